"""What went wrong, in the words of the service."""
from __future__ import annotations

import json
from typing import Any, Mapping

_URN = "urn:cordillera:problem:"


class Problem(Exception):
    """type: a word of docs/reference/errors.md, or service-unreachable or answer-unknown. status: of HTTP, 0 without an answer."""

    def __init__(self, type: str, detail: str, *, status: int = 0, accepted: str = "", parameter: str = "") -> None:
        super().__init__(detail + (f" (accepted: {accepted})" if accepted else ""))
        self.type, self.detail, self.status = type, detail, status
        self.accepted, self.parameter = accepted, parameter

    @classmethod
    def of(cls, fields: Mapping[str, Any], status: int = 0) -> Problem:
        def text(name: str) -> str:
            value = fields.get(name)
            return value if isinstance(value, str) else ""

        slug = text("type")
        slug = slug[len(_URN):] if slug.startswith(_URN) else slug
        known = fields.get("status")
        return cls(slug or "answer-unknown", text("detail") or text("title"), accepted=text("accepted"), parameter=text("parameter"),
                   status=status or (known if isinstance(known, int) else 0))

    @classmethod
    def in_body(cls, status: int, body: bytes, address: str) -> Problem:
        try:
            fields = json.loads(body)
        except ValueError:
            fields = None
        if isinstance(fields, dict) and "type" in fields:
            return cls.of(fields, status)
        return cls("answer-unknown", f"{address} answers {status}, and not as Cordillera does", status=status)
