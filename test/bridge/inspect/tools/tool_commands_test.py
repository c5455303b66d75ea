"""trestle find, watch, call, subscribe, offer and notify as programs: against each other, and beside a peer that is
nothing but sockets and hand-made bytes.

Usage: tool_commands_test.py TRESTLE
"""
import json
import os
import select
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
from bare_peer import PATIENCE, Peer, entries, receive, someip
from socket_buffers import limits_below, limits_told, of_others, without_net_admin

TRESTLE = sys.argv.pop(1)

# Addresses and a group that only this process uses.
PID = os.getpid()
HOST = f"127.{1 + (PID >> 8) % 254}.{PID & 255}."
PEER = HOST + "20"
GROUP = f"239.253.{PID >> 8 & 255}.{PID & 255}"


def command(name, host, *arguments):
    return [TRESTLE, name, *arguments, "--address", HOST + str(host), "--multicast", GROUP]


def run(name, host, *arguments, stdin=None):
    if name in ("call", "find") and "--timeout" not in arguments:  # who shall find something does so on a slow machine, too
        arguments += "--timeout", str(PATIENCE // 2)
    done = subprocess.run(command(name, host, *arguments), input=stdin, capture_output=True, text=True,
                          timeout=PATIENCE)
    done.stderr = of_others(done.stderr)
    return done


class Running:
    """A command that runs until it is stopped."""

    def __init__(self, name, host, *arguments):
        self.process = subprocess.Popen(command(name, host, *arguments), stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE)
        self.read = {self.process.stdout: b"", self.process.stderr: b""}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for stream in self.read:
            stream.close()

    def has_printed(self, seconds):
        return bool(select.select([self.process.stdout], [], [], seconds)[0])

    def line_with(self, *texts, of_log=False):
        """The next line that holds the texts, of the output or the log."""
        stream = self.process.stderr if of_log else self.process.stdout
        end = time.monotonic() + PATIENCE
        others = b""
        while True:
            line, newline, rest = self.read[stream].partition(b"\n")
            if newline:
                self.read[stream] = rest
                if all(text in line.decode() for text in texts):
                    return line.decode()
                others += line + newline
                continue
            if time.monotonic() > end or not select.select([stream], [], [], PATIENCE)[0]:
                raise AssertionError(f"not printed: {texts}, but\n{others.decode()}")
            more = os.read(stream.fileno(), 65536)
            if not more:
                raise AssertionError(f"ended without printing: {texts}")
            self.read[stream] += more

    def finish(self):
        """Waits for the end. Status, output and log, as far as they have not been read yet."""
        out, log = self.process.communicate(timeout=PATIENCE)
        before_out, before_log = self.read.values()
        return self.process.returncode, (before_out + out).decode(), of_others((before_log + log).decode())

    def stop(self):
        self.process.send_signal(signal.SIGINT)
        return self.finish()


class TwoPrograms(unittest.TestCase):
    def test_an_event_goes_from_notify_to_subscribe_as_values(self):
        with Running("notify", 1, "0x1234.0x0001", "1", "0x8001", "{x: 1.5, y: -2}", "--type",
                     "geometry_msgs/msg/Point", "--rate", "50") as notify:
            done = run("subscribe", 2, "0x1234.1", "0x0001", "--type", "geometry_msgs/Point", "--count", "2")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout, "# 0x8001 session 1\nx: 1.5\ny: -2.0\nz: 0.0\n---\n"
                                          "# 0x8001 session 2\nx: 1.5\ny: -2.0\nz: 0.0\n---\n")
            self.assertIn("subscribed to eventgroup 0x0001 of 0x1234.0x0001", done.stderr)

            done = run("subscribe", 2, "0x1234.1", "1", "0x8001", "--type", "geometry_msgs/Point", "--json", "--quiet",
                       "--count", "1")
            self.assertEqual(done.stderr, "")
            event = json.loads(done.stdout)
            self.assertEqual(event["event"], "0x8001")
            self.assertEqual(event["values"], {"x": 1.5, "y": -2.0, "z": 0.0})
            self.assertTrue(event["src"].startswith(HOST + "1:"))

            done = run("subscribe", 2, "0x1234.1", "1", "--json", "--count", "1")
            self.assertEqual(json.loads(done.stdout)["payload"], "3ff8000000000000c0000000000000000000000000000000")

            done = run("subscribe", 2, "0x1234.1", "1", "--count", "1")
            self.assertEqual(done.stdout, "0x8001 3ff8000000000000c0000000000000000000000000000000\n")

            # An event that nobody asked for is not printed.
            done = run("subscribe", 2, "0x1234.1", "1", "0x8002", "--timeout", "0.5")
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn("warning: too few events: 0 came in 0.5 s\n", done.stderr)

            # A payload that is no message of the type.
            done = run("subscribe", 2, "0x1234.1", "1", "--type", "std_msgs/String", "--count", "1")
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn("warning: not a std_msgs/msg/String: truncated at byte 0 in data", done.stderr)
            self.assertIn("warning: 1 of 1 events were not good\n", done.stderr)

            status, out, log = notify.stop()
            self.assertEqual((status, out), (0, ""))
            self.assertRegex(log, r"\n[1-9]\d* events sent\n$")

    def test_notify_sends_as_many_as_asked_for(self):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            file.write("data: " + "x" * 5000 + "\n")  # SOME/IP-TP
            file.flush()
            with Running("subscribe", 2, "0x1235.1", "1", "--type", "std_msgs/String", "--count", "3") as subscribe:
                done = run("notify", 1, "0x1235.1", "1", "0x8001", "@" + file.name, "--type", "std_msgs/msg/String",
                           "--rate", "20", "--count", "3")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertIn("3 events sent", done.stderr)
                _, out, _ = subscribe.finish()
                self.assertEqual(out.count("data: \"" + "x" * 5000 + "\"\n---\n"), 3)

    def test_notify_without_subscribers_sends_nothing(self):
        done = run("notify", 1, "0x1236.1", "1", "0x8001", "@-", "--timeout", "0.5", "--rate", "50", stdin="00 01\n02")
        self.assertEqual((done.returncode, done.stderr.splitlines()[-2:]), (1, ["waiting for subscribers", "0 events sent"]))

    def test_notify_tells_when_it_waits_for_subscribers_again(self):
        with Running("notify", 1, "0x1239.1", "1", "0x8001", "00", "--rate", "50") as notify:
            done = run("subscribe", 2, "0x1239.1", "1", "--count", "1", "-q")
            self.assertEqual((done.returncode, done.stdout), (0, "0x8001 00\n"), done.stderr)
            notify.line_with("no longer subscribed", of_log=True)
            notify.line_with("waiting for subscribers", of_log=True)
            self.assertEqual(notify.stop()[0], 0)

    def test_find_and_watch_see_an_offer_come_and_go(self):
        with Running("watch", 3) as watch, Running("watch", 3, "--json") as as_json:
            # They listen beside each other. Nothing tells when they do, so the offers go on until both have one.
            with Running("offer", 1, "0x1237.0x0002", "--eventgroup", "1", "--major", "7") as offer:
                found = run("find", 2, "0x1237.2")
                self.assertEqual(found.returncode, 0, found.stderr)
                self.assertRegex(found.stdout, rf"^0x1237\.0x0002  7\.0  udp {HOST}1:\d+  by {HOST}1  ttl 3 s\n$")
                end = time.monotonic() + PATIENCE
                while not (found := run("find", 2, "0x1237", "--json", "--timeout", "1.5")).stdout:
                    self.assertLess(time.monotonic(), end, "not found")
                self.assertEqual(json.loads(found.stdout)["instance"], "0x0002")
                self.assertIn("0x1237.0x0002", run("find", 2, "--count", "1").stdout)
                line = watch.line_with("offered", "0x1237")  # it sees what else is on the interface too
                self.assertRegex(line, rf"^\d{{4}}-.*Z  offered       0x1237\.0x0002  7\.0  udp {HOST}1:\d+  by {HOST}1")
                self.assertEqual(json.loads(as_json.line_with("offered", "0x1237"))["instance"], "0x0002")
                status, out, log = offer.stop()
                self.assertEqual((status, out), (0, ""))
            watch.line_with("stopped", "0x1237.0x0002")
            self.assertEqual(json.loads(as_json.line_with("stopped", "0x1237"))["major_version"], 7)
            self.assertEqual(watch.stop()[0], 0)
            self.assertEqual(as_json.stop()[0], 0)
        missing = run("find", 2, "0x1237.2", "--timeout", "0.5")
        self.assertEqual((missing.returncode, missing.stdout), (1, ""))

    def test_find_beside_another_stack_of_the_same_address(self):
        with Running("offer", 1, "0x1238.1") as offer:
            offer.line_with("offering", of_log=True)
            found = run("find", 1, "0x1238.1")
            self.assertEqual(found.returncode, 0, found.stderr)
            self.assertIn(f"{HOST}1:30490 is taken by another SOME/IP stack", found.stderr)

    def test_a_closed_pipe_ends_a_command_which_still_withdraws(self):
        with Running("notify", 1, "0x123a.1", "1", "0x8001", "00", "--rate", "50") as notify:
            with Running("subscribe", 2, "0x123a.1", "1") as subscribe:
                subscribe.line_with("0x8001 00")
                subscribe.process.stdout.close()
                self.assertEqual(subscribe.process.wait(timeout=PATIENCE), 0)
            notify.line_with("stopped, no longer subscribed", of_log=True)


