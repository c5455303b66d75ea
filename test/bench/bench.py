"""Measures everything beside its floor, and writes docs/performance.md.

Usage: ./run bench [--quick] [--check] [--rounds N]
"""
import argparse
import datetime
import json
import pathlib
import signal
import sys
import time

import goals
import lab
import measures
import others
import paths
import report

ROOT = pathlib.Path(__file__).resolve().parents[2]


def arguments():
    parser = argparse.ArgumentParser(prog="./run bench", description="Measure everything beside its floor, and write "
                                     "docs/performance.md and the drawings in it. Root measures in network namespaces, "
                                     "everybody else on loopback.")
    parser.add_argument("--quick", action="store_true",
                        help="fewer and shorter rounds, for a first look; writes nothing")
    parser.add_argument("--rounds", type=int, metavar="N", help="how often each thing is measured (5; quick: 2)")
    parser.add_argument("--check", action="store_true",
                        help="write nothing; print the goals that are missed, and fail if there are any")
    parser.add_argument("--redraw", action="store_true", help="measure nothing: write docs/performance.md from the last run that wrote it")
    parser.add_argument("--build", default=ROOT / "build/bench", metavar="DIR", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    chosen.rounds = chosen.rounds or (2 if chosen.quick else 5)
    return chosen


def measure(chosen):
    build = pathlib.Path(chosen.build)
    about = {"date": datetime.date.today().isoformat(), "rounds": chosen.rounds, **report.machine(),
             "command": "./run bench" + (" --quick" if chosen.quick else "")}
    taken = measures.Measures({"trestle": build / "bridge/trestle", "floor": build / "test/bench/trestle_floor",
                               "vsomeip": build / "test/bench/trestle_vsomeip",
                               "node": build / "test/bench/trestle_node",
                               "micro": build / "test/bench/trestle_bench",
                               "no_segmentation": build / "test/bench/libtrestle_no_segmentation.so"}, chosen.quick)
    about["place"] = taken.lab.place
    about["priority"] = taken.lab.priority
    start, before = time.monotonic(), report.processor_time()

    def say(what):
        print(f"{time.monotonic() - start:6.1f} s  {what}", file=sys.stderr, flush=True)

    taken.start_servers()
    ways = paths.Paths(taken)
    ways.start()
    vsomeip = others.Vsomeip(taken)
    vsomeip.start()
    if not vsomeip.there:
        say("without vsomeip, which is measured when CMake finds it (CMAKE_PREFIX_PATH, as docs/interop.md says)")
    taken.lab.check()
    for number in range(1, chosen.rounds + 1):
        taken.backwards = number % 2 == 0
        say(f"round {number} of {chosen.rounds}: small messages")
        taken.small()
        taken.busy()
        taken.one_core()
        taken.newcomers()
        say(f"round {number} of {chosen.rounds}: large messages")
        taken.large()
        taken.silent("silent", "a")
        say(f"round {number} of {chosen.rounds}: two bridges")
        ways.round()
        ways.looked_at()
        ways.record()
        vsomeip.round()
        say(f"round {number} of {chosen.rounds}: conversion")
        taken.conversion()
        taken.lab.check()
    ways.clouds()
    taken.lab.stop_all()  # an idle node hears nobody
    say("idle nodes")
    ways.nodes()
    taken.lab.close()
    about["seconds"] = round(time.monotonic() - start)
    about["stolen"] = report.stolen_percent(before, report.processor_time())
    say("done")
    return taken, about


def main():
    chosen = arguments()
    figures = pathlib.Path(chosen.build) / "bench.json"
    if chosen.redraw:
        last = json.loads(figures.read_text(encoding="utf-8"))
        report.write(last["values"], last["about"], ROOT / "docs")
        return 0
    try:
        taken, about = measure(chosen)
    except lab.Failed as why:
        print(f"error: {why}", file=sys.stderr)
        return 1
    rows = goals.communication(taken.values) + goals.paths(taken.values) + goals.conversion(taken.values)
    shown = rows if not chosen.check else [row for row in rows if row.is_judged and not row.met]
    for row in shown:
        print("{:<66} {:>12} {:>12} {:>6} {:>17}  {:<12} {}".format(*row.cells()).replace("*", ""))
    for fault in taken.faults:
        print("not measured: " + fault, file=sys.stderr)
    met, missed, unknown = (sum(row.is_judged and row.met is verdict for row in rows)
                            for verdict in (True, False, None))
    both = sum(row.others > 0 for row in rows)
    print(f"{met} goals met, {missed} missed, {unknown} not measured; of {both} the rounds lie on both sides of the goal")
    if chosen.check:
        return 1 if missed or unknown else 0
    if not chosen.quick:
        figures.write_text(json.dumps({"about": about, "values": taken.values}), encoding="utf-8")
        report.write(taken.values, about, ROOT / "docs")
    return 1 if unknown else 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # which closes the lab
    sys.exit(main())
