"""Operating modes with ramps of the drive: profile position, velocity, profile velocity (manual, 6.1 to 6.3)."""

from __future__ import annotations

from enum import IntEnum
from math import copysign, inf
from typing import Final, Protocol

from app.twins.axis_profile import SetPoints, Target
from app.twins.cia402 import Control as Word
from app.twins.cia402 import Status
from app.twins.pd4e.axis import Axis
from app.twins.pd4e.power_states import How
from app.twins.pd4e.servo import Control

OFF_32: Final = 0xFFFFFFFF
"""A window that is not watched."""
CHANGE_AT_ONCE: Final = 1 << 5
RELATIVE: Final = 1 << 6
CHANGE_ON_SET_POINT: Final = 1 << 9
_RESET_WHEN_REACHED: Final = 1
_RESET_WHEN_TAKEN: Final = 2
"""60F2h bits 4 and 5, as CiA 402 has them."""


class ModeCode(IntEnum):
    """6060h, 6061h. The numbers of most modes follow from the order in which the manual lists them."""

    AUTO_SETUP = -2
    CLOCK_DIRECTION = -1
    NONE = 0
    PROFILE_POSITION = 1
    VELOCITY = 2
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    INTERPOLATED_POSITION = 7
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10


class Mode(Protocol):
    """One operating mode."""

    control: Control
    """What it has the motor follow."""

    def begin(self) -> None:
        """The drive begins to follow this mode, at rest or not."""

    def command(self, word: int, rising: int) -> None:
        """A controlword has come, ``rising`` are the bits that rose."""

    def cycle(self) -> None:
        """One millisecond of set-points."""

    def status(self) -> int:
        """Bits 10 to 13 of the statusword."""

    def ramp(self, how: How) -> float:
        """Deceleration of a stop, rev/s2."""


class Hold:
    """No mode: the motor stands. Also the base of the others."""

    control = Control.POSITION

    def __init__(self, axis: Axis) -> None:
        self.axis = axis
        self.store = axis.store

    def begin(self) -> None:
        """Nothing is remembered."""

    def command(self, word: int, rising: int) -> None:
        """Nothing to obey."""

    def cycle(self) -> None:
        """Come to rest and hold."""
        self.axis.reference.run(0.0, self.axis.deceleration or inf, self.axis.deceleration or inf)

    def status(self) -> int:
        """Standing is what was wanted."""
        return Status.TARGET_REACHED if self.axis.servo.still else 0

    def ramp(self, how: How) -> float:
        """6084h, and for the quick stop 6085h within 60C6h."""
        return self.axis.deceleration if how is How.SLOW else self.axis.ramp(0x6085, 0x60C6)


class Window:
    """A value must be within a window for a time, ms."""

    def __init__(self) -> None:
        self._since_ms = 0

    def holds(self, error: float, window: int, time_ms: int) -> bool:
        """One millisecond; whether it has been within for long enough."""
        self._since_ms = self._since_ms + 1 if error <= window else 0
        return self._since_ms > time_ms

    def clear(self) -> None:
        """Begin anew."""
        self._since_ms = 0


def soft_limits(axis: Axis) -> tuple[int, int] | None:
    """607Dh; None where both are alike. OPEN whether that switches it off, as it does in sibling drives."""
    low, high = axis.store.number(0x607D, 1), axis.store.number(0x607D, 2)
    return None if low == high else (low, high)


def within_limits(axis: Axis, user: float) -> float:
    """A target held within 607Dh. The home offset has no part in it (manual, 607Dh)."""
    limits = soft_limits(axis)
    return user if limits is None else min(max(user, limits[0]), limits[1])


class ProfilePosition(Hold):
    """Targets one after another, the next one waiting or at once (6.1)."""

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._points = SetPoints()
        self._window = Window()
        self._last = 0.0
        self._within = True
        self._limited = False
        self._passes = False

    def begin(self) -> None:
        """Targets of before are forgotten."""
        self._points.clear()
        self._window.clear()
        self._last = self.axis.user_position(self.axis.reference.position)
        self._within, self._limited = True, False

    def command(self, word: int, rising: int) -> None:
        """Bit 4 hands a target over."""
        self._passes = bool(word & CHANGE_ON_SET_POINT)
        if rising & Word.NEW_SET_POINT:
            self._take(word)
            self._take_bit_back(_RESET_WHEN_TAKEN)
        elif not word & Word.NEW_SET_POINT:
            self._points.withdraw()

    def _take_bit_back(self, when: int) -> None:
        """The drive resets bit 4 itself where 60F2h bits 4 and 5 want that (manual, 6.1.2)."""
        cell = self.store.cell(0x6040)
        if self.store.number(0x60F2) >> 4 & 0x3 == when and cell.number & Word.NEW_SET_POINT:
            cell.raw = cell.number & ~Word.NEW_SET_POINT
            self._points.withdraw()

    def _take(self, word: int) -> None:
        axis = self.axis
        user = float(self.store.number(0x607A))
        if word & RELATIVE:
            user += self._base()
        allowed = within_limits(axis, user)
        self._limited = allowed != user
        if not self._points.last and not word & CHANGE_AT_ONCE:
            return  # one waits already: this one is not taken, and bit 12 tells
        self._last = allowed
        target = Target(
            axis.turns(allowed),
            min(axis.magnitude(0x6081), axis.highest_speed(0x607F, 0x6080)),
            axis.acceleration,
            axis.deceleration,
        )
        if word & CHANGE_AT_ONCE:
            self._points.force(target)
            self._points.acknowledged = True
        else:
            self._points.offer(target)
        self._window.clear()
        self._within = False

    def _base(self) -> float:
        """To what a relative target is added (60F2h, bits 0 and 1)."""
        axis = self.axis
        option = self.store.number(0x60F2) & 0x3
        if option == 1:
            return axis.user_position(axis.reference.position)
        return axis.user_position(axis.measured) if option == 2 else self._last

    def cycle(self) -> None:
        """Go on to the active target."""
        axis, target = self.axis, self._points.active
        axis.smooth()
        if target is None:
            deceleration = axis.deceleration or inf
            axis.reference.run(0.0, deceleration, deceleration)
            return
        passing = self._passing(target)
        if axis.reference.towards(
            target.position, target.velocity, target.acceleration, target.deceleration, passing
        ) and not (self._points.reached and self._points.last):
            self._points.arrive()
            if self._points.reached:
                self._take_bit_back(_RESET_WHEN_REACHED)
        error = abs(axis.user_position(axis.measured) - axis.user_position(target.position))
        window = self.store.number(0x6067)
        within = window == OFF_32 or self._window.holds(error, window, self.store.number(0x6068))
        self._within = self._points.reached and within

    def _passing(self, target: Target) -> float:
        """Speed with which the active target may be passed: that of the motion, where the next one lies beyond it."""
        following = self._points.waiting
        if not self._passes or following is None:
            return 0.0
        onward = (following.position - target.position) * (target.position - self.axis.reference.position)
        return target.velocity if onward > 0.0 else 0.0

    def status(self) -> int:
        """Target reached (6067h, 6068h), set-point acknowledge, limit of 607Dh in force."""
        reached = self.axis.at_rest if self.axis.stopping else self._within
        return (
            (Status.TARGET_REACHED if reached else 0)
            | (Status.MODE_12 if self._points.acknowledged else 0)
            | (Status.INTERNAL_LIMIT if self._limited else 0)
        )


