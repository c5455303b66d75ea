#!/usr/bin/env python3
"""Messages on both sides of mappings of fields, made without Trestle.

  map_oracle.py --write VECTORS        with the Python of `./run setup --peers`, which has rosbags
  map_oracle.py --check VECTORS PYTHON  whether that Python writes the same; skipped (77) where it is not there

The ROS side is serialised by rosbags, the SOME/IP side by struct, and the rules are arithmetic of Python. Each line is

  MAPPING to_ros|to_payload PAYLOAD CDR-LITTLE-ENDIAN CDR-BIG-ENDIAN SATURATED ROUNDED NOT-A-NUMBER

with the bytes in hexadecimal. map_vectors_test.cpp has the mappings.
"""
import math
import os
import pathlib
import random
import struct
import subprocess
import sys

STATUS = """
uint16 speed_raw
int16 yaw_raw
uint8 gear_raw
bool moving
uint32 time_ms
uint16[4] wheels
string text
uint8[] blob
float64[] samples
geometry_msgs/Point position
uint8 counter
uint16 checksum
"""
STATE = """
std_msgs/Header header
geometry_msgs/Twist twist
uint8 gear
int32 moving
float32[4] wheels
float64 front_left
string label
uint8[] data
float32[] samples
geometry_msgs/Point where
"""
RECEIVED = (1_700_000_123, 456_789_012)
GEARS = {0: 1, 1: 22, 2: 20, 7: 2}


def text_bytes(text):
    body = b'\xef\xbb\xbf' + text.encode() + b'\0'
    return struct.pack('>I', len(body)) + body


def status_bytes(s):
    """With Trestle's default wire rules: big endian, lengths of 32 bits, strings in UTF-8 with BOM and a zero."""
    return (struct.pack('>HhB?I4H', s['speed_raw'], s['yaw_raw'], s['gear_raw'], s['moving'], s['time_ms'], *s['wheels']) +
            text_bytes(s['text']) + struct.pack('>I', len(s['blob'])) + s['blob'] +
            struct.pack(f">I{len(s['samples'])}d", 8 * len(s['samples']), *s['samples']) +
            struct.pack('>3dBH', *s['position'], s['counter'], s['checksum']))


class Lost:
    def __init__(self):
        self.saturated = self.rounded = self.not_a_number = 0

    def whole(self, value, low, high):
        """The nearest whole number, halves away from zero."""
        if math.isnan(value):
            self.not_a_number += 1
            return 0
        if math.isinf(value) or not low <= (rounded := int(math.copysign(math.floor(abs(value) + 0.5), value))) <= high:
            self.saturated += 1
            return high if value > 0 else low
        if abs(rounded - value) > 1 / 64:
            self.rounded += 1
        return rounded

    def __str__(self):
        return f'{self.saturated} {self.rounded} {self.not_a_number}'


class Ros:
    """rosbags, with the types above."""

    def __init__(self):
        import numpy
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        self.numpy = numpy
        self.store = get_typestore(Stores.ROS2_JAZZY)
        self.store.register(get_types_from_msg(STATE, 'out_msgs/msg/State'))

    def make(self, name, **fields):
        return self.store.types[name](**fields)

    def array(self, values, kind):
        return self.numpy.array(values, dtype=kind)

    def both(self, message, name):
        return ' '.join(bytes(self.store.serialize_cdr(message, name, little_endian=little)).hex() for little in (True, False))

    def point(self, values):
        return self.make('geometry_msgs/msg/Point', x=values[0], y=values[1], z=values[2])

    def state(self, s):
        vector = lambda *v: self.make('geometry_msgs/msg/Vector3', x=v[0], y=v[1], z=v[2])
        stamp = self.make('builtin_interfaces/msg/Time', sec=s['stamp'][0], nanosec=s['stamp'][1])
        return self.make('out_msgs/msg/State', header=self.make('std_msgs/msg/Header', stamp=stamp, frame_id=s['frame_id']),
                         twist=self.make('geometry_msgs/msg/Twist', linear=vector(s['speed'], 0.0, 0.0),
                                         angular=vector(0.0, 0.0, s['yaw'])),
                         gear=s['gear'], moving=s['moving'], wheels=self.array(s['wheels'], 'float32'),
                         front_left=s['front_left'], label=s['label'], data=self.array(list(s['data']), 'uint8'),
                         samples=self.array(s['samples'], 'float32'), where=self.point(s['where']))


def random_text(rng):
    return ''.join(rng.choice('abcxyz ÄŽ€') for _ in range(rng.randrange(12)))


def single(value):
    """As a float32 has it."""
    return struct.unpack('<f', struct.pack('<f', value))[0]


