"""The user program of the drive, as far as a master sees it: 2300h, 2301h, 2302h (manual, 9). Pure.

Of the program itself nothing is simulated: there is one, or there is none. Status 4 and error 5 after a program that
held the processor for too long stand in the manual; the other numbers are those of sibling drives.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

START: Final = 0x1
"""Bit of 2300h: 1 runs the program, 0 ends it."""
RUNNING: Final = 0x1
FAILED: Final = 0x4
"""Bits of 2301h."""


class NanoJError(IntEnum):
    """2302h."""

    NONE = 0
    TIMEOUT = 5
    NO_PROGRAM = 7


class NanoJ:
    """Whether the program runs. ``installed``: there is one; ``hangs``: it never yields."""

    def __init__(self, installed: bool) -> None:
        self.installed = installed
        self.hangs = False
        self.status = 0
        self.error = NanoJError.NONE

    def control(self, raw: int) -> None:
        """2300h was written."""
        if not raw & START:
            self.status &= ~RUNNING
        elif not self.installed:
            self.status, self.error = FAILED, NanoJError.NO_PROGRAM
        else:
            self.status, self.error = RUNNING, NanoJError.NONE

    def cycle(self) -> None:
        """One millisecond: a program that hangs is ended."""
        if self.hangs and self.status & RUNNING:
            self.status, self.error = FAILED, NanoJError.TIMEOUT

    def restart(self) -> None:
        """Power-on: nothing runs. OPEN whether a program starts by itself; it does in none of the known parts."""
        self.status, self.error = 0, NanoJError.NONE
