"""Receivers that take little, nothing, or are not there: what they cost the others."""
import socket
import subprocess
import time

from attacker import CAR, Attacker, open_udp, pace
from lab import ADDRESS6, MANY, SILENT, SILENT6
from scenario import scenario
from wire import (ENDLESS, REQUEST, SD_PORT, TCP, configuration, endpoint, sd, service_entry, someip, subscribe_entry,
                  udp_packet_v6)

NEW_TCP = "new=listen:0x4011:1:tcp"
NEW_UDP = "new=listen:0x4001:1:udp"


def subscribe_over_tcp(bytes_a_second):
    attacker = Attacker()
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
    connection.bind((attacker.address, 0))
    connection.connect((CAR, 40011))
    for _ in pace(10):
        attacker.subscribe(0x4011, endpoint(attacker.address, connection.getsockname()[1], TCP))
        if bytes_a_second:
            connection.recv(bytes_a_second // 10)


def subscribe_over_udp(told, service=0x4001):
    attacker = Attacker()
    sink = open_udp(attacker.address)
    options = endpoint(*sink.getsockname()) + configuration(f"trestle.rcvbuf={told}")
    for _ in pace(1):
        attacker.subscribe(service, options, number=2)


@scenario("tcp-reads-20kB", 2, "a TCP subscriber that reads 20 kB/s")
def tcp_reads_slowly(world):
    world.honest("clouds_out_tcp", "events_out")
    world.beside(subscribe_over_tcp, 20_000, newcomer=NEW_TCP)


@scenario("tcp-never-reads", 2, "a TCP subscriber that never reads")
def tcp_never_reads(world):
    world.honest("clouds_out_tcp", "events_out")
    world.beside(subscribe_over_tcp, 0, newcomer=NEW_TCP)


@scenario("udp-takes-1-byte", 2, "a UDP subscriber that says it takes 1 byte")
def udp_takes_a_byte(world):
    world.honest("clouds_out", "events_out", "clouds_in")
    world.beside(subscribe_over_udp, 1, newcomer=NEW_UDP)


@scenario("group-takes-1-byte", 2, "the same, of a multicast eventgroup: all that goes to the group is slowed down")
def group_takes_a_byte(world):
    world.honest("clouds_out_group", "events_out")
    world.beside(subscribe_over_udp, 1, 0x4021, newcomer="new=listen:0x4021:1:udp:45021")


def subscribe_silent(rate, services, pretend):
    """From or for addresses that nobody has: no answer to ARP ever comes."""
    attacker = Attacker()
    for i in pace(rate):
        silent = SILENT[i % len(SILENT)]
        for session, service in enumerate(services, 1):
            entry, option = subscribe_entry(service, ttl=0xFFFFFF), endpoint(silent, 5000 + i % 100)
            if pretend:
                attacker.say_as(silent, entry, option, session=session)
            else:
                attacker.say(entry, option)


def _silent(world, more, pretend):
    world.honest("clouds_out", "events_out", "clouds_in", "calls_udp", more=more)
    world.beside(subscribe_silent, 60, (0x4001, 0x4002), pretend, newcomer=NEW_UDP)


@scenario("silent-endpoints", 3, "60 Subscribes/s that name silent addresses")
def silent_endpoints(world):
    _silent(world, "", False)


@scenario("silent-senders", 3, "60 Subscribes/s that say they come from silent addresses")
def silent_senders(world):
    _silent(world, "", True)


@scenario("silent-small-buffer", 3, "the same, and a send buffer as ordinary users get it")
def silent_small_buffer(world):
    _silent(world, "\n  send_buffer: 208 KiB", True)


def subscribe_silent_v6(rate, services):
    """As addresses that nobody has: neighbour discovery asks for them in vain."""
    raw = socket.socket(socket.AF_INET6, socket.SOCK_RAW, socket.IPPROTO_RAW)
    car = ADDRESS6["car"], SD_PORT
    for i in pace(rate):
        silent = SILENT6[i % len(SILENT6)]
        for session, service in enumerate(services, 1):
            message = sd(subscribe_entry(service, ttl=ENDLESS), endpoint(silent, 5000 + i % 100), session)
            raw.sendto(udp_packet_v6((silent, SD_PORT), car, message), (car[0], 0))


@scenario("silent-small-buffer-ipv6", 3, "60 Subscribes/s from silent IPv6 addresses, send buffer as ordinary users get it")
def silent_v6(world):
    world.use_ipv6()
    world.honest("clouds_out", "events_out", "clouds_in", "calls_udp", more="\n  send_buffer: 208 KiB")
    world.beside(subscribe_silent_v6, 60, (0x4001, 0x4002), newcomer=NEW_UDP)


def leave(count, rate):
    """Hosts that are there, subscribe without end, and are switched off one after the other."""
    hosts = [Attacker(address) for address in MANY[:count]]
    sinks = [open_udp(host.address, 6000) for host in hosts]
    for host in hosts:
        host.subscribe(0x4002, endpoint(host.address, 6000), ttl=ENDLESS)
        time.sleep(0.01)
    for i in pace(rate):
        if i < count:
            subprocess.run(["ip", "address", "delete", f"{MANY[i]}/16", "dev", "eth0"], check=True)
    del sinks


@scenario("gone-receivers", 3, "20 hosts subscribe without end and are switched off, 2 a second, send buffer as ordinary users "
          "get it")
def gone_receivers(world):
    # The system notices after a few seconds that somebody has gone, and not after half a minute.
    for setting in "base_reachable_time_ms=2000", "delay_first_probe_time=1":
        world.lab.set_network("car", f"ipv4.neigh.eth0.{setting}")
    world.honest("events_out", "calls_udp", more="\n  send_buffer: 208 KiB")
    world.beside(leave, 20, 2)


def find_as_silent(rate, addresses):
    """Each Find is answered to an address that nobody has."""
    attacker = Attacker()
    for i in pace(rate):
        silent = SILENT[i % addresses]
        for service in 0x4001, 0x4002:
            attacker.say_as(silent, service_entry(0, service))


@scenario("sd-send-buffer-full", 4, "Finds from silent addresses fill the send buffer of discovery")
def discovery_buffer(world):
    world.honest("events_out", "events_in", more="\n  send_buffer: 8 KiB")
    world.beside(find_as_silent, 300, 300, newcomer="new=listen:0x4002:1:udp")


@scenario("neighbour-table-full", 4, "Finds from 2,000 silent addresses fill the table of neighbours")
def neighbour_table(world):
    world.honest("events_out", "events_in")
    world.beside(find_as_silent, 400, 2000, newcomer="new=listen:0x4002:1:udp")


def ask_as_silent(rate, addresses):
    """Requests of hosts that nobody has, to services without methods: an error would answer each."""
    attacker = Attacker()
    for i in pace(rate):
        for port, service in (40001, 0x4001), (40002, 0x4002), (40003, 0x4003):
            attacker.send_as((SILENT[i % addresses], 5000), someip(service, 1, session=1 + i % 60000, kind=REQUEST),
                             (CAR, port))


@scenario("silent-callers", 3, "1,000 requests/s at each port from silent addresses, send buffer as ordinary users get it")
def silent_callers(world):
    world.honest("clouds_out", "events_out", "calls_udp", more="\n  send_buffer: 208 KiB")
    world.beside(ask_as_silent, 200 if world.scale.short else 1000, 250, newcomer=NEW_UDP)
