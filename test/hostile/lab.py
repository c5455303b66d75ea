"""Where `./run test hostile` takes place: hosts in network namespaces around one switch, and what runs on them.

All of it lives in namespaces of processes, mounts and networks that end with this program, however it ends: nothing is
left behind, and no packet leaves them.
"""
import ctypes
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import time

FOLDER = pathlib.Path("/mnt")  # a file system in memory, that only we see
NET = "10.84."
# A host has an address of its own; the attacker has several.
ADDRESS = {"car": NET + "0.1", "honest": NET + "0.2", "second": NET + "0.3", "bystander": NET + "0.9",
           "attacker": NET + "0.66"}
CARS = [ADDRESS["car"]] + [f"{NET}0.{11 + i}" for i in range(3)]  # the car may have several bridges
ATTACKERS = [f"{NET}0.{66 + i}" for i in range(4)]
SILENT = [f"{NET}{200 + i // 250}.{1 + i % 250}" for i in range(2500)]  # addresses that nobody has
STRANGERS = [f"{NET}{100 + i // 250}.{1 + i % 250}" for i in range(5000)]  # nobody has them either
ADDRESS6 = {host: address.replace(NET, "fd00:84::").replace("0.", "") for host, address in ADDRESS.items()}
SILENT6 = [f"fd00:84::5:{i:x}" for i in range(2500)]  # nobody has them, either
MANY = [f"{NET}7.{1 + i}" for i in range(120)]  # as many hosts as somebody pretends to be
PATIENCE = 60  # seconds for what should be over long before
CLONE_NEWNET = 0x40000000
INSIDE = "TRESTLE_HOSTILE_INSIDE"


class Failed(Exception):
    pass


