"""For tests of what programs say of socket buffers that the system does not grant."""
import ctypes
import re
import unittest


def without_net_admin():
    """Before a program: it may not go beyond the system's limits, even if who runs the test may."""
    drop_from_bounding_set, cap_net_admin = 24, 12
    ctypes.CDLL(None).prctl(drop_from_bounding_set, cap_net_admin, 0, 0, 0)


def limits_below(receive, send):
    """What is to be set so that a socket gets buffers of these sizes, as sysctl takes it. 0: it needs none."""
    settings = []
    for name, wanted in ("rmem_max", receive), ("wmem_max", send):
        try:
            with open(f"/proc/sys/net/core/{name}", encoding="ascii") as file:
                granted = int(file.read())
        except FileNotFoundError as error:
            raise unittest.SkipTest("a network namespace that does not show the system's limits") from error
        settings += [f"net.core.{name}={wanted}"] if granted < wanted else []
    return settings


LINE = r"^.*{}the system grants UDP .*sysctl -w (\S+)\n"


def limits_told(log, by):
    """What a log says that is to be set; `by` stands before it."""
    return re.findall(LINE.format(by), log, re.MULTILINE)


def of_others(log):
    """The log without that."""
    return re.sub(LINE.format(""), "", log, flags=re.MULTILINE)
