"""trestle find, call, subscribe, notify and offer by the address of a bridge that runs: through its socket for guests, with a
SOME/IP device that is nothing but sockets and hand-made bytes.

Usage: beside_bridge_test.py TRESTLE
"""
import json
import os
import re
import select
import signal
import socket
import stat
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
from bare_peer import PATIENCE, Peer, entries, someip, ttl
from bridge_program import BRIDGE, GROUP, HOST, PEER, head, log_until, write

TRESTLE = sys.argv.pop(1)
SERVICE = 0x2222
ROUTE = f"""\
routes:
  - topic: /in
    type: geometry_msgs/msg/Point
    direction: someip_to_dds
    service: {SERVICE}
    instance: 0x0001
    eventgroup: 0x0003
    event: 0x8001
    port: 40077
"""
POINT = struct.pack(">ddd", 1.5, 0, 0)


class Device(Peer):
    """Offers 0x2222.0x0001, by unicast to the bridge alone. Method 1 answers with the request backwards, 2 with the error
    0x21, 3 never; of those without return it keeps the payloads. All eventgroups are acknowledged but 9."""

    def __init__(self):
        super().__init__(PEER, GROUP)
        self.receivers = {}  # eventgroup -> endpoint
        self.told = []
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def close(self):
        self.ended.set()
        self.thread.join()
        super().close()

    def run(self):
        next_offer = 0
        while not self.ended.is_set():
            if time.monotonic() >= next_offer:
                self.offer(BRIDGE)
                next_offer = time.monotonic() + 0.2
            for sock in select.select([self.sd, self.service], [], [], 0.05)[0]:
                datagram, sender = sock.recvfrom(65536)
                (self.on_discovery if sock is self.sd else self.on_request)(datagram, sender)

    def on_discovery(self, datagram, _):
        for entry in entries(datagram):
            service, _, = struct.unpack_from(">HH", entry, 4)
            eventgroup = struct.unpack_from(">H", entry, 14)[0]
            if entry[0] != 6 or service != SERVICE:
                continue
            if ttl(entry) == 0:
                self.receivers.pop(eventgroup, None)
            elif eventgroup == 9:
                self.send_sd(BRIDGE, bytes([7, 0, 0, 0]) + entry[4:9] + bytes(3) + entry[12:])
            else:
                self.receivers[eventgroup] = self.udp_endpoint(datagram, entry[1])
                self.ack(BRIDGE, entry)

    @staticmethod
    def udp_endpoint(datagram, index):
        at = 24 + struct.unpack_from(">I", datagram, 20)[0] + 4
        for _ in range(index):
            at += 3 + struct.unpack_from(">H", datagram, at)[0]
        address, protocol, port = struct.unpack_from(">4sxBH", datagram, at + 4)
        assert protocol == 0x11
        return socket.inet_ntoa(address), port

    def on_request(self, datagram, sender):
        method, message_type = struct.unpack_from(">H", datagram, 2)[0], datagram[14]
        payload = datagram[16:]
        if message_type == 1:
            self.told.append(payload)
            return
        if method == 3:
            return
        payload, code = (payload[::-1], 0) if method == 1 else (b"", 0x21)
        self.service.sendto(datagram[:4] + struct.pack(">I", 8 + len(payload)) + datagram[8:14] +
                            bytes([0x80 if code == 0 else 0x81, code]) + payload, sender)

    def notify(self, eventgroup, event, payload, session=1):
        self.service.sendto(someip(SERVICE, event, payload, session), self.receivers[eventgroup])


def until(condition, what):
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"not in {PATIENCE} s: {what}")
        time.sleep(0.02)


