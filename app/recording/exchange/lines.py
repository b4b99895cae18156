"""What all text formats share: a file line by line, what is wrong with a line, numbers without a float between.

A float of seconds since 1970 has steps of 238 ns, so times are read and written as integers of ns.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from app.errors import ForeignFileError
from app.recording.cdr import MAX_DATA, MAX_ID, NS
from app.recording.exchange.formats import MAX_STANDARD_ID, Head
from app.wire.frame import Frame

MAX_LINE: Final = 4096  # bytes; longer than any line of any of the formats, shorter than a file without line ends
MAX_LISTED: Final = 100
_SHOWN: Final = 80
_DECIMAL: Final = re.compile(r"(\d{1,12})(?:\.(\d*))?$")


class BadLineError(ValueError):
    """A line that a format does not have. The argument is what is wrong; the reader adds file and line."""


class Other(Enum):
    """What stands in files and is no classic CAN frame. The value ends the text key ``exchange.other.<value>``."""

    CAN_FD = "can_fd"
    STATUS = "status"
    REQUEST = "request"


class Skipped(NamedTuple):
    """A line that was left out: its number and how it begins."""

    line: int
    text: str


@dataclass
class Notes:
    """What was found in a file beside its frames.

    ``skipped`` lists the first hundred of ``skipped_lines``; ``truncated`` is the line or byte at which the file ends
    inside something; ``head`` is what a file of ours says of itself; ``wall_known``: the file tells when it began.
    """

    other: Counter[Other] = field(default_factory=Counter)
    skipped: list[Skipped] = field(default_factory=list)
    skipped_lines: int = 0
    truncated: int | None = None
    head: Head | None = None
    wall_known: bool = True

    def skip(self, line: int, text: str) -> None:
        """Count a line that is left out."""
        self.skipped_lines += 1
        if len(self.skipped) < MAX_LISTED:
            self.skipped.append(Skipped(line, shortened(text)))


class LineParser(Protocol):
    """Reads the lines of one format. ``expects`` is the text key of what a line looks like."""

    expects: str

    def parse(self, line: str) -> Frame | None:
        """The frame of a line, if it is one. Raises BadLineError."""


def shortened(text: str) -> str:
    """The beginning of a line, as it is shown in an error."""
    text = "".join(c if c.isprintable() else "·" for c in text[: _SHOWN + 1])
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "…"


def read_lines(path: Path, parser: LineParser, notes: Notes, lenient: bool) -> Iterator[Frame]:
    """The frames of a text file. Raises ForeignFileError at a bad line unless ``lenient``, and OSError."""
    with path.open("rb") as file:
        number = 0
        while raw := file.readline(MAX_LINE):
            number += 1
            line = raw.decode("utf-8", "replace").strip("\ufeff \t\r\n")
            if not line:
                continue
            ended = raw.endswith(b"\n")
            try:
                frame = parser.parse(line)
            except BadLineError as error:
                if not ended and len(raw) < MAX_LINE:
                    notes.truncated = number
                    return
                if not lenient:
                    raise ForeignFileError(
                        file=path.name, line=number, found=shortened(line), why=str(error), expected_key=parser.expects
                    ) from error
                notes.skip(number, line)
                while not ended and raw:
                    raw = file.readline(MAX_LINE)
                    ended = raw.endswith(b"\n")
                continue
            if frame is not None:
                yield frame


def decimal_ns(text: str, unit_ns: int = NS) -> int:
    """``1750000000.123456`` in units of ``unit_ns`` (a power of ten) as ns; digits below 1 ns are cut off."""
    match = _DECIMAL.match(text)
    if match is None:
        raise BadLineError(f"{text[:_SHOWN]!r} is no time")
    digits = len(str(unit_ns)) - 1
    fraction = (match[2] or "")[:digits].ljust(digits, "0")
    return int(match[1]) * unit_ns + int(fraction or "0")


def hex_bytes(text: str) -> bytes:
    """Bytes from hexadecimal digits, at most eight."""
    try:
        data = bytes.fromhex(text)
    except ValueError:
        raise BadLineError("the data are no pairs of hexadecimal digits") from None
    if len(data) > MAX_DATA:
        raise BadLineError("more than 8 bytes of data")
    return data


def number_of(text: str, base: int, most: int, what: str) -> int:
    """A number of digits alone (no sign, no blanks, no underscores). Raises BadLineError."""
    try:
        number = int(text, base) if text.isalnum() and text.isascii() else -1
    except ValueError:
        number = -1
    if not 0 <= number <= most:
        raise BadLineError(f"{text[:_SHOWN]!r} is no {what}")
    return number


def checked_id(can_id: int, extended: bool) -> int:
    """An identifier that fits its kind."""
    if can_id > (MAX_ID if extended else MAX_STANDARD_ID):
        raise BadLineError(f"identifier {can_id:X} is too large")
    return can_id


def seconds_text(t_ns: int, decimals: int) -> str:
    """Seconds with 6 or 9 decimals, the rest cut off."""
    seconds, rest = divmod(t_ns, NS)
    return f"{seconds}.{rest // 10 ** (9 - decimals):0{decimals}d}"
