"""Findings 6 and 16: the share of the disk that stays free, whatever way bytes come and whatever jobs make of them. The disk is a small one in memory, seen by its server alone."""
import ctypes
import gzip
import io
import json
import os
import subprocess
import threading
import time
import zipfile

from attack import PATIENCE_S, case, connect
from client import cone, noise

MIB = 1 << 20
NEW_USER, NEW_MOUNTS = 0x10000000, 0x00020000
UNSHARE = ["unshare", "--user", "--map-root-user", "--mount"]


def can_mount():
    return subprocess.run(UNSHARE + ["mount", "-t", "tmpfs", "none", "/mnt"], capture_output=True, check=False).returncode == 0


def small_disk(folder, mebibytes):
    """To be called in the server's process before the program: its data folder is a disk of its own."""

    def mount():
        libc = ctypes.CDLL(None, use_errno=True)
        user, group = os.geteuid(), os.getegid()
        if libc.unshare(NEW_USER | NEW_MOUNTS) != 0:
            raise OSError(ctypes.get_errno(), "unshare")
        for name, text in (("setgroups", "deny"), ("uid_map", "0 %d 1" % user), ("gid_map", "0 %d 1" % group)):
            with open("/proc/self/" + name, "w") as file:
                file.write(text)
        if libc.mount(b"none", folder.encode(), b"tmpfs", 0, b"size=%dm" % mebibytes) != 0:
            raise OSError(ctypes.get_errno(), "mount")

    return mount


def start(attack, mebibytes, options=()):
    folder = os.path.join(attack.next_folder(), "data")
    os.makedirs(folder, exist_ok=True)
    return attack.start(options, limits=small_disk(folder, mebibytes))


def fill(folder):
    """To the last byte: a file as long as there is room."""
    with open(os.path.join(folder, "filler"), "wb", buffering=0) as filler:
        for piece in (MIB, 4096, 512, 1):
            try:
                while True:
                    filler.write(b"x" * piece)
            except OSError:
                pass


def free(server):
    """Share of the disk that is free, in percent."""
    found = os.statvfs("/proc/%d/root%s" % (server.process.pid, server.data))
    return 100 * found.f_bavail / found.f_blocks


def chunked(server, head, mebibytes):
    """Sends as much as is taken; the answer's status."""
    piece = b"%x\r\n" % MIB + b"a" * MIB + b"\r\n"
    with connect(server) as client:
        client.settimeout(PATIENCE_S)
        client.sendall(head.encode() + b"Host: localhost\r\nTransfer-Encoding: chunked\r\nConnection: close\r\n\r\n")
        try:
            for _ in range(mebibytes):
                client.sendall(piece)
            client.sendall(b"0\r\n\r\n")
        except OSError:
            pass  # it does not want more
        answer = b""
        try:
            while more := client.recv(65536):
                answer += more
        except ConnectionResetError:
            pass
    return answer.split(b" ")[1].decode() if answer else "-"


