"""Finding 7: texts inside a raster, and what of them reaches others."""
import gzip
import json
import struct

from attack import case


def tiff(unit, size=65):
    """Heights of 100 m in degrees at 10 E, 46 N; the unit stands where GDAL looks for it."""
    metadata = ('<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">%s</Item></GDALMetadata>' % unit).encode() + b"\0"
    keys = (1, 1, 0, 4, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326, 2054, 0, 1, 9102)
    parts = {  # tag: type, count, bytes
        256: (4, 1, struct.pack("<I", size)), 257: (4, 1, struct.pack("<I", size)), 258: (3, 1, struct.pack("<HH", 32, 0)),
        259: (3, 1, struct.pack("<HH", 1, 0)), 262: (3, 1, struct.pack("<HH", 1, 0)), 273: (4, 1, None), 277: (3, 1, struct.pack("<HH", 1, 0)),
        278: (4, 1, struct.pack("<I", size)), 279: (4, 1, struct.pack("<I", 4 * size * size)), 339: (3, 1, struct.pack("<HH", 3, 0)),
        33550: (12, 3, struct.pack("<3d", 0.01, 0.01, 0)), 33922: (12, 6, struct.pack("<6d", 0, 0, 0, 10, 46, 0)),
        34735: (3, len(keys), struct.pack("<%dH" % len(keys), *keys)), 42112: (2, len(metadata), metadata)}
    at = 8 + 2 + 12 * len(parts) + 4
    entries, behind = b"", b""
    for tag in sorted(parts):
        kind, count, value = parts[tag]
        if value is None:  # the strip stands last
            value = struct.pack("<I", at + sum(len(v) + len(v) % 2 for _, _, v in parts.values() if v and len(v) > 4))
        if len(value) > 4:
            place, padded = at + len(behind), value + b"\0" * (len(value) % 2)
            behind += padded
            value = struct.pack("<I", place)
        entries += struct.pack("<HHI", tag, kind, count) + value
    return struct.pack("<2sHIH", b"II", 42, 8, len(parts)) + entries + b"\0\0\0\0" + behind + struct.pack("<f", 100) * (size * size)


def posted(attack, body, options=""):
    """The answer to a POST that waits for its build."""
    headers = {"Content-Encoding": "gzip", "Prefer": "wait=120"}
    status, _, body = attack.server.ask("POST", "/v1/datasets?name=dem.tif" + options, gzip.compress(body), headers)
    return status, json.loads(body)


@case("7 a unit of 900,000 letters: refused in a line", expect="422 unit-unknown, short")
def long_unit(attack):
    status, problem = posted(attack, tiff("u" * 900000))
    return "%d %s, %s" % (status, problem["type"].rsplit(":")[-1], "short" if len(problem["detail"]) < 1000 else "long")


@case("7 a unit of 5 million letters: the report is not lost", expect="422 unit-unknown")
def longer_unit(attack):
    status, problem = posted(attack, tiff("u" * 5000000))
    return "%d %s" % (status, problem["type"].rsplit(":")[-1])


@case("7 a list after ten of them", expect="below 30 kB more", holds=lambda grown: grown < 30000)
def list_of_them(attack):
    before = len(attack.server.ask("GET", "/v1/datasets")[2])
    for _ in range(10):
        posted(attack, tiff("u" * 900000))
    return len(attack.server.ask("GET", "/v1/datasets")[2]) - before


@case("7 a known unit is read as before", expect="201")
def known_unit(attack):
    return posted(attack, tiff("metre"))[0]


@case("11 a refusal tells nothing of our options of GDAL", expect="422, nothing")
def our_options(attack):
    status, problem = posted(attack, b"ncols 99999999999\nnrows 4\nxllcorner 1\nyllcorner 1\ncellsize 1\n1 1 1 1\n", "&crs=EPSG:4326")
    return "%d, %s" % (status, "told" if "GEOREF" in problem["detail"] else "nothing")
