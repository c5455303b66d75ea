#!/usr/bin/python3 -B
"""Faults at run time beside honest traffic, and what holds afterwards. docs/faults.md tells more."""
import argparse
import os
import pathlib
import subprocess
import sys

import fault_world as worlds  # finds the modules of test/hostile, too
import clocks, links, losses, processes, reboots, resources, system_calls  # pylint: disable=unused-import,multiple-imports
import lab
import scenario

SKIPPED = 77
TRIES = 3  # of the short form: a machine that is busy may lose what UDP carries


def arguments():
    parser = argparse.ArgumentParser(prog="./run test faults", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenarios, or parts of their names; none: all")
    # The programs trestle and hostile_flow and the library faulty_calls, which ./run has built.
    for built in "trestle", "flow", "library":
        parser.add_argument(f"--{built}", help=argparse.SUPPRESS, required="--list" not in sys.argv)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("build/faults"), help="folder for logs and tables")
    parser.add_argument("--short", action="store_true", help="a few seconds each, and judges nothing that takes time")
    parser.add_argument("--sanitized", action="store_true", help="memory is not judged: a sanitizer takes some of its own")
    parser.add_argument("--list", action="store_true", help="says what there is")
    return parser.parse_args()


def chosen(names):
    known = list(scenario.ALL.values())
    if not names:
        return known
    exact = [name for name in names if name in scenario.ALL]
    found = [one for one in known if one.name in exact or any(name in one.name for name in names if name not in exact)]
    if not found:
        sys.exit(f"there is no scenario {' '.join(names)}; --list says which there are")
    return found


def run(one, options, scale, progress):
    """The figures of a scenario, and why it failed."""
    place = lab.Lab(one.name, options.out)
    figures, failed = [], ""
    try:
        world = worlds.FaultWorld(place, (options.trestle, options.flow, options.library), scale, progress)
        figures = world.figures
        one.run(world)
        world.read_counters()
        if options.sanitized:
            figures[:] = [figure for figure in figures if not figure.what.startswith("memory")]
    except (lab.Failed, OSError, subprocess.SubprocessError) as error:
        failed = str(error) or type(error).__name__
    finally:
        place.close()
    return figures, failed


def table(results, short):
    rows = [("fault", "figure", "before", "after", "goal", "")]
    for one, figures, failed in results:
        if failed:
            rows.append((one.name, failed.splitlines()[0], "", "", "", "FAILED"))
        rows += [(one.name, figure.what, figure.text(figure.alone), figure.text(figure.value), figure.goal, figure.verdict(short))
                 for figure in figures]
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines, last = [], ""
    for row in rows:
        cells = (row[0] if row[0] != last else "", *row[1:])
        lines.append("  ".join(cell.rjust(width) if i in (2, 3) else cell.ljust(width)
                               for i, (cell, width) in enumerate(zip(cells, widths))).rstrip())
        last = row[0]
    return "\n".join(lines)


NETWORK = {"all is found after": "all is found after", "frames of events that were lost": "frames lost",
           "messages that came whole": "messages that came whole", "came whole, and did not arrive": "of them did not arrive",
           "messages of which something was lost": "of which something was lost",
           "arrived, though something was lost": "of them arrived", "reboots that were none": "reboots that were none",
           "memory afterwards": "memory: before, after"}


def markdown(results):
    """Two tables for docs/faults.md, with a line a fault: of the bad network, and of all others."""
    lines = ["| fault | what happens | flows again after, at most | kept from then on, at least | memory: before, after | also |",
             "| --- | --- | ---: | ---: | ---: | --- |"]
    network = ["| fault | what happens | " + " | ".join(NETWORK.values()) + " |", "| --- | --- |" + " ---: |" * len(NETWORK)]
    for one, figures, failed in results:
        def told(what, cell=lambda figure: figure.text(figure.value), figures=figures):
            return ", ".join(cell(figure) for figure in figures if figure.what.startswith(what))
        again = told("flows again", lambda figure: f"{figure.text(figure.value)} ({figure.what.split('(')[1]}")
        memory = told("memory afterwards", lambda figure: f"{figure.text(figure.alone)}, {figure.text(figure.value)}")
        bad = [figure.what for figure in figures if figure.goal and not figure.met] + ([failed.splitlines()[0]] if failed else [])
        bad = ["**missed: " + ", ".join(bad) + "**"] if bad else []
        if told("messages that came whole"):
            cells = [memory if what == "memory afterwards" else told(what) for what in NETWORK]
            network.append(f"| `{one.name}` | {'; '.join([one.what, *bad])} | {' | '.join(cells)} |")
            continue
        known = ("flows again", "kept from then on", "memory afterwards", "log", "the bridge goes on", "descriptors afterwards",
                 "doubled or made up")
        also = [f"{figure.what}: {figure.text(figure.value)}" for figure in figures if not figure.what.startswith(known)] + bad
        lines.append(f"| `{one.name}` | {one.what} | {again} | {told('kept from then on')} | {memory} | {'; '.join(also)} |")
    return "\n".join([*network, "", *lines])


def missed(result, short):
    _, figures, failed = result
    return bool(failed) or any(figure.verdict(short) == "MISSED" for figure in figures)


def progress_of(name, number, count):
    live, last = sys.stderr.isatty(), [""]

    def progress(text):
        if live:
            print(f"\r\x1b[K[{number}/{count}] {name}: {text}", end="", file=sys.stderr, flush=True)
        elif text.split(",")[0] != last[0].split(",")[0]:
            print(f"[{number}/{count}] {name}: {text}", file=sys.stderr, flush=True)
        last[0] = text
    return progress


def main():
    options = arguments()
    if options.list:
        for one in chosen([]):
            print(f"{one.name:28} {one.what}")
        return 0
    outcome = lab.enter()
    if isinstance(outcome, int):
        return outcome
    if outcome:
        required = os.environ.get("TRESTLE_REQUIRE_PEERS", "0") not in ("", "0")
        print(f"{'failed' if required else 'skipped'}: {outcome}")
        return 1 if required else SKIPPED
    lab.mount()
    options.out = options.out.resolve()
    options.out.mkdir(parents=True, exist_ok=True)
    for built in "trestle", "flow", "library":
        setattr(options, built, str(pathlib.Path(getattr(options, built)).resolve()))
    scale = worlds.SHORT if options.short else worlds.FULL
    results = []
    which = chosen(options.names)
    for number, one in enumerate(which, 1):
        for attempt in range(TRIES if options.short else 1):
            result = (one, *run(one, options, scale, progress_of(one.name, number, len(which))))
            if not missed(result, options.short):
                break
            if options.short:
                print(f"attempt {attempt + 1}:\n" + table([result], True), file=sys.stderr)
        results.append(result)
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr)
    text = table(results, options.short)
    print(text)
    (options.out / "table.txt").write_text(text + "\n", encoding="utf-8")
    (options.out / "table.md").write_text(markdown(results) + "\n", encoding="utf-8")
    bad = [result[0].name for result in results if missed(result, options.short)]
    if bad:
        print(f"{len(bad)} of {len(results)} faults miss a goal: {' '.join(bad)}\nLogs are in {options.out}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
