"""Valve, cylinder and load of one axis, a millisecond at a time. Pure; mm, N, bar and mA.

A proportional valve with two magnets moves an asymmetric cylinder. In the steady state, with the supply at ``p``, areas
A1 (piston) and A2 (rod) and a load F against extending, the flow through both edges of the spool gives::

    extending   v = v0 s sqrt((p A1 - F) / (p0 A1))        retracting   v = v0 s sqrt((p A2 + F) / (p0 A1))

with the opening s of 0 to 1 and v0 the speed without load at the rated supply p0. Oil and mass follow with a lag; with
the spool closed the cylinder is locked. Figures are those of the twin's own bench: right in their order of magnitude.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt
from typing import Final

CYCLE_S: Final = 0.001
_NEWTON_PER_BAR_MM2: Final = 0.1
_STILL_MM_S: Final = 0.01


@dataclass(frozen=True, slots=True)
class Bench:
    """What an axis moves. Areas in mm², places in mm from the retracted end, ``link_n_mm`` ties both cylinders."""

    stroke_mm: float = 500.0
    piston_mm2: float = 3_117.0
    rod_side_mm2: float = 2_099.0
    rated_bar: float = 160.0
    speed_mm_s: float = 200.0
    switches_mm: tuple[float, float] = (3.0, 497.0)
    """Where the limit switches open, negative and positive."""
    dead_ma: tuple[float, float] = (151.0, 152.0)
    """Current at which the spool begins to open, magnets A and B."""
    full_ma: float = 700.0
    stiction_ma: float = 40.0
    """By so much the current must change before a spool without dither moves."""
    calming_ma: float = 80.0
    """Dither that frees the spool wholly, at 100 Hz and below."""
    spool_s: float = 0.012
    oil_s: float = 0.025
    link_n_mm: float = 0.0


@dataclass(slots=True)
class Drive:
    """What the controller gives to the valve: currents of both magnets, dither."""

    a_ma: float = 0.0
    b_ma: float = 0.0
    dither_ma: float = 0.0
    dither_hz: float = 100.0


class Cylinder:
    """One axis of the bench."""

    def __init__(self, bench: Bench, position_mm: float) -> None:
        self.bench = bench
        self.position_mm = position_mm
        self.velocity_mm_s = 0.0
        self.opening = 0.0
        """Of the spool, -1 to 1; above 0 the cylinder extends."""
        self._net_ma = 0.0
        """Current that the spool has followed so far."""

    @property
    def still(self) -> bool:
        """Nothing moves."""
        return abs(self.velocity_mm_s) < _STILL_MM_S

    @property
    def asleep(self) -> bool:
        """Without current nothing will move."""
        return self.velocity_mm_s == 0.0 and self.opening == 0.0

    @property
    def limits(self) -> tuple[bool, bool]:
        """Whether the negative and the positive limit switch have opened."""
        low, high = self.bench.switches_mm
        return self.position_mm < low, self.position_mm > high

    def step(self, drive: Drive, supply_bar: float, load_n: float) -> None:
        """One cycle."""
        self._move_spool(drive)
        target = self._steady_mm_s(supply_bar, load_n)
        self.velocity_mm_s += (target - self.velocity_mm_s) * CYCLE_S / self.bench.oil_s
        if target == 0.0 and abs(self.velocity_mm_s) < _STILL_MM_S:
            self.velocity_mm_s = 0.0
        moved = self.position_mm + self.velocity_mm_s * CYCLE_S
        self.position_mm = min(max(moved, 0.0), self.bench.stroke_mm)
        if self.position_mm != moved:
            self.velocity_mm_s = 0.0

    def _move_spool(self, drive: Drive) -> None:
        bench = self.bench
        free = drive.dither_ma * min(1.0, 100.0 / max(drive.dither_hz, 1.0)) / bench.calming_ma
        sticking = bench.stiction_ma * max(0.0, 1.0 - free)
        wanted = drive.a_ma - drive.b_ma
        if abs(wanted - self._net_ma) > sticking:
            self._net_ma = wanted - copysign(sticking, wanted - self._net_ma)
        if drive.a_ma == drive.b_ma == 0.0:
            self._net_ma = 0.0  # springs centre the spool
        net, dead = self._net_ma, bench.dead_ma[self._net_ma < 0.0]
        open_ma = max(abs(net) - dead, 0.0) / (bench.full_ma - dead)
        goal = copysign(min(open_ma, 1.0), net)
        self.opening += (goal - self.opening) * CYCLE_S / bench.spool_s
        if goal == 0.0 and abs(self.opening) < 1e-4:
            self.opening = 0.0

    def _steady_mm_s(self, supply_bar: float, load_n: float) -> float:
        """The speed that the opening gives; a check valve keeps a load from pushing the cylinder back."""
        bench, opening = self.bench, self.opening
        rated_n = bench.rated_bar * bench.piston_mm2 * _NEWTON_PER_BAR_MM2
        area = bench.piston_mm2 if opening > 0.0 else bench.rod_side_mm2
        force_n = supply_bar * area * _NEWTON_PER_BAR_MM2 - copysign(load_n, opening)
        return bench.speed_mm_s * opening * sqrt(max(force_n, 0.0) / rated_n) if opening else 0.0
