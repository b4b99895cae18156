"""Masks bit by bit, with the names and clamps that the description gives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.model.description import Bit, BitTable
from app.model.diff.column import Cell


@dataclass(frozen=True, slots=True)
class BitRow:
    """One bit, or one field of bits, in all columns; None where a column has no number there.

    ``text_key`` None: no table names the bit, and it is told because it is set somewhere.
    """

    bit: int
    last: int
    text_key: str | None
    clamp: str
    values: tuple[int | None, ...]

    @property
    def differs(self) -> bool:
        """True where two columns have it otherwise."""
        return len({value for value in self.values if value is not None}) > 1


def bit_rows(table: BitTable | None, cells: Sequence[Cell]) -> tuple[BitRow, ...]:
    """The bits that ``table`` names, then those that are set without a name. None where there is no table."""
    if table is None:
        return ()
    numbers = [cell.raw if isinstance(cell.raw, int) else None for cell in cells]
    named = [_row(bit, numbers) for bit in sorted(table.bits, key=lambda one: one.bit)]
    known = sum(bit.mask for bit in table.bits)
    others = 0
    for number in numbers:
        others |= 0 if number is None else number & ~known & 0xFFFF_FFFF_FFFF_FFFF
    unnamed = [_row(Bit(bit, "", ""), numbers) for bit in range(others.bit_length()) if others >> bit & 1]
    return tuple(named + unnamed)


def _row(bit: Bit, numbers: Sequence[int | None]) -> BitRow:
    values = tuple(None if number is None else (number & bit.mask) >> bit.bit for number in numbers)
    last = bit.bit if bit.last is None else bit.last
    return BitRow(bit.bit, last, bit.text_key or None, bit.clamp, values)
