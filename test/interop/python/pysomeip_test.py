#!/usr/bin/env python3
"""pysomeip_test.py NODE_PEER: our Node and pysomeip (package someip), each in both roles."""
import asyncio
import logging
import socket
import sys
import unittest

import peer

try:
    from someip import config, header, sd, service
except ImportError:
    peer.missing("pysomeip")

program = sys.argv.pop(1)
logging.disable(logging.CRITICAL)


async def discovery(address=peer.THEIRS):
    unicast, multicast, protocol = await sd.ServiceDiscoveryProtocol.create_endpoints(
        socket.AF_INET, address, peer.GROUP, multicast_interface=address)
    protocol.timings.INITIAL_DELAY_MAX = protocol.timings.REQUEST_RESPONSE_DELAY_MAX = 0.02
    protocol.timings.ANNOUNCE_TTL = protocol.timings.SUBSCRIBE_TTL = 600  # a slow machine is no reason to be gone
    protocol.transports = [unicast, multicast]
    protocol.start()
    return protocol


async def until(condition, what, seconds=60):
    for _ in range(int(seconds * 100)):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError(what)


class Service(service.SimpleService):
    service_id, version_major, version_minor = peer.SERVICE, 1, 7

    def __init__(self, instance_id):
        super().__init__(instance_id)
        self.forgotten = []
        self.register_method(0x0001, lambda message, address: message.payload)
        self.register_method(0x0002, self.forget)
        self.register_method(0x0003, self.malformed)
        self.group = service.SimpleEventgroup(self, id=1)
        self.group.values[0x0001] = b"initial"  # event 0x8001
        self.register_eventgroup(self.group)

    def forget(self, message, address):
        self.forgotten.append(message.payload)

    def malformed(self, message, address):
        raise service.MalformedMessageError


class Listener(sd.ClientServiceListener):
    def __init__(self):
        self.offered = {}

    def service_offered(self, found, source):
        self.offered[found.service_id, found.instance_id] = found

    def service_stopped(self, found, source):
        self.offered.pop((found.service_id, found.instance_id), None)


class Events(sd.SOMEIPDatagramProtocol):
    def __init__(self):
        super().__init__()
        self.messages = []

    def message_received(self, message, address, multicast):
        self.messages.append(message)


