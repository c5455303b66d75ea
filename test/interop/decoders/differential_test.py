#!/usr/bin/env python3
"""differential_test.py TRESTLE {tshark|scapy} [SEED]

Random datagrams, well formed and damaged, are decoded by `trestle decode` and by tshark or scapy: field for field
they must agree, and about what is broken. A disagreement fails the test unless a rule below tells, with the
requirement that says so, why we are right. The environment variable TRESTLE_SEED makes it other datagrams. Exit status
77: the other decoder is not there, which is a failure where TRESTLE_REQUIRE_PEERS is set.
"""
import collections
import ipaddress
import json
import logging
import os
import re
import shutil
import subprocess
import sys
import tempfile

sys.path[:0] = [(here := os.path.dirname(os.path.abspath(__file__))), os.path.dirname(here)]
from random_messages import Maker, write_pcap

WELL_FORMED, DAMAGED = 800, 1200

# What tshark says of messages that break no rule, each with the requirement that lets us accept them.
TSHARK_HARMLESS = {
    "SOME/IP Unknown Protocol Version!": "feat_req_someip_90: a decoder needs the header to answer it with an error",
    "SOME/IP-SD Unknown Option!": "feat_req_someipsd_1142: options of unknown type are ignored",
    "SOME/IP-SD Empty Entry Array!": "feat_req_someipsd_44: no rule asks for an entry",
    "SOME/IP-SD Offer Service references no endpoints!": "feat_req_someipsd_681: well formed; no client accepts it",
    # Said of NUL bytes and of bytes above 0x7f in the value of a configuration string.
    "Trailing stray characters": "feat_req_someipsd_162: only the key has to be printable, a value may hold any byte",
    "SOME/IP-SD Configuration String malformed!": "feat_req_someipsd_162: the same",
}
# What we call broken, and tshark takes without a word: the names of our errors.
TSHARK_SILENT = {
    "bad_tp_offset": "feat_req_someiptp_772: all segments but the last are multiples of 16 bytes",
    "bad_option_reference": "feat_req_someipsd_102: referenced options have to exist",
    "bad_value": "feat_req_someipsd_102: endpoints have a port, a known protocol and an address of their kind",
    "bad_entry_type": "feat_req_someipsd_46: of the types from 0 to 7 only 0, 1, 6 and 7 exist",
    "length near 2^32": "feat_req_someip_77: a Length beyond the datagram is wrong, also where adding 8 makes it 0",
    "entries shorter than one": "feat_req_someipsd_44: the entries array holds whole entries of 16 bytes",
    "load balancing option too long": "feat_req_someipsd_175: its length is 5",
    "no options length": "feat_req_someipsd_44: the length of the options array is no optional field",
    "not_sd": "feat_req_someipsd_26: SD messages have fixed versions and type",
}

HEADER = {"service": "someip.serviceid", "method": "someip.methodid", "length": "someip.length",
          "client": "someip.clientid", "session": "someip.sessionid", "protocol_version": "someip.protoversion",
          "interface_version": "someip.interfaceversion", "message_type_value": "someip.messagetype",
          "return_code_value": "someip.returncode"}
TP = {"offset": "someip.tp.offset", "reserved": "someip.tp.flags.reserved",
      "more_segments": "someip.tp.flags.more_segments"}
SD = ("flags", "reserved", "entry.type", "entry.index1", "entry.index2", "entry.numopt1", "entry.numopt2",
      "entry.serviceid", "entry.instanceid", "entry.majorver", "entry.ttl", "entry.minorver", "entry.counter",
      "entry.initialevents", "entry.eventgroupid", "option.type", "option.length", "option.ipv4address",
      "option.ipv6address", "option.proto", "option.port", "option.priority", "option.weight")


def number(value):
    return int(value, 0) if isinstance(value, str) else int(value)


