#!/usr/bin/env python3
"""A disk that is really full, and a machine without memory:  want.py PROGRAM

The data folder lies on a small tmpfs in a mount namespace of its own (unshare); where that is not permitted it says so and exits with 77.
"""
import json
import os
import resource
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from client import Gone, Server, cone  # noqa: E402

OPTIONS = "crs=EPSG:4326&vertical_datum=ellipsoid&error=5"
DISK_MIB = 24


def expect(holds, what):
    if not holds:
        print("want: " + what)
        sys.exit(1)


def slug(body):
    return json.loads(body)["type"].rsplit(":", 1)[1]


def a_tile(server, dataset):
    """Path of a tile of the dataset."""
    status, _, body = server.ask("GET", "/v1/datasets/%s/manifest.json" % dataset)
    expect(status == 200, "the manifest is answered with %d" % status)
    bounds, level = json.loads(body)["bounds"], json.loads(body)["max_level"]
    per_degree = 2 ** level / 180
    x, y = int(((bounds[0] + bounds[2]) / 2 + 180) * per_degree), int(((bounds[1] + bounds[3]) / 2 + 90) * per_degree)
    return "/v1/datasets/%s/tiles/%d/%d/%d.drc" % (dataset, level, x, y)


def fill(folder, left_kib):
    """Writes until so much is left."""
    space = os.statvfs(folder)
    try:
        with open(os.path.join(folder, "filler"), "ab") as file:
            file.write(b"x" * max(0, space.f_bavail * space.f_frsize - (left_kib << 10)))
    except OSError:
        pass  # a build was quicker: the disk is full all the same


def full_disk(program, folder):
    server = Server(program, folder, options=["--min-disk-free", "0"])
    expect(server.started(), "the server does not start")
    status, _, body = server.ask("POST", "/v1/datasets?%s&name=first.asc" % OPTIONS, cone(), {"Prefer": "wait=120"})
    expect(status == 201, "the first raster was answered with %d %s" % (status, body))
    tile = a_tile(server, json.loads(body)["id"])
    before = server.ask("GET", tile)
    expect(before[0] == 200, "its tile was answered with %d" % before[0])
    fill(folder, 300)
    status, _, body = server.ask("POST", "/v1/datasets?%s&name=large.asc" % OPTIONS, cone(400))
    expect((status, slug(body)) == (507, "storage-full"), "a raster without room was answered with %d %s" % (status, body))
    expect(os.listdir(os.path.join(server.data, "incoming")) == [], "half a raster is kept")
    status, _, body = server.ask("POST", "/v1/datasets?%s&name=second.asc" % OPTIONS, cone(48, 1500))
    expect(status in (202, 507), "a small raster was answered with %d %s" % (status, body))
    second = json.loads(body).get("id")
    fill(folder, 0)
    end = time.monotonic() + 3
    while time.monotonic() < end:
        expect(server.ask("GET", "/healthz")[0] == 200, "the server is not well")
        expect(server.ask("GET", tile)[2] == before[2], "a tile changed")
    expect(second is None or server.state(second) != "failed", "an accepted raster failed for want of room")
    os.remove(os.path.join(folder, "filler"))
    if second:
        expect(server.wait(second) == "ready", "an accepted raster is not built when there is room again")
    status, _, body = server.ask("POST", "/v1/datasets?%s&name=third.asc" % OPTIONS, cone(), {"Prefer": "wait=120"})
    expect(status == 201, "when there is room again a raster is answered with %d %s" % (status, body))
    expect(server.stop() == 0, "the server did not end by itself")
    checked = subprocess.run([program, "check", server.data], capture_output=True, text=True)
    expect(checked.returncode == 0, "check: " + checked.stdout + checked.stderr)


def asked(server, method, path, body=None):
    """Status and body; 0 where the connection was left, which is an answer too for want of memory."""
    try:
        status, _, answer = server.ask(method, path, body)
        return status, answer
    except Gone:
        return 0, b""


def outcome_of(server, dataset):
    """ready, the slug of its problem, or None where it never came to an end."""
    end = time.monotonic() + 120
    while time.monotonic() < end:
        status, body = asked(server, "GET", "/v1/datasets/" + dataset)
        state = json.loads(body) if status == 200 else {}
        if state.get("state") == "failed":
            return slug(json.dumps(state["error"]))
        if state.get("state") == "ready":
            return "ready"
        expect(server.process.poll() is None, "the server ended with %s" % server.process.returncode)
        time.sleep(0.1)
    return None


def starved(program, folder, mib):
    """Server and jobs may have so many addresses. Whatever a build comes to, the service answers, and says what it was."""
    server = Server(program, folder, limits=lambda: resource.setrlimit(resource.RLIMIT_AS, (mib << 20, mib << 20)))
    if not server.started():
        expect(server.process.returncode in (1, 127), "with %d MiB the server ended with %s" % (mib, server.process.returncode))
        return "no start, exit code %d" % server.process.returncode  # 127: the loader says so
    status, body = asked(server, "POST", "/v1/datasets?%s&name=a.asc" % OPTIONS, cone(700))
    outcome = "answered with %d" % status if status else "the connection was left"
    if status == 202:
        outcome = outcome_of(server, json.loads(body)["id"])
        expect(outcome in ("ready", "memory-limit", "job-crashed"), "with %d MiB a build came to %s" % (mib, outcome))
    else:
        expect(status == 0 or status >= 500, "with %d MiB a raster was answered with %d %s" % (mib, status, body))
    well = [asked(server, "GET", "/healthz")[0] for _ in range(20)]
    expect(server.process.poll() is None and 200 in well, "with %d MiB the server is not well: %s" % (mib, well))
    expect(server.stop() == 0, "with %d MiB the server did not end by itself" % mib)
    return outcome


def main():
    program = os.path.abspath(sys.argv[1])
    if len(sys.argv) < 3:
        inner = [sys.executable, "-B", os.path.abspath(__file__), program, "inside"]
        if subprocess.run(["unshare", "-Urm", "true"], capture_output=True).returncode != 0:
            print("want: mount namespaces are not permitted here")
            return 77
        return subprocess.run(["unshare", "-Urm", *inner]).returncode
    with tempfile.TemporaryDirectory(prefix="cordillera-want-") as folder:
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=%dm" % DISK_MIB, "none", folder]).returncode != 0:
            return 77
        try:
            full_disk(program, folder)
        finally:
            subprocess.run(["umount", "-l", folder])
    for mib in (128, 192, 240, 320):  # between 192 and 240 the server lives, but has not the memory for an answer
        with tempfile.TemporaryDirectory(prefix="cordillera-want-") as folder:
            print("%5d MiB of addresses: %s" % (mib, starved(program, folder, mib)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
