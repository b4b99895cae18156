"""Several recordings on one axis of time, each by its own zero: a trip, or any moment.

Series are reduced to least and greatest of each stretch of one grid that all share, so that curves of several incidents
can be laid over each other; where the values are few, they stand as they came.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from app.errors import UsageError
from app.model.address import Address
from app.recording.index import Series, SeriesKind, SignalInfo
from app.recording.node_table import NodeKey
from app.service.analysis.look import Look

MS: Final = 1_000_000
_FINER: Final = 4
"""The index is asked for so many buckets in one of the grid: what lies across two of the grid widens both."""
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SignalAt:
    """A signal wherever it is found: the object, on one blade or all, of one device or any. ``node``: exactly this."""

    address: Address
    blade: int | None = None
    device: str | None = None
    node: NodeKey | None = None


@dataclass(frozen=True, slots=True)
class Window:
    """What is shown: so long before the zero, so long behind it, in so many stretches."""

    before_ns: int
    after_ns: int
    points: int


@dataclass(frozen=True, slots=True)
class Track:
    """One signal of one recording; times in ms from the zero, values scaled.

    ``exact``: values as they came; else each stands for a stretch of ``step_ms`` from its time on. ``breaks_ms``: no
    line may cross these. ``device`` is the slug where it is known.
    """

    key: NodeKey
    device: str | None
    blade: int | None
    address: Address
    name: str
    unit: str
    exact: bool
    step_ms: float
    t_ms: Floats
    low: Floats
    high: Floats
    breaks_ms: Floats


@dataclass(frozen=True, slots=True)
class Aligned:
    """One recording with its zero. ``from_ms`` and ``to_ms``: as far as it reaches inside the window."""

    file: str
    turbine: str
    t0_ns: int
    from_ms: float
    to_ms: float
    tracks: tuple[Track, ...]


def zero_of_trip(look: Look, number: int) -> int:
    """T0 of a trip, by its place. Raises UsageError where the recording has no such trip."""
    if not 0 <= number < len(look.trips):
        raise UsageError(reason=f"{look.name}: {len(look.trips)} trips, no number {number}")
    return look.trips[number].t0_ns


def align(look: Look, t0_ns: int, signals: Sequence[SignalAt], window: Window) -> Aligned:
    """The signals of one recording around its zero. A signal that it does not hold gives no track.

    Raises UsageError where the zero is not in the recording.
    """
    begin, end = look.span_ns
    if not begin <= t0_ns <= end:
        raise UsageError(reason=f"{look.name}: the zero is not within the recording")
    tracks = [
        _track(look, info, t0_ns, window)
        for signal in signals
        for info in sorted(look.index.signals(), key=lambda one: (one.bus, one.node))
        if info.low is not None and _is(look, info, signal)
    ]
    from_ms, to_ms = max(begin - t0_ns, -window.before_ns) / MS, min(end - t0_ns, window.after_ns) / MS
    return Aligned(look.name, look.info.turbine, t0_ns, from_ms, to_ms, tuple(tracks))


def _is(look: Look, info: SignalInfo, signal: SignalAt) -> bool:
    if info.address != signal.address:
        return False
    key = (info.bus, info.node)
    if signal.node is not None:
        return key == signal.node
    place = look.places.get(key)
    if place is None:
        return signal.blade is None and signal.device is None
    return signal.blade in (None, place.blade) and signal.device in (None, place.device)


def _track(look: Look, info: SignalInfo, t0_ns: int, window: Window) -> Track:
    key = (info.bus, info.node)
    start, stop = t0_ns - window.before_ns, t0_ns + window.after_ns
    series = look.index.series((*key, info.address), start, stop, window.points * _FINER)
    entry, place = look.entry(key, info.address), look.places.get(key)
    quantity = None if entry is None else look.quantity(key, entry)
    scale = 1.0 if quantity is None else float(quantity.scale)
    t_ms, low, high, exact = _reduced(series, start, stop, t0_ns, window.points)
    breaks = series.breaks.astype(np.int64) - t0_ns
    return Track(
        key=key,
        device=None if place is None else place.slug,
        blade=None if place is None else place.blade,
        address=info.address,
        name=info.address.short if entry is None else entry.title,
        unit="" if quantity is None else quantity.unit,
        exact=exact,
        step_ms=0.0 if exact else (stop - start) / window.points / MS,
        t_ms=t_ms,
        low=np.minimum(low * scale, high * scale),
        high=np.maximum(low * scale, high * scale),
        breaks_ms=breaks / MS,
    )


def _reduced(series: Series, start: int, stop: int, t0_ns: int, points: int) -> tuple[Floats, Floats, Floats, bool]:
    """Times in ms from the zero with least and greatest: exact where they are few, else on the grid."""
    t_ns = series.t_ns.astype(np.int64)
    low, high = series.low.astype(np.float64), series.high.astype(np.float64)
    if series.kind is SeriesKind.POINTS and len(t_ns) <= points:
        return (t_ns - t0_ns) / MS, low, high, True
    width = max(1, -(-(stop - start) // points))
    first = np.clip((t_ns - start) // width, 0, points - 1)
    last = np.clip((t_ns + max(series.bucket_ns, 1) - 1 - start) // width, 0, points - 1)
    least, most = np.full(points, np.inf), np.full(points, -np.inf)
    for place in (first, last):
        np.minimum.at(least, place, low)
        np.maximum.at(most, place, high)
    seen = np.isfinite(least)
    times: Any = (np.flatnonzero(seen) * width + start - t0_ns) / MS
    return times, least[seen], most[seen], False
