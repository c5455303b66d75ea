"""Which requirements of the Open SOME/IP Specification the tests cover.

    coverage.py check            every id that is cited exists, every requirement has a test or a reason (a ctest test)
    coverage.py write LOG        makes docs/coverage.md from the log of a test run (`./run coverage`)
    coverage.py fresh            docs/coverage.md shows the tests that name each requirement (a stage of `./run test`)

bridge/conform/catalogue/requirements.csv and other_ids.txt beside this file hold every id of the specification; reasons.csv says why a
requirement has no test. LOG is the file that TRESTLE_COVERED named during the run: a line "test<TAB>ids" from each
test that passed. GoogleTest programs write it through test/covers.hpp; other programs append their own line.

`check` and `fresh` read only the sources, so they say the same on every machine and in every order of the tests.
"""
import argparse
import collections
import csv
import json
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parent.parent
DOCUMENT = SOURCE / "docs" / "coverage.md"
ID = re.compile(r"feat_req_[a-z]+_[0-9]+")
TEST = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\(\s*(\w+),\s*(\w+)\s*\)", re.MULTILINE)
NOT_YET = "not implemented yet"
TEXT = {".cpp", ".hpp", ".c", ".h", ".py", ".sh", ".md", ".csv", ".yaml", ".txt", ".idl", ".js", ".html", ".cmake"}


