#!/usr/bin/env python3
"""The page of `trestle generate --ui` in a browser, as somebody uses it.

Usage: generate_page_test.py TRESTLE SOURCE_FOLDER [--screenshot FILE.png]

With --screenshot it only makes the picture of docs/describe.md. Without Chromium it is skipped (77); with
TRESTLE_REQUIRE_PEERS=1, or =chromium, it fails."""
import http.client
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent.parent), str(pathlib.Path(__file__).resolve().parent.parent / "web")]
from bridge_program import BRIDGE, DOMAIN, GROUP, HOST, PEER, log_until
from browser import PATIENCE, Browser, needs_browser

program, source = sys.argv[1], pathlib.Path(sys.argv[2])
DOOR = {name: (source / "examples" / "door" / name).read_text() for name in ("Door.fidl", "Door.fdepl")}
PAGE = HOST + "13"  # where the page calls from
ENVIRONMENT = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)}


class Program:
    """A command that runs until the end of the test. Its output is in a file."""

    def __init__(self, test, *arguments):
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen([program, *map(str, arguments)], stdout=self.log, stderr=subprocess.STDOUT, env=ENVIRONMENT)
        test.addCleanup(self.end)

    def end(self):
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait(PATIENCE)
        self.log.close()


def serve(test, *arguments):
    """Starts the page; returns its URL."""
    served = Program(test, "generate", "--ui", "--listen", "127.0.0.1:0", "--address", PAGE, "--multicast", GROUP, *arguments)
    log_until(served.log, "(Ctrl-C ends it)")
    served.log.seek(0)
    return re.search(r"http://127\.0\.0\.1:\d+/", served.log.read())[0]


def choose(browser, name):
    """Chooses an element of the tree by its keys alone."""
    browser.run("document.getElementById('tree').focus()")
    browser.keys("HOME")
    for _ in range(100):
        if browser.text("#tree [aria-selected=true] .row span").strip("▾▸ ") == name:
            return
        browser.keys("DOWN")
    raise AssertionError(f"not in the tree: {name}")


def edit(browser, key, text):
    """Types an id in place of that which is there."""
    browser.run("document.getElementById(arguments[0]).focus()", f"edit-{key}")
    browser.keys("CONTROL+a", text)


