"""Reads the text of a signature.

::

    60F4 > 2 deg within 5 s before emcy 8611
    mains_low then emcy 3280 within 2 s on same blade
    |60F4| > 1.5 for 200 ms on blade 2 and not trip
    chain_open without trip within 1 s or (silent on node 13)

An event is ``trip``, ``error``, ``warning`` or the name of a sign (``emcy 8611``, ``efc_input``, ``ended chain_open``);
a condition is an object (``60F4``, ``6510:03``, ``|60F4|`` for its amount) against a number with or without unit, with
``for 200 ms`` where it must last. ``on`` says where: ``blade 2``, ``node 13``, ``pmc``, ``bus can0``. Pairs bind more
than ``not``, ``not`` more than ``and``, ``and`` more than ``or``.
"""

from __future__ import annotations

import re
from typing import Final, NoReturn

from app.errors import SignatureError
from app.model.address import parse_address
from app.service.analysis.search.query import (
    ANYWHERE,
    UNITS,
    All,
    Any,
    Comparison,
    EventIs,
    Level,
    Not,
    Order,
    Pair,
    Query,
    Same,
    Scope,
    Special,
)
from app.service.analysis.search.words import Word, WordKind, words_of
from app.wire.signs import SignKind

MAX_DEPTH: Final = 20
_TIMES_NS: Final = {
    "ns": 1,
    "us": 1_000,
    "µs": 1_000,
    "ms": 1_000_000,
    "s": 10**9,
    "min": 60 * 10**9,
    "h": 3600 * 10**9,
}
_KINDS: Final[dict[str, SignKind | Special]] = {
    **{kind.value: kind for kind in SignKind},
    **{kind.value: kind for kind in Special},
}
_WITH_CODE: Final = (SignKind.EMCY, SignKind.ERROR_CODE, SignKind.DEVICE_STATUS)
_KEYWORDS: Final = frozenset({"and", "or", "not", "then", "without", "within", "before", "on", "for", "ended", "same"})
_CODE: Final = re.compile(r"^(?:0x)?([0-9A-Fa-f]{4})h?$")
_ADDRESS: Final = re.compile(r"^(?:0x)?[0-9A-Fa-f]{4}h?(?::[0-9A-Fa-f]{1,2})?$")
_DEVICES: Final = frozenset({"pmm", "pmc"})


def parse_query(text: str) -> Query:
    """The signature that ``text`` describes. Raises SignatureError, which names the position."""
    reader = _Reader(words_of(text))
    query = reader.any_of(0)
    reader.end()
    return query


