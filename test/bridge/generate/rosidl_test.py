#!/usr/bin/env python3
"""ROS 2's own tools take the packages that `--to msg` writes. Usage: rosidl_test.py PYTHON TRESTLE SOURCE_FOLDER

PYTHON is that of the environment with ROS 2's packages (`./run setup --peers`). Each .msg and .srv file goes through
rosidl_adapter (which makes an .idl file of it) and rosidl_parser (which reads that). Without them it is skipped (77); with
TRESTLE_REQUIRE_PEERS=1 that is a failure.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

JUDGE = r"""
import pathlib, sys
from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_adapter.srv import convert_srv_to_idl
from rosidl_parser.definition import IdlLocator
from rosidl_parser.parser import parse_idl_file
root = pathlib.Path(sys.argv[1])
count = 0
for package in sorted(path.parent for path in root.glob("*/package.xml")):
    for kind, convert in (("msg", convert_msg_to_idl), ("srv", convert_srv_to_idl)):
        for file in sorted(package.glob(f"{kind}/*.{kind}")):
            out = package / "idl" / kind
            convert(package, package.name, file.relative_to(package), out)
            parse_idl_file(IdlLocator(package / "idl", pathlib.Path(kind) / (file.stem + ".idl")))
            count += 1
print(count)
"""
# Sources, and how many files there are at least.
CASES = [(["examples/door"], 5), (["test/bridge/generate/types"], 0)]


def run(*command):
    return subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          timeout=300)


def corpora(source):
    named = [os.environ.get("TRESTLE_CORPORA", ""), source / "../shared/corpora", source / "../../shared/corpora"]
    return next((pathlib.Path(path) for path in named if path and (pathlib.Path(path) / "files").is_dir()), None)


def main():
    python, program, source = pathlib.Path(sys.argv[1]), sys.argv[2], pathlib.Path(sys.argv[3])
    if not python.exists() or run(python, "-c", "import rosidl_adapter.msg, rosidl_parser.parser").returncode != 0:
        required = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) & {"1", "ros"}
        print(f"{'missing' if required else 'skipped'}: rosidl_adapter and rosidl_parser; ./run setup --peers installs them")
        return 1 if required else 77
    cases = [([source / one for one in sources], least) for sources, least in CASES]
    if folder := corpora(source):
        cases += [([file], 0) for file in sorted((folder / "files").rglob("*.fidl"))[:60]]
        cases += [([file], 0) for file in sorted((folder / "files").rglob("*.arxml"))[:20]]
    faults, judged = [], 0
    for sources, least in cases:
        with tempfile.TemporaryDirectory() as folder:
            made = run(program, "generate", *sources, "--to", "msg", "-o", folder, "-q")
            if made.returncode != 0:
                if least:
                    faults.append(f"{sources}: {made.stderr}")
                continue
            done = run(python, "-c", JUDGE, folder)
            if done.returncode != 0:
                faults.append(f"{sources}: {done.stderr[-600:]}")
            elif int(done.stdout.split()[-1]) < least:
                faults.append(f"{sources}: {done.stdout.split()[-1]} files only")
            judged += int(done.stdout.split()[-1]) if done.returncode == 0 else 0
    print(f"{judged} files are read by rosidl")
    print("\n".join(faults))
    return 1 if faults or judged < 10 else 0


if __name__ == "__main__":
    sys.exit(main())
