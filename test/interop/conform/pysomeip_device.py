"""A device of pysomeip for `trestle conform`: an echo, a field, a cyclic event. pysomeip_device.py ADDRESS"""
import asyncio
import signal
import socket
import sys

from someip import sd, service


class Device(service.SimpleService):
    service_id, version_major, version_minor = 0x1234, 1, 0

    def __init__(self, instance_id):
        super().__init__(instance_id)
        self.register_method(0x0001, lambda message, _address: message.payload)
        self.register_method(0x0002, lambda _message, _address: None)
        self.register_method(0x0010, lambda _message, _address: self.field.values[0x0010])
        self.register_method(0x0011, self.set)
        self.ticks = service.SimpleEventgroup(self, id=1, interval=0.2)
        self.ticks.values[0x0001] = b"\x01\x02"  # event 0x8001
        self.field = service.SimpleEventgroup(self, id=2)
        self.field.values[0x0010] = b"\x2a"
        self.register_eventgroup(self.ticks)
        self.register_eventgroup(self.field)

    def set(self, message, _address):
        if len(message.payload) != 1:
            raise service.MalformedMessageError
        self.field.values[0x0010] = message.payload
        self.field.notify_once([0x0010])
        return message.payload


async def main(address):
    unicast, multicast, discovery = await sd.ServiceDiscoveryProtocol.create_endpoints(
        socket.AF_INET, address, "224.244.224.245", multicast_interface=address)
    discovery.timings.INITIAL_DELAY_MAX = discovery.timings.REPETITIONS_BASE_DELAY = 0.05
    discovery.transports = [unicast, multicast]
    discovery.start()
    await Device.start_datagram_endpoint(1, discovery.announcer, local_addr=(address, 30501))
    ended = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
    await ended.wait()
    discovery.stop()
    await asyncio.sleep(0.05)  # until its StopOffer has gone


asyncio.run(main(sys.argv[1]))
