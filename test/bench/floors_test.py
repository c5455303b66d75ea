"""The programs that measure floors, each for a moment on loopback: floors_test.py TRESTLE_FLOOR."""
import contextlib
import fcntl
import json
import os
import select
import socket
import struct
import subprocess
import sys
import threading
import time
import unittest

FLOOR = sys.argv.pop()
SECONDS = 0.2
PATIENCE = 60
HOST = f"127.{1 + (os.getpid() >> 8) % 254}.{os.getpid() & 255}."
ADDRESS = HOST + "1"
GROUP, SD_PORT = "224.244.224.245", 30490
SERVICE, MAJOR = 0x7e57, 3


def bound(port):
    """Whether somebody has opened it at our address, of either kind."""
    here = f"{int.from_bytes(socket.inet_aton(ADDRESS), sys.byteorder):08X}:{port:04X}"
    for table in "udp", "tcp":
        with open(f"/proc/net/{table}", encoding="utf-8") as lines:
            if any(line.split()[1] == here for line in list(lines)[1:]):
                return True
    return False


@contextlib.contextmanager
def domain():
    """One of DDS that no other test uses at the same time: as TestDomain (test/dds_adapter/dds_test.hpp)."""
    for number in range(20, 100):
        with open(f"/tmp/trestle-test-domain-{number}", "a", encoding="utf-8") as file:
            with contextlib.suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                yield number
                return
    raise RuntimeError("no DDS domain is free")


class Stack(threading.Thread):
    """As much of one with the service of `trestle perf server` as a client without options asks for. What it sends when events
    are wanted are these: session and, of three segments, those that are sent."""
    BYTES = 4000
    EVENTS = ((1, (0, 1, 2)), (2, (0, 1, 2)), (3, (0, 1, 2)), (4, (0, 2)), (5, (0, 1, 2)), (7, (0, 1, 2)), (8, (0, 1, 2)))

    def __init__(self):
        super().__init__(daemon=True)
        self.subscriptions, self.requests, self.offer_bytes = [], [], None
        self.discovery, self.asked, self.service = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(3))
        self.asked.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.discovery.bind((ADDRESS, SD_PORT))
        self.asked.bind((GROUP, SD_PORT))
        self.asked.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton(ADDRESS))
        self.service.bind((ADDRESS, 0))
        self.ended, self.end = socket.socketpair()

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.end.close()
        self.join(PATIENCE)
        for one in self.discovery, self.asked, self.service, self.ended:
            one.close()

    def run(self):
        sockets = self.discovery, self.asked, self.service, self.ended
        while True:
            ready, _, _ = select.select(sockets, [], [])
            if ready == [self.ended]:
                return
            for one in ready:
                if one is self.ended:
                    continue  # when all has been read
                message, sender = one.recvfrom(65536)
                if sender[0].startswith(HOST):  # not of other tests
                    (self.on_request if one is self.service else self.on_discovery)(message, sender)

    @staticmethod
    def message(service, method, session, kind, payload):
        return struct.pack("!HHIHHBBBB", service, method, 8 + len(payload), 0, session, 1, MAJOR, kind, 0) + payload

    def on_discovery(self, message, sender):
        kind, service, more = message[24], int.from_bytes(message[28:30], "big"), message[36:40]
        option = b""
        if kind == 0 and service == SERVICE:
            option = struct.pack("!HBB4sBBH", 9, 4, 0, socket.inet_aton(ADDRESS), 0, 0x11, self.service.getsockname()[1])
            entry = struct.pack("!BBBBHHI4s", 1, 0, 0, 0x10, SERVICE, 1, MAJOR << 24 | 3, bytes(4))
        elif kind == 6:
            self.subscriptions.append((message[24:40], message[40:]))
            entry = struct.pack("!BBBBHH4s4s", 7, 0, 0, 0, SERVICE, 1, message[32:36], more)
        else:
            return
        body = b"\xc0\0\0\0" + struct.pack("!I", len(entry)) + entry + struct.pack("!I", len(option)) + option
        self.discovery.sendto(self.message(0xffff, 0x8100, 1, 2, body), sender)

    def on_request(self, message, sender):
        method, = struct.unpack_from("!H", message, 2)
        self.requests.append(message)
        if method == 1 and message[14] == 0:  # a request
            self.service.sendto(message[:14] + b"\x80\0" + message[16:], sender)
        elif method == 3:
            for session, segments in self.EVENTS:
                for part in segments:
                    end = min(self.BYTES, 1392 * (part + 1))
                    tp = struct.pack("!I", 1392 * part | (end < self.BYTES)) + bytes(end - 1392 * part)
                    self.service.sendto(self.message(SERVICE, 0x8001, session, 0x22, tp), sender)


