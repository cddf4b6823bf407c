#!/usr/bin/env python3
"""From a look at a block to its final tiles, of a dataset with build=lazy.

    tests/bench/live/lazy.py BUILD RASTER [--looks 4] [--options error=5] [--wait 10] [--finest] [--view 8x5] [--pause 5]

The raster is posted to a server of its own. Its provisional tiles stand when the manifest names finished blocks, none as yet. Then, at places spread over
the data, one after the other: a tile of the blocks' level is asked for, and the seconds count until the manifest names its block. --wait: one request that
prefers to wait for the final tile, and the seconds until its answer; --finest: for a tile of the finest level, and their median at the end. --view, with --wait:
for so many tiles across and up around the place, all at once, as a map of that size asks. --pause: so many seconds before each, in which the
job that makes blocks may end. Then build=full makes the rest. Prints a line for each.
"""
import argparse
import concurrent.futures
import http.client
import os
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from bench import Server  # noqa: E402

PAUSE_S = 0.02
SPREAD = 0.618  # of the golden section: places that never fall together


def until(found):
    while not (result := found()):
        time.sleep(PAUSE_S)
    return result


def tile_at(manifest, level, share_x, share_y):
    """Level, column and row of the tile at a place inside the bounds."""
    west, south, east, north = manifest["bounds"][:4]
    tiles_a_degree = 2 ** level / 180
    return level, int((west + (east - west) * share_x + 180) * tiles_a_degree), int((south + (north - south) * share_y + 90) * tiles_a_degree)


def view_of(tile, across, up):
    level, x, y = tile
    return [(level, x - across // 2 + i, y - up // 2 + j) for j in range(up) for i in range(across)]


def answers(server, dataset, tiles, wait):
    """A request a connection, all at once: the statuses, in the tiles' order, and the bytes of all."""
    def ask(tile):
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=3600)
        connection.request("GET", dataset + "/tiles/%d/%d/%d.glb" % tile, headers={"Prefer": "wait=%d" % wait})
        answer = connection.getresponse()
        return answer.status, len(answer.read())
    with concurrent.futures.ThreadPoolExecutor(len(tiles)) as pool:
        got = list(pool.map(ask, tiles))
    return [status for status, _ in got], sum(size for _, size in got)


def is_done(manifest, block):
    done = manifest["done_blocks"]
    return block[1:] in zip(done["x"], done["y"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("raster")
    parser.add_argument("--looks", type=int, default=4)
    parser.add_argument("--options", default="")
    parser.add_argument("--wait", type=int, default=0, help="seconds; the service has a limit, max_wait")
    parser.add_argument("--finest", action="store_true")
    parser.add_argument("--view", default="", help="tiles across and up, such as 8x5")
    parser.add_argument("--pause", type=float, default=0, help="seconds before each look")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = Server(os.path.join(given.build, "bin", "cordillera"), folder)
        dataset, sent = server.post(given.raster, "build=lazy" + ("&" + given.options if given.options else ""))

        def manifest():
            return server.json(dataset + "/manifest.json")

        until(manifest)
        print("first tiles after %.1f s" % (time.monotonic() - sent))
        known = until(lambda: (found := manifest()) and found.get("done_blocks") and found)
        print("levels known after %.1f s" % (time.monotonic() - sent))
        level, waited = known["max_level"] if given.finest else known["done_blocks"]["level"], []
        for k in range(given.looks):
            block = tile_at(known, level, (0.5 + k * SPREAD) % 1, (0.5 + k * SPREAD * SPREAD) % 1)
            time.sleep(given.pause)
            looked = time.monotonic()
            if given.view:
                tiles = view_of(block, *map(int, given.view.split("x")))
                statuses, size = answers(server, dataset, tiles, given.wait)
                waited.append(time.monotonic() - looked)
                print("%d tiles around %d/%d/%d: %d of them there, %d kB, after %.2f s" %
                      (len(tiles), *block, statuses.count(200), size // 1000, waited[-1]), flush=True)
                continue
            if given.wait:
                server.connection.request("GET", dataset + "/tiles/%d/%d/%d.glb" % block, headers={"Prefer": "wait=%d" % given.wait})
                answer = server.connection.getresponse()
                answer.read()
                waited.append(time.monotonic() - looked)
                print("tile %d/%d/%d: %d after %.2f s" % (*block, answer.status, waited[-1]), flush=True)
                continue
            status, _ = server.get(dataset + "/tiles/%d/%d/%d.glb" % block)
            if status != 200 or is_done(manifest(), block):
                print("block %d/%d/%d has no tile, or is done already" % block)
                continue
            until(lambda: is_done(manifest(), block))
            print("block %d/%d/%d: final tiles after %.1f s" % (*block, time.monotonic() - looked))
        if waited:
            print("median %.2f s, most %.2f s" % (sorted(waited)[len(waited) // 2], max(waited)))
        begun = time.monotonic()
        server.connection.request("PATCH", dataset + "?build=full")
        server.connection.getresponse().read()
        until(lambda: server.json(dataset)["state"] == "ready")
        print("the rest, by build=full, after %.1f s" % (time.monotonic() - begun))
        server.process.terminate()
        server.process.wait()


if __name__ == "__main__":
    main()
