"""A condition over the values of one signal, and the stretches in which it held."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from app.recording.index import Series
from app.recording.node_table import NodeKey
from app.service.analysis.search.query import Comparison, Level

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Breaks = npt.NDArray[np.uint64]
Range = tuple[float, float]
"""Least and greatest of some values."""
SHORT_NS: Final = 1 << 26
"""67 ms: stretches that are not farther apart are told as one, with interruptions, where no time was asked for."""


@dataclass(frozen=True, slots=True)
class Held:
    """A stretch in which the condition held, from its first value on to the first one that does not fit.

    ``extreme`` is the raw value that went farthest. ``open``: it may have begun earlier or gone on, for what was
    before or after is not known. ``interrupted``: between its ends it did not hold for moments of 67 ms at most.
    """

    key: NodeKey
    from_ns: int
    to_ns: int
    extreme: float
    open: bool = False
    interrupted: bool = False


class Test:
    """The comparison with a raw bound, of values between ``low`` and ``high`` (arrays, or numbers)."""

    __test__ = False

    def __init__(self, level: Level, bound: float) -> None:
        self._comparison = level.comparison
        self._amount = level.amount
        self._bound = bound

    def possible(self, low: Any, high: Any) -> Any:
        """Whether any of the values may fit."""
        low, high = self._shown(low, high)
        bound, comparison = self._bound, self._comparison
        if comparison is Comparison.ABOVE:
            return high > bound
        if comparison is Comparison.FROM:
            return high >= bound
        if comparison is Comparison.BELOW:
            return low < bound
        if comparison is Comparison.UP_TO:
            return low <= bound
        if comparison is Comparison.EQUAL:
            return (low <= bound) & (high >= bound)
        return (low != bound) | (high != bound)

    def certain(self, low: Any, high: Any) -> Any:
        """Whether all of the values fit."""
        low, high = self._shown(low, high)
        bound, comparison = self._bound, self._comparison
        if comparison is Comparison.ABOVE:
            return low > bound
        if comparison is Comparison.FROM:
            return low >= bound
        if comparison is Comparison.BELOW:
            return high < bound
        if comparison is Comparison.UP_TO:
            return high <= bound
        if comparison is Comparison.EQUAL:
            return (low == bound) & (high == bound)
        return (high < bound) | (low > bound)

    def _shown(self, low: Any, high: Any) -> tuple[Any, Any]:
        low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
        if not self._amount:
            return low, high
        around = (low <= 0) & (high >= 0)
        least, most = np.minimum(np.abs(low), np.abs(high)), np.maximum(np.abs(low), np.abs(high))
        return np.where(around, 0.0, least), most

    def mixed(self, series: Series) -> Flags:
        """The buckets of which some values may fit and some not."""
        mixed: Flags = np.asarray(self.possible(series.low, series.high) & ~self.certain(series.low, series.high))
        return mixed

    def holds(self, series: Series, at: int) -> bool:
        """Whether all values of one bucket fit."""
        return bool(self.certain(series.low[at], series.high[at]))

    def unclear(self, series: Series, breaks: Breaks, held: bool, end: int) -> Flags:
        """The buckets into which must be looked: what they hold does not tell where the condition began and ended.

        Clear is one of which all values fit as all of the one before did, and one of which none fits as none did.
        ``held`` just before the first one; what comes from ``end`` on does not count.
        """
        possible, certain = (np.asarray(part(series.low, series.high)) for part in (self.possible, self.certain))
        none, all_of = (
            np.concatenate(([first], part[:-1])) for first, part in ((not held, ~possible), (held, certain))
        )
        unclear: Flags = np.where(possible, ~certain | ~all_of, ~none)[: len(possible)]
        at = np.searchsorted(series.t_ns, breaks, "right").astype(np.int64)
        behind = np.concatenate((at - 1, at))  # a break may lie in a bucket; the next one begins anew in any case
        behind = behind[(behind >= 0) & (behind < len(possible))]
        unclear[behind] |= possible[behind]
        return unclear | (possible & (series.t_ns + np.uint64(series.bucket_ns) > end))

    def farthest(self, low: Floats, high: Floats) -> float:
        """The value that went farthest."""
        if self._comparison in (Comparison.BELOW, Comparison.UP_TO):
            return float(low[np.argmin(low)])
        if self._amount and abs(low.min()) > abs(high.max()):
            return float(low.min())
        return float(high.max())


class Course:
    """Whether the condition held, from each time on to the next one's. At ``breaks`` what was known ceases to hold."""

    def __init__(self, test: Test, breaks: Breaks) -> None:
        self.test = test
        self.breaks = breaks
        self._parts: list[tuple[npt.NDArray[np.uint64], Flags, Floats, Floats]] = []

    def add(self, series: Series, keep: Flags | None = None, begin: int = 0) -> None:
        """Values, or buckets of which all or none fit; ``keep`` chooses among them. None counts before ``begin``."""
        low, high = series.low.astype(np.float64), series.high.astype(np.float64)
        holds = np.asarray(self.test.certain(low, high))
        chosen = slice(None) if keep is None else keep
        times = np.maximum(series.t_ns[chosen], np.uint64(begin))
        self._parts.append((times, holds[chosen], low[chosen], high[chosen]))

    def held_at(self, begin: int, value: Range) -> bool:
        """Where one begins to look, ``value`` stands since before. If it fits: since when, nobody knows."""
        low, high = (np.full(1, one, np.float64) for one in value)
        holds = np.asarray(self.test.certain(low, high))
        self._parts.append((np.full(1, begin, np.uint64), holds, low, high))
        return bool(holds[0])

    def stretches(self, key: NodeKey, end_ns: int) -> Iterator[Held]:
        """The stretches in which it held; a break ends one."""
        if not self._parts:
            return
        t_ns, holds, low, high = (np.concatenate([part[n] for part in self._parts]) for n in range(4))
        inside = self.breaks[(self.breaks > t_ns.min(initial=np.uint64(end_ns))) & (self.breaks < end_ns)]
        nothing = np.full(len(inside), np.nan)
        t_ns = np.concatenate((inside, t_ns))  # what comes at the time of a break is known after it
        holds = np.concatenate((np.zeros(len(inside), np.bool_), holds))
        low, high = np.concatenate((nothing, low)), np.concatenate((nothing, high))
        order = np.argsort(t_ns, kind="stable")
        t_ns, holds, low, high = t_ns[order], holds[order], low[order], high[order]
        for first, last in runs(holds):
            goes_on = last + 1 == len(t_ns)
            to_ns = end_ns if goes_on else int(t_ns[last + 1])
            extreme = self.test.farthest(low[first : last + 1], high[first : last + 1])
            known = first > 0 and not goes_on and not np.isnan((low[first - 1], low[last + 1])).any()
            yield Held(key, int(t_ns[first]), to_ns, extreme, not known)

    def joined(self, stretches: Iterator[Held]) -> Iterator[Held]:
        """Stretches that are not farther apart than ``SHORT_NS`` as one, where no break lies between them."""
        last: Held | None = None
        for one in stretches:
            if last is None:
                last = one
            elif one.from_ns - last.to_ns > SHORT_NS or self.is_broken(last.to_ns, one.from_ns):
                yield last
                last = one
            else:
                extreme = self.test.farthest(*(2 * (np.array([last.extreme, one.extreme]),)))
                last = Held(one.key, last.from_ns, one.to_ns, extreme, last.open or one.open, interrupted=True)
        if last is not None:
            yield last

    def is_broken(self, from_ns: int, to_ns: int) -> bool:
        """Whether a break lies from ``from_ns`` to ``to_ns``."""
        return bool(((self.breaks >= from_ns) & (self.breaks <= to_ns)).any())


def runs(chosen: Flags) -> list[tuple[int, int]]:
    """First and last of each row of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], chosen, [False])).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
