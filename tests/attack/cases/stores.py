"""Finding 8: a disk that gives back other bytes than were written."""
import json
import os
import random
import sqlite3
import subprocess

from attack import case
from client import cone

POST = "/v1/datasets?name=dem.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=2"


def paths_of(store):
    """The addresses of all tiles, and the documents that are made of rows."""
    with sqlite3.connect("file:%s?mode=ro&immutable=1" % store, uri=True) as database:
        rows = database.execute("SELECT level, x, y FROM tiles").fetchall()
    database.close()
    tiles = ["tiles/%d/%d/%d.%s" % (z, x, y, kind) for z, x, y in rows for kind in ("drc", "glb")]
    return tiles + ["manifest.json", "tileset.json", "subtrees/W/0/0/0.subtree", "subtrees/E/0/0/0.subtree"]


def read(server, dataset, paths):
    """Path to status and body."""
    answers = {path: server.ask("GET", "/v1/datasets/%s/%s" % (dataset, path)) for path in paths}
    return {path: (status, body) for path, (status, _, body) in answers.items()}


def published(attack):
    """A server of the case's own with a dataset; its id, its file, and what it serves undamaged."""
    server = attack.start()
    status, _, body = server.ask("POST", POST, cone())
    assert status == 202, body
    dataset = json.loads(body)["id"]
    assert server.wait(dataset) == "ready", server.ask("GET", "/v1/datasets/" + dataset)[2]
    store = os.path.join(server.data, "datasets", dataset, "dataset.sqlite")
    paths = paths_of(store)
    return server, dataset, store, read(server, dataset, paths)


def other_bytes(attack, server, dataset, store, good, damaged):
    """The paths that answer 200 with other bytes, once the file holds these."""
    server.stop()
    with open(store, "wb") as file:
        file.write(damaged)
    again = attack.start(folder=os.path.basename(server.folder))
    seen = read(again, dataset, good)
    return again, [path for path, (status, body) in seen.items() if status == 200 and body != good[path][1]], seen


@case("8 bits flipped, pages emptied: 200 with other bytes", expect="0 of 12 rounds")
def flips(attack):
    server, dataset, store, good = published(attack)
    with open(store, "rb") as file:
        whole = file.read()
    wrong, dice = 0, random.Random(8)
    for number in range(12):
        damaged = bytearray(whole)
        if number % 3 == 2:
            page = 4096 * dice.randrange(1, len(whole) // 4096)
            damaged[page:page + 4096] = bytes(4096)
        else:
            for _ in range(20):
                damaged[dice.randrange(4096, len(whole))] ^= 1 << dice.randrange(8)
        server, others, _ = other_bytes(attack, server, dataset, store, good, bytes(damaged))
        wrong += bool(others)
    return "%d of 12 rounds" % wrong


@case("8 a tile that names its neighbour's bytes, told to the operator", expect="500 store-damaged, 1 in readyz, 1 in metrics")
def neighbour(attack):
    server, dataset, store, _ = published(attack)
    server.stop()
    with sqlite3.connect(store) as database:
        (z, x, y, _), (_, _, _, drc) = database.execute("SELECT level, x, y, drc FROM tiles ORDER BY level DESC, y, x LIMIT 2").fetchall()
        database.execute("UPDATE tiles SET drc = ? WHERE level = ? AND x = ? AND y = ?", (drc, z, x, y))
    database.close()
    again = attack.start(folder=os.path.basename(server.folder))
    status, _, body = again.ask("GET", "/v1/datasets/%s/tiles/%d/%d/%d.drc" % (dataset, z, x, y))
    ready, metrics = json.loads(again.ask("GET", "/readyz")[2]), again.ask("GET", "/metrics")[2].decode()
    told = [line.split()[1] for line in metrics.splitlines() if line.startswith("cordillera_datasets_damaged ")]
    return "%d %s, %s in readyz, %s in metrics" % (status, json.loads(body)["type"].rsplit(":")[-1], ready.get("damaged_datasets"), told[0])


@case("8 cordillera check finds a plan that was changed", expect="sound, then not: meta")
def changed_plan(attack):
    server, dataset, store, _ = published(attack)
    server.stop()

    def check():
        said = subprocess.run([attack.program, "check", server.data], capture_output=True, text=True, check=False)
        return said.returncode, said.stdout + said.stderr

    before, _ = check()
    with sqlite3.connect(store) as database:
        value = bytearray(database.execute("SELECT value FROM meta WHERE key = 'plan'").fetchone()[0])
        value[len(value) // 2] ^= 1
        database.execute("UPDATE meta SET value = ? WHERE key = 'plan'", (bytes(value),))
    database.close()
    after, said = check()
    named = "meta" if dataset in said and ("meta" in said or "plan" in said) else said[-200:]
    return "%s, then %s: %s" % ("sound" if before == 0 else "not", "sound" if after == 0 else "not", named)