def read_csv(name):
    # The program carries the requirements, too: `trestle conform explain`.
    folder = SOURCE / "bridge" / "conform" / "catalogue" if name == "requirements.csv" else HERE
    with open(folder / name, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def sources():
    """Every text file of the project with its content, but not what is built."""
    for folder in sorted(SOURCE.iterdir()):
        if folder.name == "build" or folder.name.startswith("."):
            continue
        for path in sorted(folder.rglob("*")) if folder.is_dir() else [folder]:
            if path.suffix in TEXT and path.is_file() and path != DOCUMENT:
                yield path, path.read_text(encoding="utf-8", errors="replace")


def calls_in_sources():
    """The covers(...) calls of the tests: the ids, the file, the line, and the test, "Suite.Name"."""
    for path, text in sources():
        if path.is_relative_to(SOURCE / "test") and path != pathlib.Path(__file__).resolve():
            tests = [(test.start(), f"{test[1]}.{test[2]}") for test in TEST.finditer(text)]
            for call in re.finditer(r"\bcovers\((.*?)\)", text, re.DOTALL):
                before = [name for at, name in tests if at < call.start()]
                yield (ID.findall(call.group(1)), path.relative_to(SOURCE), text.count("\n", 0, call.start()) + 1,
                       before[-1] if before else "")


def covered_in_sources():
    """The ids in the covers(...) calls of the tests, each with the places."""
    result = collections.defaultdict(set)
    for ids, path, line, _ in calls_in_sources():
        for id in ids:
            result[id].add(f"{path}:{line}")
    return result


def covered_in_log(log):
    """The ids that passing tests recorded, each with the tests; the cases of one parametrised test count as one."""
    result = collections.defaultdict(set)
    for line in pathlib.Path(log).read_text(encoding="utf-8").splitlines():
        test, _, ids = line.partition("\t")
        suite, _, name = test.partition(".")
        suite = [part for part in suite.split("/") if not part.isdigit()][-1]  # Instance/Suite, Suite/0
        for id in ids.split():
            result[id].add(f"{suite}.{name.split('/')[0]}" if name else test)
    return result


def check(specification):
    problems = []
    rows = read_csv("requirements.csv")
    known = {row["id"] for row in rows}
    others = set(ID.findall((HERE / "other_ids.txt").read_text(encoding="utf-8")))
    for path, text in sources():
        for number, line in enumerate(text.splitlines(), 1):
            for id in set(ID.findall(line)) - known - others:
                problems.append(f"{path.relative_to(SOURCE)}:{number}: the specification has no requirement {id}")
    covered = covered_in_sources()
    reasons = read_csv("reasons.csv")
    for id, places in covered.items():
        if id in others:
            problems.append(f"{min(places)}: {id} is a heading or an explanation: there is nothing in it to cover")
    for number, row in enumerate(reasons, 2):
        place = f"test/conformance/reasons.csv:{number}"
        if row["id"] in others or not (row["reason"] or "").strip():
            problems.append(f"{place}: {row['id']} needs no reason, or has an empty one")
    for id, count in collections.Counter(row["id"] for row in reasons + rows).items():
        if count > 2 or (count == 2 and id not in known):
            problems.append(f"{id} has {count} lines in the tables")
    explained = {row["id"] for row in reasons}
    for row in rows:
        if row["testable"] != "no" and row["id"] not in covered and row["id"] not in explained:
            problems.append(f"{row['id']} ({row['area']}: {row['summary']}) has no test, and no reason in reasons.csv")
    if specification:
        text = "".join(path.read_text(encoding="utf-8") for path in sorted(pathlib.Path(specification).rglob("*.rst")))
        ids = set(re.findall(r":id:\s*(feat_req_[a-z]+_[0-9]+)\s", text))
        for id in sorted(ids ^ (known | others)):
            problems.append(f"{id} is only in {'the specification' if id in ids else 'our tables'}")
    return problems


def needless_reasons(covered):
    return [f"{row['id']} has a test now ({min(covered[row['id']])}): delete its line from test/conformance/reasons.csv"
            for row in read_csv("reasons.csv") if row["id"] in covered]


def fresh():
    text = DOCUMENT.read_text(encoding="utf-8") if DOCUMENT.exists() else ""
    shown = {(id, test) for id, tests in re.findall(r"^\| (feat_req_[a-z]+_[0-9]+) \|.*\| (`[^|]*) \|$", text, re.MULTILINE)
             for test in re.findall(r"`([^`]+)`", tests)}
    named, elsewhere = {}, set()
    for ids, path, line, test in calls_in_sources():
        if path.is_relative_to("test/interop"):  # tests with other stacks, which not each machine has
            elsewhere |= {(id, test) for id in ids}
        else:
            named |= {(id, test): f"{path}:{line}" for id in ids}
    return (needless_reasons(covered_in_sources()) +
            [f"docs/coverage.md shows {test} as a test of {id}, but no such test names it"
             for id, test in sorted(shown - set(named) - elsewhere)] +
            [f"{place}: {test} covers {id}, but docs/coverage.md does not show it"
             for (id, test), place in sorted(named.items()) if (id, test) not in shown])


def table(header, lines):
    head, *rest = ["| " + " | ".join(str(cell) for cell in cells) + " |" for cells in [header, *lines]]
    return "\n".join([head, "|" + " --- |" * len(header), *rest])


def mutation_section():
    path = HERE.parent / "mutation" / "result.json"
    if not path.exists():
        return ""
    text = """
## Would the tests notice?

A tool breaks one line of `someip/` or `sd/` at a time, at random places, and runs the unit tests against each broken copy
([how](../test/mutation/mutate.py)). A mutant that a test notices is killed. Mutants that do not compile are not counted;
those that behave like the original are listed, each with the reason, in
[equivalent.csv](../test/mutation/equivalent.csv).
"""
    for result in json.loads(path.read_text(encoding="utf-8")).values():
        lines = [(f"`{file}`", n["killed"], n["survived"], n["equivalent"]) for file, n in sorted(result["files"].items())]
        total = [sum(line[i] for line in lines) for i in (1, 2, 3)]
        score = 100 * total[0] / (total[0] + total[1])
        text += f"""
`{result["command"]}`: **{total[0]} of {total[0] + total[1]} mutants killed, {score:.1f} %.**

{table(("file", "killed", "survived", "equivalent"), lines)}
"""
    return text


def write(log):
    recorded, named = covered_in_log(log), covered_in_sources()
    silent = [f"{min(named[id])} covers {id}, but in {log} no passing test recorded it" for id in sorted(set(named) - set(recorded))]
    silent += [f"{min(recorded[id])} recorded {id}, which no covers(...) spells out" for id in sorted(set(recorded) - set(named))]
    silent += needless_reasons(named)
    if silent:
        return silent
    reasons = {row["id"]: row["reason"] for row in read_csv("reasons.csv")}
    areas = collections.defaultdict(list)
    for row in read_csv("requirements.csv"):
        areas[row["area"]].append(row)

    def outcome(row):
        if row["id"] in recorded:
            return "tested"
        if row["testable"] == "no":
            return "nothing"
        return "later" if reasons.get(row["id"], "").startswith(NOT_YET) else "reason"

    def cell(row):
        tests = ", ".join(f"`{test}`" for test in sorted(recorded.get(row["id"], ())))
        return tests or reasons.get(row["id"]) or "nothing to test: " + (
            "explanation" if row["kind"] == "info" else "a rule for those who design or configure a system")

    summary = []
    for area in sorted(areas):
        count = collections.Counter(outcome(row) for row in areas[area])
        asked = sum(row["testable"] != "no" for row in areas[area])
        tested = sum(row["testable"] != "no" and row["id"] in recorded for row in areas[area])
        link = f"[{area}](#{re.sub(r'[^a-z0-9-]', '', area.replace(' ', '-'))})"
        summary.append((link, asked, tested, count["later"], count["reason"], len(areas[area]) - asked))
    total = [sum(line[i] for line in summary) for i in range(1, 6)]
    text = f"""# Requirement coverage

<!-- Made by `./run coverage` from a run of all tests. Do not edit. -->

Every requirement of the Open SOME/IP Specification, with the tests that fail when it is broken, or with the reason why
there is none. The ids and their short descriptions come from [requirements.csv](../bridge/conform/catalogue/requirements.csv),
the tests from the test run itself: a test names what it covers, and only tests that passed are counted. Redo this page
with `./run coverage`.

**{total[1]} of {total[0]} testable requirements have a test ({100 * total[1] / total[0]:.1f} %).** {total[2]} wait for
features that are not implemented yet, {total[3]} have another written reason. The {total[4]} rows below "nothing to test"
are explanations and rules for people, not for a stack.

{table(("area", "testable", "tested", NOT_YET, "other reason", "nothing to test"), [*summary, ("**all**", *total)])}
{mutation_section()}"""
    for area in sorted(areas):
        lines = [(row["id"], row["kind"], row["testable"], row["summary"].replace("|", "\\|"), cell(row)) for row in areas[area]]
        text += f"\n## {area}\n\n{table(('requirement', 'kind', 'testable', 'in short', 'tests, or why none'), lines)}\n"
    DOCUMENT.write_text(text, encoding="utf-8")
    print(f"docs/coverage.md: {total[1]} of {total[0]} testable requirements have a test, {total[2]} are {NOT_YET}")
    return []


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("check").add_argument("--specification", help="its folder: compare the tables with it")
    commands.add_parser("write").add_argument("log")
    commands.add_parser("fresh")
    given = parser.parse_args()
    if given.command == "check":
        problems = check(given.specification)
    elif given.command == "write":
        problems = write(given.log)
    else:
        problems = fresh()
        if problems:
            problems.insert(0, "docs/coverage.md is out of date: redo it with ./run coverage")
    for problem in problems[:30]:
        print(problem, file=sys.stderr)
    if problems[30:]:
        print(f"... and {len(problems) - 30} more", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
