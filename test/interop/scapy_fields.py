"""Fields of SOME/IP headers in scapy's words, which changed with 2.6.

Before, sub_id was the top bit of the Method ID and another field the rest, the offset of a segment was in units of 16
bytes, and its slice the payload. Since then sub_id is the whole, the offset in bytes, and the slice a field.
"""
from scapy.contrib.automotive.someip import SOMEIP

BEFORE_2_6 = any(field.name == "method_id" for field in SOMEIP.fields_desc)


def method_fields(method):
    if not BEFORE_2_6:
        return {"sub_id": method}
    return {"sub_id": method >> 15, "event_id" if method & 0x8000 else "method_id": method & 0x7fff}


def method_of(header):
    if not BEFORE_2_6:
        return header.sub_id
    return header.event_id | 0x8000 if header.sub_id else header.method_id


def tp_fields(offset, more, reserved=0):
    """`offset`: in bytes."""
    return {"offset": offset // 16 if BEFORE_2_6 else offset, "res": reserved, "more_seg": int(more)}


def offset_of(header):
    return int(header.offset * 16 if BEFORE_2_6 else header.offset)


def slice_of(header):
    return bytes(header.payload) if BEFORE_2_6 else b"".join(bytes(part) for part in [*header.data, header.payload])
