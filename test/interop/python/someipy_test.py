#!/usr/bin/env python3
"""someipy_test.py NODE_PEER: our Node and someipy, each in both roles, over UDP and TCP."""
import asyncio
import contextlib
import json
import logging
import os
import subprocess
import sys
import unittest

import peer

try:
    import someipy
    from someipy import (Event, EventGroup, MessageType, Method, MethodResult, ReturnCode, ServiceBuilder,
                         TransportLayerProtocol, connect_to_someipy_daemon)
except ImportError:
    peer.missing("someipy")

program = sys.argv.pop(1)
UDP, TCP = TransportLayerProtocol.UDP, TransportLayerProtocol.TCP
logging.disable(logging.CRITICAL)


def description(transport, handler=None, methods=True, events=True):
    """A service of one transport: method 1, and event 0x8001 over UDP or 0x8002 over TCP."""
    builder = ServiceBuilder().with_service_id(peer.SERVICE).with_major_version(1).with_minor_version(0)
    protocol, group = (UDP, 1) if transport == "udp" else (TCP, 2)
    if methods:
        builder.with_method(Method(0x0001, protocol, handler))
    if events:
        builder.with_eventgroup(EventGroup(group, [Event(0x8000 | group, protocol)]))
    return builder.build()


def echo(payload, address):
    result = MethodResult()
    result.message_type = MessageType.RESPONSE
    result.return_code = ReturnCode.E_OK
    result.payload = payload
    return result


async def connected(socket_path):
    """To the daemon: its socket is there some time before it listens, for which someipy waits three seconds."""
    for _ in range(20):
        try:
            return await connect_to_someipy_daemon({"socket_path": socket_path})
        except Exception as error:  # of no class of its own
            told = error
    raise AssertionError(told)


class Someipy(peer.Recorded, unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        socket_path = os.path.join(self.folder.name, "someipyd.sock")
        config = os.path.join(self.folder.name, "config.json")
        with open(config, "w") as file:
            json.dump({"sd_address": peer.GROUP, "sd_port": peer.SD_PORT, "interface": peer.THEIRS,
                       "socket_path": socket_path, "log_level": "DEBUG"}, file)
        self.process = subprocess.Popen([sys.executable, "-m", "someipy.someipyd", "--config", config],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(3000):
            if os.path.exists(socket_path):
                break
            await asyncio.sleep(0.02)
        self.daemon = await connected(socket_path)
        self.node = peer.Node(program)

    async def asyncTearDown(self):
        await asyncio.to_thread(self.node.stop)
        with contextlib.suppress(asyncio.TimeoutError):  # after half a second
            await self.daemon.disconnect_from_daemon()
        self.process.terminate()
        self.process.wait(60)
        try:
            os.unlink(os.path.join(self.folder.name, "someipyd.sock"))
        except FileNotFoundError:
            pass

    async def ask(self, *words, answer):
        return await asyncio.to_thread(self.node.ask, *words, answer=answer)

    async def expect(self, pattern, seconds=60):
        return await asyncio.to_thread(self.node.expect, pattern, seconds)

    async def serve(self, description):
        server = someipy.ServerServiceInstance(self.daemon, description, peer.INSTANCE, peer.THEIRS, 30511, ttl=600,
                                               cyclic_offer_delay_ms=500)
        await server.start_offer()
        return server

    async def client(self, description):
        client = someipy.ClientServiceInstance(self.daemon, description, peer.INSTANCE, peer.THEIRS, 30512, client_id=0x0505)
        for _ in range(6000):
            if await client.is_available():
                return client
            await asyncio.sleep(0.01)
        raise AssertionError("it does not find our service")

    async def we_call_its_method(self, transport):
        server = await self.serve(description(transport, echo))
        await self.ask("require", peer.SERVICE, peer.INSTANCE, 1, answer=f"available 1234.5678 v1.0 {transport} ")
        for payload in ("cafe", "ab" * 1000):
            await self.ask("call", 0x0001, transport, payload, answer=f"response 0001 {payload}$")
        await server.stop_offer()
        await self.expect("lost 1234.5678")

    async def test_we_call_its_method_by_udp(self):
        await self.we_call_its_method("udp")

    async def test_we_call_its_method_by_tcp(self):
        await self.we_call_its_method("tcp")

    async def we_subscribe_to_its_event(self, transport, group):
        # Without methods: with some, it fails at every subscription ("unhashable type: 'Method'").
        server = await self.serve(description(transport, methods=False))
        event = 0x8000 | group
        self.node.do("subscribe", peer.SERVICE, peer.INSTANCE, 1, group, event, transport)
        for _ in range(3000):
            server.send_event(group, event, b"\x01\x02")
            await asyncio.sleep(0.05)
            if any(line.startswith("event") for line in self.node.lines):
                break
        await self.expect(f"event {event:04x} session . 0102 from {peer.THEIRS}")
        for _ in range(3000):  # the event may be looked at before the Ack
            told = await self.ask("counters", answer="counters malformed 0 sd-malformed 0 .*subscribed (true|false)")
            if told[1] == "true":
                break
            await asyncio.sleep(0.02)
        else:
            self.fail("no SubscribeEventgroupAck")
        self.node.do("unsubscribe")
        await server.stop_offer()

    async def test_we_subscribe_to_its_event_by_udp(self):
        await self.we_subscribe_to_its_event("udp", 1)

    async def test_we_subscribe_to_its_event_by_tcp(self):
        await self.we_subscribe_to_its_event("tcp", 2)

    async def it_calls_our_method(self, transport):
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, transport)
        client = await self.client(description(transport))
        for payload in (b"\x01", b"\x02" * 1000):
            result = await client.call_method(0x0001, payload)
            self.assertEqual((result.return_code, result.payload), (ReturnCode.E_OK, payload))

    async def test_it_calls_our_method_by_udp(self):
        await self.it_calls_our_method("udp")

    async def test_it_calls_our_method_by_tcp(self):
        await self.it_calls_our_method("tcp")

    async def it_subscribes_to_our_event(self, transport, group):
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, transport)
        client = await self.client(description(transport))
        received = []
        client.register_callback(lambda event, payload: received.append((event, payload)))
        client.subscribe_eventgroup(client.service.eventgroups[group], 600)  # seconds: nothing expires that is only late
        for _ in range(3000):
            if await self.notify(group) > 0:
                break
            await asyncio.sleep(0.05)
        for _ in range(3000):
            if received:
                break
            await asyncio.sleep(0.02)
        self.assertEqual(received[:1], [(0x8000 | group, b"\x0a\x0b")])
        client.unsubscribe_eventgroup(client.service.eventgroups[group])
        for _ in range(3000):
            if await self.notify(group) == 0:
                return
            await asyncio.sleep(0.02)
        self.fail("its StopSubscribe has no effect")

    async def notify(self, group):
        return int((await self.ask("notify", 0x8000 | group, "0a0b", answer=r"notified (\d+)"))[1])

    async def test_it_subscribes_to_our_event_by_udp(self):
        await self.it_subscribes_to_our_event("udp", 1)

    async def test_it_subscribes_to_our_event_by_tcp(self):
        await self.it_subscribes_to_our_event("tcp", 2)


if __name__ == "__main__":
    unittest.main()
