"""A comparison as the command line tells it: as text, and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from app.cli.output import Output
from app.cli.sets_seen import mark, tell_legend
from app.model.diff.column import Cell
from app.model.diff.compare import Row, RowState
from app.service.compare.comparison import Compared
from app.service.compare.wording import Words, rows_of
from app.service.library.recovered import Seen
from app.service.views import raw_to_json

_MATTER: Final = (RowState.DIFFERENT, RowState.MISSING, RowState.NOT_COMPARABLE)


def matters(compared: Compared) -> bool:
    """True where a value differs that must not, is missing, or cannot be compared."""
    rows, summary = compared.comparison.rows, compared.comparison.summary
    return bool(summary.undescribed_different) or any(row.state in _MATTER for row in rows)


def tell_text(output: Output, compared: Compared, words: Words, same: bool) -> None:
    """Columns with their circumstances, a table of the rows, broken rules, and the sentence that sums up."""
    for number, one in enumerate(compared.columns, 1):
        output.line(f"({number}) {words.title(one)}: {', '.join(words.circumstances(one))}")
        if note := words.note(one):
            output.line(f"    {note}")
    rows = rows_of(compared.comparison.rows, same)
    if rows:
        head = ("ADDRESS", "NAME", "STATE", *(f"({number + 1})" for number in range(len(compared.columns))))
        table = [(row.address.short, words.name(row), words.state(row), *_cells(row, compared, words)) for row in rows]
        output.table(head, table)
    for one in compared.columns:
        if one.seen:
            tell_legend(output, one.recording)
    for line in _findings(compared, words):
        output.line(line)
    output.line(words.sentence(compared.comparison.summary))


def _cells(row: Row, compared: Compared, words: Words) -> Iterator[str]:
    """The values, each with its mark where it comes out of a recording."""
    for cell, one in zip(row.cells, compared.columns, strict=True):
        look = one.seen.get(row.address)
        yield words.value(cell) + ("" if look is None else f"  [{mark(look)}]")


def _findings(compared: Compared, words: Words) -> Iterator[str]:
    for row in compared.comparison.rows:
        for rule, numbers in compared.findings.get(row.address, {}).items():
            which = " ".join(f"({number + 1})" for number in numbers)
            yield f"! {row.address.short} {which}: {words.texts(f'rule.{rule}.title')}"


def compared_json(compared: Compared, words: Words, same: bool) -> dict[str, Any]:
    """The same for machines."""
    summary = compared.comparison.summary
    return {
        "columns": [
            {
                "spec": str(one.spec),
                "device": one.column.slug,
                "t_ns": one.t_ns,
                "hash": one.hash,
                "twin": one.twin,
                "recording": one.recording or None,
                "note": words.note(one) or None,
            }
            for one in compared.columns
        ],
        "summary": {name: getattr(summary, name) for name in summary.__dataclass_fields__},
        "sentence": words.sentence(summary),
        "rows": [
            {
                "address": row.address.short,
                "name": row.entry.title,
                "state": row.state.value,
                "class": row.entry.restore.value,
                "cells": [
                    _cell_json(cell, one.seen.get(row.address))
                    for cell, one in zip(row.cells, compared.columns, strict=True)
                ],
                "findings": list(compared.findings.get(row.address, {})),
            }
            for row in rows_of(compared.comparison.rows, same)
        ],
    }


def _cell_json(cell: Cell, look: Seen | None) -> dict[str, Any]:
    """``seen`` null: the value comes out of no recording."""
    return {
        "state": cell.state.value,
        "raw": None if cell.raw is None else raw_to_json(cell.raw),
        "shown": cell.shown,
        "unit": cell.unit,
        "seen": None if look is None else look.as_json(),
    }
