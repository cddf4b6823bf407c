#!/usr/bin/env python3
"""Pictures of relief, slope and aspect against gdaldem, on the service's own heights.

  styles.py DATASET FOLDER      the dataset's address; a folder for files

Two by two tiles are put together, of heights (Terrarium) and of each style. Only the outermost pixels are left out, so a border that shows
between tiles is found. Controls: pixels that are a few to the side, and shades that are left out, must not pass."""
import array
import json
import math
import statistics
import subprocess
import sys
import urllib.request

from refused import expect_refused

SIDE = 512
EQUATOR_M = 2 * math.pi * 6378137
SHIFT = 3  # pixels to the side, of the control
COLOUR = 2  # of 255
SLOPE_DEG, ASPECT_DEG = 0.5, 2.0
STEEP_DEG = 2.0  # aspects of flatter ground are rounding
LEAST_CORRELATION = 0.995  # of shades


def fetch(address):
    with urllib.request.urlopen(address) as answer:
        return answer.read()


def bands(path, count):
    """Bytes of each band."""
    subprocess.run(["gdal_translate", "-q", "-of", "ENVI", "-co", "INTERLEAVE=BSQ", "-ot", "Byte", path, path + ".raw"], check=True)
    data = open(path + ".raw", "rb").read()
    pixels = len(data) // count
    return [data[k * pixels:(k + 1) * pixels] for k in range(count)]


def mosaic(dataset, face, place, folder, ramp=""):
    """Rows of pixels, each a tuple of its bands, of two by two tiles."""
    zoom, x, y = place
    rows = [[None] * SIDE for _ in range(SIDE)]
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        path = f"{folder}/tile.png"
        with open(path, "wb") as file:
            file.write(fetch(f"{dataset}/{face}/{zoom}/{x + dx}/{y + dy}.png{ramp}"))
        pixels = list(zip(*bands(path, 3 if face == "terrarium" else 4)))
        for r in range(256):
            rows[256 * dy + r][256 * dx:256 * dx + 256] = pixels[256 * r:256 * r + 256]
    return rows


def inner(rows):
    return [value for row in rows[1:-1] for value in row[1:-1]]


def shifted(rows):
    return [row[SHIFT:] + row[:SHIFT] for row in rows]


class Judge:
    """gdaldem, on heights whose pixels are as large as on the ground in the middle of the tiles."""

    def __init__(self, heights, place, folder):
        self.folder = folder
        zoom, _, y = place
        self.latitude = math.atan(math.sinh(math.pi * (1 - 2 * (y + 1) / 2**zoom)))
        e2, sin = 0.0066943799901, math.sin(self.latitude)
        w = math.sqrt(1 - e2 * sin * sin)
        pixel = EQUATOR_M * math.cos(self.latitude) / (256 * 2**zoom)
        east_m, south_m = pixel / w, pixel * (1 - e2) / w**3
        array.array("f", [h for row in heights for h in row]).tofile(open(f"{folder}/heights", "wb"))
        with open(f"{folder}/heights.hdr", "w") as header:
            header.write(f"ENVI\nsamples = {SIDE}\nlines = {SIDE}\nbands = 1\ndata type = 4\ninterleave = bsq\nbyte order = 0\n"
                         f"map info = {{Arbitrary, 1, 1, 0, 0, {east_m!r}, {south_m!r}, 0}}\n")

    def raster(self, *arguments, count=1):
        path = f"{self.folder}/judged.tif"
        mode, *rest = arguments
        colours = rest[:1] if mode == "color-relief" else []  # their file stands before the result
        subprocess.run(["gdaldem", mode, "-q", f"{self.folder}/heights", *colours, path, *rest[len(colours):]], check=True)
        if count == 3:
            values = list(zip(*bands(path, 3)))
        else:
            subprocess.run(["gdal_translate", "-q", "-of", "ENVI", "-ot", "Float32", path, path + ".raw"], check=True)
            values = array.array("f", open(path + ".raw", "rb").read())
        return [list(values[SIDE * r:SIDE * (r + 1)]) for r in range(SIDE)]


def colour_off(found, wanted):
    return max(abs(a - b) for f, w in zip(inner(found), inner(wanted)) for a, b in zip(f[:3], w))


def check_colours(found, stops, judge, folder):
    with open(f"{folder}/stops.txt", "w") as file:
        file.writelines(f"{value} {int(c[1:3], 16)} {int(c[3:5], 16)} {int(c[5:], 16)}\n" for value, c in stops)
    wanted = judge.raster("color-relief", f"{folder}/stops.txt", count=3)
    worst = colour_off(found, wanted)
    assert worst <= COLOUR, f"color-relief: {worst} of 255 off gdaldem's"
    assert colour_off(shifted(found), wanted) > COLOUR, "color-relief: pixels to the side pass (control)"
    return f"colours within {worst} of 255"


