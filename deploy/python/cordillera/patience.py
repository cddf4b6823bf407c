"""How long a service that does not answer is asked again, and how long a caller waits."""
from __future__ import annotations

import math
import time
from typing import Optional

from .problem import Problem

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.25, 10.0
_PASSES_BY = (408, 429, 502, 503, 504)
# Of our own earlier request, whose connection broke and whose end the service has not noticed yet.
_OURS = ("upload-conflict", "idempotency-key-in-use")


class Deadline:
    """seconds: None is never."""

    def __init__(self, seconds: Optional[float]) -> None:
        self._seconds = math.inf if seconds is None else seconds
        self._end = time.monotonic() + self._seconds

    def left_s(self) -> float:
        return self._end - time.monotonic()

    def check(self) -> None:
        if self.left_s() <= 0:
            raise TimeoutError(f"not ready after {self._seconds:g} s")


class Patience:
    """seconds: from the first failure since something last came. However long it was quiet before, that was no failure."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self.moved()

    def moved(self) -> None:
        """Something has come: the next failure is the first."""
        self._end: Optional[float] = None
        self._pause = _FIRST_PAUSE_S

    def helps(self, trouble: Problem, until: Deadline = Deadline(None)) -> bool:
        """Waits as long as the service asks for, or longer each time, and says True, if asking again may help and there is time for it."""
        if not (trouble.status == 0 or trouble.status in _PASSES_BY or trouble.type in _OURS):
            return False
        now = time.monotonic()
        if self._end is None:
            self._end = now + self._seconds
        wait = max(self._pause, trouble.retry_after_s)
        if now + wait > self._end:
            return False
        time.sleep(max(0.0, min(wait, until.left_s())))
        self._pause = min(2 * self._pause, _LONGEST_PAUSE_S)
        return True