class Velocity(Hold):
    """Like a frequency converter (6.2)."""

    control = Control.VELOCITY

    def _rate(self, index: int) -> float:
        """An acceleration as delta speed / delta time, rev/s2. OPEN for a time of 0; it counts as 1 s."""
        return self.axis.magnitude(index, 1) / (self.store.number(index, 2) or 1)

    @property
    def factor(self) -> float:
        """604Ch: from 6042h to velocity units."""
        return (self.store.number(0x604C, 1) or 1) / (self.store.number(0x604C, 2) or 1)

    def _wanted(self) -> tuple[float, bool]:
        """Target in velocity units within 6046h, and whether a limit changed it."""
        target = self.store.number(0x6042) * self.factor
        if target == 0:
            return 0.0, False
        low, high = self.store.number(0x6046, 1), self.store.number(0x6046, 2)
        held = copysign(min(max(abs(target), low), high), target)
        return held, held != target

    def cycle(self) -> None:
        """Ramp to the target."""
        most = self.axis.highest_speed(0x6080)
        speed = self.axis.rev_s(self._wanted()[0])
        speed = copysign(min(abs(speed), most), speed)
        self.axis.reference.run(speed, self._rate(0x6048), self._rate(0x6049))

    def status(self) -> int:
        """Bit 10: the ramp is at its target. OPEN, the manual names no bit for this mode; bit 11 as sibling drives."""
        if self.axis.stopping:
            return Status.TARGET_REACHED if self.axis.at_rest else 0
        wanted, limited = self._wanted()
        there = abs(self.axis.reference.velocity - self.axis.rev_s(wanted)) < 1e-9
        return (Status.TARGET_REACHED if there else 0) | (Status.INTERNAL_LIMIT if limited else 0)

    def ramp(self, how: How) -> float:
        """6049h, for the quick stop 604Ah."""
        return self._rate(0x6049 if how is How.SLOW else 0x604A)


class ProfileVelocity(Hold):
    """Speed with acceleration and, if wanted, jerk limited (6.3)."""

    control = Control.VELOCITY

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._window = Window()
        self._slipping_ms = 0
        self._reached = False
        self.slipped = False
        """60F8h was exceeded for longer than 203Fh."""

    def begin(self) -> None:
        """The windows begin anew."""
        self._window.clear()
        self._slipping_ms, self._reached, self.slipped = 0, False, False

    def cycle(self) -> None:
        """Ramp to 60FFh, within the smaller of 607Fh and 6080h."""
        axis = self.axis
        axis.smooth()
        most = axis.highest_speed(0x607F, 0x6080)
        wanted = axis.rev_s(self.store.number(0x60FF))
        wanted = copysign(min(abs(wanted), most), wanted)
        axis.reference.run(wanted, axis.acceleration, axis.deceleration)
        actual = axis.user_velocity(axis.servo.velocity)
        # The time is that of 606Eh: the manual's 6066h in this place can only be a slip of the pen.
        error = abs(actual - axis.user_velocity(wanted))
        self._reached = self._window.holds(error, self.store.number(0x606D), self.store.number(0x606E))
        self._watch_slippage(abs(actual - axis.user_velocity(axis.reference.velocity)))

    def _watch_slippage(self, error: int) -> None:
        if error <= abs(self.store.number(0x60F8)):
            self._slipping_ms = 0
            return
        self._slipping_ms += 1
        if self._slipping_ms > self.store.number(0x203F):
            self.slipped = True

    def status(self) -> int:
        """Target velocity reached (606Dh, 606Eh); bit 12: the motor stands."""
        still = self.axis.servo.still
        reached = self.axis.at_rest if self.axis.stopping else self._reached
        return (Status.TARGET_REACHED if reached else 0) | (Status.MODE_12 if still else 0)
