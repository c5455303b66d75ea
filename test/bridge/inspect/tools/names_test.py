"""The commands that speak in the names of interface descriptions (--interfaces), as programs: against each other, and
with a recording.

Usage: names_test.py TRESTLE EXAMPLES
"""
import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest

EXAMPLES = sys.argv.pop(2)
from tool_commands_test import HOST, TRESTLE, Running, run

HERE = os.path.dirname(os.path.abspath(__file__))
DOOR = ["--interfaces", os.path.join(EXAMPLES, "door/Door.fidl"), os.path.join(EXAMPLES, "door/Door.fdepl")]
EVERY = ["--interfaces", os.path.join(HERE, "every")]

# A value for each kind of type: text, and how it is printed in JSON.
EVERYTHING = """
yes: true
i8: -5
u16: 65535
i32: -70000
u64: 18446744073709551615
f: 0.5
d: .inf
text: Grüße
wide: abc
fixed: abcd
blob: "hex:00ff10"
level: veryHigh
grade: 1
levels: [LOW, veryHigh, 7]
special: {x: 1.5, heading: -3, valid: true, label: here}
shape: {circle: {x: 2.5}}
shapes: [{name: a}, {raw: [1, 2]}]
distances: {LOW: 10, veryHigh: 20}
grid: [[1, 2], [], [3]]
flags: {few: 5, some: LOW, last: true}
"""
PRINTED = {
    "yes": True, "i8": -5, "u16": 65535, "i32": -70000, "u64": 18446744073709551615, "f": 0.5, "d": "Infinity",
    "text": "Grüße", "wide": "abc", "fixed": "abcd", "blob": "hex:00ff10", "level": "veryHigh", "grade": "LOW",
    "levels": ["LOW", "veryHigh", 7], "special": {"x": 1.5, "heading": -3, "valid": True, "label": "here"},
    "shape": {"circle": {"x": 2.5, "heading": 0, "valid": False}}, "shapes": [{"name": "a"}, {"raw": [1, 2]}],
    "distances": [{"key": "LOW", "value": 10}, {"key": "veryHigh", "value": 20}], "grid": [[1, 2], [], [3]],
    "flags": {"few": 5, "some": "LOW", "last": True}}
IT = {"it": PRINTED}


ERR_FIDL = """package car
interface Err {
  version { major 1 minor 0 }
  method shut { in { UInt8 speed } out { Boolean done } error ShutError }
  method chosen { out { Boolean done } error ShutError }
  method plain { out { Boolean done } error { FINE = 0 BROKEN = 7 } }
  enumeration ShutError { BLOCKED = 1 LOCKED = 2 }
}
"""
ERR_FDEPL = """import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl"
import "Err.fidl"
define org.genivi.commonapi.someip.deployment for interface car.Err {
  SomeIpServiceID = 0x4721
  method shut { SomeIpMethodID = 0x11 }
  method chosen { SomeIpMethodID = 0x12 }
  method plain { SomeIpMethodID = 0x13 }
}
define org.genivi.commonapi.someip.deployment for provider as Car {
  instance car.Err { InstanceId = "car.Err" SomeIpInstanceID = 1 SomeIpUnreliableUnicastPort = 30711 }
}
"""


def mapping(text):
    """Lines of YAML as a flow mapping."""
    return "{" + ", ".join(text.strip().splitlines()) + "}"


def message(service, method, payload, kind=0, code=0, version=1, session=1):
    return struct.pack(">HHIHHBBBB", service, method, 8 + len(payload), 1, session, 1, version, kind, code) + payload


def capture(datagrams):
    """A pcap file of raw IPv4 with these UDP datagrams."""
    file = struct.pack("<IHHiIII", 0xa1b2c3d4, 2, 4, 0, 0, 0x40000, 101)
    for payload in datagrams:
        udp = struct.pack(">HHHH", 30711, 40000, 8 + len(payload), 0) + payload
        packet = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, bytes([10, 0, 0, 1]),
                             bytes([10, 0, 0, 2])) + udp
        file += struct.pack("<IIII", 1, 0, len(packet), len(packet)) + packet
    return file


def decode(*arguments, stdin=b""):
    done = subprocess.run([TRESTLE, "decode", *arguments], input=stdin, capture_output=True)
    return done.returncode, [json.loads(line) for line in done.stdout.splitlines()], done.stderr.decode()


def decode_capture(datagrams, *arguments):
    with tempfile.NamedTemporaryFile(suffix=".pcap") as file:
        file.write(capture(datagrams))
        file.flush()
        return decode(file.name, *arguments)


