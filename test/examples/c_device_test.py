"""The device in C, found, called and subscribed to by the trestle program, and finding and calling it.

Usage: c_device_test.py C_DEVICE TRESTLE
"""
import os
import signal
import subprocess
import sys
import unittest

TRESTLE, DEVICE = sys.argv.pop(), sys.argv.pop()
PATIENCE = 60

# Addresses and a group that only this process uses.
PID = os.getpid()
HOST = f"127.{1 + (PID >> 8) % 254}.{PID & 255}."
GROUP = f"239.252.{PID >> 8 & 255}.{PID & 255}"
NETWORK = ["--address", HOST + "2", "--multicast", GROUP]


def trestle(name, *arguments):
    if name == "call":  # who shall find something does so on a slow machine, too
        arguments += "--timeout", str(PATIENCE // 2)
    return subprocess.run([TRESTLE, name, *arguments, *NETWORK], capture_output=True, text=True, timeout=PATIENCE)


class CDevice(unittest.TestCase):
    def setUp(self):
        self.device = subprocess.Popen([DEVICE, HOST + "1", GROUP], stdout=subprocess.PIPE, text=True)
        self.addCleanup(self.end)
        self.assertRegex(self.device.stdout.readline(), r"^offered; \d+ bytes of memory$")

    def end(self):
        if self.device.poll() is None:
            self.device.kill()
        self.device.wait()
        self.device.stdout.close()

    def line(self):
        return self.device.stdout.readline().strip()

    def test_answers_calls(self):
        self.assertEqual(trestle("call", "0x1234", "0x0001", "01 02 0a").stdout.strip(), "0a0201")
        self.assertEqual(self.line(), "asked: 01 02 0a")
        refused = trestle("call", "0x1234", "0x0001", "00 " * 65)
        self.assertEqual(refused.returncode, 3)
        self.assertIn("E_MALFORMED_MESSAGE", refused.stderr)
        self.assertIn("E_UNKNOWN_METHOD", trestle("call", "0x1234", "0x0002").stderr)

    def test_keeps_its_field(self):
        self.assertEqual(trestle("call", "0x1234", "0x0010").stdout.strip(), "0064")
        self.assertEqual(trestle("call", "0x1234", "0x0011", "01 02").stdout.strip(), "0102")
        self.assertEqual(self.line(), "limit: 01 02")
        self.assertEqual(trestle("call", "0x1234", "0x0010").stdout.strip(), "0102")
        self.assertEqual(trestle("call", "0x1234", "0x0011", "01 02 03").returncode, 3)

    def test_sends_its_events_and_the_initial_one(self):
        heard = trestle("subscribe", "0x1234.0x0001", "0x0001", "--count", "4")
        self.assertEqual(heard.returncode, 0, heard.stderr)
        lines = heard.stdout.splitlines()
        self.assertEqual(sum(line == "0x8010 0064" for line in lines), 1, heard.stdout)
        self.assertEqual(sum("0x8001" in line for line in lines), 3, heard.stdout)
        self.assertEqual(self.line(), "subscriber of eventgroup 1")

    def test_sends_large_events(self):
        heard = trestle("subscribe", "0x1234.0x0001", "0x0002", "--count", "2")
        self.assertEqual(heard.returncode, 0, heard.stderr)
        for line in heard.stdout.splitlines():
            event, payload = line.split()
            self.assertEqual(event, "0x8002")
            self.assertEqual(payload, payload[:2] * 8192)

    def test_calls_and_subscribes(self):
        server = subprocess.Popen([TRESTLE, "offer", "0x2222.0x0001", "--method", "1=ca fe", "--field",
                                   "-/-/0x8001=be ef", *NETWORK], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        try:
            heard = {self.line(), self.line()}
        finally:
            server.send_signal(signal.SIGINT)
            server.communicate(timeout=PATIENCE)
        self.assertEqual(heard, {"answer: ca fe", "event: be ef"})

    def test_withdraws_its_service_at_its_end(self):
        self.device.send_signal(signal.SIGTERM)
        self.assertEqual(self.device.wait(timeout=PATIENCE), 0)
        self.assertEqual(trestle("find", "0x1234.0x0001", "--timeout", "1").returncode, 1)


if __name__ == "__main__":
    unittest.main()
