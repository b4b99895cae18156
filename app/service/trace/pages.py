"""Pages of the trace: rows before, after or around a moment, from what is kept in memory, else from the recording.

Blocking: to be called in a thread of its own. Both sources are decoded the same way, from a known state of the decoder
before the first frame; the answer says where its rows come from and how far was looked. Nothing later than the stage's
now is told: a recording that is replayed holds frames that have not happened yet at its cursor.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final, Literal

from app.recording.content import Keyframe
from app.recording.reader import Recording, open_recording
from app.service.stage import Stage
from app.service.trace.log import BusTrace
from app.service.trace.query import TraceQuery, filter_of
from app.service.trace.text import Namer, TraceLine, line
from app.wire.trace.filter import TraceFilter
from app.wire.trace.tracer import Item, TraceRow, Tracing

MAX_SCANNED: Final = 50_000
"""Items looked at for one page, a bus: with a filter that hardly anything passes, the page says how far it got."""
KEYFRAME_NS: Final = 6_000_000_000
"""A recording has a keyframe at least as often."""
FIRST_WINDOW_NS: Final = 2_000_000_000
SourceName = Literal["ring", "recording"]


class Side(Enum):
    """Which rows are wanted: earlier or later than the moment, or both with the moment's own."""

    BEFORE = "before"
    AFTER = "after"
    AROUND = "around"


@dataclass(frozen=True, slots=True)
class TracePage:
    """Rows, oldest first. Looked at was everything between ``from_t_ns`` and ``to_t_ns`` (None: no end).

    ``older`` and ``newer``: there may be more beyond.
    """

    rows: tuple[TraceLine, ...]
    source: SourceName
    older: bool
    newer: bool
    from_t_ns: int | None
    to_t_ns: int | None


@dataclass(slots=True)
class _Found:
    """Rows of one look, and whether it ended early, at ``reached_ns``."""

    rows: list[TraceRow]
    more: bool
    reached_ns: int | None


