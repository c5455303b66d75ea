"""Much of what is allowed, and what the log makes of it."""
from attacker import Attacker, open_udp, pace
from scenario import scenario
from wire import endpoint, service_entry, subscribe_entry

NEW = "new=listen:0x4002:1:udp"


MANY = 20  # entries in a datagram


def flood(rate, kind):
    """So many datagrams a second."""
    attacker = Attacker()
    sink = open_udp(attacker.address)
    option = endpoint(*sink.getsockname())
    for i in pace(rate):
        numbers = range(i * MANY, (i + 1) * MANY)
        if kind == "finds":
            attacker.say(b"".join(service_entry(0, 0x4002) for _ in numbers))
        elif kind == "subscribes":  # and unsubscribes, so that each one is new
            attacker.say(b"".join(subscribe_entry(0x4002, ttl=3 * (n % 2)) for n in numbers), option)
        elif kind == "reboots":
            attacker.say(service_entry(1, 0x6001, options=1), option, session=1)
        elif kind == "refusals":
            attacker.say(b"".join(subscribe_entry(0x4002, eventgroup=2 + n % 60000) for n in numbers), option)
        elif kind == "offers":  # and withdrawals
            attacker.say(b"".join(service_entry(1, 0x6001 + n // 2 % 500, ttl=3 * (n % 2), options=1) for n in numbers),
                         option)


def offer_without_room(rate):
    """3,000 services, 80 in each datagram."""
    attacker = Attacker()
    sink = open_udp(attacker.address)
    option = endpoint(*sink.getsockname())
    offers = [b"".join(service_entry(1, 0x6001 + (80 * i + n) % 3000, ttl=3, options=1) for n in range(80)) for i in range(75)]
    for i in pace(rate):
        attacker.say(offers[i % len(offers)], option)


@scenario("flood-large-offers", 12, "1000 datagrams/s with 80 offers each")
def large_offers(world):
    world.honest("events_out", "events_in", "clouds_out", "calls_udp")
    world.beside(offer_without_room, 100 if world.scale.short else 1000, newcomer=NEW)


def _add(kind, rate, quiet):
    name = f"flood-{kind}" + ("-quiet" if quiet else "")
    what = f"{rate} datagrams/s with {kind}" + (" beside a bridge with --quiet" if quiet else "")

    @scenario(name, 12, what)
    def run(world):
        world.honest("events_out", "events_in", "clouds_out", "calls_udp", quiet=quiet)
        world.beside(flood, 100 if world.scale.short else rate, kind, newcomer=NEW)


for one in "finds", "subscribes", "reboots", "refusals", "offers":
    _add(one, 1000, False)
for one in "subscribes", "reboots", "refusals":
    _add(one, 1000, True)
