#!/usr/bin/env python3
"""Reads ARXML files that large_arxml.py writes: everything in them is there, and memory grows with the file no faster than a
file of 100 MB in 1 GB allows.

Usage: large_test.py ARXML_COUNTS [--any-memory]
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv[1]
ANY_MEMORY = "--any-memory" in sys.argv
WRITER = pathlib.Path(__file__).parent / "large_arxml.py"
MOST_BYTES_FOR_EACH = 10  # 1 GB for 100 MB


def read(file):
    """What arxml_counts prints, and the most memory that it had, in bytes."""
    child = subprocess.Popen([PROGRAM, str(file)], stdout=subprocess.PIPE, text=True)
    output = child.stdout.read()
    child.stdout.close()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        raise AssertionError(f"{PROGRAM} ended with {child.returncode}")
    counts = {line.split()[0]: int(line.split()[1]) for line in output.splitlines()}
    return counts, usage.ru_maxrss * 1024


class Large(unittest.TestCase):
    def test_everything_is_read_in_memory_that_grows_with_the_file(self):
        with tempfile.TemporaryDirectory() as folder:
            sizes, memory = [], []
            for megabytes in ("0.1", "2"):
                file = pathlib.Path(folder) / f"{megabytes}.arxml"
                subprocess.run([sys.executable, "-B", WRITER, megabytes, file], check=True)
                text = file.read_text(encoding="utf-8")
                counts, used = read(file)
                services = text.count("<SERVICE-INTERFACE>")
                self.assertGreater(services, 3)
                self.assertEqual(counts["services"], services)
                self.assertEqual(counts["events"], 8 * services)
                self.assertEqual(counts["methods"], 4 * services)
                self.assertEqual(counts["fields"], 0)
                self.assertGreaterEqual(counts["types"], 4 * services)
                self.assertEqual(counts["instances"], services)
                sizes.append(len(text))
                memory.append(used)
            grown = (memory[1] - memory[0]) / (sizes[1] - sizes[0])
            print(f"{grown:.1f} bytes of memory for each byte of the file", file=sys.stderr)
            if not ANY_MEMORY:
                self.assertLess(grown, MOST_BYTES_FOR_EACH)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
