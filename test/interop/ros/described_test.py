#!/usr/bin/env python3
"""described_test.py TRESTLE: a bridge that has nothing but the description of a service, between a device of another stack
that implements it and a ROS 2 node:

  ROS node -- bridge (on the other side of the cable), with examples/seat -- SOME/IP -- pysomeip (seat_device.py)

The device's payloads are written by hand. The node has the types that `trestle generate --to msg` writes, built by rosidl.
"""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
DEVICE_PEERS = os.environ.setdefault("TRESTLE_DEVICE_PEERS", os.environ.get("TRESTLE_PEERS") or str(ROOT / "build/peers"))

from ros_test import A, B, PATIENCE, Bridge, Ros, peer, program  # noqa: E402  goes on with the Python of ROS

import packages  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # noqa: E402

SEAT = ROOT / "examples/seat"
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def run(*arguments):
    subprocess.run([program, *map(str, arguments)], check=True, stderr=subprocess.DEVNULL)


def setUpModule():
    """The types, for all tests."""
    global Position, Preset, Program, CushionsEntry, car, services, hashes
    folder = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(folder.cleanup)
    source, work = pathlib.Path(folder.name, "src"), pathlib.Path(folder.name, "build")
    work.mkdir()
    run("generate", SEAT / "Seat.fidl", SEAT / "Seat.fdepl", "--to", "msg", "-o", source)
    hashes = packages.build(source, work)
    from car import msg as car, srv as services
    from seat_types.msg import CushionsEntry, Position, Preset, Program


