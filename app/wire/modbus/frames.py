"""Object frames, of which FC 101 to 103 carry many in one message (PD4-E manual, 8.4.6 and 8.4.7, pages 107 and 111).

A frame is index (low byte first), sub-index, number of bytes, and so many bytes of data, low byte first.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

from app.model.address import Address
from app.wire.modbus.fields import Fields, checked
from app.wire.modbus.functions import MAX_FRAME_BYTES

FRAME_HEAD: Final = 4
MAX_OBJECT_BYTES: Final = MAX_FRAME_BYTES - FRAME_HEAD


class ObjectFrame(NamedTuple):
    """One object and its bytes, least significant first."""

    address: Address
    data: bytes

    def encode(self) -> bytes:
        """Bytes of the frame. Raises ValueError where the data are too long for one."""
        size = checked(len(self.data), 0, MAX_OBJECT_BYTES, "object size")
        return self.address.major.to_bytes(2, "little") + bytes((self.address.minor, size)) + self.data


def encode_frames(frames: Iterable[ObjectFrame]) -> bytes:
    """A length byte and the frames. Raises ValueError where they do not fit one message."""
    data = b"".join(frame.encode() for frame in frames)
    return bytes((checked(len(data), 0, MAX_FRAME_BYTES, "frame bytes"),)) + data


def decode_frames(fields: Fields) -> tuple[ObjectFrame, ...]:
    """Read a length byte and the frames that fill the rest. Raises FormatError."""
    size = fields.byte()
    body = Fields(fields.take(size), fields.offset - size)
    frames = []
    while body.left:
        address = Address(body.word_low_first(), body.byte())
        frames.append(ObjectFrame(address, body.take(body.byte())))
    return tuple(frames)


def batches(frames: Iterable[ObjectFrame]) -> Iterator[Sequence[ObjectFrame]]:
    """Cut frames into as many as one message can hold each, in their order. Raises ValueError as ``encode`` does."""
    batch: list[ObjectFrame] = []
    used = 0
    for frame in frames:
        size = len(frame.encode())
        if used + size > MAX_FRAME_BYTES:
            yield batch
            batch, used = [], 0
        batch.append(frame)
        used += size
    if batch:
        yield batch
