"""Values over time in pages: exact where they are few, else least, greatest and number in buckets, on three levels.

Pages and buckets lie on a fixed grid of powers of two in ns since 1970, so that buckets of one level fill those of the
next. A page of level 0 spans 69 s: up to 1,024 values stand in it as they came, more in 1,024 buckets of 67 ms. Levels
1 and 2 have buckets sixteen times as long each. What a bucket says is of all values in it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from app.recording.index.arrays import pack_arrays, unpack_arrays
from app.recording.index.content import Counts, Numbers, Times

BUCKETS: Final = 1024
LEVELS: Final = (26, 30, 34)
"""Binary logarithm of the length of a bucket in ns, by level: 67 ms, 1.07 s, 17.2 s."""
PAGE_BITS: Final = 10
POINTS_AT_MOST: Final = BUCKETS
COARSE_FROM: Final = 4096
"""A signal with fewer values has pages of level 0 only."""


@dataclass(frozen=True, slots=True)
class Column:
    """Values in order of time: single ones (``count`` 1, ``low`` is ``high``) or buckets that begin at ``t_ns``."""

    t_ns: Times
    low: Numbers
    high: Numbers
    count: Counts

    def part(self, which: slice | npt.NDArray[np.bool_]) -> Column:
        """Some of them."""
        return Column(self.t_ns[which], self.low[which], self.high[which], self.count[which])

    def between(self, start_ns: int, end_ns: int) -> Column:
        """Those from ``start_ns`` on and before ``end_ns``."""
        return self.part(slice(*np.searchsorted(self.t_ns, np.array([start_ns, end_ns], np.uint64)).tolist()))


class Page(NamedTuple):
    """A page as it is kept: of ``signal``, ``number`` on the grid of its level, with so many ``values`` in it."""

    signal: int
    level: int
    number: int
    values: int
    exact: bool
    data: bytes


def page_shift(level: int) -> int:
    """Binary logarithm of the length of a page in ns."""
    return LEVELS[level] + PAGE_BITS


def points(times: Times, numbers: Numbers) -> Column:
    """Single values as a column."""
    return Column(times, numbers, numbers, np.ones(len(times), np.int64))


def joined(columns: Sequence[Column]) -> Column:
    """Columns one behind the other."""
    if len(columns) == 1:
        return columns[0]
    return Column(
        np.concatenate([column.t_ns for column in columns]),
        np.concatenate([column.low for column in columns]),
        np.concatenate([column.high for column in columns]),
        np.concatenate([column.count for column in columns]),
    )


def grouped(column: Column, keys: npt.NDArray[Any], starts: Callable[[npt.NDArray[Any]], Times]) -> Column:
    """A bucket for each run of equal ``keys``; ``starts`` tells where the bucket of a key begins."""
    if not len(keys):
        return column
    edges = np.flatnonzero(np.concatenate(([True], keys[1:] != keys[:-1])))
    return Column(
        starts(keys[edges]),
        np.minimum.reduceat(column.low, edges),
        np.maximum.reduceat(column.high, edges),
        np.add.reduceat(column.count, edges),
    )


def bucketed(column: Column, shift: int) -> Column:
    """Buckets of 2^``shift`` ns on the grid."""
    bits = np.uint64(shift)
    return grouped(column, column.t_ns >> bits, lambda keys: keys << bits)


def pack_page(signal: int, level: int, column: Column) -> Page:
    """A page of values that all lie in it."""
    number = int(column.t_ns[0]) >> page_shift(level)
    total = int(column.count.sum())
    base = np.uint64(number << page_shift(level))
    if level == 0 and total <= POINTS_AT_MOST:
        steps = np.diff(column.t_ns, prepend=base)
        return Page(signal, level, number, total, True, pack_arrays(steps, column.low))
    buckets = bucketed(column, LEVELS[level])
    places = (buckets.t_ns - base) >> np.uint64(LEVELS[level])
    return Page(signal, level, number, total, False, pack_arrays(places, buckets.low, buckets.high, buckets.count))


def unpack_page(page: Page, dtype: npt.DTypeLike) -> Column:
    """The values of a page, numbers of ``dtype``."""
    base = np.uint64(page.number << page_shift(page.level))
    arrays = unpack_arrays(page.data)
    if page.exact:
        steps, numbers = arrays
        return points(base + np.cumsum(steps, dtype=np.uint64), numbers.astype(dtype))
    places, low, high, count = arrays
    t_ns = base + (places.astype(np.uint64) << np.uint64(LEVELS[page.level]))
    return Column(t_ns, low.astype(dtype), high.astype(dtype), count.astype(np.int64))


class Pager:
    """Gathers the values of one signal, in order of time, and gives its pages as they are full."""

    def __init__(self, signal: int, write: Callable[[Page], None]) -> None:
        self._signal = signal
        self._write = write
        self._open: list[list[Column]] = [[] for _ in LEVELS]
        self._held: list[Page] = []
        self._values = 0

    def add(self, column: Column, level: int = 0) -> None:
        """More values."""
        while len(column.t_ns):
            number = int(column.t_ns[0]) >> page_shift(level)
            waiting = self._open[level]
            if waiting and int(waiting[0].t_ns[0]) >> page_shift(level) != number:
                self._close(level)
            last_ns = (number + 1 << page_shift(level)) - 1
            end = int(np.searchsorted(column.t_ns, np.uint64(last_ns), "right"))
            self._open[level].append(column.part(slice(end)))
            column = column.part(slice(end, None))

    def finish(self) -> None:
        """No more values come."""
        for level in range(len(LEVELS)):
            if self._open[level]:
                self._close(level)
        if self._values >= COARSE_FROM:
            self._let_go()

    def _let_go(self) -> None:
        for page in self._held:
            self._write(page)
        self._held.clear()

    def _close(self, level: int) -> None:
        column = joined(self._open[level])
        self._open[level] = []
        page = pack_page(self._signal, level, column)
        if level == 0:
            self._values += page.values
            self._write(page)
        else:
            self._held.append(page)
            if self._values >= COARSE_FROM:
                self._let_go()
        if level + 1 < len(LEVELS):
            self.add(bucketed(column, LEVELS[level + 1]), level + 1)
