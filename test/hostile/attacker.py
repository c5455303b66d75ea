"""What attackers have in common: sockets, a session, and a pace. All of it runs on the attacker's host."""
import socket
import time

from lab import ADDRESS, ATTACKERS
from wire import (GROUP, SD_PORT, endpoint, entries_of, sd, service_entry, subscribe_entry, udp_packet)

CAR = ADDRESS["car"]


def pace(rate_hz, seconds=60.0):
    """Numbers from 0 on, so many a second; ends by itself."""
    begin = time.monotonic()
    count = 0
    while (now := time.monotonic()) < begin + seconds:
        due = begin + count / rate_hz
        if now < due:
            time.sleep(due - now)
        yield count
        count += 1


class Attacker:
    """A host that speaks service discovery from an address of its own."""

    def __init__(self, address=ATTACKERS[0], listen=False):
        self.address = address
        self.sessions = {}
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind((address, SD_PORT))
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
        self.socket.setblocking(False)
        self.raw = socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_RAW)
        self.group = None
        if listen:
            self.group = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self.group.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self.group.bind((GROUP, SD_PORT))
            self.group.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                                  socket.inet_aton(GROUP) + socket.inet_aton(address))

    def say(self, entries=b"", options=b"", to=CAR, session=None):
        """Sends an SD message; each receiver has sessions of its own."""
        if session is None:
            session = self.sessions[to] = self.sessions.get(to, 0) % 0xFFFF + 1
        try:
            self.socket.sendto(sd(entries, options, session), (to, SD_PORT))
        except BlockingIOError:
            pass

    def say_as(self, source, entries=b"", options=b"", to=CAR, session=1):
        """The same as somebody else."""
        self.send_as((source, SD_PORT), sd(entries, options, session), (to, SD_PORT))

    def send_as(self, source, payload, to):
        self.raw.sendto(udp_packet(source, to, payload), (to[0], 0))

    def subscribe(self, service, options, number=1, to=CAR, **entry):
        """`number` options belong to the entry."""
        self.say(subscribe_entry(service, options=number, **entry), options, to)

    def offer(self, service, port, to=GROUP, ttl=3, more=b"", options=1, instance=1):
        self.say(service_entry(1, service, instance, ttl, options), endpoint(self.address, port) + more, to)

    def heard(self):
        """SD messages that came to us: (entries, endpoint, sender)."""
        while True:
            try:
                datagram, sender = self.socket.recvfrom(65536)
            except BlockingIOError:
                return
            yield *entries_of(datagram), sender


def open_udp(address, port=0):
    """A socket that never reads: what comes there is lost without a word."""
    sink = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sink.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    sink.bind((address, port))
    return sink
