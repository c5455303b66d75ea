"""What `./run bench` measures. Each measure is taken once a round, floors and ours in turn, and in the other order in the
next round: what counts is the median over the rounds of what a round's two say of each other."""
import statistics
import time

import lab

SIZES = {"64 KB": 65536, "256 KB": 262144, "1 MB": 1048576, "4 MB": 4194304}
LARGE_CALLS = {"64 KB": 5006, "1 MB": 5007}  # and the ports of their floors
# Point counts of the published bridge's figures, of 24 bytes each.
POINTS = (1_000, 5_000, 10_000, 50_000, 100_000, 200_000, 500_000)
CLOUDS = {f"{points // 1000}k": points * 24 for points in POINTS}
HEADER = 16
WIRE = HEADER + 64  # bytes of a message with such a payload
FULL = 1472  # bytes of a datagram that fills a frame of Ethernet
SERVICE = "0x7e57.1"
SERVICE_2 = "0x7e57.2"  # without UDP segmentation offload
SERVICE_3 = "0x7e57.3"  # that polls
SERVICE_4 = "0x7e57.4"  # on one core with its client
SD = 30490  # the port of service discovery
# Of events to a receiver that tells nothing of itself: bytes and messages a round, and how many MB/s it reads.
SILENT = {"1 MB": (1 << 20, 200), "4 MB": (4 << 20, 50)}
READERS = {"reads 200 MB/s": 200, "reads as fast as it can": 0}
BUSY = ["--busy-poll", 1_000_000]  # as long as anything is measured
WATCHED = "64 KB"  # of bridges that somebody looks at
WATCHED_RATE = 250  # messages a second, there and back: a record of 32 MB/s
CONVERSIONS = "point_cloud|image|float_array|laser_scan|transforms|path|markers|diagnostics|objects"


