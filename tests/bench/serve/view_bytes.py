#!/usr/bin/env python3
"""Bytes that a view needs: our .glb and .terrain against quantized-mesh of regular grids, as cesium-terrain-builder makes them.

  view_bytes.py BUILD DEM [--error METRES] [--pixels 2]

DEM: north-up, EPSG:4326, one band, without holes. Cameras stand still at fixed places (VIEWS). A tile is refined while its level's error,
seen from the camera, is above --pixels, which is CesiumJS's rule: error * height / (distance * 2 tan(fovy / 2)). Errors are measured for
both, as greatest error and as RMSE: ours are the manifest's, those of a grid level the vertical distances of its triangles from all of the
DEM's samples.
Bytes are those of the tiles on the screen, as sent: .terrain compressed with gzip, .glb as it is."""
import argparse
import array
import gzip
import json
import math
import os
import struct
import subprocess
import tempfile

CELLS = 64  # of a regular tile's side
FOVY, WIDTH, HEIGHT = math.radians(60), 1280, 720
# name, place as shares of the DEM's extent, metres above its highest point, degrees below the horizon, degrees east of north
VIEWS = [("all of it, from above", 0.5, 0.5, 60000, 90, 0), ("half of it, oblique", 0.5, 0.1, 15000, 45, 0),
         ("a valley, oblique", 0.4, 0.3, 4000, 35, 45), ("low, towards the horizon", 0.3, 0.5, 800, 12, 90)]
METRES_A_DEGREE, EARTH_RADIUS_M = 111195, 6371000


class Dem:
    def __init__(self, path, folder):
        info = json.loads(subprocess.run(["gdalinfo", "-json", path], capture_output=True, check=True).stdout)
        self.columns, self.rows = info["size"]
        west, self.dx, _, north, _, dy = info["geoTransform"]
        self.dy = -dy
        raw = os.path.join(folder, "dem.raw")
        subprocess.run(["gdal_translate", "-q", "-of", "ENVI", "-ot", "Float32", path, raw], check=True)
        self.values = array.array("f", open(raw, "rb").read())
        # centres of the outer samples
        self.west, self.north = west + self.dx / 2, north - self.dy / 2
        self.east, self.south = self.west + (self.columns - 1) * self.dx, self.north - (self.rows - 1) * self.dy

    def at(self, lon, lat):
        """Bilinear; beside the raster, its rim."""
        x = min(max((lon - self.west) / self.dx, 0), self.columns - 1.000001)
        y = min(max((self.north - lat) / self.dy, 0), self.rows - 1.000001)
        i, j = int(x), int(y)
        k, fx, fy = j * self.columns + i, x - i, y - j
        v = self.values
        return (v[k] * (1 - fx) + v[k + 1] * fx) * (1 - fy) + (v[k + self.columns] * (1 - fx) + v[k + self.columns + 1] * fx) * fy


