"""Values of a set as a vector of words of four bytes, so that thousands of sets are compared at once.

A *layout* names the addresses that a set has values of, in the order of the words: ``6065:00`` for one word,
``1008:00*2`` where the value takes two. Sets that were read the same way share it, so a store keeps each layout once.
Words say whether two values are equal; numbers can be read back from them, texts and octets cannot.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from hashlib import blake2b
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw

WIDTH: Final = 4
"""Bytes of a word."""
_TWO: Final = "*2"
_NARROW: Final = range(-(1 << 31), 1 << 32)
"""Integers of one word. -1 and FFFFFFFFh have the same, and no type of 32 bits or less holds both."""
_MASK: Final = (1 << 64) - 1


def layout_of(values: Mapping[Address, Raw]) -> tuple[str, ...]:
    """The addresses that ``values`` has, in their order, each with the room that its value takes."""
    ordered = sorted(values, key=lambda one: one[:2])
    return tuple(f"{address}{'' if _narrow(values[address]) else _TWO}" for address in ordered)


def pack(values: Mapping[Address, Raw], layout: Sequence[str]) -> bytes:
    """The words of ``values`` in the order of ``layout``, which must be theirs. Raises KeyError where it is not."""
    known = {str(address): raw for address, raw in values.items()}
    return b"".join(words(known[text.removesuffix(_TWO)], 2 if text.endswith(_TWO) else 1) for text in layout)


def places(layout: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Where the words of each address begin, and how many there are. Addresses are texts, as ``str`` gives them."""
    found, start = {}, 0
    for text in layout:
        count = 2 if text.endswith(_TWO) else 1
        found[text.removesuffix(_TWO)] = start, count
        start += count
    return found


def words(raw: Raw, count: int) -> bytes:
    """One value: integers in two's complement, floats as IEEE 754, little-endian; of anything else a digest.

    Raises KeyError where it needs another number of words.
    """
    if count != (1 if _narrow(raw) else 2):
        raise KeyError(f"{raw!r} does not take {count}")
    if isinstance(raw, int):
        return (raw & _MASK).to_bytes(2 * WIDTH, "little")[: WIDTH * count]
    return exact(raw)


def exact(raw: Raw) -> bytes:
    """Equal for equal values of one type only, whatever that is; not-a-number equals itself."""
    if isinstance(raw, int):
        return (raw & _MASK).to_bytes(2 * WIDTH, "little")
    if isinstance(raw, float):
        return struct.pack("<d", raw)
    return blake2b(raw if isinstance(raw, bytes) else raw.encode(), digest_size=2 * WIDTH).digest()


def _narrow(raw: Raw) -> bool:
    return isinstance(raw, int) and raw in _NARROW
