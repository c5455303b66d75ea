"""ROS clients that call without end what others call, too."""
import select
import socket
import struct
import time

from attacker import CAR, Attacker
from figures import Figure, at_least, holds
from lab import ADDRESS
from scenario import scenario
import flows

PORT = 41100
DONE = b"\1\0\0\0\4\xef\xbb\xbf\0"  # a response of std_srvs/srv/SetBool: success, and no message


def answer_late(delay):
    """A service that takes its time over each call, and does as many at once as come."""
    honest = Attacker(ADDRESS["honest"])
    taken = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taken.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    taken.bind((honest.address, PORT))
    taken.setblocking(False)
    due, offers = [], 0.0
    while True:
        now = time.monotonic()
        if now >= offers:
            offers = now + 0.5
            honest.offer(0x5100, PORT)
            honest.offer(0x5100, PORT, to=CAR)
        while due and due[0][0] <= now:
            _, request, caller = due.pop(0)
            taken.sendto(request[:4] + struct.pack(">I", 8 + len(DONE)) + request[8:14] + b"\x80\0" + DONE, caller)
        select.select([taken], [], [], max(0.0, min([offers] + [one[0] for one in due[:1]]) - now))
        while True:
            try:
                request, caller = taken.recvfrom(65536)
            except BlockingIOError:
                break
            due.append((time.monotonic() + delay, request, caller))


@scenario("greedy-ros-client", 11, "a ROS client that calls 2,000 times/s a method that takes 1 s, beside one that calls 10 times/s")
def greedy_ros_client(world):
    short = world.scale.short
    delay, hz, places = (0.5, 600, 64) if short else (1.0, 2000, 256)
    world.car = world.bridge("car", "bridge", "methods:\n  - {ros_service: /actuate, type: std_srvs/srv/SetBool, "
                             f"server: someip, service: 0x5100, instance: 1, method: 1, max_calls: {places}}}\n")
    world.lab.fork("honest", answer_late, delay)
    honest = world.end("car", "honest-client", "dds", 80, "calls=ask:/actuate:10:1000000")
    world.wait(lambda: any(answered for _, answered in flows.read(honest.out)[0]["calls"].calls), "nobody is answered")
    began = time.monotonic_ns()
    world.pass_time(world.scale.quiet_s, "without the attack")
    attacked = time.monotonic_ns()
    greedy = world.end("car", "greedy-client", "dds", 80, f"greedy=ask:/actuate:{hz}:1000000000")
    world.pass_time(2 if short else world.scale.attack_s, "attacked")
    ended = time.monotonic_ns()
    greedy.stop()
    world.lab.programs.remove(greedy)
    world.pass_time(delay + 0.3, "what comes late")

    def seen(begin, end):
        """A refusal comes at once; it is no answer of the service."""
        calls = [(called, answered if answered - called >= delay * 0.9e9 else 0)
                 for called, answered in flows.read(honest.out)[0]["calls"].calls]
        kept = flows.Record()
        kept.calls = calls
        return flows.calls(kept, begin, end)

    alone, beside = seen(began, attacked), seen(attacked, ended)
    world.figures.append(at_least("calls kept", beside.percent, 95, "%", alone=alone.percent))
    world.figures.append(Figure("calls p99", beside.late, "ms", "<= 3 x", beside.late <= 3 * alone.late, alone=alone.late,
                                timed=True))
    world.figures.append(holds("the log names its share", "has its share of `max_calls`" in world.car.text()))
