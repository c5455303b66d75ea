#!/usr/bin/env python3
"""schema_test.py TRESTLE SOURCE_FOLDER: the JSON Schema of `trestle schema` beside `trestle check`.

Whatever `check` takes, the schema takes. Each example, and a file with every key, is damaged at each place in several
ways: what `check` then finds wrong with a key or a value by itself, the schema refuses.
"""
import copy
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

try:
    import jsonschema
    import yaml
except ImportError as missing:
    print(f"Skipped: {missing} (Debian: python3-jsonschema, python3-yaml)")
    sys.exit(1 if os.environ.get("TRESTLE_REQUIRE_PEERS") else 77)

TRESTLE, SOURCE = sys.argv.pop(1), pathlib.Path(sys.argv.pop(1)).resolve()
# A copy: what is damaged stands beside what it names, and others read the examples at the same time (packages do).
WORK = tempfile.TemporaryDirectory()
COPY = pathlib.Path(shutil.copytree(SOURCE / "examples", pathlib.Path(WORK.name, "examples")))
EXAMPLES = sorted(path for path in COPY.glob("**/*.yaml") if "profile" not in path.name)
# Of bridges, like the one that is damaged; and one whose types are not here (test/bridge/autoware).
OTHER_ENDS = re.compile(r"_b\.yaml$|^perf_|^vehicle_interface\.yaml$")

# What `check` says of a key or a value that is wrong whatever else the file has.
BY_ITSELF = re.compile(r"unknown key|'\w+' is missing|: expected ")
# But not where the schema leaves the value open, or only its range.
LEFT_OPEN = re.compile(r"expected (`generate: all`|the name of a network interface|a time from|a size from|an absolute path|a pattern of topics|a range of ids|two addresses|"
                       r"an address or a subnet|an address of this host and a port|an IPv4 address of this host|a multicast address|this host's own|"
                       r"a decimal number|an integer for|a number for|true or false, found \"|a multiple of 16|an IPv4 or IPv6|16 ids|addresses of discovery|an id from 0x0001 to 0xfffe, or a range)")

MORE = """
someip:
  address: 192.0.2.1
  access: {peers: [192.0.2.0/24], others: deny, rules: [{allow: [call], service: 0x1000-0x1fff, methods: [1], peers: []}]}
  limits: {max_peers: 10, max_queued_bytes: 1 MiB, silent_after: 2 s}
methods:
  - {ros_service: /a/b, type: std_srvs/srv/SetBool, server: ros, service: 0x4020, instance: 1, method: 1, port: 40020, timeout: 2 s,
     offer: always}
  - {ros_service: /a/c, type: std_srvs/srv/Trigger, server: someip, service: 0x5020, instance: 1, method: 2, minor: any,
     e2e: {profile: 4m, data_id: 0x0502, source_id: 0x0042}}
fields:
  - {topic: /light, type: std_msgs/msg/Bool, server: someip, service: 0x5021, instance: 1, getter: 1, setter: 2, event: 0x8001,
     eventgroup: 1, e2e: {event: {profile: 1, data_id: 7, data_bits: 80, data_id_mode: both}}}
actions:
  - {action: /fibonacci, type: tf2_msgs/action/LookupTransform, server: ros, service: 0x5023, instance: 1, eventgroup: 1,
     port: 40021, methods: {send_goal: 1, cancel_goal: 2, get_result: 3}, events: {feedback: 0x8001, status: 0x8002}}
patterns:
  - {topics: /out/**, exclude: [/out/not], direction: dds_to_someip, services: 0x6000-0x6fff, port: 40022}
  - {topics: /in/**, direction: someip_to_dds, qos: {depth: 3}}
lock_file: trestle.lock
console: {address: '127.0.0.1:9464', token_file: console.token, records: records}
"""


def whole_files():
    """Texts with the folder that they stand in."""
    for example in (one for one in EXAMPLES if not OTHER_ENDS.search(one.name)):
        yield example.name if example.parent.name == "examples" else f"{example.parent.name}/{example.name}", example.read_text(), example.parent
    good = re.search(r'R"\((.*)\)"', (SOURCE / "test/bridge/carry/config/good_config.hpp").read_text(), re.DOTALL)
    yield "every key of routes", good[1], COPY
    yield "other lists", MORE, COPY


def paths(value, before=()):
    """Each place in a document."""
    if before:
        yield before
    if isinstance(value, (dict, list)):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from paths(value[key], (*before, key))


