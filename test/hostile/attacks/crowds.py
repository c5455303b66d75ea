"""So many of everything that no room is left for others."""
import socket
import subprocess
import time

from attacker import CAR, Attacker, open_udp, pace
from figures import at_most, holds
from lab import ADDRESS, ATTACKERS, MANY, SILENT, STRANGERS, Failed
from scenario import scenario
from wire import ENDLESS, GROUP, SD_PORT, endpoint, sd, service_entry, subscribe_entry
from world import LATE
import flows


def many_hosts(rate):
    """Ordinary hosts, each of which offers and subscribes; their sessions count up as they should."""
    hosts = [Attacker(address) for address in MANY]
    sinks = [open_udp(address, 6000) for address in MANY]
    for i in pace(rate * len(hosts)):
        host = hosts[i % len(hosts)]
        host.say(subscribe_entry(0x4002, ttl=10), endpoint(host.address, 6000))
        host.say(service_entry(1, 0x6000 + i % len(hosts), ttl=10, options=1), endpoint(host.address, 6001), to=GROUP)
        for _ in host.heard():
            pass
    del sinks


@scenario("120-peers", 11, "120 ordinary hosts that offer and subscribe; a bridge by default has room for 64 subscribers")
def many_peers(world):
    world.honest("events_out", "events_in", "calls_udp")
    world.beside(many_hosts, 0.5)
    world.figures.append(holds("the log names the setting", "limits: max_subscribers_per_eventgroup" in world.car.text()))


@scenario("120-peers-with-room", 11, "the same, and the limit that the log names is raised")
def many_peers_with_room(world):
    world.honest("events_out", "events_in", "calls_udp", more="\n  limits: {max_subscribers_per_eventgroup: 200}")
    world.beside(many_hosts, 0.5, newcomer="new=listen:0x4002:1:udp")
    world.figures.append(holds("nobody is refused", "no room for" not in world.car.text()))


