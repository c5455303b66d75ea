#!/usr/bin/env python3
"""What others see in a recorded conversation, with nothing but a description: tshark, with the tables that `trestle generate
--to wireshark` writes, shows the names and values of pcaps/pysomeip/seat.pcap.

Usage: recorded_test.py TRESTLE SOURCE_FOLDER

Without tshark it is skipped (77); with TRESTLE_REQUIRE_PEERS=1 in the environment that is a failure.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

program, source = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
SEAT = source / "examples" / "seat"
CAPTURE = source / "pcaps" / "pysomeip" / "seat.pcap"

# What was said, once each, as described_test.py and seat_device.py have it: member, message type, and each value.
PRESET = ("name: Gr\u00fc\u00df dich \u20ac", "forward: -1", "height: -32768", "backrest: 32767")
SAID = {
    ("adjust", "Request", "axis: 4 (BACKREST)", "millimetres: -120"),
    ("adjust", "Response", "reached: 1", "forward: 0", "height: 0", "backrest: -120"),
    ("adjust", "Request", "axis: 1 (HEIGHT)", "millimetres: 501"),
    ("adjust", "Response", "reached: 0", "forward: 0", "height: 501", "backrest: -120"),
    ("stop", "Request no response"),
    ("store", "Request", *PRESET),
    ("store", "Response", "slot: 0"),
    ("recall", "Request", "slot: 0"),
    ("recall", "Response", "found: 1", *PRESET),
    ("recall", "Request", "slot: 200"),
    ("recall", "Response", "found: 0", "name: ", "forward: 0", "height: 0", "backrest: 0"),
    ("trace", "Request", "count: 6"),
    ("trace", "Response", *(f"element: {angle}" for angle in ("-1", "-0.75", "-0.5", "-0.25", "0", "0.25"))),
    ("trace", "Request", "count: 0"),
    ("trace", "Response"),
    ("massage", "Request", "key: lumbar", "value: 2", "key: ", "value: 9", "key: seat", "value: 255", "seconds: 4660"),
    ("massage", "Response", f"ticket: {0x12340000 + 6 * 2 + 4 * 255}"),
    ("moved", "Notification", "forward: 120", "height: -30", "backrest: 7"),
    ("blocked", "Notification", "axis: 4 (BACKREST)", "newtons: 86.5"),
    ("occupied", "Notification", "occupied: 1", "kilograms: 72.25"),
    ("occupied", "Notification", "occupied: 0", "problem: blind"),
    ("measured", "Notification", *(f"element: {byte}" for byte in (0, 1, 127, 128, 255)), f"time: {0x1122334455667788}"),
    ("heating", "Notification", "heating: 1"),
    ("heating", "Notification", "heating: 2"),
    ("heating", "Notification", "heating: 3"),
    ("heating_get", "Request"),
    ("heating_get", "Response", "heating: 1"),
    ("heating_set", "Request", "heating: 9"),
    ("heating_set", "Response", "heating: 3"),
    ("label", "Notification", "label: Fahrer\u20ac"),
    ("label", "Notification", "label: Beifahrer \U0001f600"),
    ("label_get", "Request"),
    ("label_get", "Response", "label: Beifahrer \U0001f600"),
    ("label_set", "Request", "label: Beifahrer \U0001f600"),
    ("label_set", "Response", "label: Beifahrer \U0001f600"),
    ("presets", "Notification"),
    ("presets", "Notification", *PRESET),
    ("presets_get", "Request"),
    ("presets_get", "Response", *PRESET),
}
KINDS = {0x00: "Request", 0x01: "Request no response", 0x02: "Notification", 0x80: "Response"}


def shown_by_tshark(*descriptions):
    """Of each message of the capture what tshark shows, as in SAID."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "generate", *descriptions, "--to", "wireshark", "-o", f"{folder}/profiles/seat", "-q"], check=True,
                       stderr=subprocess.DEVNULL)
        ran = subprocess.run(["tshark", "-C", "seat", "-r", CAPTURE, "-V", "-O", "someip", "-Y", "someip && !someipsd"],
                             env={**os.environ, "WIRESHARK_CONFIG_DIR": folder}, capture_output=True, text=True, check=True)
    # Faults of the tables are told on standard error alone.
    assert not re.sub(r"^Running as user .*\n", "", ran.stderr), ran.stderr
    assert "Malformed" not in ran.stdout and "nparsed" not in ran.stdout, ran.stdout
    for text in ran.stdout.split("SOME/IP Protocol (")[1:]:
        assert "Service ID: 0x5ea7 (Seat)" in text, text
        name = re.search(r"Method ID: 0x\w+ \((\w+)\)", text)[1]
        kind = KINDS[int(re.search(r"Message Type: 0x(\w+)", text)[1], 16)]
        values = re.findall(r"^ +(\w+) \[\w+\]: ?\ufeff?(.*)$", text, re.MULTILINE)
        yield (name, kind, *(f"{key}: {value}" for key, value in values))


class Recorded(unittest.TestCase):
    maxDiff = None

    def test_tshark_shows_names_and_values_by_fidl_and_fdepl(self):
        self.check(SEAT / "Seat.fidl", SEAT / "Seat.fdepl")

    def test_tshark_shows_names_and_values_by_arxml(self):
        self.check(SEAT / "seat.arxml")

    def check(self, *descriptions):
        shown = list(shown_by_tshark(*descriptions))
        self.assertEqual(sorted(set(shown)), sorted(SAID))
        self.assertEqual(len(shown), 43)


if __name__ == "__main__":
    if shutil.which("tshark") is None:
        required = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) & {"1", "tshark"}
        print(f"{'missing' if required else 'skipped'}: tshark; ./run setup --peers installs it")
        sys.exit(1 if required else 77)
    unittest.main(argv=sys.argv[:1])
