"""trestle watch: recordings whose contents are known, and live traffic in a network namespace of its own.

Usage: watch_test.py TRESTLE FOLDER_OF_RECORDINGS
"""
import ctypes
import json
import os
import pty
import signal
import socket
import struct
import subprocess
import sys
import time
import unittest

import tool_commands_test as tools  # takes TRESTLE from the command line
from tool_commands_test import HOST, PATIENCE, TRESTLE, Running

RECORDINGS = sys.argv.pop(1)
LIBC = ctypes.CDLL(None, use_errno=True)
NEW_USER, NEW_NET = 0x10000000, 0x40000000


def enter_namespace():
    """Puts this process into a network namespace with a loopback; nothing, or why that is not possible."""
    if LIBC.unshare(NEW_NET) != 0 and LIBC.unshare(NEW_USER | NEW_NET) != 0:
        return "no network namespace may be made: " + os.strerror(ctypes.get_errno())
    done = subprocess.run(["ip", "link", "set", "lo", "up"], capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else "the loopback interface cannot be brought up: " + done.stderr


def give_up_the_right_to_capture():
    drop_from_bounding_set, net_raw = 24, 13
    LIBC.prctl(drop_from_bounding_set, net_raw, 0, 0, 0)


def read(recording, *arguments):
    done = subprocess.run([TRESTLE, "watch", "--read", f"{RECORDINGS}/{recording}.pcap", *arguments],
                          capture_output=True, text=True, timeout=PATIENCE)
    assert (done.returncode, done.stderr) == (0, ""), done
    return done.stdout


def summary(recording):
    return json.loads(read(recording, "--json"))


def rows(found, *keys):
    """The traffic as {event or method: (the named fields)}."""
    return {row.get("event") or row.get("method"): tuple(row[key] for key in keys) for row in found["traffic"]}


# What is in each file stands in pcaps/vsomeip/README.md.
class Recordings(unittest.TestCase):
    def test_an_offer_a_subscription_and_its_events(self):
        found = summary("sd_offer_find_subscribe_ack_udp")
        self.assertEqual(len(found["services"]), 1)
        service = found["services"][0]
        self.assertEqual((service["service"], service["instance"], service["udp"], service["peer"], service["gone"]),
                         ("0x1234", "0x5678", "10.0.0.1:30509", "10.0.0.1:30490", True))
        self.assertEqual(len(found["subscriptions"]), 1)
        subscription = found["subscriptions"][0]
        self.assertEqual((subscription["peer"], subscription["server"], subscription["state"], subscription["gone"]),
                         ("10.0.0.2:30490", "10.0.0.1:30490", "acknowledged", True))
        self.assertNotIn("multicast", subscription)
        self.assertEqual(len(found["traffic"]), 1)
        event = found["traffic"][0]
        self.assertEqual((event["instance"], event["event"], event["server"], event["messages"], event["bytes"],
                          event["lost"]), ("0x5678", "0x8001", "10.0.0.1:30509", 5, 5 * (16 + 32), 0))
        self.assertEqual(found["counters"], {"discovery_messages": 21, "messages": 5, "malformed": 0, "not_kept": 0,
                                             "frames_missed": 0})

    def test_a_multicast_eventgroup_with_ten_events_a_second(self):
        found = summary("sd_multicast_eventgroup")
        self.assertEqual([one["multicast"] for one in found["subscriptions"]], ["224.225.226.233:32344"])
        self.assertEqual(rows(found, "messages", "lost"), {"0x8003": (10, 0)})
        rate = found["traffic"][0]["messages_per_second"]
        self.assertTrue(9.5 < rate < 10.5, rate)

    def test_a_rate_is_that_of_the_times_in_the_recording(self):
        times = []
        with open(f"{RECORDINGS}/sd_multicast_eventgroup.pcap", "rb") as file:
            order = "<" if file.read(24)[:4] == bytes.fromhex("d4c3b2a1") else ">"  # microseconds
            while head := file.read(16):
                seconds, microseconds, length, _ = struct.unpack(order + "IIII", head)
                if bytes.fromhex("12348003") in file.read(length):
                    times.append(seconds + microseconds / 1e6)
        self.assertEqual(len(times), 10)
        event, = summary("sd_multicast_eventgroup")["traffic"]
        self.assertAlmostEqual(event["messages_per_second"], 9 / (times[-1] - times[0]), delta=0.001)
        self.assertAlmostEqual(event["bytes_per_second"], event["messages_per_second"] * event["bytes"] / 10, delta=0.1)

    def test_a_refused_subscription(self):
        found = summary("sd_subscribe_nack_unknown_eventgroup")
        self.assertEqual({one["state"] for one in found["subscriptions"]}, {"refused"})
        self.assertEqual(found["traffic"], [])

    def test_events_over_tcp(self):
        found = summary("sd_subscribe_tcp_events")
        self.assertEqual([("tcp" in one, "udp" in one) for one in found["subscriptions"]], [(True, False)])
        self.assertEqual(rows(found, "messages", "transport", "instance", "lost"), {"0x8002": (7, "tcp", "0x5678", 0)})

    def test_calls_and_their_answers(self):
        for recording, counts in [("rr_udp", {"0x0421": (16, 16), "0x0422": (3, 3)}),
                                  ("rr_tcp", {"0x0421": (14, 14), "0x0422": (2, 2)}),
                                  ("rr_tcp_magic_cookies", {"0x0421": (6, 6)})]:
            with self.subTest(recording):
                found = summary(recording)
                self.assertEqual(rows(found, "messages", "answers"), counts)
                for row in found["traffic"]:
                    self.assertTrue(0 < row["latency_p50_ns"] < 1e9, row)

    def test_answers_that_are_errors(self):
        found = summary("errors_raw_client_vs_vsomeip_service")
        # 11 ERROR messages and a RESPONSE with a return code.
        self.assertEqual(sum(row.get("errors", 0) for row in found["traffic"]), 12)
        self.assertGreater(found["counters"]["malformed"], 0)

    def test_many_messages_in_a_datagram_and_one_count_of_sessions_for_all_events(self):
        found = summary("npdu_several_messages_per_datagram")
        events = {row["event"]: (row["messages"], row["lost"]) for row in found["traffic"] if "event" in row}
        self.assertEqual(events, {"0x8001": (13, 0), "0x8002": (8, 0), "0x8003": (8, 0), "0x8004": (8, 0),
                                  "0x8005": (8, 0)})

    def test_segments_are_one_message(self):
        found = summary("tp_event_1mib_plus")
        self.assertEqual(rows(found, "messages", "lost"), {"0x8020": (2, 0)})  # of 1617 segments
        self.assertGreater(found["traffic"][0]["bytes"], 2 << 20)

    def test_many_services(self):
        found = summary("sd_many_services_many_entries")
        self.assertEqual(len({(one["service"], one["instance"]) for one in found["services"]}), 24)
        self.assertEqual({one["state"] for one in found["subscriptions"]}, {"acknowledged"})

    def test_a_service_that_was_killed(self):
        lines = read("reboot_service_kill9", "--lines", "--rates", "2").splitlines()
        story = [line.split()[1] for line in lines if "0x1234.0x5678" in line and line.split()[1] != "traffic"]
        self.assertEqual(story.count("offered"), 2, lines)
        self.assertEqual(story.count("acknowledged"), 2, lines)
        second = len(story) - story[::-1].index("offered") - 1
        self.assertTrue({"rebooted", "expired"} & set(story[:second]), story)
        self.assertEqual(story[-1], "stopped")
        self.assertTrue(any("traffic" in line and "event 0x8001" in line for line in lines))
        self.assertRegex(lines[0], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z  ")

    def test_lines_end_after_as_many_as_asked_for(self):
        self.assertEqual(len(read("sd_many_services_many_entries", "--count", "3").splitlines()), 3)
        first = json.loads(read("sd_offer_find_subscribe_ack_udp", "--count", "1", "--json"))
        self.assertEqual((first["seen"], first["service"]), ("looked_for", "0x1234"))

    def test_tables_for_people(self):
        text = read("sd_multicast_eventgroup")
        self.assertRegex(text, r"0x1234\.0x5678 +\d+\.\d+ +10\.0\.0\.1 .* gone +udp 10\.0\.0\.1:30509")
        self.assertRegex(text, r"0x1234\.0x5678 +0x4467 +10\.0\.0\.2 .* acknowledged .*multicast 224\.225\.226\.233:32344")
        self.assertRegex(text, r"0x1234\.0x5678 +event 0x8003 +(9|10)\.\d +\d+ B +10 +udp 10\.0\.0\.1:30509")

    def test_every_recording_can_be_read(self):
        for name in sorted(os.listdir(RECORDINGS)):
            if name.endswith(".pcap"):
                with self.subTest(name):
                    self.assertGreater(summary(name[:-5])["counters"]["discovery_messages"], 0)

    def test_what_is_no_recording(self):
        for file, message in [("/does/not/exist", "No such file"), (__file__, "cannot read a capture from")]:
            done = subprocess.run([TRESTLE, "watch", "--read", file], capture_output=True, text=True,
                                  timeout=PATIENCE)
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertIn(message, done.stderr)


MISSING = enter_namespace()


def watching(*arguments, **how):
    return subprocess.Popen(tools.command("watch", 9, *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                            text=True, **how)


def captures(process):
    """Whether it has opened what captures frames."""
    with open("/proc/net/packet", encoding="utf-8") as file:
        inodes = {f"socket:[{line.split()[-1]}]" for line in list(file)[1:]}
    folder = f"/proc/{process.pid}/fd"
    try:
        return any(os.readlink(os.path.join(folder, name)) in inodes for name in os.listdir(folder))
    except FileNotFoundError:  # closed since they were listed: looked at again
        return False


def wait_until(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(what)
        time.sleep(0.02)


@unittest.skipIf(MISSING, MISSING)
class Live(unittest.TestCase):
    def look_while_it_is_called(self):
        watch = watching("--for", "3", "--json")
        wait_until(lambda: captures(watch), "it does not capture")
        for _ in range(5):
            self.assertEqual(tools.run("call", 4, "0x1235", "1", "-q").stdout, "0a\n")
        out, log = watch.communicate(timeout=PATIENCE)
        self.assertEqual((watch.returncode, log), (0, ""))
        return json.loads(out)

    @staticmethod
    def is_complete(found):
        return (len(found["services"]) == 2 and found["subscriptions"] and len(found["traffic"]) == 2
                and found["counters"]["frames_missed"] == 0
                # The sender catches up with what it has missed.
                and all(row["messages_per_second"] < 60 for row in found["traffic"] if row.get("event") == "0x8001"))

    def test_shows_subscriptions_rates_and_calls(self):
        with Running("notify", 1, "0x1234.1", "1", "0x8001", "00 01 02 03", "--rate", "50") as notify, \
                Running("subscribe", 2, "0x1234.1", "1", "-q") as subscribe, \
                Running("offer", 3, "0x1235.1", "--method", "1=0a"):
            subscribe.line_with("0x8001")
            end = time.monotonic() + PATIENCE
            found = self.look_while_it_is_called()
            while not self.is_complete(found) and time.monotonic() < end:  # the machine may stall meanwhile
                found = self.look_while_it_is_called()
            self.assertEqual(found["where"], "lo")
            self.assertEqual({one["service"]: one["peer"] for one in found["services"]},
                             {"0x1234": HOST + "1:30490", "0x1235": HOST + "3:30490"})
            self.assertEqual([(one["service"], one["eventgroup"], one["peer"], one["server"], one["state"])
                              for one in found["subscriptions"]],
                             [("0x1234", "0x0001", HOST + "2:30490", HOST + "1:30490", "acknowledged")])
            by_id = {row.get("event") or row.get("method"): row for row in found["traffic"]}
            event = by_id["0x8001"]
            # The machine may make it less than the sender was asked for, but not other than what was counted.
            self.assertLess(event["messages_per_second"], 60, event)
            self.assertGreater(event["messages_per_second"] * found["seconds"], 0.99 * (event["messages"] - 1), found)
            self.assertGreater(event["messages"], 1)
            self.assertEqual((event["instance"], event["lost"], event["bytes"]), ("0x0001", 0, event["messages"] * 20))
            method = by_id["0x0001"]
            self.assertEqual(method["answers"], method["messages"])
            self.assertGreater(method["latency_p50_ns"], 0)
            self.assertEqual(notify.stop()[0], 0)

    def test_tells_line_by_line_what_happens(self):
        with Running("watch", 9, "--rates", "0.5") as watch, Running("watch", 9, "--rates", "0.5", "--json") as as_json:
            with Running("notify", 1, "0x1236.1", "1", "0x8001", "00", "--rate", "50"):
                watch.line_with("offered       0x1236.0x0001")
                with Running("subscribe", 2, "0x1236.1", "1", "-q") as subscribe:
                    self.assertRegex(watch.line_with("subscribed    0x1236"),
                                     rf"eventgroup 0x0001  by {HOST}2  at {HOST}1  udp {HOST}2:\d+  ttl 3 s$")
                    watch.line_with("acknowledged  0x1236.0x0001  eventgroup 0x0001")
                    self.assertRegex(watch.line_with("traffic       0x1236"), r"event 0x8001  \d+(\.\d)? /s  ")
                    row = json.loads(as_json.line_with('"seen":"traffic"'))
                    self.assertEqual((row["service"], row["event"], row["lost"]), ("0x1236", "0x8001", 0))
                    subscribe.stop()
                watch.line_with("unsubscribed  0x1236.0x0001  eventgroup 0x0001")
                with Running("subscribe", 2, "0x1236.1", "9", "-q"):
                    watch.line_with("refused       0x1236.0x0001  eventgroup 0x0009")
            self.assertEqual(watch.stop()[0], 0)

    def test_misses_nothing_of_a_burst_that_comes_while_it_is_busy(self):
        with Running("watch", 9) as watch, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
            sink.bind((HOST + "8", 0))
            for _ in range(20):  # until the machine lets us be as quick as the offer's lifetime of 3 s
                with Running("offer", 1, "0x123b.1") as offer:
                    watch.line_with("offered       0x123b.0x0001")
                    begin = time.monotonic()
                    watch.process.send_signal(signal.SIGSTOP)
                    for _ in range(5000):
                        sink.sendto(bytes(100), sink.getsockname())
                    offer.stop()
                    watch.process.send_signal(signal.SIGCONT)
                    line = watch.line_with("0x123b.0x0001")
                    if time.monotonic() - begin < 1.5:
                        self.assertIn("stopped", line)  # not: expired
                        break
            self.assertEqual(watch.stop()[0], 0)

    def test_draws_tables_on_a_terminal(self):
        with Running("notify", 1, "0x1237.1", "1", "0x8001", "00", "--rate", "50"), \
                Running("subscribe", 2, "0x1237.1", "1", "-q"):
            main, terminal = pty.openpty()
            watch = subprocess.Popen(tools.command("watch", 9), stdout=terminal, stderr=subprocess.PIPE,
                                     env=dict(os.environ, TERM="xterm", NO_COLOR="1"))
            os.close(terminal)
            shown = ""
            end = time.monotonic() + PATIENCE
            wanted = ["SOME/IP at lo: 1 service of 1 host, 1 subscription", "0x1237.0x0001     1.0",
                      "0x0001      " + HOST + "2", "acknowledged", "event 0x8001 ", " B/s"]
            while time.monotonic() < end and not all(text in shown for text in wanted):
                shown += os.read(main, 65536).decode()
            for text in wanted:
                self.assertIn(text, shown)
            watch.send_signal(signal.SIGINT)
            while "\x1b[?25h" not in shown:  # the cursor is back
                shown += os.read(main, 65536).decode()
            watch.stderr.close()
            self.assertEqual(watch.wait(timeout=PATIENCE), 0)
            os.close(main)

    def test_says_what_is_missing_without_the_right_to_capture(self):
        with Running("notify", 1, "0x1238.1", "1", "0x8001", "00", "--rate", "50"), \
                Running("subscribe", 2, "0x1238.1", "1", "-q") as subscribe:
            subscribe.line_with("0x8001")
            end = time.monotonic() + PATIENCE
            out = ""
            while "0x1238.0x0001" not in out and time.monotonic() < end:  # an offer comes each second, but for those of a stall
                watch = watching("--for", "6", preexec_fn=give_up_the_right_to_capture)
                out, log = watch.communicate(timeout=PATIENCE)
                self.assertEqual(watch.returncode, 0)
            self.assertEqual(log.count("note:"), 1, log)
            self.assertIn("this process may not capture from lo: only what discovery sends to all is shown", log)
            self.assertIn("sudo setcap cap_net_raw+ep " + os.path.realpath(TRESTLE), log)
            self.assertIn("0x1238.0x0001", out)
            self.assertNotIn("SUBSCRIBER", out)
            watch = watching("--interface", "any", "--for", "1", preexec_fn=give_up_the_right_to_capture)
            watch.communicate(timeout=PATIENCE)

    def test_an_interface_that_is_not_there(self):
        done = tools.run("watch", 9, "--interface", "nope0")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("cannot capture from nope0: No such device", done.stderr)

    def test_any_interface(self):
        with Running("offer", 1, "0x1239.1"):
            end = time.monotonic() + PATIENCE
            found = {"services": []}
            while not found["services"] and time.monotonic() < end:  # it looks for 3 s
                found = json.loads(tools.run("watch", 9, "--interface", "any", "--once", "--json").stdout)
            self.assertEqual([one["service"] for one in found["services"]], ["0x1239"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
