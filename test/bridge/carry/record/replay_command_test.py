#!/usr/bin/env python3
"""trestle replay: what `trestle record` wrote, and captures, to topics and to SOME/IP.

Usage: replay_command_test.py TRESTLE CAPTURES
"""
import os
import re
import signal
import struct
import time
import unittest
import zlib

from record_program import CAPTURES, HELLO, NETWORK, PATIENCE, PEER, RecordTest, decoded
from bridge_program import BRIDGE, DOMAIN, head
from plain_mcap import MAGIC, Mcap

ENVIRONMENT = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)}
SECOND = 10**9


def text(value):
    return struct.pack("<I", len(value)) + value


def record(opcode, body):
    return struct.pack("<BQ", opcode, len(body)) + body


def mcap(messages, topic=b"/text"):
    """A file as another writer may make it, without chunks and without a summary: times and data of messages."""
    body = record(1, text(b"ros2") + text(b"by hand"))
    body += record(3, struct.pack("<H", 1) + text(b"std_msgs/msg/String") + text(b"ros2msg") + text(b"string data\n"))
    qos = b"- {history: 3, depth: 0, reliability: 1, durability: 1}"
    body += record(4, struct.pack("<HH", 1, 1) + text(topic) + text(b"cdr") + text(text(b"offered_qos_profiles") + text(qos)))
    for number, (at, data) in enumerate(messages):
        body += record(5, struct.pack("<HIQQ", 1, number, at, at) + data)
    return MAGIC + body + record(15, bytes(4)) + record(2, bytes(20)) + MAGIC


