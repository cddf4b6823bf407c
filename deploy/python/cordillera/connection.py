"""One address, asked again and again while it is away. Standard library alone, no proxies, no redirects."""
from __future__ import annotations

import http.client
import json
import threading
import time
import urllib.parse
from typing import IO, Any, Callable, Mapping, Optional, Union

from .problem import Problem

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.25, 10.0
_TIMEOUT_S = 120.0  # without a byte
_PASSES_BY = (408, 429, 502, 503, 504)
# Of our own earlier request, whose connection broke and whose end the service has not noticed yet.
_OURS = ("upload-conflict", "idempotency-key-in-use")

Body = Union[bytes, IO[bytes], None]


class Answer:
    def __init__(self, status: int, headers: http.client.HTTPMessage, body: bytes) -> None:
        self.status, self.headers, self.body = status, headers, body

    def json(self) -> Any:
        return json.loads(self.body)


class Connection:
    """patience_s: how long a service may be away without any progress before that is a Problem."""

    def __init__(self, url: str, token: Optional[str], patience_s: float) -> None:
        parts = urllib.parse.urlsplit(url if "://" in url else "http://" + url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError(f"{url!r} is no address of a service: http://HOST:PORT is wanted")
        self.url = f"{parts.scheme}://{parts.netloc}{parts.path.rstrip('/')}"
        self._scheme, self._host, self._base = parts.scheme, parts.netloc, parts.path.rstrip("/")
        self._token, self._patience_s = token, patience_s
        self._here = threading.local()  # a socket a thread

    def open(self, timeout_s: float = _TIMEOUT_S) -> http.client.HTTPConnection:
        if self._scheme == "https":
            return http.client.HTTPSConnection(self._host, timeout=timeout_s)
        return http.client.HTTPConnection(self._host, timeout=timeout_s)

    def headers(self, more: Mapping[str, str]) -> dict[str, str]:
        given = {"User-Agent": "cordillera-python", **more}
        if self._token:
            given["Authorization"] = "Bearer " + self._token
        return given

    def path(self, path: str) -> str:
        return self._base + path

    def once(self, method: str, path: str, headers: Mapping[str, str] = {}, body: Body = None) -> Answer:
        """One try. A kept socket that the service has closed meanwhile is opened anew. OSError, HTTPException: no answer."""
        kept: Optional[http.client.HTTPConnection] = getattr(self._here, "socket", None)
        if body is not None and not isinstance(body, bytes):
            kept = None  # what was read of a file would have to be read again
        for socket in ([kept] if kept else []) + [self.open()]:
            try:
                socket.request(method, self.path(path), body=body, headers=self.headers(headers))
                answer = socket.getresponse()
                data = answer.read()
            except (OSError, http.client.HTTPException):
                socket.close()
                if socket is kept:
                    continue
                raise
            self._here.socket = socket
            return Answer(answer.status, answer.headers, data)
        raise AssertionError("a new socket ends the loop")

    def ask(self, method: str, path: str, headers: Mapping[str, str] = {}, body: Body = None) -> Answer:
        """Until an answer is there that asking again would not better. Problem: any status from 300 on."""
        patience = Patience(self._patience_s)
        while True:
            try:
                answer = self.once(method, path, headers, body)
            except (OSError, http.client.HTTPException) as error:
                trouble = self.unreachable(error)
            else:
                if answer.status < 300:
                    return answer
                trouble = Problem.in_body(answer.status, answer.body, self.url)
            if not patience.helps(trouble):
                raise trouble

    def patience(self) -> Patience:
        return Patience(self._patience_s)

    def unreachable(self, error: Exception) -> Problem:
        return Problem("service-unreachable", f"no service answers at {self.url}: {error or type(error).__name__}")


class Patience:
    def __init__(self, seconds: float, sleep: Callable[[float], None] = time.sleep) -> None:
        self._seconds, self._sleep = seconds, sleep
        self.moved()

    def moved(self) -> None:
        """Something has come: the time begins anew."""
        self._end, self._pause = time.monotonic() + self._seconds, _FIRST_PAUSE_S

    def helps(self, trouble: Problem) -> bool:
        """Waits a while and says True, if asking again may help and there is time for it."""
        if not (trouble.status == 0 or trouble.status in _PASSES_BY or trouble.type in _OURS):
            return False
        if time.monotonic() + self._pause > self._end:
            return False
        self._sleep(self._pause)
        self._pause = min(2 * self._pause, _LONGEST_PAUSE_S)
        return True
