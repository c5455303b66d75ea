"""What the tests with Python stacks share: our Node as a program, a recorder, and when to skip."""
import os
import re
import shutil
import subprocess
import sys
import threading
import time

# Where `./run setup --peers` installs the stacks; this program goes on there.
PEERS = os.environ.get("TRESTLE_PEERS") or os.path.join(os.path.dirname(__file__), "../../../build/peers")
PYTHON = os.path.join(os.path.abspath(PEERS), "bin/python")
if os.path.exists(PYTHON) and os.path.realpath(sys.prefix) != os.path.realpath(PEERS):
    os.execv(PYTHON, [PYTHON, "-B", *sys.argv])

SERVICE, INSTANCE = 0x1234, 0x5678
GROUP = "224.244.224.61"  # of service discovery; no other test uses it
SD_PORT = 30490


def missing(what):
    """Ends the program: as skipped, or as failed where the peers are required."""
    required = os.environ.get("TRESTLE_REQUIRE_PEERS", "") not in ("", "0")
    print(f"{'missing' if required else 'skipped'}: {what}; ./run setup --peers installs it")
    sys.exit(1 if required else 77)


class Node:
    """A Node of ours in a process of its own: see node_peer.cpp for what it understands."""

    def __init__(self, program, address, group=GROUP):
        self.address = address
        self.process = subprocess.Popen([program, address, group], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                        bufsize=1)
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

    def expect(self, pattern, seconds=5):
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
        self.process.wait(10)
        self.reader.join(5)
        self.process.stdin.close()
        self.process.stdout.close()


class Recorder:
    """Records the loopback device, so that tshark can judge what our Node sends. Needs the right to record."""

    def __init__(self, path):
        self.path = path
        self.process = None
        dumpcap = shutil.which("dumpcap")
        if dumpcap is None:
            return
        process = subprocess.Popen([dumpcap, "-q", "-i", "lo", "-f", "net 127.61.0.0/16 or dst host " + GROUP,
                                    "-w", path], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        for line in process.stderr:
            if line.startswith("File:"):
                self.process = process
                return
        process.wait(5)

    def complaints(self, address):
        """tshark's expert about frames from `address`; nothing when there is no recording."""
        if self.process is None:
            return []
        time.sleep(0.5)  # until the kernel has handed over what was last seen
        self.process.terminate()
        self.process.communicate(timeout=5)
        command = ["tshark", "-r", self.path, "-Y", f"ip.src == {address} && (someip || _ws.malformed)"]
        for transport in ("udp", "tcp"):
            command += ["-d", f"{transport}.port==1-65535,someip"]
        command += ["-T", "fields", "-e", "frame.number", "-e", "someip.messageid", "-e", "_ws.expert.message"]
        output = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=True).stdout
        rows = [line.split("\t") for line in output.splitlines()]
        if not rows:
            return ["nothing was recorded"]
        # What is said of the TCP layer (a reset, say) is the kernel's.
        return [row for row in rows if re.search("SOME/IP|Malformed|malformed", row[2])]
