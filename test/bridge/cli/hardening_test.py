#!/usr/bin/env python3
"""hardening_test.py READELF PROGRAM LIBRARY...: a program and libraries that are built to be installed have what makes
mistakes in them harder to use."""
import re
import subprocess
import sys
import unittest

READELF, PROGRAM, *LIBRARIES = sys.argv[1:]
del sys.argv[1:]


def readelf(*arguments):
    return subprocess.run([READELF, "-W", *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout


class Hardening(unittest.TestCase):
    def test_the_program_can_be_loaded_anywhere(self):
        self.assertRegex(readelf("-h", PROGRAM), r"Type: +DYN ")
        self.assertRegex(readelf("-d", PROGRAM), r"\(FLAGS_1\).*\bPIE\b")

    def test_what_the_loader_writes_is_read_only_afterwards(self):
        self.assertIn("GNU_RELRO", readelf("-l", PROGRAM))
        self.assertRegex(readelf("-d", PROGRAM), r"\(FLAGS_1\).*\bNOW\b|BIND_NOW")

    def test_its_stack_holds_no_code(self):
        stack = re.search(r"GNU_STACK .* ([RWE ]+) 0x\w+$", readelf("-l", PROGRAM), re.MULTILINE)
        self.assertTrue(stack)
        self.assertNotIn("E", stack[1])

    def test_its_functions_see_that_their_frame_was_overwritten(self):
        self.assertRegex(readelf("--dyn-syms", PROGRAM), r" UND __stack_chk_fail\b")
        for library in LIBRARIES:
            self.assertRegex(readelf("-s", library), r" UND __stack_chk_fail\b", library)

    def test_the_c_library_sees_that_more_is_written_than_there_is_room_for(self):
        checked = re.findall(r" UND (__\w+_chk)\b", readelf("--dyn-syms", PROGRAM))
        self.assertTrue(checked)
        self.assertTrue([name for name in checked if name in ("__memcpy_chk", "__memset_chk", "__memmove_chk", "__read_chk",
                                                              "__recv_chk", "__recvfrom_chk", "__snprintf_chk",
                                                              "__strcpy_chk", "__fprintf_chk", "__printf_chk")], checked)


if __name__ == "__main__":
    unittest.main()
