"""Hosts that make others send to a victim."""
import time

from attacker import CAR, Attacker, open_udp, pace
from figures import Figure, at_most
from lab import ADDRESS, SILENT
from scenario import scenario
from wire import ENDLESS, REQUEST, configuration, endpoint, someip, subscribe_entry

VICTIM = ADDRESS["bystander"]
NEW_CLOUDS, NEW_EVENTS = "new=listen:0x4001:1:udp", "new=listen:0x4002:1:udp"


def be_silent(port):
    """The victim: it has the port open, so that no ICMP tells of it, and says nothing."""
    sink = open_udp(VICTIM, port)
    time.sleep(600)
    sink.close()


def subscribe_for(address, port, told):
    """One Subscribe with an endless TTL, and 9 more in case one is lost."""
    attacker = Attacker()
    options = endpoint(address, port) + (configuration(f"trestle.rcvbuf={told}") if told else b"")
    for _ in pace(5, 2):
        attacker.subscribe(0x4001, options, number=2 if told else 1, ttl=ENDLESS)
    time.sleep(600)


def _bytes_at_victim(world, attack, *arguments, most, sent):
    world.lab.fork("bystander", be_silent, 6000)
    before = world.lab.received_bytes("bystander")
    world.beside(attack, *arguments, newcomer=NEW_EVENTS)
    got = world.lab.received_bytes("bystander") - before
    world.figures.append(at_most("bytes at the victim", got / 1e3, most / 1e3, "kB"))
    world.figures.append(Figure("bytes for each that was sent", got / sent, ": 1"))


@scenario("victim-subscribed", 8, "a Subscribe that names a silent victim")
def victim_subscribed(world):
    world.honest("clouds_out", "events_out")
    _bytes_at_victim(world, subscribe_for, VICTIM, 6000, 0, most=20_000, sent=10 * 100)


@scenario("victim-as-sender", 8, "a Subscribe that says it comes from the victim: told, not judged")
def victim_as_sender(world):
    world.honest("events_out")
    world.lab.fork("bystander", be_silent, 6000)
    before = world.lab.received_bytes("bystander")
    world.beside(subscribe_as, VICTIM, 6000, newcomer=NEW_EVENTS)
    world.figures.append(Figure("bytes at the victim", (world.lab.received_bytes("bystander") - before) / 1e3, "kB"))


def subscribe_as(address, port):
    attacker = Attacker()
    for _ in pace(1, 3):
        attacker.say_as(address, subscribe_entry(0x4002, ttl=3), endpoint(address, port))
    time.sleep(600)


@scenario("buffer-of-another", 8, "a Subscribe that names the honest subscriber's endpoint with a buffer of 1 byte")
def buffer_of_another(world):
    world.honest("clouds_out", "events_out")
    world.beside(subscribe_for, ADDRESS["honest"], 45001, 1, newcomer=NEW_CLOUDS)


def get_as_victim(rate, seconds):
    attacker = Attacker()
    for i in pace(rate, seconds):
        attacker.send_as((VICTIM, 6000), someip(0x4005, 1, session=1 + i, kind=REQUEST), (CAR, 40005))
    time.sleep(600)


@scenario("getter-reflected", 9, "20 requests for a 1 MB getter that say they come from the victim")
def getter_reflected(world):
    world.honest("big_value", "calls_udp", "events_out")
    _bytes_at_victim(world, get_as_victim, 5, 4, most=100_000, sent=20 * 44)


def get_as_subscribed_victim(rate, seconds):
    """With a Subscribe in its name before each request, to something small."""
    attacker = Attacker()
    for i in pace(rate, seconds):
        attacker.say_as(VICTIM, subscribe_entry(0x4003, ttl=3), endpoint(VICTIM, 6000), session=1 + i)
        attacker.send_as((VICTIM, 6000), someip(0x4005, 1, session=1 + i, kind=REQUEST), (CAR, 40005))
    time.sleep(600)


@scenario("getter-reflected-subscribed", 9, "the same, each after a Subscribe that says it comes from the victim")
def getter_reflected_subscribed(world):
    world.honest("big_value", "calls_udp", "events_out")
    _bytes_at_victim(world, get_as_subscribed_victim, 5, 4, most=100_000, sent=20 * 144)


def subscribe_anew_as(address, port, rate, seconds, times=1):
    """Each message ends the subscription, and begins another, so many times."""
    attacker = Attacker()
    entries = (subscribe_entry(0x4005, ttl=0) + subscribe_entry(0x4005, ttl=3)) * times
    for i in pace(rate, seconds):
        attacker.say_as(address, entries, endpoint(address, port), session=1 + i)
    time.sleep(600)


@scenario("value-again-and-again", 9, "80 Subscribes to a 1 MB field that say they come from the victim: 8 values, and one in 2 s")
def value_again(world):
    world.honest("big_value", "calls_udp", "events_out")
    _bytes_at_victim(world, subscribe_anew_as, VICTIM, 6000, 20, 4, most=15_000_000, sent=80 * 100)


@scenario("small-value-often", 9, "8,000 Subscribes in 200 messages to a field of 1.3 kB that say they come from the victim")
def small_value_often(world):
    world.honest("small_value", "calls_udp", "events_out")
    _bytes_at_victim(world, subscribe_anew_as, VICTIM, 6000, 50, 4, 40, most=280_000, sent=200 * 1400)


def subscribe_in_turn(others, rate, seconds):
    """As many silent hosts as somebody might remember, and the victim."""
    attacker = Attacker()
    for i in pace(rate, seconds):
        address = SILENT[i % (others + 1)] if i % (others + 1) else VICTIM
        entries = subscribe_entry(0x4005, ttl=3) + subscribe_entry(0x4005, ttl=0)
        attacker.say_as(address, entries, endpoint(address, 6000), session=1 + i)
    time.sleep(600)


@scenario("value-in-turn", 9, "the same, 45 times, in turn for 129 silent hosts and the victim")
def value_in_turn(world):
    world.honest("big_value", "calls_udp", "events_out")
    _bytes_at_victim(world, subscribe_in_turn, 129, 1000, 6, most=15_000_000, sent=45 * 140)
