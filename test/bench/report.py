"""docs/performance.md and its drawings, from what was measured."""
import os
import pathlib
import platform
import subprocess

import drawings
import goals
from measures import CLOUDS, SIZES, median

HEADING = """# Performance

Written by `./run bench`, which measures floors and Trestle alternately in one run. Absolute times depend on the machine; the
ratios are what counts. A *floor* is what the system itself needs for the same bytes: loops of bare system calls, memcpy,
plain Fast DDS ([test/bench](../test/bench)). "Ours" is measured by `trestle perf` ([tools.md](tools.md)), from call to answer
and from `notify()` to the handler. `./run bench --check` fails when a goal is missed.

Each round measures a floor and ours one after the other, the next round in the opposite order. A ratio is the median of the
ratios of all rounds, and "rounds" shows the smallest and the largest of them (or of our values, where there is no ratio).
Where some rounds met a goal and others missed it, the last column says how many. A round in which a floor lost something
counts as failed. Rows that scatter more are measured twice a round (without UDP_SEGMENT, two bridges) or three times (two
bridges, up to 256 KB).

"""

PATHS = """`trestle perf bridge` runs in one network namespace, its other end in the other one, and a bridge beside each: DDS, bridge,
SOME/IP, bridge, DDS. The messages are PointCloud2 with this many bytes of points. The floor is two hops of plain Fast DDS,
whose samples stay where DDS puts them, and one bare TP transfer, all measured alongside. A hop is asynchronous when a thread
of Fast DDS sends the sample, and synchronous when the writing thread sends it, which then waits for so long. For each size the
floor uses the way that is quicker in the median of the rounds. Our writers are synchronous for samples of up to 300 KB; larger
ones are copied and sent by a thread of the writer. For DDS, a latency is half of the round trip, and the other end replies on
the thread that received. Everything goes by UDP on loopback unless the row says otherwise: by default a bridge uses no shared
memory, because Fast DDS recovers badly from the end of a process that used it ([dds.md](dds.md)); the goal is for that
default. "The same by shared memory" has `shared_memory: true` in both ends and both bridges, and is compared with hops that
use it, too. The rows "the bridges by UDP, hops by shared memory" compare bridges without it with hops that use it. The bridges
report no single messages there; those of the checkpoints below do, which takes time. The idle node, without DDS, offers a
service over UDP and TCP, either alone or subscribed to the service of another node; wake-ups caused by datagrams of discovery
are not counted. The start is measured from `main()` to the first event of a service that was there before, without initial
delay.

"""
CLOUDS_TEXT = """The checkpoints are those of a published bridge: just before and after the conversion from DDS to SOME/IP (①, ②) and back
(③, ④), for its seven sizes of clouds. Between ② and ③ lies the transport.

"""
VSOMEIP = """vsomeip in the same rounds, between two processes. Each is its own routing manager, with no debounce time and no separation of
segments ([vsomeip_perf.cpp](../test/bench/vsomeip_perf.cpp)). Of its events of 64 bytes, 256 are under way at a time, of ours
as many as possible; of large events, as many of each as hold 2 MB. A vsomeip client that does not find the service is
restarted, up to four times a round:

"""
CONVERSION = """Conversion and memcpy alternate on the same memory, with default wire rules: big-endian payloads, little-endian CDR. "By
reference" does not touch the array of the payload; "copied" includes the one copy that memcpy makes. "Alone" alternates with
that memcpy, after which large clouds find little in the caches; "in a running bridge" is measured between the checkpoints
above. The placement in memory matters to memcpy and to us, so each figure is the mean of eight placements of the input.

"""

TRANSFERS = (("tp floor latency {}", "bare TP loop"), ("tp latency {}", "TP events, not paced"),
             ("tp paced latency {}", "TP events, default pacing"))
HOPS = (("dds asynchronous {}", "a hop of Fast DDS, asynchronous"), ("dds synchronous {}", "a hop of Fast DDS, synchronous"),
        ("dds shared asynchronous {}", "a hop of Fast DDS, asynchronous, by its shared memory"),
        ("dds shared synchronous {}", "a hop of Fast DDS, synchronous, by its shared memory"),
        ("path {}", "two bridges, not paced"), ("path paced {}", "two bridges, default pacing"),
        ("path shared {}", "two bridges that use shared memory, default pacing"))


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "| " + " | ".join(["---"] + ["---:"] * (len(header) - 1)) + " |"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def first_line(*command):
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[0].strip()
    except (OSError, subprocess.CalledProcessError, IndexError):
        return "unknown"


def machine():
    model = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo", encoding="utf-8")
                  if line.startswith("model name")), platform.machine())
    load = open("/proc/loadavg", encoding="utf-8").read().split()[0]
    return {"cpu": f"{len(os.sched_getaffinity(0))} cores of {model}", "kernel": platform.release(),
            "compiler": first_line("c++", "--version"), "load": load}


def processor_time():
    """Since the machine was started, in ticks: worked, and stolen by its host while there was work to do."""
    with open("/proc/stat", encoding="ascii") as file:
        user, nice, system, _, _, interrupts, soft_interrupts, stolen = map(int, file.readline().split()[1:9])
    return user + nice + system + interrupts + soft_interrupts, stolen


def stolen_percent(before, after):
    worked, stolen = (late - early for early, late in zip(before, after))
    return round(100 * stolen / max(worked + stolen, 1))


def goal_table(rows):
    return table(["", "floor", "ours", "ratio", "rounds", "goal", ""], [row.cells() for row in rows])