class GridLevel:
    """Heights at the vertices of a level's 64-cell tiles, and how far its triangles are from the raster."""

    def __init__(self, dem, level):
        self.level, self.cell = level, 180 / 2**level / CELLS
        self.c0, self.r0 = math.floor((dem.west + 180) / self.cell), math.floor((dem.south + 90) / self.cell)
        self.width = math.ceil((dem.east + 180) / self.cell) - self.c0 + 1
        height = math.ceil((dem.north + 90) / self.cell) - self.r0 + 1
        self.heights = [[dem.at(-180 + (self.c0 + i) * self.cell, -90 + (self.r0 + j) * self.cell) for i in range(self.width)] for j in range(height)]
        rows = [self.row_error(dem, row) for row in range(dem.rows)]
        self.error_m = {"max": max(worst for worst, _ in rows), "rmse": math.sqrt(sum(squares for _, squares in rows) / dem.rows / dem.columns)}

    def row_error(self, dem, row):
        y = (dem.north - row * dem.dy + 90) / self.cell - self.r0
        j, values, worst = min(int(y), len(self.heights) - 2), dem.values[row * dem.columns:(row + 1) * dem.columns], 0
        squares = 0
        low, high, fy = self.heights[j], self.heights[j + 1], y - j
        for column, value in enumerate(values):
            x = (dem.west + column * dem.dx + 180) / self.cell - self.c0
            i = min(int(x), self.width - 2)
            fx = x - i
            if fx >= fy:  # the cell's triangles meet in its diagonal from the south-west
                found = low[i] + (low[i + 1] - low[i]) * fx + (high[i + 1] - low[i + 1]) * fy
            else:
                found = low[i] + (high[i + 1] - high[i]) * fx + (high[i] - low[i]) * fy
            worst = max(worst, abs(found - value))
            squares += (found - value)**2
        return worst, squares

    def bytes_of(self, x, y):
        """Of a quantized-mesh tile without normals, after gzip."""
        at = lambda i, j: self.heights[min(max(y * CELLS + j - self.r0, 0), len(self.heights) - 1)][min(max(x * CELLS + i - self.c0, 0), self.width - 1)]
        grid = [at(i, j) for j in range(CELLS + 1) for i in range(CELLS + 1)]
        low, high = min(grid), max(grid)
        steps = [round((value - low) / max(high - low, 1e-9) * 32767) for value in grid]
        u = [round(i / CELLS * 32767) for _ in range(CELLS + 1) for i in range(CELLS + 1)]
        v = [round(j / CELLS * 32767) for j in range(CELLS + 1) for _ in range(CELLS + 1)]
        triangles = [k for j in range(CELLS) for i in range(CELLS) for a in [j * (CELLS + 1) + i]
                     for k in (a, a + 1, a + CELLS + 2, a, a + CELLS + 2, a + CELLS + 1)]
        sides = [[j * (CELLS + 1) for j in range(CELLS + 1)], list(range(CELLS + 1)), [j * (CELLS + 1) + CELLS for j in range(CELLS + 1)],
                 list(range(CELLS * (CELLS + 1), (CELLS + 1) ** 2))]
        # The codes of high-water marks want vertices in the order of their first use.
        order, renamed = {}, []
        for k in triangles:
            renamed.append(order.setdefault(k, len(order)))
        first = sorted(order, key=order.get)
        parts = [struct.pack("<3dff4d3d", 0, 0, 0, low, high, 0, 0, 0, 0, 0, 0, 0), struct.pack("<I", len(first))]
        parts += [zigzag([values[k] for k in first]) for values in (u, v, steps)]
        parts += [struct.pack("<I", len(renamed) // 3), high_water(renamed)]
        parts += [struct.pack("<I", len(side)) + struct.pack(f"<{len(side)}H", *(order[k] for k in side)) for side in sides]
        return len(gzip.compress(b"".join(parts), 6))


def zigzag(values):
    deltas = [b - a for a, b in zip([0] + values, values)]
    return struct.pack(f"<{len(values)}H", *((d << 1 ^ d >> 31) & 0xFFFF for d in deltas))


def high_water(indices):
    highest, codes = 0, []
    for index in indices:
        codes.append(highest - index)
        highest += index == highest
    return struct.pack(f"<{len(codes)}H", *codes)


class Camera:
    """A flat world around the place, lowered by the earth's curve."""

    def __init__(self, dem, top_m, view):
        _, east_share, north_share, above_m, down, heading = view
        self.lon, self.lat = dem.west + east_share * (dem.east - dem.west), dem.south + north_share * (dem.north - dem.south)
        self.eye, down, heading = (0, 0, top_m + above_m), math.radians(down), math.radians(heading)
        self.ahead = (math.sin(heading) * math.cos(down), math.cos(heading) * math.cos(down), -math.sin(down))
        self.right = (math.cos(heading), -math.sin(heading), 0)
        self.up = tuple(self.right[(k + 1) % 3] * self.ahead[(k + 2) % 3] - self.right[(k + 2) % 3] * self.ahead[(k + 1) % 3] for k in range(3))

    def sphere(self, level, x, y, low, high):
        size = 180 / 2**level
        middle = (-180 + (x + 0.5) * size - self.lon, -90 + (y + 0.5) * size - self.lat)
        east, north = middle[0] * METRES_A_DEGREE * math.cos(math.radians(self.lat)), middle[1] * METRES_A_DEGREE
        half = size / 2 * METRES_A_DEGREE
        radius = math.sqrt((half * math.cos(math.radians(self.lat)))**2 + half**2 + ((high - low) / 2)**2)
        offset = (east, north, (low + high) / 2 - (east**2 + north**2) / 2 / EARTH_RADIUS_M - self.eye[2])
        return offset, radius, (east, north, half)

    def sees(self, offset, radius):
        dot = lambda a: sum(p * q for p, q in zip(a, offset))
        ahead = dot(self.ahead)
        for side, share in ((self.right, WIDTH / HEIGHT), (self.up, 1)):
            slope = math.tan(FOVY / 2) * share
            if (abs(dot(side)) - ahead * slope) / math.hypot(1, slope) > radius:
                return False
        return ahead > -radius

    def distance(self, box, high):
        east, north, half = box
        dx, dy = max(abs(east) - half * math.cos(math.radians(self.lat)), 0), max(abs(north) - half, 0)
        return math.sqrt(dx * dx + dy * dy + max(self.eye[2] - high, 1) ** 2)


def tiles_on_screen(camera, dem, errors, low, high, pixels):
    """(level, x, y) that a client draws; errors: metres of every level, the finest last."""
    found = []
    finest = max(errors)

    def visit(level, x, y):
        size = 180 / 2**level
        west, south = -180 + x * size, -90 + y * size
        if west >= dem.east or west + size <= dem.west or south >= dem.north or south + size <= dem.south:
            return
        offset, radius, box = camera.sphere(level, x, y, low, high)
        if level > 5 and not camera.sees(offset, radius):
            return
        seen = errors.get(level, math.inf) * HEIGHT / (camera.distance(box, high) * 2 * math.tan(FOVY / 2))
        if level < finest and (seen > pixels or level not in errors):
            for child in range(4):
                visit(level + 1, 2 * x + child % 2, 2 * y + child // 2)
        else:
            found.append((level, x, y))

    for root in (0, 1):
        visit(0, root, 0)
    return found


def packed(path):
    with open(path, "rb") as file:
        return len(gzip.compress(file.read(), 6))


def row(view, dem, camera, out, errors, grid_errors, grids, heights, pixels):
    mine, theirs = (tiles_on_screen(camera, dem, levels, *heights, pixels) for levels in (errors, grid_errors))
    side = lambda z, x: f"W/{z}/{x}" if x < 2**z else f"E/{z}/{x - 2**z}"
    glb = sum(os.path.getsize(f"{out}/tiles/{side(z, x)}/{y}.glb") for z, x, y in mine)
    terrain = sum(packed(f"{out}/terrain/{z}/{x}/{y}.terrain") for z, x, y in mine)
    grid = sum(grids[z].bytes_of(x, y) for z, x, y in theirs)
    return f"| {view[0]} | {glb / 1e3:,.0f} | {glb / grid:.2f} | {terrain / 1e3:,.0f} | {terrain / grid:.2f} | {grid / 1e3:,.0f} | {len(mine)}, {len(theirs)} |"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("build")
    arguments.add_argument("dem")
    arguments.add_argument("--error", default="5")
    arguments.add_argument("--pixels", type=float, default=2)
    given = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out, dem = os.path.join(folder, "out"), Dem(given.dem, folder)
        subprocess.run([os.path.join(given.build, "bin", "cordillera"), "build", given.dem, "-o", out, "--quiet", "--error", given.error, "--formats",
                        "drc,3d-tiles,quantized-mesh"], check=True)
        levels = json.load(open(os.path.join(out, "manifest.json"), encoding="utf-8"))["levels"]
        ours = {kind: {level["level"]: level[name] for level in levels} for kind, name in (("max", "stated_max_error"), ("rmse", "rmse"))}
        grids, level = {}, 5
        while True:  # until a grid is as good as our finest level, or as fine as the raster, where cesium-terrain-builder ends
            grids[level] = GridLevel(dem, level)
            if grids[level].error_m["max"] <= min(ours["max"].values()) or grids[level].cell <= dem.dy:
                break
            level += 1
        low, high = min(dem.values), max(dem.values)
        for kind, errors in ours.items():
            print(f"\nBy {kind}. Metres: ours " + ", ".join(f"{z}: {e:.1f}" for z, e in sorted(errors.items()) if z > 4) +
                  "; grids " + ", ".join(f"{z}: {g.error_m[kind]:.1f}" for z, g in sorted(grids.items())))
            print("\n| view | .glb kB | of grids | .terrain kB | of grids | grids kB | tiles, grids' |\n|---|--:|--:|--:|--:|--:|--:|")
            for view in VIEWS:
                print(row(view, dem, Camera(dem, high, view), out, errors, {z: g.error_m[kind] for z, g in grids.items()}, grids, (low, high), given.pixels))


main()