class TracePages:
    """Reads pages of the trace of ``stage`` for one query. Raises UsageError where the query makes no sense."""

    def __init__(self, stage: Stage, query: TraceQuery) -> None:
        targets = list(stage.targets)
        self._stage = stage
        self._namer = Namer(targets)
        self._filter = filter_of(query, targets, self._namer)
        self._traces = [link.trace for link in stage.buses.values()]

    def page(self, side: Side, t_ns: int, limit: int) -> TracePage:
        """Up to ``limit`` rows. Raises RecordingError where the recording is needed and cannot be read."""
        if side is Side.AROUND:
            return self._around(t_ns, limit)
        return self._before(t_ns, limit) if side is Side.BEFORE else self._after(t_ns, limit)

    def _around(self, t_ns: int, limit: int) -> TracePage:
        half = limit // 2
        earlier = self._before(t_ns, half)
        later = self._after(t_ns - 1, half)
        rows = {row.t_ns: row for row in (*earlier.rows, *later.rows)}
        return TracePage(
            tuple(rows[key] for key in sorted(rows)),
            earlier.source if later.source == "ring" else later.source,
            earlier.older,
            later.newer,
            earlier.from_t_ns,
            later.to_t_ns,
        )

    # -- what is kept in memory -------------------------------------------------------

    def _before(self, t_ns: int, limit: int) -> TracePage:
        starts = [chunks[0].start_ns for trace in self._traces if (chunks := trace.chunks())]
        kept_from_ns = min(starts, default=t_ns)
        if t_ns <= kept_from_ns:
            return self._recorded_before(t_ns, limit)
        found = _merged([_ring_before(trace, self._filter, t_ns, limit) for trace in self._traces], limit, newest=True)
        recorded = bool(self._parts())
        return self._page(found, "ring", older=found.more or recorded, newer=True, edge=(found.reached_ns, t_ns))

    def _after(self, t_ns: int, limit: int) -> TracePage:
        starts = [chunks[0].start_ns for trace in self._traces if (chunks := trace.chunks())]
        if starts and t_ns < min(starts) - 1 and self._parts():
            return self._recorded_after(t_ns, limit)
        found = _merged([_ring_after(trace, self._filter, t_ns, limit) for trace in self._traces], limit, newest=False)
        return self._page(found, "ring", older=True, newer=found.more, edge=(t_ns, found.reached_ns))

    def _page(
        self, found: _Found, source: SourceName, older: bool, newer: bool, edge: tuple[int | None, int | None]
    ) -> TracePage:
        rows = tuple(line(row, self._namer) for row in found.rows)
        return TracePage(rows, source, older, newer, edge[0], edge[1])

    # -- the recording ----------------------------------------------------------------

    def _recorded_before(self, t_ns: int, limit: int) -> TracePage:
        t_ns = min(t_ns, self._stage.stamper() + 1)
        for path in reversed(self._parts()):
            with open_recording(path) as recording:
                span = recording.span_ns
                if span is None or span[0] >= t_ns:
                    continue
                found = self._look_back(recording, span[0], t_ns, limit)
                older = found.more or path != self._parts()[0]
                return self._page(found, "recording", older, True, (found.reached_ns, t_ns))
        return TracePage((), "recording", older=False, newer=True, from_t_ns=None, to_t_ns=t_ns)

    def _look_back(self, recording: Recording, start_ns: int, t_ns: int, limit: int) -> _Found:
        """Look in windows that grow, until there are enough rows."""
        window_ns = FIRST_WINDOW_NS
        while True:
            from_ns = max(start_ns, t_ns - window_ns)
            rows, scanned = self._decoded(recording, from_ns, t_ns, limit)
            if len(rows) >= limit or from_ns <= start_ns or scanned > MAX_SCANNED:
                reached_ns = rows[0].t_ns if len(rows) >= limit else from_ns
                return _Found(rows, len(rows) >= limit or from_ns > start_ns, reached_ns)
            window_ns *= 4

    def _decoded(self, recording: Recording, from_ns: int, to_ns: int, limit: int) -> tuple[list[TraceRow], int]:
        """The last rows before ``to_ns``, and how many frames were looked at."""
        rows: deque[TraceRow] = deque(maxlen=limit)
        scanned = 0
        for row in self._rows_of(recording, from_ns, to_ns):
            scanned += 1
            if self._passes(row):
                rows.append(row)
        return list(rows), scanned

    def _recorded_after(self, t_ns: int, limit: int) -> TracePage:
        now_ns = self._stage.stamper()
        for path in self._parts():
            with open_recording(path) as recording:
                span = recording.span_ns
                if span is None or min(span[1], now_ns) <= t_ns:
                    continue
                found = self._look_on(recording, t_ns + 1, min(span[1], now_ns), limit)
                return self._page(found, "recording", True, True, (t_ns, found.reached_ns))
        found = _merged([_ring_after(trace, self._filter, t_ns, limit) for trace in self._traces], limit, newest=False)
        return self._page(found, "ring", older=True, newer=found.more, edge=(t_ns, found.reached_ns))

    def _look_on(self, recording: Recording, from_ns: int, to_ns: int, limit: int) -> _Found:
        rows: list[TraceRow] = []
        for scanned, row in enumerate(self._rows_of(recording, from_ns, to_ns + 1)):
            if self._passes(row):
                rows.append(row)
            if len(rows) >= limit or scanned >= MAX_SCANNED:
                return _Found(rows, True, row.t_ns)
        return _Found(rows, True, to_ns)

    def _rows_of(self, recording: Recording, from_ns: int, to_ns: int) -> Iterator[TraceRow]:
        """Rows from ``from_ns`` on and before ``to_ns``, decoded from the last keyframe before."""
        keyframe = _keyframe(recording, from_ns)
        states: Mapping[str, Any] = {} if keyframe is None else keyframe.state.get("decoders", {})
        tracers = {trace.bus: trace.tracer() for trace in self._traces}
        for bus, tracer in tracers.items():
            if bus in states:
                tracer.restart(states[bus])
        for frame in recording.frames(None if keyframe is None else keyframe.t_ns + 1, to_ns):
            of_bus = tracers.get(frame.bus)
            if of_bus is None:
                continue
            row = of_bus.take(frame)
            if frame.t_ns >= from_ns:
                yield row

    def _parts(self) -> Sequence[Path]:
        """The files of this recording, oldest first."""
        return self._stage.recorded_files()

    def _passes(self, row: TraceRow) -> bool:
        return self._filter.passes_item(row.item, row.speaker) and self._filter.passes_row(row)


