"""Operating modes beyond ramps: torque, homing, cyclic set-points, auto set-up (manual, 6.4 to 6.11)."""

from __future__ import annotations

from math import copysign
from typing import Final

from app.twins.axis_kernel import CYCLE_S
from app.twins.cia402 import Control as Word
from app.twins.cia402 import Status
from app.twins.pd4e.axis import Axis
from app.twins.pd4e.homing import Order, Outcome, Plan, Run, Seen, plan_of
from app.twins.pd4e.modes import Hold, Window, within_limits
from app.twins.pd4e.power_states import How
from app.twins.pd4e.servo import Control

_PER_MILLE: Final = 1000
_SETUP_CYCLES: Final = 2000
"""The auto set-up takes this long, ms (assumed)."""
_SETUP_REV_S: Final = 0.5
_BLOCK_REV_S: Final = 0.05
"""Slower than this the shaft counts as held by a block (assumed)."""


def rated_ma(axis: Axis) -> int:
    """203Bh:01, of which torques are per mille."""
    return axis.store.number(0x203B, 1)


class Torque(Hold):
    """Profile torque: only in closed loop (6.4)."""

    control = Control.CURRENT
    target: int = 0x6071

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self.demand = 0.0
        """6074h, per mille of the rated torque."""
        self._window = Window()
        self._reached = False

    def begin(self) -> None:
        """From no torque."""
        self.demand = 0.0
        self.axis.wanted_ma = 0.0
        self._window.clear()

    def cycle(self) -> None:
        """Ramp the torque by 6087h (0: at once), within 6072h and 6073h."""
        axis, store = self.axis, self.store
        wanted = float(store.number(self.target)) + self._offset()
        most = min(store.number(0x6072), store.number(0x6073))
        wanted = copysign(min(abs(wanted), most), wanted) if axis.closed_loop else 0.0
        step = self._slope() * CYCLE_S
        self.demand = wanted if not step else _stepped(self.demand, wanted, step)
        axis.wanted_ma = self._held(self.demand / _PER_MILLE * rated_ma(axis))
        actual = axis.servo.current_ma / max(rated_ma(axis), 1) * _PER_MILLE
        self._reached = self._window.holds(abs(actual - wanted), store.number(0x203D), store.number(0x203E))
        axis.reference.put(axis.servo.position, axis.servo.velocity)

    def _offset(self) -> int:
        return 0

    def _slope(self) -> int:
        return self.store.number(0x6087)

    def _held(self, current_ma: float) -> float:
        """Within the allowed current, and taken back where 6080h is reached."""
        axis = self.axis
        current_ma = copysign(min(abs(current_ma), axis.most_ma), current_ma)
        speed, most = axis.servo.velocity, axis.highest_speed(0x6080)
        if axis.limits_torque_speed and current_ma * speed > 0.0 and abs(speed) > 0.95 * most:
            current_ma *= max(0.0, (most - abs(speed)) / (0.05 * most))
        return 0.0 if axis.barred and current_ma * axis.barred > 0.0 else current_ma

    def status(self) -> int:
        """Bit 10: the torque is within 203Dh for 203Eh."""
        reached = self.axis.at_rest if self.axis.stopping else self._reached
        return Status.TARGET_REACHED if reached else 0


class CyclicTorque(Torque):
    """6.9: 6071h and 60B2h at once, without slope."""

    def _offset(self) -> int:
        return self.store.number(0x60B2)

    def _slope(self) -> int:
        return 0

    def status(self) -> int:
        """Bit 12: the set-point is followed."""
        return Status.MODE_12


def _stepped(value: float, wanted: float, step: float) -> float:
    return wanted if abs(wanted - value) <= step else value + copysign(step, wanted - value)


