"""A cable that loses, doubles, delays and reorders frames, by chance of one seed; and what it did to each message.

It stands in for `tc netem`, which many kernels lack, and tells more: which segment of which message was lost. So what came
can be compared with what could have come.
"""
import array
import collections
import dataclasses
import fcntl
import heapq
import itertools
import os
import random
import select
import socket
import struct
import subprocess
import time

from lab import Failed
from wire import OFFER, SD_PORT, SEGMENT, entries_of

OUT, IN = "out", "in"  # what the car sends, and what it gets
LATE_S = 0.005  # of a reordered frame
TTL_S = 3.0  # of offers


@dataclasses.dataclass
class Quality:
    """Of each direction. Shares of all frames are from 0 to 1, times are in seconds."""

    loss: float = 0.0
    doubled: float = 0.0
    reordered: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0  # up to so much more, for each frame by itself


def _checksums_in_software():
    """Switches off what veth leaves to the other end: checksums, and cutting into frames. Here a frame leaves the kernel."""
    set_checksums, ioctl_ethtool = 0x17, 0x8946
    order = array.array("I", [set_checksums, 0])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        fcntl.ioctl(one, ioctl_ethtool, struct.pack("16sQ16x", b"eth0", order.buffer_info()[0]))


def _messages(frame):
    """The SOME/IP messages of an Ethernet frame: (port it is for, message)."""
    if frame[12:14] != b"\x08\0" or frame[23] != socket.IPPROTO_UDP:
        return
    at = 14 + (frame[14] & 15) * 4
    port, length = struct.unpack_from(">HH", frame, at + 2)
    rest = frame[at + 8:at + length]
    while len(rest) >= 16:
        size = 8 + struct.unpack_from(">I", rest, 4)[0]
        yield port, rest[:size]
        rest = rest[size:]


def _told(way, frame):
    """Lines for what of a frame is looked at later: events with a stamp, their segments, and offers."""
    for port, message in _messages(frame):
        service, method = struct.unpack_from(">HH", message)
        if port == SD_PORT:
            for entry in entries_of(message)[0]:
                if entry[0] == OFFER:
                    yield f"offer {way} {struct.unpack_from('>H', entry, 4)[0]}"
        elif method == 0x8001 and message[14] & ~SEGMENT == 2:
            session, body, offset, more = struct.unpack_from(">H", message, 10)[0], message[16:], 0, 0
            if message[14] & SEGMENT:
                word = struct.unpack_from(">I", message, 16)[0]
                offset, more, body = word & ~15, word & 1, message[20:]
            stamp = 0
            if offset == 0 and len(body) >= 8:
                seconds, ns = struct.unpack_from(">II", body)
                stamp = seconds * 10**9 + ns
            yield f"event {way} {service} {session} {offset} {len(body)} {more} {stamp}"


def _carry(qualities, seed, path):
    """The relay itself, on the host `switch`, for ever. Each line of the file is KIND LINE: see _told()."""
    ends = {}
    for way, name in (OUT, "car"), (IN, "relay"):
        ends[way] = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
        ends[way].bind((name, 0))
        ends[way].setblocking(False)
    choice = random.Random(seed)
    waiting, order = [], itertools.count()
    poll = select.poll()
    for one in ends.values():
        poll.register(one, select.POLLIN)
    with open(path, "w", encoding="ascii", buffering=1) as log:
        def note(kind, way, frame):
            for line in _told(way, frame):
                log.write(f"{kind} {time.monotonic_ns()} {line}\n")

        while True:
            now = time.monotonic()
            while waiting and waiting[0][0] <= now:
                _, _, way, frame = heapq.heappop(waiting)
                note("came", way, frame)
                try:
                    ends[IN if way == OUT else OUT].send(frame)
                except OSError:
                    note("refused", way, frame)
            poll.poll(max(0, (waiting[0][0] - now) * 1000) if waiting else None)
            for way, end in ends.items():
                try:
                    frame, (_, _, kind, _, _) = end.recvfrom(65536)
                except BlockingIOError:
                    continue
                if kind == socket.PACKET_OUTGOING:
                    continue
                quality = qualities[way]
                note("sent", way, frame)
                for _ in range(1 if choice.random() >= quality.doubled else 2):
                    if choice.random() < quality.loss:
                        note("lost", way, frame)
                        continue
                    due = time.monotonic() + quality.delay + choice.random() * quality.jitter
                    if choice.random() < quality.reordered:
                        due += LATE_S
                    heapq.heappush(waiting, (due, next(order), way, frame))


class Relay:
    """Between the car and the switch, from now on."""

    def __init__(self, lab, hosts, quality, seed):
        for host in hosts:
            child = lab.fork(host, _checksums_in_software)
            lab.children.remove(child)
            if os.waitpid(child, 0)[1]:
                raise Failed(f"checksums of {host} stay with the device")
        for command in ("link add relay type veth peer name relayed", "link set relay up",
                        "link set relayed master switch up", "link set car nomaster"):
            subprocess.run(["ip", "-n", "switch", *command.split()], check=True, capture_output=True)
        self._path = lab.folder / "relay.txt"
        self._path.touch()
        lab.fork("switch", _carry, {OUT: quality, IN: quality}, seed, self._path)

    def read(self):
        """Until now."""
        return Carried(self._path)


class Carried:
    """What the relay has done to events, and what their receiver can make of what came.

    The specification tells it: segments in any order; one of another session ends the message before
    [feat_req_someiptp_793]."""

    def __init__(self, path):
        self.frames = self.lost = 0  # with events
        self._stamps = {}  # of messages, by way, service and session
        self._parts = collections.defaultdict(set)  # of a message, that count: offset and size
        self._sizes = {}
        self._current = {}  # session
        self._offered = {}  # when an offer came last
        self._unsure = set()  # messages that came when the receiver may not have known the service
        with open(path, encoding="ascii") as file:
            for line in file:
                if line.endswith("\n"):
                    self._take(*line.split())

    def _take(self, kind, when, what, way, service, *numbers):
        when = int(when) / 1e9
        if what == "offer":
            if kind == "came":
                self._offered[way, service] = when
            return
        session, offset, size, more, stamp = map(int, numbers)
        message = way, service, session
        if kind == "sent":
            self.frames += 1
            if offset == 0:
                self._stamps[message] = stamp
            if not more:
                self._sizes[message] = offset + size
        elif kind == "lost":
            self.lost += 1
        elif kind == "came":
            if offset == 0 and not more:  # one that is no segment stands for itself
                self._parts[message].add((offset, size))
                return
            current = self._current.setdefault((way, service), session)
            if 0 < (session - current) % 0xFFFF < 0x8000:
                self._current[way, service] = session
            elif session != current:
                return
            self._parts[message].add((offset, size))
            if when > self._offered.get((way, service), 0) + TTL_S - 0.2:
                self._unsure.add(message)

    def of(self, way, service):
        """Stamps of the messages that came whole, and of those that did not."""
        whole, broken = set(), set()
        for message, stamp in self._stamps.items():
            if message[:2] == (way, str(service)) and message not in self._unsure:
                came = sum(size for _, size in self._parts[message])
                (whole if came == self._sizes.get(message) else broken).add(stamp)
        return whole, broken
