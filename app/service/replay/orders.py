"""What can be asked of the cursor of a replay."""

from __future__ import annotations

from dataclasses import dataclass

from app.service.replay.transport import Loop


@dataclass(frozen=True, slots=True)
class Play:
    """Go on; from the beginning where it stands at the end. ``speed`` None: as fast as before."""

    speed: float | None = None


@dataclass(frozen=True, slots=True)
class Pause:
    """Stand still."""


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to a time, in t_ns."""

    t_ns: int


@dataclass(frozen=True, slots=True)
class StepTime:
    """Go so far, in ns, backwards where negative; it stands still then."""

    dt_ns: int


@dataclass(frozen=True, slots=True)
class StepFrame:
    """Go to the next frame, or the one before; it stands still then."""

    forward: bool


@dataclass(frozen=True, slots=True)
class StepEvent:
    """Go to the next event, or the one before; it stands still then."""

    forward: bool


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """Play so many times as fast as it happened."""

    speed: float


@dataclass(frozen=True, slots=True)
class SetLoop:
    """Play a stretch over and over; None: no more."""

    loop: Loop | None


Order = Play | Pause | Seek | StepTime | StepFrame | StepEvent | SetSpeed | SetLoop
