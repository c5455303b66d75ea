"""A bad network: frames are lost, doubled, delayed and come in another order."""
import time

from fault_world import FLOWS, Figure, Scale, at_least, at_most, holds
from relay import IN, OUT, Quality, Relay
from scenario import scenario

SEED = 27
CLOUD_BYTES = 14_000  # ten segments
FLOW_WAYS = {"events_out": (OUT, 0x4002), "clouds_out": (OUT, 0x4001), "events_in": (IN, 0x5002), "clouds_in": (IN, 0x5001)}


def add(name, what, quality, cloud_hz=20, in_order=True):
    """in_order: SD messages never come in another order, which the specification takes for a reboot of their sender."""
    @scenario(name, 9, what)
    def bad_network(world):
        """Over such a network from the start, so that what is to be found has to be found over it."""
        seconds = 6 if world.scale.short else 20
        world.scale = Scale(world.scale.short, 1, 1, CLOUD_BYTES, cloud_hz, 20, 10)
        relay = Relay(world.lab, ("car", "honest"), quality, SEED)
        began = time.monotonic_ns()
        world.honest(*FLOW_WAYS, "calls_udp", "calls_tcp")
        found = [first[1] for record in world.all_flows().values() for first in record.received[:1]]
        # Three offers in a row are lost by 0.8 % at a loss of a fifth, and each comes a second after the one before.
        world.figures.append(at_most("all is found after", (max(found) - began) / 1e9, 5.0, "s", timed=True))
        world.pass_time(2, "is served")
        memory, descriptors = world.car.rss(), world.descriptors(world.car)
        before, first = world.counters_of(world.car), time.monotonic_ns()
        world.pass_time(seconds, "over a bad network")
        last = time.monotonic_ns()
        world.pass_time(2, "what comes late")
        judge(world, relay.read(), first, last, in_order)
        world.figures.append(Figure("memory afterwards", world.car.rss() / 1e6, "MB", "+ 4 MB", world.car.rss() <= memory + 4e6,
                                    alone=memory / 1e6))
        world.figures.append(at_most("descriptors afterwards", world.descriptors(world.car), descriptors + 4))
        world.figures.append(holds("the bridge goes on", world.car.running()))
        world.figures.append(at_most("log", world.car.log_bytes() / 1e3, 64, "kB"))
        reboots = (world.counters_of(world.car)["SOME/IP-SD"]["reboots_detected"] - before["SOME/IP-SD"]["reboots_detected"])
        told = "reboots that were none"
        world.figures.append(at_most(told, reboots, 0) if in_order else Figure(told, reboots))


def judge(world, carried, first, last, in_order):
    """Of each flow: what came whole arrived, and nothing else did."""
    missing = made_up = whole_of_all = broken_of_all = 0
    worst = 100.0
    for name, (way, service) in FLOW_WAYS.items():
        record = world.all_flows()[name]
        whole, broken = ({stamp for stamp in some if first <= stamp < last} for some in carried.of(way, service))
        received = set(record.came)
        missing += len(whole - received)
        made_up += len(received & broken)
        whole_of_all, broken_of_all = whole_of_all + len(whole), broken_of_all + len(broken)
        sent = [stamp for stamp in record.sent_by_other if first <= stamp < last]
        worst = min(worst, 100 * len(whole | broken) / max(1, len(sent)))
    world.figures.append(Figure("frames of events that were lost", 100 * carried.lost / max(1, carried.frames), "%"))
    world.figures.append(at_least("messages that came whole", whole_of_all, 20))
    world.figures.append(Figure("messages of which something was lost", broken_of_all))
    # What comes while the receiver has lost the service by such a reboot is of nobody that it knows.
    lost = 100 * missing / max(1, whole_of_all)
    world.figures.append(at_most("came whole, and did not arrive", missing, 0) if in_order else
                         at_most("came whole, and did not arrive", lost, 20, "%"))
    world.figures.append(at_most("arrived, though something was lost", made_up, 0))
    world.figures.append(at_least("sent, of what was to be sent, in the worst flow", worst, 70 if in_order else 30, "%"))


add("loss-1", "1 % of all frames is lost, in each direction", Quality(loss=0.01))
add("loss-5", "5 % of all frames is lost", Quality(loss=0.05))
add("loss-20", "20 % of all frames is lost", Quality(loss=0.2))
add("doubled", "20 % of all frames come twice", Quality(doubled=0.2))
add("reordered", "10 % of all frames come 5 ms late, behind others", Quality(reordered=0.1, delay=0.001), in_order=False)
add("jitter", "all frames come up to 100 ms late, each for itself", Quality(jitter=0.1), cloud_hz=4, in_order=False)
add("all-at-once", "5 % lost, 5 % doubled, 10 % reordered, up to 20 ms late",
    Quality(loss=0.05, doubled=0.05, reordered=0.1, jitter=0.02), cloud_hz=10, in_order=False)
