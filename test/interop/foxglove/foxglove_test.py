#!/usr/bin/env python3
"""foxglove_test.py TRESTLE: viewers of other makers at the console of a bridge. WebSocket is that of the library websockets; what
texts of the protocol have is judged by Foxglove's types (foxglove-websocket), schemas and CDR by its decoder (mcap-ros2-support).
Where Foxglove's client in JavaScript is there too, which Foxglove and Lichtblick are made of, it does the same.

`./run setup --peers` installs all of it: what is in Python into build/ros, without which this is skipped (77), or fails with
TRESTLE_REQUIRE_PEERS=1; what is in JavaScript into build/foxglove where npm is there. Without that its part is skipped, or fails with
TRESTLE_REQUIRE_PEERS=foxglove."""
import base64
import json
import math
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import typing
import unittest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
ROS = pathlib.Path(os.environ.get("TRESTLE_ROS") or ROOT / "build/ros")
NPM = pathlib.Path(os.environ.get("TRESTLE_FOXGLOVE") or ROOT / "build/foxglove")
REQUIRED = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(","))


def missing(what, required):
    print(f"{'missing' if required else 'skipped'}: {what}; ./run setup --peers installs it")
    sys.exit(1 if required else 77)


if pathlib.Path(sys.prefix).resolve() != ROS.resolve():
    if not (ROS / "bin/python").exists():
        missing("foxglove", REQUIRED & {"1", "foxglove"})
    os.execv(ROS / "bin/python", [ROS / "bin/python", "-B", *sys.argv])
try:
    from foxglove_websocket import types as protocol_types
    from mcap.records import Schema
    from mcap_ros2.decoder import DecoderFactory
    from websockets.sync.client import connect
except ImportError:
    missing("foxglove", REQUIRED & {"1", "foxglove"})
HAS_JAVASCRIPT = shutil.which("node") and all((NPM / "node_modules" / name).exists() for name in (
    "@foxglove/ws-protocol", "@foxglove/rosmsg", "@foxglove/rosmsg2-serialization", "ws"))
if not HAS_JAVASCRIPT and "foxglove" in REQUIRED:
    missing("Foxglove's client in JavaScript", True)

sys.path[:0] = [str(ROOT / "test/bridge/console")]
from viewers_test import CLOUD, DOMAIN, PATIENCE, PROTOCOLS, Bridges, route  # takes the name of the program


def is_of(value, kind):
    """Whether a value of JSON is of a type, as far as the protocol's types need that."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if typing.is_typeddict(kind):
        hints = typing.get_type_hints(kind)
        needed = {name for name, hint in hints.items() if type(None) not in typing.get_args(hint)}
        return isinstance(value, dict) and needed <= set(value) <= set(hints) and all(is_of(value[name], hints[name]) for name in value)
    if origin is typing.Union:
        return any(is_of(value, one) for one in arguments)
    if origin is typing.Literal:
        return value in arguments
    if origin is list:
        return isinstance(value, list) and all(is_of(one, arguments[0]) for one in value)
    if origin is not None:  # a mapping of texts
        return isinstance(value, dict) and all(isinstance(one, str) for one in (*value, *value.values()))
    if isinstance(kind, type) and issubclass(kind, protocol_types.IntEnum):
        return value in set(kind)
    return isinstance(value, getattr(kind, "__supertype__", kind))


def plain(value):
    """A decoded message as Python's JSON has it."""
    if hasattr(value, "__slots__"):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    return [plain(one) for one in value] if isinstance(value, list) and value and hasattr(value[0], "__slots__") else value


