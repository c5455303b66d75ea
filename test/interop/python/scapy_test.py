#!/usr/bin/env python3
"""scapy_test.py NODE_PEER: our Node beside a peer that scapy builds message by message: SOME/IP-TP both ways, and
frames that no stack would send."""
import os
import socket
import struct
import sys
import time
import unittest

import peer

try:
    import logging
    logging.getLogger("scapy.runtime").setLevel(logging.ERROR)
    from scapy.contrib.automotive.someip import (SD, SOMEIP, SDEntry_EventGroup, SDEntry_Service, SDOption_Config,
                                                 SDOption_IP4_EndPoint, SDOption_IP4_Multicast)
    from scapy.packet import Raw
    sys.path.append(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    from scapy_fields import method_fields, offset_of, slice_of, tp_fields
except ImportError:
    peer.missing("scapy")

program = sys.argv.pop(1)
PATIENCE = 60  # seconds; running into it is a failure
SEGMENT = 1392
TTL = 600  # of what is offered and subscribed to, in seconds: nothing expires that is only late
EVENTS = ("224.225.226.233", 32344)  # where events go by multicast


def message(method, payload=b"", kind=SOMEIP.TYPE_REQUEST, session=1, version=1, client=0x0c0c, **more):
    return bytes(SOMEIP(srv_id=peer.SERVICE, client_id=client, session_id=session, iface_ver=version, msg_type=kind,
                        **method_fields(method), **more) / Raw(payload))


def segments(method, payload, kind, **header):
    """The TP segments of a message, in order."""
    result = []
    for offset in range(0, len(payload), SEGMENT):
        last = offset + SEGMENT >= len(payload)
        result.append(message(method, payload[offset:offset + SEGMENT], kind, **tp_fields(offset, not last),
                              **header))
    return result


class Peer:
    """SD on its port and one UDP port for all else."""

    def __init__(self):
        self.discovery = self.open(peer.SD_PORT)
        self.unicast = self.open(0)
        self.group = self.open_group(peer.GROUP, peer.SD_PORT)
        self.sessions = {}

    @staticmethod
    def open(port):
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
        sock.bind((peer.THEIRS, port))
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(peer.THEIRS))
        sock.settimeout(PATIENCE)
        return sock

    @staticmethod
    def open_group(group, port):
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sock.bind((group, port))
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + socket.inet_aton(peer.THEIRS))
        sock.settimeout(PATIENCE)
        return sock

    def close(self):
        for sock in (self.discovery, self.unicast, self.group):
            sock.close()

    @property
    def port(self):
        return self.unicast.getsockname()[1]

    def endpoint(self):
        return SDOption_IP4_EndPoint(addr=peer.THEIRS, l4_proto=0x11, port=self.port)

    def say(self, entries, options=(), to=peer.OURS, flags=0xc0):
        sd = SD(flags=flags)
        sd.set_entryArray(list(entries))
        sd.set_optionArray(list(options))
        self.sessions[to] = self.sessions.get(to, 0) + 1
        header = SOMEIP(srv_id=0xffff, client_id=0, session_id=self.sessions[to], iface_ver=1,
                        msg_type=SOMEIP.TYPE_NOTIFICATION, **method_fields(0x8100))
        self.discovery.sendto(bytes(header / Raw(bytes(sd))), (to, peer.SD_PORT))

    def heard(self, sock, wanted, seconds=PATIENCE):
        """The first SD entry that arrives there and that `wanted` likes, with its message."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            data, address = sock.recvfrom(65536)
            if address[0] != peer.OURS:
                continue
            sd = SD(data[16:])
            for entry in sd.entry_array:
                if wanted(entry):
                    return entry, sd
        raise AssertionError("not heard")

    def find_us(self):
        """The port of our service."""
        self.say([SDEntry_Service(type=0, srv_id=peer.SERVICE, inst_id=0xffff, major_ver=0xff, ttl=3, minor_ver=0xffffffff)],
                 to=peer.GROUP)
        _, sd = self.heard(self.discovery, lambda entry: entry.type == 1)
        return sd.option_array[0].port

    def subscribe(self, eventgroup):
        self.say([SDEntry_EventGroup(type=6, n_opt_1=1, srv_id=peer.SERVICE, inst_id=peer.INSTANCE, major_ver=1, ttl=TTL,
                                     eventgroup_id=eventgroup)], [self.endpoint()])

    def send_apart(self, parts, to):
        """Many segments, as fast as a sender with a separation time would."""
        for number, part in enumerate(parts):
            self.unicast.sendto(part, to)
            if number % 32 == 0:
                time.sleep(0.002)

    def receive_whole(self):
        """A message of our Node, put together if it comes in segments: type, payload, and each segment's size."""
        parts, sizes = {}, []
        while True:
            data = self.unicast.recv(65536)
            received = SOMEIP(data)
            if not received.msg_type & 0x20:
                return received.msg_type, data[16:], sizes
            body = slice_of(received)
            parts[offset_of(received)] = body
            sizes.append(len(body))
            if not received.more_seg:
                whole = b"".join(parts[offset] for offset in sorted(parts))
                if len(whole) == offset_of(received) + len(body):
                    return received.msg_type & ~0x20, whole, sizes


