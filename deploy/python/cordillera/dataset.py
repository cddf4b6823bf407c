"""One dataset of a service."""
from __future__ import annotations

import html
import json
import urllib.parse
from typing import Any, Iterable, Iterator, Mapping, Optional, Sequence

from . import sources, words
from .connection import Connection
from .heights import MOST_PLACES, Height, Place, Profile
from .progress import Progress, follow


class Dataset(sources.Sources):
    """Knows its address alone: nothing is asked before a method is called."""

    def __init__(self, connection: Connection, id: str) -> None:
        super().__init__(connection, "/v1/datasets/" + words.part(id))
        self.id = id

    @property
    def url(self) -> str:
        """What map clients are given: tileset.json, layer.json and tiles are below it."""
        return self._connection.url + self._path

    @property
    def viewer_url(self) -> str:
        return self._connection.url + "/?dataset=" + urllib.parse.quote(self.id, safe="")

    def status(self) -> dict[str, Any]:
        return self._json("")

    def manifest(self) -> dict[str, Any]:
        """What was read, what was assumed, and the errors of every level."""
        return self._json("/manifest.json")

    def watch(self, timeout: Optional[float] = None) -> Iterator[Progress]:
        """The progress of the build until wait() would end, however often the connection breaks."""
        yield from follow(self._connection, self._path, timeout)
        self._tell_failed()

    def wait(self, timeout: Optional[float] = None) -> Dataset:
        """Until it is ready; a lazy one until there are tiles to look at: their blocks are made when they are asked for.

        Problem: the build failed, or a change of the rasters that was asked for here. TimeoutError: not within timeout seconds.
        """
        for _ in self.watch(timeout):
            pass
        return self

    def tile(self, z: int, x: int, y: int, format: str = "drc") -> bytes:
        """format: drc, glb or terrain (quantized-mesh); other tiles by fetch(). Problem tile-unknown: there is none."""
        folder = "terrain" if format == "terrain" else "tiles"
        return self.fetch(f"{folder}/{z:d}/{x:d}/{y:d}.{urllib.parse.quote(format)}")

    def fetch(self, path: str) -> bytes:
        """Any address below the dataset's, such as tileset.json. Waits for tiles that are still to be made."""
        return self._connection.ask("GET", self._path + "/" + path.lstrip("/"), {"Prefer": "wait=30"}).body

    def elevation(self, longitude_deg: float, latitude_deg: float, *, level: Optional[int] = None) -> Height:
        return self.elevations([(longitude_deg, latitude_deg)], level=level)[0]

    def elevations(self, places: Iterable[Place], *, level: Optional[int] = None) -> list[Height]:
        """In the order of the places, however many."""
        wanted = list(places)
        found: list[Height] = []
        for first in range(0, len(wanted), MOST_PLACES):
            answer = self._heights({"points": wanted[first:first + MOST_PLACES]}, {"level": level})
            found += [Height.of(point, answer) for point in answer["points"]]
        return found

    def profile(self, line: Sequence[Place], *, samples: int = 200, level: Optional[int] = None) -> Profile:
        """Heights at equal distances along geodesics through the places, both ends included."""
        answer = self._heights({"line": list(line)}, {"samples": samples, "level": level})
        return Profile(answer["length"], [Height.of(point, answer) for point in answer["points"]])

    def edit(self, *, title: Optional[str] = None, attribution: Optional[str] = None, imagery: Optional[str] = None,
             private: Optional[bool] = None, build: Optional[str] = None) -> dict[str, Any]:
        """Other words without a build, or build="full": the rest of a lazy dataset. The status after it."""
        given = {"title": title, "attribution": attribution, "imagery": imagery, "private": private, "build": build}
        return dict(self._connection.ask("PATCH", self._path + "?" + words.query(given)).json())

    def delete(self) -> None:
        """Cancels a running build, too."""
        self._connection.ask("DELETE", self._path)

    def _repr_html_(self) -> str:
        """In a notebook: a link to the viewer. No other page may frame it, for it may hold a token."""
        return f'<a href="{html.escape(self.viewer_url)}" target="_blank" rel="noopener">{html.escape(self.id)} in the viewer</a>'

    def __repr__(self) -> str:
        return f"Dataset({self.url!r})"

    def _heights(self, body: Mapping[str, Any], query: Mapping[str, Optional[int]]) -> dict[str, Any]:
        path = f"{self._path}/elevation?{words.query(query)}"
        answer = self._connection.ask("POST", path, {"Content-Type": "application/json"}, json.dumps(body).encode())
        return dict(answer.json())
