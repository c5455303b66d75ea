#!/usr/bin/env python3
"""image_test.py PACKAGES SOURCE_FOLDER WORK_FOLDER: the image of packaging/Containerfile, built and run by buildah.

PACKAGES is a folder with trestle_*.deb. Needs root. The image's base is TRESTLE_IMAGE_BASE, a folder with a root file system, as
packaging/try_packages.sh makes it: registries need not be in reach. Without buildah, packages or base it is skipped (77).
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

PACKAGES, SOURCE, WORK = (pathlib.Path(sys.argv.pop(1)).absolute() for _ in range(3))
BASE = pathlib.Path(os.environ.get("TRESTLE_IMAGE_BASE") or SOURCE / "build/package_root")
BUILDAH = ["buildah", "--storage-driver", "vfs", "--root", WORK / "storage", "--runroot", WORK / "run"]


def missing():
    if os.geteuid() != 0:
        return "it needs root"
    if not shutil.which("buildah"):
        return "there is no buildah"
    if not (BASE / "etc/debian_version").exists():
        return f"there is no root file system in {BASE}; packaging/try_packages.sh makes one"
    if len(list(PACKAGES.glob("trestle_*.deb"))) != 1:
        return f"there is no package in {PACKAGES}; ./run package makes it"
    return None


def good(*command):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}\nended with {done.returncode}:\n{done.stdout[-4000:]}")
    return done.stdout


class Image(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        (WORK / "context").mkdir(parents=True)
        [package] = PACKAGES.glob("trestle_*.deb")
        shutil.copy(package, WORK / "context")
        cls.addClassCleanup(shutil.rmtree, WORK, ignore_errors=True)
        base = good(*BUILDAH, "from", "scratch").strip()
        good(*BUILDAH, "add", "--quiet", base, BASE, "/")
        good(*BUILDAH, "config", "--env", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", base)
        good(*BUILDAH, "commit", "--quiet", base, "localhost/base")
        good(*BUILDAH, "rm", base)
        good(*BUILDAH, "build", "--isolation", "chroot", "--pull=never", "--build-arg", "BASE=localhost/base", "--tag", "trestle",
             "--file", SOURCE / "packaging/Containerfile", WORK / "context")
        cls.container = good(*BUILDAH, "from", "--pull=never", "localhost/trestle").strip()
        cls.root = pathlib.Path(good(*BUILDAH, "mount", cls.container).strip())

    def test_is_small_and_has_no_shell(self):
        size = sum(file.lstat().st_size for file in self.root.rglob("*") if file.is_file() and not file.is_symlink())
        self.assertLess(size, 80e6)
        self.assertEqual([path.name for path in (self.root / "usr/bin").iterdir()], ["trestle"])
        self.assertFalse((self.root / "bin").exists())

    def test_runs_as_a_user_without_rights(self):
        config = json.loads(good(*BUILDAH, "inspect", "--type", "image", "localhost/trestle"))["OCIv1"]["config"]
        self.assertEqual(config["User"], "10001:10001")
        self.assertEqual(config["Entrypoint"], ["/usr/bin/trestle"])
        self.assertEqual(config["Cmd"], ["bridge", "/etc/trestle/bridge.yaml"])
        # Nothing of it belongs to that user but what it has to write.
        owned = {str(path.relative_to(self.root)) for path in self.root.rglob("*") if path.lstat().st_uid == 10001}
        self.assertEqual(owned, {"run", "var/lib/trestle"})
        self.assertEqual([path for path in self.root.rglob("*") if path.is_file() and path.stat().st_mode & 0o6000], [])

    def test_has_the_licences_of_what_it_is_made_of(self):
        self.assertTrue((self.root / "usr/share/doc/trestle/trestle.spdx.json").exists())
        for library in self.root.glob("usr/lib/*/lib*.so*"):
            self.assertTrue(library.is_file(), library)
        documents = {path.parent.name for path in self.root.glob("usr/share/doc/*/copyright")}
        self.assertLessEqual({"libc6", "libstdc++6", "libgcc-s1", "trestle"}, documents)

    def test_the_program_works_in_it(self):
        run = [*BUILDAH, "run", "--isolation", "chroot", self.container, "--", "/usr/bin/trestle"]
        self.assertRegex(good(*run, "--version"), r"^trestle \d")
        self.assertIn("good, 2 routes", good(*run, "check", "/usr/share/doc/trestle/examples/bridge_a.yaml"))

    def test_a_bridge_runs_as_that_user_and_writes_nothing(self):
        # As an engine starts it, but in a network of its own.
        script = """ip link set lo up multicast on && mount --bind "$1" "$1" && mount -t tmpfs -o mode=1777 tmpfs "$1/run" &&
          mount -o remount,bind,ro "$1" && exec chroot --userspec=10001:10001 "$1" /usr/bin/trestle bridge /usr/share/doc/trestle/examples/bridge_a.yaml"""
        bridge = subprocess.Popen(["unshare", "--mount", "--net", "sh", "-c", script, "sh", str(self.root)], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE, text=True)
        self.addCleanup(bridge.stderr.close)
        said = ""
        for line in bridge.stderr:
            said += line
            if "carrying 2 routes" in line:
                bridge.terminate()
        self.assertEqual(bridge.wait(60), 0, said)
        self.assertIn("carrying 2 routes", said)


if __name__ == "__main__":
    why = missing()
    if why:
        print(f"Skipped: {why}")
        sys.exit(77)
    unittest.main()
