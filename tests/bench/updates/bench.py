#!/usr/bin/env python3
"""What a change of a dataset's rasters costs beside a full build, over HTTP.

    tests/bench/updates/bench.py BUILD RASTER [--share 0.01] [--patches 5] [--options error=5] [--write]

Starts a server on a folder of its own, posts the raster without and with updates=1, and lays patches over it, cut from the raster and lifted by 5 m, each
that share of its pixels, at places spread over it. Wall-clock seconds count the request until the version is served; processor seconds are those of the
jobs, which other work on the machine changes little. --write puts the table into README.md.
"""
import argparse
import http.client
import json
import math
import os
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from own_server import OwnServer  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
MARK = "<!-- table of bench.py -->"


class Server(OwnServer):
    def jobs_cpu_s(self):
        """Processor time of the children that have ended."""
        with open("/proc/%d/stat" % self.process.pid) as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[13]) + int(fields[14])) / os.sysconf("SC_CLK_TCK")

    def send(self, method, path, raster=None):
        """Answer, wall and processor seconds until what came of it is served."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=86400)
        start, cpu = time.monotonic(), self.jobs_cpu_s()
        with open(raster, "rb") if raster else open(os.devnull, "rb") as body:
            connection.request(method, path, body, {"Content-Length": str(os.path.getsize(raster) if raster else 0)})
            answer = connection.getresponse()
            said = json.loads(answer.read())
        if answer.status >= 300:
            raise SystemExit("%s %s: %s" % (method, path, said))
        dataset = said["id"] if path.startswith("/v1/datasets?") else path.split("/")[3].split("?")[0]
        while True:
            connection.request("GET", "/v1/datasets/" + dataset)
            now = json.loads(connection.getresponse().read())
            if now["state"] == "failed" or (now.get("updates") or {}).get("last", None) and now["updates"]["last"]["state"] == "failed":
                raise SystemExit("%s %s: %s" % (method, path, now))
            if now["state"] == "ready" and not (now.get("updates") or {"pending": 0})["pending"]:
                break
            time.sleep(0.01)
        return dataset, time.monotonic() - start, self.jobs_cpu_s() - cpu

    def store_bytes(self, dataset):
        return os.path.getsize(os.path.join(self.data, "datasets", dataset, "dataset.sqlite"))


def size_of(raster):
    info = json.loads(subprocess.run(["gdalinfo", "-json", raster], check=True, capture_output=True).stdout)
    return info["size"]


def run(words):
    program = os.path.join(words.build, "bin", "cordillera")
    columns, rows = size_of(words.raster)
    side = math.sqrt(words.share)
    lines = []
    with tempfile.TemporaryDirectory(prefix="cordillera-bench-") as folder:
        server = Server(program, folder)
        try:
            query = "/v1/datasets?name=%s&%s" % (os.path.basename(words.raster), words.options)
            plain, wall, cpu = server.send("POST", query, words.raster)
            lines.append(("build", wall, cpu, server.store_bytes(plain), None))
            dataset, full, full_cpu = server.send("POST", query + "&updates=1", words.raster)
            lines.append(("build, updates=1", full, full_cpu, server.store_bytes(dataset), None))
            for k in range(words.patches):
                patch = os.path.join(folder, "patch%d.tif" % k)
                # Spread by a low-discrepancy sequence, so that patches lie across the borders of blocks as they come.
                u, v = (0.5 + 0.7548776662 * k) % 1, (0.5 + 0.5698402910 * k) % 1
                window = [int(u * (1 - side) * columns), int(v * (1 - side) * rows), int(side * columns), int(side * rows)]
                subprocess.run(["gdal_translate", "-q", "-srcwin", *map(str, window), words.raster, patch], check=True)
                _, wall, cpu = server.send("POST", "/v1/datasets/%s/sources?name=patch%d.tif&z_offset=5" % (dataset, k), patch)
                lines.append(("patch %d" % (k + 1), wall, cpu, server.store_bytes(dataset), (wall / full, cpu / full_cpu)))
        finally:
            server.process.terminate()
            server.process.wait()
    return columns, rows, lines


def table(words, columns, rows, lines):
    out = ["%s, %d x %d pixels, %s; patches of %g %% of them; %s, %d cores" % (
        os.path.basename(words.raster), columns, rows, words.options, 100 * words.share, time.strftime("%Y-%m-%d"), os.cpu_count()), "",
        "| | seconds | processor seconds | MB of the store | of a full build: seconds | processor seconds |", "|---|--:|--:|--:|--:|--:|"]
    for name, wall, cpu, size, shares in lines:
        of_full = ["%.1f %%" % (100 * s) for s in shares] if shares else ["", ""]
        out.append("| %s | %.2f | %.2f | %.1f | %s | %s |" % (name, wall, cpu, size / 1e6, *of_full))
    return "\n".join(out) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("raster")
    parser.add_argument("--share", type=float, default=0.01)
    parser.add_argument("--patches", type=int, default=5)
    parser.add_argument("--options", default="error=5")
    parser.add_argument("--write", action="store_true")
    words = parser.parse_args()
    text = table(words, *run(words))
    print(text)
    if words.write:
        path = os.path.join(HERE, "README.md")
        with open(path) as readme:
            head = readme.read().split(MARK)[0]
        with open(path, "w") as readme:
            readme.write(head + MARK + "\n\n" + text)


if __name__ == "__main__":
    sys.exit(main())