class Pysomeip(peer.Recorded, unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        self.node = peer.Node(program)
        self.discovery = await discovery()

    async def asyncTearDown(self):
        self.node.stop()
        self.discovery.stop()
        await asyncio.sleep(0.05)
        for transport in self.discovery.transports:
            transport.close()

    async def ask(self, *words, answer):
        """As Node.ask(), while pysomeip goes on in this thread."""
        return await asyncio.to_thread(self.node.ask, *words, answer=answer)

    async def expect(self, pattern, seconds=60):
        return await asyncio.to_thread(self.node.expect, pattern, seconds)

    async def serve(self):
        return await Service.start_datagram_endpoint(peer.INSTANCE, self.discovery.announcer, local_addr=(peer.THEIRS, 0))

    # pysomeip serves.

    async def test_we_find_and_call_its_methods(self):
        served = await self.serve()
        self.addCleanup(served.stop)
        found = await self.ask("require", peer.SERVICE, peer.INSTANCE, 1, answer="available 1234.5678 v1.7 udp (.*)")
        self.assertTrue(found[1].startswith(peer.THEIRS + ":"))
        await self.ask("call", 0x0001, "udp", "cafe00", answer="response 0001 cafe00$")
        await self.ask("call", 0x0001, "udp", "00" * 1300, answer=f"response 0001 {'00' * 1300}$")
        await self.ask("send", 0x0002, "udp", "0102", answer="sent")
        await until(lambda: served.forgotten == [b"\x01\x02"], served.forgotten)
        await self.ask("call", 0x0003, "udp", "", answer="failed 0003 error 09$")
        await self.ask("call", 0x0999, "udp", "", answer="failed 0999 error 03$")
        # Not served.stop_announce(), which fails: it hands over a description instead of the instance.
        self.discovery.announcer.stop_announce_service(self.discovery.announcer.announcing_services[0])
        await self.expect("lost 1234.5678")

    async def test_we_subscribe_to_its_events(self):
        served = await self.serve()
        self.addCleanup(served.stop)
        self.node.do("subscribe", peer.SERVICE, peer.INSTANCE, 1, 1, 0x8001, "udp")
        await self.expect(f"event 8001 session . {b'initial'.hex()}")
        served.group.values[0x0001] = b"second"
        served.group.notify_once([0x0001])
        await self.expect(f"event 8001 session . {b'second'.hex()}")
        for _ in range(3000):  # its initial event comes before its Ack
            if (await self.ask("counters", answer="counters .*subscribed (true|false)"))[1] == "true":
                break
            await asyncio.sleep(0.02)
        else:
            self.fail("no SubscribeEventgroupAck")
        self.node.do("unsubscribe")
        await until(lambda: not served.group.subscribed_endpoints, "it goes on sending")

    async def test_it_refuses_an_unknown_eventgroup_and_we_go_on(self):
        served = await self.serve()
        self.addCleanup(served.stop)
        self.node.do("subscribe", peer.SERVICE, peer.INSTANCE, 1, 0x99, 0x8001, "udp")
        await self.ask("require", peer.SERVICE, peer.INSTANCE, 1, answer="available")
        await asyncio.sleep(0.3)
        await self.ask("counters", answer="counters malformed 0 sd-malformed 0 .*subscribed false")
        await self.ask("call", 0x0001, "udp", "01", answer="response 0001 01$")

    async def test_we_notice_its_crash_and_its_return(self):
        served = await self.serve()
        await self.ask("require", peer.SERVICE, peer.INSTANCE, 1, answer="available")
        self.node.do("subscribe", peer.SERVICE, peer.INSTANCE, 1, 1, 0x8001, "udp")
        await self.expect("event 8001")
        # Gone without a word: with its sockets closed its tasks end, and cannot say anything.
        for transport in self.discovery.transports:
            transport.abort()
        served.stop()
        await asyncio.sleep(0.1)
        self.discovery = await discovery()
        served = await self.serve()
        self.addCleanup(served.stop)
        await self.expect("lost 1234.5678")
        await self.expect("available 1234.5678")
        await self.expect(f"event 8001 session . {b'initial'.hex()}")
        await self.ask("call", 0x0001, "udp", "02", answer="response 0001 02$")
        await self.ask("counters", answer="counters .*reboots 1 ")

    # We serve.

    async def find(self):
        listener = Listener()
        self.discovery.discovery.watch_service(config.Service(peer.SERVICE, peer.INSTANCE, 1), listener)
        await until(lambda: listener.offered, "it does not find our service")
        return listener, listener.offered[peer.SERVICE, peer.INSTANCE]

    async def call(self, offered, method, payload, kind=header.SOMEIPMessageType.REQUEST, version=1, seconds=60):
        transport, protocol = await Events.create_unicast_endpoint(
            local_addr=(peer.THEIRS, 0), remote_addr=await offered.options_1[0].addrinfo())
        self.addCleanup(transport.close)
        protocol.send(header.SOMEIPHeader(service_id=peer.SERVICE, method_id=method, client_id=0x0b0b, session_id=9,
                                          interface_version=version, message_type=kind, payload=payload).build())
        await until(lambda: protocol.messages, "no answer", seconds)
        answer = protocol.messages[0]
        self.assertEqual((answer.service_id, answer.method_id, answer.client_id, answer.session_id),
                         (peer.SERVICE, method, 0x0b0b, 9))
        return answer

    async def test_it_finds_and_calls_our_methods(self):
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, "udp")
        listener, offered = await self.find()
        answer = await self.call(offered, 0x0001, b"\x01\x02")
        self.assertEqual((answer.message_type, answer.return_code, answer.payload),
                         (header.SOMEIPMessageType.RESPONSE, header.SOMEIPReturnCode.E_OK, b"\x01\x02"))
        await self.expect("request 0001 0102")
        for method, version, code in ((0x0003, 1, header.SOMEIPReturnCode.E_NOT_READY),
                                      (0x0999, 1, header.SOMEIPReturnCode.E_UNKNOWN_METHOD),
                                      (0x0001, 2, header.SOMEIPReturnCode.E_WRONG_INTERFACE_VERSION)):
            answer = await self.call(offered, method, b"", version=version)
            self.assertEqual((answer.return_code, answer.payload), (code, b""))
        with self.assertRaises(AssertionError):
            await self.call(offered, 0x0002, b"\x07", kind=header.SOMEIPMessageType.REQUEST_NO_RETURN,
                            seconds=0.2)
        await self.expect("request 0002 07")
        self.assertEqual((await self.call(offered, 0x0010, b"")).payload, bytes.fromhex("01020304"))
        self.assertEqual((await self.call(offered, 0x0011, b"\x05\x06")).payload, b"\x05\x06")
        self.assertEqual((await self.call(offered, 0x0010, b"")).payload, b"\x05\x06")
        self.node.do("withdraw")
        await until(lambda: not listener.offered, "it does not see our StopOffer")

    async def test_it_subscribes_to_our_events_and_field(self):
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, "udp")
        transport, events = await Events.create_unicast_endpoint(local_addr=(peer.THEIRS, 0))
        self.addCleanup(transport.close)
        groups = [config.Eventgroup(peer.SERVICE, peer.INSTANCE, 1, id, sockname=transport.get_extra_info("sockname"),
                                    protocol=header.L4Protocols.UDP) for id in (1, 3)]
        for group in groups:
            self.discovery.discovery.find_subscribe_eventgroup(group)
        # A field's value comes by itself, an event's does not.
        await until(lambda: events.messages, "no initial event")
        self.assertEqual([(m.method_id, m.payload) for m in events.messages], [(0x8010, bytes.fromhex("01020304"))])
        # It subscribes to each in a message of its own, in any order: the first one sent may be for nobody yet.
        for first in range(1, 3000):
            if (await self.ask("notify", 0x8001, "aa", answer=r"notified (\d)"))[1] == "1":
                break
            await asyncio.sleep(0.02)
        await self.ask("notify", 0x8001, "bb", answer="notified 1")
        self.node.do("set", "07")
        self.node.do("set", "07")  # no change: no event
        await until(lambda: len(events.messages) == 4, events.messages)
        await asyncio.sleep(0.1)
        self.assertEqual([(m.method_id, m.session_id, m.client_id, m.payload) for m in events.messages[1:]],
                         [(0x8001, first, 0, b"\xaa"), (0x8001, first + 1, 0, b"\xbb"), (0x8010, 2, 0, b"\x07")])
        for group in groups:
            self.discovery.discovery.stop_find_subscribe_eventgroup(group)
        for _ in range(3000):
            if (await self.ask("notify", 0x8001, "cc", answer=r"notified (\d)"))[1] == "0":
                return
            await asyncio.sleep(0.02)
        self.fail("its StopSubscribe has no effect")

    async def test_we_refuse_its_subscription_to_an_unknown_eventgroup(self):
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, "udp")
        await self.find()
        self.discovery.discovery.find_subscribe_eventgroup(
            config.Eventgroup(peer.SERVICE, peer.INSTANCE, 1, 0x99, sockname=(peer.THEIRS, 4711),
                              protocol=header.L4Protocols.UDP))
        for _ in range(3000):
            if (await self.ask("counters", answer=r"counters .* nacks (\d+)"))[1] != "0":
                return
            await asyncio.sleep(0.02)
        self.fail("no SubscribeEventgroupNack")

    async def test_it_notices_our_crash_and_our_return(self):
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, "udp")
        transport, events = await Events.create_unicast_endpoint(local_addr=(peer.THEIRS, 0))
        self.addCleanup(transport.close)
        self.discovery.discovery.find_subscribe_eventgroup(
            config.Eventgroup(peer.SERVICE, peer.INSTANCE, 1, 3, sockname=transport.get_extra_info("sockname"),
                              protocol=header.L4Protocols.UDP))
        await until(lambda: events.messages, "no initial event")
        self.node.kill()
        events.messages.clear()
        self.node = peer.Node(program)
        self.node.do("offer", peer.SERVICE, peer.INSTANCE, "udp")
        await until(lambda: events.messages, "no initial event after our return")
        self.assertEqual((await self.ask("notify", 0x8001, "00", answer=r"notified (\d)"))[1], "0")


