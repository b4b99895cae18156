"""The orders that axes of every kind take, each in its own way: by the profile of the state machine."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Final, NamedTuple

from app.errors import UsageError
from app.model.axis_machine import CIA402
from app.service.devices import Target
from app.service.journal import Journal
from app.service.motion import hydraulic_moves, moves
from app.service.motion.desk import MotionDesk
from app.service.motion.hydraulic import DSP408
from app.service.stop import machine_of


class Orders(NamedTuple):
    """See ``moves`` and ``hydraulic_moves``."""

    move_to: Callable[[MotionDesk, str, int, float, float, Journal], Awaitable[None]]
    hold: Callable[[MotionDesk, str, int], Awaitable[None]]
    reset_fault: Callable[[MotionDesk, str, int, Journal], Awaitable[Any]]


_ORDERS: Final[Mapping[str, Orders]] = {
    CIA402: Orders(moves.move_to, moves.hold, moves.reset_fault),
    DSP408: Orders(hydraulic_moves.move_to, hydraulic_moves.hold, hydraulic_moves.reset_fault),
}


def orders_of(target: Target) -> Orders:
    """Raises UsageError where the device is no axis that could be moved from here."""
    profile = machine_of(target).profile
    found = _ORDERS.get(profile)
    if found is None:
        raise UsageError(reason=f"{target.slug}: no orders are known for a state machine of {profile}")
    return found
