"""All of ./run bench but the measuring: pieces_test.py TRESTLE_BENCH. What is measured answers the same each time."""
import contextlib
import io
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import bench
import goals
import lab
import measures
import others
import paths
import report

MICRO = sys.argv.pop()
FIGURES = {"latency_ns": {"count": 100, "p50": 10_000, "p99": 20_000, "max": 30_000}, "per_second": 1000.0,
           "megabytes_per_second": 100.0, "received": 100, "lost": 0, "resident_kb": 5000, "seconds": 5.0, "wakeups": 11,
           "discovery_datagrams": 10, "first_event_ns": 6_000_000, "histogram": "long", "payload_bytes": 1000,
           "node": {"per_second": 1000.0, "cpu_ns": 500.0}, "proxy": {"per_second": 1000.0, "cpu_ns": 500.0}}
VIEWER = {"received": 9, "lost": 0, "recorded": 500}
ABOUT = {"date": "2000-01-01", "command": "./run bench", "rounds": 2, "place": "a test", "priority": "with none",
         "cpu": "no core", "kernel": "0", "compiler": "none", "load": "0.1"}
ROUNDS = 2


class Nowhere:
    """A place in which each program answers at once."""

    def __init__(self):
        self.address = {side + number: f"192.0.2.{i}" for i, (side, number) in
                        enumerate((side, number) for side in "ab" for number in lab.NUMBERS)}
        self.loopback = "192.0.2.101", "192.0.2.102"
        self.commands = []
        self.failing = None
        self.failures = None  # how often; nothing: always
        self.micro = None
        self.recorded = b"100 messages in bag_0.mcap\n"
        self.viewer = VIEWER
        self.cpu = 0

    def start(self, side, *command, stdout=None, **_options):
        self.commands.append((side, *map(str, command)))
        if "record" in command:
            stdout.write(self.recorded)
        elif stdout:
            stdout.write(json.dumps(self.viewer).encode())

    @staticmethod
    def on_one_core(*command):
        return ["taskset", *command]

    def cpu_ns(self, _process):
        self.cpu += 1000
        return self.cpu

    @staticmethod
    def resident_kb(_process):
        return 20_000

    def stop(self, _process):
        self.commands.append(("stop",))

    def run(self, side, *command, patience=None, **_options):
        self.start(side, *command)
        if self.failing in map(str, command) and self.failures != 0:
            self.failures = None if self.failures is None else self.failures - 1
            raise lab.Failed("it was told to")
        if command[0] == MICRO:
            if self.micro is None:
                done = subprocess.run([MICRO, *map(str, command[1:-1]), "--benchmark_min_time=0.0001"], text=True,
                                      capture_output=True, timeout=patience, check=True)
                self.micro = json.loads(done.stdout)
            return self.micro
        return dict(FIGURES)


def carried(before, after, direction, size):
    return {"event": "carried", "route": "/perf/there", "direction": direction, "session": 7, "before_ns": before,
            "after_ns": after, "bytes": size + 200}


