#!/usr/bin/env python3
"""Draws what Figures 5.27 to 5.60 of the thesis show, on another terrain, as PNG; and contact sheets of them.

  pictures.py BUILD FOLDER [MESH]     MESH: else terrain_mesh 999 999; BUILD/bin holds the programs"""
import os
import struct
import subprocess
import sys
import tempfile
import zlib

SIZE = 300
TARGETS = [50000, 100000, 200000, 300000, 400000]
CORNER, MIDDLE = ["0.0", "0.0", "0.06", "0.06"], ["0.47", "0.47", "0.53", "0.53"]
METRICS = [("length", 0.1), ("length", 0.3), ("length", 0.6), ("qem", 0.1), ("qem", 0.2), ("qem", 0.4), ("qem", 0.8)]


def read_ppm(path):
    with open(path, "rb") as file:
        data = file.read()
    width, height = map(int, data.split(b"\n", 3)[1].split())
    return width, height, data[-3 * width * height:]


def write_png(path, width, height, pixels):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    # Few shades, or noise alone fills the file.
    pixels = bytes(pixels).translate(bytes(min(255, (v + 8) // 17 * 17) for v in range(256)))
    rows = b"".join(b"\0" + pixels[3 * width * y:3 * width * (y + 1)] for y in range(height))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
                   + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def sheet(path, pictures, columns):
    """Side by side, two pixels of white between."""
    cell, rows = SIZE + 2, (len(pictures) + columns - 1) // columns
    width, height = cell * columns, cell * rows
    canvas = bytearray(b"\xff" * (3 * width * height))
    for k, (_, _, pixels) in enumerate(pictures):
        left, top = cell * (k % columns), cell * (k // columns)
        for y in range(SIZE):
            at = 3 * ((top + y) * width + left)
            canvas[at:at + 3 * SIZE] = pixels[3 * SIZE * y:3 * SIZE * (y + 1)]
    write_png(path, width, height, bytes(canvas))


class Album:
    def __init__(self, build, folder, work):
        self.bin, self.folder, self.work = os.path.join(build, "bin"), folder, work

    def draw(self, name, mesh, *kind):
        path = os.path.join(self.work, "picture.ppm")
        subprocess.run([os.path.join(self.bin, "thesis_pictures"), mesh, path, str(SIZE), *map(str, kind)], check=True)
        picture = read_ppm(path)
        write_png(os.path.join(self.folder, name + ".png"), *picture)
        return picture

    def simplified(self, name, source, spec):
        path = os.path.join(self.work, name + ".ply")
        subprocess.run([os.path.join(self.bin, "thesis_bench"), "--input", source, "--device", "cpu", "--out", path, spec],
                       check=True,                       stdout=subprocess.DEVNULL)
        return path

    def save_sheet(self, name, pictures, columns):
        sheet(os.path.join(self.folder, name + ".png"), pictures, columns)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    build, folder = sys.argv[1:3]
    os.makedirs(folder, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        album = Album(build, folder, work)
        mesh = sys.argv[3] if len(sys.argv) > 3 else os.path.join(work, "in.ply")
        if len(sys.argv) < 4:
            subprocess.run([os.path.join(build, "bin", "terrain_mesh"), "999", "999", mesh], check=True)
        parallel = {t: album.simplified(f"p{t}", mesh, f"window=512 repair=around passes=1 collapses={t}") for t in TARGETS}
        narrow = album.simplified("p128", mesh, "window=128 repair=around passes=1 collapses=400000")
        alone = album.simplified("s", mesh, "window=1 repair=around passes=1 collapses=400000")
        steps = [mesh] + [parallel[t] for t in TARGETS]
        album.save_sheet("overview", [album.draw("5.27", mesh, "relief"), album.draw("5.28", parallel[400000], "relief")], 2)
        album.save_sheet("candidates", [album.draw("5.29", mesh, "relief")] + [
            album.draw(f"5.{30 + k}", mesh, "candidates", metric, share) for k, (metric, share) in enumerate(METRICS)], 4)
        full = 11  # vertices a pixel of the input: 998,001 over 300 x 300
        album.save_sheet("density", [album.draw(f"5.{37 + k}", path, "density", full) for k, path in enumerate(steps)], 3)
        beside = [album.draw(f"5.{43 + 3 * row + k}", path, "relief", *part, "wire")
                  for row, part in enumerate((CORNER, MIDDLE)) for k, path in enumerate((alone, narrow, parallel[400000]))]
        album.save_sheet("sequential-parallel", beside, 3)
        for start, name, part in ((49, "corner", CORNER), (55, "middle", MIDDLE)):
            album.save_sheet(name, [album.draw(f"5.{start + k}", path, "relief", *part, "wire")
                                    for k, path in enumerate(steps)], 3)


if __name__ == "__main__":
    main()