class OnOneHost(unittest.IsolatedAsyncioTestCase):
    """Both in one network namespace, where they share the port of the group: whoever starts first."""
    THEIRS, OURS = "127.0.0.1", "127.0.0.2"

    async def meet(self, node, their_discovery):
        served = await Service.start_datagram_endpoint(peer.INSTANCE, their_discovery.announcer,
                                                       local_addr=(self.THEIRS, 0))
        self.addCleanup(served.stop)
        listener = Listener()
        their_discovery.discovery.watch_service(config.Service(0x4321, 1, 1), listener)
        node.do("offer", 0x4321, 1, "udp")
        await asyncio.to_thread(node.ask, "require", peer.SERVICE, peer.INSTANCE, 1,
                                answer="available 1234.5678 v1.7 udp " + self.THEIRS)
        await until(lambda: listener.offered, "it does not find our service")

    async def close(self, their_discovery):
        their_discovery.stop()
        for transport in their_discovery.transports:
            transport.close()

    async def test_pysomeip_first(self):
        theirs = await discovery(self.THEIRS)
        self.addAsyncCleanup(self.close, theirs)
        node = peer.Node(program, address=self.OURS, here=True)
        self.addCleanup(node.stop)
        await self.meet(node, theirs)

    async def test_trestle_first(self):
        node = peer.Node(program, address=self.OURS, here=True)
        self.addCleanup(node.stop)
        theirs = await discovery(self.THEIRS)
        self.addAsyncCleanup(self.close, theirs)
        await self.meet(node, theirs)


if __name__ == "__main__":
    unittest.main()
