"""trestle perf: servers and clients as programs, whose figures must add up and be possible.

Usage: perf_commands_test.py TRESTLE
"""
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.dom.minidom

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
from dds_domain import own_domain
from socket_buffers import limits_below, limits_told, of_others, without_net_admin

TRESTLE = sys.argv.pop(1)
PATIENCE = 60  # seconds; running into it is a failure

# Addresses and a group that only this process uses.
PID = os.getpid()
HOST = f"127.{1 + (PID >> 8) % 254}.{PID & 255}."
GROUP = f"239.252.{PID >> 8 & 255}.{PID & 255}"
EXAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../../examples")


def network(host):
    return ["--address", HOST + str(host), "--multicast", GROUP]


def client_command(*arguments, seconds="0.3"):
    timeout = () if "--timeout" in arguments else ("--timeout", "30")
    return [TRESTLE, "perf", "client", *network(2), "--seconds", seconds, "--warm-up", "0.05", *timeout, *arguments]


def client(*arguments, **how):
    done = subprocess.run(client_command(*arguments, **how), capture_output=True, text=True, timeout=PATIENCE,
                          check=False)
    done.stderr = of_others(done.stderr)
    return done


@contextlib.contextmanager
def running(*arguments):
    """Until it is stopped, and whatever it says."""
    with subprocess.Popen([TRESTLE, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)


class Server:
    def __init__(self, *arguments):
        self.process = subprocess.Popen([TRESTLE, "perf", "server", *network(1), *arguments],
                                        stderr=subprocess.PIPE, text=True)
        while "offering" not in self.process.stderr.readline():
            pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=PATIENCE)


def most_at_a_time(measure):
    """How many were under way at a time in the mean, of ten measurements at the most: what waits when the time is over
    does not count, which is much where the machine stalls just then."""
    most = 0
    for _ in range(10):
        figures = measure()
        most = max(most, figures["latency_ns"]["mean"] * figures["received"] / (figures["seconds"] * 1e9))
        if most > 2:
            break
    return most


def check_drawing(test, file):
    """Of latency over percentile."""
    drawing = xml.dom.minidom.parse(file)
    test.assertEqual(drawing.documentElement.tagName, "svg")
    points = drawing.getElementsByTagName("polyline")[0].getAttribute("points").split()
    test.assertGreater(len(points), 10)
    xs, ys = zip(*(map(float, point.split(",")) for point in points))
    test.assertEqual(list(xs), sorted(xs))
    test.assertEqual(list(ys), sorted(ys, reverse=True))  # later percentiles are no faster


