"""trestle bridge as a program, with a SOME/IP peer that is nothing but sockets and hand-made bytes.

Usage: bridge_command_test.py TRESTLE
"""
import contextlib
import json
import os
import re
import resource
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
from bare_peer import PATIENCE, Peer, entries, receive, someip, ttl
from bridge_program import BRIDGE, DOMAIN, GROUP, HOST, PEER, PID, TTL, head, log_until, offered, write
from socket_buffers import limits_below, limits_told, without_net_admin

TRESTLE = sys.argv.pop(1)

CONFIG = head() + """\
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


class Bridge:
    """The running program."""

    def __init__(self, config):
        self.file = tempfile.NamedTemporaryFile("w", suffix=".yaml")
        self.write(config)
        self.report, write_end = os.pipe()
        self.log = tempfile.TemporaryFile("a+")
        self.process = subprocess.Popen([TRESTLE, "bridge", "--report-fd", str(write_end), self.file.name],
                                        stdout=subprocess.PIPE, stderr=self.log, pass_fds=[write_end], text=True,
                                        preexec_fn=without_net_admin)
        os.close(write_end)
        os.set_blocking(self.process.stdout.fileno(), False)
        self.output = ""

    def counters_until(self, *wanted):
        """Asks for the counters until the output holds all wanted texts; returns what was printed last."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.process.send_signal(signal.SIGUSR1)
            time.sleep(0.1)
            printed = os.read(self.process.stdout.fileno(), 1 << 20).decode() if self.readable() else ""
            if all(text in printed for text in wanted):
                return printed
        raise AssertionError(f"not in the counters: {wanted}\n{printed}")

    def log_so_far(self):
        self.log.seek(0)
        return self.log.read()

    def readable(self):
        return bool(select.select([self.process.stdout], [], [], 0)[0])

    def write(self, config):
        write(self.file.name, config)

    def log_until(self, wanted):
        log_until(self.log, wanted)

    def finish(self):
        self.process.send_signal(signal.SIGINT)
        os.set_blocking(self.process.stdout.fileno(), True)
        out, _ = self.process.communicate(timeout=PATIENCE)
        with os.fdopen(self.report) as report:
            lines = [json.loads(line) for line in report]
        return self.process.returncode, out, self.log_so_far(), lines


def run(config, **environment):
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(config)
        file.flush()
        return subprocess.run([TRESTLE, "bridge", file.name], capture_output=True, text=True, timeout=PATIENCE,
                              env={**os.environ, **environment})


