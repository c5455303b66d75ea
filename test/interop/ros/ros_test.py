#!/usr/bin/env python3
"""ros_test.py TRESTLE: real ROS 2 nodes at both ends of two bridges, one of them at the other end of the cable:

  ROS domain 1 -- (cable) -- bridge A -- (cable, SOME/IP) -- bridge B -- ROS domain 2
"""
import array
import contextlib
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
os.environ["TRESTLE_PEERS"] = os.environ.get("TRESTLE_ROS") or str(HERE.parents[2] / "build/ros")
sys.path.insert(0, str(HERE.parent / "python"))
import peer  # noqa: E402  goes on with the Python of TRESTLE_PEERS

try:
    import rclpy
    from geometry_msgs.msg import Twist
    from rclpy.event_handler import SubscriptionEventCallbacks
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import PointCloud2, PointField
    from std_msgs.msg import String
except ImportError:
    peer.missing("ros")

program = sys.argv.pop(1)
PATIENCE = 60  # seconds; running into it is a failure
A, B = peer.OURS, peer.THEIRS
ROUTES = [  # topic, type, whether it goes from A to B, settings
    ("/chatter", "std_msgs/msg/String", True, ""),
    ("/points", "sensor_msgs/msg/PointCloud2", True, "qos: {reliability: best_effort, depth: 5}"),
    ("/cmd_vel", "geometry_msgs/msg/Twist", False, ""),
    ("/map_name", "std_msgs/msg/String", False, "qos: {durability: transient_local, depth: 1}"),
]

# As systems have them that say nothing of transports: Fast DDS's own would end the bridge beside the nodes.
PROFILE = """<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
<participant profile_name="trestle"><rtps><name>bridge</name></rtps></participant></profiles></dds>
"""


def configuration(end):
    text = (f"someip: {{address: {A if end == 'a' else B}, sd: {{initial_delay_max: 20 ms, cyclic_offer_delay: 200 ms}}}}\n"
            f"dds: {{domain: {1 if end == 'a' else 2}, node: /{'front/' if end == 'b' else ''}trestle_{end}"
            f"{', profiles: profile.xml' if end == 'b' else ''}}}\nroutes:\n")
    for i, (topic, kind, from_a, settings) in enumerate(ROUTES):
        out = from_a == (end == "a")
        text += (f"  - {{topic: {topic}, type: {kind}, direction: {'dds_to_someip' if out else 'someip_to_dds'}, "
                 f"service: {0x1000 + i}, instance: 1, eventgroup: 1, event: {0x8001 + i}"
                 f"{f', port: {40001 + i}' if out else ''}{', ' if settings else ''}{settings}}}\n")
    return text


class Bridge:
    def __init__(self, folder, end, text=None):
        file = pathlib.Path(folder, f"{end}.yaml")
        file.write_text(text or configuration(end))
        pathlib.Path(folder, "profile.xml").write_text(PROFILE)
        place = ["nsenter", "--net=" + os.environ["TRESTLE_PEER_NAMESPACE"]] if end == "a" else []
        self.log = open(pathlib.Path(folder, f"{end}.log"), "w+")
        self.process = subprocess.Popen([*peer.DIES_WITH_US, *place, program, "bridge", str(file)],
                                        stdout=self.log, stderr=subprocess.STDOUT)

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(PATIENCE)
        self.log.seek(0)
        print(self.log.read())
        self.log.close()
        return status


