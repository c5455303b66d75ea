#!/usr/bin/env python3
"""run_stacks.py TRESTLE OUT [STACK ...] [-- ARGUMENT OF CONFORM ...]: `trestle conform run` for devices of other stacks, one
after the other, with results in OUT/STACK. Under in_namespaces, from the folder of the project:

  build/release/test/interop/in_namespaces python3 test/interop/conform/run_stacks.py build/release/bridge/trestle OUT

The stacks are those of build/peers (`./run setup --peers`; opensomeip only after `build/peers/bin/pip install
opensomeip==0.2.0`). Ends with 1 when the runner itself failed (verdict error); deviations of the stacks are in
docs/stacks.md."""
import json
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
STACKS = {"pysomeip": "someip", "someipy": "someipy", "someipy_events": "someipy", "opensomeip": "opensomeip",
          "scapy": "scapy"}

arguments, rest = sys.argv[1:], []
if "--" in arguments:
    rest = arguments[arguments.index("--") + 1:]
    arguments = arguments[:arguments.index("--")]
trestle, out, *chosen = arguments
os.environ.setdefault("TRESTLE_PEERS", os.path.abspath("build/peers"))
python = os.environ["TRESTLE_PEERS"] + "/bin/python"
status = 0
for stack in chosen or STACKS:
    if subprocess.run([python, "-c", f"import {STACKS[stack]}"], stderr=subprocess.DEVNULL).returncode != 0:
        print(f"skipped: {STACKS[stack]} is not in {os.environ['TRESTLE_PEERS']}")
        continue
    folder = os.path.join(out, stack)
    print(f"=== {stack}", flush=True)
    subprocess.run([trestle, "conform", "run", "--dut", str(HERE / f"{stack}.yaml"), "--out", folder, *rest])
    with open(os.path.join(folder, "results.json")) as file:
        if json.load(file)["verdicts"]["error"]:
            status = 1
sys.exit(status)
