#!/usr/bin/env python3
"""As crash_loop.py, of a dataset whose raster is replaced: whatever goes wrong, the version before or the one after is served, whole.

    replace_loop.py PROGRAM SHIM [--points N] [--jobs N] [--random N] [--faults N] [--all] [--hours H] [--seed S]

A run is: post a raster with updates=1, wait for its tiles, put another raster in its place. After the restart the dataset has the tiles of an
undisturbed build of the one or the other; of the other, if that was answered with 202. Readers who ask for tiles meanwhile get those of the one or the other.
"""
import hashlib
import json
import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from client import PATIENCE_S, cone, tiles  # noqa: E402
from crash_loop import FIRST, Loop, main, post  # noqa: E402

OTHER = cone(40, 700)  # the same place, other heights
TILE = "tiles/7/135/96.drc"  # of both


def settled(server, dataset):
    """Waits until nothing is under way: 0, or what never ended (the build itself counts as one), or None: no such dataset."""
    end = time.monotonic() + PATIENCE_S
    while True:
        status, _, body = server.ask("GET", "/v1/datasets/" + dataset)
        if status != 200:
            return None
        now = json.loads(body)
        left = now["updates"]["pending"] + (now["state"] not in ("ready", "failed"))
        if left == 0 or time.monotonic() > end:
            return left
        time.sleep(0.01)


def tile_now(server, dataset):
    status, _, body = server.ask("GET", "/v1/datasets/%s/%s" % (dataset, TILE))
    return hashlib.sha256(body).hexdigest() if status == 200 else status


class ReplaceLoop(Loop):
    def use(self, server, told, _=None):
        told.replaced, told.seen = set(), set()
        dataset = post(server, told, "first", "updates=1&name=first.asc", FIRST)
        if not dataset or server.wait(dataset) != "ready":
            return
        told.seen.add(tile_now(server, dataset))
        source = json.loads(server.ask("GET", "/v1/datasets/%s/sources" % dataset)[2])["sources"][0]["id"]
        status, _, body = server.ask("PUT", "/v1/datasets/%s/sources/%s?name=other.asc&crs=EPSG:4326" % (dataset, source), OTHER)
        if status not in (200, 202):
            return told.problem(status, body)
        told.replaced.add(dataset)
        told.seen.add(tile_now(server, dataset))
        settled(server, dataset)
        told.seen.add(tile_now(server, dataset))

    def undisturbed(self):
        with self.counted_use() as (server, told):
            assert told.replaced and not told.problems, "the undisturbed run failed: " + str(told.problems)
            dataset, = told.replaced
            place = os.path.join(server.data, "datasets", dataset)
            self.expected = {"replaced": tiles(os.path.join(place, "dataset.sqlite")), "first": tiles(os.path.join(place, "versions", "1.sqlite"))}
            assert self.expected["first"] != self.expected["replaced"]
            self.seen = told.seen
            assert len(self.seen) == 2 and 404 not in self.seen, "the tile that is looked at: %s" % self.seen
            self.names = self.listed(place)

    @staticmethod
    def listed(folder):
        """What lies in a dataset's folder; rasters have names that chance gave, so their number stands for them."""
        names = set(os.listdir(folder)) - {"sources"}
        return names, len(os.listdir(os.path.join(folder, "sources")))

    def look(self, where, server, told):
        if not server.started():
            return self.finding(where, "the server does not start again")
        if not getattr(told, "seen", set()) <= self.seen | {404, 409, 500, 503, 507}:
            self.finding(where, "a tile that is of neither version was served")
        for dataset in told.accepted:
            left = settled(server, dataset)
            if left != 0:
                self.finding(where, "%s changes of %s never end" % (left, dataset))
                continue
            place = os.path.join(server.data, "datasets", dataset)
            if not os.path.exists(os.path.join(place, "dataset.sqlite")):
                self.finding(where, "%s was accepted and has no tiles" % dataset)
                continue
            found = tiles(os.path.join(place, "dataset.sqlite"))
            if found not in self.expected.values():
                self.finding(where, "the tiles are of neither version")
            elif dataset in told.replaced and found != self.expected["replaced"]:
                self.finding(where, "a replacement that was accepted was not made")
            else:
                self.survived += 1
            self.look_at_version(where, server, dataset, found)
        if os.listdir(os.path.join(server.data, "incoming")):
            self.finding(where, "uploads that nobody sends any more are kept")

    def look_at_version(self, where, server, dataset, found):
        if tile_now(server, dataset) not in self.seen:
            self.finding(where, "the tile that is served is of neither version")
        if found != self.expected["replaced"]:
            return
        place, end = os.path.join(server.data, "datasets", dataset), time.monotonic() + PATIENCE_S
        while self.listed(place) != self.names and time.monotonic() < end:
            time.sleep(0.01)  # tidied after the state is set
        if self.listed(place) != self.names:
            self.finding(where, "the dataset's folder holds %s, not %s" % (self.listed(place), self.names))


if __name__ == "__main__":
    sys.exit(main(ReplaceLoop, __doc__))