def state_to_ros(rng):
    """A payload, and what it becomes."""
    status = {
        'speed_raw': rng.randrange(65536), 'yaw_raw': rng.randrange(-32768, 32768), 'gear_raw': rng.choice([0, 1, 2, 7, 9]),
        'moving': rng.random() < 0.5, 'time_ms': rng.randrange(1 << 32), 'wheels': [rng.randrange(65536) for _ in range(4)],
        'text': random_text(rng), 'blob': rng.randbytes(rng.randrange(10)),
        'samples': [rng.choice([rng.uniform(-1e6, 1e6), 1e300, -1e300]) for _ in range(rng.randrange(4))],
        'position': [rng.uniform(-100, 100) for _ in range(3)], 'counter': rng.randrange(256), 'checksum': rng.randrange(65536)}
    lost = Lost()
    largest = struct.unpack('<f', bytes.fromhex('ffff7f7f'))[0]

    def to_single(value):
        if abs(value) > largest:
            lost.saturated += 1
            return math.copysign(largest, value)
        return single(value)
    state = {
        'stamp': (status['time_ms'] // 1000, status['time_ms'] % 1000 * 1_000_000), 'frame_id': 'base_link',
        'speed': 0.01 * status['speed_raw'], 'yaw': -0.001 * status['yaw_raw'] + 0.5,
        'gear': GEARS.get(status['gear_raw'], 99), 'moving': int(status['moving']),
        'wheels': [single(0.05 * wheel - 10) for wheel in status['wheels']], 'front_left': float(status['wheels'][2]),
        'label': status['text'], 'data': status['blob'], 'samples': [to_single(value) for value in status['samples']],
        'where': status['position']}
    return status, state, lost


def state_to_payload(rng):
    """A message of ROS, and what it becomes."""
    state = {
        'stamp': (rng.randrange(4_000_000), rng.randrange(1_000_000_000)), 'frame_id': random_text(rng),
        'speed': rng.choice([rng.uniform(-10, 800), rng.uniform(0, 600), 12.34, math.nan, math.inf]),
        'yaw': rng.choice([rng.uniform(-30, 30), 1e9]), 'gear': rng.choice([1, 22, 20, 2]), 'moving': rng.choice([0, 1, 1, -5, 7]),
        'wheels': [single(rng.uniform(-20, 4000)) for _ in range(4)], 'front_left': rng.uniform(-1, 9), 'label': random_text(rng),
        'data': rng.randbytes(rng.randrange(10)), 'samples': [single(rng.uniform(-10, 10)) for _ in range(rng.randrange(4))],
        'where': [rng.uniform(-100, 100) for _ in range(3)]}
    lost = Lost()
    back = {ros: payload for payload, ros in GEARS.items()}
    if not 0 <= state['moving'] <= 1:
        lost.saturated += 1
    status = {
        'speed_raw': lost.whole(state['speed'] / 0.01, 0, 65535), 'yaw_raw': lost.whole((state['yaw'] - 0.5) / -0.001, -32768, 32767),
        'gear_raw': back[state['gear']], 'moving': state['moving'] > 0,
        'time_ms': state['stamp'][0] * 1000 + state['stamp'][1] // 1_000_000,
        'wheels': [lost.whole((wheel - -10) / 0.05, 0, 65535) for wheel in state['wheels']],
        'text': state['label'], 'blob': state['data'], 'samples': state['samples'], 'position': state['where'],
        'counter': 0, 'checksum': 0xabcd}
    return status, state, lost


def imu(ros, rng):
    """Elements of arrays, defaults, the time of receiving; the payload is {float32 rate[3]; float32 variance; uint8 quality}."""
    rate = [single(rng.uniform(-3, 3)) for _ in range(3)]
    variance = single(rng.uniform(0, 1))
    payload = struct.pack('>4fB', *rate, variance, rng.randrange(256))
    covariance = [0.0] * 9
    covariance[0] = covariance[4] = covariance[8] = float(variance)
    vector = lambda *v: ros.make('geometry_msgs/msg/Vector3', x=v[0], y=v[1], z=v[2])
    stamp = ros.make('builtin_interfaces/msg/Time', sec=RECEIVED[0], nanosec=RECEIVED[1])
    message = ros.make('sensor_msgs/msg/Imu', header=ros.make('std_msgs/msg/Header', stamp=stamp, frame_id=''),
                       orientation=ros.make('geometry_msgs/msg/Quaternion', x=0.0, y=0.0, z=0.0, w=1.0),
                       orientation_covariance=ros.array([-1.0] + [0.0] * 8, 'float64'), angular_velocity=vector(*map(float, rate)),
                       angular_velocity_covariance=ros.array(covariance, 'float64'), linear_acceleration=vector(0.0, 0.0, 0.0),
                       linear_acceleration_covariance=ros.array([0.0] * 9, 'float64'))
    return f'imu to_ros {payload.hex()} {ros.both(message, "sensor_msgs/msg/Imu")} 0 0 0'


def vectors():
    ros = Ros()
    rng = random.Random(29)
    for _ in range(20):
        for direction, make in (('to_ros', state_to_ros), ('to_payload', state_to_payload)):
            status, state, lost = make(rng)
            yield f'state {direction} {status_bytes(status).hex()} {ros.both(ros.state(state), "out_msgs/msg/State")} {lost}'
    for _ in range(5):
        yield imu(ros, rng)


def main():
    if sys.argv[1] == '--write':
        pathlib.Path(sys.argv[2]).write_text(''.join(line + '\n' for line in vectors()))
        return 0
    if sys.argv[1] == '--print':
        print('\n'.join(vectors()))
        return 0
    known, python = pathlib.Path(sys.argv[2]).read_text(), sys.argv[3]
    if not os.access(python, os.X_OK):
        print(f'Skipped: there is no {python} (./run setup --peers)')
        return 1 if os.environ.get('TRESTLE_REQUIRE_PEERS') else 77
    fresh = subprocess.run([python, '-B', __file__, '--print'], stdout=subprocess.PIPE, text=True, check=True, timeout=300).stdout
    if fresh != known:
        print(f'{sys.argv[2]} is not what rosbags writes; `map_oracle.py --write` makes it anew')
        return 1
    print('the vectors are what rosbags and struct write')
    return 0


if __name__ == '__main__':
    sys.exit(main())
