#!/usr/bin/env python3
"""Every pixel of some tiles of the picture faces against the raster, brought to the same pixels by GDAL.

  pictures.py RASTER DATASET FOLDER      the address of the raster's dataset; a folder for files

Heights have to be within what the TileJSON states, plus what resampling does to the raster (the manifest has both), and shades have to go
with those of gdaldem.
Controls: pixels that are a few to the side must not pass."""
import array
import json
import math
import statistics
import subprocess
import sys
import urllib.request

SIDE = 256
EARTH_M = 20037508.342789244  # half of Web Mercator's width
SHIFT = 6  # pixels to the side, of the control
LEAST_CORRELATION = 0.9  # gdaldem's slopes are of single pixels, ours of triangles
BETWEEN = 2  # times what two ways to read the raster between its pixels differ by: triangles are a third way
NO_DATA = -30000  # metres; GDAL puts the raster's nodata value beside it
HEIGHTS = {"terrain-rgb": lambda r, g, b: -10000 + 0.1 * (r * 65536 + g * 256 + b), "terrarium": lambda r, g, b: r * 256 + g + b / 256 - 32768}


def fetch(address):
    with urllib.request.urlopen(address) as answer:
        return answer.read()


def tile_of(lon, lat, zoom):
    y = (1 - math.asinh(math.tan(math.radians(lat))) / math.pi) / 2
    return int((lon + 180) / 360 * 2**zoom), int(y * 2**zoom)


def pixels(path, band, kind):
    """Rows, one after another, of a band; kind is GDAL's name of the type and the array's letter."""
    subprocess.run(["gdal_translate", "-q", "-of", "ENVI", "-b", str(band), "-ot", kind[0], path, path + ".raw"], check=True)
    values = array.array(kind[1])
    with open(path + ".raw", "rb") as file:
        values.frombytes(file.read())
    return list(values)


def picture(dataset, face, place, folder):
    """Bands of a tile of the server."""
    path = f"{folder}/tile.png"
    with open(path, "wb") as file:
        file.write(fetch(f"{dataset}/{face}/{'/'.join(map(str, place))}.png"))
    return [pixels(path, band, ("Byte", "B")) for band in ((1, 2, 3) if face in HEIGHTS else (1,))]


def raster_on_tile(raster, place, folder):
    """The raster's heights at the centres of a tile's pixels, what two ways to read them differ by, and shades; read with two more pixels on each side, since
    shades need neighbours."""
    zoom, x, y = place
    size, path = 2 * EARTH_M / 2**zoom, f"{folder}/warped.tif"
    west, north, pixel = x * size - EARTH_M, EARTH_M - y * size, size / SIDE
    window = [west - 2 * pixel, north - size - 2 * pixel, west + size + 2 * pixel, north + 2 * pixel]
    inner = lambda values: [values[(r + 2) * (SIDE + 4) + c + 2] for r in range(SIDE) for c in range(SIDE)]
    heights = {}
    for way in ("cubic", "bilinear"):
        subprocess.run(["gdalwarp", "-q", "-overwrite", "-t_srs", "EPSG:3857", "-r", way, "-et", "0", "-ot", "Float32", "-ts", str(SIDE + 4), str(SIDE + 4),
                        "-te", *map(repr, window), raster, path], check=True)
        heights[way] = inner(pixels(path, 1, ("Float32", "f")))
    lat = math.degrees(math.atan(math.sinh(math.pi * (1 - 2 * (y + 0.5) / 2**zoom))))
    shades = f"{folder}/shades.tif"
    subprocess.run(["gdaldem", "hillshade", "-q", "-az", "315", "-alt", "45", "-z", str(1 / math.cos(math.radians(lat))), path, shades], check=True)
    between_m = differences(heights["cubic"], heights["bilinear"])[0]
    return heights["bilinear"], between_m, inner(pixels(shades, 1, ("Byte", "B")))


def shifted(values):
    return [values[r * SIDE + (c + SHIFT) % SIDE] for r in range(SIDE) for c in range(SIDE)]


def differences(found, wanted):
    assert min(wanted) > NO_DATA, "the raster does not cover the tile"
    off = [a - b for a, b in zip(found, wanted)]
    return max(map(abs, off)), math.sqrt(statistics.fmean(d * d for d in off))


def check_heights(dataset, face, place, wanted, folder, between_m):
    stated_m = next(zoom["stated_max_error"] for zoom in json.loads(fetch(f"{dataset}/{face}.json"))["zooms"] if zoom["zoom"] == place[0])
    found = [HEIGHTS[face](*colour) for colour in zip(*picture(dataset, face, place, folder))]
    allowed_m = stated_m + BETWEEN * between_m
    worst_m, rmse_m = differences(found, wanted)
    assert worst_m <= allowed_m and rmse_m <= stated_m, f"{face} {place}: {worst_m:.2f} m off, RMSE {rmse_m:.2f} m; stated {stated_m:.2f} m"
    aside_m, aside_rmse_m = differences(found, shifted(wanted))
    assert aside_m > allowed_m and aside_rmse_m > stated_m, f"{face}: pixels to the side pass (control)"
    return f"RMSE {rmse_m:.2f} m, the worst {worst_m:.2f} of {allowed_m:.2f} m"


def check_shades(dataset, place, wanted, folder):
    [found] = picture(dataset, "hillshade", place, folder)
    alike, aside = statistics.correlation(found, wanted), statistics.correlation(found, shifted(wanted))
    assert alike >= LEAST_CORRELATION, f"hillshade {place}: correlation {alike:.3f} with gdaldem's"
    assert aside < LEAST_CORRELATION - 0.2, f"hillshade: pixels to the side pass (control), {aside:.3f}"
    return f"correlation {alike:.3f} with gdaldem's, {aside:.3f} {SHIFT} pixels aside"


def main(raster, dataset, folder):
    about = json.loads(fetch(f"{dataset}/terrain-rgb.json"))
    west, south, east, north = about["bounds"]
    place = (about["maxzoom"], *tile_of((west + east) / 2, (south + north) / 2, about["maxzoom"]))
    heights, between_m, shades = raster_on_tile(raster, place, folder)
    for face in HEIGHTS:
        print(f"{face} {place}: {check_heights(dataset, face, place, heights, folder, between_m)}")
    print(f"hillshade {place}: {check_shades(dataset, place, shades, folder)}")


main(*sys.argv[1:])
