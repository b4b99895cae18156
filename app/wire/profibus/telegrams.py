"""Telegrams 1, 2 and 100 to 103 of the profile DSP-408, word by word (ED2 manual, 4.5)."""

from __future__ import annotations

from enum import Enum
from typing import Final, NamedTuple

from app.model.address import Address, Addressing
from app.wire.profibus.configuration import Length, Module

PKW_WORDS: Final = 4


class Part(Enum):
    """Which part of its words a signal has."""

    WHOLE = "whole"
    LOW = "low"
    HIGH = "high"


class Signal(NamedTuple):
    """What process data tell: its number, name, and the parameter of the same value where there is one."""

    number: int
    name: str
    words: int = 1
    signed: bool = False
    address: Address | None = None
    part: Part = Part.WHOLE

    @property
    def bits(self) -> int:
        """Bits that it takes."""
        return 16 * self.words if self.part is Part.WHOLE else 8


def _pkw(ind: int, pnu: int) -> Address:
    return Address(ind, pnu, Addressing.PKW)


CONTROL_WORD: Final = Signal(1, "db_ControlWord", address=_pkw(0, 37))
STATUS_WORD: Final = Signal(2, "db_StatusWord", address=_pkw(0, 38))
ACTUAL: Final = Signal(3, "dpc_ActualVal", 2, True, _pkw(12, 100))
SETPOINT: Final = Signal(12, "dpc_SetpointVal", 2, True, _pkw(12, 21))
RAMP_VELOCITY: Final = Signal(100, "dpc_ramp_Vel", 2, False, _pkw(12, 61))
RAMP_ACCELERATION: Final = Signal(101, "dpc_ramp_Acc", 1, False, _pkw(12, 64))
"""One word of a parameter of two: 6553.5 of the unit per s² at most."""
RAMP_DECELERATION: Final = Signal(102, "dpc_ramp_Dec")
"""No parameter has it."""
DEVICE_MODE_SET: Final = Signal(103, "db_DeviceMode", 1, True, _pkw(0, 39), Part.LOW)
CONTROL_MODE_SET: Final = Signal(103, "db_ControlMode", 1, True, _pkw(0, 40), Part.HIGH)
DEVICE_MODE: Final = Signal(104, "db_DeviceMode", 1, True, _pkw(0, 39), Part.LOW)
CONTROL_MODE: Final = Signal(104, "db_ControlMode", 1, True, _pkw(0, 40), Part.HIGH)
ERROR_CODE: Final = Signal(105, "db_ErrorCode", address=_pkw(0, 36))
DIGITAL_INPUTS: Final = Signal(106, "stat_DigInp")
"""No parameter has it."""

Words = tuple[tuple[Signal, ...], ...]
"""Signals in their order; those of one element share a word."""


class TelegramType(NamedTuple):
    """One type: with PKW or without, and the process data of either way."""

    number: int
    has_pkw: bool
    received: Words
    """From master to slave."""
    sent: Words

    @property
    def received_words(self) -> int:
        """Words of process data that the slave gets."""
        return words_of(self.received)

    @property
    def sent_words(self) -> int:
        """Words of process data that the slave sends."""
        return words_of(self.sent)

    @property
    def output_size(self) -> int:
        """Bytes from master to slave, PKW included."""
        return 2 * (PKW_WORDS * self.has_pkw + self.received_words)

    @property
    def input_size(self) -> int:
        """Bytes from slave to master, PKW included."""
        return 2 * (PKW_WORDS * self.has_pkw + self.sent_words)

    def carries(self, signal: Signal) -> bool:
        """True where the slave gets or sends it."""
        return any(signal in word for word in (*self.received, *self.sent))


def words_of(words: Words) -> int:
    """Words that they fill."""
    return sum(shared[0].words for shared in words)


_SHORT_IN: Final[Words] = ((CONTROL_WORD,), (SETPOINT,))
_SHORT_OUT: Final[Words] = ((STATUS_WORD,), (ACTUAL,))
_MODE_IN: Final[Words] = ((CONTROL_WORD,), (DEVICE_MODE_SET, CONTROL_MODE_SET), (SETPOINT,))
_MODE_OUT: Final[Words] = ((STATUS_WORD,), (DEVICE_MODE, CONTROL_MODE), (ACTUAL,), (ERROR_CODE,), (DIGITAL_INPUTS,))
_RAMP_IN: Final[Words] = ((CONTROL_WORD,), (SETPOINT,), (RAMP_VELOCITY,), (RAMP_ACCELERATION,), (RAMP_DECELERATION,))

TELEGRAM_TYPES: Final = {
    one.number: one
    for one in (
        TelegramType(1, True, _SHORT_IN, _SHORT_OUT),
        TelegramType(2, False, _SHORT_IN, _SHORT_OUT),
        TelegramType(100, False, _MODE_IN, _MODE_OUT),
        TelegramType(101, False, _RAMP_IN, _SHORT_OUT),
        TelegramType(102, True, _MODE_IN, _MODE_OUT),
        TelegramType(103, True, _RAMP_IN, _SHORT_OUT),
    )
}

_BY_SIZE: Final = {(one.output_size, one.input_size): one for one in TELEGRAM_TYPES.values()}


def telegram_of(output_size: int, input_size: int) -> TelegramType | None:
    """The type that exchanges so many bytes; no two of them have both lengths in common."""
    return _BY_SIZE.get((output_size, input_size))


def assumed_modules(telegram: TelegramType) -> tuple[Module, ...]:
    """The configuration of a telegram as usual makers would have it: the GSD of the device is the one that decides.

    Consistent over the whole length of each part, which the manual does say (5.3). How the identifiers are coded, and
    whether outputs come first where the two ways differ, is not known.
    """
    modules = []
    if telegram.has_pkw:
        both = Length(PKW_WORDS, words=True, consistent=True)
        modules.append(Module(both, both))
    outputs = Length(telegram.received_words, words=True, consistent=True)
    inputs = Length(telegram.sent_words, words=True, consistent=True)
    if outputs == inputs:
        return (*modules, Module(outputs, inputs))
    return (*modules, Module(outputs, None), Module(None, inputs))
