#!/usr/bin/env python3
"""The table "inputs and lines" of docs/describe.md.

inputs_table.py TRESTLE           prints it
inputs_table.py TRESTLE --check   is it what the document has? Also: with 14 inputs all of them are in the files, and running
                                  again changes nothing

What the table counts as inputs is all that a command gets, but for `--to fidl -o FOLDER`; no package of ROS 2 is installed.
"""
import os
import pathlib
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[3]
DOCUMENT = SOURCE / "docs" / "describe.md"
BEGIN, END = "<!-- made by test/bridge/generate/inputs_table.py -->\n", "<!-- end -->\n"
TYPES = SOURCE / "test" / "bridge" / "generate" / "types"
# By the type what the command gets. The program does not have Autoware's, so that this is given as its file.
NEEDED = {name: [name] for name in ("geometry_msgs/msg/Point", "sensor_msgs/msg/NavSatFix", "sensor_msgs/msg/PointCloud2",
                                    "tf2_msgs/msg/TFMessage")}
NEEDED["autoware_msgs/msg/Waypoint"] = [str(TYPES / "autoware_msgs" / "msg" / "Waypoint.msg")]
# Option, value, and what the files have of it.
INPUTS = [("--package", "car.paper", "package car.paper"), ("--name", "Carried", "interface Carried {"),
          ("--major", "3", "major 3"), ("--minor", "7", "minor 7"), ("--event", "changed", "broadcast changed {"),
          ("--argument", "content", " content\n"), ("--service-id", "0x1234", "SomeIpServiceID = 4660"),
          ("--event-id", "0x8042", "SomeIpEventID = 32834"), ("--eventgroup", "0x0021", "SomeIpEventGroups = { 33 }"),
          ("--instance-name", "car.paper.Front", 'InstanceId = "car.paper.Front"'),
          ("--instance", "0x0055", "SomeIpInstanceID = 85"),
          ("--address", "192.168.7.9", 'SomeIpUnicastAddress = "192.168.7.9"'),
          ("--udp-port", "30511", "SomeIpUnreliableUnicastPort = 30511"),
          ("--tcp-port", "30512", "SomeIpReliableUnicastPort = 30512")]


def generate(program, folder, arguments, prefixes=""):
    """The FIDL and FDEPL files; nothing where there is no such type."""
    command = [program, "generate", *arguments, "--to", "fidl", "-o", str(folder)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60,
                          env={**os.environ, "AMENT_PREFIX_PATH": prefixes})
    if "unknown type" in done.stderr:
        return {}
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return {file.name: file.read_text() for file in sorted(pathlib.Path(folder).rglob("*")) if file.suffix in (".fidl", ".fdepl")}


def lines(files):
    return sum(len(text.splitlines()) for text in files.values())


def table(program, faults):
    rows = ["| type | inputs needed | which | lines of FIDL and FDEPL | with all 14 inputs |",
            "| --- | --- | --- | --- | --- |"]
    given = [word for option, value, _ in INPUTS for word in (option, value)]
    for name, needed in NEEDED.items():
        with tempfile.TemporaryDirectory() as folder:
            one = generate(program, folder, needed)
            if not one or generate(program, folder, needed) != one:
                faults.append(f"{name}: running again changes something")
        with tempfile.TemporaryDirectory() as folder:
            if needed != [name] and generate(program, folder, [name]):
                faults.append(f"{name}: the program has it, so that its name is enough")
            if generate(program, folder, [name], prefixes=str(TYPES)) != one:
                faults.append(f"{name}: where its package is installed, its name is not enough")
        with tempfile.TemporaryDirectory() as folder:
            all_given = generate(program, folder, [*needed, *given])
            text = "".join(all_given.values())
            faults.extend(f"{name}: {option} {value} is not honoured, {expected!r} is not there"
                          for option, value, expected in INPUTS if expected not in text)
        which = "its name" if needed == [name] else "its file"
        rows.append(f"| {name} | {len(needed)} | {which} | {lines(one)} | {lines(all_given)} |")
    return "\n".join(rows) + "\n"


def main():
    faults = []
    made = table(sys.argv[1], faults)
    if "--check" in sys.argv:
        document = DOCUMENT.read_text()
        if made != document[document.index(BEGIN) + len(BEGIN):document.index(END)]:
            faults.append(f"{DOCUMENT} has another table than\n{made}")
    else:
        print(made, end="")
    print("\n".join(faults), file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
