"""The battery of a blade: blocs in series, each with its own charge, age and temperature. SI units.

Lithium ion, 36 V nominal (manual, 4.3.1.1). The inner state only; the current comes from ``supply_kernel``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

BLOCS: Final = 6
"""Battery blocs in series (manual, 3020h/4)."""

Curve = Sequence[tuple[float, float]]

_OPEN_CIRCUIT_V: Final[Curve] = ((-0.02, 0.0), (0.0, 31.0), (0.1, 34.2), (0.5, 36.4), (0.9, 39.4), (1.0, 41.0))
"""Bloc voltage without load over the state of charge: 36 V nominal, 41 V at most (manual, 3020h/5 and /6); the shape is
that of ten cells of lithium ion from 3.1 to 4.1 V (typical). Below empty it breaks down."""
_OHM_BY_CHARGE: Final[Curve] = ((-0.02, 20.0), (0.0, 5.0), (0.1, 1.4), (0.3, 1.0), (1.0, 1.0))
"""Internal resistance against that of a charged bloc: it soars as the bloc runs empty (typical for lithium ion)."""
_OHM_BY_C: Final[Curve] = ((-20.0, 3.0), (0.0, 1.7), (25.0, 1.0), (45.0, 0.85))
"""The same over the temperature in degC (typical for lithium ion)."""
_USABLE_BY_C: Final[Curve] = ((-20.0, 0.65), (0.0, 0.88), (25.0, 1.0))
"""Share of the charge that can be had at a temperature in degC (typical for lithium ion)."""
_SELF_DISCHARGE_PER_S: Final = 0.03 / (30 * 86400)
"""3 % a month (typical for lithium ion)."""
EMPTY: Final = -0.02
"""A bloc that gives nothing more."""


def along(curve: Curve, place: float) -> float:
    """Value of a curve of straight pieces, held at its ends."""
    for (low, low_value), (high, high_value) in pairwise(curve):
        if place <= high:
            return low_value + (max(place, low) - low) / (high - low) * (high_value - low_value)
    return curve[-1][1]


def open_circuit_v(charge: float) -> float:
    """Voltage of one bloc without load at a state of charge of 0..1."""
    return along(_OPEN_CIRCUIT_V, charge)


def charge_of(open_circuit: float) -> float:
    """State of charge 0..1 of a bloc that shows this voltage without load; the inverse of ``open_circuit_v``."""
    return min(max(along([(volts, charge) for charge, volts in _OPEN_CIRCUIT_V], open_circuit), 0.0), 1.0)


@dataclass(slots=True)
class Bloc:
    """One bloc of the battery."""

    charge: float
    """0..1 of what it can hold."""
    offset_v: float
    """How it differs from the curve."""
    temperature_c: float
    warmer_c: float
    """Above the air in the box, by its own electronics and its place."""
    new_ohm: float = 0.025
    """Internal resistance at 25 degC when new: a sixth of 150 mOhm (manual, 3020h/8)."""
    capacity_as: float = 3.0 * 3600
    """3000 mAh when new (manual, 3020h/2)."""
    capacity_share: float = 1.0
    """What ageing has left of the capacity."""
    ohm_factor: float = 1.0
    """What ageing has made of the internal resistance."""

    @property
    def rest_v(self) -> float:
        """Voltage without load. In the cold the lower end of the charge cannot be had: the curve ends earlier."""
        usable = along(_USABLE_BY_C, self.temperature_c)
        return max(open_circuit_v((self.charge - (1.0 - usable)) / usable) + self.offset_v, 0.0)

    @property
    def ohm(self) -> float:
        """Internal resistance as it is."""
        by_charge, by_c = along(_OHM_BY_CHARGE, self.charge), along(_OHM_BY_C, self.temperature_c)
        return self.new_ohm * self.ohm_factor * by_charge * by_c

    def flow(self, out_as: float, dt_s: float) -> None:
        """Charge flows out (negative: in), and some is lost by itself."""
        held_as = self.capacity_as * max(self.capacity_share, 0.001)
        charge = self.charge - out_as / held_as
        self.charge = min(max(charge - max(charge, 0.0) * _SELF_DISCHARGE_PER_S * dt_s, EMPTY), 1.0)


def in_series_v(blocs: Sequence[Bloc]) -> float:
    """Voltage of all blocs without load."""
    return sum(bloc.rest_v for bloc in blocs)


def in_series_ohm(blocs: Sequence[Bloc]) -> float:
    """Internal resistance of all blocs."""
    return sum(bloc.ohm for bloc in blocs)