def slopes_off(found, wanted):
    return max(abs(f[0] * 90 / 255 - w) for f, w in zip(inner(found), inner(wanted)))


def check_slopes(found, wanted):
    worst = slopes_off(found, wanted)
    assert worst <= SLOPE_DEG, f"slope: {worst:.2f} degrees off gdaldem's"
    assert slopes_off(shifted(found), wanted) > SLOPE_DEG, "slope: pixels to the side pass (control)"
    return f"within {worst:.2f} degrees"


def aspects_off(found, wanted, slopes):
    turn = lambda f, w: abs((f[0] * 360 / 255 - w + 180) % 360 - 180)
    return max(turn(f, w) for f, w, s in zip(inner(found), inner(wanted), inner(slopes)) if s > STEEP_DEG)


def check_aspects(found, wanted, slopes):
    worst = aspects_off(found, wanted, slopes)
    assert worst <= ASPECT_DEG, f"aspect: {worst:.2f} degrees off gdaldem's"
    assert aspects_off(shifted(found), wanted, slopes) > ASPECT_DEG, "aspect: pixels to the side pass (control)"
    return f"within {worst:.2f} degrees"


def light(pixel):
    return sum(pixel[:3])


def check_shades(relief, colours, judge, zoom):
    """Of the relief what its colours do not explain goes with gdaldem's four lights, at the same exaggeration."""
    factor = min(max(math.sqrt(EQUATOR_M / (256 * 2**zoom) / 25), 1.2), 8)
    wanted = inner(judge.raster("hillshade", "-multidirectional", "-z", repr(factor)))
    shades = lambda rows: [light(r) / light(c) for r, c in zip(inner(rows), inner(colours))]
    dark = [k for k, w in enumerate(wanted) if w < 178]  # flat ground has 180; what is brighter goes towards white
    of = lambda values: [values[k] for k in dark]
    alike = statistics.correlation(of(shades(relief)), of(wanted))
    assert alike >= LEAST_CORRELATION, f"relief: shades correlate by {alike:.3f} with gdaldem's"
    aside = statistics.correlation(of(shades(shifted(relief))), of(wanted))
    assert aside < LEAST_CORRELATION - 0.1, f"relief: pixels to the side pass (control), {aside:.3f}"
    return f"correlation {alike:.4f} with gdaldem's, {aside:.3f} {SHIFT} pixels aside"


def check_documents(dataset):
    """Ramps: TileJSON, stops of one's own, and what is refused."""
    about = json.loads(fetch(f"{dataset}/slope.json?ramp=0:000000,45:ff0000"))
    assert about["ramp"] == [[0, "#000000"], [45, "#ff0000"]] and about["tiles"][0].endswith("{y}.png?ramp=0:000000,45:ff0000"), about
    for ramp in ("rainbow", "5:ffffff", "10:000000,5:ffffff", "0:ggg000,1:ffffff"):
        expect_refused(f"{dataset}/relief.json?ramp={ramp}", "atlas")


def main(dataset, folder):
    about = json.loads(fetch(f"{dataset}/color-relief.json"))
    west, south, east, north = about["bounds"]
    zoom = about["maxzoom"]
    y = (1 - math.asinh(math.tan(math.radians((south + north) / 2))) / math.pi) / 2
    place = (zoom, round(((west + east) / 2 + 180) / 360 * 2**zoom) - 1, round(y * 2**zoom) - 1)
    tiles = lambda face, ramp="": mosaic(dataset, face, place, folder, ramp)
    heights = [[r * 256 + g + b / 256 - 32768 for r, g, b in row] for row in tiles("terrarium")]
    colours = tiles("color-relief")
    assert all(pixel[3] == 255 for pixel in inner(colours)), "the data does not cover the tiles"
    judge = Judge(heights, place, folder)
    slopes, aspects = judge.raster("slope"), judge.raster("aspect")
    print(f"color-relief {place}: {check_colours(colours, about['ramp'], judge, folder)}")
    print(f"slope {place}: {check_slopes(tiles('slope', '?ramp=grey'), slopes)}")
    print(f"aspect {place}: {check_aspects(tiles('aspect', '?ramp=grey'), aspects, slopes)}")
    print(f"relief {place}: {check_shades(tiles('relief'), colours, judge, zoom)}")
    check_documents(dataset)


main(*sys.argv[1:])
