"""A SOME/IP peer that is nothing but sockets and hand-made bytes."""
import socket
import struct
import time

PATIENCE = 60  # seconds; running into it is a failure


def someip(service, method, payload, session=1, message_type=2, interface=1):
    return struct.pack(">HHIHHBBBB", service, method, 8 + len(payload), 0, session, 1, interface, message_type, 0) + payload


class Peer:
    """A peer's SD socket, a socket in the group, and the socket of its service 0x2222.0x0001."""

    def __init__(self, address, group):
        self.address = address
        self.sd = self.bound(address, 30490)
        self.sd.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
        self.group = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.group.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.group.bind((group, 30490))
        self.group.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                              socket.inet_aton(group) + socket.inet_aton("127.0.0.1"))
        self.service = self.bound(address, 40002)
        self.session = 0

    @staticmethod
    def bound(address, port):
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sock.bind((address, port))
        return sock

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        for sock in (self.sd, self.group, self.service):
            sock.close()

    def endpoint(self, port):
        return struct.pack(">HBB4sBBH", 9, 0x04, 0, socket.inet_aton(self.address), 0, 0x11, port)

    def send_sd(self, to, entry, options=b""):
        self.session += 1
        payload = struct.pack(">II", 0xC0000000, len(entry)) + entry + struct.pack(">I", len(options)) + options
        self.sd.sendto(someip(0xFFFF, 0x8100, payload, self.session), (to, 30490))

    def offer(self, to, ttl=600, minor=0):
        self.send_sd(to, struct.pack(">BBBBHHII", 1, 0, 0, 0x10, 0x2222, 1, 1 << 24 | ttl, minor), self.endpoint(40002))

    def subscribe(self, to, service, eventgroup):
        self.send_sd(to, struct.pack(">BBBBHHIHH", 6, 0, 0, 0x10, service, 1, 1 << 24 | 600, 0, eventgroup),
                     self.endpoint(40003))

    def ack(self, to, entry, multicast=None):
        if multicast is None:
            self.send_sd(to, bytes([7, 0, 0, 0]) + entry[4:])
        else:
            option = struct.pack(">HBB4sBBH", 9, 0x14, 0, socket.inet_aton(multicast[0]), 0, 0x11, multicast[1])
            self.send_sd(to, bytes([7, 0, 0, 0x10]) + entry[4:], option)


def entries(datagram):
    """The 16-byte entries of an SD message."""
    length = struct.unpack_from(">I", datagram, 20)[0]
    return [datagram[24 + i:40 + i] for i in range(0, length, 16)]


def ttl(entry):
    return int.from_bytes(entry[9:12], "big")


def receive(sock, wanted):
    """The first entry that is wanted, of all that arrive, the datagram that holds it and who sent it."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        sock.settimeout(max(0.01, end - time.monotonic()))
        datagram, sender = sock.recvfrom(65536)
        for entry in entries(datagram):
            if wanted(entry):
                return entry, datagram, sender
    raise AssertionError("nothing such was sent")
