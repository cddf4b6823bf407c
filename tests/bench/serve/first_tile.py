#!/usr/bin/env python3
"""From a POST to tiles: how long somebody waits.

  first_tile.py BUILD DEM... [--error METRES]

For each raster, in seconds from the first byte of the POST: sent (the server has answered 202), tiles (the first tile could be fetched:
the dataset is ready, all levels at once), whole (every .glb that the explicit tileset names was fetched, one after another, over one
connection)."""
import argparse
import http.client
import json
import os
import posixpath
import shutil
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
import processes  # noqa: E402


class Server:
    def __init__(self, build, folder):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.process = processes.start([os.path.join(build, "bin", "cordillera"), "serve", "--listen", f"127.0.0.1:{self.port}", "--data", folder],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while not self.answers():
            if self.process.poll() is not None:
                sys.exit("the server ended")
            time.sleep(0.05)
        self.connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=3600)

    def answers(self):
        try:
            socket.create_connection(("127.0.0.1", self.port)).close()
            return True
        except OSError:
            return False

    def ask(self, method, path, body=None, headers=None):
        self.connection.request(method, path, body=body, headers=headers or {})
        answer = self.connection.getresponse()
        return answer.status, answer.read()


def tiles_of(server, tileset):
    """Addresses of all tiles that an explicit tileset names, with those of the tilesets that it names."""
    folder, found = posixpath.dirname(tileset), []
    waiting = [json.loads(server.ask("GET", tileset)[1])["root"]]
    while waiting:
        tile = waiting.pop()
        waiting += tile.get("children", [])
        if "content" not in tile:
            continue
        uri = posixpath.normpath(posixpath.join(folder, tile["content"]["uri"]))
        found += tiles_of(server, uri) if uri.endswith(".json") else [uri]
    return found


def dataset_of(server, path, error):
    """Posts a raster and waits for its tiles. The dataset's address, when the POST began, and the seconds until it was answered."""
    start = time.monotonic()
    with open(path, "rb") as body:
        status, answer = server.ask("POST", f"/v1/datasets?name={os.path.basename(path)}{f'&error={error}' if error else ''}", body,
                                    {"Content-Length": str(os.path.getsize(path)), "Content-Type": "application/octet-stream"})
    sent = time.monotonic() - start
    if status != 202:
        sys.exit(f"{path}: {status} {answer.decode()}")
    base = f"/v1/datasets/{json.loads(answer)['id']}"
    while json.loads(server.ask("GET", base)[1])["state"] in ("queued", "running"):
        time.sleep(0.05)
    return base, start, sent


def measure(server, path, error):
    size = os.path.getsize(path)
    base, start, sent = dataset_of(server, path, error)
    tiles = tiles_of(server, base + "/tileset-explicit.json")
    status, _ = server.ask("GET", tiles[0])
    first = time.monotonic() - start
    fetched = sum(len(server.ask("GET", tile)[1]) for tile in tiles)
    if status != 200:
        sys.exit(f"{tiles[0]}: {status}")
    return {"MB": size / 1e6, "sent": sent, "tiles": first, "whole": time.monotonic() - start, "count": len(tiles), "fetched": fetched / 1e6}


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("build")
    arguments.add_argument("dems", nargs="+")
    arguments.add_argument("--error")
    given = arguments.parse_args()
    folder = tempfile.mkdtemp()
    server = Server(given.build, os.path.join(folder, "data"))
    try:
        print("| raster | MB | sent s | first tile s | whole tileset s | .glb | MB |\n|---|--:|--:|--:|--:|--:|--:|")
        for path in given.dems:
            f = measure(server, path, given.error)
            print(f"| {os.path.basename(path)} | {f['MB']:.1f} | {f['sent']:.2f} | {f['tiles']:.1f} | {f['whole']:.1f} | {f['count']} | {f['fetched']:.1f} |", flush=True)
    finally:
        server.process.terminate()
        server.process.wait()
        shutil.rmtree(folder)
    print(f"\n{time.strftime('%Y-%m-%d')}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.0f}")


if __name__ == "__main__":
    main()
