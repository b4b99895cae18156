"""From per cent of the controller to the magnets, and from a place and a setpoint to per cent. Pure."""

from __future__ import annotations

from math import copysign
from typing import Final

from app.twins.ed2.hydraulics import CYCLE_S, Bench, Drive
from app.twins.ed2.params import Gains, Output, Params

_LEAST_PERCENT: Final = 0.02
"""Below it both magnets are off."""
FINE_X: Final = 0.3
FINE_Y: Final = 0.2
"""Knee of the joystick's curve as delivered (manual, 4.3.1.1); the curve itself is a figure that is lost (OPEN)."""


class Controller:
    """Position controller of one axis: P and a limited I, apart for both directions."""

    def __init__(self) -> None:
        self._integral = 0.0

    def reset(self) -> None:
        """Forget what was summed up."""
        self._integral = 0.0

    def percent(self, error_mm: float, params: Params) -> float:
        """Opening of the valve, per cent, positive to extend."""
        gains: Gains = params.forward if error_mm >= 0.0 else params.backward
        if gains.integral_limit > 0.0:
            self._integral += gains.proportional * error_mm * CYCLE_S / gains.integral_s
            self._integral = min(max(self._integral, -gains.integral_limit), gains.integral_limit)
        else:
            self._integral = 0.0
        return min(max(gains.proportional * error_mm + self._integral, -100.0), 100.0)


def joystick_percent(input_percent: float) -> float:
    """Opening for an analog input of 0 to 100 %: 50 % is the middle; slow up to the knee, faster beyond it."""
    deflection = min(max((input_percent - 50.0) / 50.0, -1.0), 1.0)
    size = abs(deflection)
    opening = size * FINE_Y / FINE_X if size <= FINE_X else FINE_Y + (size - FINE_X) * (1 - FINE_Y) / (1 - FINE_X)
    return copysign(100.0 * opening, deflection)


def drive_of(percent: float, output: Output, bench: Bench) -> Drive:
    """What both magnets get: from Imin at the slightest opening to Imax at the full one."""
    if output.inverted:
        percent = -percent
    if output.interface:
        return _interface(percent, output, bench)
    if abs(percent) < _LEAST_PERCENT:
        return Drive(0.0, 0.0, output.dither_ma, output.dither_hz)
    side = percent < 0.0
    least, most = output.least_ma[side], output.most_ma[side]
    current = least + (most - least) * abs(percent) / 100.0
    a_ma, b_ma = (0.0, current) if side else (current, 0.0)
    return Drive(a_ma, b_ma, output.dither_ma, output.dither_hz)


def _interface(percent: float, output: Output, bench: Bench) -> Drive:
    """±10 V to a valve with electronics of its own, which knows its dead band and needs no dither."""
    opening = min(max((percent * output.gain / 100.0 + output.offset) / 100.0, -1.0), 1.0)
    dead = bench.dead_ma[opening < 0.0]
    current = dead + (bench.full_ma - dead) * abs(opening) if opening else 0.0
    a_ma, b_ma = (0.0, current) if opening < 0.0 else (current, 0.0)
    return Drive(a_ma, b_ma, bench.calming_ma, 100.0)
