"""How fast and how far an axis is moved by hand: what this tool allows at a blade, and what the drive itself holds.

Numbers are in the unit that the description gives the object in force: degrees and degrees a second at a blade, user
units with gear and feed at a drive that has them.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Final, NamedTuple

from app.errors import AxisStateError, LimitError, UsageError
from app.model.address import Address
from app.model.values import quantity_of
from app.service.connection import Connection
from app.service.devices import Target
from app.service.motion.control import Control
from app.service.motion.interlocks import POSITION, turns_blade
from app.service.stop import is_cia402
from app.service.write import know_what_it_rests_on

TARGET_POSITION: Final = Address(0x607A)
TARGET_VELOCITY: Final = Address(0x60FF)
LOWEST: Final = Address(0x607D, 1)
HIGHEST: Final = Address(0x607D, 2)
MOST_DPS: Final = 5.0
"""The fastest that a person moves a blade by hand."""
_MOST: Final = (Address(0x607F), Address(0x6080))
"""The drive goes no faster than the lesser of these; 0 limits nothing."""
_TURN: Final[Mapping[str, float]] = {"°": 360.0, "rev": 1.0}
"""Of a unit of position there are so many in one turn."""
_TURNS_PER_S: Final[Mapping[str, float]] = {"°/s": 1 / 360, "1/min": 1 / 60, "1/s": 1.0}


class Ends(NamedTuple):
    """The software limits (607Dh), infinite where none are set."""

    low: float
    high: float


def unit_of(target: Target, address: Address) -> str:
    """Unit of an object by what is known now."""
    return quantity_of(target.entry(address), target.lookup).unit


def require_by_hand(connection: Connection, target: Target, speed: float) -> None:
    """Raises LimitError for no speed at all, and where a blade would turn faster than by hand; UsageError."""
    if not is_cia402(target):
        raise UsageError(reason=f"{target.slug} has no such command: it is no axis of CiA 402")
    most, unit = inf, unit_of(target, TARGET_VELOCITY)
    if turns_blade(connection, target):
        per_s = _TURNS_PER_S.get(unit)
        most = 0.0 if per_s is None else MOST_DPS if unit == "°/s" else MOST_DPS / (360.0 * per_s)
    if not 0 < abs(speed) <= most:
        raise _too_fast(target, speed, most, unit)


async def require_speed(connection: Connection, control: Control, speed: float) -> None:
    """As ``require_by_hand`` with the unit in force; what turns no blade may go as fast as its drive goes.

    Raises LimitError, and what reading raises.
    """
    target = control.target
    await know_what_it_rests_on(control.driver, target, target.entry(TARGET_VELOCITY))
    require_by_hand(connection, target, speed)
    if turns_blade(connection, target):
        return
    limits = [await control.scaled(address) for address in _MOST if address in target.description.entries]
    most = min((limit for limit in limits if limit > 0), default=inf)
    if abs(speed) > most:
        raise _too_fast(target, speed, most, unit_of(target, TARGET_VELOCITY))


def _too_fast(target: Target, speed: float, most: float, unit: str) -> LimitError:
    name = "" if unit == "°/s" else target.entry(TARGET_VELOCITY).title
    return LimitError(
        address=TARGET_VELOCITY.short, name=name, value=f"{speed:g}", minimum=-most, maximum=most, unit=unit
    )


async def ends_of(control: Control) -> Ends:
    """The software limits. Two that are equal as delivered have not been set. Raises what reading raises."""
    low, high = await control.number(LOWEST), await control.number(HIGHEST)
    entries = control.target.entry(LOWEST), control.target.entry(HIGHEST)
    if low == high and (low, high) == tuple(entry.default for entry in entries):
        return Ends(-inf, inf)
    return Ends(await control.scaled(LOWEST), await control.scaled(HIGHEST))


async def require_within(control: Control, position: float) -> None:
    """Raises LimitError: the drive would adjust a target outside its limits and go there (OAT manual 5.10)."""
    low, high = await ends_of(control)
    if not low <= position <= high:
        raise LimitError(
            address=TARGET_POSITION.short,
            name=control.target.entry(TARGET_POSITION).title,
            value=f"{position:g}",
            minimum=f"{low:g}",
            maximum=f"{high:g}",
            unit=unit_of(control.target, TARGET_POSITION),
        )


def way_per_s(target: Target, speed: float) -> float:
    """How far the axis goes in a second. Raises AxisStateError where both units do not go together."""
    position, velocity = unit_of(target, POSITION), unit_of(target, TARGET_VELOCITY)
    if velocity == f"{position}/s":
        return speed
    turn, per_s = _TURN.get(position), _TURNS_PER_S.get(velocity)
    if turn is None or per_s is None:
        raise AxisStateError(
            device=target.slug,
            state_key="axis_found.unknown",
            wanted_key="axis_needed.scale",
            address=TARGET_VELOCITY.short,
        )
    return speed * turn * per_s
