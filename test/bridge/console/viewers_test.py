#!/usr/bin/env python3
"""viewers_test.py TRESTLE: what a viewer of Foxglove's WebSocket protocol gets of a bridge, by a client that is written here."""
import contextlib
import json
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent.parent), str(HERE.parent), str(HERE.parent / "web")]
from bridge_program import BRIDGE, DOMAIN, GROUP, PEER, head, log_until
from websocket import PATIENCE, PONG, TEXT, Refused, WebSocket

program = sys.argv.pop(1)
ENVIRONMENT = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)}
POINT, CLOUD = "geometry_msgs/msg/Point", "sensor_msgs/msg/PointCloud2"
PROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"]
LATCHED = ", qos: {durability: transient_local}"  # so that it is carried though nobody reads it
# Of large messages that come faster than a slow machine takes them, TCP loses none. Over UDP most would lack a segment there.
TCP = ", transport: tcp"


def route(topic, service, kind=POINT, event=0x8001, instance=1, more=""):
    return (f"  - {{topic: {topic}, type: {kind}, direction: someip_to_dds, service: {service:#06x}, instance: {instance}, "
            f"eventgroup: 0x0001, event: {event:#06x}{LATCHED}{more}}}\n")


class Viewer(WebSocket):
    """One that keeps what it is told."""

    def __init__(self, port, **more):
        super().__init__("127.0.0.1", port, protocols=more.pop("protocols", PROTOCOLS), **more)
        self.channels, self.statuses, self.gone = {}, [], []
        self.info = self.text()
        while not self.channels:
            self.text()

    def take(self, text):
        message = json.loads(text)
        if message["op"] == "advertise":
            self.channels.update({one["topic"]: one for one in message["channels"]})
        elif message["op"] == "unadvertise":
            self.gone += message["channelIds"]
        elif message["op"] == "status":
            self.statuses.append(message)
        return message

    def text(self):
        message = self.receive()
        assert isinstance(message, str), message
        return self.take(message)

    def subscribe(self, **topics):
        """Numbers by "n", as in n5="/topic"."""
        self.send(json.dumps({"op": "subscribe", "subscriptions": [
            {"id": int(name[1:]), "channelId": self.channels[topic]["id"]} for name, topic in topics.items()]}))

    def message(self):
        """(subscription, time in ns, bytes)"""
        while isinstance(message := self.receive(), str):
            self.take(message)
        opcode, subscription, at_ns = struct.unpack_from("<BIQ", message)
        assert opcode == 1
        return subscription, at_ns, message[13:]

    def status(self):
        while not self.statuses:
            if isinstance(message := self.receive(), str):
                self.take(message)
        return self.statuses.pop(0)


