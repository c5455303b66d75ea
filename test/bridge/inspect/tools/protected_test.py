"""The commands that offer, call, send and receive what a description protects end to end, as programs: against each
other, and against bytes that are computed here.

Usage: protected_test.py TRESTLE EXAMPLES
"""
import json
import os
import re
import struct
import subprocess
import sys
import tempfile
import unittest

EXAMPLES = sys.argv.pop(2)
from tool_commands_test import TRESTLE, Running, run

SOURCES = [os.path.join(EXAMPLES, "door/Door.fidl"), os.path.join(EXAMPLES, "door/Door.fdepl")]
WITHOUT = ["--interfaces", *SOURCES]
FOLDER = tempfile.TemporaryDirectory()


def file_of(name, text):
    path = os.path.join(FOLDER.name, name)
    with open(path, "w") as file:
        file.write(text)
    return path


# FIDL has no E2E: a vsomeip JSON adds it to the event `moved`, the method `open` and the notifier of `label`.
IDS = {0x8010: 0x2d, 0x0010: 0x2e, 0x8002: 0x2f}
FIDL = [*WITHOUT, file_of("e2e.json", json.dumps({"e2e": {"e2e_enabled": "true", "protected": [
    {"service_id": "0x4711", "event_id": hex(event), "profile": "P04", "variant": "protector", "crc_offset": "64",
     "data_id": hex(data)} for event, data in IDS.items()]}}))]


def arxml():
    """The same as ARXML; the profile has a state machine, and parameters of other profiles."""
    text = subprocess.run([TRESTLE, "generate", *SOURCES, "--to", "arxml"], check=True, capture_output=True, text=True).stdout

    def props(kind, ref, dest, element, data):
        tag = f"END-2-END-{kind}-PROTECTION-PROPS"
        return (f"<{tag}><SHORT-NAME>P{data}</SHORT-NAME><DATA-IDS><DATA-ID>{data}</DATA-ID></DATA-IDS>"
                f"<E-2-E-PROFILE-CONFIGURATION-REF DEST=\"E-2-E-PROFILE-CONFIGURATION\">/E2E/Set/P4"
                f"</E-2-E-PROFILE-CONFIGURATION-REF><{ref} DEST=\"{dest}\">/car/Door/{element}</{ref}></{tag}>")

    where = re.compile(r"(<PROVIDED-SOMEIP-SERVICE-INSTANCE>\s*<SHORT-NAME>[^<]*</SHORT-NAME>)")
    assert len(where.findall(text)) == 1
    text = where.sub(
        lambda found: found[1] + "<E-2-E-EVENT-PROTECTION-PROPSS>" +
        props("EVENT", "EVENT-REF", "VARIABLE-DATA-PROTOTYPE", "moved", 0x2d) +
        props("EVENT", "EVENT-REF", "FIELD", "label", 0x2f) +
        "</E-2-E-EVENT-PROTECTION-PROPSS><E-2-E-METHOD-PROTECTION-PROPSS>" +
        props("METHOD", "METHOD-REF", "CLIENT-SERVER-OPERATION", "open", 0x2e) + "</E-2-E-METHOD-PROTECTION-PROPSS>",
        text)
    at = text.rindex("</AR-PACKAGES>")
    text = (text[:at] + "<AR-PACKAGE><SHORT-NAME>E2E</SHORT-NAME><ELEMENTS><E-2-E-PROFILE-CONFIGURATION-SET>"
            "<SHORT-NAME>Set</SHORT-NAME><E-2-E-PROFILE-CONFIGURATIONS><E-2-E-PROFILE-CONFIGURATION>"
            "<SHORT-NAME>P4</SHORT-NAME><CLEAR-FROM-VALID-TO-INVALID>true</CLEAR-FROM-VALID-TO-INVALID>"
            "<COUNTER-OFFSET>8</COUNTER-OFFSET><MAX-DELTA-COUNTER>1</MAX-DELTA-COUNTER>"
            "<MAX-ERROR-STATE-INIT>1</MAX-ERROR-STATE-INIT><PROFILE-NAME>PROFILE_04</PROFILE-NAME>"
            "<WINDOW-SIZE-INIT>5</WINDOW-SIZE-INIT><WINDOW-SIZE-VALID>10</WINDOW-SIZE-VALID></E-2-E-PROFILE-CONFIGURATION></E-2-E-PROFILE-CONFIGURATIONS>"
            "</E-2-E-PROFILE-CONFIGURATION-SET></ELEMENTS></AR-PACKAGE>" + text[at:])
    return ["--interfaces", file_of("protected.arxml", text)]


ARXML = arxml()


def crc32p4(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xC8DF352F if crc & 1 else 0)  # 0xF4ACFB13, the other way round
    return crc ^ 0xFFFFFFFF


assert crc32p4(b"123456789") == 0x1697D06A  # as AUTOSAR's catalogue has it


def protected(payload, counter, data_id, session, kind=2):
    """An event's payload with its header of profile 4, by the PRS."""
    front = struct.pack(">HHBBBB", 0, session, 1, 1, kind, 0)
    header = struct.pack(">HHI", len(front) + 12 + len(payload), counter, data_id)
    return header + struct.pack(">I", crc32p4(front + header + payload)) + payload


