"""PZD: process data to numbers and back, by telegram and by the order of bytes, which is a setting.

The manual says the least significant byte and word first (1.4, 4.5), its only examples by bytes have the most
significant first, and which word of two comes first is told nowhere. So the order is asked of the device:
``orders_that_fit`` compares process data with what PKW reads of the same parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from itertools import product
from typing import Final, Literal, NamedTuple

from app.wire.profibus.fields import FormatError, checked
from app.wire.profibus.telegrams import Part, Signal, Words, words_of
from app.wire.records import Fault

Values = Mapping[Signal, int]


class First(Enum):
    """Which end comes first."""

    LOW = "low"
    HIGH = "high"


class Order(NamedTuple):
    """The order of bytes in a word, and of words in a double word."""

    byte: First
    word: First


AS_PRINTED: Final = Order(First.LOW, First.LOW)
AS_PKW: Final = Order(First.HIGH, First.HIGH)
ORDERS: Final = tuple(Order(*ends) for ends in product(First, First))


def encode_pzd(words: Words, values: Values, order: Order) -> bytes:
    """Process data; what ``values`` does not hold is 0. Raises ValueError where a number does not fit its signal."""
    data = bytearray()
    for shared in words:
        raw = 0
        for signal in shared:
            raw |= _unsigned(signal, values.get(signal, 0)) << (8 if signal.part is Part.HIGH else 0)
        data += _ordered(raw, shared[0].words, order)
    return bytes(data)


def decode_pzd(words: Words, data: bytes, order: Order, base: int = 0) -> dict[Signal, int]:
    """Numbers of process data; offsets of errors begin at ``base``. Raises FormatError where the length is wrong."""
    size = 2 * words_of(words)
    if len(data) != size:
        raise FormatError(Fault.LENGTH, base + min(len(data), size), f"{len(data)} bytes of process data, not {size}")
    values, at = {}, 0
    for shared in words:
        count = shared[0].words
        raw = _number(data[at : at + 2 * count], order)
        at += 2 * count
        for signal in shared:
            own = raw >> (8 if signal.part is Part.HIGH else 0) & (1 << signal.bits) - 1
            values[signal] = own - (1 << signal.bits) if signal.signed and own >> signal.bits - 1 else own
    return values


def orders_that_fit(words: Words, data: bytes, known: Values) -> tuple[Order, ...]:
    """The orders by which ``data`` tell what is ``known`` of the same moment. Raises FormatError as ``decode_pzd``.

    More than one is left where the known numbers look the same in several orders: 0 proves nothing.
    """
    fitting = []
    for order in ORDERS:
        values = decode_pzd(words, data, order)
        if all(values[signal] == value for signal, value in known.items()):
            fitting.append(order)
    return tuple(fitting)


def _unsigned(signal: Signal, value: int) -> int:
    low = -(1 << signal.bits - 1) if signal.signed else 0
    checked(value, low, low + (1 << signal.bits) - 1, signal.name)
    return value & (1 << signal.bits) - 1


def _ordered(raw: int, count: int, order: Order) -> bytes:
    words = [raw >> 16 * number & 0xFFFF for number in range(count)]
    if order.word is First.HIGH:
        words.reverse()
    return b"".join(word.to_bytes(2, "big" if order.byte is First.HIGH else "little") for word in words)


def _number(data: bytes, order: Order) -> int:
    end: Literal["big", "little"] = "big" if order.byte is First.HIGH else "little"
    words = [int.from_bytes(data[at : at + 2], end) for at in range(0, len(data), 2)]
    if order.word is First.HIGH:
        words.reverse()
    return sum(word << 16 * number for number, word in enumerate(words))
