"""A publisher, a bridge and a SOME/IP stack are killed and started again in any order: everything heals by itself.

A second bridge, the witness, is never killed: nothing of those that were may stay with it.

Usage: restarts_test.py TRESTLE PEER [SEED]
"""
import fcntl
import os
import random
import re
import select
import signal
import subprocess
import sys
import tempfile
import time

TRESTLE, PEER = sys.argv[1:3]
SEED = int(sys.argv[3]) if len(sys.argv) > 3 else random.randrange(1 << 30)
LIVES = 50  # of each
PATIENCE = 30  # seconds

PID = os.getpid()
GROUP = f"239.253.{PID >> 8 & 255}.{PID & 255}"


def address(host):
    return f"127.{1 + (PID >> 8) % 254}.{PID & 255}.{host}"


def own_domain():
    """A DDS domain that no other test uses, as dds_test.hpp chooses it."""
    for i in range(80):
        domain = 20 + (PID + i) % 80
        file = open(f"/tmp/trestle-test-domain-{domain}", "a")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return domain, file
        except OSError:
            file.close()
    raise AssertionError("no DDS domain is free")


DOMAIN, DOMAIN_LOCK = own_domain()


def config(n):
    return f"""\
someip:
  address: {address(11 + n)}
  sd: {{multicast: {GROUP}, initial_delay_min: 0, initial_delay_max: 10 ms, cyclic_offer_delay: 200 ms, ttl: 1 s}}
dds: {{domain: {DOMAIN}, interfaces: [127.0.0.1], lease: 1 s}}
routes:
  - {{topic: /up_{n}, type: std_msgs/msg/String, direction: dds_to_someip, service: {0x1000 + n}, instance: 1,
     eventgroup: 1, event: 0x8001, port: 40001, offer: while_published}}
  - {{topic: /down_{n}, type: std_msgs/msg/String, direction: someip_to_dds, service: {0x2000 + n}, instance: 1,
     eventgroup: 1, event: 0x8001, write: while_offered, subscribe: while_read}}
"""


class Party:
    """A program that can be killed and started again."""

    def __init__(self, *command):
        self.command = command
        self.log = tempfile.TemporaryFile("a+")
        self.start()

    def start(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.PIPE, stderr=self.log)
        os.set_blocking(self.process.stdout.fileno(), False)

    def end(self, how):
        self.process.send_signal(how)
        status = self.process.wait(PATIENCE)
        self.process.stdout.close()
        # One that has not got as far as looking at signals ends by them.
        assert status in (0, -how), f"{self.command[:2]} ended with {status}:\n{self.said()}"

    def said(self):
        self.log.seek(0)
        return self.log.read()[-5000:]

    def output(self):
        assert self.process.poll() is None, f"{self.command[:2]} has ended:\n{self.said()}"
        ready = select.select([self.process.stdout], [], [], 0)[0]
        return os.read(self.process.stdout.fileno(), 1 << 20).decode() if ready else ""

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    def threads(self):
        return len(os.listdir(f"/proc/{self.process.pid}/task"))

    def memory(self):
        """Its own memory, in KiB."""
        with open(f"/proc/{self.process.pid}/smaps_rollup") as file:
            return int(re.search(r"Anonymous: +(\d+) kB", file.read())[1])

    def shared_memory(self):
        """Files that it has in shared memory."""
        with open(f"/proc/{self.process.pid}/maps") as file:
            return sorted(set(re.findall("/dev/shm/.*", file.read())))


def counters(bridge, *wanted):
    """Waits for these texts in the counters of a bridge."""
    end = time.monotonic() + PATIENCE
    printed = ""
    while time.monotonic() < end:
        bridge.process.send_signal(signal.SIGUSR1)
        time.sleep(0.05)
        printed = bridge.output() or printed
        if all(re.search(text, printed) for text in wanted):
            return
    raise AssertionError(f"not in the counters: {wanted}\n{printed}\n{bridge.said()}")


def heal(ros, peer, parties):
    """Waits until what each sends arrives at the others that live now, through either bridge."""
    missing = {(receiver, f"{way} {n} {sender.process.pid:08}")
               for n in (0, 1) for way, sender, receiver in (("up", ros, peer), ("down", peer, ros))}
    end = time.monotonic() + PATIENCE
    for party in (ros, peer):
        party.output()  # what came before
    while missing:
        assert time.monotonic() < end, \
            f"never arrived: {sorted(text for _, text in missing)}\n" + "\n".join(p.said() for p in parties)
        time.sleep(0.01)
        for party in (ros, peer):
            lines = set(party.output().splitlines())
            missing = {(receiver, text) for receiver, text in missing if receiver is not party or text not in lines}


def main():
    print(f"seed {SEED}")
    choice = random.Random(SEED)
    files = []
    for n in (0, 1):
        files.append(tempfile.NamedTemporaryFile("w", suffix=".yaml"))
        files[n].write(config(n))
        files[n].flush()
    witness = Party(TRESTLE, "bridge", "--quiet", files[1].name)
    bridge = Party(TRESTLE, "bridge", "--quiet", files[0].name)
    ros = Party(PEER, "ros", str(DOMAIN))
    peer = Party(PEER, "someip", address(21), GROUP)
    parties = (witness, bridge, ros, peer)
    all_there = (r"publishers 1, offered 1\b", r"readers 1, written 1, subscribed 1\b")
    try:
        heal(ros, peer, parties)
        counters(witness, *all_there)
        descriptors, threads, memory = witness.descriptors(), witness.threads(), None
        order = [bridge, ros, peer] * LIVES
        choice.shuffle(order)
        dead = []
        for number, victim in enumerate(order):
            while victim in dead:  # it has to live to be killed
                dead.pop().start()
            victim.end(choice.choice([signal.SIGKILL, signal.SIGTERM]))
            dead.append(victim)
            time.sleep(choice.uniform(0, 0.1))
            if choice.random() < 0.7:  # else more than one is away for a while
                choice.shuffle(dead)
                while dead:
                    dead.pop().start()
                    time.sleep(choice.uniform(0, 0.05))
            time.sleep(choice.choice([0, 0.1, 0.3]))
            if number % 15 == 14:
                while dead:
                    dead.pop().start()
                heal(ros, peer, parties)
                for party in parties:
                    assert not party.shared_memory(), party.shared_memory()
            if number == len(order) // 3:
                memory = witness.memory()  # what it needs at the most it needs by now
        while dead:
            dead.pop().start()
        heal(ros, peer, parties)
        # When the leases of the killed have ended there is nobody but the living.
        counters(witness, *all_there)
        counters(bridge, *all_there)
        grown = witness.memory() - memory
        print(f"witness: {descriptors} descriptors, {threads} threads, {memory} KiB and {grown} more")
        assert witness.descriptors() == descriptors, f"{witness.descriptors()} instead of {descriptors}"
        assert witness.threads() == threads, f"{witness.threads()} instead of {threads}"
        assert grown < 2048, f"{grown} KiB in {2 * len(order) // 3} restarts"
        # Without the others: nothing is offered, written or subscribed to.
        ros.end(signal.SIGKILL)
        peer.end(signal.SIGKILL)
        counters(witness, r"publishers 0, offered 0\b", r"readers 0, written 0, subscribed 0\b")
    finally:
        for party in parties:
            if party.process.poll() is None:
                party.process.kill()
                party.process.wait()


if __name__ == "__main__":
    main()
