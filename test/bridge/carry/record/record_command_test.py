#!/usr/bin/env python3
"""trestle record: captures, the live traffic of a network namespace, and the topics of a bridge.

Usage: record_command_test.py TRESTLE CAPTURES
"""
import json
import os
import signal
import subprocess
import unittest

from record_program import CAPTURES, HELLO, PATIENCE, PEER, TRESTLE, RecordTest, decoded
from bridge_program import DOMAIN
from plain_mcap import Mcap


def header(data):
    """Service, method and payload of a message."""
    return f"0x{data[:2].hex()}", f"0x{data[2:4].hex()}", data[16:].hex()


class Record(RecordTest):
    def test_a_capture_becomes_messages(self):
        for name in ("rr_udp", "rr_tcp_magic_cookies", "tp_event_small_to_256k", "sd_multicast_eventgroup",
                     "npdu_several_messages_per_datagram"):
            with self.subTest(name):
                capture, target = CAPTURES / f"{name}.pcap", self.folder / f"{name}.mcap"
                output, _ = self.run_record("-o", target, "--capture", capture, "--compression", "none", "--chunk-size", "10KiB")
                file, expected = Mcap(target), decoded(capture)
                self.assertTrue(file.is_whole)
                self.assertEqual(len(file.messages), len(expected))
                self.assertIn(f"{len(expected)} messages in {target}\n", output)
                for (topic, encoding, metadata, session, log_time, sent, data), one in zip(file.messages, expected):
                    self.assertEqual(encoding, "someip")
                    service, method, payload = header(data)
                    self.assertEqual((service, method, payload), (one["service"], one["method"], one["payload"]))
                    self.assertEqual(topic, "/someip/sd" if service == "0xffff" and method == "0x8100" else f"/someip/{service}/{method}")
                    self.assertEqual((metadata["from"], metadata["to"], metadata["transport"]),
                                     (one["src"], one["dst"], one["transport"]))
                    self.assertEqual(log_time, sent)
                    self.assertEqual(session, int(one["session"], 16))
                self.assertEqual(file.metadata["trestle"]["messages"], str(len(expected)))

    def test_a_channel_tells_the_instance_that_discovery_offered(self):
        target = self.folder / "events.mcap"
        self.run_record("-o", target, "--capture", CAPTURES / "sd_multicast_eventgroup.pcap", "--compression", "none")
        events = [metadata for topic, _, metadata, *_ in Mcap(target).messages if topic != "/someip/sd"]
        self.assertTrue(events)
        for metadata in events:
            self.assertRegex(metadata["instance"], "^0x[0-9a-f]{4}$")
            self.assertIn("major", metadata)

    def test_descriptions_name_topics(self):
        description = self.folder / "door.json"
        capture = CAPTURES / "rr_udp.pcap"
        call = next(one for one in decoded(capture) if not one.get("sd"))
        (self.folder / "Door.fidl").write_text("package car\ninterface Door { version { major %d minor 0 }\n"
                                               " method open { in { UInt8 a } } }\n" % int(call["interface_version"]))
        (self.folder / "Door.fdepl").write_text(
            'import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-SOMEIP_deployment_spec.fdepl"\n'
            'import "Door.fidl"\ndefine org.genivi.commonapi.someip.deployment for interface car.Door {\n'
            f' SomeIpServiceID = {int(call["service"], 16)}\n method open {{ SomeIpMethodID = {int(call["method"], 16)} }}\n}}\n')
        self.assertFalse(description.exists())
        target = self.folder / "named.mcap"
        self.run_record("-o", target, "--capture", capture, "--compression", "none", "--interfaces", self.folder / "Door.fidl",
                        self.folder / "Door.fdepl")
        self.assertIn("/someip/Door/open", {topic for topic, *_ in Mcap(target).messages})

    def test_frames_of_someip_are_a_capture_again(self):
        for name in ("rr_tcp", "sd_multicast_eventgroup", "tp_event_multicast"):
            with self.subTest(name):
                capture, frames = CAPTURES / f"{name}.pcap", self.folder / f"{name}.pcapng"
                output, _ = self.run_record("-o", self.folder / f"{name}.mcap", "--capture", capture, "--pcapng", frames)
                self.assertRegex(output, r"messages and \d+ frames in ")
                again = decoded(frames)
                for one in (*again, *(before := decoded(capture))):
                    del one["frame"]  # frames that are no SOME/IP are left out
                self.assertEqual(again, before)

    def test_begins_other_files(self):
        target = self.folder / "bag"
        self.run_record("-o", target, "--capture", CAPTURES / "tp_event_small_to_256k.pcap", "--compression", "none",
                        "--chunk-size", "64KiB", "--max-size", "150KiB")
        files = sorted(target.glob("*.mcap"), key=lambda path: int(path.stem.rpartition("_")[2]))
        self.assertGreater(len(files), 2)
        self.assertEqual([file.name for file in files], [f"bag_{i}.mcap" for i in range(len(files))])
        for file in files:  # a message that is larger has a file of its own
            sizes = [len(one[-1]) for one in Mcap(file).messages]
            self.assertTrue(sum(sizes) <= 150 << 10 or len(sizes) == 1, sizes)
        self.assertEqual(sum(len(Mcap(file).messages) for file in files), len(decoded(CAPTURES / "tp_event_small_to_256k.pcap")))
        self.assertIn("bag_1.mcap", (target / "metadata.yaml").read_text())

    def test_wrong_command_lines(self):
        for arguments, words in ((["--no-dds"], "nothing to record"), (["--pcapng", "x"], "needs --interface or --capture"),
                                 (["--topics", "points"], "no pattern of topics"), (["--compression", "zip"], "--compression"),
                                 (["--max-size", "big"], "--max-size"), (["--interface", "lo", "--capture", "x"], "excludes"),
                                 (["--config", self.folder / "none.yaml"], "cannot be read")):
            with self.subTest(arguments):
                self.assertIn(words, self.run_record("-o", self.folder / "never", *arguments, status=2)[1])
                self.assertFalse((self.folder / "never").exists())

    def test_what_cannot_be_written_or_read(self):
        (self.folder / "there.mcap").write_text("precious")
        capture = CAPTURES / "rr_udp.pcap"
        self.assertIn("File exists", self.run_record("-o", self.folder / "there.mcap", "--capture", capture, status=1)[1])
        self.assertIn("No such file", self.run_record("-o", self.folder / "new.mcap", "--capture", self.folder / "none", status=1)[1])
        self.assertIn("No such file", self.run_record("-o", self.folder / "none" / "bag", "--capture", capture, status=1)[1])

    def test_a_full_disk_is_told(self):
        done = subprocess.run(["bash", "-c", 'ulimit -f 100; trap "" XFSZ; exec "$@"', "bash", TRESTLE, "record", "-o",
                               self.folder / "full.mcap", "--capture", CAPTURES / "tp_event_small_to_256k.pcap",
                               "--compression", "none", "--chunk-size", "20KiB"], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 1)
        lost = int(next(line for line in done.stdout.splitlines() if "write_failed" in line).split()[0])
        self.assertIn("File too large", done.stderr)
        file = Mcap(self.folder / "full.mcap")
        self.assertGreater(len(file.messages), 0)
        self.assertEqual(len(file.messages) + lost, len(decoded(CAPTURES / "tp_event_small_to_256k.pcap")))

    def test_records_both_sides_of_a_bridge_until_it_is_killed(self):
        config = self.start_bridge()
        sender = self.start_events()
        target = self.folder / "both.mcap"
        recorder = self.start("record", "-o", target, "--config", config, "--interface", "lo", "--compression", "none",
                              "--pcapng", self.folder / "both.pcapng", "-q")
        self.wait(lambda: min(self.counts(target).get(topic, 0) for topic in ("/text", "/someip/0x2222/0x8001")) > 20,
                  "nothing is recorded")
        self.assertIsNone(recorder.poll())
        recorder.kill()
        recorder.wait()
        sender.kill()
        file = Mcap(target)
        self.assertFalse(file.is_whole)
        text = [one for one in file.messages if one[0] == "/text"]
        for _, encoding, metadata, _, log_time, publish_time, data in text:
            self.assertEqual((encoding, data[:14]), ("cdr", HELLO))
            self.assertIn("durability: 1", metadata["offered_qos_profiles"])
            self.assertRegex(metadata["topic_type_hash"], "^RIHS01_[0-9a-f]{64}$")
            self.assertLessEqual(publish_time, log_time)
        self.assertIn(("std_msgs/msg/String", "ros2msg", "string data\n"), file.schemas.values())
        event = next(one for one in file.messages if one[0] == "/someip/0x2222/0x8001")
        self.assertEqual(event[2]["from"].rpartition(":")[0], PEER)
        self.assertIn(b"hello", event[-1])
        self.assertIn(["0x2222", "0x8001"], [[one["service"], one["method"]] for one in decoded(self.folder / "both.pcapng")])

    def test_tells_what_it_has_until_nobody_reads_that(self):
        self.start_bridge()
        self.start_events()
        bag = self.folder / "bag"
        recorder = self.start("record", "-o", bag, "--topics", "/text", "--compression", "none", "--progress", "-q",
                              env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)})
        told = [json.loads(recorder.stdout.readline())]
        while told[-1]["messages"] == 0:
            told.append(json.loads(recorder.stdout.readline()))
        self.assertEqual(told[0]["messages"], 0)
        self.assertGreater(told[-1]["bytes"], told[0]["bytes"])
        recorder.stdout.close()
        recorder.stdout = None
        recorder.wait(PATIENCE)
        file = Mcap(bag / "bag_0.mcap")
        self.assertTrue(file.is_whole)
        self.assertGreaterEqual(len(file.messages), told[-1]["messages"])

    def test_ends_with_a_bag_when_it_is_asked_to(self):
        self.start_bridge()
        self.start_events()
        bag = self.folder / "bag"
        environment = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)}
        recorder = self.start("record", "-o", bag, "--topics", "/te*", "--compression", "none", env=environment)
        self.wait(lambda: list(bag.glob("*.mcap")) and len(Mcap(bag / "bag_0.mcap").messages) > 5, "nothing is recorded")
        recorder.send_signal(signal.SIGINT)
        output, errors = recorder.communicate(timeout=PATIENCE)
        self.assertEqual(recorder.returncode, 0, errors)
        file = Mcap(bag / "bag_0.mcap")
        self.assertTrue(file.is_whole)
        # What is overwritten in the moment in which the record finds its writer is lost, and told.
        self.assertRegex(output, rf"^{len(file.messages)} messages in {bag}/bag_0\.mcap\n(\d+ were lost before \(dds_lost\)\n)?$")
        self.assertIn("recording /text (std_msgs/msg/String), reliable, transient local\n", errors)
        self.assertEqual({topic for topic, *_ in file.messages}, {"/text"})
        self.assertIn(f"message_count: {len(file.messages)}", (bag / "metadata.yaml").read_text())


if __name__ == "__main__":
    unittest.main()
