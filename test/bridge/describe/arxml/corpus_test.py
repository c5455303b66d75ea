#!/usr/bin/env python3
"""Reads real ARXML files with Trestle, and counts in them with Python's XML parser: both must see the same.

Usage: corpus_test.py ARXML_COUNTS SOURCE_FOLDER

The files are in ../shared/corpora beside the project, or in TRESTLE_CORPORA; without them the test is skipped.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

NAMESPACE = "{http://autosar.org/schema/r4.0}"
PROGRAM = sys.argv[1]
CORPORA = pathlib.Path(os.environ.get("TRESTLE_CORPORA", pathlib.Path(sys.argv[2]).parent / "shared" / "corpora"))


def seen_by_python(files):
    """Services, methods, events and fields of Adaptive files, by their elements alone."""
    counts = {"services": 0, "methods": 0, "events": 0, "fields": 0}
    interfaces, deployments = set(), []
    for file in files:
        for interface in ElementTree.parse(file).iter(NAMESPACE + "SERVICE-INTERFACE"):
            interfaces.add(interface.findtext(NAMESPACE + "SHORT-NAME"))
            counts["services"] += 1
            for key, path in (("methods", "METHODS/CLIENT-SERVER-OPERATION"), ("events", "EVENTS/VARIABLE-DATA-PROTOTYPE"),
                              ("fields", "FIELDS/FIELD")):
                counts[key] += len(interface.findall("/".join(NAMESPACE + part for part in path.split("/"))))
        deployments += ElementTree.parse(file).iter(NAMESPACE + "SOMEIP-SERVICE-INTERFACE-DEPLOYMENT")
    for deployment in deployments:
        # One whose interface is not among the files is a service as well, of what it deploys.
        if deployment.findtext(NAMESPACE + "SERVICE-INTERFACE-REF").strip().split("/")[-1] not in interfaces:
            counts["services"] += 1
            for key, tag in (("methods", "SOMEIP-METHOD-DEPLOYMENT"), ("events", "SOMEIP-EVENT-DEPLOYMENT"),
                             ("fields", "SOMEIP-FIELD-DEPLOYMENT")):
                counts[key] += len(list(deployment.iter(NAMESPACE + tag)))
    return counts


def structures_of(files):
    """Names of all structures and unions."""
    names = set()
    for file in files:
        for kind in ("IMPLEMENTATION-DATA-TYPE", "STD-CPP-IMPLEMENTATION-DATA-TYPE", "APPLICATION-RECORD-DATA-TYPE"):
            for node in ElementTree.parse(file).iter(NAMESPACE + kind):
                if node.findtext(NAMESPACE + "CATEGORY") in ("STRUCTURE", "UNION", "VARIANT"):
                    names.add(node.findtext(NAMESPACE + "SHORT-NAME"))
    return names


def read(files, *options):
    return subprocess.run([PROGRAM, *options, *map(str, files)], capture_output=True, text=True, timeout=120)


def seen_by_trestle(done):
    return {line.split()[0]: int(line.split()[1]) for line in done.stdout.splitlines()}


class Corpus(unittest.TestCase):
    def test_files_alone(self):
        files = sorted((CORPORA / "files").rglob("*.arxml"))
        self.assertGreater(len(files), 50)
        for file in files:
            with self.subTest(file=file.name):
                done = read([file])
                got, expected = seen_by_trestle(done), seen_by_python([file])
                self.assertEqual({key: got[key] for key in expected}, expected)
                # Refused is only what refers to types of another file.
                errors = [line for line in done.stderr.splitlines() if " error: " in line]
                self.assertEqual(done.returncode, 1 if errors else 0, done.stderr)
                names = {name.text for name in ElementTree.parse(file).iter(NAMESPACE + "SHORT-NAME")}
                for line in errors:
                    path = re.search("the type (/[^ ]*) is in none of the files", line)[1]
                    self.assertNotIn(path.split("/")[-1], names)

    def test_structures(self):
        for file in sorted((CORPORA / "files").rglob("*.arxml")):
            if "franca_deployment" in str(file):
                continue  # how their application types are implemented is no type of its own
            with self.subTest(file=file.name):
                text = read([file], "--json").stdout
                for name in structures_of([file]):
                    self.assertIn(f'"name": "{name}"', text)

    def test_pairs(self):
        pairs = [(file, file.with_name(file.stem + "_Deployment.arxml"))
                 for file in sorted((CORPORA / "files").rglob("f2a/*.arxml")) if "_Deployment" not in file.stem]
        self.assertGreater(len(pairs), 3)
        for pair in pairs:
            with self.subTest(file=pair[0].name):
                done = read(pair)
                self.assertEqual(done.returncode, 0, done.stderr)
                expected = seen_by_python(pair)
                self.assertEqual({key: seen_by_trestle(done)[key] for key in expected}, expected)

    def test_round_trips(self):
        groups = [[file] for file in sorted((CORPORA / "files").rglob("*.arxml")) if "franca_deployment" not in str(file)]
        groups += [[file, file.with_name(file.stem + "_Deployment.arxml")]
                   for file in sorted((CORPORA / "files").rglob("f2a/*.arxml")) if "_Deployment" not in file.stem]
        trips = 0
        for group in groups:
            before = read(group, "--canonical")
            if before.returncode != 0:
                continue  # types of other files
            with self.subTest(file=group[0].name), tempfile.TemporaryDirectory() as folder:
                written = read(group, "--arxml")
                again = pathlib.Path(folder, "again.arxml")
                again.write_text(written.stdout)
                after = read([again], "--canonical")
                self.assertEqual(after.returncode, 0, after.stderr)
                if "not carried" not in written.stderr:
                    trips += 1
                    self.assertEqual(after.stdout, before.stdout)
        self.assertGreater(trips, 30)

    def test_classic(self):
        for name in ("classic_v1.arxml", "classic_v2.arxml"):
            done = read([CORPORA / "arxml_oracle" / name])
            self.assertEqual(done.returncode, 0, done.stderr)
            got = seen_by_trestle(done)
            self.assertEqual((got["services"], got["instances"], got["machines"]), (1, 2, 2))


if __name__ == "__main__":
    if not CORPORA.is_dir():
        print(f"skipped: no {CORPORA}")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
