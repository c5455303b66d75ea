#!/usr/bin/env python3
"""`trestle generate` and `trestle diff` as a user runs them. Usage: generate_command_test.py TRESTLE SOURCE_FOLDER"""
import contextlib
import fcntl
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from bridge_program import DOMAIN, head, log_until

program, source = sys.argv[1], pathlib.Path(sys.argv[2])
DOOR = source / "examples" / "door"
SEAT = source / "examples" / "seat"


def run(*arguments, **more):
    done = subprocess.run([program, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60, **more)
    return done.returncode, done.stdout, done.stderr


class Generate(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def door(self, **changes):
        """The FIDL and FDEPL of the example in a folder of their own, with texts replaced."""
        folder = self.folder / f"door{len(list(self.folder.iterdir()))}"
        folder.mkdir()
        for name in ("Door.fidl", "Door.fdepl"):
            text = (DOOR / name).read_text()
            for before, after in changes.get(name.replace(".", "_"), []):
                self.assertIn(before, text)
                text = text.replace(before, after)
            (folder / name).write_text(text)
        return folder

    def test_writes_the_model_to_standard_output(self):
        status, output, errors = run("generate", DOOR / "Door.fidl", DOOR / "Door.fdepl", "--to", "json")
        self.assertEqual(status, 0, errors)
        service = json.loads(output)["services"][0]
        self.assertEqual((service["name"], service["id"]), ("Door", "0x4711"))
        self.assertEqual([method["name"] for method in service["methods"]], ["open", "shut", "ring"])
        self.assertEqual([event["id"] for event in service["events"]], ["0x8010", "0x8011"])
        self.assertEqual([field["name"] for field in service["fields"]], ["opening", "label", "locked"])

    def test_writes_a_route_file_that_check_accepts(self):
        status, _, errors = run("generate", DOOR, "--to", "routes", "-o", self.folder / "out", "--address", "127.0.0.1")
        self.assertEqual(status, 0, errors)
        file = self.folder / "out" / "bridge.yaml"
        # Its types are in no folder: it names the interfaces that define them.
        status, output, errors = run("check", file)
        self.assertEqual((status, errors), (0, ""))
        self.assertIn("5 routes, 8 methods", output)

    def test_names_the_interfaces_of_types_also_where_ids_are_chosen(self):
        bare = self.folder / "a b" / "Lamp.fidl"
        bare.parent.mkdir()
        bare.write_text("package car\ninterface Lamp { version { major 1 minor 0 } broadcast hot { out { UInt8 x } } }\n")
        status, _, errors = run("generate", bare, "--to", "routes", "-o", self.folder / "out" / "deep")
        self.assertEqual(status, 0, errors)
        file = self.folder / "out" / "deep" / "bridge.yaml"
        self.assertIn("interfaces: [../../a b/Lamp.fidl]", file.read_text())
        status, output, errors = run("check", file)
        self.assertEqual((status, errors), (0, ""))

    def test_keeps_the_other_routes_as_they_are_where_some_are_too_many(self):
        fidl = self.folder / "Many.fidl"
        fidl.write_text("package car\ninterface Many {\n version { major 1 minor 0 }\n"
                        + "".join(f" broadcast b{i} {{ out {{ UInt8 x }} }}\n" for i in range(1002))
                        + "".join(f" method m{i} {{ in {{ UInt8 x }} }}\n" for i in range(3)) + "}\n")
        status, _, errors = run("generate", fidl, "--to", "routes", "-o", self.folder / "out", "-q")
        self.assertEqual(status, 0, errors)
        self.assertIn("Many.b1001: more than 1000 routes", errors)
        text = (self.folder / "out" / "bridge.yaml").read_text()
        for i in range(3):
            self.assertRegex(text, rf"# Many.m{i}\n  - ros_service: /many/m{i}\n(    .*\n){{4}}    method: 0x000{i + 1}\n")

    def test_writes_files_of_names_that_are_too_long_for_one(self):
        name = "Very" * 70
        fidl = self.folder / "Long.fidl"
        fidl.write_text(f"package org.{name.lower()}\ninterface {name} {{\n version {{ major 1 minor 0 }}\n struct {name}State {{ UInt8 a }}\n"
                        f" attribute {name}State state\n broadcast moved{name} {{ out {{ UInt8 a UInt8 b }} }}\n method open {{ in {{ UInt8 a }} }}\n}}\n")
        status, _, errors = run("generate", fidl, "--to", "msg,fidl,arxml,wireshark,sheet", "-o", self.folder / "out", "-q")
        self.assertEqual(status, 0, errors)
        self.assertIn("its whole name, which is too long for a file: Very", errors)
        messages = list((self.folder / "out").rglob("*.msg"))
        self.assertEqual(len(messages), 2, messages)

    def test_writes_messages_that_the_route_file_finds(self):
        status, _, errors = run("generate", DOOR, "--to", "routes,msg", "-o", self.folder / "out", "-q")
        self.assertEqual(status, 0, errors)
        package = self.folder / "out" / "car"
        self.assertIn("float32 distance", (self.folder / "out" / "door" / "msg" / "Obstacle.msg").read_text())
        self.assertIn("---", (package / "srv" / "DoorOpen.srv").read_text())
        self.assertIn('"srv/DoorOpen.srv"', (package / "CMakeLists.txt").read_text())
        fields = self.folder / "out" / "car_fields"
        self.assertEqual((fields / "srv" / "SetDoorLabel.srv").read_text(), "car/DoorLabel value\n---\ncar/DoorLabel value\n")
        self.assertFalse((fields / "srv" / "SetDoorOpening.srv").exists())  # read-only
        self.assertIn("<depend>car</depend>", (fields / "package.xml").read_text())
        status, output, errors = run("check", self.folder / "out" / "bridge.yaml")
        self.assertEqual(status, 0, errors)
        self.assertIn("5 routes, 8 methods", output)

    def test_makes_a_bridge_of_the_description_alone(self):
        status, output, errors = run("check", DOOR / "bridge.yaml")
        self.assertEqual((status, errors), (0, ""))
        self.assertIn("/door/moved", output)
        self.assertIn("car/srv/DoorOpen", output)

    def test_says_which_configuration_a_description_needs(self):
        folder = self.door()
        (folder / "Door.fdepl").rename(folder / "Door-SomeIP.fdepl")
        for command, *files in (("bridge", "Door.fidl"), ("check", "Door.fidl"), ("bridge", "Door-SomeIP.fdepl"), ("bridge", "Door.fidl", "Door-SomeIP.fdepl"),
                                ("check", "Door.fidl", "Door-SomeIP.fdepl")):
            status, configuration, errors = run(command, *files, cwd=folder)
            self.assertEqual(status, 2)
            self.assertRegex(errors, f"^{files[0]}: error: is an interface description: expected a configuration.*\n$")
            # It is one, when standard output is saved.
            (folder / "bridge.yaml").write_text(configuration)
            status, output, errors = run("check", folder / "bridge.yaml")
            self.assertEqual((status, errors), (0, ""))
            self.assertIn("/door/moved", output)
        # Saved, it is what was wanted.
        (folder / "bridge.yaml").unlink()
        for files, wanted in ((["Door.fidl"], 0), (["Door.fidl", "Door-SomeIP.fdepl"], 0), (["Door.fidl", "bridge.yaml"], 2)):
            with open(folder / "bridge.yaml", "w", encoding="utf-8") as saved:
                done = subprocess.run([program, "bridge", *files], cwd=folder, stdout=saved, stderr=subprocess.PIPE, text=True, timeout=60)
            self.assertEqual(done.returncode, wanted, done.stderr)
            self.assertEqual((folder / "bridge.yaml").read_text(), configuration)
            self.assertEqual("error" in done.stderr, wanted != 0)
            self.assertIn("Door.fidl", done.stderr)
        with open(folder / "bridge.yaml", "w", encoding="utf-8") as saved:  # nothing was checked
            self.assertEqual(subprocess.run([program, "check", "Door.fidl"], cwd=folder, stdout=saved, stderr=subprocess.DEVNULL, timeout=60).returncode, 2)
        # What is wrong with it is told, and nothing is saved.
        (folder / "Bad.fidl").write_text("package car\ninterface Bad {\n    attribute Bolean locked\n}\n")
        (folder / "broken.json").write_text('{"services": [\n')
        for file, place, word in (("Bad.fidl", "3:15", "Bolean"), ("broken.json", "2:1", "")):
            for command in ("bridge", "check"):
                with open(folder / "saved.yaml", "w", encoding="utf-8") as saved:
                    done = subprocess.run([program, command, file], cwd=folder, stdout=saved, stderr=subprocess.PIPE, text=True, timeout=60)
                self.assertEqual((done.returncode, (folder / "saved.yaml").read_text()), (2, ""))
                self.assertRegex(done.stderr, f"^{file}:{place}: error: .*{word}")
        (folder / "Empty.fidl").write_text("package car\n")
        self.assertEqual(run("bridge", "Empty.fidl", cwd=folder), (2, "", "Empty.fidl: error: is an interface description with nothing that a bridge can carry\n"))
        # Ids alone make no routes; they are taken beside what has types.
        (folder / "car.json").write_text('{"unicast": "10.0.0.1", "services": [{"service": "0x4711", "instance": "1"}]}\n')
        for command in ("bridge", "check"):
            status, output, errors = run(command, "car.json", cwd=folder)
            self.assertEqual((status, output), (2, ""))
            self.assertRegex(errors, "^car.json: error: is a configuration of vsomeip, which has ids and no types, so that a bridge can carry nothing of it: "
                             "name what has the types, too, such as `trestle bridge Door.fidl Door.fdepl vsomeip.json`\n$")
        status, output, errors = run("bridge", "Door.fidl", "car.json", cwd=folder)
        self.assertEqual(status, 2)
        self.assertIn("interfaces: [Door.fidl, Door-SomeIP.fdepl, car.json]\n", output)
        # JSON may be a configuration of a bridge, too.
        (folder / "bridge.json").write_text('{"someip": {"address": "127.0.0.1"}, "interfaces": ["Door.fidl", "Door-SomeIP.fdepl"], "generate": "all"}\n')
        status, output, errors = run("check", "bridge.json", cwd=folder)
        self.assertEqual((status, errors), (0, ""))
        self.assertIn("/door/moved", output)
        # The others are checked, too.
        (folder / "bad.yaml").write_text("routs: []\n")
        status, output, errors = run("check", "bad.yaml", "Door.fidl", cwd=folder)
        self.assertEqual((status, output), (2, configuration))
        self.assertIn("bad.yaml:1:1: error", errors)
        # What is not there is no description.
        status, output, errors = run("check", "Dor.fidl", cwd=folder)
        self.assertEqual((status, output), (2, ""))
        self.assertIn("Dor.fidl", errors)
        self.assertNotIn("interface description", errors)
        status, _, errors = run("bridge", DOOR / "bridge.yaml", "more.yaml")
        self.assertEqual(status, 2)
        self.assertIn("not expected: more.yaml", errors)
        status, _, errors = run("bridge", DOOR / "bridge.yaml", "--consle")
        self.assertEqual(status, 2)
        self.assertIn("not expected: --consle", errors)

    LAMP = "package car\ninterface Lamp { version { major 1 minor 0 } method turn { } broadcast hot { out { UInt8 x } } attribute Boolean lit }\n"

    def test_all_commands_take_the_ids_that_are_kept_beside_the_description(self):
        lamp, kept = self.folder / "Lamp.fidl", self.folder / "ids.lock"
        lamp.write_text(self.LAMP)
        self.assertEqual(run("generate", lamp, "--to", "routes", "-o", self.folder, "-q"), (0, "", ""))
        text = kept.read_text()
        number = re.search("id: (0x[0-9a-f]{4})", text)[1]
        kept.write_text(text.replace(number, "0x5555").replace("turn: 0x0001", "turn: 0x0077"))
        note = f"ids are missing, of 'car.Lamp' and maybe others: those of {kept} are used, which Trestle has chosen\n"
        for source in (lamp, self.folder):
            status, output, errors = run("explain", "Lamp", source)
            self.assertEqual((status, errors), (0, "note: " + note))
            self.assertIn("car.Lamp 0x5555 chosen", output)
            self.assertRegex(output, "turn +0x0077 chosen")
        status, output, errors = run("decode", "--hex", "--interfaces", lamp, input="55550077000000080000000001010000\n")
        self.assertEqual((status, errors), (0, "note: " + note))
        self.assertEqual(json.loads(output)["method_name"], "turn")
        routes = self.folder / "own.yaml"
        routes.write_text("someip: {address: 127.0.0.1}\ninterfaces: [Lamp.fidl]\ngenerate: all\n")
        status, output, errors = run("check", routes)
        self.assertEqual(status, 0, errors)
        self.assertIn("0x5555.0x0001", output)
        self.assertIn("warning: interfaces: " + note, errors)
        # What is new is kept there, too.
        lamp.write_text(self.LAMP.replace("method turn { }", "method turn { } method off { }"))
        out = self.folder / "out"
        status, _, errors = run("generate", lamp, "--to", "sheet", "-o", out, "-q")
        self.assertEqual((status, errors), (0, "note: " + note))
        self.assertFalse((out / "ids.lock").exists())
        self.assertIn("turn: 0x0077", kept.read_text())
        self.assertIn("off: ", kept.read_text())
        # Another file can be named.
        status, output, errors = run("explain", "Lamp", lamp, "--lock", self.folder / "none.lock")
        self.assertEqual((status, errors), (0, ""))
        self.assertIn(number, output)
        # What contradicts is told with its place.
        other = self.folder / "other" / "Door.fidl"
        other.parent.mkdir()
        other.write_text(self.LAMP.replace("Lamp", "Door"))
        (other.parent / "ids.lock").write_text("services:\n  - name: car.Door\n    id: 0x5555\n")
        status, _, errors = run("explain", lamp, other)
        self.assertEqual(status, 2)
        self.assertIn(f"{other.parent / 'ids.lock'}:2:5: error: 0x5555 of 'car.Door' is 0x5555 of 'car.Lamp' in {kept}: remove one of both", errors)
        kept.write_text("version: 1\ntopics: []\n")
        for command in (("explain", lamp), ("decode", "--hex", "--interfaces", lamp)):
            status, _, errors = run(*command)
            self.assertEqual(status, 2)
            self.assertRegex(errors, rf"{kept}:\d:\d+: error: .*\(it is read because it lies beside '{lamp}'\)")

    @contextlib.contextmanager
    def used(self, folder):
        """As by another run."""
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield
        finally:
            os.close(descriptor)

    def start(self, *arguments):
        process = subprocess.Popen([program, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def test_runs_at_once_lose_nothing_of_each_other(self):
        out = self.folder / "out"
        sources = [self.folder / f"{name}.fidl" for name in ("Lamp", "Bell")]
        for source in sources:
            source.write_text(self.LAMP.replace("Lamp", source.stem).replace("package car", f"package {source.stem.lower()}"))
        # Both wait, and make the folder anew, which is gone when they get it.
        out.mkdir()
        with self.used(out):
            runs = [self.start("generate", source, "--to", "msg", "-o", out, "-q") for source in sources]
            for one in runs:
                self.assertEqual(one.stderr.readline(), f"waiting for another `trestle generate`, which uses {out}\n")
            out.rmdir()
        for one in runs:
            errors = one.communicate(timeout=60)[1].replace(f"waiting for another `trestle generate`, which uses {out}\n", "")
            self.assertEqual((one.returncode, errors), (0, ""))
        for source in sources:
            self.assertIn(f"name: {source.stem.lower()}.{source.stem}\n", (out / "ids.lock").read_text())
            self.assertIn(f"{source.stem.lower()}/package.xml\n", (out / "generated.lock").read_text())
        # Likewise what another one adds to kept ids that are elsewhere: of --lock, or beside the source.
        lamp = self.folder / "elsewhere" / "Lamp.fidl"
        lamp.parent.mkdir()
        lamp.write_text(self.LAMP)
        for name, arguments in (("own.lock", ["--to", "json", "--lock", lamp.parent / "own.lock"]), ("ids.lock", ["--to", "msg", "-o", self.folder / "gen"])):
            kept = lamp.parent / name
            kept.write_text("services: [{name: a.B, id: 0x5001}]\n")
            with self.used(lamp.parent):
                one = self.start("generate", lamp, *arguments)
                self.assertEqual(one.stderr.readline(), f"waiting for another `trestle generate`, which uses {lamp.parent}\n")
                shutil.copy(out / "ids.lock", kept)
            self.assertEqual((one.communicate(timeout=60)[1].count("error"), one.returncode), (0, 0))
            self.assertIn("name: bell.Bell\n", kept.read_text())
            self.assertIn("name: car.Lamp\n", kept.read_text())

    def test_writes_nothing_where_ids_cannot_be_kept(self):
        lamp, out, lock = self.folder / "Lamp.fidl", self.folder / "out", self.folder / "my.lock"
        lamp.write_text(self.LAMP)
        before = sorted(self.folder.iterdir())
        status, output, errors = run("generate", lamp, "--to", "routes,msg", "-o", out, "--lock", self.folder / "none" / "my.lock")
        self.assertEqual((status, output), (2, ""))
        self.assertIn(f"--lock: {self.folder / 'none' / 'my.lock'} cannot be written: there is no folder '{self.folder / 'none'}'", errors)
        self.assertEqual(sorted(self.folder.iterdir()), before)
        in_the_way = self.folder / ".my.lock.new"  # as a disk that is full, or rights that are missing
        in_the_way.mkdir()
        for arguments in (["-o", out], []):
            status, output, errors = run("generate", lamp, "--to", "json", "--lock", lock, *arguments)
            self.assertEqual((status, output), (1, ""))
            self.assertIn(f"error: {lock} cannot be written: {in_the_way}: Is a directory", errors)
            self.assertEqual(sorted(self.folder.iterdir()), sorted([*before, in_the_way]))
        in_the_way.rmdir()
        self.assertEqual(run("generate", lamp, "--to", "json", "--lock", lock, "-o", out)[0], 0)
        self.assertTrue(lock.exists())

    def test_names_the_fdepl_that_was_forgotten(self):
        folder = self.door()
        add = f"Add {folder / 'Door.fdepl'}, which was not given"
        for before, behind in ((["explain"], []), (["generate"], ["--to", "json"]), (["decode", "--hex", "--interfaces"], [])):
            status, _, errors = run(*before, folder / "Door.fidl", *behind)
            self.assertEqual(status, 0, errors)
            self.assertIn(add, errors)
            status, _, errors = run(*before, folder / "Door.fidl", folder / "Door.fdepl", *behind)
            self.assertEqual(status, 0, errors)
            self.assertNotIn("ids are missing", errors)

    def test_removes_nothing_that_a_link_leads_to_or_others_need(self):
        lamp, door, out = self.folder / "Lamp.fidl", self.folder / "Gate.fidl", self.folder / "out"
        text = "package {}\ninterface {} {{ version {{ major 1 minor 0 }} broadcast hot {{ out {{ UInt8 x }} }} }}\n"
        lamp.write_text(text.format("car", "Lamp"))
        door.write_text(text.format("car", "Gate"))
        self.assertEqual(run("generate", lamp, "--to", "msg,routes", "-o", out, "-q")[0], 0)
        # Another source takes the files of the package, and says so; who names both does not.
        status, _, errors = run("generate", door, "--to", "msg", "-o", out, "-q")
        self.assertEqual(status, 0, errors)
        self.assertRegex(errors, rf"warning: {out}/car/CMakeLists.txt was made of other sources before \(--to msg \.\./Lamp.fidl\)")
        status, _, errors = run("generate", door, lamp, "--to", "msg", "-o", out, "-q")
        self.assertEqual((status, errors), (0, ""))
        self.assertEqual(run("generate", door, "--to", "msg", "-o", out, "-q")[0], 0)
        # Under another name, what the messages of the first need stays.
        lamp.write_text(text.format("light", "Lamp"))
        status, _, errors = run("generate", lamp, "--to", "msg", "-o", out)
        self.assertEqual(status, 0, errors)
        self.assertTrue((out / "car" / "package.xml").exists())
        self.assertNotIn("removed", errors)
        # A folder that is a link stays, with all that is in it; and nothing is said to be edited.
        elsewhere = self.folder / "elsewhere"
        (out / "light").rename(elsewhere)
        (out / "light").symlink_to(elsewhere)
        before = {path: path.read_bytes() for path in elsewhere.rglob("*") if path.is_file()}
        lamp.write_text(text.format("lights", "Lamp"))
        status, _, errors = run("generate", lamp, "--to", "msg", "-o", out)
        self.assertEqual(status, 0, errors)
        self.assertIn(f"kept {out}/light/package.xml, which is no longer made: a link leads to it; remove it if nobody needs it", errors)
        self.assertNotIn("edited", errors)
        self.assertEqual({path: path.read_bytes() for path in elsewhere.rglob("*") if path.is_file()}, before)
        self.assertTrue((out / "light").is_symlink())
        # A link that leads nowhere is no file of ours; the list may be of another system.
        (out / "bridge.yaml").unlink()
        (out / "bridge.yaml").symlink_to(self.folder / "nowhere")
        status, _, errors = run("generate", lamp, "--to", "routes", "-o", out)
        self.assertEqual(status, 2)
        self.assertIn("bridge.yaml is not made by `trestle generate`", errors)
        (out / "bridge.yaml").unlink()
        lock = out / "generated.lock"
        lock.write_bytes(lock.read_bytes().replace(b"\n", b"\r\n"))
        lamp.write_text(text.format("lamps", "Lamp"))
        status, _, errors = run("generate", lamp, "--to", "msg", "-o", out)
        self.assertEqual(status, 0, errors)
        self.assertIn(f"removed {out}/lights/package.xml", errors)
        self.assertFalse((out / "lights").exists())

    def test_knows_what_it_wrote_before_it_failed(self):
        lamp, out = self.folder / "Lamp.fidl", self.folder / "out"
        text = "package car\ninterface Lamp {{ version {{ major 1 minor 0 }} broadcast {} {{ out {{ UInt8 x }} }} }}\n"
        lamp.write_text(text.format("hot"))
        out.mkdir()
        (out / "car").write_text("in the way\n")
        status, _, errors = run("generate", lamp, "--to", "routes,msg", "-o", out)
        self.assertEqual(status, 1)
        self.assertRegex(errors, rf"error: {out}/car.* cannot be (made|written): ")
        (out / "car").unlink()
        lamp.write_text(text.format("cold"))
        status, _, errors = run("generate", lamp, "--to", "routes,msg", "-o", out)
        self.assertEqual(status, 0, errors)
        self.assertEqual([path for path in out.rglob(".*")], [])

    def test_marks_chosen_ids_in_what_it_writes(self):
        lamp = self.folder / "Lamp.fidl"
        lamp.write_text(self.LAMP)
        out, note = self.folder / "out", "chosen by Trestle, not given by a description"
        self.assertEqual(run("generate", lamp, "--to", "fidl,routes,arxml", "-o", out, "-q")[0], 0)
        fdepl = next(out.glob("*.fdepl")).read_text()
        for key in ("ServiceID", "MethodID", "EventID", "GetterID", "SetterID", "NotifierID", "InstanceID"):
            self.assertRegex(fdepl, rf"SomeIp{key} = \d+  // {note}\n")
        self.assertIn(f"SomeIpEventGroups = {{ 1 }}  // {{ 1 }}: {note}\n", fdepl)
        routes = (out / "bridge.yaml").read_text()
        self.assertRegex(routes, rf"service: 0x[0-9a-f]{{4}}  # {note}: service, instance, event, eventgroup\n")
        self.assertRegex(routes, rf"service: 0x[0-9a-f]{{4}}  # {note}: service, instance, method\n")
        self.assertEqual(run("check", out / "bridge.yaml")[0], 0)
        arxml = (out / "interfaces.arxml").read_text()
        for tag in ("SERVICE-INTERFACE-ID", "METHOD-ID", "EVENT-ID", "EVENT-GROUP-ID", "SERVICE-INSTANCE-ID"):
            self.assertRegex(arxml, rf"<!-- {note} -->\n *<{tag}>")
        # Readers find the same ids, and nothing that was chosen.
        models = [json.loads(run("generate", *sources, "--to", "json")[1])["services"][0] for sources in ([next(out.glob("*.fidl")), next(out.glob("*.fdepl"))], [out / "interfaces.arxml"])]
        for model in models:
            self.assertIn(model["id"], routes)
            self.assertNotIn("id_is_chosen", model)
        # Where all are given, nothing is marked.
        self.assertEqual(run("generate", DOOR, "--to", "fidl,routes,arxml", "-o", self.folder / "given", "-q")[0], 0)
        for file in (self.folder / "given").iterdir():
            self.assertNotIn("chosen", file.read_text(), file)

    def test_replaces_no_file_that_it_did_not_write(self):
        out = self.folder / "out"
        out.mkdir()
        own = {out / name: f"mine {name}\n" for name in ("bridge.yaml", "interfaces.md")}
        for file, text in own.items():
            file.write_text(text)
        arguments = ["generate", DOOR, "--to", "routes,sheet", "-o", out]
        status, _, errors = run(*arguments)
        self.assertEqual(status, 2)
        self.assertIn(f"{out / 'bridge.yaml'}, {out / 'interfaces.md'} are not made by `trestle generate`, and would be replaced: "
                      "expected another folder, or --force", errors)
        self.assertEqual({file: file.read_text() for file in out.iterdir()}, own)
        self.assertEqual(run(*arguments, "--force")[0], 0)
        self.assertIn("Door.moved", (out / "bridge.yaml").read_text())
        # What it wrote it may replace, but not where it was edited since.
        made = {file: file.read_bytes() for file in out.iterdir()}
        shutil.copy(DOOR / "Door.fidl", self.folder)
        arguments[1] = self.folder / "Door.fidl"  # the others would have other texts
        (out / "bridge.yaml").write_text("changed\n")
        changed = {file: file.read_bytes() for file in out.iterdir()}
        status, _, errors = run(*arguments)
        self.assertEqual(status, 2)
        self.assertIn(f"-o: {out / 'bridge.yaml'} was edited since `trestle generate` wrote it, and would be replaced: move it away, or "
                      "give --force", errors)
        self.assertNotIn("interfaces.md", errors)
        self.assertEqual({file: file.read_bytes() for file in out.iterdir()}, changed)
        arguments[1] = DOOR
        self.assertEqual(run(*arguments)[0], 2)
        self.assertEqual(run(*arguments, "--force")[0], 0)
        self.assertEqual({file: file.read_bytes() for file in out.iterdir()}, made)
        # Lists without checksums tell nothing of edits.
        lock = out / "generated.lock"
        lock.write_text("# What\n" + "".join(line.split("  ")[-1] for line in lock.read_text().splitlines(True) if line[0] != "#"))
        self.assertIn("\nbridge.yaml\n", lock.read_text())
        (out / "bridge.yaml").write_text("changed\n")
        self.assertEqual(run(*arguments)[0], 0)
        self.assertEqual({file: file.read_bytes() for file in out.iterdir()}, made)
        done = subprocess.run(["sha256sum", "--check", "--strict", "generated.lock"], cwd=out, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        # No source, in any case.
        self.assertEqual(run("generate", DOOR, "--to", "fidl", "-o", out, "-q")[0], 0)
        fidl = next(out.glob("*.fidl"))
        status, _, errors = run("generate", fidl, "--to", "fidl", "-o", out, "--force")
        self.assertEqual(status, 2)
        self.assertIn("is a source", errors)

    def test_leaves_others_what_happens_to_have_the_right_text(self):
        lamp, out, again = self.folder / "Lamp.fidl", self.folder / "out", self.folder / "again"
        lamp.write_text(self.LAMP)
        self.assertEqual(run("generate", lamp, "--to", "msg", "-o", out, "-q")[0], 0)
        mine = again / "car" / "msg" / "LampHot.msg"
        mine.parent.mkdir(parents=True)
        shutil.copy(out / "car" / "msg" / "LampHot.msg", mine)
        arguments = ["generate", lamp, "--to", "msg", "-o", again]
        status, _, errors = run(*arguments)
        self.assertEqual(status, 0, errors)
        self.assertIn(f"unchanged {mine}\n", errors)
        listed = (again / "generated.lock").read_text()
        self.assertIn("car/package.xml", listed)
        self.assertNotIn("LampHot", listed)
        # So it is neither removed with the others, nor replaced.
        status, _, errors = run(*arguments, "--package", "light")
        self.assertEqual(status, 0, errors)
        self.assertIn(f"removed {again / 'car' / 'package.xml'}\n", errors)
        self.assertEqual([path for path in (again / "car").rglob("*") if path.is_file()], [mine])
        lamp.write_text(self.LAMP.replace("UInt8 x", "UInt16 x"))
        status, _, errors = run(*arguments)
        self.assertEqual(status, 2)
        self.assertIn(f"{mine} is not made by `trestle generate`", errors)
        # With --force it is.
        lamp.write_text(self.LAMP)
        self.assertEqual(run(*arguments, "--force")[0], 0)
        self.assertIn("car/msg/LampHot.msg\n", (again / "generated.lock").read_text())
        self.assertIn(f"removed {mine}\n", run(*arguments, "--package", "light")[2])

    def test_refuses_a_list_that_a_merge_has_left(self):
        lamp, out = self.folder / "Lamp.fidl", self.folder / "out"
        lamp.write_text(self.LAMP)
        arguments = ["generate", lamp, "--to", "msg", "-o", out]
        self.assertEqual(run(*arguments)[0], 0)
        lock = out / "generated.lock"
        lock.write_text(lock.read_text().replace("\n", "\n<<<<<<< HEAD\n", 3))
        before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
        lamp.write_text(self.LAMP.replace("UInt8 x", "UInt16 x"))
        error = f"{lock}:2:1: error: '<<<<<<<' is what a merge has left: keep the lines of one side, and run `trestle generate` again\n"
        status, _, errors = run(*arguments, "--force")
        self.assertEqual((status, errors), (2, error))
        self.assertEqual({path: path.read_bytes() for path in out.rglob("*") if path.is_file()}, before)
        status, _, errors = run("explain", self.folder)
        self.assertEqual(status, 2)
        self.assertIn(error, errors)

    def test_removes_what_it_makes_no_longer(self):
        lamp, out = self.folder / "Lamp.fidl", self.folder / "out"
        lamp.write_text("package car\ninterface Lamp { version { major 1 minor 0 } broadcast hot { out { UInt8 x } } }\n")
        other = self.folder / "Bell.fidl"
        other.write_text(lamp.read_text().replace("Lamp", "Bell").replace("package car", "package house"))
        for source, targets in ((lamp, "routes,msg"), (other, "msg")):
            self.assertEqual(run("generate", source, "--to", targets, "-o", out)[0], 0)
        before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
        self.assertIn(out / "car" / "msg" / "LampHot.msg", before)
        # Another target, or other sources, make no file needless.
        self.assertEqual(run("generate", lamp, "--to", "fidl", "-o", out)[0], 0)
        self.assertLessEqual(before.keys(), set(out.rglob("*")))
        # Another package does, and what was edited stays.
        edited = out / "car" / "package.xml"
        edited.write_text("mine\n")
        arguments = ["generate", lamp, "--to", "msg,routes", "-o", out, "--package", "lights"]
        status, _, errors = run(*arguments)
        self.assertEqual(status, 0, errors)
        self.assertIn(f"removed {out / 'car' / 'msg' / 'LampHot.msg'}\n", errors)
        self.assertIn(f"kept {edited}, which is no longer made: it was edited", errors)
        self.assertNotIn("house", errors)
        self.assertEqual(list((out / "car").iterdir()), [edited])
        self.assertTrue((out / "lights" / "msg" / "LampHot.msg").exists())
        self.assertTrue((out / "house" / "msg" / "BellHot.msg").exists())
        # It is named until somebody removes it or takes it for good.
        self.assertIn(f"kept {edited}", run(*arguments, "-q")[2])
        edited.write_bytes(before[edited])
        self.assertIn(f"removed {edited}\n", run(*arguments, "-q")[2])
        self.assertFalse((out / "car").exists())

    def test_takes_a_dash_for_standard_output(self):
        printed = run("generate", DOOR, "--to", "json")
        self.assertEqual(run("generate", DOOR, "--to", "json", "-o", "-", cwd=self.folder), printed)
        self.assertEqual(printed[0], 0)
        status, output, errors = run("generate", DOOR, "--to", "msg", "-o", "-", cwd=self.folder)
        self.assertEqual((status, output), (2, ""))
        self.assertIn("-o: a folder is needed: there is more than one file to write", errors)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_tells_whose_kept_id_something_else_has_now(self):
        lamp = self.folder / "Lamp.fidl"
        lamp.write_text("package car\ninterface Lamp { version { major 1 minor 0 } method turn {} method off {} }\n")
        self.assertEqual(run("generate", lamp, "--to", "routes", "-o", self.folder, "-q"), (0, "", ""))
        lamp.with_suffix(".fdepl").write_text(
            'import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl"\nimport "Lamp.fidl"\n'
            "define org.genivi.commonapi.someip.deployment for interface car.Lamp { method off { SomeIpMethodID = 1 } }\n")
        both = [lamp, lamp.with_suffix(".fdepl")]
        status, _, errors = run("decode", "--hex", "--interfaces", *both, input="")
        self.assertEqual(status, 0, errors)
        self.assertIn(f"note: car.Lamp.turn has had the id 0x0001 in {self.folder / 'ids.lock'}, which something else has now: 0x0003 is taken\n", errors)
        for command in (["explain", *both], ["generate", *both, "--to", "json"]):
            self.assertIn("Lamp.turn has had the id 0x0001, which off has now: 0x0003 is taken", run(*command)[2])
        routes = self.folder / "own.yaml"
        routes.write_text("someip: {address: 127.0.0.1}\ninterfaces: [Lamp.fidl, Lamp.fdepl]\ngenerate: all\n")
        self.assertIn("Lamp.turn has had the id 0x0001, which off has now: 0x0003 is taken", run("check", routes)[2])

    def test_sees_its_sources_from_a_folder_that_is_not_there_yet(self):
        (self.folder / "Lamp.fidl").write_text("package car\ninterface Lamp { version { major 1 minor 0 } broadcast hot { } }\n")
        done = subprocess.run([program, "generate", "Lamp.fidl", "--to", "routes", "-o", "new", "-q"], cwd=self.folder)
        self.assertEqual(done.returncode, 0)
        text = (self.folder / "new/bridge.yaml").read_text()
        self.assertIn("../Lamp.fidl", text)
        self.assertNotIn(str(self.folder), text)

    def test_changes_nothing_the_second_time(self):
        bare = self.folder / "Lamp.fidl"
        bare.write_text("package car\ninterface Lamp { version { major 1 minor 0 } method on { } broadcast hot { } }\n")
        arguments = ["generate", bare, "--to", "routes,fidl", "-o", self.folder / "out"]
        self.assertEqual(run(*arguments)[0], 0)
        before = {path: (path.read_text(), path.stat().st_mtime_ns) for path in (self.folder / "out").iterdir()}
        self.assertIn("car.Lamp", (self.folder / "out" / "ids.lock").read_text())
        status, _, errors = run(*arguments)
        self.assertEqual(status, 0, errors)
        self.assertNotIn("wrote", errors)
        self.assertEqual({path: (path.read_text(), path.stat().st_mtime_ns) for path in (self.folder / "out").iterdir()}, before)

    def test_does_not_read_what_it_wrote(self):
        """Into the folder that it reads: the second time there is the same, and no service more."""
        folder = self.door()
        for _ in range(2):
            arguments = ["generate", folder, "--to", "routes,msg,fidl,vsomeip,arxml,json", "-o", folder / "gen"]
            status, _, errors = run(*arguments)
            self.assertEqual(status, 0, errors)
        self.assertRegex(errors, rf"{folder}: .*warning: .*has \d+ files that `trestle generate` wrote, which are left out")
        self.assertEqual([line for line in errors.splitlines() if line.startswith("wrote")], [])
        services = json.loads((folder / "gen" / "model.json").read_text())["services"]
        self.assertEqual([service["name"] for service in services], ["Door"])
        # A route file beside them.
        routes = folder / "own.yaml"
        routes.write_text("someip: {address: 127.0.0.1}\ninterfaces: [.]\ngenerate: all\n")
        status, output, errors = run("check", routes)
        self.assertEqual(status, 0, errors)
        self.assertIn("5 routes, 8 methods", output)
        self.assertEqual(errors.count("`trestle generate` wrote"), 1, errors)
        # What is named is read.
        status, _, errors = run("generate", folder / "gen" / "interfaces.arxml", "--to", "json")
        self.assertEqual(status, 0, errors)
        status, _, errors = run("generate", folder / "gen" / "model.json", "--to", "json")
        self.assertEqual(status, 2)
        self.assertIn("model.json:1:1: error: this is a model that `trestle generate --to json` wrote", errors)

    def test_writes_no_file_over_a_source(self):
        folder = self.door()
        self.assertEqual(run("generate", folder, "--to", "fidl", "-o", folder / "gen", "-q")[0], 0)
        made = {path: path.read_text() for path in (folder / "gen").rglob("*")}
        file = next(path for path in made if path.suffix == ".fidl")
        status, _, errors = run("generate", folder / "gen", "--to", "fidl", "-o", folder / "gen")
        self.assertEqual(status, 2, errors)
        self.assertIn("is a source, and would be written over: expected another folder", errors)
        self.assertIn(file.name, errors)
        self.assertEqual({path: path.read_text() for path in (folder / "gen").rglob("*")}, made)

    def test_writes_no_file_over_what_a_source_imports(self):
        folder = self.door()
        self.assertEqual(run("generate", folder, "--to", "fidl", "-o", folder / "gen", "-q")[0], 0)
        made = next((folder / "gen").rglob("*.fidl"))
        own = folder / "own"
        own.mkdir()
        (own / made.name).write_text("package a interface I { version { major 1 minor 0 } method m { } }")
        (own / "main.fidl").write_text(f'package {made.stem} import model "{made.name}" '
                                       "interface J extends a.I { version { major 1 minor 0 } }")
        status, _, errors = run("generate", own / "main.fidl", "--to", "fidl", "-o", own)
        self.assertEqual(status, 2, errors)
        self.assertIn(f"{made.name} is a source, and would be written over", errors)
        self.assertIn("interface I", (own / made.name).read_text())

    def test_tells_of_contradicting_deployments(self):
        """FIDL, FDEPL and vsomeip JSON of one service, with values that cannot both be true."""
        folder = self.door()
        config = folder / "car.json"
        config.write_text(json.dumps({"unicast": "192.168.1.77", "services": [
            {"service": "0x4711", "instance": "1", "unreliable": "31999", "reliable": {"port": "31998"}}]}, indent=1))
        status, output, errors = run("generate", folder, "--to", "json")
        self.assertEqual(status, 0, errors)
        self.assertRegex(errors, r"car.json:\d+:\d+: warning: instance 0x0001 of car.Door has the UDP port 31999 here, but \d+ at \S*Door.fdepl:\d+:\d+: 31999, of the configuration of vsomeip, is taken")
        self.assertEqual(json.loads(output)["services"][0]["instances"][0]["udp_port"], 31999)
        # Two deployments of one instance.
        config.unlink()
        text = (folder / "Door.fdepl").read_text()
        (folder / "Other.fdepl").write_text(re.sub(r"(UnicastPort *= *)\d+", r"\g<1>31997", text))
        status, _, errors = run("generate", folder, "--to", "json")
        self.assertEqual(status, 2, errors)
        self.assertRegex(errors, r"Other.fdepl:\d+:\d+: error: instance 0x0001 of car.Door has the (UDP|TCP) port 31997 here, but \d+ at \S*Door.fdepl")

    def test_reads_what_it_writes(self):
        for target, file in (("fidl", "."), ("arxml", "interfaces.arxml")):
            out = self.folder / target
            self.assertEqual(run("generate", DOOR, "--to", target, "-o", out, "-q")[0], 0)
            (out / "ids.lock").unlink(missing_ok=True)
            status, output, errors = run("generate", out / file, "--to", "json")
            self.assertEqual(status, 0, errors)
            service = json.loads(output)["services"][0]
            self.assertEqual([method["id"] for method in service["methods"]], ["0x0010", "0x0011", "0x0012"], target)

    def test_writes_the_arxml_of_the_example(self):
        out = self.folder / "out"
        self.assertEqual(run("generate", SEAT / "Seat.fidl", SEAT / "Seat.fdepl", "--to", "arxml", "-o", out, "-q")[0], 0)
        self.assertEqual((out / "interfaces.arxml").read_text(), (SEAT / "seat.arxml").read_text())

    def test_makes_the_same_bridge_of_fidl_and_of_arxml(self):
        summaries = []
        text = (SEAT / "bridge.yaml").read_text()
        for names in ("Seat.fidl, Seat.fdepl", "seat.arxml"):
            file = self.folder / "bridge.yaml"
            files = ", ".join(str(SEAT / name) for name in names.split(", "))
            file.write_text(text.replace("[Seat.fidl, Seat.fdepl]", f"[{files}]"))
            status, output, _ = run("check", file)
            self.assertEqual(status, 0)
            self.assertIn("7 routes, 11 methods", output)
            summaries.append(output)
        self.assertEqual(summaries[0], summaries[1])
        out = self.folder / "msg"
        packages = []
        for files in ((SEAT / "Seat.fidl", SEAT / "Seat.fdepl"), (SEAT / "seat.arxml",)):
            self.assertEqual(run("generate", *files, "--to", "msg", "-o", out, "-q")[0], 0)
            packages.append({path: path.read_text() for path in out.rglob("*.*") if path.suffix in (".msg", ".srv")})
        self.assertEqual(packages[0], packages[1])

    def test_says_what_is_not_carried(self):
        status, _, errors = run("generate", DOOR, "--to", "arxml", "-o", self.folder / "out")
        self.assertEqual(status, 0)
        self.assertRegex(errors, r"Door.fidl:\d+:\d+: not carried to arxml: Door.open: ")

    def test_tells_all_errors_with_their_places(self):
        folder = self.door(Door_fidl=[("attribute Boolean locked", "attribute Bolean locked"), ("Speed speed\n            UInt8", "Sped speed\n            UInt8")])
        status, output, errors = run("generate", folder, "--to", "json")
        self.assertEqual((status, output), (2, ""))
        self.assertRegex(errors, r"Door.fidl:\d+:\d+: error: .*Bolean")
        self.assertRegex(errors, r"Door.fidl:\d+:\d+: error: .*Sped")
        # Those of ids, too, of the FDEPL and of ids.lock, and what contradicts.
        fdepl = (folder / "Door.fdepl").read_text().replace("0x4711", "0xffff").replace("0x0011", "0x0010")
        (folder / "Door.fdepl").write_text(fdepl)
        (folder / "Other.fdepl").write_text(fdepl.replace("UnicastPort = 30711", "UnicastPort = 31997"))
        (folder / "ids.lock").write_text("services:\n  - {name: car.Lamp, id: 0xffff}\n")
        errors = run("generate", folder, "--to", "json")[2]
        for wrong in (r"Door.fidl:\d+:\d+: error: .*Bolean", r"Door.fdepl:5:\d+: error: service Door has the id 0xffff",
                      r"Door.fdepl:30:\d+: error: Door.shut has the id 0x0010 of Door.open", r"ids.lock:2:\d+: error: service car.Lamp has the id 0xffff",
                      r"Other.fdepl:49:\d+: error: instance 0x0001 of car.Door has the UDP port 31997 here, but 30711 at \S*Door.fdepl:49:"):
            self.assertRegex(errors, wrong)
            self.assertEqual(len(re.findall(wrong, errors)), 1, errors)

    def test_refuses_what_makes_no_sense(self):
        status, _, errors = run("generate", DOOR, "--to", "rotes", "-o", self.folder)
        self.assertEqual(status, 2)
        self.assertIn("did you mean 'routes'?", errors)
        status, _, errors = run("generate", DOOR, "--to", "fidl")
        self.assertEqual(status, 2)
        self.assertIn("-o", errors)
        status, _, errors = run("generate", self.folder / "none.fidl", "--to", "json")
        self.assertEqual(status, 2)
        self.assertIn("none.fidl: error: cannot be read", errors)

    def test_writes_no_file_where_there_is_nothing_to_write(self):
        capture = source / "pcaps" / "vsomeip" / "field_getter_setter_notifier.pcap"
        for target in ("routes", "msg"):
            out = self.folder / target
            status, _, errors = run("generate", capture, "--to", target, "-o", out)
            self.assertEqual(status, 1, errors)
            self.assertEqual([path.name for path in out.rglob("*") if path.name != "ids.lock"], [])
            self.assertIn(f"nothing to write to {target}: the sources have ids and no types; add what describes", errors)
            lines = [line for line in errors.splitlines() if "event_8010" in line]
            self.assertEqual(len(lines), 1, errors)

    def test_mixes_a_description_with_what_vsomeip_protects(self):
        protected = [{"service_id": "0x4711", "event_id": id, "profile": "P04", "variant": "protector", "data_id": str(data)} for data, id in enumerate(("0x8010", "0x0010", "0x8001", "0x0001"), 1)]
        file = self.folder / "e2e.json"
        file.write_text(json.dumps({"e2e": {"e2e_enabled": "true", "protected": protected}}))
        status, output, errors = run("generate", DOOR, file, "--to", "json")
        self.assertEqual(status, 0, errors)
        found = []

        def look(node):
            if isinstance(node, dict):
                found.extend(value["data_id"] for key, value in node.items() if key.endswith("e2e"))
                for value in node.values():
                    look(value)
            elif isinstance(node, list):
                for value in node:
                    look(value)

        look(json.loads(output)["services"])
        self.assertEqual(sorted(found), [1, 2, 3, 4])

    def test_diff_takes_what_vsomeip_does_not_say_for_unknown(self):
        out = self.folder / "out"
        self.assertEqual(run("generate", DOOR, "--to", "vsomeip", "-o", out, "-q")[0], 0)
        status, output, errors = run("diff", DOOR, out)
        self.assertEqual(status, 0, output + errors)
        self.assertIn("changes: 0,", output)

    def test_diff_takes_ids_that_nobody_gave_for_unknown(self):
        for sources in ((DOOR, DOOR / "Door.fidl"), (DOOR / "Door.fidl", DOOR)):
            status, output, errors = run("diff", *sources)
            self.assertEqual(status, 0, output + errors)
            self.assertIn("changes: 0,", output)
            self.assertIn(f"\nids not compared: {DOOR / 'Door.fidl'} does not give all those of Door\n", output)
        self.assertNotIn("ids not compared", run("diff", DOOR, DOOR)[1])
        # A method in front of others does not change them.
        more = self.folder / "Door.fidl"
        more.write_text((DOOR / "Door.fidl").read_text().replace("    method open", "    method knock fireAndForget {\n    }\n    method open"))
        status, output, errors = run("diff", DOOR / "Door.fidl", more)
        self.assertEqual((status, errors), (0, ""), output)
        self.assertRegex(output, r"^\S*Door.fidl:\d+:\d+: method-added Door.knock \(.*\)\nchanges: 1,")
        # What a FDEPL says of the bytes, and a FIDL alone does not, is told once.
        wide = self.door(Door_fdepl=[("    method open {", "    method open {\n        SomeIpReliable = true"),
                                     ("        SomeIpMethodID = 0x0012", "        SomeIpMethodID = 0x0012\n        in { tune { SomeIpStringLengthWidth = 2 } }"),
                                     ("SomeIpSetterID = 0x0005", "SomeIpSetterID = 0x0005\n        SomeIpAttributeReliable = true")])
        for sources in ((wide, DOOR / "Door.fidl"), (DOOR / "Door.fidl", wide)):
            status, output, errors = run("diff", *sources)
            self.assertEqual(status, 0, output + errors)
            self.assertRegex(output, r"^.*deployment-missing Door: .*\n.*changes: 1, of these 0 break")
        status, output, _ = run("diff", DOOR, wide)
        self.assertEqual(status, 1)
        self.assertIn("layout Door.ring.request.tune", output)

    def test_diff_takes_what_a_capture_and_a_configuration_leave_out_for_unknown(self):
        ids = ["0x8010", "0x8011"]
        described = {"service": "0x1234", "instance": "0x5678", "unreliable": "30501"}
        with_events = dict(described, events=[{"event": ids[0]}, {"event": ids[1], "is_reliable": "true"}], eventgroups=[{"eventgroup": "0x4470", "events": ids[:1]}, {"eventgroup": "0x4471", "events": ids[1:]}])
        bare, full = self.folder / "bare.json", self.folder / "full.json"
        bare.write_text(json.dumps({"unicast": "127.0.0.1", "services": [described]}))
        full.write_text(json.dumps({"unicast": "127.0.0.1", "services": [with_events]}))
        seen, others = [source / "pcaps" / "vsomeip" / f"{name}.pcap" for name in ("field_getter_setter_notifier", "sd_many_services_many_entries")]
        pairs = [(old, new) for old in (bare, full, seen) for new in (bare, full, seen)]
        for old, new in [*pairs, (full, others), (seen, others), (others, seen)]:
            status, output, errors = run("diff", old, new)
            self.assertEqual(status, 0, f"{old} {new}\n{output}{errors}")
        # What a capture shows, and a configuration of all events does not have.
        with_events["events"], with_events["eventgroups"] = [{"event": ids[0]}], []
        full.write_text(json.dumps({"unicast": "127.0.0.1", "services": [with_events]}))
        status, output, _ = run("diff", seen, full)
        self.assertEqual(status, 1)
        self.assertIn("event-removed service_1234.event_8011", output)

    def test_diff_finds_nothing_that_breaks_in_our_own_arxml(self):
        out = self.folder / "out"
        self.assertEqual(run("generate", DOOR, "--to", "arxml", "-o", out, "-q")[0], 0)
        status, output, errors = run("diff", DOOR, out)
        self.assertEqual(status, 0, output + errors)
        self.assertNotIn("service-renamed", output)

    def test_reads_a_capture(self):
        status, output, errors = run("generate", source / "pcaps" / "vsomeip" / "rr_udp.pcap", "--to", "json")
        self.assertEqual(status, 0, errors)
        self.assertEqual(json.loads(output)["services"][0]["id"], "0x1234")

    def test_reads_types_by_their_names(self):
        status, output, errors = run("generate", "sensor_msgs/msg/PointCloud2", "--to", "json", "--service-id", "0x1234")
        self.assertEqual(status, 0, errors)
        service = json.loads(output)["services"][0]
        self.assertEqual((service["scope"], service["name"], service["id"]), ("sensor_msgs", "PointCloud2Service", "0x1234"))
        out = self.folder / "points"
        status, _, errors = run("generate", "sensor_msgs/msg/PointCloud2", "--to", "routes,msg", "-o", out)
        self.assertEqual(status, 0, errors)
        self.assertIn("nothing to write to msg: ROS 2 has all types already", errors)
        self.assertEqual(run("check", out / "bridge.yaml")[0], 0)
        status, _, errors = run("generate", "car_msgs/msg/None", "--to", "json")
        self.assertEqual(status, 2)
        self.assertIn("car_msgs", errors)

    def test_reads_files_of_ros(self):
        types = self.folder / "car_msgs" / "msg"
        types.mkdir(parents=True)
        (types / "Door.msg").write_text("bool open\nWindow[] windows\n")
        (types / "Window.msg").write_text("float32 height\n")
        out = self.folder / "out"
        status, _, errors = run("generate", types / "Door.msg", "--to", "fidl,routes", "-o", out)
        self.assertEqual(status, 0, errors)
        self.assertIn("broadcast door", "".join(file.read_text() for file in out.rglob("*.fidl")))
        self.assertIn("direction: dds_to_someip", (out / "bridge.yaml").read_text())
        ids = (out / "ids.lock").read_text()
        (types / "Door.msg").write_text("bool open\nWindow[] windows\nuint8 more\n")
        status, _, errors = run("generate", types / "Door.msg", "--to", "fidl,routes", "-o", out)
        self.assertEqual(status, 0, errors)
        self.assertIn("unchanged", errors)  # the routes: ids and types are the same
        self.assertEqual((out / "ids.lock").read_text(), ids)

    def test_reads_a_route_file(self):
        status, output, errors = run("generate", DOOR / "bridge.yaml", "--to", "json")
        self.assertEqual(status, 0, errors)
        self.assertEqual([method["name"] for method in json.loads(output)["services"][0]["methods"]], ["open", "shut", "ring"])
        self.assertEqual(run("generate", DOOR, "--to", "routes,msg", "-o", self.folder / "out", "-q")[0], 0)
        status, output, errors = run("generate", self.folder / "out" / "bridge.yaml", "--to", "json")
        self.assertEqual(status, 0, errors)
        service = json.loads(output)["services"][0]
        self.assertEqual((service["name"], service["id"]), ("Door", "0x4711"))
        self.assertEqual([method["id"] for method in service["methods"]], ["0x0010", "0x0011", "0x0012"])
        self.assertEqual([field["name"] for field in service["fields"]], ["opening", "label", "locked"])

    def check_routes(self, *arguments):
        """What --to routes writes, which `check` takes."""
        out = self.folder / f"out{len(list(self.folder.iterdir()))}"
        status, _, errors = run("generate", *arguments, "-o", out)
        self.assertEqual(status, 0, errors)
        file = out / "bridge.yaml"
        status, output, errors = run("check", file)
        self.assertEqual(status, 0, file.read_text() + output + errors)
        return file.read_text()

    def test_writes_routes_whose_types_are_found(self):
        types = self.folder / "car_msgs"
        (types / "msg").mkdir(parents=True)
        (types / "srv").mkdir()
        (types / "msg" / "Door.msg").write_text("bool open\nwindow_msgs/Window[] windows\n")
        (types / "srv" / "Shut.srv").write_text("uint8 speed\n---\nbool done\n")
        others = self.folder / "others"
        (others / "window_msgs" / "msg").mkdir(parents=True)
        (others / "window_msgs" / "msg" / "Window.msg").write_text("float32 height\n")
        files = [types / "msg" / "Door.msg", types / "srv" / "Shut.srv", "--types", others]
        for target in ("routes", "routes,msg"):
            text = self.check_routes(*files, "--to", target)
            self.assertIn("car_msgs/msg/Door", text)
            self.assertIn("car_msgs/srv/Shut", text)
            self.check_routes(types, "--types", others, "--to", target)
            self.check_routes(types, DOOR, "--types", others, "--to", target)
            # Names of types that ROS has are no files.
            self.assertNotIn("interfaces", self.check_routes("sensor_msgs/msg/PointCloud2", "--to", target))

    def test_writes_actions_and_services_without_arguments(self):
        types = self.folder / "my_msgs"
        (types / "action").mkdir(parents=True)
        (types / "action" / "Count.action").write_text("int32 order\n---\nint32[] result\n---\nint32[] partial\n")
        for target in ("routes", "routes,msg"):
            text = self.check_routes(types / "action" / "Count.action", "std_srvs/srv/Empty", "--to", target)
            self.assertIn("action: /count", text)
            self.assertIn("type: my_msgs/action/Count", text)
            self.assertRegex(text, r"methods: {send_goal: 0x0001, cancel_goal: 0x0002, get_result: 0x0003}")
            self.assertRegex(text, r"events: {feedback: 0x8001, status: 0x8002}")
            self.assertNotIn("_action/", text)
            # A node calls it by its own type, which no argument tells.
            self.assertIn("type: std_srvs/srv/Empty\n", text)
        # And back again.
        file = self.folder / "again.yaml"
        file.write_text(text.replace("paths: [.]", "paths: []").replace("../my_msgs", "my_msgs"))
        self.assertIn("action: /count", self.check_routes(file, "--to", "routes"))

    def test_keeps_no_ids_where_nothing_is_written(self):
        status, _, errors = run("generate", "std_srvs/srv/Empty", "--to", "msg", "-o", self.folder / "none")
        self.assertEqual(status, 0, errors)
        self.assertIn("ROS 2 has all types already", errors)
        self.assertFalse((self.folder / "none").exists())

    def test_writes_routes_of_a_route_file(self):
        types = self.folder / "types" / "car_msgs" / "msg"
        types.mkdir(parents=True)
        (types / "Door.msg").write_text("bool open\n")
        file = self.folder / "routes.yaml"
        file.write_text("someip: {address: 127.0.0.1}\ntypes: {paths: [types]}\nroutes:\n"
                        "  - {topic: /door/moved, type: car_msgs/msg/Door, direction: someip_to_dds, service: 0x4711, instance: 1,\n"
                        "     eventgroup: 2, event: 0x8001}\n")
        for target in ("routes", "routes,msg"):
            self.assertNotIn("routes.yaml]", self.check_routes(file, "--to", target))
            self.check_routes(DOOR / "bridge.yaml", "--to", target)
        self.assertEqual(run("generate", DOOR, "--to", "routes,msg", "-o", self.folder / "made", "-q")[0], 0)
        for target in ("routes", "routes,msg"):
            self.check_routes(self.folder / "made" / "bridge.yaml", "--to", target)

    def test_wants_the_messages_where_their_names_are_new(self):
        lamp = self.folder / "Lamp.fidl"
        lamp.write_text("package car\ninterface Lamp { version { major 1 minor 0 } broadcast hot { out { UInt8 x } } }\n")
        status, _, errors = run("generate", lamp, "--to", "routes", "--name", "Light", "-o", self.folder / "light")
        self.assertEqual(status, 2)
        self.assertIn("expected `--to routes,msg`", errors)
        self.assertIn("car/msg/LightHot", self.check_routes(lamp, "--to", "routes,msg", "--name", "Light"))
        self.check_routes(lamp, "--to", "routes", "--service-id", "0x1234")

    def test_listens_to_a_network(self):
        # To one of its own: what other tests say on loopback is not meant.
        alone = ["unshare", "--net", *([] if os.geteuid() == 0 else ["--map-root-user"])]
        if subprocess.run([*alone, "ip", "link", "set", "lo", "up"], stderr=subprocess.DEVNULL).returncode != 0:
            self.skipTest("no network namespace may be made")
        script = """ip link set lo up && {
            "$0" offer 0x1234.0x0001 --address 127.0.0.1 >/dev/null 2>&1 &
            "$0" generate network:127.0.0.1 --for "$1" --to json
            status=$?; kill $!; wait $!; exit $status; }"""
        for seconds in (3, 10, 30):  # until the machine lets them meet
            done = subprocess.run([*alone, "sh", "-c", script, program, str(seconds)], capture_output=True, text=True, timeout=120)
            if "0x1234" in done.stdout:
                break
        self.assertEqual(done.returncode, 0, done.stderr)
        service, = json.loads(done.stdout)["services"]
        self.assertEqual((service["id"], service["instances"][0]["address"]), ("0x1234", "127.0.0.1"))

    def test_says_what_in_a_ros_graph_only_bridges_have(self):
        file = self.folder / "bridge.yaml"
        file.write_text(head() + f"interfaces: [{DOOR}]\nroutes: [{{someip: Door.moved, topic: /moved}}]\n")
        with open(self.folder / "log", "w+", encoding="utf-8") as log:
            bridge = subprocess.Popen([program, "bridge", file], stdout=subprocess.DEVNULL, stderr=log)
            try:
                log_until(log, "Ctrl-C stops")
                for seconds in ("2", "10", "30"):  # until the machine lets them meet
                    status, output, errors = run("generate", f"ros:{DOMAIN}", "--to", "json", "--for", seconds)
                    if "left out" in errors:
                        break
                self.assertIn("warning: left out: /moved: only bridges publish or serve it, so SOME/IP has it already; name it as a "
                              "SOURCE to make a service of it nevertheless", errors)
                self.assertNotIn("no topic, service or action was seen", errors)
                self.assertNotIn("oved", output)
                # Its type is that of the description.
                for seconds in ("2", "10", "30"):
                    status, output, errors = run("generate", "/moved", DOOR, "--to", "json", "--for", seconds,
                                                 env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)})
                    if "no node publishes" not in errors:
                        break
                self.assertNotIn("no node publishes", errors)
            finally:
                bridge.terminate()
                bridge.wait()

    def test_explains_bytes(self):
        status, output, errors = run("explain", "Door.open.response", DOOR)
        self.assertEqual(status, 0, errors)
        self.assertIn("Door.open response:", output)
        status, output, errors = run("explain", "geometry_msgs/msg/Point", "--values", "{y: 1.5}", "--json")
        self.assertEqual(status, 0, errors)
        self.assertEqual(json.loads(output)[0]["ranges"][1]["value"], "1.5")
        # The names and words that `call` takes.
        for name in ("Door.label.set", "Door.0x0001.label.get", "car.Door.label.notify", "Door.Speed"):
            status, output, errors = run("explain", name, DOOR)
            self.assertEqual(status, 0, errors)
        status, output, errors = run("explain", "Door.open", DOOR, "--values", "{speed: FAST, opening: 80}", "--json")
        self.assertEqual(status, 0, errors)
        self.assertIn("FAST", output)
        status, output, errors = run("explain", "Door", DOOR)
        self.assertEqual(status, 0, errors)
        self.assertIn("method  open", output)
        status, output, errors = run("explain", "car.Door", DOOR, "--json")
        self.assertEqual(json.loads(output)["service"], "car.Door")
        status, _, errors = run("explain", "Door", DOOR, "--values", "{speed: FAST}")
        self.assertEqual(status, 2)
        self.assertIn("Door is a service", errors)
        status, _, errors = run("explain", "Door.opn", DOOR)
        self.assertEqual(status, 2)
        self.assertIn("did you mean 'Door.open'?", errors)

    def test_explains_all_that_there_is(self):
        listed = {}
        for name, sources in (("files", (DOOR / "Door.fidl", DOOR / "Door.fdepl")), ("folder", (DOOR,)), ("alone", (DOOR / "Door.fidl",))):
            status, listed[name], errors = run("explain", *sources)
            self.assertEqual(status, 0, errors)
            self.assertRegex(errors, "^note: ids are missing.* Add .*Door.fdepl, which was not given\n$" if name == "alone" else "^$")
        self.assertEqual(listed["files"], listed["folder"])
        self.assertRegex(listed["files"], r"^car.Door 0x4711, version 1.0:\n  method  open +0x0010 ")
        self.assertRegex(listed["files"], r"\ntypes:\n(.*\n)*  car.Door.Speed +enumeration\n")
        self.assertNotIn("chosen", listed["files"])
        self.assertIn("  method  open     0x0001 chosen", listed["alone"])
        # A folder of the name of an element is none of the sources.
        (self.folder / "Door").mkdir()
        status, output, errors = run("explain", "Door", DOOR / "Door.fidl", "--json", cwd=self.folder)
        self.assertEqual((status, json.loads(output)["service"]), (0, "car.Door"), errors)
        status, _, errors = run("explain", "Dor.fidl")
        self.assertEqual(status, 2)
        self.assertIn("There is no file of this name", errors)
        status, _, errors = run("explain", DOOR, "--values", "{speed: FAST}")
        self.assertEqual(status, 2)
        self.assertIn("which one?", errors)

    def test_explains_values_from_files_and_pipes(self):
        values = "speed: FAST\nopening: 80\n"
        status, expected, errors = run("explain", "Door.open", DOOR, "--values", "{speed: FAST, opening: 80}", "--json")
        self.assertEqual(status, 0, errors)
        file = self.folder / "values.yaml"
        file.write_text(values)
        for argument in ("-", "/dev/stdin", "@-"):
            status, output, errors = run("explain", "Door.open", DOOR, "--json", "--values", argument, input=values)
            self.assertEqual((status, output), (0, expected), errors)
            with file.open() as opened:
                status, output, errors = run("explain", "Door.open", DOOR, "--json", "--values", argument, stdin=opened)
                self.assertEqual((status, output), (0, expected), errors)
        for argument in (file, f"@{file}"):
            status, output, errors = run("explain", "Door.open", DOOR, "--json", "--values", argument)
            self.assertEqual((status, output), (0, expected), errors)
        # What is no YAML, and what is no value of the type.
        for text, place in (("speed: FAST\nopening: [80\n", "2:13"), ("speed: FAST\nopening: 800\n", "2:10")):
            status, _, errors = run("explain", "Door.open", DOOR, "--values", "-", input=text)
            self.assertEqual(status, 2)
            self.assertIn(f"error: standard input:{place}: ", errors)
            file.write_text(text)
            status, _, errors = run("explain", "Door.open", DOOR, "--values", file)
            self.assertIn(f"error: {file}:{place}: ", errors)
        status, _, errors = run("explain", "Door.open", DOOR, "--values", self.folder / "none.yaml")
        self.assertEqual(status, 2)
        self.assertIn("there is no file", errors)

    def test_takes_the_fidl_and_the_arxml_of_one_service_for_one(self):
        status, output, errors = run("explain", "Seat.adjust", SEAT)
        self.assertEqual(status, 0, errors)
        self.assertIn("Seat.adjust request:", output)
        status, output, errors = run("generate", SEAT, "--to", "json")
        self.assertEqual(status, 0, errors)
        self.assertEqual([service["name"] for service in json.loads(output)["services"]], ["Seat"])
        # Where they contradict, which file to name.
        folder = self.folder / "seat"
        folder.mkdir()
        for file in SEAT.iterdir():
            (folder / file.name).write_text(file.read_text())
        text = (folder / "Seat.fdepl").read_text()
        (folder / "Seat.fdepl").write_text(re.sub(r"(SomeIpMethodID = )\w+", r"\g<1>0x7001", text, count=1))
        status, _, errors = run("generate", folder, "--to", "json")
        self.assertEqual(status, 2)
        self.assertRegex(errors, r"seat.arxml:\d+:\d+: error: service .*Seat.fdepl:\d+:\d+: name one of the two files")

    def test_diff_says_what_breaks(self):
        status, output, _ = run("diff", DOOR, self.door())
        self.assertEqual(status, 0)
        self.assertIn("changes: 0,", output)
        status, output, _ = run("diff", DOOR, self.door(Door_fdepl=[("SomeIpMethodID = 0x0011", "SomeIpMethodID = 0x0013")]))
        self.assertEqual(status, 1)
        self.assertIn("method-id Door.shut: 0x0011 -> 0x0013", output)
        status, output, _ = run("diff", "--json", DOOR, self.door(Door_fidl=[("        FAST\n", "        FAST\n        FASTER\n")]))
        self.assertEqual(status, 0)
        self.assertEqual({change["rule"] for change in json.loads(output)}, {"enumerator-added"})

    def test_diff_lists_its_rules(self):
        for arguments, missing in (([], "OLD"), ([DOOR], "NEW")):
            status, output, errors = run("diff", *arguments)
            self.assertEqual((status, output), (2, ""))
            self.assertIn(f"{missing} is required", errors)
        status, output, _ = run("diff", "--rules")
        self.assertEqual(status, 0)
        self.assertIn("value-removed", output)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
