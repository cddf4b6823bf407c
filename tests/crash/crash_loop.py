#!/usr/bin/env python3
"""Kills the server and its jobs, or lets the disk fail, at every call that changes the data folder, and at random instants.

    crash_loop.py PROGRAM SHIM [--points N] [--random N] [--faults N] [--all] [--hours H] [--seed S]

A run is: post a raster, wait for its tiles, send another one in parts and make a dataset of it, delete the first. It is done again with
the server killed at one point of it, restarted, and looked at: what was answered with 201 or 202 is there and comes to the same tiles, byte
for byte, as in a run that nothing disturbed; what was answered with 204 is gone; nothing lies about. --faults: instead of a kill, the disk is
full (ENOSPC) or broken (EIO) from that point on; the server goes on answering, and all comes right when the disk does. --points and --faults
spread so many points evenly; --all takes every one; --hours goes on with random kills. Prints what was done; exit code 1 after a finding.
"""
import argparse
import collections
import contextlib
import json
import os
import random
import signal
import struct
import subprocess
import sys
import threading
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from client import PATIENCE_S, Gone, Server, cone, tiles  # noqa: E402
import processes  # noqa: E402

OPTIONS = "crs=EPSG:4326&vertical_datum=ellipsoid&error=5"
FIRST, SECOND = cone(40, 900), cone(48, 1500)
PIECE = 9000
# What the disk may be said to have done to a request.
DISK_SLUGS = {"storage-full", "store-write", "internal", "not-ready"}


class Told:
    """What the server said it had done."""

    def __init__(self):
        self.accepted = {}  # dataset -> which raster
        self.deleted = set()
        self.deleting = None
        self.problems = []

    def problem(self, status, body):
        self.problems.append((status, json.loads(body)["type"].rsplit(":", 1)[1]))


def post(server, told, which, query, body=None):
    status, _, answer = server.ask("POST", "/v1/datasets?%s&%s" % (OPTIONS, query), body)
    if status in (201, 202):
        dataset = json.loads(answer)["id"]
        told.accepted[dataset] = which
        return dataset
    told.problem(status, answer)
    return None


def send_in_parts(server, told):
    status, headers, body = server.ask("POST", "/v1/uploads", headers={"Upload-Length": str(len(SECOND)), "Tus-Resumable": "1.0.0"})
    if status != 201:
        return told.problem(status, body)
    place = "/v1/" + headers["location"]
    offset = 0
    while offset < len(SECOND):
        status, headers, body = server.ask("PATCH", place, SECOND[offset:offset + PIECE],
                                           {"Upload-Offset": str(offset), "Content-Type": "application/offset+octet-stream"})
        if status != 204:
            return told.problem(status, body)
        offset = int(headers["upload-offset"])
    return place.rsplit("/", 1)[1]


def use(server, told, on_upload=lambda upload: None):
    """What a user does; ends with Gone where the server is killed."""
    first = post(server, told, "first", "name=first.asc", FIRST)
    if first:
        server.wait(first)
    upload = send_in_parts(server, told)
    second = None
    if upload:
        on_upload(upload)
        second = post(server, told, "second", "name=second.asc&upload=" + upload)
    if first:
        told.deleting = first
        status, _, body = server.ask("DELETE", "/v1/datasets/" + first)
        if status == 204:
            told.deleted.add(first)
            told.deleting = None
        else:
            told.problem(status, body)
    if second:
        server.wait(second)


