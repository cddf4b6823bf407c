#!/usr/bin/env python3
"""Start-up, list and lookup with very many datasets, or with very many tiles in one.

    many.py PROGRAM [--datasets 10000] [--rows 10000000] [--folder PLACE]

Posts one small raster to a server, copies what became of it so many times into the data folder, or fills its tables with so many tiles, and asks a server
that is started on that. Prints times in milliseconds. Needs 120 kB of disk for each dataset, 400 bytes for each tile.
"""
import argparse
import hashlib
import http.client
import json
import multiprocessing
import os
import random
import shutil
import sqlite3
import struct
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "crash"))
from client import Server, cone  # noqa: E402


def first_dataset(program, folder):
    """The id of a small dataset that a server made in the folder."""
    server = Server(program, folder)
    status, _, body = server.ask("POST", "/v1/datasets?name=cone.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=5", cone(), {"Prefer": "wait=60"})
    assert status == 201, body
    server.stop()
    return json.loads(body)["id"]


def make_datasets(data, model, count):
    registry = sqlite3.connect(os.path.join(data, "registry.sqlite"))
    columns = [row[1] for row in registry.execute("PRAGMA table_info(datasets)") if row[1] not in ("number", "id", "name", "idempotency_key")]
    names = ", ".join(columns)
    for k in range(1, count):
        name = "cone-%08d" % k
        folder = os.path.join(data, "datasets", name)
        shutil.copytree(os.path.join(data, "datasets", model), folder)
        with open(os.path.join(folder, "dataset.json"), "r+") as file:
            record = dict(json.load(file), id=name, name=name)
            file.seek(0)
            json.dump(record, file)
            file.truncate()
        registry.execute("INSERT INTO datasets (id, name, %s) SELECT ?, ?, %s FROM datasets WHERE id = ?" % (names, names), (name, name, model))
    registry.commit()
    registry.close()


def row_sum(*values):
    """As pipeline/store/sqlite.cpp has it: rows that are not as they were written are refused."""
    row = b""
    for value in values:
        if value is None:
            row += b"\x05" + struct.pack("<Q", 0)
        elif isinstance(value, int):
            row += b"\x01" + struct.pack("<q", value)
        elif isinstance(value, float):
            row += b"\x02" + struct.pack("<d", value + 0.0)
        else:
            row += (b"\x03" if isinstance(value, str) else b"\x04")
            value = value.encode() if isinstance(value, str) else value
            row += struct.pack("<Q", len(value)) + value
    return struct.unpack("<q", hashlib.sha256(row).digest()[:8])[0]


LEVEL = 14  # 4096 x 2560 tiles of it are ten million


def make_rows(store, count):
    """Tiles of a level below the data, all with the bytes of one."""
    database = sqlite3.connect(store)
    database.executescript("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA cache_size = -400000")
    across = 4096
    database.create_function("row_sum", -1, row_sum, deterministic=True)
    box = "error, west, south, east, north, low, high"
    for table, columns, summed in (("tiles", "record, drc, glb, " + box, "record, drc, glb"), ("nodes", box, box)):
        database.execute("WITH RECURSIVE k(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM k WHERE n + 1 < %d) "
                         "INSERT INTO %s (level, y, x, %s, sum) SELECT %d, n / %d, n %% %d, %s, row_sum(%d, n / %d, n %% %d, %s) "
                         "FROM k, (SELECT * FROM %s ORDER BY level DESC LIMIT 1)" %
                         (count, table, columns, LEVEL, across, across, columns, LEVEL, across, across, summed, table))
    database.commit()
    database.close()


