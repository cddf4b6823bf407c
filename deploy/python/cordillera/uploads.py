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
from typing import Any, BinaryIO, Callable, Dict, Mapping, NamedTuple, Optional, Tuple

from . import words
from .connection import Answer, Connection
from .problem import Problem
from .rasters import Opened, Raster, opened

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


Sending = Tuple[Dict[str, Any], Callable[[], None]]
"""What the service answers, and what is to be called once that is kept: until then the same call goes on with the same bytes."""
WANTED = "a raster, or source= with its address, is wanted"


def nobody(done: int, total: int) -> None:
    pass


class Way(NamedTuple):
    """How rasters go."""
    resume: bool = False
    """In parts, however small."""
    sent: Sent = nobody


def _no_note() -> None:
    pass


def send(connection: Connection, method: str, path: str, raster: Optional[Raster], options: Mapping[str, words.Option],
         way: Way) -> Sending:
    """Without a raster the options name one (source=), or need none."""
    if raster is None:
        return dict(_send_whole(connection, method, path + "?" + words.query(options), None).json()), _no_note
    name = options.get("name")
    with opened(raster, name if isinstance(name, str) else None) as given:
        target = path + "?" + words.query({**options, "name": given.name})
        if not way.resume and given.file.seek(0, io.SEEK_END) <= WHOLE:
            given.file.seek(0)
            return dict(_send_whole(connection, method, target, given.file.read()).json()), _no_note
        note = Note(f"{connection.url}\n{path}\n{given.place}", identity(given.file))
        return dict(_send_parts(connection, given, method, target, note, way.sent).json()), note.remove


def _send_whole(connection: Connection, method: str, target: str, raster: Optional[bytes]) -> Answer:
    """The answer may get lost: asked again, the service gives the same dataset."""
    headers = {"Idempotency-Key": "cordillera-" + secrets.token_hex(13)}
    if raster is not None:
        headers["Content-Type"] = "application/octet-stream"
    return connection.ask(method, target, headers, raster)


def _send_parts(connection: Connection, given: Opened, method: str, target: str, note: Note, sent: Sent) -> Answer:
    size = given.file.seek(0, io.SEEK_END)
    upload = note.read()
    offset = 0
    if upload is not None:
        try:
            offset = _offset(connection.ask("HEAD", "/v1/uploads/" + upload), size)
        except Problem as problem:
            if problem.status == 0:
                raise
            try:  # a dataset was made of it, and only the answer is missing; or the service has forgotten it
                return connection.ask(method, f"{target}&upload={upload}")
            except Problem:
                upload = None
    if upload is None:
        length = {"Tus-Resumable": "1.0.0", "Upload-Length": str(size)}
        if given.name:
            length["Upload-Metadata"] = "filename " + base64.b64encode(given.name.encode()).decode()
        begun = connection.ask("POST", "/v1/uploads", length)
        upload = (begun.headers.get("Location") or "").rsplit("/", 1)[-1]
        note.keep(upload)
    _send_rest(connection, given.file, upload, offset, sent)
    return connection.ask(method, f"{target}&upload={upload}")


def _send_rest(connection: Connection, file: BinaryIO, upload: str, offset: int, sent: Sent) -> None:
    path, size, patience = "/v1/uploads/" + upload, file.seek(0, io.SEEK_END), connection.patience()
    while offset < size:
        file.seek(offset)
        part = file.read(min(PART, size - offset))
        headers = {"Tus-Resumable": "1.0.0", "Upload-Offset": str(offset), "Content-Type": "application/offset+octet-stream"}
        try:
            answer = connection.once("PATCH", path, headers, part)
            trouble = None if answer.status == 204 else connection.problem(answer)
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