def many_ports(rate):
    """16 ordinary hosts with 16 ports each. Each datagram has 80 entries that subscribe and unsubscribe in turn."""
    entries = b"".join(subscribe_entry(0x4002, ttl=3 * (n % 2)) for n in range(80))
    sinks = [open_udp(address, 6000) for address in MANY[:16]]
    senders = [(open_udp(address), endpoint(address, 6000)) for address in MANY[:16] for _ in range(16)]
    for i in pace(rate):
        sender, option = senders[i % len(senders)]
        sender.sendto(sd(entries, option, 1 + i // len(senders) % 0xFFFF), (CAR, SD_PORT))
    del sinks


@scenario("many-ports", 12, "1000 datagrams/s with 80 Subscribes and StopSubscribes each, from 16 ports of 16 hosts each")
def ports_of_many(world):
    world.honest("events_out", "events_in", "clouds_out", "calls_udp")
    world.beside(many_ports, 100 if world.scale.short else 1000, newcomer="new=listen:0x4002:1:udp")


def pretend_hosts(rate):
    """Peers that nobody ever hears of again."""
    attacker = Attacker()
    for i in pace(rate):
        silent = SILENT[i % len(SILENT)]
        attacker.say_as(silent, service_entry(1, 0x6000 + i % 4000, ttl=ENDLESS, options=1), endpoint(silent, 6000))


@scenario("endless-offers", 11, "300 forged offers/s with endless TTL, each from another address")
def endless_offers(world):
    """The tables are full then; a new honest service has to be found all the same."""
    world.honest("events_out", "events_in", late=True)
    world.beside(pretend_hosts, 300, newcomer=LATE)


def ever_new(rate, kind):
    """Each datagram comes from an address that was never heard, and is never heard again."""
    attacker = Attacker()
    for i in pace(rate):
        stranger = STRANGERS[i % len(STRANGERS)]
        option = endpoint(stranger, 6000)
        if kind == "offers":
            attacker.say_as(stranger, service_entry(1, 0x6000 + i % 4000, options=1), option)
        elif kind == "subscribes":
            attacker.say_as(stranger, subscribe_entry(0x4002), option)
        elif kind == "finds":
            attacker.say_as(stranger, service_entry(0, 0x4002))


def _add_ever_new(kind, newcomer):
    @scenario(f"new-addresses-{kind}", 11, f"500 datagrams/s with {kind}, each from a new address: 5,000 of them")
    def run(world):
        world.honest("events_out", "events_in", "clouds_out", "calls_udp", late=newcomer == LATE)
        world.beside(ever_new, 100 if world.scale.short else 500, kind, newcomer=newcomer)


for _kind, _newcomer in ("offers", LATE), ("subscribes", "new=listen:0x4002:1:udp"), ("finds", "new=listen:0x4002:1:udp"):
    _add_ever_new(_kind, _newcomer)


def come_again(rate, count):
    """From addresses that are there, as the network sees it; each speaks once in a while, and does not hear the answers."""
    addresses = [f"10.84.{100 + i // 250}.{1 + i % 250}" for i in range(count)]
    subprocess.run(["ip", "-batch", "-"], input="\n".join(f"address add {a}/16 dev eth0" for a in addresses), text=True,
                   check=True)
    attacker = Attacker()
    for i in pace(rate):
        source = addresses[i % count]
        attacker.say_as(source, subscribe_entry(0x4002, ttl=ENDLESS), endpoint(source, 6000), session=1 + i // count)


@scenario("addresses-come-again", 11, "300 Subscribes/s from 600 addresses that are there, each every 2 s")
def addresses_come_again(world):
    world.honest("events_out", "calls_udp")
    world.beside(come_again, 300, 600, newcomer="new=listen:0x4002:1:udp")


def keep_subscribing(rate, addresses):
    """As hosts that do not answer what they are offered; each of them subscribes again and again."""
    attacker = Attacker()
    sinks = [open_udp(address, 6000) for address in addresses if address in MANY]
    for i in pace(rate):
        source = addresses[i % len(addresses)]
        attacker.say_as(source, subscribe_entry(0x4002), endpoint(source, 6000), session=1 + i // len(addresses) % 0xFFFF)
    del sinks


@scenario("100-forged-peers", 11, "100 addresses that nobody has subscribe each second; there are 64 places")
def forged_peers(world):
    world.honest("events_out", "calls_udp")
    world.beside(keep_subscribing, 100, SILENT[:100], newcomer="new=listen:0x4002:1:udp")


@scenario("70-peers-that-do-not-answer", 11, "70 hosts subscribe each second, and never because of an Offer; there are 64 places")
def peers_that_do_not_answer(world):
    world.honest("events_out", "calls_udp")
    world.beside(keep_subscribing, 70, MANY[:70], newcomer="new=listen:0x4002:1:udp")


@scenario("400-forged-peers", 11, "2,000 Subscribes/s from 400 addresses that nobody has")
def fast_forged_peers(world):
    world.honest("events_out", "calls_udp")
    world.beside(keep_subscribing, 400 if world.scale.short else 2000, SILENT[:400], newcomer="new=listen:0x4002:1:udp")


def many_subscriptions(rate, count):
    """As many subscriptions as can be from one host, to one eventgroup."""
    attacker = Attacker()
    sinks = [open_udp(attacker.address) for _ in range(count)]
    for i in pace(rate):
        attacker.subscribe(0x4002, endpoint(*sinks[i % count].getsockname()), ttl=ENDLESS)


def subscribe_to_clouds(count, each):
    """Ordinary subscriptions, each at a port of its own. Their samples are more than the bridge can send."""
    hosts = [Attacker(address) for address in MANY[:count]]
    sinks = [(host, open_udp(host.address)) for host in hosts for _ in range(each)]
    for _ in pace(2):
        for host, sink in sinks:
            host.subscribe(0x4001, endpoint(*sink.getsockname()), ttl=5)


@scenario("16-cloud-subscriptions", 2, "16 subscriptions of one host to the clouds of 1 MB")
def cloud_subscriptions(world):
    world.honest("clouds_out", "events_out")
    world.beside(subscribe_to_clouds, 1, 16, newcomer="new=listen:0x4002:1:udp")


@scenario("64-subscriptions", 11, "64 subscriptions of one host to one eventgroup")
def subscriptions(world):
    world.honest("events_out", "clouds_out")
    world.beside(many_subscriptions, 100, 64, newcomer="new=listen:0x4002:1:udp")