class Homing(Hold):
    """6.5: bit 4 starts, bits 10, 12 and 13 tell how it stands."""

    control = Control.VELOCITY

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self.switches = 0
        """60FDh as of this cycle."""
        self._run: Run | None = None
        self._plan: Plan | None = None
        self._blocked_ms = 0
        self._attained = self._failed = False
        self._speed = 0.0

    def begin(self) -> None:
        """A run of before is given up."""
        self._run = None
        self._attained = self._failed = False

    def command(self, word: int, rising: int) -> None:
        """Start on a rising bit 4, give up where it falls."""
        if rising & Word.NEW_SET_POINT:
            self.start()
        elif not word & Word.NEW_SET_POINT:
            self._run = None

    def start(self) -> None:
        """Begin the method of 6098h. One that does not exist is an error."""
        self._plan = plan_of(self.store.number(0x6098))
        self._attained, self._failed = False, self._plan is None
        self._blocked_ms = 0
        self._run = None if self._plan is None else Run(self._plan)
        self._speed = 0.0

    def start_where_it_stands(self) -> None:
        """Methods 35 and 37 need no current (manual, 6.5); others do nothing here."""
        plan = plan_of(self.store.number(0x6098))
        if plan is not None and plan.here:
            self._set_zero()
            self._attained, self._failed = True, False

    @property
    def limit_ma(self) -> float:
        """While it drives against a block, the current is limited to 203Ah:01."""
        against_block = self._run is not None and self._plan is not None and self._plan.block
        return min(self.axis.most_ma, self.store.number(0x203A, 1)) if against_block else self.axis.most_ma

    def cycle(self) -> None:
        """Follow the run."""
        order = Order(0, False) if self._run is None else self._run.step(self._seen())
        if order.outcome is not Outcome.RUNNING:
            self._end(order.outcome is Outcome.FOUND)
        self._move(order)

    def _move(self, order: Order) -> None:
        """The ramp is for the start only: a lower speed, a turn and the end come at once (manual, 609Ah)."""
        reference = self.axis.reference
        speed = order.direction * self.axis.magnitude(0x6099, 1 if order.fast else 2)
        if abs(speed) < abs(reference.velocity) or speed * reference.velocity < 0.0:
            reference.put(reference.position, 0.0 if speed * reference.velocity <= 0.0 else speed)
        rate = self.axis.ramp(0x609A, 0x60C5)
        reference.run(speed, rate, rate)

    def _seen(self) -> Seen:
        switches, servo = self.switches, self.axis.servo
        pushed = abs(servo.current_ma) >= self.limit_ma * 0.999 and abs(servo.velocity) < _BLOCK_REV_S
        self._blocked_ms = self._blocked_ms + 1 if pushed else 0
        return Seen(
            negative_limit=bool(switches & 1),
            positive_limit=bool(switches & 2),
            home=bool(switches & 4),
            index=servo.crossed_index,
            blocked=self._blocked_ms >= self.store.number(0x203A, 2),
        )

    def _end(self, found: bool) -> None:
        self._run = None
        self._attained, self._failed = found, not found
        if found:
            self._set_zero()

    def _set_zero(self) -> None:
        """The place is -607Ch from now on: CiA 402 has the zero by the home offset away from home. OPEN here."""
        axis = self.axis
        axis.zero = axis.measured + self.store.number(0x607C) / axis.units.position

    def status(self) -> int:
        """Bit 10: no run, or a standing motor after one; 12 attained; 13 error (CiA 402)."""
        still = self._run is None and self.axis.servo.still
        return (
            (Status.TARGET_REACHED if still else 0)
            | (Status.MODE_12 if self._attained else 0)
            | (Status.MODE_13 if self._failed else 0)
        )

    def ramp(self, how: How) -> float:
        """609Ah, for the quick stop 6085h."""
        return self.axis.ramp(0x609A if how is How.SLOW else 0x6085, 0x60C6)


