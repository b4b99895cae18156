"""ADUs as bytes: 13 and their own each, and the names of their connections once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from struct import Struct
from typing import Final

from app.wire.frame import Adu, Direction, Frame

_HEAD: Final = Struct("<QBHH")
_COUNT: Final = Struct("<I")
_SEPARATOR: Final = "\n"
"""No address holds one."""


def pack(frames: Sequence[Frame]) -> bytes:
    """Raises TypeError where one is no ADU."""
    links: dict[str, int] = {}
    parts = []
    for t_ns, _, direction, adu, _ in frames:
        if not isinstance(adu, Adu):
            raise TypeError("a bus of Modbus TCP carries ADUs")
        link = links.setdefault(adu.link, len(links))
        parts.append(_HEAD.pack(t_ns, direction is Direction.TX, link, len(adu.data)) + adu.data)
    names = _SEPARATOR.join(links).encode()
    return b"".join((_COUNT.pack(len(names)), names, *parts))


def unpack(data: bytes, bus: str) -> Iterator[Frame]:
    """What ``pack`` got."""
    (size,) = _COUNT.unpack_from(data)
    at = _COUNT.size + size
    links = data[_COUNT.size : at].decode().split(_SEPARATOR)
    while at < len(data):
        t_ns, sent, link, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size + length
        adu = Adu(data[at - length : at], links[link])
        yield Frame(t_ns, bus, Direction.TX if sent else Direction.RX, adu)
