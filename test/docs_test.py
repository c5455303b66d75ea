#!/usr/bin/env python3
"""Checks that what the documents point to is there.

Usage: docs_test.py SOURCE_FOLDER

- A link in any page leads to a file, and its anchor to a heading of that file.
- A path in backquotes in CONTRIBUTING.md, the architecture page, the glossary or docs/internals/ is that of a file or folder.
  A bare file name means a file that lies beside one named before it.
- A function in backquotes in docs/internals/, `Class::name()` or `name()`, stands in one of the files named in its row.
- docs/architecture.svg was drawn from docs/architecture.dot as it is now.
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


def faults(root):
    yield from bad_links(root)
    yield from bad_paths(root)
    yield from bad_drawing(root)


def finds_wrong_ones():
    """That the checks can fail."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "docs/internals").mkdir(parents=True)
        (root / "sd").mkdir()
        (root / "sd/here.cpp").write_text("void there() {}\n")
        (root / "docs/architecture.dot").write_text("digraph {}\n")
        (root / "docs/architecture.svg").write_text("<!-- drawn from something else -->\n")
        (root / "docs/internals/page.md").write_text(
            "# A page\n[one](#a-page) [two](#no-page) [three](gone.md)\n\n`sd/here.cpp`, `here.cpp`, `there()`, `gone()`\n\n"
            "`sd/gone.cpp`\n")
        return len(list(faults(root))) == 5


def main():
    if not finds_wrong_ones():
        print("the checks themselves find no faults")
        return 1
    found = list(faults(pathlib.Path(sys.argv[1])))
    print("\n".join(found) or "everything that the documents point to is there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