class CyclicPosition(Hold):
    """6.7: 607Ah, absolute; straight to it within the time of 60C2h."""

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._target = 0.0
        self._remaining = 0

    def begin(self) -> None:
        """Hold until another set-point comes."""
        self._target = self._wanted()
        self._remaining = 0

    def _wanted(self) -> float:
        return float(self.store.number(0x607A) + self.store.number(0x60B0))

    @property
    def period_cycles(self) -> int:
        """60C2h:01 x 10^60C2h:02 s, in cycles, at least one."""
        seconds = self.store.number(0x60C2, 1) * 10.0 ** self.store.number(0x60C2, 2)
        return max(1, round(min(seconds, 100.0) / CYCLE_S))

    def cycle(self) -> None:
        """One step of the straight line."""
        axis, wanted = self.axis, self._wanted()
        if wanted != self._target:
            self._target, self._remaining = wanted, self.period_cycles
        place = axis.reference.position
        if not self._remaining:
            axis.reference.follow(place, 0.0)
            return
        end = axis.turns(within_limits(axis, self._target))
        move = (end - place) / self._remaining
        most = axis.highest_speed(0x6080) * CYCLE_S
        move = copysign(min(abs(move), most), move)
        self._remaining -= 1
        axis.reference.follow(place + move, move / CYCLE_S)

    def status(self) -> int:
        """Bit 12: the set-point is followed."""
        return Status.MODE_12


class InterpolatedPosition(CyclicPosition):
    """6.6: as the cyclic position, but set-points in 60C1h:01, and only while bit 4 is set."""

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._enabled = False

    def begin(self) -> None:
        """Not enabled."""
        super().begin()
        self._enabled = False

    def command(self, word: int, rising: int) -> None:
        """Bit 4 enables."""
        self._enabled = bool(word & Word.NEW_SET_POINT)

    def _wanted(self) -> float:
        return float(self.store.number(0x60C1, 1))

    def cycle(self) -> None:
        """Stand until enabled."""
        if self._enabled:
            super().cycle()
        else:
            self._target = self._wanted()
            Hold.cycle(self)

    def status(self) -> int:
        """Bit 10: at the set-point; bit 12: interpolating."""
        reached = not self._remaining and self.axis.servo.still
        return (Status.TARGET_REACHED if reached else 0) | (Status.MODE_12 if self._enabled else 0)


class CyclicVelocity(Hold):
    """6.8: 60FFh and 60B1h, without ramp."""

    control = Control.VELOCITY

    def cycle(self) -> None:
        """The set-point as it stands, within 6080h."""
        axis = self.axis
        wanted = axis.rev_s(self.store.number(0x60FF) + self.store.number(0x60B1))
        wanted = copysign(min(abs(wanted), axis.highest_speed(0x6080)), wanted)
        axis.reference.follow(axis.reference.position + wanted * CYCLE_S, wanted)

    def status(self) -> int:
        """Bit 12: the set-point is followed."""
        return Status.MODE_12


class AutoSetup(Hold):
    """6.11: bit 4 starts; the motor turns a little; then its values are known and stored.

    The known parts of the manual end before the start. By sibling drives bit 4 starts and bit 12 tells the end.
    """

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._left = 0
        self._done = False
        self.finished = False
        """It has just ended; who stores the results takes this back."""

    def begin(self) -> None:
        """Not started."""
        self._left, self._done, self.finished = 0, False, False

    def command(self, word: int, rising: int) -> None:
        """Start once."""
        if rising & Word.NEW_SET_POINT and not self._left:
            self._left, self._done = _SETUP_CYCLES, False

    def cycle(self) -> None:
        """Forth in the first half, back in the second."""
        if not self._left:
            super().cycle()
            return
        self._left -= 1
        speed = _SETUP_REV_S if self._left > _SETUP_CYCLES // 2 else -_SETUP_REV_S
        rate = _SETUP_REV_S * 20
        self.axis.reference.run(speed if self._left > _SETUP_CYCLES // 20 else 0.0, rate, rate)
        if not self._left:
            self._done = self.finished = True

    def status(self) -> int:
        """Bit 12: it has ended."""
        return (Status.MODE_12 | Status.TARGET_REACHED) if self._done else 0
