"""Rasters, and the bytes that every tile of theirs must have: those of an undisturbed `cordillera build`."""
import hashlib
import math
import os

import processes

OPTIONS = {"crs": "EPSG:4326", "vertical_datum": "ellipsoid"}
FORMATS = "drc,3d-tiles,quantized-mesh,terrain-rgb,hillshade"
TILES = (".drc", ".glb", ".terrain", ".png")


def ripples(size, height, wave):
    """An Esri ASCII grid."""
    rows = ["ncols %d" % size, "nrows %d" % size, "xllcorner 10", "yllcorner 46", "cellsize 0.0083333333333333", "NODATA_value -9999"]
    for r in range(size):
        rows.append(" ".join("%.2f" % (height * (1 + math.sin(r / wave) * math.cos(c / wave)) + (r * 7 + c * 13) % 11) for c in range(size)))
    return ("\n".join(rows) + "\n").encode()


def tag(body):
    """A document's ETag."""
    return '"%s"' % hashlib.sha256(body).digest()[:16].hex()


class Raster:
    """query: the options of its POST. tiles: path below the dataset to bytes."""

    def __init__(self, program, folder, number):
        self.number, self.name = number, "raster-%d.asc" % number
        self.body = ripples(40 + 45 * number, 300 + 100 * number, 4 + 3 * number)
        self.options = dict(OPTIONS, error=str(4 + number % 3), title="Raster %d" % number)
        self.query = "&".join("%s=%s" % pair for pair in self.options.items()).replace(" ", "%20")
        source, out = os.path.join(folder, self.name), os.path.join(folder, "reference-%d" % number)
        with open(source, "wb") as file:
            file.write(self.body)
        words = [w for k, v in self.options.items() for w in ("--" + k.replace("_", "-"), v)]
        build = processes.start([program, "build", source, "-o", out, "--quiet", "--device", "cpu", "--formats", FORMATS] + words)
        if build.wait() != 0:
            raise SystemExit("cordillera build of %s ended with %d" % (self.name, build.returncode))
        self.tiles = {}
        for place, _, names in os.walk(out):
            for name in names:
                path = os.path.join(place, name)
                if name.endswith(TILES):
                    with open(path, "rb") as file:
                        self.tiles[os.path.relpath(path, out)] = file.read()
        self.paths = sorted(self.tiles)
