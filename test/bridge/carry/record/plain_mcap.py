"""Reads MCAP files whose chunks are not compressed, by the format's specification alone."""
import struct
import zlib

MAGIC = b"\x89MCAP0\r\n"


class Fields:
    def __init__(self, data):
        self.data, self.at = data, 0

    def number(self, form):
        value, = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return value

    def bytes(self, size):
        value = self.data[self.at:self.at + size]
        assert len(value) == size
        self.at += size
        return value

    def text(self):
        return self.bytes(self.number("I")).decode()

    def texts(self):
        inner, found = Fields(self.bytes(self.number("I"))), {}
        while inner.at < len(inner.data):
            name = inner.text()
            found[name] = inner.text()
        return found


def records(data):
    """Opcode and contents of each, as far as they are whole."""
    at = 0
    while at + 9 <= len(data):
        opcode, size = struct.unpack_from("<BQ", data, at)
        if at + 9 + size > len(data):
            return
        yield opcode, data[at + 9:at + 9 + size]
        at += 9 + size
        if opcode == 2:
            return


class Mcap:
    """What a file holds: `messages` are (topic, encoding, channel metadata, sequence, log time, publish time, data)."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        assert data.startswith(MAGIC)
        self.is_whole = data.endswith(MAGIC) and len(data) > 16
        self.messages, self.metadata, self.schemas, self.channels, self.chunks = [], {}, {}, {}, 0
        self.take(data[8:])

    def take(self, data):
        for opcode, body in records(data):
            fields = Fields(body)
            if opcode == 3:
                number = fields.number("H")
                self.schemas[number] = (fields.text(), fields.text(), fields.text())
            elif opcode == 4:
                number, schema = fields.number("H"), fields.number("H")
                self.channels[number] = (fields.text(), fields.text(), fields.texts(), self.schemas.get(schema))
            elif opcode == 5:
                number = fields.number("H")
                topic, encoding, metadata, _ = self.channels[number]
                head = fields.number("I"), fields.number("Q"), fields.number("Q")
                self.messages.append((topic, encoding, metadata, *head, body[fields.at:]))
            elif opcode == 6:
                fields.bytes(16)
                size, crc, compression = fields.number("Q"), fields.number("I"), fields.text()
                inner = fields.bytes(fields.number("Q"))
                assert compression == "" and len(inner) == size and zlib.crc32(inner) == crc
                self.chunks += 1
                self.take(inner)
            elif opcode == 12:
                name = fields.text()
                self.metadata[name] = fields.texts()
            elif opcode == 15:
                return