def window(size):
    """Messages under way where the rate is measured: about 2 MB, which receive buffers hold."""
    return max(2, min(32, (2 << 20) // size))


class Measures:
    """Name -> one JSON object a round; nothing for a round in which it failed."""

    def __init__(self, programs, quick, place=None):
        self.programs = programs
        self.preload = {"LD_PRELOAD": str(programs["no_segmentation"])}
        self.seconds = 0.15 if quick else 0.3
        self.rate_seconds = 0.15 if quick else 0.5
        self.silent_share = 0.2 if quick else 1
        self.rest = 0.1
        self.backwards = False  # ours before the floors
        self.lab = place or lab.Lab()
        self.values = {}
        self.faults = []

    def floor_client(self, role, port, seconds=None, **options):
        return self.lab.run("b", self.programs["floor"], role, f"at={self.lab.address['a']}:{port}",
                            f"seconds={seconds or self.seconds}",
                            *[f"{name}={value}" for name, value in options.items()])

    def perf_client(self, *arguments, seconds=None, segmentation=True, busy=False):
        service, address, environment = ((SERVICE_3, "b5", {}) if busy else (SERVICE, "b", {}) if segmentation else
                                         (SERVICE_2, "b2", self.preload))
        return self.lab.run("b", self.programs["trestle"], "perf", "client", service, "--json", "--address",
                            self.lab.address[address], "--seconds", seconds or self.seconds, "--warm-up", "0.1",
                            *arguments, environment=environment)

    def take(self, name, measure, tries=1):
        value = None
        while value is None and tries > 0:
            tries -= 1
            try:
                value = measure()
                value.pop("histogram", None)
            except lab.Failed as why:
                if tries == 0:
                    self.faults.append(f"{name}: {why}")
        self.values.setdefault(name, []).append(value)
        # The kernel takes 50 ms of each second from those of real-time priority when others wait. Windows are shorter
        # than the rest of it, and the others get theirs in between.
        time.sleep(self.rest)

    def in_turn(self, *measures, times=1):
        """Pairs of name and measure, the first ones first in every other round, and every other time."""
        for number in range(times):
            for name, measure in measures if (number % 2 == 1) == self.backwards else reversed(measures):
                self.take(name, measure)

    def start_servers(self):
        address = self.lab.address["a"]
        for role, port, size in (("serve-udp", 5001, WIRE), ("serve-tcp", 5002, WIRE), ("serve-flood", 5003, WIRE),
                                 ("serve-tp", 5004, WIRE), ("serve-flood", 5005, FULL),
                                 *[("serve-tcp", port, HEADER + SIZES[name]) for name, port in LARGE_CALLS.items()]):
            self.start_floor(role, port, size)
        for service, address, environment in (SERVICE, "a", {}), (SERVICE_2, "a2", self.preload):
            self.start_server(service, address, environment=environment)
        self.lab.start("b", self.programs["floor"], "serve-tp", f"at={self.lab.loopback[0]}:5010")
        self.lab.start("b", self.programs["node"], "echo", self.lab.loopback[0])
        lab.settle()

    def start_floor(self, role, port, size, *options, wrap=lambda *command: command):
        return self.lab.start("a", *wrap(self.programs["floor"], role, f"at={self.lab.address['a']}:{port}", f"bytes={size}",
                                         *options))

    def start_server(self, service, address, *options, environment=None, wrap=lambda *command: command):
        return self.lab.start("a", *wrap(self.programs["trestle"], "perf", "server", service, "--address",
                                         self.lab.address[address], "--quiet", *options), environment=environment)

    def with_server(self, start, client):
        """For its turn alone."""
        server = start()
        lab.settle()
        try:
            return client()
        finally:
            self.lab.stop(server)

    def small(self):
        """Calls and events of 64 bytes."""
        seconds = self.rate_seconds

        def flood(segmentation):
            return self.floor_client("receive-flood", 5003, seconds, bytes=WIRE, segmentation=segmentation)

        self.in_turn(("udp floor", lambda: self.floor_client("ping-udp", 5001, bytes=WIRE)),
                     ("udp call", lambda: self.perf_client("--size", 64)))
        self.in_turn(("tcp floor", lambda: self.floor_client("ping-tcp", 5002, bytes=WIRE)),
                     ("tcp call", lambda: self.perf_client("--size", 64, "--tcp")))
        self.in_turn(("flood floor", lambda: flood(0)),
                     ("trains floor", lambda: flood(1)),
                     ("calls 32", lambda: self.perf_client("--size", 64, "--in-flight", 32, seconds=seconds)),
                     ("events 64 B", lambda: self.perf_client("--events", "--size", 64, "--window", 0,
                                                              seconds=seconds)))
        # One program makes them in turn, a hundred times a round.
        program, address = self.programs["node"], self.lab.address
        self.take("calls by both", lambda: self.with_server(
            lambda: self.lab.start("a", program, "serve", address["a9"]),
            lambda: self.lab.run("b", program, "calls", address["b10"], 4 * seconds)))

    def busy(self):
        """Calls again, of two that do not wait but look. Each server takes a core."""
        for kind, port in ("udp", 5008), ("tcp", 5009):
            self.in_turn((f"{kind} busy floor", lambda: self.with_server(
                             lambda: self.start_floor(f"serve-{kind}", port, WIRE, "busy=1"),
                             lambda: self.floor_client(f"ping-{kind}", port, bytes=WIRE, busy=1))),
                         (f"{kind} busy call", lambda: self.with_server(
                             lambda: self.start_server(SERVICE_3, "a5", *BUSY),
                             lambda: self.perf_client("--size", 64, *BUSY, *["--tcp"] * (kind == "tcp"), busy=True))))

    def one_core(self):
        """Calls of two on one core: what both ends take is all of it, and nobody is waked up elsewhere."""
        pinned, address = self.lab.on_one_core, self.lab.address
        seconds = f"seconds={self.seconds}"

        def bare(*options):
            return self.lab.run("b", *pinned(self.programs["floor"], "ping-udp", f"bytes={WIRE}", seconds, *options))

        def start_server():
            return self.start_server(SERVICE_4, "a10", wrap=pinned)

        self.in_turn(("core floor", lambda: self.with_server(
                         lambda: self.start_floor("serve-udp", 5011, WIRE, wrap=pinned), lambda: bare(f"at={address['a']}:5011"))),
                     ("core bare client", lambda: self.with_server(
                         start_server, lambda: bare(f"at={address['a10']}:{SD}", f"own={address['b9']}"))),
                     ("core call", lambda: self.with_server(
                         start_server, lambda: self.lab.run("b", *pinned(
                             self.programs["trestle"], "perf", "client", SERVICE_4, "--json", "--address", address["b8"],
                             "--seconds", self.seconds, "--warm-up", "0.1", "--size", 64)))))

    def newcomers(self):
        """What programs do that give no option: an echo between two processes of one host, over UDP in segments, and an
        event at a time, each from a handler of its own."""
        address, node, (server, client) = self.lab.address, self.programs["node"], self.lab.loopback
        for name in LARGE_CALLS:
            size = SIZES[name]
            self.in_turn((f"echo transfer {name}", lambda: self.lab.run(
                             "b", self.programs["floor"], "receive-tp", f"at={server}:5010", f"bytes={size}", "window=1",
                             f"seconds={self.seconds}")),
                         (f"echo {name}", lambda: self.lab.run("b", node, "call", client, size, self.seconds)))

        def events(environment):
            return self.lab.run("b", node, "count", address["b8"], self.rate_seconds, environment=environment)

        self.in_turn(("sendto floor", lambda: self.floor_client("receive-flood", 5003, self.rate_seconds, bytes=WIRE,
                                                                segmentation=0, batches=0)),
                     ("events a turn", lambda: self.with_server(
                         lambda: self.lab.start("a", node, "notify", address["a8"]), lambda: events({}))),
                     ("events a turn unsegmented", lambda: self.with_server(
                         lambda: self.lab.start("a", node, "notify", address["a8"], environment=self.preload),
                         lambda: events(self.preload))))

    def silent(self, name, server, *options):
        """Events to a receiver of which the sender knows nothing, with pacing and buffers as they are without options."""
        for size, (size_bytes, messages) in SILENT.items():
            for reader, reads in READERS.items():
                self.take(f"{name} {size} {reader}", lambda: self.lab.run(
                    "b", self.programs["floor"], "receive-silent", f"at={self.lab.address[server]}:{SD}",
                    f"own={self.lab.address['b9']}", f"bytes={size_bytes}", f"messages={round(messages * self.silent_share)}",
                    f"reads={reads}", *options, patience=60))

    def transfer(self, size, under_way, seconds, segmentation=1):
        """Bare TP."""
        return self.floor_client("receive-tp", 5004, seconds, bytes=size, window=under_way, segmentation=segmentation)

    def large(self):
        """Events in TP segments: one at a time, and as many as arrive, which are what full datagrams could carry. Then
        large calls, as segments and as a stream."""
        for name, size in SIZES.items():
            for kind, under_way in ("latency", 1), ("rate", window(size)):
                self.transfers(f"{kind} {name}", size, under_way)
        for name, port in LARGE_CALLS.items():
            size = SIZES[name]
            self.in_turn((f"transfer {name}", lambda: self.transfer(size, 1, self.seconds)),
                         (f"udp call {name}", lambda: self.perf_client("--size", size)))
            self.in_turn((f"tcp floor {name}", lambda: self.floor_client("ping-tcp", port, bytes=HEADER + size)),
                         (f"tcp call {name}", lambda: self.perf_client("--size", size, "--tcp")))
        self.in_turn(("tp flood 1 MB floor", lambda: self.transfer(SIZES["1 MB"], 0, self.rate_seconds)),
                     ("tp flood 1 MB", lambda: self.perf_client("--events", "--size", SIZES["1 MB"], "--window", 0,
                                                                seconds=self.rate_seconds)))

    def transfers(self, name, size, under_way):
        is_rate = name.startswith("rate")
        seconds = self.rate_seconds if is_rate else self.seconds

        def events(*arguments, segmentation=True):
            return self.perf_client("--events", "--size", size, "--window", under_way, *arguments, seconds=seconds,
                                    segmentation=segmentation)

        bulk = ("bulk floor", lambda: self.floor_client("receive-flood", 5005, seconds, bytes=FULL))
        self.in_turn(*[bulk] * (name == "rate 1 MB"),
                     (f"tp floor {name}", lambda: self.transfer(size, under_way, seconds)),
                     (f"tp {name}", lambda: events("--separation", 0)),
                     (f"tp paced {name}", events))
        if is_rate:
            self.in_turn((f"tp floor {name} sendmmsg", lambda: self.transfer(size, under_way, seconds, 0)),
                         (f"tp {name} sendmmsg", lambda: events("--separation", 0, segmentation=False)), times=2)

    def conversion(self):
        """The Google Benchmarks of conversion, each of which takes its floor in turn with itself."""
        try:
            found = self.lab.run("a", self.programs["micro"], f"--benchmark_filter={CONVERSIONS}",
                                 "--benchmark_format=json", f"--benchmark_min_time={self.seconds / 10}", patience=120)
        except lab.Failed as why:
            self.faults.append(f"conversion: {why}")
            return
        for one in found["benchmarks"]:
            ours, floor = one["ours_ns"], one["floor_ns"]
            self.values.setdefault("conversion " + one["run_name"].removesuffix("/manual_time"), []).append(
                {"ns": ours, "megabytes_per_second": one["bytes"] / ours * 1e3, "floor": {
                    "ns": floor, "megabytes_per_second": one["bytes"] / floor * 1e3}})


def series(values, name, *path):
    """A number in each round's object; nothing for a round without."""
    found = []
    for value in values.get(name, []):
        for key in path:
            value = None if value is None else value[key]
        found.append(value)
    return found


def middle(numbers):
    """The median of those that there are; nothing when there are none."""
    found = [number for number in numbers if number is not None]
    return statistics.median(found) if found else None


def median(values, name, *path):
    return middle(series(values, name, *path))
