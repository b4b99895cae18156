"""Errors and warnings of the PD4-E: 1001h, 1003h, 603Fh. Pure.

The manual's known parts hold four texts of 1003h and no numbers; numbers, classes and codes are those of sibling
drives. An entry is number (8 bits), class (8 bits), code (16 bits).
"""

from __future__ import annotations

from collections import deque
from enum import Enum
from typing import Final

DEPTH: Final = 8
"""Entries that are kept (manual, 1003h)."""


class Trouble(Enum):
    """What can go wrong: number, class (which is its bit of 1001h) and code; whether it is a fault or a warning."""

    OVER_VOLTAGE = (1, 0x04, 0x3100, True)
    OVER_CURRENT = (2, 0x02, 0x2300, True)
    UNDER_VOLTAGE = (3, 0x04, 0x3100, True)
    POSITIVE_LIMIT = (10, 0x20, 0x8612, False)
    NEGATIVE_LIMIT = (11, 0x20, 0x8612, False)
    OVER_TEMPERATURE = (12, 0x08, 0x4200, True)
    FOLLOWING_ERROR = (13, 0x20, 0x8611, True)
    MEMORY = (16, 0x01, 0x7600, False)
    SLIPPAGE = (30, 0x20, 0x8400, True)

    def __init__(self, number: int, kind: int, code: int, fault: bool) -> None:
        self.entry = number << 24 | kind << 16 | code
        self.kind = kind
        self.code = code
        self.fault = fault


class ErrorStack:
    """The newest errors, and what is active."""

    def __init__(self) -> None:
        self._entries: deque[int] = deque(maxlen=DEPTH)
        self.active: set[Trouble] = set()
        """Faults that were not reset and warnings that still hold."""
        self.code = 0
        """603Fh: the code of the newest, 0 after a reset."""

    def __len__(self) -> int:
        return len(self._entries)

    def raised(self, trouble: Trouble) -> bool:
        """Something goes wrong; it is entered once until it is gone. Gives whether it is new."""
        if trouble in self.active:
            return False
        self.active.add(trouble)
        self._entries.appendleft(trouble.entry)
        self.code = trouble.code
        return True

    def gone(self, trouble: Trouble) -> None:
        """A warning, or a fault that was reset, no longer holds."""
        self.active.discard(trouble)
        if not self.active:
            self.code = 0

    def reset(self) -> None:
        """The faults were reset."""
        self.active = {trouble for trouble in self.active if not trouble.fault}
        if not self.active:
            self.code = 0

    def clear(self) -> None:
        """0 was written to 1003h:00."""
        self._entries.clear()

    @property
    def register(self) -> int:
        """1001h: bit 0 with any error, and the classes of those that are active."""
        bits = 0
        for trouble in self.active:
            bits |= trouble.kind | 1
        return bits

    def entry(self, place: int) -> int | None:
        """1003h:``place``, 1 is the newest; None where there is none."""
        return self._entries[place - 1] if 0 < place <= len(self._entries) else None
