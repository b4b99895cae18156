"""From encoder increments to position units and back (manual, 5.5 and 5.6)."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import pi

from app.twins.object_store import ObjectStore

_NEGATIVE = 0x80
"""Only bit 7 of a polarity is looked at (manual, 607Eh)."""


@dataclass(frozen=True, slots=True)
class Scaling:
    """``units_per_increment`` is exact, the numbers that every cycle needs are floats.

    ``sign`` is -1 for negative polarity; ``offset`` is the home offset in units; ``units_per_rad`` has the sign of the
    polarity.
    """

    units_per_increment: Fraction
    units_per_turn: Fraction
    sign: int
    offset: int
    units_per_rad: float
    signed_factor: float

    def position(self, increments: float) -> float:
        """Actual position: the encoder's position in units plus the home offset."""
        return increments * self.signed_factor + self.offset

    def offset_for(self, increments: float, position: int) -> int:
        """The home offset with which the encoder's count becomes ``position``."""
        return position - round(increments * self.signed_factor)


def units_per_increment(resolution: Fraction, gear: Fraction, feed: Fraction) -> Fraction:
    """Position units for one increment: feed constant / (encoder resolution x gear ratio)."""
    return feed / (resolution * gear)


def motor_scaling(store: ObjectStore) -> Scaling:
    """Of the motor encoder: 608Fh, 6091h, 6092h, 607Eh, 607Ch."""
    return _scaling(store, 0x607C, 0x607E, 0x608F, 0x6091, 0x6092)


def blade_scaling(store: ObjectStore) -> Scaling:
    """Of the additional encoder: 688Fh, 6891h, 6892h, 687Eh, 687Ch."""
    return _scaling(store, 0x687C, 0x687E, 0x688F, 0x6891, 0x6892)


def highest_profile_velocity(store: ObjectStore) -> Fraction:
    """What 607Fh must not exceed, in units/s: 6080h / 60 x feed constant / gear ratio (manual, 607Fh).

    The feed constant is that of the encoder which 606Ah selects, the gear ratio always that of the motor: it is the
    motor's speed which is limited. As delivered by default, 607Fh violates it with the gear of the pitch example.

    OPEN what a drive does with a 607Fh beyond it. The value is taken, and 6080h limits the motor: the set-point runs
    away from the axis then, and the following error tells.
    """
    feed = _ratio(store, 0x6892 if store.number(0x606A) == -1 else 0x6092)
    return Fraction(store.number(0x6080), 60) * feed / _ratio(store, 0x6091)


def interpolation_ms(value: int, index: int) -> Fraction:
    """Time between two cyclic set-points by 60C2h: value x 10^index seconds, in ms."""
    return Fraction(value) * Fraction(10) ** (index + 3)


def _scaling(store: ObjectStore, home: int, polarity: int, resolution: int, gear: int, feed: int) -> Scaling:
    per_turn = _ratio(store, resolution)
    factor = units_per_increment(per_turn, _ratio(store, gear), _ratio(store, feed))
    sign = -1 if store.number(polarity) & _NEGATIVE else 1
    turn = per_turn * factor
    return Scaling(factor, turn, sign, store.number(home), sign * float(turn) / (2 * pi), sign * float(factor))


def _ratio(store: ObjectStore, index: int) -> Fraction:
    """Sub-index 1 over sub-index 2. OPEN what a 0 does; it counts as 1, for a drive must not divide by it."""
    return Fraction(store.number(index, 1) or 1, store.number(index, 2) or 1)
