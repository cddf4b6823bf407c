"""Findings 3, 4, 5 and the rest of 10 and 11: rows that are lost, long lists, changes that come too late, what is a token's own, addresses."""
import json
import os
import shutil
import signal
import sqlite3
import subprocess

from attack import case, connect, received, statuses
from client import cone

POST = "/v1/datasets?name=cone.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=5"


def post(server, query="", headers=None):
    status, _, body = server.ask("POST", POST + query, cone(), dict({"Prefer": "wait=120"}, **(headers or {})))
    assert status == 201, body
    return json.loads(body)["id"]


def killed(server):
    server.process.send_signal(signal.SIGKILL)
    server.process.wait()
    return os.path.join(server.data, "registry.sqlite")


def without_log(registry):
    for suffix in ("-wal", "-shm"):
        if os.path.exists(registry + suffix):
            os.remove(registry + suffix)


def stores(server):
    folder = os.path.join(server.data, "datasets")
    return sum(os.path.exists(os.path.join(folder, name, "dataset.sqlite")) for name in os.listdir(folder))


def ready(server):
    return sum(server.state(name) == "ready" for name in os.listdir(os.path.join(server.data, "datasets")))


class Tokens:
    """Two tokens that may write, as headers, and the option that makes a server know them."""

    def __init__(self, attack):
        lines = []
        for who in ("alice", "bob"):
            said = subprocess.run([attack.program, "token", "new", "--name", who, "--role", "write"], check=True, capture_output=True, text=True)
            words = dict(line.split(":", 1) for line in (said.stdout + said.stderr).splitlines() if line.startswith(("token:", "line:")))
            setattr(self, who, {"Authorization": "Bearer " + words["token"].strip()})
            lines.append(words["line"].strip())
        self.options = ("--token-lines", ";".join(lines))


@case("3 an empty registry beside two datasets", expect="refused, 2 stores; adopted, 2 ready")
def empty_registry(attack):
    server = attack.start(folder="empty")
    post(server)
    post(server)
    registry = killed(server)
    without_log(registry)
    open(registry, "w").close()
    try:
        attack.start(folder="empty")
        said = "started"
    except AssertionError as error:
        said = "refused" if "cordillera adopt" in str(error) else "refused without a way out: %s" % error
    said += ", %d stores" % stores(server)
    subprocess.run([attack.program, "adopt", server.data], check=True, capture_output=True)
    return said + "; adopted, %d ready" % ready(attack.start(folder="empty"))


@case("3 another program's registry beside a dataset", expect="refused, 1 store")
def foreign_registry(attack):
    server = attack.start(folder="foreign")
    post(server)
    registry = killed(server)
    without_log(registry)
    os.remove(registry)
    with sqlite3.connect(registry) as database:
        database.execute("CREATE TABLE songs (title TEXT)")
    database.close()
    try:
        attack.start(folder="foreign")
        said = "started"
    except AssertionError as error:
        said = "refused" if "no table of datasets" in str(error) else "refused otherwise: %s" % error
    return said + ", %d store" % stores(server)


@case("3 a folder that is no dataset, without a row", expect="set aside, told; removed by vacuum --orphans alone")
def set_aside(attack):
    server = attack.start(folder="aside")
    killed(server)
    strange, aside = (os.path.join(server.data, place, "nobody") for place in ("datasets", "orphans"))
    os.makedirs(strange)
    with open(os.path.join(strange, "letter.txt"), "w", encoding="utf-8") as file:
        file.write("dear all")
    server = attack.start(folder="aside")
    with open(server.log.name, errors="replace") as log:
        told = "told" if "nobody" in log.read() else "not told"
    killed(server)
    said = "set aside, " + told if os.path.exists(os.path.join(aside, "letter.txt")) else "lost"
    subprocess.run([attack.program, "vacuum", server.data], check=True, capture_output=True)
    kept = os.path.exists(aside)
    subprocess.run([attack.program, "vacuum", "--orphans", server.data], check=True, capture_output=True)
    return said + ("; removed by vacuum --orphans alone" if kept and not os.path.exists(aside) else "; kept" if kept else "; removed too early")


@case("3 a registry without its log", expect="3 of 3")
def lost_log(attack):
    server = attack.start(folder="log")
    for _ in range(3):
        post(server)
    without_log(killed(server))
    return "%d of 3" % ready(attack.start(folder="log"))


@case("3 an older registry put back", expect="3 of 3, private 404")
def older_registry(attack):
    tokens = Tokens(attack)
    server = attack.start(folder="older", options=tokens.options)
    post(server, headers=tokens.alice)
    registry = killed(server)
    shutil.copy(registry, registry + ".older")
    server = attack.start(folder="older", options=tokens.options)
    post(server, headers=tokens.alice)
    private = post(server, "&private=1", tokens.alice)
    without_log(killed(server))
    shutil.move(registry + ".older", registry)
    server = attack.start(folder="older", options=tokens.options)
    listed = json.loads(server.ask("GET", "/v1/datasets", headers=tokens.alice)[2])["datasets"]
    return "%d of 3, private %d" % (sum(one["state"] == "ready" for one in listed), server.ask("GET", "/v1/datasets/" + private)[0])


