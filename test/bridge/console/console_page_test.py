#!/usr/bin/env python3
"""The page of `trestle bridge --console` in a browser, with peers that are programs of their own.

Usage: console_page_test.py TRESTLE

Without Chromium it is skipped (77); with TRESTLE_REQUIRE_PEERS=1, or =chromium, it fails."""
import contextlib
import http.client
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent.parent), str(HERE.parent), str(HERE.parent / "web")]
from bridge_program import BRIDGE, DOMAIN, GROUP, PEER, head, log_until
from browser import PATIENCE, Browser, needs_browser

program = sys.argv[1]
ENVIRONMENT = {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)}
LATCHED = ", qos: {durability: transient_local}"  # so that it is carried though nobody reads it
FOCUS = "return document.activeElement.id || document.activeElement.textContent"


def route(topic, service, direction="someip_to_dds", kind="geometry_msgs/msg/Point", more=""):
    return (f"  - {{topic: {topic}, type: {kind}, direction: {direction}, service: {service:#06x}, instance: 0x0001, "
            f"eventgroup: 0x0001, event: 0x8001{more}}}\n")


class Program:
    """A command that runs until the end of the test, or until it is ended. Its output is in a file."""

    def __init__(self, test, *arguments):
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen([program, *map(str, arguments)], stdout=self.log, stderr=subprocess.STDOUT, env=ENVIRONMENT)
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


def bridge(test, routes, token=""):
    """Starts a bridge with a console, which has a `url`."""
    folder = tempfile.TemporaryDirectory()
    test.addCleanup(folder.cleanup)
    file = pathlib.Path(folder.name) / "drive.yaml"
    (file.parent / "token").write_text(token)
    port = free_port()
    file.write_text(head() + f"console: {{address: 127.0.0.1:{port}{', token_file: token' if token else ''}}}\nroutes:\n" + routes)
    started = Program(test, "bridge", file)
    started.url = f"http://127.0.0.1:{port}/"
    log_until(started.log, f"console: {started.url}\n")
    return started


def notify(test, service, payload, *more):
    """A SOME/IP server that sends an event ten times a second."""
    return Program(test, "notify", f"{service:#06x}.1", "1", "0x8001", payload, "--address", PEER, "--multicast", GROUP, "--rate", "10", *more)


class Page(unittest.TestCase):
    def setUp(self):
        self.browser = Browser()
        self.addCleanup(self.browser.__exit__)

    def tearDown(self):
        # Errors, and whatever the policy of the page forbade.
        expected = ("401 (Unauthorized)", "net::ERR_CONNECTION")
        self.assertEqual([one for one in self.browser.log() if not any(text in one for text in expected)], [])

    def edges(self):
        """How many edges there are that say why nothing flows, and such where something does."""
        return self.browser.run("return [document.querySelectorAll('#graph .edge.bad').length, document.querySelectorAll('#graph .edge.good').length]")

    def test_shows_the_network_and_why_nothing_flows_until_it_does(self):
        browser = self.browser
        browser.open(bridge(self, route("/in", 0x2222, more=LATCHED) + route("/out", 0x3333, "dds_to_someip", more=", port: 40001")).url)
        browser.wait_for_text("#bridge", "drive.yaml")
        browser.wait_for_text("#graph", "no SOME/IP packet has come in")
        browser.wait_for_text("#causes", f"nobody else is in DDS domain {DOMAIN}")
        self.assertEqual(self.edges(), [2, 0])
        server = notify(self, 0x2222, "{x: 1.5, y: -2, z: 3}", "--type", "geometry_msgs/msg/Point")
        browser.wait("an edge on which something flows", "return document.querySelectorAll('#graph .edge.good').length === 2")
        self.assertEqual(self.edges(), [1, 2])
        browser.wait_for_text("#graph", PEER)
        self.assertIn("version 1.", browser.text("#graph"))
        self.assertNotIn("no SOME/IP packet", browser.text("#network"))
        rate = browser.wait("a rate", "const found = document.querySelector('#graph').textContent.match(/([0-9.]+) .s, /); return found && Number(found[1])")
        self.assertGreater(rate, 0)

        # Broken again: it says so, and which route it is.
        server.end()
        browser.wait_for_text("#causes", "nobody offers 0x2222.0x0001")
        browser.wait_for_text("#graph", "nobody offers 0x2222.0x0001")
        self.assertEqual(self.edges()[0], 2)
        browser.run("[...document.querySelectorAll('#causes a')].find((one) => one.textContent === '/in').click()")
        browser.wait_for_text("#route h2", "/in ← 0x2222.0x0001.0x8001 waiting")
        browser.wait_for_text("#route .cause", "nobody offers 0x2222.0x0001")

    def test_shows_one_route(self):
        browser = self.browser
        url = bridge(self, route("/in", 0x2222, more=LATCHED)).url
        good = notify(self, 0x2222, "{x: 1.5, y: -2, z: 3}", "--type", "geometry_msgs/msg/Point")
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
        self.assertEqual(browser.run(FOCUS), "main")
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


if __name__ == "__main__":
    needs_browser()
    unittest.main(argv=sys.argv[:1], verbosity=2)
