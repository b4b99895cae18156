"""States of an axis by its statusword (CiA 402; OAT manual 5.8, table 49)."""

from __future__ import annotations

from enum import Enum
from typing import Final


class AxisState(Enum):
    """The bits of 6041h that tell the state."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08

    @property
    def text_key(self) -> str:
        """Text key of the state."""
        return f"axis_state.{_NAMES.get(self, self.name.lower())}"

    @property
    def mask(self) -> int:
        """The bits that count: bit 5 says nothing in states without power."""
        return 0x4F if self in _SHORT else 0x6F

    @classmethod
    def of(cls, statusword: int) -> AxisState | None:
        """The state that a statusword tells; None for bits that no state has."""
        return next((state for state in cls if statusword & state.mask == state.value), None)


_NAMES: Final = {AxisState.NOT_READY: "not_ready_to_switch_on", AxisState.READY: "ready_to_switch_on"}
_SHORT: Final = (
    AxisState.NOT_READY,
    AxisState.SWITCH_ON_DISABLED,
    AxisState.FAULT_REACTION_ACTIVE,
    AxisState.FAULT,
)
FOLLOWING: Final = frozenset(
    {AxisState.OPERATION_ENABLED, AxisState.QUICK_STOP_ACTIVE, AxisState.FAULT_REACTION_ACTIVE}
)
"""The axis follows something: set-points, a quick stop, a fault reaction."""
ENERGISED: Final = FOLLOWING | {AxisState.SWITCHED_ON}
"""The output stage is on."""
