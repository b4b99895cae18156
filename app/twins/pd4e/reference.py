"""Set-points of the motor as ramps move them, in revolutions and seconds, one step a millisecond. Pure."""

from __future__ import annotations

from collections import deque
from math import ceil, copysign, inf, sqrt
from typing import Final

from app.twins.axis_kernel import CYCLE_S, changed

_LONGEST_WINDOW: Final = 4000
"""Cycles over which a ramp is smoothed at most: a jerk that asks for more would take minutes to begin."""


class _Smoothing:
    """Moving mean over the last cycles of a ramp: position and velocity."""

    def __init__(self, cycles: int, position: float, velocity: float) -> None:
        """Filled as if the motion had been uniform so far, so that the mean begins at ``position``."""
        self._past = deque(
            (position + ((cycles - 1) / 2 - back) * velocity * CYCLE_S, velocity) for back in reversed(range(cycles))
        )
        self._positions = sum(position for position, _ in self._past)
        self._velocities = sum(velocity for _, velocity in self._past)
        self._alike = 0

    @property
    def cycles(self) -> int:
        return len(self._past)

    @property
    def newest(self) -> float:
        """Where the ramp is, ahead of its mean."""
        return self._past[-1][0]

    def mean(self, position: float, velocity: float) -> tuple[float, float]:
        """The mean with these; exactly these as soon as the ramp has stood for the whole window."""
        self._alike = self._alike + 1 if (position, velocity) == self._past[-1] else 1
        old_position, old_velocity = self._past.popleft()
        self._past.append((position, velocity))
        count = len(self._past)
        if self._alike >= count:
            self._positions, self._velocities = position * count, velocity * count
            return position, velocity
        self._positions += position - old_position
        self._velocities += velocity - old_velocity
        return self._positions / count, self._velocities / count


class Reference:
    """Position and velocity set-points: ``position`` and ``velocity`` are what the motor is to follow.

    A jerk-limited ramp is a trapezoid smoothed by a moving mean over acceleration / jerk: the jerk stays within its
    limit, and the end is met exactly. It is twice that where a short move goes from speeding up straight to slowing
    down.
    """

    def __init__(self) -> None:
        self.position = 0.0
        self.velocity = 0.0
        self.acceleration = 0.0
        """Change of the velocity in the last cycle, rev/s2: a pre-control of the current."""
        self._ramp_position = 0.0
        self._ramp_velocity = 0.0
        self._smoothing: _Smoothing | None = None

    def put(self, position: float, velocity: float = 0.0) -> None:
        """Begin here, without smoothing."""
        self.position = self._ramp_position = position
        self.velocity = self._ramp_velocity = velocity
        self.acceleration = 0.0
        self._smoothing = None

    def smooth(self, acceleration: float, jerk: float) -> None:
        """Limit the jerk of what follows; a jerk of 0 or without end does not."""
        limited = 0.0 < jerk < inf and 0.0 < acceleration < inf
        cycles = min(ceil(acceleration / jerk / CYCLE_S), _LONGEST_WINDOW) if limited else 1
        if cycles == (1 if self._smoothing is None else self._smoothing.cycles):
            return
        self.put(self.position, self.velocity)
        if cycles > 1:
            self._smoothing = _Smoothing(cycles, self.position, self.velocity)
            self._ramp_position = self._smoothing.newest

    def run(self, velocity: float, acceleration: float, deceleration: float) -> None:
        """One cycle towards a velocity."""
        self._ramp_velocity = changed(self._ramp_velocity, velocity, acceleration, deceleration)
        self._ramp_position += self._ramp_velocity * CYCLE_S
        self._follow()

    def towards(
        self, target: float, velocity: float, acceleration: float, deceleration: float, passing: float = 0.0
    ) -> bool:
        """One cycle towards a position; gives whether it is reached, or passed with the speed ``passing``.

        Without velocity, acceleration or deceleration nothing moves.
        """
        distance = target - self._ramp_position
        if velocity <= 0.0 or acceleration <= 0.0 or deceleration <= 0.0:
            self._ramp_velocity = 0.0
            self._follow()
            return distance == 0.0 and self.position == target
        step = deceleration * CYCLE_S / 2
        braking = sqrt(step * step + 2 * deceleration * abs(distance) + passing * passing) - step
        wanted = copysign(min(velocity, braking), distance)
        self._ramp_velocity = changed(self._ramp_velocity, wanted, acceleration, deceleration)
        move = self._ramp_velocity * CYCLE_S
        slow_enough = abs(self._ramp_velocity) <= max(deceleration * CYCLE_S * 2, passing * 1.000001)
        if abs(distance) <= abs(move) and slow_enough:
            if passing:
                self._ramp_position += move
                self._follow()
                return True
            self._ramp_position, self._ramp_velocity = target, 0.0
        elif distance:
            self._ramp_position += move
        else:
            self._ramp_velocity = 0.0
        self._follow()
        return self.position == target and self.velocity == 0.0

    def follow(self, position: float, velocity: float) -> None:
        """One cycle of a course that somebody else gives."""
        before = self.velocity
        self.put(position, velocity)
        self.acceleration = (velocity - before) / CYCLE_S

    def _follow(self) -> None:
        before = self.velocity
        self.position, self.velocity = self._ramp_position, self._ramp_velocity
        if self._smoothing is not None:
            self.position, self.velocity = self._smoothing.mean(self.position, self.velocity)
        self.acceleration = (self.velocity - before) / CYCLE_S
