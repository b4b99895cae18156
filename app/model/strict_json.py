"""JSON of files that people keep: read strictly, and with the line of what is wrong.

Python's reader takes the last of two equal keys, ``NaN`` and numbers of any length; in a file that is to prove
something, each of them is damage.
"""

from __future__ import annotations

import json
from typing import Any, NoReturn

MOST_DIGITS = 40


class JsonError(ValueError):
    """The text is no JSON that we take; ``line`` counts from 1."""

    def __init__(self, line: int, reason: str) -> None:
        super().__init__(reason)
        self.line = line
        self.reason = reason


def read_json(text: str) -> Any:
    """The content of ``text``. Raises JsonError: no JSON, a key twice, no number, nested too deep."""
    try:
        return json.loads(
            text,
            object_pairs_hook=lambda pairs: _object(text, pairs),
            parse_constant=lambda name: _refuse(line_of(text, name), f"{name} is no number"),
            parse_int=lambda digits: _integer(text, digits),
            parse_float=lambda digits: _float(text, digits),
        )
    except json.JSONDecodeError as error:
        raise JsonError(error.lineno, f"no valid JSON: {error.msg}") from error
    except RecursionError as error:
        raise JsonError(1, "nested too deep") from error


def line_of(text: str, *pieces: str) -> int:
    """The line of the last of ``pieces``, each looked for behind the one before; 1 where the first is not there."""
    position = 0
    for piece in pieces:
        found = text.find(piece, position)
        if found < 0:
            break
        position = found
    return text.count("\n", 0, position) + 1


def _object(text: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in content if keys.count(key) > 1)
        quoted = json.dumps(twice, ensure_ascii=False)
        first = text.find(quoted)
        _refuse(line_of(text[:first] + "_" * len(quoted) + text[first + len(quoted) :], quoted), f"{quoted} twice")
    return content


def _integer(text: str, digits: str) -> int:
    if len(digits) > MOST_DIGITS:
        _refuse(line_of(text, digits), f"a number of {len(digits)} digits")
    return int(digits)


def _float(text: str, digits: str) -> float:
    number = float(digits)
    if number in (float("inf"), float("-inf")):
        _refuse(line_of(text, digits), f"{digits[:MOST_DIGITS]} is too large")
    return number


def _refuse(line: int, reason: str) -> NoReturn:
    raise JsonError(line, reason)
