"""The time between cyclic set-points, 60C2h, and the SYNC that it has to fit (manual, 5.12 and 5.13)."""

from __future__ import annotations

from collections import deque
from typing import Final

from app.model.datatypes import Raw
from app.twins.axis_scaling import interpolation_ms
from app.twins.canopen_device import MS
from app.twins.object_store import ObjectStore, RefusedAccessError
from app.wire.sdo import Abort

_CYCLE_MS: Final = 1
"""The position controller's own cycle."""
_INDICES: Final = range(-5, 1)
"""Exponents with which 1 to 255 can make at least that cycle, up to whole seconds."""
_GAPS: Final = 5
"""So many gaps between SYNCs are looked at: one that is late or lost makes no other cycle."""
_SILENT_CYCLES: Final = 4
"""So many missing SYNCs mean that there are none any more."""


class CyclicPeriod:
    """Checks 60C2h. The SYNC cycle is measured: this device has no 1006h that would tell it."""

    def __init__(self, store: ObjectStore) -> None:
        self._store = store
        self._sync_ns: int | None = None
        self._gaps_ms: deque[int] = deque(maxlen=_GAPS)

    def restart(self) -> None:
        """No SYNC was heard yet."""
        self._sync_ns = None
        self._gaps_ms.clear()

    def synchronised(self, t_ns: int) -> None:
        """A SYNC came. Arbitration moves it by parts of a millisecond, cycles are whole ones."""
        if self._sync_ns is not None:
            self._gaps_ms.append(round((t_ns - self._sync_ns) / MS))
        self._sync_ns = t_ns

    def sync_ms(self, now_ns: int) -> int:
        """Cycle of the SYNC in ms, the median of its latest gaps; 0: there is none."""
        if self._sync_ns is None or not self._gaps_ms:
            return 0
        cycle_ms = sorted(self._gaps_ms)[len(self._gaps_ms) // 2]
        return 0 if now_ns - self._sync_ns > cycle_ms * _SILENT_CYCLES * MS else cycle_ms

    def fits(self, now_ns: int, value: int | None = None, index: int | None = None) -> bool:
        """Whether 60C2h (or what it would be) is a whole multiple of the internal cycle, and of the SYNC's."""
        number = self._store.number
        value = number(0x60C2, 1) if value is None else value
        index = number(0x60C2, 2) if index is None else index
        period_ms = interpolation_ms(value, index)
        sync_ms = self.sync_ms(now_ns)
        return bool(period_ms) and period_ms % _CYCLE_MS == 0 and not (sync_ms and period_ms % sync_ms)

    def check(self, sub: int, raw: Raw, cyclic: bool, now_ns: int) -> None:
        """Before 60C2h/``sub`` is written. Raises RefusedAccessError.

        OPEN how a period that does not fit is refused. Its two parts are written one after the other, so a write is
        refused while a cyclic mode is in force, and else the choice of such a mode (``check_mode``).
        """
        number = raw if isinstance(raw, int) else 0
        if sub == 1 and number == 0:
            raise RefusedAccessError(Abort.VALUE_TOO_LOW)
        if sub == 2 and number not in _INDICES:
            raise RefusedAccessError(Abort.VALUE_RANGE)
        value, index = (number, None) if sub == 1 else (None, number)
        if cyclic and not self.fits(now_ns, value, index):
            raise RefusedAccessError(Abort.PARAMETER_INCOMPATIBLE)

    def check_mode(self, now_ns: int) -> None:
        """Before a cyclic mode is chosen. Raises RefusedAccessError."""
        if not self.fits(now_ns):
            raise RefusedAccessError(Abort.PARAMETER_INCOMPATIBLE)
