#!/usr/bin/env python3
"""From the last byte of a POST to something to look at.

    tests/bench/live/bench.py BUILD RASTER... [--runs 3] [--options error=5] [--write]

Each raster is posted to a server of its own, on a folder of its own. Seconds count from the last byte of the body until an address answers with
200, asked for again and again, a few milliseconds apart. first: the manifest, the tileset and a tile of the first provisional tiles; finer: the
same of the next ones; ready: of the final ones. off: the raster with provisional=off, until it is ready, so what the first look costs the build.
The median run by first is shown. --write puts the table into README.md.
"""
import argparse
import http.client
import json
import os
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from own_server import OwnServer  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
MARK = "<!-- table of bench.py -->"
PAUSE_S = 0.003


class Server(OwnServer):
    def __init__(self, program, folder):
        super().__init__(program, folder)
        self.connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=3600)

    def get(self, path):
        self.connection.request("GET", path)
        answer = self.connection.getresponse()
        return answer.status, answer.read()

    def json(self, path):
        status, body = self.get(path)
        return json.loads(body) if status == 200 else None

    def post(self, raster, options):
        """The dataset, and the moment after the last byte was sent."""
        name = os.path.basename(raster)
        self.connection.putrequest("POST", "/v1/datasets?name=" + name + ("&" + options if options else ""))
        self.connection.putheader("Content-Length", str(os.path.getsize(raster)))
        self.connection.endheaders()
        with open(raster, "rb") as body:
            while piece := body.read(1 << 20):
                self.connection.send(piece)
        sent = time.monotonic()
        answer = self.connection.getresponse()
        said = json.loads(answer.read())
        if answer.status >= 300:
            raise SystemExit("%s: %s" % (raster, said))
        return "/v1/datasets/" + said["id"], sent


def middle_tile(manifest):
    """A coarse one that holds the middle of the data: it has triangles whatever the data's outline is."""
    west, south, east, north = manifest["bounds"][:4]
    level = manifest["min_level"]
    x = int(((west + east) / 2 + 180) / 180 * 2 ** level)
    y = int(((south + north) / 2 + 90) / 180 * 2 ** level)
    return "/tiles/%d/%d/%d.drc" % (level, x, y)


def watch(server, at, sent):
    """Seconds until each fineness of tiles, and until ready."""
    seconds, known = {}, None
    while True:
        manifest = server.json(at + "/manifest.json")
        if manifest and (manifest["max_level"], manifest["provisional"]) != known:
            known = (manifest["max_level"], manifest["provisional"])
            step = ("first" if "first" not in seconds else "finer") if manifest["provisional"] else "ready"
            for path in ("/tileset.json", middle_tile(manifest)):
                status, _ = server.get(at + path)
                if status != 200:
                    raise SystemExit("%s: %d" % (at + path, status))
            seconds[step] = time.monotonic() - sent
            seconds.setdefault("levels", []).append(manifest["max_level"])
        if "ready" in seconds:
            return seconds
        if (server.json(at) or {}).get("state") == "failed":
            raise SystemExit("%s failed" % at)
        time.sleep(PAUSE_S if "first" not in seconds else 0.05)


def measured(program, raster, options):
    with tempfile.TemporaryDirectory() as folder:
        server = Server(program, folder)
        at, sent = server.post(raster, options)
        seconds = watch(server, at, sent)
        server.process.terminate()
        server.process.wait()
        return seconds


def pixels_of(raster):
    info = json.loads(subprocess.run(["gdalinfo", "-json", raster], check=True, capture_output=True).stdout)
    return info["size"][0] * info["size"][1] / 1e6


def run(words):
    program = os.path.join(words.build, "bin", "cordillera")
    lines = ["| raster | Mpixel | first tiles | finer ones | ready | ready, `provisional=off` | levels |", "|---|--:|--:|--:|--:|--:|---|"]
    for raster in words.raster:
        runs = sorted((measured(program, raster, words.options) for _ in range(words.runs)), key=lambda one: one.get("first", one["ready"]))
        on = runs[len(runs) // 2]
        off = measured(program, raster, "&".join(filter(None, [words.options, "provisional=off"])))
        cell = lambda name: "%.2f" % on[name] if name in on else "–"  # noqa: E731
        lines.append("| %s | %.1f | %s | %s | %s | %.2f | %s |" % (os.path.basename(raster), pixels_of(raster), cell("first"), cell("finer"), cell("ready"),
                                                             off["ready"], ", ".join(map(str, on["levels"]))))
        print(lines[-1], flush=True)
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("raster", nargs="+")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--options", default="")
    parser.add_argument("--write", action="store_true")
    words = parser.parse_args()
    table = run(words)
    if not words.write:
        return
    path = os.path.join(HERE, "README.md")
    text = open(path).read()
    head = "\n\nSeconds; %s; %d cores, %s\n\n" % (words.options or "default options", os.cpu_count(), time.strftime("%Y-%m-%d"))
    with open(path, "w") as out:
        out.write(text[:text.index(MARK) + len(MARK)] + head + "\n".join(table) + "\n")


if __name__ == "__main__":
    main()
