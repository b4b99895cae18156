"""The process data that one station is sent, and changes of them that must not be lost.

Until the order of their bytes is proven they are zeros, which is the same in any order: no bit of the controlword.
Every change stands in the telegrams until one exchange has surely brought it to the station, before the next one may
follow: an edge, such as that of new_setpoint, is never skipped because a telegram was lost. Pure: no clock, no line.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Final

from app.drivers.profibus_pkw import Failure
from app.wire.profibus.pzd import Order, encode_pzd
from app.wire.profibus.telegrams import CONTROL_WORD, Signal, TelegramType

Delivered = Callable[[Failure | None, bool], None]
"""Called once: None where the station has it, else why not; and whether it was sent."""
ENABLING: Final = 0x0007
"""D, H and M: all of them 0 bring the axis to INIT from wherever it is (ED2 manual, 4.8.2)."""


class Change:
    """Some signals get new values at once. ``refusal`` is asked right before they do whether they may not."""

    def __init__(
        self, values: Mapping[Signal, int], end: Delivered,
        urgent: bool = False, refusal: Callable[[], Failure | None] = lambda: None,
    ) -> None:  # fmt: skip
        self.values = dict(values)
        self.urgent = urgent
        self.refusal = refusal
        self._end = end
        self._ended = False

    def end(self, failure: Failure | None, sent: bool) -> None:
        """Tell what became of it, once."""
        if not self._ended:
            self._ended = True
            self._end(failure, sent)


class Image:
    """What station and telegram get."""

    def __init__(self, telegram: TelegramType) -> None:
        self.telegram = telegram
        self.order: Order | None = None
        self.values: dict[Signal, int] = {}
        self._waiting: deque[Change] = deque()
        self._going: Change | None = None

    @property
    def busy(self) -> bool:
        """A change is on its way."""
        return self._going is not None or bool(self._waiting)

    @property
    def controlword(self) -> int:
        """As it stands in the telegrams."""
        return self.values.get(CONTROL_WORD, 0)

    @property
    def standing(self) -> bytes:
        """Bytes as they stand in the telegrams. Raises ValueError where a value does not fit its signal."""
        if self.order is None:
            return bytes(2 * self.telegram.received_words)
        return encode_pzd(self.telegram.received, self.values, self.order)

    def put(self, change: Change) -> None:
        """Queue it. An urgent one takes the place of all that waits."""
        if not change.urgent:
            self._waiting.append(change)
            return
        going, self._going = self._going, None
        if going is not None:
            going.end(Failure.GONE, True)  # whether it came to the station is not known
        for one in self._waiting:
            one.end(Failure.OVERTAKEN, False)
        self._waiting.clear()
        self._waiting.append(change)

    def drop(self, change: Change) -> None:
        """Nobody waits for it any more. What was sent stays sent."""
        if change in self._waiting:
            self._waiting.remove(change)
        change.end(Failure.CANCELLED, change is self._going)

    def outputs(self) -> bytes:
        """Bytes for the next exchange. Raises ValueError where a value does not fit its signal."""
        while self._going is None and self._waiting:
            change = self._waiting.popleft()
            failure = change.refusal()
            if failure is None and self.order is None and any(change.values.values()):
                failure = Failure.NOT_READY
            if failure is None:
                self._going = change
                self.values.update(change.values)
            else:
                change.end(failure, False)
        return self.standing

    def delivered(self) -> None:
        """The station has surely taken what ``outputs`` gave."""
        going, self._going = self._going, None
        if going is not None:
            going.end(None, True)

    def forget(self, failure: Failure) -> None:
        """The station has gone: all begins anew, with a controlword of 0."""
        going, waiting = self._going, list(self._waiting)
        self._going, self.order, self.values = None, None, {}
        self._waiting.clear()
        if going is not None:
            going.end(failure, True)
        for one in waiting:
            one.end(failure, False)
