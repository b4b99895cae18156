"""Where single steps lead: the next frame or event, or the one before."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import deque
from typing import Final

from app.service.analysis.key_events import key_events
from app.service.analysis.look import Look
from app.service.replay.source import Source

_FIRST_LOOK_NS: Final = 10_000_000


def frame_before(source: Source, t_ns: int) -> int | None:
    """Time of the last frame before ``t_ns``; looks back by windows that grow, over any silence."""
    end_ns, window_ns = t_ns, _FIRST_LOOK_NS
    while end_ns > source.from_ns:
        begin_ns = max(end_ns - window_ns, source.from_ns)
        found = next(iter(deque(source.frames(begin_ns, end_ns), maxlen=1)), None)
        if found is not None:
            return found.t_ns
        end_ns, window_ns = begin_ns, window_ns * 10
    return None


def frame_after(source: Source, t_ns: int) -> int | None:
    """Time of the first frame after ``t_ns``."""
    found = next(source.frames(t_ns + 1), None)
    return None if found is None else found.t_ns


class EventSteps:
    """From event to event: trips, errors and warnings; before there is an index, what the recorder noted."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._times: list[int] | None = None

    def beside(self, t_ns: int, forward: bool) -> int | None:
        """Time of the next event after ``t_ns``, or of the last one before it. Raises RecordingError."""
        times = self._known()
        at = bisect_right(times, t_ns) if forward else bisect_left(times, t_ns) - 1
        return times[at] if 0 <= at < len(times) else None

    def _known(self) -> list[int]:
        if self._times is not None:
            return self._times
        source = self._source
        source.look_for_index()
        if source.index is None:
            return [event.t_ns for event in source.events]
        with Look(source.path, source.cache) as look:
            self._times = [event.t_ns for event in key_events(look)]
        return self._times
