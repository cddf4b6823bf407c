"""What a raster may be given as."""
from __future__ import annotations

import contextlib
import io
import os
import shutil
import tempfile
from dataclasses import dataclass
from typing import IO, BinaryIO, Iterator, Optional, Union, cast

Raster = Union[str, "os.PathLike[str]", bytes, IO[bytes]]
"""A path, the bytes themselves, or a file that is open in binary mode, which is read from its beginning if it can be."""


@dataclass(frozen=True)
class Opened:
    file: BinaryIO
    name: Optional[str]
    place: str
    """Who sends the same place again goes on where it stood."""


@contextlib.contextmanager
def opened(raster: Raster, name: Optional[str]) -> Iterator[Opened]:
    """name: None: that of the file, if it has one."""
    if isinstance(raster, (bytes, bytearray, memoryview)):
        yield Opened(io.BytesIO(raster), name, name or "")
    elif isinstance(raster, (str, os.PathLike)):
        path = os.path.realpath(raster)
        with open(path, "rb") as file:
            yield Opened(file, name or os.path.basename(path), path)
    elif isinstance(raster, io.TextIOBase):
        raise TypeError("a raster is no text: open it in binary mode")
    else:
        known = getattr(raster, "name", None)  # a number, of a file without a name
        name = name or (os.path.basename(known) if isinstance(known, str) else None)
        with _seekable(raster) as file:
            yield Opened(file, name, name or "")


@contextlib.contextmanager
def _seekable(file: IO[bytes]) -> Iterator[BinaryIO]:
    """What comes through a pipe is kept: it may have to be sent again."""
    if file.seekable():
        yield cast(BinaryIO, file)
        return
    with tempfile.TemporaryFile() as kept:
        shutil.copyfileobj(file, kept)
        yield cast(BinaryIO, kept)
