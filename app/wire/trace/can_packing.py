"""CAN frames as bytes, 30 each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from struct import Struct
from typing import Final

from app.wire.frame import Can, Direction, Frame

_PACKED: Final = Struct("<QqIBb8s")
_NO_TIME: Final = -1
_LENGTH: Final = 0x0F
_TX, _EXTENDED, _REMOTE, _ERROR = 0x10, 0x20, 0x40, 0x80


def pack(frames: Sequence[Frame]) -> bytes:
    """Raises TypeError where one is no CAN frame."""
    return b"".join(map(_pack, frames))


def unpack(data: bytes, bus: str) -> Iterator[Frame]:
    """What ``pack`` got."""
    rx, tx = Direction.RX, Direction.TX
    for t_ns, adapter_ns, can_id, flags, dlc, raw in _PACKED.iter_unpack(data):
        can = Can(
            can_id,
            raw[: flags & _LENGTH],
            bool(flags & _EXTENDED),
            bool(flags & _REMOTE),
            bool(flags & _ERROR),
            dlc,
        )
        yield Frame(t_ns, bus, tx if flags & _TX else rx, can, None if adapter_ns == _NO_TIME else adapter_ns)


def _pack(frame: Frame) -> bytes:
    t_ns, _, direction, can, adapter_ns = frame
    if not isinstance(can, Can):
        raise TypeError("a bus of CAN carries CAN frames")
    flags = len(can.data) | (_TX if direction is Direction.TX else 0) | (_EXTENDED if can.extended else 0)
    flags |= (_REMOTE if can.remote else 0) | (_ERROR if can.error else 0)
    return _PACKED.pack(t_ns, _NO_TIME if adapter_ns is None else adapter_ns, can.can_id, flags, can.dlc, can.data)
