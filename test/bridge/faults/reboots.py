"""A SOME/IP peer that is nothing but bytes reboots in the middle of a large message, a subscription, and calls."""
import socket
import struct
import time

from fault_world import Failed, at_least, at_most, holds
from lab import ADDRESS, PATIENCE
from scenario import scenario
from wire import (ACK, GROUP, OFFER, RESPONSE, SD_PORT, SUBSCRIBE, TCP, UDP, cloud, endpoint, entries_of, sd, segment,
                  service_entry, someip)
from world import route

SERVICE, EVENT, METHOD, PORT = 0x5001, 0x8001, 0x0002, 45000
OWN, CAR = ADDRESS["honest"], ADDRESS["car"]
SEGMENT_BYTES = 1392


class Peer:
    """A host of which everything that it remembers is lost by reboot(). Runs in a process of its own: see tell()."""

    def __init__(self, tells):
        self._tells = tells
        self.socket = self._bound(socket.SOCK_DGRAM, SD_PORT)
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(OWN))
        self.service = self._bound(socket.SOCK_DGRAM, PORT)
        self.listener = self._bound(socket.SOCK_STREAM, PORT)
        self.listener.listen()
        self.streams = []
        self.sessions = {}

    @staticmethod
    def _bound(kind, port):
        one = socket.socket(socket.AF_INET, kind)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        one.bind((OWN, port))
        one.settimeout(0.02)
        return one

    def reboot(self):
        """Sessions begin anew, what came meanwhile is gone, and so are connections, without a word."""
        self.sessions = {}
        for stream in self.streams:  # not even a FIN: those who have it hear of it when they send
            stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            stream.close()
        self.streams = []
        for one in self.socket, self.service:
            try:
                while True:
                    one.recv(65536)
            except TimeoutError:
                pass

    def say(self, entry, option=b"", to=CAR):
        session = self.sessions[to] = self.sessions.get(to, 0) + 1
        self.socket.sendto(sd(entry, option, session), (to, SD_PORT))

    def offer(self):
        self.say(service_entry(OFFER, SERVICE, options=2), endpoint(OWN, PORT, UDP) + endpoint(OWN, PORT, TCP), to=GROUP)

    def subscribes(self, acknowledge=True):
        """Waits for a Subscribe, and where it wants its events."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.offer()
            for _ in range(20):
                try:
                    message = self.socket.recv(65536)
                except TimeoutError:
                    continue
                entries, where = entries_of(message)
                for entry in entries:  # one that is not answered is sent again behind a StopSubscribe
                    if entry[0] == SUBSCRIBE and any(entry[9:12]):
                        if acknowledge:
                            self.say(bytes([ACK, 0, 0, 0]) + entry[4:])
                        return where[1]
        raise Failed("nobody subscribes")

    def request(self):
        """Of the next call over UDP, its Request ID and its sender."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.offer()
            for _ in range(10):
                try:
                    message, sender = self.service.recvfrom(65536)
                    return message[8:12], sender
                except TimeoutError:
                    pass
        raise Failed("nobody calls")

    def answer(self, request_id, sender):
        client, session = struct.unpack(">HH", request_id)
        # success, and a text without characters: BOM and terminator
        self.service.sendto(someip(SERVICE, METHOD, b"\1\0\0\0\4\xef\xbb\xbf\0", session, RESPONSE, client), sender)

    def told_to_go_on(self):
        """Waits until go_on() says that the bridge has the answer."""
        go = self._tells.with_suffix(".go")
        while not go.exists():
            time.sleep(0.01)
        go.unlink()

    def tell(self, what):
        with open(self._tells, "a", encoding="ascii") as file:
            file.write(f"{what} {time.monotonic_ns()}\n")


def told(path):
    return dict(line.split() for line in path.read_text(encoding="ascii").splitlines()) if path.exists() else {}


def started(world, parts, more):
    world.car = world.bridge("car", "bridge", more)
    world.car_end = world.end("car", "car-end", "dds", 80, *parts)
    path = world.lab.folder / "peer.txt"
    return path


def run_peer(world, function, path, *steps):
    """Each step: a word of the peer, after which the bridge is to know that it is subscribed."""
    world.lab.fork("honest", function, path)
    for step in steps:
        world.wait(lambda step=step: step in told(path), f"the peer does not get to '{step}'")
        world.wait(lambda: world.counters_of(world.car)["route /in from SOME/IP"]["subscribed"], "the bridge is not subscribed")
        path.with_suffix(".go").touch()
    world.wait(lambda: "done" in told(path), "the peer does not get to its end")


