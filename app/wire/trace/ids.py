"""One entry an identifier: how often it came, when, how far apart, and what it carried last.

Not thread-safe: the caller locks.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from app.wire.frame import Can, Frame
from app.wire.trace.tracer import Item

SECOND_NS: Final = 1_000_000_000
MAX_IDENTIFIERS: Final = 4096
"""More are counted together: no bus has as many, but noise on 29-bit identifiers may."""


class IdentifierView(NamedTuple):
    """One identifier: its latest frame, and how many came.

    ``period_ns`` is the distance of its last two frames; ``per_second`` counts the frames of the last full second.
    """

    frame: Frame
    frames: int
    period_ns: int | None
    shortest_ns: int | None
    longest_ns: int | None
    per_second: int


class _Entry:
    __slots__ = ("count", "frame", "in_second", "longest_ns", "period_ns", "second", "shortest_ns", "was_second")

    def __init__(self, frame: Frame) -> None:
        self.frame = frame
        self.count = 0
        self.period_ns: int | None = None
        self.shortest_ns: int | None = None
        self.longest_ns: int | None = None
        self.second = frame.t_ns // SECOND_NS
        self.in_second = self.was_second = 0

    def take(self, frame: Frame) -> None:
        if self.count:
            period_ns = frame.t_ns - self.frame.t_ns
            self.period_ns = period_ns
            self.shortest_ns = min(period_ns, self.shortest_ns or period_ns)
            self.longest_ns = max(period_ns, self.longest_ns or period_ns)
        second = frame.t_ns // SECOND_NS
        if second != self.second:
            self.was_second = self.in_second if second == self.second + 1 else 0
            self.second, self.in_second = second, 0
        self.in_second += 1
        self.count += 1
        self.frame = frame

    def view(self, now_ns: int) -> IdentifierView:
        ago = now_ns // SECOND_NS - self.second
        rate = {0: self.was_second, 1: self.in_second}.get(ago, 0)
        return IdentifierView(self.frame, self.count, self.period_ns, self.shortest_ns, self.longest_ns, rate)

    def copy(self) -> _Entry:
        other = _Entry(self.frame)
        for name in self.__slots__:
            setattr(other, name, getattr(self, name))
        return other


class Identifiers:
    """All identifiers of a bus since it was connected."""

    def __init__(self) -> None:
        self._entries: dict[tuple[int, bool], _Entry] = {}
        self.uncounted = 0
        """Frames of identifiers beyond the limit."""

    def take(self, items: Iterable[Item]) -> None:
        """Count frames; gaps and error frames have no identifier."""
        entries = self._entries
        for item in items:
            can = item[3] if isinstance(item, Frame) else None
            if not isinstance(can, Can) or can.error or not isinstance(item, Frame):
                continue
            key = (can.can_id, can.extended)
            entry = entries.get(key)
            if entry is None:
                if len(entries) >= MAX_IDENTIFIERS:
                    self.uncounted += 1
                    continue
                entry = entries[key] = _Entry(item)
            entry.take(item)

    def copy(self) -> Identifiers:
        """A table of its own with the same counts."""
        other = Identifiers()
        other._entries = {key: entry.copy() for key, entry in self._entries.items()}
        other.uncounted = self.uncounted
        return other

    def views(self, now_ns: int) -> list[IdentifierView]:
        """All, by identifier."""
        return [self._entries[key].view(now_ns) for key in sorted(self._entries)]
