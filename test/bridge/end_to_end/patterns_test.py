"""Routes from discovery in the whole program: ids outlive kills, and SIGHUP brings another pattern.

Usage: patterns_test.py TRESTLE RESTARTS_PEER
"""
import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bare_peer import PATIENCE, Peer, receive
from bridge_program import BRIDGE, DOMAIN, GROUP, PEER, head, log_until, offered, write

PEER_PROGRAM = sys.argv.pop(2)
TRESTLE = sys.argv.pop(1)

CONFIG = head() + """\
lock_file: ids.lock
patterns:
  - topics: rt/up_*
    direction: dds_to_someip
    services: 0x6000-0x6fff
    port: 40001
"""
# FNV-1a of "/up_0 std_msgs/msg/String" is 0x21d89f72, of that of /up_1 0xde8e8739.
UP_0, UP_1 = 0x6f72, 0x6739
LEASE = "20"  # of the publisher, in seconds: longer than a machine stalls


class Patterns(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.file = os.path.join(self.folder.name, "bridge.yaml")
        self.lock = os.path.join(self.folder.name, "ids.lock")
        self.log = open(os.path.join(self.folder.name, "log"), "a+", encoding="utf-8")
        write(self.file, CONFIG)
        self.peer = Peer(PEER, GROUP)
        self.started = []
        self.publisher = self.start([PEER_PROGRAM, "ros", str(DOMAIN), LEASE])

    def tearDown(self):
        for process in self.started:
            process.kill()
            process.wait()
        self.peer.close()
        self.log.close()
        self.folder.cleanup()

    def start(self, command, environment=()):
        self.started.append(subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=self.log,
                                             env={**os.environ, **dict(environment)}))
        return self.started[-1]

    def start_bridge(self):
        return self.start([TRESTLE, "bridge", self.file])

    def ids(self):
        # Whether our own volatile writers look transient-local depends on the version of Fast DDS.
        with open(self.lock, encoding="utf-8") as file:
            return [line.strip().replace(", durability: transient_local", "") for line in file if "service:" in line]

    def log_until(self, wanted, times=1):
        log_until(self.log, wanted, times)

    def check(self):
        return subprocess.run([TRESTLE, "check", self.file], capture_output=True, text=True, timeout=PATIENCE)

    def test_ids_outlive_a_bridge_that_is_killed(self):
        bridge = self.start_bridge()
        receive(self.peer.group, offered(UP_0))
        receive(self.peer.group, offered(UP_1))
        expected = [f"- {{service: 0x{UP_0:04x}, topic: /up_0, type: std_msgs/msg/String}}",
                    f"- {{service: 0x{UP_1:04x}, topic: /up_1, type: std_msgs/msg/String}}"]
        self.assertEqual(self.ids(), expected)
        checked = self.check()
        self.assertEqual(checked.returncode, 0, checked.stderr)
        self.assertIn("/up_1   0x6739", checked.stdout)
        self.assertIn("2 of 200", checked.stdout)
        bridge.kill()
        bridge.wait()
        # What would not be chosen now is what it stays.
        write(self.lock, "version: 1\ntopics:\n  - {service: 0x6123, topic: /up_0, type: std_msgs/msg/String}\n")
        self.start_bridge()
        receive(self.peer.group, offered(0x6123))
        receive(self.peer.group, offered(UP_1))
        self.assertEqual(self.ids(), ["- {service: 0x6123, topic: /up_0, type: std_msgs/msg/String}", expected[1]])

    def test_sighup_brings_another_pattern(self):
        bridge = self.start_bridge()
        receive(self.peer.group, offered(UP_0))
        receive(self.peer.group, offered(UP_1))
        # What is wrong with the lock file changes nothing, and is told with its place.
        with open(self.lock, encoding="utf-8") as file:
            good = file.read()
        write(self.lock, good.replace("0x6f72", "0x6739"))
        bridge.send_signal(signal.SIGHUP)
        self.log_until("ids.lock:7:5: error: service: 0x6739 is that of /up_0 in line 6")
        self.log_until("going on as before")
        write(self.lock, good)
        # Nor does a range that the ids are outside of.
        write(self.file, CONFIG.replace("0x6000-0x6fff", "0x6000-0x6eff"))
        bridge.send_signal(signal.SIGHUP)
        self.log_until("ids.lock:6:5: error: service: 0x6f72 of /up_0 is outside of 0x6000-0x6eff")
        self.log_until("going on as before", 2)
        # Another pattern: one topic goes, and the other one keeps its id.
        write(self.file, CONFIG.replace("rt/up_*", "/u*_1"))
        bridge.send_signal(signal.SIGHUP)
        receive(self.peer.group, offered(UP_0, False))  # the other one may be withdrawn in the same datagram
        receive(self.peer.group, offered(UP_1))
        self.assertEqual(len(self.ids()), 2, "the id of the other one stays reserved")
        bridge.send_signal(signal.SIGTERM)
        self.assertEqual(bridge.wait(timeout=PATIENCE), 0)
        receive(self.peer.group, offered(UP_1, False))

    def test_topics_behind_a_discovery_server(self):
        self.publisher.kill()
        self.publisher.wait()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            server = f"127.0.0.1:{probe.getsockname()[1]}"
        if not shutil.which("fast-discovery-server"):
            self.skipTest("fast-discovery-server, of Debian's fastdds-tools, is not installed")
        self.start(["fast-discovery-server", "-i", "0", "-l", "127.0.0.1", "-p", server.split(":")[1]])
        write(self.file, CONFIG.replace("interfaces:", f"discovery_server: '{server}', interfaces:"))
        of_ros = {"ROS_DISCOVERY_SERVER": server}
        bridge = self.start_bridge()
        self.start([PEER_PROGRAM, "ros", str(DOMAIN), LEASE], of_ros)
        receive(self.peer.group, offered(UP_0))
        bridge.send_signal(signal.SIGTERM)
        self.assertEqual(bridge.wait(timeout=PATIENCE), 0)
        receive(self.peer.group, offered(UP_0, False))
        # Nor does it matter who names the server.
        write(self.file, CONFIG)
        self.start([TRESTLE, "bridge", self.file], of_ros)
        receive(self.peer.group, offered(UP_0))
        with self.peer.bound(PEER, 40003) as events:
            events.settimeout(1)
            end = time.monotonic() + PATIENCE
            event = b""
            while not event and time.monotonic() < end:  # the publisher may go and come back while the machine stalls
                self.peer.subscribe(BRIDGE, UP_0, 1)
                with contextlib.suppress(TimeoutError):
                    event = events.recv(65536)
            self.assertEqual(event[:4], UP_0.to_bytes(2, "big") + b"\x80\x01")


if __name__ == "__main__":
    unittest.main()
