"""Errors of a twin: EMCY messages, error register 1001h and error history 1003h (CiA 301, 7.2.7, 7.5.2.2, 7.5.2.4)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from app.model.datatypes import Raw
from app.twins.object_store import Cell, ObjectStore, RefusedAccessError
from app.wire import emcy
from app.wire.sdo import Abort

_COB_INVALID: Final = 1 << 31
_GENERIC: Final = 1
_REGISTER_BITS: Final = ((0x2000, 1 << 1), (0x3000, 1 << 2), (0x4000, 1 << 3), (0x8000, 1 << 4), (0xF000, 1 << 7))
_PROFILE: Final = 1 << 5


class Emergency:
    """Pending errors of one device. ``send`` takes CAN id and data; ``uptime_s`` the seconds since power-on."""

    def __init__(self, store: ObjectStore, send: Callable[[int, bytes], None], uptime_s: Callable[[], int]) -> None:
        self._send = send
        self._uptime_s = uptime_s
        self._pending: dict[int, None] = {}
        self._cob = store.find(0x1014)
        history = [cell for cell in store if cell.entry.address.major == 0x1003 and cell.entry.address.minor > 0]
        self._history: deque[tuple[int, int]] = deque(maxlen=len(history) or 1)
        register = store.find(0x1001)
        if register is not None:
            register.source = lambda: self.register
        if self._cob is not None:
            self._cob.guard = self._check_cob
        self._bind_history(store.find(0x1003), history)
        for cell in store:
            if cell.entry.address.major == 0x2030 and cell.entry.address.minor > 0:
                self._bind_time(cell)

    @property
    def pending(self) -> tuple[int, ...]:
        """Codes of the errors that are not cleared, the oldest first."""
        return tuple(self._pending)

    @property
    def register(self) -> int:
        """The error register: bit 0 with every error, others by the class of its code."""
        register = 0
        for code in self._pending:
            register |= _GENERIC | _register_bit(code)
        return register

    def reset(self) -> None:
        """Forget pending errors and history, as at power-on."""
        self._pending.clear()
        self._history.clear()

    def occur(self, code: int, info: bytes = b"") -> None:
        """An error arose: history and EMCY; nothing where it is pending already. ``info``: up to 5 bytes."""
        if code in self._pending:
            return
        self._pending[code] = None
        self._history.appendleft((code | int.from_bytes(info[:2], "little") << 16, self._uptime_s()))
        self._transmit(code, info)

    def repeat(self, code: int) -> None:
        """Send the EMCY of a pending error once more: nobody could hear it before."""
        if code in self._pending:
            self._transmit(code, b"")

    def clear(self, code: int) -> None:
        """An error is gone; EMCY 0000h tells what is left (CiA 301, 7.2.7.1)."""
        if code in self._pending:
            del self._pending[code]
            left = next(reversed(self._pending), emcy.NO_ERROR)
            self._transmit(emcy.NO_ERROR, left.to_bytes(2, "little"))

    def _transmit(self, code: int, info: bytes) -> None:
        if self._cob is None or self._cob.number & _COB_INVALID:
            return
        self._send(self._cob.number & 0x7FF, emcy.emcy(code, self.register, info))

    def _check_cob(self, raw: Raw) -> None:
        """While the EMCY exists, its identifier cannot be changed (7.5.2.17)."""
        old = 0 if self._cob is None else self._cob.number
        if not isinstance(raw, int) or (not (raw | old) & _COB_INVALID and raw != old):
            raise RefusedAccessError(Abort.VALUE_RANGE)

    def _bind_history(self, count: Cell | None, cells: list[Cell]) -> None:
        if count is not None:
            count.source = lambda: len(self._history)
            count.guard = self._only_zero
            count.effect = lambda _raw: self._history.clear()
        for cell in cells:
            cell.source = self._history_source(cell.entry.address.minor - 1)

    def _history_source(self, place: int) -> Callable[[], Raw]:
        def value() -> Raw:
            if place >= len(self._history):
                raise RefusedAccessError(Abort.NO_DATA)
            return self._history[place][0]

        return value

    def _bind_time(self, cell: Cell) -> None:
        """Time stamps beside the history; their unit is not printed, seconds since power-on are taken."""
        place = cell.entry.address.minor - 1
        cell.source = lambda: self._history[place][1] if place < len(self._history) else 0

    @staticmethod
    def _only_zero(raw: Raw) -> None:
        if raw != 0:
            raise RefusedAccessError(Abort.VALUE_RANGE)


def _register_bit(code: int) -> int:
    if code >> 8 == 0x86:
        return _PROFILE
    return next((bit for group, bit in _REGISTER_BITS if code & 0xF000 == group), _PROFILE if code >= 0x5000 else 0)
