#!/usr/bin/env python3
"""Writes what ROS 2 itself makes of every interface that is installed: hashes and serialized messages.

  build/ros/bin/python test/interop/ros/golden.py FOLDER... > test/bridge/ros/golden.txt

Each line is a type: "TYPE HASH" for a service or an action, "TYPE HASH CDR JSON" for a message: the bytes that
rclpy.serialization makes of seeded random values with rosidl's type support, in hexadecimal, and these values. The
hashes stand in the JSON files beside the interfaces.

FOLDERs hold interfaces that are not installed, as PACKAGE/KIND/NAME.KIND. rosidl's generators make the type support of
these, and g++ a program of it (compiled.py).

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

from compiled import Package, serialized

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


def random_value(rng, kind, members_of):
    """As it stands in the JSON."""
    if isinstance(kind, idl.AbstractNestedType):
        if isinstance(kind, idl.Array):
            count = kind.size
        else:
            count = rng.randint(0, min(2, kind.maximum_size) if kind.has_maximum_size() else 2)
        return [random_value(rng, kind.value_type, members_of) for _ in range(count)]
    if isinstance(kind, idl.NamespacedType):
        return random_values(rng, '/'.join(kind.namespaced_name()), members_of)
    if isinstance(kind, idl.AbstractGenericString):
        return text(rng, kind)
    if kind.typename == 'boolean':
        return rng.random() < 0.5
    return rng.randrange(256) if kind.typename == 'octet' else number(rng, kind.typename)


def random_values(rng, name, members_of):
    """{member: value} of a message; a member that stands for nothing is 0 where a message comes from."""
    return {member: random_value(rng, kind, members_of) for member, kind in members_of(name)
            if member != 'structure_needs_at_least_one_member'}


def for_python(kind, value):
    """What the class of a message in Python takes for a value."""
    if isinstance(kind, idl.AbstractNestedType):
        return [for_python(kind.value_type, one) for one in value]
    if isinstance(kind, idl.NamespacedType):
        return message_with('/'.join(kind.namespaced_name()), value)
    return bytes([value]) if isinstance(kind, idl.BasicType) and kind.typename == 'octet' else value


def message_with(name, values):
    message = class_of(name)()
    for member, kind in installed_members(name):
        if member in values:
            setattr(message, member, for_python(kind, values[member]))
    return message


def installed_members(name):
    cls = class_of(name)
    return zip(cls.get_fields_and_field_types(), cls.SLOT_TYPES)


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
    idls = [convert_to_idl(package, package.name, file.relative_to(package), into)
            for kind in ('msg', 'srv', 'action') for file in sorted(package.glob(f'{kind}/*.{kind}'))]
    others = [*share.iterdir(), *work.iterdir()]
    arguments = {'package_name': package.name, 'output_dir': str(into),
                 'idl_tuples': [f'{into}:{file.relative_to(into)}' for file in idls],
                 'include_paths': [f'{other.name}:{other}' for other in others if other.is_dir()]}
    (into / 'arguments.json').write_text(json.dumps(arguments))
    return generate_type_hash(str(into / 'arguments.json'))


def hashes_of_folders(folders, share, work):
    """The hashes of packages that are not installed, whose IDL files are in `work` afterwards."""
    hashes = {}
    packages = [package for folder in folders for package in sorted(pathlib.Path(folder).resolve().iterdir())
                if package.is_dir() and not (share / package.name).exists()]
    for _ in range(len(packages) ** 2):  # a package that the first one uses may come later
        if not packages:
            break
        package = packages.pop(0)
        try:
            for file in hash_package(package, share, work):
                hashes.update(hashes_of(pathlib.Path(file)))
        except (FileNotFoundError, KeyError):
            packages.append(package)
    if packages:
        sys.exit(f'these use what is not there: {", ".join(package.name for package in packages)}')
    return hashes


def is_message(name):
    return name.split('/')[1] == 'msg' or name.rpartition('_')[2] in (
        'Request', 'Response', 'Event', 'Goal', 'Result', 'Feedback', 'FeedbackMessage')


def main():
    share = pathlib.Path(sys.prefix) / 'share'
    installed = {}
    for file in share.glob('*/*/*.json'):
        installed.update(hashes_of(file))
    with tempfile.TemporaryDirectory() as room, contextlib.redirect_stdout(sys.stderr):
        work = pathlib.Path(room)
        hashes = hashes_of_folders(sys.argv[1:], share, work) | installed
        packages = [Package(folder) for folder in sorted(work.iterdir())]
        members = {name: own for package in packages for name, own in package.members.items()}
        members_of = lambda name: members[name] if name in members else installed_members(name)
        values = {name: random_values(random.Random(name), name, members_of) for name in hashes if is_message(name)}
        samples = serialized(packages, {name: values[name] for name in members}, members_of, share)
    for name in sorted(hashes):
        if name in values:
            sample = samples.get(name) or serialize_message(message_with(name, values[name])).hex()
            print(name, hashes[name], sample, json.dumps(values[name], ensure_ascii=False, separators=(',', ':')))
        else:
            print(name, hashes[name])


if __name__ == '__main__':
    # New memory is filled with the complement, unless it comes from a thread's cache.
    zeros = {'MALLOC_PERTURB_': '255', 'GLIBC_TUNABLES': 'glibc.malloc.tcache_count=0'}
    if not zeros.items() <= os.environ.items():
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **zeros})
    main()
