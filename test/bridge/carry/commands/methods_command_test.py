"""Methods of programs without ROS: `trestle call` and `trestle offer`, and two bridges between them that would close a ring:

  trestle call -- SOME/IP -- bridge (server: ros) -- DDS -- bridge (server: someip) -- SOME/IP -- trestle offer

Usage: methods_command_test.py TRESTLE
"""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
from bare_peer import PATIENCE
from bridge_program import GROUP, HOST, head

TRESTLE = sys.argv.pop(1)


def configuration(host, method):
    return head(HOST + str(host)) + f"methods:\n  - {{ros_service: /set, type: std_srvs/srv/SetBool, {method}}}\n"


class Methods(unittest.TestCase):
    def start(self, *arguments, log=subprocess.DEVNULL):
        process = subprocess.Popen([TRESTLE, *arguments], stdout=subprocess.DEVNULL, stderr=log)

        def stop():
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
            self.assertEqual(process.wait(PATIENCE), 0)
        self.addCleanup(stop)
        return stop

    def bridge(self, host, method):
        """Starts it, and returns what reads its log."""
        file = tempfile.NamedTemporaryFile("w", suffix=".yaml")
        self.addCleanup(file.close)
        file.write(configuration(host, method))
        file.flush()
        log = tempfile.NamedTemporaryFile("w")
        self.addCleanup(log.close)
        self.start("bridge", file.name, log=log)

        def said():
            with open(log.name, encoding="utf-8") as lines:
                return lines.read()
        return said

    def tool(self, name, host, *arguments):
        return [name, *arguments, "--address", HOST + str(host), "--multicast", GROUP]

    def call(self, payload, *more, of=("0x1250.1", "7")):
        if "--timeout" not in more:
            more += "--timeout", str(PATIENCE // 2)
        return subprocess.run([TRESTLE, *self.tool("call", 4, *of, payload, "-q", *more)],
                              capture_output=True, text=True, timeout=2 * PATIENCE)

    def test_a_call_is_not_carried_by_two_bridges_one_after_another(self):
        # success: true, message: "on"
        stop = self.start(*self.tool("offer", 1, "0x1240.1", "--method", "1=01 00000006 efbbbf 6f6e00"))
        direct = "0x1240.1", "1"
        end = time.monotonic() + PATIENCE
        while (done := self.call("01", of=direct)).returncode != 0 and time.monotonic() < end:
            time.sleep(0.1)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "0100000006efbbbf6f6e00\n", ""))
        done = self.call("{data: true}", "--type", "std_srvs/srv/SetBool_Request", "--answer-type",
                         "std_srvs/srv/SetBool_Response", of=direct)
        self.assertEqual((done.returncode, done.stdout), (0, 'success: true\nmessage: "on"\n'), done.stderr)
        done = self.call("07" * 2000, of=direct)  # in segments
        self.assertEqual((done.returncode, done.stdout), (0, "0100000006efbbbf6f6e00\n"), done.stderr)

        # The ROS service of the one is not offered by the other, who would bring it back to SOME/IP.
        log = self.bridge(2, "server: someip, service: 0x1240, instance: 1, method: 1")
        self.bridge(3, "server: ros, service: 0x1250, instance: 1, method: 7, port: 40001, timeout: 5 s")
        end = time.monotonic() + PATIENCE
        while "has appeared" not in log() and time.monotonic() < end:
            time.sleep(0.1)
        self.assertIn("has appeared", log())
        for _ in range(3):
            done = self.call("01", "--timeout", "1")
            self.assertEqual((done.returncode, done.stderr), (1, "error: nobody offers the service\n"))

        stop()
        self.assertNotEqual(self.call("01", "--timeout", "1", of=direct).returncode, 0)


if __name__ == "__main__":
    unittest.main()
