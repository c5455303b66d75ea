#!/usr/bin/env python3
"""mcap_peers_test.py RECORD_COPY: the libraries mcap and rosbags write files, record_copy reads these with our reader and
writes others with our writer, and the libraries read those: every message is the same, byte for byte.

Without the libraries, which `./run setup --peers` installs below build/, it is skipped (77); with TRESTLE_REQUIRE_PEERS=1
in the environment that is a failure."""
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

ROS = pathlib.Path(os.environ.get("TRESTLE_ROS") or pathlib.Path(__file__).resolve().parents[3] / "build/ros")


def missing():
    required = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) & {"1", "ros"}
    print(f"{'missing' if required else 'skipped'}: mcap; ./run setup --peers installs it")
    sys.exit(1 if required else 77)


if pathlib.Path(sys.prefix).resolve() != ROS.resolve():
    if not (ROS / "bin/python").exists():
        missing()
    os.execv(ROS / "bin/python", [ROS / "bin/python", "-B", *sys.argv])
try:
    from mcap.reader import NonSeekingReader, SeekingReader
    from mcap.writer import CompressionType, IndexType, Writer
    from rosbags.rosbag2 import Reader, StoragePlugin
    from rosbags.rosbag2 import Writer as BagWriter
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
except ImportError:
    missing()

COPY = sys.argv.pop(1)
STORE = get_typestore(Stores.ROS2_JAZZY)
QOS = ("- history: 3\n  depth: 0\n  reliability: 1\n  durability: 2\n"
       "  deadline: {sec: 9223372036, nsec: 854775807}\n  lifespan: {sec: 9223372036, nsec: 854775807}\n  liveliness: 1\n"
       "  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}\n  avoid_ros_namespace_conventions: false\n")
# Of everything that a writer may do or leave out; a file without summary is read to its end for that.
WRITERS = {
    "default": {},
    "zstd": {"compression": CompressionType.ZSTD, "chunk_size": 4000},
    "lz4": {"compression": CompressionType.LZ4, "chunk_size": 4000},
    "none": {"compression": CompressionType.NONE, "chunk_size": 4000},
    "no chunks": {"use_chunking": False},
    "no index": {"index_types": IndexType.NONE},
    "no summary": {"index_types": IndexType.NONE, "use_statistics": False, "repeat_channels": False,
                   "repeat_schemas": False, "use_summary_offsets": False},
    "no schemas again": {"repeat_schemas": False},
    "all sums": {"enable_crcs": True, "enable_data_crcs": True},
}


def read(path, reader=SeekingReader):
    """What is in a file, by the library mcap."""
    with open(path, "rb") as stream:
        return [(channel.topic, channel.message_encoding, schema and (schema.name, schema.encoding, schema.data), channel.metadata,
                 message.sequence, message.log_time, message.publish_time, message.data)
                for schema, channel, message in reader(stream, validate_crcs=True).iter_messages()]


