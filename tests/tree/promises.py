#!/usr/bin/env python3
"""Tests that SECURITY.md names for its promises: promises.py REPOSITORY. Each one is there: a test of C++, a test of ctest, a case of
tests/attack or a file."""
import os
import re
import sys

HEADING = "## Which test shows it"


def named(text):
    """What stands in code in the table below the heading, of its second column."""
    section = text.partition(HEADING)[2].partition("\n## ")[0]
    rows = [line.split("|")[2] for line in section.splitlines() if line.startswith("|") and line.count("|") >= 3]
    return [name for row in rows for name in re.findall(r"`([^`]+)`", row)]


def tests_of(root):
    """Suite.Name of every test of C++, names of ctest, names of attacks."""
    found = set()
    for base, _, names in os.walk(os.path.join(root, "tests")):
        for name in names:
            if not name.endswith((".cpp", ".py", "CMakeLists.txt")):
                continue
            with open(os.path.join(base, name), encoding="utf-8") as file:
                text = file.read()
            found |= {".".join(pair) for pair in re.findall(r"^TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", text, re.M)}
            found |= set(re.findall(r"add_test\(NAME (\S+)", text)) | set(re.findall(r"@case\(\"([^\"]+)\"", text))
    return found


def judge(text, tests, exists):
    names = named(text)
    wrong = ["SECURITY.md: no test, case or file `%s`" % name for name in names if name not in tests and not exists(name)]
    return wrong or ([] if names else ["SECURITY.md: no table under '%s'" % HEADING])


def main(root):
    with open(os.path.join(root, "SECURITY.md"), encoding="utf-8") as file:
        text = file.read()
    found = judge(text, tests_of(root), lambda name: "/" in name and os.path.exists(os.path.join(root, name)))
    print("\n".join(found) if found else "every promise names tests that are there: %d" % len(named(text)))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1] if len(sys.argv) > 1 else "."))
