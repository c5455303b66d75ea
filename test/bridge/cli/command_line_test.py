#!/usr/bin/env python3
"""command_line_test.py TRESTLE: what `trestle` says of itself."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

program = sys.argv.pop(1)
COMMANDS = ["bridge", "check", "status", "schema", "record", "replay", "generate", "diff", "explain", "conform", "fuzz", "decode", "find", "watch", "call", "subscribe", "offer", "notify", "perf", "demo", "completion", "man"]


def run(*arguments):
    done = subprocess.run([program, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60)
    return done.returncode, done.stdout, done.stderr


class CommandLine(unittest.TestCase):
    def test_without_a_command_shows_the_help_as_an_error(self):
        status, output, errors = run()
        self.assertEqual((status, output), (2, ""))
        self.assertEqual(errors, run("--help")[1])
        self.assertIn("Usage: trestle [OPTIONS] SUBCOMMAND", errors)

    def test_an_unknown_command_is_an_error_and_names_it(self):
        status, output, errors = run("bride")
        self.assertEqual((status, output), (2, ""))
        self.assertEqual(errors, "There is no command or option 'bride'; did you mean 'bridge'?\n\n" + run("--help")[1])
        status, output, errors = run("brigde", "drive.yaml")
        self.assertEqual((status, output), (2, ""))
        self.assertIn("There is no command or option 'brigde'; did you mean 'bridge'?\n", errors)
        status, output, errors = run("something-else")
        self.assertEqual((status, output), (2, ""))
        self.assertEqual(errors, "There is no command or option 'something-else'\n\n" + run("--help")[1])
        status, output, errors = run("perf", "clint")
        self.assertEqual((status, output), (2, ""))
        self.assertEqual(errors, "There is no command or option 'clint'; did you mean 'client'?\n\n" +
                         run("perf", "--help")[1])
        self.assertNotIn("did you mean", run("demo-publishe")[2])  # a part of the demo, that nobody starts by hand
        status, output, errors = run("--bridge")
        self.assertEqual((status, output), (2, ""))
        self.assertIn("--bridge", errors)

    def test_a_missing_argument_of_a_command_is_named(self):
        status, output, errors = run("check")
        self.assertEqual((status, output), (2, ""))
        self.assertIn("FILE is required", errors)

    def test_describes_all_commands_alike(self):
        commands = re.findall(r"^  (\w[\w-]*) +(.*)$", run("--help")[1].split("Subcommands:")[1], re.MULTILINE)
        self.assertEqual([name for name, _ in commands], COMMANDS)
        for name, description in commands:
            self.assertRegex(description, r"^[A-Z].*[^.]$", name)

    def test_names_values_without_types_and_ranges(self):
        for command in COMMANDS:
            status, output, errors = run(command, "--help")
            self.assertEqual((status, errors), (0, ""))
            self.assertNotRegex(output, r"TEXT|UINT|FLOAT|:INT|INT:|Excludes|REQUIRED| in \[", command)
        output = run("demo", "--help")[1]
        self.assertRegex(output, r"--seconds N +End after")
        self.assertRegex(output, r"--rate HZ=10 +Clouds")
        self.assertRegex(output, r"--input FILE \.\.\. +Publish")

    def test_shows_the_form_of_values_as_a_whole(self):
        lines = []
        for command in COMMANDS:
            output = run(command, "--help")[1]
            below = re.findall(r"^  (\w[\w-]*) ", output.partition("Subcommands:")[2], re.MULTILINE)
            for text in (output, *(run(command, one, "--help")[1] for one in below)):
                lines += [line for line in text.splitlines() if line.count("[") != line.count("]")]
        self.assertEqual(lines, [])
        output = run("offer", "--help")[1]
        self.assertIn("--method ID[:TYPE[:ANSWER_TYPE]][=PAYLOAD]", output)
        self.assertIn("--field GETTER/SETTER/NOTIFIER[:TYPE][=VALUE]", output)

    def test_a_value_out_of_range_names_the_option_and_the_range(self):
        status, output, errors = run("demo", "--seconds", "0")
        self.assertEqual((status, output), (2, ""))
        self.assertIn("--seconds", errors)
        self.assertRegex(errors, r"1 (to|-) 1000000")  # in CLI11's words of before 2.4 and since

    def test_output_that_cannot_be_written_is_a_failure(self):
        example = os.path.join(os.path.dirname(__file__), "../../../examples/bridge_a.yaml")
        for arguments in (["check", example], ["--help"], ["--version"]):
            with open("/dev/full", "w") as full:
                done = subprocess.run([program, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
            self.assertEqual(done.returncode, 1, arguments)
            self.assertIn("cannot write all of the output", done.stderr)

    def test_warns_of_length_fields_that_are_too_narrow(self):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            file.write("someip: {address: 127.0.0.1}\nroutes:\n"
                       "  - {topic: /p, type: sensor_msgs/msg/PointCloud2, direction: someip_to_dds, service: 1,\n"
                       "     instance: 1, eventgroup: 1, event: 0x8001, wire: {array_length: 8}}\n")
            file.flush()
            status, output, errors = run("check", file.name)
        self.assertEqual(status, 0)
        self.assertIn("good, 1 route", output)
        self.assertIn(f"{file.name}:3:23: warning: type: with array_length: 8, messages are dropped", errors)

    def test_checks_and_writes_the_services_of_fields(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "fields.yaml")

            def check(more, *options):
                with open(file, "w") as out:
                    out.write("someip: {address: 127.0.0.1}\nfields:\n  - {topic: /light, type: std_msgs/msg/Bool, "
                              f"server: someip, service: 1, instance: 1, getter: 1, setter: 2{more}}}\n")
                return run("check", *options, file)
            place = f"{file}:3:119: error: set_type: "
            self.assertIn(place + "std_srvs/srv/SetBool_Response does not hold the value: expected one member of type "
                          "std_msgs/msg/Bool", check(", set_type: std_srvs/srv/SetBool")[2])
            self.assertIn(place + "unknown type no_msgs/srv/SetBool", check(", set_type: no_msgs/srv/SetBool")[2])
            status, output, errors = check("", "--field-services", os.path.join(folder, "src"))
            self.assertEqual((status, errors), (0, ""))
            self.assertIn("made  std_msgs_fields/srv/SetBool", output)
            with open(os.path.join(folder, "src/std_msgs_fields/srv/SetBool.srv")) as made:
                self.assertEqual(made.read(), "std_msgs/Bool value\n---\nstd_msgs/Bool value\n")
            status, _, errors = check("", "--field-services", "/dev/null/src")
            self.assertEqual(status, 1)
            self.assertIn("/dev/null/src/std_msgs_fields", errors)

    def test_an_empty_configuration_is_an_error_with_a_place(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "empty.yaml")
            with open(file, "w"):
                pass
            status, output, errors = run("check", file)
        self.assertEqual((status, output), (2, ""))
        self.assertTrue(errors.startswith(file + ":1:1: error: "), errors)


if __name__ == "__main__":
    unittest.main()
