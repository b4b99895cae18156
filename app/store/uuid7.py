"""UUIDs of version 7 (RFC 9562, section 5.7): keys that sort by the time at which they were made."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from threading import Lock
from typing import Final
from uuid import UUID

_COUNTER_BITS: Final = 12
_COUNTER_END: Final = 1 << _COUNTER_BITS
_VERSION: Final = 7
_VARIANT: Final = 0b10
_MAX_MS: Final = (1 << 48) - 1


class Uuid7:
    """Makes UUIDs, each greater than any before, from any thread. ``now_ns`` is the wall clock in ns.

    Within a millisecond, or while the clock stands behind where it was, a counter orders them (section 6.2, method 1);
    where it overflows, the next millisecond is begun early.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._ms = 0
        self._counter = 0
        self._lock = Lock()

    def __call__(self) -> str:
        """The next one, in its usual text."""
        with self._lock:
            ms, counter = self._next()
        tail = secrets.randbits(62)
        number = (min(ms, _MAX_MS) << 80) | (_VERSION << 76) | (counter << 64) | (_VARIANT << 62) | tail
        return str(UUID(int=number))

    def _next(self) -> tuple[int, int]:
        ms = self._now_ns() // 1_000_000
        if ms > self._ms:
            # Half the counter's range is left for those that follow in the same millisecond.
            self._ms, self._counter = ms, secrets.randbits(_COUNTER_BITS - 1)
        else:
            self._counter += 1
            if self._counter == _COUNTER_END:
                self._ms, self._counter = self._ms + 1, 0
        return self._ms, self._counter
