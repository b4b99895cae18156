"""PROFIBUS telegrams as bytes: 11 and their own each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from struct import Struct
from typing import Final

from app.wire.frame import Direction, Fdl, Frame

_HEAD: Final = Struct("<QBH")


def pack(frames: Sequence[Frame]) -> bytes:
    """Raises TypeError where one is no telegram."""
    parts = []
    for t_ns, _, direction, fdl, _ in frames:
        if not isinstance(fdl, Fdl):
            raise TypeError("a PROFIBUS line carries telegrams")
        parts.append(_HEAD.pack(t_ns, direction is Direction.TX, len(fdl.data)) + fdl.data)
    return b"".join(parts)


def unpack(data: bytes, bus: str) -> Iterator[Frame]:
    """What ``pack`` got."""
    at = 0
    while at < len(data):
        t_ns, sent, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size + length
        yield Frame(t_ns, bus, Direction.TX if sent else Direction.RX, Fdl(data[at - length : at]))