class Scapy(peer.Recorded, unittest.TestCase):
    @classmethod
    def tearDownClass(cls):
        cls.recorder.stop()
        # The judge is awake: it has something to say about the odd frames that we get.
        said = cls.recorder.expert(peer.THEIRS)
        assert said != []
        super().tearDownClass()

    def setUp(self):
        self.node = peer.Node(program)
        self.addCleanup(self.node.stop)
        self.peer = Peer()
        self.addCleanup(self.peer.close)

    def serve(self, *group):
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, "udp", *group)
        self.peer.heard(self.peer.group, lambda entry: entry.type == 1)
        self.server = (peer.OURS, self.peer.find_us())

    def ask(self, datagram):
        self.peer.unicast.sendto(datagram, self.server)
        return self.peer.receive_whole()

    def silent(self, datagram, seconds=0.2):
        self.peer.unicast.sendto(datagram, self.server)
        self.peer.unicast.settimeout(seconds)
        with self.assertRaises(TimeoutError):
            print(self.peer.unicast.recv(65536).hex())
        self.peer.unicast.settimeout(PATIENCE)

    def test_requests_and_responses_in_segments(self):
        self.serve()
        payload = os.urandom(20_000)
        request = segments(0x0001, payload, SOMEIP.TYPE_TP_REQUEST)
        for order in (request, request[::-1], request[1:] + request[:1], [part for part in request for _ in (0, 1)]):
            # Another Session ID each time: the same one again would be a straggler.
            self.session = getattr(self, "session", 0) + 1
            order = [part[:10] + struct.pack(">H", self.session) + part[12:] for part in order]
            for part in order:
                self.peer.unicast.sendto(part, self.server)
            kind, answer, sizes = self.peer.receive_whole()
            self.assertEqual((kind, answer), (SOMEIP.TYPE_RESPONSE, payload))
            self.assertTrue(all(size == SEGMENT for size in sizes[:-1]), sizes)
        payload = os.urandom(1 << 20)
        self.peer.send_apart(segments(0x0001, payload, SOMEIP.TYPE_TP_REQUEST, session=50), self.server)
        self.assertEqual(self.peer.receive_whole()[:2], (SOMEIP.TYPE_RESPONSE, payload))
        kind, answer, sizes = self.ask(message(0x0004, struct.pack(">I", 1 << 20), session=99))
        self.assertEqual((kind, answer), (SOMEIP.TYPE_RESPONSE, b"\x5a" * (1 << 20)))

    def test_events_in_segments(self):
        self.serve()
        self.peer.subscribe(1)
        self.peer.heard(self.peer.discovery, lambda entry: entry.type == 7 and entry.ttl == TTL)
        payload = os.urandom(1 << 20)
        self.node.do("notify", 0x8001, payload.hex())
        self.assertEqual(self.peer.receive_whole()[:2], (SOMEIP.TYPE_NOTIFICATION, payload))

    def test_events_by_multicast(self):
        self.serve(EVENTS[0])
        self.peer.subscribe(4)
        entry, sd = self.peer.heard(self.peer.discovery, lambda entry: entry.type == 7)
        option = sd.option_array[entry.index_1]
        self.assertEqual((entry.ttl, entry.n_opt_1, option.type, option.addr, option.l4_proto, option.port),
                         (TTL, 1, 0x14, EVENTS[0], 0x11, EVENTS[1]))
        with self.peer.open_group(*EVENTS) as events:
            self.node.ask("notify", 0x8004, "cafe", answer="notified 1")
            data, address = events.recvfrom(65536)
            self.assertEqual((data[16:], address), (b"\xca\xfe", self.server))

    def test_its_events_by_multicast(self):
        self.accept_subscription(4, 0x8004, [SDOption_IP4_Multicast(addr=EVENTS[0], l4_proto=0x11, port=EVENTS[1])])
        for _ in range(3000):  # our Node opens the group some time after it has been told of it
            self.peer.unicast.sendto(message(0x8004, b"\x17", SOMEIP.TYPE_NOTIFICATION, client=0), EVENTS)
            time.sleep(0.02)
            if self.node.lines:
                break
        self.node.expect(f"event 8004 session 1 17 from {peer.THEIRS}:{self.peer.port}$")

    def accept_subscription(self, eventgroup, event, options=()):
        """Has our Node subscribe to our service, and tells where it wants the events."""
        self.node.do("subscribe", peer.SERVICE, peer.INSTANCE, 1, eventgroup, event, "udp")
        self.offer()
        entry, sd = self.peer.heard(self.peer.discovery, lambda entry: entry.type == 6)
        self.peer.say([SDEntry_EventGroup(type=7, n_opt_1=len(options), srv_id=entry.srv_id, inst_id=entry.inst_id,
                                          major_ver=1, ttl=entry.ttl, eventgroup_id=entry.eventgroup_id)], options)
        return (peer.OURS, sd.option_array[entry.index_1].port)

    def test_its_events_in_segments(self):
        to = self.accept_subscription(1, 0x8001)
        payload = os.urandom(1 << 20)
        self.peer.send_apart(segments(0x8001, payload, SOMEIP.TYPE_TP_NOTIFICATION, client=0), to)
        self.node.expect(f"event 8001 session 1 {payload.hex()} ")
        payload = os.urandom(30_000)
        # One lost: nothing arrives, and the next is whole again.
        lost = segments(0x8001, payload, SOMEIP.TYPE_TP_NOTIFICATION, client=0, session=2)
        for part in lost[:3] + lost[4:]:
            self.peer.unicast.sendto(part, to)
        for part in segments(0x8001, b"\x01" * 3000, SOMEIP.TYPE_TP_NOTIFICATION, client=0, session=3):
            self.peer.unicast.sendto(part, to)
        self.node.expect(f"event 8001 session (.) {'01' * 3000} ")

    def test_its_answers_in_segments(self):
        self.node.do("require", peer.SERVICE, peer.INSTANCE, 1)
        self.peer.heard(self.peer.group, lambda entry: entry.type == 0 and entry.srv_id == peer.SERVICE)
        self.offer()
        self.node.expect("available")
        payload = os.urandom(1 << 20)
        answer = segments(0x0001, payload, SOMEIP.TYPE_TP_RESPONSE)  # takes its time, which a call has not
        self.node.do("call", 0x0001, "udp", "cafe")
        request, client = self.peer.unicast.recvfrom(65536)
        self.assertEqual(request[16:], b"\xca\xfe")
        self.peer.send_apart([part[:8] + request[8:12] + part[12:] for part in answer], client)
        self.node.expect(f"response 0001 {payload.hex()}$")

    def offer(self, **more):
        self.peer.say([SDEntry_Service(type=1, n_opt_1=1, srv_id=peer.SERVICE, inst_id=peer.INSTANCE, major_ver=1, ttl=TTL,
                                       minor_ver=0)], [self.peer.endpoint()], to=peer.GROUP, **more)

    def test_odd_requests(self):
        self.serve()
        for what, datagram, code in (
                ("an unknown method", message(0x0777), 0x03),
                ("another interface version", message(0x0001, version=9), 0x08),
                ("another protocol version", message(0x0001, proto_ver=2), 0x07)):
            self.peer.unicast.sendto(datagram, self.server)
            answer = SOMEIP(self.peer.unicast.recv(65536))
            self.assertEqual((answer.msg_type, answer.retcode, bytes(answer.payload)), (SOMEIP.TYPE_RESPONSE, code, b""), what)
        good = message(0x0001, b"\x01\x02")
        for what, datagram in (
                ("fire and forget of an unknown method", message(0x0777, kind=SOMEIP.TYPE_REQUEST_NO_RET)),
                ("a notification", message(0x8001, kind=SOMEIP.TYPE_NOTIFICATION)),
                ("a response to nothing", message(0x0001, kind=SOMEIP.TYPE_RESPONSE)),
                ("an error", message(0x0001, kind=SOMEIP.TYPE_ERROR, retcode=1)),
                ("a type that does not exist, to an unknown method", message(0x0777, kind=0x55)),
                ("a Length beyond the datagram", good[:7] + b"\xff" + good[8:]),
                ("a Length below 8", good[:7] + b"\x07" + good[8:]),
                ("half a header", good[:9]),
                ("nothing", b""),
                ("the end of a message whose beginning is missing",
                 message(0x0001, b"\x01" * 16, SOMEIP.TYPE_TP_REQUEST, session=77, **tp_fields(160, False)))):
            with self.subTest(what):
                self.silent(datagram, 0.05)
        # Several messages in one datagram, and it has not gone mad.
        self.peer.unicast.sendto(good + message(0x0001, b"\x03", session=2), self.server)
        self.assertEqual({self.peer.unicast.recv(65536)[16:] for _ in range(2)}, {b"\x01\x02", b"\x03"})

    def test_odd_subscriptions(self):
        self.serve()

        def answer():
            return self.peer.heard(self.peer.discovery, lambda entry: entry.type == 7)[0]
        for what, entry, options, ttl in (
                ("an unknown eventgroup", {"eventgroup_id": 0x99}, [self.peer.endpoint()], 0),
                ("another major version", {"major_ver": 9}, [self.peer.endpoint()], 0),
                ("no endpoint", {"n_opt_1": 0}, [], 0),
                ("an option that is not there", {"index_1": 7}, [self.peer.endpoint()], 0),
                ("port 0", {}, [SDOption_IP4_EndPoint(addr=peer.THEIRS, l4_proto=0x11, port=0)], 0),
                ("TCP without a connection", {}, [SDOption_IP4_EndPoint(addr=peer.THEIRS, l4_proto=0x06, port=4711)], 0),
                ("two endpoints that differ", {"n_opt_1": 2},
                 [self.peer.endpoint(), SDOption_IP4_EndPoint(addr=peer.THEIRS, l4_proto=0x11, port=9)], 0),
                ("a configuration option too", {"n_opt_1": 2},
                 [SDOption_Config(cfg_str=b"\x03a=b\x00"), self.peer.endpoint()], 3),
                ("the same endpoint in both runs", {"n_opt_2": 1}, [self.peer.endpoint()], 3),
                ("a counter", {"cnt": 9}, [self.peer.endpoint()], 3)):
            with self.subTest(what):
                fields = {"type": 6, "n_opt_1": 1, "srv_id": peer.SERVICE, "inst_id": peer.INSTANCE, "major_ver": 1,
                          "ttl": 3, "eventgroup_id": 1, **entry}
                self.peer.say([SDEntry_EventGroup(**fields)], options)
                got = answer()
                self.assertEqual((got.ttl, got.eventgroup_id, got.major_ver, got.cnt),
                                 (ttl, fields["eventgroup_id"], fields["major_ver"], fields.get("cnt", 0)))

    # TCP.

    def connect(self):
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, "tcp")
        self.peer.heard(self.peer.group, lambda entry: entry.type == 1)
        return self.open_stream(self.peer.find_us())

    def open_stream(self, port):
        stream = socket.create_connection((peer.OURS, port), PATIENCE, (peer.THEIRS, 0))
        self.addCleanup(stream.close)
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return stream

    def read(self, stream):
        """The next message of a stream: its type, return code, session and payload."""
        def take(size):
            data = b""
            while len(data) < size:
                part = stream.recv(size - len(data))
                if not part:
                    raise ConnectionError("closed")
                data += part
            return data
        head = take(16)
        header = SOMEIP(head)
        return header.msg_type, header.retcode, header.session_id, take(header.len - 8)

    def test_messages_in_odd_pieces_of_a_stream(self):
        stream = self.connect()
        payloads = [bytes([number]) * (number * 37) for number in range(1, 20)]
        requests = b"".join(message(0x0001, payload, session=number) for number, payload in enumerate(payloads, 1))
        for size in (1, 7, 16, 1000, len(requests)):
            for begin in range(0, len(requests), size):
                stream.sendall(requests[begin:begin + size])
            for number, payload in enumerate(payloads, 1):
                self.assertEqual(self.read(stream), (SOMEIP.TYPE_RESPONSE, 0, number, payload))
        payload = os.urandom(1 << 20)
        stream.sendall(message(0x0001, payload, session=7))
        self.assertEqual(self.read(stream), (SOMEIP.TYPE_RESPONSE, 0, 7, payload))

    def test_magic_cookies_bring_a_stream_into_step_again(self):
        stream = self.connect()
        cookie = bytes.fromhex("ffff000000000008deadbeef01010100")
        stream.sendall(cookie + message(0x0001, b"\x01"))
        self.assertEqual(self.read(stream)[3], b"\x01")
        # A Length that cannot be: all up to the next cookie is passed over.
        broken = message(0x0001, b"\x02")
        stream.sendall(broken[:4] + struct.pack(">I", 3) + broken[8:] + b"rubbish" + cookie + message(0x0001, b"\x03"))
        self.assertEqual(self.read(stream)[3], b"\x03")

    def test_a_broken_stream_is_closed_and_others_go_on(self):
        stream = self.connect()
        other = self.open_stream(stream.getpeername()[1])
        broken = message(0x0001, b"\x02")
        stream.sendall(broken[:4] + struct.pack(">I", 3) + broken[8:])
        with self.assertRaises(ConnectionError):
            self.read(stream)
        other.sendall(message(0x0001, b"\x04") + message(0x0777))
        self.assertEqual(self.read(other), (SOMEIP.TYPE_RESPONSE, 0, 1, b"\x04"))
        self.assertEqual(self.read(other)[:2], (SOMEIP.TYPE_RESPONSE, 3))

    def test_events_of_a_stream_and_their_end(self):
        stream = self.connect()
        endpoint = SDOption_IP4_EndPoint(addr=peer.THEIRS, l4_proto=0x06, port=stream.getsockname()[1])
        self.peer.say([SDEntry_EventGroup(type=6, n_opt_1=1, srv_id=peer.SERVICE, inst_id=peer.INSTANCE, major_ver=1, ttl=TTL,
                                          eventgroup_id=2)], [endpoint])
        self.assertEqual(self.peer.heard(self.peer.discovery, lambda entry: entry.type == 7)[0].ttl, TTL)
        self.node.ask("notify", 0x8002, "0a" * 5000, answer="notified 1")
        self.assertEqual(self.read(stream), (SOMEIP.TYPE_NOTIFICATION, 0, 1, b"\x0a" * 5000))
        stream.close()
        for _ in range(3000):
            if self.node.ask("notify", 0x8002, "0b", answer=r"notified (\d)")[1] == "0":
                return
            time.sleep(0.02)
        self.fail("a subscription outlives its connection")

    def test_we_connect_again_when_the_server_closes(self):
        with socket.create_server((peer.THEIRS, 0)) as server:
            offer = SDEntry_Service(type=1, n_opt_1=1, srv_id=peer.SERVICE, inst_id=peer.INSTANCE, major_ver=1, ttl=TTL,
                                    minor_ver=0)
            endpoint = SDOption_IP4_EndPoint(addr=peer.THEIRS, l4_proto=0x06, port=server.getsockname()[1])
            self.node.do("require", peer.SERVICE, peer.INSTANCE, 1)
            time.sleep(0.1)
            self.peer.say([offer], [endpoint], to=peer.GROUP)
            self.node.expect("available")
            for number in (1, 2):
                stream = self.called(server)
                self.assertEqual(self.read(stream)[3], b"\x55", f"connection {number}")
                stream.close()

    def called(self, server):
        """The connection that a call of our Node makes: some may come before there is one."""
        server.settimeout(0.05)
        for _ in range(3000):
            self.node.do("call", 0x0001, "tcp", "55")
            try:
                stream, _ = server.accept()
            except TimeoutError:
                continue
            stream.settimeout(PATIENCE)
            self.node.do("call", 0x0001, "tcp", "55")
            return stream
        raise AssertionError("it does not connect")

    def test_broken_discovery_is_counted_and_dropped(self):
        self.serve()
        entries = bytes(SDEntry_Service(type=0, srv_id=peer.SERVICE, inst_id=0xffff, major_ver=0xff, ttl=3,
                                        minor_ver=0xffffffff))
        for body in (b"\xc0\0\0\0" + struct.pack(">I", 15) + entries + b"\0\0\0\0",
                     b"\xc0\0\0\0" + struct.pack(">I", 0x7fffffff) + entries + b"\0\0\0\0",
                     b"\xc0\0\0\0" + struct.pack(">I", 16) + entries + struct.pack(">I", 999)):
            header = SOMEIP(srv_id=0xffff, client_id=0, session_id=5, iface_ver=1,
                            msg_type=SOMEIP.TYPE_NOTIFICATION, **method_fields(0x8100))
            self.peer.discovery.sendto(bytes(header / Raw(body)), (peer.OURS, peer.SD_PORT))
        for _ in range(3000):
            told = self.node.ask("counters", answer=r"counters malformed (\d+) sd-malformed (\d+) ")
            if told[2] == "3":
                break
            time.sleep(0.02)
        self.assertEqual((told[1], told[2]), ("0", "3"))
        self.peer.find_us()


if __name__ == "__main__":
    unittest.main()
