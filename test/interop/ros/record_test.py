#!/usr/bin/env python3
"""record_test.py TRESTLE: trestle record and trestle replay beside a ROS 2 node: the library rosbags, which has a CDR decoder of
its own, and the library mcap read what the one wrote, and all is what the node sent. The other one sends a bag that rosbags
wrote, and the node gets what is in it."""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import ros_test  # beside this file; goes on with the Python of ROS 2
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String

try:
    from mcap.reader import make_reader
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
    from rosbags.rosbag2 import Reader, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore
except ImportError:
    ros_test.peer.missing("ros")
from bags_test import same

STORE = get_typestore(Stores.ROS2_JAZZY)
PATIENCE = ros_test.PATIENCE
FAST = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Records(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def start(self, *arguments, domain=1):
        process = subprocess.Popen([ros_test.program, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env={**os.environ, "ROS_DOMAIN_ID": str(domain)})

        def end():
            if process.poll() is None:
                process.kill()
            process.communicate()
        self.addCleanup(end)
        return process

    def finish(self, process):
        process.send_signal(signal.SIGINT)
        output, errors = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 0, errors)
        return output, errors

    def ros(self, domain, name):
        one = ros_test.Ros(domain, name)
        self.addCleanup(one.close)
        return one

    def record(self, messages, *arguments):
        """What a node sends is recorded in a bag: topic -> (quality of service, messages)."""
        player = ros_test.Ros(1, "player")  # until it has sent: what is latched would come again
        publishers = {topic: player.node.create_publisher(type(sent[0]), topic, qos) for topic, (qos, sent) in messages.items()}
        bag = self.folder / "bag"
        recorder = self.start("record", "-o", bag, "--progress", *arguments)
        self.assertTrue(player.wait(lambda: all(one.get_subscription_count() for one in publishers.values())))
        for number in range(max(len(sent) for _, sent in messages.values())):
            for topic, (_, sent) in messages.items():
                if number < len(sent):
                    publishers[topic].publish(sent[number])
            time.sleep(0.01)
        number = sum(len(sent) for _, sent in messages.values())
        end = time.monotonic() + PATIENCE
        while json.loads(recorder.stdout.readline())["messages"] < number and time.monotonic() < end:  # a line a second
            pass
        self.finish(recorder)
        player.close()
        return bag

    def messages(self):
        return {"/text": (LATCHED, [String(data="é" * n) for n in range(30)]),
                "/points": (FAST, [ros_test.cloud(seed, 1000) for seed in range(5)]  # smaller than buffers: none may be lost
                )}

    def test_rosbags_reads_what_a_node_sent(self):
        sent = self.messages()
        for compression in ("zstd", "lz4", "none"):
            with self.subTest(compression):
                bag = self.record(sent, "--topics", "/text", "/poi*", "--compression", compression)
                with Reader(bag) as reader:
                    kinds = {one.topic: one for one in reader.connections}
                    self.assertEqual(set(kinds), {"/text", "/points"})
                    self.assertEqual(kinds["/points"].msgtype, "sensor_msgs/msg/PointCloud2")
                    qos = {topic: one.ext.offered_qos_profiles[0] for topic, one in kinds.items()}
                    self.assertEqual((qos["/text"].durability, qos["/text"].reliability),
                                     (QosDurability.TRANSIENT_LOCAL, QosReliability.RELIABLE))
                    self.assertEqual(qos["/points"].reliability, QosReliability.BEST_EFFORT)
                    for topic, (_, expected) in sent.items():
                        read = [STORE.deserialize_cdr(data, connection.msgtype)
                                for connection, _, data in reader.messages(connections=[kinds[topic]])]
                        self.assertEqual(len(read), len(expected))
                        self.assertTrue(all(same(*pair) for pair in zip(expected, read)))
                with open(bag / "bag_0.mcap", "rb") as stream:
                    for schema, channel, message in make_reader(stream).iter_messages():
                        self.assertEqual((schema.encoding, channel.message_encoding), ("ros2msg", "cdr"))
                        self.assertRegex(channel.metadata["topic_type_hash"], "^RIHS01_")
                        self.assertLessEqual(message.publish_time, message.log_time)
            for file in bag.iterdir():
                file.unlink()
            bag.rmdir()

    def test_a_node_gets_what_rosbags_wrote(self):
        never = QosTime(9223372036, 854775807)
        bag, sent = self.folder / "theirs", self.messages()
        with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            for topic, (qos, messages) in sent.items():
                kind = f"{type(messages[0]).__module__.split('.')[0]}/msg/{type(messages[0]).__name__}"
                connection = writer.add_connection(topic, kind, typestore=STORE, offered_qos_profiles=[Qos(
                    QosHistory.KEEP_LAST, 50, QosReliability.RELIABLE if qos is LATCHED else QosReliability.BEST_EFFORT,
                    QosDurability.TRANSIENT_LOCAL if qos is LATCHED else QosDurability.VOLATILE, never, never,
                    QosLiveliness.AUTOMATIC, never, False)])
                for number, message in enumerate(messages):
                    writer.write(connection, 10**18 + number * 2 * 10**7, bytes(serialize_message(message)))
        watcher = self.ros(2, "watcher")
        got = {topic: [] for topic in sent}
        for topic, (qos, messages) in sent.items():
            watcher.node.create_subscription(type(messages[0]), topic, got[topic].append, qos)
        # Who reads with best effort loses what comes before it has found its writer.
        player = self.start("replay", bag, "--wait", PATIENCE, "--delay", 3, domain=2)
        self.assertTrue(watcher.wait(lambda: all(len(got[topic]) == len(messages) for topic, (_, messages) in sent.items())),
                        {topic: len(messages) for topic, messages in got.items()})
        self.assertEqual(got, {topic: messages for topic, (_, messages) in sent.items()})
        output, errors = player.communicate(timeout=PATIENCE)
        self.assertEqual((player.returncode, output), (0, "35 messages replayed\n"), errors)
        self.assertIn("writing /text (std_msgs/msg/String), reliable, transient local\n", errors)


if __name__ == "__main__":
    unittest.main()