class _Reader:
    """Reads word by word, one function a rule."""

    def __init__(self, words: list[Word]) -> None:
        self._words = words
        self._at = 0

    # -- words -----------------------------------------------------------------

    @property
    def _word(self) -> Word:
        return self._words[self._at]

    def _take(self, *texts: str) -> bool:
        if self._word.kind in (WordKind.NAME, WordKind.SIGN) and self._word.text.lower() in texts:
            self._at += 1
            return True
        return False

    def _fail(self, reason: str, word: Word | None = None) -> NoReturn:
        word = word or self._word
        raise SignatureError(position=word.at, found=word.text or "–", reason_key=f"signature.{reason}")

    def _need(self, text: str, reason: str) -> None:
        if not self._take(text):
            self._fail(reason)

    def end(self) -> None:
        """Nothing more may follow."""
        if self._word.kind is not WordKind.END:
            self._fail("end")

    # -- rules -----------------------------------------------------------------

    def any_of(self, depth: int) -> Query:
        parts = [self._all_of(depth)]
        while self._take("or"):
            parts.append(self._all_of(depth))
        return parts[0] if len(parts) == 1 else Any(tuple(parts))

    def _all_of(self, depth: int) -> Query:
        parts = [self._not(depth)]
        while self._take("and"):
            parts.append(self._not(depth))
        return parts[0] if len(parts) == 1 else All(tuple(parts))

    def _not(self, depth: int) -> Query:
        if depth > MAX_DEPTH:
            self._fail("too_deep")
        return Not(self._not(depth + 1)) if self._take("not") else self._pairs(depth)

    def _pairs(self, depth: int) -> Query:
        left = self._one(depth)
        while True:
            start = self._word
            if self._take("within"):
                within_ns = self._time()
                self._need("before", "before")
                left = self._pair(start, left, Order.BEFORE, self._one(depth), within_ns)
            elif self._take("then"):
                left = self._then(start, left, Order.THEN, depth)
            elif self._take("without"):
                left = self._then(start, left, Order.WITHOUT, depth)
            else:
                return left

    def _then(self, start: Word, left: Query, order: Order, depth: int) -> Pair:
        right = self._one(depth)
        self._need("within", "within")
        return self._pair(start, left, order, right, self._time())

    def _pair(self, start: Word, left: Query, order: Order, right: Query, within_ns: int) -> Pair:
        for side in (left, right):
            if isinstance(side, Not | All):
                self._fail("no_pair", start)
        return Pair(left, order, right, within_ns, self._same())

    def _same(self) -> Same | None:
        if not (self._word.text.lower() == "on" and self._words[self._at + 1].text.lower() == "same"):
            return None
        self._at += 2
        for same in Same:
            if self._take(same.value):
                return same
        self._fail("same")

    def _one(self, depth: int) -> Query:
        if self._take("("):
            inner = self.any_of(depth + 1)
            self._need(")", "bracket")
            return inner
        if self._take("|"):
            level = self._level(amount=True)
            return level
        ended = self._take("ended")
        word = self._word
        if not ended and self._is_level():
            return self._level(amount=False)
        kind = _KINDS.get(word.text.lower()) if word.kind is WordKind.NAME else None
        if kind is None:
            self._fail("event")
        if ended and isinstance(kind, Special):
            self._fail("event")
        self._at += 1
        return EventIs(kind, self._code() if kind in _WITH_CODE else None, self._scope(), ended)

    def _code(self) -> int | None:
        word = self._word
        match = _CODE.match(word.text) if word.kind in (WordKind.NAME, WordKind.NUMBER) else None
        if match is not None:
            self._at += 1
            return int(match[1], 16)
        if self._take("any"):
            return None
        if word.kind is WordKind.NUMBER or (word.kind is WordKind.NAME and word.text.lower() not in _KEYWORDS):
            self._fail("code")
        return None

    # -- conditions --------------------------------------------------------------

    def _is_level(self) -> bool:
        word, following = self._word, self._words[min(self._at + 1, len(self._words) - 1)]
        named = word.kind in (WordKind.NAME, WordKind.NUMBER) and _ADDRESS.match(word.text)
        return bool(named) and following.kind is WordKind.SIGN and following.text not in "()|"

    def _level(self, amount: bool) -> Level:
        word = self._word
        if word.kind not in (WordKind.NAME, WordKind.NUMBER) or not _ADDRESS.match(word.text):
            self._fail("address")
        address = parse_address(word.text)
        self._at += 1
        if amount:
            self._need("|", "bar")
        comparison = next((one for one in Comparison if self._take(one.value)), None)
        if comparison is None:
            self._fail("comparison")
        number = self._number()
        unit = self._unit()
        lasting_ns = self._time() if self._take("for") else 0
        return Level(address, comparison, number, unit, lasting_ns, amount, self._scope())

    def _number(self) -> float:
        word = self._word
        if word.kind is not WordKind.NUMBER:
            self._fail("number")
        self._at += 1
        return float(word.text.replace(",", "."))

    def _unit(self) -> str:
        word = self._word
        if word.kind is not WordKind.NAME or word.text.lower() in _KEYWORDS:
            return ""
        self._at += 1
        return UNITS.get(word.text, word.text)

    def _time(self) -> int:
        number = self._number()
        unit = _TIMES_NS.get(self._word.text)
        if unit is None or number < 0:
            self._fail("time")
        self._at += 1
        return round(number * unit)

    # -- where ---------------------------------------------------------------------

    def _scope(self) -> Scope:
        if self._word.text.lower() != "on" or self._words[self._at + 1].text.lower() == "same":
            return ANYWHERE
        self._at += 1
        blade = node = device = bus = None
        start = self._at
        while True:
            if self._take("blade"):
                blade = self._whole()
            elif self._take("node"):
                node = self._whole()
            elif self._take("bus"):
                bus, self._at = self._word.text, self._at + 1
            elif self._take(*_DEVICES):
                device = self._words[self._at - 1].text.lower()
            else:
                break
        if self._at == start:
            self._fail("where")
        return Scope(blade, node, device, bus)

    def _whole(self) -> int:
        word = self._word
        if word.kind is not WordKind.NUMBER or not word.text.isdecimal():
            self._fail("number")
        self._at += 1
        return int(word.text)


EXAMPLES: Final = (
    "60F4 > 2 deg within 5 s before emcy 8611",
    "mains_low then emcy 3280 within 2 s on same node",
    "trip and not mains_low",
)
