"""Rasters for the cluster's test: one in each of COUNT blocks, hills from a formula; `broken` cuts the last one off in its middle.

    make_rasters.py FOLDER COUNT [broken]
"""
import math
import os
import sys

LEVEL = 13                      # of the lattice that the pixels are cells of
CELL = 180 / (256 << LEVEL)     # degrees
BLOCK = 4096                    # cells; a raster a block
SIDE = 160


def height(column, row):
    return 500 + 300 * math.sin(column / 23) * math.cos(row / 31) + 40 * math.sin(column / 5 + row / 7)


def write(folder, number):
    west = 8.0 + (number % 6) * BLOCK * CELL + (CELL * 37 * (number % 5))
    south = 46.0 + (number // 6) * BLOCK * CELL + (CELL * 53 * (number % 3))
    with open(os.path.join(folder, f"dem{number:02}.asc"), "w") as out:
        out.write(f"ncols {SIDE}\nnrows {SIDE}\nxllcorner {west!r}\nyllcorner {south!r}\ncellsize {CELL!r}\nNODATA_value -9999\n")
        for row in range(SIDE):
            out.write(" ".join(f"{height(column + 40 * number, row):.2f}" for column in range(SIDE)) + "\n")
    with open(os.path.join(folder, f"dem{number:02}.prj"), "w") as out:
        out.write('GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]\n')


folder, count = sys.argv[1], int(sys.argv[2])
os.makedirs(folder, exist_ok=True)
for number in range(count):
    write(folder, number)
if "broken" in sys.argv:
    path = os.path.join(folder, f"dem{count - 1:02}.asc")
    with open(path) as whole:
        text = whole.read()
    # As many bytes, so that it opens, and no numbers where the second half of them was.
    half = len(text) // 2
    with open(path, "w") as out:
        out.write(text[:half] + "x" * (len(text) - half))
