#!/usr/bin/env python3
"""page_test.py TRESTLE PAGE [PEER ...]: runs the commands of a page of docs/ in their order, and compares what they print.

They run in a folder that has a copy of examples/. A block of the page that begins with ```console has commands behind `$ `, with `> ` in front of lines that go on, and what each of
them prints. `...` alone in a line stands for any lines, at the end or in the middle of one for any text; a time of day stands for
any other. A command that prints something else is tried again for a minute: the machine may be slow, and what is in the network
comes when it comes. Comments in front of a block say what is special about it, with commas between:

  file: NAME         what the block has is written into this file, of any kind of block
  goes on            the command keeps running, as in a terminal of its own
  ends the last one  before the block, what was started last ends by Ctrl-C, with status 0
  status N           with which the last command of the block ends
  not run: ...       changes the machine; something else tests it

PEER is what a page needs: `pysomeip` (of build/peers) or `ros` (of build/ros). Without it the page is skipped (77); with
TRESTLE_REQUIRE_PEERS=1 that is a failure. ros2 and colcon, which PyPI does not have, are stood in for by ros2.py and colcon.py, with
the libraries of ROS 2.
"""
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PEERS = {"pysomeip": ("TRESTLE_PEERS", "build/peers", "someip"), "ros": ("TRESTLE_ROS", "build/ros", "rclpy")}
PATIENCE = 60  # seconds; running into it is a failure
DIES_WITH_US = ["setpriv", "--pdeathsig", "KILL"]


def blocks(page):
    """The comment in front of each block of commands, or of a file, and its lines."""
    for comment, kind, text in re.findall(r"(?:^<!-- ([^\n]*) -->\n)?^```(\w*)\n(.*?)^```$", page, re.DOTALL | re.MULTILINE):
        if kind == "console" or comment.startswith("file: "):
            yield comment, text.splitlines()


def commands(lines):
    """Each command of a block with the lines that it prints."""
    found = []
    for line in lines:
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif line.startswith("> ") and not found[-1][1]:
            found[-1] = (f"{found[-1][0]}\n{line[2:]}", [])
        else:
            found[-1][1].append(line)
    return found


def as_pattern(shown):
    """What is shown, as a regular expression for what is printed."""
    pattern = ""
    for line in shown:
        if line == "...":
            pattern += r"(?:.*\n)*?"
        else:
            line = re.sub(r"\d\d:\d\d:\d\d\.\d{3}", "TIME", line)
            pattern += ".*".join(re.escape(part).replace("TIME", r"\d\d:\d\d:\d\d\.\d{3}") for part in line.split("...")) + r"[ ]*\n"
    return pattern


def matches(shown, printed, goes_on=False):
    pattern = as_pattern(shown)
    return re.match(pattern, printed) if goes_on else re.fullmatch(pattern + r"\n*", printed)


