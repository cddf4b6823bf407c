"""How a build stands, and the stream that says so."""
from __future__ import annotations

import http.client
import json
from dataclasses import dataclass
from typing import Any, Iterable, Iterator, Mapping, Optional, Tuple

from .connection import Connection
from .problem import Problem


@dataclass(frozen=True)
class Progress:
    stage: str
    """queued, open, provisional, plan, build, merge or publish"""
    done: float
    total: float
    seconds_left: Optional[float]
    """of this stage; None until it can be estimated"""

    @property
    def share(self) -> float:
        return self.done / self.total if self.total > 0 else 0.0

    @classmethod
    def of(cls, fields: Mapping[str, Any]) -> Progress:
        def number(name: str) -> Optional[float]:
            value = fields.get(name)
            return float(value) if isinstance(value, (int, float)) else None

        return cls(str(fields.get("stage", "queued")), number("done") or 0.0, number("total") or 0.0, number("seconds_left"))


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
    """Whether a dataset is ready. Problem: it has failed, or the last change of its rasters has."""
    if status.get("state") == "failed":
        raise Problem.of(status.get("error") or {})
    updates = status.get("updates") or {}
    if status.get("state") != "ready" or updates.get("pending"):
        return False
    if (updates.get("last") or {}).get("error"):
        raise Problem.of(updates["last"]["error"])
    return True


def _stream(connection: Connection, path: str) -> Iterator[Tuple[str, Any]]:
    """The events of one connection, after the status: whoever comes late has missed none that matter."""
    socket = connection.open()
    try:
        socket.request("GET", connection.path(path + "/events"), headers=connection.headers({"Accept": "text/event-stream"}))
        answer = socket.getresponse()
        if answer.status != 200:
            raise Problem.in_body(answer.status, answer.read(), connection.url)
        for name, data in events(answer):
            yield name, json.loads(data)
    finally:
        socket.close()


def follow(connection: Connection, path: str) -> Iterator[Progress]:
    """Until the dataset at path is ready, however often the connection breaks."""
    patience = connection.patience()
    while True:
        try:
            for name, fields in _stream(connection, path):
                patience.moved()
                if name == "progress":
                    yield Progress.of(fields)
                elif name == "failed":
                    raise Problem.of(fields)
                elif name == "ready" and ended(fields):
                    return
            trouble = Problem("connection-broken", "the stream of events ended before the build")
        except (OSError, http.client.HTTPException) as error:
            trouble = connection.unreachable(error)
        except Problem as problem:
            if problem.status < 300:
                raise
            trouble = problem
        if not patience.helps(trouble):
            raise trouble
