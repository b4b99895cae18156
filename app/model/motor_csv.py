"""Motors as CSV: one row a motor, its plate, and its parameters as they are shown, with their units in the head.

Read with comma or semicolon, decimal point or comma, as spreadsheets write it. A file is taken whole or not at all.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Any, Final
from uuid import UUID

from app.errors import MotorFieldError, MotorFileError, UsageError
from app.model.address import Address, parse_address
from app.model.description import Description, Entry
from app.model.motor import PLATE_FIELDS, Draft, Motor, Plate, PlateField, Source, checked, entries_of, parse_value
from app.model.values import quantity_of, show

ID: Final = "id"
SOURCE: Final = "source"
_BEFORE: Final = (ID, "maker", "type", SOURCE)
_AFTER: Final = ("remarks",)
_NEEDED: Final = ("maker", "type")
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")
_MARK: Final = "\ufeff"
UUID_VERSION: Final = 7


@dataclass(frozen=True, slots=True)
class FileRow:
    """One motor of a file. ``id`` None: it has none yet. ``invented``: the file says that it is an example."""

    line: int
    id: str | None
    draft: Draft
    invented: bool


def write_motors(description: Description, motors: Iterable[Motor]) -> str:
    """The motors as a CSV file, in the order given."""
    entries = list(entries_of(description))
    made = io.StringIO()
    writer = csv.writer(made)
    writer.writerow((*_BEFORE, *map(_plate_head, PLATE_FIELDS), *map(_head, entries), *_AFTER))
    for motor in motors:
        draft = motor.draft
        writer.writerow(
            _harmless(cell)
            for cell in (
                motor.id,
                draft.maker,
                draft.type,
                motor.source.value,
                *(_plain(getattr(draft.plate, one.name)) for one in PLATE_FIELDS),
                *(_shown(description, entry, draft.values) for entry in entries),
                draft.remarks,
            )
        )
    return made.getvalue()


def _plate_head(one: PlateField) -> str:
    return f"{one.name} [{one.unit}]" if one.unit else one.name


def _head(entry: Entry) -> str:
    unit = _unit(entry)
    return f"{entry.address.short} {entry.title}" + (f" [{unit}]" if unit else "")


def _plain(found: Decimal | str | None) -> str:
    return "" if found is None else str(found)


def _shown(description: Description, entry: Entry, values: Mapping[Address, int]) -> str:
    raw = values.get(entry.address)
    if raw is None:
        return ""
    if entry.enumeration is not None:
        named = description.enumerations[entry.enumeration].by_value(raw)
        if named is not None:
            return named.name
    return show(entry, raw, values.get)


def _harmless(cell: str) -> str:
    """What a spreadsheet would take for a formula is kept from it by an apostrophe; so is an apostrophe of its own."""
    return f"'{cell}" if cell.startswith(("'", *_FORMULA)) else cell


def read_motors(description: Description, data: bytes, file: str) -> list[FileRow]:
    """The motors of a file. Raises MotorFileError, which names line, column and reason of the first that is wrong."""
    text = _decoded(data, file)
    first = text.split("\n", 1)[0]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=";" if first.count(";") > first.count(",") else ",")
    lines = _lines(reader, file)
    _line, head = next(lines, (1, []))
    columns = _Columns(description, head, file)
    rows = [columns.row(line, cells) for line, cells in lines if any(cells)]
    _each_id_once(rows, file)
    columns.check_whole(rows)
    return rows


def _each_id_once(rows: Iterable[FileRow], file: str) -> None:
    seen: dict[str, int] = {}
    for row in rows:
        if row.id is not None:
            if row.id in seen:
                first = seen[row.id]
                raise MotorFileError(file=file, line=row.line, column=ID, reason_key="motor.file.twice", first=first)
            seen[row.id] = row.line


def _decoded(data: bytes, file: str) -> str:
    try:
        return data.decode("utf-8").removeprefix(_MARK)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise MotorFileError(file=file, line=line, column="–", reason_key="motor.file.encoding") from error


def _lines(reader: Any, file: str) -> Iterator[tuple[int, list[str]]]:
    """Each row with the line on which it begins."""
    line = 1
    while True:
        try:
            cells = next(reader, None)
        except csv.Error as error:
            raise MotorFileError(file=file, line=line, column="–", reason_key="motor.file.no_csv") from error
        if cells is None:
            return
        yield line, [cell.strip() for cell in cells]
        line = reader.line_num + 1


class _Columns:
    """What each column of a file is. Raises MotorFileError."""

    def __init__(self, description: Description, head: list[str], file: str) -> None:
        self._description = description
        self._file = file
        self._plate = {one.name: one for one in PLATE_FIELDS}
        self._entries = {entry.address.short: entry for entry in entries_of(description)}
        self._titles: dict[str, str] = {}
        for title in head:
            key = self._key(title)
            if key in self._titles:
                raise self._error(1, title, "motor.file.column_twice")
            self._titles[key] = title
        for name in _NEEDED:
            if name not in self._titles:
                raise self._error(1, name, "motor.file.no_column")

    def row(self, line: int, cells: list[str]) -> FileRow:
        """One motor, checked as one that is typed."""
        if len(cells) != len(self._titles):
            raise self._error(line, "–", "motor.file.count", count=len(cells), expected=len(self._titles))
        by_key = {key: _unmarked(cell) for key, cell in zip(self._titles, cells, strict=True)}
        source = by_key.get(SOURCE, "")
        if source not in ("", *(one.value for one in Source)):
            raise self._error(line, SOURCE, "motor.file.source")
        draft = Draft(
            by_key["maker"],
            by_key["type"],
            Plate(**{name: self._plate_cell(line, one, by_key.get(name, "")) for name, one in self._plate.items()}),
            dict(self._values(line, by_key)),
            by_key.get("remarks", ""),
        )
        try:
            draft = checked(self._description, draft)
        except MotorFieldError as error:
            raise self._of(line, error) from error
        return FileRow(line, self._id(line, by_key.get(ID, "")), draft, source == Source.EXAMPLE.value)

    def check_whole(self, rows: Iterable[FileRow]) -> None:
        """A row with an id is the next version of a motor: what has no column would be dropped from it, unseen.

        Examples have no further version.
        """
        missing = next((key for key in (*self._plate, *self._entries, *_AFTER) if key not in self._titles), None)
        known = next((row for row in rows if row.id is not None and not row.invented), None)
        if missing is not None and known is not None:
            raise self._error(known.line, missing, "motor.file.drops")

    def _key(self, title: str) -> str:
        """Field, or address of the parameter, that a column holds; its unit, where one is named, must be ours."""
        name, _, rest = title.partition(" [")
        if name in (*_BEFORE, *_AFTER):
            return name
        key, ours = self._plate_key(name) or self._address_key(name) or (None, "")
        if key is None:
            raise self._error(1, title or "–", "motor.file.unknown_column")
        unit = rest.removesuffix("]")
        if unit and unit != ours:
            raise self._error(1, title, "motor.file.unit", unit=ours or "–")
        return key

    def _plate_key(self, name: str) -> tuple[str, str] | None:
        return (name, self._plate[name].unit) if name in self._plate else None

    def _address_key(self, name: str) -> tuple[str, str] | None:
        try:
            key = parse_address(name.split(" ", 1)[0]).short
        except UsageError:
            return None
        return (key, _unit(self._entries[key])) if key in self._entries else None

    def _plate_cell(self, line: int, one: PlateField, cell: str) -> Any:
        if one.is_text:
            return cell
        try:
            return Decimal(cell.replace(",", ".")) if cell else None
        except InvalidOperation as error:
            raise self._error(line, self._titles[one.name], "motor.file.no_number") from error

    def _values(self, line: int, cells: Mapping[str, str]) -> Iterator[tuple[Address, int]]:
        for key, entry in self._entries.items():
            if cells.get(key):
                try:
                    yield entry.address, parse_value(self._description, entry, cells[key])
                except MotorFieldError as error:
                    raise self._of(line, error) from error

    def _id(self, line: int, text: str) -> str | None:
        if not text:
            return None
        try:
            found = UUID(text)
        except ValueError as error:
            raise self._error(line, ID, "motor.file.id") from error
        if found.version != UUID_VERSION:
            raise self._error(line, ID, "motor.file.id")
        return str(found)

    def _of(self, line: int, error: MotorFieldError) -> MotorFileError:
        """A flaw of a motor, at its place in the file."""
        key = str(error.details["field"])
        at = {"file": self._file, "line": line, "column": self._titles.get(key, key)}
        return MotorFileError(**{**error.details, **at})

    def _error(self, line: int, column: str, reason_key: str, **details: Any) -> MotorFileError:
        return MotorFileError(file=self._file, line=line, column=column, reason_key=reason_key, **details)


def _unit(entry: Entry) -> str:
    return quantity_of(entry, lambda _address: None).unit


def _unmarked(cell: str) -> str:
    """Without the apostrophe that ``_harmless`` put before it."""
    return cell[1:] if cell.startswith("'") and cell[1:].startswith(("'", *_FORMULA)) else cell
