#!/usr/bin/env python3
"""compare_with_tshark.py TRESTLE FOLDER SHARED_FOLDER

Every capture below the folders must decode to the same SOME/IP messages, frame by frame and in order, as tshark
reports when it takes every port for SOME/IP; and so must copies of those of the first folder, with frames of 802.11 and
Ethernet below PPI headers. The second folder need not exist; the environment variable
TRESTLE_SHARED_PCAPS names another one. Exit status 77: no tshark.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

# Name in our objects, field of tshark, how to compare them.
HEADER = [
    ("service", "someip.serviceid"),
    ("method", "someip.methodid"),
    ("length", "someip.length"),
    ("client", "someip.clientid"),
    ("session", "someip.sessionid"),
    ("protocol_version", "someip.protoversion"),
    ("interface_version", "someip.interfaceversion"),
    ("message_type_value", "someip.messagetype"),
    ("return_code_value", "someip.returncode"),
]
SD = ["flags", "entry.type", "entry.serviceid", "entry.instanceid", "entry.majorver", "entry.ttl", "entry.minorver",
      "entry.eventgroupid", "option.type", "option.length", "option.port"]
TP = ["someip.tp.offset", "someip.tp.flags.more_segments"]
# What tshark's expert says of bytes that are no message.
COMPLAINT = re.compile(r"Truncated message|too short|not enough buffer|Malformed Packet|Incomplete headers")

# What it says of SD messages that break no rule.
HARMLESS = ("SOME/IP-SD Unknown Option!", "SOME/IP-SD Empty Entry Array!",
            "SOME/IP-SD Subscribe after Stop Subscribe!")


def numbers(text):
    # tshark says of a flag "1", since 4.4 "True".
    return [int({"True": "1", "False": "0"}.get(number, number), 0) for number in text.split(",")] if text else []


def tshark(path):
    fields = ["frame.number"] + [f for _, f in HEADER] + ["someipsd." + f for f in SD] + TP + ["_ws.expert.message"]
    command = ["tshark", "-r", str(path), "-T", "fields", "-E", "separator=|", "-E", "aggregator=,",
               "-d", "udp.port==1-65535,someip", "-d", "tcp.port==1-65535,someip"]
    for field in fields:
        command += ["-e", field]
    output = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True, text=True).stdout
    frames = {}
    for line in output.splitlines():
        values = dict(zip(fields, line.split("|", len(fields) - 1)))
        if not values["someip.serviceid"]:
            continue
        frames[int(values["frame.number"])] = values
    return frames


def trestle(program, path):
    done = subprocess.run([program, "decode", str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    objects = [json.loads(line) for line in done.stdout.splitlines()]
    frames = {}
    for item in objects:
        frames.setdefault(item["frame"], []).append(item)
    status = 1 if any("error" in item for item in objects) else 0
    return frames, [] if done.returncode == status else [f"exit status {done.returncode}, not {status}"]


def sd_numbers(items):
    """Our SD messages of a frame in tshark's terms."""
    result = {field: [] for field in SD}
    for item in items:
        sd = item.get("sd")
        if sd is None:
            continue
        result["flags"].append(sd["flags"]["value"])
        for entry in sd["entries"]:
            result["entry.type"].append(entry["type_value"])
            result["entry.serviceid"].append(int(entry["service"], 16))
            result["entry.instanceid"].append(int(entry["instance"], 16))
            result["entry.majorver"].append(entry["major_version"])
            result["entry.ttl"].append(entry["ttl"])
            if "minor_version" in entry:
                result["entry.minorver"].append(entry["minor_version"])
            if "eventgroup" in entry:
                result["entry.eventgroupid"].append(int(entry["eventgroup"], 16))
        for option in sd["options"]:
            result["option.type"].append(option["type_value"])
            result["option.length"].append(option["length"])
            if "port" in option:
                result["option.port"].append(option["port"])
    return result


