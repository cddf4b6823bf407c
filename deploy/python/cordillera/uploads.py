"""Rasters on their way to a service: small ones in one request, large ones in parts that survive what breaks."""
from __future__ import annotations

import base64
import hashlib
import http.client
import io
import json
import os
import secrets
from pathlib import Path
from typing import BinaryIO, Callable, Optional

from .connection import Answer, Connection
from .problem import Problem

PART = 32 << 20
WHOLE = 64 << 20
"""Larger rasters go in parts."""
Sent = Callable[[int, int], None]
"""sent(bytes, of bytes), as they go."""


class Note:
    """Which upload has a file's bytes, kept beyond this process: who asks again goes on where it stood."""

    def __init__(self, purpose: str, identity: str) -> None:
        state = os.environ.get("XDG_STATE_HOME") or os.path.join(Path.home(), ".local", "state")
        self._path = Path(state) / "cordillera" / "uploads" / ("python-" + hashlib.sha256(purpose.encode()).hexdigest()[:32] + ".json")
        self._identity = identity

    def read(self) -> Optional[str]:
        try:
            kept = json.loads(self._path.read_text())
            return str(kept["upload"]) if kept["identity"] == self._identity else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def keep(self, upload: str) -> None:
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            part = self._path.with_suffix(f".{secrets.token_hex(4)}")
            with open(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w") as file:  # without tokens an upload is whoever's knows its name
                json.dump({"upload": upload, "identity": self._identity}, file)
            os.replace(part, self._path)
        except OSError:
            pass  # then a new process begins anew

    def remove(self) -> None:
        try:
            self._path.unlink()
        except OSError:
            pass


def identity(file: BinaryIO) -> str:
    """Of its bytes: a file that was written to is another, even at the same size and time."""
    sums = hashlib.sha256()
    file.seek(0)
    while piece := file.read(1 << 20):
        sums.update(piece)
    return sums.hexdigest()


def _offset(answer: Answer, size: int) -> int:
    text = answer.headers.get("Upload-Offset") or ""
    if not text.isdigit() or int(text) > size:
        raise Problem("answer-unknown", "the service does not say how much of the upload it has", status=answer.status)
    return int(text)


def send_whole(connection: Connection, file: BinaryIO, target: str) -> Answer:
    """The answer may get lost: asked again, the service gives the same dataset."""
    headers = {"Idempotency-Key": "cordillera-" + secrets.token_hex(13), "Content-Type": "application/octet-stream"}
    file.seek(0)
    return connection.ask("POST", target, headers, file.read())


def send_parts(connection: Connection, file: BinaryIO, name: str, target: str, purpose: str, sent: Sent) -> tuple[Answer, Note]:
    """The note is to be removed once the dataset is known."""
    note = Note(purpose, identity(file))
    size = file.seek(0, io.SEEK_END)
    upload = note.read()
    offset = 0
    if upload is not None:
        try:
            offset = _offset(connection.ask("HEAD", "/v1/uploads/" + upload), size)
        except Problem as problem:
            if problem.status == 0:
                raise
            try:  # a dataset was made of it, and only the answer is missing; or the service has forgotten it
                return connection.ask("POST", f"{target}&upload={upload}"), note
            except Problem:
                upload = None
    if upload is None:
        words = {"Tus-Resumable": "1.0.0", "Upload-Length": str(size), "Upload-Metadata": "filename " + base64.b64encode(name.encode()).decode()}
        begun = connection.ask("POST", "/v1/uploads", words)
        upload = (begun.headers.get("Location") or "").rsplit("/", 1)[-1]
        note.keep(upload)
    _send_rest(connection, file, upload, offset, sent)
    return connection.ask("POST", f"{target}&upload={upload}"), note


def _send_rest(connection: Connection, file: BinaryIO, upload: str, offset: int, sent: Sent) -> None:
    path, size, patience = "/v1/uploads/" + upload, file.seek(0, io.SEEK_END), connection.patience()
    while offset < size:
        file.seek(offset)
        headers = {"Tus-Resumable": "1.0.0", "Upload-Offset": str(offset), "Content-Type": "application/offset+octet-stream"}
        try:
            answer = connection.once("PATCH", path, headers, file.read(min(PART, size - offset)))
            trouble = None if answer.status == 204 else Problem.in_body(answer.status, answer.body, connection.url)
        except (OSError, http.client.HTTPException) as error:
            trouble = connection.unreachable(error)
        if trouble is not None:
            if not patience.helps(trouble):
                raise trouble
            answer = connection.ask("HEAD", path)  # what came before the connection broke is kept
        stands = _offset(answer, size)
        if stands > offset:
            patience.moved()
        offset = stands
        sent(offset, size)
