"""Judges ARXML files by two readers of others: lxml with AUTOSAR's schema, which knows the order of elements, and
autosar-data in strict mode, which also knows where references may go. Run with the Python of build/peers.

Usage: check_arxml.py FILE...
"""
import functools
import importlib.util
import pathlib
import re
import sys

import autosar_data
from lxml import etree


@functools.lru_cache
def schema(name):
    """AUTOSAR's schema of that number, out of the package k3q-arxml."""
    folder = pathlib.Path(importlib.util.find_spec("k3q_arxml").origin).parent / "assets" / "xsd"
    return etree.XMLSchema(etree.parse(folder / f"autosar_{name}" / f"AUTOSAR_{name}.xsd"))


def faults(file):
    tree = etree.parse(file)
    location = tree.getroot().get("{http://www.w3.org/2001/XMLSchema-instance}schemaLocation")
    judge = schema(re.search(r"AUTOSAR_(\w+)\.xsd", location)[1])
    if not judge.validate(tree):
        yield from (f"{file}:{error.line}: {error.message}" for error in judge.error_log)
    model = autosar_data.AutosarModel()
    try:
        _, warnings = model.load_file(file, strict=True)
    except Exception as error:  # its own kind of error, without a common base
        yield f"{file}: {error}"
        return
    yield from (f"{file}: {warning}" for warning in warnings)
    yield from (f"{file}: reference to {element.character_data} goes nowhere, or to another kind of element"
                for element in model.check_references())


def main():
    found = [fault for file in sys.argv[1:] for fault in faults(file)]
    print("\n".join(found) or "all are valid")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