class Comparison:
    """Decodes the datagrams with our program, and counts what differs."""

    def __init__(self, program, seed):
        self.seed = seed
        maker = Maker(seed)
        self.datagrams = [maker.datagram() for _ in range(WELL_FORMED)] + [maker.damaged() for _ in range(DAMAGED)]
        self.folder = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.folder.name, "random.pcap")
        write_pcap(self.path, self.datagrams)
        done = subprocess.run([program, "decode", self.path], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert done.returncode in (0, 1), done.stderr
        self.ours = collections.defaultdict(list)
        for line in done.stdout.splitlines():
            item = json.loads(line)
            self.ours[item["frame"]].append(item)
        self.differences = 0
        self.listed = collections.Counter()

    def differ(self, frame, what, mine, other):
        self.differences += 1
        if self.differences <= 20:
            print(f"seed {self.seed}, {self.datagrams[frame - 1].hex()}:\n"
                  f"    {what}: we say {mine}, they {other}")

    def check(self, frame, what, mine, other):
        if mine != other:
            self.differ(frame, what, mine, other)

    def well_formed(self):
        for frame in range(1, WELL_FORMED + 1):
            errors = [item["error"] for item in self.ours[frame] if "error" in item]
            self.check(frame, "a well-formed datagram has errors", errors, [])

    def finish(self):
        print(f"{len(self.datagrams)} datagrams, {self.differences} differences; listed ones: {dict(self.listed)}")
        return 1 if self.differences else 0


def readable(sd):
    """Whether its arrays could be read, and all entries are of known types."""
    return all(entry["type"] for entry in sd.get("entries", [{"type": None}]))


def sd_values(sd):
    """Our SD message in tshark's terms."""
    values = collections.defaultdict(list)
    values["flags"].append(sd["flags"]["value"])
    values["reserved"].append(sd["reserved"])
    for entry in sd["entries"]:
        values["entry.type"].append(entry["type_value"])
        for name, run in (("1", "first_run"), ("2", "second_run")):
            values["entry.index" + name].append(entry[run]["index"])
            values["entry.numopt" + name].append(entry[run]["count"])
        values["entry.serviceid"].append(number(entry["service"]))
        values["entry.instanceid"].append(number(entry["instance"]))
        values["entry.majorver"].append(entry["major_version"])
        values["entry.ttl"].append(entry["ttl"])
        if "eventgroup" in entry:
            values["entry.counter"].append(entry["counter"])
            values["entry.initialevents"].append(number(entry["initial_data_requested"]))
            values["entry.eventgroupid"].append(number(entry["eventgroup"]))
        else:
            values["entry.minorver"].append(entry["minor_version"])
    for option in sd["options"]:
        values["option.type"].append(option["type_value"])
        values["option.length"].append(option["length"])
        if "port" in option:
            address = ipaddress.ip_address(option["address"])
            values[f"option.ipv{address.version}address"].append(int(address))
            values["option.proto"].append(option["transport_value"])
            values["option.port"].append(option["port"])
        elif "priority" in option:
            values["option.priority"].append(option["priority"])
            values["option.weight"].append(option["weight"])
    return values


def error_name(item):
    """Our error's name, or a narrower one of TSHARK_SILENT."""
    name, length, sd = item["error"]["name"], item.get("length", 0), "sd" in item
    if name == "truncated" and length >= 0xfffffff8:
        return "length near 2^32"
    if name == "truncated" and sd and length >= 16:
        return "no options length"
    if name == "bad_entries_length" and 0 < int(item["payload"][8:16], 16) < 16:
        return "entries shorter than one"
    if name == "bad_option_length" and any(option["type_value"] == 0x02 and option["length"] > 5
                                           for option in item["sd"].get("options", ())):
        return "load balancing option too long"
    return name


def tshark_frames(path):
    names = ["frame.number", "_ws.expert.message", "someip.payload", *HEADER.values(), *TP.values(),
             *("someipsd." + name for name in SD), "someipsd.option.config_string"]
    command = ["tshark", "-r", path, "-o", "someip.reassemble_tp:FALSE", "-d", "udp.port==1-65535,someip", "-T", "fields",
               "-E", "separator=\t", "-E", "aggregator=^"]
    for name in names:
        command += ["-e", name]
    output = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True).stdout
    for line in output.decode("utf-8", "replace").split("\n"):
        values = line.split("\t")
        if len(values) == len(names):
            yield int(values[0]), {name: text.split("^") if text else [] for name, text in zip(names, values)}


