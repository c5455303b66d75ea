#!/usr/bin/env python3
"""bags_test.py TRESTLE: a ROS 2 node records what two bridges carried into a bag, as rosbag2 does: the samples as they
came. The library rosbags, which has a CDR decoder of its own, reads it; then the bag is played through the bridges."""
import array
import pathlib
import tempfile
import time
import unittest

import ros_test  # beside this file; goes on with the Python of ROS 2
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String

try:
    from rosbags.rosbag2 import Reader, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore
except ImportError:
    ros_test.peer.missing("ros")

TOPICS = {"/chatter": String, "/points": PointCloud2}  # from domain 1 to domain 2
STORE = get_typestore(Stores.ROS2_JAZZY)


def name_of(kind):
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"


def same(sent, read):
    """A message of rclpy and what rosbags made of it, or a member of each."""
    if hasattr(sent, "get_fields_and_field_types"):
        return all(same(getattr(sent, field), getattr(read, field)) for field in sent.get_fields_and_field_types())
    if isinstance(sent, (list, array.array)):
        return len(sent) == len(read) and all(same(*pair) for pair in zip(sent, read))
    return sent == read


class Bags(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        for end in "ab":
            # Best effort would lose some, which says nothing of bags.
            text = ros_test.configuration(end).replace("reliability: best_effort, depth: 5", "depth: 50")
            self.addCleanup(ros_test.Bridge(folder.name, end, text).stop)
        self.player = ros_test.Ros(1, "player")
        self.addCleanup(self.player.close)
        self.recorder = ros_test.Ros(2, "recorder")
        self.addCleanup(self.recorder.close)
        qos = QoSProfile(depth=50)
        self.samples = []  # topic and CDR, as they came
        for topic, kind in TOPICS.items():
            self.recorder.node.create_subscription(
                kind, topic, lambda cdr, topic=topic: self.samples.append((topic, cdr)), qos, raw=True)
        self.publishers = {topic: self.player.node.create_publisher(kind, topic, qos)
                           for topic, kind in TOPICS.items()}
        self.meet()

    def meet(self):
        """Until something of each topic arrives, and nothing more is under way."""
        met = set()

        def tell():
            for topic, kind in TOPICS.items():
                if topic not in met:
                    self.publishers[topic].publish(kind())
            self.recorder.executor.spin_once(timeout_sec=0.05)
            met.update(topic for topic, _ in self.samples)
            return len(met) == len(TOPICS)

        end = time.monotonic() + ros_test.PATIENCE
        while not tell():
            self.assertLess(time.monotonic(), end, f"only {met} arrive")
        self.recorder.wait(lambda: False, 0.5)
        self.samples.clear()

    def carry(self, messages):
        """Each arrives before the next one leaves, as a bag player that waits for its topics would have it."""
        self.samples.clear()
        for number, (topic, message) in enumerate(messages, 1):
            self.publishers[topic].publish(message)
            self.assertTrue(self.recorder.wait(lambda: len(self.samples) >= number), f"message {number} of {topic}")
        self.assertEqual([topic for topic, _ in self.samples], [topic for topic, _ in messages])
        return list(self.samples)

    def write(self, samples, storage):
        bag = self.folder / f"bag_{storage.name}"
        with Writer(bag, version=9, storage_plugin=storage) as writer:
            connections = {topic: writer.add_connection(topic, name_of(kind), typestore=STORE)
                           for topic, kind in TOPICS.items()}
            for number, (topic, cdr) in enumerate(samples):
                writer.write(connections[topic], number, cdr)
        return bag

    def test_what_is_recorded_is_read_and_played_again(self):
        sent = [("/chatter", String(data="hello")), ("/points", ros_test.cloud(1)), ("/chatter", String(data="")),
                ("/points", ros_test.cloud(2)), ("/chatter", String(data="ä€\U0001f600"))]
        recorded = self.carry(sent)
        for storage in StoragePlugin:
            with Reader(self.write(recorded, storage)) as reader:
                bag = [(connection.topic, bytes(cdr), STORE.deserialize_cdr(cdr, connection.msgtype))
                       for connection, _, cdr in reader.messages()]
            self.assertEqual([topic for topic, _, _ in bag], [topic for topic, _ in sent])
            for (topic, message), (_, _, read) in zip(sent, bag):
                self.assertTrue(same(message, read), f"{topic}: {read}")
            for (topic, played), (_, cdr, _) in zip(self.carry([(topic, cdr) for topic, cdr, _ in bag]), bag):
                self.assert_equal(topic, bytes(played), cdr)

    def assert_equal(self, topic, ours, theirs):
        """As assertEqual, which would look for hours at where clouds differ."""
        if ours != theirs:
            at = next((i for i, pair in enumerate(zip(ours, theirs)) if pair[0] != pair[1]), min(len(ours), len(theirs)))
            self.fail(f"{topic}: {len(ours)} and {len(theirs)} bytes differ from byte {at} on: "
                      f"{ours[at:at + 16].hex()} and {theirs[at:at + 16].hex()}")

    def test_the_comparison_sees_differences(self):
        cdr = bytes(serialize_message(ros_test.cloud(1)))
        read = STORE.deserialize_cdr(cdr, "sensor_msgs/msg/PointCloud2")
        self.assertTrue(same(ros_test.cloud(1), read))
        self.assertFalse(same(ros_test.cloud(2), read))


if __name__ == "__main__":
    unittest.main(buffer=True)
