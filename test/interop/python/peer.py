"""What the tests with Python stacks share: our Node as a program at the other end of a cable, a recorder, and when to
skip. They are run by in_namespaces."""
import os
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from xml.etree import ElementTree

# Where `./run setup --peers` installs the stacks; this program goes on there.
PEERS = os.environ.get("TRESTLE_PEERS") or os.path.join(os.path.dirname(__file__), "../../../build/peers")
PYTHON = os.path.join(os.path.abspath(PEERS), "bin/python")
if os.path.exists(PYTHON) and os.path.realpath(sys.prefix) != os.path.realpath(PEERS):
    os.execv(PYTHON, [PYTHON, "-B", *sys.argv])

SERVICE, INSTANCE = 0x1234, 0x5678
OURS, THEIRS = "10.77.0.1", "10.77.0.2"  # where our Node is, and this program with the other stack
GROUP = "224.244.224.245"  # of service discovery
SD_PORT = 30490
DIES_WITH_US = ["setpriv", "--pdeathsig", "KILL"]
TTL = "600"  # of our Node, in seconds: a slow machine is no reason to be gone


def missing(what):
    """Ends the program: as skipped, or as failed where the peers are required."""
    wanted = os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")
    required = what in wanted or "1" in wanted
    print(f"{'missing' if required else 'skipped'}: {what}; ./run setup --peers installs it")
    sys.exit(1 if required else 77)


class Node:
    """A Node of ours in the other namespace, or in this one: see node_peer.cpp for what it understands."""

    def __init__(self, program, address=OURS, group=GROUP, here=False):
        place = [] if here else ["nsenter", "--net=" + os.environ["TRESTLE_PEER_NAMESPACE"]]
        self.process = subprocess.Popen([*DIES_WITH_US, *place, program, address, group, TTL], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True, bufsize=1)
        self.lines = []
        self.changed = threading.Condition()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        self.expect("ready")

    def _read(self):
        for line in self.process.stdout:
            with self.changed:
                self.lines.append(line.rstrip("\n"))
                self.changed.notify_all()

    def do(self, *words):
        self.process.stdin.write(" ".join(str(word) for word in words) + "\n")

    def expect(self, pattern, seconds=60):
        """The first line that begins as the regular expression says; it and those before it are forgotten."""
        deadline = time.monotonic() + seconds
        with self.changed:
            while True:
                for index, line in enumerate(self.lines):
                    found = re.match(pattern, line)
                    if found:
                        del self.lines[:index + 1]
                        return found
                left = deadline - time.monotonic()
                if left <= 0 or not self.changed.wait(left):
                    raise AssertionError(f"no line '{pattern}' within {seconds} s; there is {self.lines}")

    def ask(self, *words, answer):
        self.do(*words)
        return self.expect(answer)

    def forget(self):
        with self.changed:
            self.lines.clear()

    def stop(self):
        """Shuts down, so that it says what it withdraws; fails if it ended in another way."""
        if self.process.poll() is None:
            self.do("quit")
        self._close()
        if self.process.returncode != 0:
            raise AssertionError(f"node_peer ended with status {self.process.returncode}")

    def kill(self):
        """As a crash would."""
        self.process.kill()
        self._close()

    def _close(self):
        self.process.wait(60)
        self.reader.join(60)
        self.process.stdin.close()
        self.process.stdout.close()


class Recorder:
    """Records all that passes over the cable, so that tshark can judge it."""

    def __init__(self, path):
        self.path = path
        for program in ("dumpcap", "tshark"):
            if shutil.which(program) is None:
                missing(program)
        self.process = subprocess.Popen([*DIES_WITH_US, "dumpcap", "-q", "-i", "eth0", "-B", "32", "-w", path],
                                        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        for line in self.process.stderr:
            if line.startswith("File:"):
                return
        raise RuntimeError("dumpcap does not record")

    def stop(self):
        if self.process.poll() is not None:
            return
        self._mark()
        self.process.terminate()
        self.process.communicate(timeout=60)

    def _mark(self):
        """Sends a message that is of nobody until it is recorded: what came before it is then, too."""
        mark = os.urandom(16)
        message = struct.pack(">HHIHHBBBB", 0x4d4d, 0x8001, 8 + len(mark), 0, 1, 1, 1, 2, 0) + mark
        end = time.monotonic() + 60
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(THEIRS))
            while time.monotonic() < end:
                sock.sendto(message, ("239.255.77.77", 9))
                time.sleep(0.1)
                with open(self.path, "rb") as file:
                    if mark in file.read():
                        return
        raise RuntimeError("dumpcap does not write what it records")

    def tshark(self, wanted, *output):
        command = ["tshark", "-r", self.path, "-Y", wanted, *output]
        for transport in ("udp", "tcp"):
            command += ["-d", f"{transport}.port==1-65535,someip"]
        return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True).stdout

    def expert(self, address):
        """What tshark's expert says about frames from `address`. UDP and TCP are left out: they are the kernel's, and a
        port from 33434 on, which the kernel may choose, makes it suspect a traceroute."""
        packets = ElementTree.fromstring(self.tshark(f"{self.sent_by(address)} && _ws.expert", "-T", "pdml"))
        said = [(field.get("showname"), packet.find(".//field[@name='num']").get("show"))
                for packet in packets for layer in packet if layer.get("name") not in ("udp", "tcp")
                for field in layer.iter("field") if field.get("name") == "_ws.expert"]
        # How a missing acknowledgement is answered (feat_req_someipsd_844): tshark warns of it since 4.4.
        return [one for one in said if "Subscribe after Stop Subscribe!" not in one[0]]

    def frames(self, address):
        """How many frames from there have SOME/IP messages."""
        return len(self.tshark(f"{self.sent_by(address)} && someip").splitlines())

    @staticmethod
    def sent_by(address):
        return f"{'ipv6' if ':' in address else 'ip'}.src == {address}"


class Recorded:
    """A test case of which everything is recorded; in the end tshark has nothing to say about what our Nodes sent."""

    ours = (OURS,)

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.recorder = Recorder(os.path.join(cls.folder.name, "recorded.pcapng"))

    @classmethod
    def tearDownClass(cls):
        cls.recorder.stop()
        judged = {address: (cls.recorder.expert(address), cls.recorder.frames(address)) for address in cls.ours}
        cls.folder.cleanup()
        for address, (said, frames) in judged.items():
            print(f"tshark has judged {frames} frames from {address}", file=sys.stderr)
            assert said == [], said
            assert frames > 20, "hardly anything was recorded"
