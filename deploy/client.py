#!/usr/bin/env python3
"""What quickstart.sh needs to know of the server's answers. Only the standard library.

  client.py query  KEY=VALUE [OPTION VALUE]...   a query string
  client.py id     POSTED.json                   the dataset's id
  client.py watch  URL ID                        a progress line until the build is over; exit code 1 if it failed
  client.py report URL ID FILES                  the table, the curl lines; the tile addresses go to FILES.drc and FILES.glb
"""
import json
import math
import sys
import time
import urllib.error
import urllib.parse
import urllib.request


def get_json(url):
    with urllib.request.urlopen(url, timeout=60) as response:
        return json.load(response)


def exists(url):
    try:
        urllib.request.urlopen(urllib.request.Request(url, method="HEAD"), timeout=60).close()
        return True
    except urllib.error.HTTPError:
        return False


def query(first, *options):
    pairs = [tuple(first.split("=", 1))]
    pairs += [(name.replace("-", "_"), value) for name, value in zip(options[::2], options[1::2])]
    print(urllib.parse.urlencode(pairs, quote_via=urllib.parse.quote))


def posted_id(path):
    with open(path, encoding="utf-8") as posted:
        print(json.load(posted)["id"])


def progress_line(status):
    progress = status.get("progress") or {}
    stage = progress.get("stage") or status["state"]
    done, total = progress.get("done", 0), progress.get("total", 0)
    share = 1 if status["state"] == "ready" else min(done / total, 1) if total else 0
    left = progress.get("seconds_left")  # null while nobody can know
    bar = "#" * round(30 * share) + "." * (30 - round(30 * share))
    return f"{stage:8} [{bar}] {100 * share:3.0f} %" + (f"  {left:.0f} s left" if left is not None and left >= 0 and share < 1 else "")


def watch(url, dataset):
    on_terminal = sys.stdout.isatty()
    started, last = time.monotonic(), None
    while True:
        status = get_json(f"{url}/v1/datasets/{dataset}")
        state = status["state"]
        line = progress_line(status)
        if on_terminal:
            print(f"\r\x1b[K{line}", end="", flush=True)
        elif line[:8] != last:
            last = line[:8]
            print(line, flush=True)
        if state in ("ready", "failed"):
            break
        time.sleep(0.3)
    if on_terminal:
        print()
    if state == "failed":
        error = status.get("error") or {}
        sys.exit(f"The build failed: {error.get('detail', error)}\nAccepted: {error.get('accepted', '-')}")
    print(f"ready after {time.monotonic() - started:.1f} s")


def print_table(manifest):
    print(f"{'level':>5} {'tiles':>8} {'triangles':>12} {'.drc bytes':>12} {'.glb bytes':>12} {'max error m':>12} {'RMSE m':>9}")
    for level in manifest["levels"]:
        error = ("<=" if level["composed"] else "") + f"{level['stated_max_error']:.3f}"
        rmse = f"{level['rmse']:.3f}" if "rmse" in level else "-"  # bounds have none
        print(f"{level['level']:5} {level['tiles']:8,} {level['triangles']:12,} {level['drc_bytes']:12,.0f} {level['glb_bytes']:12,.0f} "
              f"{error:>12} {rmse:>9}")
    print(f"{'all':>5} {manifest['tiles']:8,} {manifest['triangles']:12,}   {manifest['bytes']:,.0f} bytes, equal tiles counted once")
    if any(level["composed"] for level in manifest["levels"]):
        print("<= : a bound, composed of measured steps; the others were measured at every sample of the finest level")


def tile_address(url, dataset, manifest):
    """The finest tile nearest to the middle of the data that exists: holes and ragged edges leave tiles out."""
    level = manifest["levels"][0]["level"]
    west, south, east, north = manifest["bounds"][:4]
    east += 360 if east < west else 0
    tiles = 2 ** level
    column = lambda longitude: math.floor((longitude + 180) / 180 * tiles)
    row = lambda latitude: min(max(math.floor((latitude + 90) / 180 * tiles), 0), tiles - 1)
    middle = (column((west + east) / 2), row((south + north) / 2))
    around = [(x, y) for x in range(column(west), column(east) + 1) for y in range(row(south), row(north) + 1)]
    around.sort(key=lambda tile: (tile[0] - middle[0]) ** 2 + (tile[1] - middle[1]) ** 2)
    for x, y in around[:2000]:
        address = f"{url}/v1/datasets/{dataset}/tiles/{level}/{x % (2 * tiles)}/{y}"
        if exists(address + ".drc"):
            return address
    sys.exit("no tile of the finest level answers: the dataset is not what its manifest says")


def report(url, dataset, files):
    base = f"{url}/v1/datasets/{dataset}"
    manifest = get_json(f"{base}/manifest.json")
    source = manifest["source"]
    print(f"{source['columns']} x {source['rows']} pixels, {source['crs']}, heights read as {source['vertical_datum']} "
          f"({source['vertical_datum_from']}), built on {manifest['device']}\n")
    print_table(manifest)
    tile = tile_address(url, dataset, manifest)
    for face in ("drc", "glb"):
        with open(f"{files}.{face}", "w", encoding="utf-8") as address:
            address.write(f"{tile}.{face}")
    print(f"\ncurl {base}/tileset.json\ncurl -o tile.drc {tile}.drc\ncurl -o tile.glb {tile}.glb")
    print(f"\nLook at it: {url}/?dataset={dataset}\n")


COMMANDS = {"query": query, "id": posted_id, "watch": watch, "report": report}
if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(__doc__)
    COMMANDS[sys.argv[1]](*sys.argv[2:])
