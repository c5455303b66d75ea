"""Every file in here adds scenarios to the table."""
import importlib
import pathlib

for file in sorted(pathlib.Path(__file__).parent.glob("[a-z]*.py")):
    importlib.import_module(f"attacks.{file.stem}")
