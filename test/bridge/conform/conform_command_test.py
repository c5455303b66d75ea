#!/usr/bin/env python3
"""`trestle conform` against the reference device on loopback, and what it says of its command line.

Usage: conform_command_test.py TRESTLE SOURCE_FOLDER
"""
import csv
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

TRESTLE, SOURCE = sys.argv[1:3]
# On loopback, of this process alone: other tests may run beside it.
HOST = f"127.{1 + (os.getpid() >> 8) % 254}.{os.getpid() & 0xff}"
ADDRESSES = ("--device", f"{HOST}.1", "--tester", f"{HOST}.2")
PROFILE = pathlib.Path(SOURCE) / "examples" / "ets_device" / "profile.yaml"


def conform(*arguments, status=0):
    """What it prints; the test fails on another exit status."""
    done = subprocess.run([TRESTLE, "conform", *map(str, arguments)], capture_output=True, text=True, timeout=300)
    assert done.returncode == status, f"{arguments}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


class Conform(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def expect_no_device(self):
        """Its port can be had again."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
            port.bind((ADDRESSES[1], 30501))

    def test_runs_cases_and_leaves_evidence(self):
        cases = ["sd.header.client-id", "sd.offer.ttl", "sd.subscribe.ack.ttl", "sd.subscribe.malformed.option-length-zero",
                 "rpc.response.comes", "rpc.npdu.two", "tcp.request", "ets.echo.utf8", "sd.subscribe.ack.each-eventgroup"]
        text = conform("run", *cases, "--dut", PROFILE, *ADDRESSES, "--out", self.folder)
        self.assertIn(f"{len(cases)} cases in", text)
        results = json.loads((self.folder / "results.json").read_text())
        self.assertEqual(results["schema"], 1)
        self.assertEqual(results["verdicts"]["pass"], len(cases), text)
        self.assertEqual({one["id"] for one in results["cases"]}, set(cases))
        for one in results["cases"]:
            capture = (self.folder / one["evidence"]).read_bytes()
            self.assertEqual(capture[:4], b"\x0a\x0d\x0d\x0a")
            self.assertIn(f"{one['id']}: {one['title']} (pass)\n{one['requirements'][0]}: ".encode(), capture)
            self.assertIn(f"\nagain: {one['again']}".encode(), capture)
            if one["id"] == "sd.subscribe.ack.each-eventgroup":
                # From the beginning on.
                self.assertIn(b"check: is the device there?", capture)
                self.assertGreaterEqual(capture.count(b"stimulus"), 4)
        suites = ElementTree.parse(self.folder / "junit.xml").getroot()
        self.assertEqual(sum(int(suite.get("tests")) for suite in suites), len(cases))

    def test_runs_several_devices_at_once(self):
        # With the verdicts of one device, and in the order of the cases.
        selectors = ["sd.header", "sd.flags", "rpc.response", "tcp.resynchronisation"]
        verdicts = []
        for jobs in (1, 4):
            text = conform("run", *selectors, "--dut", PROFILE, *ADDRESSES, "--out", self.folder, "--jobs", jobs)
            cases = json.loads((self.folder / "results.json").read_text())["cases"]
            verdicts.append([(one["id"], one["verdict"]) for one in cases])
            shown = re.findall(r"^ +(?:pass|fail)[a-z-]* +([a-z][\w.-]+) ", text, re.MULTILINE)
            self.assertEqual(shown, [one["id"] for one in cases], text)
            self.assertEqual({one["verdict"] for one in cases}, {"pass"}, text)
        self.assertEqual(*verdicts)
        # A device that runs already is there once.
        profile = self.folder / "profile.yaml"
        profile.write_text(PROFILE.read_text().split("lifecycle:")[0].replace("ready_within: 3 s", "ready_within: 10 ms\n  answer_within: 10 ms"))
        text = conform("run", "sd.offer.ttl", "--jobs", 2, "--dut", profile, *ADDRESSES, "--out", self.folder, status=1)
        self.assertIn("note: there is one device", text)

    def test_judges_a_device_that_is_a_client_alone(self):
        profile = self.folder / "profile.yaml"
        command = "exec {programs}/trestle subscribe 0x0111.1 1 --address {device} --multicast {multicast}"
        profile.write_text("name: Client\n"
                           "network: {device: 127.0.77.1, tester: 127.0.77.2, multicast: 239.255.77.1}\n"
                           "uses: [{id: 0x0111, udp: {eventgroup: 1, event: 0x8001}}]\n"
                           "timing: {answer_within: 500 ms, repetitions_base_delay: 30 ms, repetitions_max: 3}\n"
                           f"lifecycle: {{start: \"{command}\"}}\n")
        text = conform("run", "client", "sd.offer.ttl", "--role", "both", "--dut", profile, *ADDRESSES, "--out", self.folder)
        results = json.loads((self.folder / "results.json").read_text())
        verdicts = {one["id"]: one["verdict"] for one in results["cases"]}
        self.assertEqual(verdicts.pop("sd.offer.ttl"), "unsupported", text)
        # That it looks for further instances is allowed.
        self.assertLessEqual({verdict for case, verdict in verdicts.items() if not case.startswith("client.ets")},
                             {"pass", "pass-nonstrict"}, text)
        # One that is not there, or wants something else, fails its cases.
        profile.write_text(profile.read_text().replace("udp: {eventgroup: 1", "udp: {eventgroup: 2"))
        self.assertIn("eventgroup", conform("run", "client.subscribe.eventgroup", "--dut", profile, *ADDRESSES,
                                            "--out", self.folder, status=1))

    def test_judges_segments_of_a_device_without_testability_service(self):
        device = pathlib.Path(__file__).parent / "large_device.py"

        def verdicts(large, fault, *selectors, status):
            profile = self.folder / "large.yaml"
            profile.write_text("name: Large\n"
                               "network: {device: 127.0.77.1, tester: 127.0.77.2, multicast: 239.255.77.1}\n"
                               "services:\n"
                               "  - id: 0x4321\n"
                               "    instance: 1\n"
                               "    udp: 40321\n"
                               "    request: {method: 1, payload: 2a}\n"
                               "    eventgroups: [{id: 1, events: [0x8001], cycle: 150 ms}]\n"
                               f"    large: {large}\n"
                               f"lifecycle: {{start: \"exec {sys.executable} {device} {{device}} {{multicast}} {fault}\"}}\n")
            text = conform("run", *selectors, "--dut", profile, *ADDRESSES, "--out", self.folder, status=status)
            cases = json.loads((self.folder / "results.json").read_text())["cases"]
            return {one["id"].removeprefix("tp."): one["verdict"] for one in cases}, text

        # Who takes large requests is judged by what it takes, who sends large messages by these.
        for large in ("{echo: 1}", "{request: 2}", "{response: {method: 3}}", "{event: 0x8001}"):
            found, text = verdicts(large, "", "tp", status=0)
            for name, verdict in found.items():
                has = "echo" in large or ("request" in large) != name.startswith("response.")
                self.assertEqual(verdict, "pass" if has else "unsupported", f"{large}: {name}\n{text}")
        for large, fault, name in [("{response: {method: 3}}", "session", "session"), *(("{event: 0x8001}", *one) for one in (
                ("flag", "flag"), ("session", "session"), ("sizes", "sizes"), ("last", "last"), ("reserved", "reserved"), ("twice", "once")))]:
            found, text = verdicts(large, fault, f"tp.response.{name}", status=1)
            self.assertEqual(found, {f"response.{name}": "fail"}, f"{large}: {fault}\n{text}")
        found, text = verdicts("{request: 2}", "whole", "tp.order.ascending", status=1)
        self.assertEqual(found, {"order.ascending": "fail"}, text)

    def test_asks_again_for_events_that_get_lost(self):
        profile = self.folder / "lossy.yaml"
        device = pathlib.Path(__file__).parent / "large_device.py"
        profile.write_text("name: Lossy\n"
                           "network: {device: 127.0.77.1, tester: 127.0.77.2, multicast: 239.255.77.1}\n"
                           "services:\n"
                           "  - id: 0x4321\n"
                           "    instance: 1\n"
                           "    udp: 40321\n"
                           "    request: {method: 1, payload: 2a}\n"
                           "    field: {getter: 5, setter: 4, value: 5a, eventgroup: 2}\n"
                           "    eventgroups:\n"
                           "      - {id: 3, events: [0x8003], trigger: 4}\n"
                           "      - {id: 2, events: [0x8002], initial_values: true}\n"
                           "timing: {answer_within: 500 ms}\n"
                           f"lifecycle: {{start: \"exec {sys.executable} {device} {{device}} {{multicast}} lossy\"}}\n")
        # One after the other, each with a device that loses the first event.
        for case in ("event.message-type", "event.initial.all", "event.initial.not-at-renewal", "event.field-changes",
                     "sd.subscribe.ack.each-eventgroup"):
            text = conform("run", case, "--dut", profile, *ADDRESSES, "--out", self.folder)
            (one,) = json.loads((self.folder / "results.json").read_text())["cases"]
            self.assertIn(one["verdict"], ("pass", "pass-nonstrict"), text)
            self.assertGreaterEqual(one["retries"], 1, text)

    def test_knows_finds_that_are_answered_by_multicast(self):
        profile = self.folder / "profile.yaml"
        profile.write_text(PROFILE.read_text().replace("--event-group {event_multicast}", "--event-group {event_multicast} --find-answers optimised")
                           + "policy: {multicast_find_answers: true}\n")
        cases = ["sd.find.late-multicast-answer", "sd.find.legacy-multicast-answer"]
        self.assertIn(": 2 pass\n", conform("run", *cases, "--dut", profile, *ADDRESSES, "--out", self.folder))
        # The others ask when the answer is by unicast, or take either.
        either = ["sd.find.multicast", "sd.find.unicast-flag-clear"]
        others = either + ["sd.find.unreferenced-options", "sd.endpoint-option.find", "sd.endpoint-option.surplus"]
        self.assertIn(": 5 pass\n", conform("run", *others, "--dut", profile, *ADDRESSES, "--out", self.folder))
        # A slow machine says that it is too slow for 65,536 answers.
        self.assertRegex(conform("run", "sd.header.session-wraps", "--dut", profile, *ADDRESSES, "--out", self.folder),
                         r": 1 pass\n|the device counts \d+ Session IDs in \d+ s, too few")
        # A cyclic offer is not taken for an answer.
        text = conform("selftest", *cases, *either, "--dut", profile, *ADDRESSES, "--out", self.folder, "--fault", "find-ignored",
                       "--fault", "find-needs-unicast-flag", "--every")
        self.assertIn("2 of 2 faults are found; 4 of 4 cases fail with a fault", text)

    def test_writes_what_it_has_when_it_is_interrupted(self):
        run = subprocess.Popen([TRESTLE, "conform", "run", "--dut", PROFILE, *ADDRESSES, "--seed", "3", "--out", self.folder],
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        for line in run.stdout:
            if " pass " in line:
                break
        run.send_signal(signal.SIGINT)
        text = run.communicate(timeout=60)[0]
        self.assertEqual(run.returncode, 1, text)
        self.assertIn("ended before all of them were run", text)
        results = json.loads((self.folder / "results.json").read_text())
        self.assertTrue(results["cancelled"])
        self.assertEqual(results["seed"], 3)
        self.assertGreater(len(results["cases"]), 0)
        self.assertIn("--seed 3 ", results["cases"][0]["again"])
        self.expect_no_device()

    def test_stops_the_device_when_nobody_reads(self):
        run = subprocess.Popen([TRESTLE, "conform", "run", "sd", "--dut", PROFILE, *ADDRESSES, "--out", self.folder],
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        run.stdout.readline()
        run.stdout.close()
        self.assertEqual(run.wait(timeout=60), 1)
        self.expect_no_device()

    def test_starts_a_device_by_any_command_of_a_shell(self):
        profile = self.folder / "profile.yaml"
        profile.write_text(PROFILE.read_text().replace('start: "{programs}', 'start: "cd / && WORD=1 {programs}', 1))
        self.assertIn("2 pass", conform("run", "sd.offer.ttl", "sd.stop-offer", "--dut", profile, *ADDRESSES, "--out", self.folder))

    def test_tells_what_is_wrong_before_the_first_case(self):
        command = ("run", "sd.offer.ttl", "--dut", PROFILE)
        self.assertIn("cannot write into", conform(*command, *ADDRESSES, "--out", PROFILE / "x", status=2))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
            port.bind((ADDRESSES[3], 30490))
            self.assertIn("another SOME/IP stack", conform(*command, *ADDRESSES, "--out", self.folder, status=2))
        self.assertIn("--tester: 'nobody' is no IP address",
                      conform(*command, "--tester", "nobody", "--out", self.folder, status=2))
        for name, text in (("--tester", "device 127.0.77.1, tester fd00::2 "), ("--device", "device fd00::2, tester 127.0.77.2 ")):
            self.assertRegex(conform(*command, name, "fd00::2", "--out", self.folder, status=2),
                             f"{name}: {re.escape(text)}and .* 239.255.77.1, .* all of IPv4, or all of IPv6")
        self.assertIn("cannot use 192.0.2.1", conform(*command, "--tester", "192.0.2.1", "--out", self.folder, status=2))

    def test_gives_up_when_the_device_does_not_start(self):
        profile = self.folder / "profile.yaml"
        profile.write_text(PROFILE.read_text().replace("{programs}/ets_device", "{programs}/no_such_device"))
        text = conform("run", "sd", "--dut", profile, *ADDRESSES, "--out", self.folder, status=1)
        self.assertIn("the device exited with status 127 (no such command) after its start", text)
        # With the command as it was run, where it stands, and what the shell says of it.
        command = f"{pathlib.Path(TRESTLE).resolve().parent}/no_such_device"
        self.assertRegex(text, f"its command is '{re.escape(command)} .*' \\(start, in {re.escape(str(profile))}\\)")
        self.assertRegex(text, f"device\\.log: .*{re.escape(command)}: .*not found")
        self.assertIn("was not there for 3 cases in a row", text)
        self.assertIn("3 inconclusive", text)
        # Nor do several: the others do not go on.
        text = conform("run", "sd", "--jobs", 4, "--dut", profile, *ADDRESSES, "--out", self.folder, status=1)
        self.assertIn("was not there for 3 cases in a row", text)
        self.assertLess(len(json.loads((self.folder / "results.json").read_text())["cases"]), 20)

    def test_lets_a_device_do_what_is_allowed(self):
        # Replies to unknown methods are optional: TC8 alone asks for them.
        profile = self.folder / "profile.yaml"
        profile.write_text(PROFILE.read_text().replace("--event-group {event_multicast}\"\n",
                                                       "--event-group {event_multicast} --fault error-lost\"\n", 1))
        text = conform("run", "rpc.error", "--level", "must", "--dut", profile, *ADDRESSES, "--out", self.folder)
        self.assertIn("5 unsupported", text)
        # So is the SD endpoint option, which older editions do not know.
        profile.write_text(PROFILE.read_text() + "policy: {sd_endpoint_option: false}\n")
        text = conform("run", "sd.endpoint-option.find", "sd.endpoint-option.subscribe", "sd.endpoint-option.surplus",
                       "--dut", profile, *ADDRESSES, "--out", self.folder)
        self.assertIn("3 unsupported", text)
        # And what becomes of a request with a repeated counter, but not of one with a wrong CRC.
        profile.write_text(PROFILE.read_text().replace("--event-group {event_multicast}\"\n",
                                                       "--event-group {event_multicast} --fault e2e-unchecked\"\n", 1))
        text = conform("run", "e2e.*.repeated", "e2e.profile4.wrong-crc", "e2e.profile2.wrong-data-id", "--dut", profile, *ADDRESSES,
                       "--out", self.folder, status=1)
        self.assertIn(": 14 pass-nonstrict 2 fail\n", text)
        self.assertIn(": 1 pass\n", conform("run", "e2e.profile4.repeated", "--dut", PROFILE, *ADDRESSES, "--out", self.folder))

    def test_takes_its_address_from_an_interface(self):
        text = conform("run", "sd.offer.ttl", "--dut", PROFILE, "--device", f"{HOST}.1", "--interface", "lo",
                       "--out", self.folder)
        self.assertIn("1 pass", text)
        # --dut takes the address, too, beside the profile; --device is the same.
        text = conform("run", "sd.offer.ttl", "--dut", PROFILE, "--dut", f"{HOST}.1", "--tester", f"{HOST}.2", "--out", self.folder)
        self.assertIn("1 pass", text)
        self.assertIn(f"--dut {PROFILE} --tester {HOST}.2 --device {HOST}.1",
                      json.loads((self.folder / "results.json").read_text())["cases"][0]["again"])
        self.assertIn("--dut FILE is needed, too", conform("run", "--dut", "192.0.2.1", status=2))
        self.assertIn("two profiles", conform("run", "--dut", PROFILE, "--dut", "x.yaml", status=2))
        self.assertIn("two addresses on the command line: 192.0.2.1 and 192.0.2.7",
                      conform("run", "--dut", PROFILE, "--dut", "192.0.2.1", "--device", "192.0.2.7", status=2))
        self.assertIn("no address in the subnet", conform("run", "--dut", PROFILE, "--device", "192.0.2.1", "--interface", "lo",
                                                          status=2))

    def test_finds_faults(self):
        text = conform("selftest", "sd.subscribe.ack", "rpc.response", "sd.subscribe.malformed.option-length-zero",
                       "e2e.profile4.repeated", "e2e.profile11.event*", "sd.reboot.channels", "event.initial.not-of-events", "--dut", PROFILE, *ADDRESSES,
                       "--out", self.folder, "--quick", "--fault", "ack-ttl", "--fault", "response-session", "--fault", "subscribe-any",
                       "--fault", "e2e-repeated-ends", "--fault", "channels-mixed", "--fault", "initial-of-events",
                       *(word for name in ("crc", "counter-stuck", "counts-copies", "never-zero") for word in ("--fault", f"e2e-event-{name}")))
        self.assertIn("10 of 10 faults are found", text)
        for name, case in (("crc", "event"), ("counter-stuck", "event-counter"), ("counts-copies", "event-for-two"), ("never-zero", "event-wrap")):
            self.assertRegex(text, rf"found +e2e-event-{name} +\S*e2e\.profile11\.{case}\S*\n")
        self.assertRegex(text, r"found +ack-ttl +.*sd\.subscribe\.ack\.ttl")

    def test_tells_of_cases_that_no_fault_fails(self):
        profile = self.folder / "profile.yaml"
        listed = "  list: \"printf 'ack-ttl\\\\tsd.subscribe.ack.ttl\\\\twrong\\\\n'\""
        profile.write_text(re.sub(r"(?m)^  list: .*$", lambda _: listed, PROFILE.read_text()))
        command = ("selftest", "sd.subscribe.ack.ttl", "sd.offer.minor", "sd.find.late-multicast-answer", "--dut", profile, *ADDRESSES,
                   "--out", self.folder)
        text = conform(*command, status=1)
        self.assertRegex(text, r"blind +sd\.offer\.minor fails with none of the faults")
        self.assertIn("1 of 1 faults are found; 1 of 2 cases fail with a fault; 1 unsupported\n", text)
        # Of those that were not to be tried with all faults, nobody knows.
        self.assertRegex(conform(*command, "--fault", "ack-ttl"), r"passes +sd\.offer\.minor fails with none of the chosen faults")
        # One that fails without a fault shows nothing with one.
        profile.write_text(profile.read_text().replace("minor: 0", "minor: 1"))
        self.assertIn("1 of 2 cases fail with a fault; 1 do not pass without one; 1 unsupported\n", conform(*command, status=1))

    def test_shows_what_was_not_answered(self):
        profile = self.folder / "my profile.yaml"

        profile.write_text(PROFILE.read_text().replace("--event-group {event_multicast}\"\n",
                                                       "--event-group {event_multicast} --fault find-ignored\"\n", 1))
        text = conform("run", "sd.find.unicast", "--dut", profile, *ADDRESSES, "--out", self.folder, status=1)
        (find,) = json.loads((self.folder / "results.json").read_text())["cases"]
        self.assertIn("no offer in answer to FindService", find["reason"])
        self.assertEqual(find["retries"], 2, text)
        (difference,) = find["differences"]
        self.assertEqual((difference["expected"], difference["actual"]), ("an OfferService", "nothing"))
        # The last of three Finds. Wireshark numbers packets from 1, and so does the page.
        page = json.loads(re.search(r'(?s)<script[^>]* id="data"[^>]*>(.*?)</script>', (self.folder / "report.html").read_text())[1])
        packets = next(one for one in page["cases"] if one["id"] == find["id"])["packets"]
        marked = [one for one in packets if "OFFENDING" in one["comment"]]
        self.assertEqual([one["number"] for one in marked], [difference["packet"]])
        self.assertRegex(marked[0]["comment"], r"^FindService; OFFENDING: no answer to this within \d+\.\d s, expected an OfferService$")
        self.assertIn(marked[0]["comment"].encode(), (self.folder / find["evidence"]).read_bytes())
        self.assertIn(f"message: expected an OfferService, got nothing (packet {difference['packet']})",
                      (self.folder / "junit.xml").read_text())
        # What runs a case again can be copied into a shell.
        self.assertIn(f" --dut '{profile}' ", find["again"])
        # A cycle that is nearly half as long again.
        profile.write_text(PROFILE.read_text().replace("cyclic_offer_delay: 500 ms", "cyclic_offer_delay: 350 ms"))
        self.assertRegex(conform("run", "sd.phase.cyclic", "--dut", profile, *ADDRESSES, "--out", self.folder, "--quiet", status=1),
                         r"time between offers is \d+\.\d ms, expected 350\.0 ms, and a fifth more or less")

    def test_tells_of_a_failure(self):
        # The same device, of which the profile says something else.
        profile = self.folder / "profile.yaml"
        profile.write_text(PROFILE.read_text().replace("ttl: 5", "ttl: 6"))
        text = conform("run", "sd.offer.ttl", "--dut", profile, *ADDRESSES, "--out", self.folder / "out", status=1)
        self.assertIn("TTL is 5 (0x5), expected 6 (0x6)", text)
        self.assertIn(b"OFFENDING: TTL is 5", (self.folder / "out" / "sd.offer.ttl.pcapng").read_bytes())
        # And what broke since a run that was good.
        good = self.folder / "good"
        conform("run", "sd.offer.ttl", "rpc.response.comes", "--dut", PROFILE, *ADDRESSES, "--out", good)
        text = conform("diff", good / "results.json", self.folder / "out", status=1)
        self.assertRegex(text, r"broke \(1\)\n +sd\.offer\.ttl +pass -> fail: TTL is 5")
        self.assertRegex(text, r"gone \(1\)\n +rpc\.response\.comes")
        self.assertIn("mended (1)", conform("diff", self.folder / "out", good))
        # A run that was ended has not shown that nothing broke.
        cut = json.loads((good / "results.json").read_text())
        cut["cancelled"] = True
        del cut["cases"][1:]
        (self.folder / "cut.json").write_text(json.dumps(cut))
        self.assertIn("the run after is not complete: it was ended before all cases were run, and has 1 of them",
                      conform("diff", good, self.folder / "cut.json", status=1))
        self.assertIn("the run before is not complete", conform("diff", self.folder / "cut.json", good))
        self.assertRegex(conform("matrix", good, self.folder / "out"), r"sd\.offer\.ttl +pass +fail\n")
        self.assertIn("| sd.offer | 1/1 | 0/1 |", conform("matrix", good, self.folder / "out", "--format", "markdown"))
        self.assertIn("missing/results.json", conform("diff", good, self.folder / "missing" / "results.json", status=2))

    def test_writes_a_profile(self):
        door = pathlib.Path(SOURCE) / "examples" / "door"
        text = conform("profile", door / "Door.fidl", door / "Door.fdepl", "--device", f"{HOST}.1")
        self.assertIn("  - id: 0x4711  # car.Door\n    instance: 1\n", text)
        self.assertIn("    request: {method: 0x0001}  # the getter of opening\n", text)
        self.assertIn("is needed, or --from-network", conform("profile", status=2))
        # From the network: of the reference device, and good enough to run cases with.
        group = f"239.255.{os.getpid() >> 8 & 0xff}.{os.getpid() & 0xff}"
        device = subprocess.Popen([pathlib.Path(TRESTLE).parent / "ets_device", "--address", f"{HOST}.1", "--multicast", group,
                                   "--sd-port", "30490", "--event-group", "239.255.77.2"], stdout=subprocess.DEVNULL)
        self.addCleanup(device.wait, 20)
        self.addCleanup(device.terminate)
        file = self.folder / "found.yaml"
        # Who may capture sees all of loopback, other tests too; and the device may take its time to start.
        for _ in range(20):
            done = subprocess.run([TRESTLE, "conform", "profile", f"network:{HOST}.2", "--multicast", group, "--for", "1.5",
                                   "--device", f"{HOST}.1", "--tester", f"{HOST}.2", "-o", file], capture_output=True, text=True, timeout=60)
            text = file.read_text() if done.returncode == 0 else done.stderr
            if "0x0102" in text and "0x0101" in text and text.count("id: 0x0103") == 2:
                break
        self.assertIn(f"  device: {HOST}.1\n", text)
        self.assertIn("  - id: 0x0102", text)
        # Both versions of one service.
        self.assertEqual(re.findall(r"- id: 0x0103.*\n    instance: 1\n    major: (\d)\n", text), ["1", "2"])
        self.assertIn(f"  multicast: {group}\n", text)
        self.assertIn("1 pass", conform("run", "sd.offer.service", "--dut", file, "--out", self.folder))

    def test_judges_captures(self):
        """What the READMEs of the captures say is wrong with them is found, and nothing in the others."""
        shared = pathlib.Path(SOURCE).resolve().parent / "shared" / "pcaps" / "public"
        shared = pathlib.Path(os.environ.get("TRESTLE_SHARED_PCAPS", shared))
        wrong = {
            "errors_raw_client_vs_vsomeip_service.pcap": {
                "header.length", "header.protocol-version", "header.message-type", "header.return-code", "rpc.session",
                "rpc.response-asked", "rpc.interface-version", "rpc.event-source", "tp.order", "sd.stop-offer"},
            "sd_malformed_raw_peer_vs_vsomeip_service.pcap": {
                "sd.unicast-flag", "sd.arrays", "sd.entry-type", "sd.run", "sd.option-layout", "sd.option-protocol",
                "sd.option-counts", "sd.subscribe-endpoint", "sd.subscribe-address", "sd.entries", "sd.endpoint-port",
                "sd.subscribe-transport"},
            # vsomeip withdraws what it offers over UDP and TCP with one of the two endpoints.
            "sd_service_first_client_late.pcap": {"sd.stop-offer"},
            "fire_and_forget_udp_tcp.pcap": {"sd.stop-offer"},
            "sd_subscribe_udp_and_tcp_same_eventgroup.pcap": {"sd.stop-offer"},
            "field_getter_setter_notifier.pcap": {"sd.stop-offer"},
            "tp_separation_time_and_short_segments.pcap": {"tp.largest"},
            "seat.pcap": {"sd.tc8-flags"},
            "someip1.pcap": {"sd.port", "sd.session", "sd.unicast-flag", "sd.option-counts", "sd.subscribe-address"},
            "SomeIpSd.pcapng": {"sd.tc8-flags"},
            # Events come from the port of service discovery, to two ports of one host, which subscribe in turns.
            "udp-someip.pcap": {"sd.port", "sd.session", "sd.subscribe-answered", "rpc.event-source", "sd.one-subscriber"},
            # The clients of these two use a Session ID twice in a row.
            "normal_dataset.pcap": {"rpc.response-once", "rpc.session-counts"},
            "error_on_event_dataset.pcap": {"ids.event", "ids.one-meaning", "rpc.response-asked", "rpc.session-counts"},
            "someip-udp-method-call.pcapng": {"sd.port", "sd.option-repeated"},
        }
        packets = {
            "errors_raw_client_vs_vsomeip_service.pcap": {"rpc.interface-version": [13, 27, 77], "rpc.event-source": [49]},
            "sd_malformed_raw_peer_vs_vsomeip_service.pcap": {"sd.subscribe-transport": [27], "sd.endpoint-port": [35],
                                                              "sd.entries": [59]},
        }
        captures = [*pathlib.Path(SOURCE, "pcaps").rglob("*.pcap"), *shared.rglob("*.pcap*")]
        self.assertGreater(len(captures), 25)
        for capture in captures:
            done = subprocess.run([TRESTLE, "conform", "replay", capture, "--out", self.folder], capture_output=True, text=True, timeout=60)
            cases = json.loads((self.folder / "results.json").read_text())["cases"]
            found = {one["id"].removeprefix("pcap."): one for one in cases if one["differences"]}
            self.assertEqual(set(found), wrong.get(capture.name, set()), f"{capture}\n{done.stdout}")
            self.assertEqual(done.returncode, 1 if any(one["verdict"] == "fail" for one in found.values()) else 0, capture)
            for rule, numbers in packets.get(capture.name, {}).items():
                self.assertEqual([one["packet"] for one in found[rule]["differences"]], numbers, f"{capture}: {rule}")
                self.assertIn(f"packet{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}\n", done.stdout)
            if capture.name == "reboot_service_kill9.pcap":
                self.assertIn("restarts were seen", done.stdout)
        self.assertIn('id="data"', (self.folder / "report.html").read_text())
        text = conform("replay", pathlib.Path(SOURCE) / "pcaps" / "vsomeip" / "errors_raw_client_vs_vsomeip_service.pcap",
                       "--host", "10.0.0.1", "--only", "pcap.header.message-type")
        self.assertRegex(text, "1 case in .* 1 pass")
        # The capture is named as it was, wherever the results are.
        text = conform("replay", os.path.relpath(capture := pathlib.Path(SOURCE) / "pcaps" / "vsomeip" / "fire_and_forget_udp_tcp.pcap"),
                       "--out", self.folder, "--only", "pcap.sd.stop-offer", status=1)
        named = re.search(r"evidence: (.+)", text)[1]
        self.assertTrue(os.path.samefile(named, capture), named)
        evidence = json.loads((self.folder / "results.json").read_text())["cases"][0]["evidence"]
        self.assertTrue(os.path.samefile(self.folder / evidence, capture), evidence)
        self.assertIn("nobody", conform("replay", PROFILE, "--host", "nobody", status=2))
        self.assertIn("'pcap.nosuch' chooses no rule of replay", conform("replay", capture, "--only", "pcap.nosuch", status=2))
        conform("replay", PROFILE, status=2)

    def test_works_over_ipv6(self):
        # Loopback has one address of IPv6 only, so this needs a network of its own; with room for two devices at once.
        network = ("ip link add v0 type veth peer name v1 && ip link set lo up && ip link set v1 up && ip link set v0 up && "
                   "for one in 1 2 1:1 1:2 2:1 2:2; do ip addr add fd00::$one/64 dev v0 nodad || exit 1; done && "
                   "timeout 60 sh -c 'until ip link show v0 | grep -q \"state UP\"; do sleep 0.01; done' && "
                   # Until they are addresses of this host: before, they would be asked for on the link.
                   "for one in 1 2 1:1 1:2 2:1 2:2; do timeout 60 sh -c 'until ip -6 route get fd00::$0 | grep -q ^local; "
                   "do sleep 0.01; done' $one || exit 1; done")
        own = next((words for words in (["unshare", "-n"], ["unshare", "-Urn"])
                    if subprocess.run([*words, "sh", "-c", network], capture_output=True).returncode == 0), None)
        if own is None:
            self.skipTest("cannot make a network of its own")
        text = PROFILE.read_text()
        for old, new in (("127.0.77.1", '"fd00::1"'), ("127.0.77.2", '"fd00::2"'), ("239.255.77.1", '"ff15::77"'),
                         ("239.255.77.2", '"ff15::78"')):
            text = text.replace(old, new)
        profile = self.folder / "profile.yaml"
        profile.write_text(text)
        cases = ["sd.offer.endpoint", "sd.option.endpoint", "sd.option.multicast.address", "sd.subscribe.ack.ttl",
                 "sd.subscribe.endpoint", "sd.endpoint-option.find", "event.multicast", "tcp.request", "client.subscribe.endpoint"]
        run = f"{network} && '{TRESTLE}' conform run {' '.join(cases)} --dut '{profile}' --out '{self.folder}'"
        done = subprocess.run([*own, "sh", "-c", run], capture_output=True, text=True, timeout=600)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertGreater(json.loads((self.folder / "results.json").read_text())["verdicts"]["pass"], len(cases))
        # Faults are found there, too: those of options, whose places are others, and of where datagrams go to.
        faults = ["endpoint-address", "endpoint-port", "endpoint-protocol", "endpoint-reserved-2", "offer-udp-only",
                  "multicast-address", "multicast-port", "sd-endpoint-unknown", "sd-endpoint-last-counts", "sd-endpoint-sent",
                  "multicast-too-early", "multicast-never", "options-must-be-referenced", "client-subscribe-multicast",
                  "client-subscribe-address", "deaf-after-burst"]
        run = (f"{network} && '{TRESTLE}' conform selftest sd client event load.flood.entries --quick --jobs 2 --dut '{profile}' "
               f"--out '{self.folder}' {' '.join('--fault ' + one for one in faults)}")
        done = subprocess.run([*own, "sh", "-c", run], capture_output=True, text=True, timeout=900)
        self.assertIn(f"{len(faults)} of {len(faults)} faults are found", done.stdout, done.stderr)
        # A profile from what is offered there.
        found = self.folder / "found.yaml"
        run = (f"{network} && {{ '{pathlib.Path(TRESTLE).parent}/ets_device' --address fd00::1 --multicast ff15::77 --sd-port 30490 "
               f"--event-group ff15::78 >'{self.folder}/device.log' & }} && for one in 1 2 3 4 5 6 7 8; do '{TRESTLE}' conform profile "
               f"network:fd00::2 --multicast ff15::77 --for 1.5 --tester fd00::2 -o '{found}' && grep -q 0x0102 '{found}' && break; done; "
               f"'{TRESTLE}' conform run sd.offer.service --dut '{found}' --out '{self.folder}'; kill $!; wait")
        done = subprocess.run([*own, "sh", "-c", run], capture_output=True, text=True, timeout=600)
        self.assertIn(": 1 pass", done.stdout, done.stderr)
        # With addresses from the command line.
        profile.write_text(text.replace('"fd00::1"', '"fd00::8"', 1).replace('"fd00::2"', '"fd00::9"', 1))
        run = (f"{network} && '{TRESTLE}' conform run sd.offer.endpoint --dut '{profile}' --device fd00::1 --tester fd00::2 "
               f"--out '{self.folder}'")
        done = subprocess.run([*own, "sh", "-c", run], capture_output=True, text=True, timeout=600)
        self.assertIn(": 1 pass", done.stdout, done.stderr)
        self.assertIn("--tester fd00::2 --device fd00::1", json.loads((self.folder / "results.json").read_text())["cases"][0]["again"])

    def test_lists_and_explains(self):
        lines = conform("list", "sd.offer").splitlines()
        self.assertTrue(lines and all(line.startswith("sd.offer.") for line in lines), lines)
        self.assertGreater(len(conform("list").splitlines()), 150)
        text = conform("explain", "sd.offer.ttl")
        self.assertIn("feat_req_someipsd_253: Offer fields", text)
        self.assertIn("SOMEIPSRV_FORMAT_17", text)
        self.assertIn("  level must, role server, at most 120 s\n  unsupported where: the profile does not tell the cyclic offer delay\n",
                      conform("explain", "sd.phase.cyclic"))
        # The documentation counts right.
        documentation = " ".join((pathlib.Path(SOURCE) / "docs" / "conform.md").read_text().split())
        self.assertIn(f"A run of all {len(conform('list').splitlines())} cases takes ", documentation)
        faults = subprocess.run([pathlib.Path(TRESTLE).parent / "ets_device", "--list-faults"], capture_output=True, text=True, check=True)
        number = len(faults.stdout.splitlines())
        self.assertIn(f"Now {number} of {number} faults are found", documentation)
        # Of what a capture alone can show, the rule, or why there is none.
        self.assertIn("rule of replay: pcap.rpc.session-counts, ", conform("explain", "feat_req_someip_88"))
        text = conform("explain", "pcap.udp.size")
        self.assertIn("pcap.udp.size\n  The device sends no more than 1400 bytes", text)
        self.assertIn("feat_req_someip_318", text)
        self.assertIn("pcap.no-such", conform("explain", "pcap.no-such", status=2))
        self.assertIn("no rule of replay: a capture does not tell", conform("explain", "feat_req_someip_667"))

    def test_says_why_a_requirement_has_no_case(self):
        with (pathlib.Path(SOURCE) / "bridge" / "conform" / "catalogue" / "no_case.csv").open(newline="") as file:
            why = {row["id"]: row["why"] for row in csv.DictReader(file)}
        self.assertIn("feat_req_someipsd_855", why)
        text = conform("explain", *why)
        for one, reason in why.items():
            self.assertRegex(text, f"(?m)^{one}: .+\\n    no case: {re.escape(reason)}$")
        self.assertNotIn("role ", text)  # of a case
        self.assertIn("has no case: " + why["feat_req_someipsd_855"], conform("list", "feat_req_someipsd_855", status=2))
        # There is nothing to test, or a capture is enough.
        self.assertIn("no case: it explains", conform("explain", "feat_req_someip_33"))
        self.assertIn("'trestle conform replay' judges it", conform("run", "feat_req_someip_77", "feat_req_someip_36",
                                                                    "--dut", PROFILE, status=2))
        # Beside a case, or a rule of replay.
        text = conform("explain", "feat_req_someip_92")
        self.assertIn("rpc.response.interface-version\n  The device ", text)
        self.assertIn("rule of replay: pcap.rpc.interface-version, ", text)
        self.assertNotIn("no case", text)

    def test_says_why_a_tc8_case_has_no_case(self):
        """As the documentation does."""
        with (pathlib.Path(SOURCE) / "bridge" / "conform" / "catalogue" / "tc8.csv").open(newline="") as file:
            why = {row["id"]: row["why-there-is-no-case"] for row in csv.DictReader(file) if row["why-there-is-no-case"]}
        self.assertIn("SOMEIP_ETS_120", why)
        documentation = (pathlib.Path(SOURCE) / "docs" / "conform.md").read_text()
        for case, reason in why.items():
            text = conform("explain", case)
            self.assertTrue(text.startswith(f"{case}: "), text)
            self.assertIn(f"no case: {reason}\n", text)
            self.assertNotIn("role ", text)  # of a case
            self.assertIn(f"| {case} | {reason} |\n", documentation)
            self.assertIn(f"has no case: {reason}", conform("list", case, status=2))
        self.assertEqual(documentation.count("| SOMEIP"), len(why))
        # Beside one that has a case.
        text = conform("explain", "SOMEIP_ETS_120", "sd.offer.ttl")
        self.assertRegex(text, r"(?s)^sd\.offer\.ttl\n.*\nSOMEIP_ETS_120: ")
        self.assertEqual(len(re.findall(r"^  The device ", text, re.MULTILINE)), 1)

    def test_refuses_what_it_does_not_know(self):
        self.assertIn("chooses no case", conform("list", "sd.ofer", status=2))
        # Nor what leaves nothing of what is asked for: that would look as if all went well.
        for words in (("sd.offer.ttl", "--role", "client"), ("sd.offer.first-option", "sd.offer.ttl", "--level", "must")):
            text = conform("run", *words, "--dut", PROFILE, *ADDRESSES, "--out", self.folder, status=2)
            self.assertRegex(text, f"{re.escape(words[0])}: chooses no case with --level (tc8|must) --role (both|client)")
        for seed in ("-1", "99999999999999999999", "x"):
            self.assertIn("a number from 0 to 18446744073709551615",
                          conform("run", "sd.offer.ttl", "--dut", PROFILE, f"--seed={seed}", "--out", self.folder, status=2))
        profile = self.folder / "profile.yaml"
        profile.write_text("name: D\nnetwork: {device: 192.0.2.1, tester: nobody}\nservices: []\n")
        text = conform("run", "--dut", profile, status=2)
        self.assertTrue(re.search(r"profile\.yaml:2:\d+: error: ", text), text)
        conform("run", "--dut", self.folder / "missing.yaml", status=2)
        conform("run", status=2)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
