"""The table of goals: what is met, what is missed, and that nothing is left out in silence."""
import unittest

import goals

LATENCY = {"latency_ns": {"p50": 10e3, "p99": 20e3}, "per_second": 1000.0, "megabytes_per_second": 100.0, "lost": 0}


class Goals(unittest.TestCase):
    def test_a_ratio_is_met_up_to_its_bound(self):
        for ours, met in (14, True), (15, True), (15.1, False):
            self.assertEqual(goals.Goal("", goals.ns, [10], [ours], at_most=1.5).met, met)
        for ours, met in (6.1, True), (6, True), (5.9, False):
            self.assertEqual(goals.Goal("", goals.per_second, [10], [ours], at_least=0.6).met, met)

    def test_a_ratio_is_the_median_of_those_of_the_rounds(self):
        # Medians of floor and ours would be 20 and 30: of two rounds that have nothing to do with each other.
        row = goals.Goal("what", goals.ns, [10, 20, 40], [30, 22, 44], at_most=1.5)
        self.assertEqual(row.cells(), ["what", "20 ns", "30 ns", "1.10", "1.10 – 3.00", "≤ 1.5 ×",
                                       "met; missed 1 of 3 times"])

    def test_rounds_on_the_other_side_of_a_goal_are_told(self):
        for ours, verdict in (([12, 13, 14], "met"), ([14, 16, 17], "**missed**; met 1 of 3 times"),
                              ([16, 17, 18], "**missed**"), ([14, 15, None, 16], "met; missed 1 of 3 times; 1 of 4 rounds failed")):
            row = goals.Goal("what", goals.ns, [10] * len(ours), ours, at_most=1.5)
            self.assertEqual(row.cells()[-1], verdict)
        self.assertEqual(goals.Goal("", goals.megabytes, None, [900, 800, 1100], least=1000).cells()[-1],
                         "**missed**; met 1 of 3 times")

    def test_a_round_in_which_one_of_the_two_failed_has_no_ratio(self):
        row = goals.Goal("what", goals.ns, [10, None, 10, 10, 10], [None, 900, 12, 14, 13], at_most=1.5)
        self.assertEqual([round(ratio, 3) for ratio in row.ratios], [1.2, 1.4, 1.3])
        self.assertEqual(row.cells()[3:], ["1.30", "1.20 – 1.40", "≤ 1.5 ×", "met; 2 of 5 rounds failed"])

    def test_a_goal_needs_more_than_half_of_the_rounds(self):
        for ours, met in ([12, None, None], None), ([12, None], None), ([12, 13, None], True), ([None] * 3, None):
            row = goals.Goal("what", goals.ns, None, ours, limit=20)
            self.assertEqual(row.met, met)
            self.assertEqual(row.cells()[-1].startswith("not measured"), met is None)
        self.assertEqual(goals.Goal("what", goals.ns, None, [12, None], limit=20).cells()[-1],
                         "not measured; 1 of 2 rounds failed")

    def test_what_has_no_goal_is_told_and_not_judged(self):
        row = goals.Goal("what", goals.per_second, [200], [100])
        self.assertEqual((row.is_judged, row.met), (False, None))
        self.assertEqual(row.cells(), ["what", "200 /s", "100 /s", "0.50", "", "", ""])
        self.assertEqual(goals.Goal("what", goals.per_second, [200], [None]).cells()[-1], "not measured")

    def test_a_limit_is_met_up_to_it(self):
        for ours, met in (2999, True), (3000, True), (3001, False):
            self.assertEqual(goals.Goal("", goals.ns, None, [ours], limit=3000).met, met)
        for ours, met in (1001, True), (1000, True), (999, False):
            self.assertEqual(goals.Goal("", goals.megabytes, [5000], [ours], least=1000).met, met)
        row = goals.Goal("what", goals.ns, None, [2900, 5000, 2800], limit=3000)
        self.assertEqual(row.cells(), ["what", "", "2.9 µs", "", "2.8 µs – 5 µs", "≤ 3 µs", "met; missed 1 of 3 times"])

    def test_what_was_not_measured_is_neither(self):
        for floor, ours in (None, [1]), ([1], None), ([1], [None]), (None, None):
            self.assertIsNone(goals.Goal("", goals.ns, floor, ours, at_most=1.5).met)
        self.assertIsNone(goals.Goal("", goals.ns, None, None, limit=1).met)
        self.assertIn("not measured", goals.Goal("", goals.ns, None, None, limit=1).cells())

    def test_a_rate_with_losses_is_no_rate(self):
        measured = {"megabytes_per_second": 100.0, "lost": 0}
        for lost, verdict in (0, "met"), (3, "**missed**; 3 lost"):
            values = {"tp floor rate 1 MB": [measured] * 3,  # also when it was but one of them
                      "tp rate 1 MB": [measured, {**measured, "lost": lost}, measured]}
            row = next(row for row in goals.communication(values) if row.what == "TP sustained 1 MB, not paced")
            self.assertEqual(row.cells()[-1], verdict)

    def test_a_latency_with_losses_is_missed(self):
        values = {"udp floor": [LATENCY], "udp call": [{**LATENCY, "lost": 1}], "path transfer 1 MB": [LATENCY],
                  "dds synchronous 1 MB": [LATENCY], "path 1 MB": [{**LATENCY, "lost": 2}]}
        rows = {row.what: row for row in goals.communication(values) + goals.paths(values)}
        self.assertEqual(rows["UDP call 64 B, p50"].cells()[-1], "**missed**; 1 lost")
        self.assertIn("**missed**; 2 lost", rows["DDS, SOME/IP, DDS 1 MB, p50, not paced"].cells()[-1])

    def test_a_flood_tells_how_much_of_it_was_lost(self):
        flood = {"per_second": 1000.0, "received": 90, "lost": 10}
        values = {"flood floor": [flood] * 2, "trains floor": [{**flood, "lost": 0}] * 2,
                  "events 64 B": [{**flood, "received": 30, "lost": 10}] * 2}
        rows = {row.what: row.cells()[-1] for row in goals.communication(values) if row.what.startswith("events 64 B, received")}
        self.assertEqual(rows, {"events 64 B, received: over sendmmsg": "met; lost: floor 10 %, ours 25 %",
                                "events 64 B, received: over trains of 80 B": "lost: floor nothing, ours 25 %"})

    def test_a_silent_receiver_is_to_miss_nothing_and_vsomeip_has_to_be_there_for_a_ratio(self):
        whole = {"megabytes_per_second": 130.0, "lost": 0, "received": 200, "latency_ns": {"p50": 8e6}}
        name, what = "1 MB reads 200 MB/s", "events of 1 MB to a silent receiver that reads 200 MB/s: "
        for theirs, lost, rate, verdict in (
                (None, 0, "vsomeip is not installed: no goal; first to last segment 8 ms (p50)", "met; of 600 messages in all rounds"),
                (100.0, 0, "met; first to last segment 8 ms (p50)", "met; of 600 messages in all rounds"),
                (101.0, 1, "**missed**; first to last segment 8 ms (p50)", "**missed**; 1 lost; of 600 messages in all rounds")):
            values = {f"silent {name}": [whole, {**whole, "lost": lost, "received": 200 - lost}, whole]}
            if theirs:
                values[f"vsomeip silent {name}"] = [{**whole, "megabytes_per_second": theirs, "lost": 50}] * 3
            rows = {row.what: row.cells()[-1] for row in goals.communication(values)}
            self.assertEqual((rows[what + "rate, over vsomeip's"], rows[what + "lost"]), (rate, verdict))

    def test_being_looked_at_costs_a_hundredth_and_two_megabytes_at_most(self):
        def used(cpu_ns, kb):
            return [{"cpu_ns": cpu_ns, "resident_kb": kb, "lost": 0}] * 3

        for cpu_ns, kb, verdicts in (101_000, 32_048, [True, True]), (101_001, 32_049, [False, False]):
            rows = goals.looked_at({"path unseen": used(100_000, 30_000), "path seen": used(cpu_ns, kb)})
            self.assertEqual([row.met for row in rows[:2]], verdicts)

    def test_calls_by_a_proxy_are_compared_with_those_of_a_node_in_rate_and_time(self):
        for per_second, cpu_ns, met in (901, 549, [True, True]), (899, 549, [False, True]), (901, 551, [True, False]):
            values = {"calls by both": [{"node": {"per_second": 1000, "cpu_ns": 500}, "lost": 0,
                                         "proxy": {"per_second": per_second, "cpu_ns": cpu_ns}}]}
            rows = [row for row in goals.communication(values) if row.what.endswith("over Node::call")]
            self.assertEqual([row.met for row in rows], met)

    def test_the_slowest_size_counts(self):
        values = {f"checkpoints {size}": [{"to_someip_ns": size / 1000 + i, "to_cdr_ns": 10 + i} for i in range(100)]
                  for size in goals.CLOUDS.values()}
        rows = {row.what: row for row in goals.conversion(values)}
        for part, ours in ("p50", 12049), ("p99", 12098):
            row = rows[f"PointCloud2 to SOME/IP in a running bridge, {part}, slowest size"]
            self.assertEqual((row.ours, row.met), (ours, False))
            row = rows[f"PointCloud2 to CDR in a running bridge, {part}, slowest size"]
            self.assertEqual((row.ours, row.met), (ours - 12000 + 10, True))
        values = {f"conversion point_cloud_to_cdr/points:{points}": [{"ns": points / 100}] * 2 for points in goals.POINTS}
        rows = {row.what: row for row in goals.conversion(values)}
        row = rows["PointCloud2 to CDR by reference, alone, slowest size"]
        self.assertEqual((row.ours, row.met), (5000, False))

    def test_values_count_by_their_median_over_the_rounds(self):
        values = {"udp floor": [LATENCY] * 3,
                  "udp call": [{"latency_ns": {"p50": p50, "p99": 1}, "lost": 0} for p50 in (90e3, 12e3, 13e3)]}
        row = goals.communication(values)[0]
        self.assertEqual(row.cells(),
                         ["UDP call 64 B, p50", "10 µs", "13 µs", "1.30", "1.20 – 9.00", "≤ 1.5 ×",
                          "met; missed 1 of 3 times"])

    def test_the_way_through_two_bridges_is_compared_with_two_hops_and_a_transfer(self):
        values = {"dds asynchronous 1 MB": [LATENCY], "path transfer 1 MB": [LATENCY], "path 1 MB": [LATENCY]}
        row = next(row for row in goals.paths(values) if row.what == "DDS, SOME/IP, DDS 1 MB, p50, not paced")
        self.assertEqual((row.floor, row.ours, row.met), (30e3, 10e3, True))

    def test_the_quicker_way_of_writing_is_the_floor_of_a_hop(self):
        def hops(*each):
            return [{"latency_ns": {"p50": p50}, "lost": 0} for p50 in each]

        for asynchronous, synchronous, floors, way in (
                ((20e3, 20e3, 20e3), (30e3, 10e3, 12e3), [70e3, 30e3, 34e3], "synchronous"),
                ((10e3, 11e3, 40e3), (20e3, 20e3, 20e3), [30e3, 32e3, 90e3], "asynchronous")):
            values = {"dds asynchronous 64 KB": hops(*asynchronous), "dds synchronous 64 KB": hops(*synchronous),
                      "path transfer 64 KB": [LATENCY] * 3, "path 64 KB": hops(45e3, 45e3, 45e3)}
            row = next(row for row in goals.paths(values) if row.what == "DDS, SOME/IP, DDS 64 KB, p50, not paced")
            self.assertEqual(row.floors, floors)
            self.assertIn(f"floor: {way} hops", row.cells()[-1])

    def test_bridges_that_use_shared_memory_are_compared_with_hops_that_do(self):
        by_udp, quick, slow, ours = ({"latency_ns": {"p50": p50}, "lost": 0, "received": 9} for p50 in (20e3, 5e3, 6e3, 30e3))
        values = {"dds synchronous 64 KB": [by_udp], "dds shared asynchronous 64 KB": [quick],
                  "dds shared synchronous 64 KB": [slow], "path transfer 64 KB": [LATENCY], "path paced 64 KB": [LATENCY],
                  "path shared 64 KB": [ours]}
        rows = {row.what: row for row in goals.paths(values)}
        row = rows["the same 64 KB by shared memory, default pacing"]
        self.assertEqual((row.floors, row.ours, row.is_judged), ([20e3], 30e3, False))
        row = rows["the bridges by UDP, hops by shared memory 64 KB, default pacing"]
        self.assertEqual((row.floors, row.ours, row.is_judged), ([20e3], 10e3, False))
        self.assertEqual(rows["DDS, SOME/IP, DDS 64 KB, p50, default pacing"].floors, [50e3])

    def test_a_floor_that_lost_something_is_none(self):
        lossy = {**LATENCY, "lost": 1}
        values = {"tp floor latency 1 MB": [LATENCY, lossy, LATENCY], "tp latency 1 MB": [LATENCY] * 3,
                  "dds synchronous 1 MB": [LATENCY, LATENCY, lossy], "path transfer 1 MB": [lossy, LATENCY, LATENCY],
                  "path 1 MB": [LATENCY] * 3}
        rows = {row.what: row for row in goals.communication(values) + goals.paths(values)}
        self.assertEqual(rows["TP event 1 MB, p50, not paced"].floors, [10e3, None, 10e3])
        self.assertEqual(rows["DDS, SOME/IP, DDS 1 MB, p50, not paced"].floors, [None, 30e3, None])

    def test_a_large_call_is_compared_with_the_way_there_and_back(self):
        values = {"transfer 1 MB": [LATENCY], "udp call 1 MB": [LATENCY], "tcp floor 1 MB": [LATENCY], "tcp call 1 MB": [LATENCY]}
        rows = {row.what: row for row in goals.communication(values)}
        self.assertEqual(rows["UDP call 1 MB, p50, default pacing"].floors, [20e3])
        self.assertEqual(rows["TCP call 1 MB, p50"].floors, [10e3])

    def test_wake_ups_for_discovery_are_not_counted(self):
        idle = {"resident_kb": 6144, "seconds": 5.0, "wakeups": 11, "discovery_datagrams": 10}
        for kind, words in ("idle", "alone"), ("idle beside", "with a subscription"):
            rows = {row.what: row for row in goals.paths({kind: [idle]})}
            self.assertTrue(rows[f"idle node {words}, wake-ups beside SD"].met)
            self.assertTrue(rows[f"idle node {words}, memory (RSS)"].met)
            rows = {row.what: row for row in goals.paths({kind: [{**idle, "wakeups": 12, "resident_kb": 6145}]})}
            self.assertFalse(rows[f"idle node {words}, wake-ups beside SD"].met)
            self.assertFalse(rows[f"idle node {words}, memory (RSS)"].met)

    def test_small_arrays_of_numbers_tell_by_how_much_they_are_above(self):
        values = {"conversion laser_scan_to_cdr": [{"ns": 190, "floor": {"ns": 100}}] * 2,
                  "conversion laser_scan_to_someip": [{"ns": 150, "floor": {"ns": 100}}] * 2}
        rows = {row.what: row.cells()[-1] for row in goals.conversion(values) if row.what.startswith("LaserScan")}
        self.assertEqual(rows, {"LaserScan of 1,081 ranges and intensities to CDR": "**missed**; by 40 ns",
                                "LaserScan of 1,081 ranges and intensities to SOME/IP": "met"})

    def test_times_have_three_digits_that_matter(self):
        for value, text in ((812, "812 ns"), (3456, "3.46 µs"), (33.1e6, "33.1 ms"), (123e6, "123 ms"), (2e9, "2 s"),
                            (999.8e3, "1 ms")):
            self.assertEqual(goals.ns(value), text)


if __name__ == "__main__":
    unittest.main()
