"""Finding 12: what the service keeps of datasets is bounded, SQLite's page caches included, and goes with them."""
import http.client
import json
import math
import os
import sqlite3
import sys
import threading

from attack import PATIENCE_S, case, eventually
from cases.slow_readers import MIB, given_back, resident
from client import noise

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bench", "many"))
import many  # noqa: E402

LARGE = 64          # datasets, as many as are held open, of some 12 MiB each: without a bound they would take 800
BOUND = 512 * MIB   # what is said
BESIDE = 128 * MIB  # what the heap takes for pieces, and gives back every ten seconds


def posted(server, side):
    """A dataset of which nothing can be left out."""
    path = "/v1/datasets?name=a.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=1&strategy=cleap&pixels=lattice"
    status, _, body = server.ask("POST", path, noise(side))
    assert status == 202, body
    dataset = json.loads(body)["id"]
    assert server.wait(dataset) == "ready"
    return dataset


def tiles_of(server, dataset, *kinds):
    store = os.path.join(server.data, "datasets", dataset, "dataset.sqlite")
    with sqlite3.connect("file:%s?immutable=1" % store, uri=True) as database:
        rows = database.execute("SELECT level, x, y FROM tiles").fetchall()
    database.close()
    return ["tiles/%d/%d/%d.%s" % (z, x, y, kind) for z, x, y in rows for kind in kinds]


def read_all(server, datasets, paths):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE_S)
    for dataset in datasets:
        for path in paths:
            connection.request("GET", "/v1/datasets/%s/%s" % (dataset, path), headers={"Accept-Encoding": "gzip"})
            answer = connection.getresponse()
            answer.read()
            assert answer.status in (200, 204), (path, answer.status)
    connection.close()


@case("12 all tiles of 64 datasets of 12 MiB; then they are deleted", minutes=True,
      expect="MiB above the start: 300 to 640, after < 64", holds=lambda seen: 300 < seen[0] <= (BOUND + BESIDE) // MIB and seen[1] < 64)
def kept(attack):
    server = attack.start(folder="kept")
    model = posted(server, 801)
    server.stop()
    many.make_datasets(server.data, model, LARGE)
    datasets, paths = [model] + ["cone-%08d" % k for k in range(1, LARGE)], tiles_of(server, model, "drc")
    server = attack.start(folder="kept")
    server.ask("GET", "/v1/datasets")
    start = resident(server)
    # All at the same dataset, so that each of its connections to its store has pages.
    readers = [threading.Thread(target=read_all, args=(server, datasets, paths[k::4])) for k in range(4)]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()
    eventually(lambda: resident(server) <= start + BOUND + BESIDE, 0.1)
    held = resident(server)
    for dataset in datasets:
        assert server.ask("DELETE", "/v1/datasets/" + dataset)[0] == 204
    return (held - start) // MIB, given_back(server, start)


def contours(level, longitude=10.06, latitude=46.06):
    """A vector tile in the middle of the noise, which is sent compressed."""
    row = (1 - math.log(math.tan(math.radians(latitude)) + 1 / math.cos(math.radians(latitude))) / math.pi) / 2
    return "contours/%d/%d/%d.mvt" % (level, int((longitude + 180) / 360 * 2 ** level), int(row * 2 ** level))


def in_memory(server, marks):
    """How many of these stand anywhere in the memory of the process that is no file's."""
    found = set()
    with open("/proc/%d/maps" % server.process.pid) as maps, open("/proc/%d/mem" % server.process.pid, "rb", buffering=0) as memory:
        for line in maps:
            words = line.split()
            if "r" not in words[1] or len(words) > 5 and words[5] != "[heap]":
                continue
            first, _, end = words[0].partition("-")
            memory.seek(int(first, 16))
            try:
                piece = memory.read(int(end, 16) - int(first, 16))
            except OSError:
                continue  # it has gone meanwhile
            found |= {mark for mark in marks if mark in piece}
    return len(found)


@case("12 what was compressed of a dataset goes with it", expect="3 of 3 in memory, then 0 of 3", minutes=True)
def compressed(attack):
    server = attack.start()
    dataset = posted(server, 301)
    marks = []
    for level, coding in ((10, "gzip"), (11, "gzip"), (11, "br")):
        status, headers, body = server.ask("GET", "/v1/datasets/%s/%s" % (dataset, contours(level)), headers={"Accept-Encoding": coding})
        assert status == 200 and headers["content-encoding"] == coding and len(body) > 3 * 4096, (status, headers, len(body))
        marks.append(body[len(body) // 2:len(body) // 2 + 64])
    before = in_memory(server, marks)
    # Freed memory stays as it is until the heap gives it back, which it does where there is much of it.
    read_all(server, [dataset], tiles_of(server, dataset, "drc", "glb"))
    assert server.ask("DELETE", "/v1/datasets/" + dataset)[0] == 204
    eventually(lambda: in_memory(server, marks) == 0, 0.5)
    return "%d of 3 in memory, then %d of 3" % (before, in_memory(server, marks))
