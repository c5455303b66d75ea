#!/usr/bin/env python3
"""The table "inputs and lines" of docs/describe.md.

inputs_table.py TRESTLE           prints it
inputs_table.py TRESTLE --check   is it what the document has? Also: with 14 inputs all of them are in the files, and running
                                  again changes nothing
"""
import pathlib
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[3]
DOCUMENT = SOURCE / "docs" / "describe.md"
BEGIN, END = "<!-- made by test/bridge/generate/inputs_table.py -->\n", "<!-- end -->\n"
TYPES = ["geometry_msgs/msg/Point", "sensor_msgs/msg/NavSatFix", "sensor_msgs/msg/PointCloud2", "tf2_msgs/msg/TFMessage",
         "autoware_msgs/msg/Waypoint"]
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


def generate(program, folder, arguments):
    """The FIDL and FDEPL files."""
    command = [program, "generate", *arguments, "--types", str(SOURCE / "test/bridge/generate/types"), "--to", "fidl", "-o",
               str(folder)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return {file: file.read_text() for file in sorted(pathlib.Path(folder).rglob("*")) if file.suffix in (".fidl", ".fdepl")}


def lines(files):
    return sum(len(text.splitlines()) for text in files.values())


def table(program, faults):
    rows = ["| type | inputs needed | lines of FIDL and FDEPL | with all 14 inputs |", "| --- | --- | --- | --- |"]
    given = [word for option, value, _ in INPUTS for word in (option, value)]
    for name in TYPES:
        with tempfile.TemporaryDirectory() as folder:
            one = generate(program, folder, [name])
            if generate(program, folder, [name]) != one:
                faults.append(f"{name}: running again changes something")
        with tempfile.TemporaryDirectory() as folder:
            all_given = generate(program, folder, [name, *given])
            text = "".join(all_given.values())
            faults.extend(f"{name}: {option} {value} is not honoured, {expected!r} is not there"
                          for option, value, expected in INPUTS if expected not in text)
        rows.append(f"| {name} | 1 | {lines(one)} | {lines(all_given)} |")
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
