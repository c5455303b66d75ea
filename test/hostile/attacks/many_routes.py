"""A thousand routes of a thousand services between two bridges."""
import signal
import struct
import time

import flows
from attacker import Attacker, open_udp, pace
from figures import Figure, at_least, at_most, holds
from lab import ADDRESS, PATIENCE, Failed
from scenario import scenario
from wire import ENDLESS, GROUP, endpoint, service_entry, subscribe_entry
from world import route

MESSAGE = "std_msgs/msg/String"
SAMPLED = 20  # topics that are published and read


def _subscribed(bridge):
    """How many of its routes have their subscription, as its counters say."""
    before = bridge.out.stat().st_size
    bridge.send_signal(signal.SIGUSR1)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        time.sleep(0.05)
        text = bridge.out.read_bytes()[before:]
        if b"SOME/IP-SD: " in text and text.endswith(b"\n"):
            return text.count(b"subscribed 1")
    raise Failed("the bridge does not tell its counters")


def _wait(world, bridge, count, begin, patience):
    """Seconds from `begin` until it has so many, and how many it has."""
    while True:
        have = _subscribed(bridge)
        if have >= count or time.monotonic() > begin + patience:
            return time.monotonic() - begin, have
        world.progress(f"{have} of {count} subscribed, {begin + patience - time.monotonic():.0f} s to go")
        world.check()
        time.sleep(0.1)


def _carrying(world, bridge, times=1):
    world.wait(lambda: bridge.text().count("info carrying ") >= times, f"{bridge.name} does not start")


def _bridges(world, count):
    offers = "".join(route(f"/t{i}", 0x1000 + i, "dds_to_someip", 40001, MESSAGE) for i in range(count))
    wants = "".join(route(f"/t{i}", 0x1000 + i, "someip_to_dds", None, MESSAGE) for i in range(count))

    def start(name):
        host = "car" if name.startswith("offering") else "honest"
        # Domains of one number would wait for each other.
        return world.bridge(host, name, "routes:\n" + (offers if host == "car" else wants), 80 if host == "car" else 81)
    return start


def _judge(world, what, waited, have, count, bridge):
    world.figures.append(at_least(f"{what}: subscribed", have, count))
    world.figures.append(at_most(f"{what}: after", waited if have >= count else float("inf"), 1, "s", timed=True))
    if have < count:
        world.figures.append(holds(f"{what}: the log says that some are not", "max_remote_services" in bridge.text()
                                   or "no room" in bridge.text()))


@scenario("1000-routes", 11, "1,000 routes of 1,000 services: start, restarts, idle")
def many(world):
    count = 300 if world.scale.short else 1000  # 256 was the limit once
    patience = 40 if world.scale.short else 10
    start = _bridges(world, count)
    server = start("offering")
    _carrying(world, server)
    began = time.monotonic()
    client = start("wanting")
    _carrying(world, client)
    _judge(world, "start", *_wait(world, client, count, began, patience), count, client)

    step = count // SAMPLED
    topics = [f"t{i}" for i in range(step - 1, count, step)]
    reader = world.end("honest", "reader", "dds", 81, *[f"{topic}=read:/{topic}:string" for topic in topics])
    world.pass_time(1.5, "who reads")
    writer = world.end("car", "writer", "dds", 80, *[f"{topic}=publish:/{topic}:string:0:5:reliable:{10}" for topic in topics])
    world.pass_time(5, "messages of some routes")
    sent, came = flows.read(writer.out)[0], flows.read(reader.out)[0]
    all_sent = sum(len(sent[topic].sent) for topic in topics)
    kept = sum(1 for topic in topics for stamp in sent[topic].sent if stamp in came[topic].came)
    world.figures.append(at_least("messages kept", 100 * kept / max(all_sent, 1), 95, "%"))
    for program in reader, writer:
        world.lab.programs.remove(program)
        program.stop()

    if not world.scale.short:
        world.pass_time(2, "calm")
        for bridge in server, client:
            before = bridge.cpu_ms()
            world.pass_time(5, "idle")
            world.figures.append(at_most(f"idle, {bridge.name}", (bridge.cpu_ms() - before) / 5, 15, "ms/s", timed=True))

    for name, number in ("offering", signal.SIGKILL), ("wanting", signal.SIGKILL), ("offering", signal.SIGTERM):
        old = server if name == "offering" else client
        world.lab.programs.remove(old)
        old.stop(number)
        starts = old.text().count("info carrying ")  # it goes on with that log
        began = time.monotonic()
        again = start(name)
        _carrying(world, again, starts + 1)
        if name == "offering":
            server = again
        else:
            client = again
        how = "killed" if number == signal.SIGKILL else "stopped"
        _judge(world, f"{name} {how} and started", *_wait(world, client, count, began, patience), count, client)
    world.car = None


