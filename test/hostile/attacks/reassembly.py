"""Messages in segments: such as never end, and such as come in another order."""
import random
import socket
import time

import flows
from attacker import CAR, Attacker, pace
from figures import at_least, at_most, holds
from flows import events
from lab import ADDRESS, ATTACKERS, Failed
from scenario import scenario
from wire import EVENT, REQUEST, cloud, segment, service_entry
from world import LATE


def half_requests(rate, kind, ports, services, method=None):
    """The first segment and one that is 8 MB further on, of ever new requests that nobody can answer."""
    sockets = []
    for address in ATTACKERS:
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sock.bind((address, 0))
        sockets.append(sock)
    fill = bytes(1392)
    for i in pace(rate):
        sock = sockets[i % len(sockets)]
        for port, service in zip(ports, services):
            for offset in 0, 8_000_000, 15_900_000:
                sock.sendto(segment(service, method or 1 + i % 200, offset // 16 * 16, fill, session=1 + i % 60000, kind=kind,
                                    client=i % 300), (CAR, port))


def filling_requests(rate, megabytes):
    """Requests of so many megabytes, each without its last segment."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((ATTACKERS[0], 0))
    fill = bytes(1392)
    for i in pace(rate):
        for number in range(megabytes * 1_000_000 // 1392):
            sock.sendto(segment(0x4001, 1, number * 1392, fill, session=1 + i, kind=REQUEST, client=i), (CAR, 40001))


@scenario("half-requests", 5, "half-finished requests to services without methods")
def half_requests_scenario(world):
    world.honest("clouds_out", "clouds_in", "events_in", "calls_udp")
    world.beside(half_requests, 100, REQUEST, (40001, 40003, 45001), (0x4001, 0x4003, 0x5001),
                 newcomer="new=listen:0x4001:1:udp")


@scenario("half-events", 5, "half-finished events at the port where clouds come in")
def half_events(world):
    world.honest("clouds_in", "events_in", late=True)
    world.beside(half_requests, 100, EVENT, (45001,), (0x5001,), newcomer=LATE)


def endpoint_of(attacker, service, host):
    """Where the host offers the service, which it tells whoever looks for it."""
    for _ in pace(5):
        attacker.say(service_entry(0, service, 0xFFFF, major=0xFF, minor=0xFFFFFFFF), to=host)
        time.sleep(0.1)
        for entries, where, sender in attacker.heard():
            if where and sender[0] == host and any(entry[0] == 1 and entry[4:6] == service.to_bytes(2, "big")
                                                   for entry in entries):
                return where
    raise Failed(f"{host} offers no service {service:#x}")


def half_requests_to(rate, service, method):
    """Ever new requests that are never whole, from several addresses, to a method that takes large ones."""
    where = endpoint_of(Attacker(), service, CAR)
    half_requests(rate, REQUEST, (where[1],), (service,), method)


@scenario("half-requests-taken", 5, "half-finished requests to a method that takes large ones")
def half_requests_taken(world):
    """They do take places, so the slowest have to give way to honest large requests."""
    scale = world.scale
    server = world.end("car", "server", "peer", CAR, "served=serve:0x5100:1:200")
    client = world.end("honest", "client", "peer", ADDRESS["honest"],
                       f"calls=call:0x5100:1:3:{scale.cloud_bytes}:{scale.cloud_hz}:udp")
    world.wait(lambda: any(answered for _, answered in flows.read(client.out)[0]["calls"].calls), "no call is answered")
    world.pass_time(scale.quiet_s, "without the attack")
    before, began = server.rss(), time.monotonic_ns()
    child = world.lab.fork("attacker", half_requests_to, 100, 0x5100, 3)
    world.pass_time(scale.attack_s, "attacked")
    peak, ended = server.rss(), time.monotonic_ns()
    world.lab.end(child)
    world.pass_time(2, "what comes late")
    record = flows.read(client.out)[0]["calls"]
    alone, seen = flows.calls(record, began - int(scale.quiet_s * 1e9), began), flows.calls(record, began, ended)
    kept = min(100.0, 100 * seen.percent / alone.percent) if alone.percent else 0.0
    world.figures.append(at_least("large requests answered", kept, 95, "%", alone=alone.percent))
    world.figures.append(at_most("memory for what is never whole", (peak - before) / 1e6, 520, "MB"))
    world.figures.append(holds("places were taken, and some gave way", "gave way to others" in server.text()))


def half_events_as_honest(rate):
    """The same in the name of the honest host, from the endpoint that it offers its clouds at."""
    attacker = Attacker()
    source = endpoint_of(attacker, 0x5001, ADDRESS["honest"])
    fill = bytes(1392)
    for i in pace(rate):
        for offset in 0, 8_000_000, 15_900_000:
            attacker.send_as(source, segment(0x5001, 0x8001, offset // 16 * 16, fill, session=1 + i % 60000, kind=EVENT,
                                             client=1 + i % 300), (CAR, 45001))


@scenario("half-events-forged", 5, "half-finished events in the name of the server that offers them, at the port where clouds come in")
def half_events_forged(world):
    world.honest("clouds_in", "events_in", late=True)
    world.beside(half_events_as_honest, 100, newcomer=LATE, late=8.0)
    world.figures.append(holds("places were taken, and some gave way", "gave way to others" in world.car.text()))


@scenario("filling-requests", 5, "16 MB requests without an end: memory")
def filling(world):
    world.honest("clouds_in", "clouds_out")
    world.beside(filling_requests, 2 if world.scale.short else 3, 4 if world.scale.short else 15,
                 newcomer="new=listen:0x4001:1:udp", late=8.0)


def reordering_source(log, rate, size, within_s, until):
    """Offers the clouds, and sends their segments as a network does that puts them in another order within some time."""
    source = Attacker(ADDRESS["honest"])
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.bind((source.address, 41001))
    out.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 8 << 20)
    where = None
    dice = random.Random(1)
    session = 0
    with open(log, "w", encoding="ascii", buffering=1) as lines:
        for i in pace(rate):
            if i % max(rate // 2, 1) == 0:
                source.offer(0x5001, 41001)
            for entries, option, sender in source.heard():
                for entry in entries:
                    if entry[0] == 6 and option:
                        where = option
                        source.say(bytes([7, 0, 0, 0]) + entry[4:], to=sender[0])
            if not where:
                continue
            session = session % 0xFFFF + 1
            now = time.monotonic_ns()
            payload = cloud(now, size)
            pieces = [(offset, payload[offset:offset + 1392]) for offset in range(0, len(payload), 1392)]
            # A segment takes 1.2 us on a wire of 10 Gbit/s; each is late by up to `within_s`.
            late = within_s if until[0] <= time.monotonic() < until[1] else 0
            order = sorted(range(len(pieces)), key=lambda n, late=late: n * 1.2e-6 + dice.random() * late)
            lines.write(f"S clouds_in {now}\n")
            for n in order:
                offset, piece = pieces[n]
                out.sendto(segment(0x5001, 0x8001, offset, piece, offset + 1392 < len(payload), session), where)


@scenario("reordered-1ms", 5, "the network reorders segments within 1 ms")
def reordered(world):
    scale = world.scale
    world.honest(routes=world.route_of("clouds_in"), ends=["clouds_in=read:/clouds_in:cloud"])
    log = world.lab.folder / "source.out"
    rate = 3 if scale.short else 10
    began = time.monotonic() + 4 + scale.quiet_s
    world.lab.fork("honest", reordering_source, log, rate, 1_000_000, 1e-3, (began, began + scale.attack_s))
    world.pass_time(began + scale.attack_s + 2 - time.monotonic(), "reordered")
    source, here = flows.read(log)[0]["clouds_in"], flows.read(world.car_end.out)[0]["clouds_in"]
    first = int(began * 1e9)
    alone = events(source, here, int((began - scale.quiet_s) * 1e9), first)
    seen = events(source, here, first, int((began + scale.attack_s) * 1e9))
    if not alone.kept:
        raise Failed("no cloud came, even in order")
    world.figures.append(at_least("clouds_in kept", 100 * seen.percent / alone.percent, 95, "%", alone=alone.percent))
