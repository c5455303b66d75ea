"""Random SOME/IP datagrams, well formed and damaged, made without any SOME/IP library. The same seed makes the same."""
import random
import struct

TYPES = (0x00, 0x01, 0x02, 0x80, 0x81)
TP_FLAG = 0x20
ENDPOINTS = {0x04: 4, 0x14: 4, 0x24: 4, 0x06: 16, 0x16: 16, 0x26: 16}  # option type: bytes of the address
KEY = "".join(chr(c) for c in range(0x21, 0x7f) if chr(c) not in "=^")


class Maker:
    def __init__(self, seed):
        self.random = random.Random(seed)

    def datagram(self):
        """A datagram that breaks no rule."""
        kind = self.random.randrange(10)
        if kind < 3:
            return b"".join(self.message() for _ in range(self.random.choice((1, 1, 1, 2, 4))))
        return self.segment() if kind < 5 else self.discovery()

    def damaged(self):
        """One that was well formed before a few bytes of it changed, vanished, or were added."""
        data = bytearray(self.datagram())
        for _ in range(self.random.choice((1, 1, 2, 3))):
            self.random.choice((self.set_byte, self.flip_bit, self.cut, self.append, self.shift_length, self.repeat))(data)
        return bytes(data)

    def message(self):
        service, method = self.random.getrandbits(16), self.random.getrandbits(16)
        if (service, method) == (0xffff, 0x8100):
            method = 0
        return self.header(service, method, self.random.choice(TYPES), self.random.randbytes(self.random.randrange(60)))

    def header(self, service, method, kind, payload, client=None, interface=None, code=None):
        def pick(value, bits):
            return self.random.getrandbits(bits) if value is None else value
        return struct.pack(">HHIHHBBBB", service, method, 8 + len(payload), pick(client, 16), self.random.getrandbits(16),
                           1, pick(interface, 8), kind, pick(code, 5)) + payload

    def segment(self):
        more = self.random.getrandbits(1)
        size = 16 * self.random.randrange(1, 20) if more else self.random.randrange(1, 200)
        word = self.random.getrandbits(20) << 4 | more
        return self.header(self.random.getrandbits(15), self.random.getrandbits(16), self.random.choice(TYPES) | TP_FLAG,
                           struct.pack(">I", word) + self.random.randbytes(size))

    def discovery(self):
        options = [self.option() for _ in range(self.random.randrange(6))]
        entries = b"".join(self.entry(len(options)) for _ in range(self.random.randrange(1, 7)))
        joined = b"".join(options)
        flags = self.random.choice((0xc0, 0xc0, 0x40, 0xe0, 0x00, 0x80))
        payload = struct.pack(">II", flags << 24, len(entries)) + entries + struct.pack(">I", len(joined)) + joined
        return self.header(0xffff, 0x8100, 0x02, payload, client=0, interface=1, code=0)

    def entry(self, options):
        def run():
            if options == 0:
                return 0, 0
            index = self.random.randrange(options)
            return index, self.random.randrange(min(options - index, 15) + 1)
        (first, first_count), (second, second_count) = run(), run()
        kind = self.random.choice((0x00, 0x01, 0x06, 0x07))
        ttl = self.random.choice((0, 3, 0xffffff, self.random.getrandbits(24)))
        eventgroup = kind in (0x06, 0x07)
        tail = self.random.getrandbits(16) | self.random.getrandbits(4) << 16 | self.random.getrandbits(1) << 23 \
            if eventgroup else self.random.getrandbits(32)
        return struct.pack(">BBBBHHII", kind, first, second, first_count << 4 | second_count, self.random.getrandbits(16),
                           self.random.getrandbits(16), self.random.getrandbits(8) << 24 | ttl, tail)

    def option(self):
        kind = self.random.choice((0x01, 0x02, *ENDPOINTS))
        if kind == 0x01:
            body = b""
            for _ in range(self.random.randrange(4)):
                item = "".join(self.random.choice(KEY) for _ in range(self.random.randrange(1, 9)))
                item += self.random.choice(("", "=", "=" + "".join(self.random.choice(KEY) for _ in range(5))))
                body += bytes([len(item)]) + item.encode()
            body += b"\0"
        elif kind == 0x02:
            body = self.random.randbytes(4)
        else:
            body = self.endpoint(kind)
        return struct.pack(">HBB", 1 + len(body), kind, self.random.choice((0, 0, 0x80))) + body

    def endpoint(self, kind):
        address = bytearray(self.random.randbytes(ENDPOINTS[kind]))
        v6 = len(address) == 16
        if kind & 0x10:
            address[0] = 0xff if v6 else 0xe0 | address[0] & 0x0f
        elif v6:
            address[0] = 0xfd
        else:
            address[0] = 1 + address[0] % 223
        unicast = kind in (0x04, 0x06)
        return bytes(address) + struct.pack(">BBH", 0, self.random.choice((0x06, 0x11)) if unicast else 0x11,
                                            self.random.randrange(1, 0x10000))

    # Damage.

    def set_byte(self, data):
        if data:
            data[self.random.randrange(len(data))] = self.random.choice((0, 1, 0x7f, 0x80, 0xff, self.random.getrandbits(8)))

    def flip_bit(self, data):
        if data:
            data[self.random.randrange(len(data))] ^= 1 << self.random.randrange(8)

    def cut(self, data):
        del data[self.random.randrange(len(data) + 1):]

    def append(self, data):
        data += self.random.randbytes(self.random.randrange(1, 40))

    def repeat(self, data):
        begin = self.random.randrange(len(data) + 1)
        data[begin:begin] = data[begin:begin + self.random.randrange(1, 20)]

    def shift_length(self, data):
        """Changes one of the Length fields of SOME/IP, the entries array or the options array, where there are some."""
        places = [4, 20]
        if len(data) >= 24:
            places.append(24 + struct.unpack_from(">I", data, 20)[0])
        place = self.random.choice(places)
        if place + 4 <= len(data):
            length = struct.unpack_from(">I", data, place)[0] + self.random.choice((-16, -4, -1, 1, 4, 16, 0x10000))
            struct.pack_into(">I", data, place, length % (1 << 32))


def write_pcap(path, datagrams, port=30490):
    """Writes each datagram as a UDP datagram of its own."""
    with open(path, "wb") as out:
        out.write(struct.pack("<IHHiIII", 0xa1b2c3d4, 2, 4, 0, 0, 262144, 101))
        for number, data in enumerate(datagrams):
            total = 28 + len(data)
            # Each has another sender, so that nobody puts their segments together.
            source = bytes((10, 1, number >> 8 & 0xff, number & 0xff))
            ip = struct.pack(">BBHHHBBH", 0x45, 0, total, number & 0xffff, 0, 64, 17, 0) + source + bytes((10, 0, 0, 1))
            udp = struct.pack(">HHHH", port, port, 8 + len(data), 0)
            out.write(struct.pack("<IIII", number, 0, total, total) + ip + udp + data)
