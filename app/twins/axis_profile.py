"""Set-points of an axis: ramps, targets and their hand-over (manual, 5.10, 5.11). Pure; position units and seconds."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, sqrt


@dataclass(frozen=True, slots=True)
class Target:
    """Where to go and how: position units, units/s, units/s2. Limited when it was handed over."""

    position: float
    velocity: float
    acceleration: float
    deceleration: float


class Profile:
    """Position and velocity set-points that move by ramps."""

    __slots__ = ("position", "velocity")

    def __init__(self) -> None:
        self.position = 0.0
        self.velocity = 0.0

    def put(self, position: float) -> None:
        """Stand at a position."""
        self.position = position
        self.velocity = 0.0

    def towards(self, target: Target, dt_s: float) -> None:
        """Drive to a target and stop there. Without velocity, acceleration or deceleration it does not move."""
        acceleration, deceleration = target.acceleration, target.deceleration
        distance = target.position - self.position
        if acceleration <= 0 or deceleration <= 0:
            self.velocity = 0.0
            return
        step = deceleration * dt_s / 2
        braking = sqrt(step * step + 2 * deceleration * abs(distance)) - step
        wanted = copysign(min(target.velocity, braking), distance)
        self._change_velocity(wanted, acceleration, deceleration, dt_s)
        move = self.velocity * dt_s
        if abs(distance) <= abs(move) and abs(self.velocity) <= deceleration * dt_s * 2:
            self.put(target.position)
        else:
            self.position += move

    def run(self, velocity: float, acceleration: float, deceleration: float, dt_s: float) -> None:
        """Drive with a velocity, reached by a ramp."""
        self._change_velocity(velocity, acceleration, deceleration, dt_s)
        self.position += self.velocity * dt_s

    def _change_velocity(self, wanted: float, acceleration: float, deceleration: float, dt_s: float) -> None:
        now = self.velocity
        faster = abs(wanted) > abs(now) and wanted * now >= 0
        most = (acceleration if faster else deceleration) * dt_s
        self.velocity = wanted if abs(wanted - now) <= most else now + copysign(most, wanted - now)


class SetPoints:
    """Hand-over of targets by controlword bit 4 and statusword bit 12: one in work, one waiting."""

    def __init__(self) -> None:
        self.active: Target | None = None
        self.reached = True
        self.acknowledged = False
        self._waiting: Target | None = None
        self._offered = False

    @property
    def last(self) -> bool:
        """No further target waits."""
        return self._waiting is None

    def clear(self) -> None:
        """Forget all targets."""
        self.active = self._waiting = None
        self.reached = True
        self.acknowledged = self._offered = False

    def force(self, target: Target) -> None:
        """Go to this target at once, whatever stood."""
        self.clear()
        self.active = target
        self.reached = False

    def offer(self, target: Target) -> None:
        """Bit 4 rose. While a target waits already, another is not taken."""
        self._offered = True
        if not self.last:
            return
        if self.active is not None and not self.reached:
            self._waiting = target
        else:
            self.active = target
            self.reached = False
        self.acknowledged = True

    def withdraw(self) -> None:
        """Bit 4 fell; the acknowledge follows once another target could be taken."""
        self._offered = False
        if self.last:
            self.acknowledged = False

    def arrive(self) -> None:
        """The active target is reached; the waiting one begins."""
        self.reached = True
        if self._waiting is not None:
            self.active, self._waiting = self._waiting, None
            self.reached = False
            self.acknowledged = self._offered
