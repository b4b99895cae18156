"""User units of the PD4-E: positions, velocities, accelerations and jerks (manual, 5.3). Pure.

Inside, the twin counts in revolutions of the motor shaft and in seconds. The codes of the units are not legible in the
known parts of the manual; they are those of CiA 303-2 and of sibling drives.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import pi
from typing import Final

from app.twins.object_store import ObjectStore

INCREMENTS_OPEN_LOOP: Final = 320_000
"""Increments of a motor revolution in open loop (manual, 5.3.1)."""
_NEGATIVE_POSITION: Final = 0x80
_NEGATIVE_VELOCITY: Final = 0x40
_BYTE: Final = 0xFF


class Unit(IntEnum):
    """Codes of a position unit, bits 16 to 23 of 60A8h and 60A9h."""

    DIMENSIONLESS = 0x00
    METRE = 0x01
    RADIAN = 0x10
    GON = 0x40
    DEGREE = 0x41
    STEP = 0xAC
    REVOLUTION = 0xB4
    INCREMENT = 0xB5
    POLE = 0xC0
    INCH = 0xC1
    FOOT = 0xC2


MINUTE: Final = 0x47
"""Code of the minute as a time unit, bits 8 to 15 of 60A9h; anything else counts as a second."""
_IN_A_TURN: Final = {Unit.REVOLUTION: 1.0, Unit.DEGREE: 360.0, Unit.GON: 400.0, Unit.RADIAN: 2 * pi}
"""Units that follow the gear, and how many of them are a revolution of its output shaft."""
UNIT_OBJECTS: Final = (0x2030, 0x3202, 0x607E, 0x608F, 0x6091, 0x6092, 0x6096, 0x6097, 0x60A2, 0x60A8, 0x60A9)
"""The objects that decide; a change of them is not applied in Operation enabled (manual, 5.3)."""


@dataclass(frozen=True, slots=True)
class Units:
    """User units in one motor revolution, and in one revolution per second (per s2, per s3). Signed by 607Eh."""

    position: float
    velocity: float
    acceleration: float
    jerk: float
    increments: float


def units_of(store: ObjectStore) -> Units:
    """The units that the dictionary asks for.

    OPEN what a denominator of 0 does; it counts as 1. The factors 6096h, 6097h and 60A2h are taken as the size of one
    user unit in base units.
    """
    increments = encoder_increments(store)
    polarity = store.number(0x607E)
    position_unit, velocity_unit = store.number(0x60A8), store.number(0x60A9)
    per_second = 60.0 if velocity_unit >> 8 & _BYTE == MINUTE else 1.0
    position = _in_a_motor_turn(store, position_unit, increments)
    velocity = _in_a_motor_turn(store, velocity_unit, increments) * per_second / _ratio(store, 0x6096)
    acceleration = velocity / _ratio(store, 0x6097)
    return Units(
        position=-position if polarity & _NEGATIVE_POSITION else position,
        velocity=-velocity if polarity & _NEGATIVE_VELOCITY else velocity,
        acceleration=acceleration,
        jerk=acceleration / _ratio(store, 0x60A2),
        increments=increments,
    )


def encoder_increments(store: ObjectStore) -> float:
    """Increments in a motor revolution: 608Fh in closed loop, a fixed number in open loop."""
    return _ratio(store, 0x608F) if store.number(0x3202) & 1 else float(INCREMENTS_OPEN_LOOP)


def _in_a_motor_turn(store: ObjectStore, coded: int, increments: float) -> float:
    code = coded >> 16 & _BYTE
    exponent = coded >> 24 & _BYTE
    size = 10.0 ** (exponent - 256 if exponent > 127 else exponent)
    shaft = 1 / _ratio(store, 0x6091)
    if code in _IN_A_TURN:
        return shaft * _IN_A_TURN[Unit(code)] / size
    if code == Unit.INCREMENT:
        return increments / size
    if code == Unit.STEP:
        return 4 * store.number(0x2030) / size
    if code == Unit.POLE:
        return store.number(0x2030) / size
    # Metres, inches, feet and numbers without unit: 6092h says them in user units already.
    return shaft * _ratio(store, 0x6092)


def _ratio(store: ObjectStore, index: int) -> float:
    return abs((store.number(index, 1) or 1) / (store.number(index, 2) or 1))
