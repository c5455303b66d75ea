"""A ROS node, a bridge and a SOME/IP stack are killed and started again in any order: topics, calls and fields heal.

A second bridge, the witness, is never killed: nothing of those that were may stay with it. Nor may readers or writers
stay that somebody else in the DDS domain sees, nor files in shared memory, of which nobody may ever have had one.

Usage: restarts_test.py TRESTLE PEER [SEED]
"""
import os
import random
import re
import select
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from dds_domain import own_domain

TRESTLE, PEER = sys.argv[1:3]
SEED = int(sys.argv[3]) if len(sys.argv) > 3 else random.randrange(1 << 30)
LIVES = 50  # of each
PATIENCE = 60  # seconds


def take_own_shared_memory():
    """Goes on with a /dev/shm that nobody else has, so that all that is ever in it is ours. False: we may not."""
    if "TRESTLE_OWN_SHM" not in os.environ:
        command = ["unshare", "--mount"] + ([] if os.geteuid() == 0 else ["--map-root-user"])
        command += ["sh", "-c", 'mount -t tmpfs none /dev/shm && exec "$@"', "sh"]
        if subprocess.run([*command, "true"], stderr=subprocess.DEVNULL).returncode != 0:
            return False
        os.environ["TRESTLE_OWN_SHM"] = "1"
        os.execvp(command[0], [*command, sys.executable, *sys.argv])
    return True


OWN_SHARED_MEMORY = take_own_shared_memory()
PID = os.getpid()
GROUP = f"239.253.{PID >> 8 & 255}.{PID & 255}"


# Of the action.
INTERFACES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../ros/interfaces")


def address(host):
    return f"127.{1 + (PID >> 8) % 254}.{PID & 255}.{host}"


DOMAIN = own_domain()


def config(n):
    return f"""\
someip:
  address: {address(11 + n)}
  sd: {{multicast: {GROUP}, initial_delay_min: 0, initial_delay_max: 10 ms, cyclic_offer_delay: 200 ms, ttl: 1 s}}
dds: {{domain: {DOMAIN}, interfaces: [127.0.0.1], lease: 1 s}}
types: {{paths: ["{INTERFACES}"]}}
lock_file: {n}.lock
routes:
  - {{topic: /up_{n}, type: std_msgs/msg/String, direction: dds_to_someip, service: {0x1000 + n}, instance: 1,
     eventgroup: 1, event: 0x8001, port: 40001, offer: while_published}}
  - {{topic: /down_{n}, type: std_msgs/msg/String, direction: someip_to_dds, service: {0x2000 + n}, instance: 1,
     eventgroup: 1, event: 0x8001, write: while_offered, subscribe: while_read}}
  - {{topic: /safe_{n}, type: std_msgs/msg/String, direction: dds_to_someip, service: {0x5000 + n}, instance: 1,
     eventgroup: 1, event: 0x8001, port: 40001, transport: tcp, offer: while_published, e2e: {{profile: 4, data_id: {0x5000 + n}}}}}
  - {{topic: /sure_{n}, type: std_msgs/msg/String, direction: someip_to_dds, service: {0x6000 + n}, instance: 1,
     eventgroup: 1, event: 0x8001, transport: tcp, write: while_offered, subscribe: while_read,
     e2e: {{profile: 4, data_id: {0x6000 + n}}}}}
patterns:
  - {{topics: /wild_{n}/*, direction: dds_to_someip, services: {0x7000 + n:#x}-{0x7000 + n:#x}, port: 40001}}
actions:
  - {{action: /act_{n}, type: test_msgs/action/Fibonacci, server: ros, service: {0x8000 + n}, instance: 1, eventgroup: 1,
     methods: {{send_goal: 0x11, cancel_goal: 0x12, get_result: 0x13}}, events: {{feedback: 0x8011, status: 0x8012}},
     port: 40001, timeout: 1 s}}
methods:
  - {{ros_service: /ask_{n}, type: std_srvs/srv/Trigger, server: ros, service: {0x1000 + n}, instance: 1, method: 1,
     port: 40001, timeout: 1 s}}
  - {{ros_service: /tell_{n}, type: std_srvs/srv/Trigger, server: someip, service: {0x2000 + n}, instance: 1, method: 1,
     timeout: 1 s}}
fields:
  - {{topic: /light_{n}, type: std_msgs/msg/String, server: ros, service: {0x3000 + n}, instance: 1, eventgroup: 1,
     event: 0x8001, getter: 2, setter: 3, port: 40001, timeout: 1 s}}
  - {{topic: /lamp_{n}, type: std_msgs/msg/String, server: someip, service: {0x4000 + n}, instance: 1, eventgroup: 1,
     event: 0x8001, getter: 2, setter: 3, timeout: 1 s}}
"""

# What arrives of the node at the SOME/IP stack, and the other way.
OF_ROS = ("up", "safe", "wild", "ask", "light", "light_get", "light_set", "cancel", "feedback", "status")
OF_SOMEIP = ("down", "sure", "tell", "lamp", "lamp_get", "lamp_set")


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


