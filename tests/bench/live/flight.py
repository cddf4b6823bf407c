#!/usr/bin/env python3
"""Viewers that fly over one lazy dataset: what they are answered, how soon, and the memory of the service and its jobs.

    tests/bench/live/flight.py BUILD RASTER [--viewers 200] [--minutes 10] [--options error=5]

The raster is posted with build=lazy to a server of its own. Each viewer has an address of the loopback network, a connection and a straight way over the
data at a speed of its own; it turns back at the rim. Once a second it asks for the four tiles of the finest level around it and for those above them, as
.glb, one after the other. Prints a line each half minute, then how many answers of each status there were. Ends with 1 if one is none of 200, 404 and 503, or
if a connection breaks.
"""
import argparse
import collections
import http.client
import os
import pathlib
import random
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from bench import Server  # noqa: E402
from lazy import tile_at, until  # noqa: E402

GOOD = (200, 404, 503)
LEVELS = 5  # from the finest up
WAYS = 60   # seconds over the data, at the greatest speed
TELL_S = 30


class Flight:
    def __init__(self, server, dataset, manifest, end):
        self.port, self.dataset, self.manifest, self.end = server.port, dataset, manifest, end
        self.counts, self.waits, self.broken, self.lock = collections.Counter(), [], [], threading.Lock()

    def paths(self, at):
        finest, x, y = tile_at(self.manifest, self.manifest["max_level"], *at)
        for level in range(finest, max(finest - LEVELS, 0), -1):
            beside = (0, 1) if level == finest else (0,)
            for dx in beside:
                for dy in beside:
                    yield "%s/tiles/%d/%d/%d.glb" % (self.dataset, level, (x >> (finest - level)) + dx, (y >> (finest - level)) + dy)

    def fly(self, number):
        chance = random.Random(number)
        at, step = [chance.random(), chance.random()], [chance.uniform(-1, 1) / WAYS, chance.uniform(-1, 1) / WAYS]
        own = ("127.0.%d.%d" % (1 + number // 250, 1 + number % 250), 0)
        connection = None
        while time.monotonic() < self.end:
            began = time.monotonic()
            for path in self.paths(at):
                asked = time.monotonic()
                try:
                    connection = connection or http.client.HTTPConnection("127.0.0.1", self.port, timeout=60, source_address=own)
                    connection.request("GET", path)
                    answer = connection.getresponse()
                    answer.read()
                except (OSError, http.client.HTTPException) as trouble:
                    connection = None
                    with self.lock:
                        self.broken.append(repr(trouble))
                    continue
                with self.lock:
                    self.counts[answer.status] += 1
                    self.waits.append(time.monotonic() - asked)
            for k in range(2):
                if not 0 <= at[k] + step[k] <= 1:
                    step[k] = -step[k]
                at[k] += step[k]
            time.sleep(max(0.0, 1 - (time.monotonic() - began)))


def memory_mb(pid):
    """Of a process and its children."""
    pages = 0
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            parent = (folder / "stat").read_text().rsplit(")", 1)[1].split()[1]
            if pid in (int(folder.name), int(parent)):
                pages += int((folder / "statm").read_text().split()[1])
        except OSError:
            continue
    return pages * os.sysconf("SC_PAGE_SIZE") / 2 ** 20


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("raster")
    parser.add_argument("--viewers", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--options", default="")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = Server(os.path.join(given.build, "bin", "cordillera"), folder)
        dataset, _ = server.post(given.raster, "build=lazy" + ("&" + given.options if given.options else ""))
        manifest = until(lambda: (found := server.json(dataset + "/manifest.json")) and found.get("done_blocks") and found)
        began = time.monotonic()
        flight = Flight(server, dataset, manifest, began + 60 * given.minutes)
        viewers = [threading.Thread(target=flight.fly, args=(k,)) for k in range(given.viewers)]
        for viewer in viewers:
            viewer.start()
        while time.monotonic() < flight.end:
            time.sleep(min(TELL_S, max(0.1, flight.end - time.monotonic())))
            print("%.0f s: %.0f MB, %d answers" % (time.monotonic() - began, memory_mb(server.process.pid), sum(flight.counts.values())), flush=True)
        for viewer in viewers:
            viewer.join()
        server.process.terminate()
        server.process.wait()
    waits = sorted(flight.waits)
    print("answers %s; %d connections broke %s" % (dict(sorted(flight.counts.items())), len(flight.broken), flight.broken[:3]))
    print("seconds: median %.3f, 99th percentile %.3f, most %.2f" % (waits[len(waits) // 2], waits[len(waits) * 99 // 100], waits[-1]))
    return 1 if flight.broken or any(status not in GOOD for status in flight.counts) else 0


if __name__ == "__main__":
    sys.exit(main())
