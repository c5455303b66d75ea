"""The seat of examples/seat as a device of another stack, pysomeip: its payloads are written by hand, byte by byte.

  seat_device.py ADDRESS     goes on with the Python of build/peers, which has pysomeip

It prints a line when it is ready, for each eventgroup when somebody has subscribed to it, and for calls that get no answer.
On standard input it understands `send EVENT`, `heat LEVEL`, and `quit`.
"""
import asyncio
import collections
import logging
import socket
import struct
import sys

import peer

try:
    from someip import sd, service
except ImportError:
    peer.missing("pysomeip")

logging.disable(logging.CRITICAL)

BOM, BOM_16 = b"\xef\xbb\xbf", b"\xfe\xff"
# What `send` sends: the ids of the FDEPL without bit 15, which pysomeip adds.
EVENTS = {
    "moved": (0x0010, struct.pack(">hhh", 120, -30, 7)),
    "blocked": (0x0011, struct.pack(">Bf", 4, 86.5)),
    # A union: 2 bytes length, 1 byte type, counted from 1.
    "occupied": (0x0012, struct.pack(">BHBf", 1, 4, 1, 72.25)),
    "problem": (0x0012, struct.pack(">BHBI", 0, 4 + 3 + 5 + 1, 2, 3 + 5 + 1) + BOM + b"blind" + b"\0"),
    "measured": (0x0013, struct.pack(">I", 5) + bytes([0, 1, 127, 128, 255]) + struct.pack(">Q", 0x1122334455667788)),
}


def told(*words):
    print(*words, flush=True)


def string_of(payload, width=4):
    """A string at the front and what comes behind it."""
    length = int.from_bytes(payload[:width], "big")
    text, rest = payload[width:width + length], payload[width + length:]
    if len(text) != length or not text.startswith(BOM) or not text.endswith(b"\0"):
        raise service.MalformedMessageError
    return text[len(BOM):-1].decode(), rest


class Seat(service.SimpleService):
    service_id, version_major, version_minor = 0x5ea7, 1, 2

    def __init__(self, instance_id):
        super().__init__(instance_id)
        self.subscribed = collections.Counter()
        self.position = [0, 0, 0]
        self.slots = []  # names and positions
        self.methods_of(self.adjust, self.stop_moving, self.store, self.recall, self.trace, self.massage)
        self.fields, self.events = service.SimpleEventgroup(self, id=1), service.SimpleEventgroup(self, id=2)
        self.register_eventgroup(self.fields)
        self.register_eventgroup(self.events)
        for value, (getter, setter) in {0x0001: (0x0001, 0x0002), 0x0002: (0x0003, 0x0004), 0x0003: (0x0005, None)}.items():
            self.register_method(getter, self.checked(lambda payload, value=value: self.got(value, payload)))
            if setter is not None:
                self.register_method(setter, self.checked(lambda payload, value=value: self.set(value, payload)))
        self.fields.values[0x0001] = b"\x01"
        label = BOM_16 + "Fahrer\u20ac\0".encode("utf-16-be")
        self.fields.values[0x0002] = struct.pack(">I", len(label)) + label
        self.fields.values[0x0003] = self.presets()

    def client_subscribed(self, subscription, source):
        super().client_subscribed(subscription, source)
        self.subscribed[subscription, source] += 1

    def client_unsubscribed(self, subscription, source):
        """pysomeip tells late that a subscription has run out: it may have been made anew before."""
        self.subscribed[subscription, source] -= 1
        if not self.subscribed[subscription, source]:
            super().client_unsubscribed(subscription, source)

    def methods_of(self, *handlers):
        for index, handler in enumerate(handlers):
            self.register_method(0x0010 + index, self.checked(handler))

    @staticmethod
    def checked(handler):
        def handle(message, _address):
            try:
                return handler(message.payload)
            except struct.error as error:  # too long or too short
                raise service.MalformedMessageError from error
        return handle

    # Methods

    def adjust(self, payload):
        axis, millimetres = struct.unpack(">Bh", payload)
        self.position[{0: 0, 1: 1, 4: 2}[axis]] += millimetres
        return struct.pack(">Bhhh", abs(millimetres) <= 500, *self.position)

    def stop_moving(self, payload):
        told("stop", payload.hex() or "empty")

    def store(self, payload):
        name, rest = string_of(payload)
        self.slots.append((name, struct.unpack(">hhh", rest)))
        self.fields.values[0x0003] = self.presets()
        self.fields.notify_once([0x0003])
        return struct.pack(">B", len(self.slots) - 1)

    def recall(self, payload):
        slot, = struct.unpack(">B", payload)
        found = slot < len(self.slots)
        return struct.pack(">B", found) + self.preset(*(self.slots[slot] if found else ("", (0, 0, 0))))

    @staticmethod
    def trace(payload):
        count, = struct.unpack(">H", payload)
        return struct.pack(f">I{count}d", 8 * count, *(i / 4 - 1 for i in range(count)))

    @staticmethod
    def massage(payload):
        """A map has 4 bytes of length, and then keys and values. The ticket says what has arrived."""
        size, = struct.unpack_from(">I", payload)
        cushions, rest = payload[4:4 + size], payload[4 + size:]
        seconds, = struct.unpack(">H", rest)
        ticket = seconds << 16
        while cushions:
            name, cushions = string_of(cushions)
            intensity, cushions = cushions[0], cushions[1:]
            ticket += len(name) * intensity
        return struct.pack(">I", ticket)

    # Fields

    @staticmethod
    def preset(name, position):
        """A struct with 2 bytes of length; the string in it has 1."""
        text = BOM + name.encode() + b"\0"
        members = struct.pack(">B", len(text)) + text + struct.pack(">hhh", *position)
        return struct.pack(">H", len(members)) + members

    def presets(self):
        """An array with 2 bytes of length."""
        elements = b"".join(self.preset(*one) for one in self.slots)
        return struct.pack(">H", len(elements)) + elements

    def got(self, value, payload):
        if payload:
            raise service.MalformedMessageError
        return self.fields.values[value]

    def set(self, value, payload):
        if value == 0x0001:
            payload = struct.pack(">B", min(struct.unpack(">B", payload)[0], 3))
        elif payload[4:6] != BOM_16 or payload[-2:] != b"\0\0" or struct.unpack_from(">I", payload)[0] != len(payload) - 4:
            raise service.MalformedMessageError
        self.fields.values[value] = payload
        self.fields.notify_once([value])
        return payload

    # What it is told.

    def do(self, command, word=""):
        if command == "send":
            event, payload = EVENTS[word]
            self.events.values[event] = payload
            self.events.notify_once([event])
        elif command == "heat":
            self.set(0x0001, struct.pack(">B", int(word)))


async def main(address):
    unicast, multicast, discovery = await sd.ServiceDiscoveryProtocol.create_endpoints(
        socket.AF_INET, address, peer.GROUP, multicast_interface=address)
    discovery.timings.INITIAL_DELAY_MAX = 0.02
    discovery.timings.ANNOUNCE_TTL = 600  # a slow machine is no reason to be gone
    discovery.transports = [unicast, multicast]
    discovery.start()
    seat = await Seat.start_datagram_endpoint(1, discovery.announcer, local_addr=(address, 30712))

    async def subscribed(group):
        await group.has_clients.wait()
        told("subscribed", group.id)
    tasks = [asyncio.create_task(subscribed(group)) for group in (seat.fields, seat.events)]
    told("ready")
    while words := (await asyncio.to_thread(sys.stdin.readline)).split():
        if words == ["quit"]:
            break
        seat.do(*words)
    for task in tasks:
        task.cancel()
    discovery.stop()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
