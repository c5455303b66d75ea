"""The way DDS -> SOME/IP -> DDS through two bridges, beside a hop of plain Fast DDS."""
import dataclasses
import functools
import json
import os
import tempfile
import time

from measures import CLOUDS, SIZES

LOOPBACK = "127.0.0.1"
# Of plain Fast DDS: sent by a thread of its own or by the thread that writes, and both by shared memory.
HOPS = {"asynchronous": ["domain=93"], "synchronous": ["domain=95", "synchronous=1"],
        "shared asynchronous": ["domain=94", "shared_memory=1"],
        "shared synchronous": ["domain=96", "shared_memory=1", "synchronous=1"]}
MOST = max(CLOUDS.values())
IDLE_SECONDS = 20  # with several timers of every kind that discovery has
# Topics before /there and /back, and what their messages on SOME/IP wait for.
PACINGS = {"/perf": "0 us", "/paced": None}


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two bridges, and who measures them."""
    domains: dict
    service: int  # the first of its routes
    address: str
    shared_memory: bool = False
    reports: bool = False  # each message, which takes time

    def yaml(self, side, address):
        """Bridge a carries TOPIC/there to SOME/IP and TOPIC/back to DDS; bridge b the other way."""
        lines = ["someip:", f"  address: {address}", "dds:", f"  domain: {self.domains[side]}", f"  interfaces: [{LOOPBACK}]",
                 *["  shared_memory: true"] * self.shared_memory, "routes:"]
        for number, (topic, separation) in enumerate(PACINGS.items()):
            for way in "there", "back":
                out = (way == "there") == (side == "a")
                lines += [f"  - topic: {topic}/{way}", "    type: sensor_msgs/msg/PointCloud2",
                          f"    direction: {'dds_to_someip' if out else 'someip_to_dds'}",
                          f"    service: {self.service + 2 * number + (way == 'back'):#06x}", "    instance: 0x0001",
                          "    eventgroup: 0x0001", "    event: 0x8001"]
                if out:
                    lines.append(f"    port: {40001 + 2 * number + (way == 'back')}")
                if separation:
                    lines.append(f"    tp: {{separation: {separation}}}")
        return "\n".join(lines) + "\n"


PLAIN = Pair({"a": 91, "b": 92}, 0x7e61, "3")
SHARED = Pair({"a": 97, "b": 98}, 0x7e71, "6", shared_memory=True)
REPORTING = Pair({"a": 89, "b": 90}, 0x7e81, "7", reports=True)


class Paths:
    def __init__(self, measures):
        self.measures = measures
        self.lab = measures.lab
        self.folder = tempfile.TemporaryDirectory(prefix="trestle-bench-")

    def start(self):
        """All bridges, and at side b somebody who reflects for each of them."""
        for pair in PLAIN, SHARED, REPORTING:
            for side in "ab":
                self.start_bridge(pair, side)
            for topic in PACINGS:
                self.lab.start("b", *self.perf(pair, "b", topic), "--reflect")
        for hop in HOPS.values():
            self.lab.start("a", self.measures.programs["floor"], "reflect-dds", *hop)
        time.sleep(1)

    def start_bridge(self, pair, side):
        config = os.path.join(self.folder.name, f"{side}{pair.address}.yaml")
        with open(config, "w", encoding="utf-8") as file:
            file.write(pair.yaml(side, self.lab.address[side + pair.address]))
        command = [self.measures.programs["trestle"], "bridge", "--quiet", config]
        if pair.reports:
            with open(self.report(side), "wb") as report:
                self.lab.start(side, *command, "--report-fd", report.fileno(), pass_fds=[report.fileno()])
        else:
            self.lab.start(side, *command)

    def report(self, side):
        return os.path.join(self.folder.name, side + ".jsonl")

    def perf(self, pair, side, topic):
        return [self.measures.programs["trestle"], "perf", "bridge", "--domain", pair.domains[side], "--interface", LOOPBACK,
                "--topic", topic, *["--shared-memory"] * pair.shared_memory]

    def ping(self, pair, topic, size, seconds):
        return self.lab.run("a", *self.perf(pair, "a", topic), "--json", "--size", size, "--seconds", seconds, "--warm-up",
                            "0.1", "--timeout", "5")

    def hop(self, kind, size):
        return self.lab.run("a", self.measures.programs["floor"], "ping-dds", *HOPS[kind], f"bytes={size}",
                            f"seconds={self.measures.seconds}")

    def round(self):
        """With the hops and the transfer that are a way's floor."""
        seconds = self.measures.seconds
        for name, size in SIZES.items():
            self.measures.in_turn(*[(f"dds {way} {name}", functools.partial(self.hop, way, size)) for way in HOPS],
                                  (f"path transfer {name}", lambda: self.measures.transfer(size, 1, seconds)),
                                  (f"path {name}", lambda: self.ping(PLAIN, "/perf", size, seconds)),
                                  (f"path paced {name}", lambda: self.ping(PLAIN, "/paced", size, seconds)),
                                  (f"path shared {name}", lambda: self.ping(SHARED, "/paced", size, seconds)),
                                  times=3 if size < 1 << 20 else 2)  # the small ones scatter more
        for size in CLOUDS.values():  # percentiles want many, and large ones take their time
            self.measures.take(f"cloud {size}", lambda: self.ping(REPORTING, "/perf", size, max(seconds, 10 * seconds * size / MOST)))

    def clouds(self):
        """What the bridges reported of them: conversion and transport of each message, by cloud size."""
        sent = [line for line in self.carried("a") if line["route"] == "/perf/there"]
        came = [line for line in self.carried("b") if line["route"] == "/perf/there"]
        waiting = {}
        for line in sorted(sent + came, key=lambda line: line["before_ns"]):
            if line["direction"] == "dds_to_someip":
                waiting[line["session"]] = line
            elif line["session"] in waiting:
                self.add(waiting.pop(line["session"]), line)

    def carried(self, side):
        with open(self.report(side), encoding="utf-8") as file:
            lines = [json.loads(line) for line in file]
        return [line for line in lines if line["event"] == "carried"]

    def add(self, sent, came):
        """The size of a payload is that of its points and a few hundred bytes of description."""
        size = next((size for size in CLOUDS.values() if size <= sent["bytes"] < size + 400), None)
        if size is not None:
            there, back = (line["after_ns"] - line["before_ns"] for line in (sent, came))
            self.measures.values.setdefault(f"checkpoints {size}", []).append(
                {"to_someip_ns": there, "to_cdr_ns": back, "conversion_ns": there + back,
                 "communication_ns": came["after_ns"] - sent["before_ns"]})

    def nodes(self):
        """A node without DDS: alone, beside one whose service it has subscribed to, and as it starts."""
        program, address = self.measures.programs["node"], self.lab.address
        self.measures.take("idle", lambda: self.lab.run("b", program, "idle", address["b"], IDLE_SECONDS, patience=60))
        self.lab.start("a", program, "serve", address["a2"])
        time.sleep(1)
        self.measures.take("idle beside", lambda: self.lab.run("b", program, "idle", address["b"], IDLE_SECONDS,
                                                               patience=60))
        for _ in range(5):
            self.measures.take("first event", lambda: self.lab.run("b", program, "first-event", address["b"]))
