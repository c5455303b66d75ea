#!/usr/bin/env python3
"""run_stacks.py TRESTLE OUT [STACK ...] [-- ARGUMENT OF CONFORM ...]: `trestle conform run` for devices of other stacks, one
after the other, with results in OUT/STACK. Under in_namespaces, from the folder of the project:

  build/release/test/interop/in_namespaces python3 test/interop/conform/run_stacks.py build/release/bridge/trestle OUT

The stacks are those of build/peers (`./run setup --peers`; opensomeip only after `build/peers/bin/pip install
opensomeip==0.2.0`), with TRESTLE_VSOMEIP_DEVICE=FILE that of vsomeip_device.cpp, and with TRESTLE_FIRMWARE=FILE that of
examples/cortex_m with the Enhanced Testability Service, in QEMU at a tap device. Ends with 1 when the runner itself failed
(verdict error, or no results), with 77 when none of the stacks is there (with TRESTLE_REQUIRE_PEERS=1 with 1), and with 2 for a
stack that it does not know; deviations of the stacks are in docs/stacks.md."""
import json
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
STACKS = {"pysomeip": "someip", "someipy": "someipy", "someipy_events": "someipy", "opensomeip": "opensomeip",
          "scapy": "scapy"}
VSOMEIP = "vsomeip"
BOARD = "cortex_m"
BOARD_PROFILE = HERE.parents[2] / "examples" / "cortex_m" / "profile.yaml"
FIRMWARE = os.environ.get("TRESTLE_FIRMWARE")
VSOMEIP_DEVICE = os.environ.get("TRESTLE_VSOMEIP_DEVICE")

arguments, rest = sys.argv[1:], []
if "--" in arguments:
    rest = arguments[arguments.index("--") + 1:]
    arguments = arguments[:arguments.index("--")]
if len(arguments) < 2:
    print(__doc__, file=sys.stderr)
    sys.exit(2)
trestle, out, *chosen = arguments
os.environ.setdefault("TRESTLE_PEERS", os.path.abspath("build/peers"))
python = os.environ["TRESTLE_PEERS"] + "/bin/python"


def missing(stack):
    """Why a stack cannot be run; None: it can."""
    if stack == VSOMEIP:
        return None if VSOMEIP_DEVICE else "TRESTLE_VSOMEIP_DEVICE does not name vsomeip_device"
    if stack == BOARD:
        return None if FIRMWARE else "TRESTLE_FIRMWARE does not name the firmware"
    try:
        there = subprocess.run([python, "-c", f"import {STACKS[stack]}"], stderr=subprocess.DEVNULL).returncode == 0
    except OSError:
        there = False
    return None if there else f"{STACKS[stack]} is not in {os.environ['TRESTLE_PEERS']}"


def errors(folder):
    """How many cases have the verdict error; without results the runner itself has failed."""
    try:
        with open(os.path.join(folder, "results.json")) as file:
            return json.load(file)["verdicts"]["error"]
    except FileNotFoundError:
        print(f"no results in {folder}")
        return 1


def switch_on(folder):
    """Connects the board to this namespace, unless a tap device is there. Its profile can only switch it off and on again."""
    if subprocess.run(["ip", "link", "show", "tap0"], capture_output=True).returncode != 0:
        for command in ("tuntap add tap0 mode tap", "link set tap0 up", "addr add 10.78.0.1/24 dev tap0",
                        "route replace 224.0.0.0/4 dev tap0"):
            subprocess.run(["ip", *command.split()], check=True)
    os.environ["TRESTLE_BOARD"] = os.path.join(folder, "qemu.pid")
    subprocess.run(["sh", "-c", "qemu-system-arm $TRESTLE_QEMU"], check=True)


os.environ["TRESTLE_QEMU"] = ("-M mps2-an385 -display none -semihosting-config enable=on,target=native -daemonize "
                              "-nic tap,ifname=tap0,script=no,downscript=no,model=lan9118 "
                              f"-kernel {FIRMWARE} -pidfile {os.path.abspath(out)}/{BOARD}/qemu.pid")
if unknown := [one for one in chosen if one not in (*STACKS, VSOMEIP, BOARD)]:
    print(f"no such stack: {', '.join(unknown)}; there are {', '.join((*STACKS, VSOMEIP, BOARD))}", file=sys.stderr)
    sys.exit(2)
status = 0
ran = False
for stack in chosen or [*STACKS, *([VSOMEIP] if VSOMEIP_DEVICE else []), *([BOARD] if FIRMWARE else [])]:
    if why := missing(stack):
        print(f"skipped: {why}")
        continue
    ran = True
    if stack == BOARD:
        os.makedirs(os.path.join(out, BOARD), exist_ok=True)
        switch_on(os.path.abspath(os.path.join(out, BOARD)))
    folder = os.path.join(out, stack)
    print(f"=== {stack}", flush=True)
    profile = BOARD_PROFILE if stack == BOARD else HERE / f"{stack}.yaml"
    try:
        pathlib.Path(folder, "results.json").unlink(missing_ok=True)
        subprocess.run([trestle, "conform", "run", "--dut", str(profile), "--out", folder, *rest])
        status = 1 if errors(folder) else status
    finally:
        if stack == BOARD:
            subprocess.run(["sh", "-c", "kill $(cat $TRESTLE_BOARD)"])
if not ran:
    status = 1 if {"1", "conform"} & set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) else 77
sys.exit(status)
