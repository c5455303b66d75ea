#!/usr/bin/env python3
"""trestle status and trestle bridge --console, with a SOME/IP peer that is nothing but sockets and hand-made bytes.

Usage: status_command_test.py TRESTLE
"""
import contextlib
import json
import os
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.error
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bare_peer import PATIENCE, Peer, entries, receive, someip, ttl
from bridge_program import BRIDGE, DOMAIN, GROUP, PEER, head, log_until

TRESTLE = sys.argv.pop(1)
EXAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../examples")

ROUTES = """\
routes:
  - topic: /out
    type: std_msgs/msg/String
    direction: dds_to_someip
    service: 0x1111
    instance: 0x0001
    eventgroup: 0x0001
    event: 0x8001
    port: 40001
  - topic: /in
    type: geometry_msgs/msg/Point
    direction: someip_to_dds
    service: 0x2222
    instance: 0x0001
    eventgroup: 0x0003
    event: 0x8001
    qos: {durability: transient_local}
"""


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


class StatusCommand(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": self.folder.name, "TZ": "UTC"}
        self.sockets = os.path.join(self.folder.name, "trestle")

    def start(self, *arguments, more="", routes=ROUTES, ready="Ctrl-C stops"):
        file = os.path.join(self.folder.name, "bridge.yaml")
        with open(file, "w", encoding="utf-8") as config:
            config.write(head() + more + routes)
        log = tempfile.TemporaryFile("a+")
        self.addCleanup(log.close)
        bridge = subprocess.Popen([TRESTLE, "bridge", *arguments, file], stdout=subprocess.DEVNULL, stderr=log,
                                  env=self.environment)
        bridge.log, bridge.file = log, file
        self.addCleanup(self.end, bridge)
        if ready:
            log_until(log, ready)
        return bridge

    @staticmethod
    def end(bridge):
        if bridge.poll() is None:
            bridge.send_signal(signal.SIGINT)
            bridge.wait(PATIENCE)

    def ask_once(self, bridge, *arguments):
        return subprocess.run([TRESTLE, "status", bridge.file, *arguments], capture_output=True, text=True,
                              timeout=PATIENCE, env=self.environment)

    def status(self, bridge, *arguments):
        """On a slow machine a bridge that runs may not answer within three seconds."""
        end = time.monotonic() + PATIENCE
        while "does not answer" in (done := self.ask_once(bridge, *arguments)).stderr and time.monotonic() < end:
            pass
        return done

    def picture(self, bridge):
        done = self.status(bridge, "--json")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return json.loads(done.stdout)

    def route(self, bridge, name):
        return next(one for one in self.picture(bridge)["routes"] if one["name"] == name)

    def route_until(self, bridge, name, condition):
        end = time.monotonic() + PATIENCE
        while True:
            route = self.route(bridge, name)
            if condition(route):
                return route
            self.assertLess(time.monotonic(), end, route)
            time.sleep(0.05)

    def test_shows_a_bridge_and_why_nothing_flows_until_it_does(self):
        bridge = self.start()
        picture = self.picture(bridge)
        self.assertEqual((picture["trestle"], picture["pid"], picture["configuration"]), (1, bridge.pid, bridge.file))
        self.assertEqual(picture["someip"]["address"], BRIDGE)
        self.assertEqual(picture["dds"]["domain"], DOMAIN)
        self.assertEqual({one["name"]: (one["state"], one["cause"]["name"]) for one in picture["routes"]},
                         {"/out": ("waiting", "no_participant"), "/in": ("waiting", "no_packet")})
        self.assertIn("max_peers", [one["name"] for one in picture["limits"]])
        words = f"nobody else is in DDS domain {DOMAIN} (`dds: {{domain: ...}}`, ROS_DOMAIN_ID; firewall; `interfaces`)"
        text = self.status(bridge).stdout
        self.assertIn(f"process {bridge.pid}, running for ", text)
        self.assertRegex(text, r"  /out +-> +0x1111\.0x0001\.0x8001 +waiting .*never")
        self.assertIn("      " + words + "\n", text)
        self.assertIn(f"      no SOME/IP packet has come in for {BRIDGE} since the start: is multicast routed there, and "
                      "UDP 30490 let through?\n", text)
        self.assertNotIn("\x1b", text)
        log_until(bridge.log, "/out: nothing has come yet: " + words)

        with Peer(PEER, GROUP) as peer, contextlib.ExitStack() as ends:
            peer.offer(BRIDGE)
            entry, datagram, _ = receive(peer.sd, lambda e: e[0] == 6)
            self.assertEqual(self.route(bridge, "/in")["cause"]["name"], "not_acknowledged")
            peer.ack(BRIDGE, entry)
            ends.enter_context(self.acknowledging(peer))
            self.route_until(bridge, "/in", lambda one: one["cause"]["name"] == "no_event")
            hosts = self.picture(bridge)["someip"]["hosts"]
            self.assertEqual([(one["address"], one["offers"]) for one in hosts], [(PEER, 1)])
            port = int.from_bytes(self.port_in(datagram), "big")
            peer.service.sendto(someip(0x2222, 0x8002, bytes(24)), (BRIDGE, port))
            route = self.route_until(bridge, "/in", lambda one: one["cause"]["name"] == "other_events")
            self.assertEqual(route["cause"]["words"], "1 event came with id 0x8002, the route waits for 0x8001")
            peer.service.sendto(someip(0x2222, 0x8001, bytes(3), session=2), (BRIDGE, port))
            route = self.route_until(bridge, "/in", lambda one: one["cause"]["name"] == "dropped")
            self.assertEqual(route["state"], "failing")
            self.assertIn("their bytes are no message of the route's type", route["cause"]["words"])
            self.assertRegex(self.status(bridge).stdout, r"\n      dropped: .*1 not_convertible")
            for session in range(3, 8):
                peer.service.sendto(someip(0x2222, 0x8001, struct.pack(">ddd", 1, 2, 3), session), (BRIDGE, port))
            route = self.route_until(bridge, "/in", lambda one: one["carried"] == 5)
        self.assertEqual(route["cause"], {"name": "none", "words": ""})
        self.assertEqual(route["received"], 6)
        self.assertEqual(route["conversion"]["count"], 5)
        self.assertEqual(sum(one["count"] for one in route["conversion"]["buckets"]), 5)
        self.assertLess(abs(route["last_ns"] / 1e9 - time.time()), PATIENCE)
        self.assertEqual(len(route["slowest"]), 4)
        slowest = self.status(bridge, "--slowest").stdout
        self.assertEqual(len(re.findall(r"^  \d\d:\d\d:\d\d\.\d{3}  /in  session 0x000[3-7]  \d+ B  .*: waited .*, convert .*, "
                                        r"send .*$", slowest, re.MULTILINE)), 4, slowest)

    def test_names_what_the_interfaces_describe(self):
        bridge = self.start(routes=f"interfaces: [{os.path.join(EXAMPLES, 'door')}]\ngenerate: all\n")
        self.assertRegex(self.status(bridge).stdout, r"  /door/moved +<- +Door\.0x0001\.moved +waiting ")
        with Peer(PEER, GROUP) as peer:
            peer.offer(BRIDGE)
            route = self.route_until(bridge, "/door/moved", lambda one: one["cause"]["name"] == "not_offered")
            self.assertEqual(route["cause"]["words"], "nobody offers Door.0x0001 (1 SOME/IP host was heard)")
            peer.send_sd(BRIDGE, struct.pack(">BBBBHHII", 1, 0, 0, 0x10, 0x4711, 1, 1 << 24 | 600, 0), peer.endpoint(40002))
            route = self.route_until(bridge, "/door/moved", lambda one: one["cause"]["name"] == "not_acknowledged")
            words = ("Door.0x0001 is offered, but the server has not answered the subscription to eventgroup 0x0002 "
                     "(moved, blocked)")
            self.assertEqual(route["cause"]["words"], words)
            self.assertIn("      " + words + "\n", self.status(bridge).stdout)
            self.assertEqual([route[key] for key in ("service_name", "member_name", "eventgroup_name")],
                             ["Door", "moved", "moved, blocked"])
            getter = self.route(bridge, "/door/label/get")
            self.assertEqual((getter["member_name"], getter["eventgroup_name"]), ("label.get", ""))
            log_until(bridge.log, words)

    def test_tells_which_ids_were_chosen(self):
        with open(os.path.join(EXAMPLES, "door", "Door.fidl"), encoding="utf-8") as example:
            fidl = example.read()
        lamp = "package car\ninterface Lamp { version { major 1 minor 0 } method turn { } broadcast lit { out { Boolean on } } }\n"
        deployed = """import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl"
import "Lamp.fidl"
define org.genivi.commonapi.someip.deployment for interface car.Lamp {
    SomeIpServiceID = 0x4712
    method turn { SomeIpMethodID = 7 }
}
"""
        for name, content in (("Door.fidl", fidl), ("Lamp.fidl", lamp), ("Lamp.fdepl", deployed)):
            with open(os.path.join(self.folder.name, name), "w", encoding="utf-8") as file:
                file.write(content)
        bridge = self.start(routes="interfaces: [Door.fidl, Lamp.fidl, Lamp.fdepl]\ngenerate: all\n")
        text = self.status(bridge).stdout
        self.assertRegex(text, r"  /door/moved +.. +Door\.0x[0-9a-f]{4}\.moved chosen ")
        self.assertIn("  chosen: Trestle chose the id of this service, because no description gives it\n", text)
        self.assertTrue(self.route(bridge, "/door/moved")["service_id_is_chosen"])
        # The description has the service, and not all of its members.
        self.assertRegex(text, r"  /lamp/lit +.. +Lamp\.0x[0-9a-f]{4}\.lit chosen member, eventgroup ")
        self.assertRegex(text, r"  /lamp/turn +.. +Lamp\.0x[0-9a-f]{4}\.turn  ")
        self.assertIn("  chosen member, eventgroup: Trestle chose these ids of the service, because no description gives them\n",
                      text)
        chosen = {name: [self.route(bridge, name)[f"{what}_id_is_chosen"] for what in ("service", "member", "eventgroup")]
                  for name in ("/lamp/lit", "/lamp/turn")}
        self.assertEqual(chosen, {"/lamp/lit": [False, True, True], "/lamp/turn": [False, False, False]})

    @staticmethod
    @contextlib.contextmanager
    def acknowledging(peer):
        """Offers again and again, and answers the Subscribes that come of it, so that the subscription stays."""
        ended = threading.Event()

        def answer():
            while not ended.wait(0.2):
                peer.offer(BRIDGE)
                while select.select([peer.sd], [], [], 0)[0]:
                    for entry in entries(peer.sd.recv(65536)):
                        if entry[0] == 6 and ttl(entry) > 0:
                            peer.ack(BRIDGE, entry)

        thread = threading.Thread(target=answer)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    @staticmethod
    def port_in(datagram):
        """The port of the first endpoint in an SD message."""
        length = struct.unpack_from(">I", datagram, 20)[0]
        options = datagram[24 + length + 4:]
        while options[2] != 0x04:  # an IPv4 endpoint
            options = options[3 + int.from_bytes(options[:2], "big"):]
        return options[10:12]

    def test_finds_only_what_runs(self):
        bridge = self.start()
        done = self.status(bridge)
        self.assertEqual(done.returncode, 0)
        bridge.kill()
        bridge.wait()
        self.assertEqual(sorted(os.listdir(self.sockets)), [f"{bridge.pid}.guests", f"{bridge.pid}.sock"])
        done = self.status(bridge)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertEqual(done.stderr, f"no bridge {bridge.file} runs on this host\n")
        self.assertEqual(os.listdir(self.sockets), [], "what was left behind is removed")

    def test_removes_its_socket_at_the_end(self):
        bridge = self.start()
        path = os.path.join(self.sockets, f"{bridge.pid}.sock")
        self.assertEqual(os.stat(path).st_mode & 0o777, 0o600)
        self.end(bridge)
        self.assertEqual(bridge.returncode, 0)
        self.assertEqual(os.listdir(self.sockets), [])

    def test_says_that_a_bridge_does_not_answer(self):
        bridge = self.start()
        bridge.send_signal(signal.SIGSTOP)
        try:
            done = self.ask_once(bridge)
        finally:
            bridge.send_signal(signal.SIGCONT)
        self.assertEqual(done.returncode, 1)
        self.assertIn("the bridge does not answer; it may be stopped, or very busy", done.stderr)
        self.assertEqual(self.status(bridge).returncode, 0, "its socket is still there")

    def test_goes_on_while_it_is_watched(self):
        bridge = self.start()
        watch = subprocess.Popen([TRESTLE, "status", str(bridge.pid), "--watch", "--json"], stdout=subprocess.PIPE,
                                 text=True, env=self.environment)
        pictures = [json.loads(watch.stdout.readline()) for _ in range(2)]
        while pictures[0]["running_s"] == pictures[-1]["running_s"]:  # of a bridge that stalls the same may come twice
            pictures.append(json.loads(watch.stdout.readline()))
        watch.send_signal(signal.SIGINT)
        watch.communicate(timeout=PATIENCE)
        self.assertEqual(watch.returncode, 0)
        self.assertLess(pictures[0]["running_s"], pictures[-1]["running_s"])

    def get(self, url, token=None):
        request = urllib.request.Request(url, headers={"Authorization": "Bearer " + token} if token else {})
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()

    def test_serves_metrics(self):
        port = free_port()
        bridge = self.start("--console", f"127.0.0.1:{port}")
        log_until(bridge.log, f"console: http://127.0.0.1:{port}/\n")
        self.assertEqual(self.get(f"http://127.0.0.1:{port}/readyz"), (200, "ready\n"))
        self.assertEqual(self.get(f"http://127.0.0.1:{port}/healthz"), (200, "ok\n"))
        status, text = self.get(f"http://127.0.0.1:{port}/metrics")
        self.assertEqual(status, 200)
        self.assertRegex(text, r'trestle_route_cause\{route="/out",.*cause="no_participant"\} 1\n')
        bridge.send_signal(signal.SIGHUP)  # everything begins anew, also this
        log_until(bridge.log, "Ctrl-C stops", times=2)
        self.assertEqual(self.get(f"http://127.0.0.1:{port}/healthz"), (200, "ok\n"))

    def test_says_that_the_port_is_taken(self):
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            port = other.getsockname()[1]
            bridge = self.start("--console", f"127.0.0.1:{port}", ready="")
            self.assertEqual(bridge.wait(PATIENCE), 1)
        log_until(bridge.log, f"console: cannot listen at 127.0.0.1:{port}: ")

    def test_is_open_to_other_hosts_with_a_token_only(self):
        port = free_port()
        bridge = self.start("--console", f"0.0.0.0:{port}", ready="")
        self.assertEqual(bridge.wait(PATIENCE), 1)
        bridge.log.seek(0)
        self.assertIn("console: 0.0.0.0 is reached from other hosts: `token_file` is needed", bridge.log.read())
        token = "a token that nobody guesses"
        with open(os.path.join(self.folder.name, "token"), "w", encoding="utf-8") as file:
            file.write(token + "\n")
        self.start(more=f"console: {{address: 0.0.0.0:{port}, token_file: token}}\n")
        self.assertEqual(self.get(f"http://127.0.0.1:{port}/metrics")[0], 401)
        self.assertEqual(self.get(f"http://127.0.0.1:{port}/metrics", token)[0], 200)

    def test_refuses_an_address_that_is_none(self):
        done = subprocess.run([TRESTLE, "bridge", "--console", "host:1", "x.yaml"], capture_output=True, text=True,
                              timeout=PATIENCE)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--console: expected an address of this host and a port", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
