"""A device of someipy, with its daemon, for `trestle conform`: an echo, or a cyclic event, as it cannot have both (a
Subscribe fails when the service has methods). someipy_device.py ADDRESS methods|events"""
import asyncio
import json
import logging
import os
import signal
import subprocess
import sys
import tempfile

from someipy import (Event, EventGroup, MessageType, Method, MethodResult, ReturnCode, ServerServiceInstance,
                     ServiceBuilder, TransportLayerProtocol, connect_to_someipy_daemon)

logging.disable(logging.CRITICAL)


def answer(payload):
    result = MethodResult()
    result.message_type, result.return_code, result.payload = MessageType.RESPONSE, ReturnCode.E_OK, payload
    return result


async def main(address, what):
    with tempfile.TemporaryDirectory() as folder:
        path, config = os.path.join(folder, "someipyd.sock"), os.path.join(folder, "config.json")
        with open(config, "w") as file:
            json.dump({"sd_address": "224.244.224.245", "sd_port": 30490, "interface": address, "socket_path": path,
                       "log_level": "ERROR"}, file)
        # A session of its own: the signal that ends this program must not end the daemon before its StopOffer.
        daemon = subprocess.Popen(["setpriv", "--pdeathsig", "KILL", sys.executable, "-B", "-m", "someipy.someipyd",
                                   "--config", config], start_new_session=True)
        while not os.path.exists(path):
            await asyncio.sleep(0.02)
        client = await connect_to_someipy_daemon({"socket_path": path})
        builder = ServiceBuilder().with_service_id(0x1234).with_major_version(1).with_minor_version(0)
        if what == "events":
            builder.with_eventgroup(EventGroup(1, [Event(0x8001, TransportLayerProtocol.UDP)]))
        else:
            builder.with_method(Method(0x0001, TransportLayerProtocol.UDP, lambda payload, _address: answer(payload)))
        server = ServerServiceInstance(client, builder.build(), 1, address, 30501, ttl=3, cyclic_offer_delay_ms=1000)
        await server.start_offer()
        ended = asyncio.Event()
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
        while not ended.is_set():
            if what == "events":
                server.send_event(1, 0x8001, b"\x01\x02")
            try:
                await asyncio.wait_for(ended.wait(), 0.2)
            except asyncio.TimeoutError:
                pass
        await server.stop_offer()
        await asyncio.sleep(0.2)  # until its StopOffer has gone
        daemon.terminate()
        daemon.wait(10)


asyncio.run(main(*sys.argv[1:]))
