#!/usr/bin/env python3
"""decode_command_test.py TRESTLE CAPTURES: what a user of `trestle decode` sees: output, messages, exit status."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

program, captures = sys.argv.pop(1), sys.argv.pop(1)

REQUEST = "123404210000000a000100010101000" + "0cafe"
OFFER = ("ffff81000000003000000001010102 00c000000000000010010000101234567801000003000000020000000c"
         "000904000a0000010011772d")


def capture(name):
    return os.path.join(captures, name + ".pcap")


def run(*arguments, stdin=""):
    text = stdin if isinstance(stdin, bytes) else stdin.encode()
    done = subprocess.run([program, "decode", *arguments], input=text, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    return done.returncode, [json.loads(line) for line in done.stdout.splitlines()], done.stderr.decode()


class Hex(unittest.TestCase):
    def test_answers_each_line_in_order(self):
        status, objects, errors = run("--hex", stdin=f"{REQUEST}\n{OFFER}\n0x12:34-04 21\n\nwhat?\n{REQUEST}{REQUEST}\n")
        self.assertEqual([item["line"] for item in objects], [1, 2, 3, 4, 5, 6, 6])
        self.assertEqual([item.get("error", {}).get("name") for item in objects],
                         [None, None, "truncated", "truncated", "bad_hex", None, None])
        self.assertEqual([item["offset"] for item in objects], [0, 0, 0, 0, 0, 0, 18])
        self.assertEqual((status, errors), (1, ""))

    def test_a_line_that_is_not_hexadecimal_has_no_bytes(self):
        status, objects, errors = run("--hex", stdin="1234 04g1\n")
        self.assertEqual((status, errors), (1, ""))
        detail = objects[0]["error"].pop("detail")
        self.assertIn("character 7", detail)
        self.assertEqual(objects, [{"line": 1, "offset": 0, "error": {"name": "bad_hex", "rule": None, "offset": 7}}])

    def test_exits_with_0_when_all_is_well_formed(self):
        status, objects, errors = run("--hex", stdin=f"{REQUEST}\n{OFFER}")
        self.assertEqual((status, len(objects), errors), (0, 2, ""))
        self.assertEqual(objects[0]["payload"], "cafe")
        self.assertEqual(objects[1]["sd"]["entries"][0]["type"], "offer_service")

    def test_no_input_is_no_error(self):
        self.assertEqual(run("--hex"), (0, [], ""))

    def test_every_truncation_is_answered(self):
        for whole in (REQUEST, OFFER.replace(" ", "")):
            lines = [whole[:size] for size in range(0, len(whole), 2)]
            status, objects, _ = run("--hex", stdin="\n".join(lines) + "\n")
            self.assertEqual([item["line"] for item in objects], list(range(1, len(lines) + 1)))
            self.assertTrue(all("error" in item for item in objects))
            self.assertEqual(status, 1)

    def test_lengths_that_lie_are_answered(self):
        for length in (0, 7, 9, 11, 0x7fffffff, 0xffffffff):
            status, objects, _ = run("--hex", stdin=f"12340421{length:08x}000100010101 0000cafe\n")
            self.assertEqual((status, "error" in objects[-1]), (1, True), length)

    def test_text_that_is_not_utf8_stays_valid_json(self):
        option = "000701" + "00" + "04613dff41" + "00"
        payload = "c0000000" + "00000000" + f"{len(option) // 2:08x}" + option
        status, objects, _ = run("--hex", stdin=f"ffff8100{8 + len(payload) // 2:08x}0000000101010200{payload}\n")
        self.assertEqual(status, 0)
        self.assertEqual(objects[0]["sd"]["options"][0]["items"], [{"key": "a", "value": "\ufffdA"}])

    def test_answers_before_the_next_line_comes(self):
        with subprocess.Popen([program, "decode", "--hex"], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
            for line in range(1, 4):
                process.stdin.write(REQUEST.encode() + b"\n")
                process.stdin.flush()
                self.assertEqual(json.loads(process.stdout.readline())["line"], line)
            process.stdin.close()
            self.assertEqual(process.wait(), 0)

    def test_puts_segments_of_several_lines_together(self):
        slices = ["00" * 16, "11" * 16, "22" * 3]
        lines = [f"12348001{12 + len(part) // 2:08x}0000000101012200{16 * at | (at < 2):08x}{part}"
                 for at, part in enumerate(slices)]
        status, objects, _ = run("--hex", "--reassemble", stdin="\n".join(lines) + "\n")
        self.assertEqual((status, [item["line"] for item in objects]), (0, [1, 2, 3, 3]))
        self.assertEqual((objects[3]["reassembled"], objects[3]["payload"]), (True, "".join(slices)))


class Captures(unittest.TestCase):
    def test_file_and_standard_input_give_the_same(self):
        from_file = run(capture("rr_udp"))
        self.assertEqual((from_file[0], len(from_file[1])), (0, 48))
        with open(capture("rr_udp"), "rb") as file:
            self.assertEqual(run("-", stdin=file.read()), from_file)

    def test_exits_with_1_when_something_was_malformed(self):
        status, objects, _ = run(capture("errors_raw_client_vs_vsomeip_service"))
        broken = [item for item in objects if "error" in item]
        self.assertEqual((status, [(item["frame"], item["error"]["name"], item["error"]["offset"]) for item in broken]),
                         (1, [(37, "truncated", 4), (39, "truncated", 20), (41, "bad_length", 4), (43, "truncated", 10)]))

    def test_puts_large_messages_together(self):
        status, objects, errors = run("--reassemble", capture("tp_event_1mib_plus"))
        whole = [(item["message_type"], item["length"]) for item in objects if "reassembled" in item]
        self.assertEqual((status, whole, errors), (0, [("NOTIFICATION", 1048584), ("NOTIFICATION", 1200009)], ""))

    def test_knows_magic_cookies(self):
        _, objects, _ = run(capture("rr_tcp_magic_cookies"))
        self.assertEqual([item["magic_cookie"] for item in objects if "magic_cookie" in item], ["client", "server"])

    def test_says_when_the_interfaces_describe_nothing_of_it(self):
        with tempfile.TemporaryDirectory() as folder:
            lamp = os.path.join(folder, "Lamp.fidl")
            with open(lamp, "w") as file:
                file.write("package car\ninterface Lamp { version { major 1 minor 0 } broadcast hot { } }\n")
            deployed = os.path.join(folder, "Lamp.fdepl")
            with open(deployed, "w") as file:
                file.write('import "Lamp.fidl"\ndefine org.genivi.commonapi.someip.deployment for interface car.Lamp {\n'
                           "    SomeIpServiceID = 0x1234\n    broadcast hot { SomeIpEventID = 0x8001 SomeIpEventGroups = { 1 } }\n}\n")
            bare = "note: no message is of a service that the interfaces describe (Lamp 0x[0-9a-f]{4}, an id that Trestle chose); there are "
            bare = bare.replace("(", r"\(").replace(")", r"\)")
            status, _, errors = run("--hex", "--interfaces", lamp, stdin=f"{REQUEST}\n{OFFER}\n".encode())
            self.assertEqual(status, 0, errors)
            self.assertRegex(errors, bare + "messages of 0x1234\n")
            status, _, errors = run("--hex", "--interfaces", lamp)
            self.assertRegex(errors, bare + "none at all\n")
            # An entry of service discovery is enough.
            for seen in (REQUEST, OFFER):
                status, _, errors = run("--hex", "--interfaces", lamp, deployed, stdin=f"{seen}\n")
                self.assertEqual((status, errors), (0, ""))
            # A message whose interface version alone is another one.
            for version in ("01", "07"):
                status, objects, errors = run("--hex", "--interfaces", lamp, deployed, stdin=f"12348001000000080000000001{version}0200\n")
                self.assertEqual((status, objects[0]["event_name"]), (0, "hot"))
                self.assertEqual(objects[0].get("described_version"), None if version == "01" else 1)
                self.assertEqual(errors, "" if version == "01" else "note: 1 messages have another interface version than the interfaces (described_version)\n")
            status, _, errors = run(capture("rr_udp"), "--interfaces", lamp)
            self.assertRegex(errors, bare + "messages of 0x")

    def test_a_file_that_breaks_off_is_an_error(self):
        with open(capture("rr_udp"), "rb") as file, tempfile.NamedTemporaryFile() as cut:
            cut.write(file.read()[:5000])
            cut.flush()
            status, objects, errors = run(cut.name)
        self.assertEqual(status, 1)
        self.assertGreater(len(objects), 0)
        self.assertIn("truncated", errors)

    def test_ends_quietly_when_nobody_reads(self):
        # With --reassemble it must not tell of segments that it would have read, had somebody wanted them.
        for options in ([], ["--reassemble"]):
            with subprocess.Popen([program, "decode", *options, capture("tp_event_1mib_plus")],
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
                process.stdout.readline()
                process.stdout.close()
                self.assertEqual(process.stderr.read(), b"")
                self.assertEqual(process.wait(), 0)

    def test_ends_quietly_when_nobody_reads_the_answers_to_lines(self):
        segment = "123480010000019c000000070101220000000001" + "00" * 400  # 400 = 25 * 16; more are to come
        with subprocess.Popen([program, "decode", "--hex", "--reassemble"], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            process.stdout.close()
            process.stdin.write(f"{segment}\n".encode() * 3)
            process.stdin.close()
            self.assertEqual(process.stderr.read(), b"")
            self.assertEqual(process.wait(), 0)


class CommandLine(unittest.TestCase):
    def test_mistakes_exit_with_2_and_say_what_is_wrong(self):
        for arguments, expected in [
                ([], "FILE"), (["x.pcap", "--hex"], "--hex"), (["--port", "0", "x.pcap"], "--port"),
                (["--port", "70000", "x.pcap"], "--port"), (["--nonsense"], "--nonsense"),
                (["/nowhere/x.pcap"], "/nowhere/x.pcap: No such file"),
                ([os.path.join(captures, "README.md")], "README.md: unknown file format")]:
            status, objects, errors = run(*arguments)
            self.assertEqual((status, objects), (2, []), arguments)
            self.assertIn(expected, errors)

    def test_help_shows_examples(self):
        done = subprocess.run([program, "decode", "--help"], stdout=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0)
        self.assertIn("trestle decode --hex", done.stdout)

    def test_port_may_be_repeated(self):
        status, objects, _ = run("--port", "30509", "--port", "30510", capture("rr_udp"))
        self.assertEqual((status, len(objects)), (0, 48))


unittest.main()
