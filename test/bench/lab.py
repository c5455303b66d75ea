"""Where `./run bench` measures: two network namespaces joined by a veth pair, or two addresses of loopback."""
import atexit
import json
import os
import shutil
import subprocess
import tempfile
import time

PATIENCE = 30  # seconds for what should be over long before
# A stack has an address of its own: "a" of side a, "a2" for the second one there.
NUMBERS = ("", *map(str, range(2, 13)))


class Failed(Exception):
    pass


class Lab:
    """Two sides, "a" where servers run and "b" where clients run, with twelve addresses each."""

    def __init__(self):
        self.spaces = {}
        self.processes = []
        self.log = tempfile.TemporaryFile()
        atexit.register(self.close)
        if os.geteuid() == 0 and shutil.which("ip") and self._make_spaces():
            own = "10.83.7."
            self.place = "two network namespaces joined by a veth pair"
        else:
            own = f"127.{1 + (os.getpid() >> 8) % 254}.{os.getpid() & 255}."
            self.place = "two addresses of loopback"
        self.priority = self._become_real_time()
        self.address = {side + number: f"{own}{host + 2 * i}" for side, host in (("a", 1), ("b", 2))
                        for i, number in enumerate(NUMBERS)}
        # Of two programs on one host, both of them at side b.
        self.loopback = ("127.0.0.1", "127.0.0.2") if self.spaces else (self.address["b10"], self.address["b8"])

    @staticmethod
    def _become_real_time():
        """All that is started from here on comes before other work of the machine, floors as well as ours."""
        try:
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
        except PermissionError:
            return "with the priority of any other program"
        return "with real-time priority (SCHED_RR), so that other work of the machine does not come between"

    def _make_spaces(self):
        names = {side: f"trestle-bench-{os.getpid()}-{side}" for side in "ab"}
        links = {side: f"tb{os.getpid() % 100000}{side}" for side in "ab"}
        commands = [f"ip netns add {names[side]}" for side in "ab"]
        commands += [f"ip link add {links['a']} netns {names['a']} type veth peer name {links['b']} netns {names['b']}"]
        for side, host in ("a", 1), ("b", 2):
            settings = [f"address add 10.83.7.{host + 2 * i}/24 dev {links[side]}" for i in range(len(NUMBERS))]
            settings += [f"link set {links[side]} up", "link set lo up", f"route add 224.0.0.0/4 dev {links[side]}"]
            commands += [f"ip -n {names[side]} {setting}" for setting in settings]
        for command in commands:
            if subprocess.run(command.split(), capture_output=True, check=False).returncode:
                for name in names.values():
                    subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)
                return False
        self.spaces = names
        return True

    def _command(self, side, command):
        inside = ["ip", "netns", "exec", self.spaces[side]] if self.spaces else []
        return inside + [str(part) for part in command]

    def start(self, side, *command, environment=None, **options):
        """A program that runs until the lab is closed, or it is stopped."""
        process = subprocess.Popen(self._command(side, command), stdin=subprocess.DEVNULL, **{
            "stdout": subprocess.DEVNULL, "stderr": self.log,
            "env": {**os.environ, **(environment or {})}, **options})
        self.processes.append(process)
        return process

    def check(self):
        """Fails when a program has ended that should not have."""
        for process in self.processes:
            if process.poll() is not None:
                self.log.seek(0)
                raise Failed(f"{' '.join(process.args)} has ended: {self.log.read().decode(errors='replace')}")

    def stop(self, process):
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        self.processes.remove(process)

    def run(self, side, *command, environment=None, patience=PATIENCE):
        """What a program prints, as JSON."""
        try:
            done = subprocess.run(self._command(side, command), capture_output=True, text=True, timeout=patience,
                                  env={**os.environ, **(environment or {})}, check=False)
        except subprocess.TimeoutExpired as late:
            raise Failed(f"{' '.join(map(str, command))}: not done after {patience} s") from late
        if done.returncode:
            raise Failed(f"{' '.join(map(str, command))}: {done.stderr.strip() or done.returncode}")
        return json.loads(done.stdout)

    @staticmethod
    def on_one_core(*command):
        """A program and whatever else is started like this share a core."""
        return ["taskset", "-c", max(os.sched_getaffinity(0)), *command]

    @staticmethod
    def cpu_ns(process):
        """Of all its threads, also those that have ended."""
        return time.clock_gettime_ns(~process.pid << 3 | 2)  # its CPU clock: clock_getcpuclockid(3)

    @staticmethod
    def resident_kb(process):
        with open(f"/proc/{process.pid}/status", encoding="ascii", errors="replace") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmRSS:"))

    def stop_all(self):
        for process in list(self.processes):
            self.stop(process)

    def close(self):
        self.stop_all()
        for name in self.spaces.values():
            subprocess.run(["ip", "netns", "delete", name], capture_output=True, check=False)
        self.spaces = {}


def settle():
    """Time for servers to open their ports."""
    time.sleep(0.3)