class Page(unittest.TestCase):
    def setUp(self):
        self.browser = Browser()
        self.addCleanup(self.browser.__exit__)

    def tearDown(self):
        # Errors, and whatever the policy of the page forbade.
        self.assertEqual(self.browser.log(), [])

    def test_from_a_dropped_file_to_a_running_bridge_and_a_call(self):
        browser = self.browser
        browser.open(serve(self))
        browser.wait_for_text("#state", "Drop FIDL")
        browser.drop(DOOR)
        browser.wait_for_text("#state", "1 service, 0 errors, 0 warnings")
        self.assertIn("0x4711", browser.text("#tree"))

        # An id, and what it changes.
        choose(browser, "Door")
        edit(browser, "id", "0x4712")
        browser.wait_for_text("#tree", "0x4712")
        browser.wait_for_text("#text", "0x4712")
        choose(browser, "open")
        edit(browser, "id", "0x11")
        browser.wait_for_text("#problems", "0x0011")  # of the method shut
        browser.wait_for_text("#text", "The files have errors")
        edit(browser, "id", "zebra")
        browser.wait_for_text("#fault-id", "a number from 0x0001 to 0xfffe")
        edit(browser, "id", "0x0021")
        browser.wait_for_text("#problems", "none")

        # Each target is there, in colours.
        for name in ("msg", "fidl", "vsomeip", "arxml", "wireshark", "sheet", "json", "routes"):
            browser.run("""[...document.querySelectorAll('#targets [role=tab]')].find((tab) => tab.textContent === arguments[0]).click()""", name)
            browser.wait(f"the target {name}", """
                const chosen = document.querySelector('#targets [aria-selected=true]');
                return chosen && chosen.textContent === arguments[0] && document.querySelector('#text span') !== null""", name)
        browser.wait_for_text("#text", "0x0021")

        # Bytes with values.
        choose(browser, "open")
        browser.wait_for_text("#values", "speed")
        browser.run("document.querySelector('#values select').focus()")
        browser.keys("DOWN")
        browser.run("document.querySelector('#values input').focus()")
        browser.keys("CONTROL+a", "300")
        browser.wait_for_text("#values .fault", "a whole number from 0 to 255")
        browser.keys("CONTROL+a", "85")
        browser.wait_for_text("#layout", "FAST (1)")
        browser.wait_for_text("#layout pre.hex", "01 55")

        # Downloads: one file, and all.
        browser.click("#save")
        self.assertIn("0x4712", pathlib.Path(browser.downloaded("bridge.yaml")).read_text())
        browser.click("#zip")
        folder = pathlib.Path(browser.downloads) / "all"
        with zipfile.ZipFile(browser.downloaded("interfaces.zip")) as archive:
            self.assertIsNone(archive.testzip())
            archive.extractall(folder)
        self.assertIn(f"SomeIpServiceID = {0x4712}", (folder / "car.fdepl").read_text())
        self.assertTrue((folder / "interfaces.arxml").exists())

        # The bridge with it, a device, and a call of its method from the page.
        device = Program(self, "offer", "0x4712.1", "--address", PEER, "--multicast", GROUP, "--method", "0x0021=00 01", "--method", "0x0012")
        route_file = folder / "bridge.yaml"
        route_file.write_text(route_file.read_text().replace(f"address: {PAGE}", f"address: {BRIDGE}"))
        bridge = Program(self, "bridge", route_file)
        log_until(bridge.log, "0x4712")
        end = time.monotonic() + PATIENCE
        while "done: true" not in browser.text("#result"):  # again, where the device is found later than a call lasts
            self.assertLess(time.monotonic(), end, browser.text("#result"))
            browser.click("#call-method")
            browser.wait("an answer, or none", "return ['good', 'bad'].includes(document.getElementById('result').className)")
        browser.wait_for_text("#layout", "OK (0)")
        log_until(device.log, "0x0021 0155")
        choose(browser, "ring")
        browser.wait_for_text("#values", "tune")
        browser.run("document.querySelector('#values input').focus()")
        browser.keys("chime", "ENTER")
        browser.wait_for_text("#result", "sent; no response is expected")
        self.assertIsNone(bridge.process.poll())

    def test_starts_with_files_and_survives_a_reload(self):
        browser = self.browser
        url = serve(self, source / "examples" / "door" / "Door.fdepl")
        browser.open(url)
        browser.wait_for_text("#state", "1 service, 0 errors")
        self.assertIn("Door.fidl", browser.text("#files"))  # which it imports
        choose(browser, "locked")
        edit(browser, "getter", "0x0099")
        browser.wait_for_text("#tree", "0x0099")
        # What is renamed stays chosen, and can be edited further.
        edit(browser, "name", "bolted")
        browser.wait_for_text("#tree", "bolted")
        edit(browser, "eventgroups", "0x0001, zebra")
        browser.wait_for_text("#fault-eventgroups", "ids with commas")
        edit(browser, "eventgroups", "7")
        browser.wait_for_text("#title", "Door.bolted")
        edit(browser, "setter", "0x0098")
        browser.wait_for_text("#tree", "0x0098")
        choose(browser, "Door")
        edit(browser, "name", "Gate")
        edit(browser, "major", "9")
        browser.wait_for_text("#text", "/gate/bolted")
        browser.wait_for_text("#text", "major: 9")
        browser.open(url)
        browser.wait_for_text("#tree", "0x0099")
        browser.wait_for_text("#tree", "bolted")
        browser.wait_for_text("#text", "eventgroup: 0x0007")
        browser.click("#clear")
        browser.wait_for_text("#state", "Drop FIDL")

    def test_tells_of_mistakes_with_their_places(self):
        browser = self.browser
        browser.open(serve(self))
        browser.drop({"Door.fidl": DOOR["Door.fidl"].replace("Speed speed", "Sped speed")})
        browser.wait_for_text("#problems", "Sped")
        self.assertRegex(browser.text("#problems"), r"Door\.fidl:\d+:\d+")
        browser.drop({"Far.fdepl": 'import "/etc/passwd"\n'})
        browser.wait_for_text("#problems", "it is not among the files; add it")
        self.assertNotIn("root:", browser.text("body"))

    def test_can_be_used_without_a_mouse(self):
        browser = self.browser
        browser.open(serve(self, source / "examples" / "door"))
        browser.wait_for_text("#state", "1 service")
        focus = "return document.activeElement.id || document.activeElement.textContent"
        browser.keys("TAB", "ENTER")  # "Skip to the services"
        browser.keys("TAB") if browser.run(focus) != "tree" else None
        self.assertEqual(browser.run(focus), "tree")
        browser.keys("DOWN", "ENTER")
        browser.wait("focus in the id", "return document.activeElement.id === 'edit-id'")
        seen = set()
        for _ in range(40):
            browser.keys("TAB")
            seen.add(browser.run(focus))
        self.assertLessEqual({"call-method", "routes", "output-file", "save", "zip", "text"}, seen)
        self.assertTrue(any(one.startswith("value-") for one in seen), seen)
        # The arrow keys go through the targets.
        browser.run("document.querySelector('#targets [aria-selected=true]').focus()")
        browser.keys("RIGHT")
        browser.wait_for_text("#targets [aria-selected=true]", "msg")
        self.assertEqual(browser.run(focus), "msg")
        # A service closes and opens.
        choose(browser, "Door")
        browser.keys("LEFT")
        browser.wait("a closed service", "return document.querySelectorAll('#tree li').length === 1")
        browser.keys("RIGHT")
        browser.wait("an open service", "return document.querySelectorAll('#tree li').length > 1")

    def test_is_dark_for_those_who_want_that(self):
        back = "return getComputedStyle(document.body).backgroundColor"
        self.browser.open(serve(self))
        light = self.browser.run(back)
        self.browser.ask("POST", "/goog/cdp/execute", {"cmd": "Emulation.setEmulatedMedia", "params": {
            "features": [{"name": "prefers-color-scheme", "value": "dark"}]}})
        self.assertNotEqual(self.browser.run(back), light)

    def test_answers_nobody_else(self):
        host = serve(self).removeprefix("http://").rstrip("/")

        def status(method, path, body=None, **headers):
            connection = http.client.HTTPConnection(host, timeout=PATIENCE)
            headers = {name.replace("_", "-"): value for name, value in headers.items()}
            connection.request(method, path, body, {"Content-Type": "application/json", **headers})
            return connection.getresponse().status

        question = json.dumps({"files": [], "edits": {}})
        self.assertEqual(status("POST", "/api/system", question), 200)
        self.assertEqual(status("POST", "/api/system", question, Origin="http://evil.example"), 403)
        self.assertEqual(status("POST", "/api/call", question, Origin="null"), 403)
        self.assertEqual(status("POST", "/api/call", question, Content_Type="text/plain"), 415)
        self.assertEqual(status("GET", "/api/start", Host="evil.example"), 403)
        self.assertEqual(status("GET", "/etc/passwd"), 404)
        self.assertEqual(status("GET", "/..%2f..%2f..%2fetc/passwd"), 404)
        self.assertEqual(status("GET", "//etc/passwd"), 404)


