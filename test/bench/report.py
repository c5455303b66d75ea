"""docs/performance.md and its drawings, from what was measured."""
import pathlib
import platform
import subprocess

import goals
from measures import SIZES, median

HEADING = """# Performance

Written by `./run bench`, which measures floors and ours in turn in one run. Absolute times say something only about the
machine; what counts are the ratios. A floor is what the system itself does with the same bytes: loops of bare system
calls, memcpy, plain Fast DDS ([test/bench](../test/bench)). Ours is measured by `trestle perf` ([tools.md](tools.md)),
from call to answer and from `notify()` to the handler. `./run bench --check` fails when a goal is missed.

"""


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
    return {"cpu": f"{len(__import__('os').sched_getaffinity(0))} cores of {model}", "kernel": platform.release(),
            "compiler": first_line("c++", "--version"), "load": load}


def goal_table(rows):
    return table(["", "floor", "ours", "ratio", "goal", ""], [row.cells() for row in rows])


def latencies(values):
    def cell(name):
        p50, p99 = (median(values, name, "latency_ns", part) for part in ("p50", "p99"))
        return "" if p50 is None else f"{goals.ns(p50)}, {goals.ns(p99)}"

    return table(["TP events: p50, p99", *SIZES],
                 [[words, *[cell(f"{kind} latency {size}") for size in SIZES]] for kind, words in
                  (("tp floor", "floor"), ("tp", "ours, not paced"), ("tp paced", "ours, default pacing"))])


def rates(values):
    def cell(name):
        rate, lost, came = (median(values, name, key) for key in ("megabytes_per_second", "lost", "received"))
        if rate is None:
            return ""
        return f"{rate:,.0f}" + (f" ({100 * lost / (lost + came):.1f} % lost)" if lost else "")

    kinds = (("tp floor rate {}", "floor"), ("tp rate {}", "ours, not paced"),
             ("tp paced rate {}", "ours, default pacing"), ("tp floor rate {} sendmmsg", "floor, no UDP_SEGMENT"),
             ("tp rate {} sendmmsg", "ours, no UDP_SEGMENT"))
    return table(["TP events: MB/s", *SIZES],
                 [[words, *[cell(name.format(size)) for size in SIZES]] for name, words in kinds])


def write(values, about, folder):
    folder = pathlib.Path(folder)
    text = HEADING
    text += (f"Measured {about['date']} with `{about['command']}`, {about['rounds']} rounds, medians over the rounds, in "
             f"{about['place']}.\n{about['cpu']}; Linux {about['kernel']}; {about['compiler']}; "
             f"load average {about['load']} before the start.\n\n")
    if float(about["load"]) > 0.5:
        text += ("**The machine was busy with other work**, which makes all times longer and the ratios uncertain: they "
                 "are to be taken again on a quiet one.\n\n")
    text += "## Calls and events\n" + goal_table(goals.communication(values))
    text += "\n" + latencies(values) + "\n" + rates(values)
    text += "\n## Conversion\n" + goal_table(goals.conversion(values))
    (folder / "performance.md").write_text(text, encoding="utf-8")
