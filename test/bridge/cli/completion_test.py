#!/usr/bin/env python3
"""completion_test.py TRESTLE: scripts for shells and pages of the manual, beside what `--help` shows.

Completion is tried in each shell that is installed.
"""
import functools
import re
import shutil
import subprocess
import sys
import tempfile
import pathlib
import unittest

TRESTLE = sys.argv.pop(1)


def run(*command, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command} ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


@functools.cache
def shown(*command):
    """The subcommands and the options that the help of a command shows."""
    text = run(TRESTLE, *command, "--help").replace("OPTIONS:", "Options:").replace("SUBCOMMANDS:", "Subcommands:")
    commands = re.findall(r"^  (\w[\w-]*) ", text.partition("\nSubcommands:")[2].partition("\n\n")[0], re.MULTILINE)
    options = []
    # A block after each heading, up to the text below, which has none with a dash in front.
    for line in text.splitlines():
        entry = re.match(r"  (-[\w?-]+(?:,\s*-[\w?-]+)*)(?: |$)", line)
        if entry:
            options += re.split(r",\s*", entry[1])
    return commands, sorted(set(options))


@functools.cache
def every_command():
    def below(command):
        yield command
        for inner in shown(*command)[0]:
            yield from below((*command, inner))
    return list(below(()))


class Bash(unittest.TestCase):
    shell = "bash"

    @classmethod
    def setUpClass(cls):
        if not shutil.which(cls.shell):
            raise unittest.SkipTest(f"there is no {cls.shell}")
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.work = pathlib.Path(cls.folder.name)
        (cls.work / "script").write_text(run(TRESTLE, "completion", cls.shell))
        (cls.work / "bridge.yaml").touch()

    def completed(self, *words):
        """What stands there for the last word."""
        program = 'source ./script; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _trestle; printf "%s\\n" "${COMPREPLY[@]}"'
        out = run("bash", "--norc", "-c", program, "bash", "trestle", *words, cwd=self.work)
        return sorted(filter(None, out.splitlines()))

    def test_offers_each_command_and_option_of_the_help(self):
        self.assertGreater(len(every_command()), 20)
        for command in every_command():
            commands, options = shown(*command)
            with self.subTest(command):
                self.assertIn("--help", options)
                if commands:
                    self.assertEqual(self.completed(*command, ""), sorted(commands))
                offered = self.completed(*command, "-")
                if self.shell == "fish":  # which offers short options only alone
                    offered += self.completed(*command, "--")
                self.assertEqual(sorted(set(offered)), options)

    def test_goes_on_with_what_was_typed(self):
        self.assertEqual(self.completed("sub"), ["subscribe"])
        self.assertEqual(self.completed("conform", "sel"), ["selftest"])
        self.assertEqual(self.completed("check", "--qui"), ["--quiet"])

    def test_offers_words_and_files_where_they_belong(self):
        self.assertEqual(self.completed("check", "bri"), ["bridge.yaml"])
        self.assertEqual(self.completed("call", "--interfaces", "bri"), ["bridge.yaml"])
        self.assertEqual(self.completed("conform", "run", "--role", ""), ["both", "client", "server"])
        self.assertEqual(self.completed("call", "--timeout", "bri"), [])

    def test_the_value_of_an_option_is_no_command(self):
        self.assertEqual(self.completed("demo", "--json", "check", "--seco"), ["--seconds"])


class Zsh(Bash):
    shell = "zsh"

    def completed(self, *words):
        # Outside of an editor line there is no completion system: these stand for what it does with the offers.
        program = ('compdef() {}; _describe() { shift; [[ $1 == option ]] && shift; local one; '
                   'for one in "${(@P)@[-1]}"; do print -r -- "${one%%:*}"; done; }; '
                   '_files() { print -rl -- *(N); }; source ./script; words=("$@"); CURRENT=$#; _trestle')
        out = run("zsh", "-f", "-c", program, "zsh", "trestle", *words, cwd=self.work)
        return sorted(one for one in out.splitlines() if one.startswith(words[-1]))


class Fish(Bash):
    shell = "fish"

    def completed(self, *words):
        program = "source ./script; complete -C (string join ' ' -- $argv)"
        out = run("fish", "--no-config", "-c", program, "trestle", *words, cwd=self.work)
        return sorted(line.partition("\t")[0] for line in out.splitlines())


class Man(unittest.TestCase):
    def test_has_a_page_for_each_command_with_all_that_the_help_says(self):
        with tempfile.TemporaryDirectory() as folder:
            run(TRESTLE, "man", "--output", folder)
            pages = {path.name: path.read_text() for path in pathlib.Path(folder).iterdir()}
        self.assertEqual(sorted(pages), sorted("-".join(("trestle", *command)) + ".1" for command in every_command()))
        for command in every_command():
            page = pages["-".join(("trestle", *command)) + ".1"].replace("\\-", "-")
            commands, options = shown(*command)
            for name in commands:
                self.assertIn(f"\\fB{name}\\fR", page)
            for option in options:
                self.assertIn(f"\\fB{option}\\fR", page)
            self.assertEqual(page, run(TRESTLE, "man", *command).replace("\\-", "-"))

    def test_an_unknown_command_is_an_error(self):
        done = subprocess.run([TRESTLE, "man", "conform", "nothing"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("There is no command 'conform nothing'", done.stderr)

    def test_can_be_read(self):
        if not shutil.which("man"):
            self.skipTest("there is no man")
        with tempfile.TemporaryDirectory() as folder:
            run(TRESTLE, "man", "--output", folder)
            pages = {}
            for path in sorted(pathlib.Path(folder).iterdir()):
                done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", str(path)], stdout=subprocess.PIPE,
                                      stderr=subprocess.PIPE, text=True, timeout=60,
                                      env={"MANROFFSEQ": "", "MANWIDTH": "80", "LC_ALL": "C.UTF-8", "PATH": "/usr/bin:/bin"})
                self.assertEqual((done.returncode, done.stderr), (0, ""), path.name)
                pages[path.name] = done.stdout
        self.assertIn("Check configurations", pages["trestle-check.1"])
        self.assertRegex(pages["trestle-check.1"], r"EXAMPLES\n +trestle check bridge\.yaml\n")
        self.assertRegex(pages["trestle.1"], r"'trestle\s+COMMAND\s+--help'\s+explains")


if __name__ == "__main__":
    unittest.main()
