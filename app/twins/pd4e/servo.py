"""The motor on its load: current, speed and position of the shaft, one step a millisecond. Pure; SI and revolutions.

One mass with dry friction, a current that follows at once within its limit, and a speed controller that fits it and
learns the torque of the load from how the shaft moves. The gains 3210h have no printed unit and no part in it. In open
loop the same controller stands for the stepping field: lost steps are not simulated.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import copysign, floor, pi
from typing import Final

from app.twins.axis_kernel import CYCLE_S, slowed

_TURN_RAD: Final = 2 * pi
_SPEED_S: Final = 0.004
"""Time constant of the speed controller."""
_POSITION_PER_S: Final = 50.0
"""Gain of the position controller."""
_LEARNING_S: Final = 0.01
"""Time constant with which the load is learnt."""
_STILL_REV_S: Final = 0.002


class Control(Enum):
    """What the controllers follow."""

    OFF = "no current"
    POSITION = "position"
    VELOCITY = "velocity"
    CURRENT = "current"


@dataclass(frozen=True, slots=True)
class Motor:
    """A motor with its load.

    ``torque_nm`` is that of the rated current (assumed, but for the BLDC type: manual, 3.3.2), ``inertia_kgm2`` and
    ``friction_nm`` those of motor and load together (assumed).
    """

    rated_ma: float
    torque_nm: float
    inertia_kgm2: float
    friction_nm: float


@dataclass(frozen=True, slots=True)
class Bench:
    """What the shaft is coupled to, in revolutions of the motor from where it stands at the first power-on.

    Beyond a stop it does not turn. A limit switch is closed up to ``negative_switch`` and from ``positive_switch``
    on, the reference switch between both ends of ``home_switch``. The index of the encoder passes once a revolution,
    at ``index``.
    """

    low_stop: float | None = None
    high_stop: float | None = None
    negative_switch: float | None = None
    positive_switch: float | None = None
    home_switch: tuple[float, float] | None = None
    index: float = 0.3

    def inputs(self, position: float) -> int:
        """Levels of inputs 1 to 3 (negative limit, positive limit, reference), as bits 0 to 2."""
        levels = 0
        if self.negative_switch is not None and position <= self.negative_switch:
            levels |= 1
        if self.positive_switch is not None and position >= self.positive_switch:
            levels |= 2
        if self.home_switch is not None and self.home_switch[0] <= position <= self.home_switch[1]:
            levels |= 4
        return levels


class Servo:
    """Motor and controllers. ``position`` is in revolutions, ``velocity`` in revolutions per second."""

    def __init__(self, motor: Motor, bench: Bench) -> None:
        self.motor = motor
        self.bench = bench
        self.position = 0.0
        self.velocity = 0.0
        self.current_ma = 0.0
        """Torque-producing current, signed."""
        self.load_nm = 0.0
        """Torque of the load on the shaft."""
        self.limited = False
        """The current was at its limit in the last cycle."""
        self.crossed_index = False
        """The index passed in the last cycle."""
        self._against_load_ma = 0.0
        self._per_rev_s2 = motor.inertia_kgm2 * _TURN_RAD / motor.torque_nm * motor.rated_ma
        self._friction_ma = motor.friction_nm / motor.torque_nm * motor.rated_ma

    @property
    def still(self) -> bool:
        """The shaft stands."""
        return abs(self.velocity) < _STILL_REV_S

    def release(self) -> None:
        """Take the current away."""
        self.current_ma = self._against_load_ma = 0.0
        self.limited = False

    def step(self, control: Control, position: float, velocity: float, acceleration: float, limit_ma: float) -> None:
        """One cycle. ``limit_ma`` is the most current, or for ``Control.CURRENT`` the wanted current, signed."""
        if control is Control.OFF:
            self.release()
        elif control is Control.CURRENT:
            self.current_ma, self._against_load_ma, self.limited = limit_ma, 0.0, False
        else:
            self.current_ma = self._speed_control(control, position, velocity, acceleration, limit_ma)
        self._move()

    def _speed_control(
        self, control: Control, position: float, velocity: float, acceleration: float, limit_ma: float
    ) -> float:
        wanted = velocity
        if control is Control.POSITION:
            wanted += _POSITION_PER_S * (position - self.position)
        error = wanted - self.velocity
        friction = copysign(self._friction_ma, wanted) if abs(wanted) > _STILL_REV_S else 0.0
        self._against_load_ma = min(max(self._against_load_ma, -limit_ma), limit_ma)
        current = self._per_rev_s2 * (acceleration + error / _SPEED_S) + friction + self._against_load_ma
        self.limited = abs(current) > limit_ma
        return min(max(current, -limit_ma), limit_ma)

    def _move(self) -> None:
        torque = self.current_ma / self.motor.rated_ma * self.motor.torque_nm + self.load_nm
        pushed = self.velocity + torque / (self.motor.inertia_kgm2 * _TURN_RAD) * CYCLE_S
        friction = self.motor.friction_nm / (self.motor.inertia_kgm2 * _TURN_RAD) * CYCLE_S
        was, before = self.velocity, self.position
        self.velocity = slowed(pushed, friction)
        self.position += (was + self.velocity) / 2 * CYCLE_S
        self._stop_at_ends()
        self._learn_load(was)
        index = self.bench.index
        self.crossed_index = floor(before - index) != floor(self.position - index)

    def _learn_load(self, was: float) -> None:
        """What the motor must give besides speeding up: its current, less what the change of speed and friction took.

        A shaft that is held gives no hint; then the current stays, and grows as long as something is wanted.
        """
        moved = self._per_rev_s2 * (self.velocity - was) / CYCLE_S
        rubbed = copysign(self._friction_ma, self.velocity) if self.velocity else 0.0
        needed = self.current_ma - moved - rubbed
        self._against_load_ma += (needed - self._against_load_ma) * CYCLE_S / _LEARNING_S

    def _stop_at_ends(self) -> None:
        low, high = self.bench.low_stop, self.bench.high_stop
        if low is not None and self.position < low:
            self.position, self.velocity = low, 0.0
        elif high is not None and self.position > high:
            self.position, self.velocity = high, 0.0
