"""Finding 11 and what came after it: hosts that rasters are fetched from, as a whole or by ranges, and that say other things than they should."""
import contextlib
import http.server
import json
import threading
import time
import urllib.parse

from attack import PATIENCE_S, case, eventually
from client import cone
from cases.slow_readers import MIB, resident
from cases.texts import tiff

RASTER = tiff("metre", size=401)  # more than one block of those that are fetched
PRIVATE = "/private/a.tif"


class Answer(http.server.BaseHTTPRequestHandler):
    """What a name of a path stands for is what the host does."""
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def do_GET(self):
        self.server.asked.append(self.path)
        name = self.path.rpartition("/")[2].partition(".")[0].partition("?")[0]
        asked = self.headers.get("Range")
        if name in self.server.leads:
            self.head(302, Location=self.server.leads[name], Content_Length="0")
        elif name == "headless":
            self.send_response(200)
            while not self.server.ending.is_set():
                self.send_header("X-More", "x" * 1000)
                self.flush_headers()
        elif name == "dripping":
            self.whole(RASTER[:100])
            self.drip()
        elif asked is None:
            self.whole(RASTER)
        else:
            self.part(name, *[int(number) for number in asked[len("bytes="):].split("-")])

    def drip(self):
        with self.server.counts:
            self.server.held += 1
        try:
            while not self.server.ending.wait(0.2):
                self.wfile.write(b"x")
        finally:
            with self.server.counts:
                self.server.held -= 1

    def head(self, status, **headers):
        self.send_response(status)
        for key, value in headers.items():
            self.send_header(key.replace("_", "-"), value)
        self.end_headers()

    def whole(self, begins):
        self.head(200, ETag='"one"', Content_Length=str(len(RASTER)))
        self.wfile.write(begins)

    def part(self, name, first, last):
        """The first is as it should be."""
        last = min(last, len(RASTER) - 1)
        body, total = RASTER[first:last + 1], len(RASTER)
        if first > 0 and name == "moved":
            first, last = first + 1, last + 1
        if first > 0 and name == "huge":
            total = 2 ** 64 - 1
        said = {"ETag": '"one"', "Content_Range": "bytes %d-%d/%d" % (first, last, total)}
        if first > 0 and name == "unsaid":
            del said["Content_Range"]
        if first == 0 or name not in ("endless", "slow"):
            self.head(206, Content_Length=str(len(body)), **said)
            self.wfile.write(body)
        elif name == "endless":
            self.head(206, Transfer_Encoding="chunked", **said)
            while not self.server.ending.is_set():
                self.wfile.write(b"10000\r\n" + b"x" * 65536 + b"\r\n")
        else:
            self.head(206, Content_Length=str(len(body)), **said)
            self.drip()


class Host(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, leads):
        super().__init__(("127.0.0.1", 0), Answer)
        self.asked, self.ending = [], threading.Event()
        self.counts, self.held = threading.Lock(), 0  # who waits for bytes that drip
        self.address = "http://127.0.0.1:%d" % self.server_port
        self.leads = {name: where.replace("HOST", "127.0.0.1:%d" % self.server_port) for name, where in leads.items()}

    def handle_error(self, *_):
        pass  # who has enough leaves


@contextlib.contextmanager
def host(**leads):
    """leads: name to where a request for it is led."""
    server = Host(leads)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield server
    finally:
        server.ending.set()
        server.shutdown()
        thread.join()
        server.server_close()


def start(attack, server, *options):
    return attack.start(options=("--source-allow", server.address + "/dems/", *options))


def live(service, address):
    return service.ask("GET", "/v1/live?" + urllib.parse.urlencode({"url": address}))


def made_of(service, address):
    status, _, body = live(service, address)
    assert status in (200, 202), body
    return json.loads(body)["id"]


