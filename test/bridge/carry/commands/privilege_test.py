"""What `trestle bridge` may do, and who may do what with it: access control with a peer of bare sockets, rights of root
given up, a file system that cannot be written, and the unit for systemd.

Usage: privilege_test.py TRESTLE SOURCE
"""
import os
import pwd
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
from bare_peer import PATIENCE, Peer, receive, ttl
from bridge_program import BRIDGE, GROUP, HOST, PEER, head, log_until

TRESTLE, SOURCE = sys.argv.pop(1), sys.argv.pop(1)
UNIT = os.path.join(SOURCE, "packaging/trestle@.service")

ROUTES = """\
routes:
  - {topic: /out, type: std_msgs/msg/String, direction: dds_to_someip, service: 0x1111, instance: 0x0001,
     eventgroup: 0x0001, event: 0x8001, port: 40001%s}
"""


class Bridge:
    """The running program, perhaps by way of another one that starts it."""

    def __init__(self, config, *options, starter=()):
        self.file = tempfile.NamedTemporaryFile("w", suffix=".yaml")
        self.file.write(config)
        self.file.flush()
        self.log = tempfile.TemporaryFile("a+")
        self.process = subprocess.Popen([*starter, TRESTLE, "bridge", *options, self.file.name], stdout=subprocess.PIPE,
                                        stderr=self.log, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def log_until(self, *wanted):
        for text in wanted:
            log_until(self.log, text)

    def finish(self):
        self.process.send_signal(signal.SIGINT)
        out, _ = self.process.communicate(timeout=PATIENCE)
        self.log.seek(0)
        return self.process.returncode, out, self.log.read()


class Access(unittest.TestCase):
    def acknowledged(self, config):
        """Whether a subscription of PEER is, and what the bridge then says."""
        with Peer(PEER, GROUP) as peer, Bridge(config) as bridge:
            bridge.log_until("Ctrl-C stops")
            peer.subscribe(BRIDGE, 0x1111, 0x0001)
            entry, _, _ = receive(peer.sd, lambda one: one[0] == 7)
            status, out, log = bridge.finish()
            self.assertEqual(status, 0, log)
            return ttl(entry) > 0, out, log

    def test_a_peer_of_the_route_may_subscribe(self):
        is_acknowledged, out, log = self.acknowledged(head() + ROUTES % f", peers: [{HOST}0/24]")
        self.assertTrue(is_acknowledged, log)
        self.assertNotIn("not_allowed", out)

    def test_another_gets_a_nack(self):
        is_acknowledged, out, log = self.acknowledged(head() + ROUTES % f", peers: [{HOST}13]")
        self.assertFalse(is_acknowledged)
        self.assertIn("nacks_not_allowed 1", out)
        self.assertIn("subscriptions_not_allowed 1", out)
        self.assertIn(f"refused a subscription to eventgroup 0x0001 of 0x1111.0x0001 by {PEER}: access control does not allow it", log)

    def test_rules_of_the_file_count_too(self):
        config = head().replace("  sd:", "  access: {others: deny}\n  sd:") + ROUTES % ""
        is_acknowledged, out, _ = self.acknowledged(config)
        self.assertFalse(is_acknowledged)
        self.assertIn("subscriptions_not_allowed 1", out)


class Rights(unittest.TestCase):
    def test_of_root_are_given_up(self):
        with open("/proc/self/uid_map", encoding="ascii") as file:
            if os.geteuid() != 0 or file.read().split()[2] != "4294967295":
                self.skipTest("only root can give up the rights of root")
        nobody = pwd.getpwnam("nobody")
        with Bridge(head() + ROUTES % "", "--user", "nobody") as bridge:
            os.chmod(bridge.file.name, 0o644)
            bridge.log_until("running as nobody")
            for thread in os.listdir(f"/proc/{bridge.process.pid}/task"):
                with open(f"/proc/{bridge.process.pid}/task/{thread}/status", encoding="ascii") as file:
                    status = dict(line.rstrip("\n").split(":\t", 1) for line in file if ":\t" in line)
                self.assertEqual(set(status["Uid"].split()), {str(nobody.pw_uid)})
                self.assertEqual(set(status["Gid"].split()), {str(nobody.pw_gid)})
                self.assertEqual(int(status["CapEff"], 16), 0)
                self.assertEqual(int(status["CapPrm"], 16), 0)
                self.assertEqual(status["NoNewPrivs"], "1")
            # It can begin anew without them.
            bridge.process.send_signal(signal.SIGHUP)
            bridge.log_until("was read again")
            log_until(bridge.log, "Ctrl-C stops", times=2)
            self.assertEqual(bridge.finish()[0], 0)

    def test_a_user_that_is_not_there_is_told(self):
        with Bridge(head() + ROUTES % "", "--user", "no-such-user") as bridge:
            self.assertEqual(bridge.process.wait(PATIENCE), 1)
            bridge.log_until("--user: ")

    def test_nothing_is_written(self):
        """With a root file system that is read-only; the counters go to a pipe, the log to a file that is open."""
        starter = ("unshare", "--mount", "sh", "-c", 'mount --make-rprivate / && mount -o remount,bind,ro / && '
                   '! touch "$0.written" 2>/dev/null && exec "$@"', os.path.realpath(TRESTLE))
        if subprocess.run([*starter, "true"], capture_output=True).returncode != 0:
            self.skipTest("no mount namespace can be made here")
        with Bridge(head() + ROUTES % "", starter=starter) as bridge:
            bridge.log_until("Ctrl-C stops")
            status, out, log = bridge.finish()
            self.assertEqual(status, 0, log)
            self.assertIn("route /out", out)


@unittest.skipUnless(shutil.which("systemd-analyze"), "systemd-analyze is not there")
class Unit(unittest.TestCase):
    def test_is_hardened(self):
        done = subprocess.run(["systemd-analyze", "security", "--offline=true", "--no-pager", UNIT], capture_output=True, text=True)
        if "--offline" in done.stderr:
            self.skipTest("this systemd-analyze has no --offline")
        exposure = re.search(r"Overall exposure level for \S+: ([\d.]+)", done.stdout)
        self.assertIsNotNone(exposure, done.stdout + done.stderr)
        self.assertLess(float(exposure[1]), 2.0, done.stdout)


if __name__ == "__main__":
    unittest.main()
