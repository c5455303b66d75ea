"""What tests of `trestle bridge` as a program share: where it is, the head of its configuration, and its log."""
import os
import time

from bare_peer import PATIENCE, ttl
from dds_domain import own_domain

# Addresses, a group and a DDS domain that only this process uses.
PID = os.getpid()
HOST = f"127.{1 + (PID >> 8) % 254}.{PID & 255}."
BRIDGE, PEER = HOST + "11", HOST + "12"
GROUP = f"239.254.{PID >> 8 & 255}.{PID & 255}"
DOMAIN = own_domain()
TTL = 600  # of what a bridge offers and subscribes to: a slow machine is no reason to be gone


def head(address=BRIDGE):
    return f"""\
someip:
  address: {address}
  sd: {{multicast: {GROUP}, initial_delay_min: 0, initial_delay_max: 5 ms, cyclic_offer_delay: 200 ms, ttl: {TTL} s}}
dds: {{domain: {DOMAIN}, interfaces: [127.0.0.1]}}
"""


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def offered(service, wanted=True):
    """Entries that offer instance 1 of the service, or that withdraw it."""
    return lambda e: e[0] == 1 and e[4:8] == service.to_bytes(2, "big") + b"\0\1" and (ttl(e) > 0) == wanted


def log_until(log, wanted, times=1):
    """Waits until the file `log` has a text so many times."""
    end = time.monotonic() + PATIENCE
    while True:
        log.seek(0)
        text = log.read()
        if text.count(wanted) >= times:
            return
        if time.monotonic() > end:
            raise AssertionError(f"not in the log: {wanted}\n{text}")
        time.sleep(0.02)
