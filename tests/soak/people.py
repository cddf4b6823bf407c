"""Who uses the service: readers, people who post and delete, and clients who are slow, idle or rude. All are endless coroutines."""
import asyncio
import json
import random

from client import Broken, Client, NoAnswer, nap, now, problem
from codings import decoded
from rasters import tag
from watch import Pulse, waited_s

DOCUMENTS = ("manifest.json", "tileset.json", "layer.json", "terrain-rgb.json", "hillshade.json", "tileset-explicit.json")
VIEWER = ("/", "/viewer.js", "/style.css", "/api", "/cesium/Cesium.js")
LATE_S = 5.0  # half of what the service waits for the slowest of things: who comes so late may have been left, and rightly
CODINGS = ("gzip", "br", "gzip, deflate, br", "identity")


class Dataset:
    """One that the service said is ready. ending: its removal was asked for."""

    def __init__(self, name, raster, version):
        self.name, self.raster, self.version, self.ending = name, raster, version, False
        self.documents = {}  # address to the tag of the bytes that were read first

    def address(self, path):
        versioned = "versions/%s/" % self.version if self.version and random.random() < 0.2 else ""
        return "/v1/datasets/%s/%s%s" % (self.name, versioned, path)


class World:
    """What all of them know, and what was found."""

    def __init__(self, port, rasters, rate, alive, server=0):
        self.port, self.rasters, self.pause_s, self.alive, self.server = port, rasters, rate, alive, server
        self.live, self.counts, self.findings, self.clients, self.pulse = [], {}, [], 0, Pulse()
        self.viewer = Dataset("", None, None)

    def client(self):
        self.clients += 1
        return Client(self.port, self.clients % 10000)

    def count(self, what):
        self.counts[what] = self.counts.get(what, 0) + 1

    def finding(self, what):
        self.count("finding")
        if len(self.findings) < 50:
            self.findings.append(what)
            print("FINDING", what, flush=True)

    def no_answer(self, where, error):
        """A finding, unless this program itself was so late that the service may have given it up. error: with begun, of ask(), or any."""
        late_s = self.pulse.most_s(getattr(error, "begun", now()))
        what = "%s: no answer: %s; this program was %.1f s late, the server's threads have waited %.0f s for a processor so far" % (
            where, str(error) or repr(error), late_s, waited_s(self.server))
        if late_s < LATE_S:
            return self.finding(what)
        print("late", what, flush=True)
        return self.count("no answer, this program was late")

    def look(self, dataset, path, sent_tag, answer):
        """An answer to a GET of a tile."""
        status, headers, body = answer
        if status == 200:
            self.count("tiles")
            if body != dataset.raster.tiles[path]:
                self.finding("wrong bytes: %s of %s (raster %d): %d bytes for %d" %
                             (path, dataset.name, dataset.raster.number, len(body), len(dataset.raster.tiles[path])))
            if headers.get("etag", "").replace("W/", "") != tag(body):
                self.finding("%s of %s: ETag %s is not that of its bytes" % (path, dataset.name, headers.get("etag")))
        elif status == 304:
            self.count("unchanged")
            if sent_tag != tag(dataset.raster.tiles[path]):
                self.finding("%s of %s: 304 for the tag of other bytes" % (path, dataset.name))
        elif status == 404 and dataset.ending:
            self.count("gone")
        elif status in (429, 503) and "retry-after" in headers:
            self.count("busy")
        else:
            self.finding("%s of %s: %d %s" % (path, dataset.name, status, problem(body)))

    def look_at_document(self, dataset, path, answer):
        """Once decoded it is the same for everybody, and what its ETag says."""
        status, headers, body = answer
        if status == 200:
            coding = headers.get("content-encoding", "identity")
            self.count("documents, " + coding)
            plain = tag(decoded(coding, body))
            # What is stored compressed has the tag of the compressed bytes.
            if headers.get("etag", "").replace("W/", "") not in (plain, tag(body)):
                self.finding("%s in %s: ETag %s is not that of its bytes" % (path, coding, headers.get("etag")))
            if dataset.documents.setdefault(path, plain) != plain:
                self.finding("%s in %s: other bytes than before" % (path, coding))
        elif status == 404 and dataset.ending:
            self.count("gone")
        elif status in (429, 503) and "retry-after" in headers:
            self.count("busy")
        else:
            self.finding("%s of %s: %d %s" % (path, dataset.name, status, problem(body)))


async def read_document(world, client, dataset):
    accepts = {"Accept-Encoding": random.choice(CODINGS)}
    if random.random() < 0.2:
        path = random.choice(VIEWER[:-1]) if random.random() < 0.95 else VIEWER[-1]
        world.look_at_document(world.viewer, path, await client.ask("GET", path, None, accepts))
    else:
        path = dataset.address(random.choice(DOCUMENTS))  # some name the version that they were asked by
        world.look_at_document(dataset, path, await client.ask("GET", path, None, accepts))


