"""Which objects of a description tell of hydraulic cylinders: what a picture of them is drawn from, whatever the bus."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.model.address import Address, parse_address
from app.model.datatypes import Raw

LOOKS: Final = ("idle", "enabled", "warning", "fault")
"""How a cylinder may look in a state."""
MOST: Final = 2
"""Cylinders of one device that a picture has room for."""
_KEYS: Final = frozenset(
    "count position setpoint follows status mask warning error limits limited synchronous unit state".split()
)


@dataclass(frozen=True, slots=True)
class Holds:
    """True while the object at ``address`` has one of ``values``."""

    address: Address
    values: tuple[int, ...]

    def of(self, lookup: Callable[[Address], Raw | None]) -> bool | None:
        """Whether it does; None where its value is not known."""
        raw = lookup(self.address)
        return raw in self.values if isinstance(raw, int) else None


@dataclass(frozen=True, slots=True)
class CylinderState:
    """The state of an axis whose status has ``value`` in its mask. ``look`` is one of ``LOOKS``.

    ``moves``: setpoints count in it.
    """

    value: int
    name: str
    look: str
    moves: bool

    @property
    def text_key(self) -> str:
        """Text key of the state."""
        return f"cylinder_state.{self.name}"


@dataclass(frozen=True, slots=True)
class Cylinders:
    """``count`` cylinders, of which the objects tell the first; its error codes bear the number of theirs.

    A rod follows ``setpoint`` in a state that ``moves``, while all of ``follows`` hold. ``limits`` (lower,
    upper) count while ``limited`` holds, and all cylinders move as one while ``synchronous`` does. ``mask`` are the bits
    of ``status`` that tell the state, ``warning`` those that warn. ``unit`` chooses the unit of lengths.
    """

    count: int
    position: Address
    setpoint: Address
    follows: tuple[Holds, ...]
    status: Address
    mask: int
    warning: int
    error: Address
    limits: tuple[Address, Address]
    limited: Holds
    synchronous: Holds
    unit: Address
    states: tuple[CylinderState, ...]

    @property
    def moving(self) -> tuple[Address, ...]:
        """Objects that change while a cylinder moves."""
        return self.position, self.status

    @property
    def still(self) -> tuple[Address, ...]:
        """Objects that seldom change, without which a picture says less."""
        asked = (self.error, self.setpoint, *self.limits, self.limited.address, self.synchronous.address, self.unit)
        return tuple(dict.fromkeys((*asked, *(one.address for one in self.follows))))

    def state(self, status: int) -> CylinderState | None:
        """The state that a status tells; None for bits that no state has."""
        return next((state for state in self.states if state.value == status & self.mask), None)

    def references(self) -> Iterator[Address]:
        """All objects that must be there."""
        yield from (*self.moving, *self.still)


def read_cylinders(table: Mapping[str, Any]) -> Cylinders:
    """The table ``[cylinders]`` of a description. Raises KeyError, TypeError, ValueError, UsageError."""
    if unknown := table.keys() - _KEYS:
        raise ValueError(f"unknown key '{min(unknown)}'")
    count, states = int(table["count"]), tuple(_state(row) for row in table["state"])
    if not 1 <= count <= MOST:
        raise ValueError(f"count is {count}, there may be 1 to {MOST}")
    if len({state.value for state in states}) < len(states):
        raise ValueError("two states have the same value")
    lower, upper = map(parse_address, table["limits"])
    return Cylinders(
        count=count,
        position=parse_address(table["position"]),
        setpoint=parse_address(table["setpoint"]),
        follows=tuple(_holds(row) for row in table["follows"]),
        status=parse_address(table["status"]),
        mask=int(table["mask"]),
        warning=int(table["warning"]),
        error=parse_address(table["error"]),
        limits=(lower, upper),
        limited=_holds(table["limited"]),
        synchronous=_holds(table["synchronous"]),
        unit=parse_address(table["unit"]),
        states=states,
    )


def _holds(row: Mapping[str, Any]) -> Holds:
    return Holds(parse_address(row["address"]), tuple(map(int, row["values"])))


def _state(row: Mapping[str, Any]) -> CylinderState:
    if row["look"] not in LOOKS:
        raise ValueError(f"look '{row['look']}' is none of: {', '.join(LOOKS)}")
    return CylinderState(int(row["value"]), str(row["name"]), row["look"], bool(row.get("moves", False)))