class Mcap(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def copy(self, given, compression="lz4", chunk=4000):
        folder = self.folder / f"copy_{len(list(self.folder.iterdir()))}"
        folder.mkdir()
        result = folder / "copy.mcap"
        done = subprocess.run([COPY, given, result, compression, str(chunk)], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return result, done.stdout

    def write(self, name, **options):
        """A file by the library mcap."""
        some = random.Random(1)
        path = self.folder / f"{name}.mcap"
        with open(path, "wb") as stream:
            writer = Writer(stream, **options)
            writer.start(profile="ros2", library="test")
            schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
            channels = [writer.register_channel("/text", "cdr", schema, {"offered_qos_profiles": QOS}),
                        writer.register_channel("/someip/0x1234/0x8001", "someip", 0),
                        writer.register_channel("/never", "cdr", schema)]
            writer.add_attachment(0, 0, "photo.png", "image/png", some.randbytes(3000))
            writer.add_metadata("of the test", {"key": "value"})
            for number in range(200):
                data = some.randbytes(some.randrange(200)) if number % 2 else b"\0\1\0\0" + bytes(some.randrange(200))
                writer.add_message(channels[number % 2], 10**18 + 1000 * number, data, 10**18 + number, sequence=number)
            writer.finish()
        return path

    def test_reads_what_others_write_and_writes_what_they_read(self):
        for name, options in WRITERS.items():
            given = self.write(name, **options)
            expected = read(given, NonSeekingReader)
            self.assertEqual(len(expected), 200)
            for compression in ("none", "lz4", "zstd"):
                for chunk in (1, 4000, 1 << 20):
                    with self.subTest(name, compression=compression, chunk=chunk):
                        copied, said = self.copy(given, compression, chunk)
                        self.assertEqual(said, "200 messages" + (", no summary" if name in ("no summary", "no schemas again") else "") + "\n")
                        self.assertEqual(read(copied), expected)
                        self.assertEqual(read(copied, NonSeekingReader), expected)

    def test_writes_a_summary_by_which_others_find_their_way(self):
        copied, _ = self.copy(self.write("default"), chunk=2000)
        with open(copied, "rb") as stream:
            reader = SeekingReader(stream, validate_crcs=True)
            summary = reader.get_summary()
            self.assertEqual(summary.statistics.message_count, 200)
            self.assertEqual(summary.statistics.channel_message_counts, {1: 100, 2: 100})
            self.assertEqual((summary.statistics.message_start_time, summary.statistics.message_end_time),
                             (10**18, 10**18 + 199_000))
            self.assertEqual(summary.statistics.chunk_count, len(summary.chunk_indexes))
            self.assertGreater(len(summary.chunk_indexes), 5)
            self.assertEqual([one.name for one in reader.iter_metadata()], ["of the test"])
            some = [message.sequence for _, _, message in
                    reader.iter_messages(topics=["/text"], start_time=10**18 + 50_000, end_time=10**18 + 60_000)]
            self.assertEqual(some, [50, 52, 54, 56, 58])

    def test_what_a_killed_writer_left_is_read_up_to_the_last_whole_chunk(self):
        copied, _ = self.copy(self.write("default"), chunk=2000)
        whole = read(copied)
        data = copied.read_bytes()
        with open(copied, "rb") as stream:
            chunks = SeekingReader(stream).get_summary().chunk_indexes
        third = chunks[2]
        for cut in (third.chunk_start_offset + 9, third.chunk_start_offset + third.chunk_length - 1):
            path = self.folder / f"cut_{cut}.mcap"
            path.write_bytes(data[:cut])
            again, said = self.copy(path)
            left = read(again)
            self.assertEqual(left, whole[:len(left)])
            self.assertIn(f"no summary, cut off at {third.chunk_start_offset}", said)
            self.assertEqual(len(left), sum(1 for one in whole if one[5] < third.message_start_time))

    def test_rosbags_takes_the_folder_for_a_bag(self):
        String, Cloud = (STORE.types[f"{name}"] for name in ("std_msgs/msg/String", "sensor_msgs/msg/PointField"))
        sent = [String(data="é" * n) for n in range(30)] + [Cloud(name="x", offset=1, datatype=7, count=n) for n in range(30)]
        bag = self.folder / "bag"
        with BagWriter(bag, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
            connections = {kind: writer.add_connection(topic, kind.__msgtype__, typestore=STORE)
                           for topic, kind in (("/text", String), ("/field", Cloud))}
            for number, message in enumerate(sent):
                writer.write(connections[type(message)], 10**18 + number,
                             STORE.serialize_cdr(message, message.__msgtype__))
        copied, _ = self.copy(next(bag.glob("*.mcap")), "zstd")
        for path in (copied.parent, copied):
            with Reader(path) as reader:
                self.assertEqual({one.topic: one.msgcount for one in reader.connections}, {"/text": 30, "/field": 30})
                self.assertEqual((reader.message_count, reader.start_time, reader.duration), (60, 10**18, 60))
                self.assertEqual([STORE.deserialize_cdr(data, connection.msgtype) for connection, _, data in reader.messages()], sent)

    def test_schemas_are_what_ros_says_of_its_types(self):
        path = self.folder / "schemas.mcap"
        subprocess.run([COPY, "schemas", path], check=True)
        compared = 0
        for _, _, (name, encoding, data), *_ in read(path):
            self.assertEqual(encoding, "ros2msg")
            types = get_types_from_msg(data.decode(), name)
            for one, (constants, fields) in types.items():
                if one in STORE.fielddefs:
                    known_constants, known_fields = STORE.fielddefs[one]
                    # What rosidl puts into C++ and CDR of a message without fields; it is in no .msg file.
                    known_fields = [field for field in known_fields if field[0] != "structure_needs_at_least_one_member"]
                    self.assertEqual((one, fields), (one, known_fields))
                    # What is compiled in has no constants, which play no part on the wire.
                    self.assertLessEqual({constant[0] for constant in constants}, {constant[0] for constant in known_constants})
                    compared += 1
        self.assertGreater(compared, 150)

    def test_damage_is_told_with_its_place(self):
        copied, _ = self.copy(self.write("default"), "none", 1 << 20)
        data = bytearray(copied.read_bytes())
        at = data.index(b"\x06", 8 + 9)  # the chunk, behind the header
        data[at + 1000] ^= 1
        (self.folder / "damaged.mcap").write_bytes(data)
        done = subprocess.run([COPY, self.folder / "damaged.mcap", self.folder / "none.mcap", "lz4", "1"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, rf"^at byte {at + 9 + 24}, chunk.uncompressed_crc: 0x")


if __name__ == "__main__":
    unittest.main()
