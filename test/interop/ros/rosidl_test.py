#!/usr/bin/env python3
"""rosidl_test.py BRIDGE_ROS_TEST: the interfaces of an installed ROS 2 beside what we know and make of them.

Without ROS 2, which `./run setup --peers` installs below build/, it is skipped (77); with TRESTLE_REQUIRE_PEERS=1 in the
environment that is a failure."""
import os
import pathlib
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
ROS = pathlib.Path(os.environ.get("TRESTLE_ROS") or ROOT / "build/ros")
program = sys.argv.pop(1)


class Rosidl(unittest.TestCase):
    def test_still_makes_what_the_golden_file_says(self):
        made = subprocess.run([ROS / "bin/python", "-B", ROOT / "test/interop/ros/golden.py",
                               ROOT / "bridge/messages/types/builtin", ROOT / "test/bridge/ros/interfaces"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=True).stdout
        golden = (ROOT / "test/bridge/ros/golden.txt").read_text()
        for ours, theirs in zip(golden.splitlines(), made.splitlines()):
            self.assertEqual(ours, theirs)
        self.assertEqual(len(golden), len(made))

    def test_idl_files_of_all_interfaces_say_the_same_to_us(self):
        ran = subprocess.run([program, "--gtest_filter=InstalledInterfaces.*"], stdout=subprocess.PIPE, text=True,
                             env={**os.environ, "TRESTLE_ROS_SHARE": str(ROS / "share")}, check=False)
        self.assertEqual(ran.returncode, 0, ran.stdout)
        self.assertIn("[  PASSED  ] 1 test.", ran.stdout)


if __name__ == "__main__":
    if not (ROS / "bin/python").exists():
        required = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) & {"1", "ros"}
        print(f"{'missing' if required else 'skipped'}: ros; ./run setup --peers installs it")
        sys.exit(1 if required else 77)
    unittest.main()