def _keyframe(recording: Recording, t_ns: int) -> Keyframe | None:
    """The last one before ``t_ns``."""
    found = None
    for keyframe in recording.keyframes(t_ns - KEYFRAME_NS, t_ns):
        found = keyframe
    return found


def _ring_before(trace: BusTrace, wanted: TraceFilter, t_ns: int, limit: int) -> _Found:
    """The last rows before ``t_ns``, chunk by chunk backwards."""
    parts: list[list[TraceRow]] = []
    count = scanned = 0
    tracer = trace.tracer()
    chunks = [chunk for chunk in trace.chunks() if chunk.count and chunk.start_ns < t_ns]
    reached_ns = None
    while chunks and count < limit and scanned < MAX_SCANNED:
        chunk = chunks.pop()
        tracer.restart(chunk.snapshot)
        rows = [row for row in _rows_until(tracer, chunk.items(), t_ns) if _passes(wanted, row)]
        parts.append(rows)
        count += len(rows)
        scanned += chunk.count
        reached_ns = chunk.start_ns
    rows = [row for part in reversed(parts) for row in part]
    if len(rows) > limit:
        return _Found(rows[-limit:], True, rows[-limit].t_ns)
    return _Found(rows, bool(chunks), reached_ns)


def _ring_after(trace: BusTrace, wanted: TraceFilter, t_ns: int, limit: int) -> _Found:
    """The first rows after ``t_ns``, chunk by chunk."""
    rows: list[TraceRow] = []
    scanned = 0
    tracer = trace.tracer()
    chunks = [chunk for chunk in trace.chunks() if chunk.end_ns > t_ns]
    for at, chunk in enumerate(chunks):
        tracer.restart(chunk.snapshot)
        rows += [row for row in tracer.rows(chunk.items()) if row.t_ns > t_ns and _passes(wanted, row)]
        scanned += chunk.count
        if len(rows) > limit:
            return _Found(rows[:limit], True, rows[limit - 1].t_ns)
        if scanned >= MAX_SCANNED and at + 1 < len(chunks):
            return _Found(rows, True, chunk.end_ns)
    return _Found(rows, False, chunks[-1].end_ns if chunks else None)


def _rows_until(tracer: Tracing, items: Iterable[Item], t_ns: int) -> Iterator[TraceRow]:
    for item in items:
        if item[0] >= t_ns:
            return
        yield tracer.take(item)


def _passes(wanted: TraceFilter, row: TraceRow) -> bool:
    return wanted.passes_item(row.item, row.speaker) and wanted.passes_row(row)


def _merged(found: list[_Found], limit: int, newest: bool) -> _Found:
    """Those of all buses by time. Beyond the edge of the bus that was looked at least far nothing is told."""
    edges = [one.reached_ns for one in found if one.more and one.reached_ns is not None]
    edge_ns = (max(edges) if newest else min(edges)) if edges else None
    rows = list(heapq.merge(*(one.rows for one in found), key=lambda row: row.t_ns))
    if edge_ns is not None:
        rows = [row for row in rows if (row.t_ns >= edge_ns if newest else row.t_ns <= edge_ns)]
    cut = rows[-limit:] if newest else rows[:limit]
    if len(cut) < len(rows):
        return _Found(cut, True, cut[0 if newest else -1].t_ns)
    known = [one.reached_ns for one in found if one.reached_ns is not None]
    plain = (min(known) if newest else max(known)) if known else None
    return _Found(cut, bool(edges), plain if edge_ns is None else edge_ns)
