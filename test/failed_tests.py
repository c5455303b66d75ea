"""The end of what each failed test printed, so that a log which is cut shows it.

Usage: failed_tests.py TESTS.xml
"""
import sys
import xml.etree.ElementTree as ElementTree

LINES = 160  # of all that failed together, and no fewer than 20 of each

failed = [case for case in ElementTree.parse(sys.argv[1]).getroot().iter("testcase") if case.get("status") == "fail"]
for case in failed:
    print(f"--- the end of {case.get('name')}, after {float(case.get('time')):.0f} s:")
    print("\n".join((case.findtext("system-out") or "").rstrip().splitlines()[-max(LINES // len(failed), 20):]))
