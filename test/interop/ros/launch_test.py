#!/usr/bin/env python3
"""launch_test.py TRESTLE: the launch file of the ROS package, run by ROS 2's `launch`, beside a node of rclpy.

PyPI has no wheel of `launch`: without one in PYTHONPATH (/opt/ros has it) this is skipped, as without ROS 2.
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parents[2]
os.environ["TRESTLE_PEERS"] = os.environ.get("TRESTLE_ROS") or str(SOURCE / "build/ros")
sys.path.insert(0, str(HERE.parent / "python"))
import peer  # noqa: E402  goes on with the Python of TRESTLE_PEERS

try:
    import ament_index_python  # noqa: F401
    import rclpy
    from geometry_msgs.msg import Point
    from rclpy.executors import SingleThreadedExecutor
except ImportError:
    peer.missing("ros")
try:
    import launch  # noqa: F401
except ImportError:
    print("skipped: there is no `launch` of ROS 2; set PYTHONPATH to one")
    sys.exit(77)

PROGRAM = sys.argv.pop(1)
PATIENCE = 60  # seconds; running into it is a failure

# What `ros2 launch` does with a file and its arguments.
RUN = """
import json, sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
service = LaunchService()
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    PythonLaunchDescriptionSource(sys.argv[1]), launch_arguments=json.loads(sys.argv[2]).items())]))
sys.exit(service.run())
"""
# A launch file of somebody else, with what docs/ros.md shows.
COMPOSED = """
import pathlib
import signal
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import EmitEvent, IncludeLaunchDescription, RegisterEventHandler
from launch.event_handlers import OnProcessIO
from launch.events.process import SignalProcess, matches_name
from launch.launch_description_sources import PythonLaunchDescriptionSource

THERE = pathlib.Path(get_package_share_directory("trestle"), "launch/bridge.launch.py")
HERE = pathlib.Path(__file__).parent
reloaded = set()


def reload_once(event):
    if b"carrying" not in event.text or event.process_name in reloaded:
        return None
    reloaded.add(event.process_name)
    return EmitEvent(event=SignalProcess(signal_number=signal.SIGHUP, process_matcher=matches_name(event.process_name)))


def generate_launch_description():
    return LaunchDescription([
        RegisterEventHandler(OnProcessIO(on_stderr=reload_once)),
        *(IncludeLaunchDescription(PythonLaunchDescriptionSource(str(THERE)),
                                   launch_arguments={"config": str(HERE / file), "name": file[:-5]}.items())
          for file in ("bridge_a.yaml", "bridge_b.yaml")),
    ])