def _both(world):
    """The bridge that offers 1,000 services, and the one that has subscribed to them."""
    start = _bridges(world, 1000)
    server, client = start("offering"), start("wanting")
    _carrying(world, server)
    began = time.monotonic()
    _carrying(world, client)
    _wait(world, client, 1000, began, 10)
    return server, client


def _judge_time(world, bridge, attack, *arguments):
    """How much of a processor the bridge takes during an attack."""
    world.pass_time(2, "calm")
    before = bridge.cpu_ms()
    world.pass_time(3, "calm")
    alone = (bridge.cpu_ms() - before) / 3
    child = world.lab.fork("attacker", attack, *arguments)
    world.pass_time(2, "attacked")
    before = bridge.cpu_ms()
    world.pass_time(5, "attacked")
    world.figures.append(at_most(f"the {bridge.name} bridge", (bridge.cpu_ms() - before) / 5, 100, "ms/s", timed=True,
                                 alone=alone))
    world.lab.end(child)
    world.car = None


def offer_and_withdraw(rate):
    """Services that nobody wants, 20 entries in each datagram."""
    attacker = Attacker()
    sink = open_udp(attacker.address, 41004)
    for i in pace(rate):
        numbers = range(i * 20, (i + 1) * 20)
        attacker.say(b"".join(service_entry(1, 0x8001 + n // 2 % 900, ttl=3 * (n % 2), options=1) for n in numbers),
                     endpoint(attacker.address, 41004), to=ADDRESS["honest"])
    sink.close()


@scenario("1000-offers-withdrawn", 11, "1,000 datagrams/s with 20 offers and withdrawals each beside 1,000 routes")
def withdrawn(world):
    _, client = _both(world)
    _judge_time(world, client, offer_and_withdraw, 1000)
    world.figures.append(at_least("still subscribed", _subscribed(client), 1000))


def say_what_means_nothing(rate, to, offered, entry):
    """85 entries in each datagram; `offered`: a service of this host, so that it is one that Acks may come from."""
    attacker = Attacker()
    sink = open_udp(attacker.address, 41004)
    option = endpoint(attacker.address, 41004)
    if offered:
        attacker.say(service_entry(1, offered, ttl=ENDLESS, options=1), option, to=to)
    for i in pace(rate):
        attacker.say(b"".join(entry(n) for n in range(85 * i, 85 * (i + 1))), b"" if offered else option, to=to)
    sink.close()


def unexpected_ack(number):
    return struct.pack(">BBBBHHIHH", 7, 0, 0, 0, 0x9001, 1, 1 << 24 | 3, 0, 1 + number % 60_000)


def unmeant_stop(number):
    return subscribe_entry(0x1000 + number % 1000, ttl=0)


@scenario("1000-unexpected-acks", 11, "1,000 datagrams/s with 85 Acks that nobody waits for, beside 1,000 routes")
def unexpected_acks(world):
    _, client = _both(world)
    _judge_time(world, client, say_what_means_nothing, 1000, ADDRESS["honest"], 0x9001, unexpected_ack)
    world.figures.append(at_least("still subscribed", _subscribed(client), 1000))


@scenario("1000-unmeant-stops", 11, "1,000 datagrams/s with 85 StopSubscribes of a host that has not subscribed, beside 1,000 routes")
def unmeant_stops(world):
    server, client = _both(world)
    _judge_time(world, server, say_what_means_nothing, 1000, ADDRESS["car"], 0, unmeant_stop)
    world.figures.append(at_least("still subscribed", _subscribed(client), 1000))


def offer_many(count):
    attacker = Attacker()
    sink = open_udp(attacker.address, 41004)
    for _ in pace(1):
        for first in range(0, count, 60):
            entries = b"".join(service_entry(1, 0x8000 + first + i, options=1) for i in range(60))
            attacker.say(entries, endpoint(attacker.address, 41004), to=GROUP)
    sink.close()


@scenario("1000-foreign-offers", 11, "1,000 offers of others each second beside 1,000 routes: told")
def foreign(world):
    _, client = _both(world)
    child = world.lab.fork("attacker", offer_many, 1000)
    world.pass_time(3, "foreign offers")
    before = client.cpu_ms()
    world.pass_time(5, "foreign offers")
    world.figures.append(at_most("the wanting bridge", (client.cpu_ms() - before) / 5, 60, "ms/s", timed=True))
    world.lab.end(child)