def tshark_numbers(texts):
    numbers = []
    for text in texts:
        if text in ("True", "False"):
            numbers.append(int(text == "True"))
        elif re.fullmatch(r"[0-9.]*\.[0-9.]*|[0-9a-f:.]*:[0-9a-f:.]*", text):
            numbers.append(int(ipaddress.ip_address(text)))
        else:
            numbers.append(int(text, 0))
    return numbers


def compare_with_tshark(comparison):
    seen = 0
    for frame, theirs in tshark_frames(comparison.path):
        seen += 1
        items = comparison.ours[frame]
        whole = [item for item in items if "payload" in item]
        errors = [error_name(item) for item in items if "error" in item]
        for name, field in HEADER.items():
            # Behind the first thing that is no message the two may go on differently.
            other = tshark_numbers(theirs[field])
            comparison.check(frame, name, [number(item[name]) for item in whole],
                             other[:len(whole)] if len(whole) < len(items) else other)
        complaints = set(theirs["_ws.expert.message"])
        if not errors:
            # Bytes behind the options array mean nothing, and break nothing  (feat_req_someipsd_44).
            trailing = any("trailing" in item.get("sd", {}) for item in whole)
            harmless = {*TSHARK_HARMLESS, *(["SOME/IP-SD Option Array truncated!"] if trailing else [])}
            comparison.listed.update(complaints & harmless)
            complaints -= harmless
        silent = set(errors) & set(TSHARK_SILENT)
        comparison.listed.update(silent)
        if bool(errors) != bool(complaints) and not (errors and set(errors) == silent):
            comparison.differ(frame, "something is broken", errors, sorted(complaints))
        segments = [item["tp"] for item in whole if "tp" in item]
        for name, field in TP.items():
            other = tshark_numbers(theirs[field])
            comparison.check(frame, "TP " + name, [number(item[name]) for item in segments],
                             other[:len(segments)] if len(whole) < len(items) else other)
        # Broken for both: how much of it can still be told is everyone's own affair.
        unlike = {"not_sd", "load balancing option too long"} & set(errors)
        if errors and complaints or unlike or any(not readable(item["sd"]) for item in whole if "sd" in item):
            continue
        if not any("sd" in item or "tp" in item for item in whole):
            comparison.check(frame, "payload", [item["payload"] for item in whole if item["payload"]], theirs["someip.payload"])
        messages = [sd_values(item["sd"]) for item in whole if "sd" in item]
        for name in SD:
            comparison.check(frame, "SD " + name, [value for values in messages for value in values[name]],
                             tshark_numbers(theirs["someipsd." + name]))
    if seen != len(comparison.datagrams):
        comparison.differ(1, "datagrams", len(comparison.datagrams), seen)


# What scapy reads in another way, and why we read it in ours.
SCAPY_LISTED = {
    "TP flag of a reserved message type": "feat_req_someip_761: the flag is a bit of the type, whatever the others are",
    "options behind an unknown one": "feat_req_someipsd_133: each option tells its own length",
}


def compare_with_scapy(comparison, someip):
    from scapy_fields import method_of, offset_of, slice_of
    for frame, data in enumerate(comparison.datagrams, 1):
        for item in comparison.ours[frame]:
            # scapy fails at a segment that ends before its TP header does.
            if "payload" not in item or "tp" not in item and "error" in item and "sd" not in item:
                continue
            begin = item["offset"]
            whole = data[begin:begin + 8 + item["length"]]
            theirs = someip.SOMEIP(whole)
            comparison.check(
                frame, "header",
                [number(item[name]) for name in HEADER],
                [theirs.srv_id, method_of(theirs), theirs.len, theirs.client_id, theirs.session_id, theirs.proto_ver,
                 theirs.iface_ver, theirs.msg_type, theirs.retcode])
            if "tp" in item:
                tp = item["tp"]
                if not someip.SOMEIP._is_tp(theirs):
                    comparison.listed["TP flag of a reserved message type"] += 1
                    continue
                comparison.check(frame, "TP", [tp["offset"], tp["reserved"], number(tp["more_segments"])],
                                 [offset_of(theirs), theirs.res, theirs.more_seg])
                comparison.check(frame, "slice", item["payload"], slice_of(theirs).hex())
            elif "sd" in item and "error" not in item:
                # From the payload itself, since scapy builds its own layers only for what it knows.
                compare_sd_with_scapy(comparison, frame, item["sd"], someip.SD(whole[16:]))
            elif "sd" not in item and "error" not in item:
                comparison.check(frame, "payload", item["payload"], whole[16:].hex())


