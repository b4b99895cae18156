"""Where the scope listens: picks what it wants out of the decoded records of a bus, and hands it to the event loop.

``Tap.hear`` runs on the receive thread. While nothing is armed no tap stands at a bus. What it costs is one look-up for
each value that crosses the wire. The loop takes what has gathered in portions, so that it never stands still for long.
"""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from threading import Lock
from typing import Final

from app.service.scope.signals import Place
from app.wire.records import BootUpSeen, EmcySeen, GapSeen, Record, RestartSeen, Source, StateSeen, ValueSeen

log = logging.getLogger(__name__)

Heard = ValueSeen | EmcySeen | BootUpSeen | RestartSeen | StateSeen | GapSeen
_EVENTS: Final = frozenset({EmcySeen, BootUpSeen, RestartSeen, StateSeen, GapSeen})
MAX_QUEUED: Final = 200_000
"""Records that wait for the event loop. More are let go, and the capture has a gap."""
PORTION: Final = 1000
"""So many are handed over in one go: some milliseconds of work."""
SILENT_NS: Final = 1_000_000_000
"""A bus that told nothing for so long is waited for no longer."""
BEHIND: Final = "scope.gap.behind"


class Tap:
    """``take`` is called in ``loop`` with what was heard, in order. ``hear`` never raises and never waits.

    ``failed``: a defect of ours ended the listening; what came since is missing.
    """

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
        self._queue: deque[Heard] = deque()
        self._due = False
        self._losing: set[str] = set()
        """Buses of which something was let go; each has a gap in the queue where that began."""
        self.heard_ns: dict[str, int] = {}
        """When each bus told something last."""
        self.closed = False
        self.failed = False

    def hear(self, records: Sequence[Record]) -> None:
        """Take what is wanted of some records of one bus; on any thread."""
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
            if records:
                self.heard_ns[records[-1].bus] = records[-1].t_ns
        except Exception:  # the receive thread goes on whatever happens here
            log.exception("the scope listens no more")
            self.closed = self.failed = True

    def _queue_up(self, found: list[Heard]) -> None:
        bus = found[0].bus
        with self._lock:
            if len(self._queue) + len(found) <= self._max:
                self._losing.discard(bus)
                self._queue.extend(found)
            elif bus in self._losing:
                return
            else:  # told at once and beyond the limit, once for each bus: a loss without a mark would be none
                self._losing.add(bus)
                self._queue.append(GapSeen(found[0].t_ns, bus, 0, BEHIND))
            if self._due:
                return
            self._due = True
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._hand_over)

    # -- in the loop -------------------------------------------------------------------

    def settled_ns(self, now_ns: int, settle_ns: int) -> int:
        """Up to here all that crossed the wire was handed over; ``now_ns`` at most.

        Frames of a bus are told in their order, so what a bus told last vouches for what came before, and for
        ``settle_ns`` after it.
        """
        # What was heard first: what comes between both looks waits then, and is not vouched for.
        heard = [t_ns + settle_ns for t_ns in tuple(self.heard_ns.values()) if now_ns - t_ns < SILENT_NS]
        with self._lock:
            waiting = [self._queue[0].t_ns] if self._queue else []
        return min((now_ns, *waiting, *heard))

    async def drain(self) -> None:
        """Hand over all that waits; others get their turn meanwhile."""
        while self._hand_over():  # noqa: ASYNC110  others get their turn; nothing is waited for
            await asyncio.sleep(0)

    def _hand_over(self) -> bool:
        """One portion; True where more waits."""
        with self._lock:
            queue = self._queue
            portion = [queue.popleft() for _ in range(min(PORTION, len(queue)))]
            more = self._due = bool(queue)
        if more:
            self._loop.call_soon(self._hand_over)
        if portion:
            self._take(portion)
        return more
