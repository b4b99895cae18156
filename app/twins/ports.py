"""What a twin needs of the line it hangs on, and timers that can be set again.

Times are in nanoseconds on the line's own clock; a twin reads no other. ``app.twins.line.CanLine`` is such a line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Protocol

from app.wire.frame import Can

OnFrame = Callable[[Can, int], None]
"""Takes a frame and the time (ns) at which it was complete on the bus."""
OnTime = Callable[[int], None]
"""Takes the time (ns) for which it was asked."""


class Port(Protocol):
    """A node's place on the line; frames of one identifier leave in the order in which they were sent.

    ``pending``: how many wait.
    """

    pending: int

    def send(self, can: Can, not_before_ns: int = 0, /) -> None:
        """Queue a frame that takes part in arbitration from ``not_before_ns`` on (0: at once)."""

    def accept(self, identifiers: Iterable[int] | None, /) -> None:
        """Receive only these identifiers; None: all."""

    def clear(self) -> None:
        """Forget the frames that wait."""

    def detach(self) -> None:
        """Leave the line."""

    def cut(self) -> None:
        """Cut the node off the line: it neither sends nor hears. Cuts add up."""

    def join(self) -> None:
        """End one cut."""


class Line(Protocol):
    """A simulated bus with its clock. ``bitrate`` in bit/s."""

    bitrate: int
    now_ns: int

    def attach(self, handler: OnFrame, /) -> Port:
        """Join the line: ``handler`` gets the frames of all others."""

    def call_at(self, t_ns: int, callback: OnTime, /) -> None:
        """Call ``callback`` with the time once the line's clock reaches ``t_ns``."""


class Alarm:
    """One timer on a line: setting it again or clearing it makes an earlier setting void."""

    __slots__ = ("_line", "_round")

    def __init__(self, line: Line) -> None:
        self._line = line
        self._round = 0

    def set(self, t_ns: int, fn: OnTime) -> None:
        """Call ``fn`` with the time at ``t_ns``, unless set again or cleared before."""
        self._round += 1
        mine = self._round

        def ring(now_ns: int) -> None:
            if mine == self._round:
                self._round += 1
                fn(now_ns)

        self._line.call_at(t_ns, ring)

    def clear(self) -> None:
        """Void the current setting, if any."""
        self._round += 1
