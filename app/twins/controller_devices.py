"""PMM and PMC as a turbine controller sees them: what they have told it, and what it has told them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.twins.cia402 import State, Status

PARK_DEG: Final = 85.0
"""Where the blades stand when no power is made, clear of the 90 degree switch."""
_STATE_MASK: Final = 0x6F


@dataclass(slots=True)
class SeenDevice:
    """A device as the controller sees it."""

    node: int
    heard_ns: int | None = None
    ready: bool = False
    """Set and started."""
    setting: bool = False
    idle_beats: int = 0
    """Heartbeats in a row that told another state than operational."""
    error: int = 0
    """Code of its last emergency message."""


@dataclass(slots=True)
class SeenPmm(SeenDevice):
    """A PMM."""

    status: int = 0
    word: int = 0


@dataclass(slots=True)
class SeenPmc(SeenDevice):
    """A PMC."""

    status: int | None = None
    position_deg: float | None = None
    set_deg: float = PARK_DEG
    word: int = 0
    waited: int = 0
    """Cycles in "switched on"."""
    mode_set: bool = False

    @property
    def state(self) -> int:
        """Bits of the state; -1 where it is not known."""
        return -1 if self.status is None else self.status & _STATE_MASK

    @property
    def failed(self) -> bool:
        """Fault or its reaction: statusword bit 3."""
        return self.status is not None and bool(self.status & State.FAULT.value)

    @property
    def remote(self) -> bool:
        """The controlword counts."""
        return self.status is not None and bool(self.status & Status.REMOTE)

    @property
    def enabled(self) -> bool:
        """It follows."""
        return self.state == State.OPERATION_ENABLED.value
