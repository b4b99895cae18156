"""Values for plots: every one where they are few, else least and greatest of buckets; nothing across a break."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from app.service.scope.capture import Capture, Floats

Time = TypeVar("Time", np.int64, np.float64)


@dataclass(frozen=True, slots=True)
class ScopeSeries:
    """One signal over time, s since the trigger. ``exact``: every value, with ``low`` the same as ``high``.

    Else least and greatest of buckets of ``bucket_s``. None is a break: from there nothing is known.
    """

    signal: str
    exact: bool
    bucket_s: float
    t_s: list[float]
    low: list[float | None]
    high: list[float | None]


def series_of(
    name: str, t_s: Floats, values: Floats, breaks_s: Sequence[float], from_s: float, to_s: float, points: int
) -> ScopeSeries:
    """A stretch of a signal, with the value before it and the one after it, in about ``points`` points at most."""
    first = max(0, int(np.searchsorted(t_s, from_s, "left")) - 1)
    last = min(len(t_s), int(np.searchsorted(t_s, to_s, "right")) + 1)
    t_s, values = t_s[first:last], values[first:last]
    inside = [one for one in breaks_s if len(t_s) and t_s[0] < one]
    if len(t_s) <= points:
        return _with_breaks(name, True, 0.0, t_s, values, values, inside)
    bucket_s = (to_s - from_s) / max(1, points)
    keys = np.floor((t_s - from_s) / bucket_s)
    starts = np.flatnonzero(np.diff(keys, prepend=keys[0] - 1))
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    return _with_breaks(name, False, bucket_s, keys[starts] * bucket_s + from_s, low, high, inside)


def _with_breaks(
    name: str, exact: bool, bucket_s: float, t_s: Floats, low: Floats, high: Floats, breaks_s: Sequence[float]
) -> ScopeSeries:
    times, lows, highs = t_s.tolist(), low.tolist(), high.tolist()
    for one in sorted(breaks_s, reverse=True):
        at = int(np.searchsorted(t_s, one, "left"))
        times.insert(at, one)
        lows.insert(at, None)
        highs.insert(at, None)
    return ScopeSeries(name, exact, bucket_s, times, lows, highs)


def capture_series(capture: Capture, from_s: float, to_s: float, points: int) -> list[ScopeSeries]:
    """All signals of a capture."""
    zero_ns = capture.head.trigger_ns
    return [
        series_of(one.name, values.t_s(zero_ns), values.scaled(one.scale), capture.breaks_s(at), from_s, to_s, points)
        for at, (one, values) in enumerate(zip(capture.head.signals, capture.values, strict=True))
    ]


def each_once(times: Sequence[npt.NDArray[Time]]) -> npt.NDArray[Time]:
    """All times in their order, none twice. By sorting: beside ``np.unique`` no other thread runs."""
    every = np.sort(np.concatenate(times))
    return every[np.diff(every, prepend=every[:1] - 1) > 0]


@dataclass(frozen=True, slots=True)
class XyPoints:
    """One signal against another. ``instants`` there were in all; where there are too many, every n-th is told."""

    x: list[float | None]
    y: list[float | None]
    t_s: list[float]
    instants: int
    every: int


def xy_points(capture: Capture, x: int, y: int, from_s: float, to_s: float, points: int) -> XyPoints:
    """At each instant at which one of the two was seen, the value that each had shown last; a break stays one."""
    head, zero_ns = capture.head, capture.head.trigger_ns
    sides = [
        (capture.values[at].t_s(zero_ns), capture.values[at].scaled(head.signals[at].scale), capture.breaks_s(at))
        for at in (x, y)
    ]
    times = each_once([t_s for t_s, _, _ in sides])
    times = times[(times >= from_s) & (times <= to_s)]
    every = max(1, -(-len(times) // points))
    shown = times[::every]
    held = [_held(t_s, values, breaks, shown) for t_s, values, breaks in sides]
    known = ~(np.isnan(held[0]) & np.isnan(held[1]))
    columns = [[None if one != one else one for one in side[known].tolist()] for side in held]
    return XyPoints(columns[0], columns[1], shown[known].tolist(), len(times), every)


def _held(t_s: Floats, values: Floats, breaks_s: Sequence[float], at_s: Floats) -> Floats:
    """The last value at or before each time; NaN before the first one and from a break to the next value."""
    index = np.searchsorted(t_s, at_s, "right") - 1
    found = np.where(index >= 0, values[np.maximum(index, 0)] if len(values) else np.nan, np.nan)
    for one in breaks_s:
        seen_s = np.where(index >= 0, t_s[np.maximum(index, 0)] if len(t_s) else -np.inf, -np.inf)
        found = np.where((seen_s < one) & (one <= at_s), np.nan, found)
    return found