def make_picture(file):
    """The page with the door of the examples, for the documents."""
    test = unittest.TestCase()
    try:
        with Browser(1500, 980) as browser:
            browser.open(serve(test, "examples/door/Door.fidl", "examples/door/Door.fdepl"))
            browser.wait_for_text("#state", "1 service")
            Program(test, "offer", "0x4711.1", "--address", PEER, "--multicast", GROUP, "--method", "0x0010=00 01")
            choose(browser, "open")
            browser.wait_for_text("#values", "speed")
            browser.run("document.querySelector('#values select').focus()")
            browser.keys("DOWN")
            browser.run("document.querySelector('#values input').focus()")
            browser.keys("CONTROL+a", "80")
            browser.wait_for_text("#layout", "FAST (1)")
            browser.run("""[...document.querySelectorAll('#targets [role=tab]')].find((tab) => tab.textContent === 'fidl').click()""")
            browser.wait_for_text("#text", "interface Door")
            browser.run("document.activeElement.blur()")
            browser.screenshot(file)
    finally:
        test.doCleanups()


if __name__ == "__main__":
    needs_browser()
    if "--screenshot" in sys.argv:
        file = pathlib.Path(sys.argv[sys.argv.index("--screenshot") + 1]).resolve()
        program = str(pathlib.Path(program).resolve())
        os.chdir(source)
        make_picture(file)
    else:
        unittest.main(argv=sys.argv[:1])
