"""What the cases share: the list of them, servers that end with the run, and raw bytes to a server."""
import dataclasses
import os
import re
import socket
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "crash"))
from client import Server  # noqa: E402

PATIENCE_S = 60  # for an answer; longer than the slowest machine needs, so the time never decides
CASES = []


def eventually(condition, pause_s=0.02):
    """Whether it comes to hold."""
    end = time.monotonic() + PATIENCE_S
    while not (holds := condition()) and time.monotonic() < end:
        time.sleep(pause_s)
    return holds


@dataclasses.dataclass
class Case:
    name: str          # begins with the finding's number
    expected: str      # as the table shows it
    run: object        # takes an Attack, returns what was seen
    holds: object      # takes what was seen, says whether that is as expected
    minutes: bool      # takes minutes: only with --long
    module: str = ""


def case(name, expect, holds=None, minutes=False):
    """Decorates a function that takes an Attack and returns what it saw. Without holds, that must be what is expected, as text."""

    def register(function):
        as_expected = holds or (lambda seen: str(seen) == expect)
        CASES.append(Case(name, expect, function, as_expected, minutes, function.__module__.rsplit(".", 1)[-1]))
        return function

    return register


class Attack:
    """One run: a server that all cases share, and further ones that end with their case."""

    def __init__(self, program):
        self.program = program
        self._folder = tempfile.TemporaryDirectory(prefix="attack")
        self._shared, self._own, self._started = None, [], 0

    @property
    def server(self):
        """Without options. A case must leave it as it was, but for datasets."""
        if self._shared is None or self._shared.process.poll() is not None:
            self._shared = self._start("shared", (), None)
        return self._shared

    def start(self, options=(), limits=None, folder=None):
        """A server of the case's own; limits: called in the process before the program; folder: of an earlier one, to start again there."""
        server = self._start(folder or os.path.basename(self.next_folder()), options, limits)
        self._own.append(server)
        self._started += 1  # never again: a case must not find what another left
        return server

    def next_folder(self):
        """Where the next server of the case's own will have its log and its data."""
        return os.path.join(self._folder.name, "own%d" % self._started)

    def _start(self, name, options, limits):
        folder = os.path.join(self._folder.name, name)
        os.makedirs(folder, exist_ok=True)
        server = Server(self.program, folder, options=options, limits=limits)
        if not server.started():
            with open(os.path.join(folder, "log"), errors="replace") as log:
                raise AssertionError("the server does not start: " + log.read()[-2000:])
        return server

    def end_case(self):
        for server in self._own:
            server.kill()
        self._own = []

    def end(self):
        self.end_case()
        if self._shared is not None:
            self._shared.kill()
        self._folder.cleanup()


def connect(server):
    return socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S)


def received(client):
    """All that comes until the other side closes."""
    seen = b""
    try:
        while piece := client.recv(65536):
            seen += piece
    except ConnectionResetError:
        pass  # after the last answer, with bytes of ours unread
    return seen


def exchange(server, sent):
    """Sends the bytes and returns all that comes until the server closes: the last request must ask for that, or be refused."""
    with connect(server) as client:
        client.sendall(sent)
        return received(client)


def statuses(answers):
    """'200 404': the statuses in a connection's bytes; '-' if there is none."""
    found = re.findall(r"HTTP/1\.1 ([0-9]{3}) ", answers.decode("latin-1"))
    return " ".join(found) or "-"


def request(line, headers="", body=b"", host="localhost"):
    """A request that asks for the end of its connection."""
    head = "%s HTTP/1.1\r\nHost: %s\r\n%sConnection: close\r\n\r\n" % (line, host, headers)
    return head.encode("latin-1") + body
