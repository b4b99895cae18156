"""Compare any number of columns, address by address.

The order of the columns changes nothing but the order of the cells: whether a row is the same, different or not to be
compared is a matter of all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from app.model.address import Address
from app.model.description import BitTable, Entry, RestoreClass
from app.model.diff.bits import BitRow, bit_rows
from app.model.diff.column import Cell, CellState, Column


class RowState(Enum):
    """What a row comes to; the first that holds counts.

    ``NOT_COMPARABLE``: another kind of device, major version, type or unit. ``UNIT``: values differ that are bound to
    the single unit. ``DIFFERENT``: values differ. ``MISSING``: those that are there are equal, and one is not there.
    """

    NOT_COMPARABLE = "not-comparable"
    UNIT = "unit"
    DIFFERENT = "different"
    MISSING = "missing"
    SAME = "same"


@dataclass(frozen=True, slots=True)
class Row:
    """One address. ``entry`` is that of the first column that knows it.

    ``rescaled``: the same raw value means another quantity in another column, because what its unit rests on differs.
    """

    entry: Entry
    state: RowState
    cells: tuple[Cell, ...]
    bits: tuple[BitRow, ...] = ()
    rescaled: bool = False

    @property
    def address(self) -> Address:
        """Where it is."""
        return self.entry.address


@dataclass(frozen=True, slots=True)
class Summary:
    """Rows by state; the five add up to all. ``unread``: rows of any state in which a value was not read.

    ``undescribed``: addresses in no row, at which a column has a value that its description does not know. So many of
    them as ``undescribed_different`` are not the same in every column.
    """

    different: int = 0
    same: int = 0
    unit: int = 0
    missing: int = 0
    not_comparable: int = 0
    unread: int = 0
    undescribed: int = 0
    undescribed_different: int = 0

    @property
    def rows(self) -> int:
        """All of them."""
        return self.different + self.same + self.unit + self.missing + self.not_comparable


@dataclass(frozen=True, slots=True)
class Comparison:
    """All rows, group by group as the description has them, and what they come to."""

    rows: tuple[Row, ...]
    summary: Summary


_NOWHERE: Final = (CellState.NOT_IN_SET, CellState.NOT_ON_DEVICE)


def compare(columns: Sequence[Column], everything: bool = False) -> Comparison:
    """Compare ``columns``: parameters only, or ``everything`` that can be read. What none of them has is no row."""
    rows = (_row(entry, columns) for entry in _entries(columns, everything))
    kept = tuple(row for row in rows if not all(cell.state in _NOWHERE for cell in row.cells))
    return Comparison(kept, _with_undescribed(summary_of(kept), kept, columns))


def summary_of(rows: Sequence[Row]) -> Summary:
    """Count ``rows``."""
    counts = {state: sum(row.state is state for row in rows) for state in RowState}
    return Summary(
        different=counts[RowState.DIFFERENT],
        same=counts[RowState.SAME],
        unit=counts[RowState.UNIT],
        missing=counts[RowState.MISSING],
        not_comparable=counts[RowState.NOT_COMPARABLE],
        unread=sum(any(cell.state is CellState.UNREAD for cell in row.cells) for row in rows),
    )


def _with_undescribed(summary: Summary, rows: Sequence[Row], columns: Sequence[Column]) -> Summary:
    """Nobody can say what stands there, only whether it is the same: it is counted, so that it is not passed over."""
    told = {row.address for row in rows}
    unknown = {address for one in columns for address in one.values if address not in one.description.entries} - told
    differ = sum(
        not all(address in one.values for one in columns) or len({one.key(address) for one in columns}) > 1
        for address in unknown
    )
    return replace(summary, undescribed=len(unknown), undescribed_different=differ)


def _entries(columns: Sequence[Column], everything: bool) -> list[Entry]:
    """What is compared: each address once, by the first description that has it, in the order of its groups."""
    found: dict[Address, tuple[int, int, Address, Entry]] = {}
    wanted: set[Address] = set()
    for number, column in enumerate(columns):
        groups = {group: place for place, group in enumerate(column.description.groups)}
        for entry in column.description:
            place = number, groups.get(entry.group, len(groups)), entry.address, entry
            found.setdefault(entry.address, place)
            if entry.access.readable and (everything or entry.is_parameter):
                wanted.add(entry.address)
    ordered = sorted((found[address] for address in wanted), key=lambda one: (one[0], one[1], one[2][:2]))
    return [entry for *_, entry in ordered]


def _row(entry: Entry, columns: Sequence[Column]) -> Row:
    address = entry.address
    cells = tuple(column.cell(address) for column in columns)
    valued = [column for column, cell in zip(columns, cells, strict=True) if cell.state is CellState.VALUE]
    if len({column.measure(address) for column in valued}) > 1:
        return Row(entry, RowState.NOT_COMPARABLE, cells)
    rescaled = len({scale for column in valued if (scale := column.scale(address)) is not None}) > 1
    state = _state(address, cells, valued, rescaled)
    return Row(entry, state, cells, bit_rows(_table(entry, columns), cells), rescaled)


def _table(entry: Entry, columns: Sequence[Column]) -> BitTable | None:
    """The names of the bits, from the first column that has this entry."""
    if entry.bits is None:
        return None
    owner = next(column for column in columns if column.description.entries.get(entry.address) is entry)
    return owner.description.bit_tables[entry.bits]


def _state(address: Address, cells: Sequence[Cell], valued: Sequence[Column], rescaled: bool) -> RowState:
    if len({column.key(address) for column in valued}) > 1 or rescaled:
        bound = all(_is_bound(column, address) for column in valued)
        return RowState.UNIT if bound else RowState.DIFFERENT
    if len(valued) == len(cells) or all(cell.state is CellState.EMPTY for cell in cells):
        return RowState.SAME
    return RowState.MISSING


def _is_bound(column: Column, address: Address) -> bool:
    """True where the column's own description binds it to the unit; what it does not know is not bound."""
    entry = column.description.entries.get(address)
    return entry is not None and entry.restore is RestoreClass.UNIT
