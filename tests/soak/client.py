"""A small HTTP client on asyncio: thousands of requests a second would be too many for http.client's threads."""
import asyncio
import json
import random

PATIENCE_S = 120  # longer than the slowest machine needs
KEPT_S = 30  # a connection that was idle for longer is not used again: the service closes it after 60 s, maybe just as it is asked


class Broken(Exception):
    """The connection ended before the answer did. heard: bytes of the answer that had come."""

    def __init__(self, what, heard=0):
        super().__init__(what)
        self.heard = heard


class NoAnswer(Broken):
    """A request that a client did what it could for. begun: when it was asked, on the loop's clock."""

    def __init__(self, what, begun):
        super().__init__(what)
        self.begun = begun


class Client:
    """One connection at a time, kept alive. number: which loopback address it comes from, for limits count by address."""

    def __init__(self, port, number):
        self.port, self.local = port, ("127.0.%d.%d" % (1 + number // 200, 1 + number % 200), 0)
        self.reader = self.writer = self.asked = None
        self.answers, self.since = 0, 0.0  # of this connection; of its last answer, or its beginning

    async def connect(self):
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port, local_addr=self.local)
        self.answers, self.since = 0, now()

    def close(self):
        if self.writer:
            self.writer.close()
        self.reader = self.writer = None

    async def send(self, method, path, body=None, headers=None, whole=True):
        """The head, and the body unless whole is False: then the caller sends it."""
        if not self.writer:
            await self.connect()
        self.asked = method
        lines = ["%s %s HTTP/1.1" % (method, path), "Host: 127.0.0.1:%d" % self.port]
        lines += ["%s: %s" % pair for pair in (headers or {}).items()]
        if body is not None:
            lines.append("Content-Length: %d" % len(body))
        self.writer.write(("\r\n".join(lines) + "\r\n\r\n").encode() + (body if body and whole else b""))
        await self.writer.drain()

    async def answer(self):
        """Status, headers (names in lower case), body."""
        head_size, length = 0, None
        try:
            raw = await self.reader.readuntil(b"\r\n\r\n")
            head, head_size = raw.decode("latin-1").split("\r\n"), len(raw)
            status = int(head[0].split()[1])
            headers = dict((k.lower(), v.strip()) for k, _, v in (line.partition(":") for line in head[1:] if line))
            if status == 100:
                return await self.answer()
            length = int(headers.get("content-length", 0))
            body = await self.reader.readexactly(length) if length and self.asked != "HEAD" and status not in (204, 304) else b""
        except (asyncio.IncompleteReadError, OSError) as error:
            self.close()
            partial = len(getattr(error, "partial", b""))
            where = "before the answer" if head_size + partial == 0 else "in the head" if length is None else "at byte %d of %d" % (partial, length)
            raise Broken("%s %s" % ("closed" if isinstance(error, asyncio.IncompleteReadError) else repr(error), where), head_size + partial) from error
        self.answers, self.since = self.answers + 1, now()
        if headers.get("connection", "") == "close":
            self.close()
        return status, headers, body

    async def ask(self, method, path, body=None, headers=None):
        """On a connection that the service may have closed meanwhile, for being idle, what changes nothing is asked again, once: any client has to.
        NoAnswer says how it went."""
        begun = now()
        if self.writer and begun - self.since > KEPT_S:
            self.close()
        used = "a connection with %d answers, the last %.1f s ago" % (self.answers, begun - self.since) if self.writer else "a new connection"
        may_repeat = self.writer is not None and method in ("GET", "HEAD")
        try:
            try:
                return await self._once(method, path, body, headers)
            except (Broken, ConnectionError) as error:
                self.close()
                if not may_repeat or getattr(error, "heard", 0) > 0:
                    raise
                used += ", then (%s) a new one" % (str(error) or repr(error))
            return await self._once(method, path, body, headers)
        except asyncio.TimeoutError as error:
            self.close()
            raise NoAnswer("%s %s on %s: nothing more for %d s" % (method, path, used, PATIENCE_S), begun) from error
        except (Broken, OSError) as error:
            self.close()
            raise NoAnswer("%s %s on %s: %s after %.1f s" % (method, path, used, str(error) or repr(error), now() - begun), begun) from error

    async def _once(self, method, path, body, headers):
        await self.send(method, path, body, headers)
        return await asyncio.wait_for(self.answer(), PATIENCE_S)


def now():
    return asyncio.get_running_loop().time()


def problem(body):
    """The slug of a problem document."""
    try:
        return json.loads(body)["type"].rsplit(":", 1)[1]
    except (ValueError, KeyError, IndexError):
        return "no problem document"


async def nap(mean_s):
    await asyncio.sleep(random.expovariate(1 / mean_s))
