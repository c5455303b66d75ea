"""The drawings of docs/performance.md, by gnuplot."""
import statistics
import subprocess

from measures import CLOUDS, LARGE_CALLS, SIZES, median

CALLS = {"64 B": 64, **{name: SIZES[name] for name in LARGE_CALLS}}


def plot(path, height, settings, curves):
    """@param curves  pairs: what gnuplot is to do with columns, and the rows of these."""
    script = [f"set terminal svg size 700,{height} font 'sans,11' background '#ffffff'", f"set output '{path}'",
              "set encoding utf8", "set grid linecolor rgb '#dddddd'", *settings]
    for number, (_, rows) in enumerate(curves):
        script += [f"$curve{number} << end", *(" ".join(str(value) for value in row) for row in rows), "end"]
    script.append("plot " + ", ".join(f"$curve{number} {drawn}" for number, (drawn, _) in enumerate(curves)))
    subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)


def latency_by_size(values, path, lines, sizes=None):
    """p50 as lines, p99 as broken ones."""
    sizes = sizes or SIZES
    curves = []
    for kind, label, colour in lines:
        for part, style in ("p50", "dashtype 1 pointsize 0.5"), ("p99", "dashtype 2 pointsize 0.3"):
            rows = [(size, median(values, kind.format(name).removesuffix(" 64 B"), "latency_ns", part))  # the plain ones
                    for name, size in sizes.items()]
            if rows := [(size, ns / 1e3) for size, ns in rows if ns]:
                curves.append((f"using 1:2 with linespoints linewidth 1.5 pointtype 7 linecolor rgb '{colour}' {style} "
                               f"title '{label}, {part}'", rows))
    if curves:
        tics = ", ".join(f"'{name}' {size}" for name, size in sizes.items())
        plot(path, 400, ["set logscale xy", "set xlabel 'payload'", "set ylabel 'µs'", f"set xtics ({tics})",
                         f"set xrange [{min(sizes.values()) / 2}:{max(sizes.values()) * 2}]", "set format y '%g'",
                         "set key left top font ',9'"], curves)


def latencies(values, folder):
    latency_by_size(values, folder / "calls.svg", [("udp floor {}", "UDP, bare system calls", "#888888"),
                                                   ("tcp floor {}", "TCP, bare system calls", "#444444"),
                                                   ("udp call {}", "UDP call, default pacing", "#d62728"),
                                                   ("tcp call {}", "TCP call", "#1f77b4"),
                                                   ("vsomeip udp call {}", "vsomeip, UDP", "#2ca02c"),
                                                   ("vsomeip tcp call {}", "vsomeip, TCP", "#98df8a")], CALLS)
    latency_by_size(values, folder / "latency.svg", [("tp floor latency {}", "bare TP loop", "#888888"),
                                                     ("tp latency {}", "TP event, not paced", "#1f77b4"),
                                                     ("tp paced latency {}", "TP event, default pacing", "#d62728"),
                                                     ("vsomeip latency {}", "vsomeip", "#2ca02c")])
    latency_by_size(values, folder / "bridges.svg", [("dds asynchronous {}", "an asynchronous hop of Fast DDS", "#888888"),
                                                     ("dds synchronous {}", "a synchronous hop", "#2ca02c"),
                                                     ("dds shared synchronous {}", "the same by shared memory", "#98df8a"),
                                                     ("path shared {}", "two bridges by shared memory", "#ff7f0e"),
                                                     ("path {}", "two bridges, not paced", "#1f77b4"),
                                                     ("path paced {}", "two bridges, default pacing", "#d62728")])


def box(samples):
    """As the paper draws them: quartiles, and whiskers to the last sample within 1.5 times their distance.

    @return lower quartile, lower and upper whisker, upper quartile, median
    """
    low, middle, high = statistics.quantiles(samples, n=4, method="inclusive")
    reach = 1.5 * (high - low)
    return (low, min(one for one in samples if one >= low - reach), max(one for one in samples if one <= high + reach),
            high, middle)


def checkpoints(values, folder):
    drawings = (("conversion", "µs, both conversions", lambda one: one["conversion_ns"] / 1e3),
                ("share", "% of ① to ④ that is conversion",
                 lambda one: 100 * one["conversion_ns"] / one["communication_ns"]))
    for name, label, of in drawings:
        boxes = [(place, *box([of(one) for one in found]), points) for place, (points, size) in enumerate(CLOUDS.items())
                 if len(found := values.get(f"checkpoints {size}", [])) > 1]
        if boxes:
            plot(folder / f"{name}.svg", 300,
                 ["set xlabel 'points of 24 bytes'", f"set ylabel '{label}'", "set yrange [0:*]", "set boxwidth 0.4",
                  f"set xrange [-0.5:{len(CLOUDS) - 0.5}]"],
                 [("using 1:2:3:4:5:xticlabels(7) with candlesticks linecolor rgb '#222222' notitle whiskerbars 0.5", boxes),
                  ("using 1:6:6:6:6 with candlesticks linecolor rgb '#d62728' linewidth 1.5 notitle", boxes)])


def draw(values, folder):
    folder.mkdir(exist_ok=True)
    latencies(values, folder)
    checkpoints(values, folder)
