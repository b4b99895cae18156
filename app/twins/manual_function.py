"""The manual functions that a selector switch and a key button call for (manual, 3.3; both units have the objects)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from app.model.datatypes import Raw
from app.twins.object_store import ObjectStore

KEY: Final = 1 << 4
"""The key button is pressed (tables 8 and 9: bit 4)."""
_SELECTED: Final = 0x0F
_BY_OBJECT: Final = 1 << 5
_RESET: Final = 1 << 7


class ManualFunction:
    """Objects 5040h to 5042h of one unit; the PMC has no 5042h.

    ``operated`` gives what comes from elsewhere, as bits of table 8: in the PMM from its switch and button, in the PMC
    what its PMM sends. ``reset`` is the fault reset of bit 7. OPEN which functions there are: none is printed, so none
    acts; a selected one counts as active (busy) while its button is pressed.
    """

    def __init__(self, store: ObjectStore, operated: Callable[[], int], reset: Callable[[], None]) -> None:
        self._operated = operated
        self._reset = reset
        self._control = 0
        store.cell(0x5040).effect = self._on_control
        store.cell(0x5041).source = lambda: self.status
        out = store.find(0x5042)
        if out is not None:
            out.source = lambda: self.word

    @property
    def word(self) -> int:
        """5042h: from 5040h where its bit 5 is set, else from elsewhere."""
        word = self._control if self._control & _BY_OBJECT else self._operated()
        return word & (_SELECTED | KEY)

    @property
    def status(self) -> int:
        """5041h (table 9): the selected function in bits 0 to 3, busy in bit 4."""
        word = self.word
        return word if word & _SELECTED else 0

    def clear(self) -> None:
        """Begin anew, as at power-on."""
        self._control = 0

    def _on_control(self, raw: Raw) -> None:
        before, self._control = self._control, raw if isinstance(raw, int) else 0
        if self._control & ~before & _RESET:
            self._reset()
