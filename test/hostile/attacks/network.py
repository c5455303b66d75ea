"""What networks do to datagrams without meaning any harm."""
import socket
import struct
import subprocess
import time

import flows
from attacker import CAR, pace
from lab import ADDRESS, ATTACKERS
from scenario import scenario
from wire import SD_PORT


def send_twice():
    """Each SD datagram of this host leaves a second time."""
    wire = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x0003))
    wire.bind(("eth0", 0))
    own = socket.inet_aton(ADDRESS["honest"])
    seen = set()
    while True:
        frame, where = wire.recvfrom(65536)
        if where[2] != socket.PACKET_OUTGOING or frame[12:14] != b"\x08\x00" or frame[23] != 17 or frame[26:30] != own:
            continue
        if struct.unpack_from(">H", frame, 36)[0] == SD_PORT and (key := frame[30:34] + frame[42:]) not in seen:
            seen.add(key)
            wire.send(frame[:40] + b"\0\0" + frame[42:])  # its checksum was left to the device: none


@scenario("duplicated-discovery", 17, "the network brings each SD datagram of the honest host twice")
def duplicated(world):
    world.honest("clouds_in", "clouds_out", "clouds_out_tcp", "events_in")
    world.beside(send_twice, host="honest")


def switch_off():
    subprocess.run(["ip", "link", "set", "eth0", "down"], check=True)
    time.sleep(600)


@scenario("dds-host-off", 3, "a host with reliable DDS readers is switched off")
def dds_host_off(world):
    for setting in "base_reachable_time_ms=2000", "delay_first_probe_time=1":
        world.lab.set_network("car", f"ipv4.neigh.eth0.{setting}")
    world.honest("clouds_in", "events_in", "events_out", interface=ADDRESS["car"], dds_at="bystander")
    gone = world.end("second", "gone", "dds", "80,all", "clouds_in=read:/clouds_in:cloud", "events_in=read:/events_in:cloud")
    world.wait(lambda: flows.read(gone.out)[0]["clouds_in"].received, "the other reader gets nothing")
    world.beside(switch_off, host="second")


def checksum(data):
    total = sum(struct.unpack(f">{len(data) // 2}H", data))
    while total > 0xffff:
        total = (total & 0xffff) + (total >> 16)
    return ~total & 0xffff


def forge_unreachable(rate, port, to_port):
    """Says that nobody is where the bridge sends from `port`, at the honest host's `to_port`: from the attacker's own
    address."""
    raw = socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP)
    raw.bind((ATTACKERS[0], 0))
    quoted = struct.pack(">BBHHHBBH4s4sHHHH", 0x45, 0, 28, 1, 0, 64, socket.IPPROTO_UDP, 0, socket.inet_aton(CAR),
                         socket.inet_aton(ADDRESS["honest"]), port, to_port, 8, 0)
    message = struct.pack(">BBHI", 3, 3, 0, 0) + quoted
    message = message[:2] + struct.pack(">H", checksum(message)) + message[4:]
    for _ in pace(rate):
        raw.sendto(message, (CAR, 0))


@scenario("icmp-forged", 8, "20 ICMP messages/s say that the subscriber is not there, from the attacker's own address")
def icmp_forged(world):
    world.honest("events_out", "clouds_out", "events_in")
    world.beside(forge_unreachable, 20, 40002, 45002)
