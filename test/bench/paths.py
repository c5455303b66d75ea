"""The way DDS -> SOME/IP -> DDS through two bridges, beside a hop of plain Fast DDS."""
import dataclasses
import functools
import json
import os
import pathlib
import re
import shutil
import sys
import tempfile
import time

from lab import Failed
from measures import CLOUDS, SIZES, WATCHED, WATCHED_RATE

LOOPBACK = "127.0.0.1"
# Of plain Fast DDS: sent by a thread of its own or by the thread that writes, and both by shared memory.
HOPS = {"asynchronous": ["domain=93"], "synchronous": ["domain=95", "synchronous=1"],
        "shared asynchronous": ["domain=94", "shared_memory=1"],
        "shared synchronous": ["domain=96", "shared_memory=1", "synchronous=1"]}
MOST = max(CLOUDS.values())
CONSOLE = {"a": 19464, "b": 19465}  # ports, on loopback
RECORD_DOMAIN = 84
RECORD_BYTES, RECORD_RATE = 4_000_000, 100  # 400 MB/s of clouds
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
    console: bool = False  # a page, metrics, and who makes records

    def yaml(self, side, address, records):
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
        if self.console:
            lines.append(f"console: {{address: {LOOPBACK}:{CONSOLE[side]}, records: {records}}}")
        return "\n".join(lines) + "\n"


PLAIN = Pair({"a": 91, "b": 92}, 0x7e61, "3")
SHARED = Pair({"a": 97, "b": 98}, 0x7e71, "6", shared_memory=True)
REPORTING = Pair({"a": 89, "b": 90}, 0x7e81, "7", reports=True)
UNSEEN = Pair({"a": 85, "b": 86}, 0x7e91, "11")
SEEN = Pair({"a": 87, "b": 88}, 0x7ea1, "12", console=True)


class Paths:
    def __init__(self, measures):
        self.measures = measures
        self.lab = measures.lab
        self.folder = tempfile.TemporaryDirectory(prefix="trestle-bench-")
        self.memory = tempfile.TemporaryDirectory(prefix="trestle-bench-", dir="/dev/shm")  # a tmpfs

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
            file.write(pair.yaml(side, self.lab.address[side + pair.address], self.memory.name))
        command = [self.measures.programs["trestle"], "bridge", "--quiet", config]
        if pair.reports:
            with open(self.report(side), "wb") as report:
                return self.lab.start(side, *command, "--report-fd", report.fileno(), pass_fds=[report.fileno()])
        return self.lab.start(side, *command)

    def report(self, side):
        return os.path.join(self.folder.name, side + ".jsonl")

    def perf(self, pair, side, topic):
        return [self.measures.programs["trestle"], "perf", "bridge", "--domain", pair.domains[side], "--interface", LOOPBACK,
                "--topic", topic, *["--shared-memory"] * pair.shared_memory]

    def ping(self, pair, topic, size, seconds, *options, warm_up=0.1):
        return self.lab.run("a", *self.perf(pair, "a", topic), "--json", "--size", size, "--seconds", seconds, "--warm-up",
                            warm_up, "--timeout", "5", *options)

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

    def looked_at(self):
        """What it costs that somebody can look at bridges, and what it costs when somebody does: two pairs, of which one has
        consoles, started anew for it."""
        size, seconds = SIZES[WATCHED], 5 * self.measures.seconds
        bridges, started = {}, []
        for pair in UNSEEN, SEEN:
            bridges[pair.service] = [self.start_bridge(pair, side) for side in "ab"]
            started += [*bridges[pair.service], self.lab.start("b", *self.perf(pair, "b", "/paced"), "--reflect")]
        time.sleep(1)

        def used(pair):
            """Nobody looks. All that a bridge does for a message is counted, also in the kernel."""
            before = sum(map(self.lab.cpu_ns, bridges[pair.service]))
            found = self.ping(pair, "/paced", size, seconds, warm_up=0)
            return {**found, "cpu_ns": (sum(map(self.lab.cpu_ns, bridges[pair.service])) - before) / found["received"],
                    "resident_kb": max(map(self.lab.resident_kb, bridges[pair.service]))}

        def slowly(pair):
            return self.ping(pair, "/paced", size, seconds, "--rate", WATCHED_RATE)

        def watched():
            out = os.path.join(self.folder.name, "viewer.json")
            with open(out, "wb") as file:
                viewer = self.lab.start("a", "chrt", "--other", "0", sys.executable, "-B", pathlib.Path(__file__).parent / "viewer.py",
                                        CONSOLE["a"], "/paced/there", stdout=file)
            try:
                time.sleep(1)
                found = slowly(SEEN)
            finally:
                self.lab.stop(viewer)
            with open(out, encoding="utf-8") as file:
                seen = json.loads(file.read() or "null")
            if not seen or not seen["received"] or not seen["recorded"] or seen["lost"]:
                raise Failed(f"nobody looked at it, or it was not recorded: {seen}")
            return {**found, "viewer": seen}

        try:
            self.measures.in_turn(*[(f"path {name}", functools.partial(used, pair))
                                    for name, pair in (("unseen", UNSEEN), ("seen", SEEN))], times=2)
            self.measures.in_turn(("path unwatched", functools.partial(slowly, UNSEEN)), ("path watched", watched))
        finally:
            for process in started:
                self.lab.stop(process)
            self.forget_records()

    def forget_records(self):
        for left in pathlib.Path(self.memory.name).iterdir():
            shutil.rmtree(left)

    def record(self):
        """`trestle record` beside somebody who publishes, in whose sight nothing else is."""
        config = os.path.join(self.folder.name, "record.yaml")
        with open(config, "w", encoding="utf-8") as file:
            file.write(f"someip: {{address: {self.lab.address['a12']}}}\n"
                       f"dds: {{domain: {RECORD_DOMAIN}, interfaces: [{LOOPBACK}]}}\nroutes:\n"
                       "  - {topic: /clouds, type: sensor_msgs/msg/PointCloud2, direction: dds_to_someip, service: 0x7eb1, "
                       "instance: 1, eventgroup: 1, event: 0x8001, port: 40001}\n")

        def recorded():
            out = os.path.join(self.folder.name, "record.txt")
            with open(out, "wb") as file:
                recorder = self.lab.start("a", self.measures.programs["trestle"], "record", "--quiet", "--config", config, "-o",
                                          os.path.join(self.memory.name, "bag"), stdout=file)
            try:
                sent = self.lab.run("a", self.measures.programs["floor"], "publish-dds", f"domain={RECORD_DOMAIN}",
                                    f"bytes={RECORD_BYTES}", f"rate={RECORD_RATE}", f"seconds={7 * self.measures.seconds}")
                time.sleep(0.5)  # for what is under way
            finally:
                self.lab.stop(recorder)
                self.forget_records()
            with open(out, encoding="utf-8") as file:
                text = file.read()
            came = re.search(r"^(\d+) messages in ", text, re.MULTILINE)
            if not came:
                raise Failed(f"nothing was recorded: {text}")
            counted = sum(map(int, re.findall(r"^(\d+) (?:messages|frames|were) .*\(\w+\)$", text, re.MULTILINE)))
            return {**sent, "received": int(came[1]), "published": sent["megabytes_per_second"],
                    "lost": max(counted, sent["received"] - int(came[1])),
                    "megabytes_per_second": sent["megabytes_per_second"] * int(came[1]) / sent["received"]}

        self.measures.take("record", recorded)

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
