"""The memory of one signal: times and raw values, exactly as they came."""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

_LEAST: Final = 1024
_DTYPES: Final = {"B": "u1", "q": "<i8", "Q": "<u8", "d": "<f8"}


class Stretch(NamedTuple):
    """Values of a signal by time, raw, and how many of them a PDO brought."""

    t_ns: npt.NDArray[np.int64]
    raw: npt.NDArray[Any]
    by_pdo: int


class Samples:
    """Grows at its end, forgets at its beginning. ``code`` of module ``array``."""

    def __init__(self, code: str) -> None:
        self._t = array("q")
        self._raw: array[Any] = array(code)
        self._pdo = array("B")
        self._from = 0
        self._dtype = _DTYPES[code]

    def __len__(self) -> int:
        return len(self._t) - self._from

    @property
    def first_ns(self) -> int:
        """When the oldest came that is remembered."""
        return self._t[self._from]

    def add(self, t_ns: int, raw: int | float, by_pdo: bool) -> None:
        """One more."""
        self._t.append(t_ns)
        self._raw.append(raw)
        self._pdo.append(by_pdo)

    def between(self, from_ns: int, to_ns: int) -> Stretch:
        """Those of a stretch of time, both ends included; copies."""
        first = bisect_left(self._t, from_ns, self._from)
        last = bisect_right(self._t, to_ns, first)
        return Stretch(
            np.array(self._t[first:last], np.int64), np.array(self._raw[first:last], self._dtype),
            int(np.count_nonzero(np.array(self._pdo[first:last], np.uint8))),
        )  # fmt: skip

    def forget_before(self, t_ns: int) -> int:
        """Let go of what is older; how many that were."""
        first = bisect_left(self._t, t_ns, self._from)
        gone, self._from = first - self._from, first
        if self._from > max(_LEAST, len(self._t) // 2):  # moved seldom, so that each value is moved once or twice
            del self._t[: self._from], self._raw[: self._from], self._pdo[: self._from]
            self._from = 0
        return gone
