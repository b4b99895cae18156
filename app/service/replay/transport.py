"""Where the cursor of a replay ought to be: play, pause, speed, loop. Pure; the clock is passed in.

The cursor is computed from the moment at which it was last set, never summed up, so that it cannot drift.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Final

from app.errors import UsageError

SLOWEST: Final = 0.01
FASTEST: Final = 50.0
ATTAINED_OVER_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Loop:
    """What is played over and over, in t_ns, from and to."""

    from_ns: int
    to_ns: int


class Transport:
    """The cursor between ``from_ns`` and ``to_ns`` (t_ns). ``now_ns`` is always a monotonic time in ns.

    At the end of the recording it pauses, at the end of the loop it goes on at the loop's beginning.
    """

    def __init__(self, from_ns: int, to_ns: int) -> None:
        self.from_ns = from_ns
        self.to_ns = to_ns
        self.playing = False
        self.speed = 1.0
        self.loop: Loop | None = None
        self._set_at_ns = 0
        self._t_ns = from_ns

    def t_ns(self, now_ns: int) -> int:
        """The place of the cursor; not beyond the end of what is played."""
        if not self.playing:
            return self._t_ns
        return min(self._t_ns + round((now_ns - self._set_at_ns) * self.speed), self.end_ns)

    @property
    def end_ns(self) -> int:
        """Where playing ends or begins again: the loop's end counts only for who has not passed it."""
        loop = self.loop
        return self.to_ns if loop is None or self._t_ns > loop.to_ns else loop.to_ns

    def play(self, now_ns: int) -> None:
        """Go on from here; from the beginning (of the loop) where the cursor stands at the end."""
        if self.playing:
            return
        if self._t_ns >= self.end_ns:
            self._t_ns = self.from_ns if self.loop is None else self.loop.from_ns
        self.playing, self._set_at_ns = True, now_ns

    def pause(self, now_ns: int) -> None:
        """Stand still."""
        self._t_ns = self.t_ns(now_ns)
        self.playing = False

    def seek(self, t_ns: int, now_ns: int) -> int:
        """Set the cursor; what lies outside is taken as the nearest end. Gives the place."""
        self._t_ns = min(max(t_ns, self.from_ns), self.to_ns)
        self._set_at_ns = now_ns
        return self._t_ns

    def set_speed(self, speed: float, now_ns: int) -> None:
        """Play ``speed`` times as fast as it happened. Raises UsageError outside 0.01 to 50."""
        if not SLOWEST <= speed <= FASTEST:
            raise UsageError(reason=f"speed {speed} is not within {SLOWEST} and {FASTEST:g}")
        self.seek(self.t_ns(now_ns), now_ns)
        self.speed = speed

    def set_loop(self, loop: Loop | None, now_ns: int) -> None:
        """Play a stretch over and over. Raises UsageError where it is none, or lies outside the recording."""
        if loop is not None and not self.from_ns <= loop.from_ns < loop.to_ns <= self.to_ns:
            raise UsageError(reason="the loop is no stretch of the recording")
        self.seek(self.t_ns(now_ns), now_ns)
        self.loop = loop

    def wrapped(self, now_ns: int) -> int | None:
        """Where to begin again, once the end of the loop is reached; at the end of the recording it pauses."""
        if not self.playing or self.t_ns(now_ns) < self.end_ns:
            return None
        if self.loop is None or self.end_ns != self.loop.to_ns:
            self.pause(now_ns)
            return None
        return self.loop.from_ns


class Attained:
    """The speed of the last second, out of what was really played."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, int]] = deque()

    def restart(self) -> None:
        """The cursor was set elsewhere, or stood still."""
        self._seen.clear()

    def take(self, now_ns: int, t_ns: int) -> None:
        """``t_ns`` of the recording have been played until now, wherever they lie."""
        self._seen.append((now_ns, t_ns))
        while now_ns - self._seen[0][0] > ATTAINED_OVER_NS:
            self._seen.popleft()

    @property
    def speed(self) -> float | None:
        """None before there is a tenth of a second to judge by."""
        if not self._seen:
            return None
        (first_ns, from_ns), (last_ns, to_ns) = self._seen[0], self._seen[-1]
        took_ns = last_ns - first_ns
        return (to_ns - from_ns) / took_ns if took_ns >= ATTAINED_OVER_NS // 10 else None
