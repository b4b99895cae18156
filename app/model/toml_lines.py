"""Line numbers of tables, keys and rows of a TOML text; the standard parser keeps none.

Good for texts that are valid TOML and write one sub-index a line, as ours do (an inline table cannot break over lines).
"""

from __future__ import annotations

import re

_TABLE = re.compile(r"^\s*\[\[?\s*([\w.-]+)\s*\]\]?")
_KEY = re.compile(r"^\s*([\w-]+)\s*=")
_ROW = re.compile(r"^\s*\{")
_AT = re.compile(r"at line (\d+)")


class TomlLines:
    """Where things stand in ``text``; 0 where a thing does not stand there. Lines count from 1."""

    def __init__(self, text: str) -> None:
        self._lines = text.splitlines()
        self._tables: dict[str, list[int]] = {}
        for number, line in enumerate(self._lines, 1):
            if match := _TABLE.match(line):
                self._tables.setdefault(match[1], []).append(number)

    @staticmethod
    def line_of_error(message: str) -> int:
        """The line that a message of the TOML parser names."""
        match = _AT.search(message)
        return int(match[1]) if match else 0

    def table(self, name: str, number: int) -> int:
        """Line of the ``number``-th (from 0) table ``[[name]]``."""
        lines = self._tables.get(name, [])
        return lines[number] if number < len(lines) else 0

    def key(self, key: str) -> int:
        """First line that sets ``key`` or opens a table of that name."""
        for number, line in enumerate(self._lines, 1):
            match = _KEY.match(line) or _TABLE.match(line)
            if match and match[1] == key:
                return number
        return 0

    def key_in(self, name: str, number: int, key: str) -> int:
        """Line of ``key`` inside the ``number``-th table ``[[name]]``; the table's line where it is not found."""
        start = self.table(name, number)
        for offset, line in enumerate(self._body(start), 1):
            match = _KEY.match(line)
            if match and match[1] == key:
                return start + offset
        return start

    def subs(self, name: str, number: int, count: int) -> list[int]:
        """Lines of the ``count`` inline tables of ``subs`` in the ``number``-th table ``[[name]]``."""
        start = self.table(name, number)
        rows = [start + offset for offset, line in enumerate(self._body(start), 1) if _ROW.match(line)]
        return rows[:count] if len(rows) >= count else [start] * count

    def _body(self, start: int) -> list[str]:
        body: list[str] = []
        for line in self._lines[start:]:
            if _TABLE.match(line):
                break
            body.append(line)
        return body
