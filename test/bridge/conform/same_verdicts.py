#!/usr/bin/env python3
"""Whether `trestle conform run` gives the same verdicts again and again, also beside load. From the folder of the project:

  python3 test/bridge/conform/same_verdicts.py build/release/bridge/trestle --runs 20 --load 4

runs all cases against the reference device twenty times, beside `stress-ng --cpu 4`, and says how many runs gave the verdicts
of the first one. Ends with 0 when all did, with 1 when one did not, and with 2 when the command line is wrong or stress-ng is
not there."""
import argparse
import collections
import contextlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trestle", metavar="TRESTLE", help="the program, with ets_device beside it")
    parser.add_argument("selectors", metavar="SELECTOR", nargs="*", help="only these cases")
    parser.add_argument("--runs", metavar="N", type=int, default=20, help="so many (default: %(default)s)")
    parser.add_argument("--load", metavar="N", type=int, default=4, help="workers of stress-ng; 0: none (default: %(default)s)")
    parser.add_argument("--jobs", metavar="N", type=int, default=8, help="as that of conform (default: %(default)s)")
    parser.add_argument("--seed", metavar="N", type=int, default=1, help="as that of conform (default: %(default)s)")
    parser.add_argument("--dut", metavar="FILE", default=ROOT / "examples" / "ets_device" / "profile.yaml",
                        help="another profile than that of the reference device")
    parser.add_argument("--out", metavar="DIR", help="keep the results there, in a folder for each run")
    chosen = parser.parse_args()
    if chosen.runs < 2:
        parser.error("--runs: two or more can be compared")
    if chosen.load and not shutil.which("stress-ng"):
        parser.error("stress-ng is not installed; --load 0 runs without it")
    return chosen


@contextlib.contextmanager
def load(workers):
    """Keeps processors busy until the end."""
    if not workers:
        yield
        return
    busy = subprocess.Popen(["stress-ng", "--quiet", "--cpu", str(workers)])
    try:
        yield
    finally:
        busy.terminate()
        busy.wait()


def run(chosen, folder):
    """The verdicts by case, and which cases were tried more than once."""
    done = subprocess.run([chosen.trestle, "conform", "run", *chosen.selectors, "--dut", chosen.dut, "--jobs", str(chosen.jobs),
                           "--seed", str(chosen.seed), "--out", folder, "--quiet"], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(done.stdout + done.stderr + f"conform ended with status {done.returncode}")
    results = json.loads((folder / "results.json").read_text())
    again = [one["id"] for one in results["cases"] if one["attempts"] > 1]
    return {one["id"]: one["verdict"] for one in results["cases"]}, again


def main():
    chosen = options()
    first, same = None, 0
    with contextlib.ExitStack() as at_end:
        folder = pathlib.Path(chosen.out or at_end.enter_context(tempfile.TemporaryDirectory()))
        at_end.enter_context(load(chosen.load))
        for number in range(1, chosen.runs + 1):
            began = time.monotonic()
            verdicts, again = run(chosen, folder / f"run-{number:02}")
            first = verdicts if first is None else first
            different = sorted(one for one in {*first, *verdicts} if first.get(one) != verdicts.get(one))
            same += not different
            counts = ", ".join(f"{count} {verdict}" for verdict, count in collections.Counter(verdicts.values()).most_common())
            print(f"run {number}: {counts}; {len(again)} tried again; {time.monotonic() - began:.1f} s", flush=True)
            for one in different:
                print(f"  {one}: {verdicts.get(one, 'not run')}, in the first run {first.get(one, 'not run')}")
    print(f"{same} of {chosen.runs} runs gave the same verdicts for {len(first)} cases")
    return 0 if same == chosen.runs else 1


if __name__ == "__main__":
    sys.exit(main())