class Terminal:
    """A command that keeps running, and what it has printed."""

    def __init__(self, command, folder, environment):
        self.command = command
        self.process = subprocess.Popen([*DIES_WITH_US, *shlex.split(command)], cwd=folder, env=environment, text=True,
                                        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.printed = ""
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.printed += line

    def interrupt(self):
        self.process.send_signal(signal.SIGINT)
        status = self.process.wait(PATIENCE)
        self.reader.join(PATIENCE)
        self.process.stdout.close()
        return status


class Session:
    """Runs the page, in a folder that is as the sources to it."""

    def __init__(self, folder, environment):
        self.folder, self.environment = folder, environment
        self.state = folder / "state"
        self.where = str(folder)
        self.terminals = []

    def run(self, comment, lines):
        if comment.startswith("not run: "):
            return
        if comment.startswith("file: "):
            pathlib.Path(self.where, comment.removeprefix("file: ")).write_text("\n".join(lines) + "\n")
            return
        notes = comment.split(", ")
        if "ends the last one" in notes:
            status = self.terminals.pop().interrupt()
            assert status == 0, f"Ctrl-C: status {status}"
        todo = commands(lines)
        for number, (command, shown) in enumerate(todo, 1):
            if "goes on" in notes:
                self.start(command, shown)
            else:
                last = re.match(r"status (\d)", comment) if number == len(todo) else None
                self.expect(command, shown, int(last[1]) if last else 0)

    def start(self, command, shown):
        terminal = Terminal(command, self.where, self.environment)
        self.terminals.append(terminal)
        end = time.monotonic() + PATIENCE
        while not matches(shown, terminal.printed, goes_on=True):
            assert terminal.process.poll() is None and time.monotonic() < end, self.differs(command, shown, terminal.printed)
            time.sleep(0.05)
        print(f"$ {command}    # goes on")

    def expect(self, command, shown, status):
        """Runs it in a shell that begins where the one before ended, with its environment."""
        begin = time.monotonic()
        patience = PATIENCE if self.terminals else 0  # nothing else changes
        while True:
            done = subprocess.run(["bash", "-c", f"{command}\nstatus=$?; pwd >{self.state}; env -0 >>{self.state}; exit $status"],
                                  cwd=self.where, env=self.environment, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, timeout=5 * PATIENCE, check=False)
            if done.returncode == status and matches(shown, done.stdout):
                break
            assert time.monotonic() < begin + patience, self.differs(command, shown, f"{done.stdout}(status {done.returncode})\n")
            time.sleep(0.2)
        self.where, _, variables = self.state.read_text().partition("\n")
        self.environment = dict(one.split("=", 1) for one in variables.split("\0") if "=" in one)
        print(f"$ {command}    # {time.monotonic() - begin:.1f} s")

    def differs(self, command, shown, printed):
        others = "".join(f"\n--- {one.command}\n{one.printed}" for one in self.terminals if one.command != command)
        return f"$ {command}\n--- shown in the page\n" + "\n".join(shown) + f"\n--- printed\n{printed}{others}"

    def close(self):
        for terminal in reversed(self.terminals):
            if terminal.process.poll() is None:
                terminal.interrupt()


def missing(what):
    wanted = os.environ.get("TRESTLE_REQUIRE_PEERS", "0").split(",")
    required = what in wanted or "1" in wanted
    print(f"{'missing' if required else 'skipped'}: {what}; ./run setup --peers installs it")
    sys.exit(1 if required else 77)


def check_myself():
    """That what differs is found."""
    assert matches(["a ... b", "...", "c"], "a 1 b\nx\ny\nc\n")
    assert matches(["12:00:00.000 d"], "23:59:59.999 d\n")
    assert not matches(["a"], "a\nb\n") and not matches(["a", "b"], "a\n") and not matches(["12:00:00.000"], "noon\n")


def check_versions(page):
    """What is not run installs what is run."""
    for version in re.findall(r"pip install (\S+==\S+)", page):
        assert version in (ROOT / "run").read_text(), f"./run setup --peers does not install {version}"


def python_of(peer):
    variable, default, module = PEERS[peer]
    python = pathlib.Path(os.environ.get(variable) or ROOT / default).resolve() / "bin/python"
    if not python.exists() or subprocess.run([python, "-c", f"import {module}"], stderr=subprocess.DEVNULL, check=False).returncode != 0:
        missing(peer)
    return python


def hide_other_bridges():
    """`trestle status` shows root the bridges of everybody: this program goes on where /run is empty."""
    if os.geteuid() == 0 and "TRESTLE_PAGE" not in os.environ:
        os.environ["TRESTLE_PAGE"] = "1"
        os.execvp("unshare", ["unshare", "--mount", "sh", "-c", 'mount -t tmpfs none /run && exec "$@"', "sh", sys.executable, "-B",
                              *sys.argv])


def main():
    hide_other_bridges()
    check_myself()
    trestle, page = (pathlib.Path(one).resolve() for one in sys.argv[1:3])
    text = page.read_text()
    check_versions(text)
    pythons = {peer: python_of(peer) for peer in sys.argv[3:]}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copytree(ROOT / "examples", folder / "examples")
        programs = folder / "bin"
        programs.mkdir()
        (programs / "trestle").symlink_to(trestle)
        if "pysomeip" in pythons:
            (folder / "examples/tutorial/ecu").symlink_to(pythons["pysomeip"].parents[1])  # what pip would have made
        if "ros" in pythons:
            for name in ("ros2", "colcon"):
                (programs / name).write_text(f'#!/bin/sh\nexec {shlex.quote(str(pythons["ros"]))} -B {HERE}/{name}.py "$@"\n')
                (programs / name).chmod(0o755)
        session = Session(folder, {"PATH": f"{programs}:/usr/bin:/bin", "HOME": str(folder), "ROS_HOME": str(folder / "ros"),
                                   "XDG_RUNTIME_DIR": str(folder), "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp", "LC_ALL": "C.UTF-8",
                                   "PYTHONDONTWRITEBYTECODE": "1"})
        try:
            ran = [session.run(comment, lines) for comment, lines in blocks(text)]
        except AssertionError as error:
            print(error)
            return 1
        finally:
            session.close()
        assert len(ran) > 1
    print(f"all commands of {page.name} print what stands there")
    return 0


if __name__ == "__main__":
    sys.exit(main())
