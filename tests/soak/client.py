"""A small HTTP client on asyncio: thousands of requests a second would be too many for http.client's threads."""
import asyncio
import json
import random

PATIENCE_S = 120  # longer than the slowest machine needs


class Broken(Exception):
    """The connection ended before the answer did."""


class Client:
    """One connection at a time, kept alive. number: which loopback address it comes from, for limits count by address."""

    def __init__(self, port, number):
        self.port, self.local = port, ("127.0.%d.%d" % (1 + number // 200, 1 + number % 200), 0)
        self.reader = self.writer = self.asked = None

    async def connect(self):
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port, local_addr=self.local)

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
        try:
            head = (await self.reader.readuntil(b"\r\n\r\n")).decode("latin-1").split("\r\n")
            status = int(head[0].split()[1])
            headers = dict((k.lower(), v.strip()) for k, _, v in (line.partition(":") for line in head[1:] if line))
            if status == 100:
                return await self.answer()
            length = int(headers.get("content-length", 0))
            body = await self.reader.readexactly(length) if length and self.asked != "HEAD" and status not in (204, 304) else b""
        except (asyncio.IncompleteReadError, OSError) as error:
            self.close()
            raise Broken(str(error)) from error
        if headers.get("connection", "") == "close":
            self.close()
        return status, headers, body

    async def ask(self, method, path, body=None, headers=None):
        """One that was closed meanwhile, for being idle, is opened again: any client has to."""
        fresh = self.writer is None
        try:
            await self.send(method, path, body, headers)
            return await asyncio.wait_for(self.answer(), PATIENCE_S)
        except (Broken, OSError):
            self.close()
            if fresh or method != "GET":
                raise
        await self.send(method, path, body, headers)
        return await asyncio.wait_for(self.answer(), PATIENCE_S)


def problem(body):
    """The slug of a problem document."""
    try:
        return json.loads(body)["type"].rsplit(":", 1)[1]
    except (ValueError, KeyError, IndexError):
        return "no problem document"


async def nap(mean_s):
    await asyncio.sleep(random.expovariate(1 / mean_s))