def came_of(service, dataset):
    """Its state, or the problem that it has: what may be well another time is tried again."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        now = json.loads(service.ask("GET", "/v1/datasets/" + dataset)[2])
        problem = (now.get("error") or {}).get("type", "").rpartition(":")[2]
        if now["state"] == "ready" or problem not in ("", "source-replaced"):  # the latter is looked at once more at once
            return problem or "ready"
        time.sleep(0.02)
    return now["state"]


@case("11 redirects of a source=: one without a slash, five out of its prefix", expect="ready; option-forbidden; nothing else was asked for")
def redirects(attack):
    away = {"path": PRIVATE, "dots": "../private/a.tif", "host": "//HOST" + PRIVATE, "semicolon": "..;/private/a.tif",
            "escaped": "%2e%2e/private/a.tif"}
    with host(near="there.tif", **away) as server:
        service = start(attack, server)
        near = came_of(service, made_of(service, server.address + "/dems/near.tif"))
        seen = {came_of(service, made_of(service, "%s/dems/%s.tif" % (server.address, name))) for name in away}
        outside = [path for path in server.asked if not path.startswith("/dems/") or ".." in path or "%2e" in path]
    return "%s; %s; %s" % (near, ", ".join(sorted(seen)), outside or "nothing else was asked for")


@case("11 addresses of /v1/live that are not below the prefix", expect="403; nothing was asked for")
def live_prefix(attack):
    with host() as server:
        service, at = start(attack, server), server.address
        port = at.rpartition(":")[2]
        addresses = [at + PRIVATE, at + "/dems/..?x", at + "/dems/..;/private/a.tif", at + "/dems/../private/a.tif", at + "/dems/%2e%2e/private/a.tif",
                     at + "/dems/..%252fprivate/a.tif", at.replace("//", "//u@") + "/dems/a.tif", "http://2130706433:%s/dems/a.tif" % port,
                     "http://localhost:%s/dems/a.tif" % port, "file:///etc/passwd", "/vsicurl/%s/dems/a.tif" % at]
        seen = {str(live(service, address)[0]) for address in addresses}
        return "%s; %s" % (" ".join(sorted(seen)), server.asked or "nothing was asked for")


@case("11 parts that are moved, without a Content-Range, of 2^64 bytes, endless", expect="unreachable 3, copied as a whole 1; MiB more < 64",
      holds=lambda seen: seen[0] == ["source-unreachable", "source-unreachable", "ready", "source-unreachable"] and seen[1] < 64)
def parts(attack):
    with host() as server:
        service = start(attack, server, "--jobs", "4")
        before = resident(service)
        names = [made_of(service, "%s/dems/%s.tif" % (server.address, how)) for how in ("moved", "unsaid", "huge", "endless")]
        return [came_of(service, name) for name in names], (resident(service) - before) // MIB


@case("11 a head that does not end", expect="source-unreachable; MiB more < 64", holds=lambda seen: seen[0] == "source-unreachable" and seen[1] < 64)
def headless(attack):
    with host() as server:
        service = start(attack, server)
        before = resident(service)
        return came_of(service, made_of(service, server.address + "/dems/headless.tif")), (resident(service) - before) // MIB


def cone_behind(service, server, name):
    """Posts a cone once the host was asked for this so often that it is held up; what became of both."""
    slow = made_of(service, "%s/dems/%s.tif" % (server.address, name))
    eventually(lambda: server.held > 0)
    status, _, answer = service.ask("POST", "/v1/datasets?name=a.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=50", cone())
    assert status == 202, answer
    return "cone %s, %s" % (service.wait(json.loads(answer)["id"]), came_of(service, slow))


@case("11 a source that drips, and a cone behind it", expect="cone ready, source-unreachable", minutes=True)
def dripping(attack):
    with host() as server:
        return cone_behind(start(attack, server), server, "dripping")


@case("11 a part that drips, and a cone behind its build", expect="cone ready, source-unreachable", minutes=True)
def dripping_part(attack):
    with host() as server:
        return cone_behind(start(attack, server), server, "slow")


@case("11 who deletes the dataset of a source that drips does not wait for it", expect="204, gone, the host is left")
def deleted(attack):
    with host() as server:
        service = start(attack, server)
        dataset = made_of(service, server.address + "/dems/dripping.tif")
        eventually(lambda: server.held > 0)
        status = service.ask("DELETE", "/v1/datasets/" + dataset)[0]
        there = service.wait(dataset)
        left = eventually(lambda: server.held == 0)
        return "%d, %s, %s" % (status, there or "gone", "the host is left" if left else "the host still sends")