class Calls(unittest.TestCase):
    def test_are_answered_by_offer(self):
        with Running("offer", 1, "0x1240.1", "--method", "1=0a 0b", "--method", "2", "--error", "3=0x21", "--udp",
                     "--tcp") as offer:
            for way in ([], ["--udp"], ["--tcp"]):
                done = run("call", 2, "0x1240", "1", "00 01 02", *way)
                self.assertEqual((done.returncode, done.stdout), (0, "0a0b\n"), done.stderr)
                self.assertEqual(offer.line_with("0x0001"), "0x0001 000102")
            done = run("call", 2, "0x1240.1", "0x0002", "--quiet")
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "\n", ""))
            self.assertEqual(offer.line_with("0x0002"), "0x0002 ")

            done = run("call", 2, "0x1240.1", "1", "--json", "-q")
            answer = json.loads(done.stdout)
            self.assertEqual(answer, {"method": "0x0001", "return_code": "E_OK", "return_code_value": 0,
                                      "payload": "0a0b"})

            # Errors, of the service and of the stack.
            done = run("call", 2, "0x1240.1", "3", "-q")
            self.assertEqual((done.returncode, done.stdout, done.stderr), (3, "", "error: the answer is error 0x21\n"))
            done = run("call", 2, "0x1240.1", "3", "-q", "--json")
            self.assertEqual((done.returncode, json.loads(done.stdout)["return_code_value"]), (3, 33))
            self.assertEqual(json.loads(done.stdout)["method"], "0x0003")
            done = run("call", 2, "0x1240.1", "9", "-q")
            self.assertEqual((done.returncode, done.stderr), (3, "error: the answer is E_UNKNOWN_METHOD\n"))

            for way in (["--udp"], ["--tcp"]):
                done = run("call", 2, "0x1240.1", "2", "ff", "--fire-and-forget", *way)
                self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
                self.assertEqual(offer.line_with("0x0002 f"), "0x0002 ff")

            # A large one, in segments and in one piece.
            large = "5a" * 20000
            for way in (["--udp"], ["--tcp"]):
                done = run("call", 2, "0x1240.1", "1", "@-", *way, stdin=large)
                self.assertEqual((done.returncode, done.stdout), (0, "0a0b\n"), done.stderr)
                self.assertEqual(offer.line_with("0x0001"), "0x0001 " + large)
            self.assertEqual(offer.stop()[0], 0)

    def test_take_and_print_values(self):
        with Running("offer", 1, "0x1241.1", "--method", '1={"data": true}', "--type", "std_msgs/msg/String",
                     "--answer-type", "std_msgs/msg/Bool", "--json") as offer:
            done = run("call", 2, "0x1241", "1", "{data: hi}", "--type", "std_msgs/String", "--answer-type",
                       "std_msgs/Bool", "-q")
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "data: true\n", ""))
            request = json.loads(offer.line_with("method"))
            self.assertEqual((request["method"], request["values"]), ("0x0001", {"data": "hi"}))
            self.assertTrue(request["src"].startswith(HOST + "2:"))
            # Neither side takes what is no message of the type.
            done = run("call", 2, "0x1241", "1", "00", "-q")
            self.assertEqual((done.returncode, done.stderr), (3, "error: the answer is E_MALFORMED_MESSAGE\n"))
            offer.line_with("warning: not a std_msgs/msg/String", of_log=True)
            done = run("call", 2, "0x1241", "1", "{data: hi}", "--type", "std_msgs/String", "-q")
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn("error: not a std_msgs/msg/String", done.stderr)

    def test_call_by_the_type_of_a_service(self):
        with Running("offer", 1, "0x1255.1", "--method", '1:std_msgs/msg/Bool:std_srvs/srv/SetBool_Response='
                     '{"success": true, "message": "on"}', "--json") as offer:
            for of_service in (["--type", "std_srvs/srv/SetBool"],
                               ["--type", "std_srvs/srv/SetBool_Request", "--answer-type", "std_srvs/srv/SetBool_Response"]):
                done = run("call", 2, "0x1255", "1", "{data: true}", *of_service, "-q")
                self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "success: true\nmessage: \"on\"\n", ""))
                self.assertEqual(json.loads(offer.line_with("method"))["values"], {"data": True})
        done = run("call", 2, "0x1255", "1", "{data: true}", "--type", "std_srvs/srv/SetBol", "-q")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--type: ", done.stderr)
        self.assertIn("std_srvs/srv/SetBol", done.stderr)

    def test_what_is_wrong_in_values_is_told_where_it_is(self):
        done = run("call", 2, "0x1255", "1", "{gear: 2", "--type", "std_msgs/msg/Int32", "-q")
        self.assertEqual(done.returncode, 2)
        self.assertIn("PAYLOAD: 1:9: not valid YAML: '{' of 1:1 is not closed; expected '}'", done.stderr)
        done = run("call", 2, "0x1255", "1", "1", "--type", "std_msgs/msg/Int32", "-q", "--wire", "{gear: 2")
        self.assertEqual(done.returncode, 2)
        self.assertIn("wire:1:1: error: not valid YAML: this '{' is not closed; expected '}'", done.stderr)

    def test_get_and_set_fields(self):
        with Running("offer", 1, "0x1242.1", "--field", "1/2/0x8001={data: 20}", "--type",
                     "std_msgs/msg/Float64") as offer:
            typed = ["--type", "std_msgs/msg/Float64", "-q"]
            with Running("subscribe", 3, "0x1242.1", "1", *typed) as subscribe:
                self.assertEqual(subscribe.line_with("data"), "data: 20.0")
                self.assertEqual(run("call", 2, "0x1242", "1", *typed).stdout, "data: 20.0\n")
                self.assertEqual(run("call", 2, "0x1242", "2", "{data: 21.5}", *typed).stdout, "data: 21.5\n")
                self.assertEqual(subscribe.line_with("data: 21"), "data: 21.5")
                self.assertEqual(offer.line_with("data"), "data: 21.5")
                self.assertEqual(run("call", 2, "0x1242", "1", *typed).stdout, "data: 21.5\n")
                self.assertEqual(run("call", 2, "0x1242", "2", "00", "-q").returncode, 3)
                self.assertEqual(run("call", 2, "0x1242", "1", *typed).stdout, "data: 21.5\n")

    def test_requests_to_fields_are_printed_like_all_others(self):
        with Running("offer", 1, "0x1245.1", "--field", "1/2/-=0a", "--field", "3/-/-", "--json", "-q") as offer:
            self.assertEqual(run("call", 2, "0x1245", "1", "-q").stdout, "0a\n")
            request = json.loads(offer.line_with("0x0001"))
            self.assertEqual((request["session"], request["payload"]), (1, ""))
            self.assertTrue(request["src"].startswith(HOST + "2:"))
            self.assertEqual(run("call", 2, "0x1245", "2", "0b", "-q").stdout, "0b\n")
            request = json.loads(offer.line_with("0x0002"))
            self.assertEqual((request["session"], request["payload"]), (1, "0b"))
            self.assertTrue(request["src"].startswith(HOST + "2:"))
            self.assertEqual(run("call", 2, "0x1245", "1", "-q").stdout, "0b\n")  # and is the value from now on
            # A field without a value yet.
            done = run("call", 2, "0x1245", "3", "-q")
            self.assertEqual((done.returncode, done.stderr), (3, "error: the answer is E_NOT_OK\n"))

    def test_each_method_and_field_may_have_types_of_its_own(self):
        with Running("offer", 1, "0x1246.1", "--method", "1:std_msgs/msg/String:std_msgs/msg/Bool={data: true}",
                     "--method", "2:std_msgs/msg/UInt8={data: 7}", "--method", "3=ff",
                     "--field", "4/-/0x8004:std_msgs/msg/Int16={data: -2}") as offer:
            done = run("call", 2, "0x1246", "1", "{data: hi}", "--type", "std_msgs/String", "--answer-type",
                       "std_msgs/Bool", "-q")
            self.assertEqual((done.returncode, done.stdout), (0, "data: true\n"), done.stderr)
            self.assertEqual(offer.line_with("data"), "data: hi")
            self.assertEqual(run("call", 2, "0x1246", "2", "09", "-q").stdout, "07\n")
            self.assertEqual(offer.line_with("data"), "data: 9")
            self.assertEqual(run("call", 2, "0x1246", "3", "0102030405", "-q").stdout, "ff\n")
            self.assertEqual(run("call", 2, "0x1246", "4", "-q").stdout, "fffe\n")
            done = run("subscribe", 2, "0x1246.1", "1", "--count", "1")
            self.assertEqual(done.stdout, "0x8004 fffe\n")

    def test_values_are_laid_out_by_the_rules_of_the_service(self):
        rules = "{byte_order: little, string_length: 16, string_bom: false}"
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            file.write(rules)
            file.flush()
            with Running("notify", 1, "0x1247.1", "1", "0x8001", "{data: hi}", "--type", "std_msgs/msg/String",
                         "--wire", rules, "--rate", "50"):
                # 16 bits of length, big endian as always: two characters and a zero.
                done = run("subscribe", 2, "0x1247.1", "1", "--count", "1", "-q")
                self.assertEqual(done.stdout, "0x8001 0003686900\n")
                done = run("subscribe", 2, "0x1247.1", "1", "--count", "1", "-q", "--type", "std_msgs/msg/String",
                           "--wire", "@" + file.name, "--json")
                self.assertEqual(json.loads(done.stdout)["values"], {"data": "hi"})
        with Running("notify", 1, "0x1248.1", "1", "0x8001", "{data: hi}", "--type", "std_msgs/msg/String",
                     "--wire", "{profile: commonapi, byte_order: little}", "--rate", "50"):
            # CommonAPI's lengths follow the payload: 32 bits, little endian; BOM, two characters and a zero.
            done = run("subscribe", 2, "0x1248.1", "1", "--count", "1", "-q")
            self.assertEqual(done.stdout, "0x8001 06000000efbbbf686900\n")

    def test_end_when_nobody_answers(self):
        done = run("call", 2, "0x1243", "1", "--timeout", "0.3", "-q")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (1, "", "error: nobody offers the service\n"))
        done = run("call", 2, "0x1243", "1", "--timeout", "0.3", "-q", "--fire-and-forget")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (1, "", "error: nobody offers the service\n"))
        with Running("offer", 1, "0x1243.1", "--method", "1") as offer:
            offer.line_with("offering", of_log=True)
            done = run("call", 2, "0x1243", "1", "--tcp", "--timeout", "5", "-q")
            self.assertEqual((done.returncode, done.stderr), (1, (
                "error: 0x1243.0x0001 is offered over UDP, and not over TCP, over which this call goes\n")))

    def test_tell_of_other_versions_of_the_service(self):
        with Running("offer", 1, "0x1249.1", "--method", "1") as offer:
            offer.line_with("offering", of_log=True)
            other = "note: 0x1249.0x0001 is offered with major version 1, not 2: see --major\n"
            error = "error: nobody offers the service with major version 2, only with 1\n"
            with Running("call", 2, "0x1249", "1", "--major", "2", "--timeout", "4") as call:
                call.line_with(other[:-1], of_log=True)
                status, out, log = call.finish()
                self.assertEqual((status, out), (1, ""))
                self.assertTrue(log.endswith(error), log)
            with Running("subscribe", 2, "0x1249.1", "1", "--major", "2") as subscribe:
                subscribe.line_with(other[:-1], of_log=True)
                self.assertEqual(subscribe.stop()[0], 0)
            done = run("call", 2, "0x1249", "1", "--major", "2", "--timeout", "4", "--fire-and-forget", "-q")
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, rf"^warning: 0x1249.0x0001 is wanted in version 2.any, but .*\n{error}$")
            self.assertNotIn("note:", run("call", 2, "0x1249", "1").stderr)

    def test_tell_which_buffers_the_system_does_not_grant(self):
        for name, *arguments in [("call", "0x124b", "1"), ("subscribe", "0x124b.1", "1"), ("offer", "0x124b.1"),
                                 ("notify", "0x124b.1", "1", "0x8001", "00")]:
            done = subprocess.run(command(name, 2, *arguments, "--quiet", "--timeout", "0.2"), capture_output=True,
                                  preexec_fn=without_net_admin, text=True, timeout=PATIENCE)
            self.assertEqual(limits_told(done.stderr, by="warning: "), limits_below(8 << 20, 0), name)
            self.assertEqual(done.stdout, "", name)

    def test_a_refusal_for_want_of_a_protocol_says_so_at_both_ends(self):
        with Running("offer", 1, "0x124a.1", "--udp", "--tcp", "--field", "1/-/0x8001=0a") as offer:
            with Running("subscribe", 2, "0x124a.1", "1", "--tcp") as subscribe:
                subscribe.line_with("refused by the server", "it may want a UDP endpoint, too", of_log=True)
                offer.line_with("refused a subscription", "missing endpoint", of_log=True)
            with Running("subscribe", 3, "0x124a.1", "1", "--tcp", "--udp") as subscribe:
                subscribe.line_with("0x8001 0a")

    def test_events_come_over_tcp(self):
        with Running("notify", 1, "0x1244.1", "1", "0x8001", "0a0b", "--tcp", "--rate", "50"):
            done = run("subscribe", 2, "0x1244.1", "1", "--tcp", "--count", "2")
            self.assertEqual((done.returncode, done.stdout), (0, "0x8001 0a0b\n0x8001 0a0b\n"), done.stderr)
            done = run("subscribe", 2, "0x1244.1", "1", "--timeout", "0.5")
            self.assertEqual((done.returncode, done.stdout), (1, ""))