class Ros:
    """A node in a domain."""

    def __init__(self, domain, name):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node(name, context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def wait(self, condition, patience=PATIENCE):
        end = time.monotonic() + patience
        while not condition():
            if time.monotonic() > end:
                return False
            self.executor.spin_once(timeout_sec=0.02)
        return True

    def ask(self, call, wait=None):
        """The answer to what call() asks a service, by wait(condition, patience). Again where none comes: a server of rclpy
        leaves out an answer whose reader it has not found within 100 ms."""
        end = time.monotonic() + 2 * PATIENCE
        while True:
            future = call()
            if (wait or self.wait)(future.done, PATIENCE / 4):
                return future.result()
            if time.monotonic() > end:
                raise AssertionError("no answer")

    def hashes(self, topic):
        """The type's hash as each node tells it that reads or writes a topic, called as it is in DDS."""
        return {info.node_name: str(info.topic_type_hash)
                for of in (self.node.get_publishers_info_by_topic, self.node.get_subscriptions_info_by_topic)
                for info in of(topic, no_mangle=True)}

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def cloud(seed, points=20_000):
    return PointCloud2(height=1, width=points, point_step=16, row_step=16 * points, is_dense=True,
                       fields=[PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
                               for i, name in enumerate("xyzi")],
                       data=array.array("B", [(seed + i * 7) % 251 for i in range(16)] * points))


class RealRos(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.bridges = {}
        for end in "ab":
            self.bridges[end] = Bridge(folder.name, end)
            self.addCleanup(self.bridges[end].stop)
        self.one = Ros(1, "one")
        self.addCleanup(self.one.close)
        self.two = Ros(2, "two")
        self.addCleanup(self.two.close)

    def state(self):
        """What the bridges are doing, for the message of a failure."""
        said = []
        for end, bridge in sorted(self.bridges.items()):
            log = pathlib.Path(self.folder, f"{end}.log").read_text()
            said.append(f"bridge {end}: {'runs' if bridge.process.poll() is None else f'ended with {bridge.process.poll()}'}, "
                        f"said:\n{log[:2000]}")
        return "\n".join(said)

    def carry(self, source, target, topic, kind, messages, qos=10):
        """Publishes until the path is open, then each message; all have to arrive as they were."""
        got = []
        subscription = target.node.create_subscription(kind, topic, got.append, qos)
        publisher = source.node.create_publisher(kind, topic, qos)
        end = time.monotonic() + PATIENCE
        while not got and time.monotonic() < end:
            publisher.publish(kind())
            target.executor.spin_once(timeout_sec=0.1)
        self.assertTrue(got, f"{topic}: nothing arrives; {self.state()}")
        for message in messages:
            got.clear()
            end = time.monotonic() + PATIENCE
            while message not in got and time.monotonic() < end:  # best effort may lose some
                publisher.publish(message)
                target.wait(lambda: message in got, 1)
            self.assertIn(message, got)
        target.node.destroy_subscription(subscription)
        source.node.destroy_publisher(publisher)

    def test_messages_arrive_as_they_were(self):
        self.carry(self.one, self.two, "/chatter", String, [String(data=text) for text in ("hello", "", "\u00e4\u20ac\U0001f600")])
        sensor = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.carry(self.one, self.two, "/points", PointCloud2, [cloud(1), cloud(2)], sensor)
        twist = Twist()
        twist.linear.x, twist.angular.z = 1.5, -0.25
        self.carry(self.two, self.one, "/cmd_vel", Twist, [twist])

    def test_the_bridges_are_nodes(self):
        for ros, name, space, written, read in (
                (self.one, "trestle_a", "/", {"/cmd_vel", "/map_name"}, {"/chatter", "/points"}),
                (self.two, "trestle_b", "/front", {"/chatter", "/points"}, {"/cmd_vel", "/map_name"})):
            node = ros.node
            types = {topic: [kind] for topic, kind, _, _ in ROUTES}
            self.assertTrue(ros.wait(lambda: (name, space, "/") in node.get_node_names_and_namespaces_with_enclaves()), name)
            self.assertTrue(ros.wait(lambda: types.items() <= dict(node.get_topic_names_and_types()).items()))
            # A node tells of itself before it tells what it writes and reads.
            for of, those in ((node.get_publisher_names_and_types_by_node, written), (node.get_subscriber_names_and_types_by_node, read)):
                wanted = {topic: types[topic] for topic in those}
                self.assertTrue(ros.wait(lambda: dict(of(name, space)) == wanted), (of(name, space), wanted))
            self.assertEqual(node.get_service_names_and_types_by_node(name, space), [])

    def endpoint(self, ros, name, topic, of):
        found = []

        def look():
            nonlocal found
            found = [info for info in of(topic) if info.node_name == name]
            return found
        self.assertTrue(ros.wait(look), topic)
        self.assertEqual(len(found), 1)
        return found[0]

    def test_topic_info_tells_types_and_quality(self):
        node = self.one.node
        # A publisher of ROS 2's own says what the hash has to be.
        probes = {kind: node.create_publisher(msg, f"/probe_{i}", 1)
                  for i, (kind, msg) in enumerate([("std_msgs/msg/String", String), ("geometry_msgs/msg/Twist", Twist),
                                                   ("sensor_msgs/msg/PointCloud2", PointCloud2)])}
        hashes = {kind: str(self.endpoint(self.one, "one", probe.topic_name, node.get_publishers_info_by_topic).topic_type_hash)
                  for kind, probe in probes.items()}
        for topic, kind, from_a, _ in ROUTES:
            of = node.get_subscriptions_info_by_topic if from_a else node.get_publishers_info_by_topic
            info = self.endpoint(self.one, "trestle_a", topic, of)
            self.assertEqual((info.node_namespace, info.topic_type), ("/", kind))
            self.assertEqual(str(info.topic_type_hash), hashes[kind])
            best_effort = topic == "/points"
            self.assertEqual(info.qos_profile.reliability,
                             ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE)
        latched = self.endpoint(self.one, "trestle_a", "/map_name", node.get_publishers_info_by_topic)
        self.assertEqual(latched.qos_profile.durability, DurabilityPolicy.TRANSIENT_LOCAL)

    def test_quality_that_does_not_go_together_is_named_on_both_sides(self):
        told = []
        # /points is published by the bridge with best effort.
        reader = self.two.node.create_subscription(
            PointCloud2, "/points", lambda _: self.fail("a sample"), QoSProfile(depth=5, reliability=ReliabilityPolicy.RELIABLE),
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=told.append))
        log = pathlib.Path(self.folder, "b.log")
        line = r"DDS rt/points: the quality of service of node /two \(\w+\) does not go with the route's `qos`: reliability"
        self.assertTrue(self.two.wait(lambda: told and re.search(line, log.read_text())), f"{told} {log.read_text()}")
        self.assertEqual(told[0].last_policy_kind, QoSPolicyKind.RELIABILITY)
        self.two.node.destroy_subscription(reader)

    def test_a_bridge_that_stops_leaves_the_graph(self):
        node = self.one.node
        self.assertTrue(self.one.wait(lambda: "trestle_a" in node.get_node_names()))
        self.assertTrue(self.one.wait(lambda: node.count_publishers("/cmd_vel") == 1))
        self.assertEqual(self.bridges["a"].process.send_signal(signal.SIGTERM), None)
        self.assertTrue(self.one.wait(lambda: "trestle_a" not in node.get_node_names()))
        self.assertTrue(self.one.wait(lambda: node.count_publishers("/cmd_vel") == 0))


class KilledNodes(unittest.TestCase):
    """Nodes have shared memory by default. Those that are killed leave it behind, and its locks as they were."""
    LIVES = 4
    PUBLISHER = """
import rclpy, sys, time
from geometry_msgs.msg import Twist
rclpy.init(domain_id=2)
publisher = rclpy.create_node("mortal").create_publisher(Twist, "/cmd_vel", 10)
message = Twist()
message.linear.x = float(sys.argv[1])
while True:
    publisher.publish(message)
    time.sleep(0.001)
"""

    def of_fast_dds(self, files):
        return {str(file) for file in files if re.match(r"/dev/shm/(sem\.)?fast", str(file))}

    def shared_memory(self, process):
        opened = []
        for link in pathlib.Path(f"/proc/{process.pid}/fd").iterdir():
            with contextlib.suppress(FileNotFoundError):  # closed since it was listed
                opened.append(os.readlink(link))
        return self.of_fast_dds(opened + pathlib.Path(f"/proc/{process.pid}/maps").read_text().split())

    def all_shared_memory(self):  # that of this test: the namespace has a /dev/shm of its own
        return self.of_fast_dds(pathlib.Path("/dev/shm").iterdir())

    def test_nodes_that_are_killed_leave_the_bridge_alone(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        before = self.all_shared_memory()
        bridges = [Bridge(folder.name, end) for end in "ab"]
        for bridge, end in zip(bridges, "ab"):
            self.addCleanup(bridge.stop)
            give_up = time.monotonic() + PATIENCE
            while "carrying" not in pathlib.Path(folder.name, f"{end}.log").read_text():
                self.assertLess(time.monotonic(), give_up)
                time.sleep(0.02)
        self.assertEqual(self.all_shared_memory(), before)
        one = Ros(1, "one")
        self.addCleanup(one.close)
        got = set()
        one.node.create_subscription(Twist, "/cmd_vel", lambda message: got.add(message.linear.x), 10)
        for life in range(self.LIVES):
            node = subprocess.Popen([*peer.DIES_WITH_US, sys.executable, "-B", "-c", self.PUBLISHER, str(life)])
            try:
                self.assertTrue(one.wait(lambda: life in got), f"life {life}: nothing arrives")
                self.assertTrue(self.shared_memory(node), "without shared memory this proves nothing")
            finally:
                node.kill()
                node.wait()
            for bridge in bridges:
                self.assertIsNone(bridge.process.poll(), "the bridge ended")
        for bridge in bridges:
            self.assertEqual(self.shared_memory(bridge.process), set())


if __name__ == "__main__":
    unittest.main(buffer=True)
