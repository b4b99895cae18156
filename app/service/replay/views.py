"""What a page is told of a whole recording: the timeline, its events, its signals as series, values over time.

Everything comes from the index; nothing here moves the cursor. Times are in t_ns, or in seconds since the recording's
beginning where a name ends in ``_s``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from app.errors import IndexMissingError, UsageError
from app.model.address import Address, parse_address
from app.model.description import Entry, Kind
from app.model.values import quantity_of
from app.recording.index import Gap, RecordingIndex, Series, SeriesKind, SignalInfo
from app.service.devices import Target, decode
from app.service.replay.noted import event_line
from app.service.replay.source import Source
from app.service.views import (
    SOURCE_NAMES,
    EventLine,
    RawJson,
    SeverityName,
    SourceName,
    event_of_wire,
    is_told,
    raw_to_json,
)

MAX_MARKS: Final = 600
"""More marks than a timeline has pixels to tell apart."""
_NS: Final = 1e9
_RANK: Final[Mapping[SeverityName, int]] = {"error": 0, "warning": 1, "info": 2}
Numbers = npt.NDArray[np.float64]
_Values = tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class LoadLine:
    """Traffic of one bus by bucket: share of the bit time (None: bit rate not known), and frames."""

    bus: str
    share: tuple[float | None, ...]
    frames: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class GapLine:
    """A stretch in which the recording does not hold everything; ``text_key`` with ``details`` says why."""

    kind: str
    bus: str
    device: str | None
    from_ns: int
    to_ns: int
    text_key: str
    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Timeline:
    """From ``from_ns`` to ``to_ns``: load in buckets of ``bucket_ns``, gaps, and the events that matter most.

    ``left_out`` counts the events for which there is no room.
    """

    from_ns: int
    to_ns: int
    bucket_ns: int
    load: tuple[LoadLine, ...]
    gaps: tuple[GapLine, ...]
    marks: tuple[EventLine, ...]
    left_out: int


@dataclass(frozen=True, slots=True)
class SignalLine:
    """One object of a device that is a number, as it was seen in the recording.

    ``low`` and ``high`` are in ``unit``; ``states`` are text keys of an enumeration's values, None where it has none.
    ``changes`` counts the values that differed from the one before.
    """

    device: str
    address: str
    name: str
    sub: str | None
    unit: str
    count: int
    changes: int
    first_s: float
    last_s: float
    low: float
    high: float
    states: Mapping[int, str] | None


@dataclass(frozen=True, slots=True)
class SeriesLine:
    """A signal over time. None is a break: from there nothing is known.

    ``exact``: every value, with ``low`` the same as ``high``; else the least and greatest of each bucket of
    ``bucket_s``, which begins at ``t_s``.
    """

    device: str
    address: str
    unit: str
    exact: bool
    bucket_s: float
    t_s: tuple[float, ...]
    low: tuple[float | None, ...]
    high: tuple[float | None, ...]


@dataclass(frozen=True, slots=True)
class ChangeLine:
    """RAM of an object from ``t_ns`` on; ``raw`` None: unknown from here."""

    t_ns: int
    raw: RawJson | None
    hex: str | None
    source: SourceName | None


class Views:
    """Of one recording, by its index. ``targets`` are its devices at the cursor: units may depend on their values."""

    def __init__(self, source: Source, targets: Iterable[Target]) -> None:
        if source.index is None:
            raise IndexMissingError(recording=source.path.name)
        self._index: RecordingIndex = source.index
        self._source = source
        self._targets = {target.slug: target for target in targets}
        self._places = {(target.device.bus, target.node): target for target in self._targets.values()}
        self._slugs = {place: target.slug for place, target in self._places.items()}

    # -- time ---------------------------------------------------------------------------

    def timeline(self, from_ns: int | None, to_ns: int | None, buckets: int) -> Timeline:
        """The whole recording, or a part of it. Raises UsageError where it is none."""
        begin, end = self._span(from_ns, to_ns)
        loads = self._index.load(begin, end, buckets)
        bucket_ns = max((load.bucket_ns for load in loads), default=max(1, (end - begin) // buckets))
        events = self.events(begin, end)
        marks = thinned(events, MAX_MARKS)
        return Timeline(
            from_ns=begin,
            to_ns=end,
            bucket_ns=bucket_ns,
            load=tuple(LoadLine(one.bus, _shares(one.share), tuple(one.frames.tolist())) for one in loads),
            gaps=tuple(self._gap(gap) for gap in self._index.gaps() if gap.to_ns >= begin and gap.from_ns <= end),
            marks=tuple(marks),
            left_out=len(events) - len(marks),
        )

    def events(self, from_ns: int | None, to_ns: int | None, least: SeverityName = "info") -> list[EventLine]:
        """What the devices told and what was noted, by time; from ``least`` severity on."""
        told = [event_of_wire(one, self._slugs) for one in self._index.events(from_ns, to_ns) if is_told(one)]
        noted = [event_line(one) for one in self._index.noted(from_ns, to_ns)]
        lines = [line for line in (*told, *noted) if _RANK[line.severity] <= _RANK[least]]
        return sorted(lines, key=lambda line: line.t_ns)

    def _gap(self, gap: Gap) -> GapLine:
        node = gap.details.get("node")
        device = self._slugs.get((gap.bus, node)) if isinstance(node, int) else None
        details = {name: detail for name, detail in gap.details.items() if detail is not None}
        key = f"replay.gap.{gap.kind.value}"
        return GapLine(gap.kind.value, gap.bus, device, gap.from_ns, gap.to_ns, key, {"bus": gap.bus, **details})

    def _span(self, from_ns: int | None, to_ns: int | None) -> tuple[int, int]:
        begin = self._source.from_ns if from_ns is None else from_ns
        end = self._source.to_ns + 1 if to_ns is None else to_ns
        if begin >= end:
            raise UsageError(reason="the end is not behind the beginning")
        return begin, end

    # -- signals ------------------------------------------------------------------------

    def signals(self) -> list[SignalLine]:
        """Every described number that crossed the wire, device by device."""
        found = []
        for info in self._index.signals():
            target = self._places.get((info.bus, info.node))
            entry = None if target is None else target.description.entries.get(info.address)
            if target is not None and entry is not None and info.low is not None and info.high is not None:
                found.append(self._signal(target, entry, info, float(info.low), float(info.high)))
        return sorted(found, key=lambda line: (line.device, line.address))

    def _signal(self, target: Target, entry: Entry, info: SignalInfo, low: float, high: float) -> SignalLine:
        quantity = quantity_of(entry, target.lookup)
        name, sub = (entry.name, None) if entry.kind is Kind.VAR else (entry.object_name, entry.name)
        ends = sorted((low * float(quantity.scale), high * float(quantity.scale)))
        states = None
        if entry.enumeration is not None:
            values = target.description.enumerations[entry.enumeration].values
            states = {value.value: value.text_key for value in values}
        return SignalLine(
            device=target.slug,
            address=entry.address.short,
            name=name,
            sub=sub,
            unit=quantity.unit,
            count=info.count,
            changes=info.changes,
            first_s=self._seconds(info.first_ns),
            last_s=self._seconds(info.last_ns),
            low=ends[0],
            high=ends[1],
            states=states,
        )

    def series(self, signals: Sequence[str], from_ns: int | None, to_ns: int | None, points: int) -> list[SeriesLine]:
        """Signals named ``<device>/<address>``, each in at most about ``points`` points. Raises UsageError."""
        begin, end = self._span(from_ns, to_ns)
        return [self._series(*self._named(name), begin, end, points) for name in signals]

    def _series(self, target: Target, address: Address, begin: int, end: int, points: int) -> SeriesLine:
        entry = target.description.entries.get(address)
        bus, node = target.device.bus, target.node
        series = self._index.series((bus, node, address), begin, end, points)
        unit, scale = "", 1.0
        if entry is not None:
            quantity = quantity_of(entry, target.lookup)
            unit, scale = quantity.unit, float(quantity.scale)
        times, low, high = _broken(series, scale)
        return SeriesLine(
            device=target.slug,
            address=address.short,
            unit=unit,
            exact=series.kind is SeriesKind.POINTS,
            bucket_s=series.bucket_ns / _NS,
            t_s=tuple(self._seconds(one) for one in times),
            low=low,
            high=high,
        )

    def history(self, device: str, address: str) -> list[ChangeLine]:
        """When RAM of an object changed. Raises UsageError."""
        target, at = self._named(f"{device}/{address}")
        entry = target.description.entries.get(at)
        found = []
        for change in self._index.history(target.device.bus, target.node, at):
            data = change.data
            raw = None if data is None else raw_to_json(data if entry is None else decode(entry, data))
            source = None if change.source is None else SOURCE_NAMES[change.source]
            found.append(ChangeLine(change.t_ns, raw, None if data is None else data.hex(), source))
        return found

    def _named(self, name: str) -> tuple[Target, Address]:
        parts = name.split("/", 3)  # a device has three, an address may have a slash of its own
        device, address = "/".join(parts[:3]), parts[3] if len(parts) > 3 else ""
        target = self._targets.get(device)
        if target is None:
            raise UsageError(reason=f"no device '{device}' in the recording")
        return target, parse_address(address)

    def _seconds(self, t_ns: int) -> float:
        return (int(t_ns) - self._source.from_ns) / _NS


def thinned(lines: Sequence[EventLine], limit: int) -> list[EventLine]:
    """At most ``limit`` of the lines, in their order: errors go before warnings, and these before the rest."""
    if len(lines) <= limit:
        return list(lines)
    by_weight = sorted(range(len(lines)), key=lambda at: (_RANK[lines[at].severity], at))
    return [lines[at] for at in sorted(by_weight[:limit])]


def _shares(shares: Numbers) -> tuple[float | None, ...]:
    return tuple(None if math.isnan(one) else round(one, 5) for one in shares.tolist())


def _broken(series: Series, scale: float) -> tuple[list[int], _Values, _Values]:
    """Times and values, with a None wherever what was known ceased to hold."""
    times = np.concatenate([series.t_ns, series.breaks])
    known = np.arange(len(times)) < len(series.t_ns)
    order = np.lexsort((known, times))  # at the same time the break comes first

    def scaled(numbers: npt.NDArray[Any]) -> _Values:
        values = np.concatenate([numbers.astype(np.float64) * scale, np.zeros(len(series.breaks))])[order]
        return tuple(value if is_known else None for value, is_known in zip(values.tolist(), known[order], strict=True))

    return times[order].tolist(), scaled(series.low), scaled(series.high)