class BesideAPeerOfBareSockets(unittest.TestCase):
    def test_find_asks_and_takes_the_answer_by_unicast(self):
        with Peer(PEER, GROUP) as peer, Running("find", 4, "0x2222", "--count", "1", "--timeout", "30") as find:
            # service, any instance, any version; TTL 3; no options; asked by multicast from the SD port
            entry, datagram, sender = receive(peer.group, lambda e: e[0] == 0)
            self.assertEqual(entry, bytes.fromhex("00000000 2222ffff ff000003 ffffffff"))
            self.assertEqual(datagram[:24], bytes.fromhex(
                "ffff8100 00000024 00000001 01010200 c0000000 00000010"))
            self.assertEqual(sender, (HOST + "4", 30490))
            peer.offer(HOST + "4", ttl=3, minor=5)
            status, out, log = find.finish()
            self.assertEqual((status, log), (0, ""))
            self.assertEqual(out, f"0x2222.0x0001  1.5  udp {PEER}:40002  by {PEER}  ttl 3 s\n")

    def test_watch_survives_what_is_malformed(self):
        with Peer(PEER, GROUP) as peer, Running("watch", 4) as watch:
            end = time.monotonic() + PATIENCE
            while time.monotonic() < end and not watch.has_printed(0.1):
                for length in range(0, 60, 7):
                    peer.sd.sendto(bytes.fromhex("ffff810000000030")[:length] + b"\xff" * length, (GROUP, 30490))
                peer.offer(GROUP, ttl=1, minor=5)
            peer.offer(GROUP, ttl=1, minor=5)  # what it has printed may have been of others
            watch.line_with("offered", "0x2222.0x0001  1.5")
            watch.line_with("expired", "0x2222.0x0001")
            self.assertEqual(watch.stop()[0], 0)

    def test_subscribe_prints_what_the_peer_sends(self):
        with Peer(PEER, GROUP) as peer, Running("subscribe", 4, "0x2222.1", "3", "--type", "std_msgs/msg/String", "--yaml",
                                     "--count", "2") as subscribe:
            receive(peer.group, lambda e: e[0] == 0 and e[4:6] == b"\x22\x22")
            peer.offer(HOST + "4")
            entry, datagram, _ = receive(peer.sd, lambda e: e[0] == 6)
            options = datagram[24 + 16 * len(entries(datagram)) + 4:]
            to = (HOST + "4", struct.unpack_from(">H", options, 10)[0])
            peer.ack(HOST + "4", entry)
            for text in (b"map", b"\x1b[31m"):
                payload = struct.pack(">I", 4 + len(text)) + b"\xef\xbb\xbf" + text + b"\0"
                peer.service.sendto(someip(0x2222, 0x8003, payload, session=9), to)
            status, out, log = subscribe.finish()
            self.assertEqual(status, 0, log)
            self.assertEqual(out, "# 0x8003 session 9\ndata: map\n---\n"
                                  "# 0x8003 session 9\ndata: \"\\u001b[31m\"\n---\n")
            receive(peer.sd, lambda e: e[0] == 6 and e[9:12] == b"\0\0\0")  # and unsubscribes


    def test_call_is_answered_by_the_peer(self):
        with Peer(PEER, GROUP) as peer, Running("call", 4, "0x2222", "0x0005", "0102", "-q") as call:
            receive(peer.group, lambda e: e[0] == 0 and e[4:6] == b"\x22\x22")
            peer.offer(HOST + "4")
            peer.service.settimeout(PATIENCE)
            request, client = peer.service.recvfrom(65536)
            # service, method; length; client, session; protocol 1, interface 1, REQUEST, E_OK; payload
            self.assertEqual(request, bytes.fromhex("22220005 0000000a 00010001 01010000 0102"))
            self.assertEqual(client[0], HOST + "4")
            # An answer to somebody else's call, then ours.
            peer.service.sendto(bytes.fromhex("22220005 0000000a 00010002 01018000 dead"), client)
            peer.service.sendto(bytes.fromhex("22220005 0000000b 00010001 01018000 beef01"), client)
            self.assertEqual(call.finish(), (0, "beef01\n", ""))

    def test_call_tells_the_error_of_the_peer_with_its_payload(self):
        with Peer(PEER, GROUP) as peer, Running("call", 4, "0x2222", "5", "-q") as call:
            receive(peer.group, lambda e: e[0] == 0 and e[4:6] == b"\x22\x22")
            peer.offer(HOST + "4")
            peer.service.settimeout(PATIENCE)
            _, client = peer.service.recvfrom(65536)
            peer.service.sendto(bytes.fromhex("22220005 00000009 00010001 01018104 77"), client)
            self.assertEqual(call.finish(), (3, "", "error: the answer is E_NOT_READY: 77\n"))

    def test_fire_and_forget_reaches_the_peer(self):
        with Peer(PEER, GROUP) as peer, Running("call", 4, "0x2222", "5", "ab", "--fire-and-forget", "-q") as call:
            receive(peer.group, lambda e: e[0] == 0 and e[4:6] == b"\x22\x22")
            peer.offer(HOST + "4")
            peer.service.settimeout(PATIENCE)
            request, _ = peer.service.recvfrom(65536)
            self.assertEqual(request, bytes.fromhex("22220005 00000009 00010001 01010100 ab"))
            self.assertEqual(call.finish(), (0, "", ""))

    def test_offer_answers_the_peer(self):
        with Peer(PEER, GROUP) as peer, Running("offer", 4, "0x2223.1", "--method", "5=beef", "--error", "6=0x20", "--json",
                                     "-q") as offer:
            _, datagram, _ = receive(peer.group, lambda e: e[0] == 1 and e[4:6] == b"\x22\x23")
            options = datagram[24 + 16 * len(entries(datagram)) + 4:]
            at = (HOST + "4", struct.unpack_from(">H", options, 10)[0])
            peer.service.settimeout(PATIENCE)
            for request, answer in [
                ("22230005 00000009 12345678 01010000 99", "22230005 0000000a 12345678 01018000 beef"),
                ("22230006 00000008 12345679 01010000", "22230006 00000008 12345679 01018020"),
                ("22230007 00000008 1234567a 01010000", "22230007 00000008 1234567a 01018003"),
            ]:
                peer.service.sendto(bytes.fromhex(request), at)
                self.assertEqual(peer.service.recvfrom(65536)[0], bytes.fromhex(answer))
            self.assertEqual(json.loads(offer.line_with("method")),
                             {"method": "0x0005", "session": 0x5678, "src": PEER + ":40002", "payload": "99"})


