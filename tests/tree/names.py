#!/usr/bin/env python3
"""A type's name says which one is meant: no more than two namespaces have a type of the same name. Types inside a class are named with it, and another
name of a type that is there (using) is none of its own.

  names.py ROOT       prints the names that too many have, a line each; exit code 1 if there is one
  names.py ROOT --all     every name that several namespaces have"""
import collections
import os
import re
import sys

import includes

MOST = 2  # namespaces with a type of one name

NOISE = re.compile(r'R"(\w*)\(.*?\)\1"|//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.DOTALL)
TOKEN = re.compile(r"\bnamespace\s+(?P<space>[\w:]*)\s*\{"
                   r"|\b(?:struct|class|enum\s+class|enum|union)\s+(?:alignas\([^()]*\)\s*)?(?P<type>\w+)\s*(?:final\s*)?(?::[^;{}()]*)?\{"
                   r"|[{}]")


def types(text):
    """(namespace, name) of every type that a namespace, and not a class or a function, has in this source."""
    around = []  # what each open brace is: the name of a namespace, or None
    for token in TOKEN.finditer(NOISE.sub('""', text)):
        if token[0] == "}":
            if around:
                around.pop()
        elif token["space"] is not None:
            around.append(token["space"])
        else:
            if token["type"] and None not in around:
                yield "::".join(name for name in around if name), token["type"]
            around.append(None)


def homes(root):
    """{name: {namespace: [files]}}"""
    found = collections.defaultdict(lambda: collections.defaultdict(set))
    for path in includes.sources(root):
        with open(os.path.join(root, path), encoding="utf-8") as file:
            for space, name in types(file.read()):
                found[name][space].add(path)
    return found


def findings(root, most=MOST):
    lines = []
    for name, spaces in sorted(homes(root).items()):
        if len(spaces) > most:
            where = "; ".join(f"{space} ({', '.join(sorted(files))})" for space, files in sorted(spaces.items()))
            lines.append(f"{name} is a type of {len(spaces)} namespaces, more than {most}: {where}")
    return lines


def main(root, words):
    found = findings(root, 1 if "--all" in words else MOST)
    for line in found:
        print(line)
    print("every type's name is of two namespaces at most" if not found else f"{len(found)} of them")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
