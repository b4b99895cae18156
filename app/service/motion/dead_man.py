"""The dead man: a page that holds an axis says so every ``BEAT_S``. Pure; the clock is the server's monotonic one.

A beat counts only with the fencing number of the lease and a number higher than those before: what the network held
back or somebody recorded holds nothing. It counts from when it was sent, not from when it came: on a line that grows
slower and slower beats come as often as ever, and letting go would be heard later and later.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

BEAT_S: Final = 0.1
SILENCE_S: Final = 0.3
"""Without a beat for so long nobody holds the axis."""
_DRIFT: Final = 5e-4
"""Two clocks may run apart by so much: the shortest way seen is forgotten as fast."""


class DeadMan:
    """Whether the axes are held by the page of lease ``fence``."""

    def __init__(self, monotonic_s: Callable[[], float]) -> None:
        self._now_s = monotonic_s
        self._fence = 0
        self._number = 0
        self._beat_s: float | None = None
        self._least: tuple[float, float] | None = None
        """The shortest way of a beat, with the unknown distance of both clocks in it, and when it was seen."""
        self._holding = False
        self._void = False
        self._order = 0
        self.ignored = 0
        """Beats that held nothing: of another lease, or older than one before."""

    def start(self, fence: int) -> None:
        """Another lease: nothing is held yet."""
        self._fence, self._number, self._beat_s, self._least = fence, 0, None, None
        self._holding = self._void = False

    def beat(self, fence: int, number: int, holding: bool, order: int = 0, sent_s: float | None = None) -> bool:
        """A beat has come; whether it counts. ``holding``: the person presses what ``order`` has the axis do.

        ``sent_s`` is the time of the page's own clock, from any zero; without it the beat is as old as its coming.
        """
        if fence != self._fence or number <= self._number:
            self.ignored += 1
            return False
        self._void = self._void and holding
        now_s = self._now_s()
        late_s = 0.0 if sent_s is None else self._late_s(now_s, sent_s)
        self._number, self._beat_s, self._order = number, now_s - late_s, order
        self._holding = holding and not self._void
        return True

    def _late_s(self, now_s: float, sent_s: float) -> float:
        """How much longer than the quickest beat of this lease it took."""
        way_s = now_s - sent_s
        if self._least is not None:
            least_s, seen_s = self._least
            floor_s = least_s + _DRIFT * (now_s - seen_s)
            if way_s > floor_s:
                return way_s - floor_s
        self._least = way_s, now_s
        return 0.0

    def release(self) -> None:
        """What was held holds nothing any more: it must be let go and pressed anew."""
        self._void = self._void or self._holding
        self._holding = False

    @property
    def silent_s(self) -> float | None:
        """How long nothing was heard; None where nothing ever was."""
        return None if self._beat_s is None else self._now_s() - self._beat_s

    @property
    def present(self) -> bool:
        """The page is there."""
        return self._beat_s is not None and self._now_s() - self._beat_s < SILENCE_S

    def holds(self, order: int) -> bool:
        """The page is there and its person presses what this order has the axis do."""
        return self._order == order and self.holding

    @property
    def holding(self) -> bool:
        """The page is there and its person presses what moves the axis."""
        return self._holding and self.present
