"""A signature: what is looked for in recordings, as a tree. Immutable; ``str`` gives its text."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from app.model.address import Address
from app.wire.signs import SignKind

NS_PER_S: Final = 1_000_000_000


class Special(Enum):
    """Events that are no single sign."""

    TRIP = "trip"
    ERROR = "error"
    """Any sign of severity error."""
    WARNING = "warning"


class Comparison(Enum):
    """How a value is compared."""

    ABOVE = ">"
    FROM = ">="
    BELOW = "<"
    UP_TO = "<="
    EQUAL = "="
    OTHER = "!="


class Order(Enum):
    """How two things follow each other."""

    BEFORE = "before"
    """The left one not longer than the time before the right one."""
    THEN = "then"
    """The right one after the left one, within the time."""
    WITHOUT = "without"
    """The left one, and within the time after it no right one."""


class Same(Enum):
    """What both sides of a pair must have in common."""

    NODE = "node"
    BLADE = "blade"


@dataclass(frozen=True, slots=True)
class Scope:
    """Where: None means anywhere. ``device`` is the last part of a slug: pmm, pmc."""

    blade: int | None = None
    node: int | None = None
    device: str | None = None
    bus: str | None = None

    def __str__(self) -> str:
        parts = [
            None if self.blade is None else f"blade {self.blade}",
            None if self.node is None else f"node {self.node}",
            self.device,
            None if self.bus is None else f"bus {self.bus}",
        ]
        told = " ".join(part for part in parts if part)
        return f" on {told}" if told else ""


ANYWHERE: Final = Scope()


@dataclass(frozen=True, slots=True)
class EventIs:
    """A sign of this kind (or a trip, any error, any warning); ``code`` of an emergency message or error code.

    ``ended``: the end of the condition, not its begin.
    """

    kind: SignKind | Special
    code: int | None = None
    scope: Scope = ANYWHERE
    ended: bool = False

    def __str__(self) -> str:
        code = "" if self.code is None else f" {self.code:04X}"
        return f"{'ended ' if self.ended else ''}{self.kind.value}{code}{self.scope}"


@dataclass(frozen=True, slots=True)
class Level:
    """A signal on one side of a number for at least ``lasting_ns``. ``number`` is scaled, in ``unit`` where given.

    ``amount``: the value without its sign.
    """

    address: Address
    comparison: Comparison
    number: float
    unit: str = ""
    lasting_ns: int = 0
    amount: bool = False
    scope: Scope = ANYWHERE

    def __str__(self) -> str:
        name = f"|{self.address.short}|" if self.amount else self.address.short
        lasting = f" for {lasting_text(self.lasting_ns)}" if self.lasting_ns else ""
        unit = f" {_ASCII_UNITS.get(self.unit, self.unit)}" if self.unit else ""
        return f"{name} {self.comparison.value} {self.number:g}{unit}{lasting}{self.scope}"


@dataclass(frozen=True, slots=True)
class Pair:
    """Two things in an order, ``within_ns`` of each other."""

    left: Query
    order: Order
    right: Query
    within_ns: int
    same: Same | None = None

    def __str__(self) -> str:
        left, right = _inner(self.left), _inner(self.right, right=True)
        same = f" on same {self.same.value}" if self.same else ""
        within = f"within {lasting_text(self.within_ns)}"
        if self.order is Order.BEFORE:
            return f"{left} {within} before {right}{same}"
        return f"{left} {self.order.value} {right} {within}{same}"


@dataclass(frozen=True, slots=True)
class All:
    """Each of these somewhere in the recording."""

    parts: tuple[Query, ...]

    def __str__(self) -> str:
        return " and ".join(f"({part})" if isinstance(part, Any) else str(part) for part in self.parts)


@dataclass(frozen=True, slots=True)
class Any:
    """At least one of these."""

    parts: tuple[Query, ...]

    def __str__(self) -> str:
        return " or ".join(str(part) for part in self.parts)


@dataclass(frozen=True, slots=True)
class Not:
    """Nowhere in the recording."""

    part: Query

    def __str__(self) -> str:
        return f"not {_inner(self.part)}"


Query = EventIs | Level | Pair | All | Any | Not

_ASCII_UNITS: Final = {"°": "deg", "°C": "degC", "°/s": "deg/s", "°/s²": "deg/s2", "mΩ": "mOhm"}
UNITS: Final = {text: unit for unit, text in _ASCII_UNITS.items()} | {"°/s2": "°/s²"}
"""Units as they are typed, by those of the descriptions."""


def lasting_text(time_ns: int) -> str:
    """A time as the search text has it."""
    if time_ns % NS_PER_S == 0:
        return f"{time_ns // NS_PER_S} s"
    return f"{time_ns / 1e6:g} ms"


def with_scope(query: EventIs | Level, scope: Scope) -> EventIs | Level:
    """The same somewhere else."""
    return replace(query, scope=scope)


def _inner(query: Query, right: bool = False) -> str:
    """In brackets where it would be read differently otherwise."""
    loose = isinstance(query, All | Any | Not) or (right and isinstance(query, Pair))
    return f"({query})" if loose else str(query)
