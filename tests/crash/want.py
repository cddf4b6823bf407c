#!/usr/bin/env python3
"""A disk that is really full, and a machine without memory:  want.py PROGRAM

The data folder lies on a small tmpfs in a mount namespace of its own (unshare); where that is not permitted it says so and exits with 77.
"""
import json
import os
import resource
import signal
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from client import PATIENCE_S, Gone, Server, cone  # noqa: E402
import processes  # noqa: E402

OPTIONS = "crs=EPSG:4326&vertical_datum=ellipsoid&error=5"
DISK_MIB = 24
ALL = "CORDILLERA_ALL_TESTS" in os.environ  # else every third amount of memory that a job may have, and three in five of the server's


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
    waits = second is None  # until its build has met the full disk, and waits for room
    while True:
        expect(server.ask("GET", "/healthz")[0] == 200, "the server is not well")
        expect(server.ask("GET", tile)[2] == before[2], "a tile changed")
        if waits:
            break
        status, _, body = server.ask("GET", "/v1/datasets/" + second)
        waits = json.loads(body)["state"] == "ready" or "error" in json.loads(body)
        time.sleep(0.02)
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
    """ready or the slug of its problem; otherwise what was answered instead, for as long as one has patience."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        status, body = asked(server, "GET", "/v1/datasets/" + dataset)
        state = json.loads(body) if status == 200 else {}
        if state.get("state") == "failed":
            return slug(json.dumps(state["error"]))
        if state.get("state") == "ready":
            return "ready"
        expect(server.process.poll() is None, "the server ended with %s" % server.process.returncode)
        time.sleep(0.1)
    if status == 503 and slug(body) == "service-busy":
        return "service-busy"  # hardly more than it started with: it says so, and that it needs more
    return "no end: %d %s" % (status, body[:300])


def starved_server(program, folder, mib):
    return Server(program, folder, limits=lambda: resource.setrlimit(resource.RLIMIT_AS, (mib << 20, mib << 20)))


def least_mib(program):
    """With how many MiB of addresses a server starts: how many its libraries take differs from machine to machine."""
    low, high = 32, 4096
    while high - low > 1:
        middle = (low + high) // 2
        with processes.folder("cordillera-want-") as folder:
            starts = starved_server(program, folder, middle).started()
            with open(os.path.join(folder, "log"), errors="replace") as log:
                said = log.read()
            expect("should not have happened" not in said, "with %d MiB the server says %s" % (middle, said))
            low, high = (low, middle) if starts else (middle, high)
    return high


def starved(program, folder, mib):
    """Server and jobs may have so many addresses. Whatever a build comes to, the service answers, and says what it was; or that it has hardly
    any memory left, where threads that a raster needed have taken the last of it."""
    server = starved_server(program, folder, mib)
    if not server.started():
        expect(server.process.returncode in (1, 127), "with %d MiB the server ended with %s" % (mib, server.process.returncode))
        return "no start, exit code %d" % server.process.returncode  # 127: the loader says so
    status, body = asked(server, "POST", "/v1/datasets?%s&name=a.asc" % OPTIONS, cone(700))
    outcome = "answered with %d" % status if status else "the connection was left"
    if status == 202:
        outcome = outcome_of(server, json.loads(body)["id"])
        expect(outcome in ("ready", "memory-limit", "job-crashed", "service-busy"), "with %d MiB a build came to %s" % (mib, outcome))
    else:
        expect(status == 0 or status >= 500, "with %d MiB a raster was answered with %d %s" % (mib, status, body))
    well = [asked(server, "GET", "/healthz") for _ in range(20)]
    states = [state for state, _ in well]
    says_so = outcome != "ready" and all(state == 503 and slug(body) == "service-busy" for state, body in well)
    expect(server.process.poll() is None, "with %d MiB the server ended with %s" % (mib, server.process.returncode))
    expect(200 in states or says_so, "with %d MiB the server is not well: %s" % (mib, states))
    expect(server.stop() == 0, "with %d MiB the server did not end by itself" % mib)
    return outcome


def starved_job(program, folder, raster, mib):
    """A job alone, with so few addresses: what it says of its end, or its exit code."""
    with open(os.path.join(folder, "a.asc"), "wb") as file:
        file.write(raster)
    options = {"crs": "EPSG:4326", "vertical_datum": "ellipsoid", "error": 5, "threads": 2, "device": "cpu"}
    with open(os.path.join(folder, "job.json"), "w") as file:
        json.dump({"id": "a", "name": "a.asc", "raster": "a.asc", "options": options, "max_seconds": PATIENCE_S}, file)

    def limits():
        os.dup2(says, 3)
        resource.setrlimit(resource.RLIMIT_AS, (mib << 20, mib << 20))

    hears, says = os.pipe()
    job = processes.start([program, "job", folder], limits=limits, close_fds=False, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL)
    os.close(says)
    with open(hears, "rb") as report:
        problems = [json.loads(line)["error"] for line in report.read().splitlines() if b'"error"' in line]
    job.wait()
    return problems[-1]["type"] if problems else job.returncode


def starved_jobs(program):
    """From so few addresses that the program cannot be loaded to enough: a job succeeds, says memory-limit, or cannot even say so."""
    raster, outcomes = cone(120), {}
    for mib in range(128, 1024, 3 if ALL else 9):
        with processes.folder("cordillera-want-") as folder:
            outcome = starved_job(program, folder, raster, mib)
        outcomes.setdefault(outcome, []).append(mib)
        # libnuma, which comes with GDAL, ends a process with 1 where it is loaded and finds no memory.
        unloaded = outcome == 1 and not outcomes.keys() & {0, "memory-limit"}
        expect(outcome in (0, "memory-limit") or unloaded or outcome in (127, -signal.SIGABRT, -signal.SIGSEGV) and 0 not in outcomes,
               "with %d MiB a job came to %s" % (mib, outcome))
        if len(outcomes.get(0, [])) == (12 if ALL else 4):
            break
    expect("memory-limit" in outcomes and 0 in outcomes, "jobs came to %s" % outcomes)
    print("jobs alone: " + "; ".join("%s from %d to %d MiB" % (what, min(at), max(at)) for what, at in outcomes.items()))


def main():
    program = os.path.abspath(sys.argv[1])
    if len(sys.argv) < 3:
        inner = [sys.executable, "-B", os.path.abspath(__file__), program, "inside"]
        if subprocess.run(["unshare", "-Urm", "true"], capture_output=True).returncode != 0:
            print("want: mount namespaces are not permitted here")
            return 77
        os.execvp("unshare", ["unshare", "-Urm", *inner])
    with processes.folder("cordillera-want-") as folder:
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=%dm" % DISK_MIB, "none", folder]).returncode != 0:
            return 77
        try:
            full_disk(program, folder)
        finally:
            subprocess.run(["umount", "-l", folder])
    starved_jobs(program)
    least = least_mib(program)
    # No library is loaded, no thread starts; it lives, and has not the memory for a raster; answers that meet the last of it in the middle of a
    # document (14 to 23: from machine to machine); a build; the allocator takes two heaps of 64 MiB.
    for more in (-60, -6, 6, 14, 17, 19, 20, 21, 22, 23, 40, 64, 107, 127, 130) if ALL else (-6, 6, 14, 17, 20, 23, 40, 107, 130):
        with processes.folder("cordillera-want-") as folder:
            print("%5d MiB of addresses: %s" % (least + more, starved(program, folder, least + more)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
