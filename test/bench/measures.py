"""What `./run bench` measures. Each measure is taken once a round, floors and ours in turn; what counts is the median
over the rounds."""
import json
import statistics
import subprocess

import lab

SIZES = {"64 KB": 65536, "256 KB": 262144, "1 MB": 1048576, "4 MB": 4194304}
WIRE = 80  # bytes of a message with a payload of 64
SERVICE = "0x7e57.1"
SERVICE_2 = "0x7e57.2"  # without UDP segmentation offload


def window(size):
    """Messages under way where the rate is measured: about 2 MB, which receive buffers hold."""
    return max(2, min(32, (2 << 20) // size))


class Measures:
    """Name -> one JSON object a round."""

    def __init__(self, programs, quick):
        self.programs = programs
        self.preload = {"LD_PRELOAD": str(programs["no_segmentation"])}
        self.seconds = 0.15 if quick else 0.3
        self.lab = lab.Lab()
        self.values = {}
        self.faults = []

    def floor_client(self, role, port, **options):
        return self.lab.run("b", self.programs["floor"], role, f"at={self.lab.address['a']}:{port}",
                            f"seconds={self.seconds}", *[f"{name}={value}" for name, value in options.items()])

    def perf_client(self, *arguments, segmentation=True):
        service, address, environment = (SERVICE, "b", {}) if segmentation else (SERVICE_2, "b2", self.preload)
        return self.lab.run("b", self.programs["trestle"], "perf", "client", service, "--json", "--address",
                            self.lab.address[address], "--seconds", self.seconds, "--warm-up", "0.1", *arguments,
                            environment=environment)

    def take(self, name, measure):
        try:
            value = measure()
        except lab.Failed as why:
            self.faults.append(f"{name}: {why}")
            return
        value.pop("histogram", None)
        self.values.setdefault(name, []).append(value)

    def start_servers(self):
        address = self.lab.address["a"]
        for role, port, size in (("serve-udp", 5001, WIRE), ("serve-tcp", 5002, WIRE), ("serve-flood", 5003, WIRE),
                                 ("serve-tp", 5004, WIRE)):
            self.lab.start("a", self.programs["floor"], role, f"at={address}:{port}", f"bytes={size}")
        for service, address, environment in (SERVICE, "a", {}), (SERVICE_2, "a2", self.preload):
            self.lab.start("a", self.programs["trestle"], "perf", "server", service, "--address",
                           self.lab.address[address], "--quiet", environment=environment)
        lab.settle()

    def small(self):
        """Calls and events of 64 bytes."""
        self.take("udp floor", lambda: self.floor_client("ping-udp", 5001, bytes=WIRE))
        self.take("udp call", lambda: self.perf_client("--size", 64))
        self.take("tcp floor", lambda: self.floor_client("ping-tcp", 5002, bytes=WIRE))
        self.take("tcp call", lambda: self.perf_client("--size", 64, "--tcp"))
        self.take("flood floor", lambda: self.floor_client("receive-flood", 5003, bytes=WIRE))
        self.take("calls 32", lambda: self.perf_client("--size", 64, "--in-flight", 32))
        self.take("events 64 B", lambda: self.perf_client("--events", "--size", 64, "--window", 0))

    def large(self):
        """Events in TP segments: one at a time, and as many as arrive."""
        for name, size in SIZES.items():
            for kind, under_way in ("latency", 1), ("rate", window(size)):
                self.transfers(f"{kind} {name}", size, under_way)

    def transfers(self, name, size, under_way):
        def floor(segmentation):
            return self.floor_client("receive-tp", 5004, bytes=size, window=under_way, segmentation=segmentation)

        events = ["--events", "--size", size, "--window", under_way]
        self.take(f"tp floor {name}", lambda: floor(1))
        self.take(f"tp {name}", lambda: self.perf_client(*events, "--separation", 0))
        self.take(f"tp paced {name}", lambda: self.perf_client(*events))
        if name.startswith("rate"):
            self.take(f"tp floor {name} sendmmsg", lambda: floor(0))
            self.take(f"tp {name} sendmmsg", lambda: self.perf_client(*events, "--separation", 0, segmentation=False))

    def conversion(self):
        """The Google Benchmarks of conversion, in random order; times are medians already."""
        done = subprocess.run(
            [self.programs["micro"], "--benchmark_filter=point_cloud|float_array|transforms|path|markers",
             "--benchmark_format=json", "--benchmark_enable_random_interleaving=true", "--benchmark_repetitions=3",
             f"--benchmark_min_time={self.seconds / 10}"], capture_output=True, text=True, check=True)
        for one in json.loads(done.stdout)["benchmarks"]:
            if one["run_type"] == "iteration":
                self.values.setdefault("conversion " + one["run_name"], []).append(
                    {"ns": one["cpu_time"] * {"ns": 1, "us": 1e3, "ms": 1e6}[one["time_unit"]],
                     "megabytes_per_second": one.get("bytes_per_second", 0) / 1e6})


def median(values, name, *path):
    """Of a number in each round's object; nothing when it was not measured."""
    found = []
    for value in values.get(name, []):
        for key in path:
            value = value[key]
        found.append(value)
    return statistics.median(found) if found else None
