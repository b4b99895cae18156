"""A signal over time from its pages: exact where the values are few enough, else in buckets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from app.recording.index.content import Series, SeriesKind, Times
from app.recording.index.pages import (
    COARSE_FROM,
    LEVELS,
    Column,
    Page,
    bucketed,
    grouped,
    joined,
    page_shift,
    unpack_page,
)

PagesOf = Callable[[int, int, int], Sequence[Page]]
"""The pages of a signal: level, first and last number."""
FromFrames = Callable[[int, int], Column]
"""The values of a signal from ``start_ns`` on and before ``end_ns``, read from the recording."""
_EMPTY: Final = np.zeros(0, np.uint64)


class SeriesReader:
    """Reads one signal of ``values`` in all; ``counts`` gives those in pages of level 0, first to last."""

    def __init__(
        self,
        pages: PagesOf,
        counts: Callable[[int, int], int],
        from_frames: FromFrames,
        dtype: npt.DTypeLike,
        values: int,
    ) -> None:
        self._levels = len(LEVELS) if values >= COARSE_FROM else 1
        self._pages = pages
        self._counts = counts
        self._from_frames = from_frames
        self._dtype = dtype

    def read(self, start_ns: int, end_ns: int, max_points: int, breaks: Times) -> Series:
        """From ``start_ns`` on and before ``end_ns``; not more points or buckets than ``max_points`` and one."""
        inside = breaks[(breaks >= start_ns) & (breaks < end_ns)]
        if self._few(start_ns, end_ns, max_points):
            column = self._exact(start_ns, end_ns)
            return _series(SeriesKind.POINTS, column, 0, inside)
        width_ns = max(1, -(-(end_ns - start_ns) // max_points))
        level = max((n for n, shift in enumerate(LEVELS[: self._levels]) if 1 << shift <= width_ns), default=None)
        if level is not None:  # buckets of the level, some of them together
            shift = LEVELS[level]
            width_ns = -(-width_ns >> shift) << shift
            start_ns = start_ns >> shift << shift
        end_ns = start_ns - (start_ns - end_ns) // width_ns * width_ns  # the last bucket is a whole one, too
        if level is None:
            column = self._exact(start_ns, end_ns)
        else:
            column = bucketed(self._column(level, start_ns, end_ns), LEVELS[level])
        start = np.uint64(start_ns)
        width = np.uint64(width_ns)
        buckets = grouped(column, (column.t_ns - start) // width, lambda keys: keys * width + start)
        return _series(SeriesKind.BUCKETS, buckets, width_ns, inside)

    def _few(self, start_ns: int, end_ns: int, limit: int) -> bool:
        """Whether there are not more values than that."""
        shift = page_shift(0)
        first, last = start_ns >> shift, (end_ns - 1) >> shift
        inner = self._counts(first + 1, last - 1) if last > first + 1 else 0
        if inner > limit:
            return False
        edges = [page for number in {first, last} for page in self._pages(0, number, number)]
        for page in edges:
            inner += self._inside(page, start_ns, end_ns)
        return inner <= limit

    def _inside(self, page: Page, start_ns: int, end_ns: int) -> int:
        column = unpack_page(page, self._dtype)
        if not page.exact:  # buckets that are touched count whole
            start_ns = start_ns >> LEVELS[0] << LEVELS[0]
        return int(column.between(start_ns, end_ns).count.sum())

    def _column(self, level: int, start_ns: int, end_ns: int) -> Column:
        shift = page_shift(level)
        pages = self._pages(level, start_ns >> shift, (end_ns - 1) >> shift)
        if not pages:
            return self._nothing()
        return joined([unpack_page(page, self._dtype) for page in pages]).between(start_ns, end_ns)

    def _exact(self, start_ns: int, end_ns: int) -> Column:
        """The values as they came: of pages that hold buckets, from the frames."""
        shift = page_shift(0)
        columns = []
        for page in self._pages(0, start_ns >> shift, (end_ns - 1) >> shift):
            begin, end = max(start_ns, page.number << shift), min(end_ns, (page.number + 1) << shift)
            column = unpack_page(page, self._dtype) if page.exact else self._from_frames(begin, end)
            columns.append(column.between(begin, end))
        return joined(columns) if columns else self._nothing()

    def _nothing(self) -> Column:
        numbers = np.zeros(0, self._dtype)
        return Column(_EMPTY, numbers, numbers, np.zeros(0, np.int64))


def _series(kind: SeriesKind, column: Column, bucket_ns: int, breaks: Times) -> Series:
    return Series(kind, column.t_ns, column.low, column.high, column.count, bucket_ns, breaks)
