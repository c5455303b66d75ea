#!/usr/bin/env python3
"""Checks that what the documents point to is there.

Usage: docs_test.py SOURCE_FOLDER

- A link in any page leads to a file, and its anchor to a heading of that file.
- A path in backquotes in CONTRIBUTING.md, the architecture page, the glossary or docs/internals/ is that of a file or folder.
  A bare file name means a file that lies beside one named before it.
- A function in backquotes in docs/internals/, `Class::name()` or `name()`, stands in one of the files named in its row.
- docs/architecture.svg was drawn from docs/architecture.dot as it is now, and its arrows are the includes that there are.
- Each folder below bridge/ has a box in that drawing, and stands in docs/architecture.md and docs/internals/README.md.
- Each page of docs/ has its row in docs/README.md.
- A command of `trestle` or `./run` that a page shows is one, and its long options stand in the program's sources.
- docs/troubleshooting.md has each cause of docs/status.md, and docs/choosing.md and the README no figure that neither
  docs/performance.md nor docs/hostile.md has. "N times" is the ratio of the rows that it is about.
- Pages and sources do not say "for", "to", "of", "by", "with" or "from" with a bare "who" behind it, but whom they mean.
- The table of docs/cli.md has the commands of bridge/program/main.cpp in the order of its help, and docs/architecture.md names the room of each.
"""
import hashlib
import pathlib
import re
import sys
import tempfile

NAMES_PATHS = ("CONTRIBUTING.md", "docs/architecture.md", "docs/glossary.md", "docs/internals/*.md")
LINK = re.compile(r"\]\(([^)\s]+)\)")
CODE = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
PATH = re.compile(r"^[\w.-]+(/[\w.*-]+)*/?$")
SUFFIXES = (".cpp", ".hpp", ".py", ".md", ".txt", ".yaml", ".cmake", ".dot", ".svg", ".h", ".c")
TOPS = ("someip", "sd", "dds_adapter", "bridge", "pcaps", "fuzz", "test", "docs", "examples", "cmake", ".ci")
# What a reader makes, or the name of something that others have.
NOT_OURS = re.compile(r"build/|fuzz/corpus/TARGET|NAME|FILE|PointCloud2\.msg")


def anchors(text):
    """Those that GitHub makes of the headings."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE), re.MULTILINE):
        heading = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        found.add(re.sub(r" ", "-", re.sub(r"[^\w\- ]", "", heading)))
    return found


def bad_links(root):
    for page in sorted([*root.glob("*.md"), *root.glob("docs/**/*.md")]):
        for link in LINK.findall(re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)):
            if re.match(r"\w+:", link):
                continue
            file, _, anchor = link.partition("#")
            there = page if not file else (page.parent / file)
            if not there.exists():
                yield f"{page.relative_to(root)}: {link}: no such file"
            elif anchor and there.suffix == ".md" and anchor not in anchors(there.read_text()):
                yield f"{page.relative_to(root)}: {link}: no such heading"


def blocks(text):
    """Paragraphs, items of lists and rows of tables, without what is shown as code."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.split(r"\n\s*\n|\n(?=[|-])", text)


def files_of(root, pattern):
    return sorted(root.glob(pattern)) if "*" in pattern else [path for path in [root / pattern] if path.exists()]


def bad_paths(root):
    for page in sorted(path for pattern in NAMES_PATHS for path in root.glob(pattern)):
        where = page.relative_to(root)
        folders = []  # of the files named before, of this page
        for block in blocks(page.read_text()):
            named = []
            for code in CODE.findall(block):
                is_file = code.endswith(SUFFIXES) and PATH.match(code)
                is_path = "/" in code and PATH.match(code) and code.split("/")[0] in TOPS
                if NOT_OURS.search(code) or not (is_file or is_path):
                    if "NAME" in code and (root / code).parent.is_dir():  # a file to be made there, beside others
                        folders.append(code.rpartition("/")[0])
                    continue
                found = files_of(root, code)
                if not found and "/" not in code:
                    for folder in [*reversed(folders)]:
                        found = files_of(root, f"{folder}/{code}")
                        if found:
                            break
                if not found:
                    yield f"{where}: {code}: no such file"
                    continue
                named += found
                folders.append(found[0].parent.relative_to(root).as_posix() if found[0].is_file() else code.rstrip("/"))
            if named and "internals" in str(where):
                yield from (f"{where}: {name}() is not in {', '.join(str(one.relative_to(root)) for one in named)}"
                            for name in missing_functions(block, named))


def missing_functions(block, named):
    beside = {path for one in named if one.is_file() for path in one.parent.glob(one.stem + ".*")}
    text = "".join(path.read_text(errors="replace") for path in beside)
    for code in CODE.findall(block):
        call = re.match(r"^(?:\w+::)*(\w+)\(\)$", code)
        if call and text and not re.search(rf"\b{call[1]}\b", text):
            yield call[1]


