"""An ECU that knows nothing of Trestle: the heating that Climate.fidl describes, on another SOME/IP stack (pysomeip).

  climate.py [ADDRESS]     127.0.0.2; until Ctrl-C. Needs: pip install someip==0.3.0

docs/tutorial.md brings it into ROS 2. Payloads are packed by hand, as CommonAPI lays them out.
"""
import asyncio
import collections
import logging
import socket
import struct
import sys

from someip import sd, service

DISCOVERY_GROUP, PORT = "224.244.224.245", 30500
TARGET, TEMPERATURE = 0x0001, 0x0010  # events; pysomeip adds bit 15


def text(words):
    """A string: its length, a byte order mark, UTF-8, and a 0."""
    encoded = b"\xef\xbb\xbf" + words.encode() + b"\0"
    return struct.pack(">I", len(encoded)) + encoded


class Climate(service.SimpleService):
    service_id, version_major, version_minor = 0x4c11, 1, 0

    def __init__(self, instance_id):
        super().__init__(instance_id)
        self.celsius, self.target, self.on = 19.5, 22.0, False
        self.subscribed = collections.Counter()
        self.register_method(0x0001, lambda message, _address: struct.pack(">f", self.target))
        self.register_method(0x0002, self.set_target)
        self.register_method(0x0010, self.heat)
        self.fields, self.events = service.SimpleEventgroup(self, id=1), service.SimpleEventgroup(self, id=2)
        self.register_eventgroup(self.fields)
        self.register_eventgroup(self.events)
        self.tell()

    def client_subscribed(self, subscription, source):
        super().client_subscribed(subscription, source)
        self.subscribed[subscription, source] += 1

    def client_unsubscribed(self, subscription, source):
        """pysomeip tells late that a subscription has run out: it may have been made anew before."""
        self.subscribed[subscription, source] -= 1
        if not self.subscribed[subscription, source]:
            super().client_unsubscribed(subscription, source)

    def tell(self):
        self.fields.values[TARGET] = struct.pack(">f", self.target)
        self.events.values[TEMPERATURE] = struct.pack(">f", self.celsius)

    def set_target(self, message, _address):
        if len(message.payload) != 4:
            raise service.MalformedMessageError
        self.target = min(max(struct.unpack(">f", message.payload)[0], 16.0), 28.0)
        self.tell()
        self.fields.notify_once([TARGET])
        return self.fields.values[TARGET]

    def heat(self, message, _address):
        if len(message.payload) != 1:
            raise service.MalformedMessageError
        self.on = message.payload != b"\0"
        return struct.pack(">B", True) + text(f"heating to {self.target:.1f} degrees" if self.on else "off")

    async def run(self):
        while True:
            await asyncio.sleep(1)
            if self.on and self.celsius < self.target:
                self.celsius = min(self.celsius + 0.5, self.target)
            self.tell()
            self.events.notify_once([TEMPERATURE])


async def main(address):
    unicast, multicast, discovery = await sd.ServiceDiscoveryProtocol.create_endpoints(
        socket.AF_INET, address, DISCOVERY_GROUP, multicast_interface=address)
    discovery.transports = [unicast, multicast]
    discovery.start()
    climate = await Climate.start_datagram_endpoint(1, discovery.announcer, local_addr=(address, PORT))
    print(f"the heating is at {address}:{PORT}", flush=True)
    await climate.run()


if __name__ == "__main__":
    logging.disable(logging.CRITICAL)
    try:
        asyncio.run(main(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.2"))
    except KeyboardInterrupt:
        pass
