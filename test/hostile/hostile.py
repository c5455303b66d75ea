#!/usr/bin/python3 -B
"""Attacks beside honest traffic, and what becomes of that. docs/hostile.md tells more."""
import argparse
import os
import pathlib
import subprocess
import sys
import time

import attacks  # pylint: disable=unused-import
import figures
import lab
import scenario
import world as worlds

SKIPPED = 77
TRIES = 3  # of the short form: a machine that is busy may lose what UDP carries


def arguments():
    parser = argparse.ArgumentParser(prog="./run test hostile", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenarios, or parts of their names; none: all")
    # The programs trestle and hostile_flow, which ./run has built.
    parser.add_argument("--trestle", help=argparse.SUPPRESS, required="--list" not in sys.argv)
    parser.add_argument("--flow", help=argparse.SUPPRESS, required="--list" not in sys.argv)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("build/hostile"), help="folder for logs and tables")
    parser.add_argument("--short", action="store_true", help="a few seconds each, and judges nothing that takes time")
    parser.add_argument("--sanitized", action="store_true", help="memory is not judged: a sanitizer takes some of its own")
    parser.add_argument("--list", action="store_true", help="says what there is")
    return parser.parse_args()


def chosen(names):
    known = sorted(scenario.ALL.values(), key=lambda one: one.point)
    if not names:
        return known
    found = [one for one in known if one.name in names] or [one for one in known if any(name in one.name for name in names)]
    if not found:
        sys.exit(f"there is no scenario {' '.join(names)}; --list says which there are")
    return found


def progress_of(name, number, count):
    live = sys.stderr.isatty()
    last = [""]

    def progress(text):
        if live:
            print(f"\r\x1b[K[{number}/{count}] {name}: {text}", end="", file=sys.stderr, flush=True)
        elif text.split(",")[0] != last[0].split(",")[0]:
            print(f"[{number}/{count}] {name}: {text}", file=sys.stderr, flush=True)
        last[0] = text
    return progress


def run(one, options, scale, progress):
    result = {"name": one.name, "point": one.point, "what": one.what, "failed": "", "figures": [], "counters": {}}
    place = lab.Lab(one.name, options.out)
    try:
        world = worlds.World(place, (options.trestle, options.flow), scale, progress)
        result["figures"] = world.figures
        result["counters"] = world.counters
        progress("begins")
        one.run(world)
        world.read_counters()
        if options.sanitized:
            world.figures[:] = [figure for figure in world.figures if not figure.what.startswith("memory")]
    except (lab.Failed, OSError, subprocess.SubprocessError) as error:
        result["failed"] = str(error)
    finally:
        place.close()
    return result


def main():
    options = arguments()
    if options.list:
        for one in chosen([]):
            print(f"{one.name:24} point {one.point:2}  {one.what}")
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
    options.trestle, options.flow = (str(pathlib.Path(path).resolve()) for path in (options.trestle, options.flow))
    scale = worlds.SHORT if options.short else worlds.FULL
    results = []
    which = chosen(options.names)
    for number, one in enumerate(which, 1):
        for attempt in range(TRIES if options.short else 1):
            result = run(one, options, scale, progress_of(one.name, number, len(which)))
            if not figures.missed([result], options.short):
                break
            if options.short:
                print(f"attempt {attempt + 1}:\n" + figures.table([result], True), file=sys.stderr)
        results.append(result)
    if sys.stderr.isatty():
        print("\r\x1b[K", end="", file=sys.stderr)
    text = figures.table(results, options.short)
    print(text)
    (options.out / "table.txt").write_text(text + "\n", encoding="utf-8")
    (options.out / "table.md").write_text(figures.markdown(results) + "\n", encoding="utf-8")
    figures.write_json(options.out / "table.json", results, options.short)
    missed = figures.missed(results, options.short)
    if missed:
        print(f"{len(missed)} of {len(results)} scenarios miss a goal: {' '.join(missed)}\nLogs are in {options.out}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
