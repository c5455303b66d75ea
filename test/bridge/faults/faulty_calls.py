"""What faulty_calls.cpp does to a program that it is preloaded to."""
import mmap
import struct

LAYOUT = struct.Struct("=iIiIqiIQQ")


class FaultyCalls:
    """The file that says which calls fail. `prefix` stands before the program's command."""

    def __init__(self, library, path):
        path.write_bytes(LAYOUT.pack(0, 1, 0, 1, 0, 0, 0, 0, 0).ljust(4096, b"\0"))
        with open(path, "r+b") as file:
            self._memory = mmap.mmap(file.fileno(), 4096)
        self.prefix = ["env", f"LD_PRELOAD={library}", f"TRESTLE_FAULTS={path}"]

    def _set(self, form, offset, *values):
        struct.pack_into("=" + form, self._memory, offset, *values)

    def sends_fail(self, error, every=1, streams=False):
        """One of so many calls that send fails with this errno; 0: none."""
        self._set("i", 24, int(streams))
        self._set("I", 4, every)
        self._set("i", 0, error)

    def receives_fail(self, error, every=1):
        self._set("I", 12, every)
        self._set("i", 8, error)

    def shift_time(self, seconds):
        """The time of day is so much later than it is."""
        self._set("q", 16, int(seconds * 1e9))

    def failed(self):
        """How many calls have failed that send, and that receive."""
        return LAYOUT.unpack_from(self._memory)[7:9]
