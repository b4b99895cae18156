"""When a signal was on one side of a number, by the least and greatest values that the index keeps.

Stretches that cannot fit are passed over whole, level by level. What is left is told to the finest stretch of the index
(67 ms) where a signal is faster than that, else to the value. Value by value from the frames is read only where that
decides: a condition that must last and that may have been interrupted, an equality, a span of half a second.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from app.errors import UnknownObjectError, UsageError
from app.model.description import Description, Entry
from app.recording.index import Series, SeriesKind, SignalInfo, SignalKey
from app.recording.node_table import NodeKey
from app.service.analysis.look import Look
from app.service.analysis.search.query import Comparison, Level, Scope
from app.wire.signs import SignKind

Floats = npt.NDArray[np.float64]
Breaks = npt.NDArray[np.uint64]
Span = tuple[int, int]
"""From one time on and before another, ns."""
_SHIFTS: Final = (34, 30, 26)
"""Binary logarithm of the length of a bucket, from look to look: 17 s, 1 s, 67 ms."""
_EXACT_NS: Final = 500_000_000
"""A span up to this is read value by value."""
_ALL: Final = 1 << 30
"""More values than any span has."""
_HELD_NS: Final = (2_000_000_000, 60_000_000_000)
"""So far back a value is looked for that holds at the begin of a span, before the whole file is."""
_PREFIXES: Final = {"mV": ("V", 1e-3), "mA": ("A", 1e-3), "ms": ("s", 1e-3), "mΩ": ("Ω", 1e-3), "min": ("s", 60.0)}


@dataclass(frozen=True, slots=True)
class Held:
    """A stretch in which the condition held. ``extreme`` is the raw value that went farthest.

    ``cut``: it may have gone on; nobody looked behind ``to_ns``.
    """

    key: NodeKey
    from_ns: int
    to_ns: int
    extreme: float
    cut: bool = False


def fits(key: NodeKey, scope: Scope, look: Look) -> bool:
    """Whether a node is where the signature says."""
    bus, node = key
    place = look.places.get(key)
    return (
        (scope.bus is None or scope.bus == bus)
        and (scope.node is None or scope.node == node)
        and (scope.blade is None or (place is not None and place.blade == scope.blade))
        and (scope.device is None or (place is not None and place.device == scope.device))
    )


def find_levels(look: Look, level: Level, spans: list[Span] | None = None) -> Iterator[Held]:
    """The stretches of all signals that fit, within ``spans`` (None: everywhere).

    Raises UsageError where the unit is another one than the object's.
    """
    for info in look.index.signals():
        if info.address != level.address or info.low is None or info.high is None:
            continue
        key = (info.bus, info.node)
        entry = look.entry(key, info.address)
        if entry is None or not fits(key, level.scope, look):
            continue
        test = _Test(level, _raw_bound(look, key, entry, level))
        if test.possible(info.low, info.high):
            yield from _find(look, info, test, level.lasting_ns, spans or [_whole(look)])


def _whole(look: Look) -> Span:
    return look.span_ns[0], look.span_ns[1] + 1


def check_level(level: Level, descriptions: Iterable[Description]) -> None:
    """Whether any device has the object, and any the unit.

    Raises UsageError on a unit of another kind, UnknownObjectError on an object that no device has.
    """
    entries = [one.entries[level.address] for one in descriptions if level.address in one.entries]
    if not entries:
        raise UnknownObjectError(device="–", address=level.address.short)
    wrong = None
    for entry in entries:
        try:
            _factor(entry.quantity.unit, level.unit, level)
        except UsageError as error:
            wrong = error
        else:
            return
    if wrong is not None:
        raise wrong


def _raw_bound(look: Look, key: NodeKey, entry: Entry, level: Level) -> float:
    quantity = look.quantity(key, entry)
    # 0.29 ° is 29 hundredths of a degree, not 28.999999999999996: binary fractions must not decide
    return round(level.number * _factor(quantity.unit, level.unit, level) / float(quantity.scale), 6)


def _factor(own: str, given: str, level: Level) -> float:
    """From the unit that was typed to the object's."""
    if not given or given == own:
        return 1.0
    own_base, own_factor = _PREFIXES.get(own, (own, 1.0))
    given_base, given_factor = _PREFIXES.get(given, (given, 1.0))
    if own_base != given_base:
        raise UsageError(reason=f"{level.address.short}: {given} ≠ {own or '1'}")
    return given_factor / own_factor


