#!/usr/bin/env python3
"""Writes test vectors for the conversion between CDR and SOME/IP payloads.

An implementation of its own of .msg files, CDR (XCDR1) and SOME/IP serialisation: short and slow, sharing
nothing with bridge/messages/convert, so that a misunderstanding would have to be made twice.

  oracle.py FOLDER... [--seed N] [--values N] [--all-profiles] [--json]

FOLDERs hold <package>/msg/<Type>.msg. Each line of the output is one vector:

  TYPE PROFILE CDR-LITTLE-ENDIAN CDR-BIG-ENDIAN SOMEIP-PAYLOAD        (the bytes in hexadecimal)

With --json, the message's values in JSON follow. PROFILE names wire rules that the tests know too
(test/bridge/messages/convert/profiles.hpp).
"""
import argparse
import json
import math
import pathlib
import random
import re
import struct

NUMBERS = {'bool': '?', 'byte': 'B', 'char': 'B', 'int8': 'b', 'uint8': 'B', 'int16': 'h', 'uint16': 'H', 'int32': 'i',
           'uint32': 'I', 'int64': 'q', 'uint64': 'Q', 'float32': 'f', 'float64': 'd'}
FIELD = re.compile(r'([\w/]+)(?:<=(\d+))?(\[(<=)?(\d*)\])?\s+(\w+)\s*(=)?')

DEFAULT = dict(big=True, length_big=True, array=4, fixed=0, string=4, struct=0, encoding='utf-8', bom=True, zero=True,
               align=1, by_field=False)
# 'by_field': of the first, second, third, fourth … field of each message, and of the elements of arrays.
BY_FIELD = [{}, dict(array=2, fixed=2, string=2, struct=2),
            dict(array=4, fixed=0, string=1, struct=4, encoding='utf-16-be', bom=False)]
PROFILES = {
    'commonapi': {},
    'autosar': dict(struct=4, fixed=4),
    'commonapi_little': dict(big=False, length_big=False),
    'little': dict(big=False, struct=2),
    'short': dict(array=2, string=2, struct=2, fixed=2),
    'legacy_strings': dict(bom=False, zero=False, string=1),
    'utf16le': dict(encoding='utf-16-le'),
    'utf16be_plain': dict(encoding='utf-16-be', bom=False),
    'aligned4': dict(align=4),
    'aligned32': dict(align=32, big=False, struct=4),
    'by_field': dict(by_field=True),
}


def load(folders):
    """{'pkg/msg/Type': [(name, type, string bound, array kind, array size)]}"""
    types = {}
    for folder in folders:
        for file in sorted(pathlib.Path(folder).glob('*/msg/*.msg')):
            package = file.parts[-3]
            fields = []
            for line in file.read_text().splitlines():
                match = FIELD.match(line.split('#')[0].strip())
                if not match or match[7]:
                    continue
                base = match[1]
                if base not in NUMBERS and base not in ('string', 'wstring'):
                    parts = base.split('/')
                    base = f'{parts[0] if len(parts) > 1 else package}/msg/{parts[-1]}'
                kind = None if not match[3] else 'bounded' if match[4] else 'fixed' if match[5] else 'unbounded'
                fields.append((match[6], base, int(match[2] or 0), kind, int(match[5] or 0)))
            if not fields:
                fields = [('structure_needs_at_least_one_member', 'uint8', 0, None, 0)]
            types[f'{package}/msg/{file.stem}'] = fields
    return types


def value_of(rng, types, base, bound, kind, size):
    if kind:
        count = size if kind == 'fixed' else rng.randint(0, min(3, size) if kind == 'bounded' else 3)
        return [value_of(rng, types, base, bound, None, 0) for _ in range(count)]
    if base == 'bool':
        return rng.random() < 0.5
    if base in NUMBERS:  # any bit pattern but NaN, which Python may change
        width = struct.calcsize(NUMBERS[base])
        value = struct.unpack('<' + NUMBERS[base], rng.randbytes(width))[0]
        return value if value == value else 0.5
    if base in ('string', 'wstring'):
        alphabet = 'abcxyz_ /\u00e4\u20ac' + ('\U0001f600' if base == 'string' else '')
        text = ''.join(rng.choice(alphabet) for _ in range(rng.randint(0, 9)))
        width = (lambda t: len(t.encode())) if base == 'string' else len
        while bound and width(text) > bound:
            text = text[:-1]
        return text
    return [value_of(rng, types, *field[1:]) for field in types[base]]