def bad_drawing(root):
    source, drawing = root / "docs/architecture.dot", root / "docs/architecture.svg"
    if not source.exists() or not drawing.exists():
        yield "docs/architecture.svg: not there, or not what it is drawn from"
    elif hashlib.sha256(source.read_bytes()).hexdigest() not in drawing.read_text():
        yield "docs/architecture.svg: not drawn from docs/architecture.dot as it is now; run ./run drawing"


def drawn(text):
    """The folders of each box, and the arrows between boxes."""
    folders = {}
    inside = ""  # the cluster
    for line in text.split("\n"):
        if cluster := re.search(r"subgraph cluster_(\w+)", line):
            inside = cluster[1]
        elif line.strip() == "}":
            inside = ""
        elif (box := re.match(r'\s*(\w+) \[label="([^"\\]+)', line)) and inside:
            folders[box[1]] = [("bridge/" if inside == "bridge" else "") + one for one in box[2].split(", ")]
    arrows = set()
    for start, ends in re.findall(r"^\s*(\w+) -> (\w+|\{[^}]*\})\s*$", text, re.MULTILINE):
        arrows |= {(start, end) for end in ends.strip("{}").split()}
    return folders, arrows


def box_of(folders, folder):
    """That of the longest path; "" for none."""
    fits = [(len(one), box) for box, ones in folders.items() for one in ones if f"{folder}/".startswith(f"{one}/")]
    return max(fits)[1] if fits else ""


def includes_of(root, folders):
    found = set()
    for file in (file for ones in folders.values() for one in ones for file in (root / one).rglob("*")):
        if file.suffix in (".hpp", ".cpp", ".h", ".c"):
            here = box_of(folders, file.parent.relative_to(root).as_posix())
            for include in re.findall(r'^\s*#\s*include "([^"]+)"', file.read_text(), re.MULTILINE):
                there = box_of(folders, include.rpartition("/")[0])
                if there and there != here:
                    found.add((here, there))
    return found


def below(arrows, box):
    """All that is reached from a box."""
    found, to_do = set(), [box]
    while to_do:
        here = to_do.pop()
        for end in {end for start, end in arrows if start == here} - found:
            found.add(end)
            to_do.append(end)
    return found


def bad_arrows(root):
    source = root / "docs/architecture.dot"
    folders, arrows = drawn(source.read_text() if source.exists() else "")
    real = includes_of(root, folders)
    in_core = {box for box, ones in folders.items() if re.match(r"(someip|sd)/(wire|core|c)", ones[0])}
    yield from (f"docs/architecture.dot: {start} -> {end}: there is no such include" for start, end in sorted(arrows - real))
    yield from (f"docs/architecture.dot: {start} includes of {end}, to which no arrow leads" for start, end in sorted(real)
                if end not in below(arrows, start) and (end not in in_core or start in in_core))


def bad_commands(root):
    program = root / "bridge/program/main.cpp"
    made = re.findall(r"\badd_([a-z_]+?)_commands?\(app", program.read_text()) if program.exists() else []
    page = root / "docs/cli.md"
    told = list(dict.fromkeys(re.findall(r"^\| `trestle (\w+)", page.read_text(), re.MULTILINE) if page.exists() else []))
    yield from (f"docs/cli.md: `trestle {name}` is missing in the table" for name in made if name not in told)
    yield from (f"docs/cli.md: `trestle {name}` is no command" for name in told if name not in made)
    if [name for name in made if name in told] != [name for name in told if name in made]:
        yield f"docs/cli.md: the commands are not in the order of the help: {', '.join(made)}"
    rooms = root / "docs/architecture.md"
    text = rooms.read_text() if rooms.exists() else ""
    yield from (f"docs/architecture.md: the room of `trestle {name}` is missing" for name in made
                if not re.search(rf"`(trestle )?{name}`", text))


def bad_rooms(root):
    source = root / "docs/architecture.dot"
    boxes = {one for ones in drawn(source.read_text() if source.exists() else "")[0].values() for one in ones}
    rooms = sorted({path.relative_to(root).parts[1] for path in (root / "bridge").glob("*/**/*.cpp")})
    yield from (f"docs/architecture.dot: bridge/{room} has no box" for room in rooms if f"bridge/{room}" not in boxes)
    for page in (root / "docs/architecture.md", root / "docs/internals/README.md"):
        text = page.read_text() if page.exists() else ""
        yield from (f"{page.relative_to(root)}: bridge/{room} is missing" for room in rooms
                    if not re.search(rf"bridge/{room}\b", text))


