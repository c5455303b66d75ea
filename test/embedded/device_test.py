#!/usr/bin/env python3
"""device_test.py FIRMWARE ETS_FIRMWARE TRESTLE: the firmware of examples/cortex_m, with a sensor and with the Enhanced
Testability Service, on an emulated board, whose Ethernet controller is a tap device of this network namespace, and at its
other end Trestle, pysomeip and ROS 2. Run by in_namespaces.

Skipped (77) where there is no emulator, or no tap device can be made; failed then with TRESTLE_REQUIRE_PEERS=1, or with
one that lists qemu or tap. So are the tests with pysomeip and ROS 2 where `./run setup --peers` has not installed them."""
import contextlib
import json
import os
import pathlib
import queue
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FIRMWARE, ETS_FIRMWARE, TRESTLE = (os.path.abspath(sys.argv.pop(1)) for _ in range(3))
DEVICE, HOST, OTHER_HOST = "10.78.0.2", "10.78.0.1", "10.78.0.3"  # the last two are ours: one stack runs at each
MAC = bytes.fromhex("020000007802")
GROUP, SD_PORT, PORT = "224.244.224.245", 30490, 30509
SERVICE, INSTANCE = 0x6001, 1
PATIENCE = 120  # seconds; running into it is a failure
DIES_WITH_US = ["setpriv", "--pdeathsig", "KILL"]
WANTED = os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")


def is_required(name):
    return "1" in WANTED or name in WANTED


def cannot(name, why):
    print(f"{'failed' if is_required(name) else 'skipped'}: {why}")
    sys.exit(1 if is_required(name) else 77)


def make_network():
    if shutil.which("qemu-system-arm") is None:
        cannot("qemu", "no qemu-system-arm, of the Debian package of that name")
    done = subprocess.run(["ip", "tuntap", "add", "tap0", "mode", "tap"], capture_output=True, text=True)
    if done.returncode != 0:
        cannot("tap", f"no tap device here, /dev/net/tun is not to be had: {done.stderr.strip()}")
    commands = ["link set tap0 up"] + [f"addr add {own}/24 dev tap0" for own in (HOST, OTHER_HOST)]
    for command in [*commands, "route replace 224.0.0.0/4 dev tap0"]:
        subprocess.run(["ip", *command.split()], check=True)


def python_of(name, module):
    """The Python of build/`name` that has `module`."""
    place = os.environ.get("TRESTLE_" + name.upper()) or ROOT / "build" / name
    python = os.path.join(os.path.abspath(place), "bin/python")
    if os.path.exists(python) and subprocess.run([python, "-c", f"import {module}"], capture_output=True).returncode == 0:
        return python
    if is_required(name):
        raise AssertionError(f"no {module} in {place}")
    raise unittest.SkipTest(f"no {module}; ./run setup --peers installs it")