def enter():
    """Runs this program again where it can make namespaces, and gives its exit status; a text says why that cannot be.

    Nothing: it runs there already."""
    if INSIDE in os.environ:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the one outside ends us
        return None
    for program in "unshare", "nsenter", "setpriv", "ip":
        if not shutil.which(program):
            return f"there is no program '{program}'"
    spaces = ["unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]
    if os.geteuid() != 0:
        spaces += ["--user", "--map-root-user"]
    tried = subprocess.run([*spaces, "sh", "-c", "mount -t tmpfs none /mnt && ip link add type bridge"],
                           capture_output=True, text=True, check=False)
    if tried.returncode:
        return "cannot make namespaces: " + (tried.stderr.strip() or str(tried.returncode))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    signal.signal(signal.SIGINT, lambda *_: sys.exit(130))
    # It dies with us, whatever we die of, and all that it has started with it.
    inside = subprocess.Popen(["setpriv", "--pdeathsig", "KILL", *spaces, sys.executable, "-B", *sys.argv],
                              env={**os.environ, INSIDE: "1"})
    try:
        return inside.wait()
    finally:
        inside.kill()
        inside.wait()


def _run(command):
    subprocess.run(command.split(), check=True, capture_output=True)


class Program:
    """A program that runs on a host, and what it writes."""

    def __init__(self, lab, host, name, command):
        self.name = name
        self.out = lab.folder / f"{name}.out"
        self.log = lab.folder / f"{name}.log"
        self.started = time.monotonic()
        with open(self.out, "ab") as out, open(self.log, "ab") as log:
            self.process = subprocess.Popen(["nsenter", f"--net=/run/netns/{host}", *map(str, command)], stdout=out,
                                            stderr=log, stdin=subprocess.DEVNULL)
        self.pid = self.process.pid

    def _status(self, key):
        for line in pathlib.Path(f"/proc/{self.pid}/status").read_text(encoding="ascii").splitlines():
            if line.startswith(key + ":"):
                return int(line.split()[1]) * 1024
        return 0

    def rss(self):
        return self._status("VmRSS")

    def limit_memory(self, more):
        """From now on it may have so many bytes more of address space than it has."""
        limit = self._status("VmSize") + more
        resource.prlimit(self.pid, resource.RLIMIT_AS, (limit, limit))

    def cpu_ms(self):
        fields = pathlib.Path(f"/proc/{self.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) * 1000 / os.sysconf("SC_CLK_TCK")

    def running(self):
        return self.process.poll() is None

    def log_bytes(self):
        return self.log.stat().st_size

    def text(self):
        return self.log.read_text(encoding="utf-8", errors="replace")

    def send_signal(self, number):
        if self.running():
            self.process.send_signal(number)

    def stop(self, number=signal.SIGTERM):
        self.send_signal(number)
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Lab:
    """The switch and its hosts, for one scenario."""

    def __init__(self, name, out):
        self.name = name
        self.kept = out / name
        self.folder = FOLDER / name
        self.folder.mkdir()
        self.programs = []
        self.children = []
        _run("ip netns add switch")
        _run("ip -n switch link add switch type bridge mcast_snooping 0")
        _run("ip -n switch link set switch up")
        for host, address in ADDRESS.items():
            addresses = {"attacker": ATTACKERS + MANY, "car": CARS}.get(host, [address])
            _run(f"ip netns add {host}")
            _run(f"ip link add eth0 netns {host} type veth peer name {host} netns switch")
            _run(f"ip -n switch link set {host} master switch up")
            for one in addresses:
                _run(f"ip -n {host} address add {one}/16 dev eth0")
            for setting in "link set lo up", "link set eth0 up", "route add 224.0.0.0/4 dev eth0":
                _run(f"ip -n {host} {setting}")
            self.set_network(host, "ipv4.ip_local_port_range=51000 59000")  # no port of a service (isolated.cpp)
        end = time.monotonic() + PATIENCE
        while any("state UP" not in self._link(host) for host in ADDRESS):
            if time.monotonic() > end:
                raise Failed("the links do not come up")
            time.sleep(0.02)

    def add_ipv6(self):
        """Gives each host an address of IPv6, too."""
        for host, address in ADDRESS6.items():
            _run(f"ip -n {host} address add {address}/64 dev eth0 nodad")
        end = time.monotonic() + PATIENCE
        while any(not self._is_local(host, address) for host, address in ADDRESS6.items()):
            if time.monotonic() > end:
                raise Failed("the addresses of IPv6 do not come up")
            time.sleep(0.02)

    @staticmethod
    def _is_local(host, address):
        """Whether it is one of that host by now: before, it would be asked for on the link."""
        return subprocess.run(["ip", "-n", host, "-6", "route", "get", address], capture_output=True, text=True,
                              check=False).stdout.startswith("local")

    @staticmethod
    def set_network(host, setting):
        """A setting NAME=VALUE below /proc/sys/net, for one host."""
        name, value = setting.split("=")
        subprocess.run(["nsenter", f"--net=/run/netns/{host}", "sysctl", "-qw", f"net.{name}={value}"], check=True, capture_output=True)

    @staticmethod
    def _link(host):
        return subprocess.run(["ip", "-n", host, "-oneline", "link", "show", "dev", "eth0"], capture_output=True,
                              text=True, check=False).stdout

    def start(self, host, name, *command):
        program = Program(self, host, name, command)
        self.programs.append(program)
        return program

    def fork(self, host, function, *arguments):
        """Runs a Python function on a host, in a process of its own; gives that one's number."""
        sys.stdout.flush()
        child = os.fork()
        if child:
            self.children.append(child)
            return child
        status = 1
        try:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            with open(f"/run/netns/{host}", encoding="ascii") as space:
                if ctypes.CDLL(None, use_errno=True).setns(space.fileno(), CLONE_NEWNET):
                    raise OSError(ctypes.get_errno(), "setns")
            with open(self.folder / f"{host}-{function.__name__}.log", "a", encoding="utf-8") as log:
                os.dup2(log.fileno(), 2)
                function(*arguments)
            status = 0
        except BaseException:  # pylint: disable=broad-except
            sys.excepthook(*sys.exc_info())
        finally:
            sys.stderr.flush()
            os._exit(status)

    def end(self, child):
        """Ends a function that runs on a host; an attack that failed is no attack."""
        os.kill(child, signal.SIGTERM)
        _, status = os.waitpid(child, 0)
        self.children.remove(child)
        if os.WIFEXITED(status) and os.WEXITSTATUS(status):
            logs = "\n".join(log.read_text(encoding="utf-8") for log in self.folder.glob("*-*.log"))
            raise Failed(f"the attack itself failed: {logs}")

    @staticmethod
    def received_bytes(host):
        """That the host's network device has received."""
        text = subprocess.run(["nsenter", f"--net=/run/netns/{host}", "cat", "/proc/net/dev"], capture_output=True,
                              text=True, check=True).stdout
        line = next(line for line in text.splitlines() if line.strip().startswith("eth0:"))
        return int(line.split(":")[1].split()[0])

    def close(self):
        """Ends all that runs, and keeps what it wrote."""
        for child in list(self.children):
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
        for program in reversed(self.programs):
            program.stop()
        shutil.rmtree(self.kept, ignore_errors=True)
        shutil.copytree(self.folder, self.kept)
        shutil.rmtree(self.folder)
        for host in [*ADDRESS, "switch"]:
            _run(f"ip netns delete {host}")


def mount():
    """What the lab needs, once."""
    os.makedirs("/run/netns", exist_ok=True)
    for place in "/run/netns", str(FOLDER):
        _run(f"mount -t tmpfs none {place}")
