"""docs/performance.md and its drawings, from what was measured."""
import os
import pathlib
import platform
import subprocess

import drawings
import goals
from measures import CLOUDS, LARGE_CALLS, SILENT, SIZES, median

TITLE = """# Performance

For people who choose; what each row is, and all others, stands below. "Floor" is what the system itself takes or gives for the
same bytes. "To others" has a peer that is no Trestle, or a program without any option, and nothing set on our side.

"""

HEADING = """
## How it is measured
Written by `./run bench`, which measures floors and Trestle alternately in one run. Absolute times depend on the machine; the
ratios are what counts. A *floor* is what the system itself needs for the same bytes: loops of bare system calls, memcpy,
plain Fast DDS ([test/bench](../test/bench)). "Ours" is measured by `trestle perf` ([tools.md](tools.md)), from call to answer
and from `notify()` to the handler; for the rows "over Node::call", one program calls through a `Proxy` and by `Node::call()` in
turn. `./run bench --check` fails when a goal is missed.

Each round measures a floor and ours one after the other, the next round in the opposite order. A ratio is the median of the
ratios of all rounds, and "rounds" shows the smallest and the largest of them (or of our values, where there is no ratio).
Where some rounds met a goal and others missed it, the last column says how many. A round in which a floor lost something
counts as failed. Rows that scatter more are measured twice a round (without UDP_SEGMENT, two bridges) or three times (two
bridges, up to 256 KB).

"""

REPEAT = """To repeat a row, on loopback (`10.83.7.x` in two network namespaces, `127.0.0.x` here); after `./run bench` the programs are
in `build/bench/bridge` and `build/bench/test/bench`:

```sh
trestle perf server --address 127.0.0.1 &
trestle perf client --address 127.0.0.2                                             # UDP call 64 B
trestle perf client --address 127.0.0.2 --in-flight 32                              # calls, 32 in flight
trestle perf client --address 127.0.0.2 --events --window 0                         # events 64 B
trestle perf client --address 127.0.0.2 --events --size 1MB                         # TP event, default pacing
trestle perf client --address 127.0.0.2 --events --size 1MB --window 2              # TP sustained
trestle_floor receive-silent at=127.0.0.1:30490 own=127.0.0.3 bytes=1048576 reads=200   # a silent receiver
taskset -c 1 trestle perf server 0x7e57.4 --address 127.0.0.4 &                     # all on one core
taskset -c 1 trestle perf client 0x7e57.4 --address 127.0.0.2
taskset -c 1 trestle_floor ping-udp at=127.0.0.4:30490 own=127.0.0.3                # with a bare client
trestle_node echo 127.0.0.5 &
trestle_node call 127.0.0.2 1048576                                                 # UDP echo of a program without options
trestle_node notify 127.0.0.6 &
trestle_node count 127.0.0.2                                                        # events, one `notify()` a handler
trestle_floor serve-flood at=127.0.0.1:5003 bytes=80 &
trestle_floor receive-flood at=127.0.0.1:5003 bytes=80 segmentation=0 batches=0     # and a loop of sendto
trestle record -o /dev/shm/bag --config FILE.yaml &                                 # with `dds: {domain: 84}`
trestle_floor publish-dds domain=84 bytes=4000000 rate=100 seconds=2
```

"""

FOREIGN = """The **silent receiver** is a program without any part of Trestle ([floor_silent.cpp](../test/bench/floor_silent.cpp)): it
subscribes by hand-made bytes that tell nothing of its socket, which has the buffer that Linux gives to everybody (208 KB), and
puts segments together by their offsets. The sender is `trestle perf server` without an option. What "reads 200 MB/s" works
on each segment for as long as that takes. vsomeip, where it is installed, sends to the same receiver, with four messages under
way. The **echo** and **one `notify()` a handler** are programs as [application.md](application.md) has them
([newcomer.cpp](../test/bench/newcomer.cpp)): a method without `ServiceSpec::segmented`, called through a Proxy without a
subscription by another process of the same host (to another host such a server sends no large answers, see
`unproven_answer_bytes`). On **one core** (`taskset`) server and client share a core; the bare client sends a request of hand-made
bytes to the echo of `trestle perf server`.

"""

