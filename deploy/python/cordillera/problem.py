"""What went wrong, in the words of the service."""
from __future__ import annotations

import json
from email.message import Message
from typing import Any, Mapping, Tuple

_URN = "urn:cordillera:problem:"
_MOST_RETRY_AFTER_S = 9999


class Problem(Exception):
    """type: a word of docs/reference/errors.md, or service-unreachable, connection-broken or answer-unknown. status: of HTTP, 0 without
    an answer. request_id: the service's log has it, too. retry_after_s: asking again makes no sense before; 0: not said."""

    def __init__(self, type: str, detail: str, *, status: int = 0, accepted: str = "", parameter: str = "", request_id: str = "",
                 retry_after_s: float = 0) -> None:
        super().__init__(detail + (f" (accepted: {accepted})" if accepted else ""))
        self.type, self.detail, self.status = type, detail, status
        self.accepted, self.parameter, self.request_id, self.retry_after_s = accepted, parameter, request_id, retry_after_s

    def __reduce__(self) -> Tuple[Any, ...]:
        return _blank, (type(self), self.args), self.__dict__

    @classmethod
    def of(cls, fields: Mapping[str, Any], status: int = 0) -> Problem:
        def text(name: str) -> str:
            value = fields.get(name)
            return value if isinstance(value, str) else ""

        slug = text("type")
        slug = slug[len(_URN):] if slug.startswith(_URN) else slug
        known = fields.get("status")
        return cls(slug or "answer-unknown", text("detail") or text("title"), accepted=text("accepted"), parameter=text("parameter"),
                   request_id=text("request_id"), status=status or (known if isinstance(known, int) else 0))

    @classmethod
    def in_answer(cls, status: int, headers: Message, body: bytes, address: str) -> Problem:
        try:
            fields = json.loads(body)
        except ValueError:
            fields = None
        if isinstance(fields, dict) and "type" in fields:
            problem = cls.of(fields, status)
        else:
            problem = cls("answer-unknown", f"{address} answers {status}, and not as Cordillera does", status=status)
        problem.request_id = problem.request_id or headers.get("X-Request-Id") or ""
        seconds = headers.get("Retry-After") or ""
        problem.retry_after_s = min(int(seconds), _MOST_RETRY_AFTER_S) if seconds.isascii() and seconds.isdigit() else 0
        return problem


def _blank(kind: type[Problem], args: Tuple[Any, ...]) -> Problem:
    """Of a copy: its fields follow. Exception's own way gives __init__ the text alone."""
    return kind.__new__(kind, *args)
