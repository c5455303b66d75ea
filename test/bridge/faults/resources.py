"""What a bridge needs runs out: room for its log, who reads it, file descriptors."""
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import time

from fault_world import FLOWS, Failed, at_least, at_most, holds
from lab import ADDRESS, FOLDER
from scenario import scenario

CAR = ADDRESS["car"]
SOME_FLOWS = "events_out", "clouds_out", "events_in", "calls_udp", "calls_tcp"
TALKATIVE = 300  # lines in the log, of subscribers that come and go


def make_it_talk(world, lines=TALKATIVE):
    """Has the bridge write lines to its log and its output, more than a pipe or a small disk takes."""
    for _ in range(lines):
        world.car.send_signal(signal.SIGUSR1)
        time.sleep(0.005)


def with_output(world, output, log):
    """The bridge begins with these files in place of its output and its log."""
    world.prefix = ["sh", "-c", f'exec "$@" >>{output} 2>>{log}', "sh"]
    world.honest(*SOME_FLOWS)


def small_disk(world):
    disk = FOLDER / f"{world.lab.name}.disk"
    disk.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", disk], check=True)
    return disk


def fill(disk):
    with open(disk / "filler", "wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            pass


@scenario("disk-full", 5, "the disk with the log and the counters has 64 KiB and is full, and has room again")
def disk_full(world):
    disk = small_disk(world)
    with_output(world, disk / "out", disk / "log")

    def fault():
        fill(disk)
        world.kill(world.honest_end)  # which the log would tell
        world.honest_end = world.again(world.honest_end)
        make_it_talk(world)
        (disk / "filler").unlink()
        (disk / "out").write_bytes(b"")
    world.hold_after(fault)
    before = (disk / "log").stat().st_size
    world.kill(world.honest_end)
    world.honest_end = world.again(world.honest_end)
    world.wait(lambda: (disk / "log").stat().st_size > before, "nothing is logged when there is room again")
    subprocess.run(["umount", "-l", disk], check=True)
    ends_with(world, 1)


def ends_with(world, status):
    """1 says that some counters could not be written."""
    world.car.send_signal(signal.SIGTERM)
    world.figures.append(holds(f"it ends with status {status}", world.car.process.wait(60) == status))
    world.lab.programs.remove(world.car)
    world.car = None


@scenario("output-full", 5, "nothing can be written to the output, nor to the log, from the start (/dev/full)")
def output_full(world):
    with_output(world, "/dev/full", "/dev/full")
    world.hold_after(lambda: make_it_talk(world, 20))
    ends_with(world, 1)


class Pipe:
    """Both outputs of the bridge, and a program that reads them: it can be stopped and killed."""

    def __init__(self, world):
        path = FOLDER / f"{world.lab.name}.pipe"  # what is kept are files
        path.unlink(missing_ok=True)
        os.mkfifo(path)
        self.reader = world.lab.start("car", "reader", "cat", path)
        with_output(world, path, path)


@scenario("log-reader-killed", 5, "the program that reads the log and the counters from a pipe is killed")
def reader_killed(world):
    pipe = Pipe(world)

    def fault():
        world.kill(pipe.reader)
        make_it_talk(world, 20)
    world.hold_after(fault)
    ends_with(world, 0)  # as for every reader that has read enough


@scenario("log-reader-stopped", 5, "the program that reads the log and the counters from a pipe is stopped, and goes on")
def reader_stopped(world):
    pipe = Pipe(world)

    def fault():
        pipe.reader.send_signal(signal.SIGSTOP)
        make_it_talk(world)
    world.hold_after(fault)
    pipe.reader.send_signal(signal.SIGCONT)
    world.pass_time(1, "the reader goes on")
    world.hold_after(lambda: None)


# --- File descriptors -----------------------------------------------------------------------------------------


def connected(port, count):
    """So many TCP clients of the bridge, from the honest host, that want nothing."""
    clients = []
    for _ in range(count):
        client = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        client.settimeout(2)
        client.connect((CAR, port))
        clients.append(client)
    time.sleep(600)


@scenario("descriptors-run-out", 6, "no file descriptor is free, clients connect and DDS participants come; then there are more")
def descriptors_run_out(world):
    world.honest(*SOME_FLOWS)
    more = []

    def fault():
        used = world.descriptors(world.car)
        before = resource.prlimit(world.car.pid, resource.RLIMIT_NOFILE, (used, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
        cpu, began = world.car.cpu_ms(), time.monotonic()
        child = world.lab.fork("second", connected, 40004, 20)
        more.append(world.end("car", "more", "dds", "80", "events_in=read:/events_in:cloud"))
        world.pass_time(world.scale.attack_s, "without descriptors")
        busy = (world.car.cpu_ms() - cpu) / 10 / (time.monotonic() - began)
        world.figures.append(at_most("processor without descriptors", busy, 60, "%", timed=True))
        world.lab.end(child)
        resource.prlimit(world.car.pid, resource.RLIMIT_NOFILE, before)
    world.hold_after(fault)
    world.figures.append(holds("the log names the limit", "ulimit -n" in world.car.text()))
    new = world.end("second", "newcomer", "peer", ADDRESS["second"], "new=call:0x4004:1:1:0:10:tcp")
    world.wait(lambda: any(answered for _, answered in world.flows_of(new)["new"].calls), "no new TCP client is served")


@scenario("starts-without-descriptors", 6, "the bridge starts with too few file descriptors, from 3 on")
def starts_with_few(world):
    body = "routes:\n" + FLOWS["events_out"].route + FLOWS["clouds_out_tcp"].route + FLOWS["events_in"].route
    bad, refused = [], 0
    for limit in range(3, 200, 5 if world.scale.short else 1):
        name = f"few-{limit}"
        world.prefix = ["prlimit", f"--nofile={limit}:{limit}"]
        bridge = world.bridge("car", name, body)
        world.lab.programs.remove(bridge)
        end = time.monotonic() + 30
        while bridge.running() and "Ctrl-C stops" not in bridge.text() and time.monotonic() < end:
            time.sleep(0.02)
        if bridge.running():
            started = "Ctrl-C stops" in bridge.text()
            bridge.stop()
            if not started or bridge.process.returncode:
                bad.append(f"{limit}: {'hangs' if not started else bridge.process.returncode}")
            if started:
                break
        elif bridge.process.returncode not in (1, 2, 127) or not re.search(r"error|cannot", bridge.text()):
            bad.append(f"{limit}: {bridge.process.returncode} {bridge.text()[-100:]!r}")
        else:
            refused += 1
    else:
        raise Failed("it never starts")
    world.figures.append(at_least("refused to start", refused, 1))
    world.figures.append(at_most("ended in another way", len(bad), 0))
    if bad:
        raise Failed("; ".join(bad))
