"""One address, asked again and again while it is away. Standard library alone, no proxies, no redirects."""
from __future__ import annotations

import collections
import contextlib
import http.client
import json
import os
import urllib.parse
from email.message import Message
from typing import Any, Mapping, Optional

from .patience import Patience
from .problem import Problem

TIMEOUT_S = 120.0
"""without a byte"""
_CONNECT_S = 10.0


class Answer:
    def __init__(self, status: int, headers: Message, body: bytes) -> None:
        self.status, self.headers, self.body = status, headers, body

    def json(self) -> Any:
        return json.loads(self.body)


class Connection:
    """patience_s: how long a service may be away without any progress before that is a Problem. Threads may share one."""

    def __init__(self, url: str, token: Optional[str], patience_s: float) -> None:
        self._idle: collections.deque[http.client.HTTPConnection] = collections.deque()
        self._process = os.getpid()
        self._reached = False
        parts = urllib.parse.urlsplit(url if "://" in url else "http://" + url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError(f"{url!r} is no address of a service: http://HOST:PORT is wanted")
        self.url = f"{parts.scheme}://{parts.netloc}{parts.path.rstrip('/')}"
        self._scheme, self._host, self._base = parts.scheme, parts.netloc, parts.path.rstrip("/")
        self._token, self._patience_s = token, patience_s

    def close(self) -> None:
        """The sockets that wait for another call. A later call opens one anew."""
        with contextlib.suppress(IndexError):
            while True:
                self._idle.pop().close()

    def __del__(self) -> None:
        self.close()

    def open(self, limit_s: float = TIMEOUT_S) -> http.client.HTTPConnection:
        """A new connection, without a byte for limit_s at most. OSError: none could be made."""
        kind = http.client.HTTPSConnection if self._scheme == "https" else http.client.HTTPConnection
        socket: http.client.HTTPConnection = kind(self._host, timeout=min(_CONNECT_S, limit_s))
        try:
            socket.connect()
        except BaseException:
            socket.close()
            raise
        self._reached = True
        socket.sock.settimeout(limit_s)
        return socket

    def headers(self, more: Mapping[str, str]) -> dict[str, str]:
        given = {"User-Agent": "cordillera-python", **more}
        if self._token:
            given["Authorization"] = "Bearer " + self._token
        return given

    def path(self, path: str) -> str:
        return self._base + path

    def once(self, method: str, path: str, headers: Mapping[str, str] = {}, body: Optional[bytes] = None) -> Answer:
        """One try. A kept socket that the service has closed meanwhile is opened anew. OSError, HTTPException: no answer."""
        kept = self._kept()
        if kept is not None:
            try:
                return self._exchange(kept, method, path, headers, body)
            except (OSError, http.client.HTTPException) as error:
                if not _of_network(error):
                    raise
        return self._exchange(self.open(), method, path, headers, body)

    def ask(self, method: str, path: str, headers: Mapping[str, str] = {}, body: Optional[bytes] = None) -> Answer:
        """Until an answer is there that asking again would not better. Problem: any status from 300 on."""
        patience = self.patience()
        while True:
            try:
                answer = self.once(method, path, headers, body)
            except (OSError, http.client.HTTPException) as error:
                trouble = self.unreachable(error)
            else:
                if answer.status < 300:
                    return answer
                trouble = self.problem(answer)
            if not patience.helps(trouble):
                raise trouble

    def patience(self) -> Patience:
        return Patience(self._patience_s)

    def problem(self, answer: Answer) -> Problem:
        return Problem.in_answer(answer.status, answer.headers, answer.body, self.url)

    def unreachable(self, error: Exception) -> Problem:
        """The problem that asking again may help. One that does not is raised: the address of a service that was never there is wrong."""
        if not _of_network(error):
            raise error
        problem = Problem("service-unreachable", f"no service answers at {self.url}: {error or type(error).__name__}")
        if not self._reached:
            raise problem from error
        return problem

    def _kept(self) -> Optional[http.client.HTTPConnection]:
        if self._process != os.getpid():  # after a fork these are the parent's: what is closed here stays open there
            self.close()
            self._process = os.getpid()
        try:
            return self._idle.pop()
        except IndexError:
            return None

    def _exchange(self, socket: http.client.HTTPConnection, method: str, path: str, headers: Mapping[str, str],
                  body: Optional[bytes]) -> Answer:
        try:
            socket.request(method, self.path(path), body=body, headers=self.headers(headers))
            answer = socket.getresponse()
            data = answer.read()
        except BaseException:
            socket.close()
            raise
        if socket.sock is not None:
            self._idle.append(socket)
        return Answer(answer.status, answer.headers, data)


def _of_network(error: Exception) -> bool:
    """What the handler of a signal raises may be an OSError, too, such as TimeoutError. That is for its caller."""
    at = error.__traceback__
    while at is not None and at.tb_next is not None:
        at = at.tb_next
    return at is None or at.tb_frame.f_globals.get("__name__") in ("http.client", "socket", "ssl")
