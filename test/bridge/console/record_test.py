#!/usr/bin/env python3
"""record_test.py TRESTLE: records that the console of a bridge begins and ends, over HTTP. They are read here by the format's
specification alone, and by `trestle replay`."""
import contextlib
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import tempfile
import time
import unittest

from viewers_test import ENVIRONMENT, POINT, Bridges, program, route  # which reads the command line
from bridge_program import head, log_until
from bare_peer import PATIENCE

MAGIC = b"\x89MCAP0\r\n"
START, STOP = {"do": "start"}, {"do": "stop"}


def read_bag(folder):
    """Messages by topic, from the summary of its only file; nothing: it is not whole. (mcap.dev/spec)"""
    file = folder / f"{folder.name}_0.mcap"
    data = file.read_bytes() if file.exists() else b""
    if not (folder / "metadata.yaml").exists() or len(data) < 64 or not (data.startswith(MAGIC) and data.endswith(MAGIC)):
        return None
    at, = struct.unpack_from("<Q", data, len(data) - 8 - 20)  # of the summary, in the footer
    topics, counts = {}, {}
    while data[at] != 2:
        opcode, size = struct.unpack_from("<BQ", data, at)
        body, at = data[at + 9:at + 9 + size], at + 9 + size
        if opcode == 4:
            number, _, length = struct.unpack_from("<HHI", body)
            topics[number] = body[8:8 + length].decode()
        elif opcode == 11:
            length, = struct.unpack_from("<I", body, 42)
            counts = {struct.unpack_from("<H", body, 46 + i)[0]: struct.unpack_from("<Q", body, 48 + i)[0] for i in range(0, length, 10)}
    return {topics[number]: count for number, count in counts.items()}


def children(parent):
    """Those that run our program; a sanitizer has helpers of its own."""
    found = []
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(fields[1]) == parent and fields[0] != "Z":
            with contextlib.suppress(FileNotFoundError):
                if os.path.samefile(stat.parent / "exe", program):
                    found.append(int(stat.parent.name))
    return found


