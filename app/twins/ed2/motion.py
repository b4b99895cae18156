"""How the setpoint of one axis, or of a synchronous pair, moves in each mode (ED2 manual, 4.3.1). Pure; mm, s."""

from __future__ import annotations

from math import inf
from typing import Final, NamedTuple

from app.twins.axis_profile import SetPoints, Target
from app.twins.ed2.params import ControlMode, Params
from app.twins.ed2.states import Control
from app.twins.pd4e.reference import Reference

_LONGEST_TACT_MS: Final = 500
"""Setpoints that come more seldom are no stream that could be interpolated (assumed)."""


class Order(NamedTuple):
    """What is wanted: a place, and the ramps towards it."""

    place: float
    velocity: float
    acceleration: float
    deceleration: float


class Motion:
    """The setpoint, one step a millisecond."""

    def __init__(self) -> None:
        self.reference = Reference()
        self.points = SetPoints()
        self.target = 0.0
        """Where it goes in the end."""
        self._word = 0
        self._stream = _Stream()

    def begin(self, actual: float) -> None:
        """A closed loop begins where the axis is."""
        self.reference.put(actual)
        self.points = SetPoints()
        self.target = actual
        self._stream.begin(actual)

    @property
    def acknowledges(self) -> bool:
        """Setpoint_acknowledge of mode -1."""
        return self.points.acknowledged

    @property
    def arrived(self) -> bool:
        """The setpoint stands where it was to go, and nothing waits."""
        return self.points.last and self.reference.position == self.target

    def enter(self, word: int) -> None:
        """DEVICE_MODE_ACTIVE begins: an edge counts from here on."""
        self._word = word
        self._stream.begin(self.reference.position)

    def rest(self, params: Params, deceleration: float) -> None:
        """Come to rest and stay: HOLD, and the stop bit."""
        self.points.clear()
        # A ramp of 0 would never end.
        self.reference.run(0.0, params.acceleration, deceleration if deceleration > 0.0 else inf)
        self.target = self.reference.position
        self._stream.begin(self.target)

    def run(self, mode: ControlMode, word: int, order: Order, params: Params) -> None:
        """One cycle of DEVICE_MODE_ACTIVE in a mode with a closed loop."""
        rising, falling, self._word = word & ~self._word, self._word & ~word, word
        if word & Control.STOP:
            # OPEN: polarity and latching are not told. Set, it brings the axis to rest and drops what was ordered.
            self.rest(params, order.deceleration)
        elif mode is ControlMode.POSITION:
            self._follow(word, order, params)
        elif mode is ControlMode.PROFILE:
            self._profile(word, rising, falling, order, params)
        elif mode is ControlMode.MANUAL:
            direction = bool(word & Control.POSITIVE) - bool(word & Control.NEGATIVE)
            self.jog(direction, bool(word & Control.RAPID), params)

    def jog(self, direction: int, rapid: bool, params: Params) -> None:
        """Manual control: a constant speed while commanded. Both directions at once are none (OPEN)."""
        speed = min(params.rapid if rapid else params.creep, params.velocity)
        ramp = params.hand_acceleration
        edge = None if params.travel is None else params.travel[direction > 0]
        if direction and edge is not None:
            beyond = (self.reference.position - edge) * direction >= 0.0
            if beyond:
                self.reference.run(0.0, ramp, ramp or inf)
            else:
                self.reference.towards(edge, speed, ramp, ramp)
        else:
            self.reference.run(direction * speed, ramp, ramp or inf)
        self.target = self.reference.position

    def bar(self, direction: int, actual: float) -> None:
        """A limit switch lets nothing go on in a direction."""
        if self.reference.velocity * direction > 0.0:
            self.reference.put(actual)

    def _follow(self, word: int, order: Order, params: Params) -> None:
        """Mode 9. OPEN whether start counts as a level; here the axis follows while it is set, and rests else."""
        if not word & Control.START:
            self.rest(params, order.deceleration)
            return
        self.target = _within(order.place, params)
        place = self._stream.next(self.target)
        self.reference.towards(place, order.velocity, order.acceleration, order.deceleration)

    def _profile(self, word: int, rising: int, falling: int, order: Order, params: Params) -> None:
        """Mode -1: handshake of new_setpoint and setpoint_acknowledge (4.3.1.3)."""
        points = self.points
        if rising & Control.NEW_SETPOINT:
            target = Target(_within(order.place, params), order.velocity, order.acceleration, order.deceleration)
            if word & Control.FORCE_SETPOINT:
                points.force(target)
                points.acknowledged = True
            elif not points.acknowledged:
                points.offer(target)
        elif falling & Control.NEW_SETPOINT:
            points.withdraw()
        active = points.active
        if active is None:
            self.reference.run(0.0, order.acceleration, order.deceleration or inf)
            return
        self.target = active.position
        there = self.reference.towards(active.position, active.velocity, active.acceleration, active.deceleration)
        if there and not points.reached:
            points.arrive()


class _Stream:
    """Setpoints that come at a constant tact: from the last but one to the last in the time of one tact."""

    def __init__(self) -> None:
        self.begin(0.0)

    def begin(self, place: float) -> None:
        """Nothing has come yet; the axis is here."""
        self._from = self._to = place
        self._since_ms = _LONGEST_TACT_MS
        self._tact_ms = 0

    def next(self, wanted: float) -> float:
        """One cycle further, with the latest setpoint."""
        if wanted != self._to:
            self._from, self._to = self._to, wanted
            self._tact_ms = self._since_ms if self._since_ms < _LONGEST_TACT_MS else 0
            self._since_ms = 0
        self._since_ms = min(self._since_ms + 1, _LONGEST_TACT_MS)
        if self._since_ms >= self._tact_ms:
            return self._to
        return self._from + (self._to - self._from) * self._since_ms / self._tact_ms


def _within(place: float, params: Params) -> float:
    """A place inside the limits of travel, where they are in force. Enabled with 0 to 0, there is but one place."""
    if params.travel is None:
        return place
    low, high = params.travel
    return min(max(place, low), high)