class Measuring(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server()

    @classmethod
    def tearDownClass(cls):
        with cls.server:
            pass
        assert cls.server.process.returncode == 0

    def measured(self, *arguments):
        done = client("--json", *arguments)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        figures = json.loads(done.stdout)
        self.assertEqual(figures["sent"], figures["received"] + figures["lost"] + figures["failed"])
        self.assertEqual(figures["failed"], 0)
        self.assertGreater(figures["received"], 0)
        self.assertGreaterEqual(figures["seconds"], 0.3)
        self.assertAlmostEqual(figures["per_second"], figures["received"] / figures["seconds"], delta=0.01)
        self.assertAlmostEqual(figures["megabytes_per_second"], figures["per_second"] * figures["payload_bytes"] / 1e6,
                               delta=0.01)
        latency = figures["latency_ns"]
        self.assertEqual(latency["count"], figures["received"])
        self.assertEqual(sum(count for _, count in figures["histogram"]), latency["count"])
        order = [latency[key] for key in ("min", "p50", "p90", "p99", "p999", "max")]
        self.assertEqual(order, sorted(order))
        self.assertGreater(latency["min"], 0)
        self.assertLess(latency["max"], PATIENCE * 1e9)
        self.assertNotIn("clock_error_ns", figures)  # one host has one clock
        for process in "client", "server":
            self.assertGreaterEqual(figures["cpu_percent"][process]["user"], 0)
        return figures

    def test_calls_are_measured(self):
        for transport in "udp", "tcp":
            with self.subTest(transport):
                figures = self.measured("--size", "100", *(["--tcp"] if transport == "tcp" else []))
                self.assertEqual((figures["what"], figures["transport"], figures["payload_bytes"], figures["lost"]),
                                 ("calls", transport, 100, 0))
                # One at a time: the latencies of all fill the time, but for what lies between answer and call.
                self.assertLessEqual(figures["latency_ns"]["mean"] * figures["received"], figures["seconds"] * 1e9)

    def test_calls_in_flight_overlap(self):
        self.assertGreater(most_at_a_time(lambda: self.measured("--in-flight", "8")), 2)

    def test_large_calls_go_in_segments(self):
        self.assertEqual(self.measured("--size", "64KB", "--separation", "0")["payload_bytes"], 65536)

    def test_requests_wait_between_bursts_as_they_are_told_to(self):
        # Three segments, with two pauses between them. Some may seem shorter: where this program had to wait for a
        # processor between the first segment and the look at the clock.
        paced = client("--json", "--size", "4000", "--burst", "1", "--separation", "50000", seconds="2")
        self.assertEqual(paced.returncode, 0, paced.stderr)
        self.assertGreaterEqual(json.loads(paced.stdout)["latency_ns"]["p50"], 95e6)

    def test_events_are_measured_one_at_a_time(self):
        for size, transport in ("16", []), ("64KB", []), ("1MB", ["--separation", "0"]), ("64KB", ["--tcp"]):
            with self.subTest(size=size, transport=transport):
                figures = self.measured("--events", "--size", size, *transport)
                self.assertEqual(figures["what"], "events")
                self.assertIn("dropped_by_server", figures["counters"])

    def test_events_come_at_the_rate_that_is_wanted(self):
        begin = time.monotonic()
        figures = self.measured("--events", "--rate", "200", "--window", "0")
        # What a stall takes is caught up with, also that of a stall just before.
        self.assertLessEqual(figures["sent"], 200 * (time.monotonic() - begin) + 10)
        # What the numbers of the events tell is what the server has counted, but for what it sent before and after.
        self.assertLessEqual(figures["sent"], figures["counters"]["sent_by_server"] + 10)
        others = 200 * (time.monotonic() - begin - figures["seconds"]) + 10
        self.assertGreaterEqual(figures["sent"], figures["counters"]["sent_by_server"] - others)

    def test_busy_polling_takes_a_core(self):
        def cpu(*how):
            return sum(self.measured("--events", "--rate", "20", "--window", "0", *how)["cpu_percent"]["client"].values())
        self.assertGreater(cpu("--busy-poll", "1000000"), 3 * cpu())

    def test_events_without_a_window_are_received_or_lost(self):
        figures = self.measured("--events", "--size", "256KB", "--window", "0", "--separation", "0")
        self.assertGreater(figures["counters"]["sent_by_server"] + 10, figures["received"])

    def test_two_clients_one_after_another_get_what_they_ask_for(self):
        self.assertEqual(self.measured("--events", "--size", "1000")["payload_bytes"], 1000)
        self.assertEqual(self.measured("--events", "--size", "2000")["payload_bytes"], 2000)

    def test_calls_and_events_beside_each_other_do_not_mix(self):
        events = subprocess.Popen([TRESTLE, "perf", "client", *network(3), "--json", "--events", "--size", "64", "--rate",
                                   "200", "--window", "0", "--seconds", "4", "--warm-up", "0.05"],
                                  stdout=subprocess.PIPE, text=True)
        time.sleep(0.5)
        self.assertEqual(self.measured("--size", "64")["what"], "calls")
        figures = json.loads(events.communicate(timeout=PATIENCE)[0])
        self.assertEqual((events.returncode, figures["failed"]), (0, 0))
        self.assertGreater(figures["received"], 400)  # to the end, though the calls have ended

    def test_the_text_for_people_has_the_same_figures(self):
        done = client()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"^calls by udp, 64 bytes, 1 in flight\n")
        sent, received, lost, failed = map(int, re.search(
            r"sent (\d+)   received (\d+)   lost (\d+)   failed (\d+)", done.stdout).groups())
        self.assertEqual(sent, received + lost + failed)
        self.assertRegex(done.stdout, r"latency    min [\d.]+ [num]?s   p50 ")

    def test_progress_is_told_on_standard_error(self):
        done = client(seconds="4")  # each second, but for those in which the machine stalls
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"^ +[1-4]\.\d s +\d+ /s ")
        self.assertEqual(client("--quiet", seconds="1.2").stderr, "")

    def test_the_drawing_is_an_image(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "latency.svg")
            self.assertEqual(client("--plot", file).returncode, 0)
            check_drawing(self, file)
            self.assertEqual(client("--plot", "/proc/no/such.svg").returncode, 1)


