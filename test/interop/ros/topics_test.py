#!/usr/bin/env python3
"""topics_test.py TRESTLE: a ROS 2 node beside two bridges, with a topic of every message type that is installed.

The node publishes /in/N, one bridge makes SOME/IP events of it, the other one /out/N of these; what the node gets there
has to be what it published. It is run by in_namespaces, so nobody else hears them: a bridge whose `interfaces` are
127.0.0.1 alone would not find nodes that have not the same, see docs/configuration.md.

Without ROS 2, which `./run setup --peers` installs below build/, it is skipped (77); with TRESTLE_REQUIRE_PEERS=1 in the
environment that is a failure."""
import atexit
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
ROS = pathlib.Path(os.environ.get("TRESTLE_ROS") or ROOT / "build/ros")
PID = os.getpid()
DOMAIN = 120 + PID % 20
if pathlib.Path(sys.prefix).resolve() != ROS.resolve():
    if not (ROS / "bin/python").exists():
        required = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) & {"1", "ros"}
        print(f"{'missing' if required else 'skipped'}: ros; ./run setup --peers installs it")
        sys.exit(1 if required else 77)
    # What ROS reads from its environment, and a home for its log.
    home = tempfile.mkdtemp(prefix="trestle_ros_")
    os.execve(ROS / "bin/python", [ROS / "bin/python", "-B", *sys.argv],
              {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN), "ROS_HOME": home, "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"})

import golden  # noqa: E402: beside this file
import rclpy  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from rclpy.serialization import serialize_message  # noqa: E402

TRESTLE = sys.argv.pop(1)
PATIENCE = 60
CONFIG = """\
someip:
  address: 127.{net}.{host}
  sd: {{multicast: 239.254.{net}, initial_delay_min: 0, initial_delay_max: 5 ms, cyclic_offer_delay: 500 ms}}
dds: {{domain: {domain}, node: /trestle_{host}}}
types: {{paths: [{share}]}}
routes:
"""
ROUTE = """\
  - {{topic: /{way}/t{i}, type: {type}, direction: {direction}, service: 0x3000, instance: 1, eventgroup: 1,
     event: {event}{port}}}
"""


class Bridge:
    def __init__(self, host, types, outbound):
        net = f"{1 + (PID >> 8) % 254}.{PID & 255}"
        self.file = tempfile.NamedTemporaryFile("w", suffix=".yaml")
        self.file.write(CONFIG.format(net=net, host=host, domain=DOMAIN, share=ROS / "share"))
        for i, type_name in enumerate(types):
            self.file.write(ROUTE.format(way="in" if outbound else "out", i=i, type=type_name, event=0x8001 + i,
                                         direction="dds_to_someip" if outbound else "someip_to_dds",
                                         port=", port: 40001" if outbound else ""))
        self.file.flush()
        self.log = tempfile.TemporaryFile("a+")
        self.process = subprocess.Popen([TRESTLE, "bridge", self.file.name], stdout=self.log, stderr=self.log)

    def finish(self):
        self.process.send_signal(signal.SIGINT)
        code = self.process.wait(PATIENCE)
        self.log.seek(0)
        text = self.log.read()
        self.log.close()
        self.file.close()
        return code, text


def installed_messages():
    share = ROS / "share"
    names = [".".join(file.relative_to(share).parts) for file in share.glob("*/msg/*.msg")]
    names = [name.removesuffix(".msg").replace(".", "/") for name in names]
    # The texts of test_msgs stand twice.
    return sorted(name for name in names if not name.startswith("test_interface_files/"))


class Topics(unittest.TestCase):
    def test_every_message_comes_back_as_it_was_published(self):
        types = installed_messages()
        self.assertGreater(len(types), 160)
        bridges = [Bridge(11, types, outbound=True), Bridge(12, types, outbound=False)]
        rclpy.init()
        node = rclpy.create_node("trestle_topics_test")
        try:
            self.compare(node, types, bridges)
        finally:
            node.destroy_node()
            rclpy.shutdown()
            ends = [bridge.finish() for bridge in bridges]
        for code, log in ends:
            self.assertEqual(code, 0, log)

    def compare(self, node, types, bridges):
        sent, received, publishers = [], {}, []
        qos = QoSProfile(depth=10)
        for i, name in enumerate(types):
            cls = golden.class_of(name)
            values = golden.random_values(random.Random(name), name, golden.installed_members)
            sent.append(golden.message_with(name, values))
            publishers.append(node.create_publisher(cls, f"/in/t{i}", qos))
            node.create_subscription(cls, f"/out/t{i}", lambda message, at=i: received.setdefault(at, message), qos)
        # As bag players do, too: such samples may be longer than their messages.
        for prepare in (lambda message: message, serialize_message):
            received.clear()
            end, again = time.monotonic() + PATIENCE, 0
            while len(received) < len(types) and time.monotonic() < end:
                for bridge in bridges:
                    self.assertIsNone(bridge.process.poll(), "a bridge ended")
                if time.monotonic() > again:  # until all have met
                    again = time.monotonic() + 1
                    for i, publisher in enumerate(publishers):
                        if i not in received:
                            publisher.publish(prepare(sent[i]))
                rclpy.spin_once(node, timeout_sec=0.05)
            self.assertEqual([name for i, name in enumerate(types) if i not in received], [], "nothing came of these")
            for i, name in enumerate(types):
                self.assertEqual(received[i], sent[i], name)
        self.check_graph(node, types)

    def check_graph(self, node, types):
        """What `ros2 topic info -v` asks for: the bridge is a node, and its types are those of ROS 2."""
        for i, name in enumerate(types):
            end = time.monotonic() + PATIENCE
            while True:  # whose they are is told later than what they are
                ours = node.get_publishers_info_by_topic(f"/out/t{i}")
                if time.monotonic() > end or not {one.node_name for one in ours} & {"_CREATED_BY_BARE_DDS_APP_", "_NODE_NAME_UNKNOWN_"}:
                    break
                rclpy.spin_once(node, timeout_sec=0.05)
            theirs = node.get_publishers_info_by_topic(f"/in/t{i}")
            self.assertEqual([one.topic_type for one in ours], [name])
            self.assertEqual(str(ours[0].topic_type_hash), str(theirs[0].topic_type_hash), name)
            self.assertNotIn(ours[0].node_name, ("_CREATED_BY_BARE_DDS_APP_", "_NODE_NAME_UNKNOWN_"))


if __name__ == "__main__":
    atexit.register(shutil.rmtree, os.environ["ROS_HOME"])
    unittest.main()