def damaged(document, path):
    """Documents with one thing changed at a place, each with what it is."""
    def change(what, act):
        result = copy.deepcopy(document)
        inner = result
        for key in path[:-1]:
            inner = inner[key]
        act(inner, path[-1])
        return f"{'.'.join(map(str, path))}: {what}", result

    def put(value):
        return change(json.dumps(value), lambda inner, key: inner.__setitem__(key, value))
    yield change("removed", lambda inner, key: inner.pop(key))
    if isinstance(path[-1], str):
        yield change("another name", lambda inner, key: inner.__setitem__(key + "x", inner.pop(key)))
    for value in ({}, None, -1, 10**15, "no such thing", [{"x": 1}]):
        yield put(value)


def check(documents, beside):
    """What `trestle check` says of each: its errors."""
    with tempfile.TemporaryDirectory(dir=beside) as folder:
        files = []
        for number, document in enumerate(documents):
            # Names of other files are meant from this one.
            text = re.sub(r'"(\w+\.(?:fidl|fdepl|arxml))"', r'"../\1"', json.dumps(document)).replace('"."', '".."')
            files.append(os.path.join(folder, f"{number}.yaml"))
            pathlib.Path(files[-1]).write_text(text)
        errors = {file: [] for file in files}
        for at in range(0, len(files), 200):
            done = subprocess.run([TRESTLE, "check", "--quiet", *files[at:at + 200]], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True, timeout=300)
            if done.returncode not in (0, 2):
                raise AssertionError(done.stderr)
            for file, text in re.findall(r"^(/.*?\.yaml)(?::\d+:\d+)?: error: (.*)$", done.stderr, re.MULTILINE):
                errors[file].append(text)
        return [errors[file] for file in files]


class Schema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        done = subprocess.run([TRESTLE, "schema"], stdout=subprocess.PIPE, check=True, timeout=60)
        cls.schema = json.loads(done.stdout)
        jsonschema.Draft7Validator.check_schema(cls.schema)
        cls.validator = jsonschema.Draft7Validator(cls.schema)

    def faults(self, document):
        return [error.message[:200] for error in self.validator.iter_errors(document)]

    def test_takes_what_check_takes_and_refuses_what_is_wrong_by_itself(self):
        for name, text, folder in whole_files():
            with self.subTest(name):
                document = yaml.safe_load(text)
                self.assertEqual(self.faults(document), [])
                mutants = [mutant for path in paths(document) for mutant in damaged(document, path)]
                verdicts = check([document, *(one for _, one in mutants)], folder)
                # One has rules for a type that no such type could have.
                self.assertEqual([error for error in verdicts[0] if "cannot be carried" not in error], [])
                differences = []
                for (what, mutant), errors in zip(mutants, verdicts[1:]):
                    faults = self.faults(mutant)
                    if not errors:
                        differences += [f"{what}: check takes it: {faults}"] if faults else []
                    elif any(BY_ITSELF.search(error) and not LEFT_OPEN.search(error) for error in errors):
                        differences += [] if faults else [f"{what}: {errors}"]
                self.assertEqual(differences, [])

    def test_takes_examples_and_what_the_documents_show(self):
        shown = []
        for page in (SOURCE / "docs").glob("*.md"):
            for block in re.findall(r"^```yaml\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE):
                document = yaml.safe_load(block) if re.search(r"^someip:", block, re.MULTILINE) else None
                if isinstance(document, dict) and any(key in document for key in ("routes", "methods", "fields", "patterns", "generate")):
                    shown.append((page.name, document))
        by_themselves = [example for example in EXAMPLES if example.parent.name == "examples"]
        shown += [(example.name, yaml.safe_load(example.read_text())) for example in by_themselves]
        verdicts = check([document for _, document in shown], COPY)
        good = [one for one, errors in zip(shown, verdicts) if not errors]
        self.assertGreater(len(good), len(by_themselves))
        for page, document in good:
            self.assertEqual(self.faults(document), [], page)

    def test_describes_values_for_editors(self):
        someip = self.schema["properties"]["someip"]
        self.assertIn("this host's own", someip["properties"]["address"]["description"])
        self.assertEqual(someip["required"], ["address"])

    def test_knows_which_keys_go_with_a_word(self):
        pattern = {"topics": "/a/**", "direction": "someip_to_dds"}
        document = {"someip": {"address": "192.0.2.1"}, "patterns": [pattern], "lock_file": "x"}
        self.assertEqual(self.faults(document), [])
        self.assertNotEqual(self.faults({**document, "patterns": [{**pattern, "services": "0x6000-0x6fff"}]}), [])
        self.assertNotEqual(self.faults({**document, "patterns": [{**pattern, "direction": "dds_to_someip"}]}), [])
        del document["lock_file"]
        self.assertNotEqual(self.faults(document), [])

    def test_every_example_names_the_schema(self):
        for example in EXAMPLES:
            self.assertRegex(example.read_text(), r"\A# yaml-language-server: \$schema=\S*trestle\.schema\.json\n", example)


if __name__ == "__main__":
    unittest.main()
