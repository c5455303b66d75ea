"""Would the tests notice a mistake? Breaks the code one line at a time and runs the unit tests against each mutant.

    ./run mutation [--part core|net] [--count N] [--seed S]
                              N mutants, drawn at random from all that there are
    ./run mutation --again    only those that survived the last time, after tests were added: the tally of that run is
                              brought up to date
    ./run mutation --list     every mutant that there is

Mutants are made of someip/ and sd/, either wire/, core/ and c/ or net/: a relation or a calculation becomes its neighbour, a
constant one more or less, a condition its opposite, a returned value the empty one, a statement nothing. A mutated file is compiled
beside the sources, which are never touched, and linked before the libraries that hold the original; so a mutant costs a
compilation or two. It is killed when a program of test/someip or test/sd fails, crashes or hangs: for net/ the programs
that open sockets, each in a network namespace of its own (that needs root; else one after the other). These wait for real
time, so they must fail twice, and the original must pass the same test at that moment. For the others it is those programs
that open none. A mutant that does not compile is not counted. equivalent.csv lists those that differ in nothing that can
be observed, each with the reason.

The tally goes to result.json, which docs/coverage.md shows; it is there from the first mutants on, so a run may be cut
short: it then says what a run with fewer mutants would say. The exit status is 1 below --goal percent.
"""
import argparse
import collections
import concurrent.futures
import contextlib
import csv
import json
import os
import pathlib
import random
import re
import resource
import shlex
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parent.parent
FOLDERS = {"core": ("someip/wire", "someip/core", "sd/wire", "sd/core", "sd/c"), "net": ("someip/net", "sd/net")}
MEMORY_BYTES = {"core": 2 << 30, "net": 16 << 30}  # a Node reserves half a gigabyte, and takes what it fills
ALONE = ["unshare", "--net", "sh", "-c", 'ip link set lo up && exec "$0" "$@"']

Mutant = collections.namedtuple("Mutant", "file line begin end text")


# ---- which mutants there are

