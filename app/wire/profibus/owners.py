"""Whose each telegram of a line is: the station that is asked, or that answers. What a bus load is shared by."""

from __future__ import annotations

from app.wire.profibus.control import Request
from app.wire.profibus.fdl import BROADCAST, ShortAck, Telegram, decode
from app.wire.profibus.fields import FormatError


class Owners:
    """Told all telegrams of one line in their order. 0 is nobody: tokens, and what is said to everybody."""

    def __init__(self) -> None:
        self._asked = 0

    def of(self, data: bytes) -> int:
        """Whose telegram this is. SC does not say, nor does what makes no sense: it is of whoever was asked."""
        try:
            telegram = decode(data)
        except FormatError:
            return self._asked
        if isinstance(telegram, ShortAck):
            return self._asked
        if not isinstance(telegram, Telegram):
            self._asked = 0
            return 0
        if not isinstance(telegram.control, Request):
            return telegram.source
        self._asked = 0 if telegram.destination == BROADCAST else telegram.destination
        return self._asked