async def read_tile(world, client, dataset, path):
    known = {}
    if random.random() < 0.1:
        known["If-None-Match"] = tag(dataset.raster.tiles[path]) if random.random() < 0.8 else '"%032x"' % random.getrandbits(128)
    world.look(dataset, path, known.get("If-None-Match"), await client.ask("GET", dataset.address(path), None, known))


async def reader(world):
    client = world.client()
    while True:
        await nap(world.pause_s)
        if not world.live:
            continue
        dataset = random.choice(world.live)
        try:
            if random.random() < 0.15:
                await read_document(world, client, dataset)
            else:
                await read_tile(world, client, dataset, random.choice(dataset.raster.paths))
        except NoAnswer as error:
            world.no_answer("a reader of %s" % dataset.name, error)
        if random.random() < 0.02:
            client.close()


async def in_parts(world, client, raster):
    """Over connections that break; the id of the upload."""
    status, headers, body = await client.ask("POST", "/v1/uploads", b"", {"Upload-Length": len(raster.body), "Tus-Resumable": "1.0.0"})
    if status != 201:
        return world.finding("an upload cannot begin: %d %s" % (status, problem(body)))
    place, offset = "/v1/" + headers["location"], 0
    while offset < len(raster.body):
        piece = raster.body[offset:offset + random.randint(1, 1 + len(raster.body) // 2)]
        part = {"Content-Type": "application/offset+octet-stream", "Tus-Resumable": "1.0.0", "Upload-Offset": offset}
        if random.random() < 0.3:  # breaks off in the middle
            await client.send("PATCH", place, piece, part, whole=False)
            client.writer.write(piece[:len(piece) // 2])
            client.close()
            world.count("broken part")
        else:
            status, headers, body = await client.ask("PATCH", place, piece, part)
            # The part that broke off before may still be on its way: then it is asked again where the upload stands.
            if status != 204 and (status, problem(body)) != (409, "upload-conflict"):
                return world.finding("a part at %d: %d %s" % (offset, status, problem(body)))
        status, headers, _ = await client.ask("HEAD", place)
        if status != 200 or int(headers["upload-offset"]) < offset:
            return world.finding("an upload that stood at %d: %d %s" % (offset, status, headers.get("upload-offset")))
        offset = int(headers["upload-offset"])
    return place.rsplit("/", 1)[1]


async def post(world, client, raster):
    """The id of a dataset that was accepted."""
    query = "/v1/datasets?name=%s&%s" % (raster.name, raster.query)
    if random.random() < 0.4:
        upload = await in_parts(world, client, raster)
        if not upload:
            return None
        answer = await client.ask("POST", query + "&upload=" + upload, b"")
    else:
        answer = await client.ask("POST", query, raster.body)
    return accepted(world, answer)


def accepted(world, answer):
    status, headers, body = answer
    if status in (201, 202):
        world.count("posted")
        return json.loads(body)["id"]
    if status in (429, 503) and "retry-after" in headers:
        return world.count("busy")
    return world.finding("a raster was refused: %d %s" % (status, problem(body)))


async def published(world, client, name, raster):
    """Waits until it is ready, and shows it to the readers."""
    while True:
        status, _, body = await client.ask("GET", "/v1/datasets/" + name)
        state = json.loads(body).get("state") if status == 200 else None
        if state == "ready":
            break
        if state not in ("queued", "running"):
            return world.finding("dataset %s of raster %d: %d %s" % (name, raster.number, status, body[:300]))
        await nap(0.3)
    world.live.append(Dataset(name, raster, json.loads(body).get("version")))


async def delete(world, client, name):
    status, _, body = await client.ask("DELETE", "/v1/datasets/" + name)
    if status != 204:
        return world.finding("dataset %s cannot be deleted: %d %s" % (name, status, problem(body)))
    world.count("deleted")
    status, _, body = await client.ask("GET", "/v1/datasets/" + name)
    if (status, problem(body)) != (404, "dataset-unknown"):
        world.finding("dataset %s was deleted, and is there: %d" % (name, status))


async def garbage(world, client):
    status, headers, body = await client.ask("POST", "/v1/datasets?name=x.tif&crs=EPSG:4326", random.randbytes(3000), {"Prefer": "wait=60"})
    world.count("garbage refused")
    if status != 422 and not (status in (429, 503) and "retry-after" in headers):
        world.finding("garbage was answered with %d %s" % (status, problem(body)))
    elif status == 422:
        await delete(world, client, headers["location"].rsplit("/", 1)[1])


async def writer(world):
    client = world.client()
    while True:
        try:
            await nap(0.5)
            chance = random.random()
            if chance < 0.1:
                await garbage(world, client)
                continue
            raster = random.choice(world.rasters)
            name = await post(world, client, raster)
            if name and chance < 0.25:  # while it waits or is built
                await nap(0.5)
                await delete(world, client, name)
                world.count("cancelled")
            elif name:
                await published(world, client, name, raster)
            while len(world.live) > world.alive:
                old = world.live.pop(0)
                old.ending = True
                await delete(world, client, old.name)
        except (Broken, OSError, asyncio.TimeoutError) as error:
            client.close()
            world.no_answer("a writer", error)
