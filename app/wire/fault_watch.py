"""Faults of a device that sends no emergency messages: by its statusword, and by the error code that it holds.

Whichever is seen first tells of a fault; the code, where it comes later, tells of it once more, for it names the
reason. A code without the state Fault is a warning (CiA 402, 603Fh).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

from app.model.address import Address, Addressing
from app.model.axis_state import AxisState
from app.wire.records import FaultSeen, ValueSeen

_BYTES: Final = 2
_STATE: Final = 0x0F
"""Bits of the statusword of DSP-408 that tell the state."""


class FaultPlaces(NamedTuple):
    """Where a device shows its faults; ``in_fault`` judges its statusword."""

    statusword: Address
    error_code: Address
    in_fault: Callable[[int], bool]


CIA402: Final = FaultPlaces(
    Address(0x6041),
    Address(0x603F),
    lambda word: AxisState.of(word) in (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE),
)
DSP408: Final = FaultPlaces(
    Address(0, 38, Addressing.PKW), Address(0, 36, Addressing.PKW), lambda word: word & _STATE in (0x1, 0x3, 0x7)
)
"""FAULT, FAULT_HOLD and FAULT_REACTION: not ready, and yet in a state (ED2 manual, 4.8.3 and 5.7)."""


class FaultWatch:
    """What the values of one device have told. ``fault`` None: its statusword was not seen; ``code`` 0: no error."""

    def __init__(self, places: FaultPlaces = CIA402) -> None:
        self._places = places
        self.fault: bool | None = None
        self.code = 0

    def forget(self) -> None:
        """It has started anew, or frames are missing: what is seen next is told as it stands."""
        self.fault, self.code = None, 0

    def see(self, value: ValueSeen) -> FaultSeen | None:
        """One value; what it tells of a fault, if that is new."""
        statusword, error_code, in_fault = self._places
        if value.address not in (statusword, error_code) or len(value.data) != _BYTES:
            return None
        number = int.from_bytes(value.data, "little")
        new = self._state(in_fault(number)) if value.address == statusword else self._error(number)
        return FaultSeen(value.t_ns, value.bus, value.node, self.fault, self.code) if new else None

    def _state(self, fault: bool) -> bool:
        before, self.fault = self.fault, fault
        if self.fault:
            return before is False or (before is None and not self.code)
        return bool(before) and not self.code

    def _error(self, code: int) -> bool:
        before, self.code = self.code, code
        if code:
            return code != before
        return bool(before) and not self.fault

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state."""
        return {"fault": self.fault, "code": self.code}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()``. Raises KeyError on another state."""
        self.fault, self.code = state["fault"], state["code"]
