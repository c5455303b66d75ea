#!/usr/bin/env python3
"""someipy_test.py NODE_PEER: our Node and someipy, each in both roles, over UDP and TCP, on loopback addresses."""
import asyncio
import json
import logging
import os
import subprocess
import sys
import tempfile
import time
import unittest

import peer

try:
    import someipy
    from someipy import (Event, EventGroup, MessageType, Method, MethodResult, ReturnCode, ServiceBuilder,
                         TransportLayerProtocol, connect_to_someipy_daemon)
except ImportError:
    peer.missing("someipy")

program = sys.argv.pop(1)
OURS, THEIRS = "127.61.3.1", "127.61.3.2"
UDP, TCP = TransportLayerProtocol.UDP, TransportLayerProtocol.TCP
logging.disable(logging.CRITICAL)


def description(handler=None, transport=TCP):
    return (ServiceBuilder().with_service_id(peer.SERVICE).with_major_version(1).with_minor_version(0)
            .with_method(Method(0x0001, transport, handler)).with_method(Method(0x0003, transport, handler))
            .with_eventgroup(EventGroup(1, [Event(0x8001, UDP)])).with_eventgroup(EventGroup(2, [Event(0x8002, TCP)]))
            .build())


def udp_description(handler=None):
    return (ServiceBuilder().with_service_id(peer.SERVICE).with_major_version(1).with_minor_version(0)
            .with_method(Method(0x0001, UDP, handler)).with_eventgroup(EventGroup(1, [Event(0x8001, UDP)])).build())


def tcp_description(handler=None):
    return (ServiceBuilder().with_service_id(peer.SERVICE).with_major_version(1).with_minor_version(0)
            .with_method(Method(0x0001, TCP, handler)).with_eventgroup(EventGroup(2, [Event(0x8002, TCP)])).build())


def echo(payload, address):
    result = MethodResult()
    result.message_type = MessageType.RESPONSE
    result.return_code = ReturnCode.E_OK
    result.payload = payload
    return result


class Someipy(unittest.IsolatedAsyncioTestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.recorder = peer.Recorder(os.path.join(cls.folder.name, "recorded.pcapng"))

    @classmethod
    def tearDownClass(cls):
        complaints = cls.recorder.complaints(OURS)
        cls.folder.cleanup()
        assert complaints == [], complaints

    async def asyncSetUp(self):
        socket_path = os.path.join(self.folder.name, "someipyd.sock")
        config = os.path.join(self.folder.name, "config.json")
        with open(config, "w") as file:
            json.dump({"sd_address": peer.GROUP, "sd_port": peer.SD_PORT, "interface": THEIRS,
                       "socket_path": socket_path, "log_level": "DEBUG"}, file)
        self.process = subprocess.Popen([sys.executable, "-m", "someipy.someipyd", "--config", config],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(200):
            if os.path.exists(socket_path):
                break
            await asyncio.sleep(0.02)
        self.daemon = await connect_to_someipy_daemon({"socket_path": socket_path})
        self.node = peer.Node(program, OURS)

    async def asyncTearDown(self):
        await asyncio.to_thread(self.node.stop)
        await self.daemon.disconnect_from_daemon()
        self.process.terminate()
        self.process.wait(5)
        try:
            os.unlink(os.path.join(self.folder.name, "someipyd.sock"))
        except FileNotFoundError:
            pass

    async def ask(self, *words, answer):
        return await asyncio.to_thread(self.node.ask, *words, answer=answer)

    async def expect(self, pattern, seconds=5):
        return await asyncio.to_thread(self.node.expect, pattern, seconds)

    async def serve(self, description):
        server = someipy.ServerServiceInstance(self.daemon, description, peer.INSTANCE, THEIRS, 30511, ttl=3,
                                               cyclic_offer_delay_ms=500)
        await server.start_offer()
        return server

    async def client(self, description):
        client = someipy.ClientServiceInstance(self.daemon, description, peer.INSTANCE, THEIRS, 30512, client_id=0x0505)
        for _ in range(300):
            if await client.is_available():
                return client
            await asyncio.sleep(0.01)
        raise AssertionError("it does not find our service")

    async def test_we_call_its_methods_over_udp_and_tcp(self):
        for transport, description in (("udp", udp_description), ("tcp", tcp_description)):
            with self.subTest(transport):
                server = await self.serve(description(echo))
                await self.ask("require", peer.SERVICE, peer.INSTANCE, 1, answer=f"available 1234.5678 v1.0 {transport} ")
                await self.ask("call", 0x0001, transport, "cafe", answer="response 0001 cafe$")
                await server.stop_offer()
                await self.expect("lost 1234.5678")
                self.node.forget()

    async def test_we_subscribe_to_its_events(self):
        for transport, event, description in (("udp", 0x8001, udp_description), ("tcp", 0x8002, tcp_description)):
            with self.subTest(transport):
                server = await self.serve(description(echo))
                group = event & 0xff
                self.node.do("subscribe", peer.SERVICE, peer.INSTANCE, 1, group, event, transport)
                for _ in range(100):
                    server.send_event(group, event, b"\x01\x02")
                    await asyncio.sleep(0.05)
                    if any(line.startswith("event") for line in self.node.lines):
                        break
                await self.expect(f"event {event:04x} session . 0102 from {THEIRS}")
                self.node.do("unsubscribe")
                await server.stop_offer()
                await asyncio.sleep(0.2)
                self.node.forget()

    async def test_it_calls_our_methods(self):
        for transport, description in (("udp", udp_description), ("tcp", tcp_description)):
            with self.subTest(transport):
                self.node.do("offer", peer.SERVICE, peer.INSTANCE, transport)
                client = await self.client(description())
                result = await client.call_method(0x0001, b"\x01" * 1000)
                self.assertEqual((result.return_code, result.payload), (ReturnCode.E_OK, b"\x01" * 1000))
                self.node.do("withdraw")
                for _ in range(200):
                    if not await client.is_available():
                        break
                    await asyncio.sleep(0.01)

    async def test_it_subscribes_to_our_events(self):
        for transport, event, description in (("udp", 0x8001, udp_description), ("tcp", 0x8002, tcp_description)):
            with self.subTest(transport):
                self.node.do("offer", peer.SERVICE, peer.INSTANCE, transport)
                client = await self.client(description())
                received = []
                client.register_callback(lambda id, payload: received.append((id, payload)))
                client.subscribe_eventgroup(client.service.eventgroups[event & 0xff], 3)
                deadline = time.monotonic() + 5
                while not received and time.monotonic() < deadline:
                    self.node.do("notify", event, "0a0b")
                    await asyncio.sleep(0.05)
                self.assertEqual(received[:1], [(event, b"\x0a\x0b")])
                client.unsubscribe_eventgroup(client.service.eventgroups[event & 0xff])
                self.node.do("withdraw")
                await asyncio.sleep(0.2)


if __name__ == "__main__":
    unittest.main()
