"""A Cordillera service."""
from __future__ import annotations

import itertools
import os
import urllib.parse
from typing import Any, Iterator, Literal, Optional, Sequence, Union, overload

from . import uploads, words
from .connection import Connection
from .dataset import Dataset
from .rasters import Raster

PAGE = 100
"""Datasets that one request lists."""


class Service:
    """url: also with the path that a proxy puts before /v1; without one $CORDILLERA_SERVER, or this machine's port 8080.

    token: who may write, and read what is private; $CORDILLERA_TOKEN. patience_s: how long a service that was there may be away. One that
    was never there is a Problem at once. Its sockets are closed by close(), or at the end of `with cordillera.Service() as service:`.
    """

    def __init__(self, url: Optional[str] = None, *, token: Optional[str] = None, patience_s: float = 120) -> None:
        self._connection = Connection(url or os.environ.get("CORDILLERA_SERVER") or "http://127.0.0.1:8080",
                                      token or os.environ.get("CORDILLERA_TOKEN"), patience_s)

    @property
    def url(self) -> str:
        return self._connection.url

    def close(self) -> None:
        """For its datasets as well. A later call opens a socket anew."""
        self._connection.close()

    def __enter__(self) -> Service:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def version(self) -> str:
        return str(self._connection.ask("GET", "/version").json()["version"])

    @overload
    def post(self, raster: Union[Raster, Sequence[Raster], None] = None, *, dry_run: Literal[True], source: Optional[str] = None,
             name: Optional[str] = None, resume: bool = False, sent: uploads.Sent = uploads.nobody,
             **options: words.Option) -> dict[str, Any]: ...

    @overload
    def post(self, raster: Union[Raster, Sequence[Raster], None] = None, *, dry_run: Literal[False] = False, source: Optional[str] = None,
             name: Optional[str] = None, resume: bool = False, sent: uploads.Sent = uploads.nobody, **options: words.Option) -> Dataset: ...

    def post(self, raster: Union[Raster, Sequence[Raster], None] = None, *, dry_run: bool = False, source: Optional[str] = None,
             name: Optional[str] = None, resume: bool = False, sent: uploads.Sent = uploads.nobody,
             **options: words.Option) -> Union[Dataset, dict[str, Any]]:
        """A raster becomes a dataset, whose build begins. options: those of docs/reference/options.md, such as error=5.

        raster: a path, bytes or a file, or a list of them: the first one wins, and others can be added later. source: its address, in
        place of a raster. dry_run: nothing is built, and the answer is what a build would give.

        Above 64 MiB, or with resume, it goes in parts: after a broken connection, a restart of the service or a killed process the same
        call goes on with the same bytes, and gives the same dataset.
        """
        first, *more = raster if isinstance(raster, (list, tuple)) else [raster]
        if (first is None) == (source is None):
            raise ValueError(uploads.WANTED)
        if more and dry_run:
            raise ValueError("a dry run of several rasters is the command line's: cordillera build --dry-run")
        way = uploads.Way(resume, sent)
        given: dict[str, words.Option] = {**options, "name": name, "source": source, "dry_run": dry_run or None}
        if more:
            given["updates"] = True
        made, kept = uploads.send(self._connection, "POST", "/v1/datasets", first, given, way)
        if made.get("dry_run"):
            return made  # an upload in parts stays, for the post that follows
        dataset = self.dataset(made["id"])
        for called in [kept] + [dataset._add_below(one, k, options, way) for k, one in enumerate(more, 1)]:
            called()
        return dataset

    def dataset(self, id: str) -> Dataset:
        """It is not asked whether there is one."""
        return Dataset(self._connection, id)

    def datasets(self, *, limit: Optional[int] = None, **filters: words.Option) -> Iterator[Dataset]:
        """Newest first, limit at most. filters: state, bbox, q, as of GET /v1/datasets."""
        return itertools.islice(self._all(filters), limit)

    def _all(self, filters: dict[str, words.Option]) -> Iterator[Dataset]:
        query = words.query({**filters, "limit": PAGE})
        while True:
            page: dict[str, Any] = self._connection.ask("GET", "/v1/datasets?" + query).json()
            for row in page["datasets"]:
                yield self.dataset(row["id"])
            if not page["next"]:
                return
            query = urllib.parse.urlsplit(page["next"]).query  # its path is the public one, which a proxy may have changed

    def __repr__(self) -> str:
        return f"Service({self.url!r})"
