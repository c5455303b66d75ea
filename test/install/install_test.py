#!/usr/bin/env python3
"""What `cmake --install` puts down, used as others do.

Usage: install_test.py CLASS BUILD_FOLDER SOURCE_FOLDER WORK_FOLDER CXX

The class Whole fills WORK_FOLDER/prefix. WithoutDds builds and installs a Trestle of its own; the others use that prefix.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

NAME, BUILD, SOURCE, WORK, CXX = (sys.argv.pop(1) for _ in range(5))
BUILD, SOURCE, WORK = pathlib.Path(BUILD), pathlib.Path(SOURCE), pathlib.Path(WORK)
PREFIX = WORK / "prefix"

# What Trestle needs, by the name that find_package() has for it; and what each component does without.
DDS_PACKAGES = ["fastrtps", "fastdds", "fastcdr"]
BRIDGE_PACKAGES = ["fmt", "spdlog", "yaml-cpp", "EXPAT", "tinyxml2", "nlohmann_json", "OpenSSL", "CLI11"]
SPARED = {
    "core": ["Boost", "Threads", *DDS_PACKAGES, *BRIDGE_PACKAGES],
    "fuzz": ["Boost", "Threads", *DDS_PACKAGES, *BRIDGE_PACKAGES],
    "net": [*DDS_PACKAGES, *(name for name in BRIDGE_PACKAGES if name != "OpenSSL")],  # which is for TLS
    "sd": [*DDS_PACKAGES, *(name for name in BRIDGE_PACKAGES if name != "OpenSSL")],
    "dds": ["Boost", "fmt", "spdlog", "yaml-cpp", "EXPAT", "nlohmann_json", "CLI11"],
    "bridge": ["CLI11"],
}
PROGRAMS = {"core": "device", "fuzz": "fuzz_mutate", "net": "someip_net", "sd": "sd_net", "dds": "dds", "bridge": "bridge"}


def run(*command, **options):
    return subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          **options)


def good(*command, **options):
    done = run(*command, **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}\nended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def configuring(source, build, *settings, without=()):
    """The command for a project in a new build folder that finds Trestle in the prefix, and not the packages `without`."""
    shutil.rmtree(build, ignore_errors=True)
    return ["cmake", "-S", source, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=-O0",
            f"-DCMAKE_CXX_COMPILER={CXX}", "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache", "-Wno-dev", *settings,
            *(f"-DCMAKE_DISABLE_FIND_PACKAGE_{package}=ON" for package in without)]


def consumer(*settings, without=(), prefix=PREFIX, name="consumer"):
    return run(*configuring(SOURCE / "test/install/consumer", WORK / name, f"-DCMAKE_PREFIX_PATH={prefix}", *settings,
                            without=without))


def build(folder, *targets):
    good("cmake", "--build", folder, *(["--target", *targets] if targets else []))


def missing_includes(includes):
    """What headers below this folder include of Trestle that is not there, or in quotes, a line each."""
    for header in sorted(path for path in includes.rglob("*") if path.suffix in (".hpp", ".h")):
        for there in re.findall(r'^\s*#\s*include\s+[<"](trestle/[^>"]+)[>"]', header.read_text(), re.MULTILINE):
            if not (includes / there).exists():
                yield f"{header.relative_to(includes)} includes {there}, which is not installed: make it public, or spare it"
        for there in re.findall(r'^\s*#\s*include\s+"([^"]+)"', header.read_text(), re.MULTILINE):
            yield f"{header.relative_to(includes)} includes \"{there}\", which users cannot"


class Whole(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        good("cmake", "--install", BUILD, "--prefix", PREFIX)

    def test_has_the_program(self):
        self.assertIn("0.", good(PREFIX / "bin/trestle", "--version"))

    def test_has_the_public_headers_and_no_others(self):
        def headers(folder):
            return sorted(str(path.relative_to(folder)) for path in folder.rglob("*.h*"))
        self.assertEqual(headers(PREFIX / "include"), headers(BUILD / "include"))
        self.assertEqual([path.name for path in (PREFIX / "include").iterdir()], ["trestle"])
        for public in ("sd/net/node.hpp", "sd/core/device/device.hpp", "trestle.h", "bridge/carry/runtime/bridge.hpp"):
            self.assertTrue((PREFIX / "include/trestle" / public).exists(), public)
        for private in ("sd/net/ports.hpp", "someip/net/udp_socket.hpp", "bridge/messages/convert/quick/shape.hpp"):
            self.assertTrue((SOURCE / private).exists(), private)
            self.assertFalse((PREFIX / "include/trestle" / private).exists(), private)

    def test_no_installed_header_includes_one_that_is_not(self):
        self.assertEqual(list(missing_includes(PREFIX / "include")), [])

    def test_that_such_a_header_would_be_found(self):
        with tempfile.TemporaryDirectory() as folder:
            include = pathlib.Path(folder)
            (include / "trestle").mkdir()
            (include / "trestle/one.hpp").write_text('#pragma once\n#include <trestle/private.hpp>\n#include "sd/x.hpp"\n')
            self.assertEqual(len(list(missing_includes(include))), 2)

    def test_names_no_folder_of_the_build_machine(self):
        # Where the folder's name begins a path: it may be the name of one of ours, too.
        ours = re.compile(rf"(?<![\w}}/.-]){re.escape(str(SOURCE))}")
        files = [path for path in (PREFIX / "lib").rglob("*") if path.suffix in (".cmake", ".pc")]
        self.assertGreater(len(files), 8)
        self.assertEqual([str(path) for path in files if ours.search(path.read_text())], [])

    def test_leaves_what_has_not_changed(self):
        header = PREFIX / "include/trestle/sd/net/node.hpp"
        before = header.stat().st_mtime_ns
        good("cmake", "--install", BUILD, "--prefix", PREFIX)
        self.assertEqual(header.stat().st_mtime_ns, before)


class Stage(unittest.TestCase):
    """Headers on their way to where they are installed, which all `cmake --install` of one build share."""

    def test_a_header_that_another_install_is_copying_stays_whole(self):
        work = WORK / "stage"
        shutil.rmtree(work, ignore_errors=True)
        (work / "source/sd").mkdir(parents=True)
        (work / "staged/sd").mkdir(parents=True)
        (work / "source/sd/one.hpp").write_text('#include "sd/two.hpp"\n')
        (work / "staged/sd/one.hpp").write_text("as it was\n")
        with open(work / "staged/sd/one.hpp") as copying:
            good("cmake", f"-DTRESTLE_SOURCE={work}/source", f"-DTRESTLE_STAGE={work}/staged", f"-DTRESTLE_INCLUDES={work}/include",
                 "-DTRESTLE_HEADERS=sd/one.hpp", "-P", SOURCE / "cmake/install_headers.cmake")
            self.assertEqual(copying.read(), "as it was\n")
        self.assertEqual((work / "include/sd/one.hpp").read_text(), "#include <trestle/sd/two.hpp>\n")
        self.assertEqual([path.name for path in (work / "staged/sd").iterdir()], ["one.hpp"])


class Run(unittest.TestCase):
    """./run, as far as nothing is built."""

    def copy(self):
        """Of ./run alone, where all packages are installed, and cmake notes its arguments in `built`."""
        root = WORK / "run"
        shutil.rmtree(root, ignore_errors=True)
        (root / "tools").mkdir(parents=True)
        shutil.copy(SOURCE / "run", root)
        self.write(root / "tools/dpkg-query", "echo installed")
        self.write(root / "tools/cmake", f'echo "$@" >>{root}/built')
        (root / "built").write_text("")
        return root, {**os.environ, "PATH": f"{root}/tools:{os.environ['PATH']}"}

    def write(self, tool, does):
        tool.parent.mkdir(parents=True, exist_ok=True)
        tool.write_text(f"#!/bin/sh\n{does}\n")
        tool.chmod(0o755)

    def test_says_where_it_installs(self):
        self.assertRegex(good(SOURCE / "run", "install", "--help"), r"in DIR, else in ~/\.local, or in /usr/local as root")

    def test_refuses_what_it_does_not_know(self):
        for arguments in (["--prefix"], ["--prefix="], ["--prefx", "there"], ["there"], ["--prefix", "there", "more"]):
            with self.subTest(arguments):
                self.assertEqual(run(SOURCE / "run", "install", *arguments).returncode, 2)

    def test_looks_first_whether_it_may_write(self):
        refused = run(SOURCE / "run", "install", "--prefix", "/proc/trestle")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("nothing can be written to /proc/trestle", refused.stdout)

    def test_builds_the_device_for_the_commands_that_start_it(self):
        root, environment = self.copy()
        self.write(root / "build/program/bridge/trestle", 'echo "ran $*"')
        for command, builds in (("conform", True), ("fuzz", True), ("find", False)):
            with self.subTest(command):
                (root / "built").write_text("")
                told = good(root / "run", "trestle", command, "x", env=environment)
                self.assertIn(f"ran {command} x", told)
                built = (root / "built").read_text()
                self.assertIn("--target trestle", built)
                self.assertEqual("--target ets_device" in built, builds)

    def test_builds_then_installs_where_it_is_told(self):
        root, environment = self.copy()
        for arguments in (["--prefix", root / "there"], ["--prefix=there"]):
            with self.subTest(arguments):
                (root / "built").write_text("")
                told = good(root / "run", "install", *arguments, env=environment, cwd=root)
                configures, builds, installs = (root / "built").read_text().splitlines()
                self.assertEqual(configures, "--preset program")
                self.assertRegex(builds, r"^--build build/program --parallel \d+$")
                self.assertEqual(installs, f"--install build/program --prefix {root}/there")
                self.assertIn(f"the program is {root}/there/bin/trestle", told)
                self.assertTrue((root / "there").is_dir())

    def test_installs_nothing_that_is_not_built(self):
        root, environment = self.copy()
        self.write(root / "tools/cmake", f'echo "$@" >>{root}/built; [ "$1" != --build ]')
        refused = run(root / "run", "install", "--prefix", root / "there", env=environment)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("Building program failed", refused.stdout)
        self.assertNotIn("--install", (root / "built").read_text())

    def test_explains_the_bench_before_it_builds(self):
        root, environment = self.copy()
        shutil.copytree(SOURCE / "test/bench", root / "test/bench")
        for arguments, says in ((["--help"], "--quick"), (["--check", "-h"], "--quick"),
                                (["--micro", "--help"], "--benchmark_filter=REGEX")):
            with self.subTest(arguments):
                self.assertIn(says, good(root / "run", "bench", *arguments, env=environment))
        self.assertEqual((root / "built").read_text(), "")

    def test_stages_are_explained_as_they_are_called(self):
        for words in (["test", "hostile"], ["mutation"]):
            told = good(SOURCE / "run", *words, "--help")
            self.assertIn(f"usage: ./run {' '.join(words)} [-h]", told)
            self.assertNotIn("--flow", told)
        self.assertIn("loop-two-bridges", good(SOURCE / "run", "test", "hostile", "--list", timeout=60))


class Headers(unittest.TestCase):
    def test_each_compiles_alone(self):
        good(*configuring(SOURCE / "test/install/headers", WORK / "headers", f"-DCMAKE_PREFIX_PATH={PREFIX}",
                          "-DCOMPONENTS=core;sd;dds;bridge", "-DLIBRARIES=trestle::bridge;trestle::c"))
        build(WORK / "headers")


class Components(unittest.TestCase):
    def test_each_needs_no_packages_of_others(self):
        for component, spared in SPARED.items():
            with self.subTest(component):
                done = consumer(f"-DCOMPONENTS={component}", f"-DPROGRAM={PROGRAMS[component]}", without=spared)
                self.assertEqual(done.returncode, 0, done.stdout)
                build(WORK / "consumer")
                good(WORK / "consumer/consumer")

    def test_one_that_there_is_not_fails(self):
        done = consumer("-DCOMPONENTS=sd;bus")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn('trestle has no component "bus"; there are core, fuzz, net, sd, dds, bridge', done.stdout)

    def test_a_package_that_is_not_there_is_named(self):
        done = consumer("-DCOMPONENTS=bridge", without=["yaml-cpp"])
        self.assertNotEqual(done.returncode, 0)
        self.assertIn('component "bridge" needs the package yaml-cpp', re.sub(r"\s+", " ", done.stdout))

    def test_an_optional_one_may_lack_its_packages(self):
        done = consumer("-DCOMPONENTS=core", "-DOPTIONAL=bridge;bus;net", without=["spdlog"])
        self.assertEqual(done.returncode, 0, done.stdout)
        found = dict(re.findall(r"trestle_(\w+)_FOUND (\w+)", done.stdout))
        self.assertEqual(found, {"core": "TRUE", "bridge": "FALSE", "bus": "FALSE", "net": "TRUE"})

    def test_without_a_choice_it_is_all_that_was_installed(self):
        done = consumer("-DPROGRAM=bridge")
        self.assertEqual(done.returncode, 0, done.stdout)


class Examples(unittest.TestCase):
    def test_build_by_the_project_beside_them(self):
        folder = WORK / "examples"
        good(*configuring(SOURCE / "examples", folder, f"-DCMAKE_PREFIX_PATH={PREFIX}"))
        build(folder)
        self.assertEqual(run(folder / "run_bridge", "missing.yaml").returncode, 2)

    def test_are_all_in_that_project(self):
        sources = [path for path in (SOURCE / "examples").rglob("*") if path.suffix in (".c", ".cpp")]
        self.assertIn(SOURCE / "examples/bare_device/main.cpp", sources)
        for source in sources:  # some are a project of their own
            project = next(folder for folder in source.parents if (folder / "CMakeLists.txt").exists())
            named = re.escape(str(source.relative_to(project).with_suffix("")))
            self.assertRegex((project / "CMakeLists.txt").read_text(), rf"(?<![\w/]){named}\b", source)


class PkgConfig(unittest.TestCase):
    def flags(self, name):
        asked = good("pkg-config", "--cflags", "--libs", name,
                     env={**os.environ, "PKG_CONFIG_PATH": str(PREFIX / "lib/pkgconfig")})
        self.assertIn(str(PREFIX), os.path.normpath(asked.split()[0]))
        return asked.split()

    def test_builds_an_example(self):
        program = WORK / "values"
        good("ccache", CXX, "-std=c++20", "-O0", "-c", SOURCE / "examples/values.cpp", "-o", f"{program}.o",
             *(flag for flag in self.flags("trestle") if not flag.lower().startswith("-l")))
        good(CXX, f"{program}.o", "-o", program, *self.flags("trestle"))
        self.assertIn("cone 7", good(program))

    def test_builds_one_of_the_core_in_c(self):
        program = WORK / "device_in_c"
        good("cc", "-std=c11", SOURCE / "examples/c_device/main.c", "-o", program, *self.flags("trestle-core"))
        self.assertNotEqual(run(program).returncode, 0)  # it wants an address


class WithoutDds(unittest.TestCase):
    """TRESTLE_DDS=OFF where only Boost and tl::expected are there."""

    def test_builds_and_is_found(self):
        folder, prefix = WORK / "build", WORK / "prefix"
        shutil.rmtree(WORK, ignore_errors=True)
        good(*configuring(SOURCE, folder, "-DTRESTLE_DDS=OFF", "-DTRESTLE_TESTS=OFF", "-DCMAKE_UNITY_BUILD=ON",
                          without=[*DDS_PACKAGES, *BRIDGE_PACKAGES, "GTest", "benchmark"]))

        refused = run("cmake", "--install", folder, "--prefix", prefix)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("Trestle is not built whole, so nothing is installed", re.sub(r"\s+", " ", refused.stdout))
        self.assertFalse(prefix.exists())

        build(folder)
        good("cmake", "--install", folder, "--prefix", prefix)
        self.assertFalse((prefix / "include/trestle/bridge").exists())
        done = consumer("-DPROGRAM=sd_net", prefix=prefix, without=[*DDS_PACKAGES, *BRIDGE_PACKAGES])
        self.assertEqual(done.returncode, 0, done.stdout)
        build(WORK / "consumer")
        good(WORK / "consumer/consumer")

        done = consumer("-DCOMPONENTS=bridge", prefix=prefix)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn('trestle was installed without component "bridge"', re.sub(r"\s+", " ", done.stdout))


if __name__ == "__main__":
    # A clean environment: of no make that runs the tests, and of no compiler cache's settings but those of everybody.
    for name in ("MAKEFLAGS", "DESTDIR", "CXXFLAGS", "CFLAGS", "LDFLAGS"):
        os.environ.pop(name, None)
    os.environ.setdefault("CCACHE_BASEDIR", str(SOURCE))
    os.environ.setdefault("CCACHE_NOHASHDIR", "1")
    unittest.main(argv=[sys.argv[0], NAME, *sys.argv[1:]], verbosity=2)
