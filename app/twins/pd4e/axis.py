"""What all operating modes share: the motor, its set-points, its limits and how it is brought to rest."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from app.twins.object_store import ObjectStore
from app.twins.pd4e.power_states import How
from app.twins.pd4e.reference import Reference
from app.twins.pd4e.servo import Control, Servo
from app.twins.pd4e.units import Units, encoder_increments, units_of

CLOSED_LOOP = 0x1
"""Bit of 3202h."""
_TORQUE_ONLY = 0x20
"""Bit of 3202h: no speed limit in the torque modes."""
_RAMP_KINDS = 3
"""6086h: jerk-limited ramps."""
_PATIENCE_MS = 1000
"""How long a shaft that does not come to rest is waited for after the ramp has ended (assumed)."""
NO_REACTION = -1
"""3701h and 3700h: nothing happens."""


class Axis:
    """The motor as operating modes see it, in revolutions and revolutions per second."""

    def __init__(self, store: ObjectStore, servo: Servo) -> None:
        self.store = store
        self.servo = servo
        self.reference = Reference()
        self.control = Control.OFF
        self.wanted_ma = 0.0
        """Current of the torque modes."""
        self.barred = 0
        """Direction in which a limit switch forbids to go on, else 0."""
        self.most_ma = 0.0
        """Most current that the motor may have now."""
        self.encoder_start = servo.position
        """Where the shaft stood at power-on: there the encoder counts from 0."""
        self.zero = servo.position
        """Where the user position is 0, by homing."""
        self.units: Units = units_of(store)
        self._how: How | None = None
        self._deceleration = inf
        self._waited_ms = 0
        self._ramps: Callable[[How], float] = lambda _how: inf

    # -- user units ------------------------------------------------------------------------

    def restart(self) -> None:
        """Power-on: an incremental encoder begins at 0, and the reference is lost."""
        self.encoder_start = self.zero = self.servo.position
        self.units = units_of(self.store)
        self.release()

    def user_position(self, turns: float) -> int:
        """A place of the shaft in position units."""
        return round((turns - self.zero) * self.units.position)

    def turns(self, user: float) -> float:
        """The place of the shaft for a user position."""
        return user / self.units.position + self.zero

    def user_velocity(self, rev_s: float) -> int:
        """A speed in velocity units."""
        return round(rev_s * self.units.velocity)

    def rev_s(self, user: float) -> float:
        """A speed from velocity units, signed."""
        return user / self.units.velocity

    @property
    def measured(self) -> float:
        """Place of the shaft as the encoder tells it."""
        return self.encoder_start + self.increments / self._per_turn

    @property
    def increments(self) -> int:
        """6063h: what the encoder has counted since power-on."""
        return round((self.servo.position - self.encoder_start) * self._per_turn)

    @property
    def following_error(self) -> int:
        """60F4h: wanted less actual position, in position units."""
        return self.user_position(self.reference.position) - self.user_position(self.measured)

    @property
    def _per_turn(self) -> float:
        return encoder_increments(self.store)

    # -- parameters --------------------------------------------------------------------------

    @property
    def closed_loop(self) -> bool:
        """3202h bit 0."""
        return bool(self.store.number(0x3202) & CLOSED_LOOP)

    @property
    def limits_torque_speed(self) -> bool:
        """3202h bit 5 is not set: the torque modes keep below 6080h."""
        return not self.store.number(0x3202) & _TORQUE_ONLY

    def magnitude(self, index: int, sub: int = 0) -> float:
        """A velocity object as a speed, rev/s."""
        return abs(self.rev_s(self.store.number(index, sub)))

    def highest_speed(self, *objects: int) -> float:
        """The lowest of some limits of speed, rev/s. OPEN what 0 means; it counts as no limit."""
        limits = [self.magnitude(index) for index in objects if self.store.number(index)]
        return min(limits, default=inf)

    def ramp(self, index: int, limit: int | None = None) -> float:
        """An acceleration object, rev/s2, not beyond the one that limits it (0: none)."""
        value = abs(self.store.number(index) / self.units.acceleration)
        most = 0 if limit is None else self.store.number(limit)
        return min(value, abs(most / self.units.acceleration)) if most else value

    @property
    def acceleration(self) -> float:
        """6083h within 60C5h."""
        return self.ramp(0x6083, 0x60C5)

    @property
    def deceleration(self) -> float:
        """6084h within 60C6h."""
        return self.ramp(0x6084, 0x60C6)

    @property
    def jerk(self) -> float:
        """The smallest of 60A4h with jerk-limited ramps (6086h = 3), rev/s3; else 0: not limited.

        The four jerks of a ramp are not told apart.
        """
        if self.store.number(0x6086) != _RAMP_KINDS:
            return 0.0
        jerks = [self.store.number(0x60A4, sub) for sub in range(1, 5) if self.store.find(0x60A4, sub) is not None]
        return min((abs(jerk / self.units.jerk) for jerk in jerks if jerk), default=0.0)

    def smooth(self) -> None:
        """Apply the jerk limit to the ramps of the profile modes."""
        self.reference.smooth(max(self.acceleration, self.deceleration), self.jerk)

    # -- current on and off, stops -----------------------------------------------------------

    def operate(self, control: Control, ramps: Callable[[How], float]) -> None:
        """Begin to follow set-points that start where the motor is."""
        self.control = control
        self._ramps = ramps
        self._how = None
        self._waited_ms = 0
        self.reference.put(self.servo.position, 0.0 if self.servo.still else self.servo.velocity)

    def release(self) -> None:
        """No current."""
        self.control = Control.OFF
        self._how = None
        self.servo.release()
        self.reference.put(self.servo.position)

    def stop(self, how: How) -> None:
        """Come to rest, and stay so until ``operate`` or ``go_on``."""
        self._how = how
        self._waited_ms = 0
        self._deceleration = inf if how is How.AT_ONCE else self._ramps(how)
        if self._deceleration <= 0.0:
            self._deceleration = inf  # a ramp of 0 would never end
        if self.control is Control.CURRENT:
            self.control = Control.VELOCITY
            self.reference.put(self.servo.position, self.servo.velocity)
        else:
            self.reference.put(self.reference.position, self.reference.velocity)

    @property
    def stopping(self) -> bool:
        """A stop was commanded and not taken back."""
        return self._how is not None

    def go_on(self, control: Control) -> None:
        """End a halt."""
        self._how = None
        self.control = control

    @property
    def at_rest(self) -> bool:
        """The commanded stop has ended, or there is no current. A shaft that is dragged along is waited for a while."""
        if self.control is Control.OFF:
            return True
        return self.reference.velocity == 0.0 and (self.servo.still or self._waited_ms >= _PATIENCE_MS)

    def step(self, limit_ma: float) -> None:
        """One millisecond of the motor."""
        reference = self.reference
        if self._how is not None and self.control is not Control.OFF:
            reference.run(0.0, self._deceleration, self._deceleration)
            self._waited_ms = self._waited_ms + 1 if reference.velocity == 0.0 else 0
        elif self.barred and reference.velocity * self.barred > 0.0:
            reference.put(self.servo.position)
        limit = self.wanted_ma if self.control is Control.CURRENT else limit_ma
        self.servo.step(self.control, reference.position, reference.velocity, reference.acceleration, limit)