class Door(unittest.TestCase):
    """The example that the documentation uses."""

    def test_a_method_is_called_by_names(self):
        with Running("offer", 1, "Door", "--method", "open={error: BLOCKED, done: true}", "--tcp", "--udp", *DOOR) as offer:
            done = run("call", 2, "Door.open", "{speed: FAST, opening: 80}", *DOOR)
            self.assertEqual((done.returncode, done.stdout), (0, "error: BLOCKED\ndone: true\n"), done.stderr)
            self.assertIn("# Door.open session", offer.line_with("#"))
            self.assertEqual(offer.line_with("speed"), "speed: FAST")
            self.assertEqual(offer.line_with("opening"), "opening: 80")
            # Two arguments, and numbers in place of enumerators.
            done = run("call", 2, "car.Door.0x0001", "open", "{speed: 1}", "--json", *DOOR)
            self.assertEqual(done.returncode, 2)  # with --json, payloads are JSON
            done = run("call", 2, "car.Door.0x0001", "open", '{"speed": 1}', "--json", *DOOR)
            self.assertEqual(json.loads(done.stdout), {
                "method": "0x0010", "service_name": "Door", "method_name": "open", "return_code": "E_OK",
                "return_code_value": 0, "values": {"error": "BLOCKED", "done": True}})
            self.assertEqual(offer.line_with("speed"), "speed: FAST")
            # By ids, with the values of the description.
            done = run("call", 2, "0x4711", "0x0011", "{speed: SLOW}", *DOOR)
            self.assertEqual((done.returncode, done.stdout), (0, "done: false\n"), done.stderr)
            # Hexadecimal on demand.
            done = run("call", 2, "Door.open", "01 50", "--hex", *DOOR)
            self.assertEqual((done.returncode, done.stdout), (0, "0101\n"), done.stderr)
            # Fire and forget, as the description says.
            done = run("call", 2, "Door.ring", "{tune: ding}", *DOOR)
            self.assertEqual((done.returncode, done.stdout), (0, ""), done.stderr)
            self.assertEqual(offer.line_with("tune"), "tune: ding")

    def test_arguments_that_are_left_out_are_told(self):
        with Running("offer", 1, "Door", "--method", "open={done: true}", "--udp", *DOOR) as offer:
            done = run("call", 2, "Door.open", "{speed: FAST}", *DOOR)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn('opening is left out; sent is {"speed":"FAST","opening":0}', done.stderr)
            self.assertEqual(offer.line_with("opening"), "opening: 0")
            done = run("call", 2, "Door.open", "{speed: FAST, opening: 0}", *DOOR)
            self.assertNotIn("left out", done.stderr)
            done = run("call", 2, "Door.open", "{speed: FAST}", "-q", *DOOR)
            self.assertNotIn("left out", done.stderr)

    def test_an_error_of_a_method(self):
        with Running("offer", 1, "Door", "--error", "shut=0x21", "--udp", *DOOR):
            done = run("call", 2, "Door.shut", "{speed: SLOW}", *DOOR)
            self.assertEqual((done.returncode, done.stdout), (3, ""), done.stderr)

    def test_a_payload_with_a_crc_is_not_made_up(self):
        with tempfile.TemporaryDirectory() as folder:
            summed = ERR_FDEPL.replace("SomeIpMethodID = 0x1", "SomeIpMethodCRCWidth = four SomeIpMethodID = 0x1")
            for name, text in (("Err.fidl", ERR_FIDL), ("Err.fdepl", summed)):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            for call in (["Err.shut", "{speed: 3}"], ["Err.plain"]):
                done = run("call", 2, *call, "--interfaces", folder)
                self.assertNotEqual(done.returncode, 0)
                self.assertIn(f"the values of {call[0]} are not known", done.stderr)
                self.assertIn("a CRC of 4 bytes in the payload, which Trestle does not make", done.stderr)

    def test_errors_without_a_zero_are_told(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in (("Err.fidl", ERR_FIDL), ("Err.fdepl", ERR_FDEPL)):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            err = ["--interfaces", folder]
            with Running("offer", 1, "Err", "--method", "chosen={error: LOCKED, done: true}", "--udp", *err) as offer:
                line = offer.line_with("the error", of_log=True)
                self.assertIn("Err.shut is answered with the error BLOCKED, the first of its errors, none of which is 0 (no "
                              "error): --method 'shut={error: …}' chooses another answer", line)
                self.assertEqual(run("call", 2, "Err.shut", "{speed: 3}", *err).stdout, "error: BLOCKED\ndone: false\n")
                self.assertEqual(run("call", 2, "Err.chosen", *err).stdout, "error: LOCKED\ndone: true\n")
                self.assertEqual(run("call", 2, "Err.plain", *err).stdout, "error: FINE\ndone: false\n")
            log = offer.read[offer.process.stderr].decode()
            self.assertNotIn("Err.chosen", log)
            self.assertNotIn("Err.plain", log)

    def test_bytes_behind_the_values_are_told(self):
        with Running("notify", 1, "0x4711.1", "2", "0x8010", "32000102", "--rate", "50") as notify:
            done = run("subscribe", 2, "Door.0x0001.moved", "--count", "1", *DOOR)
            self.assertIn("opening: 50\nspeed: SLOW\n# 2 bytes left over at offset 2\n", done.stdout, done.stderr)
            done = run("subscribe", 2, "Door.0x0001.moved", "--count", "1", "--json", *DOOR)
            self.assertEqual(json.loads(done.stdout)["left_over"],
                             {"offset": 2, "bytes": 2, "detail": "2 bytes left over at offset 2"})

    def test_a_field_is_read_set_and_heard(self):
        with Running("offer", 1, "Door", "--field", 'label="Push"', "--udp", *DOOR) as offer:
            self.assertEqual(run("call", 2, "Door.label", *DOOR).stdout, "label: Push\n")
            with Running("subscribe", 3, "Door", "label", "opening", "--count", "3", "--json", *DOOR) as subscribe:
                lines = [json.loads(subscribe.line_with("event")) for _ in range(2)]
                self.assertEqual(sorted(line["field_name"] for line in lines), ["label", "opening"])
                done = run("call", 2, "Door.label", "Pull", *DOOR)
                self.assertEqual((done.returncode, done.stdout), (0, "label: Pull\n"), done.stderr)
                line = json.loads(subscribe.line_with("event"))
                self.assertEqual((line["event"], line["service_name"], line["field_name"], line["field_part"],
                                  line["values"]), ("0x8002", "Door", "label", "notify", {"label": "Pull"}))
                self.assertEqual(subscribe.finish()[0], 0)
            self.assertEqual(run("call", 2, "Door.label.get", *DOOR).stdout, "label: Pull\n")
            self.assertIn("# Door.label.set session", offer.line_with("set"))

    def test_a_service_is_offered_with_all_its_events(self):
        with Running("offer", 1, "Door", "--events", "--event", "moved={opening: 50, speed: FAST}", "--rate", "50", "--udp", *DOOR):
            done = run("subscribe", 2, "Door", "moved", "blocked", "--count", "2", "--json", *DOOR)
            self.assertEqual({line["event_name"]: line["values"] for line in map(json.loads, done.stdout.splitlines())},
                             {"moved": {"opening": 50, "speed": "FAST"}, "blocked": {"obstacles": []}}, done.stderr)
        with Running("offer", 1, "0x4711.1", "--event", "0x8010=3201", "--event", "0x8011:std_msgs/msg/UInt8={data: 7}", "--eventgroup", "2",
                     "--rate", "50", "--udp"):
            done = run("subscribe", 2, "0x4711.1", "2", "0x8010", "0x8011", "--count", "2")
            self.assertEqual(sorted(line.split()[1] for line in done.stdout.splitlines()), ["07", "3201"], done.stdout + done.stderr)

    def test_an_event_has_names_and_values(self):
        with Running("notify", 1, "Door.moved", "{opening: 50, speed: FAST}", "--rate", "50", *DOOR):
            done = run("subscribe", 2, "Door.moved", "--count", "1", *DOOR)
            self.assertEqual((done.returncode, done.stdout),
                             (0, "# Door.moved session 1\nopening: 50\nspeed: FAST\n---\n"), done.stderr)
            done = run("subscribe", 2, "Door", "moved", "--hex", "--count", "1", *DOOR)
            self.assertEqual(done.stdout, "Door.moved 3201\n")
            done = run("subscribe", 2, "0x4711.1", "2", "--count", "1", *DOOR)  # by ids
            self.assertIn("# Door.moved session", done.stdout)
            done = run("subscribe", 2, "Door", "--count", "1", *DOOR)  # all that it has
            self.assertIn("# Door.moved session", done.stdout)
            done = run("find", 2, "Door", "--count", "1", *DOOR)
            self.assertRegex(done.stdout, r"^Door\.0x0001  1\.0  udp .*:30711  by")
            found = json.loads(run("find", 2, "Door.0x0001", "--json", *DOOR).stdout)
            self.assertEqual((found["service"], found["service_name"]), ("0x4711", "Door"))

    def test_a_call_goes_to_the_only_instance_of_the_description(self):
        with Running("offer", 1, "Door.0x0002", "--method", "open={done: false}", *DOOR) as other:
            other.line_with("offering Door.0x0002", of_log=True)
            done = run("call", 2, "Door.open", "{speed: FAST}", "-q", "--timeout", "5", *DOOR)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (
                1, "", "error: nobody offers instance 0x0001 of the service; there is Door.0x0002\n"))
            with Running("offer", 3, "Door", "--method", "open={done: true}", *DOOR):
                for call in (["Door.open"], ["Door", "open"], ["0x4711", "0x0010"], ["Door.0x0001.open"]):
                    done = run("call", 2, *call, "{speed: FAST}", "-q", *DOOR)
                    self.assertEqual((done.returncode, done.stdout), (0, "error: OK\ndone: true\n"), done.stderr)
            for call in ("Door.*.open", "Door.2.open"):
                done = run("call", 2, call, "{speed: FAST}", "-q", *DOOR)
                self.assertEqual((done.returncode, done.stdout), (0, "error: OK\ndone: false\n"), done.stderr)
            done = run("find", 2, "Door.0x0001", "--timeout", "5", *DOOR)
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (1, "", "nobody offers Door.0x0001; there is Door.0x0002\n"))

    def test_a_method_over_tcp_whose_instance_has_no_tcp_port(self):
        with tempfile.TemporaryDirectory() as folder:
            files = [os.path.join(folder, name) for name in ("Door.fidl", "Door.fdepl")]
            for source, file in zip(DOOR[1:], files):
                with open(source) as old, open(file, "w") as new:
                    new.write(old.read().replace("= 0x0011\n", "= 0x0011\n        SomeIpReliable = true\n"))
            done = subprocess.run([TRESTLE, "generate", *files, "--to", "json"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0)
            self.assertRegex(done.stderr, r"Door\.fdepl:\d+:\d+: warning: the instance of car\.Door has no TCP port, which shut "
                                          r"needs: expected one, or UDP for it\n")
            with Running("offer", 1, "Door", "-q", "--interfaces", *files) as offer:
                self.assertIn("warning: Door.shut goes over TCP by the description", offer.line_with("TCP", of_log=True))
                done = run("call", 2, "Door.shut", "{speed: SLOW}", "-q", "--interfaces", *files)
                self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "done: false\n", ""))
            with Running("offer", 1, "Door", "--udp", "--interfaces", *files) as offer:
                offer.line_with("offering", of_log=True)
                done = run("call", 2, "Door.shut", "{speed: SLOW}", "-q", "--timeout", "5", "--interfaces", *files)
                self.assertEqual((done.returncode, done.stdout, done.stderr), (1, "", (
                    "error: Door.0x0001 is offered over UDP, and not over TCP, over which this call goes\n")))

    def test_an_event_over_udp_of_an_eventgroup_that_has_one_over_tcp(self):
        with tempfile.TemporaryDirectory() as folder:
            files = [os.path.join(folder, name) for name in ("Door.fidl", "Door.fdepl")]
            for source, file in zip(DOOR[1:], files):
                with open(source) as old, open(file, "w") as new:
                    new.write(old.read().replace("SomeIpEventID = 0x8011\n", "SomeIpEventID = 0x8011\n        SomeIpReliable = true\n")
                              .replace("UnicastPort = 30711\n", "UnicastPort = 30711\n        SomeIpReliableUnicastPort = 30711\n"))
            with Running("notify", 1, "Door.moved", "{opening: 50, speed: FAST}", "--rate", "50", "--interfaces", *files):
                done = run("subscribe", 2, "Door.moved", "--count", "1", "-q", "--interfaces", *files)
                self.assertIn("opening: 50\n", done.stdout, done.stderr)

    def test_the_log_has_names(self):
        with Running("notify", 1, "Door.moved", "{opening: 1}", "--rate", "50", *DOOR) as notify:
            # All eventgroups are offered, so that who wants more than this event is not refused.
            with Running("subscribe", 2, "Door", *DOOR) as subscribe:
                for text in ("subscribed to eventgroup 0x0001 (opening, label, locked) of Door.0x0001",
                             "subscribed to eventgroup 0x0002 (moved, blocked) of Door.0x0001"):
                    subscribe.line_with(text, of_log=True)
                self.assertNotIn("refused", subscribe.stop()[2])
            notify.line_with("subscribed to eventgroup 0x0002 (moved, blocked) of Door.0x0001", of_log=True)

    def test_a_payload_that_does_not_fit_is_told_with_offset_field_and_bytes(self):
        with Running("notify", 1, "0x4711.1", "2", "0x8010", "32", "--rate", "50"):
            done = run("subscribe", 2, "Door.moved", "--count", "1", *DOOR)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn("warning: Door.moved: truncated: 1 byte wanted, 0 left at byte 1 in speed: 32\n", done.stderr)
            done = run("subscribe", 2, "Door.moved", "--count", "1", "--json", *DOOR)
            self.assertEqual(done.returncode, 1)
            line = json.loads(done.stdout)
            self.assertEqual((line["payload"], line["error"]["offset"], line["error"]["field"]), ("32", 1, "speed"))

    def test_a_name_that_does_not_exist_is_an_error_with_what_there_is(self):
        for arguments, text in (
                (("call", 2, "Dor.open", "{}"), "did you mean 'Door.open'?"),
                (("call", 2, "Door.opem", "{}"), "did you mean 'open'?; there are: moved, blocked, open, shut, ring"),
                (("call", 2, "Door", "opem", "{}"), "did you mean 'open'?"),
                (("call", 2, "Door.open", "{sped: FAST}"), "'sped' is no field of Door.open; expected speed, opening"),
                (("call", 2, "Door.open", "{speed: FASTER}"),
                 "PAYLOAD: 1:9: speed: expected one of SLOW (0), FAST (1), found 'FASTER'; did you mean FAST?"),
                (("call", 2, "Door.open"), "Door.open needs values: speed, opening"),
                (("call", 2, "Door.moved"), "Door.moved is an event"),
                (("call", 2, "Door.opening", "5"), "opening has no setter"),
                (("call", 2, "Door"), "METHOD"),
                (("subscribe", 2, "Door.open"), "Door.open is a method"),
                (("subscribe", 2, "Door", "mooved"), "did you mean 'moved'?"),
                (("notify", 2, "Door.open", "{}"), "Door.open is a method"),
                (("notify", 2, "Door.moved"), "PAYLOAD"),
                (("offer", 2, "Door.open"), "is more than a service"),
                (("offer", 2, "Door", "--method", "moved={}"), "moved is no method"),
                (("offer", 2, "Door", "--event", "open={}"), "open is no event"),
                (("find", 2, "Dor"), "did you mean 'Door'?")):
            done = run(*arguments, *DOOR)
            self.assertEqual((done.returncode, done.stdout), (2, ""), arguments)
            self.assertIn(text, done.stderr)
        done = run("call", 2, "Door.open", "{}", "--interfaces", "/nonexistent.fidl")
        self.assertEqual(done.returncode, 2)
        self.assertIn("/nonexistent.fidl", done.stderr)
        with tempfile.NamedTemporaryFile("w", suffix=".fidl") as file:
            file.write("package a\ninterface B {\n  attribute Nothing c\n}\n")
            file.flush()
            done = run("call", 2, "B.c", "--interfaces", file.name)
            self.assertEqual(done.returncode, 2)
            self.assertRegex(done.stderr, r"\.fidl:3:\d+: .*Nothing")


