#!/usr/bin/env python3
"""package_test.py BUILD_FOLDER SOURCE_FOLDER WORK_FOLDER: the Debian packages of a build, unpacked beside each other.

That they can be installed, upgraded and purged is tried in a Debian of its own: `./run package --try`.
"""
import difflib
import gzip
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

BUILD, SOURCE, WORK = (pathlib.Path(sys.argv.pop(1)).absolute() for _ in range(3))
sys.path.insert(0, str(SOURCE / "test/bridge/autoware"))
from definitions import found_in  # noqa: E402

PACKAGES = ["libtrestle-core-dev", "libtrestle-dev", "trestle"]

if not shutil.which("dpkg-buildpackage") or not shutil.which("dh"):
    print("Skipped: there are no dpkg-buildpackage and dh (Debian: debhelper)")
    sys.exit(1 if os.environ.get("TRESTLE_REQUIRE_PEERS") else 77)


def good(*command, **options):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}\nended with {done.returncode}:\n{done.stdout[-4000:]}")
    return done.stdout


def files(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir()}


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        good(SOURCE / "packaging/package.sh", BUILD, WORK / "out")
        cls.debs = {path.name.partition("_")[0]: path for path in (WORK / "out").glob("*.deb")}
        for name, deb in cls.debs.items():
            good("dpkg-deb", "--extract", deb, WORK / name)
            good("dpkg-deb", "--control", deb, WORK / name / "DEBIAN")
        cls.trestle = WORK / "trestle/usr/bin/trestle"

    def field(self, package, name):
        return good("dpkg-deb", "--field", self.debs[package], name).strip()

    def test_are_these(self):
        self.assertEqual(sorted(self.debs), sorted([*PACKAGES, "trestle-dbgsym"]))

    def test_the_program_says_its_version_and_checks_its_examples(self):
        version = good(self.trestle, "--version").split()[1]
        self.assertRegex(self.field("trestle", "Version"), rf"^{re.escape(version)}(~git\d{{12}}\.\w{{8}}(\.changed)?)?$")
        examples = WORK / "trestle/usr/share/doc/trestle/examples"
        found = sorted(examples.rglob("*.yaml"))
        self.assertGreater(len(found), 5)
        good(self.trestle, "check", *found, env={**os.environ, "AMENT_PREFIX_PATH": found_in(WORK / "types")})

    def test_the_program_is_stripped_and_its_symbols_are_in_a_package(self):
        sections = good("readelf", "--sections", "--wide", self.trestle)
        self.assertNotIn(".symtab", sections)
        self.assertNotIn(".debug_info", sections)
        build_id = re.search(r"Build ID: (\w+)", good("readelf", "--notes", self.trestle))[1]
        debug = WORK / f"trestle-dbgsym/usr/lib/debug/.build-id/{build_id[:2]}/{build_id[2:]}.debug"
        self.assertIn(".symtab", good("readelf", "--sections", "--wide", debug))

    def test_the_unit_runs_the_program(self):
        unit = (WORK / "trestle/lib/systemd/system/trestle@.service").read_text()
        self.assertIn("\nExecStart=/usr/bin/trestle bridge /etc/trestle/%i.yaml\n", unit)
        self.assertNotIn("/usr/local", unit)
        self.assertTrue((WORK / "trestle/etc/trestle").is_dir())

    def test_has_what_the_program_says_of_itself(self):
        share = WORK / "trestle/usr/share"
        pages = WORK / "pages"
        good(self.trestle, "man", "--output", pages)
        self.assertEqual({path.name.removesuffix(".gz"): gzip.decompress(path.read_bytes()) for path in (share / "man/man1").iterdir()},
                         {path.name: path.read_bytes() for path in pages.iterdir()})
        for shell, file in (("bash", "bash-completion/completions/trestle"), ("zsh", "zsh/vendor-completions/_trestle"),
                            ("fish", "fish/vendor_completions.d/trestle.fish")):
            self.assertEqual((share / file).read_text(), good(self.trestle, "completion", shell))
        self.assertEqual((share / "trestle/trestle.schema.json").read_text(), good(self.trestle, "schema"))

    def test_the_libraries_are_in_one_package_each(self):
        # A file of two packages could not be installed with both.
        every = [name for package in PACKAGES for name in files(WORK / package) if not name.startswith("DEBIAN/")]
        self.assertEqual(sorted(every), sorted(set(every)))
        headers = {name for name in every if name.startswith("usr/include/")}
        self.assertEqual(headers, {f"usr/include/{path.relative_to(BUILD / 'include')}" for path in (BUILD / "include").rglob("*.h*")})
        core = files(WORK / "libtrestle-core-dev")
        self.assertIn("usr/include/trestle/trestle.h", core)
        self.assertFalse([name for name in core if "/net/" in name or "/bridge/" in name])
        self.assertIn("usr/include/trestle/sd/net/node.hpp", files(WORK / "libtrestle-dev"))
        for library in WORK.glob("lib*/usr/lib/**/*.a"):
            self.assertNotIn(".debug_info", good("readelf", "--sections", "--wide", library), library)

    def test_ask_for_what_they_need(self):
        version = self.field("trestle", "Version")
        self.assertEqual(self.field("libtrestle-core-dev", "Depends"), "libexpected-dev")
        self.assertIn(f"libtrestle-core-dev (= {version})", self.field("libtrestle-dev", "Depends"))
        # All that the files for CMake look for.
        config = "".join(path.read_text() for path in WORK.glob("lib*/usr/lib/**/trestle-config.cmake"))
        wanted = {"Boost": "boost", "fastcdr": "fastcdr", "fmt": "fmt", "spdlog": "spdlog", "yaml-cpp": "yaml-cpp", "EXPAT": "expat",
                  "tinyxml2": "tinyxml2", "nlohmann_json": "nlohmann-json", "OpenSSL": "ssl"}
        for package, debian in wanted.items():
            if package in config or package == "OpenSSL":
                self.assertIn(debian, self.field("libtrestle-dev", "Depends"))
        self.assertRegex(self.field("trestle", "Depends"), r"libfast(rtps|dds)[\d.]")

    def test_the_sbom_names_what_the_program_is_made_of(self):
        [beside] = (WORK / "out").glob("*.spdx.json")
        text = (WORK / "trestle/usr/share/doc/trestle/trestle.spdx.json").read_text()
        self.assertEqual(beside.read_text(), text)
        document = json.loads(text)
        self.assertEqual((document["spdxVersion"], document["dataLicense"], document["SPDXID"]),
                         ("SPDX-2.3", "CC0-1.0", "SPDXRef-DOCUMENT"))
        self.assertRegex(document["creationInfo"]["created"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
        by_id = {one["SPDXID"]: one for one in document["packages"]}
        self.assertEqual(len(by_id), len(document["packages"]))
        for one in by_id.values():
            self.assertRegex(one["SPDXID"], r"^SPDXRef-[A-Za-z0-9.-]+$")
            self.assertTrue(one["name"] and one["versionInfo"] and one["downloadLocation"])
        kinds = {}
        for one in document["relationships"]:
            kinds.setdefault(one["relationshipType"], set()).update(
                by_id[one[end]]["name"] for end in ("spdxElementId", "relatedSpdxElement") if one[end] in by_id)
        self.assertEqual(kinds["DESCRIBES"], {"trestle"})
        # Each library that Depends names is loaded; libraries of headers are in the program itself.
        depends = {re.split(r"[ (]", one)[0] for one in self.field("trestle", "Depends").split(", ")}
        self.assertLessEqual({re.sub(r"-fmt\d+$", "", name) for name in depends}, kinds["DYNAMIC_LINK"])
        for headers in ("boost", "libcli11-dev", "libexpected-dev", "nlohmann-json3-dev"):
            self.assertTrue([name for name in kinds["STATIC_LINK"] if headers in name], headers)

    def test_twice_gives_the_same_bytes(self):
        good(SOURCE / "packaging/package.sh", BUILD, WORK / "again")

        def sums(folder):
            return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir()
                    if path.suffix in (".deb", ".json")}

        def differences(name):
            first, second = (good("dpkg-deb", "--contents", WORK / folder / name).splitlines() for folder in ("out", "again"))
            return "\n".join(difflib.unified_diff(first, second, name, "again", n=0, lineterm=""))
        first, second = sums(WORK / "out"), sums(WORK / "again")
        self.assertEqual(sorted(first), sorted(second))
        differ = [name for name in first if first[name] != second[name]]
        self.assertEqual(differ, [], "\n".join(differences(name) for name in differ if name.endswith(".deb")))

    def test_lintian_has_nothing_to_say(self):
        if not shutil.which("lintian"):
            self.skipTest("there is no lintian")
        # This tree is installed below /usr/local and has no debug symbols; that of ./run package is, and has.
        spared = ["pkg-config-unavailable-for-cross-compilation", "debug-file-with-no-debug-symbols"]
        [changes] = (WORK / "out").glob("*.changes")
        found = good("lintian", "--allow-root", "--fail-on", "error,warning", "--suppress-tags", ",".join(spared), changes)
        self.assertNotRegex(found, r"(?m)^[EW]: ")


if __name__ == "__main__":
    unittest.main()
