"""When a signal was on one side of a number: to the value, with little of it read.

Stretches of which all values fit, or none, are passed over whole, level by level, by the least and greatest values that
the index keeps. Value by value is read only where the condition begins, ends or may have been interrupted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from app.errors import UnknownObjectError, UsageError
from app.model.description import Description, Entry
from app.recording.index import Series, SeriesKind, SignalInfo, SignalKey
from app.recording.node_table import NodeKey
from app.service.analysis.look import Look
from app.service.analysis.search.query import Level, Scope
from app.service.analysis.search.stretches import Breaks, Course, Held, Range, Test, runs
from app.wire.signs import SignKind

Span = tuple[int, int]
"""From one time on and before another, ns."""
_SHIFTS: Final = (34, 30, 26)
"""Binary logarithm of the length of a bucket, from look to look: 17 s, 1 s, 67 ms."""
_EXACT_NS: Final = 500_000_000
"""A span up to this is read value by value."""
_NEAR_NS: Final = 10_000_000_000
"""What is read value by value and is not farther apart is read at once: to begin reading takes as long."""
_LONGEST_NS: Final = 120_000_000_000
_ALL: Final = 1 << 30
"""More values than any span has."""
_HELD: Final = (30, 900)
"""So many of the shortest buckets (2 s, 60 s) a value is looked for that holds at the begin of a span, then in all."""
_PREFIXES: Final = {"mV": ("V", 1e-3), "mA": ("A", 1e-3), "ms": ("s", 1e-3), "mΩ": ("Ω", 1e-3), "min": ("s", 60.0)}


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
        test = Test(level, _raw_bound(look, key, entry, level))
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


def _find(look: Look, info: SignalInfo, test: Test, lasting_ns: int, spans: list[Span]) -> Iterator[Held]:
    breaks = np.concatenate(
        (look.index.breaks(info.bus, info.node, info.address), _silences(look, (info.bus, info.node)))
    )
    breaks.sort()
    for begin, end in _merged(spans):
        course = _course(look, info, test, (begin - lasting_ns, min(end, look.span_ns[1] + 1)), breaks)
        found = course.stretches((info.bus, info.node), min(end, look.span_ns[1] + 1))
        for one in found if lasting_ns else course.joined(found):
            if one.to_ns > begin and one.to_ns - one.from_ns >= lasting_ns:
                yield one


def _course(look: Look, info: SignalInfo, test: Test, span: Span, breaks: Breaks) -> Course:
    signal: SignalKey = (info.bus, info.node, info.address)
    begin, end = span[0] >> _SHIFTS[-1] << _SHIFTS[-1], span[1]  # a bucket that is cut through would have to be read
    course = Course(test, breaks)
    before = _before(look, signal, info.first_ns, begin, course)
    held = before is not None and course.held_at(begin, before)
    whole = end - begin <= _EXACT_NS
    for start, stop in _near([(begin, end)] if whole else list(_collect(look, signal, (begin, end), course, held))):
        look.check()
        course.add(look.index.series(signal, start, stop, _ALL))
    return course


def _silences(look: Look, key: NodeKey) -> Breaks:
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


def _before(look: Look, signal: SignalKey, first_ns: int, begin: int, course: Course) -> Range | None:
    """The last value before ``begin``, or the last ones where all fit or none; None where nothing is known any more."""
    shift = _SHIFTS[-1]
    for back in (*_HELD, -((first_ns - begin) >> shift)):
        start = max(first_ns >> shift << shift, begin - (back << shift))
        if start >= begin:
            break
        series = _buckets(look, signal, start, begin, shift)
        mixed = course.test.mixed(series)
        for at in reversed(range(len(mixed))):
            t_ns = int(series.t_ns[at])
            if not mixed[at] and not course.is_broken(t_ns, begin):
                return float(series.low[at]), float(series.high[at])
            exact = look.index.series(signal, t_ns, min(begin, t_ns + max(1, series.bucket_ns)), _ALL)
            if len(exact.t_ns):
                known = not course.is_broken(int(exact.t_ns[-1]) + 1, begin)
                return (float(exact.low[-1]), float(exact.high[-1])) if known else None
    return None


def _collect(look: Look, signal: SignalKey, span: Span, course: Course, held: bool, level: int = 0) -> Iterator[Span]:
    """Take what is clear by the index, and tell what must be read value by value. ``held`` just before the span.

    It looks closer only where some values of a bucket fit and some do not, and where the condition begins or ends.
    """
    look.check()
    begin, end = span
    series = _buckets(look, signal, begin, end, _SHIFTS[level])
    if series.kind is SeriesKind.POINTS:
        course.add(series, series.t_ns < end)
        return
    unclear = course.test.unclear(series, course.breaks, held, end)
    course.add(series, ~unclear, begin)
    for first, last in runs(unclear):
        closer = max(begin, int(series.t_ns[first])), min(end, int(series.t_ns[last]) + series.bucket_ns)
        if level == len(_SHIFTS) - 1:
            yield closer
        else:
            before = held if not first else course.test.holds(series, first - 1)
            yield from _collect(look, signal, closer, course, before, level + 1)


def _near(spans: list[Span]) -> Iterator[Span]:
    """Spans that are near each other made one, as long as it does not get too long to be cancelled."""
    begin, end = spans[0] if spans else (0, 0)
    for start, stop in spans[1:]:
        if start - end <= _NEAR_NS and stop - begin <= _LONGEST_NS:
            end = stop
        else:
            yield begin, end
            begin, end = start, stop
    if spans:
        yield begin, end


def _buckets(look: Look, signal: SignalKey, begin: int, end: int, shift: int) -> Series:
    """The signal in buckets of 2^``shift`` ns; they may reach over both ends."""
    count = max(1, -((begin - end) >> shift))
    return look.index.series(signal, begin, begin + (count << shift), count)