def latency_table(values, kinds):
    def cell(name):
        p50, p99 = (median(values, name, "latency_ns", part) for part in ("p50", "p99"))
        return "" if p50 is None else f"{goals.ns(p50)}, {goals.ns(p99)}"

    return table(["p50, p99", *SIZES],
                 [[words, *[cell(kind.format(size)) for size in SIZES]] for kind, words in kinds])


def rate_text(values, name):
    """Megabytes per second and what was lost; nothing when it was not measured."""
    rate, lost, came = (median(values, name, key) for key in ("megabytes_per_second", "lost", "received"))
    if rate is None:
        return None
    return f"{rate:,.0f} MB/s" + (f" ({100 * lost / (lost + came):.1f} % lost)" if lost else "")


def rates(values):
    def cell(name):
        return rate_text(values, name) or ""

    kinds = (("tp floor rate {}", "floor"), ("tp rate {}", "ours, not paced"),
             ("tp paced rate {}", "ours, default pacing"), ("tp floor rate {} sendmmsg", "floor, no UDP_SEGMENT"),
             ("tp rate {} sendmmsg", "ours, no UDP_SEGMENT"))
    return table(["TP events", *SIZES],
                 [[words, *[cell(name.format(size)) for size in SIZES]] for name, words in kinds])


def of_rounds(values, name):
    """Of how many rounds a median is, if not of all."""
    found = values[name]
    came = sum(one is not None for one in found)
    return "" if came == len(found) else f" ({came} of {len(found)} rounds)"


def vsomeip(values):
    """Nothing when it was not there."""
    def row(what, show, name, ours, *path):
        if name not in values:
            return None
        theirs, mine = median(values, name, *path), median(values, ours, *path)
        return [what, (show(theirs) if theirs else "not measured") + of_rounds(values, name), show(mine) if mine else ""]

    def rate_row(size):
        name = f"vsomeip rate {size}"
        if name not in values:
            return None
        theirs, mine = rate_text(values, name) or "not measured", rate_text(values, f"tp rate {size}") or ""
        return [f"TP sustained {size}, not paced", theirs + of_rounds(values, name), mine]

    rows = [row("UDP call 64 B, p50", goals.ns, "vsomeip udp call", "udp call", "latency_ns", "p50"),
            row("TCP call 64 B, p50", goals.ns, "vsomeip tcp call", "tcp call", "latency_ns", "p50"),
            row("calls, 32 in flight", goals.per_second, "vsomeip calls 32", "calls 32", "per_second"),
            row("events 64 B, received", goals.per_second, "vsomeip events 64 B", "events 64 B", "per_second")]
    rows += [row(f"TP event {size}, p50, not paced", goals.ns, f"vsomeip latency {size}", f"tp latency {size}",
                 "latency_ns", "p50") for size in SIZES]
    rows += [rate_row(size) for size in SIZES]
    rows = [found for found in rows if found]
    return "\n" + VSOMEIP + table(["", "vsomeip", "ours"], rows) if rows else ""


def clouds(values):
    rows = []
    for points, size in CLOUDS.items():
        found = values.get(f"checkpoints {size}", [])
        conversion, communication = (median(values, f"checkpoints {size}", key)
                                     for key in ("conversion_ns", "communication_ns"))
        if found:
            each = [", ".join(goals.ns(goals.percentile([one[way] for one in found], part)) for part in (50, 99))
                    for way in ("to_someip_ns", "to_cdr_ns")]
            rows.append([points, str(len(found)), *each, goals.ns(conversion), goals.ns(communication),
                         f"{100 * conversion / communication:.2f} %"])
    return table(["points", "clouds", "to SOME/IP: p50, p99", "to CDR: p50, p99", "both, median", "① to ④, median",
                  "share"], rows)


def text_of(values, about):
    text = HEADING
    text += (f"Measured {about['date']} with `{about['command']}`, {about['rounds']} rounds, medians over the rounds,\n"
             f"in {about['place']},\n{about['priority']}.\n{about['cpu']}; Linux {about['kernel']}; {about['compiler']}; "
             f"load average {about['load']} before the start.\n\n")
    if float(about["load"]) > 0.5:
        text += ("**Other work was running on the machine.** Below real-time priority that makes all times longer and the "
                 "ratios\nuncertain; with it there are still the caches and the memory that are shared.\n\n")
    if about.get("stolen", 0) > 2:
        text += (f"**The machine is a virtual one, whose host took {about['stolen']} % of the time that there was work for.** "
                 "It stands still then,\nwhich makes the ratios uncertain and the highest latencies long.\n\n")
    text += "## Calls and events\n" + goal_table(goals.communication(values))
    text += "\n" + latency_table(values, TRANSFERS) + "\n" + rates(values)
    text += "\n![latency of calls by size](performance/calls.svg)\n"
    text += "\n![latency of events by size](performance/latency.svg)\n" + vsomeip(values)
    text += "\n## Through two bridges, and nodes alone\n" + PATHS + goal_table(goals.paths(values))
    text += "\n" + latency_table(values, HOPS) + "\n![latency by size](performance/bridges.svg)\n"
    text += "\n" + CLOUDS_TEXT + clouds(values)
    text += "\n![conversion time](performance/conversion.svg)\n\n![share of conversion](performance/share.svg)\n"
    text += "\n## Conversion\n" + CONVERSION + goal_table(goals.conversion(values))
    text += "\n" + (pathlib.Path(__file__).parent / "notes.md").read_text(encoding="utf-8")
    return text


def write(values, about, folder):
    folder = pathlib.Path(folder)
    (folder / "performance.md").write_text(text_of(values, about), encoding="utf-8")
    drawings.draw(values, folder / "performance")
