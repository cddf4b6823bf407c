"""Finding 9: one dataset with many changes, rasters that are cheap to send and dear to build, and those who wait behind them."""
import array
import json
import os
import subprocess
import tempfile

from attack import case
from client import cone

OPTIONS = "crs=EPSG:4326&vertical_datum=ellipsoid&error=2"
CHANGES = 12
SECONDS = 10  # of a build; a cone takes less than one
PLACE = ["-a_srs", "EPSG:4326", "-a_ullr", "10", "47", "11", "46"]


@case("9 a raster behind a dataset with 12 pending changes", expect="ready after 3 of them at most", holds=lambda done: done <= 3)
def changes(attack):
    server = attack.start()  # one build at a time

    def post(path, body):
        status, _, answer = server.ask("POST", path, body)
        assert status == 202, answer
        return json.loads(answer)

    changed = post("/v1/datasets?name=a.asc&updates=1&" + OPTIONS, cone())["id"]
    assert server.wait(changed) == "ready"
    for number in range(CHANGES):
        post("/v1/datasets/%s/sources?name=%d.asc" % (changed, number), cone(120 + number))
    other = post("/v1/datasets?name=b.asc&" + OPTIONS, cone())["id"]
    before = ended(server, changed)
    assert server.wait(other) == "ready"
    return ended(server, changed) - before


def ended(server, dataset):
    listed = json.loads(server.ask("GET", "/v1/datasets/%s/sources" % dataset)[2])["changes"]
    return sum(change["state"] != "pending" for change in listed)


def constant(folder):
    """Some hundred bytes for 144 million samples."""
    path = os.path.join(folder, "constant.tif")
    subprocess.run(["gdal_create", "-q", "-outsize", "12000", "12000", "-burn", "100", "-ot", "Float32", "-co", "COMPRESS=LERC",
                    "-co", "BLOCKYSIZE=12000", *PLACE, path], check=True)
    return path


def checkerboard(folder, side=3000, height=15000):
    """Nothing of it can be left out."""
    raw, path = os.path.join(folder, "board"), os.path.join(folder, "board.tif")
    rows = array.array("h", [height, -height] * (side // 2) + [-height, height] * (side // 2))
    with open(raw, "wb") as file:
        file.write(rows.tobytes() * (side // 2))
    with open(raw + ".hdr", "w", encoding="utf-8") as file:
        file.write("ENVI\nsamples = %d\nlines = %d\nbands = 1\nheader offset = 0\nfile type = ENVI Standard\n"
                   "data type = 2\ninterleave = bsq\nbyte order = 0\n" % (side, side))
    subprocess.run(["gdal_translate", "-q", "-co", "COMPRESS=DEFLATE", *PLACE, raw, path], check=True)
    return path


@case("9 constant LERC of 12,000 x 12,000 and a checkerboard, then a cone", expect="build-time-limit twice, ready", minutes=True,
      holds=lambda seen: seen == ["build-time-limit", "build-time-limit", "ready"])
def dear(attack):
    server = attack.start(("--build-time-base", str(SECONDS), "--build-time-per-mib", "0"))
    seen, names = [], []
    with tempfile.TemporaryDirectory() as folder:
        for path in (constant(folder), checkerboard(folder)):
            assert os.path.getsize(path) < 1 << 20, "cheap to send, or nothing is shown"
            with open(path, "rb") as file:
                status, _, answer = server.ask("POST", "/v1/datasets?name=" + os.path.basename(path), file.read())
            assert status == 202, answer
            names.append(json.loads(answer)["id"])
    status, _, answer = server.ask("POST", "/v1/datasets?name=a.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=5", cone())
    assert status == 202, answer
    last = server.wait(json.loads(answer)["id"])
    for name in names:
        state = server.wait(name)
        error = json.loads(server.ask("GET", "/v1/datasets/" + name)[2])["error"]
        seen.append(error["type"].rsplit(":", 1)[1] if error else state)
    return seen + [last]
