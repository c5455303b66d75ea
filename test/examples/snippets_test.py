"""snippets_test.py SOURCE: each block of C++ in the README, docs/application.md and docs/embedding.md stands in an example,
word for word; and no example is longer than a page. What is in folders below examples/ are whole programs."""
import pathlib
import re
import sys

LONGEST_EXAMPLE = 80  # lines

source = pathlib.Path(sys.argv[1])
files = sorted((source / "examples").glob("*.cpp"))
code = [re.sub(r"\s+", " ", file.read_text()) for file in [*files, *(source / "examples").glob("*/*.cpp")]]
wrong = 0
for document in ("README.md", "docs/application.md", "docs/embedding.md"):
    blocks = re.findall(r"^```cpp\n(.*?)^```$", (source / document).read_text(), re.DOTALL | re.MULTILINE)
    missing = [block for block in blocks if not any(re.sub(r"\s+", " ", block).strip() in text for text in code)]
    for block in missing:
        print(f"{document}: not in any program of examples/:\n{block}")
    if not blocks:
        print(f"{document}: shows no code")
    wrong += len(missing) + (not blocks)
for file in files:
    lines = len(file.read_text().splitlines())
    if lines > LONGEST_EXAMPLE:
        print(f"{file.name}: {lines} lines, more than {LONGEST_EXAMPLE}")
        wrong += 1
sys.exit(1 if wrong else 0)
