"""One column of a comparison: what is known of one device at one instant, and one cell of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description, Quantity, QuantityRule
from app.model.set_head import NOT_IN_FILE
from app.model.set_vector import exact
from app.model.values import quantity_of, show, to_scaled


class CellState(Enum):
    """What a column has at an address.

    ``NOT_IN_SET``: nobody asked for it, as in a partial set. ``NOT_ON_DEVICE``: its description does not know it, or
    the device answered so. ``UNREAD``: it was asked for, or could be, and is not known. ``EMPTY``: read, no data in it.
    """

    VALUE = "value"
    NOT_IN_SET = "not-in-set"
    NOT_ON_DEVICE = "not-on-device"
    UNREAD = "unread"
    EMPTY = "empty"


_WHY_NOT: Final = {
    "abort 06020000h": CellState.NOT_ON_DEVICE,
    "abort 06090011h": CellState.NOT_ON_DEVICE,
    NOT_IN_FILE: CellState.NOT_IN_SET,
}
"""Reasons of a set for an unread object: no such object, no such sub-index (CiA 301, table 22), a partial file."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One value, ``shown`` without its unit; ``text_key`` where an enumeration names it, ``reason`` why not read."""

    state: CellState
    raw: Raw | None = None
    shown: str = ""
    unit: str = ""
    text_key: str | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Column:
    """Raw values of one device. ``version`` is that of the description that they were read by.

    ``description`` is what they are shown by: the same kind, perhaps of a later version.
    """

    slug: str
    description: Description
    version: str
    values: Mapping[Address, Raw]
    unread: Mapping[Address, str] = field(default_factory=dict)
    empty: frozenset[Address] = frozenset()

    def state(self, address: Address) -> CellState:
        """What there is at ``address``."""
        if address in self.values:
            return CellState.VALUE
        if address in self.empty:
            return CellState.EMPTY
        if address in self.unread:
            return _WHY_NOT.get(self.unread[address], CellState.UNREAD)
        return CellState.NOT_IN_SET if address in self.description.entries else CellState.NOT_ON_DEVICE

    def cell(self, address: Address) -> Cell:
        """The cell at ``address``, in the units that this column's own values give."""
        state = self.state(address)
        entry = self.description.entries.get(address)
        if state is not CellState.VALUE:
            return Cell(state, reason=self.unread.get(address, ""))
        raw = self.values[address]
        if entry is None:
            return Cell(state, raw, raw.hex(" ") if isinstance(raw, bytes) else str(raw))
        shown = show(entry, raw, self.values.get)
        scaled = to_scaled(entry, raw, self.values.get)
        unit = "" if scaled is None else scaled.unit
        return Cell(state, raw, shown, unit, self.description.name_key(entry, raw))

    def measure(self, address: Address) -> Measure:
        """By what a value at ``address`` is to be understood: only equal ones can be compared."""
        entry = self.description.entries.get(address)
        kind = self.description.id, self.version.partition(".")[0]
        if entry is None:
            return Measure(*kind)
        return Measure(*kind, entry.type.name, entry.quantity, _rule(entry.quantity_rule))

    def scale(self, address: Address) -> Quantity | None:
        """Unit and factor in force; None where they rest on nothing else, or on what is not known."""
        entry = self.description.entries.get(address)
        rule = None if entry is None else entry.quantity_rule
        if entry is None or rule is None:
            return None
        sources = [rule.address] if rule.shaft is None else [rule.address, rule.shaft]
        known = [self.values.get(source) for source in sources]
        if not all(isinstance(raw, int) and (raw or rule.shaft is None) for raw in known):
            return None
        return quantity_of(entry, self.values.get)

    def key(self, address: Address) -> str | bytes:
        """Equal where two values at ``address`` are equal."""
        raw = self.values[address]
        return raw if isinstance(raw, str | bytes) else exact(raw)


@dataclass(frozen=True, slots=True)
class Measure:
    """Kind of device, major version of its description, and type and unit of one object."""

    description_id: str
    major: str
    type: str = ""
    quantity: Quantity | None = None
    rule: tuple[object, ...] | None = None


def _rule(rule: QuantityRule | None) -> tuple[object, ...] | None:
    return None if rule is None else (rule.address, tuple(sorted(rule.choices.items())), rule.shaft)
