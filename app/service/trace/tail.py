"""The running trace of one page: what came since the last look, filtered, and no more of it than a page can show."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from app.errors import UsageError
from app.service.stage import Stage
from app.service.trace.log import BusTrace
from app.service.trace.query import TraceQuery, filter_of
from app.service.trace.text import Namer, TraceLine, line
from app.wire.trace.filter import TraceFilter
from app.wire.trace.tracer import Tone, TraceRow, Tracing

PERIOD_S: Final = 0.1
MAX_ROWS: Final = 100
"""Of one batch."""
MAX_WAITING: Final = 300
"""Rows that wait for a later batch: a burst is shown whole, a flood is sampled."""


@dataclass(frozen=True, slots=True)
class TraceBatch:
    """New rows, oldest first, and what became of the frames since ``start_t_ns``.

    ``seen`` counts all frames, ``matched`` those that the filter lets pass, ``sent`` those that were sent; ``left_out``
    were matched and are not sent: the recording has them. The rest waits for the next batch. ``invalid`` says what is
    wrong with the filter; then nothing is sent.
    """

    id: int
    start_t_ns: int
    rows: tuple[TraceLine, ...]
    seen: int
    matched: int
    sent: int
    left_out: int
    invalid: str | None


class _BusTail:
    def __init__(self, trace: BusTrace) -> None:
        self._trace = trace
        self._epoch = trace.epoch
        self._tracer, self._next = trace.tracer_now()

    def rows(self) -> tuple[int, list[TraceRow]]:
        """Frames that were lost to the tail, and the rows of all others since the last call."""
        if self._trace.epoch != self._epoch:
            before = self._next
            self._epoch = self._trace.epoch
            self._tracer, self._next = self._trace.tracer_now()
            return self._next - before, []
        first, items = self._trace.since(self._next)
        missed = first - self._next
        if missed:
            self._tracer = self._resumed(first)
        self._next = first + len(items)
        return missed, list(self._tracer.rows(items))

    def _resumed(self, first: int) -> Tracing:
        tracer = self._trace.tracer()
        for chunk in self._trace.chunks():
            if chunk.first == first:
                tracer.restart(chunk.snapshot)
        return tracer


class TraceTail:
    """The tail of all buses of ``stage`` from now on. For one thread."""

    def __init__(self, stage: Stage, query: TraceQuery) -> None:
        targets = list(stage.targets)
        self._query = query
        self._namer = Namer(targets)
        self._filter: TraceFilter | None = None
        self._invalid: str | None = None
        try:
            self._filter = filter_of(query, targets, self._namer)
        except UsageError as error:
            self._invalid = str(error.details["reason"])
        self._tails = [_BusTail(link.trace) for link in stage.buses.values()]
        self._start_ns = stage.stamper()
        self._waiting: deque[TraceRow] = deque()
        self._seen = self._matched = self._sent = self._left_out = 0

    def batch(self) -> TraceBatch:
        """What came since the last call."""
        for tail in self._tails:
            missed, rows = tail.rows()
            self._seen += missed + len(rows)
            self._left_out += missed
            self._keep(rows)
        if len(self._tails) > 1:
            self._waiting = deque(sorted(self._waiting, key=lambda row: row.t_ns))
        rows = thinned(list(self._waiting), MAX_WAITING)
        self._left_out += len(self._waiting) - len(rows)
        now, self._waiting = rows[:MAX_ROWS], deque(rows[MAX_ROWS:])
        self._sent += len(now)
        return TraceBatch(
            id=self._query.id,
            start_t_ns=self._start_ns,
            rows=tuple(line(row, self._namer) for row in now),
            seen=self._seen,
            matched=self._matched,
            sent=self._sent,
            left_out=self._left_out,
            invalid=self._invalid,
        )

    def _keep(self, rows: list[TraceRow]) -> None:
        wanted = self._filter
        if wanted is None:
            return
        passed = [row for row in rows if wanted.passes_item(row.item, row.speaker) and wanted.passes_row(row)]
        self._matched += len(passed)
        self._waiting += passed


def thinned(rows: list[TraceRow], limit: int) -> list[TraceRow]:
    """At most ``limit`` of the rows, in their order: what failed first, then the newest."""
    if len(rows) <= limit:
        return rows
    bad = [at for at, row in enumerate(rows) if row.tone is not Tone.PLAIN][-limit:]
    chosen = set(bad)
    for at in range(len(rows) - 1, -1, -1):
        if len(chosen) >= limit:
            break
        chosen.add(at)
    return [rows[at] for at in sorted(chosen)]
