#!/usr/bin/env python3
"""ipv6_test.py NODE_PEER: two Nodes of ours over IPv6, as tshark sees them."""
import sys
import time
import unittest

import peer

program = sys.argv.pop(1)
SERVER, CLIENT, GROUP, EVENTS = "fd77::1", "fd77::2", "ff05::4:c0", "ff05::4:c1"


class Ipv6(peer.Recorded, unittest.TestCase):
    ours = (SERVER, CLIENT)

    def setUp(self):
        self.server = peer.Node(program, SERVER, GROUP)
        self.client = peer.Node(program, CLIENT, GROUP, here=True)
        self.server.do("offer", peer.SERVICE, peer.INSTANCE, "both", EVENTS)
        self.client.ask("require", peer.SERVICE, peer.INSTANCE, 1,
                        answer=r"available 1234\.5678 v1\.0 udp \[fd77::1\]:\d+ tcp \[fd77::1\]:\d+")

    def tearDown(self):
        self.client.stop()
        self.server.stop()

    def test_calls(self):
        for transport in "udp", "tcp":
            for payload in "cafe", "ab" * 1000, "cd" * 100_000:
                self.client.ask("call", 0x0001, transport, payload, answer=f"response 0001 {payload}$")
            self.client.ask("call", 0x0003, transport, "00", answer="failed 0003 error 04$")
            self.client.ask("send", 0x0002, transport, "11", answer="sent")
            self.server.expect("request 0002 11")

    def events(self, group, event, transport):
        self.client.do("subscribe", peer.SERVICE, peer.INSTANCE, 1, group, event, transport)
        for _ in range(3000):  # a client opens the group of multicast events some time after it has been served
            self.server.ask("notify", event, "0102", answer=r"notified \d")
            if self.client.lines:
                break
            time.sleep(0.02)
        self.client.expect(f"event {event:04x} session .+ 0102 from ")
        for payload in "03", "ef" * 50_000:
            self.server.ask("notify", event, payload, answer="notified 1")
            self.client.expect(f"event {event:04x} session .+ {payload} from ")
        self.client.do("unsubscribe")

    def test_events_by_udp(self):
        self.events(1, 0x8001, "udp")

    def test_events_by_tcp(self):
        self.events(2, 0x8002, "tcp")

    def test_events_by_multicast(self):
        self.events(4, 0x8004, "udp")

    def test_a_field(self):
        self.client.do("subscribe", peer.SERVICE, peer.INSTANCE, 1, 3, 0x8010, "udp")
        self.client.expect("event 8010 session .+ 01020304 from ")
        self.client.ask("call", 0x0011, "udp", "05060708", answer="response 0011 05060708$")
        self.client.expect("event 8010 session .+ 05060708 from ")
        self.client.ask("call", 0x0010, "tcp", "", answer="response 0010 05060708$")

    def test_an_offer_is_withdrawn(self):
        self.server.do("withdraw")
        self.client.expect("lost 1234.5678")


if __name__ == "__main__":
    unittest.main()