class Bridge(unittest.TestCase):
    DOMAIN, FAR_DOMAIN = own_domain(), own_domain()
    WHERE = ["--domain", str(DOMAIN), "--interface", "127.0.0.1", "--topic", f"/perf{PID}"]

    def test_samples_that_come_back_are_measured(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "latency.svg")
            with running("perf", "bridge", "--reflect", *self.WHERE) as far:
                done = subprocess.run([TRESTLE, "perf", "bridge", *self.WHERE, "--json", "--size", "1000", "--seconds",
                                       "0.3", "--timeout", "30", "--plot", file],
                                      capture_output=True, text=True, timeout=PATIENCE, check=False)
            check_drawing(self, file)
        self.assertEqual((done.returncode, of_others(done.stderr), far.returncode), (0, "", 0))
        figures = json.loads(done.stdout)
        self.assertEqual((figures["what"], figures["payload_bytes"]), ("bridge", 992))  # 62 points
        self.assertEqual(list(figures["cpu_percent"]), ["this_end"])
        self.assertEqual(figures["sent"], figures["received"] + figures["lost"])
        latency = figures["latency_ns"]
        self.assertEqual(latency["count"], figures["received"])
        self.assertGreater(latency["min"], 0)
        # One at a time, and each takes its latency twice.
        self.assertLessEqual(2 * latency["mean"] * figures["received"], 1.01 * figures["seconds"] * 1e9)

    def test_samples_under_way_overlap(self):
        def measured():
            done = subprocess.run([TRESTLE, "perf", "bridge", *self.WHERE, "--json", "--window", "8", "--seconds", "0.3",
                                   "--timeout", "30"], capture_output=True, text=True, timeout=PATIENCE, check=False)
            self.assertEqual((done.returncode, of_others(done.stderr)), (0, ""))
            return json.loads(done.stdout)
        with running("perf", "bridge", "--reflect", *self.WHERE) as far:
            self.assertGreater(2 * most_at_a_time(measured), 2)  # each takes its latency twice
        self.assertEqual(far.returncode, 0)

    def test_samples_go_at_the_rate_that_is_wanted(self):
        with running("perf", "bridge", "--reflect", *self.WHERE) as far:
            done = subprocess.run([TRESTLE, "perf", "bridge", *self.WHERE, "--json", "--size", "1000", "--window", "8", "--rate", "50",
                                   "--seconds", "0.5", "--timeout", "30"],
                                  capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertEqual((done.returncode, of_others(done.stderr), far.returncode), (0, "", 0))
        figures = json.loads(done.stdout)
        self.assertEqual(figures["how"], "50 a second, 8 under way, half of the way there and back")
        # Beside those that were under way before. Without a limit there are thousands a second.
        self.assertLessEqual(figures["sent"], 50 * figures["seconds"] + 9)

    def test_the_examples_are_a_way_that_can_be_measured(self):
        def own(text):
            """With addresses, domains and topics of this process alone."""
            for pattern, ours in [(r"192\.168\.1\.", HOST), (r"(domain:? )91", rf"\g<1>{self.DOMAIN}"),
                                  (r"(domain:? )92", rf"\g<1>{self.FAR_DOMAIN}"), (r"/perf/", f"/perf{PID}/"),
                                  (r"^dds:", f"  sd: {{multicast: {GROUP}}}\ndds:")]:
                text = re.sub(pattern, ours, text, flags=re.MULTILINE)
            return text

        measuring, reflecting = "--size 1MB", "--reflect"
        with contextlib.ExitStack() as stack:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            for side, what in ("b", reflecting), ("a", measuring):
                with open(os.path.join(EXAMPLES, f"perf_bridge_{side}.yaml"), encoding="utf-8") as file:
                    text = own(file.read())
                with open(os.path.join(folder, side), "w", encoding="utf-8") as file:
                    file.write(text)
                stack.enter_context(running("bridge", "--quiet", file.name))
                perf = re.search(rf"^#   trestle (perf bridge .* {what})$", text, re.MULTILINE).group(1).split()
                perf += ["--topic", f"/perf{PID}"]
                if what == reflecting:
                    stack.enter_context(running(*perf))
            done = subprocess.run([TRESTLE, *perf, "--json", "--seconds", "0.3", "--timeout", "30"], capture_output=True,
                                  text=True, timeout=PATIENCE, check=False)
        self.assertEqual((done.returncode, of_others(done.stderr)), (0, ""))
        figures = json.loads(done.stdout)
        self.assertEqual(figures["payload_bytes"], 1 << 20)
        self.assertGreater(figures["received"], 0)

    def test_nobody_at_the_other_end_is_told(self):
        done = subprocess.run([TRESTLE, "perf", "bridge", *self.WHERE, "--timeout", "0.2"], capture_output=True,
                              text=True, timeout=PATIENCE, check=False)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("error: nothing came back", done.stderr)

    def test_buffers_that_the_system_does_not_grant_are_told(self):
        for end in [], ["--reflect"]:
            with subprocess.Popen([TRESTLE, "perf", "bridge", *self.WHERE, *end], stderr=subprocess.PIPE, text=True) as run:
                told = [limits_told(run.stderr.readline(), by="warning: DDS: ") for _ in limits_below(16 << 20, 0)]
                run.send_signal(signal.SIGINT)
            self.assertEqual([limit for line in told for limit in line], limits_below(16 << 20, 0))


class Failing(unittest.TestCase):
    def test_a_missing_service_is_told(self):
        done = client("0x7e58.1", "--timeout", "0.3")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertEqual(done.stderr, "error: nobody offers the service\n")

    def test_what_can_wait_to_be_sent_is_not_refused(self):
        done = client("0x7e58.1", "--timeout", "0.3", "--in-flight", "3", "--size", "16MB")
        self.assertEqual((done.returncode, done.stderr), (1, "error: nobody offers the service\n"))

    def test_buffers_that_the_system_does_not_grant_are_told(self):
        short = "--timeout", "0.3"
        for command in client_command("0x7e58.1", "--json", *short), [TRESTLE, "perf", "server", *network(4), *short]:
            done = subprocess.run([*command, "--quiet"], preexec_fn=without_net_admin,
                                  capture_output=True, text=True, timeout=PATIENCE, check=False)
            self.assertEqual(limits_told(done.stderr, by="warning: "), limits_below(8 << 20, 0))
            self.assertEqual(done.stdout, "")

    def test_another_service_is_told(self):
        other = subprocess.Popen([TRESTLE, "offer", "0x7e59.1", "--udp", "--tcp", "--method", "1", *network(3)],
                                 stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        try:
            done = client("0x7e59.1", "--timeout", "30")
        finally:
            other.send_signal(signal.SIGINT)
            other.wait(PATIENCE)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertEqual(done.stderr, "error: the service is not one of 'trestle perf server'\n")

    def test_a_server_that_ends_is_told(self):
        with Server("0x7e5a.1"):
            started = subprocess.Popen(client_command("0x7e5a.1", "--timeout", "30", seconds="30"), stdout=subprocess.PIPE,
                                       stderr=subprocess.PIPE, text=True)
            self.assertIn(" /s ", next(line for line in started.stderr if of_others(line)))  # it measures
        out, log = started.communicate(timeout=PATIENCE)
        self.assertEqual((started.returncode, out), (1, ""))
        self.assertIn("error: the service is gone\n", log)

    def test_wrong_command_lines_are_explained(self):
        for arguments, message in [
            (["perf"], "subcommand"),
            (["perf", "client", "--size", "17MB"], "--size"),
            (["perf", "client", "--size", "some"], "--size"),
            (["perf", "client", "--events", "--size", "8"], "events have at least 16 bytes"),
            (["perf", "client", "--in-flight", "0"], "--in-flight"),
            (["perf", "client", "--in-flight", "4", "--events"], "--events excludes --in-flight"),
            (["perf", "client", "--rate", "100"], "--rate requires --events"),
            (["perf", "client", "--window", "4"], "--window requires --events"),
            (["perf", "client", "--separation", "0", "--tcp"], "--tcp excludes --separation"),
            (["perf", "client", "--burst", "4", "--tcp", "--events"], "--tcp excludes --burst"),
            (["perf", "client", "--in-flight", "4", "--size", "16MB"],
             "--in-flight, --size: 4 calls of 16777216 bytes at a time: no more than 67108864 bytes can wait"),
            (["perf", "client", "--seconds", "0"], "--seconds"),
            (["perf", "client", "0x10000"], "SERVICE: expected"),
            (["perf", "server", "0x1234"], "names no instance"),
            (["perf", "bridge", "--domain", "233"], "--domain"),
            (["perf", "bridge", "--size", "15"], "--size"),
            (["perf", "bridge", "--reflect", "--size", "1MB"], "--reflect excludes --size"),
            (["perf", "bridge", "--rate", "-1"], "--rate"),
            (["perf", "bridge", "--json", "--reflect"], "--reflect excludes --json"),
        ]:
            with self.subTest(arguments):
                done = subprocess.run([TRESTLE, *arguments], capture_output=True, text=True, timeout=PATIENCE,
                                      check=False)
                self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
                self.assertIn(message, done.stderr)

    def test_help_has_examples(self):
        for name in "server", "client", "bridge":
            done = subprocess.run([TRESTLE, "perf", name, "--help"], capture_output=True, text=True, timeout=PATIENCE,
                                  check=False)
            self.assertEqual(done.returncode, 0)
            self.assertIn(f"Examples:\n  trestle perf {name}", done.stdout)
            self.assertIn("Exit status: 0", done.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
