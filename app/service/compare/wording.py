"""A comparison in words: titles of columns, values, states, and the one sentence that sums up."""

from __future__ import annotations

from typing import Final

from app.model.diff.bits import BitRow
from app.model.diff.column import Cell, CellState
from app.model.diff.compare import Row, RowState, Summary
from app.model.sets import iso_time
from app.model.texts import Texts
from app.service.compare.sources import Shown
from app.service.compare.spec import ColumnKind
from app.service.library.recovered import Seen
from app.service.records.view import visible

DASH: Final = "–"
_ALWAYS: Final = ("different", "same", "unit", "missing")
_WHERE_ANY: Final = ("not_comparable", "unread", "undescribed")


class Words:
    """Says it in one language."""

    def __init__(self, texts: Texts) -> None:
        self.texts = texts

    def sentence(self, summary: Summary) -> str:
        """``7 differ, 120 match, 2 bound to this unit, 0 not found``, and what else there is."""
        counts = {part: int(getattr(summary, part)) for part in (*_ALWAYS, *_WHERE_ANY)}
        return ", ".join(
            self.texts(
                f"page.compare.sum.{part}{'_one' if count == 1 else ''}",
                count=count,
                different=summary.undescribed_different,
            )
            for part, count in counts.items()
            if part in _ALWAYS or count
        )

    def source(self, shown: Shown) -> str:
        """``as left``, ``file pmc.json``."""
        source = self.texts(f"page.compare.source.{shown.spec.kind.value}")
        if shown.spec.kind in (ColumnKind.FILE, ColumnKind.SET):
            return f"{source} {visible(shown.spec.of)}"
        return source

    def title(self, shown: Shown) -> str:
        """``wtg-07/blade-2/pmc, as left``."""
        return f"{visible(shown.column.slug)}, {self.source(shown)}"

    def circumstances(self, shown: Shown) -> list[str]:
        """When, by whom, why, which content, and what it is of; each where it is known."""
        column = shown.column
        when = "" if shown.t_ns is None else iso_time(shown.t_ns)[:16].replace("T", " ") + " UTC"
        described = f"{column.description.id} {column.version}"
        digest = "" if shown.hash is None else f"sha256:{shown.hash[:16]}"
        twin = self.texts("compare.twin") if shown.twin else ""
        unread = "" if shown.complete else self.texts("compare.incomplete", count=len(column.unread))
        parts = (when, shown.person, shown.reason, described, digest, unread, twin)
        return [visible(part) for part in parts if part]

    def note(self, shown: Shown) -> str:
        """What must be known of a column to read it, in one sentence; empty where nothing must."""
        if shown.spec.kind is not ColumnKind.STORED:
            return ""
        known, unread = len(shown.column.values), len(shown.column.unread)
        return self.texts("compare.stored", known=known, all=known + unread)

    def value(self, cell: Cell) -> str:
        """A cell with its unit, or why there is no value."""
        if cell.state is not CellState.VALUE:
            return self.texts(f"page.compare.absence.{cell.state.value}")
        name = "" if cell.text_key is None else f" {self.texts(cell.text_key)}"
        return visible(f"{cell.shown} {cell.unit}".rstrip()) + name

    def seen(self, look: Seen) -> str:
        """``written 2026-03-04 14:03:21 UTC, by another master, before a restart``: of a value out of a recording."""
        time = f"{iso_time(look.t_ns)[:19].replace('T', ' ')} UTC"
        parts = [self.texts(f"page.sets.seen_{look.access.value}", time=time)]
        if not look.ours:
            parts.append(self.texts("page.sets.seen_foreign"))
        if look.doubt is not None:
            parts.append(self.texts(f"page.sets.doubt.{look.doubt.value.replace('-', '_')}"))
        return ", ".join(parts)

    def state(self, row: Row) -> str:
        """``differs``."""
        return self.texts(f"page.compare.row.{row.state.value}")

    def restore(self, row: Row) -> str:
        """The class, where it is worth a word that the state does not say already."""
        word = row.entry.restore.value
        return "" if word == "copy" or row.state is RowState.UNIT else self.texts(f"page.compare.class.{word}")

    def name(self, row: Row) -> str:
        """What the parameter is called."""
        return self.texts.name(row.entry.title)

    def group(self, row: Row) -> str:
        """The group that it belongs to."""
        return self.group_name(row.entry.group)

    def group_name(self, group: str) -> str:
        """What people call a group."""
        key = f"group.{group}"
        words = self.texts(key)
        return group if words == key else words

    def bit(self, bit: BitRow) -> str:
        """A bit with its clamp."""
        number = str(bit.bit) if bit.bit == bit.last else f"{bit.bit}..{bit.last}"
        name = self.texts("page.compare.bit_unnamed") if bit.text_key is None else self.texts(bit.text_key)
        clamp = f" ({bit.clamp})" if bit.clamp and bit.clamp not in name else ""
        return f"{self.texts('page.compare.bit', bit=number)}: {name}{clamp}"

    def bit_value(self, bit: BitRow, number: int | None) -> str:
        """On or off, or the number of a field of several bits."""
        if number is None:
            return DASH
        if bit.bit != bit.last:
            return str(number)
        return self.texts("page.compare.on" if number else "page.compare.off")


def rows_of(rows: tuple[Row, ...], same: bool) -> list[Row]:
    """What is told: the differences, or all."""
    return [row for row in rows if same or row.state is not RowState.SAME]