def compare(program, path):
    theirs = tshark(path)
    ours, faults = trestle(program, path)
    messages = 0
    for number in sorted(set(theirs) | set(ours)):
        if number not in theirs or number not in ours:
            faults.append(f"frame {number}: only {'we' if number in ours else 'tshark'} found SOME/IP")
            continue
        items, reference = ours[number], theirs[number]
        broken = [item for item in items if "payload" not in item]
        messages += len(items) - len(broken)

        def check(what, mine, other):
            if mine != other:
                faults.append(f"frame {number}: {what}: we say {mine}, tshark {other}")

        for name, field in HEADER:
            mine = [int(str(item[name]), 0) for item in items if name in item]
            other = numbers(reference[field])
            if broken:
                # After something broken the two may go on differently, but not before it and not about it.
                common = len(items) - len(broken)
                mine, other = mine[:common], other[:common]
            check(name, mine, other)
        complaint = reference["_ws.expert.message"]
        if not any(item.get("service") == "0xffff" for item in items):
            check("something broken", bool(broken), bool(COMPLAINT.search(complaint)))
        segments = [item for item in items if "tp" in item]
        check("TP offset", [item["tp"]["offset"] for item in segments], numbers(reference[TP[0]]))
        check("TP more", [int(item["tp"]["more_segments"]) for item in segments], numbers(reference[TP[1]]))
        if not any("error" in item for item in items):
            for field, mine in sd_numbers(items).items():
                check(field, mine, numbers(reference["someipsd." + field]))
            check("SD complaint", [], [c for c in re.findall("SOME/IP-SD [^!]*!", complaint) if c not in HARMLESS])
    return messages, faults


def wlan_copy(path, folder):
    """The Ethernet capture as one of 802.11 and Ethernet frames, by turns, with Per-Packet Information in front; nothing
    for one of another kind."""
    data = path.read_bytes()
    order = {b"\xd4\xc3\xb2\xa1": "<", b"\x4d\x3c\xb2\xa1": "<", b"\xa1\xb2\xc3\xd4": ">"}.get(data[:4])
    if order is None or struct.unpack_from(order + "I", data, 20)[0] != 1:
        return None
    copy = bytearray(data[:20] + struct.pack(order + "I", 192))
    at, number = 24, 0
    while at < len(data):
        seconds, fraction, size, wire_size = struct.unpack_from(order + "IIII", data, at)
        frame = data[at + 16:at + 16 + size]
        at, number = at + 16 + size, number + 1
        # A field of 802.11, "common": no flags, a rate and a channel.
        common = struct.pack("<HHQHHHHBBbb", 2, 20, 0, 0, 12, 2412, 0xa0, 0, 0, -40, -90)
        inner = frame
        if number % 2:
            wlan = b"\x88\x02" if number % 4 == 1 else b"\x08\x02"  # with and without quality of service
            inner = (wlan + b"\0\0" + frame[:6] + frame[6:12] + frame[6:12] + struct.pack("<H", number << 4 & 0xffff) +
                     (b"\0\0" if number % 4 == 1 else b"") + b"\xaa\xaa\x03\0\0\0" + frame[12:])
        header = struct.pack("<BBHI", 0, 0, 8 + len(common), 105 if number % 2 else 1) + common
        grown = len(header) + len(inner) - size
        copy += struct.pack(order + "IIII", seconds, fraction, size + grown, wire_size + grown) + header + inner
    made = pathlib.Path(folder) / ("wlan_" + path.name)
    made.write_bytes(copy)
    return made


def main():
    if shutil.which("tshark") is None:
        print("skipped: tshark is not installed")
        return 77
    program = sys.argv[1]
    folders = [sys.argv[2], os.environ.get("TRESTLE_SHARED_PCAPS", sys.argv[3])]
    captures = sorted(path for folder in folders if os.path.isdir(folder)
                      for path in pathlib.Path(folder).rglob("*.pcap*"))
    if not captures:
        print("no captures found")
        return 1
    made = tempfile.TemporaryDirectory()
    copies = [copy for path in pathlib.Path(folders[0]).rglob("*.pcap") if (copy := wlan_copy(path, made.name))]
    if not copies:
        print("no capture could be made into one of 802.11")
        return 1
    captures += copies
    failed = False
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for path, (messages, faults) in zip(captures, pool.map(lambda path: compare(program, path), captures)):
            print(f"{path.parent.name}/{path.name}: {messages} messages, {len(faults)} differences")
            for fault in faults[:20]:
                print("    " + fault)
            failed = failed or bool(faults) or messages == 0
    return 1 if failed else 0


sys.exit(main())
