#!/usr/bin/env python3
"""What it costs that a .glb is made from the stored .drc.

  glb.py BUILD DEM [--error METRES]

Processor time of a build on one thread, size of its store, and over one connection to a server with the same dataset: how long each .glb
takes when it is asked for the first time, and when it is asked for again."""
import argparse
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from first_tile import Server, dataset_of, tiles_of  # noqa: E402


def build(program, raster, error, store):
    """Processor seconds of a build of the raster into a store."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([program, "build", raster, "-o", store, "--error", str(error), "--threads", "1", "--device", "cpu"], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def milliseconds(server, paths):
    times = []
    for path in paths:
        start = time.monotonic()
        status, _ = server.ask("GET", path)
        times.append(1000 * (time.monotonic() - start))
        if status != 200:
            sys.exit(f"{path}: {status}")
    return times


def line(name, times):
    times = sorted(times)
    print(f"| {name} | {len(times)} | {statistics.median(times):.2f} | {times[int(0.9 * (len(times) - 1))]:.2f} | {times[-1]:.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("dem")
    parser.add_argument("--error", type=float, default=5)
    options = parser.parse_args()
    folder = tempfile.mkdtemp(prefix="cordillera-glb-")
    try:
        store = os.path.join(folder, "dem.sqlite")
        seconds = build(os.path.join(options.build, "bin", "cordillera"), options.dem, options.error, store)
        print(f"build on one thread: {seconds:.2f} CPU s; store {os.path.getsize(store) / 1e6:.2f} MB")
        server = Server(options.build, os.path.join(folder, "data"))
        try:
            tiles = tiles_of(server, dataset_of(server, options.dem, options.error)[0] + "/tileset-explicit.json")
            print("| asked for | tiles | median ms | 90 % ms | longest ms |\n|---|--:|--:|--:|--:|")
            line("`.glb` first", milliseconds(server, tiles))
            line("`.glb` again", milliseconds(server, tiles))
        finally:
            server.process.terminate()
            server.process.wait()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
