"""Stands in for ros2cli in what docs/tutorial.md uses of it: `topic list`, `topic echo --once TOPIC`, and `service call NAME TYPE
YAML`. It is a node of rclpy, and prints as ros2cli does."""
import importlib
import sys
import time

import rclpy
import yaml
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

PATIENCE = 30  # seconds


def class_of(name):
    package, kind, one = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), one)


def until(node, condition, what):
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        if time.monotonic() > end:
            sys.exit(what)
        rclpy.spin_once(node, timeout_sec=0.1)
    return found


def set_values(message, values):
    for name, value in values.items():
        if isinstance(value, dict):
            set_values(getattr(message, name), value)
        else:
            setattr(message, name, value)


def topics(node):
    return sorted(name for name, _ in node.get_topic_names_and_types() if node.count_publishers(name))


def types_of(node, topic):
    return dict(node.get_topic_names_and_types()).get(topic)


def publishers(node, topic):
    return node.get_publishers_info_by_topic(topic)


def echo(node, topic):
    """As the publishers offer it, which ros2cli asks for, too."""
    name = until(node, lambda: types_of(node, topic), f"WARNING: topic [{topic}] does not appear to be published yet")[0]
    kind = class_of(name)
    offered = until(node, lambda: publishers(node, topic), "nobody publishes it")[0].qos_profile
    qos = QoSProfile(depth=1, reliability=offered.reliability, durability=offered.durability)
    assert qos.reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT)
    assert qos.durability in (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL)
    got = []
    node.create_subscription(kind, topic, got.append, qos)
    message = until(node, lambda: got, "nothing comes")[0]
    for member in kind.get_fields_and_field_types():
        print(f"{member}: {getattr(message, member)}")
    print("---")


def call(node, service, name, values):
    kind = class_of(name)
    client = node.create_client(kind, service)
    until(node, client.service_is_ready, "the service is not there")
    request = kind.Request()
    set_values(request, yaml.safe_load(values))
    print(f"requester: making request: {request!r}\n")
    future = client.call_async(request)
    until(node, future.done, "no answer")
    print(f"response:\n{future.result()!r}\n")


def main():
    rclpy.init()
    node = rclpy.create_node("_ros2cli")
    match sys.argv[1:]:
        case ["topic", "list"]:
            until(node, lambda: len(topics(node)) > 2, "there is nothing")
            print("\n".join(topics(node)))
        case ["topic", "echo", "--once", topic]:
            echo(node, topic)
        case ["service", "call", service, name, values]:
            call(node, service, name, values)
        case _:
            sys.exit(f"ros2.py does not know: {sys.argv[1:]}")


if __name__ == "__main__":
    main()
