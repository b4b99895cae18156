"""The use case: resolve the columns, and compare them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.model.diff.compare import Comparison, compare
from app.service.compare.sources import Columns, Pending, Shown


@dataclass(frozen=True, slots=True)
class Compared:
    """The columns in their order, and what differs between them."""

    columns: tuple[Shown, ...]
    comparison: Comparison


def compare_shown(shown: Sequence[Shown], everything: bool = False) -> Compared:
    """Compare columns that are there."""
    return Compared(tuple(shown), compare([one.column for one in shown], everything))


async def compare_columns(
    columns: Columns, specs: Sequence[str], pending: Pending | None = None, everything: bool = False
) -> Compared:
    """Compare what ``specs`` name. Raises ColumnError, which names the column, StoreError, SetFileError."""
    return compare_shown([await columns.resolve(spec, pending) for spec in specs], everything)
