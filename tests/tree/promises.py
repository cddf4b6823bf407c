#!/usr/bin/env python3
"""Tests that SECURITY.md and tests/README.md name for their promises: promises.py REPOSITORY. Each one is there: a test of C++, a test of
ctest, a case of tests/attack or a file. And GLOSSARY.md has no more words than somebody reads."""
import os
import re
import sys

HEADING = "## Which test shows it"
TABLES = [("SECURITY.md", HEADING), ("tests/README.md", "## Right by default")]
MOST_WORDS = 40  # of the glossary: what a textbook says stays out of it


def named(text, heading=HEADING):
    """What stands in code in the table below the heading, of its second column."""
    section = text.partition(heading)[2].partition("\n## ")[0]
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


def judge(text, tests, exists, page="SECURITY.md", heading=HEADING):
    names = named(text, heading)
    wrong = ["%s: no test, case or file `%s`" % (page, name) for name in names if name not in tests and not exists(name)]
    return wrong or ([] if names else ["%s: no table under '%s'" % (page, heading)])


def too_many_words(text):
    """text: of GLOSSARY.md, one table."""
    rows = [line for line in text.splitlines() if line.startswith("|")]
    count = len(rows) - 2  # its head
    return ["GLOSSARY.md has %d words, more than %d: take out the least particular" % (count, MOST_WORDS)] if count > MOST_WORDS else []


def main(root):
    tests, found, count = tests_of(root), [], 0
    for page, heading in TABLES:
        with open(os.path.join(root, page), encoding="utf-8") as file:
            text = file.read()
        found += judge(text, tests, lambda name: "/" in name and os.path.exists(os.path.join(root, name)), page, heading)
        count += len(named(text, heading))
    with open(os.path.join(root, "GLOSSARY.md"), encoding="utf-8") as file:
        found += too_many_words(file.read())
    print("\n".join(found) if found else "every promise names tests that are there: %d" % count)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1] if len(sys.argv) > 1 else "."))