class Loop:
    def __init__(self, program, shim, seed):
        self.program, self.shim, self.random = program, shim, random.Random(seed)
        self.findings, self.runs, self.survived = [], {}, 0

    def use(self, server, told, on_upload=lambda upload: None):
        use(server, told, on_upload)

    def counter(self, folder):
        path = os.path.join(folder, "counter")
        with open(path, "wb") as file:
            file.write(b"\0" * 16)
        return path

    @staticmethod
    def counted(path):
        with open(path, "rb") as file:
            return struct.unpack("<Q", file.read(8))[0]

    def undisturbed(self):
        """The hashes of both datasets, how many calls there are, and how long it takes."""
        with processes.folder("cordillera-crash-") as folder:
            counter, log = self.counter(folder), os.path.join(folder, "calls")
            server = Server(self.program, folder, self.shim, {"FAULT_COUNTER": counter, "FAULT_LOG": log})
            told = Told()
            first = post(server, told, "first", "name=first.asc", FIRST)
            assert first and server.wait(first) == "ready", "the undisturbed build failed: " + str(told.problems)
            self.expected = {"first": tiles(os.path.join(server.data, "datasets", first, "dataset.sqlite"))}
            server.stop()
        with self.counted_use() as (server, told):
            second = [d for d, which in told.accepted.items() if which == "second"]
            assert second and not told.problems, "the undisturbed run failed: " + str(told.problems)
            self.expected["second"] = tiles(os.path.join(server.data, "datasets", second[0], "dataset.sqlite"))

    @contextlib.contextmanager
    def counted_use(self):
        """A run that nothing disturbs, to be looked at before its server ends: how long it takes, and its calls by kind."""
        with processes.folder("cordillera-crash-") as folder:
            counter, log = self.counter(folder), os.path.join(folder, "calls")
            start = time.monotonic()
            server = Server(self.program, folder, self.shim, {"FAULT_COUNTER": counter, "FAULT_LOG": log})
            told = Told()
            self.use(server, told)
            self.seconds = time.monotonic() - start
            yield server, told
            assert server.stop() == 0, "the server did not end by itself"
            self.calls = self.counted(counter)
            with open(log) as lines:
                self.kinds = dict(collections.Counter(line.split()[1] for line in lines))

    def finding(self, where, what):
        self.findings.append("%s: %s" % (where, what))
        print("FINDING", self.findings[-1], flush=True)

    def look(self, where, server, told):
        """After a restart on a disk that works."""
        if not server.started():
            return self.finding(where, "the server does not start again")
        for dataset, which in told.accepted.items():
            if dataset in told.deleted:
                if server.state(dataset) is not None:
                    self.finding(where, "a deleted dataset came back")
                continue
            state = server.wait(dataset)
            if state is None and dataset == told.deleting:
                continue  # the delete was done, its answer was lost
            if state != "ready":
                self.finding(where, "%s, which was accepted, is %s: %s" % (which, state, server.ask("GET", "/v1/datasets/" + dataset)[2][:600]))
                continue
            store = os.path.join(server.data, "datasets", dataset, "dataset.sqlite")
            if tiles(store) != self.expected[which]:
                self.finding(where, "%s has other tiles than an undisturbed build" % which)
            else:
                self.survived += 1
        self.look_at_folder(where, server)

    def look_at_folder(self, where, server):
        listed = {d["id"]: d["state"] for d in json.loads(server.ask("GET", "/v1/datasets")[2])["datasets"]}
        for dataset in listed:
            server.wait(dataset)  # accepted, though the answer was lost
        there = set(os.listdir(os.path.join(server.data, "datasets")))
        if there - set(listed):
            self.finding(where, "folders without a dataset: %s" % (there - set(listed)))
        if os.listdir(os.path.join(server.data, "incoming")):
            self.finding(where, "uploads that nobody sends any more are kept")
        for dataset in there & set(listed):
            left = set(os.listdir(os.path.join(server.data, "datasets", dataset))) - {"dataset.sqlite", "dataset.json"}
            end = time.monotonic() + PATIENCE_S  # removed after the state is set
            while left and time.monotonic() < end:
                time.sleep(0.01)
                left = set(os.listdir(os.path.join(server.data, "datasets", dataset))) - {"dataset.sqlite", "dataset.json"}
            if left:
                self.finding(where, "a finished dataset keeps %s" % left)

    def checked(self, where, data):
        ended = subprocess.run([self.program, "check", data], capture_output=True, text=True)
        if ended.returncode != 0:
            self.finding(where, "check: " + (ended.stdout + ended.stderr)[:600])

    def restarted(self, where, folder, told):
        server = Server(self.program, folder)
        try:
            self.look(where, server, told)
        except Gone:
            self.finding(where, "the server ended after the restart")
        finally:
            server.stop()
        self.checked(where, server.data)

    def kill_at(self, point, kind):
        where = "%s at call %d" % (kind, point)
        with processes.folder("cordillera-crash-") as folder:
            told = Told()
            server = Server(self.program, folder, self.shim, {"FAULT_COUNTER": self.counter(folder), "FAULT_AT": str(point), "FAULT_KIND": kind})
            try:
                if server.started():
                    self.use(server, told)
            except Gone:
                pass
            finally:
                server.kill()
            if kind == "job" and told.problems:
                self.finding(where, "a job that was killed was answered with %s" % told.problems)
            self.restarted(where, folder, told)
        self.runs[kind] = self.runs.get(kind, 0) + 1

    def kill_after(self, seconds):
        where = "kill after %.3f s" % seconds
        with processes.folder("cordillera-crash-") as folder:
            told, upload = Told(), []
            server = Server(self.program, folder)
            timer = threading.Timer(seconds, lambda: os.kill(server.process.pid, signal.SIGKILL))
            timer.start()
            try:
                if server.started():
                    self.use(server, told, upload.append)
            except Gone:
                pass
            finally:
                timer.cancel()
                server.kill()
            self.restarted(where, folder, told)
        self.runs["random"] = self.runs.get("random", 0) + 1

    def fail_from(self, point, kind):
        where = "%s from call %d" % (kind, point)
        with processes.folder("cordillera-crash-") as folder:
            told, full = Told(), os.path.join(folder, "full")
            open(full, "w").close()
            fault = {"FAULT_COUNTER": self.counter(folder), "FAULT_AT": str(point), "FAULT_KIND": kind, "FAULT_FULL": full}
            mender = threading.Timer(1.0, lambda: os.path.exists(full) and os.remove(full))  # the disk is well again
            server = Server(self.program, folder, self.shim, fault)
            try:
                if server.started():
                    mender.start()
                    self.use(server, told)
                    if server.ask("GET", "/healthz")[0] != 200:
                        self.finding(where, "the server is not well")
                    for status, slug in told.problems:
                        if slug not in DISK_SLUGS or status < 500:
                            self.finding(where, "the disk's fault was answered with %d %s" % (status, slug))
                    for dataset, which in told.accepted.items():
                        if dataset not in told.deleted and server.wait(dataset) == "failed":
                            self.finding(where, "an accepted upload failed for the disk's fault: %s" % server.ask("GET", "/v1/datasets/" + dataset)[2][:600])
                elif server.process.returncode not in (1, 0):
                    self.finding(where, "the server did not refuse a disk like this, it ended with %d" % server.process.returncode)
            except Gone:
                self.finding(where, "the server ended")
            finally:
                mender.cancel()
                server.kill()
            self.restarted(where, folder, told)
        self.runs[kind] = self.runs.get(kind, 0) + 1


