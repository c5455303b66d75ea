#!/usr/bin/env python3
"""run_stacks.py with stacks that are not there, and with a stand-in for `trestle`: what it runs, and how it ends.

Usage: run_stacks_test.py
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import textwrap
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent / "run_stacks.py"
# Leaves results as `trestle conform run` does: as many errors as it is told to, or no results at all.
STAND_IN = """
    #!/usr/bin/env python3
    import json, os, pathlib, sys
    print("ran", *sys.argv[1:], flush=True)
    folder = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
    folder.mkdir(parents=True, exist_ok=True)
    if "ERRORS" in os.environ:
        (folder / "results.json").write_text(json.dumps({"verdicts": {"error": int(os.environ["ERRORS"])}}))
"""


class RunStacks(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.trestle = self.executable("trestle", textwrap.dedent(STAND_IN).lstrip())

    def executable(self, name, text):
        file = self.folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        file.chmod(0o755)
        return file

    def run_stacks(self, *arguments, status, **environment):
        """What it prints; the test fails on another exit status."""
        clean = {name: value for name, value in os.environ.items() if not name.startswith("TRESTLE_")}
        done = subprocess.run([sys.executable, "-B", SCRIPT, *map(str, arguments)], capture_output=True, text=True, timeout=60,
                              env={**clean, "TRESTLE_PEERS": str(self.folder / "peers"), **environment})
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def test_skips_what_is_not_there(self):
        # No folder of peers; and one whose Python has no stack.
        for _ in range(2):
            text = self.run_stacks(self.trestle, self.folder / "out", status=77)
            for module in ("someip", "someipy", "opensomeip", "scapy"):
                self.assertIn(f"skipped: {module} is not in {self.folder / 'peers'}\n", text)
            self.assertNotIn("ran", text)
            self.executable("peers/bin/python", "#!/bin/sh\nexit 1\n")
        text = self.run_stacks(self.trestle, self.folder / "out", "vsomeip", "cortex_m", status=77)
        self.assertIn("skipped: TRESTLE_VSOMEIP_DEVICE ", text)
        self.assertIn("skipped: TRESTLE_FIRMWARE ", text)
        self.run_stacks(self.trestle, self.folder / "out", status=1, TRESTLE_REQUIRE_PEERS="1")

    def test_runs_what_is_there(self):
        self.executable("peers/bin/python", "#!/bin/sh\ncase $2 in *scapy) ;; *) exit 1 ;; esac\n")
        text = self.run_stacks(self.trestle, self.folder / "out", "scapy", "pysomeip", "--", "sd.offer", "--seed", "7", status=0,
                               ERRORS="0")
        self.assertIn(f"ran conform run --dut {SCRIPT.parent / 'scapy.yaml'} --out {self.folder / 'out' / 'scapy'} sd.offer --seed 7",
                      text)
        self.assertIn("skipped: someip is not in", text)
        # The runner itself failed, or left nothing: also where results of an earlier run are.
        self.run_stacks(self.trestle, self.folder / "out", "scapy", status=1, ERRORS="2")
        self.assertIn("no results in", self.run_stacks(self.trestle, self.folder / "out", "scapy", status=1))

    def test_refuses_what_it_does_not_know(self):
        self.assertIn("no such stack: nobody", self.run_stacks(self.trestle, self.folder / "out", "nobody", status=2))
        self.run_stacks(status=2)


if __name__ == "__main__":
    unittest.main()
