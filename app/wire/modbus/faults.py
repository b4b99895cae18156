"""Faults of a device that sends no emergency messages: by its statusword, and by the error code that it holds.

Whichever is seen first tells of a fault; the code, where it comes later, tells of it once more, for it names the
reason. A code without the state Fault is a warning (CiA 402, 603Fh).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from app.model.address import Address
from app.model.axis_state import AxisState
from app.wire.records import FaultSeen, ValueSeen

STATUSWORD: Final = Address(0x6041)
ERROR_CODE: Final = Address(0x603F)
_FAULT: Final = (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE)
_BYTES: Final = 2


class FaultWatch:
    """What the values of one device have told. ``fault`` None: its statusword was not seen; ``code`` 0: no error."""

    def __init__(self) -> None:
        self.fault: bool | None = None
        self.code = 0

    def forget(self) -> None:
        """It has started anew, or frames are missing: what is seen next is told as it stands."""
        self.fault, self.code = None, 0

    def see(self, value: ValueSeen) -> FaultSeen | None:
        """One value; what it tells of a fault, if that is new."""
        if value.address not in (STATUSWORD, ERROR_CODE) or len(value.data) != _BYTES:
            return None
        number = int.from_bytes(value.data, "little")
        new = self._state(number) if value.address == STATUSWORD else self._error(number)
        return FaultSeen(value.t_ns, value.bus, value.node, self.fault, self.code) if new else None

    def _state(self, statusword: int) -> bool:
        before, self.fault = self.fault, AxisState.of(statusword) in _FAULT
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
