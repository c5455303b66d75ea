#!/usr/bin/env python3
"""ros_package_test.py CLASS PROGRAM SOURCE_FOLDER WORK_FOLDER CXX: Trestle as a package of ROS 2.

Installed configures as colcon does, and installs what is for ROS. Colcon has colcon itself build and install the core, as all of
Trestle takes long: it is in build/peers, from `./run setup --peers`, or in TRESTLE_PEERS.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest
import xml.etree.ElementTree

NAME, PROGRAM, SOURCE, WORK, CXX = sys.argv[1:6]
SOURCE, WORK = pathlib.Path(SOURCE), pathlib.Path(WORK, NAME.lower())
PEERS = pathlib.Path(os.environ.get("TRESTLE_PEERS") or SOURCE / "build/peers")

# Keys of rosdep for what CMake looks for. Threads and pcap's library come with others.
ROSDEP = {"Boost": "libboost-dev", "OpenSSL": "libssl-dev", "fmt": "fmt", "spdlog": "spdlog", "yaml-cpp": "yaml-cpp",
          "EXPAT": "libexpat1-dev", "tinyxml2": "tinyxml2", "CLI11": "cli11", "nlohmann_json": "nlohmann-json-dev",
          "fastcdr": "fastcdr", "fastrtps": "fastrtps", "fastdds": "fastdds", "tl-expected": "libexpected-dev"}
NOT_FOR_ROS = {"Threads", "GTest", "benchmark"}


def good(*command, **options):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}\nended with {done.returncode}:\n{done.stdout[-4000:]}")
    return done.stdout


def cached(build, name):
    return re.search(rf"(?m)^{name}:\w+=(.*)$", (build / "CMakeCache.txt").read_text())[1]


def configure(build, *settings, **environment):
    environment = {**os.environ, **environment}
    good("cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={CXX}", "-Wno-dev", *settings, env=environment)


def shell(shell_name, script):
    """What a shell, to which nobody has told of ROS before, prints."""
    clean = {name: value for name, value in os.environ.items() if name not in ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH")}
    return good(shell_name, "-c", script, env=clean).strip()


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        cls.build, cls.prefix = WORK / "build", WORK / "prefix"
        configure(cls.build, f"-DCMAKE_INSTALL_PREFIX={cls.prefix}", COLCON="1")
        good("cmake", "--install", cls.build, "--component", "ros")
        (cls.prefix / "bin").mkdir()
        shutil.copy(PROGRAM, cls.prefix / "bin/trestle")  # which is not built here

    def test_is_optimised_and_without_tests(self):
        self.assertEqual(cached(self.build, "CMAKE_BUILD_TYPE"), "Release")
        self.assertEqual(cached(self.build, "TRESTLE_TESTS"), "OFF")
        self.assertEqual(cached(self.build, "TRESTLE_ROS_PACKAGE"), "ON")

    def test_is_only_made_for_ros(self):
        environment = {name: value for name, value in os.environ.items() if name != "COLCON"}
        core = WORK / "core"
        good("cmake", "-S", SOURCE, "-B", core, "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={CXX}", "-DTRESTLE_CORE_ONLY=ON", "-Wno-dev",
             "-DTRESTLE_TESTS=OFF", env=environment)
        self.assertEqual(cached(core, "TRESTLE_ROS_PACKAGE"), "OFF")
        good("cmake", "--install", core, "--component", "ros", "--prefix", WORK / "none")
        self.assertFalse((WORK / "none").exists())

    def test_ros_finds_the_program_the_launch_file_and_the_package(self):
        self.assertEqual((self.prefix / "share/ament_index/resource_index/packages/trestle").read_text(), "")
        self.assertEqual(good(self.prefix / "lib/trestle/trestle", "--version"), good(PROGRAM, "--version"))
        self.assertFalse((self.prefix / "lib/trestle/trestle").readlink().is_absolute())
        self.assertEqual((self.prefix / "share/trestle/package.xml").read_bytes(), (SOURCE / "package.xml").read_bytes())
        launch = self.prefix / "share/trestle/launch/bridge.launch.py"
        compile(launch.read_text(), launch, "exec")

    def test_shells_learn_where_it_is(self):
        moved = WORK / "moved"
        shutil.copytree(self.prefix, moved, symlinks=True)
        for name in ("bash", "zsh"):
            if not shutil.which(name):
                continue
            with self.subTest(name):
                script = f". {moved}/share/trestle/local_setup.{name}; echo $AMENT_PREFIX_PATH"
                self.assertEqual(shell(name, script), str(moved))
                self.assertEqual(shell(name, f"export AMENT_PREFIX_PATH=/opt/ros/jazzy; {script}"), f"{moved}:/opt/ros/jazzy")
                self.assertEqual(shell(name, f"export AMENT_PREFIX_PATH=/a:{moved}; {script}"), f"/a:{moved}")
        # Another shell cannot know where the file is that it reads.
        self.assertEqual(shell("sh", f". {moved}/share/trestle/local_setup.sh; echo $AMENT_PREFIX_PATH"), str(self.prefix))
        self.assertEqual(shell("sh", f"COLCON_CURRENT_PREFIX={moved}; . {moved}/share/trestle/local_setup.sh; "
                               "echo $AMENT_PREFIX_PATH"), str(moved))

    def test_the_package_asks_for_what_cmake_looks_for(self):
        package = xml.etree.ElementTree.parse(SOURCE / "package.xml").getroot()
        version = re.search(r"project\(trestle VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text())[1]
        self.assertEqual(package.findtext("version"), version)
        asked = {one.text for tag in ("depend", "build_depend") for one in package.iter(tag)}
        text = "".join((SOURCE / name).read_text() for name in ("CMakeLists.txt", "cmake/TrestleDependencies.cmake"))
        looked_for = set(re.findall(r"find_package\(([\w-]+)", text)) - NOT_FOR_ROS
        self.assertEqual(asked, {ROSDEP[name] for name in looked_for} | {"libpcap"})


class Colcon(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        WORK.mkdir(parents=True)
        good(PEERS / "bin/colcon", "--log-base", WORK / "log", "build", "--base-paths", SOURCE, "--cmake-args", "-G Ninja",
             f"-DCMAKE_CXX_COMPILER={CXX}", "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache", "-DCMAKE_BUILD_TYPE=Debug",
             "-DCMAKE_CXX_FLAGS_DEBUG=-O0", "-DCMAKE_UNITY_BUILD=ON", "-DTRESTLE_CORE_ONLY=ON", cwd=WORK,
             env={**os.environ, "MAKEFLAGS": f"-j{os.cpu_count()}"})  # else it waits until nobody else computes
        cls.prefix = WORK / "install/trestle"

    def test_takes_all_as_one_package(self):
        self.assertEqual([path.name for path in (WORK / "build").iterdir() if path.is_dir()], ["trestle"])
        self.assertTrue((self.prefix / "lib/libtrestle_device.a").exists())
        # The core has no program to run.
        self.assertFalse((self.prefix / "lib/trestle").exists())

    def test_a_workspace_finds_it(self):
        for name in ("bash", "sh"):
            with self.subTest(name):
                script = f". {WORK}/install/setup.{name}; echo $AMENT_PREFIX_PATH; echo $CMAKE_PREFIX_PATH"
                self.assertEqual(shell(name, script).splitlines(), [str(self.prefix)] * 2)

    def test_the_package_is_one_for_catkin_pkg(self):
        told = good(PEERS / "bin/python", "-B", "-c", f"""
import os
from catkin_pkg.package import parse_package
for distro in ('humble', 'jazzy', 'kilted', 'rolling'):
    package = parse_package({str(SOURCE / 'package.xml')!r}, warnings=[])
    package.evaluate_conditions({{'ROS_DISTRO': distro}})
    print(distro, [one.name for one in package.build_depends if one.evaluated_condition and 'dds' in one.name or 'rtps' in one.name
                   and one.evaluated_condition])
""")
        self.assertEqual(told, "humble ['fastrtps']\njazzy ['fastrtps']\nkilted ['fastdds']\nrolling ['fastdds']\n")


if __name__ == "__main__":
    if NAME == "Colcon" and not (PEERS / "bin/colcon").exists():
        required = {"1", "colcon"} & set(os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(","))
        print(f"{'missing' if required else 'skipped'}: colcon; ./run setup --peers installs it")
        sys.exit(1 if required else 77)
    unittest.main(argv=[sys.argv[0], NAME, *sys.argv[6:]])
