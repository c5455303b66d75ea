#!/usr/bin/env python3
"""The report.html of `trestle conform run` in a browser, as somebody reads it.

Usage: report_page_test.py TRESTLE SOURCE_FOLDER [--screenshot FILE.png]

With --screenshot it only makes the picture of docs/conform.md, of all cases. Without Chromium it is skipped (77); with
TRESTLE_REQUIRE_PEERS=1, or =chromium, it fails."""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "web"))
from browser import Browser, needs_browser

PROGRAM, SOURCE = str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()
# On loopback, of this process alone: other tests may run beside it.
HOST = f"127.{1 + (os.getpid() >> 8) % 254}.{os.getpid() & 0xff}"


def report(folder, *cases):
    """Makes a report of the reference device, of which the profile says something that is not so; returns its URL."""
    profile = folder / "profile.yaml"
    profile.write_text((SOURCE / "examples" / "ets_device" / "profile.yaml").read_text().replace("ttl: 5", "ttl: 6"))
    done = subprocess.run([PROGRAM, "conform", "run", *cases, "--dut", profile.name, "--device", f"{HOST}.1", "--tester", f"{HOST}.2",
                           "--out", "out"], cwd=folder, capture_output=True, text=True, timeout=250)
    assert done.returncode == 1, done.stdout + done.stderr
    return (folder / "out" / "report.html").as_uri()


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.url = report(pathlib.Path(cls.folder.name), "sd.offer", "sd.header", "sd.subscribe.ack", "rpc.response")
        cls.browser = Browser()
        cls.addClassCleanup(cls.browser.__exit__)

    def setUp(self):
        self.browser.open(self.url)
        self.browser.wait_for_text("#device", "Trestle ETS device")

    def tearDown(self):
        self.assertEqual(self.browser.log(), [])

    def shown(self):
        return self.browser.run("return [...document.querySelectorAll('#cases > tbody > tr[id]')].filter((row) => !row.hidden).map((row) => row.id)")

    def type(self, text):
        self.browser.run("document.getElementById('filter').focus(); document.getElementById('filter').select()")
        self.browser.keys(text)

    def test_filters_cases_by_words_ids_and_verdicts(self):
        everything = self.shown()
        self.type("offer ttl")
        self.browser.wait_for_text("#shown", " of ")
        self.assertIn("sd.offer.ttl", self.shown())
        self.assertLess(len(self.shown()), len(everything))
        self.type("SOMEIPSRV_FORMAT_17")
        self.browser.wait("one case", "return document.getElementById('shown').textContent.startsWith('1 of')")
        self.assertEqual(self.shown(), ["sd.offer.ttl"])
        self.type("no such words")
        self.browser.wait_for_text("#shown", "0 of")
        self.browser.keys("CONTROL+a", "BACKSPACE")
        self.browser.wait("all", "return document.getElementById('shown').textContent === ''")
        self.browser.click("#verdicts button.pass")
        self.assertEqual(self.shown(), ["sd.offer.ttl"])
        self.browser.click("#verdicts button.pass")
        self.assertEqual(self.shown(), everything)

    def test_opens_a_failed_case_by_keys_and_shows_its_packets(self):
        self.type("sd.offer.ttl")
        self.browser.wait("one case", "return document.getElementById('shown').textContent.startsWith('1 of')")
        for _ in range(20):  # past the verdicts, to the case
            self.browser.keys("TAB")
            if self.browser.run("return document.activeElement.classList.contains('opener')"):
                break
        self.browser.keys("ENTER")
        self.browser.wait_for_text(".details", "What is different")
        self.assertEqual(self.browser.run("return document.activeElement.getAttribute('aria-expanded')"), "true")
        self.assertEqual(self.browser.run("return [...document.querySelectorAll('.differences tbody td')].map((cell) => cell.textContent).slice(0, 3)"),
                         ["TTL", "6 (0x6)", "5 (0x5)"])
        number = self.browser.text(".differences a")
        offending = self.browser.text(".packets tr.offending")
        self.assertTrue(offending.startswith(number), offending)
        self.assertIn("OFFENDING: TTL is 5 (0x5), expected 6 (0x6)", offending)
        self.assertIn("Offer 0x0101.0x0001 v1.0 TTL 5 [", offending)
        self.assertIn("Find 0x0101.0x0001", self.browser.text(".packets"))
        self.assertIn("feat_req_someipsd_253", self.browser.text(".details"))
        self.assertIn("trestle conform run --dut profile.yaml", self.browser.text(".details .panel > div:last-child pre"))
        # The bytes of the packet are behind its line.
        self.browser.click(".packets tr.offending summary")
        self.assertTrue(self.browser.run("return document.querySelector('.packets tr.offending pre').checkVisibility()"))
        self.assertTrue(self.browser.text(".packets tr.offending pre").startswith("ff ff 81 00 "))
        self.browser.run("document.querySelector('.open .opener').focus()")
        self.browser.keys("ENTER")
        self.assertEqual(self.browser.text(".details"), "")

    def test_shows_all_requirements_and_the_cases_of_one(self):
        self.assertEqual(self.browser.run("return document.querySelectorAll('.square[data-id]').length"), 543)
        state = "return document.querySelector(`[data-id=${arguments[0]}]`).className"
        self.assertEqual(self.browser.run(state, "feat_req_someipsd_253"), "square fail")
        self.assertEqual(self.browser.run(state, "feat_req_someipsd_614"), "square pass")
        self.assertEqual(self.browser.run(state, "feat_req_someip_541"), "square rule")
        # One stop for Tab; from there by arrows.
        self.assertEqual(self.browser.run("return document.querySelectorAll('.square[tabindex=\"0\"]').length"), 1)
        self.browser.run("document.querySelector('.square[tabindex=\"0\"]').focus()")
        for _ in range(600):
            if "square fail" in self.browser.run("return document.activeElement.className"):
                break
            self.browser.keys("RIGHT")
        self.browser.keys("ENTER")
        self.browser.wait_for_text("#requirement", "feat_req_")
        self.assertEqual(self.shown(), ["sd.offer.ttl"])
        self.browser.click("#requirement button")
        self.assertGreater(len(self.shown()), 10)
        # One without a case says why.
        self.browser.click(".square[data-id=feat_req_someipsd_23]")
        self.browser.wait_for_text("#requirement", "There is no case: the tester cannot take the link away")
        self.browser.click("#requirement button")

    def test_opens_the_case_that_the_address_names(self):
        self.browser.open("about:blank")
        self.browser.open(self.url + "#rpc.response.comes")
        self.browser.wait_for_text(".details", "Run it again")
        self.assertIn("request 0x0101.0x0008", self.browser.text(".packets"))
        self.assertEqual(self.browser.text(".packets .offending"), "")

    def test_needs_nothing_but_itself(self):
        self.assertEqual(self.browser.run("return performance.getEntriesByType('resource').length"), 0)


def make_picture(file):
    with tempfile.TemporaryDirectory() as folder, Browser(1300, 1500) as browser:
        browser.open(report(pathlib.Path(folder)) + "#sd.offer.ttl")
        browser.wait_for_text(".details", "Packets")
        browser.click("#verdicts button.pass")
        browser.run("document.activeElement.blur(); scrollTo(0, 0)")
        browser.screenshot(file)


if __name__ == "__main__":
    needs_browser()
    if "--screenshot" in sys.argv:
        make_picture(pathlib.Path(sys.argv[sys.argv.index("--screenshot") + 1]).resolve())
    else:
        unittest.main(argv=sys.argv[:1])
