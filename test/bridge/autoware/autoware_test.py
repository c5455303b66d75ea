#!/usr/bin/env python3
"""autoware_test.py TRESTLE SOURCE_FOLDER: examples/autoware is right, and carries what a vehicle and Autoware say.

  ECU (trestle notify, subscribe) -- SOME/IP -- the example's bridge -- DDS -- its mirror -- SOME/IP -- another ECU
"""
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from bridge_program import DOMAIN, GROUP, HOST, PATIENCE  # noqa: E402
from definitions import found_in  # noqa: E402

TRESTLE, SOURCE = sys.argv.pop(1), pathlib.Path(sys.argv.pop(1))
EXAMPLE = SOURCE / "examples/autoware/vehicle_interface.yaml"
MIRROR_GROUP = GROUP.replace("239.254.", "239.253.")
DIES_WITH_US = ["setpriv", "--pdeathsig", "KILL"]


def big(layout, *values):
    return struct.pack(">" + layout, *values).hex()


# Event, type, and its bytes as the README says: big endian, lengths of 32 bits, UTF-8 with its mark and its end.
FRAME = big("I", 3 + 9 + 1) + "efbbbf" + b"base_link".hex() + "00"
VELOCITY = ("0x4100.1", 1, 0x8001, big("iI", 7, 8) + FRAME + big("fff", 12.5, -0.25, 0.125))
GEAR = ("0x4100.1", 3, 0x8003, big("iIB", 7, 9, 2))
CONTROL = ("0x4200.1", 1, 0x8001, big("iIiI", 1, 2, 3, 4) + big("iIiIff?", 1, 2, 3, 4, 0.5, -0.25, True) +
           big("iIiIfff??", 1, 2, 3, 4, 8.0, 1.5, 0.0, True, False))


def mirrored(text):
    """The other end: what goes in here comes out there, at a port that the example has not."""
    swap = {"dds_to_someip": "someip_to_dds", "someip_to_dds": "dds_to_someip"}
    text = re.sub(r"(?m)^methods:\n(?:.*\n)*", "", text)
    text = re.sub(r"(?m)^ +port: 40200\n", "", text)
    text = re.sub(r"direction: someip_to_dds", "direction: someip_to_dds\n    port: 40300", text)
    return re.sub(r"direction: (\w+)", lambda found: f"direction: {swap[found[1]]}", text)


class Autoware(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        os.environ["AMENT_PREFIX_PATH"] = found_in(self.folder / "types")

    def start(self, name, *command):
        file = open(self.folder / name, "w+")
        self.addCleanup(file.close)
        process = subprocess.Popen([*DIES_WITH_US, TRESTLE, *map(str, command)], stdout=file, stderr=subprocess.STDOUT)
        self.addCleanup(self.end, process)
        return process

    def end(self, process):
        process.terminate()
        process.wait(PATIENCE)

    def bridge(self, name, text, address, group, other):
        # What another bridge publishes is carried only where that is told.
        text = re.sub(r"direction: dds_to_someip", f"direction: dds_to_someip\n    from_bridges: [{other}]", text)
        text = re.sub(r"address: 192\.168\.10\.2", f"address: {address}\n  sd: {{multicast: {group}, initial_delay_min: 0, initial_delay_max: 5 ms, "
                      "cyclic_offer_delay: 200 ms}", text).replace("domain: 0", f"domain: {DOMAIN}\n  interfaces: [127.0.0.1]")
        (self.folder / f"{name}.yaml").write_text(text.replace("/vehicle/trestle", f"/vehicle/{name}"))
        return self.start(name, "bridge", self.folder / f"{name}.yaml")

    def test_check_takes_it(self):
        done = subprocess.run([TRESTLE, "check", str(EXAMPLE)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertNotIn("warning", done.stdout)

    def test_without_the_types_check_names_them(self):
        if (self.folder / "types/share/autoware_vehicle_msgs").exists():
            del os.environ["AMENT_PREFIX_PATH"]
            done = subprocess.run([TRESTLE, "check", str(EXAMPLE)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertRegex(done.stdout, r"vehicle_interface\.yaml:\d+:\d+: error: .*autoware_vehicle_msgs/msg/VelocityReport")

    def test_is_as_its_schema_says(self):
        try:
            import jsonschema
            import yaml
        except ImportError:
            self.skipTest("there are no jsonschema and yaml (Debian: python3-jsonschema, python3-yaml)")
        schema = json.loads(subprocess.run([TRESTLE, "schema"], stdout=subprocess.PIPE, check=True).stdout)
        jsonschema.Draft7Validator(schema).validate(yaml.safe_load(EXAMPLE.read_text()))

    def test_carries_reports_and_commands_byte_for_byte(self):
        example = EXAMPLE.read_text()
        self.bridge("example", example, HOST + "11", GROUP, HOST + "21")
        self.bridge("mirror", mirrored(example), HOST + "21", MIRROR_GROUP, HOST + "11")
        near, far = (HOST + "12", GROUP), (HOST + "22", MIRROR_GROUP)
        for (service, eventgroup, event, payload), sender, receiver in (
                (VELOCITY, near, far), (GEAR, near, far), (CONTROL, far, near)):
            with self.subTest(f"{service} {event:#x}"):
                notify = self.start("notify", "notify", service, eventgroup, hex(event), payload, "--rate", 20, "--quiet",
                           "--address", sender[0], "--multicast", sender[1])
                try:
                    got = self.first_event(service, eventgroup, event, receiver)
                finally:
                    self.end(notify)
                logs = "".join((self.folder / name).read_text() for name in ("example", "mirror", "notify"))
                self.assertEqual(got.returncode, 0, got.stdout + logs)
                self.assertEqual(json.loads(got.stdout)["payload"].replace(" ", ""), payload)

    def first_event(self, service, eventgroup, event, receiver):
        return subprocess.run([TRESTLE, "subscribe", service, str(eventgroup), hex(event), "--count", "1", "--json", "--quiet",
                               "--address", receiver[0], "--multicast", receiver[1], "--timeout", str(PATIENCE)],
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=2 * PATIENCE)


if __name__ == "__main__":
    unittest.main()