class Program:
    """One that runs beside the test, and its lines."""

    def __init__(self, *command):
        self.process = subprocess.Popen([*DIES_WITH_US, *command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True)
        self.lines = queue.Queue()
        self.seen = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(line.rstrip("\n"))
        self.lines.put(None)

    def expect(self, pattern, patience=PATIENCE):
        """The next line with what the regular expression says."""
        deadline = time.monotonic() + patience
        while True:
            try:
                line = self.lines.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                line = None
            if line is None:
                raise AssertionError(f"no line with '{pattern}' in {self.seen[-20:]}")
            self.seen.append(line)
            found = re.search(pattern, line)
            if found:
                return found

    def all_seen(self):
        """All that it has said so far."""
        while not self.lines.empty():
            self.seen.append(self.lines.get() or "")
        return "\n".join(self.seen)

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        self.process.wait(PATIENCE)
        self.process.stdout.close()


class Board(Program):
    def __init__(self, firmware=FIRMWARE):
        super().__init__("qemu-system-arm", "-M", "mps2-an385", "-kernel", firmware, "-display", "none", "-monitor", "none",
                         "-serial", "none", "-semihosting-config", "enable=on,target=native",
                         "-nic", "tap,ifname=tap0,script=no,downscript=no,model=lan9118")
        self.expect(f"^ready at {DEVICE}:{SD_PORT}")


def with_checksum(message, at):
    """With the internet protocols' checksum at that place, where there are zeros."""
    padded = message + bytes(len(message) % 2)
    total = sum(int.from_bytes(padded[i:i + 2], "big") for i in range(0, len(padded), 2))
    while total > 0xffff:
        total = (total >> 16) + (total & 0xffff)
    return message[:at] + (total ^ 0xffff).to_bytes(2, "big") + message[at + 2:]


def words_of(words, own):
    return [TRESTLE, *(str(word) for word in words), "--address", own]


class Device(unittest.TestCase):
    def setUp(self):
        self.board = Board()
        self.addCleanup(lambda: self.board.stop())

    def trestle(self, *words, own=HOST):
        return subprocess.run(words_of(words, own), capture_output=True, text=True, timeout=PATIENCE)

    def beside(self, *command):
        program = Program(*command)
        self.addCleanup(program.stop)
        return program

    def call(self, method, payload=""):
        done = self.trestle("call", "0x6001.1", method, payload, "--timeout", 60)
        return done.stdout.strip() if done.returncode == 0 else (done.returncode, re.search("E_[A-Z_]+", done.stderr)[0])

    def is_well(self):
        self.assertEqual(self.call(1, "00000002 00000028"), "0000002a")
        self.assertIsNone(self.board.process.poll())
        self.assertNotIn("fault", self.board.all_seen())

    def test_is_found(self):
        done = self.trestle("find", "0x6001", "--count", 1, "--timeout", 60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, rf"^0x6001\.0x0001  1\.0  udp {DEVICE}:{PORT}  by {DEVICE}  ttl 3 s")

    def test_answers_ping(self):
        with socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP) as icmp:
            icmp.settimeout(PATIENCE)
            for size in (0, 1, 56, 1472):
                data = bytes(i & 0xff for i in range(size))
                icmp.sendto(with_checksum(bytes.fromhex("08000000 77770001") + data, 2), (DEVICE, 0))
                answer, sender = icmp.recvfrom(2000)
                self.assertEqual((answer[20:], sender[0]),
                                 (with_checksum(bytes.fromhex("00000000 77770001") + data, 2), DEVICE))

    def test_reports_its_group_to_a_querier(self):
        group = socket.inet_aton(GROUP)
        with socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x0800)) as raw:
            raw.bind(("tap0", 0x0800))
            raw.settimeout(1)
            header = bytes.fromhex("4500001c 00000000 01020000") + socket.inet_aton(HOST) + group
            query = with_checksum(bytes.fromhex("110a0000") + group, 2)  # within a second
            end, ask_again, frame = time.monotonic() + PATIENCE, 0, b""
            while frame[6:12] != MAC or frame[23] != 2:
                self.assertLess(time.monotonic(), end, "no report")
                if time.monotonic() > ask_again:  # what comes while the board has no time for it may be lost
                    ask_again = time.monotonic() + 3
                    raw.send(bytes.fromhex("01005e74e0f5 020000000001 0800") + with_checksum(header, 10) + query)
                with contextlib.suppress(TimeoutError):
                    frame = raw.recv(2000)
        self.assertEqual(frame[:6], bytes.fromhex("01005e74e0f5"))
        self.assertEqual(frame[38:46], bytes.fromhex("16002815e0f4e0f5"))

    def test_answers_calls(self):
        self.assertEqual(self.call(1, "00000002 00000028"), "0000002a")
        self.assertEqual(self.call(1, "ffffffff 00000002"), "00000001")
        self.assertEqual(self.call(1, "0000000200000028ff"), (3, "E_MALFORMED_MESSAGE"))
        self.assertEqual(self.call(1, "00000002"), (3, "E_MALFORMED_MESSAGE"))
        self.assertEqual(self.call(2, "00000002"), (3, "E_UNKNOWN_METHOD"))

    def test_keeps_a_field_and_tells_of_its_changes(self):
        self.assertEqual(self.call(0x10), "00000064")
        other = self.beside(*words_of(["subscribe", "0x6001.1", 3], OTHER_HOST))
        other.expect("^0x8010 00000064$")
        self.assertEqual(self.call(0x11, "00000014"), "00000014")
        other.expect("^0x8010 00000014$")
        self.assertEqual(self.call(0x11, "00000000"), (3, "E_NOT_OK"))
        self.assertEqual(self.call(0x11, "0000"), (3, "E_MALFORMED_MESSAGE"))
        self.assertEqual(self.call(0x10), "00000014")

    def test_sends_its_cyclic_event(self):
        done = self.trestle("subscribe", "0x6001.1", 1, "--count", 20, "--timeout", 60, "--type",
                            "builtin_interfaces/msg/Time", "--json", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        values = [json.loads(line)["values"] for line in done.stdout.splitlines()]
        times = [value["sec"] * 1000 + value["nanosec"] // 1_000_000 for value in values]
        self.assertEqual(len(times), 20)
        pauses = [b - a for a, b in zip(times, times[1:])]
        self.assertGreaterEqual(min(pauses), 100)  # milliseconds, never in a burst
        self.assertLess(sorted(pauses)[len(pauses) // 2], 200, pauses)

    def test_sends_8_kb_in_segments(self):
        done = self.trestle("subscribe", "0x6001.1", 2, "--count", 5, "--timeout", 60, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        scans = [bytes.fromhex(line.removeprefix("0x8002 ")) for line in done.stdout.splitlines()]
        self.assertEqual(len(scans), 5)
        for number, scan in enumerate(scans, int.from_bytes(scans[0][:4], "big")):
            self.assertEqual(scan, number.to_bytes(4, "big") + bytes((7 * i + number) & 0xff for i in range(4, 8192)))

    def test_is_seen_by_who_watches(self):
        other = self.beside(*words_of(["subscribe", "0x6001.1", 1], OTHER_HOST))
        other.expect("^0x8001 ")
        wanted = rf"(?s)0x6001\.0x0001[^\n]*{DEVICE}.*0x8001"
        end = time.monotonic() + PATIENCE
        while True:
            done = self.trestle("watch", "--interface", "tap0", "--for", 3)
            self.assertEqual(done.returncode, 0, done.stderr)
            if re.search(wanted, done.stdout) or time.monotonic() > end:
                break
        self.assertRegex(done.stdout, wanted)

    def test_serves_two_subscribers(self):
        programs = [self.beside(*words_of(["subscribe", "0x6001.1", 2], own)) for own in (HOST, OTHER_HOST)]
        numbers = [[int(program.expect("^0x8002 (.{8})")[1], 16) for _ in range(3)] for program in programs]
        for got in numbers:
            self.assertEqual(got, list(range(got[0], got[0] + 3)))

    def test_is_noticed_when_it_starts_anew(self):
        other = self.beside(*words_of(["subscribe", "0x6001.1", 1], OTHER_HOST))
        time.sleep(2)
        for _ in range(15):
            uptime = other.expect("^0x8001 (.{8})")[1]
        self.assertGreater(int(uptime, 16), 0)
        self.board.process.kill()
        self.board.process.wait()
        self.board.process.stdout.close()
        self.board = Board()
        other.expect("^subscribed to eventgroup 0x0001")
        other.expect("^0x8001 000000[0-9a-f]{2}")
        self.is_well()

    def test_bears_whatever_comes(self):
        draw = random.Random(6)
        other = self.beside(*words_of(["subscribe", "0x6001.1", 1], OTHER_HOST))
        other.expect("^0x8001 ")
        raw = socket.socket(socket.AF_PACKET, socket.SOCK_RAW)
        self.addCleanup(raw.close)
        raw.bind(("tap0", 0))
        raw.setblocking(True)
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(udp.close)
        udp.bind((HOST, 0))
        udp.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(HOST))
        find = bytes.fromhex("ffff8100 00000024 00000001 01010200 c0000000 00000010 00000000 6001ffff ff000003 ffffffff 00000000")
        subscribe = bytes.fromhex("ffff8100 00000030 00000001 01010200 c0000000 00000010 06000010 60010001 01000003 00000001"
                                  "0000000c 00090400 0a4e0001 00119999")
        request = bytes.fromhex("60010001 00000010 00010001 01010000 0000000200000028")
        segment = bytes.fromhex("60010001 00000414 00010001 01012000 00000001") + bytes(1024)
        udp_frame = bytes.fromhex("020000007802 020000000001 0800 45000021 12340000 4011 5496 0a000001 0a000002 9c40772d000dcf5d"
                                  "0102030405")
        for i in range(1500):
            seed = bytearray(draw.choice([find, subscribe, request, segment]))
            for _ in range(draw.randrange(4)):
                seed[draw.randrange(len(seed))] = draw.randrange(256)
            datagram = bytes(seed[:draw.randrange(len(seed) + 1)] if draw.random() < 0.5 else seed)
            udp.sendto(datagram, draw.choice([(DEVICE, SD_PORT), (DEVICE, PORT), (GROUP, SD_PORT), (DEVICE, 9)]))
            frame = bytearray(udp_frame)
            frame[draw.randrange(12, len(frame))] = draw.randrange(256)
            raw.send(bytes(frame[:draw.randrange(14, len(frame) + 1)]) if draw.random() < 0.5 else
                     MAC + draw.randbytes(draw.randrange(8, 1500)))
            if i % 4 == 0:
                time.sleep(0.002)  # what the controller can take
        self.is_well()
        while not other.lines.empty():
            other.lines.get_nowait()
        other.expect("^0x8001 ")

    def test_is_shown_as_a_ros_2_topic(self):
        python = python_of("ros", "rclpy")
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "bridge.yaml")
            file.write_text(f"""\
someip: {{address: {HOST}}}
dds: {{domain: 78}}
routes:
  - {{topic: /device/uptime, type: builtin_interfaces/msg/Time, direction: someip_to_dds, service: 0x6001, instance: 1,
     eventgroup: 1, event: 0x8001}}
""")
            self.beside(TRESTLE, "bridge", str(file))
            node = self.beside(python, "-u", "-c", """
import rclpy
from builtin_interfaces.msg import Time
rclpy.init(domain_id=78)
node = rclpy.create_node("reader")
node.create_subscription(Time, "/device/uptime", lambda m: print("uptime", m.sec, m.nanosec), 10)
rclpy.spin(node)
""")
            times = []
            for _ in range(10):
                found = node.expect(r"^uptime (\d+) (\d+)$")
                times.append(int(found[1]) * 10**9 + int(found[2]))
        self.assertEqual(times, sorted(set(times)))
        self.assertLess(times[-1], 10**9 * 300)

    def test_is_found_and_called_by_pysomeip(self):
        python = python_of("peers", "someip")
        found = self.beside(python, "-u", "-c", f"""
import asyncio, socket
from someip import config, header, sd

class Listener(sd.ClientServiceListener):
    def service_offered(self, service, source):
        print("found", hex(service.service_id), service.instance_id, service.major_version,
              *[f"{{option.address}}:{{option.port}}" for option in service.options_1])
    def service_stopped(self, service, source):
        pass

class Answers(sd.SOMEIPDatagramProtocol):
    def message_received(self, message, address, multicast):
        print("message", hex(message.method_id), message.return_code.name, len(message.payload), message.payload[:8].hex())

async def main():
    unicast, multicast, protocol = await sd.ServiceDiscoveryProtocol.create_endpoints(
        socket.AF_INET, "{HOST}", "{GROUP}", multicast_interface="{HOST}")
    protocol.start()
    protocol.discovery.watch_service(config.Service(0x6001, 1, 1), Listener())
    transport, _ = await Answers.create_unicast_endpoint(local_addr=("{HOST}", 0))
    call, calls = await Answers.create_unicast_endpoint(local_addr=("{HOST}", 0), remote_addr=("{DEVICE}", {PORT}))
    protocol.discovery.find_subscribe_eventgroup(config.Eventgroup(0x6001, 1, 1, 1, protocol=header.L4Protocols.UDP,
        sockname=transport.get_extra_info("sockname")))
    while True:
        calls.send(header.SOMEIPHeader(service_id=0x6001, method_id=1, client_id=7, session_id=9, interface_version=1,
            message_type=header.SOMEIPMessageType.REQUEST, payload=bytes.fromhex("0000000200000028")).build())
        await asyncio.sleep(0.5)

asyncio.run(main())
""")
        found.expect(f"^found 0x6001 1 1 {DEVICE}:{PORT}$")
        found.expect("^message 0x1 E_OK 4 0000002a")
        found.expect("^message 0x8001 E_OK 8 000000")


class Testability(unittest.TestCase):
    """The firmware with the Enhanced Testability Service."""
    PORT = 30501

    def talk(self):
        board = Board(ETS_FIRMWARE)
        self.addCleanup(board.stop)
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(udp.close)
        udp.bind((HOST, 0))
        udp.settimeout(PATIENCE)
        return udp

    def send(self, udp, method, payload, session, message_type=0):
        header = (0x0101).to_bytes(2, "big") + method.to_bytes(2, "big") + (len(payload) + 8).to_bytes(4, "big")
        udp.sendto(header + (0x5a5a).to_bytes(2, "big") + session.to_bytes(2, "big") + bytes([1, 1, message_type, 0]) + payload,
                   (DEVICE, self.PORT))

    def answer(self, udp, session):
        while True:
            message = udp.recv(2000)
            if message[10:12] == session.to_bytes(2, "big"):
                return message

    def conform(self, *selectors):
        """What conform says of each case."""
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, "-B", ROOT / "test/interop/conform/run_stacks.py", TRESTLE, folder, "cortex_m",
                                   "--", *selectors], env={**os.environ, "TRESTLE_FIRMWARE": ETS_FIRMWARE}, capture_output=True,
                                  text=True, cwd=ROOT, timeout=1800)
            self.assertEqual(done.returncode, 0, done.stdout[-4000:] + done.stderr)
            return json.loads(pathlib.Path(folder, "cortex_m/results.json").read_text(encoding="utf-8"))["cases"]

    def test_conforms(self):
        """All that the profile does not say to be missing is judged, and good but for one case, of which docs/stacks.md
        tells the cause. The emulator stops the board while the machine has no time for it, which conform cannot see: a
        fault of the firmware is there each time."""
        cases = self.conform()
        bad = {case["id"]: case["reason"] for case in cases if case["verdict"] in ("fail", "error")}
        bad.pop("tp.order.duplicates", None)
        for _ in range(2):
            if bad:
                again = self.conform(*bad)
                bad = {case["id"]: case["reason"] for case in again if case["verdict"] in ("fail", "error")}
        self.assertEqual(bad, {})
        self.assertEqual({case["reason"] for case in cases if case["verdict"] == "unsupported"}, {
            "the service has no TCP port",
            "no eventgroup with multicast",
            "no eventgroup with a multicast threshold above 1, and a trigger",
            "the profile names no eventgroup over TCP that the device uses",
            "no service with load balancing",
            "no service with a configuration",
            "no event with end-to-end protection (e2e: event)",
            "the profile has no way to stop and start the device",
            "the profile says that Finds are answered by unicast (policy: multicast_find_answers)"})

    def send_large(self, udp, payload, session, copies=1):
        """In segments, with pauses: all at once they may be more than the controller keeps."""
        for at in range(0, len(payload), 1392):
            piece = payload[at:at + 1392]
            last = at + len(piece) == len(payload)
            for _ in range(1 if last else copies):
                self.send(udp, 0x09, (at | (not last)).to_bytes(4, "big") + piece, session, 0x20)
                time.sleep(0.01)

    def large_answers(self, udp, expected):
        """By session, of those that come in segments; `expected` by session, too."""
        echoes = {session: {} for session in expected}
        while any(sum(map(len, echoes[session].values())) < len(payload) for session, payload in expected.items()):
            message = udp.recv(2000)
            if message[2:4] == b"\x00\x09":
                self.assertEqual(message[14:16], bytes.fromhex("a000"))  # a segment of a response
                offset = int.from_bytes(message[16:20], "big") & ~0xf
                echoes[int.from_bytes(message[10:12], "big")][offset] = message[20:]
            else:
                self.assertEqual((message[15], message[16:]), (0, b"\x2a"))
        return {session: b"".join(parts[at] for at in sorted(parts)) for session, parts in echoes.items()}

    def test_takes_segments_that_come_twice(self):
        udp = self.talk()
        payload = (6000).to_bytes(4, "big") + bytes(7 * i & 0xff for i in range(6000))
        self.send_large(udp, payload, 0x77, copies=2)
        self.assertEqual(self.large_answers(udp, {0x77: payload}), {0x77: payload})

    def test_serves_others_while_it_sends_large_answers(self):
        udp = self.talk()
        payloads = {session: (8000).to_bytes(4, "big") + bytes([session]) * 8000 for session in range(1, 4)}
        for session, payload in payloads.items():
            self.send_large(udp, payload, session)
            self.send(udp, 0x08, b"\x2a", 0x99)  # looked at with the answers
        self.assertEqual(self.large_answers(udp, payloads), payloads)

    def test_says_so_when_a_string_is_too_long_for_it(self):
        udp = self.talk()
        for characters, code in ((127, 0), (1, 0), (384, 0), (385, 1)):
            text = bytes.fromhex("feff") + "x".encode("utf-16-be") * characters + bytes(2)
            self.send(udp, 0x16, len(text).to_bytes(4, "big") + text, characters)
            self.assertEqual(self.answer(udp, characters)[15], code, characters)


class Firmware(unittest.TestCase):
    def test_has_no_heap_and_throws_nothing(self):
        for firmware in (FIRMWARE, ETS_FIRMWARE):
            names = subprocess.run(["arm-none-eabi-nm", "-C", firmware], capture_output=True, text=True, check=True).stdout
            self.assertIn(" reset\n", names)
            self.assertEqual(re.findall(r".*\b(?:malloc|_sbrk|free|operator new.*|__cxa_throw|abort)$", names, re.MULTILINE), [])


if __name__ == "__main__":
    make_network()
    unittest.main()
