#!/usr/bin/env python3
"""examples/monitoring: Prometheus itself scrapes a bridge and evaluates the rules; rules and dashboard name what there is.

Usage: monitoring_test.py TRESTLE SOURCE_FOLDER
Without Prometheus it is skipped (77); with TRESTLE_REQUIRE_PEERS=1 in the environment, or with promtool in that list, it fails.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.parse
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bridge_program import head, log_until

TRESTLE, SOURCE = sys.argv.pop(1), pathlib.Path(sys.argv.pop(1)).resolve()
EXAMPLES = SOURCE / "examples/monitoring"
PATIENCE = 60
if not shutil.which("promtool") or not shutil.which("prometheus"):
    REQUIRED = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) & {"1", "promtool"}
    print(f"{'missing' if REQUIRED else 'skipped'}: prometheus; ./run setup --peers installs it")
    sys.exit(1 if REQUIRED else 77)

ROUTES = """
console: {address: 127.0.0.1:9464}
routes:
  - {topic: /out, type: std_msgs/msg/String, direction: dds_to_someip, service: 0x1111, instance: 1, eventgroup: 1, event: 0x8001,
     port: 40001}
"""


def families(text):
    """The names that samples may have, of metrics in text form."""
    names = set()
    for name, kind in re.findall(r"^# TYPE (\S+) (\S+)$", text, re.MULTILINE):
        names |= {name + end for end in ("_bucket", "_sum", "_count")} if kind == "histogram" else {name}
    return names


class Monitoring(unittest.TestCase):
    def good(self, *command):
        done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=PATIENCE)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_files_are_right(self):
        self.good("promtool", "check", "config", EXAMPLES / "prometheus.yml")
        self.good("promtool", "test", "rules", EXAMPLES / "trestle.rules.test.yml")

    def test_prometheus_scrapes_a_bridge(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "bridge.yaml").write_text(head() + ROUTES)
        with open(folder / "log", "a+", encoding="utf-8") as log:
            bridge = subprocess.Popen([TRESTLE, "bridge", folder / "bridge.yaml"], stdout=subprocess.DEVNULL, stderr=log)
            self.addCleanup(self.end, bridge)
            log_until(log, "Ctrl-C stops")
        with urllib.request.urlopen("http://127.0.0.1:9464/metrics", timeout=PATIENCE) as answer:
            there = families(answer.read().decode())
        rules = (EXAMPLES / "trestle.rules.yml").read_text()
        dashboard = (EXAMPLES / "grafana.json").read_text()
        named = set(re.findall(r"\btrestle_\w+", rules + dashboard))
        self.assertGreater(len(named), 10)
        self.assertEqual(named - there, set())

        for name in ("trestle.rules.yml", "prometheus.yml"):
            (folder / name).write_text((EXAMPLES / name).read_text().replace("5s", "1s"))
        with socket.socket() as sock:
            sock.bind(("127.0.0.1", 0))
            port = sock.getsockname()[1]
        with open(folder / "prometheus.log", "w", encoding="utf-8") as log:
            prometheus = subprocess.Popen(["prometheus", f"--config.file={folder}/prometheus.yml",
                                           f"--storage.tsdb.path={folder}/data", f"--web.listen-address=127.0.0.1:{port}"],
                                          stdout=log, stderr=log)
        self.addCleanup(self.end, prometheus)
        self.port, self.log = port, folder / "prometheus.log"
        self.assertEqual(self.value('up{job="trestle"}'), "1")
        self.assertEqual(self.value('trestle_route_state{route="/out", state="waiting"}'), "1")
        self.assertEqual(self.value('ALERTS{alertname="TrestleRouteSilent", route="/out", alertstate="pending"}'), "1")
        for panel in json.loads(dashboard)["panels"]:
            for target in panel["targets"]:
                expression = target["expr"].replace("$__rate_interval", "5s").replace("$instance", ".*").replace("$route", ".*")
                self.assertEqual(self.query(expression)["status"], "success", expression)

    def query(self, expression):
        address = f"http://127.0.0.1:{self.port}/api/v1/query?" + urllib.parse.urlencode({"query": expression})
        with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
            return json.load(answer)

    def value(self, expression):
        """The value, as soon as there is one."""
        end = time.monotonic() + PATIENCE
        while True:
            try:
                found = self.query(expression)["data"]["result"]
            except (OSError, ValueError):
                found = []
            if found:
                return found[0]["value"][1]
            self.assertLess(time.monotonic(), end, f"{expression}\n{self.log.read_text()}")
            time.sleep(0.2)

    @staticmethod
    def end(program):
        program.send_signal(signal.SIGINT)
        program.wait(PATIENCE)


if __name__ == "__main__":
    unittest.main()
