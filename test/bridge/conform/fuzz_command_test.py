#!/usr/bin/env python3
"""`trestle fuzz` against the reference device on loopback, with and without bugs that were put into it.

Usage: fuzz_command_test.py TRESTLE SOURCE_FOLDER
"""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

TRESTLE, SOURCE = sys.argv[1:3]
HOST = f"127.{1 + (os.getpid() >> 8) % 254}.{os.getpid() & 0xff}"
ADDRESSES = ("--device", f"{HOST}.1", "--tester", f"{HOST}.2")
DEVICE = pathlib.Path(SOURCE) / "examples" / "ets_device"
PROFILE = DEVICE / "profile.yaml"
INTERFACES = (DEVICE / "ets.fidl", DEVICE / "ets.fdepl")
# Nothing but where the device is, and how it is started.
BARE_PROFILE = """
name: Some device
network: {device: 127.0.77.1, tester: 127.0.77.2, multicast: 239.255.77.1}
timing: {ready_within: 10 s}
lifecycle: {start: "{programs}/ets_device --address {device} --multicast {multicast} --sd-port {sd_port}"}
"""
# Some of them. All are tried by hand, as docs/fuzzing.md tells.
BUGS = {"bug-option-length": "crash", "bug-message-type": "rule"}


class Fuzz(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def fuzz(self, *arguments, status=0, dut=PROFILE):
        """What it prints; the test fails on another exit status."""
        done = subprocess.run([TRESTLE, "fuzz", "--dut", dut, *ADDRESSES, "--out", self.folder, *map(str, arguments)],
                              capture_output=True, text=True, timeout=250)
        self.assertEqual(done.returncode, status, f"{arguments}: {done.stdout}{done.stderr}")
        return done.stdout + done.stderr

    def results(self):
        return json.loads((self.folder / "results.json").read_text())

    def test_finds_nothing_in_the_device_as_it_is(self):
        text = self.fuzz("--seconds", 100, "--sequences", 300, "--seed", 11)
        self.assertIn("0 findings", text)
        results = self.results()
        self.assertEqual(results["schema"], 1)
        self.assertEqual(results["sequences"], 300)
        self.assertGreater(results["answers"], 10)
        self.assertIn("<title>trestle fuzz: Trestle ETS device</title>", (self.folder / "report.html").read_text())

    def test_finds_bugs_and_shows_them_again(self):
        for bug, kind in BUGS.items():
            with self.subTest(bug=bug):
                self.fuzz("--seconds", 60, "--fault", bug, "--max-findings", 1, status=1)
                found = self.results()["findings"][0]
                self.assertEqual(found["kind"], kind)
                self.assertTrue(found["confirmed"], found)
                self.assertLessEqual(len(found["steps"]), found["steps_found"])
                capture = self.folder / found["evidence"]
                self.assertEqual(capture.read_bytes()[:4], b"\x0a\x0d\x0d\x0a")
                again = self.fuzz("--fault", bug, "--replay", capture, status=1)
                self.assertIn(kind, again)
                # The device without the bug takes the same.
                self.assertIn("nothing is wrong", self.fuzz("--replay", capture))

    def test_finds_by_type_what_is_wrong_in_the_values_of_a_method(self):
        self.fuzz("--seconds", 200, "--fault", "bug-text", "--max-findings", 1, "--interfaces", *INTERFACES, status=1)
        crashes = [one for one in self.results()["findings"] if one["kind"] == "crash"]
        self.assertTrue(crashes, self.results()["findings"])
        self.assertIn("efbbbf", crashes[0]["steps"][-1]["bytes"])
        self.assertIn(f"--interfaces {INTERFACES[0]}", self.results()["command"])

    def test_learns_the_services_from_service_discovery(self):
        bare = self.folder / "bare.yaml"
        bare.write_text(BARE_PROFILE)
        text = self.fuzz("--seconds", 100, "--sequences", 150, dut=bare)
        self.assertIn("0 findings", text)
        self.assertEqual(self.results()["sequences"], 150)
        self.assertGreater(self.results()["answers"], 10)

    def test_keeps_what_it_has_when_the_device_cannot_be_stopped(self):
        profile = self.folder / "profile.yaml"
        profile.write_text(PROFILE.read_text().replace('lifecycle:\n', 'lifecycle:\n  stop: "false"\n', 1))
        text = self.fuzz("--seconds", 60, "--sequences", 20, dut=profile, status=1)
        self.assertIn("ended early: 'false' failed", text)
        self.assertEqual(self.results()["sequences"], 20)

    def test_says_what_is_wrong_with_a_description(self):
        broken = self.folder / "broken.fidl"
        broken.write_text("package p interface")
        self.assertIn("broken.fidl:1", self.fuzz("--interfaces", broken, status=2))

    def test_confirms_a_crash_that_does_not_come_each_time(self):
        # The bug is in the device when it is started first, and from the fifth time on.
        profile = self.folder / "profile.yaml"
        count = self.folder / "count"
        count.write_text("0")
        text = PROFILE.read_text()
        start = re.search(r'  start: "\{programs\}/ets_device (.*)"\n', text)
        profile.write_text(text.split("lifecycle:")[0] + "lifecycle:\n  start: 'n=$(($(cat " + str(count) + ") + 1)); echo $n >"
                           + str(count) + "; [ $n -gt 1 ] && [ $n -lt 5 ] && unset bug || bug=\"--fault bug-option-length\"; "
                           + "exec {programs}/ets_device " + start[1] + " $bug'\n")
        done = subprocess.run([TRESTLE, "fuzz", "--dut", profile, *ADDRESSES, "--out", self.folder / "out", "--seconds", "60",
                               "--max-findings", "1"], capture_output=True, text=True, timeout=250)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        found = json.loads((self.folder / "out" / "results.json").read_text())["findings"][0]
        self.assertEqual(found["kind"], "crash")
        self.assertTrue(found["confirmed"], found)

    def test_writes_what_it_has_when_it_is_interrupted(self):
        run = subprocess.Popen([TRESTLE, "fuzz", "--dut", PROFILE, *ADDRESSES, "--out", self.folder, "--seconds", "600"],
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        while not (self.folder / "device.log").exists():
            time.sleep(0.05)
        time.sleep(1)
        run.send_signal(signal.SIGINT)
        text, _ = run.communicate(timeout=60)
        self.assertEqual(run.returncode, 1, text)
        self.assertTrue(self.results()["cancelled"])

    def test_says_what_is_wrong_with_its_command_line(self):
        done = subprocess.run([TRESTLE, "fuzz"], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--dut", done.stdout + done.stderr)
        self.assertIn("no.pcapng", self.fuzz("--replay", "no.pcapng", status=2))

    def test_bugs_have_names_and_kinds(self):
        device = pathlib.Path(TRESTLE).parent / "ets_device"
        lines = subprocess.run([device, "--list-bugs"], capture_output=True, text=True, check=True).stdout.splitlines()
        self.assertGreaterEqual(len(lines), 20)
        for line in lines:
            self.assertTrue(re.fullmatch(r"bug-[a-z-]+\t(crash|silence|rule|memory|descriptors|slowness)\t.+", line), line)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
