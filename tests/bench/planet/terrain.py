#!/usr/bin/env python3
"""One-degree cells of the planet's layout with real pixels, to measure tasks with: terrain.py FOLDER RASTER...

Each raster, taken as one of pixels of an arc second, is mirrored until it fills 2 x 2 cells of 3600 x 3600 pixels: no step where copies meet.
They stand three abreast from 6 E 44 N, so that blocks lie over several cells, as on the planet. Only the pixels are real, not where they
lie. Needs gdal_translate and gdalinfo. FOLDER/list.txt is what `cordillera plan` takes."""
import array
import json
import os
import subprocess
import sys

SIDE = 3600       # pixels of a cell
CELLS = 2         # cells a side of each raster
ABREAST = 3       # rasters
WEST, SOUTH = 6, 44
PACKED = ["-co", "TILED=YES", "-co", "BLOCKXSIZE=512", "-co", "BLOCKYSIZE=512", "-co", "COMPRESS=DEFLATE", "-co", "PREDICTOR=3"]
HEADER = "ENVI\nsamples = {0}\nlines = {0}\nbands = 1\nheader offset = 0\ndata type = 4\ninterleave = bsq\nbyte order = 0\n"


def run(*words):
    return subprocess.run(words, check=True, stdout=subprocess.PIPE).stdout


def mirrored(sequence, length):
    """There and back again."""
    both = sequence + sequence[::-1]
    return (both * (length // len(both) + 1))[:length]


def rows_of(raster, folder):
    """Nodata value, and lines of float32."""
    about = json.loads(run("gdalinfo", "-json", raster))
    width, height = about["size"]
    raw = os.path.join(folder, "raw.bin")
    run("gdal_translate", "-q", "-of", "ENVI", "-ot", "Float32", raster, raw)
    pixels = array.array("f")
    with open(raw, "rb") as file:
        pixels.fromfile(file, width * height)
    return about["bands"][0].get("noDataValue"), [pixels[row * width:(row + 1) * width] for row in range(height)]


def write_cell(folder, lines, nodata, west, north):
    name = f"N{north - 1:02}E{west:03}.tif"
    raw = os.path.join(folder, "cell.bin")
    with open(raw, "wb") as file:
        for line in lines:
            line.tofile(file)
    with open(os.path.join(folder, "cell.hdr"), "w", encoding="utf-8") as file:
        file.write(HEADER.format(SIDE))
    words = [] if nodata is None else ["-a_nodata", str(nodata)]
    run("gdal_translate", "-q", *PACKED, *words, "-a_srs", "EPSG:4326", "-a_ullr", str(west), str(north), str(west + 1), str(north - 1), raw,
        os.path.join(folder, name))
    return name


def main():
    folder, rasters = sys.argv[1], sys.argv[2:]
    os.makedirs(folder, exist_ok=True)
    names = []
    for k, raster in enumerate(rasters):
        nodata, rows = rows_of(raster, folder)
        rows = mirrored([mirrored(row, CELLS * SIDE) for row in rows], CELLS * SIDE)
        west, north = WEST + CELLS * (k % ABREAST), SOUTH + CELLS * (k // ABREAST + 1)
        for cell in range(CELLS * CELLS):
            across, down = cell % CELLS, cell // CELLS
            lines = [row[across * SIDE:(across + 1) * SIDE] for row in rows[down * SIDE:(down + 1) * SIDE]]
            names.append(write_cell(folder, lines, nodata, west + across, north - down))
    for name in ("raw.bin", "raw.hdr", "raw.bin.aux.xml", "cell.bin", "cell.hdr", "cell.bin.aux.xml"):
        if os.path.exists(os.path.join(folder, name)):
            os.remove(os.path.join(folder, name))
    with open(os.path.join(folder, "list.txt"), "w", encoding="utf-8") as file:
        file.writelines(f"{name}\n" for name in names)


if __name__ == "__main__":
    main()