@case("4 a list of 3,000 datasets is read in pages", expect="100 at once, 3000 in all")
def pages(attack):
    server = attack.start(folder="pages")
    registry = killed(server)
    database = sqlite3.connect(registry)
    database.executemany("INSERT INTO datasets (id, name, state, options, created, raster, options_hash, body_hash) "
                         "VALUES (?, 'n', 'failed', '{}', '2026-01-01T00:00:00Z', 'source', '', '')", [("d%d" % k,) for k in range(3000)])
    database.commit()
    database.close()
    server = attack.start(folder="pages")
    first = len(json.loads(server.ask("GET", "/v1/datasets")[2])["datasets"])
    seen, path = set(), "/v1/datasets?limit=1000"
    while path:
        page = json.loads(server.ask("GET", path)[2])
        seen.update(one["id"] for one in page["datasets"])
        path = page["next"]
    return "%d at once, %d in all" % (first, len(seen))


@case("5 a change that ends after its dataset", expect="204, 404, no folder")
def late_change(attack):
    dataset = post(attack.server, "&updates=1")
    raster = cone()
    with connect(attack.server) as client:
        head = "POST /v1/datasets/%s/sources?name=late.asc HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\nExpect: 100-continue\r\nConnection: close\r\n\r\n"
        client.sendall((head % (dataset, len(raster))).encode())
        assert b"100" in client.recv(100)  # now the body is waited for
        client.sendall(raster[:100])
        deleted = attack.server.ask("DELETE", "/v1/datasets/" + dataset)[0]
        client.sendall(raster[100:])
        changed = statuses(received(client))
    there = os.path.exists(os.path.join(attack.server.data, "datasets", dataset))
    return "%d, %s, %s" % (deleted, changed, "its folder" if there else "no folder")


@case("10 Idempotency-Keys are each token's own", expect="201, another dataset; 201, the same")
def keys(attack):
    tokens = Tokens(attack)
    server = attack.start(options=tokens.options)
    key = {"Idempotency-Key": "k"}
    first = post(server, "&private=1", dict(tokens.alice, **key))
    other = post(server, "&private=1", dict(tokens.bob, **key))
    again = post(server, "&private=1", dict(tokens.alice, **key))
    return "201, %s dataset; 201, %s" % ("another" if other != first else "the same", "the same" if again == first else "another")


@case("10 a private id is answered as none", expect="equal, 404")
def private_ids(attack):
    tokens = Tokens(attack)
    server = attack.start(options=tokens.options)
    hidden = post(server, "&private=1", tokens.alice)
    none = hidden[:-8] + "a" * 8

    def answer(dataset):
        status, headers, body = server.ask("GET", "/v1/datasets/" + dataset)
        for name in ("date", "x-request-id"):
            headers.pop(name, None)
        return status, headers, body.decode().replace(dataset, "ID").split('"request_id"')[0]

    return "%s, %d" % ("equal" if answer(hidden) == answer(none) else "they differ", answer(hidden)[0])


@case("10 a signature is not shown to strangers", expect="not shown")
def signatures(attack):
    tokens = Tokens(attack)
    server = attack.start(options=tokens.options + ("--source-allow", "http://127.0.0.1:1/dems/"))
    status, _, body = server.ask("POST", "/v1/datasets?updates=1&source=http://127.0.0.1:1/dems/a.tif%3Fsig%3DSECRET", headers=tokens.alice)
    assert status == 202, body
    dataset = json.loads(body)["id"]
    assert server.wait(dataset) == "failed", "it cannot be fetched"
    paths = ["/v1/datasets", "/v1/datasets/" + dataset, "/v1/datasets/%s/sources" % dataset]
    return "shown" if any(b"SECRET" in server.ask("GET", path)[2] for path in paths) else "not shown"


@case("11 source= does not leave its prefix", expect="403")
def prefixes(attack):
    server = attack.start(options=("--source-allow", "http://127.0.0.1:1/tiles/"))
    seen = set()
    for end in ("..%3Fx", "..%23x", "..;/secret.tif", "..;v=1/a.tif", "..", "../a.tif", ".%3Fx"):
        status, _, body = server.ask("POST", "/v1/datasets?updates=1&source=http://127.0.0.1:1/tiles/" + end)
        seen.add("%d" % status if b"option-forbidden" in body else "%s: %d" % (end, status))
    return " ".join(sorted(seen))
