#!/usr/bin/env python3
"""generated_test.py TRESTLE VSOMEIP_DOOR ROOT: vsomeip with the configuration that `trestle generate` makes of examples/door,
and Trestle's tools, which call it by names. Run by in_namespaces."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

trestle, door, root = sys.argv[1:4]
del sys.argv[1:4]
OURS, THEIRS = "10.77.0.2", "10.77.0.1"
FILES = [str(pathlib.Path(root) / "examples/door" / name) for name in ("Door.fidl", "Door.fdepl")]


class Generated(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        subprocess.run([trestle, "generate", *FILES, "--to", "vsomeip", "--address", THEIRS, "-o", self.folder.name],
                       check=True)
        place = ["setpriv", "--pdeathsig", "KILL", "nsenter", "--net=" + os.environ["TRESTLE_PEER_NAMESPACE"]]
        environment = {**os.environ, "VSOMEIP_CONFIGURATION": os.path.join(self.folder.name, "vsomeip-service.json"),
                       "VSOMEIP_APPLICATION_NAME": "trestle-service", "VSOMEIP_BASE_PATH": self.folder.name}
        self.log = open(os.path.join(self.folder.name, "vsomeip.log"), "w+")
        self.process = subprocess.Popen([*place, door], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=self.log, text=True)
        # vsomeip's log goes to standard output, too.
        self.lines = []
        for line in self.process.stdout:
            self.lines.append(line)
            if line.startswith("ready"):
                return
        self.fail("vsomeip does not start:\n" + "".join(self.lines))

    def tearDown(self):
        self.process.stdin.close()
        try:
            self.process.stdout.read()
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()
        self.log.close()
        self.folder.cleanup()

    @staticmethod
    def trestle(*words):
        command = [trestle, *words, "--interfaces", *FILES, "--address", OURS, "--json", "-q"]
        return subprocess.run(command, capture_output=True, text=True, timeout=60)

    def test_methods_and_fields_by_their_names(self):
        answer = self.trestle("call", "Door.open", '{"speed": "FAST", "opening": 80}', "--timeout", "30")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertIn('"done":true', answer.stdout.replace(" ", ""))
        self.assertIn('"OK"', answer.stdout)
        answer = self.trestle("call", "Door.open", '{"speed": "SLOW", "opening": 101}', "--timeout", "30")
        self.assertIn('"BLOCKED"', answer.stdout)
        answer = self.trestle("call", "Door.label", "--timeout", "30")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertIn('"Push"', answer.stdout)
        answer = self.trestle("call", "Door.label", '"Pull"', "--timeout", "30")
        self.assertIn('"Pull"', answer.stdout)

    def test_the_event_of_a_field_by_its_name(self):
        told = self.trestle("subscribe", "Door.label", "--count", "1", "--timeout", "30")
        self.assertEqual(told.returncode, 0, told.stderr)
        self.assertIn('"Push"', told.stdout)


unittest.main()
