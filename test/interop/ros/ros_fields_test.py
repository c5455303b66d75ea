#!/usr/bin/env python3
"""ros_fields_test.py TRESTLE: fields between real ROS 2 nodes that don't know of each other: a latched topic with a get and
a set service at one end is one with two services at the other, and a SOME/IP field in between.

  ROS owner, domain 1 -- bridge A (server: ros) -- SOME/IP -- bridge B (server: someip) -- ROS user, domain 2
"""
import pathlib
import signal
import sys
import tempfile
import unittest

from ros_test import A, B, PATIENCE, Bridge, Ros

from nav_msgs.msg import OccupancyGrid  # noqa: E402  rclpy is there, or ros_test had ended
from nav_msgs.srv import GetMap
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from test_msgs.srv import BasicTypes

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Has the members of both messages of test_msgs/srv/BasicTypes. No topic has it: no node knows it as a message.
BASIC = """bool a
byte b
char c
float32 d
float64 e
int8 f
uint8 g
int16 h
uint16 i
int32 j
uint32 k
int64 l
uint64 m
string n
"""


def configuration(end, folder):
    server = "ros, port: 40001" if end == "a" else "someip"
    common = f"server: {server}, service: 0x4000, instance: 1"
    return f"""\
someip: {{address: {A if end == 'a' else B}, sd: {{initial_delay_max: 20 ms, cyclic_offer_delay: 200 ms}}}}
dds: {{domain: {1 if end == 'a' else 2}, node: /trestle_{end}}}
types: {{paths: [{folder}, {sys.prefix}]}}
fields:
  - {{topic: /map, type: nav_msgs/msg/OccupancyGrid, event: 0x8001, eventgroup: 1, getter: 1, {common},
     get_type: nav_msgs/srv/GetMap{', get_service: /static_map' if end == 'a' else ''}}}
  - {{topic: /basic, type: mine/msg/Basic, setter: 4, set_type: test_msgs/srv/BasicTypes, {common}}}
"""


def grid(name, value):
    result = OccupancyGrid(data=[value] * 100)
    result.header.frame_id, result.info.width, result.info.height = name, 10, 10
    result.info.resolution = 0.5
    return result


class RealRosFields(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        path = pathlib.Path(folder.name, "mine/msg")
        path.mkdir(parents=True)
        (path / "Basic.msg").write_text(BASIC)
        self.bridges = {}
        for end in "ab":
            self.start(end)
        self.owner = Ros(1, "owner")
        self.addCleanup(self.owner.close)
        self.user = Ros(2, "user")
        self.addCleanup(self.user.close)

    def start(self, end):
        self.bridges[end] = Bridge(self.folder, end, configuration(end, self.folder))
        self.addCleanup(self.bridges[end].stop)

    def both(self, condition, patience=PATIENCE):
        """Waits, working both nodes."""
        return self.user.wait(lambda: (self.owner.executor.spin_once(timeout_sec=0.005), condition())[1], patience)

    def own(self):
        """The owner's side of all fields."""
        node = self.owner.node

        def on_set(request, response):
            for field in request.get_fields_and_field_types():
                setattr(response, field, getattr(request, field))
            response.uint8_value = min(request.uint8_value, 100)
            return response
        publisher = node.create_publisher(OccupancyGrid, "/map", LATCHED)
        services = [
            node.create_service(GetMap, "/static_map", lambda _, response: (setattr(response, "map", grid("static", 5)), response)[1]),
            node.create_service(BasicTypes, "/basic/set", on_set)]
        return publisher, services

    def ask(self, kind, name, request):
        client = self.user.node.create_client(kind, name)
        self.assertTrue(self.both(client.service_is_ready), name)
        return self.user.ask(lambda: client.call_async(request), self.both)

    def listen(self):
        seen = []
        return seen, self.user.node.create_subscription(OccupancyGrid, "/map", seen.append, LATCHED)

    def test_values_are_latched_got_and_set(self):
        publisher, _services = self.own()
        publisher.publish(grid("first", 1))
        seen, early = self.listen()
        self.assertTrue(self.both(lambda: seen == [grid("first", 1)]), seen)
        publisher.publish(grid("second", 2))
        self.assertTrue(self.both(lambda: seen == [grid("first", 1), grid("second", 2)]), seen)
        seen_late, late = self.listen()
        self.assertTrue(self.both(lambda: seen_late == [grid("second", 2)]), seen_late)
        self.assertEqual(self.ask(GetMap, "/map/get", GetMap.Request()).map, grid("static", 5))
        request = BasicTypes.Request(bool_value=True, byte_value=b"\x07", char_value=200, float32_value=1.5,
                                     float64_value=-2.25, int8_value=-8, uint8_value=200, int64_value=-(1 << 40),
                                     string_value="text \u00e4\u20ac")
        answer = self.ask(BasicTypes, "/basic/set", request)
        request.uint8_value = 100  # what the owner took
        for field in request.get_fields_and_field_types():
            self.assertEqual(getattr(answer, field), getattr(request, field), field)

    def test_a_bridge_that_is_started_again_brings_the_value_back(self):
        publisher, _services = self.own()
        publisher.publish(grid("first", 1))
        seen, early = self.listen()
        self.assertTrue(self.both(lambda: len(seen) == 1))
        client = self.user.node.create_client(GetMap, "/map/get")
        self.assertTrue(self.both(client.service_is_ready))
        self.bridges["a"].process.send_signal(signal.SIGTERM)
        self.assertTrue(self.both(lambda: not client.service_is_ready() and self.user.node.count_publishers("/map") == 0))
        self.bridges["a"].process.wait(PATIENCE)  # only then are its ports free
        self.start("a")
        self.assertTrue(self.both(lambda: len(seen) == 2), seen)
        self.assertEqual(seen[1], grid("first", 1))
        self.assertEqual(self.ask(GetMap, "/map/get", GetMap.Request()).map, grid("static", 5))


if __name__ == "__main__":
    unittest.main(buffer=True)
