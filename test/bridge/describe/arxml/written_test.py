#!/usr/bin/env python3
"""What Trestle writes as ARXML is valid to others: check_arxml.py says by whom.

Usage: written_test.py PEERS_PYTHON BRIDGE_DESCRIBE_ARXML_TEST BRIDGE_DESCRIBE_TARGETS_TEST

Without the packages of `./run setup --peers` it is skipped; with TRESTLE_REQUIRE_PEERS=1 it fails.
"""
import os
import pathlib
import subprocess
import sys
import tempfile


def main():
    python, test, trips = sys.argv[1:]
    there = subprocess.run([python, "-c", "import autosar_data, k3q_arxml, lxml"], capture_output=True).returncode == 0 \
        if pathlib.Path(python).exists() else False
    if not there:
        print("skipped: autosar-data, k3q-arxml and lxml are not there; ./run setup --peers installs them")
        return 1 if {"1", "arxml"} & set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")) else 77
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "written.arxml")
        subprocess.run([test, "--gtest_filter=WriteArxml.IsReadBackAsItWas"], check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, "TRESTLE_ARXML_OUT": str(file)})
        subprocess.run([trips, "--gtest_filter=ArxmlOfFidl.*"], check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, "TRESTLE_ARXML_OUT": folder})
        written = sorted(pathlib.Path(folder).glob("*.arxml"))
        broken = pathlib.Path(folder, "broken.arxml")
        broken.write_text(file.read_text().replace("</SHORT-NAME>", "</SHORT-NAME><NO-SUCH/>", 1))
        checker = pathlib.Path(__file__).with_name("check_arxml.py")
        if subprocess.run([python, "-B", checker, broken], stdout=subprocess.DEVNULL).returncode == 0:
            print("the check finds nothing wrong in a wrong file")
            return 1
        example = pathlib.Path(__file__).resolve().parents[4] / "examples/seat/seat.arxml"
        return subprocess.run([python, "-B", checker, *written, example]).returncode


if __name__ == "__main__":
    sys.exit(main())
