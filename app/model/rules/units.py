"""Positions of the axis in degrees: how many position units a turn of the blade has, by the encoder in use."""

from __future__ import annotations

from fractions import Fraction
from typing import Final

from app.model.rules.look import Look, Object, pmc

SENSOR: Final = pmc("606A")
FEED: Final = (pmc("6092:01"), pmc("6092:02"))
BLADE_FEED: Final = (pmc("6892:01"), pmc("6892:02"))
SCALING: Final = (SENSOR, *FEED, *BLADE_FEED)
"""Everything that ``units_per_turn`` may look at."""
BLADE_ENCODER: Final = -1


def feed_in_use(look: Look) -> tuple[Object, Object]:
    """The feed constant of the encoder that 606Ah selects."""
    (sensor,) = look(SENSOR)
    return BLADE_FEED if sensor == BLADE_ENCODER else FEED


def ratio(look: Look, pair: tuple[Object, Object]) -> Fraction | None:
    """First by second; None where either is 0: then nothing can be computed, and the object's own limits say so."""
    above, below = look(*pair)
    return Fraction(above, below) if above > 0 and below > 0 else None


def units_per_turn(look: Look) -> Fraction | None:
    """Position units of one turn of the blade; None where the feed constant holds a 0."""
    return ratio(look, feed_in_use(look))


def degrees(units: Fraction | float, turn: Fraction) -> float:
    """Position units as degrees, rounded to hundredths."""
    return round(float(units * 360 / turn), 2)
