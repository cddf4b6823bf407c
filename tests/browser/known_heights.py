#!/usr/bin/env python3
"""Ellipsoidal heights at vertices of the finest lattice, of a north-up EPSG:4326 raster above EGM96 whose samples are points, found
without any code of the project: the samples by gdallocationinfo, bilinear between them, the geoid by PROJ.

  known_heights.py RASTER MANIFEST       prints JSON: [{"lon", "lat", "height", "orthometric"}, ...]; height is ellipsoidal"""
import json
import math
import subprocess
import sys

GRID = 5  # places a side
CELLS = 256  # a tile side
UNDULATION = "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=vgridshift +grids=egm96_15.gtx +multiplier=1"


def run(command, text=""):
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


def bilinear(raster, column, row):
    x, y = math.floor(column), math.floor(row)
    fx, fy = column - x, row - y
    corners = "".join(f"{x + i} {y + j}\n" for j in (0, 1) for i in (0, 1))
    a, b, c, d = map(float, run(["gdallocationinfo", "-valonly", raster], corners).split())
    return (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy


def places(raster, manifest):
    """Lattice vertices, a tenth of the raster away from its rim (rims may move), with their heights above the geoid."""
    info = json.loads(run(["gdalinfo", "-json", raster]))
    columns, rows = info["size"]
    west, step_x, _, north, _, step_y = info["geoTransform"]
    cell = 180 / 2 ** manifest["levels"][0]["level"] / CELLS
    for j in range(GRID):
        for i in range(GRID):
            wanted_x, wanted_y = columns * (0.1 + 0.8 * i / (GRID - 1)), rows * (0.1 + 0.8 * j / (GRID - 1))
            lon = -180 + round((west + wanted_x * step_x + 180) / cell) * cell
            lat = -90 + round((north + wanted_y * step_y + 90) / cell) * cell
            yield lon, lat, bilinear(raster, (lon - west) / step_x - 0.5, (lat - north) / step_y - 0.5)


def main(raster, manifest_path):
    with open(manifest_path, encoding="utf-8") as manifest:
        found = list(places(raster, json.load(manifest)))
    lines = run(["gdaltransform", "-ct", UNDULATION], "".join(f"{lon!r} {lat!r} {value!r}\n" for lon, lat, value in found)).splitlines()
    heights = [float(line.split()[2]) for line in lines]
    if len(heights) != len(found) or any(abs(height - value) < 0.5 for height, (_, _, value) in zip(heights, found)):
        sys.exit("PROJ did not apply the geoid: is proj-data installed?")
    print(json.dumps([{"lon": lon, "lat": lat, "height": height, "orthometric": value} for (lon, lat, value), height in zip(found, heights)]))


main(*sys.argv[1:])