class _Test:
    """The comparison with a raw bound, of values between ``low`` and ``high`` (arrays, or numbers)."""

    def __init__(self, level: Level, bound: float) -> None:
        self._comparison = level.comparison
        self._amount = level.amount
        self._bound = bound

    @property
    def exact(self) -> bool:
        """Whether least and greatest of several values do not tell that one of them fits."""
        small = self._amount and self._comparison in (Comparison.BELOW, Comparison.UP_TO)  # one may be at neither end
        return small or self._comparison in (Comparison.EQUAL, Comparison.OTHER)

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

    def farthest(self, low: Floats, high: Floats) -> float:
        """The value that went farthest."""
        if self._comparison in (Comparison.BELOW, Comparison.UP_TO):
            return float(low[np.argmin(low)])
        if self._amount and abs(low.min()) > abs(high.max()):
            return float(low.min())
        return float(high.max())


class _Course:
    """Whether the condition held, from each time on to the next one's."""

    def __init__(self, test: _Test) -> None:
        self._test = test
        self._parts: list[tuple[npt.NDArray[np.uint64], npt.NDArray[np.bool_], Floats, Floats]] = []

    def add(self, series: Series, keep: npt.NDArray[np.bool_] | None = None, unclear: bool = False) -> None:
        """Values, or buckets of which all or none fit; with ``unclear`` those too of which some do.

        ``keep`` chooses among them.
        """
        low, high = series.low.astype(np.float64), series.high.astype(np.float64)
        holds = np.asarray(self._test.possible(low, high) if unclear else self._test.certain(low, high))
        chosen = slice(None) if keep is None else keep
        self._parts.append((series.t_ns[chosen], holds[chosen], low[chosen], high[chosen]))
        at = _broken(series)
        if len(at):  # some of its values may have come after the break
            self._parts.append((_inside(series), holds[at], low[at], high[at]))

    def stretches(self, key: NodeKey, breaks: npt.NDArray[np.uint64], end_ns: int) -> Iterator[Held]:
        """The stretches in which it held; a break ends one."""
        if not self._parts:
            return
        t_ns, holds, low, high = (np.concatenate([part[n] for part in self._parts]) for n in range(4))
        inside = breaks[(breaks > t_ns.min(initial=np.uint64(end_ns))) & (breaks < end_ns)]
        nothing = np.full(len(inside), np.nan)
        t_ns = np.concatenate((inside, t_ns))  # what comes at the time of a break is known after it
        holds = np.concatenate((np.zeros(len(inside), np.bool_), holds))
        low, high = np.concatenate((nothing, low)), np.concatenate((nothing, high))
        order = np.argsort(t_ns, kind="stable")
        t_ns, holds, low, high = t_ns[order], holds[order], low[order], high[order]
        for first, last in _runs(holds):
            cut = last + 1 == len(t_ns)
            to_ns = end_ns if cut else int(t_ns[last + 1])
            extreme = self._test.farthest(low[first : last + 1], high[first : last + 1])
            yield Held(key, int(t_ns[first]), to_ns, extreme, cut)


def _find(look: Look, info: SignalInfo, test: _Test, lasting_ns: int, spans: list[Span]) -> Iterator[Held]:
    signal: SignalKey = (info.bus, info.node, info.address)
    breaks = np.concatenate((look.index.breaks(*signal), _silences(look, (info.bus, info.node))))
    breaks.sort()
    for begin, end in _merged(spans):
        end = min(end, look.span_ns[1] + 1)
        for found in _in_span(look, info, test, (begin, end), breaks):
            if found.to_ns - found.from_ns < lasting_ns:
                continue
            if not lasting_ns:
                yield found
                continue
            for exact in _exactly(look, signal, test, found, breaks):
                if exact.to_ns - exact.from_ns >= lasting_ns:
                    yield exact


def _in_span(look: Look, info: SignalInfo, test: _Test, span: Span, breaks: Breaks) -> Iterator[Held]:
    signal: SignalKey = (info.bus, info.node, info.address)
    begin, end = span
    course = _Course(test)
    held = _held(look, signal, info.first_ns, begin)
    if held is not None:
        course.add(held, unclear=True)
    if end - begin <= _EXACT_NS or test.exact:
        _collect_exactly(look, signal, span, test, course)
    else:
        _collect(look, signal, span, test, course)
    return (one for one in course.stretches((info.bus, info.node), breaks, end) if one.to_ns > begin)


