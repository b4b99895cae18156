"""Pages of values: what is drawn of them is exact, however dense the values are and whatever is asked for."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from app.recording.index.content import SeriesKind
from app.recording.index.pages import Column, Page, Pager, points
from app.recording.index.series import SeriesReader

START_NS = 1_750_000_000_000_000_000
NO_BREAKS = np.zeros(0, np.uint64)


class Signal:
    """Random values, in pages and as they are."""

    def __init__(self, seed: int, count: int, seconds: float, bursts: bool, kind: str) -> None:
        chance = np.random.default_rng(seed)
        at = chance.random(count)
        if bursts:
            at = at**4
        self.times = START_NS + np.sort(np.unique((at * seconds * 1e9).astype(np.uint64)))
        size = len(self.times)
        self.numbers = chance.normal(0, 50, size) if kind == "f8" else chance.integers(-900, 900, size)
        self.pages: list[Page] = []
        pager = Pager(3, self.pages.append)
        for first in range(0, size, 700):
            pager.add(points(self.times[first : first + 700], self.numbers[first : first + 700]))
        pager.finish()
        self.read = 0
        self.reader = SeriesReader(self._pages, self._counts, self._from_frames, self.numbers.dtype, size)

    def _pages(self, level: int, first: int, last: int) -> list[Page]:
        found = [page for page in self.pages if page.level == level and first <= page.number <= last]
        return sorted(found, key=lambda page: page.number)

    def _counts(self, first: int, last: int) -> int:
        return sum(page.values for page in self._pages(0, first, last))

    def _from_frames(self, start_ns: int, end_ns: int) -> Column:
        self.read += 1
        return points(self.times, self.numbers).between(start_ns, end_ns)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 1000),
    count=st.sampled_from([1, 30, 900, 5000, 30_000]),
    seconds=st.sampled_from([0.5, 70.0, 4000.0, 90_000.0]),
    bursts=st.booleans(),
    kind=st.sampled_from(["i8", "f8"]),
    ends=st.tuples(st.floats(-0.1, 1.1), st.floats(-0.1, 1.1)),
    limit=st.sampled_from([1, 7, 300, 2000]),
)
def test_points_are_all_and_buckets_hold_the_least_and_greatest(
    seed: int, count: int, seconds: float, bursts: bool, kind: str, ends: tuple[float, float], limit: int
) -> None:
    signal = Signal(seed, count, seconds, bursts, kind)
    start_ns, end_ns = (START_NS + int(end * seconds * 1e9) for end in sorted(ends))
    end_ns = max(end_ns, start_ns + 1)
    drawn = signal.reader.read(start_ns, end_ns, limit, NO_BREAKS)
    inside = (signal.times >= start_ns) & (signal.times < end_ns)
    if drawn.kind is SeriesKind.POINTS:
        assert np.array_equal(drawn.t_ns, signal.times[inside])
        assert np.array_equal(drawn.low, signal.numbers[inside])
        assert inside.sum() <= limit
        return
    assert len(drawn.t_ns) <= limit + 1
    assert drawn.count.sum() >= inside.sum()
    assert np.all(np.diff(drawn.t_ns.astype(np.int64)) >= drawn.bucket_ns)
    begins = np.searchsorted(signal.times, drawn.t_ns)
    closes = np.searchsorted(signal.times, drawn.t_ns + np.uint64(drawn.bucket_ns))
    for n, (begin, close) in enumerate(zip(begins, closes, strict=True)):
        values = signal.numbers[begin:close]
        assert (drawn.low[n], drawn.high[n], drawn.count[n]) == (values.min(), values.max(), len(values))


def test_few_values_are_drawn_as_they_are_and_without_reading_frames() -> None:
    signal = Signal(1, 900, 3600.0, False, "i8")
    drawn = signal.reader.read(START_NS, START_NS + 3600 * 10**9, 2000, NO_BREAKS)
    assert drawn.kind is SeriesKind.POINTS
    assert len(drawn.t_ns) == len(signal.times)
    assert signal.read == 0


def test_an_hour_is_drawn_from_pages_alone_and_not_much_coarser_than_asked() -> None:
    signal = Signal(2, 200_000, 3600.0, False, "i8")
    drawn = signal.reader.read(START_NS, START_NS + 3600 * 10**9, 2000, NO_BREAKS)
    assert drawn.kind is SeriesKind.BUCKETS
    assert signal.read == 0
    assert len(drawn.t_ns) > 1500


def test_breaks_of_the_stretch_are_told() -> None:
    signal = Signal(3, 100, 10.0, False, "i8")
    breaks = np.array([START_NS - 5, START_NS + 5, START_NS + 20 * 10**9], np.uint64)
    drawn = signal.reader.read(START_NS, START_NS + 10**10, 2000, breaks)
    assert drawn.breaks.tolist() == [START_NS + 5]
