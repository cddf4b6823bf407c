"""A server of the program under test, and what a user does with it."""
import hashlib
import http.client
import json
import os
import random
import signal
import socket
import sqlite3
import subprocess
import sys
import time

sys.path.insert(1, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import processes  # noqa: E402

PATIENCE_S = 120  # longer than the slowest machine needs; the time never decides


class Gone(Exception):
    """The server ended in the middle of a request."""


def cone(size=40, height=900):
    """An Esri ASCII grid."""
    rows = ["ncols %d" % size, "nrows %d" % size, "xllcorner 10", "yllcorner 46", "cellsize 0.0083333333333333", "NODATA_value -9999"]
    middle = (size - 1) / 2
    for r in range(size):
        rows.append(" ".join("%.3f" % (height - 20 * ((r - middle) ** 2 + (c - middle) ** 2) ** 0.5) for c in range(size)))
    return ("\n".join(rows) + "\n").encode()


def noise(size):
    """An Esri ASCII grid of which nothing can be left out: its build takes its time, and its meshes are large."""
    numbers = random.Random(1)
    head = "ncols %d\nnrows %d\nxllcorner 10\nyllcorner 46\ncellsize 0.0008333333333333\nNODATA_value -9999\n" % (size, size)
    return (head + "\n".join(" ".join("%d" % numbers.randrange(1000, 1400) for _ in range(size)) for _ in range(size)) + "\n").encode()


class Server:
    """`cordillera serve` on a folder; fault: variables of fault.c; options: further words; limits: called in the process before the program."""

    def __init__(self, program, folder, shim=None, fault=None, options=(), limits=None):
        self.folder, self.data = folder, os.path.join(folder, "data")
        environment = {k: v for k, v in os.environ.items() if not k.startswith("CORDILLERA_") or k == "CORDILLERA_CACHE"}
        if fault is not None:
            environment.update(fault, LD_PRELOAD=shim, FAULT_FOLDER=self.data)
            environment["CORDILLERA_JOB_ENVIRONMENT"] = ",".join(["LD_PRELOAD", "FAULT_FOLDER", *fault])
        self.log = open(os.path.join(folder, "log"), "a+b")
        at = self.log.seek(0, os.SEEK_END)
        self.process = processes.start(
            [program, "serve", "--listen", "127.0.0.1:0", "--data", self.data, "--threads", "1", "--device", "cpu", *options],
            env=environment, stderr=self.log, stdin=subprocess.DEVNULL, limits=limits)
        self.port = None
        while self.port is None and self.process.poll() is None:
            with open(os.path.join(folder, "log"), "rb") as log:
                log.seek(at)
                said = log.read().decode(errors="replace")
            mark = said.find("http://127.0.0.1:")
            if mark >= 0 and said.find("/", mark + 7) > 0:
                self.port = int(said[mark + 17:said.index("/", mark + 17)])
            else:
                time.sleep(0.003)

    def started(self):
        return self.port is not None

    def ask(self, method, path, body=None, headers=None):
        """Status, headers (names in lower case) and body; Gone if the server went away."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        try:
            connection.request(method, path, body, headers or {})
            answer = connection.getresponse()
            return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
        except (OSError, http.client.HTTPException) as error:
            if isinstance(error, socket.timeout):
                raise
            raise Gone() from error
        finally:
            connection.close()

    def state(self, dataset):
        status, _, body = self.ask("GET", "/v1/datasets/" + dataset)
        return json.loads(body)["state"] if status == 200 else None

    def wait(self, dataset):
        """ready, failed, or None when there is no such dataset."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            state = self.state(dataset)
            if state in ("ready", "failed", None):
                return state
            time.sleep(0.01)
        raise AssertionError("dataset %s does not come to an end: %s" % (dataset, self.ask("GET", "/v1/datasets/" + dataset)[2]))

    def kill(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.log.close()

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(PATIENCE_S)
        self.log.close()
        return code


def tiles(store):
    """One hash over every tile of a store: address, .drc and record, of which the .glb is made."""
    database = sqlite3.connect("file:%s?mode=ro&immutable=1" % store, uri=True)
    digest = hashlib.sha256()
    rows = database.execute("SELECT t.level, t.y, t.x, d.bytes, t.record FROM tiles t JOIN blobs d ON d.hash = t.drc ORDER BY 1, 2, 3")
    for level, y, x, drc, record in rows:
        digest.update(b"%d/%d/%d " % (level, y, x))
        digest.update(drc)
        digest.update(record)
    database.close()
    return digest.hexdigest()