def _exactly(look: Look, signal: SignalKey, test: _Test, held: Held, breaks: Breaks) -> Iterator[Held]:
    """The same stretch value by value; a bucket at its ends belongs to it in part."""
    bucket_ns = 1 << _SHIFTS[-1]
    course = _Course(test)
    course.add(look.index.series(signal, held.from_ns, held.to_ns + bucket_ns, _ALL))
    return course.stretches(held.key, breaks, held.to_ns)


def _silences(look: Look, key: NodeKey) -> npt.NDArray[np.uint64]:
    """Since when a node was silent: what it said last holds no longer."""
    silent = (one for one in look.signs if one.kind is SignKind.SILENT and not one.ends)
    return np.array([one.since_ns + 1 for one in silent if (one.bus, one.node) == key], np.uint64)


def _merged(spans: list[Span]) -> list[Span]:
    """Spans that overlap made one: nothing is read or told twice."""
    found: list[Span] = []
    for begin, end in sorted(spans):
        if found and begin <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], end)
        else:
            found.append((begin, end))
    return found


def _held(look: Look, signal: SignalKey, first_ns: int, begin: int) -> Series | None:
    """The last values before ``begin``: the very last of them holds there."""
    if begin <= first_ns:
        return None
    for back_ns in (*_HELD_NS, begin - first_ns):
        start = max(first_ns, begin - back_ns)
        series = look.index.series(signal, start, begin, _buckets(start, begin, _SHIFTS[-1]))
        if len(series.t_ns):
            return series
    return None


def _collect(look: Look, signal: SignalKey, span: Span, test: _Test, course: _Course, level: int = 0) -> None:
    """Look closer only where some values of a bucket fit and some do not, and where it begins or ends."""
    look.check()
    begin, end = span
    series = look.index.series(signal, begin, end, _buckets(begin, end, _SHIFTS[level]))
    if series.kind is SeriesKind.POINTS or level == len(_SHIFTS) - 1:
        course.add(series, unclear=True)
        return
    unclear = _unclear(series, test)
    course.add(series, ~unclear)
    for first, last in _runs(unclear):
        start, stop = max(begin, int(series.t_ns[first])), min(end, int(series.t_ns[last]) + series.bucket_ns)
        _collect(look, signal, (start, stop), test, course, level + 1)


def _buckets(begin: int, end: int, shift: int) -> int:
    """How many it takes so that none is wider than 2^shift ns: one too few, and all are up to twice as wide."""
    return max(1, -((begin - end) >> shift))


def _unclear(series: Series, test: _Test) -> npt.NDArray[np.bool_]:
    possible, certain = (np.asarray(part(series.low, series.high)) for part in (test.possible, test.certain))
    unclear: npt.NDArray[np.bool_] = possible & ~certain
    unclear[1:] |= possible[1:] != possible[:-1]
    unclear[_broken(series)] |= possible[_broken(series)]
    return unclear


def _broken(series: Series) -> npt.NDArray[np.int64]:
    """The buckets in which a break lies, one for each such break."""
    at = np.searchsorted(series.t_ns, series.breaks, "right").astype(np.int64) - 1
    return at[_in_bucket(series, at)]


def _inside(series: Series) -> Breaks:
    """The breaks that lie in a bucket."""
    at = np.searchsorted(series.t_ns, series.breaks, "right").astype(np.int64) - 1
    return series.breaks[_in_bucket(series, at)]


def _in_bucket(series: Series, at: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    if not len(series.t_ns) or not series.bucket_ns:
        return np.zeros(len(at), np.bool_)
    ends = series.t_ns[np.maximum(at, 0)] + np.uint64(series.bucket_ns)
    return (at >= 0) & (series.breaks < ends)


def _collect_exactly(look: Look, signal: SignalKey, span: Span, test: _Test, course: _Course) -> None:
    """Value by value, but only where any may fit."""
    look.check()
    begin, end = span
    if end - begin <= _EXACT_NS:
        course.add(look.index.series(signal, begin, end, _ALL))
        return
    series = look.index.series(signal, begin, end, _buckets(begin, end, _SHIFTS[-1]))
    if series.kind is SeriesKind.POINTS:
        course.add(series)
        return
    unclear = _unclear(series, test)
    course.add(series, ~unclear)
    for first, last in _runs(unclear):
        start, stop = max(begin, int(series.t_ns[first])), min(end, int(series.t_ns[last]) + series.bucket_ns)
        course.add(look.index.series(signal, start, stop, _ALL))


def _runs(chosen: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last of each row of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], chosen, [False])).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