def read(path):
    return path.read_text(errors="replace") if path.exists() else ""


def unlisted_pages(root):
    listed = {(root / "docs" / link.partition("#")[0]).resolve() for link in LINK.findall(read(root / "docs/README.md"))}
    yield from (f"docs/README.md: {page.relative_to(root)} has no row" for page in sorted((root / "docs").glob("**/*.md"))
                if page.resolve() not in listed and page.parent.name != "reference" and page != root / "docs/README.md")


def shown_commands(text):
    """What stands behind a prompt, in a block of commands or in backquotes."""
    for line in re.findall(r"^(?:\$ |> )?((?:sudo |LD_\S+ )?(?:\./run|trestle) .*)$", text, re.MULTILINE):
        yield line
    yield from (code for code in CODE.findall(text) if re.match(r"(sudo )?(\./run|trestle) (?!has )", code))  # names of tests


def bad_shown_commands(root):
    program = read(root / "bridge/program/main.cpp")
    known = {"trestle": {*re.findall(r"\badd_([a-z_]+?)_commands?\(app", program), "--help", "--version", "COMMAND", "demo-publisher",
                         "demo-subscriber"},
             "./run": {*re.findall(r"^  ([a-z]+) ", read(root / "run"), re.MULTILINE), "COMMAND"}}
    sources = "".join(read(file) for file in sorted((root / "bridge").rglob("*.cpp")))
    for page in sorted([*root.glob("*.md"), *root.glob("docs/**/*.md")]):
        for line in shown_commands(page.read_text()):
            for tool, name, rest in re.findall(r"(?:^|[|&;(] ?|sudo )(\./run(?: trestle)?|trestle) ([\w-]+)([^|&;#]*)", line):
                tool = "trestle" if tool.endswith("trestle") else tool
                if name not in known[tool]:
                    yield f"{page.relative_to(root)}: {tool} {name}: no such command"
                elif tool == "trestle":
                    yield from (f"{page.relative_to(root)}: trestle {name} {option}: no such option" for option in
                                re.findall(r"(?<![\w'-])--[a-z][\w-]*", rest) if option not in sources and option != "--help")


def bad_troubleshooting(root):
    causes = re.findall(r"^\| `(\w+)` \|", read(root / "docs/status.md").partition("## Why nothing flows")[2].partition("\n## ")[0],
                        re.MULTILINE)
    counted = re.search(r"(\d+) causes", read(root / "README.md"))
    if counted and int(counted[1]) != len(causes):
        yield f"README.md: {counted[0]}, where docs/status.md has {len(causes)}"
    text = read(root / "docs/troubleshooting.md")
    yield from (f"docs/troubleshooting.md: the cause `{cause}` is missing" for cause in causes if f"`{cause}`" not in text)


# What a page calls "N times" of, and the rows of docs/performance.md whose ratios these are.
RATIOS = {"two hops of Fast DDS": r"DDS, SOME/IP, DDS (?:64 KB|256 KB|1 MB), p50, default pacing",
          "clouds of 1,000 points that are copied": r"PointCloud2 of 1,000 points to \w+(?:/IP)?, copied",
          "events of 256 KB and 1 MB one after another": r"TP sustained (?:256 KB|1 MB), default pacing"}
UNIT = r"(?:[mµn]?s|[kMG]?B/s|MB|KB|k/s|%|/s|ms/s)(?![\w/])"


def bad_figures(root):
    performance = read(root / "docs/performance.md")
    measured = re.sub(r"\s+", " ", performance + read(root / "docs/hostile.md"))
    for page, line in ((page, line) for page in ("README.md", "docs/choosing.md")
                       for line in re.findall(r"^\|.*$", read(root / page), re.MULTILINE)):
        for first, last, unit in re.findall(rf"(?:(\d[\d,.]*)(?: to | – ))?(\d[\d,.]*) ({UNIT})", line):
            for figure in (f"{number} {unit}" for number in (first, last) if number):
                if not re.search(rf"(?<![\d.,]){re.escape(figure)}(?!\d)", measured):
                    yield f"{page}: {figure}: neither in docs/performance.md nor in docs/hostile.md"
        said = re.findall(r"(?:(\d\.\d+) to )?(\d\.\d+) times", line)
        if said:
            yield from bad_ratios(page, line, [number for one in said for number in one if number], performance)


def bad_ratios(page, line, said, performance):
    """All those of the rows in their order, or the smallest and the largest, or the largest alone."""
    rows = next((row for words, row in RATIOS.items() if words in line), None)
    if rows is None:
        yield f"{page}: {' to '.join(said)} times: RATIOS of test/docs_test.py does not say of what"
        return
    ratios = re.findall(rf"^\| (?:{rows}) (?:\|[^|]*){{2}}\| (\d\.\d+) \|", performance, re.MULTILINE)
    if not ratios or said not in (ratios, [min(ratios), max(ratios)], [max(ratios)]):
        yield f"{page}: {' to '.join(said)} times, where docs/performance.md has {', '.join(ratios) or 'no such row'}"


