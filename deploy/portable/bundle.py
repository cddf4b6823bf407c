#!/usr/bin/env python3
"""Puts private copies of all that a program is linked with into a folder:  deploy/portable/bundle.py PROGRAM FOLDER LICENCES

glibc and libgcc stay the machine's; 2.34 is old enough. The licences of what was copied go into LICENCES, one file a Debian package.
Prints a line for each thing that is missing.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

import older_versions
import stand_in
import symbols

HERE = os.path.dirname(os.path.abspath(__file__))
OURS = "libcordillera_glibc.so"
# Parts of glibc, and what it brings itself.
OF_THE_MACHINE = re.compile(r"^(ld-linux.*|lib(c|m|mvec|dl|rt|pthread|resolv|util|nss_.*|gcc_s))\.so")


def left_out():
    with open(os.path.join(HERE, "left_out.txt")) as file:
        return [line.strip() for line in file if line.strip() and not line.startswith("#")]


def where():
    """soname -> path, as the loader finds it here."""
    listed = subprocess.run(["/sbin/ldconfig", "-p"], check=True, capture_output=True, text=True).stdout
    found = {}
    for name, path in re.findall(r"^\s+(\S+) \(libc6,x86-64[^)]*\) => (\S+)$", listed, re.M):
        found.setdefault(name, path)
    return found


def closure(program, places, without):
    """soname -> path of what the program needs, and what that needs; not below what is left out."""
    kept, absent, queue = {}, {}, list(symbols.needed(program))
    while queue:
        name = queue.pop()
        if name in kept or name in absent or OF_THE_MACHINE.match(name):
            continue
        if name not in places:
            sys.exit("bundle: no %s here" % name)
        if name in without:
            absent[name] = places[name]
            continue
        kept[name] = places[name]
        queue += symbols.needed(places[name])
    return kept, absent


def copy(kept, folder):
    for name, path in sorted(kept.items()):
        target = os.path.join(folder, name)
        shutil.copyfile(path, target)
        os.chmod(target, 0o644)


def make_stand_ins(absent, users, folder):
    """A stand-in for each library that is left out, with what the users take of it."""
    wanted = set().union(*(symbols.taken(path) for path in users))
    with tempfile.TemporaryDirectory() as work:
        ours = os.path.join(folder, OURS)
        subprocess.run(["gcc", "-shared", "-fPIC", "-O2", "-s", "-Wl,--build-id=none", "-Wl,-soname," + OURS, "-o", ours,
                        os.path.join(HERE, "older_glibc.c")], check=True)
        for name, path in sorted(absent.items()):
            given = symbols.given(path)
            taken = [given[key] for key in wanted if key in given]
            stand_in.make(name, taken, os.path.join(folder, name), work, [ours])


def licences(paths, folder):
    os.makedirs(folder, exist_ok=True)
    # dpkg knows a library by one of its names: by the link, or with /usr or without.
    names = {path: {path, os.path.realpath(path), os.path.realpath(path)[len("/usr"):]} for path in paths}
    listed = subprocess.run(["dpkg", "-S", *sorted(set().union(*names.values()))], capture_output=True, text=True).stdout
    owners = {line.split(": ", 1)[1]: line.split(":", 1)[0] for line in listed.splitlines()}
    for path in sorted(paths):
        owner = next((owners[name] for name in sorted(names[path]) if name in owners), None)
        text = "/usr/share/doc/%s/copyright" % owner
        if not os.path.exists(text):
            sys.exit("bundle: no licence of %s" % path)
        shutil.copyfile(text, os.path.join(folder, owner))


def main(program, folder, texts):
    os.makedirs(folder, exist_ok=True)
    kept, absent = closure(program, where(), left_out())
    copy(kept, folder)
    users = [program] + [os.path.join(folder, name) for name in kept]
    make_stand_ins(absent, users, folder)
    for path in users:
        older_versions.make_older(path)
    licences(kept.values(), texts)


if __name__ == "__main__":
    main(*sys.argv[1:])
