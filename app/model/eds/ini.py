"""The INI layer of an EDS: bytes to sections and keys, each with the line it stands in, and the list of warnings.

The standard parser keeps no lines, stops at the first duplicate and takes ``#`` and ``:`` for its own. Here the first
of two sections or keys counts, as in Windows, whose functions first read such files.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

MOST_WARNINGS: Final = 1000
"""Warnings about single lines that are kept of one file; what is beyond is only counted."""

_LINE_END: Final = re.compile(r"\r\n|\r|\n")
_SECTION: Final = re.compile(r"\[([^\]]*)\]")
_SHOWN: Final = 60
_ENCODING_OF_BOM: Final = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


@dataclass(frozen=True, slots=True)
class EdsWarning:
    """Something in line ``line`` (from 1; 0: the file as a whole) that is not as CiA 306 has it.

    ``text_key`` is a key of the locale catalogue, ``details`` fills its placeholders.
    """

    line: int
    text_key: str
    details: Mapping[str, str] = field(default_factory=dict)

    def __str__(self) -> str:
        details = ", ".join(f"{key}={value}" for key, value in self.details.items())
        return f"line {self.line}: {self.text_key.rpartition('.')[2]} {details}".rstrip()


class Warnings:
    """Collects warnings: those about the file as a whole, and ``MOST_WARNINGS`` of those about single lines."""

    def __init__(self) -> None:
        self._kept: list[EdsWarning] = []
        self._beyond = 0

    def add(self, line: int, name: str, **details: object) -> None:
        """Add the warning ``eds.<name>``."""
        if line == 0 or len(self._kept) < MOST_WARNINGS:
            shown = {key: shorten(str(value)) for key, value in details.items()}
            self._kept.append(EdsWarning(line, f"eds.{name}", shown))
        else:
            self._beyond += 1

    def by_line(self) -> list[EdsWarning]:
        """All of them in the order of the file."""
        found = sorted(self._kept, key=lambda warning: warning.line)
        if self._beyond:
            found.append(EdsWarning(0, "eds.more_warnings", {"count": str(self._beyond)}))
        return found


class Value(NamedTuple):
    """Text right of an equals sign, and its line."""

    text: str
    line: int


@dataclass(slots=True)
class Section:
    """A section: its name as written, the line of its header, and its keys in lower case."""

    name: str
    line: int
    values: dict[str, Value] = field(default_factory=dict)

    def get(self, key: str) -> Value | None:
        """The value of ``key`` in any case; None where it is missing or empty."""
        value = self.values.get(key.lower())
        return value if value is not None and value.text else None

    def text(self, key: str) -> str:
        """The text of ``key``, or an empty text."""
        value = self.get(key)
        return "" if value is None else value.text

    def line_of(self, key: str) -> int:
        """Line of ``key``, or of the section where the key is missing."""
        value = self.values.get(key.lower())
        return self.line if value is None else value.line


class Ini:
    """All sections by their name in lower case, in the order of the file."""

    def __init__(self, sections: dict[str, Section]) -> None:
        self._sections = sections

    def items(self) -> Iterator[tuple[str, Section]]:
        """Each name, in lower case and without blanks, with its section."""
        yield from self._sections.items()

    def get(self, name: str) -> Section | None:
        """The section ``name`` in any case, or None."""
        return self._sections.get(_section_key(name))

    def section(self, name: str) -> Section:
        """The section ``name``; an empty one where it is missing."""
        return self.get(name) or Section(name, 0)


def decode(data: bytes, warnings: Warnings) -> str:
    """Text of the bytes: by their byte order mark, else UTF-8, else the Windows code page 1252."""
    for mark, encoding in _ENCODING_OF_BOM:
        if data.startswith(mark):
            return data.decode(encoding, "replace")
    if data.isascii():
        return data.decode("ascii")
    line = _line_of_first_non_ascii(data)
    try:
        text = data.decode("utf-8")
        encoding = "UTF-8"
    except UnicodeDecodeError:
        text = data.decode("cp1252", "replace")
        encoding = "Windows-1252"
    warnings.add(line, "not_ascii", encoding=encoding)
    return text


def parse(text: str, warnings: Warnings) -> Ini:
    """Sections and keys of ``text``. Never raises: lines that make no sense become warnings."""
    sections: dict[str, Section] = {}
    current: Section | None = None
    for number, raw_line in enumerate(_LINE_END.split(text), 1):
        line = raw_line.strip(" \t\0\x1a")  # 1Ah ended a text file in DOS
        if not line or line[0] in ";#":
            continue
        if line[0] == "[":
            current = _open_section(line, number, sections, warnings)
        elif current is None:
            warnings.add(number, "line_before_section", text=line)
        else:
            _add_value(line, number, current, warnings)
    return Ini(sections)


def _open_section(line: str, number: int, sections: dict[str, Section], warnings: Warnings) -> Section:
    match = _SECTION.match(line)
    if match is None:
        warnings.add(number, "section_not_closed", text=line)
    name = (match[1] if match else line[1:]).strip()
    key = _section_key(name)
    known = sections.get(key)
    if known is not None:
        warnings.add(number, "section_twice", section=name, first=known.line)
        return known
    return sections.setdefault(key, Section(name, number))


def _section_key(name: str) -> str:
    """Sections are found in any case and with blanks wherever their writer put them."""
    return "".join(name.split()).lower()


def _add_value(line: str, number: int, section: Section, warnings: Warnings) -> None:
    key, equals, text = line.partition("=")
    key = key.strip()
    if not equals or not key:
        warnings.add(number, "line_not_understood", text=line)
        return
    known = section.values.get(key.lower())
    if known is None:
        section.values[key.lower()] = Value(text.strip(), number)
    elif known.text != text.strip():
        warnings.add(number, "key_twice", key=key, section=section.name, first=known.line)


def _line_of_first_non_ascii(data: bytes) -> int:
    position = next(at for at, byte in enumerate(data) if byte > 0x7F)
    head = data[:position].decode("ascii")
    return len(_LINE_END.findall(head)) + 1


def shorten(text: str, most: int = _SHOWN) -> str:
    """The text on one line, printable, at most ``most`` characters."""
    printable = "".join(char if char.isprintable() else " " for char in text[: 4 * most])
    words = " ".join(printable.split())
    return words if len(words) <= most else f"{words[: most - 1]}…"
