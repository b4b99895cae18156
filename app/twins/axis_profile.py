"""Set-points of an axis: targets and their hand-over (manual, 5.10, 5.11). Pure; position units and seconds."""

from __future__ import annotations

from dataclasses import dataclass

from app.twins.axis_kernel import SET_POSITION, SET_VELOCITY


@dataclass(frozen=True, slots=True)
class Target:
    """Where to go and how: position units, units/s, units/s2. Limited when it was handed over."""

    position: float
    velocity: float
    acceleration: float
    deceleration: float


class Profile:
    """Position and velocity set-points as the kernel moves them; ``s`` is its state."""

    __slots__ = ("_s",)

    def __init__(self, s: list[float]) -> None:
        self._s = s

    @property
    def position(self) -> float:
        """Set-point of the position."""
        return self._s[SET_POSITION]

    @property
    def velocity(self) -> float:
        """Set-point of the velocity, per second."""
        return self._s[SET_VELOCITY]

    def put(self, position: float, velocity: float = 0.0) -> None:
        """Begin at a position, with a velocity."""
        self._s[SET_POSITION] = position
        self._s[SET_VELOCITY] = velocity


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

    @property
    def waiting(self) -> Target | None:
        """The target that follows the active one."""
        return self._waiting

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
