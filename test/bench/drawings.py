"""The drawings of docs/performance.md."""
import statistics

import matplotlib

matplotlib.use("svg")
matplotlib.rcParams.update({"svg.hashsalt": "trestle", "svg.fonttype": "none", "font.size": 9, "axes.grid": True,
                            "grid.color": "#ddd", "axes.axisbelow": True})
from matplotlib import pyplot  # noqa: E402  the backend is chosen first

from measures import CLOUDS, SIZES, median  # noqa: E402


def save(figure, folder, name):
    figure.tight_layout()
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None, "Creator": None})
    pyplot.close(figure)


def latency_by_size(values, folder, lines):
    """p50 as lines, p99 as broken ones."""
    figure, axes = pyplot.subplots(figsize=(7, 4))
    for kind, label, colour in lines:
        for part, style in ("p50", "-o"), ("p99", "--."):
            points = [(size, median(values, kind.format(name), "latency_ns", part)) for name, size in SIZES.items()]
            points = [(size, ns / 1e3) for size, ns in points if ns]
            if points:
                axes.plot(*zip(*points), style, color=colour, label=f"{label}, {part}", linewidth=1.2, markersize=4)
    axes.set(xscale="log", yscale="log", xlabel="payload", ylabel="µs")
    axes.set_xticks(list(SIZES.values()), list(SIZES))
    axes.minorticks_off()
    axes.legend(fontsize=7)
    return figure


def latencies(values, folder):
    save(latency_by_size(values, folder, [("tp floor latency {}", "bare TP loop", "#888"),
                                          ("tp latency {}", "TP event, not paced", "#1f77b4"),
                                          ("tp paced latency {}", "TP event, default pacing", "#d62728"),
                                          ("vsomeip latency {}", "vsomeip", "#2ca02c")]), folder, "latency")
    save(latency_by_size(values, folder, [("dds floor {}", "a hop of Fast DDS", "#888"),
                                          ("path {}", "two bridges, not paced", "#1f77b4"),
                                          ("path paced {}", "two bridges, default pacing", "#d62728")]),
         folder, "bridges")


def box(samples):
    """As the paper draws them: quartiles, and whiskers to the last sample within 1.5 times their distance."""
    low, middle, high = statistics.quantiles(samples, n=4, method="inclusive")
    reach = 1.5 * (high - low)
    return {"q1": low, "med": middle, "q3": high, "fliers": [],
            "whislo": min(one for one in samples if one >= low - reach),
            "whishi": max(one for one in samples if one <= high + reach)}


def checkpoints(values, folder):
    drawings = (("conversion", "µs, both conversions", lambda one: one["conversion_ns"] / 1e3),
                ("share", "% of ① to ④ that is conversion",
                 lambda one: 100 * one["conversion_ns"] / one["communication_ns"]))
    for name, label, of in drawings:
        boxes = [{**box([of(one) for one in found]), "label": points} for points, size in CLOUDS.items()
                 if len(found := values.get(f"checkpoints {size}", [])) > 1]
        if boxes:
            figure, axes = pyplot.subplots(figsize=(7, 3))
            axes.bxp(boxes, showfliers=False)
            axes.set(xlabel="points of 24 bytes", ylabel=label, ylim=(0, None))
            save(figure, folder, name)


def draw(values, folder):
    folder.mkdir(exist_ok=True)
    latencies(values, folder)
    checkpoints(values, folder)
