#!/usr/bin/env python3
"""Which file may include what: the floors of CONTRIBUTING.md, and the home of every header that is not ours.

  includes.py [ROOT]       prints what breaks a rule, a line each; exit code 1 if anything does"""
import fnmatch
import os
import re
import sys

# A floor may include itself and these. raster and gpu stand side by side and never see each other.
BELOW = {
    "proto": [],
    "raster": ["proto"],
    "gpu": ["proto"],
    "pipeline": ["proto", "raster", "gpu"],
    "server": ["proto", "raster", "gpu", "pipeline"],
}
# Products beside the way of a tile, each a library of its own; and who may include them beside themselves.
APART = {"gpu/fit": ("gpu/cleap", "server"), "gpu/cleap": ("server",)}
SOURCES = (".h", ".hpp", ".inl", ".c", ".cc", ".cpp", ".cu", ".cuh")

# protoc writes these into the build folder. They need protobuf, which proto's plain headers and gpu do without.
GENERATED = "*.pb.h"
WITHOUT_PROTOBUF = ("proto", "gpu")

# Headers of packages, and the only files that may include them: another library should cost a file or two.
HOMES = [
    ("execinfo.h", ["server/cli/serve_command.cpp"]),
    ("httplib.h", ["server/client/connection.cpp"]),
    ("brotli/*", ["server/front/codec.cpp"]),
    ("CLI/*", ["server/main.cpp", "server/command_line.*", "server/add_commands.cpp", "server/options/option_words.*", "server/options/shell_words.*",
               "server/cli/work_line.*", "server/client/client_line.*"]),
    ("seccomp.h", ["server/sandbox/calls.cpp"]),
    ("spdlog/*", ["server/log/log.cpp"]),
    ("nlohmann/*", ["pipeline/encode/json.h"]),
    ("google/protobuf/*", ["pipeline/tileset/manifest_json.cpp", "server/http/json.cpp"]),
    ("openssl/*", ["pipeline/store/content_hash.cpp", "server/http/digest.cpp"]),
    ("zlib.h", ["raster/archive/archive.cpp", "pipeline/exports/gzip.cpp", "pipeline/store/water_mask.cpp", "server/front/codec.cpp"]),
    ("zstd.h", ["pipeline/build/exact/kept_block.cpp"]),
    ("sqlite3.h", ["pipeline/store/sqlite.*", "pipeline/store/sqlite_object.cpp"]),
    ("boost/beast*", ["server/front/message/beast.cpp", "server/fetch/http_get.cpp"]),
    ("boost/asio*", ["pipeline/threads/workers.cpp", "server/front/*", "server/fetch/http_get.cpp", "server/jobs/job_queue.*", "server/cli/serve_command.cpp"]),
    ("draco/*", ["pipeline/encode/draco_*"]),
    ("png.h", ["pipeline/faces/pictures/png_image.cpp"]),
    ("webp/*", ["pipeline/faces/pictures/webp_image.cpp"]),
    ("gdal*", ["raster/*"]),
    ("ogr*", ["raster/*"]),
    ("cpl_*", ["raster/*"]),
    ("GeographicLib/*", ["raster/*"]),
    ("proj.h", ["raster/gdal/proj_context.cpp", "raster/datum/vertical_crs.cpp"]),
    ("cuda*", ["gpu/*.cu", "gpu/*.cuh"]),
    ("cub/*", ["gpu/*.cu", "gpu/*.cuh"]),
    ("thrust/*", ["gpu/*.cu", "gpu/*.cuh"]),
    ("cooperative_groups.h", ["gpu/*.cu", "gpu/*.cuh"]),
]
# C++ names its own headers without an ending. With one: what POSIX and Linux have and C++ has not.
SYSTEM = re.compile(r"[a-z_]+|(arpa|linux|sys)/\w+\.h|(dirent|dlfcn|fcntl|malloc|netdb|poll|pthread|pwd|sched|signal|spawn|string|time|unistd)\.h")

# A block comment that begins a line may hold an #include that is none.
COMMENT = re.compile(r"^[ \t]*/\*.*?\*/", re.DOTALL | re.MULTILINE)
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"]', re.MULTILINE)


def sources(root):
    """Files of the floors, relative to the root."""
    for floor in BELOW:
        for folder, folders, names in os.walk(os.path.join(root, floor)):
            folders[:] = [name for name in folders if name != "node_modules"]
            for name in sorted(names):
                if name.endswith(SOURCES):
                    yield os.path.relpath(os.path.join(folder, name), root)


def includes(root, path):
    with open(os.path.join(root, path), encoding="utf-8") as file:
        text = COMMENT.sub(lambda comment: "\n" * comment[0].count("\n"), file.read())
    for match in INCLUDE.finditer(text):
        yield text.count("\n", 0, match.start(1)) + 1, match[1] == "<", match[2]


def homes_of(header):
    return next((homes for pattern, homes in HOMES if fnmatch.fnmatchcase(header, pattern)), None)


def wrong_package(path, header, in_angles):
    """A header that is not ours: why path may not include it."""
    homes = homes_of(header)
    if homes is None:
        if in_angles and SYSTEM.fullmatch(header):
            return None
        return f"{header} has no home: use what is there, or give it a file of its own and name that in tests/tree/includes.py"
    if any(fnmatch.fnmatchcase(path, home) for home in homes):
        return None
    return f"{header} stays in {' and '.join(homes)}"


def wrong_floor(root, path, header):
    """A header of the project: why path may not include it."""
    floor, other = path.split(os.sep)[0], header.split("/")[0]
    if other not in BELOW:
        return f"{header}: {floor} does not look into {other}"
    if other != floor and other not in BELOW[floor]:
        return f"{header}: includes only go down, and {other} is not below {floor}"
    if not os.path.isfile(os.path.join(root, header)):
        return f"{header}: no such file; paths start at the repository's root"
    for product, users in APART.items():
        if header.startswith(product + "/") and not path.startswith(tuple(user + os.sep for user in (product, *users))):
            return f"{header}: {product} is a product of its own, and the way of a tile does without it"
    return None


def wrong(root, path, in_angles, header):
    if fnmatch.fnmatchcase(header, GENERATED) and "/" not in header:
        return f"{header}: {path.split(os.sep)[0]} builds without protobuf" if path.startswith(WITHOUT_PROTOBUF) else None
    first = header.split("/")[0]
    if "/" in header and homes_of(header) is None and os.path.isdir(os.path.join(root, first)):
        return wrong_floor(root, path, header)
    if not in_angles and homes_of(header) is None:
        return f"{header}: paths start at the repository's root"
    return wrong_package(path, header, in_angles)


def findings(root):
    """What breaks a rule, in words; and the number of includes that were looked at."""
    found, seen = [], 0
    for path in sources(root):
        for line, in_angles, header in includes(root, path):
            seen += 1
            why = wrong(root, path, in_angles, header)
            if why:
                found.append(f"{path}:{line}: {why}")
    return found, seen


def main():
    root = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
    found, seen = findings(root)
    for line in found:
        print(line)
    if seen == 0:
        sys.exit(f"{root}: no include in any floor; is this the repository's root?")
    print(f"{seen} includes, {len(found)} of them wrong")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
