#!/usr/bin/env python3
"""Contours over HTTP against gdal_contour, on the service's own heights.

  contours.py DATASET FOLDER      the dataset's address; a folder for files

Tiles come as GDAL's reader of vector tiles has them; heights from Terrarium, two by two tiles. Of each height the lines of both
are as long as each other, and all their points are near each other. Control: lines that are a pixel to the side must not pass.
Then what is compressed, what is absent, and what is refused."""
import array
import gzip
import json
import math
import subprocess
import sys
import urllib.request

from refused import expect_refused

SIDE = 512
PIXELS = 0.3  # from a point to the other's line: rounding, a unit of simplification, and the 256ths of a metre of Terrarium
LENGTH = 0.02
HALF = math.pi * 6378137


def fetch(address, coding=None):
    with urllib.request.urlopen(urllib.request.Request(address, headers={"Accept-Encoding": coding} if coding else {})) as answer:
        return answer.status, answer.headers, answer.read()


def heights(dataset, place, folder):
    """The middle of two by two tiles; a raster in pixels, y downwards."""
    zoom, x, y = place
    rows = [[0.0] * SIDE for _ in range(SIDE)]
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        with open(f"{folder}/tile.png", "wb") as file:
            file.write(fetch(f"{dataset}/terrarium/{zoom}/{x + dx}/{y + dy}.png")[2])
        raw = ["-q", "-of", "ENVI", "-co", "INTERLEAVE=BSQ", f"{folder}/tile.png", f"{folder}/tile.raw"]
        subprocess.run(["gdal_translate", *raw], check=True)
        data = open(f"{folder}/tile.raw", "rb").read()
        for k in range(65536):
            rows[256 * dy + k // 256][256 * dx + k % 256] = data[k] * 256 + data[65536 + k] + data[131072 + k] / 256 - 32768
    array.array("f", [h for row in rows for h in row]).tofile(open(f"{folder}/heights", "wb"))
    with open(f"{folder}/heights.hdr", "w") as header:
        header.write(f"ENVI\nsamples = {SIDE}\nlines = {SIDE}\nbands = 1\ndata type = 4\ninterleave = bsq\nbyte order = 0\n"
                     f"map info = {{Arbitrary, 1, 1, 0, {SIDE}, 1, 1, 0}}\n")


def segments(features, place_of):
    """{height: [((x, y), (x, y))]} in pixels within the two by two tiles, but for a rim that only one of the two has."""
    found = {}
    for feature in features:
        shape = feature["geometry"]
        for line in [shape["coordinates"]] if shape["type"] == "LineString" else shape["coordinates"]:
            points = [place_of(*point[:2]) for point in line]
            for a, b in zip(points, points[1:]):
                if all(1 < c < SIDE - 1 for c in (*a, *b)):
                    found.setdefault(float(feature["properties"]["ele"]), []).append((a, b))
    return found


def drawn(place, folder, interval):
    arguments = ["-q", "-a", "ele", "-i", str(interval), "-f", "GeoJSON", f"{folder}/heights", f"{folder}/drawn.json"]
    subprocess.run(["gdal_contour", *arguments], check=True)
    return segments(json.load(open(f"{folder}/drawn.json"))["features"], lambda x, y: (x, SIDE - y))


def served(dataset, place, folder, query):
    zoom, x, y = place
    features = []
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        with open(f"{folder}/tile.mvt", "wb") as file:
            file.write(fetch(f"{dataset}/contours/{zoom}/{x + dx}/{y + dy}.mvt{query}")[2])
        place_of_tile = ["-oo", f"X={x + dx}", "-oo", f"Y={y + dy}", "-oo", f"Z={zoom}", "-oo", "CLIP=YES"]
        written = ["-t_srs", "EPSG:3857", "-lco", "RFC7946=NO", "-lco", "COORDINATE_PRECISION=9"]
        files = [f"{folder}/tile.json", f"{folder}/tile.mvt"]
        subprocess.run(["ogr2ogr", "-f", "GeoJSON", *place_of_tile, *written, *files], check=True)
        features += json.load(open(f"{folder}/tile.json"))["features"]
    pixel = 2 * HALF / (256 * 2**zoom)
    return segments(features, lambda e, n: ((e + HALF) / pixel - 256 * x, (HALF - n) / pixel - 256 * y))


def length(lines):
    return sum(math.dist(a, b) for a, b in lines)


def distance(point, segment):
    (px, py), ((ax, ay), (bx, by)) = point, segment
    square = (bx - ax) ** 2 + (by - ay) ** 2
    share = 0 if square == 0 else min(max(((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / square, 0), 1)
    return math.hypot(px - ax - share * (bx - ax), py - ay - share * (by - ay))


def far_points(lines, others, aside=0.0):
    """The share of points that are farther than PIXELS from every line of the others."""
    cells = {}
    for segment in others:
        (ax, ay), (bx, by) = segment
        for column in range(int(min(ax, bx)) - 1, int(max(ax, bx)) + 2):
            for row in range(int(min(ay, by)) - 1, int(max(ay, by)) + 2):
                cells.setdefault((column, row), []).append(segment)
    points = [(x + aside, y) for (x, y), _ in lines if 3 < x < SIDE - 3 and 3 < y < SIDE - 3]
    far = [p for p in points if all(distance(p, s) > PIXELS for s in cells.get((int(p[0]), int(p[1])), []))]
    return len(far) / max(len(points), 1)


def check_lines(dataset, place, folder, interval):
    ours, wanted = served(dataset, place, folder, f"?interval={interval}"), drawn(place, folder, interval)
    assert len(wanted) > 5 and set(ours) == set(wanted), f"lines at {sorted(ours)}, not {sorted(wanted)}"
    whole = {k: length([s for lines in which.values() for s in lines]) for k, which in (("ours", ours), ("wanted", wanted))}
    assert abs(whole["ours"] / whole["wanted"] - 1) < LENGTH, f"lines of {whole['ours']:.0f} pixels, not {whole['wanted']:.0f}"
    worst = max(far_points(ours[ele], wanted[ele]) for ele in ours)
    assert worst < 0.02, f"{worst:.1%} of a height's points are not on gdal_contour's lines"
    aside = min(far_points(ours[ele], wanted[ele], 1.0) for ele in ours if len(ours[ele]) > 50)
    assert aside > 0.2, f"points a pixel to the side pass (control), {aside:.1%}"
    lines = f"{len(ours)} heights, {whole['ours']:.0f} pixels of lines, gdal_contour has {whole['wanted']:.0f}"
    return f"{lines}; at most {worst:.2%} of points off, {aside:.0%} a pixel aside"


def check_answers(dataset, place):
    zoom, x, y = place
    tile = f"{dataset}/contours/{zoom}/{x}/{y}.mvt"
    _, headers, plain = fetch(tile, "identity")
    assert headers["Content-Type"] == "application/vnd.mapbox-vector-tile" and headers["Content-Encoding"] is None, headers
    _, headers, packed = fetch(tile, "gzip")
    assert headers["Content-Encoding"] == "gzip" and gzip.decompress(packed) == plain and "Accept-Encoding" in headers["Vary"], headers
    assert fetch(tile, "br")[1]["Content-Encoding"] == "br"
    assert fetch(f"{dataset}/contours/{zoom}/0/0.mvt")[0] == 204
    assert json.loads(fetch(f"{dataset}/contours.json?interval=20")[2])["tiles"][0].endswith("{y}.mvt?interval=20")
    for address in (tile, f"{dataset}/contours.json"):
        for interval in ("0", "5001", "ten", "1.0001", "-20"):
            expect_refused(f"{address}?interval={interval}", "1 to 5000")


def main(dataset, folder):
    about = json.loads(fetch(f"{dataset}/contours.json")[2])
    west, south, east, north = about["bounds"]
    zoom = about["maxzoom"]
    y = (1 - math.asinh(math.tan(math.radians((south + north) / 2))) / math.pi) / 2
    place = (zoom, round(((west + east) / 2 + 180) / 360 * 2**zoom) - 1, round(y * 2**zoom) - 1)
    heights(dataset, place, folder)
    for interval in (100, 20):
        print(f"contours {place}, {interval} m: {check_lines(dataset, place, folder, interval)}")
    check_answers(dataset, place)


main(*sys.argv[1:])
