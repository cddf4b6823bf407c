#!/usr/bin/env python3
"""A raster as a mesh, for compare.py --input and --between.

  raw_mesh.py HEIGHTS COLUMNS ROWS SPACING OUT.ply [EVERY]

HEIGHTS: float32, little endian, from the north-west corner, as `gdal_translate -of ENVI -ot Float32` writes them; SPACING in metres.
EVERY 2 takes every second sample of every second row: the input, and the whole raster is what lies between."""
import array
import sys


def main():
    if len(sys.argv) not in (6, 7):
        sys.exit(__doc__)
    path, out = sys.argv[1], sys.argv[5]
    columns, rows, spacing = int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
    every = int(sys.argv[6]) if len(sys.argv) == 7 else 1
    heights = array.array("f")
    with open(path, "rb") as file:
        heights.fromfile(file, columns * rows)
    # Whole cells only, so that the finer mesh does not reach beyond the coarser.
    across, down = (columns - 1) // every, (rows - 1) // every
    vertices, triangles = array.array("f"), bytearray()
    for row in range(down * every, -1, -every):
        for column in range(0, across * every + 1, every):
            vertices.extend((column * spacing, (down * every - row) * spacing, heights[row * columns + column]))
    for row in range(down):
        for column in range(across):
            south = row * (across + 1) + column
            north = south + across + 1
            for corners in ((south, south + 1, north + 1), (south, north + 1, north)):
                triangles += b"\x03" + array.array("i", corners).tobytes()
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices) // 3}\nproperty float x\nproperty float y\nproperty float z\n"
              f"element face {2 * across * down}\nproperty list uchar int vertex_indices\nend_header\n")
    with open(out, "wb") as file:
        file.write(header.encode() + vertices.tobytes() + bytes(triangles))


if __name__ == "__main__":
    main()