"""


class Launch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.prefix = pathlib.Path(folder.name)
        # A prefix as `cmake --install` makes it; ros_package_test.py tells that it does.
        packages = cls.prefix / "share/ament_index/resource_index/packages"
        for path in (packages, cls.prefix / "lib/trestle", cls.prefix / "share/trestle"):
            path.mkdir(parents=True)
        (packages / "trestle").touch()
        (cls.prefix / "lib/trestle/trestle").symlink_to(PROGRAM)
        (cls.prefix / "share/trestle/launch").symlink_to(SOURCE / "packaging/ros/launch")
        os.environ["AMENT_PREFIX_PATH"] = f"{cls.prefix}:{os.environ.get('AMENT_PREFIX_PATH', '')}"
        os.environ["ROS_HOME"] = str(cls.prefix / "home")

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def launch(self, file=None, **arguments):
        file = file or self.prefix / "share/trestle/launch/bridge.launch.py"
        self.log = open(self.folder / "log", "w+")
        self.addCleanup(self.log.close)
        self.process = subprocess.Popen([*peer.DIES_WITH_US, sys.executable, "-B", "-c", RUN, str(file), json.dumps(arguments)],
                                        stdout=self.log, stderr=subprocess.STDOUT)
        self.addCleanup(self.stop)

    def stop(self):
        """Ctrl-C of the launch; its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.process.wait(PATIENCE)

    def text(self):
        return (self.folder / "log").read_text()

    def wait_for(self, condition):
        end = time.monotonic() + PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), end, self.text())
            time.sleep(0.05)

    def config(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return str(path)

    def bridges(self):
        """The processes of bridges that this launch started."""
        children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return [int(pid) for pid in children if b"\0bridge\0" in pathlib.Path(f"/proc/{pid}/cmdline").read_bytes()]

    def simple(self):
        return self.config("simple.yaml", "someip: {address: 127.0.0.1}\ndds: {domain: 3}\nroutes:\n  - {topic: /target, "
                           "type: geometry_msgs/msg/Point, direction: someip_to_dds, service: 0x2222, instance: 1, "
                           "eventgroup: 1, event: 0x8001}\n")

    def test_two_bridges_of_anothers_launch_file_carry_reload_and_stop(self):
        for name in ("bridge_a.yaml", "bridge_b.yaml"):
            (self.folder / name).symlink_to(SOURCE / "examples" / name)
        self.launch(self.config("car.launch.py", COMPOSED))
        nodes = []
        for domain in (0, 1):
            context = rclpy.Context()
            rclpy.init(context=context, domain_id=domain)
            self.addCleanup(rclpy.shutdown, context=context)
            node = rclpy.create_node(f"node{domain}", context=context)
            executor = SingleThreadedExecutor(context=context)
            executor.add_node(node)
            nodes.append((node, executor))
        (there, spin_there), (here, spin_here) = nodes
        got = []
        subscription = there.create_subscription(Point, "/target", got.append, 10)
        publisher = here.create_publisher(Point, "/target", 10)

        def arrives():
            publisher.publish(Point(x=1.5, y=-2.0, z=3.25))
            spin_here.spin_once(timeout_sec=0.05)
            spin_there.spin_once(timeout_sec=0.05)
            return got
        self.wait_for(lambda: self.text().count("was read again") == 2)
        got.clear()
        self.wait_for(arrives)
        self.assertEqual((got[0].x, got[0].y, got[0].z), (1.5, -2.0, 3.25))
        self.assertLessEqual({"/points", "/target"}, {name for name, _ in there.get_topic_names_and_types()})
        there.destroy_subscription(subscription)
        self.assertEqual(self.stop(), 0, self.text())
        self.assertEqual(self.text().count("has finished cleanly"), 2, self.text())

    def test_a_bridge_that_fails_is_started_again(self):
        self.launch(config=self.simple(), respawn_delay="0.1", quiet="true", console="127.0.0.1:9477")
        self.wait_for(self.bridges)
        [first] = self.bridges()
        self.assertEqual(pathlib.Path(f"/proc/{first}/cmdline").read_text().split("\0")[1:5],
                         ["bridge", "--console", "127.0.0.1:9477", "--quiet"])
        os.kill(first, signal.SIGKILL)
        self.wait_for(lambda: [pid for pid in self.bridges() if pid != first])
        self.assertEqual(self.stop(), 0, self.text())

    def test_or_is_not_when_it_shall_not(self):
        self.launch(config=self.simple(), respawn="false")
        self.wait_for(self.bridges)
        os.kill(self.bridges()[0], signal.SIGKILL)
        self.assertEqual(self.process.wait(PATIENCE), 0, self.text())
        self.assertNotIn("started again", self.text())

    def test_a_wrong_configuration_is_not_tried_again(self):
        self.launch(config=self.config("wrong.yaml", "someip: {adress: 127.0.0.1}\n"), respawn_delay="0.1")
        self.assertEqual(self.process.wait(PATIENCE), 0, self.text())
        self.assertIn("wrong.yaml:1:10", self.text())
        self.assertEqual(self.text().count("process started"), 1, self.text())

    def test_a_wrong_argument_is_named(self):
        self.launch(config=self.simple(), quiet="yes")
        self.assertNotEqual(self.process.wait(PATIENCE), 0)
        self.assertIn("quiet:=yes: it is true or false", self.text())


if __name__ == "__main__":
    unittest.main()
