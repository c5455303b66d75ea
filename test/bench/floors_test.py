"""The programs that measure floors, each for a moment on loopback: floors_test.py TRESTLE_FLOOR."""
import contextlib
import fcntl
import json
import os
import socket
import subprocess
import sys
import time
import unittest

FLOOR = sys.argv.pop()
SECONDS = 0.2
PATIENCE = 60
ADDRESS = f"127.{1 + (os.getpid() >> 8) % 254}.{os.getpid() & 255}.1"


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


class Floors(unittest.TestCase):
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
