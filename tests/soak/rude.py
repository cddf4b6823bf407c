"""Clients that are slow, idle or rude. Each must be served or left, in time, and take nothing from the others."""
import asyncio
import random
import select
import socket

from client import Broken, NoAnswer, nap, now
from people import accepted, delete

LEFT_S = 150  # by then the service has left whoever does not go on


async def closed(reader):
    """What still came until the other side closed."""
    heard = b""
    try:
        while piece := await asyncio.wait_for(reader.read(65536), LEFT_S):
            heard += piece
    except ConnectionError:
        pass
    return heard


async def slow_reader(world, client):
    """Asks for many tiles at once, reads them two KiB a second, and leaves after a while."""
    dataset = random.choice(world.live)
    paths = [random.choice(dataset.raster.paths) for _ in range(8)]
    for path in paths:
        await client.send("GET", dataset.address(path))
    for path in paths:
        await asyncio.sleep(2)
        world.look(dataset, path, None, await client.answer())
    world.count("slow reader served")


async def stopped_reader(world, client):
    """Asks until the service takes no more, and never reads: it must be left, and its answers must not pile up."""
    dataset = random.choice(world.live)
    # One that is only looked up: until the system's buffers are full (4 MB), the service is right to answer, however slow the machine.
    path = max((p for p in dataset.raster.paths if p.endswith(".glb")), key=lambda p: len(dataset.raster.tiles[p]))
    asked = ("GET %s HTTP/1.1\r\nHost: 127.0.0.1:%d\r\n\r\n" % (dataset.address(path), world.port)).encode()
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    raw.bind(client.local)
    raw.setblocking(False)
    loop = asyncio.get_running_loop()
    try:
        await loop.sock_connect(raw, ("127.0.0.1", world.port))
        try:
            while True:
                await asyncio.wait_for(loop.sock_sendall(raw, asked * 20), 5)
        except asyncio.TimeoutError:
            pass
        errors = select.poll()
        errors.register(raw, 0)  # of being left alone
        end = loop.time() + 4 * LEFT_S
        while not errors.poll(0):
            if loop.time() > end:
                return world.finding("a client that does not read was kept for %d s" % (4 * LEFT_S))
            await asyncio.sleep(1)
    except OSError:
        pass
    finally:
        raw.close()
    world.count("stopped reader left")


async def dripping_head(world, client):
    await client.connect()
    for byte in b"GET /v1/datasets HTTP/1.1\r\nHost: x":
        client.writer.write(bytes([byte]))
        await asyncio.sleep(1)
        if client.reader.at_eof():
            break
    heard = await closed(client.reader)
    world.count("dripping head left")
    if heard and not heard.startswith(b"HTTP/1.1 408"):
        world.finding("a slow head was answered with %r" % heard[:60])


async def idle(world, client):
    await client.connect()
    await closed(client.reader)
    world.count("idle left")


async def slow_upload(world, client):
    """Four KiB a second: above the least rate, so it is taken. Where this machine lets us send less than half of that, it may be left."""
    raster = min(world.rasters, key=lambda r: len(r.body))
    clock = asyncio.get_running_loop().time
    await client.send("POST", "/v1/datasets?name=slow.asc&" + raster.query, raster.body, whole=False)
    start, sent, late = clock(), 0, False
    try:
        for at in range(0, len(raster.body), 2048):
            client.writer.write(raster.body[at:at + 2048])
            await client.writer.drain()
            await asyncio.sleep(0.5)
            sent += 2048
            late = late or sent < 2048 * (clock() - start)
        answer = await client.answer()
    except (Broken, OSError):
        if late:
            return world.count("slow upload left: this machine was late")
        raise
    if late and answer[0] == 408:
        return world.count("slow upload left: this machine was late")
    name = accepted(world, answer)
    if name:
        world.count("slow upload taken")
        await delete(world, client, name)


async def stalled_upload(world, client):
    raster = world.rasters[0]
    await client.send("POST", "/v1/datasets?name=stalled.asc&" + raster.query, raster.body, whole=False)
    client.writer.write(raster.body[:1000])
    heard = await closed(client.reader)
    world.count("stalled upload left")
    if heard and not heard.startswith((b"HTTP/1.1 408", b"HTTP/1.1 429", b"HTTP/1.1 503")):
        world.finding("a stalled upload was answered with %r" % heard[:60])


async def broken_upload(world, client):
    raster = world.rasters[-1]
    await client.send("POST", "/v1/datasets?name=broken.asc&" + raster.query, raster.body, whole=False)
    client.writer.write(raster.body[:len(raster.body) // 3])
    await nap(0.2)
    client.writer.transport.abort()
    world.count("broken upload")
    await nap(3)


async def listener(world, client):
    """An event stream that is left in the middle."""
    await client.send("GET", "/v1/datasets/%s/events" % random.choice(world.live).name)
    await nap(5)
    world.count("event stream")


RUDE = (slow_reader, stopped_reader, dripping_head, idle, slow_upload, stalled_upload, broken_upload, listener)


async def slow_client(world, number):
    """number: which of them it begins with."""
    while True:
        await nap(1)
        if not world.live:
            continue
        client = world.client()
        number += 1
        kind, begun = RUDE[number % len(RUDE)], now()
        try:
            await kind(world, client)
        except (Broken, OSError) as error:
            if kind in (slow_upload, slow_reader):
                world.no_answer(kind.__name__, NoAnswer("%s, begun %.1f s ago" % (str(error) or repr(error), now() - begun), begun))
        except asyncio.TimeoutError:
            world.finding("%s: still connected after %d s" % (kind.__name__, LEFT_S))
        finally:
            client.close()
