#!/usr/bin/env python3
"""What tests may not do: wait for a time instead of for what is meant, start what nobody ends, or run without a limit that suits them.

    habits.py REPOSITORY [CTEST BUILD]       with a build: its tests have limits of their own

A pause between two looks at what is awaited is short (half a second in a script, 20 ms in C++); anything longer decides by time."""
import json
import os
import re
import subprocess
import sys

LONGEST_PAUSE_S = 0.5
MOST_LIMIT_S = 1200  # ctest's own default is 1500, which nobody chose
# (what it looks like, in which files, what is wrong); a file of EXCEPT may.
RULES = [
    (re.compile(r"waitForTimeout\("), ".mjs", "waits for a time: wait for what is meant"),
    (re.compile(r"sleep_for\(std::chrono::(?:seconds|milliseconds\((?:[3-9]\d|\d{3,})\))"), (".cpp", ".h"), "waits for a time: use eventually()"),
    (re.compile(r"(?<!exec )\bsleep (?:[1-9]|0\.[6-9])"), ".sh", "waits for a time: a pause between looks is %s s at most" % LONGEST_PAUSE_S),
    (re.compile(r"[^&>]&\s*$"), ".sh", "starts a process that may stay behind: use start of processes.sh"),
    (re.compile(r"subprocess\.Popen\(|asyncio\.create_subprocess"), ".py", "starts a process that may stay behind: use start of processes.py"),
]
EXCEPT = {
    "tests/processes.sh": "the helper itself",
    "tests/processes.py": "the helper itself",
    "tests/deploy/clean_machine_inside.sh": "its server ends with the system that it runs in",
    "tests/bench/planet/emulate.sh": "a bench, run by hand: a cluster of daemons, which its own stop ends",
    "tests/tree/habits.py": "the rules themselves",
    "tests/tree/habits_test.py": "breaks each rule",
}


def test_files(root):
    for base, folders, names in os.walk(os.path.join(root, "tests")):
        folders[:] = [folder for folder in folders if folder not in ("node_modules", "__pycache__", "corpus")]
        for name in names:
            yield os.path.relpath(os.path.join(base, name), root)


def findings_in(root):
    for path in sorted(test_files(root)):
        rules = [rule for rule in RULES if path.endswith(rule[1])]
        if not rules or path in EXCEPT:
            continue
        with open(os.path.join(root, path), encoding="utf-8") as file:
            for number, line in enumerate(file, 1):
                yield from ("%s:%d: %s" % (path, number, wrong) for pattern, _, wrong in rules if pattern.search(line))


def limits_in(tests):
    """tests: what `ctest --show-only=json-v1` prints."""
    for test in tests["tests"]:
        if test["name"].endswith("_NOT_BUILT"):
            continue  # what ctest calls a program that is not there
        limit = next((p["value"] for p in test.get("properties", []) if p["name"] == "TIMEOUT"), None)
        if limit is None or limit > MOST_LIMIT_S:
            yield "%s: its TIMEOUT is %s, not one of its own up to %d s" % (test["name"], limit, MOST_LIMIT_S)


def main(root, ctest=None, build=None):
    found = list(findings_in(root))
    if ctest:
        shown = subprocess.run([ctest, "--test-dir", build, "--show-only=json-v1"], check=True, capture_output=True, text=True).stdout
        found += limits_in(json.loads(shown))
    print("\n".join(found) or "tests wait for what is meant, end what they start, and have limits")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
