"""The examples as programs, the pairs against each other.

Usage: examples_test.py FOLDER
"""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

FOLDER = sys.argv.pop(1)
PATIENCE = 60  # seconds; running into it is a failure

# Addresses and a group that only this process uses.
PID = os.getpid()
HOST = f"127.{1 + (PID >> 8) % 254}.{PID & 255}."
GROUP = f"239.252.{PID >> 8 & 255}.{PID & 255}"


def command(name, *hosts):
    return [os.path.join(FOLDER, "example_" + name), *(HOST + str(host) for host in hosts), GROUP]


def output(name, *hosts):
    done = subprocess.run(command(name, *hosts), capture_output=True, text=True, timeout=PATIENCE)
    return done.returncode, done.stdout, done.stderr


class Serving:
    """A program that runs until it is stopped, which it takes well."""

    def __init__(self, name, host):
        self.process = subprocess.Popen(command(name, host))

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        self.process.send_signal(signal.SIGINT)
        status = self.process.wait(timeout=PATIENCE)
        if kind is None and status != 0:
            raise AssertionError(f"ended with {status}")


class Examples(unittest.TestCase):
    def test_hello(self):
        with Serving("hello_service", 1):
            for _ in range(10):
                begin = time.monotonic()
                status, out, errors = output("hello_client", 2)
                if time.monotonic() - begin < 2:  # as long as its calls may take: else the machine may have stalled
                    break
        self.assertEqual((status, errors), (0, ""))
        self.assertRegex(out, r"\AHello, world!\n42 / 6 = 7\n42 / 0: the answer is error 0x21.*\n\Z")

    def test_hello_to_nobody(self):
        status, out, errors = output("hello_client", 3)
        self.assertEqual((status, errors), (0, ""))
        self.assertRegex(out, r"\Ano greeting: nobody offers the service\n42 / 6: nobody offers the service.*\n"
                              r"42 / 0: nobody offers the service.*\n\Z")

    def test_a_guarded_service_answers_no_stranger(self):
        with Serving("guarded_service", 8):
            status, out, errors = output("hello_client", 9)
        self.assertEqual((status, errors), (0, ""))
        self.assertRegex(out, r"\Ano greeting: .*\n42 / 6: .*\n42 / 0: ")
        self.assertNotIn("= 7", out)

    def test_publish_and_subscribe(self):
        with Serving("publish", 4):
            status, out, errors = output("subscribe", 5)
        self.assertEqual((status, errors), (0, ""))
        self.assertRegex(out, rf"\A(reading \d+ of front from {HOST}4: 2 distances\n){{3}}\Z")
        numbers = [int(line.split()[1]) for line in out.splitlines()]
        self.assertEqual(numbers, list(range(numbers[0], numbers[0] + 3)))

    def test_field(self):
        status, out, errors = output("field", 6, 7)
        self.assertEqual((status, errors), (0, ""))
        lines = out.splitlines()
        # The answer and the event of one change come by different sockets, in either order; a new subscriber may
        # be told twice.
        told = [line for line in lines if line.startswith("target is")]
        self.assertEqual(list(dict.fromkeys(told)), ["target is 20.0", "target is 30.0", "target is 18.5"])
        self.assertEqual(lines[0], told[0])
        self.assertEqual([line for line in lines if line not in told],
                         ["set: Success, 30.0", "set: the answer is E_NOT_OK"])

    def test_e2e(self):
        status, out, errors = output("e2e", 10, 11)
        self.assertEqual((status, errors), (0, ""))
        self.assertEqual(out.splitlines(),
                         ["limit: Success, 130.0", "speed 99.5, ok, channel init", "speed 100.5, ok, channel init",
                          "speed 101.5, ok, channel valid"])

    def test_values(self):
        status, out, errors = output("values")
        self.assertEqual((status, errors), (0, ""))
        self.assertEqual(out.splitlines(),
                         ["2001" "00000007" "4002" "00000008" "00000001" "3e800000" "4003" "0000000c"
                          "efbbbf" "636f6e65" "0000000000", "cone 7: radius 0.25, no note"])

    def test_large_message(self):
        status, out, errors = output("large_message", 8, 9)
        self.assertEqual((status, errors), (0, ""))
        lines = out.splitlines()
        self.assertEqual(sorted(lines[:2]), ["TCP: 1048576 bytes came back", "UDP: 1048576 bytes came back"])
        self.assertGreater(int(lines[2].split()[-1]), 700)

    def test_run_bridge(self):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            file.write("someip:\n  addres: 127.0.0.1\n")
            file.flush()
            done = subprocess.run([os.path.join(FOLDER, "example_run_bridge"), file.name], capture_output=True,
                                  text=True, timeout=PATIENCE)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn(f"{file.name}:2:3: error: ", done.stderr)

    def test_an_address_that_is_none(self):
        done = subprocess.run([os.path.join(FOLDER, "example_subscribe"), "here"], capture_output=True, text=True,
                              timeout=PATIENCE)
        self.assertEqual((done.returncode, done.stdout), (1, ""))


if __name__ == "__main__":
    unittest.main(verbosity=2)
