"""The guided check of the order of bytes: what PKW reads of a parameter, against the process data that tell it too.

The manual says one order in words and shows another in its examples, and a controlword in the wrong one sets bits that
nobody meant. So no bit of it is sent before both agree (ED2 manual, 1.4, 4.5 and 4.6).
"""

from __future__ import annotations

from typing import Final, NamedTuple

from app.wire.profibus.pzd import ORDERS, Order, orders_that_fit
from app.wire.profibus.telegrams import Signal, TelegramType

ATTEMPTS: Final = 5
"""So often a value is read that has changed while it was."""


class Evidence(NamedTuple):
    """One parameter as PKW reads it, the process data of that moment, and the orders by which they agree."""

    signal: Signal
    value: int
    data: bytes
    fits: tuple[Order, ...]


class OrderCheck(NamedTuple):
    """What is known of the order of a station's process data. ``setting`` is what the site says."""

    evidence: tuple[Evidence, ...]
    setting: Order | None = None

    @property
    def fits(self) -> tuple[Order, ...]:
        """The orders that nothing contradicts."""
        return tuple(order for order in ORDERS if all(order in one.fits for one in self.evidence))

    @property
    def proven(self) -> Order | None:
        """The order that is in force, None while nothing may be sent.

        One that only one is left of; or the setting, where the bytes of a word are proven and only the order of the two
        words of a double word is not, because what was read has equal words, as 0 does.
        """
        fits = self.fits
        if len(fits) == 1:
            return fits[0] if self.setting in (None, fits[0]) else None
        bytes_proven = bool(fits) and len({order.byte for order in fits}) == 1
        return self.setting if bytes_proven and self.setting in fits else None

    @property
    def reason_key(self) -> str:
        """Text key of why nothing is proven."""
        if not self.fits:
            return "profibus.order.contradiction"
        if self.setting is not None and self.setting not in self.fits:
            return "profibus.order.setting"
        return "profibus.order.ambiguous"


def evidence_of(telegram: TelegramType, signal: Signal, read: bytes, data: bytes) -> Evidence:
    """What one reading tells: ``read`` has the parameter's bytes, least significant first. Raises FormatError."""
    value = int.from_bytes(read, "little", signed=signal.signed)
    return Evidence(signal, value, data, orders_that_fit(telegram.sent, data, {signal: value}))
