"""Which control commands an axis, by the profile of its state machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from app.errors import UsageError
from app.model.axis_machine import CIA402, StateMachine
from app.service.motion.commanding import Commanding
from app.service.motion.control import Control
from app.service.motion.hydraulic import HydraulicControl

_CONTROLS: Final[Mapping[str, type[Commanding]]] = {CIA402: Control, "dsp408": HydraulicControl}


def control_class(machine: StateMachine) -> type[Commanding]:
    """Raises UsageError where nothing here knows the profile."""
    found = _CONTROLS.get(machine.profile)
    if found is None:
        raise UsageError(reason=f"no commands are known for a state machine of {machine.profile}")
    return found
