"""FC 43 wants the number of bytes of what it reads; where that is not known, the refusals of the device lead to it."""

from __future__ import annotations

from typing import Final

from app.wire.modbus.requests import MAX_OBJECT_DATA
from app.wire.sdo import Abort

SIZES: Final = (4, 2, 1, 8, MAX_OBJECT_DATA)
"""Bytes that are asked for where the size is not known, or another one than described; texts may have fewer."""
_WRONG_SIZE: Final = frozenset({Abort.LENGTH, Abort.LENGTH_TOO_HIGH, Abort.LENGTH_TOO_LOW})


class SizeSearch:
    """Looks for the size of an object: ``likely`` ones first, then between those that were too high and too low."""

    def __init__(self, likely: tuple[int, ...]) -> None:
        self.size = likely[0]
        self._likely = list(likely[1:])
        self._least, self._most = 1, MAX_OBJECT_DATA
        self._told = False

    def refused(self, abort_code: int) -> bool:
        """The device refused ``size``. True where there is another one to try, which ``size`` is then."""
        if abort_code not in _WRONG_SIZE:
            return False
        if abort_code == Abort.LENGTH_TOO_HIGH:
            self._most, self._told = self.size - 1, True
        elif abort_code == Abort.LENGTH_TOO_LOW:
            self._least, self._told = self.size + 1, True
        self._likely = [size for size in self._likely if self._least <= size <= self._most]
        if self._likely:
            self.size = self._likely.pop(0)
            return True
        if abort_code == Abort.LENGTH:
            return False  # it does not say which way: nothing is nearer than before
        self.size = (self._least + self._most) // 2
        return self._told and self._least <= self._most