class BridgeCommand(unittest.TestCase):
    def test_starts_nothing_on_a_wrong_configuration(self):
        for wrong, message in [
            (CONFIG.replace("0x2222", "0x22222"), ":17:14: error: service: "),
            (CONFIG.replace("event: 0x8001", "evnt: 0x8001"), "did you mean 'event'?"),
            (CONFIG.replace("geometry_msgs/msg/Point", "geometry_msgs/msg/Pint"), "geometry_msgs/msg/Pint"),
            (CONFIG + "    service: 0x3333\n", "service"),
        ]:
            # If it started, it would run on and run into the time limit.
            done = run(wrong)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(message, done.stderr)
            self.assertEqual(done.stdout, "")

    def test_names_a_variable_that_is_wrong(self):
        done = run(CONFIG.replace(f"domain: {DOMAIN}, ", ""), ROS_DOMAIN_ID="300")
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("error: ROS_DOMAIN_ID in the environment: expected a whole number from 0 to 232, found '300'", done.stderr)

    def test_names_a_port_that_is_taken_and_what_to_do(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as vsomeip does
            other.bind((BRIDGE, 30490))
            done = run(CONFIG)
        self.assertEqual(done.returncode, 1)
        self.assertIn(":2:12: ", done.stderr)
        self.assertIn(f"UDP {BRIDGE}:30490", done.stderr)
        self.assertIn("ss -ulpn", done.stderr)
        self.assertIn("another address", done.stderr)

    def test_says_when_the_counters_cannot_be_written(self):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file, open("/dev/full", "w") as full:
            file.write(CONFIG)
            file.flush()
            process = subprocess.Popen([TRESTLE, "bridge", file.name], stdout=full, stderr=subprocess.PIPE, text=True)
            while "Ctrl-C stops" not in process.stderr.readline():
                self.assertIsNone(process.poll())
            process.send_signal(signal.SIGINT)
            _, log = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 1)
        self.assertIn("cannot write all of the output", log)

    def test_warns_of_shared_memory(self):
        warning = "dds: shared memory is in use: a process on this host that uses it with another build of Fast DDS can end the bridge"
        if "libfastrtps.so.2.9" in subprocess.run(["ldd", TRESTLE], capture_output=True, text=True).stdout:
            warning += "; with this version of Fast DDS one that is killed or stopped at the wrong moment can, too"
        for setting, warns in (("", False), (", shared_memory: false", False), (", shared_memory: true", True)):
            bridge = Bridge(CONFIG.replace("interfaces: [127.0.0.1]", "interfaces: [127.0.0.1]" + setting))
            try:
                bridge.log_until("Ctrl-C stops")
            finally:
                status, _, log, _ = bridge.finish()
            self.assertEqual(status, 0, log)
            self.assertEqual(warning in log, warns, log)

    def test_warns_of_buffers_that_the_system_does_not_grant(self):
        bridge = Bridge(CONFIG.replace("  sd:", "  receive_buffer: 32 MiB\n  send_buffer: 24 MiB\n  sd:"))
        try:
            bridge.log_until("Ctrl-C stops")
        finally:
            status, _, log, _ = bridge.finish()
        self.assertEqual(status, 0, log)
        self.assertEqual(limits_told(log, by="warning SD "), limits_below(32 << 20, 0))
        self.assertEqual(limits_told(log, by="warning DDS "), limits_below(16 << 20, 0))

    def test_names_an_interface_that_is_not_there(self):
        done = run(CONFIG.replace("  sd:", "  interface: nope0\n  sd:"))
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r":3:14: interface: there is no network interface 'nope0'")

    def test_names_the_line_of_what_cannot_be_opened(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind((BRIDGE, 40001))
            done = run(CONFIG)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, rf":6:5: .*UDP {BRIDGE}:40001")
        done = run(CONFIG.replace("127.0.0.1", "192.0.2.77"))
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r":4:\d+: .*192\.0\.2\.77")

    def test_holds_each_route_to_its_own_limit(self):
        config = CONFIG + "    tp: {max_message: 1 KiB}\n"  # the other route has 16 MiB
        peer = Peer(PEER, GROUP)
        bridge = Bridge(config)
        try:
            receive(peer.group, lambda e: e[0] == 1 and e[4:8] == bytes.fromhex("11110001"))  # it is there
            peer.offer(BRIDGE)
            wanted = bytes.fromhex("22220001")
            subscribe, datagram, _ = receive(peer.sd, lambda e: e[0] == 6 and e[4:8] == wanted and ttl(e) > 0)
            to = (BRIDGE, struct.unpack_from(">H", datagram, 24 + 16 * len(entries(datagram)) + 4 + 10)[0])
            peer.ack(BRIDGE, subscribe)
            # What follows a message's last field is ignored: each would be carried were it not for the limit.
            peer.service.sendto(someip(0x2222, 0x8001, bytes(1024)), to)
            peer.service.sendto(someip(0x2222, 0x8001, bytes(1025)), to)
            segments = [struct.pack(">I", 1) + bytes(1392), struct.pack(">I", 1392) + bytes(100)]
            for segment in segments:
                peer.service.sendto(someip(0x2222, 0x8001, segment, session=2, message_type=0x22), to)
            printed = bridge.counters_until("received 3, carried 1,")
            self.assertRegex(printed, "route /in from SOME/IP: received 3, carried 1, bytes 28, readers 0, bridges 0, written 1, subscribed 1; lost: too_large 2\n")
            # Being refused does not fill the log.
            for _ in range(50):
                peer.subscribe(BRIDGE, 0x1111, 0x0077)
            bridge.counters_until("nacks_sent 50")
            time.sleep(1.1)
            peer.subscribe(BRIDGE, 0x1111, 0x0077)
            bridge.counters_until("nacks_sent 51")
        except BaseException:
            bridge.process.kill()
            bridge.process.communicate()
            print(bridge.log_so_far(), file=sys.stderr)
            raise
        finally:
            peer.close()
        status, _, log, _ = bridge.finish()
        self.assertEqual(status, 0)
        refusals = [line for line in log.splitlines() if "refused a subscription" in line]
        self.assertLess(len(refusals), 25)  # one a second, and some to begin with
        self.assertNotIn("others before", refusals[0])
        others = [int(number) for line in refusals for number in re.findall(r"\(and (\d+) others? before\)$", line)]
        self.assertGreater(len(others), 0)
        self.assertEqual(len(refusals) + sum(others), 51)

    def test_reads_the_file_and_the_types_again_on_sighup(self):
        peer = Peer(PEER, GROUP)
        with tempfile.TemporaryDirectory() as types:
            os.makedirs(os.path.join(types, "my_msgs/msg"))

            def define(text):
                with open(os.path.join(types, "my_msgs/msg/Value.msg"), "w", encoding="utf-8") as file:
                    file.write(text)

            define("uint8 value\n")
            config = CONFIG.replace("geometry_msgs/msg/Point", "my_msgs/msg/Value") + f"types: {{paths: [{types}]}}\n"
            bridge = Bridge(config)
            try:
                receive(peer.group, offered(0x1111, True))
                # What is wrong changes nothing.
                bridge.write(config.replace("service: 0x1111", "service: 0x11111"))
                bridge.process.send_signal(signal.SIGHUP)
                bridge.log_until("going on as before")
                self.assertIn("service: expected an id", bridge.log_so_far())
                # Nor does what cannot be carried out.
                with Peer.bound(BRIDGE, 40077):
                    bridge.write(config.replace("port: 40001", "port: 40077"))
                    bridge.process.send_signal(signal.SIGHUP)
                    bridge.log_until("the bridge cannot start with")
                receive(peer.group, offered(0x1111, False))
                receive(peer.group, offered(0x1111, True))
                # What is good takes the place of what was.
                bridge.write(config.replace("service: 0x1111", "service: 0x1112"))
                define("uint32 value\n")
                bridge.process.send_signal(signal.SIGHUP)
                receive(peer.group, offered(0x1111, False))
                receive(peer.group, offered(0x1112, True))
                peer.offer(BRIDGE)
                subscribe, datagram, _ = receive(
                    peer.sd, lambda e: e[0] == 6 and e[4:8] == bytes.fromhex("22220001") and ttl(e) > 0)
                options = datagram[24 + 16 * len(entries(datagram)) + 4:]
                peer.ack(BRIDGE, subscribe)
                to = (BRIDGE, struct.unpack_from(">H", options, 10)[0])
                peer.service.sendto(someip(0x2222, 0x8001, b"\x05"), to)
                peer.service.sendto(someip(0x2222, 0x8001, b"\0\0\0\x05"), to)
                bridge.counters_until("route /in from SOME/IP: received 2, carried 1, bytes 8, ",
                                      "; lost: not_convertible 1")
            except BaseException:
                bridge.process.kill()
                bridge.process.communicate()
                print(bridge.log_so_far(), file=sys.stderr)
                raise
            finally:
                peer.close()
            self.assertEqual(bridge.finish()[0], 0)

    def test_carries_counts_drops_and_withdraws(self):
        peer = Peer(PEER, GROUP)
        bridge = Bridge(CONFIG)
        try:
            # It offers its service by multicast, with the endpoint where that is.
            _, offer, _ = receive(peer.group, lambda e: e[0] == 1 and e[4:8] == bytes.fromhex("11110001") and ttl(e) == TTL)
            self.assertIn(struct.pack(">HBB4sBBH", 9, 4, 0, socket.inet_aton(BRIDGE), 0, 0x11, 40001), offer)

            # It subscribes to what the peer offers, by unicast, with the endpoint where it wants events.
            peer.offer(BRIDGE)
            wanted = bytes.fromhex("22220001")
            subscribe, datagram, _ = receive(peer.sd, lambda e: e[0] == 6 and e[4:8] == wanted and ttl(e) > 0)
            self.assertEqual(subscribe[14:16], b"\0\3")
            options = datagram[24 + 16 * len(entries(datagram)) + 4:]
            self.assertEqual(options[:8], struct.pack(">HBB4s", 9, 4, 0, socket.inet_aton(BRIDGE)))
            to = (BRIDGE, struct.unpack_from(">H", options, 10)[0])
            peer.ack(BRIDGE, subscribe)

            point = struct.pack(">ddd", 1.5, -2.5, 1e300)
            good = someip(0x2222, 0x8001, point)
            peer.service.sendto(good, to)
            bridge.counters_until("route /in from SOME/IP: received 1, carried 1,")

            # Damage: each is dropped under its own name, and does not disturb what follows.
            for cut in range(len(good)):
                peer.service.sendto(good[:cut], to)  # cut anywhere
            for size in (23, 25):
                peer.service.sendto(someip(0x2222, 0x8001, (point + b"\0")[:size]), to)  # one byte less or more
            peer.service.sendto(someip(0x2222, 0x8002, point), to)  # an event nobody asked for
            peer.service.sendto(someip(0x2222, 0x8001, point, interface=2), to)
            segment = struct.pack(">I", 0 | 1) + bytes(15)  # not the last, yet no multiple of 16
            peer.service.sendto(someip(0x2222, 0x8001, segment, message_type=0x22), to)
            huge = struct.pack(">I", 0xFFFFFFF0) + bytes(16)
            peer.service.sendto(someip(0x2222, 0x8001, huge, session=2, message_type=0x22), to)
            with Peer.bound(PEER, 0) as stranger:
                stranger.sendto(good, to)
            peer.service.sendto(good, to)
            printed = bridge.counters_until("carried 3,", "unknown_sender 1", "too_large 1")
            self.assertIn("received 4, carried 3, bytes 84, readers 0, bridges 0, written 1, subscribed 1; lost: unexpected 1, not_convertible 1", printed)  # 4 + 24 bytes each
            self.assertIn(f"malformed {len(good)}, wrong_version 1, unexpected 1, unknown_sender 1", printed)
            self.assertIn("unaligned 1, too_large 1", printed.replace("session_zero 0, ", ""))

            # A call is answered: there are no methods. An answer is not.
            for message_type in (0, 0x80):
                peer.service.sendto(someip(0x1111, 0x0001, b"", message_type=message_type), (BRIDGE, 40001))
            peer.service.settimeout(PATIENCE)
            self.assertEqual(peer.service.recv(1500), struct.pack(">HHIHHBBBB", 0x1111, 1, 8, 0, 1, 1, 1, 0x80, 3))
            bridge.counters_until("unexpected 2", "calls_answered_with_an_error 1")

            # A subscription to what is not offered is refused, and said to be.
            peer.subscribe(BRIDGE, 0x1111, 0x0077)
            receive(peer.sd, lambda e: e[0] == 7 and e[4:8] == bytes.fromhex("11110001") and ttl(e) == 0)
            bridge.counters_until("nacks_sent 1")

            # Events that the server sends by multicast are received too.
            group = (f"239.253.{PID >> 8 & 255}.{PID & 255}", 40777)
            peer.service.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            peer.offer(BRIDGE)
            subscribe, _, _ = receive(peer.sd, lambda e: e[0] == 6 and e[4:8] == wanted and ttl(e) > 0)
            peer.ack(BRIDGE, subscribe, group)
            end = time.monotonic() + PATIENCE
            while f"come at {group[0]}" not in bridge.log_so_far() and time.monotonic() < end:
                time.sleep(0.02)
            peer.service.sendto(good, group)
            bridge.counters_until("carried 4,")

            # Damaged SD messages don't disturb either.
            for cut in range(40):
                peer.sd.sendto(offer[:cut], (BRIDGE, 30490))
            bridge.counters_until("SOME/IP-SD: ", "malformed 40")
            # A peer that starts anew is noticed.
            peer.session = 0
            peer.offer(BRIDGE)
            bridge.counters_until("reboots_detected 1")
        except BaseException:
            bridge.process.kill()
            bridge.process.communicate()
            print(bridge.log_so_far(), file=sys.stderr)
            raise

        status, out, log, lines = bridge.finish()
        self.assertEqual(status, 0, log)
        receive(peer.group, lambda e: e[0] == 1 and e[4:8] == bytes.fromhex("11110001") and ttl(e) == 0)
        receive(peer.sd, lambda e: e[0] == 6 and e[4:8] == wanted and ttl(e) == 0)
        self.assertIn("route /in from SOME/IP: received 5, carried 4", out)
        self.assertIn("calls_answered_with_an_error 1, ", out)
        self.assertIn("datagrams_sent 1, messages_sent 1, ", out)
        self.assertIn(f"refused a subscription of {PEER}", log)
        self.assertIn(f"{PEER} has restarted", log)
        self.assertIn("SD 0x2222.0x0001 version 1.0 is offered at UDP", log)
        self.assertIn("subscribed to eventgroup 0x0003 of 0x2222.0x0001", log)
        self.assertIn("/in: dropped a message that cannot be converted: truncated at byte 16 in z", log)
        carried = [line for line in lines if line["event"] == "carried"]
        self.assertEqual([line["bytes"] for line in carried], [28, 28, 28, 28])
        self.assertEqual({line["route"] for line in carried}, {"/in"})
        self.assertTrue(all(0 < line["before_ns"] <= line["after_ns"] for line in carried))
        self.assertTrue(any(line["event"] == "discovery" and "is offered" in line["text"] for line in lines))
        self.assertTrue(any(line["event"] == "counters" and line["group"] == "SOME/IP-TP" for line in lines))
        peer.close()

    def test_serves_more_connections_than_its_first_limit_of_descriptors_allows(self):
        def few_descriptors():
            resource.setrlimit(resource.RLIMIT_NOFILE, (100, min(4096, resource.getrlimit(resource.RLIMIT_NOFILE)[1])))
        routes = "".join(
            f"  - {{topic: /out{port}, type: std_msgs/msg/String, direction: dds_to_someip, service: {port}, instance: 1,\n"
            f"     eventgroup: 1, event: 0x8001, port: {port}, transport: tcp}}\n" for port in (40001, 40002))
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file, tempfile.TemporaryFile("w+") as log, \
                contextlib.ExitStack() as connections:
            write(file.name, head() + "routes:\n" + routes)
            with subprocess.Popen([TRESTLE, "bridge", file.name], stdout=subprocess.DEVNULL, stderr=log,
                                  preexec_fn=few_descriptors) as bridge:
                try:
                    log_until(log, "Ctrl-C")
                    clients = []
                    for number in range(120):
                        client = connections.enter_context(socket.socket(socket.AF_INET, socket.SOCK_STREAM))
                        client.settimeout(PATIENCE)
                        client.bind((HOST + str(20 + number // 10), 0))
                        client.connect((BRIDGE, 40001 + number % 2))
                        clients.append((client, 40001 + number % 2))
                    for client, service in clients:  # all at once: none has been closed for another
                        client.sendall(someip(service, 5, b"", message_type=0))
                        self.assertEqual(client.recv(100)[14:16], bytes([0x80, 3]), "error: E_UNKNOWN_METHOD")
                finally:
                    bridge.kill()

    def test_writes_only_some_of_many_lines_of_a_kind(self):
        for more in [], ["--quiet"]:
            with self.subTest(more), tempfile.NamedTemporaryFile("w", suffix=".yaml") as file, \
                    tempfile.TemporaryFile("w+") as log, Peer(PEER, GROUP) as peer:
                write(file.name, CONFIG)
                with subprocess.Popen([TRESTLE, "bridge", *more, file.name], stdout=subprocess.DEVNULL, stderr=log) as bridge:
                    try:
                        receive(peer.group, lambda e: e[0] == 0)  # it is there, and looks for the service
                        for _ in range(150):  # each is told of as a warning
                            peer.offer(BRIDGE)
                            entry, *_ = receive(peer.sd, lambda e: e[0] == 6 and ttl(e) != 0)
                            peer.send_sd(BRIDGE, bytes([7, 0, 0, 0]) + entry[4:9] + bytes(3) + entry[12:])
                            peer.offer(BRIDGE, ttl=0)
                        bridge.send_signal(signal.SIGINT)
                        self.assertEqual(bridge.wait(PATIENCE), 0)
                    finally:
                        bridge.kill()
                log.seek(0)
                text = log.read()
                refused = text.count("refused by the server")
                self.assertGreater(refused, 10)
                self.assertLess(refused, 150)
                self.assertRegex(text, r"left out \d+ ")
                self.assertLess(len(text), 64_000)
                (self.assertNotIn if more else self.assertIn)(" info ", text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