def bare_who(root):
    suffixes = (".md", ".hpp", ".cpp", ".h", ".c", ".py", ".js")
    for file in sorted([*root.glob("*.md"), *(file for top in TOPS for file in (root / top).rglob("*"))]):
        if file.suffix in suffixes:
            text = read(file)
            for found in re.finditer(r"\b(?:for|to|of|by|with|from)(?: |\n[ /*#]*)who\b(?!,)", text, re.IGNORECASE):
                yield f"{file.relative_to(root)}:{text.count(chr(10), 0, found.start()) + 1}: say whom you mean: \"{found[0]}\""


def faults(root):
    yield from bare_who(root)
    yield from bad_links(root)
    yield from bad_paths(root)
    yield from bad_drawing(root)
    yield from bad_arrows(root)
    yield from bad_rooms(root)
    yield from bad_commands(root)
    yield from unlisted_pages(root)
    yield from bad_shown_commands(root)
    yield from bad_troubleshooting(root)
    yield from bad_figures(root)


def finds_wrong_ones():
    """That the checks can fail."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "docs/internals").mkdir(parents=True)
        (root / "sd").mkdir()
        (root / "sd/here.cpp").write_text("void there() {}  // kept for\n// who needs it\n")
        (root / "bridge/program").mkdir(parents=True)
        (root / "bridge/program/main.cpp").write_text(
            '#include "sd/here.hpp"\nint main() { add_known_command(app); add_also_command(app); add_new_command(app); }\n')
        (root / "bridge/undrawn").mkdir()
        (root / "bridge/undrawn/untold.cpp").touch()
        (root / "docs/internals/README.md").write_text("`bridge/program`\n")
        (root / "docs/cli.md").write_text("| `trestle also` | |\n| `trestle known` | |\n| `trestle gone` | |\n")
        (root / "docs/architecture.md").write_text("`bridge/program`, `trestle known`, `trestle also`\n")
        (root / "docs/architecture.dot").write_text(
            'digraph {\n subgraph cluster_bridge {\n  program [label="program"]\n }\n subgraph cluster_drivers {\n'
            '  sd [label="sd"]\n }\n sd -> program\n}\n')
        (root / "docs/architecture.svg").write_text("<!-- drawn from something else -->\n")
        (root / "docs/internals/page.md").write_text(
            "# A page\n[one](#a-page) [two](#no-page) [three](gone.md)\n\n`sd/here.cpp`, `here.cpp`, `there()`, `gone()`\n\n"
            "`sd/gone.cpp`\n")
        (root / "run").write_text("  test [NAME ...]\n")
        (root / "docs/README.md").write_text("[one](cli.md) [two](architecture.md) [three](internals/README.md) [four](internals/page.md)\n")
        (root / "docs/status.md").write_text("## Why nothing flows\n| `told` | |\n| `untold` | |\n## More\n| `no_cause` | |\n")
        (root / "docs/troubleshooting.md").write_text("`told`\n```\n$ trestle known --no-option\n$ trestle unknown\n$ ./run untried\n```\n")
        (root / "docs/performance.md").write_text(
            "| 1.5 ms |\n| TP sustained 256 KB, default pacing | 1 s | 2 s | 0.70 | 0.67 – 0.78 |\n"
            "| TP sustained 1 MB, default pacing | 1 s | 2 s | 0.66 | 0.61 – 0.68 |\n| another | 1 s | 2 s | 0.50 |\n")
        about = "events of 256 KB and 1 MB one after another"
        (root / "docs/choosing.md").write_text(
            f"| 1.5 ms | 2.5 ms |\n| 1.4 to 1.5 ms |\n| {about} | 0.66 to 0.70 times |\n| {about} | 0.70 times, 0.66 times |\n"
            f"| {about} | 0.50 to 0.70 times |\n| something else | 0.70 times |\n")
        # A heading, a file, a function, a path and a drawing; an arrow too many and one too few; a room without a box and
        # without a place on two pages; a command that is not in the table, one that is not in the program, one without a
        # room, and two in another order than in the program; four pages without a row; three commands that there are not; a
        # cause; a comment that does not say whom it means; a figure, the first one of a range, a ratio of another row, and one of which nobody knows the row.
        return len(list(faults(root))) == 28


def main():
    if not finds_wrong_ones():
        print("the checks themselves find no faults")
        return 1
    found = list(faults(pathlib.Path(sys.argv[1])))
    print("\n".join(found) or "everything that the documents point to is there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
