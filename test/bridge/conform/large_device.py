#!/usr/bin/env python3
"""A device for `trestle conform` that sends and takes large messages in segments, and is no code of ours: sockets and bytes.

large_device.py ADDRESS GROUP [FAULT]: service 0x4321, instance 1, at UDP port 40321. Method 1 gives back its payload, 2 takes
what is large and answers with nothing, 3 answers with 4000 bytes; event 0x8001 of eventgroup 1 has 4000 bytes, each 150 ms.
Method 4 sets the field 0x8002 of eventgroup 2, and makes event 0x8003 of eventgroup 3 be sent; 5 gets the field.
FAULT is wrong with the segments that it sends: flag, session, sizes, last, reserved, twice; or whole: it takes none. Or it is
lossy: of each event of the eventgroups 2 and 3, every other one gets lost, from the first one on."""
import select
import socket
import struct
import sys
import time

OWN, GROUP, *FAULT = sys.argv[1:]
SD, PORT, SERVICE, EVENT, LARGE = 30490, 40321, 0x4321, 0x8001, bytes(range(250)) * 16
FAULT = FAULT[0] if FAULT else ""


def port(address, number):
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    one.bind((address, number))
    one.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(OWN))
    return one


sd, service, group = port(OWN, SD), port(OWN, PORT), port(GROUP, SD)
group.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton(OWN))
sessions, subscribers, parts = {}, {}, {}  # subscribers: of each eventgroup
field, events = b"\x01", {}  # events: how many there were of each


def send_sd(to, entry, options=b""):
    sessions[to] = sessions.get(to, 0) + 1
    body = struct.pack(">II", 0xc0000000, len(entry)) + entry + struct.pack(">I", len(options)) + options
    sd.sendto(struct.pack(">HHIHHI", 0xffff, 0x8100, len(body) + 8, 0, sessions[to], 0x01010200) + body, to)


def offer(to):
    send_sd(to, struct.pack(">BBBBHHII", 1, 0, 0, 0x10, SERVICE, 1, 0x01000003, 0),
            struct.pack(">HBB4sBBH", 9, 4, 0, socket.inet_aton(OWN), 0, 17, PORT))


def on_sd(data, peer):
    length = struct.unpack(">I", data[20:24])[0]
    options = data[28 + length:]
    for at in range(24, 24 + length, 16):
        kind, _, _, _, wanted, _, version, tail = struct.unpack(">BBBBHHII", data[at:at + 16])
        if kind == 0 and wanted == SERVICE:
            offer(peer)
        elif kind == 6:
            to = (socket.inet_ntoa(options[4:8]), struct.unpack(">H", options[10:12])[0])
            known = subscribers.setdefault(tail & 0xffff, set())
            if version & 0xffffff:
                send_sd(peer, struct.pack(">BBBBHHII", 7, 0, 0, 0, SERVICE, 1, version, tail))
                if tail & 0xffff == 2 and to not in known:
                    notify(to, 0x8002, field)
                known.add(to)
            else:
                known.discard(to)


def notify(to, event, payload):
    events[event] = events.get(event, 0) + 1
    if FAULT != "lossy" or events[event] % 2 == 0:
        send(to, event, 0, events[event], 0x02, payload)


def send(to, method, client, session, kind, payload):
    def message(kind, session, payload):
        service.sendto(struct.pack(">HHIHHBBBB", SERVICE, method, len(payload) + 8, client, session, 1, 1, kind, 0) + payload, to)
    if len(payload) <= 1400:
        return message(kind, session, payload)
    size = 1392
    for number, at in enumerate(range(0, len(payload), size)):
        piece = payload[at:at + size]
        if FAULT == "sizes" and number == 0:
            piece = piece[:1376]
        more = at + size < len(payload) or (FAULT == "last" and 1)
        word = struct.pack(">I", at | (2 if FAULT == "reserved" else 0) | (1 if more else 0))
        for _ in range(2 if FAULT == "twice" and number == 1 else 1):
            message(kind if FAULT == "flag" else kind | 0x20, session + (number if FAULT == "session" else 0), word + piece)


def on_request(data, peer):
    _, method, _, client, session, _, _, kind, _ = struct.unpack(">HHIHHBBBB", data[:16])
    payload = data[16:]
    if kind & 0x20:
        word = struct.unpack(">I", payload[:4])[0]
        key = (peer, method, client)
        if FAULT == "whole":
            return
        known, pieces, end = parts.setdefault(key, (session, {}, []))
        if known != session:
            known, pieces, end = parts[key] = (session, {}, [])
        if word & 1 and len(payload) % 16 != 4:
            return
        pieces.setdefault(word & ~15, payload[4:])
        if not word & 1:
            end.append((word & ~15) + len(payload) - 4)
        if not end or sum(map(len, pieces.values())) != end[0]:
            return
        payload = b"".join(pieces[at] for at in sorted(pieces))
        del parts[key]
    if method == 4:
        global field
        field = payload or field
        for number, event, value in ((2, 0x8002, field), (3, 0x8003, b"\x07")):
            for to in subscribers.get(number, ()):
                notify(to, event, value)
    if kind in (0x00, 0x20):
        send(peer, method, client, session, 0x80, {1: payload, 3: LARGE, 4: field, 5: field}.get(method, b""))


next_offer = next_event = time.monotonic()
count = 0
while True:
    now = time.monotonic()
    if now >= next_offer:
        offer((GROUP, SD))
        next_offer = now + 1
    if now >= next_event:
        count, next_event = count % 0xff00 + 16, now + 0.15
        for to in subscribers.get(1, ()):
            send(to, EVENT, 0, count, 0x02, LARGE)
    for one in select.select([sd, service, group], [], [], max(0, min(next_offer, next_event) - now))[0]:
        data, peer = one.recvfrom(65536)
        if one is service:
            on_request(data, peer)
        elif len(data) >= 40:
            on_sd(data, peer)
