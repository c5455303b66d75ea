"""What networks do to datagrams without meaning any harm."""
import socket
import struct

from lab import ADDRESS
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
