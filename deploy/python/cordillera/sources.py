"""The rasters of a dataset that was posted with updates=True, or of several: docs/machines/many-rasters.md."""
from __future__ import annotations

from typing import Any, Callable, Mapping, Optional

from . import uploads, words
from .connection import Connection
from .problem import Problem
from .rasters import Raster


class Sources:
    """A change is done after the call, in its turn. wait() ends when it is, and tells the problem of one that was asked for here."""

    def __init__(self, connection: Connection, path: str) -> None:
        self._connection, self._path = connection, path
        self._asked: set[str] = set()

    def sources(self) -> list[dict[str, Any]]:
        """The one that wins first."""
        return list(self._json("/sources")["sources"])

    def add_source(self, raster: Optional[Raster] = None, *, source: Optional[str] = None, position: Optional[int] = None,
                   name: Optional[str] = None, resume: bool = False, sent: uploads.Sent = uploads.nobody, **options: words.Option) -> str:
        """Gives the raster's id. source: its address, in place of a raster. position: 0, the default, wins over all others."""
        if (raster is None) == (source is None):
            raise ValueError(uploads.WANTED)
        given: dict[str, words.Option] = {"source": source, "position": position, "name": name, **options}
        change, kept = self._change("POST", "/sources", raster, given, uploads.Way(resume, sent))
        kept()
        return str(change["source"])

    def replace_source(self, id: str, raster: Optional[Raster] = None, *, source: Optional[str] = None, position: Optional[int] = None,
                       name: Optional[str] = None, resume: bool = False, sent: uploads.Sent = uploads.nobody,
                       **options: words.Option) -> None:
        """Another raster in its place; without one another position, or other options."""
        given: dict[str, words.Option] = {"source": source, "position": position, "name": name, **options}
        _, kept = self._change("PUT", "/sources/" + words.part(id), raster, given, uploads.Way(resume, sent))
        kept()

    def remove_source(self, id: str) -> None:
        self._note(self._connection.ask("DELETE", self._path + "/sources/" + words.part(id)).json())

    def versions(self) -> list[dict[str, Any]]:
        """Those that are kept; "served" says which one is seen."""
        return list(self._json("/versions")["versions"])

    def rollback(self, to: Optional[int] = None) -> list[dict[str, Any]]:
        """An earlier version is served again, by its number, or the one before. The versions that are kept then."""
        if to is None:  # a number does no harm twice, should the answer get lost
            to = next((version["number"] for version in self.versions() if not version["served"]), None)
        answer = self._connection.ask("POST", f"{self._path}/rollback?{words.query({'to': to})}")
        return list(answer.json()["versions"])

    def _change(self, method: str, below: str, raster: Optional[Raster], options: Mapping[str, words.Option],
                way: uploads.Way) -> uploads.Sending:
        sending = uploads.send(self._connection, method, self._path + below, raster, options, way)
        self._note(sending[0])
        return sending

    def _add_below(self, raster: Raster, position: int, options: Mapping[str, words.Option], way: uploads.Way) -> Callable[[], None]:
        """One of several of a post. Of its options the service takes those of the first, but for the CRS."""
        _, kept = self._change("POST", "/sources", raster, {"position": position, "crs": options.get("crs")}, way)
        return kept

    def _note(self, change: dict[str, Any]) -> None:
        self._asked.add(change["id"])

    def _tell_failed(self) -> None:
        """Problem: a change that was asked for here has failed. It is told once."""
        if not self._asked:
            return
        for change in self._json("/sources")["changes"]:
            if change["id"] in self._asked and change["state"] != "pending":
                self._asked.remove(change["id"])
                if change["error"]:
                    raise Problem.of(change["error"])

    def _json(self, below: str) -> dict[str, Any]:
        return dict(self._connection.ask("GET", self._path + below).json())
