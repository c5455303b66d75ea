#!/usr/bin/env python3
"""The page of `trestle bridge --console` in a browser, with peers that are programs of their own.

Usage: console_page_test.py TRESTLE [--screenshot FILE.png]

With --screenshot it only makes the picture of docs/console.md. Without Chromium it is skipped (77); with
TRESTLE_REQUIRE_PEERS=1, or =chromium, it fails."""
import contextlib
import http.client
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent.parent), str(HERE.parent), str(HERE.parent / "web")]
from bridge_program import BRIDGE, DOMAIN, GROUP, PEER, head, log_until
from browser import ELEMENT, PATIENCE, Browser, needs_browser

program = sys.argv[1]
ENVIRONMENT = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)}
POINT = "geometry_msgs/msg/Point"
LATCHED = ", qos: {durability: transient_local}"  # so that it is carried though nobody reads it
FOCUS = "return document.activeElement.id || document.activeElement.textContent"


def route(topic, service, direction="someip_to_dds", kind=POINT, more=""):
    return (f"  - {{topic: {topic}, type: {kind}, direction: {direction}, service: {service:#06x}, instance: 0x0001, "
            f"eventgroup: 0x0001, event: 0x8001{more}}}\n")


class Program:
    """A command that runs until the end of the test, or until it is ended. Its output is in a file."""

    def __init__(self, test, *arguments, environment=None):
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen([program, *map(str, arguments)], stdout=self.log, stderr=subprocess.STDOUT,
                                        env={**ENVIRONMENT, **(environment or {})})
        test.addCleanup(self.close)

    def end(self):
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait(PATIENCE)

    def close(self):
        self.end()
        self.log.close()

    def text(self):
        self.log.seek(0)
        return self.log.read()


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


def bridge(test, routes, token="", records=False):
    """Starts a bridge with a console, which has a `url`, and a folder for `records`."""
    folder = tempfile.TemporaryDirectory()
    test.addCleanup(folder.cleanup)
    file = pathlib.Path(folder.name) / "drive.yaml"
    (file.parent / "token").write_text(token)
    (file.parent / "records").mkdir()
    port = free_port()
    more = (", token_file: token" if token else "") + (", records: records" if records else "")
    file.write_text(head() + f"console: {{address: 127.0.0.1:{port}{more}}}\nroutes:\n" + routes)
    started = Program(test, "bridge", file)
    started.url, started.records = f"http://127.0.0.1:{port}/", file.parent / "records"
    log_until(started.log, f"console: {started.url}\n")
    return started


def notify(test, service, payload, kind=""):
    """A SOME/IP server that sends an event ten times a second: bytes, or values of a type."""
    return Program(test, "notify", f"{service:#06x}.1", "1", "0x8001", payload, "--address", PEER, "--multicast", GROUP, "--rate", "10",
                   *(["--type", kind] if kind else []))