class WrongCommandLines(unittest.TestCase):
    def test_end_with_2_and_say_what_is_wrong(self):
        for arguments, message in [
            (["find", "0x12345"], "SERVICE: expected"),
            (["find", "0x1234.0"], "INSTANCE: expected"),
            (["find", "--timeout", "0"], "--timeout"),
            (["subscribe", "0x1234", "1"], "'0x1234' names no instance"),
            (["subscribe", "0x1234.1"], "EVENTGROUP is required"),
            (["subscribe", "0x1234.1", "1", "0x8001", "--type", "std_msgs/msg/Strin"], "unknown type"),
            (["subscribe", "0x1234.1", "1", "--yaml"], "needs --type"),
            (["subscribe", "0x1234.1", "1", "--yaml", "--json"], "--json"),
            (["notify", "0x1234.1", "1", "0x8001", "0g"], "good up to character 1"),
            (["notify", "0x1234.1", "1", "0x8001", "@/does/not/exist"], "cannot read '/does/not/exist'"),
            (["notify", "0x1234.1", "1", "0x8001", "x: 1", "--type", "std_msgs/msg/String"],
             "PAYLOAD: 1:1: 'x' is no field of std_msgs/msg/String; expected data"),
            (["notify", "0x1234.1", "1", "0x8001", "{\"data\": 5}", "--json", "--type", "std_msgs/msg/String"],
             "PAYLOAD: 1:10: data: expected a string, found '5'"),
            (["call", "0x1234", "1", "{data: 4.5}", "--json", "--type", "std_msgs/msg/Float64"],
             "last read: '{d'; expected string literal (with --json payloads are given in JSON, too)"),
            (["find", "--count", "-1"], "--count: expected a number from 1 to 1000000000, found '-1'"),
            (["notify", "0x1234.1", "1", "0x8001", "00", "--count", "0"], "--count: expected a number from 1 to"),
            (["subscribe", "0x1234.1", "1", "--count", "-1"], "--count: expected a number from 1 to"),
            (["watch", "--count", "-1"], "--count: expected a number from 1 to"),
            (["notify", "0x1234.1", "1", "0x8001", "00", "--rate", "0"], "--rate"),
            (["offer", "0x1234.1", "--eventgroup", "0"], "--eventgroup: expected"),
            (["offer", "0x1234.1", "--method", "0=00"], "--method: expected"),
            (["offer", "0x1234.1", "--method", "1=0"], "good up to character 1"),
            (["offer", "0x1234.1", "--error", "1"], "--error: expected METHOD=CODE"),
            (["offer", "0x1234.1", "--error", "1=0"], "--error: expected METHOD=CODE"),
            (["offer", "0x1234.1", "--field", "1/2=00"], "expected GETTER/SETTER/NOTIFIER=VALUE, found '1/2'"),
            (["offer", "0x1234.1", "--field", "-/-/-"], "has none of getter, setter and notifier"),
            (["offer", "0x1234.1", "--method", "1", "--answer-type", "std_msgs/msg/Strin"], "--answer-type: "),
            (["offer", "0x1234.1", "--method", "1:std_msgs/msg/Strin"], "--method: "),
            (["offer", "0x1234.1", "--field", "1/-/-:std_msgs/msg/Strin"], "--field: "),
            (["offer", "0x1234.1", "--wire", "{byte_order: middle}"], "--wire: wire:1:14: error: byte_order: expected"),
            (["offer", "0x1234.1", "--wire", "{"], "not valid YAML"),
            (["offer", "0x1234.1", "--wire", "@/does/not/exist"], "--wire: cannot read '/does/not/exist'"),
            (["notify", "0x1234.1", "1", "0x8001", "00", "--rate", "nan"], "--rate: expected a number from 0.001 to"),
            (["notify", "0x1234.1", "1", "0x8001", "00", "--rate", "-1"], "found '-1'"),
            (["notify", "0x1234.1", "1", "0x8001", "00", "--timeout", "nan"], "--timeout: expected a number from"),
            (["call", "0x1234", "1", "--timeout", "inf"], "found 'inf'"),
            (["find", "--timeout", "1e999"], "found '1e999'"),
            (["watch", "--timeout", "nan"], "--timeout"),
            (["subscribe", "0x1234.1", "1", "--timeout", "1s"], "found '1s'"),
            (["call", "0x1234"], "METHOD is required"),
            (["call", "0x1234", "0x10000"], "METHOD: expected"),
            (["call", "0x1234", "1", "--udp", "--tcp"], "--tcp"),
            (["call", "0x1234", "1", "--timeout", "0"], "--timeout"),
            (["watch", "--multicast", "10.0.0.1"], "is no multicast address"),
            (["watch", "--address", "here"], "expected an IPv4 or IPv6 address, found 'here'"),
            (["watch", "--address", "::1"], "both be IPv4 or both IPv6"),
        ]:
            with self.subTest(arguments):
                done = subprocess.run([TRESTLE, *arguments], capture_output=True, text=True, timeout=PATIENCE)
                self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
                self.assertIn(message, done.stderr)

    def test_help_has_examples(self):
        for name in ("find", "watch", "call", "subscribe", "offer", "notify"):
            done = subprocess.run([TRESTLE, name, "--help"], capture_output=True, text=True, timeout=PATIENCE)
            self.assertEqual(done.returncode, 0)
            self.assertIn(f"Examples:\n  trestle {name}", done.stdout)
            self.assertIn("Exit status: 0", done.stdout)

    def test_an_address_of_no_interface_is_named(self):
        for command_line in (["find"], ["watch"], ["watch", "--interface", "any"], ["watch", "--once"]):
            with self.subTest(command_line):
                done = subprocess.run([TRESTLE, *command_line, "--address", "192.0.2.77"], capture_output=True, text=True,
                                      timeout=PATIENCE)
                self.assertEqual((done.returncode, done.stdout), (1, ""))
                self.assertIn("UDP 192.0.2.77:30490: cannot find the network interface: ", done.stderr)
                self.assertIn("no interface of this host has this address", done.stderr)

    def test_a_taken_address_is_named(self):
        with Running("offer", 1, "0x123b.1") as offer:
            offer.line_with("offering", of_log=True)
            done = run("offer", 1, "0x123c.1")
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"UDP {HOST}1:30490", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
