"""The words of a search text, each with its place."""

from __future__ import annotations

import re
from enum import Enum
from typing import Final, NamedTuple

from app.errors import SignatureError

MAX_TEXT: Final = 1000


class WordKind(Enum):
    """What a word is made of."""

    NAME = "name"
    NUMBER = "number"
    SIGN = "sign"
    END = "end"


class Word(NamedTuple):
    """One word. ``at`` counts characters from 1."""

    kind: WordKind
    text: str
    at: int


_WORD: Final = re.compile(
    r"\s*(?:(?P<sign>>=|<=|!=|[><=()|])"
    r"|(?P<name>(?![0-9]{4}(?![\w:]))(?:0x)?[0-9A-Fa-f]{4}h?(?::[0-9A-Fa-f]{1,2})?(?!\w)"  # an address or a code
    r"|[^\W0-9][\w°²%/]*|°[\w²/]*|%|1/[a-z]+)"  # a word or a unit
    r"|(?P<number>[-+]?[0-9]+(?:[.,][0-9]+)?))"
)


def words_of(text: str) -> list[Word]:
    """The words, an END behind them. Raises SignatureError where a character fits nowhere."""
    if len(text) > MAX_TEXT:
        raise SignatureError(position=MAX_TEXT, found="…", reason_key="signature.too_long")
    found: list[Word] = []
    at = 0
    while text[at:].strip():
        match = _WORD.match(text, at)
        if match is None:
            place = at + len(text[at:]) - len(text[at:].lstrip())
            raise SignatureError(position=place + 1, found=text[place], reason_key="signature.character")
        kind = WordKind(str(match.lastgroup))
        found.append(Word(kind, match[kind.value], match.start(kind.value) + 1))
        at = match.end()
    found.append(Word(WordKind.END, "", len(text.rstrip()) + 1))
    return found
