#!/usr/bin/env python3
"""The rooms of a floor, its folders, include each other in one direction only and have few files; CONTRIBUTING.md has the picture of them.

  rooms.py ROOT              prints what breaks a rule, a line each; exit code 1 if anything does
  rooms.py ROOT --picture    prints the pictures as CONTRIBUTING.md must have them"""
import collections
import os
import sys

import includes

FLOORS = ("raster", "gpu", "pipeline", "server")
# Doors: the one file of a room that names what the rooms above it have, for whoever asks by name.
DOORS = ("pipeline/faces/all_faces.cpp",)
MOST_FILES = 30  # of a room, without those of its own rooms: more is a list that nobody reads


def arrows(root, floor):
    """{(room, room that it includes): [(file, header)]} within a floor."""
    found = collections.defaultdict(list)
    for path in includes.sources(root):
        if not path.startswith(floor + os.sep) or path in DOORS:
            continue
        for _, _, header in includes.includes(root, path):
            room, other = os.path.dirname(path), os.path.dirname(header)
            if header.startswith(floor + "/") and room != other:
                found[room, other].append((path, header))
    return found


def reach(found):
    """{room: all rooms that it includes, directly or not}."""
    below = collections.defaultdict(set)
    for room, other in found:
        below[room].add(other)
    known = {}
    for room in list(below):
        seen, left = set(), list(below[room])
        while left:
            one = left.pop()
            if one not in seen:
                seen.add(one)
                left.extend(below[one])
        known[room] = seen
    return known


def circles(root):
    """A line for each include of a room that can see back."""
    lines = []
    for floor in FLOORS:
        found = arrows(root, floor)
        known = reach(found)
        for (room, other), files in sorted(found.items()):
            if room in known.get(other, ()):
                lines += [f"{path}: {header}: {other} includes {room} too, directly or not" for path, header in files]
    return lines


def crowded(root):
    """A line for each room with more files than somebody looks through."""
    files = collections.Counter(os.path.dirname(path) for path in includes.sources(root))
    return [f"{room}/ has {count} files, more than {MOST_FILES}: it is two rooms" for room, count in sorted(files.items())
            if count > MOST_FILES and room.split(os.sep)[0] in FLOORS]


def strays(root):
    """A line for each file beside the floors that is empty: a slip of a test or a shell that ran there. A Python package's py.typed is empty by its spec."""
    lines = []
    for place, folders, files in os.walk(root):
        folders[:] = [one for one in folders if not one.startswith((".git", ".cache")) and one not in ("build", "cordillera-data", "node_modules")]
        lines += [f"{os.path.relpath(os.path.join(place, one), root)}: an empty file" for one in sorted(files)
                  if one != "py.typed" and os.path.getsize(os.path.join(place, one)) == 0]
    return lines


def name(floor, room):
    return floor if room == floor else room[len(floor) + 1:]


def picture(root, floor):
    """Mermaid: an arrow from a room to each that it includes, but for those that it sees through another one."""
    found = arrows(root, floor)
    known = reach(found)
    lines = ["```mermaid", "flowchart TD"]
    for room, other in sorted(found):
        between = {via for at, via in found if at == room and via != other}
        if not any(other in known.get(via, ()) for via in between):
            lines.append(f"    {name(floor, room).replace('/', '_')}[{name(floor, room)}/] --> {name(floor, other).replace('/', '_')}[{name(floor, other)}/]")
    return "\n".join(lines + ["```"]) + "\n"


def findings(root):
    found = circles(root) + crowded(root) + strays(root)
    with open(os.path.join(root, "CONTRIBUTING.md"), encoding="utf-8") as file:
        text = file.read()
    found += [f"CONTRIBUTING.md: the picture of {floor} is not that of the includes: tests/tree/rooms.py . --picture prints it"
              for floor in FLOORS if picture(root, floor) not in text]
    return found


def main(root, words):
    if "--picture" in words:
        print("\n".join(f"`{floor}`:\n\n{picture(root, floor)}" for floor in FLOORS), end="")
        return 0
    found = findings(root)
    for line in found:
        print(line)
    print("rooms include each other in one direction" if not found else f"{len(found)} of them wrong")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