def becomes(count, wanted):
    """Waits until it counts as many as are wanted: what has come to an end may be there for a moment."""
    end = time.monotonic() + PATIENCE
    while (found := count()) != wanted:
        assert time.monotonic() < end, f"{found} instead of {wanted}"
        time.sleep(0.05)


def entities():
    """The topics of all writers, each once, and how many readers and writers either bridge tells ROS 2 that it has."""
    names = [f"rt/{topic}_{n}" for n in (0, 1) for topic in ("up", "light", "down", "lamp", "safe", "sure")]
    names += [f"rt/{topic}" for n in (0, 1)
              for topic in (f"wild_{n}/up", f"act_{n}/_action/feedback", f"act_{n}/_action/status")]
    services = [f"{name}_{n}{part}" for n in (0, 1)
                for name, part in (("ask", ""), ("tell", ""), ("light", "/set"), ("lamp", "/get"), ("lamp", "/set"),
                                   *(("act", f"/_action/{one}") for one in ("send_goal", "cancel_goal", "get_result")))]
    names += [f"rq/{service}Request" for service in services] + [f"rr/{service}Reply" for service in services]
    return sorted(names + 2 * ["ros_discovery_info", "rt/diagnostics", "14+12"])


def see(watcher, wanted):
    """Waits until it sees these readers and writers, no less and no more."""
    end = time.monotonic() + PATIENCE
    seen = []
    watcher.output()  # what it saw before
    while wanted not in seen:
        assert time.monotonic() < end, f"seen: {seen[-1:]}\nwanted: {wanted}"
        time.sleep(0.02)
        seen = [line.split() for line in watcher.output().splitlines()] or seen


def heal(ros, peer, parties):
    """Waits until what each sends and answers arrives at the others that live now, through either bridge."""
    missing = {(receiver, f"{way} {n} {sender.process.pid:08}")
               for n in (0, 1) for ways, sender, receiver in ((OF_ROS, ros, peer), (OF_SOMEIP, peer, ros)) for way in ways}
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
    if not OWN_SHARED_MEMORY:
        print("no /dev/shm of its own: of shared memory only that of the living is looked at")
    choice = random.Random(SEED)
    folder = tempfile.TemporaryDirectory()
    files = [os.path.join(folder.name, f"{n}.yaml") for n in (0, 1)]
    for n in (0, 1):
        with open(files[n], "w", encoding="utf-8") as file:
            file.write(config(n))
    witness = Party(TRESTLE, "bridge", "--quiet", files[1])
    bridge = Party(TRESTLE, "bridge", "--quiet", files[0])
    ros = Party(PEER, "ros", str(DOMAIN))
    peer = Party(PEER, "someip", address(21), GROUP)
    watcher = Party(PEER, "watch", str(DOMAIN))
    parties = (witness, bridge, ros, peer, watcher)
    routes = ("route /up_%d to", "route /light_%d to", "route /safe_%d to", "route /act_%d/_action/feedback to",
              "route /down_%d from", "route /lamp_%d from", "route /sure_%d from")
    calls = "/ask_%d", "/tell_%d", "/light_%d/set", "/lamp_%d/get", "/lamp_%d/set", "/act_%d/_action/cancel_goal"

    def those_of(n, outbound, inbound, method):
        return ([f"{group % n} .*{outbound if group.endswith('to') else inbound}\\b" for group in routes]
                + [f"(method of ROS service|ROS service of method) {name % n}: .*{method}\\b" for name in calls])

    def all_there(n):
        return those_of(n, "publishers 1, bridges 0, offered 1", "readers 1, bridges 0, written 1, subscribed 1", "ready 1")
    try:
        heal(ros, peer, parties)
        counters(witness, *all_there(1))
        see(watcher, entities())
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
        counters(witness, *all_there(1))
        counters(bridge, *all_there(0))
        see(watcher, entities())
        grown = witness.memory() - memory
        print(f"witness: {descriptors} descriptors, {threads} threads, {memory} KiB and {grown} more")
        becomes(witness.descriptors, descriptors)
        becomes(witness.threads, threads)
        assert grown < 2048, f"{grown} KiB in {2 * len(order) // 3} restarts"
        assert not OWN_SHARED_MEMORY or not os.listdir("/dev/shm"), os.listdir("/dev/shm")
        # Without the others: nothing is offered, written or subscribed to, and no call waits for ever.
        ros.end(signal.SIGKILL)
        peer.end(signal.SIGKILL)
        counters(witness, *those_of(1, "publishers 0, bridges 0, offered 0",
                                     "readers 0, bridges 0, written 0, subscribed 0", "in_flight 0, ready 0"))
    finally:
        for party in parties:
            if party.process.poll() is None:
                party.process.kill()
                party.process.wait()


if __name__ == "__main__":
    main()
