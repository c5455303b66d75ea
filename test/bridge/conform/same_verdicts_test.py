#!/usr/bin/env python3
"""same_verdicts.py with a stand-in for `trestle`, of which one run is different.

Usage: same_verdicts_test.py
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import textwrap
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent / "same_verdicts.py"
# Passes its cases, but for one in the run that DIFFERENT names.
STAND_IN = """
    #!/usr/bin/env python3
    import json, os, pathlib, sys
    folder = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
    folder.mkdir(parents=True)
    (folder / "words").write_text(" ".join(sys.argv[1:]))
    bad = folder.name == os.environ.get("DIFFERENT")
    (folder / "results.json").write_text(json.dumps({"cases": [
        {"id": "a.b", "verdict": "fail" if bad else "pass", "attempts": 3 if bad else 1},
        {"id": "a.c", "verdict": "unsupported", "attempts": 0}]}))
    sys.exit(int(os.environ.get("STATUS", bad)))
"""


class SameVerdicts(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.trestle = self.folder / "trestle"
        self.trestle.write_text(textwrap.dedent(STAND_IN).lstrip())
        self.trestle.chmod(0o755)

    def same(self, *arguments, status, **environment):
        """What it prints; the test fails on another exit status."""
        done = subprocess.run([sys.executable, "-B", SCRIPT, *map(str, arguments)], capture_output=True, text=True, timeout=60,
                              env={**os.environ, **environment})
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def test_counts_runs_that_are_the_same(self):
        text = self.same(self.trestle, "a", "--runs", 3, "--load", 0, "--seed", 5, "--out", self.folder / "out", status=0)
        self.assertIn("3 of 3 runs gave the same verdicts for 2 cases\n", text)
        words = (self.folder / "out" / "run-02" / "words").read_text()
        self.assertRegex(words, "^conform run a --dut .*/examples/ets_device/profile.yaml --jobs 8 --seed 5 --out ")
        text = self.same(self.trestle, "--runs", 4, "--load", 0, status=1, DIFFERENT="run-03")
        self.assertRegex(text, r"run 3: 1 fail, 1 unsupported; 1 tried again; .* s\n  a\.b: fail, in the first run pass\n")
        self.assertIn("3 of 4 runs gave the same verdicts for 2 cases\n", text)

    def test_ends_when_it_cannot_compare(self):
        self.assertIn("conform ended with status 2", self.same(self.trestle, "--load", 0, status=1, STATUS="2"))
        self.assertIn("two or more", self.same(self.trestle, "--runs", 1, status=2))
        self.assertIn("--load 0 runs without it", self.same(self.trestle, status=2, PATH="/nowhere"))


if __name__ == "__main__":
    unittest.main()
