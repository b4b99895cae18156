"""Where the scope listens: picks what it wants out of the decoded records of a bus, and hands it to the event loop.

It runs on the receive thread. While nothing is armed no tap stands at a bus. What it costs is one look-up for each
value that crosses the wire.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from threading import Lock
from typing import Final

from app.service.scope.signals import Place
from app.wire.records import BootUpSeen, EmcySeen, GapSeen, Record, Source, StateSeen, ValueSeen

log = logging.getLogger(__name__)

Heard = ValueSeen | EmcySeen | BootUpSeen | StateSeen | GapSeen
_EVENTS: Final = frozenset({EmcySeen, BootUpSeen, StateSeen, GapSeen})
MAX_QUEUED: Final = 200_000
"""Records that wait for the event loop. More are let go, and the capture has a gap."""
BEHIND: Final = "scope.gap.behind"


class Tap:
    """``take`` is called in ``loop`` with what was heard, in order. ``hear`` never raises and never waits."""

    def __init__(
        self,
        wanted: Mapping[Place, int],
        loop: asyncio.AbstractEventLoop,
        take: Callable[[Sequence[Heard]], None],
        max_queued: int = MAX_QUEUED,
    ) -> None:
        # By plain tuples: a named one costs as much again to make.
        self._wanted = {tuple(place): number for place, number in wanted.items()}
        self._loop = loop
        self._take = take
        self._max = max_queued
        self._lock = Lock()
        self._queue: list[Heard] = []
        self._due = False
        self._lost_ns: int | None = None
        self.closed = False

    def hear(self, records: Sequence[Record]) -> None:
        """Take what is wanted of some records; on any thread."""
        if self.closed:
            return
        try:
            wanted = self._wanted
            found = [
                one
                for one in records
                if (
                    (one.bus, one.node, one.address) in wanted and one.source is not Source.EMCY
                    if type(one) is ValueSeen
                    else type(one) in _EVENTS
                )
            ]
            if found:
                self._queue_up(found)  # type: ignore[arg-type]  # the comprehension leaves nothing else
        except Exception:  # the receive thread goes on whatever happens here
            log.exception("the scope listens no more")
            self.closed = True

    def _queue_up(self, found: list[Heard]) -> None:
        with self._lock:
            if len(self._queue) + len(found) > self._max:
                self._lost_ns = found[-1].t_ns
                return
            if self._lost_ns is not None:
                self._queue.append(GapSeen(self._lost_ns, found[0].bus, 0, BEHIND))
                self._lost_ns = None
            self._queue.extend(found)
            if self._due:
                return
            self._due = True
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._hand_over)

    def _hand_over(self) -> None:
        with self._lock:
            queue, self._queue = self._queue, []
            self._due = False
        if not self.closed:
            self._take(queue)
