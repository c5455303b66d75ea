"""What tests of `trestle record` and `trestle replay` share: a SOME/IP service, a bridge that makes a topic of its event,
and programs that run beside each other."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
from bare_peer import PATIENCE
from bridge_program import BRIDGE, GROUP, PEER, head
from plain_mcap import MAGIC, Mcap

TRESTLE = sys.argv.pop(1)
CAPTURES = pathlib.Path(sys.argv.pop(1))

ROUTE = """\
routes:
  - {topic: /text, type: std_msgs/msg/String, direction: someip_to_dds, service: 0x2222, instance: 1, eventgroup: 1, event: 0x8001,
     minor: any, qos: {depth: 50, durability: transient_local}}
"""
HELLO = bytes.fromhex("00010000 06000000 68656c6c6f 00")
NETWORK = ["--multicast", GROUP]


def decoded(capture):
    """The messages of a capture as `trestle decode` has them: segments put together, and none that cannot be read."""
    done = subprocess.run([TRESTLE, "decode", "--reassemble", capture], stdout=subprocess.PIPE, timeout=PATIENCE)
    return [one for one in map(json.loads, done.stdout.splitlines()) if "service" in one and "bytes" not in one and
            (not one.get("tp") or one.get("reassembled"))]


class RecordTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_trestle(self, *arguments, status=0, environment=None):
        done = subprocess.run([TRESTLE, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE,
                              env={**os.environ, **(environment or {})})
        self.assertEqual(done.returncode, status, done.stderr + done.stdout)
        return done.stdout, done.stderr

    def run_record(self, *arguments, status=0):
        return self.run_trestle("record", *arguments, status=status)

    def start(self, *command, **settings):
        process = subprocess.Popen([TRESTLE, *map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **settings)

        def end():
            if process.poll() is None:
                process.kill()
            process.communicate()
        self.addCleanup(end)
        return process

    def wait(self, condition, what):
        end = time.monotonic() + PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.05)

    def start_bridge(self):
        """With one route; its configuration."""
        config = self.folder / "bridge.yaml"
        config.write_text(head(BRIDGE) + ROUTE)
        self.start("bridge", "-q", config)
        return config

    def start_events(self):
        return self.start("notify", "0x2222.1", "1", "0x8001", "data: hello", "--address", PEER, *NETWORK,
                          "--type", "std_msgs/msg/String", "--rate", "50", "-q")

    def counts(self, target):
        """Messages by topic, as far as they are in the file now."""
        if not target.exists() or target.stat().st_size < len(MAGIC):
            return {}
        found = {}
        for topic, *_ in Mcap(target).messages:
            found[topic] = found.get(topic, 0) + 1
        return found