def at_once(works):
    seen = [None] * len(works)

    def run(k):
        seen[k] = works[k]()

    threads = [threading.Thread(target=run, args=(k,)) for k in range(len(works))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return seen


def judged(server, statuses):
    ready = server.ask("GET", "/healthz")[0]
    return "%s, %s free, alive %d" % (" ".join(sorted(statuses)), "5 % and more" if free(server) >= 5 else "%.1f %%" % free(server), ready)


def waits_for_room(server, ending, raster, options="&error=50"):
    """What becomes of a raster that the disk has no room for, and how much the disk has at the least until that is known."""
    path = "/v1/datasets?name=dem.%s&crs=EPSG:4326&vertical_datum=ellipsoid&provisional=0%s" % (ending, options)
    status, _, body = server.ask("POST", path, raster)
    if status != 202:
        return str(status)
    dataset, least, end = json.loads(body)["id"], 100, time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        least = min(least, free(server))
        now = json.loads(server.ask("GET", "/v1/datasets/" + dataset)[2])
        problem = (now.get("error") or {}).get("type", "").rsplit(":")[-1]
        if problem or now["state"] == "ready":
            return "%s %s, %s free throughout" % (now["state"], problem, "5 % and more" if least >= 5 else "%.1f %%" % least)
        time.sleep(0.005)
    return now["state"]


if can_mount():
    BOUNDED = "507, 5 % and more free, alive 200"

    # One that is far ahead has room for all of it.
    @case("6 two uploads in parts without a length, together more than the disk", expect="507 " + BOUNDED + ", or 204 for one",
          holds=lambda seen: seen in ("507 " + BOUNDED, "204 " + BOUNDED))
    def tus(attack):
        server = start(attack, 300)
        heads = []
        for _ in range(2):
            status, headers, _ = server.ask("POST", "/v1/uploads", headers={"Upload-Length": str(200 * MIB)})
            assert status == 201
            heads.append("PATCH /v1/%s HTTP/1.1\r\nUpload-Offset: 0\r\nContent-Type: application/offset+octet-stream\r\n" % headers["location"])
        return judged(server, at_once([lambda head=head: chunked(server, head, 200) for head in heads]))

    @case("6 two posts without a length", expect="507 507, 5 % and more free, alive 200")
    def posts(attack):
        server = start(attack, 300)
        head = "POST /v1/datasets?name=dem.tif HTTP/1.1\r\n"
        return judged(server, at_once([lambda: chunked(server, head, 300)] * 2))

    @case("6 what was cut short for want of room can be gone on with", expect="507, then 204 at the offset")
    def go_on(attack):
        server = start(attack, 100)
        location = server.ask("POST", "/v1/uploads", headers={"Upload-Length": str(90 * MIB)})[1]["location"]
        filler = server.ask("POST", "/v1/uploads", headers={"Upload-Length": str(60 * MIB)})[1]["location"]
        typed = {"Content-Type": "application/offset+octet-stream"}
        status = server.ask("PATCH", "/v1/" + filler, b"b" * (60 * MIB), dict(typed, **{"Upload-Offset": "0"}))[0]
        assert status == 204, status
        head = "PATCH /v1/%s HTTP/1.1\r\nUpload-Offset: 0\r\nContent-Type: application/offset+octet-stream\r\n" % location
        first = chunked(server, head, 90)
        server.ask("DELETE", "/v1/" + filler)
        offset = server.ask("HEAD", "/v1/" + location)[1]["upload-offset"]
        status = server.ask("PATCH", "/v1/" + location, b"a" * (90 * MIB - int(offset)), dict(typed, **{"Upload-Offset": offset}))[0]
        return "%s, then %d at the %s" % (first, status, "offset" if int(offset) > MIB else "beginning")
    @case("16 a small archive that unpacks to more than the disk", expect="queued storage-full, 5 % and more free throughout, then 202")
    def archive(attack):
        server, side = start(attack, 40), 2600
        grid = b"ncols %d\nnrows %d\nxllcorner 10\nyllcorner 46\ncellsize 0.0001\nNODATA_value -9999\n" % (side, side) + (b"100.000 " * side + b"\n") * side
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("dem.asc", grid)
        seen = [waits_for_room(server, "zip", packed.getvalue()), waits_for_room(server, "asc.gz", gzip.compress(grid))]
        other = server.ask("POST", "/v1/datasets?name=cone.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=5", cone())[0]
        return "%s, then %d" % (" / ".join(sorted(set(seen))), other)

    @case("16 a build whose tiles are more than the disk", expect="queued storage-full, 5 % and more free throughout")
    def tiles(attack):
        return waits_for_room(start(attack, 4), "asc", noise(400), "&error=1")

    @case("a disk that is full to its last byte: what is deleted makes room", expect="204, then 404 and 200")
    def full(attack):
        server = start(attack, 40, ("--min-disk-free", "0"))
        ids = []
        for name in ("one", "two"):
            posted = server.ask("POST", "/v1/datasets?name=%s.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=5" % name, cone(), {"Prefer": "wait=100"})
            assert posted[0] == 201, posted
            ids.append(json.loads(posted[2])["id"])
        fill("/proc/%d/root%s" % (server.process.pid, server.data))
        for k in range(200):  # until the registry's log has no page left either
            if server.ask("PATCH", "/v1/datasets/" + ids[1], json.dumps({"title": "%d" % k}).encode(), {"Content-Type": "application/json"})[0] != 200:
                break
        fill("/proc/%d/root%s" % (server.process.pid, server.data))
        seen = [str(server.ask("DELETE", "/v1/datasets/" + ids[0])[0])]
        seen += [str(server.ask("GET", "/v1/datasets/" + k)[0]) for k in ids]
        return "%s, then %s and %s" % tuple(seen)
else:
    @case("6 a small disk", expect="skipped: this system gives no user namespace to mount one in")
    def skipped(_attack):
        return "skipped: this system gives no user namespace to mount one in"
