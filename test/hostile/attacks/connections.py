"""TCP connections that take places or memory."""
import socket
import time

from attacker import CAR, Attacker, pace
from figures import holds
from lab import ATTACKERS, MANY
from scenario import scenario
from wire import REQUEST, TCP, endpoint, is_refusal, someip


def _connect(address, port):
    connection = socket.socket()
    connection.bind((address, 0))
    connection.settimeout(2)
    connection.connect((CAR, port))
    return connection


def keep_idle(port, each, say, addresses=ATTACKERS):
    """Connections that say nothing more, from every address there is; again when they are closed."""
    held = []
    while True:
        for address in addresses:
            mine = [one for one in held if one[0] == address]
            while len(mine) < each:
                try:
                    mine.append((address, _connect(address, port)))
                    if say:
                        mine[-1][1].send(say)
                except OSError:
                    break
                held.append(mine[-1])
        time.sleep(0.5)
        for one in list(held):
            one[1].setblocking(False)
            try:
                if one[1].recv(4096) == b"":
                    held.remove(one)
            except BlockingIOError:
                pass
            except OSError:
                held.remove(one)


@scenario("tcp-idle", 6, "4 addresses with 16 idle TCP connections each")
def idle(world):
    world.honest("clouds_out_tcp", "calls_tcp")
    world.beside(keep_idle, 40011, 16, b"", newcomer="new=listen:0x4011:1:tcp")


@scenario("tcp-spoke-once", 6, "80 addresses with a TCP connection each, over which one message came")
def spoke_once(world):
    world.honest("clouds_out_tcp", "calls_tcp")
    world.beside(keep_idle, 40011, 1, someip(0x4011, 1, b"", kind=REQUEST), MANY[:80],
                 newcomer="new=listen:0x4011:1:tcp")


@scenario("tcp-announced", 6, "12 TCP connections that announce 16 MB each, 100 MB of memory")
def announced(world):
    world.honest("events_out", "calls_tcp")
    world.car.limit_memory(100_000_000)
    say = someip(0x4004, 1, b"", kind=REQUEST, length=(16 << 20) - 8) + bytes(1000)
    world.beside(keep_idle, 40004, 3, say, newcomer=f"new=call:0x4004:1:1:0:{world.scale.call_hz}:tcp")


def never_read(addresses, say):
    """Subscribers over TCP that never read, each at an address of its own; they connect anew when they are refused.

    say: bytes of a message, of which each sends one now and then."""
    hosts = [Attacker(address) for address in addresses]
    connections = {}
    for turn in pace(2):
        for host in hosts:
            if any(is_refusal(entry) for entries, _, _ in host.heard() for entry in entries):
                connections.pop(host, None)
            if host not in connections:
                connections[host] = connection = socket.socket()
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                connection.bind((host.address, 0))
                connection.setblocking(False)
                connection.connect_ex((CAR, 40011))
                continue
            try:
                connections[host].send(say[turn % max(len(say), 1):][:1])
            except OSError:
                del connections[host]
                continue
            host.subscribe(0x4011, endpoint(*connections[host].getsockname(), TCP))


@scenario("tcp-100-never-read", 6, "100 addresses subscribe over TCP and never read; there are 64 places")
def never_reads(world):
    world.honest("clouds_out_tcp", "calls_tcp")
    world.beside(never_read, MANY[:100], b"", newcomer="new=listen:0x4011:1:tcp")


@scenario("tcp-100-send-bytes", 6, "the same, and each sends a byte of a message now and then")
def sends_bytes(world):
    world.honest("clouds_out_tcp", "calls_tcp")
    world.beside(never_read, MANY[:100], someip(0x4011, 1, bytes(1000), kind=REQUEST), newcomer="new=listen:0x4011:1:tcp")