class Every(unittest.TestCase):
    """Every kind of type."""

    def test_goes_to_bytes_and_back(self):
        with Running("notify", 1, "Every.0x0001.changed", mapping(EVERYTHING), "--rate", "50", *EVERY):
            done = run("subscribe", 2, "Every.1.changed", "--count", "1", "--json", *EVERY)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(json.loads(done.stdout)["values"], IT)
            as_yaml = run("subscribe", 2, "Every.1", "changed", "--count", "1", *EVERY).stdout
        # What is printed can be read, in both languages.
        body = as_yaml.split("\n", 1)[1].removesuffix("---\n")
        for text, form in ((body, "--yaml"), (json.dumps(IT), "--json")):
            with tempfile.NamedTemporaryFile("w") as file:
                file.write(text)
                file.flush()
                with Running("notify", 1, "Every.1.changed", "@" + file.name, form, "--rate", "50", *EVERY):
                    done = run("subscribe", 2, "Every.1.changed", "--count", "1", "--json", *EVERY)
                    self.assertEqual(json.loads(done.stdout)["values"], IT)

    def test_is_refused_where_the_description_has_several_instances(self):
        done = run("subscribe", 2, "Every.changed", *EVERY)
        self.assertEqual(done.returncode, 2)
        self.assertIn("Every has several instances: write Every.0x0001 or Every.0x0002", done.stderr)

    def test_is_offered_as_a_whole_with_the_version_of_the_description(self):
        with Running("offer", 1, "Every.2", "--method", "echo=" + mapping(EVERYTHING), *EVERY) as offer:
            done = run("call", 2, "Every.echo", mapping(EVERYTHING), "--json", *EVERY)
            self.assertEqual(done.returncode, 2)
            done = run("call", 2, "Every.echo", json.dumps(IT), "--json", *EVERY)
            self.assertEqual(json.loads(done.stdout)["values"], IT, done.stderr)
            self.assertIn("Every.echo", offer.line_with("echo"))
            found = json.loads(run("find", 2, "Every", "--count", "1", "--json", *EVERY).stdout)
            self.assertEqual((found["major_version"], found["minor_version"], found["instance"]), (2, 1, "0x0002"))
            # The error comes first; a single value needs no name.
            done = run("call", 2, "Every.choose", "{name: abc}", *EVERY)
            self.assertEqual((done.returncode, done.stdout), (0, "error: NONE\nlevels: []\n"), done.stderr)
            done = run("call", 2, "Every.choose", "{shape: {name: a, raw: []}}", *EVERY)
            self.assertEqual(done.returncode, 2)
            self.assertIn("expected exactly one of circle, name, raw, found 2", done.stderr)
            done = run("call", 2, "Every.level", "veryHigh", *EVERY)
            self.assertEqual((done.returncode, done.stdout), (0, "level: veryHigh\n"), done.stderr)
            # What has no zero begins with its first enumerator, or its first member.
            with Running("offer", 3, "Every.1", "-q", *EVERY):
                values = json.loads(run("call", 2, "Every.1.echo", json.dumps(IT), "--json", *EVERY).stdout)["values"]["it"]
                self.assertEqual((values["level"], values["shape"], values["flags"]["some"], values["shapes"]), (
                    "LOW", {"circle": {"x": 0.0, "heading": 0, "valid": False}}, "LOW", []))
                self.assertEqual(run("call", 2, "Every.1.level", "-q", *EVERY).stdout, "level: LOW\n")
            done = run("call", 2, "Every.position", *EVERY)
            self.assertEqual(done.stdout, "position:\n  x: 0.0\n  heading: 0\n  valid: false\n")


