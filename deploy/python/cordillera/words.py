"""Options as a query spells them, and ids in a path."""
from __future__ import annotations

import urllib.parse
from typing import Iterable, Mapping, Union

Word = Union[str, int, float, bool]
Option = Union[Word, Iterable[Word], None]
"""bbox=(west, south, east, north) and keep=[0.5, 0.25] are lists with commas. None is left out."""


def _text(value: Union[Word, Iterable[Word]]) -> str:
    if isinstance(value, bool):
        return "1" if value else "0"
    if isinstance(value, str) or not isinstance(value, Iterable):
        return str(value)
    return ",".join(map(_text, value))


def query(options: Mapping[str, Option]) -> str:
    return urllib.parse.urlencode({name: _text(value) for name, value in options.items() if value is not None})


def part(id: str) -> str:
    """An id as a part of a path."""
    if not id:
        raise ValueError("an empty id names nothing")
    return urllib.parse.quote(id, safe="")