class Pieces(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = Nowhere()
        programs = {name: pathlib.Path(name) for name in ("trestle", "floor", "node", "no_segmentation")}
        cls.taken = measures.Measures({**programs, "micro": MICRO, "vsomeip": pathlib.Path(__file__)}, quick=True,
                                      place=cls.place)
        cls.taken.rest = 0
        ways = paths.Paths(cls.taken)
        ways.report = lambda side: pathlib.Path(ways.folder.name) / f"{side}.jsonl"
        for side in "ab":
            with open(ways.report(side), "w", encoding="utf-8") as lines:
                for number, size in enumerate(measures.CLOUDS.values()):
                    at = 1_000_000 * number
                    lines.write(json.dumps(carried(at, at + 2000, "dds_to_someip", size) if side == "a" else
                                           carried(at + 500_000, at + 504_000, "someip_to_dds", size)) + "\n")
        vsomeip = others.Vsomeip(cls.taken)  # for this one it is enough to be a file
        for number in range(ROUNDS):
            cls.taken.backwards = number % 2 == 1
            cls.taken.small()
            cls.taken.busy()
            cls.taken.one_core()
            cls.taken.newcomers()
            cls.taken.large()
            cls.taken.silent("silent", "a")
            ways.round()
            ways.looked_at()
            ways.record()
            vsomeip.round()
            cls.taken.conversion()
        ways.clouds()
        ways.nodes()
        for holder in ways.folder, ways.memory, vsomeip.folder:
            holder.cleanup()
        cls.rows = goals.communication(cls.taken.values) + goals.paths(cls.taken.values) + goals.conversion(
            cls.taken.values)

    def test_each_row_of_the_tables_is_measured(self):
        self.assertEqual(self.taken.faults, [])
        for row in self.rows:
            self.assertIsNotNone(row.ours, row.what)
            self.assertNotIn("not measured", row.cells()[-1])
            if row.is_judged:
                self.assertIn(row.met, (True, False), row.what)

    def test_what_has_a_floor_is_measured_as_often_as_that(self):
        for row in self.rows:
            if row.floor is not None:
                is_way = row.what.startswith(("DDS, SOME/IP, DDS ", "the same 64", "the same 256", "the same 1 MB", "the same 4 MB",
                                              "the bridges by UDP"))
                times = (3 if is_way and (" 64 KB" in row.what or " 256 KB" in row.what) else
                         2 if is_way or ("TP " in row.what and "no UDP_SEGMENT" in row.what) or "CPU time" in row.what else 1)
                self.assertEqual(len(row.ratios), ROUNDS * times, row.what)

    def test_every_other_round_goes_the_other_way_about(self):
        order = [("floor" if command[1] == "floor" else "ours") for command in self.place.commands
                 if (command[1:3] == ("floor", "ping-udp") and "busy=1" not in command)
                 or (command[1:3] == ("trestle", "perf") and command[-2:] == ("--size", "64") and "--events" not in
                     command)]
        self.assertEqual(order, ["floor", "ours", "ours", "floor"])

    def test_every_other_time_in_a_round_goes_the_other_way_about(self):
        for backwards, order in (False, ["floor", "ours", "ours", "floor"]), (True, ["ours", "floor", "floor", "ours"]):
            taken = measures.Measures(self.taken.programs, quick=True, place=Nowhere())
            taken.rest, taken.backwards = 0, backwards
            came = []
            taken.in_turn(*[(name, lambda name=name: came.append(name) or {}) for name in ("floor", "ours")], times=2)
            self.assertEqual(came, order)

    def test_another_stack_is_tried_again_and_the_report_tells_what_it_has_not_measured(self):
        for failures, medians in ((others.TRIES - 1, "10 µs"), (others.TRIES, "10 µs (1 of 2 rounds)"),
                                  (2 * others.TRIES, "not measured (0 of 2 rounds)")):
            place = Nowhere()
            place.failing, place.failures = "tcp", failures
            taken = measures.Measures(self.taken.programs, quick=True, place=place)
            taken.rest = 0
            other = others.Vsomeip(taken)
            for _ in range(ROUNDS):
                other.round()
            other.folder.cleanup()
            self.assertEqual(taken.faults, ["vsomeip tcp call: it was told to"] * (failures // others.TRIES))
            text = report.vsomeip({**self.taken.values, **taken.values})
            self.assertIn(f"| TCP call 64 B, p50 | {medians} | 10 µs |", text)
            self.assertIn("| UDP call 64 B, p50 | 10 µs | 10 µs |", text)

    def test_a_host_that_takes_the_processors_away_is_told(self):
        self.assertEqual(report.stolen_percent((100, 7), (160, 47)), 40)
        self.assertEqual(report.stolen_percent((100, 7), (100, 7)), 0)
        for stolen, is_told in (40, True), (2, False):
            text = report.text_of(self.taken.values, {**ABOUT, "stolen": stolen})
            self.assertEqual(f"took {stolen} % of the time" in text, is_told)

    def test_only_what_is_written_is_kept_to_be_drawn_again(self):
        for options, is_kept in ([], True), (["--quick"], False), (["--check"], False), (["--quick", "--check"], False):
            with tempfile.TemporaryDirectory() as folder, mock.patch.object(
                    sys, "argv", ["bench", "--build", folder, *options]), mock.patch.object(
                    bench, "measure", lambda _: (self.taken, ABOUT)), mock.patch.object(
                    report, "write") as write, contextlib.redirect_stdout(io.StringIO()):
                bench.main()
                self.assertEqual((pathlib.Path(folder) / "bench.json").exists(), is_kept)
                self.assertEqual(write.call_count, int(is_kept))

    def test_checkpoints_are_told_apart(self):
        rows = {row.what: row.ours for row in self.rows}
        for part in "p50", "p99":
            self.assertEqual(rows[f"PointCloud2 to SOME/IP in a running bridge, {part}, slowest size"], 2000)
            self.assertEqual(rows[f"PointCloud2 to CDR in a running bridge, {part}, slowest size"], 4000)

    def test_the_report_has_all_of_it(self):
        text = report.text_of(self.taken.values, ABOUT)
        for row in self.rows:
            self.assertEqual(text.count("| " + " | ".join(row.cells()) + " |\n"), 1, row.what)
        self.assertNotIn("not measured", text)
        for kind in paths.HOPS:
            self.assertEqual(len(self.taken.values[f"dds {kind} 4 MB"]), ROUNDS * 2)
        self.assertIn("| calls, 32 in flight | 1,000 /s | 1,000 /s |", text)  # vsomeip's
        self.assertIn("| 1k | 1 | 2 µs, 2 µs | 4 µs, 4 µs | 6 µs | 504 µs | 1.19 % |", text)
        for line in text.splitlines():
            if line.startswith("|"):
                self.assertTrue(line.endswith("|"), line)

    def test_the_report_begins_with_what_people_choose_by(self):
        lines = report.text_of(self.taken.values, ABOUT).splitlines()
        first = [line for line in lines if line.startswith("|")]
        self.assertEqual(first[0], "| p50, or what is received | between two of ours | to others | vsomeip | floor |")
        self.assertIn("| events of 1 MB, default pacing | 100 MB/s | 100 MB/s | 100 MB/s; to others 100 MB/s | 100 MB/s |", first)
        self.assertLess(lines.index(first[0]), lines.index("## How it is measured"))
        self.assertIn("| UDP call 64 B, both ends sleep in between |  |  |  |  |", report.chooser({}))

    def ways(self):
        taken = measures.Measures(self.taken.programs, quick=True, place=Nowhere())
        taken.rest = 0
        ways = paths.Paths(taken)
        self.addCleanup(ways.folder.cleanup)
        self.addCleanup(ways.memory.cleanup)
        return ways, taken

    def test_a_record_that_misses_something_is_no_record(self):
        for text, lost, rate in ((b"100 messages in bag\n", 0, 100), (b"90 messages in bag\n", 10, 90),
                                 (b"99 messages in bag\n7 messages came faster than the disk took them (queue_full)\n", 7, 99),
                                 (b"98 messages in bag\n2 were lost before (dds_lost)\n", 2, 98)):
            ways, taken = self.ways()
            ways.lab.recorded = text
            ways.record()
            value, = taken.values["record"]
            self.assertEqual((value["lost"], value["megabytes_per_second"], value["published"]), (lost, rate, 100))
            row = goals.looked_at(taken.values)[-1]
            self.assertEqual(row.met, lost == 0)

    def test_who_sees_nothing_is_no_viewer(self):
        for viewer, failed in (VIEWER, False), ({**VIEWER, "received": 0}, True), ({**VIEWER, "lost": 1}, True), (
                {**VIEWER, "recorded": 0}, True), (None, True):
            ways, taken = self.ways()
            ways.lab.viewer = viewer
            ways.looked_at()
            self.assertEqual(taken.values["path watched"][0] is None, failed)
            self.assertEqual([fault.partition(":")[0] for fault in taken.faults], ["path watched"] * failed)

    def test_the_drawings_are_drawn(self):
        clouds = {name: 3 * found for name, found in self.taken.values.items() if name.startswith("checkpoints ")}
        with tempfile.TemporaryDirectory() as folder:
            report.write({**self.taken.values, **clouds}, ABOUT, folder)
            for name, said in (("calls", "UDP call, default pacing, p99"), ("latency", "TP event, default pacing, p99"),
                               ("bridges", "two bridges, not paced, p50"), ("conversion", "both conversions"),
                               ("share", "that is conversion")):
                drawing = (pathlib.Path(folder) / f"performance/{name}.svg").read_text(encoding="utf-8")
                self.assertIn("<svg", drawing)
                self.assertIn(said, drawing)

    def test_what_fails_is_told_and_leaves_a_gap(self):
        place = Nowhere()
        place.failing = "ping-tcp"
        taken = measures.Measures(self.taken.programs, quick=True, place=place)
        taken.rest = 0
        taken.small()
        place.failing = None
        taken.small()
        self.assertEqual(taken.faults, ["tcp floor: it was told to"])
        self.assertIsNone(taken.values["tcp floor"][0])
        row = next(row for row in goals.communication(taken.values) if row.what == "TCP call 64 B, p50")
        self.assertEqual((len(row.all_ours), row.ratios), (2, [1.0]))


if __name__ == "__main__":
    unittest.main()
