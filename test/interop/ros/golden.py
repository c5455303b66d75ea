#!/usr/bin/env python3
"""Writes what ROS 2 itself makes of every interface that is installed: hashes and serialized messages.

  build/ros/bin/python test/interop/ros/golden.py FOLDER... > test/bridge/ros/golden.txt

Each line is a type: "TYPE HASH" for a service or an action, "TYPE HASH CDR JSON" for a message: the bytes that
rclpy.serialization makes of seeded random values with rosidl's type support, in hexadecimal, and these values. The
hashes stand in the JSON files beside the interfaces.

FOLDERs hold interfaces that are not installed, as PACKAGE/KIND/NAME.KIND. There is no type support for these, so they
get "TYPE HASH", which rosidl's generator makes.

rosidl leaves the gaps before aligned numbers as they were in memory. So that the bytes are the same each time, glibc is
told to give out memory full of zeros.
"""
import contextlib
import importlib
import json
import os
import pathlib
import random
import struct
import sys
import tempfile

from rclpy.serialization import serialize_message
from rosidl_adapter import convert_to_idl
from rosidl_generator_type_description import generate_type_hash
from rosidl_parser import definition as idl

WIDTHS = {'int8': 'b', 'uint8': 'B', 'int16': 'h', 'uint16': 'H', 'int32': 'i', 'uint32': 'I', 'int64': 'q',
          'uint64': 'Q', 'float': 'f', 'double': 'd'}
ALPHABET = 'abcxyz_ /\u00e4\u20ac\U0001f600'


def number(rng, name):
    while True:  # any bit pattern, but NaN and infinities, which JSON does not know
        value = struct.unpack('<' + WIDTHS[name], rng.randbytes(struct.calcsize(WIDTHS[name])))[0]
        if isinstance(value, int) or abs(value) <= (3.4e38 if name == 'float' else 1.7e308):
            return value


def text(rng, kind):
    value = ''.join(rng.choice(ALPHABET) for _ in range(rng.randint(0, 7)))
    if isinstance(kind, idl.AbstractWString):
        width = lambda one: len(one.encode('utf-16-le')) // 2
    else:
        width = lambda one: len(one.encode())
    while kind.has_maximum_size() and width(value) > kind.maximum_size:
        value = value[:-1]
    return value


def random_value(rng, kind):
    """(what the Python class takes, what stands in the JSON)"""
    if isinstance(kind, idl.AbstractNestedType):
        if isinstance(kind, idl.Array):
            count = kind.size
        else:
            count = rng.randint(0, min(2, kind.maximum_size) if kind.has_maximum_size() else 2)
        values = [random_value(rng, kind.value_type) for _ in range(count)]
        return [one for one, _ in values], [one for _, one in values]
    if isinstance(kind, idl.NamespacedType):
        module = importlib.import_module('.'.join(kind.namespaces))
        name = kind.name
        for suffix in ('_Goal', '_Result', '_Feedback', '_Request', '_Response'):
            if kind.namespaces[1] != 'msg' and name.endswith(suffix):
                return random_message(rng, part_of(module, name[:-len(suffix)], suffix[1:]))
        return random_message(rng, getattr(module, name))
    if isinstance(kind, idl.AbstractGenericString):
        value = text(rng, kind)
        return value, value
    if kind.typename == 'boolean':
        value = rng.random() < 0.5
        return value, value
    if kind.typename == 'octet':
        value = rng.randrange(256)
        return bytes([value]), value
    value = number(rng, kind.typename)
    return value, value


def random_message(rng, cls):
    message, values = cls(), {}
    for slot, kind in zip(cls.get_fields_and_field_types(), cls.SLOT_TYPES):
        if slot == 'structure_needs_at_least_one_member':
            continue  # stands for nothing; it is 0 where a message comes from
        value, values[slot] = random_value(rng, kind)
        setattr(message, slot, value)
    return message, values


def part_of(module, name, part):
    """The class of X_Request, X_Goal, X_SendGoal_Request ..., which Python has as members."""
    for service, member in (('_SendGoal', 'SendGoalService'), ('_GetResult', 'GetResultService')):
        if name.endswith(service):
            return getattr(getattr(getattr(module, name[:-len(service)]).Impl, member), part)
    owner = getattr(module, name)
    return getattr(owner, part) if hasattr(owner, part) else getattr(owner.Impl, part)


def class_of(name):
    package, kind, type_name = name.split('/')
    module = importlib.import_module(f'{package}.{kind}')
    if kind == 'msg':
        return getattr(module, type_name)
    owner, _, part = type_name.rpartition('_')
    return part_of(module, owner, part) if owner else None


def hashes_of(file):
    return {entry['type_name']: entry['hash_string'] for entry in json.loads(file.read_text()).get('type_hashes', [])}


def hash_package(package, share, work):
    """Has rosidl translate a package and hash its types, which takes those of the packages it uses."""
    into = work / package.name
    idls = [convert_to_idl(package, package.name, file.relative_to(package), into / file.parent.name)
            for kind in ('msg', 'srv', 'action') for file in sorted(package.glob(f'{kind}/*.{kind}'))]
    others = [*share.iterdir(), *work.iterdir()]
    arguments = {'package_name': package.name, 'output_dir': str(into),
                 'idl_tuples': [f'{into}:{file.relative_to(into)}' for file in idls],
                 'include_paths': [f'{other.name}:{other}' for other in others if other.is_dir()]}
    (into / 'arguments.json').write_text(json.dumps(arguments))
    return generate_type_hash(str(into / 'arguments.json'))


def hashes_of_folders(folders, share):
    hashes = {}
    packages = [package for folder in folders for package in sorted(pathlib.Path(folder).resolve().iterdir())
                if not (share / package.name).exists()]
    with tempfile.TemporaryDirectory() as work, contextlib.redirect_stdout(sys.stderr):
        for _ in range(len(packages) ** 2):  # a package that the first one uses may come later
            if not packages:
                break
            package = packages.pop(0)
            try:
                for file in hash_package(package, share, pathlib.Path(work)):
                    hashes.update(hashes_of(pathlib.Path(file)))
            except (FileNotFoundError, KeyError):
                packages.append(package)
    if packages:
        sys.exit(f'these use what is not there: {", ".join(package.name for package in packages)}')
    return hashes


def main():
    share = pathlib.Path(sys.prefix) / 'share'
    installed = {}
    for file in share.glob('*/*/*.json'):
        installed.update(hashes_of(file))
    hashes = hashes_of_folders(sys.argv[1:], share) | installed
    for name in sorted(hashes):
        kind = name.split('/')[1]
        last = name.rpartition('_')[2]
        is_message = kind == 'msg' or last in ('Request', 'Response', 'Event', 'Goal', 'Result', 'Feedback',
                                               'FeedbackMessage')
        if not is_message or name not in installed:
            print(name, hashes[name])
            continue
        message, values = random_message(random.Random(name), class_of(name))
        print(name, hashes[name], serialize_message(message).hex(),
              json.dumps(values, ensure_ascii=False, separators=(',', ':')))


if __name__ == '__main__':
    # New memory is filled with the complement, unless it comes from a thread's cache.
    zeros = {'MALLOC_PERTURB_': '255', 'GLIBC_TUNABLES': 'glibc.malloc.tcache_count=0'}
    if not zeros.items() <= os.environ.items():
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **zeros})
    main()
