"""System calls of the bridge's sockets fail, all of them, and then a third."""
import errno

from fault_world import at_least
from scenario import scenario

SOME_FLOWS = "events_out", "clouds_out", "clouds_out_tcp", "events_in", "clouds_in", "calls_udp", "calls_tcp"
ALL_S, SOME_S = 1, 2
SENDING = {"ENOBUFS": False, "EAGAIN": False, "ENOMEM": False, "EPERM": False, "ENETUNREACH": False, "EINTR": False,
           "ENOBUFS-tcp": True, "EAGAIN-tcp": True, "ENOMEM-tcp": True, "EPIPE-tcp": True}
WAIT = errno.ENOBUFS, errno.EAGAIN, errno.EINTR  # for room: what is small is sent later
RECEIVING = "ENOBUFS", "EAGAIN", "ENOMEM", "EPERM", "ECONNREFUSED", "EINTR"


def failing(switch):
    def fault(world):
        switch(world.calls, 1)
        world.pass_time(ALL_S, "all calls fail")
        switch(world.calls, 3)
        world.pass_time(SOME_S, "a third of the calls fails")
        switch(world.calls, 0)
    return fault


def prove(world, which):
    world.figures.append(at_least("calls that failed", world.calls.failed()[which], 10))


def add_sending(name, streams):
    error = getattr(errno, name.removesuffix("-tcp"))

    @scenario(f"send-{name}", 7, f"calls that send {'also over TCP ' if streams else ''}fail with {name.removesuffix('-tcp')}")
    def sending(world):
        world.preload()
        world.honest(*SOME_FLOWS)
        fault = failing(lambda calls, every: calls.sends_fail(error if every else 0, every or 1, streams))
        world.hold_after(lambda: fault(world))
        prove(world, 0)
        if error not in WAIT:
            refused = world.counters_of(world.car)["SOME/IP"].get("refused_by_system", 0)
            world.figures.append(at_least("messages counted as refused_by_system", refused, 1))


def add_receiving(name):
    error = getattr(errno, name)

    @scenario(f"receive-{name}", 7, f"calls that receive from UDP fail with {name}")
    def receiving(world):
        world.preload()
        world.honest(*SOME_FLOWS)
        fault = failing(lambda calls, every: calls.receives_fail(error if every else 0, every or 1))
        world.hold_after(lambda: fault(world))
        prove(world, 1)


for each, tcp in SENDING.items():
    add_sending(each, tcp)
for each in RECEIVING:
    add_receiving(each)