class Cdr:
    def __init__(self, types, order):
        self.types, self.order, self.out = types, order, bytearray()

    def number(self, code, value):
        width = struct.calcsize(code)
        self.out += b'\0' * (-len(self.out) % width) + struct.pack(self.order + code, value)

    def put(self, value, base, kind):
        if kind:
            if kind != 'fixed':
                self.number('I', len(value))
            for one in value:
                self.put(one, base, None)
        elif base in NUMBERS:
            self.number(NUMBERS[base], value)
        elif base == 'string':
            self.number('I', len(value.encode()) + 1)
            self.out += value.encode() + b'\0'
        elif base == 'wstring':
            self.number('I', len(value))
            for unit in value:
                self.number('I', ord(unit))
        else:
            for one, field in zip(value, self.types[base]):
                self.put(one, field[1], field[3])


def cdr(types, name, value, order):
    out = Cdr(types, order)
    out.put(value, name, None)
    return (b'\0\1\0\0' if order == '<' else b'\0\0\0\0') + bytes(out.out)


class Someip:
    """Works on one bytearray that begins with a stand-in for the 16 byte header: alignment counts from there."""

    def __init__(self, types, rules):
        self.types, self.rules, self.out = types, rules, bytearray(16)
        self.order = '>' if rules['big'] else '<'
        self.length_order = 'big' if rules['big'] or rules['length_big'] else 'little'

    def measured(self, width, write):
        at = len(self.out)
        self.out += bytes(width)
        write()
        if width:
            self.out[at:at + width] = (len(self.out) - at - width).to_bytes(width, self.length_order)

    def pad(self):
        self.out += b'\0' * (-len(self.out) % self.rules['align'])

    def text(self, text, wide):
        encoding = self.rules['encoding']
        if wide and encoding == 'utf-8':
            encoding = 'utf-16-be'
        if self.rules['bom']:
            text = '\ufeff' + text
        if self.rules['zero']:
            text += '\0'
        self.out += text.encode(encoding)

    def put(self, value, base, kind):
        if kind:
            def elements():
                for one in value:
                    self.put(one, base, None)
            self.measured(self.rules['fixed' if kind == 'fixed' else 'array'], elements)
            if kind != 'fixed':
                self.pad()
        elif base in NUMBERS:
            self.out += struct.pack(self.order + NUMBERS[base], value)
        elif base in ('string', 'wstring'):
            self.measured(self.rules['string'], lambda: self.text(value, base == 'wstring'))
            self.pad()
        else:
            def members():
                outer = self.rules
                for index, (one, field) in enumerate(zip(value, self.types[base])):
                    if outer['by_field']:
                        self.rules = DEFAULT | dict(by_field=True) | BY_FIELD[index % 3]
                    self.put(one, field[1], field[3])
                self.rules = outer
            self.measured(self.rules['struct'], members)


def someip(types, name, value, rules):
    out = Someip(types, rules)
    out.put(value, name, None)
    return bytes(out.out[16:])


def named(types, value, base, kind):
    """The value with the names of its fields, as JSON can say it."""
    if kind:
        return [named(types, one, base, None) for one in value]
    if isinstance(value, float) and math.isinf(value):
        return 'Infinity' if value > 0 else '-Infinity'
    if not isinstance(value, list):
        return value
    return {field[0]: named(types, one, field[1], field[3]) for one, field in zip(value, types[base])
            if field[0] != 'structure_needs_at_least_one_member'}


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument('folders', nargs='+')
    arguments.add_argument('--seed', type=int, default=1)
    arguments.add_argument('--values', type=int, default=1)
    arguments.add_argument('--all-profiles', action='store_true')
    arguments.add_argument('--json', action='store_true')
    options = arguments.parse_args()
    types = load(options.folders)
    rng = random.Random(options.seed)
    others = list(PROFILES)[1:]
    for index, name in enumerate(sorted(types)):
        for _ in range(options.values):
            value = value_of(rng, types, name, 0, None, 0)
            chosen = list(PROFILES) if options.all_profiles else ['commonapi', others[index % len(others)]]
            for profile in chosen:
                payload = someip(types, name, value, DEFAULT | PROFILES[profile])
                print(name, profile, cdr(types, name, value, '<').hex(), cdr(types, name, value, '>').hex(),
                      payload.hex(), *([json.dumps(named(types, value, name, None))] if options.json else []))


if __name__ == '__main__':
    main()
