"""The world of a scenario: bridges, honest ends beside them, a time without the attack and one with it."""
import dataclasses
import time

import flows
from figures import Figure, at_least, at_most
from lab import ADDRESS, ADDRESS6, FOLDER, PATIENCE, Failed
from wire import GROUP6

LATE = "late_in"  # the flow of a service that a new host offers
NEWCOMER_S = 2.0  # within which a new honest peer is served
GIVES_BACK_S = 15.0  # within which memory goes back that is not needed any longer


@dataclasses.dataclass
class Scale:
    """How much of everything: in full, or the short form that is to pass on any machine."""

    short: bool
    quiet_s: float
    attack_s: float
    cloud_bytes: int
    cloud_hz: int
    event_hz: int
    call_hz: int


FULL = Scale(False, 5, 10, 1_000_000, 20, 100, 50)
SHORT = Scale(True, 1.5, 3, 100_000, 10, 20, 10)

HEAD = """\
someip:
  address: '{address}'{more}
  sd: {{initial_delay_min: 10 ms, initial_delay_max: 20 ms{group}}}
dds: {{domain: {domain}, interfaces: [{interface}], node: /{name}}}
"""
POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
RELIABLE = "qos: {reliability: reliable, durability: volatile}"


def route(topic, service, direction, port=None, message=POINT_CLOUD, more=""):
    where = f", port: {port}" if port else ""
    return (f"  - {{topic: {topic}, type: {message}, direction: {direction}, service: {service}, instance: 1, "
            f"eventgroup: 1, event: 0x8001{where}, {RELIABLE}{more}}}\n")


class Flow:
    """Honest messages through the bridge of the car: a line of its file, and what both ends are to do.

    `judged` by how many came and how late, but for what is only there to be attacked."""

    def __init__(self, name, route_text="", car="", honest="", field_text="", kind="events"):
        self.name, self.route, self.field, self.kind = name, route_text, field_text, kind
        self._car, self._honest = car, honest

    def ends(self, scale):
        words = {"cloud": scale.cloud_bytes, "cloud_hz": scale.cloud_hz, "hz": scale.event_hz, "call_hz": scale.call_hz}
        return self._car.format(**words), self._honest.format(**words)


def _out(name, service, port, sizes, tcp=False, more=""):
    return Flow(name, route(f"/{name}", service, "dds_to_someip", port, more=", transport: tcp" if tcp else more),
                f"{name}=publish:/{name}:cloud:{sizes}", f"{name}=listen:{service}:1:{'tcp' if tcp else 'udp'}:{port + 5000}")


def _in(name, service, port, sizes):
    return Flow(name, route(f"/{name}", service, "someip_to_dds", port), f"{name}=read:/{name}:cloud",
                f"{name}=notify:{service}:1:{sizes}")


def _field(name, service, port, size, call, tcp=False):
    """A latched topic whose value SOME/IP clients get."""
    return Flow(name, field_text=f"  - {{topic: /{name}, type: {POINT_CLOUD}, server: ros, service: {service}, instance: 1, "
                f"event: 0x8001, eventgroup: 1, getter: 0x0001, port: {port}, offer: always"
                f"{', transport: tcp' if tcp else ''}}}\n", car=f"{name}=publish:/{name}:cloud:{size}:0:latched",
                honest=call and f"{name}=call:{service}:1:1:0:{{call_hz}}:{'tcp' if tcp else 'udp'}", kind="calls")


CLOUDS, EVENTS = "{cloud}:{cloud_hz}", "200:{hz}"
FLOWS = {flow.name: flow for flow in [
    _out("clouds_out", 0x4001, 40001, CLOUDS), _out("events_out", 0x4002, 40002, EVENTS),
    _out("clouds_out_tcp", 0x4011, 40011, CLOUDS, tcp=True),
    _out("clouds_out_group", 0x4021, 40021, CLOUDS, more=", multicast: {address: 239.1.2.3, port: 30500, threshold: 1}"),
    _in("late_in", 0x5009, 45009, EVENTS), _in("clouds_in", 0x5001, 45001, CLOUDS), _in("events_in", 0x5002, 45002, EVENTS),
    _field("calls_udp", 0x4003, 40003, 200, True), _field("calls_tcp", 0x4004, 40004, 200, True, tcp=True),
    _field("big_value", 0x4005, 40005, 1_000_000, ""), _field("small_value", 0x4005, 40005, 1_300, "")]}


