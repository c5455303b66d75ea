"""A client of WebSocket (RFC 6455) for tests, which needs nothing of Python's packages. It checks what a server must do."""
import base64
import hashlib
import os
import socket
import struct

PATIENCE = 60
TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Refused(Exception):
    """No 101, but this answer."""


class WebSocket:
    """One connection. Use as a context manager."""

    def __init__(self, host, port, path="/", protocols=(), headers=(), receive_buffer=None):
        self.socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(PATIENCE)
        self.socket.connect((host, port))
        self.file = self.socket.makefile("rb")
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {path} HTTP/1.1", f"Host: {host}:{port}", "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}",
                 "Sec-WebSocket-Version: 13", *([f"Sec-WebSocket-Protocol: {', '.join(protocols)}"] if protocols else []), *headers]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        status = self.file.readline().decode().strip()
        self.headers = {}
        while line := self.file.readline().decode().strip():
            name, _, value = line.partition(":")
            self.headers[name.lower()] = value.strip()
        if not status.startswith("HTTP/1.1 101 "):
            body = self.file.read(int(self.headers.get("content-length", 0))).decode()
            self.close()
            raise Refused(f"{status}: {body}")
        expected = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()).decode()
        assert self.headers["sec-websocket-accept"] == expected, self.headers
        self.protocol = self.headers.get("sec-websocket-protocol")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.file.close()
        self.socket.close()

    def send(self, payload, opcode=None, masked=True, last=True):
        """A text (str) or bytes, as one frame."""
        opcode = opcode if opcode is not None else TEXT if isinstance(payload, str) else BINARY
        data = payload.encode() if isinstance(payload, str) else payload
        length = (bytes([len(data)]) if len(data) < 126 else b"\x7e" + struct.pack(">H", len(data)) if len(data) < 65536
                  else b"\x7f" + struct.pack(">Q", len(data)))
        head = bytes([(0x80 if last else 0) | opcode, length[0] | (0x80 if masked else 0)]) + length[1:]
        mask = os.urandom(4) if masked else b""
        body = bytes(one ^ mask[i % 4] for i, one in enumerate(data)) if masked else data
        self.socket.sendall(head + mask + body)

    def read_exactly(self, count):
        data = self.file.read(count)
        if len(data) < count:
            raise EOFError("the server has closed the connection")
        return data

    def frame(self):
        """(opcode, payload, whether it is the last of a message). Of a server none is masked."""
        first, second = self.read_exactly(2)
        assert first & 0x70 == 0, "no extension was agreed on"
        assert second & 0x80 == 0, "a server must not mask"
        length = second & 0x7f
        if length >= 126:
            length = int.from_bytes(self.read_exactly(2 if length == 126 else 8), "big")
        return first & 15, self.read_exactly(length), bool(first & 0x80)

    def receive(self):
        """The next message: str or bytes. Pings are answered. The end raises EOFError, with the server's code and reason."""
        opcode, parts = None, []
        while True:
            kind, payload, last = self.frame()
            if kind == PING:
                self.send(payload, PONG)
            elif kind == CLOSE:
                raise EOFError(int.from_bytes(payload[:2], "big"), payload[2:].decode())
            elif kind != PONG:
                opcode = opcode or kind
                parts.append(payload)
                if last:
                    data = b"".join(parts)
                    return data.decode() if opcode == TEXT else data
