"""A device of opensomeip for `trestle conform`, by the classes of its C++ library, as the Python classes above them pass on
neither timers nor eventgroups: a method that answers without payload, an eventgroup. opensomeip_device.py ADDRESS"""
import datetime
import signal
import sys
import threading

from opensomeip._bridge import get_ext

library = get_ext()
address = sys.argv[1]


def milliseconds(count):
    return datetime.timedelta(milliseconds=count)


def succeed(_client, _session, _payload, _output):  # what is put into the last one is lost on the way to C++
    return library.rpc.RpcResult.SUCCESS


config = library.sd.SdConfig()
config.multicast_address, config.multicast_port = "224.244.224.245", 30490
config.unicast_address, config.unicast_port = address, 30490
config.initial_delay = config.repetition_base = milliseconds(50)
config.repetition_max, config.cyclic_offer, config.ttl = milliseconds(60_000), milliseconds(1000), milliseconds(3000)
methods = library.rpc.RpcServer(0x1234, 1, library.Endpoint(address, 30501))
methods.register_method(0x0001, succeed)
methods.register_method(0x0002, succeed, library.rpc.MethodSemantics.FIRE_AND_FORGET)
discovery = library.sd.SdServer(config)
if not methods.initialize() or not discovery.initialize():
    sys.exit("opensomeip cannot be started")
instance = library.sd.ServiceInstance(0x1234, 1, 1, 0)
instance.ttl_seconds = 3
discovery.offer_service(instance, f"{address}:30501", "", [1])
ended = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: ended.set())
ended.wait()
discovery.stop_offer_service(0x1234, 1)
discovery.shutdown()
methods.shutdown()
