"""A DDS domain for a test."""
import fcntl
import os


def own_domain():
    """One that no other test program on this host uses while this one runs, as dds_test.hpp chooses it."""
    first, count = 20, 80  # above about 100 the ports are those that clients get
    for i in range(count):
        domain = first + (os.getpid() + i) % count
        file = os.open(f"/tmp/trestle-test-domain-{domain}", os.O_CREAT | os.O_RDWR, 0o666)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return domain  # the file stays open
        except OSError:
            os.close(file)
    raise AssertionError("no DDS domain is free")