class Sees:
    """see(url, topic, messages, protocol): what the server says of itself, the channels by topic, and the messages."""

    def test_decodes_a_cloud_that_came_by_someip(self):
        points = [(0.5, -1.25, 2, 7), (4, 0, 0, 2), (0, 3, 1, 3)]
        data = b"".join(struct.pack("<ffff", *one) for one in points)
        fields = [{"name": name, "offset": 4 * i, "datatype": 7, "count": 1} for i, name in enumerate(("x", "y", "z", "intensity"))]
        sent = {"header": {"stamp": {"sec": 17, "nanosec": 5}, "frame_id": "lidar"}, "height": 1, "width": 3, "fields": fields,
                "is_bigendian": False, "point_step": 16, "row_step": 48, "data": "hex:" + data.hex(), "is_dense": True}
        self.bridge(route("/cloud", 0x2222, CLOUD))
        self.notify(0x2222, json.dumps(sent), CLOUD)
        for protocol in PROTOCOLS:
            with self.subTest(protocol):
                info, channels, messages = self.see(f"ws://127.0.0.1:{self.port}/", "/cloud", protocol=protocol)
                self.assertEqual(info["capabilities"], [])
                self.assertEqual(channels["/cloud"]["schemaName"], CLOUD)
                self.assertEqual(messages, [{**sent, "data": data}] * 3)
        _, _, messages = self.see(f"ws://127.0.0.1:{self.port}/", "/someip/0x2222/0x8001")
        self.assertEqual(messages, [sent] * 3)

    def test_decodes_clouds_that_come_by_dds(self):
        self.bridge("  - {topic: /points, type: sensor_msgs/msg/PointCloud2, direction: dds_to_someip, service: 0x1111, instance: 1, "
                    "eventgroup: 1, event: 0x8001, port: 40001}\n")
        self.start("demo-publisher", "--domain", DOMAIN, "--topic", "/points")
        _, _, messages = self.see(f"ws://127.0.0.1:{self.port}/", "/points")
        for message in messages:
            data = message["data"]
            self.assertEqual(message["width"] * message["height"], 131072)  # as many as the scene of the demo has
            self.assertEqual(len(data), message["row_step"] * message["height"])
            offsets = [field["offset"] for field in message["fields"] if field["name"] in "xyz"]
            far = [math.hypot(*(struct.unpack_from("<f", data, at + offset)[0] for offset in offsets))
                   for at in range(0, len(data), message["point_step"] * 997)]
            self.assertTrue(all(0 <= one < 500 for one in far if not math.isnan(one)), "points of a scene, not of noise")
        stamps = [(message["header"]["stamp"]["sec"], message["header"]["stamp"]["nanosec"]) for message in messages]
        self.assertEqual(stamps, sorted(set(stamps)))


class InPython(Sees, Bridges):
    KINDS = {"serverInfo": "ServerInfo", "advertise": "Advertise", "unadvertise": "Unadvertise", "status": "StatusMessage"}

    def see(self, url, topic, messages=3, protocol=PROTOCOLS[0]):
        info, channels, seen = None, {}, []
        with connect(url, subprotocols=[protocol], max_size=None, open_timeout=PATIENCE) as viewer:
            self.assertEqual(viewer.subprotocol, protocol)
            while len(seen) < messages:
                message = viewer.recv(PATIENCE)
                if isinstance(message, str):
                    text = json.loads(message)
                    self.assertTrue(is_of(text, getattr(protocol_types, self.KINDS[text["op"]])), message)
                    info = text if text["op"] == "serverInfo" else info
                    channels.update((one["topic"], one) for one in text.get("channels", []))
                    if topic in [one["topic"] for one in text.get("channels", [])]:
                        viewer.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 4711, "channelId": channels[topic]["id"]}]}))
                else:
                    opcode, subscription, _ = struct.unpack_from("<BIQ", message)
                    self.assertEqual((opcode, subscription), (protocol_types.BinaryOpcode.MESSAGE_DATA, 4711))
                    seen.append(self.decode(channels[topic], message[13:]))
        return info, channels, seen

    def decode(self, channel, data):
        if channel["encoding"] == "json":
            return json.loads(data)
        schema = Schema(id=1, name=channel["schemaName"], encoding=channel["schemaEncoding"], data=channel["schema"].encode())
        message = plain(DecoderFactory().decoder_for(channel["encoding"], schema)(data))
        return {**message, "data": bytes(message["data"])}


@unittest.skipUnless(HAS_JAVASCRIPT, "Foxglove's client in JavaScript is not there")
class InJavaScript(Sees, Bridges):
    def see(self, url, topic, messages=3, protocol=PROTOCOLS[0]):
        done = subprocess.run(["node", HERE / "viewer.cjs", NPM, url, topic, str(messages), protocol], stdout=subprocess.PIPE, text=True,
                              timeout=PATIENCE)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual(done.returncode, 0, [line for line in lines if "message" not in line])
        channels = {one["topic"]: one for line in lines for one in line.get("channels", [])}
        seen = [line["message"] for line in lines if "message" in line]
        if channels[topic]["encoding"] == "cdr":
            seen = [{**one, "data": base64.b64decode(one["data"])} for one in seen]
        return next(line["info"] for line in lines if "info" in line), channels, seen


if __name__ == "__main__":
    unittest.main()
