#!/usr/bin/env python3
"""Reads ARXML files that large_arxml.py writes, of up to so many megabytes: everything in them is there, and memory grows with
the file no faster than a file of 100 MB in 1 GB allows.

Usage: large_test.py ARXML_COUNTS MEGABYTES [--any-memory]
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv[1]
MEGABYTES = sys.argv[2]
ANY_MEMORY = "--any-memory" in sys.argv
WRITER = pathlib.Path(__file__).parent / "large_arxml.py"
MOST_BYTES_FOR_EACH = 10  # 1 GB for 100 MB


def read(file):
    """What arxml_counts prints, and the most memory that it had, in bytes."""
    child = subprocess.Popen([PROGRAM, str(file)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    output = child.stdout.read()
    child.stdout.close()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        raise AssertionError(f"{PROGRAM} ended with {child.returncode}")
    counts = {line.split()[0]: int(line.split()[1]) for line in output.splitlines()}
    return counts, usage.ru_maxrss * 1024


def count(file, what):
    """Line by line: the memory of a child is at least what this program ever had."""
    with file.open(encoding="utf-8") as lines:
        return sum(line.count(what) for line in lines)


class Large(unittest.TestCase):
    def check(self, megabytes, options, expected):
        """Reads a small file and one of this size; `expected` says of a file how many of each thing are in it."""
        with tempfile.TemporaryDirectory() as folder:
            sizes, memory = [], []
            for size in ("0.1", megabytes):
                file = pathlib.Path(folder) / f"{size}.arxml"
                subprocess.run([sys.executable, "-B", WRITER, size, file, *options], check=True)
                counts, used = read(file)
                wanted = expected(file)
                self.assertGreater(wanted["services"], 3)
                self.assertEqual({name: counts[name] for name in wanted}, wanted)
                sizes.append(file.stat().st_size)
                memory.append(used)
            grown = (memory[1] - memory[0]) / (sizes[1] - sizes[0])
            print(f"{grown:.1f} bytes of memory for each byte of the file", file=sys.stderr)
            if not ANY_MEMORY:
                self.assertLess(grown, MOST_BYTES_FOR_EACH)

    def test_everything_is_read_in_memory_that_grows_with_the_file(self):
        def expected(file):
            services = count(file, "<SERVICE-INTERFACE>")
            return {"services": services, "events": 8 * services, "methods": 4 * services, "fields": 0,
                    "types": 4 * services, "instances": services}
        self.check(MEGABYTES, [], expected)

    def test_the_same_of_a_system_description(self):
        def expected(file):
            services = count(file, "<PROVIDED-SERVICE-INSTANCE>")
            return {"services": services, "events": services, "methods": 0, "fields": 0, "instances": 2 * services}
        self.check("6", ["--classic"], expected)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
