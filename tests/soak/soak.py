#!/usr/bin/env python3
"""Mixed work for a while, and every byte looked at.

    soak.py PROGRAM [--minutes 30] [--readers 200] [--slow 50] [--writers 4] [--rate 300] [--report FILE]

Readers fetch tiles of five families from datasets that others post, cancel, replace and delete meanwhile; each answer is compared with the bytes of an
undisturbed build and with its ETag. Slow, idle and rude clients must be served or left in time. At the end everything is deleted but
what readers had, `cordillera check` reads the data folder, the server ends by itself, and nothing lies about. Memory, descriptors and
threads of the server are sampled from /proc. Exit code 1 after a finding. SIGTERM and SIGINT end the work early: the folder is looked at and the table
printed all the same, and the exit code is 143 or 130. No process stays behind.
"""
import argparse
import asyncio
import json
import logging
import os
import signal
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(1, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import processes  # noqa: E402
from people import World, reader, writer  # noqa: E402
from rasters import Raster  # noqa: E402
from rude import slow_client  # noqa: E402
from watch import Watch, slope  # noqa: E402

MOST_SLOPE_KIB = 512     # a minute, in the second half: beyond the noise of pools and caches
MOST_DESCRIPTORS = 1.0   # a minute, likewise


def started(program, folder):
    """The process and its port."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("CORDILLERA_") or k == "CORDILLERA_CACHE"}
    log_path = os.path.join(folder, "log")
    with open(log_path, "wb") as log:
        process = processes.start([program, "serve", "--listen", "127.0.0.1:0", "--data", os.path.join(folder, "data"), "--threads", "1",
                                   "--device", "cpu"], env=environment, stderr=log, stdin=subprocess.DEVNULL)
    mark = "http://127.0.0.1:"
    while process.poll() is None:
        with open(log_path, errors="replace") as log:
            said = log.read()
        if mark in said and "/" in said[said.index(mark) + len(mark):]:
            return process, int(said[said.index(mark) + len(mark):].split("/")[0])
        time.sleep(0.02)
    raise SystemExit("the server did not start: " + said)


async def mixed_work(words, world, watch, process):
    """The signal that ended it early; 0: none."""
    told = []
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, told.append, int(number))
    tasks = [asyncio.create_task(watch.run()), asyncio.create_task(world.pulse.run())]
    tasks += [asyncio.create_task(writer(world)) for _ in range(words.writers)]
    tasks += [asyncio.create_task(reader(world)) for _ in range(words.readers)]
    tasks += [asyncio.create_task(slow_client(world, k)) for k in range(words.slow)]
    end = time.monotonic() + 60 * words.minutes
    next_word = time.monotonic() + 60
    print("%s the work begins" % time.strftime("%H:%M:%S"), flush=True)
    while time.monotonic() < end and process.poll() is None and not told:
        await asyncio.sleep(0.2)
        for task in tasks:
            if task.done() and task.exception():
                world.finding("the test itself: %r" % task.exception())
                end = 0
        if time.monotonic() > next_word:
            next_word += 60
            print(time.strftime("%H:%M:%S"), world.counts, watch.samples[-1:], flush=True)
    if process.poll() is not None and not told:  # a terminal's signal is for all of its programs
        world.finding("the server ended with %d" % process.returncode)
    # More than once: before Python 3.12 a wait_for whose end has just come swallows a cancellation.
    pending, rounds = set(tasks), 0
    while pending and rounds < 60:
        for task in pending:
            task.cancel()
        _, pending = await asyncio.wait(pending, timeout=1)
        rounds += 1
    if pending:
        world.finding("the test itself: %d clients do not end" % len(pending))
    return told[0] if told else 0


def judged_watch(words, world, watch):
    if words.minutes < 10:
        return  # pools are still filling
    if slope(watch.column(1)) > MOST_SLOPE_KIB:
        world.finding("memory grows: " + next(watch.lines()))
    if slope(watch.column(2)) > MOST_DESCRIPTORS:
        world.finding("descriptors grow: " + list(watch.lines())[1])


def judged_end(program, folder, world, process):
    """The folder that is left."""
    if process.poll() is None:
        process.terminate()
        try:
            if process.wait(120) != 0:
                world.finding("the server ended with %d" % process.returncode)
        except subprocess.TimeoutExpired:
            process.kill()
            world.finding("the server does not end")
    data = os.path.join(folder, "data")
    checked = subprocess.run([program, "check", data], capture_output=True, text=True)
    if checked.returncode != 0:
        world.finding("check: " + (checked.stdout + checked.stderr)[:600])
    there = set(os.listdir(os.path.join(data, "datasets")))
    lost = {d.name for d in world.live} - there
    if lost:
        world.finding("ready datasets without a folder: %s" % lost)
    if os.listdir(os.path.join(data, "incoming")):
        world.finding("left in incoming: %s" % os.listdir(os.path.join(data, "incoming")))
    return checked.stdout.strip().splitlines()[-1:]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--readers", type=int, default=200)
    parser.add_argument("--slow", type=int, default=50)
    parser.add_argument("--writers", type=int, default=4)
    parser.add_argument("--rate", type=float, default=300, help="tiles a second of all readers together")
    parser.add_argument("--rasters", type=int, default=6)
    parser.add_argument("--alive", type=int, default=8, help="datasets that are there at a time")
    parser.add_argument("--report", help="a file of JSON: counts, findings, samples")
    words = parser.parse_args()
    program = os.path.abspath(words.program)
    logging.getLogger("asyncio").setLevel(logging.ERROR)  # it warns of what rude clients do on purpose
    with processes.folder("cordillera-soak-") as folder:
        rasters = [Raster(program, folder, k) for k in range(words.rasters)]
        process, port = started(program, folder)
        world = World(port, rasters, words.readers / words.rate, words.alive, process.pid)
        watch = Watch(process.pid, min(5.0, words.minutes * 2))
        begin = time.monotonic()
        told = asyncio.run(mixed_work(words, world, watch, process))
        minutes = (time.monotonic() - begin) / 60
        if not told:
            judged_watch(words, world, watch)
        last = judged_end(program, folder, world, process)
    if told:
        print("ended by signal %d" % told)
    print("%.1f minutes, %d readers, %d slow clients, %d writers; check: %s" % (minutes, words.readers, words.slow, words.writers, last))
    print("this program was late by %.1f s at most" % max([late for _, late in world.pulse.late] + [0.0]))
    print(", ".join("%d %s" % (n, what) for what, n in sorted(world.counts.items())))
    print("\n".join(watch.lines()))
    print("%d findings" % len(world.findings))
    if words.report:
        with open(words.report, "w") as file:
            json.dump({"counts": world.counts, "findings": world.findings, "samples": watch.samples}, file)
    if world.findings or not (told or world.counts.get("tiles")):
        return 1
    return 128 + told if told else 0


if __name__ == "__main__":
    sys.exit(main())