def spread(count, calls, everything):
    if everything or count >= calls:
        return range(1, calls + 1)
    return sorted({1 + k * (calls - 1) // max(1, count - 1) for k in range(count)})


def told(loop, start):
    print("%s; %d accepted datasets came through, with the tiles of an undisturbed build; %d findings; %.0f s" %
          (", ".join("%d %s" % (n, k) for k, n in loop.runs.items()), loop.survived, len(loop.findings), time.monotonic() - start), flush=True)
    return 1 if loop.findings else 0


def main(kind=Loop, about=__doc__):
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("shim")
    parser.add_argument("--points", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=0, help="points at which only the job is killed")
    parser.add_argument("--random", type=int, default=0)
    parser.add_argument("--faults", type=int, default=0)
    parser.add_argument("--all", action="store_true", help="every point, for those of --points, --jobs and --faults that are not 0")
    parser.add_argument("--hours", type=float, default=0)
    parser.add_argument("--seed", type=int, default=1)
    words = parser.parse_args()
    loop = kind(os.path.abspath(words.program), os.path.abspath(words.shim), words.seed)
    start = time.monotonic()
    loop.undisturbed()
    print("%d calls in an undisturbed run of %.2f s: %s" % (loop.calls, loop.seconds, ", ".join("%d %s" % (n, k) for k, n in sorted(loop.kinds.items()))), flush=True)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(told(loop, start)))  # so far
    if words.points:
        for point in spread(words.points, loop.calls, words.all):
            loop.kill_at(point, "kill")
    if words.jobs:
        for point in spread(words.jobs, loop.calls, words.all):
            loop.kill_at(point, "job")
    if words.faults:
        for k, point in enumerate(spread(words.faults, loop.calls, words.all)):
            for kind in ("enospc", "eio") if words.all else (("enospc", "eio")[k % 2],):
                loop.fail_from(point, kind)
    end = start + 3600 * words.hours
    done = 0
    while done < words.random or time.monotonic() < end:
        loop.kill_after(loop.random.uniform(0, 1.1 * loop.seconds))
        done += 1
    return told(loop, start)


if __name__ == "__main__":
    sys.exit(main())
