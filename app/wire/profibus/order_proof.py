"""Which order the process data of a slave have, told by its line alone: no setting, and nobody to ask.

Whoever reads by PKW a parameter that process data tell as well shows the order: both stand in one telegram. So a
recording proves its own process data, whichever master it was (ED2 manual, 1.4, 4.5 and 4.6).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from app.model.address import Address
from app.wire.profibus.pzd import ORDERS, First, Order, orders_that_fit
from app.wire.profibus.telegrams import Part, Signal, TelegramType

CONTRADICTIONS: Final = 3
"""So many readings in a row that fit another order than those left, and the proof begins anew: another device is there."""


class OrderProof:
    """What is left of the four orders. ``setting`` is what the site says; it decides between words only."""

    def __init__(self) -> None:
        self.setting: Order | None = None
        self._left = ORDERS
        self._against = 0

    @property
    def order(self) -> Order | None:
        """The order of bytes and words; None while it is not proven."""
        if len(self._left) == 1:
            return self._left[0]
        return self.setting if self.byte is not None and self.setting in self._left else None

    @property
    def byte(self) -> First | None:
        """The order of bytes in a word, which is all that a signal of one word needs; None while it is not proven."""
        ends = {order.byte for order in self._left}
        return ends.pop() if len(ends) == 1 else None

    def tells(self, signal: Signal) -> Order | None:
        """By which order ``signal`` can be read; None while it is not proven enough for it."""
        if signal.words > 1 or self.byte is None:
            return self.order
        return Order(self.byte, self.byte)

    def know(self, order: Order | None) -> None:
        """Somebody has proven it; None: nothing is proven."""
        self._left, self._against = ORDERS if order is None else (order,), 0

    def take(self, telegram: TelegramType, address: Address, data: bytes, sent: bytes) -> None:
        """``address`` was read by PKW as ``data`` (least significant byte first), in one telegram with ``sent``."""
        signal = _signal_of(telegram, address)
        if signal is None:
            return
        value = int.from_bytes(data, "little", signed=signal.signed)
        fits = orders_that_fit(telegram.sent, sent, {signal: value})
        left = tuple(order for order in self._left if order in fits)
        if left:
            self._left, self._against = left, 0
            return
        if not fits:
            return  # the value has changed since it was read: that says nothing, as often as it comes
        self._against += 1
        if self._against >= CONTRADICTIONS:
            self._left, self._against = fits, 0

    def snapshot(self) -> dict[str, Any]:
        """JSON-able. The setting is not in it."""
        return {"left": [order_text(order) for order in self._left], "against": self._against}

    def restore(self, kept: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()``. Raises KeyError or ValueError on another state."""
        left = tuple(read_order(text) for text in kept["left"])
        if not left:
            raise ValueError("no order is left in this state")
        self._left, self._against = left, int(kept["against"])


def order_text(order: Order) -> str:
    """``low-high``: which byte of a word, and which word of a double word, comes first."""
    return f"{order.byte.value}-{order.word.value}"


def read_order(text: str) -> Order:
    """What ``order_text`` gave. Raises ValueError."""
    byte, _, word = text.partition("-")
    return Order(First(byte), First(word))


def _signal_of(telegram: TelegramType, address: Address) -> Signal | None:
    """What the slave sends of ``address``; None where that is nothing, or a byte that shares its word."""
    for word in telegram.sent:
        for signal in word:
            if signal.address == address and signal.part is Part.WHOLE:
                return signal
    return None