def png(width, height, colour):
    """A picture of one colour. (W3C's PNG specification)"""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = (b"\0" + bytes(colour) * width) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class Page(unittest.TestCase):
    def setUp(self):
        self.browser = Browser()
        self.addCleanup(self.browser.__exit__)

    def tearDown(self):
        # Errors, and whatever the policy of the page forbade.
        expected = ("401 (Unauthorized)", "net::ERR_CONNECTION", "net::ERR_EMPTY_RESPONSE")  # of a bridge that ends
        self.assertEqual([one for one in self.browser.log() if not any(text in one for text in expected)], [])

    def test_has_the_names_of_interface_descriptions(self):
        browser = self.browser
        door = HERE.parent.parent.parent / "examples" / "door"
        url = bridge(self, f"  - {{someip: Door.moved, topic: /moved}}\ninterfaces: [{door}]\n").url
        browser.open(url)
        browser.wait_for_text("#graph", "Door.0x0001")
        browser.wait_for_text("#graph", "moved")
        browser.run("[...document.querySelectorAll('#graph a')][0].dispatchEvent(new MouseEvent('click', {bubbles: true}))")
        browser.wait_for_text("#route h2", "/moved ← Door.0x0001.moved waiting")
        browser.wait_for_text("#route", "Door.0x0001.moved, version 1.any; UDP; eventgroup 0x0002 (moved, blocked)")

    def wait_for_edges(self, bad, good):
        """Until there are so many edges that say why nothing flows, and such where something does."""
        self.browser.wait(f"{bad} edges that say why nothing flows, and {good} on which something does",
                          "return document.querySelectorAll('#graph .edge.bad').length === arguments[0]"
                          " && document.querySelectorAll('#graph .edge.good').length === arguments[1]", bad, good)

    def test_shows_the_network_and_why_nothing_flows_until_it_does(self):
        browser = self.browser
        browser.open(bridge(self, route("/in", 0x2222, more=LATCHED) + route("/out", 0x3333, "dds_to_someip", more=", port: 40001")).url)
        browser.wait_for_text("#bridge", "drive.yaml")
        browser.wait_for_text("#graph", "no SOME/IP packet has come in")
        browser.wait_for_text("#causes", f"nobody else is in DDS domain {DOMAIN}")
        self.wait_for_edges(2, 0)
        server = notify(self, 0x2222, "{x: 1.5, y: -2, z: 3}", POINT)
        self.wait_for_edges(1, 2)
        browser.wait_for_text("#graph", PEER)
        self.assertIn("version 1.", browser.text("#graph"))
        self.assertNotIn("no SOME/IP packet", browser.text("#network"))
        rate = browser.wait("a rate", "const found = document.querySelector('#graph').textContent.match(/([0-9.]+) .s, /); return found && Number(found[1])")
        self.assertGreater(rate, 0)

        # Broken again: it says so, and which route it is.
        server.end()
        browser.wait_for_text("#causes", "nobody offers 0x2222.0x0001")
        browser.wait_for_text("#graph", "nobody offers 0x2222.0x0001")
        self.wait_for_edges(2, 0)
        browser.run("[...document.querySelectorAll('#causes a')].find((one) => one.textContent === '/in').click()")
        browser.wait_for_text("#route h2", "/in ← 0x2222.0x0001.0x8001 waiting")
        browser.wait_for_text("#route .cause", "nobody offers 0x2222.0x0001")

    def test_shows_one_route(self):
        browser = self.browser
        url = bridge(self, route("/in", 0x2222, more=LATCHED)).url
        good = notify(self, 0x2222, "{x: 1.5, y: -2, z: 3}", POINT)
        browser.open(url + "#routes")
        browser.wait_for_text("#route-table", "flowing")
        self.assertEqual(browser.text("#route-count"), "1 route")
        browser.click("#route-table a")
        browser.wait_for_text("#route", "flowing")
        browser.wait("columns of both histograms", "return [...document.querySelectorAll('#route .chart')].filter((one) => one.querySelector('rect')).length === 2")
        for text in ("geometry_msgs/msg/Point", "p99", "reliable, transient local", "Nothing was lost.", "subscribed", PEER):
            browser.wait_for_text("#route", text)
        # Something else comes there: it is counted with its reason.
        good.end()
        notify(self, 0x2222, "00 01 02")
        browser.wait_for_text("#route td.warn", "")
        browser.wait_for_text("#route", "not_convertible")
        self.assertNotIn("Nothing was lost.", browser.run("return document.getElementById('route').innerText"))

    def test_shows_service_discovery_as_a_timeline(self):
        browser = self.browser
        browser.open(bridge(self, route("/in", 0x2222) + route("/out", 0x3333, "dds_to_someip", more=", port: 40001")).url + "#limits")
        bars = "return [...document.querySelectorAll('#timeline rect')].map((one) => [one.getAttribute('class'), one.textContent.split(',')[0]])"
        changes = "return [...document.querySelectorAll('#timeline tbody tr')].map((row) => `${row.cells[1].textContent} ${row.cells[2].textContent}`)"
        browser.wait("the own offer", bars + ".some(([name, words]) => name === 'there' && words.includes('(here) offers 0x3333.0x0001'))")
        server = notify(self, 0x2222, "{x: 1}", POINT)
        browser.wait("an offer", bars + f".some(([name, words]) => name === 'there' && words.startsWith('{PEER} offers 0x2222.0x0001'))")
        server.end()
        browser.wait("its end", bars + f".some(([name, words]) => name === 'gone' && words.startsWith('{PEER} offers 0x2222.0x0001'))")
        told = [one for one in browser.run(changes) if one.startswith(f"{PEER} offers")]
        # More than once where the machine stalled for longer than an offer lives.
        self.assertRegex("\n".join(told), rf"^({PEER} offers 0x2222\.0x0001 1\.\d+ no longer\n{PEER} offers 0x2222\.0x0001 1\.\d+\n?)+$")
        # A host that comes back has another bar in its row.
        before = len(told) // 2
        notify(self, 0x2222, "{x: 1}", POINT)
        browser.wait("another bar", bars + f".filter(([, words]) => words.startsWith('{PEER} offers 0x2222.0x0001')).length > {before}")

    def see(self, kind, values):
        """Opens the page of a route to which such messages come."""
        started = bridge(self, route("/seen", 0x2222, kind=kind, more=LATCHED))
        notify(self, 0x2222, values, kind)
        self.browser.open(started.url + "#routes")
        self.browser.wait_for_text("#route-table", "flowing")
        self.browser.click("#route-table a")
        return self.browser

    def test_shows_the_newest_message_with_its_bytes(self):
        browser = self.see(POINT, "{x: 1.5, y: -2, z: 3}")
        browser.wait_for_text("#message .values", "x: 1.5\ny: -2.0\nz: 3.0")
        rows = browser.run("return [...document.querySelectorAll('#message tbody tr')].map((row) => [...row.cells].map((cell) => cell.textContent.trim()))")
        self.assertEqual([(row[0], row[1], row[2], row[4]) for row in rows],
                         [("0", "3f f8 00 00 00 00 00 00", "x", "1.5"), ("8", "c0 00 00 00 00 00 00 00", "y", "-2"), ("16", "40 08 00 00 00 00 00 00", "z", "3")])
        self.assertTrue(browser.run("return document.getElementById('sight') === null"))

    def test_shows_both_messages_of_a_route_that_maps_fields(self):
        vector = "geometry_msgs/msg/Vector3"
        started = bridge(self, route("/in", 0x2222, more=LATCHED + f", payload: {vector}, map: {{x: {{from: y, scale: 0.5}}}}, drop: [x, z], others: default"))
        notify(self, 0x2222, "{y: 3}", vector)
        browser = self.browser
        browser.open(started.url + "#routes")
        browser.wait_for_text("#route-table", "flowing")
        browser.click("#route-table a")
        browser.wait_for_text("#message .values", "x: 1.5\ny: 0.0\nz: 0.0")
        browser.wait_for_text("#message p", f"of {vector} in SOME/IP")
        rows = browser.run("return [...document.querySelectorAll('#message tbody tr')].map((row) => [...row.cells].map((cell) => cell.textContent.trim()))")
        self.assertEqual([(row[1], row[2]) for row in rows][1], ("40 08 00 00 00 00 00 00", "y"))

    def test_shows_what_cannot_be_carried(self):
        started = bridge(self, route("/in", 0x2222, more=LATCHED))
        notify(self, 0x2222, "3f f8 00 00 00 00 00 00 01")
        browser = self.browser
        browser.open(started.url + "#routes")
        browser.wait_for_text("#route-table", "failing")
        browser.click("#route-table a")
        browser.wait_for_text("#message .bad", "It cannot be carried")
        browser.wait_for_text("#message tbody", "1.5")

    def test_turns_a_cloud(self):
        points = b"".join(struct.pack("<ffff", *one) for one in ((0, 0, 0, 1), (4, 0, 0, 2), (0, 3, 1, 3), (float("nan"), 0, 0, 0)))
        fields = ", ".join(f"{{name: {name}, offset: {4 * i}, datatype: 7, count: 1}}" for i, name in enumerate(("x", "y", "z", "intensity")))
        browser = self.see("sensor_msgs/msg/PointCloud2", "{header: {frame_id: lidar}, height: 1, width: 4, point_step: 16, row_step: 64, "
                           f"fields: [{fields}], data: 'hex:{points.hex()}'}}")
        browser.wait_for_text("#sight-words", "3 points, 1 nowhere, in lidar")
        pixels = "return document.querySelector('canvas.scene').toDataURL()"
        drawn = browser.run(pixels)

        def another(before):
            return browser.wait("another picture", f"const now = (() => {{ {pixels} }})(); return now !== arguments[0] && now", before)
        self.assertEqual(browser.run("return document.querySelector('canvas.scene').dataset.points"), "3")
        time.sleep(0.5)
        self.assertEqual(browser.run(pixels), drawn, "the same cloud looks the same")
        canvas = {ELEMENT: browser.find("canvas.scene")}
        move = lambda x: {"type": "pointerMove", "duration": 50, "origin": canvas, "x": x, "y": 0}
        browser.ask("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": [
            move(0), {"type": "pointerDown", "button": 0}, move(30), move(90), {"type": "pointerUp", "button": 0}]}]})
        dragged = another(drawn)
        browser.run("document.querySelector('canvas.scene').focus()")
        browser.keys("UP")
        turned = another(dragged)
        browser.keys("+")
        near = another(turned)
        browser.run("const by = document.querySelector('#sight select'); by.value = 'value'; by.onchange()")
        another(near)

    def colour(self, browser):
        """Of a pixel in the middle of the picture."""
        return browser.wait("a picture", "const canvas = document.querySelector('canvas.picture'); if (!canvas) return null;"
                            "const colour = [...canvas.getContext('2d').getImageData(canvas.width >> 1, canvas.height >> 1, 1, 1).data];"
                            "return colour[3] > 0 && colour")

    def test_shows_a_picture(self):
        browser = self.see("sensor_msgs/msg/Image", f"{{height: 4, width: 4, step: 12, encoding: bgr8, data: 'hex:{'1040a0' * 16}'}}")
        browser.wait_for_text("#sight-words", "4 × 4, bgr8")
        self.assertEqual(self.colour(browser), [0xA0, 0x40, 0x10, 255])

    def test_shows_a_compressed_picture(self):
        browser = self.see("sensor_msgs/msg/CompressedImage", f"{{format: png, data: 'hex:{png(8, 6, (10, 200, 30)).hex()}'}}")
        browser.wait_for_text("#sight-words", "8 × 6, png")
        self.assertEqual(self.colour(browser), [10, 200, 30, 255])

    def test_shows_a_track(self):
        browser = self.see("sensor_msgs/msg/NavSatFix", "{latitude: 48.7, longitude: 9.1, altitude: 250}")
        browser.wait_for_text("#sight-words", "48.7000000°, 9.1000000°, 250.0 m")
        self.assertEqual(browser.run("return document.querySelectorAll('#sight .track circle[cx]').length"), 1)

    def test_shows_frames(self):
        browser = self.see("tf2_msgs/msg/TFMessage", "{transforms: [{header: {frame_id: map}, child_frame_id: car, transform: "
                           "{translation: {x: 1}, rotation: {w: 1}}}, {header: {frame_id: car}, child_frame_id: lidar, transform: {rotation: {w: 1}}}]}")
        browser.wait_for_text("#sight-words", "2 frames below map")
        self.assertIn("car → lidar", browser.text("#sight"))

    def test_shows_the_clouds_of_the_demo_moving(self):
        # A screen and something that opens pages, as far as the demo can tell.
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        opener, opened = pathlib.Path(folder.name) / "xdg-open", pathlib.Path(folder.name) / "opened"
        opener.write_text(f'#!/bin/sh\necho "$1" >{opened}\n')
        opener.chmod(0o755)
        demo = Program(self, "demo", "--console", environment={"DISPLAY": ":none", "PATH": f"{folder.name}:{os.environ['PATH']}"})
        log_until(demo.log, "console of bridge A: ")
        url = re.search(r"console of bridge A: (http://127\.0\.0\.1:\d+/)\n", demo.text())[1]
        end = time.monotonic() + PATIENCE
        while not (opened.exists() and opened.read_text()):
            self.assertLess(time.monotonic(), end, demo.text())
            time.sleep(0.05)
        self.assertEqual(opened.read_text(), url + "\n")
        browser = self.browser
        browser.open(url)
        browser.wait_for_text("#graph", "flowing")
        browser.run("location.hash = document.querySelector('#graph a').getAttribute('href')")
        browser.wait_for_text("#sight-words", " points, ")
        words = browser.text("#sight-words")
        shown, nowhere = (int(found[1].replace(",", "")) if (found := re.search(f"([0-9,]+) {what}", words)) else 0
                          for what in ("points", "nowhere"))
        self.assertEqual(shown + nowhere, 131072, words)  # as many as the scene of the demo has
        pixels = "return document.querySelector('canvas.scene').toDataURL()"
        first = browser.run(pixels)
        browser.wait("another picture", "return document.querySelector('canvas.scene').toDataURL() !== arguments[0]", first)
        browser.wait_for_text("#message tbody", "height")
        browser.wait("columns of both histograms", "return [...document.querySelectorAll('#route .chart')].filter((one) => one.querySelector('rect')).length === 2")
        demo.end()
        self.assertRegex(demo.text(), r" arrived [1-9]\d* +lost \d+ +corrupt 0 ")  # a machine that stalls loses some of UDP

    def test_finds_one_of_a_thousand(self):
        browser = self.browser
        browser.open(bridge(self, "".join(route(f"/car/value_{i}", 0x1000 + i) for i in range(1000))).url + "#routes")
        browser.wait_for_text("#route-count", "1,000 routes")
        self.assertEqual(browser.run("return document.querySelectorAll('#route-table tbody tr').length"), 50)
        browser.click("#after")
        browser.wait_for_text("#page-number", "51 – 100")
        browser.run("document.getElementById('filter').focus()")
        browser.keys("value_777")
        browser.wait_for_text("#route-count", "1 of 1,000 routes")
        self.assertEqual(browser.text("#route-table tbody a"), "/car/value_777")
        browser.keys("CONTROL+a", "0x1005 waiting")
        browser.wait_for_text("#route-table tbody", "/car/value_5")
        # In the graph those that can be looked at.
        browser.run("location.hash = '#network'")
        browser.wait_for_text("#graph-count", "40 of 1,000 routes")
        self.assertEqual(browser.run("return document.querySelectorAll('#graph a').length"), 40)

    def test_can_be_used_without_a_mouse(self):
        browser = self.browser
        browser.open(bridge(self, route("/in", 0x2222)).url)
        browser.wait_for_text("#graph", "waiting")
        browser.keys("TAB", "ENTER")  # "Skip to the content"
        browser.wait("the content", "return document.activeElement.id === 'main'")
        browser.keys("TAB", "TAB", "TAB")  # the filter, the graph, its only route
        self.assertEqual(browser.run("return document.activeElement.getAttribute('aria-label').split(',')[0]"), "/in 0x2222.0x0001.0x8001")
        # It stays there while everything is drawn again and again.
        time.sleep(2.5)
        browser.keys("ENTER")
        browser.wait_for_text("#route h2", "/in ← 0x2222.0x0001.0x8001")
        browser.run("document.querySelector('nav a').focus()")
        browser.keys("TAB")
        browser.keys("ENTER")
        browser.wait("the list of routes", "return !document.getElementById('routes').hidden")
        seen = set()
        for _ in range(20):
            browser.keys("TAB")
            seen.add(browser.run(FOCUS))
        self.assertLessEqual({"filter", "State", "/in", "Network", "Hosts and limits"}, seen)

    def test_begins_and_ends_a_record(self):
        browser = self.browser
        started = bridge(self, route("/in", 0x2222, more=LATCHED), records=True)
        notify(self, 0x2222, "{x: 1.5, y: -2, z: 3}", POINT)
        browser.open(started.url)
        browser.wait("the button", "return !document.getElementById('record').hidden")
        self.assertEqual(browser.text("#record").split(), ["Record"])
        browser.click("#record-button")
        browser.wait_for_text("#record-button", "Stop")
        words = browser.wait("messages", "const text = document.getElementById('record-now').textContent; return / [1-9][0-9,]* messages?, /.test(text) && text")
        self.assertRegex(words, r"^[0-9.]+ (s|min), [0-9,]+ messages?, [0-9.]+ [KM]?B$")
        browser.run("document.getElementById('record-button').focus()")
        browser.keys("ENTER")
        browser.wait_for_text("#record-last", "recorded: ")
        self.assertEqual(browser.text("#record-button"), "Record")
        self.assertEqual(browser.text("#record-now"), "")
        self.assertEqual(browser.run(FOCUS), "record-button")
        bag, = started.records.iterdir()
        self.assertTrue((bag / "metadata.yaml").exists())
        # One that is overwritten in the moment in which the record finds its writer is lost, and told.
        self.assertRegex(browser.text("#record-last"), rf"^recorded: [1-9]\d* messages in {bag}/{bag.name}_0\.mcap(\n1 were lost before \(dds_lost\))?$")
        # It is there as long as the bridge is, and fits.
        browser.ask("POST", "/goog/cdp/execute", {"cmd": "Emulation.setDeviceMetricsOverride", "params": {
            "width": 380, "height": 700, "deviceScaleFactor": 1, "mobile": True}})
        browser.run("location.reload()")
        browser.wait_for_text("#record-last", "recorded: ")
        self.assertLessEqual(browser.run("return document.documentElement.scrollWidth"), 380)

    def test_says_why_a_record_failed(self):
        browser = self.browser
        started = bridge(self, route("/in", 0x2222), records=True)
        browser.open(started.url)
        browser.wait("the button", "return !document.getElementById('record').hidden")
        started.records.rmdir()
        browser.click("#record-button")
        browser.wait_for_text("#record-last.bad", "the record failed: error: ")
        self.assertIn("No such file or directory", browser.text("#record-last"))
        self.assertEqual(browser.text("#record-button"), "Record")

    def test_makes_no_record_where_that_is_not_allowed(self):
        browser = self.browser
        browser.open(bridge(self, route("/in", 0x2222)).url)
        browser.wait_for_text("#graph", "waiting")
        browser.wait("that it was asked", "return performance.getEntriesByType('resource').filter((one) => one.name.endsWith('/record')).length > 1")
        self.assertTrue(browser.run("return document.getElementById('record').hidden"))

    def test_asks_for_the_token(self):
        browser = self.browser
        browser.open(bridge(self, route("/in", 0x2222), token="a token of many letters\n").url)
        browser.wait("the form", "return !document.getElementById('ask-token').hidden && document.activeElement.id === 'token'")
        self.assertNotIn("/in", browser.text("body"))
        browser.keys("another token", "ENTER")
        browser.wait_for_text("#token-fault", "That is not the token.")
        browser.keys("a token of many letters", "ENTER")
        browser.wait_for_text("#graph", "/in")
        browser.run("location.reload()")
        browser.wait_for_text("#graph", "/in")
        self.assertEqual(browser.run("return document.getElementById('ask-token').hidden"), True)

    def test_says_that_the_bridge_has_ended(self):
        browser = self.browser
        started = bridge(self, route("/in", 0x2222))
        browser.open(started.url)
        browser.wait_for_text("#state", "running")
        started.end()
        browser.wait_for_text("#state", "the bridge does not answer")

    def test_is_dark_for_those_who_want_that_and_fits_a_narrow_screen(self):
        browser = self.browser
        back = "return getComputedStyle(document.body).backgroundColor"
        browser.open(bridge(self, route("/in", 0x2222)).url)
        browser.wait_for_text("#graph", "waiting")
        light = browser.run(back)
        emulate = lambda cmd, params: browser.ask("POST", "/goog/cdp/execute", {"cmd": cmd, "params": params})
        emulate("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]})
        self.assertNotEqual(browser.run(back), light)
        emulate("Emulation.setDeviceMetricsOverride", {"width": 380, "height": 700, "deviceScaleFactor": 1, "mobile": True})
        for page in ("network", "routes", "limits"):
            browser.run("location.hash = arguments[0]", page)
            browser.wait("the page", "return !document.getElementById(arguments[0]).hidden", page)
            self.assertLessEqual(browser.run("return document.documentElement.scrollWidth"), 380, page)

    def test_asks_nobody_else_and_answers_nobody_else(self):
        url = bridge(self, route("/in", 0x2222)).url
        host = url.removeprefix("http://").rstrip("/")

        def ask(method, path, **headers):
            with contextlib.closing(http.client.HTTPConnection(host, timeout=PATIENCE)) as connection:
                connection.request(method, path, headers=headers)
                answer = connection.getresponse()
                answer.read()
                return answer

        policy = ask("GET", "/").getheader("Content-Security-Policy")
        self.assertIn("default-src 'none'; script-src 'self'; style-src 'self';", policy)
        self.assertNotIn("unsafe", policy)
        self.assertEqual(ask("GET", "/status.json").status, 200)
        self.assertEqual(ask("GET", "/status.json", Host="evil.example").status, 403)
        self.assertEqual(ask("GET", "/", Host="evil.example").status, 403)
        self.assertEqual(ask("GET", "/generate/page.js").status, 404)
        self.assertEqual(ask("GET", "/console/../../etc/passwd").status, 404)
        self.browser.open(url)
        self.browser.wait_for_text("#graph", "waiting")
        asked = self.browser.run("return performance.getEntriesByType('resource').map((one) => one.name)")
        self.assertIn(url + "status.json", asked)
        self.assertEqual([one for one in asked if not one.startswith((url, "data:"))], [])


def make_picture(file):
    """The cloud of the demo, for the documents."""
    test = unittest.TestCase()
    try:
        with Browser(1500, 1180) as browser:
            demo = Program(test, "demo", "--console")
            log_until(demo.log, "console of bridge A: ")
            browser.open(re.search(r"console of bridge A: (\S+)", demo.text())[1])
            browser.wait_for_text("#graph", "flowing")
            browser.run("location.hash = document.querySelector('#graph a').getAttribute('href')")
            browser.wait_for_text("#sight-words", "points")
            browser.wait_for_text("#message tbody", "height")
            time.sleep(10)  # a line of rates
            browser.screenshot(file)
    finally:
        test.doCleanups()


if __name__ == "__main__":
    needs_browser()
    if "--screenshot" in sys.argv:
        make_picture(sys.argv[sys.argv.index("--screenshot") + 1])
    else:
        unittest.main(argv=sys.argv[:1], verbosity=2)
