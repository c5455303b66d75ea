#!/usr/bin/env python3
"""compare_with_scapy.py TRESTLE

Frames that our recordings lack, built by scapy: our decoder must find in them what scapy was told to put there.
Exit status 77: no scapy.
"""
import json
import logging
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../interop"))
logging.getLogger("scapy.runtime").setLevel(logging.ERROR)
try:
    from scapy.contrib.automotive.someip import (SD, SOMEIP, SDEntry_EventGroup, SDEntry_Service, SDOption_Config,
                                                 SDOption_IP4_EndPoint, SDOption_IP4_Multicast,
                                                 SDOption_IP6_EndPoint, SDOption_LoadBalance)
    from scapy.layers.inet import ICMP, IP, TCP, UDP, fragment
    from scapy.layers.inet6 import IPv6, IPv6ExtHdrDestOpt, IPv6ExtHdrFragment, IPv6ExtHdrHopByHop, fragment6
    from scapy.layers.l2 import CookedLinux, Dot1AD, Dot1Q, Ether
    from scapy.packet import Raw
    from scapy.utils import wrpcap, wrpcapng
    from scapy_fields import method_fields, tp_fields
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

program = sys.argv[1]
folder = tempfile.TemporaryDirectory()
failures = 0


def decode(packets, arguments=(), write=wrpcap, **how):
    path = os.path.join(folder.name, "scapy.pcap")
    write(path, packets, **how)
    done = subprocess.run([program, "decode", path, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    objects = [json.loads(line) for line in done.stdout.splitlines()]
    expect("exit status", done.returncode, 1 if any("error" in item for item in objects) else 0)
    return objects


def expect(what, found, wanted):
    global failures
    if found != wanted:
        failures += 1
        print(f"{test}: {what}:\n    found  {found}\n    wanted {wanted}")


def header(service, method, kind, session=1, client=0x0102, version=3, **more):
    return SOMEIP(srv_id=service, client_id=client, session_id=session, iface_ver=version, msg_type=kind,
                  **method_fields(method), **more)


def message(method=0x0421, payload=b"\xca\xfe", kind=0x00):
    return header(0x1234, method, kind) / Raw(payload)


def fields(item):
    return {name: item.get(name) for name in ("service", "method", "length", "client", "session", "protocol_version",
                                              "interface_version", "message_type_value", "return_code_value",
                                              "payload")}


def wanted(method=0x0421, payload=b"\xca\xfe", kind=0x00, session=1):
    return {"service": "0x1234", "method": f"0x{method:04x}", "length": 8 + len(payload), "client": "0x0102",
            "session": f"0x{session:04x}", "protocol_version": 1, "interface_version": 3, "message_type_value": kind,
            "return_code_value": 0, "payload": payload.hex()}


ip4 = IP(src="192.168.0.1", dst="192.168.0.2")
ip6 = IPv6(src="fd00::1", dst="fd00::2")
udp = UDP(sport=40000, dport=30509)
ether = Ether(src="02:00:00:00:00:01", dst="02:00:00:00:00:02")

test = "link layers"
for name, packet, how in [
        ("Ethernet", ether / ip4 / udp / message(), {}),
        ("VLAN", ether / Dot1Q(vlan=73) / ip4 / udp / message(), {}),
        ("QinQ", ether / Dot1AD(vlan=2) / Dot1Q(vlan=73) / ip4 / udp / message(), {}),
        ("VLAN and IPv6", ether / Dot1Q(vlan=73) / ip6 / udp / message(), {}),
        ("Linux cooked", CookedLinux(proto=0x0800) / ip4 / udp / message(), {"linktype": 113}),
        ("raw IPv4", ip4 / udp / message(), {"linktype": 101}),
        ("raw IPv6", ip6 / udp / message(), {"linktype": 101}),
        ("IPv4 options", ether / IP(src="192.168.0.1", dst="192.168.0.2", options=[b"\x94\x04\x00\x00"]) / udp /
         message(), {}),
        ("IPv6 extension headers", ether / ip6 / IPv6ExtHdrHopByHop() / IPv6ExtHdrDestOpt() / udp / message(), {}),
        ("a wrong UDP checksum", ether / ip4 / UDP(sport=40000, dport=30509, chksum=0x1111) / message(), {})]:
    items = decode([packet], **how)
    expect(name, [fields(item) for item in items], [wanted()])
    v6 = IPv6 in packet
    expect(name, [(item["src"], item["dst"]) for item in items],
           [("[fd00::1]:40000", "[fd00::2]:30509") if v6 else ("192.168.0.1:40000", "192.168.0.2:30509")])

test = "pcapng"
expect("messages", [fields(item) for item in decode([ether / ip4 / udp / message()], write=wrpcapng)], [wanted()])

test = "several messages in one datagram"
together = bytes(message(1, b"", 0x01)) + bytes(message(2, b"\x01", 0x02)) + bytes(message(3, b"\x02" * 100, 0x80))
items = decode([ether / ip4 / udp / Raw(together)])
expect("messages", [fields(item) for item in items],
       [wanted(1, b"", 0x01), wanted(2, b"\x01", 0x02), wanted(3, b"\x02" * 100, 0x80)])
expect("offsets", [item["offset"] for item in items], [0, 16, 33])
items = decode([ether / ip4 / udp / Raw(together + b"\x12\x34")])
expect("what is left over", (items[3]["offset"], items[3]["bytes"], items[3]["error"]["name"]),
       (149, "1234", "truncated"))

test = "fragments of IP"
big = bytes(range(256)) * 20
for name, packets in [("IPv4", fragment(ip4 / udp / message(payload=big), fragsize=600)),
                      ("IPv6", fragment6(ip6 / IPv6ExtHdrFragment(id=7) / udp / message(payload=big), 1280))]:
    assert len(packets) > 3
    packets = [ether / packet for packet in packets]
    items = decode([packets[-1]] + packets[1:-1] + [packets[0]] + [ether / ip4 / ICMP()])
    expect(name, [fields(item) for item in items], [wanted(payload=big)])
    expect(name + " frame", [item["frame"] for item in items], [len(packets)])
    expect(name + " with one lost", decode(packets[1:]), [])

test = "SOME/IP-TP"
segments = []
for offset in range(0, len(big), 1392):
    more = offset + 1392 < len(big)
    segment = header(0x1234, 0x8001, 0x22, 9, **tp_fields(offset, more))
    segment = segment / Raw(big[offset:offset + 1392])
    segments.append(ether / ip4 / udp / segment)
items = decode(segments)
expect("segments", [(item["tp"]["offset"], item["tp"]["more_segments"], item["message_type_value"], item["payload"])
                    for item in items],
       [(offset, offset + 1392 < len(big), 0x22, big[offset:offset + 1392].hex())
        for offset in range(0, len(big), 1392)])
items = decode(segments[::-1], ["--reassemble"])
expect("whole message", [fields(item) for item in items if item.get("reassembled")],
       [wanted(0x8001, big, 0x02, 9)])

test = "TCP"
stream = b"".join(bytes(message(method, bytes([method]) * size)) for method, size in [(1, 10), (2, 3000), (3, 40)])
tcp = [ether / ip6 / TCP(sport=40000, dport=30510, flags="S", seq=999)]
tcp += [ether / ip6 / TCP(sport=40000, dport=30510, flags="A", seq=1000 + at) / Raw(stream[at:at + 500])
        for at in range(0, len(stream), 500)]
for name, packets in [("in order", tcp), ("out of order", [tcp[0]] + tcp[:0:-1]), ("repeated", tcp + tcp[1:]),
                      ("interleaved", tcp[:3] + [tcp[2], tcp[5], tcp[1], tcp[3], tcp[4]] + tcp[5:])]:
    items = decode(packets)
    expect(name, [fields(item) for item in items],
           [wanted(1, b"\x01" * 10), wanted(2, b"\x02" * 3000), wanted(3, b"\x03" * 40)])
    expect(name + " offsets", [item["offset"] for item in items], [0, 26, 3042])

test = "service discovery"
sd = SD(flags=0xe0)
sd.set_entryArray([
    SDEntry_Service(type=0x01, index_1=0, n_opt_1=2, index_2=2, n_opt_2=1, srv_id=0x1111, inst_id=0x2222, major_ver=4,
                    ttl=0x00fffe, minor_ver=0x01020304),
    SDEntry_Service(type=0x01, srv_id=0x1111, inst_id=0x2222, major_ver=4, ttl=0, minor_ver=0x01020304),
    SDEntry_Service(type=0x00, srv_id=0x3333, inst_id=0xffff, major_ver=0xff, ttl=3, minor_ver=0xffffffff),
    SDEntry_EventGroup(type=0x06, index_1=3, n_opt_1=1, srv_id=0x1111, inst_id=0x2222, major_ver=4, ttl=5, cnt=9,
                       eventgroup_id=0x4465),
    SDEntry_EventGroup(type=0x06, srv_id=0x1111, inst_id=0x2222, major_ver=4, ttl=0, eventgroup_id=0x4465),
    SDEntry_EventGroup(type=0x07, index_1=4, n_opt_1=1, srv_id=0x1111, inst_id=0x2222, major_ver=4, ttl=5,
                       eventgroup_id=0x4465),
    SDEntry_EventGroup(type=0x07, srv_id=0x1111, inst_id=0x2222, major_ver=4, ttl=0, eventgroup_id=0x4466)])
sd.set_optionArray([
    SDOption_IP4_EndPoint(addr="10.1.2.3", l4_proto=0x11, port=30509),
    SDOption_IP4_EndPoint(addr="10.1.2.3", l4_proto=0x06, port=30510),
    SDOption_Config(cfg_str=b"\x03a=b\x01c\x00"),
    SDOption_IP6_EndPoint(addr="fd00::7", l4_proto=0x11, port=40001),
    SDOption_IP4_Multicast(addr="224.1.2.3", l4_proto=0x11, port=40002),
    SDOption_LoadBalance(priority=5, weight=6)])
items = decode([ether / ip4 / UDP(sport=30490, dport=30490) /
                header(0xffff, 0x8100, 0x02, 7, client=0, version=1) / Raw(bytes(sd))])
expect("objects", len(items), 1)
expect("error", items[0].get("error"), None)
found = items[0]["sd"]
expect("flags", found["flags"], {"value": 0xe0, "reboot": True, "unicast": True, "explicit_initial_data": True})
expect("entries", [(e["type"], e["service"], e["instance"], e["major_version"], e["ttl"],
                    e.get("minor_version", e.get("eventgroup"))) for e in found["entries"]],
       [("offer_service", "0x1111", "0x2222", 4, 0xfffe, 0x01020304),
        ("stop_offer_service", "0x1111", "0x2222", 4, 0, 0x01020304),
        ("find_service", "0x3333", "0xffff", 0xff, 3, 0xffffffff),
        ("subscribe_eventgroup", "0x1111", "0x2222", 4, 5, "0x4465"),
        ("stop_subscribe_eventgroup", "0x1111", "0x2222", 4, 0, "0x4465"),
        ("subscribe_eventgroup_ack", "0x1111", "0x2222", 4, 5, "0x4465"),
        ("subscribe_eventgroup_nack", "0x1111", "0x2222", 4, 0, "0x4466")])
expect("runs", (found["entries"][0]["first_run"], found["entries"][0]["second_run"]),
       ({"index": 0, "count": 2}, {"index": 2, "count": 1}))
expect("counter", found["entries"][3]["counter"], 9)
endpoints = [(o["type"], o["address"], o["transport"], o["port"]) for o in found["options"] if "port" in o]
expect("endpoints", endpoints, [("ipv4_endpoint", "10.1.2.3", "udp", 30509), ("ipv4_endpoint", "10.1.2.3", "tcp", 30510),
                                ("ipv6_endpoint", "fd00::7", "udp", 40001),
                                ("ipv4_multicast", "224.1.2.3", "udp", 40002)])
expect("configuration", found["options"][2].get("items"), [{"key": "a", "value": "b"}, {"key": "c", "value": None}])
expect("load balancing", (found["options"][5].get("priority"), found["options"][5].get("weight")), (5, 6))

print("all as expected" if failures == 0 else f"{failures} differences")
sys.exit(1 if failures else 0)
