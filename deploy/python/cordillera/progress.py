"""How a build stands, and the stream that says so."""
from __future__ import annotations

import http.client
import json
from dataclasses import dataclass
from typing import Any, Callable, Iterable, Iterator, Mapping, Optional, Tuple

from .connection import TIMEOUT_S, Answer, Connection
from .patience import Deadline
from .problem import Problem

_FIRST_LOOK_S = 1.0  # also where there is no time: who gives timeout=0 wants to know how it stands


@dataclass(frozen=True)
class Progress:
    stage: str
    """queued, fetch, provisional, open, plan, build, merge or publish"""
    done: float
    total: float
    """of this stage"""
    seconds_left: Optional[float]
    """of this stage; None until it can be estimated"""
    share: float = 0.0
    """of all stages together, 0 to 1; it never falls"""
    place: Optional[int] = None
    """in the queue, 1 is next; None once the build has begun"""

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> Progress:
        def number(name: str) -> Optional[float]:
            value = fields.get(name)
            return float(value) if isinstance(value, (int, float)) else None

        place = number("place")
        return cls(str(fields.get("stage", "queued")), number("done") or 0.0, number("total") or 0.0, number("seconds_left"),
                   number("share") or 0.0, None if place is None else int(place))


def events(lines: Iterable[bytes]) -> Iterator[Tuple[str, str]]:
    """(name, data) of each event of a stream; one that is cut off is none."""
    name, data = "message", []  # type: str, list[str]
    for raw in lines:
        line = raw.rstrip(b"\r\n").decode("utf-8", "replace")
        if not raw.endswith(b"\n"):
            return
        if not line:
            if data:
                yield name, "\n".join(data)
            name, data = "message", []
            continue
        field, _, value = line.partition(":")
        value = value[1:] if value.startswith(" ") else value
        if field == "event":
            name = value
        elif field == "data":
            data.append(value)


def ended(status: Mapping[str, Any]) -> bool:
    """Whether a dataset is as far as it comes by itself: ready, or lazy and with tiles to look at. Problem: its build has failed.

    A change of its rasters that has failed leaves it ready, as it was before.
    """
    if status.get("build") == "lazy" and status.get("provisional") is True:
        return True
    if status.get("state") == "failed":
        raise Problem.of(status.get("error") or {})
    return status.get("state") == "ready" and not (status.get("updates") or {}).get("pending")


class _Refused(Exception):
    def __init__(self, problem: Problem) -> None:
        self.problem = problem


def _status(connection: Connection, path: str) -> Any:
    answer = connection.once("GET", path)
    if answer.status != 200:
        raise _Refused(connection.problem(answer))
    return answer.json()


def _lines(connection: Connection, path: str, alive: Callable[[], None], until: Deadline) -> Iterator[bytes]:
    """Of the events of one connection. Each is a sign of life, the comments of a quiet time too."""
    socket = connection.open(min(TIMEOUT_S, max(until.left_s(), _FIRST_LOOK_S)))
    wire = socket.sock
    try:
        socket.request("GET", connection.path(path + "/events"), headers=connection.headers({"Accept": "text/event-stream"}))
        with socket.getresponse() as answer:
            if answer.status != 200:
                raise _Refused(connection.problem(Answer(answer.status, answer.headers, answer.read())))
            for line in answer:
                alive()
                yield line
                wire.settimeout(min(TIMEOUT_S, max(until.left_s(), 0.001)))
    finally:
        socket.close()


def _told(connection: Connection, path: str, alive: Callable[[], None], until: Deadline) -> Iterator[Tuple[str, Any]]:
    """Events, and two that are the status itself: "lazy" when there may be tiles to look at, and "status" in place of a stream. A stream
    begins with how the dataset stands: whoever comes late has missed none that matter."""
    tiles = False
    try:
        for name, data in events(_lines(connection, path, alive, until)):
            fields = json.loads(data)
            yield name, fields
            tiles = tiles or name == "tiles"
            if tiles and name == "progress" and fields.get("build") == "lazy":
                yield "lazy", _status(connection, path)
    except _Refused as refused:
        if refused.problem.status in (429, 503):  # too many streams, or a proxy without them
            yield "status", _status(connection, path)
            alive()
        raise


def follow(connection: Connection, path: str, timeout_s: Optional[float] = None) -> Iterator[Progress]:
    """Until the dataset at path has ended(), however often the connection breaks. TimeoutError: not within timeout_s."""
    patience, until = connection.patience(), Deadline(timeout_s)
    while True:
        try:
            for name, fields in _told(connection, path, patience.moved, until):
                shown = fields.get("progress") if name == "status" else fields if name == "progress" else None
                if shown:
                    yield Progress.of(shown)
                if name == "failed":
                    raise Problem.of(fields)
                if name in ("ready", "lazy", "status") and ended(fields):
                    return
                until.check()
            trouble = Problem("connection-broken", "the stream of events ended before the build")
        except (OSError, http.client.HTTPException) as error:
            until.check()
            trouble = connection.unreachable(error)
        except _Refused as refused:
            trouble = refused.problem
        if not patience.helps(trouble, until):
            raise trouble
        until.check()
