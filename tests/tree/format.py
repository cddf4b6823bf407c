#!/usr/bin/env python3
"""C++ and CUDA sources are as clang-format writes them (.clang-format), and no line of them is longer than 130 columns.

  format.py ROOT     prints what breaks a rule, a line each; exit code 1 if anything does

Versions of clang-format differ in small things, so one of them decides: that of Debian 12. Without it only the columns are tested."""
import re
import shutil
import subprocess
import sys

VERSION = "14"
SUFFIXES = (".cpp", ".h", ".hpp", ".cu", ".cuh", ".inl")
MOST_COLUMNS = 130


def sources(root):
    names = subprocess.run(["git", "-C", root, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                           capture_output=True, text=True)
    if names.returncode:  # a source archive
        names = subprocess.run(["find", ".", "-path", "./build", "-prune", "-o", "-type", "f", "-print0"], cwd=root,
                               capture_output=True, text=True, check=True)
    listed = (name.removeprefix("./") for name in names.stdout.split("\0"))
    return sorted(name for name in listed if name.endswith(SUFFIXES))


def long_lines(name, text):
    return [f"{name}:{number}: {len(line)} columns, {MOST_COLUMNS} are the most"
            for number, line in enumerate(text.split("\n"), 1) if len(line) > MOST_COLUMNS]


def formatter():
    """The clang-format that decides, or None."""
    for name in (f"clang-format-{VERSION}", "clang-format"):
        if shutil.which(name):
            version = subprocess.run([name, "--version"], capture_output=True, text=True).stdout
            if re.search(rf"version {VERSION}\.", version):
                return name
    return None


def unformatted(root, tool, names):
    """The files among `names` that `tool` would change."""
    said = subprocess.run([tool, "--dry-run", *names], cwd=root, capture_output=True, text=True)
    if said.returncode:
        return [said.stderr.strip()]
    changed = {line.split(":", 1)[0] for line in said.stderr.splitlines() if "[-Wclang-format-violations]" in line}
    return [f"{name}: not as clang-format writes it; run  {tool} -i {name}" for name in sorted(changed)]


def findings(root, tool):
    names, wrong = sources(root), []
    for name in names:
        try:
            with open(f"{root}/{name}", encoding="utf-8") as file:
                wrong += long_lines(name, file.read())
        except FileNotFoundError:  # deleted, and not yet committed
            names = [other for other in names if other != name]
    return names, wrong + (unformatted(root, tool, names) if tool else [])


def main(root):
    tool = formatter()
    names, wrong = findings(root, tool)
    how = "formatted" if tool else f"within {MOST_COLUMNS} columns (no clang-format {VERSION} here: the rest was not tested)"
    print("\n".join(wrong) or f"{len(names)} sources are {how}")
    return 1 if wrong or not names else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