class Device:
    """seat_device.py at B."""

    def __init__(self):
        self.process = subprocess.Popen(
            [*peer.DIES_WITH_US, sys.executable, "-B", ROOT / "test/interop/python/seat_device.py", B],
            env={**os.environ, "TRESTLE_PEERS": DEVICE_PEERS}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.lines = []
        self.reader = threading.Thread(target=lambda: self.lines.extend(map(str.strip, self.process.stdout)), daemon=True)
        self.reader.start()

    def do(self, *words):
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()

    def stop(self):
        if self.process.poll() is None:
            self.do("quit")
        self.process.stdin.close()
        status = self.process.wait(PATIENCE)
        self.reader.join(PATIENCE)
        self.process.stdout.close()
        return status


class Described(unittest.TestCase):
    """What is the same whatever the description's language is."""

    def start(self, *descriptions):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for name in descriptions:
            shutil.copy(SEAT / name, folder.name)
        text = (SEAT / "bridge.yaml").read_text()
        self.assertIn("interfaces: [Seat.fidl, Seat.fdepl]", text)
        text = text.replace("[Seat.fidl, Seat.fdepl]", f"[{', '.join(descriptions)}]").replace("127.0.0.1", A)
        self.bridge = Bridge(folder.name, "a", text)
        self.addCleanup(self.bridge.stop)
        self.device = Device()
        self.addCleanup(self.device.stop)
        self.ros = Ros(0, "driver")
        self.addCleanup(self.ros.close)

    def until(self, condition, what, again=None):
        """Waits for a condition; what `again` does is repeated each second, because the first time may be too early."""
        end = time.monotonic() + PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), end, what() if callable(what) else what)
            if again:
                again()
            self.ros.wait(condition, 1)

    def call(self, name, kind, /, **request):
        client = self.ros.node.create_client(kind, name)
        self.until(client.service_is_ready, f"{name} does not come")
        answer = self.ros.ask(lambda: client.call_async(kind.Request(**request)))
        self.ros.node.destroy_client(client)
        return answer

    def hears(self, topic, kind, wanted, again, qos=10):
        got = []
        subscription = self.ros.node.create_subscription(kind, topic, got.append, qos)
        self.until(lambda: wanted in got, lambda: f"{topic}: {got}", again)
        self.ros.node.destroy_subscription(subscription)

    def check_all(self):
        self.check_methods()
        self.check_events()
        self.check_fields()
        self.check_types()

    def check_methods(self):
        answer = self.call("/seat/adjust", services.SeatAdjust, axis=services.SeatAdjust.Request.AXIS_BACKREST, millimetres=-120)
        self.assertEqual((answer.reached, answer.position), (True, Position(backrest=-120)))
        answer = self.call("/seat/adjust", services.SeatAdjust, axis=services.SeatAdjust.Request.AXIS_HEIGHT, millimetres=501)
        self.assertEqual((answer.reached, answer.position), (False, Position(height=501, backrest=-120)))
        self.call("/seat/stop", services.SeatStop)
        self.until(lambda: "stop empty" in self.device.lines, lambda: self.device.lines)
        preset = Preset(name="Gr\u00fc\u00df dich \u20ac", position=Position(forward=-1, height=-32768, backrest=32767))
        self.assertEqual(self.call("/seat/store", services.SeatStore, name=preset.name, position=preset.position).slot, 0)
        answer = self.call("/seat/recall", services.SeatRecall, slot=0)
        self.assertEqual((answer.found, answer.preset), (True, preset))
        answer = self.call("/seat/recall", services.SeatRecall, slot=200)
        self.assertEqual((answer.found, answer.preset), (False, Preset()))
        self.assertEqual(list(self.call("/seat/trace", services.SeatTrace, count=6).angles), [-1, -0.75, -0.5, -0.25, 0, 0.25])
        self.assertEqual(list(self.call("/seat/trace", services.SeatTrace, count=0).angles), [])
        cushions = [CushionsEntry(key="lumbar", value=2), CushionsEntry(key="", value=9), CushionsEntry(key="seat", value=255)]
        answer = self.call("/seat/massage", services.SeatMassage, program=Program(cushions=cushions), seconds=0x1234)
        self.assertEqual(answer.ticket, 0x12340000 + 6 * 2 + 4 * 255)

    def check_events(self):
        self.until(lambda: "subscribed 2" in self.device.lines, "it does not subscribe to the events")
        send = lambda name: lambda: self.device.do("send", name)
        self.hears("/seat/moved", Position, Position(forward=120, height=-30, backrest=7), send("moved"))
        self.hears("/seat/blocked", car.SeatBlocked, car.SeatBlocked(axis=car.SeatBlocked.AXIS_BACKREST, newtons=86.5), send("blocked"))
        wanted = car.SeatOccupied(occupied=True)
        wanted.weight.kilograms = [72.25]
        self.hears("/seat/occupied", car.SeatOccupied, wanted, send("occupied"))
        wanted = car.SeatOccupied(occupied=False)
        wanted.weight.problem = ["blind"]
        self.hears("/seat/occupied", car.SeatOccupied, wanted, send("problem"))
        self.hears("/seat/measured", car.SeatMeasured, car.SeatMeasured(samples=[0, 1, 127, 128, 255], time=0x1122334455667788),
                   send("measured"))

    def check_fields(self):
        from car_fields import srv as of_fields
        self.until(lambda: "subscribed 1" in self.device.lines, "it does not subscribe to the fields")
        # A reader that comes late has the value: it is latched.
        self.hears("/seat/heating", car.SeatHeating, car.SeatHeating(heating=1), None, LATCHED)
        self.hears("/seat/label", car.SeatLabel, car.SeatLabel(label="Fahrer\u20ac"), None, LATCHED)
        presets = car.SeatPresets(presets=[self.call("/seat/recall", services.SeatRecall, slot=0).preset])
        self.hears("/seat/presets", car.SeatPresets, presets, None, LATCHED)
        self.assertEqual(self.call("/seat/presets/get", of_fields.GetSeatPresets).value, presets)
        self.assertEqual(self.call("/seat/heating/get", of_fields.GetSeatHeating).value.heating, 1)
        answer = self.call("/seat/heating/set", of_fields.SetSeatHeating, value=car.SeatHeating(heating=9))
        self.assertEqual(answer.value.heating, 3)  # what the device took
        self.hears("/seat/heating", car.SeatHeating, car.SeatHeating(heating=3), None, LATCHED)
        self.device.do("heat", 2)
        self.hears("/seat/heating", car.SeatHeating, car.SeatHeating(heating=2), None, LATCHED)
        label = car.SeatLabel(label="Beifahrer \U0001f600")
        self.assertEqual(self.call("/seat/label/set", of_fields.SetSeatLabel, value=label).value, label)
        self.assertEqual(self.call("/seat/label/get", of_fields.GetSeatLabel).value, label)
        self.hears("/seat/label", car.SeatLabel, label, None, LATCHED)

    def check_types(self):
        """The bridge's types are those that rosidl has made."""
        for topic, kind in (("moved", "seat_types/msg/Position"), ("occupied", "car/msg/SeatOccupied"),
                            ("measured", "car/msg/SeatMeasured"), ("presets", "car/msg/SeatPresets")):
            info, = self.ros.node.get_publishers_info_by_topic(f"/seat/{topic}")
            self.assertEqual((info.topic_type, str(info.topic_type_hash)), (kind, hashes[kind]))

    def test_fidl_and_fdepl_alone_are_a_bridge(self):
        self.start("Seat.fidl", "Seat.fdepl")
        self.check_all()

    def test_arxml_alone_is_a_bridge(self):
        self.start("seat.arxml")
        self.check_all()


if __name__ == "__main__":
    if lacking := packages.can_build():
        peer.missing(lacking)
    if subprocess.run([f"{DEVICE_PEERS}/bin/python", "-c", "import someip"], stderr=subprocess.DEVNULL, check=False).returncode != 0:
        peer.missing("pysomeip")
    unittest.main(buffer=True)