class Protected(unittest.TestCase):
    def test_a_call_goes_both_ways(self):
        for interfaces in (FIDL, ARXML):
            with Running("offer", 1, "Door", "--method", 'open={"error": "BLOCKED", "done": true}', "--json", "--udp",
                         "--tcp", *interfaces) as offer:
                for way in ([], ["--tcp"], []):  # the last one: a server knows callers that begin anew
                    done = run("call", 2, "Door.open", "{speed: FAST, opening: 80}", "-q", *way, *interfaces)
                    self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "error: BLOCKED\ndone: true\n", ""))
                    request = json.loads(offer.line_with("method"))
                    self.assertEqual((request["e2e_check"], request["values"]), ("ok", {"speed": "FAST", "opening": 80}))
                done = run("call", 2, "Door.open", '{"speed": "SLOW"}', "-q", "--json", *interfaces)
                answer = json.loads(done.stdout)
                self.assertEqual((answer["e2e_check"], answer["values"]), ("ok", {"error": "BLOCKED", "done": True}))
                # Others have no protection.
                done = run("call", 2, "Door.shut", "{speed: SLOW}", "-q", *interfaces)
                self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "done: false\n", ""))
                self.assertEqual(offer.stop()[0], 0)

    def test_a_request_without_its_header_is_refused_and_told(self):
        with Running("offer", 1, "Door", "-q", *FIDL) as offer:
            done = run("call", 2, "Door.open", "{speed: FAST}", "-q", *WITHOUT)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (3, "", "error: the answer is E_E2E\n"))
            self.assertIn("warning: the E2E check of Door.open failed: data_length", offer.line_with("E2E", of_log=True))

    def test_an_answer_without_its_header_is_told(self):
        with Running("offer", 1, "0x4711.1", "--method", "0x10=0101", "-q") as offer:
            done = run("call", 2, "Door.open", "{speed: FAST, opening: 2}", "-q", *FIDL)
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (3, "", "error: the E2E check of the answer failed: data_length\n"))
            # The request had its header: length, counter, data id.
            self.assertRegex(offer.line_with("0x0010"), r"^0x0010 001600000000002e[0-9a-f]{8}0102$")

    def test_an_event_goes_to_a_subscriber(self):
        for interfaces in (FIDL, ARXML):
            with Running("notify", 1, "Door.moved", "{opening: 50, speed: FAST}", "--rate", "50", *interfaces) as notify:
                done = run("subscribe", 2, "Door.moved", "--count", "3", "-q", *interfaces)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertEqual(done.stdout.count("opening: 50\nspeed: FAST\n---\n"), 3)
                # Who joins later finds the first one out of sequence, and all others in it.
                done = run("subscribe", 3, "0x4711.1", "2", "--count", "3", "--json", "-q", *interfaces)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertEqual([json.loads(line)["e2e_check"] for line in done.stdout.splitlines()],
                                 ["wrong_sequence", "ok", "ok"])
                self.assertEqual(notify.stop()[0], 0)

    def test_an_event_has_the_bytes_of_the_profile(self):
        with Running("notify", 1, "Door.moved", "{opening: 50, speed: FAST}", "--rate", "50", *FIDL):
            done = run("subscribe", 2, "0x4711.1", "2", "--count", "3", "--json", "-q")
            for line in map(json.loads, done.stdout.splitlines()):
                payload = bytes.fromhex(line["payload"])
                counter = int.from_bytes(payload[2:4], "big")
                self.assertEqual(payload.hex(), protected(b"\x32\x01", counter, 0x2D, line["session"]).hex())

    def test_bytes_of_others_are_taken_and_wrong_ones_told(self):
        # The first event has session 1; later ones have another, which the CRC does not fit.
        with Running("subscribe", 2, "Door.moved", "--count", "2", "--json", "-q", *FIDL) as subscribe:
            with Running("notify", 1, "0x4711.1", "2", "0x8010", protected(b"\x32\x01", 0, 0x2D, 1).hex(), "--rate", "20"):
                first, second = (json.loads(subscribe.line_with("event")) for _ in range(2))
                self.assertEqual((first["e2e_check"], first["values"]), ("ok", {"opening": 50, "speed": "FAST"}))
                self.assertEqual((second["e2e_check"], second["e2e_fault"], second["payload"]), ("error", "crc", "3201"))
                status, _, log = subscribe.finish()
                self.assertEqual((status, log), (1, "warning: the E2E check of Door.moved failed: crc\nwarning: 1 of 2 events were not good\n"))

    def test_a_field_is_read_set_and_heard(self):
        for interfaces in (FIDL, ARXML):
            with Running("offer", 1, "Door", "--field", "label=Push", *interfaces) as offer:
                with Running("subscribe", 3, "Door.label", "--count", "3", "--json", "-q", *interfaces) as subscribe:
                    checks = [json.loads(subscribe.line_with("event"))]
                    for value in ("Pull", "Turn"):
                        done = run("call", 2, "Door.label", value, "-q", *interfaces)
                        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, f"label: {value}\n", ""))
                        checks.append(json.loads(subscribe.line_with("event")))
                    self.assertEqual([(one["e2e_check"], one["values"]["label"]) for one in checks],
                                     [("ok", "Push"), ("ok", "Pull"), ("ok", "Turn")])
                    self.assertEqual(subscribe.finish()[::2], (0, ""))
                done = run("call", 2, "Door.label", "-q", *interfaces)
                self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "label: Turn\n", ""))
                self.assertEqual(offer.stop()[0], 0)

    def test_each_instance_has_its_own(self):
        with open(ARXML[1]) as file:
            text = file.read()
        first = re.search("<PROVIDED-SOMEIP-SERVICE-INSTANCE>.*?</PROVIDED-SOMEIP-SERVICE-INSTANCE>", text, re.DOTALL)[0]
        second = re.sub("<SHORT-NAME>[^<]*<", "<SHORT-NAME>Other<", first, count=1)
        second = second.replace("<DATA-ID>", "<DATA-ID>1").replace("<SERVICE-INSTANCE-ID>1<", "<SERVICE-INSTANCE-ID>2<")
        path = file_of("instances.arxml", text.replace(first, first + second))
        two = ["--interfaces", path]
        with Running("notify", 1, "Door.0x0002.moved", "{opening: 50, speed: FAST}", "--rate", "50", *two) as notify:
            done = run("subscribe", 2, "Door.0x0002.moved", "--count", "2", "-q", *two)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            done = run("subscribe", 2, "0x4711.2", "2", "--count", "1", "--json", "-q")
            self.assertEqual(int.from_bytes(bytes.fromhex(json.loads(done.stdout)["payload"])[4:8], "big"), 145)
            self.assertEqual(notify.stop()[0], 0)
        with Running("offer", 1, "Door.0x0002", "-q", *two):
            done = run("call", 2, "Door.0x0002.open", "{speed: FAST}", "-q", *two)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            done = run("call", 2, "Door.open", "{speed: FAST}", "-q", *two)
            self.assertEqual(done.returncode, 3)
            self.assertIn("warning: the E2E protection of Door.open is not the same in all instances: in instance 0x0002 data_id "
                          "0x0092; without an instance that of the others is taken\n", done.stderr)
        # A bridge has a route for each, also of the method.
        routes = os.path.join(FOLDER.name, "routes")
        subprocess.run([TRESTLE, "generate", path, "--to", "routes,msg", "-o", routes, "-q"], check=True)
        with open(os.path.join(routes, "bridge.yaml")) as file:
            ids = re.findall("data_id: (0x[0-9a-f]+|\\d+)", file.read())
        self.assertEqual(sorted(int(one, 0) for one in ids), [45, 46, 47, 145, 146, 147])
        subprocess.run([TRESTLE, "check", os.path.join(routes, "bridge.yaml")], check=True, stdout=subprocess.DEVNULL)

    def test_what_cannot_be_protected_is_told_in_any_case(self):
        # Profile 5 needs a length, which nobody has said.
        path = file_of("bad.json", json.dumps({"e2e": {"protected": [
            {"service_id": "0x4711", "event_id": event, "profile": "P05", "variant": "protector", "data_id": "1"}
            for event in ("0x8010", "0x0010")]}}))
        text = "warning: the E2E protection of {} (profile 5) is left out, and its messages {}: e2e: 'data_bits' is missing"
        with Running("notify", 1, "Door.moved", "{opening: 50}", "-q", "--rate", "50", *WITHOUT, path) as notify:
            self.assertIn(text.format("Door.moved", "go without it"), notify.line_with("E2E", of_log=True))
            done = run("subscribe", 2, "Door.moved", "-q", "--count", "1", *WITHOUT, path)
            self.assertIn(text.format("Door.moved", "are not checked"), done.stderr)
        with Running("offer", 1, "Door", "-q", *WITHOUT, path) as offer:
            self.assertIn(text.format("Door.moved", "go without it"), offer.line_with("Door.moved", of_log=True))
            done = run("call", 2, "Door.open", "{}", "-q", *WITHOUT, path)
            self.assertIn(text.format("Door.open", "go without it"), done.stderr)

    def test_a_payload_of_a_length_that_the_profile_does_not_have_is_refused(self):
        path = file_of("short.json", json.dumps({"e2e": {"protected": [
            {"service_id": "0x4711", "event_id": event, "profile": "P05", "variant": "protector", "crc_offset": "64",
             "data_id": "1", "data_length": "112"} for event in ("0x8010", "0x0010")]}}))
        for arguments in (("notify", 1, "Door.moved", "{opening: 50}"), ("call", 1, "Door.open", "{opening: 50}")):
            done = run(*arguments, "-q", *WITHOUT, path)
            self.assertEqual(done.returncode, 2)
            self.assertRegex(done.stderr, r"Door\.\w+ has 2 bytes, and its E2E profile has no messages of this length")


if __name__ == "__main__":
    unittest.main()
