"""SOME/IP and service discovery as bytes, for attackers: nothing here is checked, on purpose."""
import socket
import struct

SD_PORT = 30490
GROUP = "224.244.224.245"
GROUP6 = "ff15::84"
FIND, OFFER, SUBSCRIBE, ACK = 0, 1, 6, 7
ENDLESS = 0xFFFFFF
UDP, TCP = 0x11, 0x06
REQUEST, NO_RETURN, EVENT, SEGMENT, RESPONSE = 0x00, 0x01, 0x02, 0x20, 0x80


def someip(service, method, payload=b"", session=1, kind=EVENT, client=0, major=1, length=None):
    return struct.pack(">HHIHHBBBB", service, method, 8 + len(payload) if length is None else length, client, session, 1,
                       major, kind, 0) + payload


def segment(service, method, offset, payload, more=True, session=1, kind=EVENT, client=0, major=1):
    return someip(service, method, struct.pack(">I", offset | int(more)) + payload, session, kind | SEGMENT, client, major)


def endpoint(address, port, protocol=UDP, kind=0x04):
    if ":" in address:
        return struct.pack(">HBB16sBBH", 21, kind | 0x02, 0, socket.inet_pton(socket.AF_INET6, address), 0, protocol, port)
    return struct.pack(">HBB4sBBH", 9, kind, 0, socket.inet_aton(address), 0, protocol, port)


def sd_endpoint(address, port=SD_PORT):
    return endpoint(address, port, kind=0x24)


def configuration(*items):
    text = b"".join(bytes([len(item)]) + item.encode() for item in items) + b"\0"
    return struct.pack(">HBB", 1 + len(text), 0x01, 0) + text


def load_balancing(priority, weight):
    return struct.pack(">HBBHH", 5, 0x02, 0, priority, weight)


def service_entry(kind, service, instance=1, ttl=3, options=0, major=1, minor=0, first=0):
    return struct.pack(">BBBBHHII", kind, first, 0, options << 4, service, instance, major << 24 | ttl, minor)


def subscribe_entry(service, eventgroup=1, instance=1, ttl=3, options=1, major=1, first=0):
    return struct.pack(">BBBBHHIHH", SUBSCRIBE, first, 0, options << 4, service, instance, major << 24 | ttl, 0, eventgroup)


def sd(entries=b"", options=b"", session=1, flags=0xC0):
    payload = struct.pack(">II", flags << 24, len(entries)) + entries + struct.pack(">I", len(options)) + options
    return someip(0xFFFF, 0x8100, payload, session)


def udp_packet(source, to, payload):
    """An IPv4 packet that says it comes from `source`: (address, port)."""
    datagram = struct.pack(">HHHH", source[1], to[1], 8 + len(payload), 0) + payload
    return struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(datagram), 0, 0, 64, 17, 0, socket.inet_aton(source[0]),
                       socket.inet_aton(to[0])) + datagram


def udp_packet_v6(source, to, payload):
    """The same as an IPv6 packet, which needs a checksum."""
    ends = b"".join(socket.inet_pton(socket.AF_INET6, address) for address, _ in (source, to))
    length = 8 + len(payload)
    ports = struct.pack(">HHH", source[1], to[1], length)
    total = sum(struct.unpack(f">{(length + 35) // 2}H", ends + struct.pack(">HH", length, 17) + ports + payload +
                              bytes(length % 2)))
    while total > 0xFFFF:
        total = (total & 0xFFFF) + (total >> 16)
    return (struct.pack(">IHBB", 6 << 28, length, 17, 64) + ends + ports + struct.pack(">H", ~total & 0xFFFF or 0xFFFF) +
            payload)


def cloud(stamp_ns, size):
    """A sensor_msgs/msg/PointCloud2 of so many bytes, whose stamp is a time."""
    points = max(size // 16, 1)
    return struct.pack(">III4sIIIBIII", stamp_ns // 10**9, stamp_ns % 10**9, 4, b"\xef\xbb\xbf\0", 1, points, 0, 0, 16,
                       points * 16, points * 16) + bytes(points * 16) + b"\0"


def entries_of(datagram):
    """The 16-byte entries of an SD message, and the address and port of its first UDP endpoint."""
    length = struct.unpack_from(">I", datagram, 20)[0]
    options = datagram[28 + length:]
    where = None
    while len(options) > 3 and where is None:
        size, kind = struct.unpack_from(">HB", options)
        if kind == 0x04 and options[9] == UDP:
            where = socket.inet_ntoa(options[4:8]), struct.unpack_from(">H", options, 10)[0]
        options = options[3 + size:]
    return [datagram[24 + i:40 + i] for i in range(0, length, 16)], where


def is_refusal(entry):
    """Whether such an entry says no to a Subscribe."""
    return entry[0] == ACK and entry[9:12] == b"\0\0\0"