class Floors(unittest.TestCase):
    def ask(self, role, *options):
        """Of a Stack, by a client that has nothing of ours."""
        done = subprocess.run([FLOOR, role, f"at={ADDRESS}:{SD_PORT}", f"own={HOST}2", *options], capture_output=True, text=True,
                              timeout=PATIENCE, check=True)
        return json.loads(done.stdout)

    def test_a_silent_receiver_counts_what_is_whole_and_what_is_not(self):
        with Stack() as stack:
            for reads in 0, 100:
                figures = self.ask("receive-silent", f"bytes={Stack.BYTES}", "messages=6", f"reads={reads}")
                # From the second to the last but one: of one a segment is missing, of another all.
                self.assertEqual((figures["received"], figures["lost"], figures["latency_ns"]["count"]), (4, 2, 4))
                self.assertGreaterEqual(figures["latency_ns"]["p50"], 2 * 1412 * 10 * bool(reads))  # two segments before the last
        entry, options = stack.subscriptions[0]
        self.assertEqual(entry[9:12], (600).to_bytes(3, "big"))
        self.assertEqual((len(options), options[:8], options[12:14]), (16, struct.pack("!IHBB", 12, 9, 4, 0), b"\0\x11"))  # an endpoint
        self.assertEqual(stack.subscriptions[1][0][9:12], bytes(3))
        # What `trestle perf client --events --window 0` asks for: size, no rate, no window, the default pacing.
        self.assertEqual(stack.requests[0][12:], struct.pack("!BBBBBIdIIH", 1, MAJOR, 0, 0, 0, Stack.BYTES, 0, 0, 500_000, 0))

    def test_a_silent_receiver_acknowledges_what_vsomeip_has_under_way(self):
        with Stack() as stack:
            figures = self.ask("receive-silent", f"bytes={Stack.BYTES}", "messages=6", "vsomeip=1")
            self.assertEqual((figures["received"], figures["lost"]), (4, 2))
        start, *acknowledged, stop = stack.requests
        self.assertEqual(struct.unpack("=QQq", start[16:]), (Stack.BYTES, 4, 60_000_000_000))
        self.assertEqual([struct.unpack("=Q", one[16:])[0] for one in acknowledged], [1, 2, 3, 4, 6, 7])
        self.assertEqual(struct.unpack("=QQq", stop[16:]), (Stack.BYTES, 4, 1))

    def test_a_bare_client_calls_a_stack(self):
        with Stack() as stack:
            self.check_latency(self.ask("ping-udp", "bytes=80", f"seconds={SECONDS}"))
        self.assertEqual(stack.requests[0], Stack.message(SERVICE, 1, 1, 0, bytes(64)))

    def measure(self, *arguments, **options):
        """What a client prints beside its server; again, if the machine has stalled for all of that time."""
        for _ in range(10):
            figures = self.measure_once(*arguments, **options)
            if figures["received"] > 0:
                break
        return figures

    def measure_once(self, server, client, port, **options):
        options = [f"{name}={value}" for name, value in options.items()]
        at = [f"at={ADDRESS}:{port}"] if port else []
        with subprocess.Popen([FLOOR, server, *at, *options]) as serving:
            try:
                while port and not bound(port):
                    self.assertIsNone(serving.poll())
                    time.sleep(0.01)
                done = subprocess.run([FLOOR, client, *at, *options, f"seconds={SECONDS}"], capture_output=True, text=True,
                                      timeout=PATIENCE, check=True)
            finally:
                serving.kill()
        return json.loads(done.stdout)

    def check_latency(self, figures):
        self.assertGreater(figures["received"], 0)
        self.assertEqual(figures["lost"], 0)
        latency = figures["latency_ns"]
        self.assertEqual(latency["count"], figures["received"])
        self.assertLess(0, latency["p50"])
        self.assertLessEqual(latency["p50"], latency["p99"])

    def test_there_and_back(self):
        for number, transport in enumerate(("udp", "tcp")):
            with self.subTest(transport):
                self.check_latency(self.measure(f"serve-{transport}", f"ping-{transport}", 20501 + number))

    def test_floods_tell_what_came_and_what_did_not(self):
        for segmentation in 0, 1:
            with self.subTest(segmentation=segmentation):
                figures = self.measure("serve-flood", "receive-flood", 20503 + segmentation, bytes=80,
                                       segmentation=segmentation)
                self.assertGreater(figures["received"], 0)
                self.assertAlmostEqual(figures["per_second"], figures["received"] / SECONDS, delta=1)
                self.assertAlmostEqual(figures["megabytes_per_second"], figures["per_second"] * 80 / 1e6, delta=0.01)

    def test_floods_by_a_call_for_each_datagram(self):
        figures = self.measure("serve-flood", "receive-flood", 20508, bytes=80, segmentation=0, batches=0)
        self.assertGreater(figures["received"], 0)
        self.assertGreater(figures["per_second"], 0)

    def test_floods_of_full_datagrams(self):
        figures = self.measure("serve-flood", "receive-flood", 20507, bytes=1472)
        self.assertGreater(figures["received"], 0)
        self.assertEqual(figures["payload_bytes"], 1472)

    def test_transfers(self):
        for segmentation in 0, 1:
            with self.subTest(segmentation=segmentation):
                self.check_latency(self.measure("serve-tp", "receive-tp", 20505 + segmentation, bytes=200_000, window=1,
                                                segmentation=segmentation))

    def test_hops_of_dds(self):
        for option in {}, {"shared_memory": 1}, {"synchronous": 1}:
            with self.subTest(**option), domain() as number:
                self.check_latency(self.measure("reflect-dds", "ping-dds", None, bytes=100_000, domain=number,
                                                **option))

    def test_what_it_does_not_know_is_refused(self):
        for arguments in (["nothing"], ["ping-udp", "colour=red"], ["ping-udp", "at=nowhere"], []):
            done = subprocess.run([FLOOR, *arguments], capture_output=True, text=True, timeout=PATIENCE, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn("Usage", done.stderr)


if __name__ == "__main__":
    unittest.main()
