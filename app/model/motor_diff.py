"""Two motors beside each other, or a motor and what a device holds: which parameters and plate fields differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from enum import Enum

from app.model.address import Address
from app.model.description import Description
from app.model.motor import PLATE_FIELDS, Plate, PlateField, entries_of, is_of_the_machine


class RowState(Enum):
    """How the two sides of a row stand to each other."""

    DIFFERENT = "different"
    SAME = "same"
    MISSING = "missing"
    """One side does not say; nothing is known."""
    UNIT = "unit"
    """Belongs to one machine: the two may differ and be right."""


@dataclass(frozen=True, slots=True)
class ValueRow:
    """One parameter; None where that side does not hold it."""

    address: Address
    state: RowState
    left: int | None
    right: int | None


@dataclass(frozen=True, slots=True)
class PlateRow:
    """One field of the plate; None where that side says nothing."""

    field: PlateField
    state: RowState
    left: Decimal | str | None
    right: Decimal | str | None


def compare_values(
    description: Description, left: Mapping[Address, int], right: Mapping[Address, int]
) -> list[ValueRow]:
    """Every parameter of a motor, in the order of the manual. What neither side holds is left out."""
    rows = []
    for entry in entries_of(description):
        pair = left.get(entry.address), right.get(entry.address)
        if pair != (None, None):
            state = RowState.UNIT if is_of_the_machine(entry) else _state(*pair)
            rows.append(ValueRow(entry.address, state, *pair))
    return rows


def compare_plates(left: Plate, right: Plate) -> list[PlateRow]:
    """Every field of the plate of which a side says something."""
    rows = []
    for one in PLATE_FIELDS:
        pair = getattr(left, one.name) or None, getattr(right, one.name) or None
        if pair != (None, None):
            rows.append(PlateRow(one, _state(*pair), *pair))
    return rows


def _state(left: object | None, right: object | None) -> RowState:
    if left is None or right is None:
        return RowState.MISSING
    return RowState.SAME if left == right else RowState.DIFFERENT