LOOKED_AT = """Two pairs of bridges are compared for what it costs to be **looked at**, one of them with `console` (page, metrics, Foxglove) in
both bridges. CPU time is that of both bridges, user and kernel, divided by the messages that came back; the memory is that of
the larger one. Counters and histograms of a bridge cannot be switched off, and are in both. The viewer speaks Foxglove's
protocol and gets each cloud of one topic; the record, begun by the console, has all topics. Both pairs then carry the same 250
messages a second. `trestle record` has a bare publisher of Fast DDS beside it, whose samples are noise, which no compression
makes smaller.

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


def chooser(values):
    """Few rows, in the words of those who ask."""
    def shown(show, name, *path):
        number = median(values, name, *path)
        return "" if number is None else show(number)

    def p50(name):
        return shown(goals.ns, name, "latency_ns", "p50")

    def rate(name):
        return rate_text(values, name) or ""

    def per_second(name):
        return shown(goals.per_second, name, "per_second")

    def of(rows, what):
        row = next(row for row in rows if row.what == what)
        return "" if row.ours is None else row.show(row.ours), "" if row.floor is None else row.show(row.floor)

    def of_vsomeip(size):
        both = [rate(f"vsomeip rate {size}"), rate(f"vsomeip silent {size} {reader}")]
        return "; to others ".join(both) if all(both) else both[0] or both[1]

    ways, reader = goals.paths(values), "reads as fast as it can"
    rows = [["UDP call 64 B, both ends sleep in between", p50("udp call"), "", p50("vsomeip udp call"), p50("udp floor")],
            ["the same on one core", p50("core call"), p50("core bare client"), "", p50("core floor")],
            ["TCP call 64 B", p50("tcp call"), "", p50("vsomeip tcp call"), p50("tcp floor")],
            *[[f"UDP call {size}", p50(f"udp call {size}"), p50(f"echo {size}"), "",
               shown(lambda one_way: goals.ns(2 * one_way), f"transfer {size}", "latency_ns", "p50")] for size in LARGE_CALLS],
            ["calls, 32 in flight", per_second("calls 32"), "", per_second("vsomeip calls 32"), per_second("flood floor")],
            ["events 64 B, one `notify()` a handler", per_second("events a turn"), "", "", per_second("sendto floor")],
            ["events 64 B, as many as there can be", per_second("events 64 B"), "", per_second("vsomeip events 64 B"),
             per_second("flood floor")],
            *[[f"events of {size}, default pacing", rate(f"tp paced rate {size}"), rate(f"silent {size} {reader}"),
               of_vsomeip(size), rate(f"tp floor rate {size}")] for size in SILENT]]
    for size in "64 KB", "1 MB", "4 MB":
        ours, floor = of(ways, f"DDS, SOME/IP, DDS {size}, p50, default pacing")
        rows.append([f"DDS, SOME/IP, DDS, {size}, one way", ours, "", "", floor])
    rows.append(["memory of an idle node", of(ways, "idle node alone, memory (RSS)")[0], "", "", ""])
    return table(["p50, or what is received", "between two of ours", "to others", "vsomeip", "floor"], rows)


def text_of(values, about):
    text = TITLE + chooser(values) + HEADING
    text += (f"Measured {about['date']} with `{about['command']}`, {about['rounds']} rounds, medians over the rounds,\n"
             f"in {about['place']},\n{about['priority']}.\n{about['cpu']}; Linux {about['kernel']}; {about['compiler']}; "
             f"load average {about['load']} before the start.\n\n")
    if float(about["load"]) > 0.5:
        text += ("**Other work was running on the machine.** Below real-time priority that makes all times longer and the "
                 "ratios\nuncertain; with it there are still the caches and the memory that are shared.\n\n")
    if about.get("stolen", 0) > 2:
        text += (f"**The machine is a virtual one, whose host took {about['stolen']} % of the time that there was work for.** "
                 "It stands still then,\nwhich makes the ratios uncertain and the highest latencies long.\n\n")
    text += REPEAT + "## Calls and events\n" + FOREIGN + goal_table(goals.communication(values))
    text += "\n" + latency_table(values, TRANSFERS) + "\n" + rates(values)
    text += "\n![latency of calls by size](performance/calls.svg)\n"
    text += "\n![latency of events by size](performance/latency.svg)\n" + vsomeip(values)
    text += "\n## Through two bridges, and nodes alone\n" + PATHS + LOOKED_AT + goal_table(goals.paths(values))
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
