"""Errors of the PMC: which there are, what the axis does (tables 38, 47 and 48), which are pending."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.twins.cia402 import Stop
from app.twins.emergency import Emergency
from app.twins.object_store import ObjectStore

SWITCH_95_CODE: Final = 0x1000
"""The manual names no code for the 95 degree switch (T13); the neutral one of CiA 301 is taken."""


class Reaction(Enum):
    """What an error does to the axis."""

    MOTOR_OFF = "motor off"
    OPTION_605E = "fault reaction option code"
    OPTION_6007 = "abort connection option code"


@dataclass(frozen=True, slots=True)
class ErrorKind:
    """An error: its bit in 6510h/8 (None: it has none), its reaction; priority A cannot be masked."""

    bit: int | None
    reaction: Reaction
    priority_a: bool = False


_OFF: Final = Reaction.MOTOR_OFF
_FAULT: Final = Reaction.OPTION_605E
_LINK: Final = Reaction.OPTION_6007

KINDS: Final = {
    0x2320: ErrorKind(0, _OFF, True),
    0x3210: ErrorKind(2, _OFF, True),
    0x3220: ErrorKind(3, _OFF),
    0x7305: ErrorKind(4, _FAULT),
    0x4210: ErrorKind(5, _OFF),
    0x6320: ErrorKind(6, _OFF),
    0x2310: ErrorKind(7, _OFF, True),
    0x4310: ErrorKind(8, _OFF),
    0x6380: ErrorKind(9, _OFF),
    0x8400: ErrorKind(10, _OFF),
    0x7320: ErrorKind(11, _FAULT),
    0x6010: ErrorKind(12, _OFF, True),
    0x7321: ErrorKind(13, _FAULT),
    0x8611: ErrorKind(14, _FAULT),
    0x6080: ErrorKind(15, _OFF, True),
    # Without a flag bit and without a printed reaction. OPEN; the axis stops, which is safer than to go on.
    0x7300: ErrorKind(None, _FAULT),
    0x8620: ErrorKind(None, _FAULT),
    SWITCH_95_CODE: ErrorKind(None, _FAULT),
    0x5510: ErrorKind(None, _OFF),
    0x5530: ErrorKind(None, _OFF),
    0x8100: ErrorKind(None, _LINK),
    0x8110: ErrorKind(None, _LINK),
    0x8120: ErrorKind(None, _LINK),
    0x8130: ErrorKind(None, _LINK),
    0x8140: ErrorKind(None, _LINK),
    0x8230: ErrorKind(None, _LINK),
}

_STOPS_605E: Final = {0: Stop.COAST, 1: Stop.RAMP, 2: Stop.QUICK, 3: Stop.QUICK, -1: None}
_STOPS_6007: Final = {0: None, 1: None, 2: Stop.COAST, 3: Stop.QUICK}


class AxisErrors:
    """Errors present (their cause stands), pending (raised and not reset), and warnings."""

    def __init__(self, store: ObjectStore, emergency: Emergency) -> None:
        self._store = store
        self._emergency = emergency
        self._present: set[int] = set()
        self._seen: set[int] = set()
        """Masked errors without a lasting cause, until the reset: their flags show."""
        self._pending: dict[int, None] = {}
        self._warnings: dict[int, None] = {}
        self._reaction: Stop | None = None

    @property
    def flags(self) -> int:
        """6510h/8: causes that stand and errors that wait for a reset."""
        bits = (KINDS[code].bit for code in self._present | self._seen | self._pending.keys())
        return sum(1 << bit for bit in bits if bit is not None)

    @property
    def code(self) -> int:
        """603Fh: the oldest error, else the oldest warning, else 0."""
        return next(iter(self._pending), next(iter(self._warnings), 0))

    @property
    def pending(self) -> tuple[int, ...]:
        """Codes that wait for a reset, the oldest first."""
        return tuple(self._pending)

    @property
    def warns(self) -> bool:
        """Statusword bit 7: a warning, or an error that is a message only."""
        return bool(self._warnings) or any(self._stop_of(code) is None for code in self._pending)

    @property
    def stops(self) -> bool:
        """An error is pending that is more than a message; the watchdog contact is open with it."""
        return any(self._stop_of(code) is not None for code in self._pending)

    @property
    def gone(self) -> bool:
        """No cause of a pending error stands."""
        return not self._present & self._pending.keys()

    @property
    def blocks_feather(self) -> bool:
        """A cause stands with which the motor cannot run; an EFC is not possible then."""
        return any(KINDS[code].reaction is Reaction.MOTOR_OFF for code in self._present)

    def clear(self) -> None:
        """Forget what was raised, as at power-on; causes that stand will be raised again."""
        for known in (self._pending, self._warnings, self._present, self._seen):
            known.clear()
        self._reaction = None

    def condition(self, code: int, present: bool) -> None:
        """A cause appears or disappears."""
        if present:
            if code not in self._present:
                self._present.add(code)
                self._raise(code)
        else:
            self._present.discard(code)

    def event(self, code: int) -> None:
        """An error without a lasting cause."""
        self._raise(code)
        if code not in self._pending:
            self._seen.add(code)

    def warning(self, code: int, present: bool) -> None:
        """A warning appears or disappears; no message is sent."""
        if present:
            self._warnings[code] = None
        else:
            self._warnings.pop(code, None)

    def take_reaction(self) -> Stop | None:
        """What the axis has to do for errors raised since the last call."""
        reaction, self._reaction = self._reaction, None
        return reaction

    def reset(self) -> None:
        """Fault reset: errors whose cause is gone are cleared."""
        self._seen.clear()
        for code in [code for code in self._pending if code not in self._present]:
            del self._pending[code]
            self._emergency.clear(code)

    def mask_changed(self) -> None:
        """6510h/7 was written: a cause that stands and is masked no more is an error now."""
        for code in sorted(self._present):
            self._raise(code)

    def react_again(self) -> None:
        """Let pending errors act once more (after an EFC that went on in spite of them)."""
        for code in self._pending:
            self._want(self._stop_of(code))

    def _raise(self, code: int) -> None:
        kind = KINDS[code]
        masked = kind.bit is not None and not kind.priority_a and not self._store.number(0x6510, 7) >> kind.bit & 1
        ignored = kind.reaction is Reaction.OPTION_6007 and self._store.number(0x6007) == 0
        if masked or ignored or code in self._pending:
            return
        self._pending[code] = None
        self._emergency.occur(code)
        self._want(self._stop_of(code))

    def _want(self, stop: Stop | None) -> None:
        if stop is not None and self._reaction is not Stop.COAST:
            self._reaction = stop

    def _stop_of(self, code: int) -> Stop | None:
        reaction = KINDS[code].reaction
        if reaction is Reaction.MOTOR_OFF:
            return Stop.COAST
        if reaction is Reaction.OPTION_6007:
            return _STOPS_6007.get(self._store.number(0x6007), Stop.QUICK)
        return _STOPS_605E.get(self._store.number(0x605E), Stop.QUICK)
