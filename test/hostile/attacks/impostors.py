"""Hosts that say they are others."""
import pathlib
import random
import socket
import time

import flows
from attacker import CAR, Attacker, open_udp, pace
from figures import Figure, at_least, at_most
from lab import ADDRESS, MANY, SILENT, STRANGERS, Failed
from scenario import scenario
from wire import (ENDLESS, GROUP, RESPONSE, SD_PORT, TCP, UDP, cloud, endpoint, load_balancing, sd_endpoint, service_entry,
                  someip)
from world import FLOWS, LATE, route

HONEST = ADDRESS["honest"]
FORGED_STAMP = 10**9  # which no message of ours has


def forged_cloud():
    return someip(0x5002, 0x8001, cloud(FORGED_STAMP, 200))


def reboot_as_honest(rate):
    """Empty SD messages that name the honest host as their SD endpoint, each with its first session again."""
    attacker = Attacker()
    for _ in pace(rate):
        attacker.say(b"", sd_endpoint(HONEST), session=1)


@scenario("named-endpoint-reboots", 7, "2 empty SD messages/s that name the honest host by an SD Endpoint option")
def named_reboots(world):
    world.honest("clouds_in", "events_in", "clouds_out", "clouds_out_tcp")
    world.beside(reboot_as_honest, 2, newcomer="new=listen:0x4001:1:udp")