def masked(text):
    """`text` with blanks for what is not to be mutated: comments, literals of text, directives, assertions."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match.group(0))

    text = re.sub(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|(?<![\w])\'(?:\\.|[^\'\\\n])+\'', blank, text, flags=re.DOTALL)
    text = re.sub(r"^[ \t]*#[^\n]*", blank, text, flags=re.MULTILINE)
    return re.sub(r"\b(?:static_)?assert\((?:[^;]*)\);", blank, text)


NEIGHBOURS = {
    "<": ["<=", ">="], "<=": ["<", ">"], ">": [">=", "<="], ">=": [">", "<"], "==": ["!="], "!=": ["=="],
    "&&": ["||"], "||": ["&&"], "+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"], "%": ["/"], "&": ["|"], "|": ["&"],
    "^": ["&"], "<<": [">>"], ">>": ["<<"], "+=": ["-="], "-=": ["+="], "*=": ["/="], "|=": ["&="], "&=": ["|="],
}
BINARY = re.compile(r"(?<= )(?:" + "|".join(re.escape(op) for op in sorted(NEIGHBOURS, key=len, reverse=True)) + r")(?=[ \n])")
NUMBER = re.compile(r"(?<![\w.'])(0x[0-9a-fA-F']+|[0-9][0-9']*)((?:[uU]?[lL]{0,2}|ns|us|ms|s|min|h))(?![\w.'])")
STATEMENT = re.compile(r"^[ \t]+((?:(?:\+\+|--)?[\w:.<>\[\]()*]+(?:->[\w.\[\]()]+)*(?:\(| [-+|&*]?= )[^;{}]*"
                       r"|(?:\+\+|--)[\w.>\[\]()-]+|return|break|continue);)$", re.MULTILINE)


def balanced(text, opening):
    """The place behind the bracket that closes the one at `opening`."""
    depth = 0
    for at in range(opening, len(text)):
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        if depth == 0:
            return at + 1
    return len(text)


def changes(code):
    """(begin, end, new text) of every mutation of masked code."""
    for match in BINARY.finditer(code):
        for other in NEIGHBOURS[match.group(0)]:
            yield match.start(), match.end(), other
    for match in NUMBER.finditer(code):
        number = int(match.group(1).replace("'", ""), 0)
        for other in (number + 1, number - 1):
            if other >= 0:
                yield match.start(), match.end(), f"{other:#x}{match.group(2)}" if "x" in match.group(1) else f"{other}{match.group(2)}"
    for match in re.finditer(r"\b(true|false)\b", code):
        yield match.start(), match.end(), "false" if match.group(0) == "true" else "true"
    for match in re.finditer(r"\b(?:if|while) \(", code):
        end = balanced(code, match.end() - 1)
        condition = code[match.end():end - 1]
        declared = re.fullmatch(r"(.*; )?(const auto [*&]?|auto [*&]?)?(.*)", condition, re.DOTALL)
        if not declared.group(2):
            begin = match.end() + len(declared.group(1) or "")
            yield begin, end - 1, f"!({{{begin}:{end - 1}}})"
    for match in re.finditer(r"\breturn ([^;]+);", code):
        if match.group(1) not in ("true", "false", "{}", "std::nullopt", "nullptr", "0") and "{\n" not in match.group(1):
            yield match.start(1), match.end(1), "{}"
    for match in STATEMENT.finditer(code):
        if match.group(1).count("(") == match.group(1).count(")"):
            yield match.start(1), match.end(1), ";"


def mutants_of(path):
    text = (SOURCE / path).read_text(encoding="utf-8")
    for begin, end, new in sorted(set(changes(masked(text)))):
        new = re.sub(r"\{(\d+):(\d+)\}", lambda span: text[int(span.group(1)):int(span.group(2))], new)
        yield Mutant(path, text.count("\n", 0, begin) + 1, begin, end, new)


def all_mutants(part, only):
    files = sorted(str(path.relative_to(SOURCE)) for folder in FOLDERS[part] for path in (SOURCE / folder).rglob("*.[ch]pp"))
    return [mutant for file in files if re.search(only, file) for mutant in mutants_of(file)]


def lines_of(mutant):
    """The lines that the mutant changes, before and after."""
    text = (SOURCE / mutant.file).read_text(encoding="utf-8")
    first, last = text.rfind("\n", 0, mutant.begin) + 1, text.find("\n", mutant.end)
    joined = lambda lines: " ".join(lines.split())
    return joined(text[first:last]), joined(text[first:mutant.begin] + mutant.text + text[mutant.end:last])


# ---- building and running one

def run(command, **more):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **more)


def must(command, **more):
    result = run(command, **more)
    if result.returncode != 0:
        sys.exit(f"{command} failed:\n{result.stdout[-4000:]}")
    return result.stdout


def limits(part):
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES[part], MEMORY_BYTES[part]))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


class Build:
    """An unoptimised build of the unit tests, and what is needed to build parts of it again with other sources."""

    def __init__(self, folder, part, jobs):
        self.folder, self.part = folder, part
        separate = part == "net" and os.geteuid() == 0
        self.start = ALONE if separate else []
        self.turn = threading.Lock() if part == "net" and not separate else contextlib.nullcontext()
        must(["cmake", "-S", SOURCE, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug", "-DCMAKE_CXX_FLAGS_DEBUG=-O0 -w"])
        links = {}  # program: how it is linked
        for line in must(["ninja", "-C", folder, "-t", "targets", "all"]).splitlines():
            name, _, rule = line.partition(": ")
            if re.match(r"test/(someip|sd)/", name) and rule.startswith("CXX_EXECUTABLE_LINKER"):
                links[name] = must(["ninja", "-C", folder, "-t", "commands", name]).splitlines()[-1]
        self.links = {name: link for name, link in links.items() if ("_net.a" in link) == (part == "net")}
        print(f"building {len(self.links)} test programs in {folder}", flush=True)
        must(["ninja", "-C", folder, f"-j{jobs}", *self.links])
        self.commands = {}  # object file: how it is compiled
        for entry in json.loads((folder / "compile_commands.json").read_text(encoding="utf-8")):
            words = shlex.split(entry["command"])
            self.commands[words[words.index("-o") + 1]] = words
        self.needs = collections.defaultdict(set)  # source: the object files that are made with it
        objects = None
        for line in must(["ninja", "-C", folder, "-t", "deps"]).splitlines():
            if line and not line.startswith(" "):
                objects = line.split(":")[0]
            elif line.startswith(f"    {SOURCE}/"):
                self.needs[line.strip()[len(str(SOURCE)) + 1:]].add(objects)
        self.seconds = {}
        for name in self.links:
            begin = time.monotonic()
            must([*self.start, folder / name], cwd=folder)
            self.seconds[name] = time.monotonic() - begin

    def parts(self, program):
        """The object files of a program: its own, and those in the libraries that it is linked with."""
        link = self.links[program]
        own = {word for word in link.split() if word.endswith(".o")}
        libraries = re.findall(r"(\S+)/lib(trestle_\w+)\.a", link)
        return own | {part for part in self.commands for folder, name in libraries if part.startswith(f"{folder}/CMakeFiles/{name}.dir/")}

    def verdict(self, mutant):
        """What became of the mutant: "invalid", "survived", or the program that killed it."""
        affected = self.needs[mutant.file]
        programs = [name for name in self.links if self.parts(name) & affected]
        programs.sort(key=lambda name: (name.split("/")[1] != mutant.file.split("/")[0], self.seconds[name]))
        with tempfile.TemporaryDirectory(dir=self.folder) as room:
            text = (SOURCE / mutant.file).read_text(encoding="utf-8")
            changed = pathlib.Path(room, mutant.file)
            changed.parent.mkdir(parents=True)
            changed.write_text(text[:mutant.begin] + mutant.text + text[mutant.end:], encoding="utf-8")
            made = {}
            for program in programs:
                for part in sorted(self.parts(program) & affected):
                    if part not in made:
                        made[part] = os.path.join(room, f"{len(made)}.o")
                        words = list(self.commands[part])
                        words[words.index("-o") + 1] = made[part]
                        words = [str(changed) if word == str(SOURCE / mutant.file) else word for word in words]
                        words.insert(1, f"-I{room}")
                        if run(words, cwd=self.folder).returncode != 0:
                            return "invalid"
                if self.fails(program, made, room):
                    return program
        return "survived" if programs else "untested"

    def fails(self, program, made, room):
        words = shlex.split(self.links[program].replace(": &&", "").replace("&& :", ""))
        own = set(words)
        words = [made.get(word, word) for word in words]
        at = words.index("-o")
        extra = [made[part] for part in self.parts(program) if part in made and part not in own]
        mutated = os.path.join(room, os.path.basename(program))
        must([*words[:at], *extra, "-o", mutated, *words[at + 2:]], cwd=self.folder)
        try:
            if self.part != "net":
                return self.failed_test(mutated, program) is not None
            for _ in range(3):  # until it passes, or fails where the original does not
                tests = [self.failed_test(mutated, program) for _ in range(2)]
                if None in tests:
                    return False
                if self.failed_test(program, program, tests[-1]) is None:
                    return True
            return False
        finally:
            os.unlink(mutated)

    def failed_test(self, path, program, only="*"):
        """The first test that a program at `path` fails, a build of `program`: "*" when it crashes or hangs, else None."""
        command = [*self.start, path, "--gtest_brief=1", "--gtest_fail_fast", f"--gtest_filter={only}"]
        patience = (4 if self.part == "net" else 20) * self.seconds[program] + 10
        try:
            with self.turn:
                result = run(command, cwd=self.folder, preexec_fn=lambda: limits(self.part), timeout=patience)
        except subprocess.TimeoutExpired:
            return "*"
        if result.returncode == 0:
            return None
        failed = re.search(r"^\[  FAILED  \] (\S+?)(?:,| \(|$)", result.stdout, re.MULTILINE)
        return failed.group(1) if failed else "*"


# ---- the tally

def read_equivalent():
    with open(HERE / "equivalent.csv", newline="", encoding="utf-8") as file:
        return {(row["file"], row["before"], row["after"]) for row in csv.DictReader(file)}


def sample(mutants, equivalent, count, judge, jobs):
    """Judges mutants in their order until `count` of them count. Gives (mutant, verdict) in that order."""
    counted = 0
    mutants = iter(mutants)
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        while counted < count:
            batch = [mutant for _, mutant in zip(range(min(8 * jobs, count - counted)), mutants)]
            if not batch:
                return
            decide = lambda mutant: "equivalent" if (mutant.file, *lines_of(mutant)) in equivalent else judge(mutant)
            for mutant, verdict in zip(batch, pool.map(decide, batch)):
                counted += verdict not in ("invalid", "equivalent", "untested")
                yield mutant, verdict


def main():
    parser = argparse.ArgumentParser(prog="./run mutation", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=sorted(FOLDERS), default="core", help="what to break (core)")
    parser.add_argument("--count", type=int, default=300, help="mutants to judge (300)")
    parser.add_argument("--seed", type=int, default=1, help="which ones (1)")
    parser.add_argument("--only", default="", help="mutate only files whose name matches this expression; no result is kept")
    parser.add_argument("--again", action="store_true", help="judge only the survivors of the last run")
    parser.add_argument("--list", action="store_true", help="print every mutant and exit")
    parser.add_argument("--goal", type=float, default=85, help="percent of mutants to be killed (85)")
    parser.add_argument("--build", type=pathlib.Path, default=SOURCE / "build" / "mutation")
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args()
    if given.part != "net":  # whose tests wait for real time
        os.nice(19)
    mutants = all_mutants(given.part, given.only)
    if given.list:
        for mutant in mutants:
            print(f"{mutant.file}:{mutant.line}\n  - {lines_of(mutant)[0]}\n  + {lines_of(mutant)[1]}")
        return 0
    random.Random(given.seed).shuffle(mutants)
    last = HERE / "result.json"
    files = collections.defaultdict(lambda: {"killed": 0, "survived": 0, "equivalent": 0})
    command = None
    if given.again:
        before = json.loads(last.read_text(encoding="utf-8"))[given.part]
        command = before["command"]
        left = {tuple(survivor) for survivor in before["survivors"]}
        for file, tally in before["files"].items():
            files[file].update(tally, survived=0)
        mutants = [mutant for mutant in mutants if (mutant.file, mutant.line, *lines_of(mutant)) in left]
        if len(mutants) != len(left):
            sys.exit(f"the sources have changed since the last run ({last}): some of its survivors are gone; run it anew")
    build = Build(given.build.resolve(), given.part, given.jobs)
    survivors, untested, killed_by, begin = [], 0, collections.Counter(), time.monotonic()

    def save():
        if not given.only:
            judged = sum(tally["killed"] + tally["survived"] for tally in files.values())
            results = json.loads(last.read_text(encoding="utf-8"))
            results[given.part] = {"command": command or f"./run mutation --part {given.part} --count {judged} --seed {given.seed}",
                                   "files": dict(sorted(files.items())), "survivors": sorted(survivors)}
            last.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")

    for mutant, verdict in sample(mutants, read_equivalent(), given.count, build.verdict, given.jobs):
        if verdict in ("survived", "equivalent"):
            files[mutant.file][verdict] += 1
        elif verdict == "untested":
            untested += 1
        elif verdict != "invalid":
            files[mutant.file]["killed"] += 1
            killed_by[verdict] += 1
        if verdict == "survived":
            survivors.append((mutant.file, mutant.line, *lines_of(mutant)))
            print("survived: {}:{}\n  - {}\n  + {}".format(*survivors[-1]), flush=True)
        if verdict not in ("invalid", "equivalent") and not given.again:
            save()
    killed = sum(tally["killed"] for tally in files.values())
    total = killed + len(survivors)
    score = 100 * killed / max(total, 1)
    print(f"{killed} of {total} mutants killed, {score:.1f} %, in {time.monotonic() - begin:.0f} s; " +
          ", ".join(f"{program.split('/')[-1]} killed {count}" for program, count in killed_by.most_common()))
    if untested:
        print(f"{untested} mutants are in files that no test program uses")
    save()
    return 0 if score >= given.goal else 1


if __name__ == "__main__":
    sys.exit(main())