class World:
    """What a scenario makes use of."""

    def __init__(self, lab, programs, scale, progress):
        self.lab, self.scale, self.progress = lab, scale, progress
        self.trestle, self.flow = programs
        self.figures = []
        self.flows = []
        self.car = None
        self.addresses = ADDRESS
        self.counters = {}

    def use_ipv6(self):
        """To be called first: SOME/IP uses IPv6."""
        self.lab.add_ipv6()
        self.addresses = ADDRESS6

    # --- Who is there ---------------------------------------------------------------------------------------

    def bridge(self, host, name, body, domain=80, more="", quiet=False, address="",
               interface="127.0.0.1"):
        """Starts a bridge from what its file says beside the networks. interface: of DDS, by its address."""
        path = FOLDER / self.lab.name / f"{name}.yaml"
        group = f", multicast: '{GROUP6}'" if self.addresses is ADDRESS6 else ""
        path.write_text(HEAD.format(address=address or self.addresses[host], domain=domain, interface=interface, group=group,
                                    name=name.replace("-", "_"), more=more) + body, encoding="utf-8")
        return self.lab.start(host, name, self.trestle, "bridge", *(["--quiet"] if quiet else []), path)

    def end(self, host, name, kind, where, *parts):
        """Starts an end of honest messages."""
        return self.lab.start(host, name, self.flow, kind, where, *[part for part in parts if part])

    @staticmethod
    def route_of(name):
        """The route of a flow whose other end is not there from the start."""
        return FLOWS[name].route

    def honest(self, *names, more="", quiet=False, routes="", fields="", ends=(), late=False, interface="127.0.0.1",
               dds_at="car"):
        """A bridge in the car, flows through it, and their other ends at the honest host. `ends`: more in the car.

        late: there is LATE, too, which a newcomer may offer. dds_at: the host of their ends in DDS, which the bridge
        reaches by `interface`."""
        self.flows = [FLOWS[name] for name in names]
        if late:
            routes += self.route_of(LATE)
            ends = [*ends, FLOWS[LATE].ends(self.scale)[0]]
        routes += "".join(flow.route for flow in self.flows)
        fields += "".join(flow.field for flow in self.flows)
        body = ("routes:\n" + routes if routes else "") + ("fields:\n" + fields if fields else "")
        self.car = self.bridge("car", "bridge", body, more=more, quiet=quiet, interface=interface)
        parts = [flow.ends(self.scale) for flow in self.flows]
        self.car_end = self.end(dds_at, "car-end", "dds", 80 if dds_at == "car" else "80,all", *[car for car, _ in parts], *ends)
        if names:
            self.honest_end = self.end("honest", "honest-end", "peer", self.addresses["honest"], *[part for _, part in parts])
            self.wait_for_flows()

    def _ends(self):
        return flows.read(self.car_end.out)[0], flows.read(self.honest_end.out)[0]

    def wait_for_flows(self):
        """Until something comes through each of them."""
        def flowing():
            car, honest = self._ends()
            return all(any(answered for _, answered in honest[flow.name].calls) if flow.kind == "calls" else
                       car[flow.name].received or honest[flow.name].received
                       for flow in self.flows if flow.ends(self.scale)[1])
        self.wait(flowing, "nothing comes through the bridge")

    def wait(self, condition, otherwise, patience=PATIENCE):
        end = time.monotonic() + patience
        while not condition():
            self.check()
            if time.monotonic() > end:
                raise Failed(otherwise)
            time.sleep(0.05)

    def check(self):
        """Fails when a program has ended that should not have."""
        for program in self.lab.programs:
            if not program.running():
                raise Failed(f"{program.name} has ended with {program.process.returncode}: {program.text()[-500:]}")

    # --- What is done ---------------------------------------------------------------------------------------

    def pass_time(self, seconds, what):
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.progress(f"{what}, {left:.0f} s to go")
            time.sleep(min(left, 0.5))

    def beside(self, attack, *arguments, host="attacker", newcomer="", late=2.0, forging=False):
        """Measures the flows alone, then beside an attack: what comes through, how late, and the bridge's memory and log.

        newcomer: a part of hostile_flow for a new host, which begins in the middle of the attack; or LATE."""
        self.pass_time(self.scale.quiet_s, "without the attack")
        memory, log, began = self.car.rss(), self.car.log_bytes(), time.monotonic_ns()
        child = self.lab.fork(host, attack, *arguments) if attack else None
        new = None
        self.pass_time(self.scale.attack_s / 2, "attacked")
        if newcomer and self.car.running():
            new = self.end("second", "newcomer", "peer", self.addresses["second"],
                           FLOWS[LATE].ends(self.scale)[1] if newcomer == LATE else newcomer)
        self.pass_time(self.scale.attack_s / 2, "attacked")
        ended = time.monotonic_ns()
        written = self.car.log_bytes() - log
        peak = self.car.rss() if self.car.running() else 0
        if child:
            self.lab.end(child)
        self.pass_time(late, "what comes late")
        self._judge_flows(began, ended, forging)
        if new:
            self._judge_newcomer(new, newcomer == LATE, ended)
        allowed = memory * 1.1
        end = time.monotonic() + GIVES_BACK_S
        while (after := self.car.rss() if self.car.running() else 0) > allowed and time.monotonic() < end:
            self.pass_time(0.5, "memory goes back")
        self.figures.append(Figure("the bridge goes on", "yes" if after else "no", "", "yes", bool(after)))
        self.figures.append(Figure("memory afterwards", after / 1e6, "MB", "+ 10 %", 0 < after <= allowed,
                                   alone=memory / 1e6))
        self.figures.append(Figure("memory meanwhile", peak / 1e6, "MB"))
        self.figures.append(at_most("log", written / 1e3, 64, "kB"))

    def _judge_flows(self, began, ended, forging):
        car, honest = self._ends()
        begin = began - int(self.scale.quiet_s * 1e9)
        forged = 0
        for flow in self.flows:
            one, other = car[flow.name], honest[flow.name]
            if flow.kind == "calls":
                if not flow.ends(self.scale)[1]:
                    continue  # only there to be attacked
                if not other.calls:
                    raise Failed(f"{flow.name}: nobody has called")
                forged += len(other.forged)
                alone, seen = flows.calls(other, begin, began), flows.calls(other, began, ended)
            else:
                ways = (one, other) if one.sent else (other, one)
                alone, seen = flows.events(*ways, begin, began), flows.events(*ways, began, ended)
                forged += seen.forged
            kept = min(100.0, 100 * seen.percent / alone.percent) if alone.percent else 0.0
            self.figures.append(at_least(f"{flow.name} kept", kept, 95, "%", alone=alone.percent))
            if not self.scale.short:  # or there is nothing to compare with
                self.figures.append(at_least(f"{flow.name} without the attack", alone.percent, 95, "%"))
            # Below a millisecond a machine that does anything else would be judged, and not the bridge.
            self.figures.append(Figure(f"{flow.name} p99", seen.late, "ms", "<= 3 x",
                                       seen.late <= 3 * max(alone.late, 1.0), alone=alone.late, timed=True))
        if forging:
            self.figures.append(at_most("forged and accepted", forged, 0))

    def _judge_newcomer(self, new, offers, ended):
        """When it is served first, and what it gets from then on until the attack ends."""
        found, up = flows.read(new.out)
        senders = self._ends()[0].values()
        if offers:  # it only sends
            senders, found = found.values(), {LATE: self._ends()[0][LATE]}
        first = [came for record in found.values() for came in
                 [came for _, came in record.received] + [answered for _, answered in record.calls if answered]]
        waited = (min(first) - up) / 1e9 if first and up else float("inf")
        self.figures.append(at_most("a new honest peer is served after", waited, NEWCOMER_S, "s", timed=bool(first)))
        for record in found.values() if first else []:
            seen = flows.calls(record, min(first), ended) if record.calls else next(
                (flows.events(sender, record, min(first), ended) for sender in senders
                 if any(stamp in record.came for stamp in sender.sent)), None)
            if seen and seen.sent:
                self.figures.append(at_least("a new honest peer keeps", seen.percent, 95, "%"))

    def read_counters(self):
        """Ends the bridge of the car and takes what it has counted."""
        if self.car and self.car.running():
            self.car.stop()
        for line in self.car.out.read_text(encoding="utf-8").splitlines() if self.car else []:
            name, _, numbers = line.partition(": ")
            self.counters[name] = numbers
