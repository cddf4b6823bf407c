"""Rasters for the cluster's test: one in each of COUNT blocks, hills from a formula. The last one is a GeoTIFF; with `broken` its
pixels cannot be unpacked, though it opens.

    make_rasters.py FOLDER COUNT [broken]
"""
import math
import os
import struct
import sys
import zlib

LEVEL = 13                      # of the lattice that the pixels are cells of
CELL = 180 / (256 << LEVEL)     # degrees
BLOCK = 4096                    # cells; a raster a block
SIDE = 160


def height(column, row):
    return 500 + 300 * math.sin(column / 23) * math.cos(row / 31) + 40 * math.sin(column / 5 + row / 7)


def corner(number):
    """West and south, degrees."""
    return (8.0 + (number % 6) * BLOCK * CELL + (CELL * 37 * (number % 5)), 46.0 + (number // 6) * BLOCK * CELL + (CELL * 53 * (number % 3)))


def write(folder, number):
    west, south = corner(number)
    with open(os.path.join(folder, f"dem{number:02}.asc"), "w") as out:
        out.write(f"ncols {SIDE}\nnrows {SIDE}\nxllcorner {west!r}\nyllcorner {south!r}\ncellsize {CELL!r}\nNODATA_value -9999\n")
        for row in range(SIDE):
            out.write(" ".join(f"{height(column + 40 * number, row):.2f}" for column in range(SIDE)) + "\n")
    with open(os.path.join(folder, f"dem{number:02}.prj"), "w") as out:
        out.write('GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]\n')


def write_tiff(folder, number, broken):
    """One strip of float32, deflated; of a broken one the strip is something else."""
    west, south = corner(number)
    rows = [struct.pack(f"<{SIDE}f", *(height(column + 40 * number, row) for column in range(SIDE))) for row in range(SIDE)]
    strip = zlib.compress(b"".join(rows))
    if broken:
        strip = b"x" * len(strip)
    keys = (1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 1, 2048, 0, 1, 4326)  # geographic, pixels are areas, WGS 84
    tags = [(256, "H", (SIDE,)), (257, "H", (SIDE,)), (258, "H", (32,)), (259, "H", (8,)), (262, "H", (1,)), (273, "I", (8,)),
            (277, "H", (1,)), (278, "H", (SIDE,)), (279, "I", (len(strip),)), (339, "H", (3,)), (33550, "d", (CELL, CELL, 0)),
            (33922, "d", (0, 0, 0, west, south + SIDE * CELL, 0)), (34735, "H", keys)]
    types, at, entries, beyond = {"H": 3, "I": 4, "d": 12}, 8 + len(strip), b"", b""
    values_at = at + 2 + 12 * len(tags) + 4
    for tag, kind, values in tags:
        data = struct.pack(f"<{len(values)}{kind}", *values)
        if len(data) > 4:
            place, beyond = struct.pack("<I", values_at + len(beyond)), beyond + data
        else:
            place = data.ljust(4, b"\0")
        entries += struct.pack("<HHI", tag, types[kind], len(values)) + place
    with open(os.path.join(folder, f"dem{number:02}.tif"), "wb") as out:
        out.write(struct.pack("<2sHI", b"II", 42, at) + strip + struct.pack("<H", len(tags)) + entries + struct.pack("<I", 0) + beyond)


folder, count = sys.argv[1], int(sys.argv[2])
os.makedirs(folder, exist_ok=True)
for number in range(count - 1):
    write(folder, number)
write_tiff(folder, count - 1, "broken" in sys.argv)