def sockets(process):
    found = set()
    for descriptor in pathlib.Path(f"/proc/{process}/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            found.add(os.readlink(descriptor))
    return {one for one in found if one.startswith("socket:")}


class Records(Bridges):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.records = self.folder / "records"
        self.records.mkdir()
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.log = tempfile.TemporaryFile("w+")
        self.addCleanup(self.log.close)

    def configure(self, more=", records: records"):
        self.file = self.folder / "drive.yaml"
        self.file.write_text(head() + f"console: {{address: 127.0.0.1:{self.port}{more}}}\nroutes:\n" + route("/in", 0x2222))

    def begin(self, more=", records: records", ready=True):
        """Starts a bridge, and who sends its event."""
        self.configure(more)
        self.bridge = subprocess.Popen([program, "bridge", self.file], stdout=self.log, stderr=subprocess.STDOUT, env=ENVIRONMENT)
        self.addCleanup(self.end)
        if ready:
            log_until(self.log, "Ctrl-C stops")
            self.notify(0x2222, "{x: 1.5, y: -2, z: 3}", POINT)

    def end(self):
        if self.bridge.poll() is None:
            self.bridge.terminate()
        return self.bridge.wait(PATIENCE)

    def ask(self, method="GET", body=None, path="/record", **headers):
        """Status, and the answer: an object, or words."""
        if method == "POST":
            headers = {"Content-Type": "application/json", **headers}
        # A bridge has 16 connections, and keeps those that nobody closes.
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)) as connection:
            connection.request(method, path, body=json.dumps(body) if isinstance(body, dict) else body, headers=headers)
            answer = connection.getresponse()
            text = answer.read().decode()
        return answer.status, json.loads(text) if answer.getheader("Content-Type").startswith("application/json") else text

    def state_until(self, condition, what):
        end = time.monotonic() + PATIENCE
        while True:
            status, state = self.ask()
            self.assertEqual(status, 200)
            if condition(state):
                return state
            self.assertLess(time.monotonic(), end, f"{what}: {state}")
            time.sleep(0.05)

    def start_record(self, messages=3):
        """Its folder, when it has so many."""
        status, state = self.ask("POST", START)
        self.assertEqual((status, state["recording"], state["last"]), (200, True, None), state)
        self.state_until(lambda now: now["messages"] >= messages, "messages")
        return pathlib.Path(state["folder"])

    def wait_for_bag(self, folder):
        end = time.monotonic() + PATIENCE
        while (found := read_bag(folder)) is None:
            self.assertLess(time.monotonic(), end, list(folder.glob("*")))
            time.sleep(0.05)
        return found

    def test_are_made_of_the_topics_of_the_routes(self):
        self.begin()
        status, idle = self.ask()
        self.assertEqual((status, idle["allowed"], idle["recording"], idle["folder"], idle["last"]), (200, True, False, "", None))
        before = time.time_ns()
        folder = self.start_record()
        self.assertEqual(folder.parent, self.records)
        self.assertRegex(folder.name, r"^record_\d{4}_\d\d_\d\d-\d\d_\d\d_\d\d$")
        status, state = self.ask()
        self.assertGreaterEqual(state["since_ns"], before)
        self.assertLessEqual(state["since_ns"] + state["running_s"] * 1e9, time.time_ns() + 1e9)
        self.assertGreater(state["bytes"], 0)
        self.assertEqual(self.ask("POST", START), (409, "a record is being made already\n"))
        status, state = self.ask("POST", STOP)
        self.assertEqual((status, state["folder"]), (200, str(folder)))
        last = self.state_until(lambda now: not now["recording"], "the end")["last"]
        found = read_bag(folder)
        self.assertEqual(set(found), {"/in"})
        self.assertGreaterEqual(found["/in"], 3)
        words = f"{found['/in']} messages in {folder}/{folder.name}_0.mcap"
        self.assertEqual((last["folder"], last["ok"]), (str(folder), True))
        # What is overwritten in the moment in which the record finds its writer is lost, and told.
        self.assertRegex(last["words"], rf"^{re.escape(words)}(\n\d+ were lost before \(dds_lost\))?$")
        log_until(self.log, f"record: {words}")
        self.assertEqual(self.ask("POST", STOP), (409, "no record is being made\n"))
        replay = subprocess.run([program, "replay", folder, "--speed", "100", "--delay", "0"], capture_output=True, text=True, timeout=PATIENCE,
                                env=ENVIRONMENT)
        self.assertEqual(replay.returncode, 0, replay.stderr)
        self.assertIn(str(found["/in"]), replay.stdout + replay.stderr)

    def test_have_a_folder_each_also_within_one_second(self):
        self.begin()
        folders = []
        for _ in range(3):
            status, state = self.ask("POST", START)
            self.assertEqual(status, 200)
            folders.append(pathlib.Path(state["folder"]))
            self.ask("POST", STOP)  # before it can have begun to record
            last = self.state_until(lambda now: not now["recording"], "the end")["last"]
            self.assertTrue(last["ok"], last)
            self.assertIsNotNone(read_bag(folders[-1]), last)
        self.assertEqual(len(set(folders)), 3)

    def test_are_not_made_unless_that_is_allowed(self):
        self.begin(more="")
        status, state = self.ask()
        self.assertEqual((status, state["allowed"], state["recording"]), (200, False, False))
        words = "no record may be made: the configuration has no `console: {records: FOLDER}`\n"
        self.assertEqual(self.ask("POST", START), (403, words))
        self.assertEqual(self.ask("POST", STOP), (403, words))
        self.assertEqual(children(self.bridge.pid), [])

    def test_are_made_only_for_whom_the_page_is(self):
        token = "a token that nobody guesses"
        (self.folder / "token").write_text(token + "\n")
        self.begin(more=", records: records, token_file: token")
        self.assertEqual(self.ask()[0], 401)
        self.assertEqual(self.ask("POST", START)[0], 401)
        self.assertEqual(self.ask("POST", START, Authorization="Bearer another")[0], 401)
        mine = {"Authorization": f"Bearer {token}"}
        self.assertEqual(self.ask("POST", START, Origin="https://evil.example", **mine)[0], 403)
        self.assertEqual(self.ask("POST", START, Host="evil.example", **mine)[0], 403)
        self.assertEqual(self.ask("POST", START, **{**mine, "Content-Type": "text/plain"})[0], 415)
        self.assertEqual(list(self.records.iterdir()), [])
        self.assertFalse(self.ask(**mine)[1]["recording"])
        self.assertEqual(self.ask("POST", START, Origin=f"http://127.0.0.1:{self.port}", **mine)[0], 200)

    def test_refuse_what_is_no_order(self):
        self.begin()
        for body in ("", "no JSON", "[]", "1", "{}", '{"do": 1}', '{"do": "pause"}', b"\xff", "[" * 1000):
            with self.subTest(body):
                self.assertEqual(self.ask("POST", body), (400, 'expected {"do": "start"} or {"do": "stop"}\n'))
        self.assertEqual(self.ask("POST", " " * 1025)[0], 413)
        self.assertEqual(self.ask("PUT", START, **{"Content-Type": "application/json"})[0], 405)
        self.assertEqual(self.ask("POST", START, path="/status.json")[0], 405)
        self.assertFalse(self.ask()[1]["recording"])

    def test_are_whole_when_the_bridge_ends(self):
        self.begin()
        folder = self.start_record()
        recorder, = children(self.bridge.pid)
        self.assertEqual(self.end(), 0)
        self.assertGreaterEqual(read_bag(folder)["/in"], 3)
        self.assertFalse(pathlib.Path(f"/proc/{recorder}").exists())
        log_until(self.log, f" messages in {folder}/")

    def test_are_whole_when_the_bridge_is_killed(self):
        self.begin()
        folder = self.start_record()
        self.bridge.kill()
        self.bridge.wait(PATIENCE)
        self.assertGreaterEqual(self.wait_for_bag(folder)["/in"], 3)

    def test_do_not_hurt_the_bridge(self):
        self.begin()
        folder = self.start_record()
        recorder, = children(self.bridge.pid)
        shared = sockets(recorder) & sockets(self.bridge.pid)
        self.assertEqual(shared, set(), "what comes there would be for both")
        self.assertTrue(sockets(recorder))
        os.kill(recorder, signal.SIGKILL)
        last = self.state_until(lambda now: not now["recording"], "the end")["last"]
        self.assertEqual(last, {"folder": str(folder), "ok": False, "words": "ended by signal 9"})
        self.assertIsNone(self.bridge.poll())
        self.assertEqual(self.ask("POST", START)[0], 200)

    def test_go_on_when_the_configuration_is_read_again(self):
        self.begin()
        folder = self.start_record()
        self.bridge.send_signal(signal.SIGHUP)
        log_until(self.log, "Ctrl-C stops", times=2)
        status, state = self.ask()
        self.assertEqual((state["recording"], state["folder"]), (True, str(folder)))
        self.state_until(lambda now: now["messages"] > state["messages"] + 3, "more messages")
        # And end where they are allowed no longer: nobody could end them.
        self.configure(more="")
        self.bridge.send_signal(signal.SIGHUP)
        log_until(self.log, "Ctrl-C stops", times=3)
        self.assertGreater(self.wait_for_bag(folder)["/in"], state["messages"])
        self.state_until(lambda now: not now["recording"], "the end")
        self.assertFalse(self.ask()[1]["allowed"])

    def test_say_why_they_cannot_be_made(self):
        self.begin()
        self.records.rmdir()
        self.assertEqual(self.ask("POST", START)[0], 200)
        last = self.state_until(lambda now: not now["recording"], "the end")["last"]
        self.assertFalse(last["ok"])
        self.assertRegex(last["words"], f"^error: .*No such file or directory.*{last['folder']}")
        self.assertFalse(self.records.exists(), "it may be a disk that is not there now")
        self.records.mkdir()
        self.configure(more=", records: none")
        self.bridge.send_signal(signal.SIGHUP)
        log_until(self.log, "going on as before")
        log_until(self.log, "Ctrl-C stops", times=2)
        self.file.write_text("routes: [")  # for the recorder, which reads it
        self.assertEqual(self.ask("POST", START)[0], 200)
        last = self.state_until(lambda now: not now["recording"], "the end")["last"]
        self.assertFalse(last["ok"])
        self.assertIn(f"{self.file}:", last["words"])

    def test_need_a_folder_from_the_start_on(self):
        self.begin(more=", records: none", ready=False)
        self.assertEqual(self.bridge.wait(PATIENCE), 1)
        line = 1 + head().count("\n")
        column = self.file.read_text().splitlines()[line - 1].index("none") + 1
        log_until(self.log, f"error: {self.file}:{line}:{column}: records: '{self.folder}/none' is no folder that can be written to: No such file or directory")
        (self.folder / "none").write_text("a file")
        self.begin(more=", records: none", ready=False)
        self.assertEqual(self.bridge.wait(PATIENCE), 1)
        log_until(self.log, "is no folder that can be written to: Not a directory")


if __name__ == "__main__":
    unittest.main()
