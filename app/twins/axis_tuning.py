"""From the parameters of the drive to what its cycles calculate with: gains, limits, windows (manual, 5.2 to 5.4)."""

from __future__ import annotations

from math import exp, pi
from typing import Final

from app.twins import axis_kernel as k
from app.twins.axis_scaling import motor_scaling
from app.twins.object_store import ObjectStore
from app.twins.plant import ENCODER_INCREMENTS, AxisPlant

SIMULATION: Final = 1 << 15
"""60FBh/3: the axis is not moved."""
_NO_WINDOW: Final = 0xFFFFFFFF
"""6065h: monitoring off."""
_VELOCITY_LOOP_S: Final = 0.010
_VELOCITY_RESET_S: Final = 0.100
_CURRENT_LOOP_S: Final = 0.002
_VELOCITY_GAIN, _VELOCITY_INTEGRAL, _VELOCITY_DIFFERENTIAL = 100, 200, 100
_CURRENT_GAIN, _CURRENT_INTEGRAL = 16, 512
"""60F9h and 60F6h hold gains without units. With their defaults (for the differential share that is 0) the loops get
these time constants: current 2 ms, velocity 10 ms, its integral 100 ms, as a drive of this size is tuned (estimate);
other values change the gains in proportion."""
_BLADE_GAIN, _BLADE_INTEGRAL = 0.125, 0.035
"""OPEN: how an axis is tuned that runs by its blade encoder. Play and twist of the gear lie between motor and encoder
then; with the full gains the axis would swing between the limits of its current. Gain and integral are made smaller by
so much: well damped, and a stop takes half a second."""
_DIFFERENTIAL_S: Final = 0.001
_LONGEST_FILTER: Final = 16
"""60F9h/5 is an exponent; beyond it the loop is dead anyway (a minute)."""


def tune(store: ObjectStore, plant: AxisPlant) -> None:
    """Give the cycles the parameters in force (60FBh, 60F9h, 60F6h, 6065h to 6068h, 6073h, 6080h)."""
    p, constants = plant.p, plant.constants
    scaling = motor_scaling(store)
    p[k.UNITS_PER_RAD] = scaling.signed_factor * ENCODER_INCREMENTS / (2 * pi)
    p[k.OFFSET_UNITS] = scaling.position(plant.encoder_zero_increments)
    p[k.POSITION_GAIN] = store.number(0x60FB, 1)
    p[k.FEED_FORWARD] = store.number(0x60FB, 2) / 1000
    p[k.SIMULATION] = 1.0 if store.number(0x60FB, 3) & SIMULATION else 0.0
    p[k.SPEED_LIMIT] = store.number(0x6080) * 2 * pi / 60
    p[k.PEAK_A] = min(store.number(0x6073), 2000) / 1000 * constants.rated_current_a
    p[k.NOMINAL_A] = constants.rated_current_a
    p[k.PEAK_TIME_S] = store.number(0x60F6, 3) / 1000
    _tune_velocity_loop(store, plant)
    _tune_current_loop(store, plant)
    window = store.number(0x6065)
    p[k.FOLLOWING_WINDOW] = k.NO_WINDOW if window == _NO_WINDOW else window
    p[k.FOLLOWING_TIME_S] = store.number(0x6066) / 1000
    p[k.POSITION_WINDOW] = store.number(0x6067)
    p[k.POSITION_TIME_S] = store.number(0x6068) / 1000


def _tune_velocity_loop(store: ObjectStore, plant: AxisPlant) -> None:
    """60F9h: gains, and the filter of the measured speed, 2 to the power of sub-index 5 in ms."""
    p, constants = plant.p, plant.constants
    filter_s = 2 ** min(store.number(0x60F9, 5), _LONGEST_FILTER) / 1000
    usual = constants.inertia_kgm2 / _VELOCITY_LOOP_S / constants.torque_nm_per_a
    p[k.FILTER] = 1 - exp(-k.CYCLE_S / filter_s)
    by_blade = p[k.SPEED_SOURCE] == k.BLADE_ENCODER
    gain, integral = (_BLADE_GAIN, _BLADE_INTEGRAL) if by_blade else (1.0, 1.0)
    p[k.VELOCITY_P] = usual * gain * store.number(0x60F9, 1) / _VELOCITY_GAIN
    p[k.VELOCITY_I] = usual * integral / _VELOCITY_RESET_S * store.number(0x60F9, 2) / _VELOCITY_INTEGRAL
    p[k.VELOCITY_D] = usual * _DIFFERENTIAL_S / filter_s * store.number(0x60F9, 3) / _VELOCITY_DIFFERENTIAL


def _tune_current_loop(store: ObjectStore, plant: AxisPlant) -> None:
    """60F6h: the integral share makes up for what the windings lose; both make a lag of the first order."""
    p, constants = plant.p, plant.constants
    lost = 1 - p[k.DECAY]
    usual = (1 - exp(-k.CYCLE_S / _CURRENT_LOOP_S)) * constants.resistance_ohm / lost
    p[k.CURRENT_P] = usual * store.number(0x60F6, 1) / _CURRENT_GAIN
    p[k.CURRENT_I] = usual * lost * store.number(0x60F6, 2) / _CURRENT_INTEGRAL