def sent_cloud(peer, port, stamp, size, session, segments=None):
    """Sends an event in segments; `segments`: only the first ones."""
    payload = cloud(stamp, size)
    pieces = range(0, len(payload), SEGMENT_BYTES)
    for offset in list(pieces)[:segments]:
        peer.service.sendto(segment(SERVICE, EVENT, offset, payload[offset:offset + SEGMENT_BYTES],
                                    offset + SEGMENT_BYTES < len(payload), session), (CAR, port))


HALF, FIRST, SECOND = 1_000_000_001, 2_000_000_002, 3_000_000_003  # stamps
BYTES = 14_000


def half_a_message(path):
    peer = Peer(path)
    port = peer.subscribes()
    peer.tell("first")
    peer.told_to_go_on()
    sent_cloud(peer, port, HALF, BYTES, 1, segments=5)
    peer.reboot()
    peer.tell("rebooted")
    port = peer.subscribes()
    peer.tell("second")
    peer.told_to_go_on()
    # What the half message left behind has the same Session ID, sender and place.
    sent_cloud(peer, port, FIRST, BYTES, 1)
    sent_cloud(peer, port, SECOND, BYTES, 2)
    peer.tell("done")
    time.sleep(600)


@scenario("reboot-in-a-message", 10, "the peer reboots after half of a message in segments; the next one has the same session")
def reboot_in_message(world):
    path = started(world, ["in=read:/in:cloud"], "routes:\n" + route("/in", SERVICE, "someip_to_dds", 45001))
    run_peer(world, half_a_message, path, "first", "second")

    def received():
        return [stamp for stamp, _ in world.flows_of(world.car_end)["in"].received]
    world.wait(lambda: SECOND in received(), "the messages after the reboot do not come")
    world.pass_time(1, "what comes late")
    world.figures.append(at_most("messages made of two", received().count(HALF), 0))
    world.figures.append(holds("the first message after the reboot arrives", FIRST in received()))
    world.figures.append(at_least("reboots detected", world.counters_of(world.car)["SOME/IP-SD"]["reboots_detected"], 1))


def half_a_subscription(path):
    peer = Peer(path)
    peer.subscribes(acknowledge=False)
    peer.reboot()
    peer.tell("rebooted")
    port = peer.subscribes()
    peer.tell("second")
    peer.told_to_go_on()
    sent_cloud(peer, port, FIRST, BYTES, 1)
    peer.tell("done")
    time.sleep(600)


@scenario("reboot-in-a-subscription", 10, "the peer reboots between a Subscribe and its answer")
def reboot_in_subscription(world):
    path = started(world, ["in=read:/in:cloud"], "routes:\n" + route("/in", SERVICE, "someip_to_dds", 45001))
    run_peer(world, half_a_subscription, path, "second")
    world.wait(lambda: world.flows_of(world.car_end)["in"].received, "no event comes after the reboot")
    times = told(path)
    world.figures.append(at_most("subscribed anew after", (int(times["second"]) - int(times["rebooted"])) / 1e9, 2.0, "s",
                                 timed=True))


def half_a_call(path):
    peer = Peer(path)
    old, sender = peer.request()
    peer.reboot()
    peer.tell("rebooted")
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        request_id, sender = peer.request()
        if request_id == old:
            peer.tell("repeated")
        peer.answer(old, sender)  # what it was to answer before it rebooted
        peer.answer(request_id, sender)
        peer.tell("done")


@scenario("reboot-in-a-call", 10, "the peer reboots before it answers a call, and gives that answer to the next call, too")
def reboot_in_call(world):
    path = started(world, ["asked=ask:/asked:5:1000000"], f"methods:\n  - {{ros_service: /asked, type: std_srvs/srv/SetBool, "
                   f"server: someip, service: {SERVICE}, instance: 1, method: {METHOD}, timeout: 1 s}}\n")
    run_peer(world, half_a_call, path)

    def calls():
        return world.flows_of(world.car_end)["asked"].calls
    world.wait(lambda: sum(1 for _, answered in calls() if answered) >= 5, "no call is answered after the reboot")
    begun = max(called for called, answered in calls() if answered)
    world.pass_time(3, "calls")
    lost = sum(1 for called, answered in calls() if called > begun and not answered)
    world.figures.append(at_least("calls that were answered", sum(1 for _, answered in calls() if answered), 5))
    world.figures.append(at_most("calls that were not, from the answers on", lost, 0))
