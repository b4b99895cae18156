"""Which objects of a description tell of hydraulic cylinders: what a picture of them is drawn from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.model.address import Address, parse_address
from app.model.datatypes import Raw

MOST: Final = 2
"""Cylinders of one device that a picture has room for."""
_KEYS: Final = frozenset("count position setpoint follows warning error limits limited synchronous unit".split())


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
class Cylinders:
    """``count`` cylinders, of which the objects tell the first; its error codes bear the number of theirs.

    A rod follows ``setpoint`` while its axis runs and all of ``follows`` hold. ``limits`` (lower, upper) count while
    ``limited`` holds, and all cylinders move as one while ``synchronous`` does. ``warning`` are the bits of the status
    word that warn. ``unit`` chooses the unit of lengths.
    """

    count: int
    position: Address
    setpoint: Address
    follows: tuple[Holds, ...]
    warning: int
    error: Address
    limits: tuple[Address, Address]
    limited: Holds
    synchronous: Holds
    unit: Address

    @property
    def still(self) -> tuple[Address, ...]:
        """Objects that seldom change, without which a picture says less than with ``position`` alone."""
        asked = (self.error, self.setpoint, *self.limits, self.limited.address, self.synchronous.address, self.unit)
        return tuple(dict.fromkeys((*asked, *(one.address for one in self.follows))))

    def references(self) -> Iterator[Address]:
        """All objects that must be there."""
        yield from (self.position, *self.still)


def read_cylinders(table: Mapping[str, Any]) -> Cylinders:
    """The table ``[cylinders]`` of a description. Raises KeyError, TypeError, ValueError, UsageError."""
    if unknown := table.keys() - _KEYS:
        raise ValueError(f"unknown key '{min(unknown)}'")
    count = int(table["count"])
    if not 1 <= count <= MOST:
        raise ValueError(f"count is {count}, there may be 1 to {MOST}")
    lower, upper = map(parse_address, table["limits"])
    return Cylinders(
        count=count,
        position=parse_address(table["position"]),
        setpoint=parse_address(table["setpoint"]),
        follows=tuple(_holds(row) for row in table["follows"]),
        warning=int(table["warning"]),
        error=parse_address(table["error"]),
        limits=(lower, upper),
        limited=_holds(table["limited"]),
        synchronous=_holds(table["synchronous"]),
        unit=parse_address(table["unit"]),
    )


def _holds(row: Mapping[str, Any]) -> Holds:
    return Holds(parse_address(row["address"]), tuple(map(int, row["values"])))
