"""The table of goals: what is met, what is missed, and that nothing is left out in silence."""
import unittest

import goals

LATENCY = {"latency_ns": {"p50": 10e3, "p99": 20e3}, "per_second": 1000.0, "megabytes_per_second": 100.0}


class Goals(unittest.TestCase):
    def test_a_ratio_is_met_up_to_its_bound(self):
        for ours, met in (14, True), (15, True), (15.1, False):
            self.assertEqual(goals.Goal("", goals.ns, 10, ours, at_most=1.5).met, met)
        for ours, met in (6.1, True), (6, True), (5.9, False):
            self.assertEqual(goals.Goal("", goals.rate, 10, ours, at_least=0.6).met, met)

    def test_a_limit_is_met_up_to_it(self):
        for ours, met in (2999, True), (3000, True), (3001, False):
            self.assertEqual(goals.Goal("", goals.ns, None, ours, limit=3000).met, met)
        for ours, met in (1001, True), (1000, True), (999, False):
            self.assertEqual(goals.Goal("", goals.megabytes, 5000, ours, least=1000).met, met)

    def test_what_was_not_measured_is_neither(self):
        for floor, ours in (None, 1), (1, None), (None, None):
            self.assertIsNone(goals.Goal("", goals.ns, floor, ours, at_most=1.5).met)
        self.assertIsNone(goals.Goal("", goals.ns, None, None, limit=1).met)
        self.assertIn("not measured", goals.Goal("", goals.ns, None, None, limit=1).cells())

    def test_values_count_by_their_median_over_the_rounds(self):
        values = {"udp floor": [LATENCY] * 3,
                  "udp call": [{"latency_ns": {"p50": p50, "p99": 1}} for p50 in (90e3, 12e3, 13e3)]}
        row = goals.communication(values)[0]
        self.assertEqual(row.cells(), ["UDP call 64 B, p50", "10 µs", "13 µs", "1.30", "≤ 1.5 ×", "met"])

    def test_the_way_through_two_bridges_is_compared_with_two_hops_and_a_transfer(self):
        values = {"dds floor 1 MB": [LATENCY], "tp floor latency 1 MB": [LATENCY], "path 1 MB": [LATENCY]}
        row = next(row for row in goals.paths(values) if row.what == "DDS, SOME/IP, DDS 1 MB, p50, not paced")
        self.assertEqual((row.floor, row.ours, row.met), (30e3, 10e3, True))

    def test_wake_ups_for_discovery_are_not_counted(self):
        idle = {"resident_kb": 6144, "seconds": 5.0, "wakeups": 11, "discovery_datagrams": 10}
        rows = {row.what: row for row in goals.paths({"idle": [idle]})}
        self.assertTrue(rows["idle node, wake-ups beside SD"].met)
        self.assertTrue(rows["idle node, memory (RSS)"].met)
        rows = {row.what: row for row in goals.paths({"idle": [{**idle, "wakeups": 12, "resident_kb": 6145}]})}
        self.assertFalse(rows["idle node, wake-ups beside SD"].met)
        self.assertFalse(rows["idle node, memory (RSS)"].met)

    def test_times_have_three_digits_that_matter(self):
        for value, text in ((812, "812 ns"), (3456, "3.46 µs"), (33.1e6, "33.1 ms"), (123e6, "123 ms"), (2e9, "2 s"),
                            (999.8e3, "1 ms")):
            self.assertEqual(goals.ns(value), text)


if __name__ == "__main__":
    unittest.main()
