#!/usr/bin/env python3
"""promtool_test.py CONSOLE_TEST: the metrics as `promtool check metrics` judges them, and, where there is one, a reader of
OpenMetrics. Without promtool (Debian's package prometheus) it is skipped (77); with TRESTLE_REQUIRE_PEERS=1 in the
environment, or with promtool in that list, it fails."""
import os
import shutil
import subprocess
import sys
import tempfile


def main():
    promtool = shutil.which("promtool")
    if not promtool:
        required = set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) & {"1", "promtool"}
        print(f"{'missing' if required else 'skipped'}: promtool; ./run setup --peers installs it")
        return 1 if required else 77
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.argv[1], "--gtest_filter=Metrics.AreWrittenForOthersToJudge"], check=True, timeout=120,
                       env={**os.environ, "METRICS_FOLDER": folder}, stdout=subprocess.DEVNULL)
        with open(os.path.join(folder, "prometheus.txt"), encoding="utf-8") as text:
            done = subprocess.run([promtool, "check", "metrics"], stdin=text, timeout=120, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        print(done.stdout)
        if done.returncode != 0 or done.stdout.strip():
            return 1
        try:
            from prometheus_client.openmetrics.parser import text_string_to_metric_families
        except ImportError:
            print("OpenMetrics was not judged: there is no prometheus_client")
            return 0
        with open(os.path.join(folder, "openmetrics.txt"), encoding="utf-8") as text:
            families = {family.name: family for family in text_string_to_metric_families(text.read())}
        received = families["trestle_route_received_messages"]
        assert received.type == "counter" and received.samples[0].value == 12, received
        assert families["trestle_route_conversion_seconds"].type == "histogram"
    return 0


if __name__ == "__main__":
    sys.exit(main())
