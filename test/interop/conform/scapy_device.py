"""A device of a hundred lines for `trestle conform`, which reads and writes messages with scapy: an echo, a cyclic event.
scapy knows formats only; that this checks little of what it gets is its own doing, and usual among simulated devices.
scapy_device.py ADDRESS"""
import logging
import os
import select
import signal
import socket
import sys
import time

logging.getLogger("scapy.runtime").setLevel(logging.ERROR)
sys.path.append(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from scapy.contrib.automotive.someip import SD, SOMEIP, SDEntry_EventGroup, SDEntry_Service, SDOption_IP4_EndPoint
from scapy.packet import Raw
from scapy_fields import method_fields, method_of

OWN, GROUP, PORT, SERVICE, INSTANCE = sys.argv[1], ("224.244.224.245", 30490), 30501, 0x1234, 1


def bound(address, port):
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    opened.bind((address, port))
    opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(OWN))
    return opened


unicast, multicast, service = bound(OWN, 30490), bound(*GROUP), bound(OWN, PORT)
multicast.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP[0]) + socket.inet_aton(OWN))
sessions, subscribers = {}, {}


def say(entry, options, to):
    count = sessions[to] = sessions.get(to, 0) + 1
    message = SD(flags=0xc0 if count <= 0xffff else 0x40)
    message.set_entryArray([entry])
    message.set_optionArray(options)
    unicast.sendto(bytes(SOMEIP(srv_id=0xffff, client_id=0, session_id=(count - 1) % 0xffff + 1, iface_ver=1,
                                msg_type=SOMEIP.TYPE_NOTIFICATION, **method_fields(0x8100)) / Raw(bytes(message))), to)


def offer(to, ttl=3):
    say(SDEntry_Service(type=1, n_opt_1=1, srv_id=SERVICE, inst_id=INSTANCE, major_ver=1, ttl=ttl, minor_ver=0),
        [SDOption_IP4_EndPoint(addr=OWN, l4_proto=0x11, port=PORT)], to)


def answer_subscribe(entry, ttl, to):
    say(SDEntry_EventGroup(type=7, srv_id=entry.srv_id, inst_id=entry.inst_id, major_ver=entry.major_ver, ttl=ttl,
                           cnt=entry.cnt, eventgroup_id=entry.eventgroup_id), [], to)


def hear(data, source):
    if SOMEIP(data).srv_id != 0xffff:
        return
    message = SD(data[16:])
    for entry in message.entry_array:
        if entry.type == 0:
            if entry.srv_id == SERVICE and entry.inst_id in (INSTANCE, 0xffff) and entry.major_ver in (1, 0xff):
                offer(source)
        elif entry.type == 6:
            options = message.option_array[entry.index_1:entry.index_1 + entry.n_opt_1]
            wanted = [(option.addr, option.port) for option in options if isinstance(option, SDOption_IP4_EndPoint)]
            known = (entry.srv_id, entry.inst_id, entry.major_ver, entry.eventgroup_id) == (SERVICE, INSTANCE, 1, 1)
            if entry.ttl == 0:
                for one in wanted:
                    subscribers.pop(one, None)
            elif not known or not wanted:
                answer_subscribe(entry, 0, source)
            else:
                subscribers[wanted[0]] = time.monotonic() + entry.ttl
                answer_subscribe(entry, entry.ttl, source)


def serve(data, source):
    asked = SOMEIP(data)
    if asked.srv_id != SERVICE or asked.msg_type != SOMEIP.TYPE_REQUEST:
        return
    code = 8 if asked.iface_ver != 1 else 3 if method_of(asked) != 1 else 0
    service.sendto(bytes(SOMEIP(srv_id=SERVICE, client_id=asked.client_id, session_id=asked.session_id,
                                iface_ver=asked.iface_ver, msg_type=SOMEIP.TYPE_RESPONSE, retcode=code,
                                **method_fields(method_of(asked))) / Raw(b"" if code else data[16:])), source)


def notify(session):
    event = bytes(SOMEIP(srv_id=SERVICE, client_id=0, session_id=session, iface_ver=1, msg_type=SOMEIP.TYPE_NOTIFICATION,
                         **method_fields(0x8001)) / Raw(b"\x01\x02"))
    for subscriber, until in list(subscribers.items()):
        try:
            if until < time.monotonic():
                del subscribers[subscriber]
            else:
                service.sendto(event, subscriber)
        except OSError:  # an address that nobody can reach
            pass


ended = []
signal.signal(signal.SIGTERM, lambda *_: ended.append(True))
next_event = time.monotonic()
offers = [next_event + delay for delay in (0.02, 0.07, 0.17, 0.37)]
event_session = 0
while not ended:
    if time.monotonic() >= offers[0]:
        offer(GROUP)
        offers = offers[1:] or [offers[0] + 1]
    if time.monotonic() >= next_event:
        next_event += 0.2
        event_session = event_session % 0xffff + 1
        notify(event_session)
    wait = max(0, min(next_event, offers[0]) - time.monotonic())
    for readable in select.select([unicast, multicast, service], [], [], wait)[0]:
        received = readable.recvfrom(65536)
        try:
            (serve if readable is service else hear)(*received)
        except Exception as error:  # what scapy says to bytes that are no message
            print(repr(error), received[0].hex(), flush=True)
offer(GROUP, 0)
