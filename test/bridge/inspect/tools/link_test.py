#!/usr/bin/env python3
"""link_test.py TRESTLE: `trestle offer` and `trestle subscribe` at the two ends of a cable that is pulled. It runs in a
network namespace with one end as eth0; the other end is in TRESTLE_PEER_NAMESPACE (see in_namespaces)."""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

program = sys.argv.pop(1)
PATIENCE = 60  # seconds; running into it is a failure
OURS, PEERS = "10.77.0.2", "10.77.0.1"


class Command:
    """trestle with its arguments, and what it has written so far."""

    def __init__(self, folder, *arguments, at_peer=False):
        place = ["nsenter", "--net=" + os.environ["TRESTLE_PEER_NAMESPACE"]] if at_peer else []
        self.files = {name: pathlib.Path(folder, f"{arguments[0]}.{name}") for name in ("out", "log")}
        with open(self.files["out"], "w") as out, open(self.files["log"], "w") as log:
            self.process = subprocess.Popen([*place, program, *arguments], stdout=out, stderr=log)

    def said(self, where, text):
        return self.files[where].read_text().count(text)

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        self.process.wait(PATIENCE)
        print(*(file.read_text() for file in self.files.values()))


class Link(unittest.TestCase):
    def wait(self, ready, what):
        end = time.monotonic() + PATIENCE
        while not ready():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.02)

    def test_is_followed_at_both_ends(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        server = Command(folder.name, "offer", "0x1234.1", "--field", "-/-/0x8001=c0ffee", "--address", OURS)
        self.addCleanup(server.stop)
        client = Command(folder.name, "subscribe", "0x1234.1", "1", "--hex", "--address", PEERS, at_peer=True)
        self.addCleanup(client.stop)
        self.wait(lambda: client.said("out", "c0ffee") > 0, "the first value")

        subprocess.run(["ip", "link", "set", "eth0", "down"], check=True)
        self.wait(lambda: server.said("log", "link eth0 is down: it is switched off"), "the server sees it")
        self.wait(lambda: server.said("log", "link down, no longer subscribed"), "the server's subscription ends")
        self.wait(lambda: client.said("log", "link eth0 is down: it has no carrier"), "the client sees it")
        self.wait(lambda: client.said("log", "is gone: link down"), "the client loses the service")

        before = client.said("out", "c0ffee")
        subprocess.run(["ip", "link", "set", "eth0", "up"], check=True)
        self.wait(lambda: client.said("out", "c0ffee") > before, "the value again, of the new subscription")
        for one in server, client:
            self.assertEqual(one.said("log", "link eth0 is up"), 1)
            self.assertEqual(one.said("log", "has restarted"), 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