def offer_and_forge(rate, sd_option, first):
    """Offers the honest host's service at the attacker's endpoint, and sends events of it."""
    attacker = Attacker()
    source = open_udp(attacker.address, 41002)
    for i in pace(rate):
        if i % max(rate // 4, 1) == 0:
            entry = service_entry(1, 0x5002, ttl=3, options=1, first=1 if sd_option else 0)
            option = (sd_endpoint(HONEST) if sd_option else b"") + endpoint(attacker.address, 41002)
            attacker.say(entry, option, session=None)
            attacker.say(entry, option, to=GROUP)
        for entries, _, sender in attacker.heard():
            for entry in entries:
                if entry[0] == 6 and first:
                    attacker.say(bytes([7, 0, 0, 0]) + entry[4:], to=sender[0])
        source.sendto(forged_cloud(), (CAR, 45002))


@scenario("named-endpoint-offers", 7, "an Offer as of the honest host, with the attacker's endpoint, and events from there")
def named_offers(world):
    world.honest("events_in", "clouds_in", late=True)
    world.beside(offer_and_forge, 20, True, False, newcomer=LATE, forging=True)


def serve_tcp():
    """The honest service of another stack: offered over both, subscribed to over TCP, and silent."""
    honest = Attacker(HONEST)
    sink = open_udp(HONEST, 42002)
    listener = socket.create_server((HONEST, 42003))
    listener.setblocking(False)
    connections = []
    options = endpoint(HONEST, 42002) + endpoint(HONEST, 42003, TCP)
    for i in pace(10):
        try:
            connections.append(listener.accept()[0])
        except BlockingIOError:
            pass
        if i % 10 == 0:
            for to in GROUP, CAR:
                honest.say(service_entry(1, 0x5002, ttl=3, options=2), options, to)
        for entries, _, sender in honest.heard():
            for entry in entries:
                if entry[0] == 6:  # a Subscribe
                    honest.say(bytes([7, 0, 0, 0]) + entry[4:], to=sender[0])
    sink.close()


def forge_datagrams():
    attacker = Attacker()
    for i in pace(20):
        attacker.send_as((HONEST, 42002), someip(0x5002, 0x8001, cloud(10**9, 200), session=1 + i), (CAR, 40002))


@scenario("tcp-route-udp-events", 7, "datagrams in the name of the server of a route over TCP, whose service is offered over UDP, too")
def tcp_route(world):
    routes = route("/tcp_in", 0x5002, "someip_to_dds", more=", transport: tcp") + FLOWS["events_out"].route
    car = world.bridge("car", "bridge", "routes:\n" + routes)
    end = world.end("car", "car-end", "dds", 80, "tcp_in=read:/tcp_in:cloud",
                    "events_out=publish:/events_out:cloud:200:20")
    world.lab.fork("honest", serve_tcp)
    world.wait(lambda: "subscribed to eventgroup" in car.text(), "the route is not subscribed")
    child = world.lab.fork("attacker", forge_datagrams)
    world.pass_time(world.scale.attack_s, "attacked")
    world.lab.end(child)
    taken = flows.read(end.out)[0]["tcp_in"].received
    world.figures.append(at_most("forged and accepted", len(taken), 0))


@scenario("second-offer", 10, "an impostor offers an instance of the honest host second, and sends events")
def second_offer(world):
    world.honest("events_in", "clouds_in", late=True)
    world.beside(offer_and_forge, 20, False, True, newcomer=LATE, forging=True)


def offer_only(rate):
    attacker = Attacker()
    sink = open_udp(attacker.address, 41002)
    for _ in pace(rate):
        attacker.offer(0x5002, 41002)
        attacker.offer(0x5002, 41002, to=CAR)
    sink.close()


def offer_once(rate):
    """In the name of an address that nobody has, and then never again."""
    attacker = Attacker()
    for i in range(2):
        entry = service_entry(1, 0x5002, ttl=ENDLESS, options=1)
        attacker.say_as(SILENT[0], entry, endpoint(SILENT[0], 41100), session=1 + i)
        time.sleep(1 / rate)
    time.sleep(600)


def offer_other_ports(rate):
    attacker = Attacker()
    for i in pace(rate):
        attacker.offer(0x5002, 41100 + i % 40)
        attacker.offer(0x5002, 41100 + i % 40, to=CAR)


def offer_anew(rate):
    """Each message withdraws the offer before."""
    attacker = Attacker()
    entries = service_entry(1, 0x5002, ttl=0, options=1) + service_entry(1, 0x5002, ttl=3, options=1)
    for _ in pace(rate):
        attacker.say(entries, endpoint(attacker.address, 41100), GROUP)
        attacker.say(entries, endpoint(attacker.address, 41100), CAR)


def offer_and_refuse(rate):
    """Answers each Subscribe with a Nack."""
    attacker = Attacker()
    for _ in pace(rate):
        attacker.offer(0x5002, 41100)
        attacker.offer(0x5002, 41100, to=CAR)
        for entries, _, sender in attacker.heard():
            for entry in entries:
                if entry[0] == 6:
                    attacker.say(bytes([7, 0, 0, 0]) + entry[4:9] + bytes(3) + entry[12:], to=sender[0])


def first_offer(world, attack, rate, more="", tcp=False, within_s=2):
    """The honest host comes while the impostor is there; its events have to come through all the same."""
    world.honest(routes=route("/events_in", 0x5002, "someip_to_dds", None if tcp else 45002, more=more),
                 ends=["events_in=read:/events_in:cloud"])
    child = world.lab.fork("attacker", attack, rate)
    world.pass_time(2, "the impostor alone")
    begin = time.monotonic_ns()
    end = world.end("honest", "honest-end", "peer", HONEST,
                    f"events_in=notify:0x5002:1:200:{world.scale.event_hz}" + (":tcp" if tcp else ""))
    world.pass_time(max(world.scale.attack_s, within_s + 3), "both offer")
    world.lab.end(child)
    here, there = flows.read(world.car_end.out)[0]["events_in"], flows.read(end.out)[0]["events_in"]
    first = min((came for _, came in here.received), default=None)
    wait = (first - begin) / 1e9 if first else float("inf")
    world.figures.append(at_most("the honest one is carried after", wait, within_s, "s", timed=bool(first)))
    seen = flows.events(there, here, first or begin, time.monotonic_ns() - int(1e9))
    world.figures.append(at_least("events_in kept from then on", seen.percent, 95, "%"))


def offer_other_minor(rate):
    attacker = Attacker()
    for _ in pace(rate):
        for to in GROUP, CAR:
            attacker.say(service_entry(1, 0x5002, options=1, minor=7), endpoint(attacker.address, 41002), to)


def offer_udp_only(rate):
    attacker = Attacker()
    for _ in pace(rate):
        for to in GROUP, CAR:
            attacker.offer(0x5002, 41002, to=to)


def offer_in_turn(rate):
    """20 hosts, one after another."""
    hosts = [Attacker(address) for address in MANY[:20]]
    for i in pace(rate):
        for to in GROUP, CAR:
            hosts[i % len(hosts)].offer(0x5002, 41002, to=to)


for _name, _what, _attack, _rate in (
        ("first-offer", "offers an instance first, and does not answer", offer_only, 2),
        ("first-offer-once", "offers an instance twice, without end, from an address that nobody has", offer_once, 5),
        ("first-offer-ports", "offers an instance first, at ever other ports", offer_other_ports, 4),
        ("first-offer-anew", "offers an instance first, and withdraws it each time", offer_anew, 4),
        ("first-offer-refused", "offers an instance first, and refuses each subscription", offer_and_refuse, 4)):
    scenario(_name, 10, f"an impostor {_what}")(
        lambda world, attack=_attack, rate=_rate: first_offer(world, attack, rate))


@scenario("first-offer-minor", 10, "an impostor offers another minor version of an instance first than the route wants")
def first_offer_minor(world):
    first_offer(world, offer_other_minor, 4, more=", minor: 0")


@scenario("first-offer-udp", 10, "an impostor offers an instance first, and only over UDP, of which the route wants TCP")
def first_offer_udp(world):
    first_offer(world, offer_udp_only, 4, more=", transport: tcp", tcp=True)


def offer_as_strangers(rate):
    """In the names of 2,000 addresses that nobody has."""
    attacker = Attacker()
    strangers = STRANGERS[:2000]
    for i in pace(rate):
        stranger = strangers[i % len(strangers)]
        attacker.say_as(stranger, service_entry(1, 0x5002, ttl=3, options=1), endpoint(stranger, 41100),
                        session=1 + i // len(strangers))


@scenario("first-offers-in-turn", 10, "20 impostors offer an instance first, in turn, and do not answer")
def first_offers_in_turn(world):
    first_offer(world, offer_in_turn, 20)


@scenario("first-offers-forged", 10, "100 Offers/s of an instance, first, from 2,000 addresses that nobody has")
def first_offers_forged(world):
    first_offer(world, offer_as_strangers, 100)


def offer_for_calls(rate, protocol):
    """At a port where nobody answers."""
    attacker = Attacker()
    for _ in pace(rate):
        for to in GROUP, ADDRESS["second"]:
            attacker.say(service_entry(1, 0x5100, options=1), endpoint(attacker.address, 41099, protocol), to)


def called_over(world, offered, how):
    child = world.lab.fork("attacker", offer_for_calls, 4, offered)
    world.pass_time(1, "the impostor alone")
    client = world.end("second", "client", "peer", ADDRESS["second"], f"calls=call:0x5100:1:1:16:{world.scale.call_hz}:{how}")
    world.pass_time(1, "the impostor alone")
    begin = time.monotonic_ns()
    world.end("honest", "server", "peer", HONEST, "served=serve:0x5100:1:200")
    world.pass_time(max(world.scale.attack_s, 6), "both offer")
    ended = time.monotonic_ns()
    world.lab.end(child)
    world.pass_time(1.5, "what comes late")
    seen = flows.read(client.out)[0]["calls"]
    first = min((called for called, answered in seen.calls if answered), default=None)
    wait = (first - begin) / 1e9 if first else float("inf")
    world.figures.append(at_most("the honest one is called after", wait, 2, "s", timed=bool(first)))
    later = flows.calls(seen, begin + int(2e9), ended)
    world.figures.append(at_least("calls answered by it from then on", later.percent, 95, "%"))


for _name, _what, _offered, _how in (
        ("called-refused", "refuses the connection that calls need", TCP, "tcp"),
        ("called-udp", "offers only UDP where calls need TCP", UDP, "tcp"),
        ("called-tcp", "offers only TCP where calls need UDP", TCP, "udp")):
    scenario(_name, 10, f"an impostor that offers an instance first {_what}")(
        lambda world, offered=_offered, how=_how: called_over(world, offered, how))


@scenario("restart-impostor", 10, "an impostor that acknowledges and sends events, while the honest host restarts")
def restart_impostor(world):
    """Whoever holds the instance meanwhile, the honest host gets it back, and then nothing forged is accepted."""
    world.honest(routes=world.route_of("events_in"), ends=["events_in=read:/events_in:cloud"])
    parts = ("peer", HONEST, f"events_in=notify:0x5002:1:200:{world.scale.event_hz}")
    before = world.end("honest", "honest-end", *parts)
    received = lambda: flows.read(world.car_end.out)[0]["events_in"]  # noqa: E731
    world.wait(lambda: received().received, "nothing comes through the bridge")
    world.pass_time(6, "without the attack")
    child = world.lab.fork("attacker", offer_and_forge, 20, False, True)
    world.pass_time(1, "both offer")
    before.stop()
    away = time.monotonic_ns()
    world.pass_time(2.5, "the impostor alone")
    back = time.monotonic_ns()
    after = world.end("honest", "honest-again", *parts)
    world.pass_time(max(world.scale.attack_s, 6), "both offer again")
    world.lab.end(child)
    there, here = flows.read(after.out)[0]["events_in"], received()
    known = set(there.sent)
    first = min((came for stamp, came in here.received if stamp in known), default=None)
    taken = sum(1 for stamp, came in here.received if stamp not in known and away + 1e9 < came < back)
    wait = (first - back) / 1e9 if first else float("inf")
    world.figures.append(Figure("forged and accepted while the honest one is away", taken))
    world.figures.append(at_most("the honest one is carried after", wait, 2, "s", timed=bool(first)))
    seen = flows.events(there, here, first or back, time.monotonic_ns() - int(1e9))
    world.figures.append(at_most("forged and accepted from then on", seen.forged, 0))
    world.figures.append(at_least("events_in kept from then on", seen.percent, 95, "%"))


def offer_ever_others(rate, service):
    """A new instance each time, with the best priority."""
    attacker = Attacker()
    sink = open_udp(attacker.address, 41003)
    for i in pace(rate):
        for to in GROUP, ADDRESS["second"]:
            attacker.offer(service, 41003, more=load_balancing(0, 65535), options=2, instance=0x100 + i % 2000, to=to)
    sink.close()


def offer_better(rate, service, instance):
    attacker = Attacker()
    sink = open_udp(attacker.address, 41003)
    for _ in pace(rate):
        attacker.offer(service, 41003, more=load_balancing(0, 65535), options=2, instance=instance)
    sink.close()


@scenario("better-priority", 10, "an impostor offers another instance with a better priority")
def better_priority(world):
    server = world.end("honest", "server", "peer", HONEST, "served=serve:0x5100:1:200")
    client = world.end("second", "client", "peer", ADDRESS["second"],
                       f"calls=call:0x5100:0xffff:1:16:{world.scale.call_hz}:udp")
    world.wait(lambda: any(answered for _, answered in flows.read(client.out)[0]["calls"].calls), "no call is answered")
    world.pass_time(world.scale.quiet_s, "without the attack")
    began = time.monotonic_ns()
    child = world.lab.fork("attacker", offer_better, 2, 0x5100, 0x77)
    world.pass_time(world.scale.attack_s, "attacked")
    ended = time.monotonic_ns()
    world.lab.end(child)
    world.pass_time(1.5, "what comes late")
    seen = flows.calls(flows.read(client.out)[0]["calls"], began, ended)
    world.figures.append(at_least("calls answered by the honest one", seen.percent, 95, "%"))
    assert server.running()


def called_first(world, attack, *arguments):
    """Nobody can tell at first which of two instances is the honest one: three calls may be lost."""
    world.end("honest", "server", "peer", HONEST, "served=serve:0x5100:1:200")
    child = world.lab.fork("attacker", attack, *arguments)
    world.pass_time(2, "both offer")
    client = world.end("second", "client", "peer", ADDRESS["second"],
                       f"calls=call:0x5100:0xffff:1:16:{world.scale.call_hz}:udp")
    world.pass_time(world.scale.attack_s + 1, "attacked")
    ended = time.monotonic_ns()
    world.lab.end(child)
    world.pass_time(1.5, "what comes late")
    seen = flows.read(client.out)[0]["calls"]
    began = min((called for called, _ in seen.calls), default=ended)
    first = min((called for called, answered in seen.calls if answered), default=None)
    wait = (first - began) / 1e9 if first else float("inf")
    world.figures.append(at_most("the honest one is called after", wait, 2, "s", timed=bool(first)))
    later = flows.calls(seen, began + int(2e9), ended)
    world.figures.append(at_least("calls answered by it from then on", later.percent, 95, "%"))


@scenario("better-priority-first", 10, "the same, to a client that comes when both are there")
def better_priority_first(world):
    called_first(world, offer_better, 2, 0x5100, 0x77)


@scenario("ever-other-instances", 10, "an impostor offers 50 instances/s with a better priority, and answers no calls")
def ever_other_instances(world):
    called_first(world, offer_ever_others, 50, 0x5100)


@scenario("better-priority-away", 10, "the same, while the honest one is away for some seconds")
def better_priority_away(world):
    parts = ("peer", HONEST, "served=serve:0x5100:1:200")
    server = world.end("honest", "server", *parts)
    client = world.end("second", "client", "peer", ADDRESS["second"],
                       f"calls=call:0x5100:0xffff:1:16:{world.scale.call_hz}:udp")
    world.wait(lambda: any(answered for _, answered in flows.read(client.out)[0]["calls"].calls), "no call is answered")
    child = world.lab.fork("attacker", offer_better, 2, 0x5100, 0x77)
    world.pass_time(1, "both offer")
    server.stop()
    world.pass_time(2.5, "the impostor alone")
    back = time.monotonic_ns()
    world.end("honest", "server-again", *parts)
    world.pass_time(world.scale.attack_s + 1, "both offer again")
    ended = time.monotonic_ns()
    world.lab.end(child)
    world.pass_time(1.5, "what comes late")
    seen = flows.read(client.out)[0]["calls"]
    first = min((called for called, answered in seen.calls if answered and called >= back), default=None)
    wait = (first - back) / 1e9 if first else float("inf")
    world.figures.append(at_most("the honest one is called after", wait, 2, "s", timed=bool(first)))
    later = flows.calls(seen, back + int(2e9), ended)
    world.figures.append(at_least("calls answered by it from then on", later.percent, 95, "%"))


def forge_answers(server, client):
    """Answers to calls of the client: from an address of the attacker's with each session that may be outstanding, and in
    the server's name with such as are guessed."""
    attacker = Attacker()
    own = open_udp(attacker.address, 41004)
    dice = random.Random(1)
    for i in pace(200):
        for session in range(1 + 10 * i % 2000, 11 + 10 * i % 2000):
            own.sendto(forged_answer(session), client)
        attacker.send_as(server, forged_answer(dice.randrange(2000, 0x10000)), client)


def forged_answer(session):
    return someip(0x5100, 1, b"\xf0" * 16, session, RESPONSE, client=1)


def udp_ports(program, address):
    """The UDP ports that a program has at its address, but for service discovery's."""
    own = socket.inet_aton(address)[::-1].hex().upper()
    lines = pathlib.Path(f"/proc/{program.pid}/net/udp").read_text(encoding="ascii").splitlines()[1:]
    places = [line.split()[1].split(":") for line in lines]
    return [int(port, 16) for where, port in places if where == own and int(port, 16) != SD_PORT]


@scenario("forged-answers", 7, "answers to outstanding calls, from a third address and with guessed sessions")
def forged_answers(world):
    server = world.end("honest", "server", "peer", HONEST, "served=serve:0x5100:1:200")
    client = world.end("second", "client", "peer", ADDRESS["second"],
                       f"calls=call:0x5100:1:1:16:{world.scale.call_hz}:udp")
    record = lambda: flows.read(client.out)[0]["calls"]  # noqa: E731
    world.wait(lambda: any(answered for _, answered in record().calls), "no call is answered")
    where = [(HONEST, port) for port in udp_ports(server, HONEST)]
    to = [(ADDRESS["second"], port) for port in udp_ports(client, ADDRESS["second"])]
    if len(where) != 1 or len(to) != 1:
        raise Failed(f"one UDP port of each is expected, not {where} and {to}")
    world.pass_time(world.scale.quiet_s, "without the attack")
    began = time.monotonic_ns()
    child = world.lab.fork("attacker", forge_answers, where[0], to[0])
    world.pass_time(world.scale.attack_s, "attacked")
    ended = time.monotonic_ns()
    world.lab.end(child)
    world.pass_time(1.5, "what comes late")
    seen = flows.calls(record(), began, ended)
    world.figures.append(at_least("calls answered", seen.percent, 95, "%"))
    world.figures.append(at_most("forged and accepted", len(record().forged), 0))