def processor_ms(pid):
    """Of the server so far. Unlike the time that passes it hardly depends on what else the machine does."""
    with open("/proc/%d/stat" % pid) as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return 1000 * (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Asking:
    """One connection that is kept."""

    def __init__(self, port, pid):
        self.pid = pid
        self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=600)

    def ask(self, path):
        """Milliseconds and body."""
        start = time.perf_counter()
        self.connection.request("GET", path)
        answer = self.connection.getresponse()
        body = answer.read()
        assert answer.status == 200, (path, answer.status, body[:300])
        return 1000 * (time.perf_counter() - start), body

    def told(self, what, paths):
        before = processor_ms(self.pid)
        times = sorted(self.ask(path)[0] for path in paths)
        used = (processor_ms(self.pid) - before) / len(times)
        print("%-34s %6d  p50 %8.2f  p99 %8.2f  most %8.2f ms  processor %8.2f ms each" %
              (what, len(times), times[len(times) // 2], times[int(len(times) * 0.99)], times[-1], used), flush=True)


CROWD = 8  # clients
CROWD_PATHS = ("/v1/datasets", "/nosuchfile", "/v1/datasets?limit=1000", "/assets/none.js", "/v1/datasets?q=cone-00009", "/v1/datasets?bbox=9,45,11,47", "/")


def ask_all_the_time(port, ending, answers):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=600)
    count = 0
    while not ending.is_set():
        connection.request("GET", CROWD_PATHS[count % len(CROWD_PATHS)])
        connection.getresponse().read()
        count += 1
    with answers.get_lock():
        answers.value += count


def crowd(port, ending, answers):
    threads = [threading.Thread(target=ask_all_the_time, args=(port, ending, answers)) for _ in range(CROWD)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


class Crowd:
    """Others who ask for lists and for pages that do not exist, in a process of their own, as long as it lasts."""

    def __init__(self, port):
        self.ending, self.answers = multiprocessing.Event(), multiprocessing.Value("q", 0)
        self.process = multiprocessing.Process(target=crowd, args=(port, self.ending, self.answers))

    def __enter__(self):
        self.start = time.perf_counter()
        self.process.start()

    def __exit__(self, *unused):
        self.ending.set()
        self.process.join()
        print("%-34s %40.0f answers a second" % ("%d others were given" % CROWD, self.answers.value / (time.perf_counter() - self.start)), flush=True)


def follow(asking, path):
    """All pages of a list: how many, how many datasets, milliseconds."""
    pages, datasets, spent = 0, 0, 0.0
    while path:
        took, body = asking.ask(path)
        page = json.loads(body)
        pages, datasets, spent = pages + 1, datasets + len(page["datasets"]), spent + took
        path = page["next"]
    print("%-34s %6d  datasets in %d pages, %.0f ms" % ("all of the list", datasets, pages, spent), flush=True)


def memory_mib(pid):
    with open("/proc/%d/status" % pid) as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS")) / 1024


def started(program, folder):
    start = time.perf_counter()
    server = Server(program, folder)
    assert server.started(), "the server does not start"
    print("%-34s %40.0f ms  processor %8.0f ms" % ("start until it listens", 1000 * (time.perf_counter() - start), processor_ms(server.process.pid)), flush=True)
    return server, Asking(server.port, server.process.pid)


def tile_path(data, model):
    row = sqlite3.connect("file:%s?immutable=1" % os.path.join(data, "datasets", model, "dataset.sqlite"), uri=True).execute(
        "SELECT level, x, y FROM tiles ORDER BY level DESC LIMIT 1").fetchone()
    return "tiles/%d/%d/%d.drc" % row


def many_datasets(program, folder, count):
    model = first_dataset(program, folder)
    data = os.path.join(folder, "data")
    make_datasets(data, model, count)
    tile = tile_path(data, model)
    names = ["cone-%08d" % random.randrange(1, count) for _ in range(2000)]
    server, asking = started(program, folder)
    asking.told("a dataset's status", ["/v1/datasets/" + n for n in names[:1000]])
    asking.told("a tile, any dataset", ["/v1/datasets/%s/%s" % (n, tile) for n in names])
    asking.told("a tile, one of 50 datasets", ["/v1/datasets/%s/%s" % (n, tile) for n in (names[:50] * 40)])
    asking.told("the list, first time", ["/v1/datasets"])
    asking.told("the list", ["/v1/datasets"] * 100)
    asking.told("a page of 1,000", ["/v1/datasets?limit=1000"] * 20)
    asking.told("a search that finds nothing", ["/v1/datasets?q=nobody"] * 20)
    asking.told("a box that none touches", ["/v1/datasets?bbox=100,0,101,1"] * 20)
    follow(asking, "datasets?limit=1000")
    with Crowd(server.port):
        asking.told("a tile, 50 datasets, a crowd asks", ["/v1/datasets/%s/%s" % (n, tile) for n in (names[:50] * 60)])
    asking.told("/metrics", ["/metrics"] * 20)
    print("%-34s %40.1f MiB" % ("memory then", memory_mib(server.process.pid)))
    server.stop()


def many_rows(program, folder, count):
    model = first_dataset(program, folder)
    data = os.path.join(folder, "data")
    make_rows(os.path.join(data, "datasets", model, "dataset.sqlite"), count)
    server, asking = started(program, folder)
    base = "/v1/datasets/%s/" % model
    asking.told("the first answer", [base + "manifest.json"])
    places = [divmod(random.randrange(count), 4096) for _ in range(3000)]
    asking.told("a tile", [base + "tiles/%d/%d/%d.drc" % (LEVEL, x, y) for y, x in places])
    asking.told("a tile again", [base + "tiles/%d/%d/%d.drc" % (LEVEL, x, y) for y, x in places])
    print("%-34s %40.1f MiB" % ("memory then", memory_mib(server.process.pid)))
    server.stop()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--datasets", type=int, default=0)
    parser.add_argument("--rows", type=int, default=0)
    parser.add_argument("--folder", help="where the data folders are made; default: the system's place for temporary files")
    words = parser.parse_args()
    program = os.path.abspath(words.program)
    random.seed(1)
    for count, measure in ((words.datasets, many_datasets), (words.rows, many_rows)):
        if count > 0:
            with tempfile.TemporaryDirectory(prefix="cordillera-many-", dir=words.folder) as folder:
                measure(program, folder, count)
    return 0


if __name__ == "__main__":
    sys.exit(main())
