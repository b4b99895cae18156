"""Parameter sets as CSV: a table that spreadsheets open, and in again.

One row an object: address, name, raw value, value and unit as people read them. Only address and raw value are read
back; raw texts begin with ``text:``, or with ``json:`` where a character in them is not printable, raw bytes with
``hex:``, all else is a number. The head (see ``set_head``) stands in rows that begin with ``#``, with values that no
cell can hold. Separators are commas; semicolons and tabs are read too.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterator
from typing import Final

from app.errors import SetFileError, UsageError
from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.set_head import Imported, Taking, Value, head_of, with_head, without_head
from app.model.sets import INTEGERS, ParameterSet
from app.model.values import quantity_of, show

COLUMNS: Final = ("address", "name", "raw", "value", "unit")
_HEAD: Final = "#hubside-set"
_CHUNK: Final = 1000
_LONGEST: Final = 100_000
"""Characters of a raw value in a cell: readers of CSV, Python's too, take a longer one for damage."""
_TEXT, _JSON, _HEX = "text:", "json:", "hex:"
_INTEGER: Final = re.compile(r"-?[0-9]{1,30}|-?0[xX][0-9A-Fa-f]{1,16}", re.ASCII)
_FLOAT: Final = re.compile(
    r"-?[0-9]{1,30}\.[0-9]{1,30}([eE][-+]?[0-9]{1,3})?|-?[0-9]{1,30}[eE][-+]?[0-9]{1,3}", re.ASCII
)
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")


def dump_csv(parameters: ParameterSet, description: Description | None) -> str:
    """The set as CSV; without ``description`` there are no names and units."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    others = {address: raw for address, raw in parameters.values.items() if len(_raw_text(raw)) > _LONGEST}
    head = head_of(parameters, others)
    for start in range(0, len(head), _CHUNK):
        writer.writerow((_HEAD, head[start : start + _CHUNK]))
    writer.writerow(COLUMNS)
    for address in sorted(parameters.values, key=lambda one: one[:2]):
        if address not in others:
            writer.writerow(_row(parameters, address, description))
    return out.getvalue()


def csv_name(parameters: ParameterSet) -> str:
    """File name of a set's CSV."""
    return f"{parameters.origin.device.replace('/', '_')}.csv"


def load_csv(text: str, file: str, taking: Taking) -> Imported:
    """Read a CSV. Raises SetFileError with line and reason; every row must be understood."""
    text = text.removeprefix("\ufeff")
    values: dict[Address, Value] = {}
    head: list[str] = []
    head_line = 1
    columns: list[str] | None = None
    for line, row in _rows(text, file):
        if row[0] == _HEAD:
            head_line = head_line if head else line
            head.append(row[1] if len(row) > 1 else "")
        elif columns is None:
            columns = _columns(row, file, line)
        elif any(row[len(columns) :]):  # such as a comma in a number: the wrong cell would be the raw value
            raise SetFileError(file=file, line=line, reason="the row has more cells than there are columns")
        else:
            address, value = _value(dict(zip(columns, row, strict=False)), file, line)
            if address in values:
                raise SetFileError(file=file, line=line, reason=f"{address} stands there twice")
            values[address] = value
    if head and not taking.as_values:
        return Imported(with_head("".join(head), values, file, head_line))
    if not values:
        raise SetFileError(file=file, line=1, reason="it holds no values")
    return without_head(values, taking, file, None)


def _row(parameters: ParameterSet, address: Address, description: Description | None) -> tuple[str, ...]:
    raw = parameters.values[address]
    entry = None if description is None else description.entries.get(address)
    if entry is None:
        return str(address), "", _raw_text(raw), "", ""
    lookup = parameters.values.get
    number = not isinstance(raw, str | bytes)
    fits = entry.type.is_integer == isinstance(raw, int)
    shown = show(entry, raw, lookup) if fits or not number else str(raw)
    unit = quantity_of(entry, lookup).unit if number and entry.bits is None else ""
    return str(address), _harmless(entry.title), _raw_text(raw), shown if number else _harmless(_visible(shown)), unit


def _raw_text(raw: Raw) -> str:
    if isinstance(raw, bytes):
        return f"{_HEX}{raw.hex()}"
    if isinstance(raw, str):
        return f"{_TEXT}{raw}" if raw.isprintable() else f"{_JSON}{json.dumps(raw)}"
    return repr(raw)


def _visible(text: str) -> str:
    """What is not printable, by its code: a zero byte, say, would make the file none."""
    return text if text.isprintable() else json.dumps(text)[1:-1]


def _harmless(text: str) -> str:
    """Not a formula for a spreadsheet."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def _rows(text: str, file: str) -> Iterator[tuple[int, list[str]]]:
    """Rows with something in them, each with the line in which it begins."""
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise SetFileError(file=file, line=line, reason="a zero byte: this is no text")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=_delimiter(text), strict=True)
    try:
        line = 1
        for row in reader:
            if any(cell.strip() for cell in row):
                yield line, [cell if cell.startswith(_TEXT) else cell.strip() for cell in row]
            line = reader.line_num + 1
    except csv.Error as error:
        raise SetFileError(file=file, line=reader.line_num or 1, reason=f"no valid CSV: {error}") from error


def _delimiter(text: str) -> str:
    """The character behind the first word."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    found = re.search(r"[,;\t]", first)
    return found[0] if found else ","


def _columns(row: list[str], file: str, line: int) -> list[str]:
    columns = [cell.lower() for cell in row]
    for name in ("address", "raw"):
        if columns.count(name) != 1:
            raise SetFileError(file=file, line=line, reason=f"no column '{name}': this is no table of parameters")
    return columns


def _value(row: dict[str, str], file: str, line: int) -> tuple[Address, Value]:
    try:
        address = parse_address(row.get("address", ""))
    except UsageError as error:
        raise SetFileError(file=file, line=line, reason=str(error.details["reason"])) from error
    if "raw" not in row:
        raise SetFileError(file=file, line=line, reason=f"{address} has no raw value: the row ends too early")
    try:
        raw = _raw(row["raw"])
    except ValueError as error:
        reason = f"'{row['raw'][:60]}' is no raw value of {address}"
        raise SetFileError(file=file, line=line, reason=reason) from error
    return address, Value(raw, line, row.get("name", ""))


def _raw(text: str) -> Raw:
    """The value of a cell. Raises ValueError where it is none, or one that no type holds."""
    if text.startswith(_TEXT):
        return text.removeprefix(_TEXT)
    if text.startswith(_JSON):
        return _json_text(text.removeprefix(_JSON))
    if text.startswith(_HEX):
        return bytes.fromhex(text.removeprefix(_HEX))
    if _INTEGER.fullmatch(text):
        number = int(text, 0 if "x" in text.lower() else 10)
        if number in INTEGERS:
            return number
    elif _FLOAT.fullmatch(text) and math.isfinite(float(text)):
        return float(text)
    raise ValueError(text)


def _json_text(text: str) -> str:
    try:
        found = json.loads(text)
    except RecursionError as error:
        raise ValueError(text[:40]) from error
    if not isinstance(found, str):
        raise ValueError(text)
    found.encode()  # half a character is none: UnicodeEncodeError is a ValueError
    return found
