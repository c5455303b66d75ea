#!/usr/bin/env python3
"""Checks that includes between folders point one way, and that each folder says what it is for.

Usage: rooms_test.py SOURCE_FOLDER

Each line of ORDER names folders. A file includes only of its own folder and of folders on lines before its own; those of
one line know nothing of each other. A new folder gets its place here. And each fuzz target has its corpus.

The main header of a folder (of a folder without headers, the main file) begins with a comment of at least four lines:
"// FOLDER: what lives there", and its files. A row of them begins with a file's name, and has one such beginning only; what
does not fit is continued further to the right. Files that the comment names exist.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

ORDER = """
someip/wire
someip/core sd/wire
someip/core/e2e sd/core pcaps fuzz/mutate
sd/core/device someip/net dds_adapter
sd/c sd/net
bridge/documents bridge/picture bridge/statistics
bridge/messages/types
bridge/messages/convert/program
bridge/messages/convert/quick
bridge/messages/convert
bridge/messages/map
bridge/messages/values
bridge/describe
bridge/describe/read bridge/describe/write
bridge/describe/read/arxml bridge/describe/read/fidl bridge/describe/read/vsomeip
bridge/describe/write/arxml bridge/describe/write/fidl bridge/describe/write/msg bridge/describe/write/routes bridge/describe/write/sheet bridge/describe/write/vsomeip bridge/describe/write/wireshark
bridge/describe/sources
bridge/cli bridge/record bridge/traffic bridge/web
bridge/console bridge/traffic/live
bridge/carry/config bridge/conform bridge/guest bridge/inspect/decode bridge/measure
bridge/carry/runtime bridge/conform/cases bridge/conform/replay bridge/inspect/tools bridge/measure/demo bridge/measure/perf
bridge/carry/commands bridge/conform/fuzz bridge/generate
bridge/carry/record bridge/conform/commands
bridge/program
"""
# The core knows nothing of the network, and nothing below the bridge knows of the other world's protocol; siblings of one
# room on different lines may know each other, siblings of different rooms may not.
NEVER = [("dds_adapter", "someip/net"), ("dds_adapter", "sd"), ("someip", "dds_adapter"), ("sd", "dds_adapter"),
         ("pcaps", "someip/core"), ("bridge/carry", "bridge/inspect"), ("bridge/carry", "bridge/measure"),
         ("bridge/inspect", "bridge/carry"), ("bridge/inspect", "bridge/measure"),
         ("bridge/measure", "bridge/carry"), ("bridge/measure", "bridge/inspect"),
         ("bridge/generate", "bridge/carry"), ("bridge/generate", "bridge/inspect"), ("bridge/generate", "bridge/measure"),
         ("bridge/carry", "bridge/generate"), ("bridge/conform", "someip/core"), ("bridge/conform", "sd/core"),
         ("bridge/conform", "sd/net"),
         ("bridge/conform", "bridge/carry"), ("bridge/conform", "bridge/inspect"), ("bridge/conform", "bridge/measure"),
         ("bridge/conform", "bridge/guest"), ("bridge/conform", "bridge/console"),
         ("bridge/carry", "bridge/conform"), ("bridge/inspect", "bridge/conform"), ("bridge/measure", "bridge/conform"),
         ("bridge/generate", "bridge/conform")]
NAME = r"[\w*.]+(?:/\w*|\.\w+)+"
ROW = re.compile(rf"{NAME}(?:, {NAME})* +(?!.*\.(?:hpp|cpp|h)  )\S")
INCLUDE = re.compile(r'^\s*#\s*include "([^"]+)"', re.MULTILINE)


def line_of_each():
    return {folder: number for number, line in enumerate(ORDER.split("\n")) for folder in line.split()}


def within(folder, room):
    return folder == room or folder.startswith(room + "/")


def top_comment(file):
    """Of the first line on."""
    return re.match(r"/\*(?:.|\n)*?\*/|(?://.*\n)*", file.read_text(errors="replace"))[0]


def missing_headers(root, folders):
    """Folders that do not say what they are for, rows that were torn, and files that are named and not there."""
    for folder in folders:
        files = [file for file in sorted((root / folder).glob("*")) if file.suffix in (".hpp", ".cpp", ".h")]
        said = [(file, text) for file in files for text in [top_comment(file)]
                if re.match(rf"/[/*] {folder}: ", text) and text.count("\n") >= 4]
        if not said:
            yield f"{folder}: no file begins with \"// {folder}: what lives here\" and a list of its files"
        for file, text in said:
            yield from (f"{file.relative_to(root)}: \"{row}\" is no row of a list of files"
                        for row in re.findall(r"^//   (?=\S)(.*)$", text, re.MULTILINE) if not ROW.match(row))
            for name in re.findall(r"(?<!\w)[a-z*][\w./*]*\.(?:hpp|cpp|h)\b", text):
                if not any(True for place in (root / folder, root) for _ in place.glob(name)) and not any(
                        True for _ in (root / folder).rglob(name)):
                    yield f"{file.relative_to(root)}: names {name}, which is not there"


def faults(root):
    """What is wrong, a line each."""
    lines = line_of_each()
    seen = set()
    for top in ("someip", "sd", "dds_adapter", "pcaps", "fuzz/mutate", "bridge"):
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in (".hpp", ".cpp", ".h", ".c"):
                continue
            here = file.parent.relative_to(root).as_posix()
            if here not in lines:
                yield f"{file.relative_to(root)}: the folder {here} has no place in ORDER of test/rooms_test.py"
                continue
            seen.add(here)
            text = file.read_text()
            for include in INCLUDE.finditer(text):
                there = pathlib.PurePosixPath(include[1]).parent.as_posix()
                where = f"{file.relative_to(root)}:{text.count(chr(10), 0, include.start()) + 1}"
                if there == ".":
                    there = here
                if there not in lines:
                    yield f"{where}: includes of {there}, which is no folder of the product"
                elif there != here and lines[there] >= lines[here]:
                    yield f"{where}: {here} may not include of {there}"
                elif any(within(here, a) and within(there, b) for a, b in NEVER):
                    yield f"{where}: {here} never includes of {there}"
    yield from (f"{folder}: in ORDER, but there is no such folder" for folder in sorted(set(lines) - seen))
    yield from missing_headers(root, [*sorted(seen), "fuzz"])
    yield from missing_corpora(root)


def missing_corpora(root):
    """Fuzz targets whose corpus a clone would not have."""
    for name in re.findall(r"^ *trestle_fuzz\((\w+)", (root / "fuzz/CMakeLists.txt").read_text(), re.MULTILINE):
        corpus = f"fuzz/corpus/{name}"
        tracked = subprocess.run(["git", "-C", root, "ls-files", corpus], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        if not (tracked.stdout if tracked.returncode == 0 else any((root / corpus).glob("*"))):
            yield f"{corpus}: there are no files for the target {name}, or git does not know them"


def finds_a_wrong_one():
    """That the check can fail."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name in [*line_of_each(), "fuzz"]:
            (root / name).mkdir(parents=True, exist_ok=True)
            (root / name / "empty.hpp").write_text(f"// {name}: nothing\n//\n// empty.hpp\n//\n")
        (root / "fuzz/CMakeLists.txt").touch()
        none = list(faults(root))
        (root / "someip/wire/up.hpp").write_text('#pragma once\n#include "sd/wire/empty.hpp"\n')
        (root / "bridge/inspect/tools/aside.cpp").write_text('#include "bridge/carry/config/empty.hpp"\n')
        for here, there in (("conform/fuzz", "carry/runtime"), ("conform/fuzz", "inspect/tools"), ("conform/fuzz", "measure/perf"),
                            ("conform/cases", "guest"), ("conform/replay", "console"), ("carry/runtime", "conform"),
                            ("inspect/tools", "conform"), ("measure/perf", "conform"), ("generate", "conform/cases")):
            (root / f"bridge/{here}/{there.replace('/', '_')}.cpp").write_text(f'#include "bridge/{there}/empty.hpp"\n')
        (root / "bridge/new").mkdir()
        (root / "bridge/new/file.hpp").touch()
        (root / "fuzz/empty.hpp").write_text("// fuzz: too little\n")
        (root / "sd/c/empty.hpp").write_text("// sd/c: a file\n//\n// gone.hpp\n//\n")
        (root / "sd/net/empty.hpp").write_text(
            "// sd/net: files\n//\n//   empty.hpp, up.hpp  this and\n//   that down.hpp  more\n//   up.hpp    a down.hpp  b\n"
            "//   empty.hpp:\n//       more\n//   under/    others\n")
        for name in ("up", "down"):
            (root / f"sd/net/{name}.hpp").touch()
        (root / "fuzz/CMakeLists.txt").write_text("function(trestle_fuzz name)\ntrestle_fuzz(one LIBS x)\n  trestle_fuzz(two LIBS x)\n")
        (root / "fuzz/corpus/one").mkdir(parents=True)
        (root / "fuzz/corpus/one/seed").touch()
        return not none and [line.split(": ")[0] for line in faults(root)] == [
            "someip/wire/up.hpp:2", "bridge/carry/runtime/conform.cpp:1", "bridge/conform/cases/guest.cpp:1",
            "bridge/conform/fuzz/carry_runtime.cpp:1", "bridge/conform/fuzz/inspect_tools.cpp:1",
            "bridge/conform/fuzz/measure_perf.cpp:1", "bridge/conform/replay/console.cpp:1", "bridge/generate/conform_cases.cpp:1",
            "bridge/inspect/tools/aside.cpp:1", "bridge/inspect/tools/conform.cpp:1", "bridge/measure/perf/conform.cpp:1",
            "bridge/new/file.hpp", "sd/c/empty.hpp", *["sd/net/empty.hpp"] * 3, "fuzz", "fuzz/corpus/two"]


def main():
    if not finds_a_wrong_one():
        print("the check itself does not find what is wrong")
        return 1
    found = list(faults(pathlib.Path(sys.argv[1])))
    print("\n".join(found) or "all includes point one way, each folder says what it is for, and each fuzz target has its corpus")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