class Guest:
    """A guest of hand-made bytes."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(PATIENCE)
        self.socket.connect(path)
        self.hello = self.frame()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def say(self, kind, body):
        self.socket.sendall(struct.pack(">IB", 1 + len(body), kind) + body)

    def subscribe(self, eventgroup, event):
        self.say(7, struct.pack(">HHBHBBHH", SERVICE, 1, 1, eventgroup, 1, 0, 1, event))

    def read(self, size):
        data = b""
        while len(data) < size:
            try:
                more = self.socket.recv(size - len(data))
            except ConnectionResetError:  # it was left with words unread
                more = b""
            if not more:
                return None
            data += more
        return data

    def frame(self):
        """(kind, body), or None at the end."""
        length = self.read(4)
        body = self.read(struct.unpack(">I", length)[0]) if length else None
        return (body[0], body[1:]) if body else None

    def said(self):
        """The text of the next line for people, and whether it is the end."""
        kind, body = self.frame()
        assert kind == 4, (kind, body)
        return body[3:].decode(), bool(body[0])


class BesideABridge(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.environment = {**os.environ, "XDG_RUNTIME_DIR": cls.folder.name}

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        self.file = os.path.join(self.folder.name, "drive.yaml")
        write(self.file, head() + ROUTE)
        self.log = tempfile.TemporaryFile("a+")
        self.addCleanup(self.log.close)
        self.counters = tempfile.TemporaryFile("a+")
        self.addCleanup(self.counters.close)
        self.bridge = subprocess.Popen([TRESTLE, "bridge", self.file], stdout=self.counters, stderr=self.log,
                                       env=self.environment)
        self.addCleanup(self.end_bridge)
        log_until(self.log, "Ctrl-C stops")
        self.socket = os.path.join(self.folder.name, "trestle", f"{self.bridge.pid}.guests")
        self.device = Device()
        self.addCleanup(self.device.close)
        until(lambda: 3 in self.device.receivers, "the route subscribes")

    def end_bridge(self):
        if self.bridge.poll() is None:
            self.bridge.send_signal(signal.SIGINT)
        self.bridge.wait(PATIENCE)

    def printed_counters(self):
        """All those of the guests that the bridge has printed, oldest first."""
        self.counters.seek(0)
        return [dict.fromkeys(("events_unread", "events_too_many"), 0) |
                {name: int(number) for name, number in re.findall(r"(\w+) (\d+)", line)}
                for line in self.counters.read().splitlines(keepends=True)
                if line.startswith("tools beside it:") and line.endswith("\n")]

    def guest_counters(self):
        """Those of the guests, from the end of the bridge."""
        self.end_bridge()
        return self.printed_counters()[-1]

    def guest_counters_now(self):
        before = len(self.printed_counters())
        self.bridge.send_signal(signal.SIGUSR1)
        until(lambda: len(self.printed_counters()) > before, "counters are printed")
        return self.printed_counters()[-1]

    def carry_one(self):
        """The route receives one message more. What the device sent before to its port has then arrived, too."""
        before = self.received()

        def is_received():
            self.device.notify(3, 0x8001, POINT)
            return self.received() > before
        until(is_received, "the route receives")

    def command(self, name, *arguments):
        return [TRESTLE, name, *arguments, "--address", BRIDGE, "--multicast", GROUP]

    def run_command(self, name, *arguments):
        if name in ("call", "find") and "--timeout" not in arguments:  # who shall find something does so on a slow machine, too
            arguments += "--timeout", str(PATIENCE // 2)
        return subprocess.run(self.command(name, *arguments), capture_output=True, text=True, timeout=PATIENCE,
                              env=self.environment)

    def start(self, name, *arguments):
        process = subprocess.Popen(self.command(name, *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env=self.environment)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        return process

    def received(self):
        end = time.monotonic() + PATIENCE
        done = None
        while done is None or ("does not answer" in done.stderr and time.monotonic() < end):  # on a slow machine, within 3 s
            done = subprocess.run([TRESTLE, "status", "--json", self.file], capture_output=True, text=True, timeout=PATIENCE,
                                  env=self.environment)
        counters = json.loads(done.stdout)["routes"][0]["counters"]
        return next(one["count"] for one in counters if one["name"] == "received")

    def test_call(self):
        done = self.run_command("call", f"{SERVICE}.1", "1", "0a0b0c")
        self.assertEqual((done.returncode, done.stdout), (0, "0c0b0a\n"), done.stderr)
        self.assertIn(f"note: through trestle bridge {self.file}, process {self.bridge.pid}, which has {BRIDGE}:30490",
                      done.stderr)
        self.assertEqual(self.run_command("call", f"{SERVICE}", "1", "01", "--quiet").stderr, "")
        done = self.run_command("call", f"{SERVICE}.1", "1", "{data: 1.5}", "--type", "std_msgs/msg/Float64", "--wire",
                                "{byte_order: little}", "--hex")
        self.assertEqual(done.returncode, 2)  # what is wrong with an argument is found before the bridge is asked
        done = self.run_command("call", f"{SERVICE}.1", "2", "--json")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("error: ", done.stderr)
        self.assertIn("0x21", done.stdout + done.stderr)
        done = self.run_command("call", f"{SERVICE}.1", "3", "--timeout", "0.3")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        done = self.run_command("call", f"{SERVICE}.2", "1", "--timeout", "0.3")
        self.assertEqual(done.returncode, 1)
        self.assertIn("error: nobody offers the service; there is 0x2222.0x0001 version 1.0", done.stderr)
        done = self.run_command("call", f"{SERVICE}.1", "1", "--tcp", "--timeout", "0.3")
        self.assertIn("error: 0x2222.0x0001 is offered over UDP, and not over TCP, over which this call goes", done.stderr)
        done = self.run_command("call", f"{SERVICE}.2", "1", "--timeout", "0.3", "--fire-and-forget")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("error: nobody offers the service; there is 0x2222.0x0001 version 1.0", done.stderr)
        done = self.run_command("call", f"{SERVICE}.1", "1", "--fire-and-forget", "55")
        self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
        until(lambda: self.device.told == [b"\x55"], "the request arrives")
        done = self.run_command("call", "0x3333", "1", "--fire-and-forget", "--timeout", "0.2")
        self.assertEqual(done.returncode, 1)
        self.assertIn("nobody offers the service", done.stderr)

    def test_find(self):
        for form, wanted in ([], "0x2222.0x0001  1.0  udp " + PEER + ":40002  by " + PEER + "\n"), (["--json"], None):
            done = self.run_command("find", f"{SERVICE}.1", *form)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("note: through trestle bridge", done.stderr)
            if wanted:
                self.assertEqual(done.stdout, wanted)
            else:
                found = json.loads(done.stdout)
                self.assertEqual((found["seen"], found["service"], found["instance"]), ("offered", "0x2222", "0x0001"))
        done = self.run_command("find", "0x3333", "--timeout", "0.3")
        self.assertEqual(done.returncode, 1)
        self.assertIn("nobody offers 0x3333", done.stderr)

    def test_subscribe(self):
        subscribed = self.start("subscribe", f"{SERVICE}.1", "4", "--count", "3")
        until(lambda: 4 in self.device.receivers, "the bridge subscribes")
        shared = self.start("subscribe", f"{SERVICE}.1", "3", "0x8001", "--count", "1", "--type", "geometry_msgs/msg/Point")
        line = ""
        while "subscribed to eventgroup 0x0003 of 0x2222.0x0001" not in line:  # which the route has, too
            line = shared.stderr.readline()
            self.assertTrue(line)
        # All events come to one port, so that the device sends each once.
        self.assertEqual(self.device.receivers, {3: (BRIDGE, 40077), 4: (BRIDGE, 40077)})
        for session in range(1, 4):
            self.device.notify(4, 0x8004, bytes([session]), session)
        self.device.notify(3, 0x8001, POINT)
        out, log = subscribed.communicate(timeout=PATIENCE)
        self.assertEqual((subscribed.returncode, out), (0, "0x8004 01\n0x8004 02\n0x8004 03\n"), log)
        out, log = shared.communicate(timeout=PATIENCE)
        self.assertEqual((shared.returncode, out), (0, "# 0x8001 session 1\nx: 1.5\ny: 0.0\nz: 0.0\n---\n"), log)
        until(lambda: self.received() == 1, "the route receives it, too")
        until(lambda: 4 not in self.device.receivers, "the subscription of the tool has ended")
        self.assertIn(3, self.device.receivers)  # that of the route has not

        for arguments, text in ((("--tcp",), "is wanted over TCP, but the service is not offered over TCP"),
                                (("--major", "2"), "is wanted, but the service is offered in another version")):
            waits = self.start("subscribe", f"{SERVICE}.1", "5", *arguments)
            while f"eventgroup 0x0005 of 0x2222.0x0001 {text}" not in line:
                line = waits.stderr.readline()
                self.assertTrue(line)
            waits.send_signal(signal.SIGINT)
            waits.communicate(timeout=PATIENCE)

        refused = self.start("subscribe", f"{SERVICE}.1", "9")
        while "the server refuses eventgroup 0x0009" not in line:
            line = refused.stderr.readline()
            self.assertTrue(line)
        refused.send_signal(signal.SIGINT)
        refused.communicate(timeout=PATIENCE)

    def test_offer_and_notify_say_what_to_do(self):
        for arguments in ("offer", "0x4444.1"), ("notify", "0x4444.1", "1", "0x8001", "00"):
            done = self.run_command(*arguments)
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"trestle bridge {self.file}, process {self.bridge.pid} has {BRIDGE}:30490, and offers nothing for "
                          "others: give the command an address of its own", done.stderr)
        # With which it works, and beside a stack that is no bridge it is as ever.
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind((HOST + "30", 30490))
            done = subprocess.run([TRESTLE, "call", "0x2222", "1", "--address", HOST + "30", "--multicast", GROUP],
                                  capture_output=True, text=True, timeout=PATIENCE, env=self.environment)
            self.assertEqual(done.returncode, 1)
            self.assertNotIn("through", done.stderr)

    def test_protection_and_tls_are_refused(self):
        key = os.path.join(self.folder.name, "key")
        write(key, "00112233445566778899aabbccddeeff\n")
        done = self.run_command("call", f"{SERVICE}.1", "1", "--tls-psk-identity", "me", "--tls-psk-key", key)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("TLS settings of its own", done.stderr)

    def test_a_bridge_that_is_stopped(self):
        self.bridge.send_signal(signal.SIGSTOP)
        done = self.run_command("call", f"{SERVICE}.1", "1", "0a")
        self.bridge.send_signal(signal.SIGCONT)
        self.assertEqual(done.returncode, 1)
        self.assertIn(f"{self.socket}: the bridge does not answer; it may be stopped, or very busy", done.stderr)
        waits = self.start("call", f"{SERVICE}.1", "3", "0a", "--timeout", "0.2")
        while "through trestle bridge" not in waits.stderr.readline():
            pass
        self.bridge.send_signal(signal.SIGSTOP)
        _, log = waits.communicate(timeout=PATIENCE)
        self.bridge.send_signal(signal.SIGCONT)
        self.assertEqual(waits.returncode, 1)
        self.assertIn("error: ", log)  # that it does not answer, unless it did before it was stopped

    def test_a_reload_ends_it(self):
        subscribed = self.start("subscribe", f"{SERVICE}.1", "4")
        until(lambda: 4 in self.device.receivers, "the bridge subscribes")
        self.bridge.send_signal(signal.SIGHUP)
        _, log = subscribed.communicate(timeout=PATIENCE)
        self.assertEqual(subscribed.returncode, 1)
        self.assertIn("error: the bridge has ended, or begins anew", log)
        log_until(self.log, "Ctrl-C stops", times=2)
        until(lambda: self.run_command("call", f"{SERVICE}.1", "1", "0a0b").stdout == "0b0a\n", "the new bridge calls")

    def test_only_so_many_guests_and_requests(self):
        self.assertEqual(stat.S_IMODE(os.stat(self.socket).st_mode), 0o600)
        guests = [Guest(self.socket) for _ in range(4)]
        self.assertEqual(struct.unpack_from(">I", guests[0].hello[1])[0], self.bridge.pid)
        with Guest(self.socket) as fifth:
            self.assertEqual(fifth.said(), ("the bridge serves 4 tools at a time, and they are there", True))
            self.assertIsNone(fifth.frame())
        guests[0].socket.close()
        for _ in range(8):
            guests[1].say(5, struct.pack(">HH", 0x5555, 1))
        guests[1].say(5, struct.pack(">HH", 0x5555, 1))
        self.assertEqual(guests[1].said(), ("the bridge does no more than 8 things for a tool", True))
        self.assertIsNone(guests[1].frame())
        # What is no frame, and one that is too long, end the connection.
        guests[2].say(99, b"")
        self.assertEqual(guests[2].said(), ("the bridge does not understand the request: is the tool of the same version?", True))
        self.assertIsNone(guests[2].frame())
        guests[3].socket.sendall(struct.pack(">I", 100_000_000))
        self.assertEqual(guests[3].said(), ("a request has at most 4194304 bytes, not 100000000", True))
        self.assertIsNone(guests[3].frame())
        done = self.run_command("call", f"{SERVICE}.1", "1", "0a0b")  # there is room again
        self.assertEqual(done.stdout, "0b0a\n", done.stderr)
        for one in guests:
            one.socket.close()
        # A request of which the Node thinks nothing.
        with Guest(self.socket) as guest:
            guest.say(7, struct.pack(">HHBHBBHH", SERVICE, 1, 1, 4, 0, 0, 1, 0x8001))  # neither UDP nor TCP
            text, is_end = guest.said()
            self.assertTrue(is_end)
            self.assertIn("subscription to", text)
        # What may be very many.
        with Guest(self.socket) as guest:
            guest.say(7, struct.pack(">HHBHBBHH", SERVICE, 0xffff, 1, 4, 1, 0, 1, 0x8001))
            self.assertEqual(guest.said(), ("a tool subscribes to one instance", True))
        # What only a bridge says.
        with Guest(self.socket) as guest:
            guest.say(4, b"\0\0\2no")
            self.assertEqual(guest.said(), ("the bridge was told what only a bridge tells", True))
        self.carry_one()
        counters = self.guest_counters()
        self.assertEqual((counters["guests"], counters["guests_refused"], counters["requests_refused"],
                          counters["frames_refused"]), (9, 1, 3, 3))

    def test_who_dies_leaves_nothing_behind(self):
        killed = self.start("subscribe", f"{SERVICE}.1", "4")
        with Guest(self.socket) as half:
            half.socket.sendall(struct.pack(">IB", 1000, 6) + bytes(10))  # and no more of it
            until(lambda: 4 in self.device.receivers, "the bridge subscribes")
            killed.kill()
            killed.communicate(timeout=PATIENCE)
            until(lambda: 4 not in self.device.receivers, "the subscription has ended")
        self.carry_one()
        self.assertIn(3, self.device.receivers)
        done = self.run_command("call", f"{SERVICE}.1", "1", "0a0b")
        self.assertEqual(done.stdout, "0b0a\n", done.stderr)

    def burst(self, count, eventgroup, event):
        payload = bytes(1300)
        for i in range(count):
            self.device.notify(eventgroup, event, payload, 1 + i)

    def test_who_reads_slowly_loses_its_own_and_is_told(self):
        with Guest(self.socket) as slow:
            slow.subscribe(4, 0x8004)
            until(lambda: 4 in self.device.receivers, "the bridge subscribes")
            self.assertEqual(slow.said(), ("subscribed to eventgroup 0x0004 of 0x2222.0x0001", False))
            # More than waits, without being read.
            while self.guest_counters_now()["events_unread"] == 0:
                self.burst(100, 4, 0x8004)
            self.carry_one()  # meanwhile the route has what it is for
            counters = self.guest_counters_now()
            missed = counters["events_unread"] + counters["events_too_many"]
            got = lost = 0
            while got + lost < counters["events"] + missed:
                kind, body = slow.frame()
                self.assertEqual(kind, 3)
                lost += struct.unpack_from(">Q", body, 19)[0]
                got += len(body) > 27
            self.assertEqual((got, lost), (counters["events"], missed))

    def test_who_gets_far_too_many_is_left(self):
        with Guest(self.socket) as guest:
            guest.subscribe(4, 0x8004)
            until(lambda: 4 in self.device.receivers, "the bridge subscribes")
            receiver = self.device.receivers[4]
            # So many messages in each datagram that any machine is fast enough.
            datagram = someip(SERVICE, 0x8004, b"") * 4000
            texts = []

            def read():
                while frame := guest.frame():
                    if frame[0] == 4:
                        texts.append(frame[1][3:].decode())
            reader = threading.Thread(target=read)
            reader.start()
            end = time.monotonic() + PATIENCE
            while reader.is_alive() and time.monotonic() < end:
                self.device.service.sendto(datagram, receiver)
                time.sleep(0.02)
            reader.join()
            self.assertRegex(texts[-1], "more than 8000 events or 64 MB a second come")
            until(lambda: 4 not in self.device.receivers, "the subscription has ended")
        self.carry_one()
        counters = self.guest_counters()
        self.assertEqual(counters["ended_too_fast"], 1)
        self.assertGreater(counters["events_too_many"], 0)


if __name__ == "__main__":
    unittest.main()