class Bridges(unittest.TestCase):
    """Bridges with a console, and who sends to them."""

    def start(self, *arguments):
        log = tempfile.TemporaryFile("w+")
        process = subprocess.Popen([program, *map(str, arguments)], stdout=log, stderr=subprocess.STDOUT, env=ENVIRONMENT)

        def end():
            process.terminate()
            process.wait(PATIENCE)
            log.close()
        self.addCleanup(end)
        return log

    def bridge(self, routes):
        """Its port."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        file = self.file = pathlib.Path(folder.name) / "drive.yaml"
        with contextlib.closing(socket.socket()) as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        file.write_text(head() + f"console: {{address: 127.0.0.1:{self.port}}}\nroutes:\n" + routes)
        log_until(self.start("bridge", file), f"console: http://127.0.0.1:{self.port}/\n")

    def notify(self, service, payload, kind="", rate=20, tcp=False):
        return self.start("notify", f"{service:#06x}.1", "1", "0x8001", payload, "--address", PEER, "--multicast", GROUP, "--rate", rate,
                          *(["--type", kind] if kind else []), *(["--tcp"] if tcp else []))


class Viewers(Bridges):
    def viewer(self, **more):
        viewer = Viewer(self.port, **more)
        self.addCleanup(viewer.close)
        return viewer

    @contextlib.contextmanager
    def saying_that_it_is_there(self, viewer):
        """One that reads nothing answers no ping, and is taken to be gone after a while. So it says so itself, however long all else
        takes."""
        end = threading.Event()

        def say():
            while not end.wait(1):
                viewer.send(b"", PONG)
        thread = threading.Thread(target=say)
        thread.start()
        try:
            yield
        finally:
            end.set()
            thread.join()

    def metric(self, name):
        with urllib.request.urlopen(f"http://127.0.0.1:{self.port}/metrics", timeout=PATIENCE) as answer:
            return int(re.search(rf"^{re.escape(name)} (\d+)$", answer.read().decode(), re.MULTILINE)[1])

    def wait_for_metric(self, name, value):
        end = time.monotonic() + PATIENCE
        while (now := self.metric(name)) != value:
            self.assertLess(time.monotonic(), end, f"{name} is {now}")
            time.sleep(0.05)

    def test_get_both_sides_of_a_route(self):
        self.bridge(route("/in", 0x2222))
        self.notify(0x2222, "{x: 1.5, y: -2, z: 3}", POINT)
        viewer = self.viewer()
        self.assertEqual(viewer.protocol, "foxglove.sdk.v1")
        self.assertEqual((viewer.info["op"], viewer.info["capabilities"]), ("serverInfo", []))
        self.assertEqual(set(viewer.channels), {"/in", "/someip/0x2222/0x8001"})
        topic, event = viewer.channels["/in"], viewer.channels["/someip/0x2222/0x8001"]
        self.assertEqual((topic["encoding"], topic["schemaName"], topic["schemaEncoding"]), ("cdr", POINT, "ros2msg"))
        self.assertEqual(re.findall(r"^float64 [xyz]", topic["schema"], re.MULTILINE), ["float64 x", "float64 y", "float64 z"])
        self.assertEqual((event["encoding"], event["schemaName"], event["schemaEncoding"]), ("json", POINT, "jsonschema"))
        self.assertEqual(list(json.loads(event["schema"])["properties"]), ["x", "y", "z"])

        before = time.time_ns()
        viewer.subscribe(n5="/in")
        subscription, at_ns, message = viewer.message()
        self.assertEqual(subscription, 5)
        self.assertTrue(before <= at_ns <= time.time_ns())
        self.assertEqual(message[:2], b"\0\1" if sys.byteorder == "little" else b"\0\0")
        self.assertEqual(struct.unpack_from("=3d", message, 4), (1.5, -2, 3))
        viewer.subscribe(n6="/someip/0x2222/0x8001")
        while (other := viewer.message())[0] != 6:
            pass
        self.assertEqual(json.loads(other[2]), {"x": 1.5, "y": -2, "z": 3})

    def test_get_the_payload_of_a_route_that_maps_fields_in_its_type(self):
        vector = "geometry_msgs/msg/Vector3"
        self.bridge(route("/in", 0x2222).rstrip("}\n") + "}" + f", payload: {vector}, map: {{x: {{from: y, scale: 0.5}}}}, drop: [x, z], "
                    "others: default}\n")
        self.notify(0x2222, "{y: 3}", vector)
        viewer = self.viewer()
        self.assertEqual(viewer.channels["/in"]["schemaName"], POINT)
        self.assertEqual(viewer.channels["/someip/0x2222/0x8001"]["schemaName"], vector)
        viewer.subscribe(n5="/in")
        self.assertEqual(struct.unpack_from("=3d", viewer.message()[2], 4), (1.5, 0, 0))
        viewer.subscribe(n6="/someip/0x2222/0x8001")
        while (other := viewer.message())[0] != 6:
            pass
        self.assertEqual(json.loads(other[2]), {"x": 0, "y": 3, "z": 0})

    def test_get_each_message_and_none_after_the_end(self):
        self.bridge(route("/in", 0x2222))
        self.notify(0x2222, "{x: 1}", POINT, 50)
        viewer = self.viewer()
        viewer.subscribe(n1="/in")
        times = [viewer.message()[1] for _ in range(50)]
        self.assertEqual(times, sorted(times))
        self.assertEqual(len(set(times)), 50, "a stream, not the newest one again and again")
        viewer.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [1]}))
        # Asked behind it: what comes after the answer was sent after both.
        viewer.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [1]}))
        self.assertEqual(viewer.status()["message"], "there is no subscription 1")
        viewer.subscribe(n2="/someip/0x2222/0x8001")
        self.assertEqual({viewer.message()[0] for _ in range(5)}, {2})
        self.wait_for_metric("trestle_viewers", 1)
        viewer.close()
        self.wait_for_metric("trestle_viewers", 0)

    def test_are_told_of_what_cannot_be_shown(self):
        self.bridge(route("/in", 0x2222))
        self.notify(0x2222, "00 01 02")
        viewer = self.viewer()
        viewer.subscribe(n1="/in")
        status = viewer.status()
        self.assertEqual(status["level"], 1)
        self.assertRegex(status["message"], "^messages not sent, because they cannot be converted: 1; the last one of /in: ")

    def test_may_only_look(self):
        self.bridge(route("/in", 0x2222))
        viewer = self.viewer()
        viewer.send(json.dumps({"op": "advertise", "channels": [{"id": 1, "topic": "/x", "encoding": "cdr", "schemaName": POINT}]}))
        self.assertEqual(viewer.status()["message"], "advertise: this bridge only shows; see its capabilities")
        viewer.send(b"\x01\x01\0\0\0")
        self.assertEqual(viewer.status()["level"], 2)

    def test_end_alone_when_they_break_the_protocol(self):
        self.bridge(route("/in", 0x2222))
        self.notify(0x2222, "{x: 1}", POINT)
        good = self.viewer()
        good.subscribe(n1="/in")
        wrong = [lambda one: one.send("no JSON"), lambda one: one.send(b"\xff"), lambda one: one.send('{"op": "subscribe"}'),
                 lambda one: one.send("{}", masked=False), lambda one: one.send(b"\xff\xfe", TEXT), lambda one: one.send("x", opcode=5),
                 lambda one: one.send(" " * (257 << 10))]
        for number, break_it in enumerate(wrong, 1):
            with self.subTest(number):
                bad = self.viewer()
                break_it(bad)
                with self.assertRaises((EOFError, ConnectionError)):
                    while True:
                        bad.receive()
                bad.close()  # for that the server waits
                self.wait_for_metric("trestle_viewers_malformed_total", number)
                self.wait_for_metric("trestle_viewers", 1)
        good.message()

    def test_are_few(self):
        self.bridge(route("/in", 0x2222))
        viewers = [self.viewer() for _ in range(4)]
        with self.assertRaisesRegex(Refused, "503.*as many viewers as may be"):
            self.viewer()
        viewers[0].close()
        self.wait_for_metric("trestle_viewers", 3)
        self.viewer()

    def test_need_not_read_and_the_bridge_goes_on(self):
        data = 2 << 20
        self.bridge(route("/cloud", 0x2222, "std_msgs/msg/UInt8MultiArray", more=TCP))
        values = self.file.parent / "values.yaml"
        values.write_text(f"data: 'hex:{'5a' * data}'\n")
        # No faster than a slow machine can take them: the thread of the viewers gives way to that of the bridge.
        self.notify(0x2222, f"@{values}", "std_msgs/msg/UInt8MultiArray", rate=4, tcp=True)
        slow, quick = self.viewer(receive_buffer=8192), self.viewer()
        slow.subscribe(n1="/cloud")
        quick.subscribe(n1="/cloud")
        with self.saying_that_it_is_there(slow):
            # More than what may wait for the slow one: 64 MB, and what the sockets hold.
            end = time.monotonic() + 4 * PATIENCE
            while self.metric('trestle_viewer_messages_lost_total{reason="slow"}') == 0:
                self.assertEqual(len(quick.message()[2]), 4 + 4 + 4 + 4 + data)
                self.assertLess(time.monotonic(), end)
            for _ in range(3):
                quick.message()
            told = slow.status()["message"]
        self.assertRegex(told, "^messages not sent, because this viewer reads too slowly: [0-9]+; the last one of /cloud$")

    def test_may_take_longer_for_a_message_than_one_that_is_gone_is_waited_for(self):
        data, patience = 3 << 20, 30
        self.bridge(route("/cloud", 0x2222, "std_msgs/msg/UInt8MultiArray", more=TCP))
        values = self.file.parent / "values.yaml"
        values.write_text(f"data: 'hex:{'5a' * data}'\n")
        self.notify(0x2222, f"@{values}", "std_msgs/msg/UInt8MultiArray", rate=1, tcp=True)
        steady, gone = self.viewer(receive_buffer=8192), self.viewer(receive_buffer=8192)
        for one in (steady, gone):
            one.subscribe(n1="/cloud")
        self.wait_for_metric("trestle_viewers", 2)
        with self.saying_that_it_is_there(steady):  # until the first message comes, whenever that is
            parts = [steady.read_exactly(1)]
        begin = time.monotonic()
        while sum(map(len, parts)) < data:  # the first message, at a pace: no ping is answered in between
            parts.append(steady.read_exactly(data // 100))
            time.sleep(1.4 * patience / 100)
            self.assertLess(time.monotonic() - begin, 4 * PATIENCE)
        self.assertGreater(time.monotonic() - begin, 1.3 * patience)
        self.wait_for_metric("trestle_viewers", 1)  # one that takes nothing has gone

    def test_see_each_channel_under_a_name_of_its_own(self):
        self.bridge(route("/one", 0x2222) + route("/two", 0x2222, event=0x8002) + route("/three", 0x2222, instance=2))
        self.assertEqual(set(self.viewer().channels), {"/one", "/two", "/three", "/someip/0x2222/0x8001", "/someip/0x2222/0x8002",
                                                       "/someip/0x2222/0x8001/0x0002"})

    def test_find_a_thousand_routes(self):
        self.bridge("".join(route(f"/t{i}", 0x3000 + i // 100, event=0x8001 + i % 100) for i in range(1000)))
        viewer = self.viewer()
        self.assertEqual(len(viewer.channels), 2000)
        viewer.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": i, "channelId": one["id"]}
                                                                     for i, one in enumerate(viewer.channels.values())]}))
        self.notify(0x3005, "{x: 7}", POINT)
        wanted = {list(viewer.channels).index(topic) for topic in ("/t500", "/someip/0x3005/0x8001")}
        self.assertEqual({viewer.message()[0] for _ in range(6)}, wanted)


if __name__ == "__main__":
    unittest.main()
