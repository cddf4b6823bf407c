"""A Cordillera service."""
from __future__ import annotations

import os
import urllib.parse
from typing import Any, Iterator, Optional, Union

from . import uploads
from .connection import Connection
from .dataset import Dataset

Option = Union[str, int, float, bool]


def _query(name: str, options: dict[str, Option]) -> str:
    shown = {key: ("1" if value else "0") if isinstance(value, bool) else str(value) for key, value in options.items()}
    return urllib.parse.urlencode({"name": name, **shown})


def _nobody(done: int, total: int) -> None:
    pass


class Service:
    """url: also with the path that a proxy puts before /v1; without one $CORDILLERA_SERVER, or this machine's port 8080.

    token: who may write, and read what is private; $CORDILLERA_TOKEN. patience_s: how long the service may be away.
    """

    def __init__(self, url: Optional[str] = None, *, token: Optional[str] = None, patience_s: float = 120) -> None:
        self._connection = Connection(url or os.environ.get("CORDILLERA_SERVER") or "http://127.0.0.1:8080",
                                      token or os.environ.get("CORDILLERA_TOKEN"), patience_s)

    @property
    def url(self) -> str:
        return self._connection.url

    def version(self) -> str:
        return str(self._connection.ask("GET", "/version").json()["version"])

    def post(self, raster: Union[str, "os.PathLike[str]"], *, name: Optional[str] = None, resume: bool = False,
             sent: uploads.Sent = _nobody, **options: Option) -> Dataset:
        """A raster becomes a dataset, whose build begins. options: those of docs/reference/options.md, such as error=5.

        Above 64 MiB, or with resume, it goes in parts: after a broken connection, a restart of the service or a killed process the same
        call goes on with the same bytes, and gives the same dataset.
        """
        path = os.path.realpath(raster)
        name = name or os.path.basename(path)
        target = "/v1/datasets?" + _query(name, options)
        with open(path, "rb") as file:
            if not resume and os.fstat(file.fileno()).st_size <= uploads.WHOLE:
                return self.dataset(uploads.send_whole(self._connection, file, target).json()["id"])
            answer, note = uploads.send_parts(self._connection, file, name, target, f"{self.url}\n{path}", sent)
            dataset = self.dataset(answer.json()["id"])
            note.remove()
            return dataset

    def dataset(self, id: str) -> Dataset:
        """It is not asked whether there is one."""
        return Dataset(self._connection, id)

    def datasets(self, **filters: Option) -> Iterator[Dataset]:
        """Newest first. filters: state, bbox, q, as of GET /v1/datasets."""
        query = urllib.parse.urlencode({key: str(value) for key, value in filters.items()})
        while True:
            page: dict[str, Any] = self._connection.ask("GET", "/v1/datasets?" + query).json()
            for row in page["datasets"]:
                yield self.dataset(row["id"])
            if not page["next"]:
                return
            query = urllib.parse.urlsplit(page["next"]).query  # its path is the public one, which a proxy may have changed

    def __repr__(self) -> str:
        return f"Service({self.url!r})"