class Replay(RecordTest):
    def record_both(self):
        """A recording of a bridge that carries, as MCAP and as frames; and the bridge's configuration."""
        config = self.start_bridge()
        sender = self.start_events()
        target = self.folder / "both.mcap"
        recorder = self.start("record", "-o", target, "--config", config, "--interface", "lo", "--compression", "none",
                              "--pcapng", self.folder / "both.pcapng", "-q")
        self.wait(lambda: min(self.counts(target).get(topic, 0) for topic in ("/text", "/someip/0x2222/0x8001")) > 20,
                  "nothing is recorded")
        recorder.send_signal(signal.SIGINT)
        recorder.communicate(timeout=PATIENCE)
        sender.kill()
        self.end_all()
        return target, self.folder / "both.pcapng", config

    def end_all(self):
        """Bridge and service are gone; what is on the network from now on comes from the replay."""
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.wait()

    def setUp(self):
        super().setUp()
        self.processes = []

    def start(self, *command, **settings):
        process = super().start(*command, **settings)
        self.processes.append(process)
        return process

    def replayed(self, *arguments, topic="/text", dropped=0):
        """What a recorder gets of a topic while a file is replayed, and what the replay says. `dropped`: so many never arrive."""
        target = self.folder / f"again_{len(list(self.folder.iterdir()))}.mcap"
        recorder = self.start("record", "-o", target, "--topics", "/**", "--compression", "none", "-q", env=ENVIRONMENT)
        self.wait(target.exists, "the recorder does not start")
        output, errors = self.run_trestle("replay", *arguments, "--wait", PATIENCE, environment=ENVIRONMENT)
        number = int(re.search(r"^(\d+) messages replayed$", output, re.MULTILINE)[1])
        self.wait(lambda: sum(self.counts(target).values()) >= number - dropped, "not all is recorded again")
        recorder.send_signal(signal.SIGINT)
        recorder.communicate(timeout=PATIENCE)
        return [one for one in Mcap(target).messages if one[0] == topic], output, errors

    def test_topics_come_again_as_they_were(self):
        mcap_file, _, _ = self.record_both()
        sent = [one for one in Mcap(mcap_file).messages if one[0] == "/text"]
        got, output, errors = self.replayed(mcap_file, "--remap", "/text:=/old/text", topic="/old/text")
        self.assertEqual([one[-1] for one in got], [one[-1] for one in sent])
        self.assertIn("durability: 1", got[0][2]["offered_qos_profiles"])
        self.assertEqual(got[0][2]["topic_type_hash"], sent[0][2]["topic_type_hash"])
        self.assertIn(f"{len(sent)} messages replayed\n", output)
        self.assertRegex(output, r"not replayed: \d+ SOME/IP messages, which need --config or --to someip\n")
        self.assertIn("writing /old/text (std_msgs/msg/String), reliable, transient local\n", errors)

    def test_a_capture_becomes_topics_through_the_routes_of_a_bridge(self):
        mcap_file, capture, config = self.record_both()
        for given in (capture, mcap_file):
            with self.subTest(given.suffix):
                events = [one for one in decoded(capture) if one["message_type"] == "NOTIFICATION" and one["service"] == "0x2222"]
                got, output, _ = self.replayed(given, "--config", config, "-q")
                self.assertEqual([one[-1][:14] for one in got], [HELLO] * len(events))
                self.assertIn(f"{len(events)} messages replayed\n", output)
                self.assertRegex(output, r"not replayed: \d+ calls, answers and messages of discovery\n")

    def test_end_to_end_protection_is_checked_and_taken_out(self):
        """Of vsomeip, profile 1: number and value behind 2 bytes. Of the first message the profile has no opinion."""
        (self.folder / "car/msg").mkdir(parents=True)
        (self.folder / "car/msg/Six.msg").write_text("uint16 number\nuint32 value\n")
        config = self.folder / "bridge.yaml"
        config.write_text(head(BRIDGE) + f"""\
types: {{paths: [{self.folder}]}}
routes:
  - {{topic: /six, type: car/msg/Six, direction: someip_to_dds, service: 0x1234, instance: 1, eventgroup: 1, event: 0x8031,
     minor: any, qos: {{durability: transient_local}},
     e2e: {{profile: 1, data_id: 0xa73, data_id_mode: nibble, data_bits: 64, payload_only: true}}}}
""")
        got, output, _ = self.replayed(CAPTURES / "e2e_events_p01_p04_p05_p07_crc32.pcap", "--config", config, topic="/six", dropped=1)
        self.assertEqual([one[-1].hex(" ", 4) for one in got],
                         ["00010000 02000000 dbbc9d7e", "00010000 03000000 dcbd9e7f", "00010000 04000000 ddbe9f80"])
        self.assertIn("1 route /six from SOME/IP: e2e_wrong_sequence\n", output)
        self.assertIn("18 events that no route takes\n", output)

    def test_events_of_a_capture_are_offered_and_sent(self):
        _, capture, _ = self.record_both()
        events = [one for one in decoded(capture) if one["message_type"] == "NOTIFICATION" and one["service"] == "0x2222"]
        receiver = self.start("subscribe", "0x2222.1", "1", "--address", BRIDGE, *NETWORK, "--count", str(len(events)), "-q")
        output, errors = self.run_trestle("replay", capture, "--to", "someip", "--address", PEER, *NETWORK, "--wait", PATIENCE)
        self.assertIn("offering 0x2222.0x0001 with 1 eventgroup\n", errors)
        self.assertIn(f"{len(events)} messages replayed\n", output)
        received, _ = receiver.communicate(timeout=PATIENCE)
        self.assertEqual(len(re.findall("68 ?65 ?6c ?6c ?6f", received)), len(events), received)

    def test_goes_at_the_speed_that_it_is_told(self):
        path = self.folder / "slow.mcap"
        path.write_bytes(mcap([(SECOND * 1000, HELLO), (SECOND * 1000 + 100 * SECOND, HELLO), (SECOND * 1000 + 200 * SECOND, HELLO)]))
        for speed, least in ((1000, 0.2), (200, 1.0)):
            start = time.monotonic()
            self.run_trestle("replay", path, "--speed", speed, "--delay", "0", environment=ENVIRONMENT)
            took = time.monotonic() - start
            self.assertGreater(took, least)
            self.assertLess(took, 100)

    def test_what_was_recorded_late_is_sent_at_once(self):
        path = self.folder / "late.mcap"
        path.write_bytes(mcap([(100 * SECOND, HELLO), (SECOND, HELLO)]))
        output, _ = self.run_trestle("replay", path, "--delay", "0", environment=ENVIRONMENT)
        self.assertIn("2 messages replayed\n", output)

    def test_goes_on_in_a_loop_until_it_is_stopped(self):
        path = self.folder / "short.mcap"
        path.write_bytes(mcap([(SECOND, HELLO), (SECOND + SECOND // 50, HELLO)]))
        target = self.folder / "again.mcap"
        self.start("record", "-o", target, "--topics", "/text", "--compression", "none", "-q", env=ENVIRONMENT)
        player = self.start("replay", path, "--loop", "-q", env=ENVIRONMENT)
        self.wait(lambda: self.counts(target).get("/text", 0) > 10, "no loop")
        player.send_signal(signal.SIGINT)
        player.communicate(timeout=PATIENCE)
        self.assertEqual(player.returncode, 0)

    def test_a_recording_that_was_not_finished(self):
        path = self.folder / "cut.mcap"
        whole = mcap([(SECOND, HELLO), (SECOND, HELLO)])
        path.write_bytes(whole[:-len(MAGIC) - 29 - 13 - 3])
        output, errors = self.run_trestle("replay", path, "--delay", "0", environment=ENVIRONMENT)
        self.assertIn("1 messages replayed\n", output)
        self.assertRegex(errors, r"warning: .*cut.mcap was not finished: it is whole up to byte \d+\n")

    def test_what_cannot_be_replayed(self):
        path = self.folder / "damaged.mcap"
        chunk = struct.pack("<QQQI", 0, 0, 3, zlib.crc32(b"abc") ^ 1) + text(b"") + struct.pack("<Q", 3) + b"abc"
        path.write_bytes(MAGIC + record(1, text(b"ros2") + text(b"")) + record(6, chunk) + record(15, bytes(4)) +
                         record(2, bytes(20)) + MAGIC)
        _, errors = self.run_trestle("replay", path, status=1)
        self.assertRegex(errors, r"damaged.mcap is damaged at byte \d+, chunk.uncompressed_crc: ")
        capture = CAPTURES / "rr_udp.pcap"
        for arguments, words in (([self.folder / "none"], "No such file"), ([capture], "add --config FILE, or --to someip"),
                                 ([capture, "--to", "someip", "--address", PEER], "no SOME/IP event that can be sent")):
            with self.subTest(arguments):
                self.assertIn(words, self.run_trestle("replay", *arguments, status=1, environment=ENVIRONMENT)[1])
        self.folder.joinpath("empty").mkdir()
        self.assertIn("has no MCAP file", self.run_trestle("replay", self.folder / "empty", status=1)[1])
        good = self.folder / "good.mcap"
        good.write_bytes(mcap([(SECOND, HELLO)]))
        self.assertIn("none of these topics", self.run_trestle("replay", good, "--topics", "/other", status=1, environment=ENVIRONMENT)[1])
        self.assertIn("no SOME/IP event", self.run_trestle("replay", good, "--to", "someip", "--address", PEER, *NETWORK, status=1)[1])

    def test_wrong_command_lines(self):
        path = self.folder / "good.mcap"
        path.write_bytes(mcap([(SECOND, HELLO)]))
        for arguments, words in ((["--to", "ros"], "--to"), (["--speed", "0"], "--speed"), (["--remap", "/a:/b"], "expected two topics"),
                                 (["--to", "someip", "--topics", "/a"], "is for --to dds"), (["--config", self.folder / "none"], "cannot be read")):
            with self.subTest(arguments):
                self.assertIn(words, self.run_trestle("replay", path, *arguments, status=2)[1])


if __name__ == "__main__":
    unittest.main()
