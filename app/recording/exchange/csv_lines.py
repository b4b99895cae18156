"""CSV: the seven columns of python-can in the common style, all that a frame has in the exact one.

python-can's own writer gives neither bus nor direction, and its data are base64. Times have nine decimals here, which
its reader takes.
"""

from __future__ import annotations

import base64
import binascii
import csv
import io
import re
from collections.abc import Iterable, Iterator
from decimal import Decimal, InvalidOperation
from typing import Final

from app.recording.cdr import MAX_DATA, MAX_DLC, MAX_ID, NS, make_can
from app.recording.exchange.formats import ONE_BUS, Head, Style
from app.recording.exchange.lines import BadLineError, Notes, Other, hex_bytes, number_of, seconds_text
from app.wire.frame import Can, Direction, Frame

COMMON: Final = ("timestamp", "arbitration_id", "extended", "remote", "error", "dlc", "data")
EXACT: Final = ("t_ns", "bus", "direction", "can_id", "extended", "remote", "error", "dlc", "data")
_PLAIN_HEX: Final = re.compile(r"(?:0x)?([0-9A-Fa-f]{1,8})$", re.ASCII)
_MAX_EXPONENT: Final = 12


class CsvParser:
    """Reads either table; the first line says which it is."""

    expects = "exchange.expects.csv"

    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        self._columns: tuple[str, ...] | None = None

    def parse(self, line: str) -> Frame | None:
        """The frame of a row; None for the head of the table. Raises BadLineError."""
        row = _row(line)
        if self._columns is None:
            columns = tuple(cell.strip() for cell in row)
            if columns not in (COMMON, EXACT):
                raise BadLineError("the first line names none of the two sets of columns")
            self._columns = columns
            return None
        if len(row) != len(self._columns):
            raise BadLineError(f"{len(row)} columns in place of {len(self._columns)}")
        return self._common(row) if self._columns == COMMON else _exact(row)

    def _common(self, row: list[str]) -> Frame | None:
        time, identifier, extended, remote, error, dlc_text, data_text = row
        dlc = number_of(dlc_text.strip(), 10, 64, "length")
        try:
            data = base64.b64decode(data_text, validate=True)
        except (binascii.Error, ValueError):
            raise BadLineError("the data are no base64") from None
        if len(data) > MAX_DATA:
            self._notes.other[Other.CAN_FD] += 1
            return None
        return Frame(_time_ns(time), ONE_BUS, Direction.RX, _can(identifier, extended, remote, error, dlc, data))


def _exact(row: list[str]) -> Frame:
    t_ns, bus, direction, identifier, extended, remote, error, dlc, data = row
    try:
        way = Direction(direction)
    except ValueError:
        raise BadLineError(f"{direction[:20]!r} is no direction (rx, tx)") from None
    if not bus:
        raise BadLineError("no bus is named")
    can = _can(identifier, extended, remote, error, number_of(dlc, 10, MAX_DLC, "length"), hex_bytes(data))
    return Frame(number_of(t_ns, 10, 1 << 63, "time"), bus, way, can)


def _row(line: str) -> list[str]:
    try:
        return next(csv.reader([line], strict=True), [])
    except csv.Error as error:
        raise BadLineError(str(error)) from None


def _can(identifier: str, extended: str, remote: str, error: str, dlc: int, data: bytes) -> Can:
    match = _PLAIN_HEX.match(identifier)
    if match is None or int(match[1], 16) > MAX_ID:
        raise BadLineError(f"{identifier[:20]!r} is no identifier")
    is_remote = _flag(remote)
    if dlc > MAX_DLC or (not is_remote and len(data) != min(dlc, MAX_DATA)):
        raise BadLineError("length and data do not agree")
    return make_can(int(match[1], 16), data, _flag(extended), is_remote, _flag(error), dlc)


def _flag(text: str) -> bool:
    if text not in ("0", "1"):
        raise BadLineError(f"{text[:20]!r} is neither 0 nor 1")
    return text == "1"


def _time_ns(text: str) -> int:
    """Seconds as ``repr(float)`` writes them, exponents too."""
    try:
        seconds = Decimal(text)
        if not seconds.is_finite() or not 0 <= seconds.adjusted() + 30 <= 30 + _MAX_EXPONENT or seconds < 0:
            raise BadLineError(f"{text[:20]!r} is no time")
        return int(seconds * NS)
    except (InvalidOperation, ValueError):
        raise BadLineError(f"{text[:20]!r} is no time") from None


def csv_lines(_head: Head, frames: Iterable[Frame], style: Style) -> Iterator[str]:
    """The lines of frames that are ``held``, each with its end; the first names the columns."""
    yield ",".join(COMMON if style is Style.COMMON else EXACT) + "\n"
    for frame in frames:
        can = frame.payload
        if isinstance(can, Can):
            yield _common_line(frame, can) if style is Style.COMMON else _exact_line(frame, can)


def _common_line(frame: Frame, can: Can) -> str:
    data = base64.b64encode(can.data).decode()
    flags = f"{can.extended:d},{can.remote:d},{can.error:d}"
    return f"{seconds_text(frame.t_ns, 9)},{can.can_id:#x},{flags},{can.length},{data}\n"


def _exact_line(frame: Frame, can: Can) -> str:
    bus = frame.bus if re.fullmatch(r"[\w.-]+", frame.bus) else _quoted(frame.bus)
    flags = f"{can.extended:d},{can.remote:d},{can.error:d}"
    identifier = f"{can.can_id:#x},{flags},{can.length},{can.data.hex()}"
    return f"{frame.t_ns},{bus},{frame.direction.value},{identifier}\n"


def _quoted(text: str) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="").writerow([text])
    return out.getvalue()