def compare_sd_with_scapy(comparison, frame, ours, theirs):
    comparison.check(frame, "SD flags", [ours["flags"]["value"], ours["reserved"]], [theirs.flags, theirs.res])

    def run(entry, name):
        return [entry[name]["index"], entry[name]["count"]]
    mine, other = [], []
    for entry in ours["entries"]:
        fields = [entry["type_value"], *run(entry, "first_run"), *run(entry, "second_run"), number(entry["service"]),
                  number(entry["instance"]), entry["major_version"], entry["ttl"]]
        fields += [entry["counter"], entry["initial_data_requested"], number(entry["eventgroup"])] \
            if "eventgroup" in entry else [entry["minor_version"]]
        mine.append(fields)
    for entry in theirs.entry_array:
        fields = [entry.type, entry.index_1, entry.n_opt_1, entry.index_2, entry.n_opt_2, entry.srv_id, entry.inst_id,
                  entry.major_ver, entry.ttl]
        # scapy knows the bit that asks for initial data as one of twelve reserved ones.
        fields += [entry.cnt, bool(entry.res & 8), entry.eventgroup_id] if hasattr(entry, "eventgroup_id") \
            else [entry.minor_ver]
        other.append(fields)
    comparison.check(frame, "SD entries", mine, other)
    mine, other = [], []
    for option, theirs_option in zip(ours["options"], theirs.option_array):
        if not hasattr(theirs_option, "type"):
            comparison.listed["options behind an unknown one"] += 1
            break
        fields = [option["length"], option["type_value"]]
        their_fields = [theirs_option.len, theirs_option.type]
        if "port" in option:
            fields += [ipaddress.ip_address(option["address"]), option["transport_value"], option["port"]]
            their_fields += [ipaddress.ip_address(theirs_option.addr), theirs_option.l4_proto, theirs_option.port]
        elif "priority" in option:
            fields += [option["priority"], option["weight"]]
            their_fields += [theirs_option.priority, theirs_option.weight]
        elif "items" in option:
            text = b"".join(bytes([len(item)]) + item for item in (
                (one["key"] + ("" if one["value"] is None else "=" + one["value"])).encode() for one in option["items"]))
            if "\ufffd" not in text.decode():  # not UTF-8: our output does not say what it was
                fields.append(text + b"\0")
                their_fields.append(theirs_option.cfg_str)
        mine.append(fields)
        other.append(their_fields)
    else:
        comparison.check(frame, "number of options", len(ours["options"]), len(theirs.option_array))
    comparison.check(frame, "SD options", mine, other)


def missing(what):
    wanted = os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")
    required = what in wanted or "1" in wanted
    print(f"{'missing' if required else 'skipped'}: {what} is not installed")
    return 1 if required else 77


def main():
    program, oracle = sys.argv[1:3]
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else int(os.environ.get("TRESTLE_SEED", "1"))
    if oracle == "tshark":
        if shutil.which("tshark") is None:
            return missing("tshark")
        comparison = Comparison(program, seed)
        comparison.well_formed()
        compare_with_tshark(comparison)
        return comparison.finish()
    try:
        logging.getLogger("scapy.runtime").setLevel(logging.ERROR)
        from scapy.contrib.automotive import someip
    except ImportError:
        return missing("scapy")
    comparison = Comparison(program, seed)
    compare_with_scapy(comparison, someip)
    return comparison.finish()


sys.exit(main())
