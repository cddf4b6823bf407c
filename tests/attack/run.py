#!/usr/bin/env python3
"""Attacks on the real server of a build, each as it once broke something:  run.py BUILD [--long] [--module NAME] [--only TEXT]

Prints a row a case and exits with 1 if one does not hold. README.md says how to add one."""
import argparse
import importlib
import os
import signal
import sys
import time
import traceback

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import attack  # noqa: E402

COLUMNS = "%-4s %6s  %-64s  %-24s  %s"


def read_cases(only_module):
    names = sorted(name[:-3] for name in os.listdir(os.path.join(HERE, "cases")) if name.endswith(".py") and name != "__init__.py")
    if only_module and only_module not in names:
        sys.exit("no module '%s'; there are: %s" % (only_module, ", ".join(names)))
    for name in [only_module] if only_module else names:
        importlib.import_module("cases." + name)
    return [one for one in attack.CASES if only_module in (None, one.module)]  # a module may take helpers of another


def run_case(run, case):
    """Whether it holds, and what was seen."""
    try:
        seen = case.run(run)
        return bool(case.holds(seen)), str(seen)
    except Exception as error:  # a case that breaks does not hold, and the others still run
        traceback.print_exc()
        return False, "%s: %s" % (type(error).__name__, error)
    finally:
        run.end_case()


def main():
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("build", help="folder of the build, with bin/cordillera")
    words.add_argument("--long", action="store_true", help="the cases that take minutes too")
    words.add_argument("--module", help="cases of this file alone, without .py")
    words.add_argument("--only", default="", help="cases whose name holds this text")
    given = words.parse_args()
    program = os.path.join(os.path.abspath(given.build), "bin", "cordillera")
    if not os.access(program, os.X_OK):
        sys.exit(program + " is missing: build the target cordillera")
    cases = [one for one in read_cases(given.module) if given.only in one.name and (given.long or not one.minutes)]
    if not cases:
        sys.exit("no case has '%s' in its name%s" % (given.only, "" if given.long else "; those of minutes take --long"))

    # An exception passes through every finally; the signal's default would not.
    for ending in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(ending, lambda number, _: sys.exit(128 + number))
    failed = 0
    run = attack.Attack(program)
    try:
        print(COLUMNS % ("", "s", "case", "expected", "seen"))
        for case in cases:
            start = time.monotonic()
            holds, seen = run_case(run, case)
            failed += not holds
            print(COLUMNS % ("ok" if holds else "FAIL", "%.1f" % (time.monotonic() - start), case.name, case.expected, seen[:300]), flush=True)
    finally:
        run.end()
    print("%d cases, %d of them failed" % (len(cases), failed))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