class Recordings(unittest.TestCase):
    def test_have_names_and_values(self):
        datagrams = [
            message(0x4711, 0x0010, b"\x01\x50"),
            message(0x4711, 0x0010, b"\x01\x01", kind=0x80),
            message(0x4711, 0x8010, b"\x32\x00", kind=2),
            message(0x4711, 0x0002, b""),
            message(0x4711, 0x0002, b"\0\0\0\x06\xef\xbb\xbfhi\0", kind=0x80),
            message(0x4711, 0x8003, b"\x01", kind=2),
            message(0x4711, 0x0010, b"", kind=0x80, code=0x21),
            message(0x4711, 0x0077, b"\xaa"),
            message(0x4799, 0x0001, b"\xbb")]
        status, objects, errors = decode_capture(datagrams, *DOOR)
        self.assertEqual((status, errors), (0, ""))
        names = [[one.get(key) for key in ("service_name", "method_name", "event_name", "field_name", "field_part",
                                           "values")] for one in objects]
        self.assertEqual(names, [
            ["Door", "open", None, None, None, {"speed": "FAST", "opening": 80}],
            ["Door", "open", None, None, None, {"error": "BLOCKED", "done": True}],
            ["Door", None, "moved", None, None, {"opening": 50, "speed": "SLOW"}],
            ["Door", None, None, "label", "get", {}],
            ["Door", None, None, "label", "get", {"label": "hi"}],
            ["Door", None, None, "locked", "notify", {"locked": True}],
            ["Door", "open", None, None, None, None],
            ["Door", None, None, None, None, None],
            [None, None, None, None, None, None]])
        self.assertEqual(objects[0]["payload"], "0150")  # the bytes stay
        # The capture may stand behind the descriptions.
        with tempfile.NamedTemporaryFile(suffix=".pcap") as file:
            file.write(capture(datagrams))
            file.flush()
            self.assertEqual(decode(*DOOR, file.name)[1], objects)
            done = subprocess.run([TRESTLE, "watch", "--read", file.name, *DOOR], capture_output=True, text=True)
            self.assertRegex(done.stdout, r"Door\.\?  +event moved ")
            self.assertRegex(done.stdout, r"Door\.\?  +method open ")
            done = subprocess.run([TRESTLE, "watch", "--read", file.name, "--json", *DOOR], capture_output=True, text=True)
            rows = json.loads(done.stdout)["traffic"]
            self.assertIn(("Door", "moved"), [(row.get("service_name"), row.get("event_name")) for row in rows])

    def test_have_what_is_in_eventgroups_without_a_name(self):
        # A subscription to eventgroup 2, of a client that names no endpoint.
        entry = struct.pack(">BBBBHHIHH", 6, 0, 0, 0, 0x4711, 1, 0x01000003, 0, 2)
        discovery = message(0xffff, 0x8100, struct.pack(">II", 0xc0000000, len(entry)) + entry + bytes(4), kind=2)
        _, objects, _ = decode_capture([discovery], *DOOR)
        found = objects[0]["sd"]["entries"][0]
        self.assertEqual((found["eventgroup"], found["eventgroup_name"]), ("0x0002", "moved, blocked"))

    def test_are_watched_as_text_in_names(self):
        def discovery(session, entry, options=b""):
            return message(0xffff, 0x8100, struct.pack(">II", 0xc0000000, len(entry)) + entry + struct.pack(">I", len(options)) +
                           options, kind=2, session=session)
        endpoint = struct.pack(">HBB4sBBH", 9, 4, 0, bytes([10, 0, 0, 1]), 0, 0x11, 30711)
        datagrams = [
            discovery(1, struct.pack(">BBBBHHII", 1, 0, 0, 0x10, 0x4711, 1, 1 << 24 | 600, 0), endpoint),
            discovery(2, struct.pack(">BBBBHHIHH", 6, 0, 0, 0x10, 0x4711, 1, 1 << 24 | 600, 0, 2), endpoint),
            message(0x4711, 0x0010, b"\x01\x50"),
            message(0x4711, 0x8010, b"\x32\x00", kind=2),
            message(0x4711, 0x0002, b""),
            message(0x4711, 0x0003, b"\0\0\0\x06\xef\xbb\xbfhi\0"),
            message(0x4711, 0x8003, b"\x01", kind=2)]
        with tempfile.TemporaryDirectory() as folder:
            read = os.path.join(folder, "door.pcap")
            with open(read, "wb") as file:
                file.write(capture(datagrams))

            def watch(*arguments):
                done = subprocess.run([TRESTLE, "watch", "--read", read, *arguments], capture_output=True, text=True)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                return done.stdout

            table = watch(*DOOR)
            self.assertRegex(table, r"\nDoor\.0x0001 +1\.0 +10\.0\.0\.1 ")
            self.assertRegex(table, r"\nDoor\.0x0001 +0x0002 \(moved, blocked\) +10\.0\.0\.1 +asked ")
            for traffic in ("method open", "event moved", "method label.get", "method label.set", "event locked.notify"):
                self.assertRegex(table, rf"\nDoor\.\S+ +{traffic} ")
            lines = watch("--lines", *DOOR)
            self.assertRegex(lines, r"Z  offered +Door\.0x0001  1\.0  udp 10\.0\.0\.1:30711 ")
            self.assertRegex(lines, r"Z  subscribed +Door\.0x0001  eventgroup 0x0002 \(moved, blocked\)  by 10\.0\.0\.1 ")
            # ARXML gives eventgroups names, which stand in place of ids.
            subprocess.run([TRESTLE, "generate", *DOOR[1:], "--to", "arxml", "-o", folder], check=True, capture_output=True)
            arxml = os.path.join(folder, "interfaces.arxml")
            with open(arxml, encoding="utf-8") as file:
                text = file.read()
            self.assertIn("Eventgroup_2", text)
            with open(arxml, "w", encoding="utf-8") as file:
                file.write(text.replace("Eventgroup_2", "Motion"))
            self.assertRegex(watch("--interfaces", arxml), r"\nDoor\.0x0001 +Motion +10\.0\.0\.1 +asked ")
            self.assertRegex(watch("--lines", "--interfaces", arxml), r"Z  subscribed +Door\.0x0001  eventgroup Motion  by ")
            row, = json.loads(watch("--json", "--interfaces", arxml))["subscriptions"]
            self.assertEqual((row["eventgroup"], row["eventgroup_name"]), ("0x0002", "Motion"))

    def test_say_what_is_left_over_behind_the_values(self):
        status, objects, log = decode_capture(
            [message(0x4711, 0x8010, b"\x32\x00", kind=2),
             message(0x4711, 0x8010, b"\x32\x00\x01\x02\x03", kind=2),
             message(0x4711, 0x8011, b"\0\0\0\0\xff", kind=2),
             message(0x4711, 0x0002, b"\x07\x08"),
             message(0x4711, 0x0077, b"\xaa")], *DOOR)
        self.assertEqual(status, 0, "a receiver ignores them")
        self.assertEqual([one.get("left_over") for one in objects], [
            None, {"offset": 18, "bytes": 3, "detail": "3 bytes left over at offset 18"},
            {"offset": 20, "bytes": 1, "detail": "1 byte left over at offset 20"},
            {"offset": 16, "bytes": 2, "detail": "2 bytes left over at offset 16"}, None])
        self.assertEqual([one.get("values") for one in objects], [
            {"opening": 50, "speed": "SLOW"}, {"opening": 50, "speed": "SLOW"}, {"obstacles": []}, {}, None])
        self.assertIn("3 messages have bytes left over behind their values", log)

    def test_say_where_a_payload_does_not_fit(self):
        status, objects, _ = decode_capture(
            [message(0x4711, 0x8011, b"\0\0\0\x08\x3f\x80\0\0\0\0\0\x09", kind=2),
             message(0x4711, 0x8011, b"\0\0\0\x08\x3f\x80\0\0\0\0\0\x09", kind=2, version=2)], *DOOR)
        self.assertEqual(status, 1)
        error = objects[0]["error"]
        self.assertEqual((error["name"], error["rule"], error["field"]), ("bad_values", None, "obstacles[0].name"))
        self.assertEqual(error["offset"], 16 + 8)
        self.assertEqual(objects[0]["payload"], "000000083f80000000000009")
        self.assertNotIn("values", objects[0])
        # Of another version the description need not be right.
        self.assertNotIn("error", objects[1])
        self.assertEqual(objects[1]["event_name"], "blocked")

    def test_name_services_of_discovery(self):
        offer = bytes.fromhex("ffff81000000003000000001010102 00c000000000000010010000104711000101000003000000000000000c"
                              "000904000a00000100117 7f7".replace(" ", ""))
        status, objects, _ = decode("--hex", *DOOR, stdin=offer.hex().encode() + b"\n")
        self.assertEqual(status, 0)
        self.assertEqual(objects[0]["sd"]["entries"][0]["service_name"], "Door")

    def test_have_every_kind_of_type(self):
        with Running("notify", 1, "Every.1.changed", mapping(EVERYTHING), "--rate", "50", *EVERY):
            done = run("subscribe", 2, "Every.1.changed", "--hex", "--count", "1", *EVERY)
        payload = bytes.fromhex(done.stdout.split()[1])
        status, objects, _ = decode_capture([message(0x4712, 0x8010, payload, kind=2, version=2)], *EVERY)
        self.assertEqual(status, 0)
        self.assertEqual(objects[0]["values"], IT)
        self.assertNotIn("left_over", objects[0])
        behind = [message(0x4712, 0x8010, payload + bytes(more), kind=2, version=2) for more in (1, 2, 9)]
        for more, one in zip((1, 2, 9), decode_capture(behind, *EVERY)[1]):
            self.assertEqual((one["left_over"]["offset"], one["left_over"]["bytes"]), (16 + len(payload), more))
            self.assertEqual(one["values"], IT)
        # Cut anywhere: an error, or what is there, and never the end of the program.
        cut = [message(0x4712, 0x8010, payload[:size], kind=2, version=2) for size in range(len(payload))]
        status, objects, _ = decode_capture(cut, *EVERY)
        self.assertEqual((status, len(objects)), (1, len(cut)))
        for one in objects:
            self.assertEqual(one["error"]["name"], "bad_values")
            self.assertLessEqual(one["error"]["offset"], 16 + len(payload))

    def test_of_a_system_without_types_have_names_only(self):
        with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
            json.dump({"unicast": "10.0.0.1", "services": [{
                "service": "0x4711", "instance": "0x0001", "unreliable": "30711",
                "events": [{"event": "0x8010", "is_field": "false"}],
                "eventgroups": [{"eventgroup": "0x0002", "events": ["0x8010"]}]}]}, file)
            file.flush()
            status, objects, _ = decode_capture([message(0x4711, 0x8010, b"\x32\x00", kind=2)], "--interfaces", file.name)
        self.assertEqual(status, 0)
        self.assertEqual((objects[0]["service_name"], objects[0]["event_name"]), ("service_4711", "event_8010"))
        self.assertEqual(objects[0]["payload"], "3200")
        self.assertNotIn("values", objects[0])


if __name__ == "__main__":
    unittest.main()
