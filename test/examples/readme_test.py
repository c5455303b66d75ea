"""readme_test.py SOURCE: each block of C++ in the README stands in an example, word for word."""
import pathlib
import re
import sys

source = pathlib.Path(sys.argv[1])
text = (source / "README.md").read_text()
blocks = re.findall(r"^```cpp\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
examples = {file.name: re.sub(r"\s+", " ", file.read_text()) for file in (source / "examples").glob("**/*.cpp")}
missing = [block for block in blocks if not any(re.sub(r"\s+", " ", block) in code for code in examples.values())]
for block in missing:
    print(f"not in any of {sorted(examples)}:\n{block}")
sys.exit(1 if missing or not blocks else 0)
