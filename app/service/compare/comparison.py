"""The use case: resolve the columns, and compare them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.model.diff.compare import Comparison, compare
from app.service.compare.findings import Findings, findings_of
from app.service.compare.sources import Columns, Pending, Shown


@dataclass(frozen=True, slots=True)
class Compared:
    """The columns in their order, what differs between them, and which rules their values break."""

    columns: tuple[Shown, ...]
    comparison: Comparison
    findings: Findings


async def compare_shown(
    columns: Columns, shown: Sequence[Shown], pending: Pending | None = None, everything: bool = False
) -> Compared:
    """Compare columns that are there."""
    compared = compare([one.column for one in shown], everything)
    return Compared(tuple(shown), compared, await findings_of(columns, shown, pending))


async def compare_columns(
    columns: Columns, specs: Sequence[str], pending: Pending | None = None, everything: bool = False
) -> Compared:
    """Compare what ``specs`` name. Raises ColumnError, which names the column, StoreError, SetFileError."""
    return await compare_shown(columns, [await columns.resolve(spec, pending) for spec in specs], pending, everything)
