"""Values of a set as a vector: one word of eight bytes an address, so that thousands of sets are compared at once.

A *layout* is the tuple of addresses that a set has values of, in the order of the words. Sets that were read the same
way share it, so a store keeps each layout once. A word says whether two values of one address are equal; numbers can
be read back from it, texts and octets cannot.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from hashlib import blake2b
from typing import Final

from app.model.address import Address, parse_address
from app.model.datatypes import Raw

WIDTH: Final = 8
"""Bytes of a word. Every integer of CiA 301 fits."""
_MASK: Final = (1 << 8 * WIDTH) - 1


def layout_of(values: Mapping[Address, Raw]) -> tuple[str, ...]:
    """The addresses that ``values`` has, as text, in their order."""
    return tuple(str(address) for address in sorted(values, key=lambda one: one[:2]))


def pack(values: Mapping[Address, Raw], layout: Sequence[str]) -> bytes:
    """The words of ``values`` in the order of ``layout``. Raises KeyError where an address of it has no value."""
    return b"".join(word(values[parse_address(text)]) for text in layout)


def word(raw: Raw) -> bytes:
    """One value: integers in two's complement, floats as IEEE 754, little-endian; of anything else a digest."""
    if isinstance(raw, int):
        return (raw & _MASK).to_bytes(WIDTH, "little")
    if isinstance(raw, float):
        return struct.pack("<d", raw)
    return blake2b(raw if isinstance(raw, bytes) else raw.encode(), digest_size=WIDTH).digest()
