#!/usr/bin/env python3
"""trestle check --network, with a SOME/IP peer that is nothing but sockets, and a DDS publisher.

Usage: network_check_test.py TRESTLE
"""
import os
import re
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bare_peer import PATIENCE, Peer, entries
from bridge_program import BRIDGE, DOMAIN, GROUP, HOST, PEER, head, log_until, write

TRESTLE = sys.argv.pop(1)

TO_DDS = """\
routes:
  - {topic: /in, type: geometry_msgs/msg/Point, direction: someip_to_dds, service: 0x2222, instance: 1, eventgroup: 3, event: 0x8001}
"""
TO_SOMEIP = """\
routes:
  - {topic: /in, type: geometry_msgs/msg/Point, direction: dds_to_someip, service: 0x1111, instance: 1, eventgroup: 1, event: 0x8001,
     port: 40001}
"""


class NetworkCheck(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def file(self, name, text):
        path = os.path.join(self.folder, name)
        write(path, text)
        return path

    def check(self, file, *arguments):
        return subprocess.run([TRESTLE, "check", "--network", *arguments, file], capture_output=True, text=True, timeout=PATIENCE + 60)

    def bridge(self, file):
        log = tempfile.TemporaryFile("a+")
        self.addCleanup(log.close)
        bridge = subprocess.Popen([TRESTLE, "bridge", file], stdout=subprocess.DEVNULL, stderr=log)
        self.addCleanup(bridge.wait, PATIENCE)
        self.addCleanup(bridge.send_signal, signal.SIGINT)
        log_until(log, "Ctrl-C stops")
        return bridge

    def test_says_for_each_route_why_its_source_is_not_there(self):
        both = head() + TO_DDS + TO_SOMEIP.replace("routes:\n", "").replace("/in", "/out")
        done = self.check(self.file("both.yaml", both), "--wait", "1")
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        self.assertIn("both.yaml: 0 of 2 routes would find their sources now\n", done.stdout)
        self.assertRegex(done.stdout, r"  /in   <-  no SOME/IP packet has come in ")
        self.assertRegex(done.stdout, rf"  /out  ->  nobody else is in DDS domain {DOMAIN} ")
        self.assertNotIn("\x1b", done.stdout)

    def test_finds_a_service_and_asks_for_nothing(self):
        with Peer(PEER, GROUP) as peer:
            check = subprocess.Popen([TRESTLE, "check", "--network", "--wait", str(PATIENCE), self.file("in.yaml", head() + TO_DDS)],
                                     stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            kinds = set()
            while check.poll() is None:
                peer.offer(BRIDGE)
                peer.sd.settimeout(0.2)
                try:
                    kinds |= {entry[0] for entry in entries(peer.sd.recv(65536))}
                except TimeoutError:
                    pass
            out, errors = check.communicate(timeout=PATIENCE)
        self.assertEqual((check.returncode, errors), (0, ""), out)
        self.assertRegex(out, r"in\.yaml: 1 of 1 routes would find their sources now\n")
        self.assertRegex(out, r"\n  SOME/IP \S+: 1 other host\n(.*\n)+  /in  <-  there\n")
        self.assertLessEqual(kinds, {0}, "it finds, and neither offers nor subscribes")

    def test_finds_a_publisher_though_not_one_of_another_bridge(self):
        file = self.file("out.yaml", head() + TO_SOMEIP)
        # Another bridge writes the topic, which is never carried back.
        self.bridge(self.file("other.yaml", head(HOST + "13") + TO_DDS))
        for wait in 2, 5, 15, 45:  # on a slow machine the other one is found late
            done = self.check(file, "--wait", str(wait))
            self.assertEqual((done.returncode, done.stderr), (1, ""), done.stdout)
            if "1 other participant\n" in done.stdout:
                break
        self.assertIn("1 other participant\n", done.stdout)
        self.assertRegex(done.stdout, r"  /in  ->  nobody publishes it ")

    def test_says_that_the_bridge_itself_runs(self):
        file = self.file("in.yaml", head() + TO_DDS)
        self.bridge(file)
        done = self.check(file, "--wait", "1")
        self.assertEqual((done.returncode, done.stdout), (1, ""), done.stderr)
        self.assertRegex(done.stderr, r"in\.yaml: .*if that is the bridge itself, 'trestle status' says what it finds\n")

    def test_says_what_is_wrong_with_a_file_first(self):
        done = self.check(self.file("bad.yaml", head() + TO_DDS.replace("eventgroup", "group")))
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertRegex(done.stderr, r"bad\.yaml:\d+:\d+: error: .*unknown key")

    def test_waits_only_for_the_network(self):
        done = subprocess.run([TRESTLE, "check", "--wait", "3", "x.yaml"], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, re.escape("--wait requires --network"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
