"""Lets a library that was linked with glibc 2.36, Debian 12's, run with 2.34.

A function of glibc carries the version that it came or changed with, and the loader refuses a file that asks for a version it lacks. Of
what came after 2.34 our libraries use four functions. They are asked for by the oldest version instead: hypot and hypotf have had that too, and
arc4random is then found in older_glibc.c, whose functions have no version.
"""
import mmap
import struct

import symbols

NEWEST = (2, 34)
OLD = "GLIBC_2.2.5"
KNOWN = {"hypot", "hypotf", "arc4random", "arc4random_buf"}
_STRTAB, _VERNEED, _VERNEEDNUM = 5, 0x6FFFFFFE, 0x6FFFFFFF
_LOAD, _DYNAMIC = 1, 2


def too_new(version):
    return version is not None and version.startswith("GLIBC_2.") and tuple(map(int, version[len("GLIBC_"):].split("."))) > NEWEST


def _tables(data):
    """(values of the dynamic section, address -> place in the file)."""
    if data[:6] != b"\x7fELF\x02\x01":
        raise ValueError("no 64-bit little-endian ELF file")
    start, (size, count) = struct.unpack_from("<Q", data, 32)[0], struct.unpack_from("<HH", data, 54)
    segments = [struct.unpack_from("<IIQQQQQQ", data, start + k * size) for k in range(count)]
    loads = [(s[3], s[2], s[5]) for s in segments if s[0] == _LOAD]

    def place(address):
        return next(address - at + offset for at, offset, length in loads if at <= address < at + length)

    dynamic = next(s for s in segments if s[0] == _DYNAMIC)
    return dict(struct.unpack_from("<QQ", data, dynamic[2] + k) for k in range(0, dynamic[5], 16)), place


def _entries(data):
    """(place, version, place of its name among the strings) of each version that the file asks for."""
    values, place = _tables(data)
    if _VERNEED not in values:
        return
    names, at = place(values[_STRTAB]), place(values[_VERNEED])
    for _ in range(values[_VERNEEDNUM]):
        _, count, _, first, following = struct.unpack_from("<HHIII", data, at)
        entry = at + first
        for _ in range(count):
            name, more = struct.unpack_from("<II", data, entry + 8)
            yield entry, data[names + name:data.find(b"\0", names + name)].decode(), name
            entry += more
        at += following


def make_older(path):
    """Changes the file; a function that is not known here is a ValueError."""
    unknown = {name for name, version in symbols.taken(path) if too_new(version)} - KNOWN
    if unknown:
        raise ValueError("%s asks glibc for %s, which is too new" % (path, ", ".join(sorted(unknown))))
    with open(path, "r+b") as file, mmap.mmap(file.fileno(), 0) as data:
        entries = list(_entries(data))
        new = [entry for entry, version, _ in entries if too_new(version)]
        if not new:
            return
        entry, _, name = next(e for e in entries if e[1] == OLD)
        hashed = data[entry:entry + 4]
        for entry in new:
            data[entry:entry + 4] = hashed
            struct.pack_into("<I", data, entry + 8, name)
