"""Bytes of SDO block transfers, seen by the server (CiA 301, 7.2.4.3.9 to 7.2.4.3.15). Pure."""

from __future__ import annotations

import struct
from typing import Final

from app.model.address import Address

MAX_BLOCK: Final = 127
SEGMENT_SIZE: Final = 7
_IDX_U32: Final = struct.Struct("<BHBI")


def download_initiated(address: Address, block_size: int) -> bytes:
    """Accept a block download; the server can do the CRC."""
    return _IDX_U32.pack(0xA4, address.major, address.minor, block_size)


def download_block_ack(sequence: int, block_size: int) -> bytes:
    """Tell the last segment that came in order, and the size of the next block."""
    return bytes([0xA2, sequence, block_size]) + bytes(5)


def download_ended() -> bytes:
    """Acknowledge the whole block download."""
    return bytes([0xA1]) + bytes(7)


def upload_initiated(address: Address, size: int) -> bytes:
    """Accept a block upload of ``size`` bytes; the server can do the CRC."""
    return _IDX_U32.pack(0xC6, address.major, address.minor, size)


def segment(sequence: int, data: bytes, last: bool) -> bytes:
    """One segment of a block; ``sequence`` counts from 1 within the block."""
    return bytes([sequence | last << 7]) + data.ljust(SEGMENT_SIZE, b"\0")


def upload_end(unused: int, crc: int) -> bytes:
    """End a block upload: unused bytes of the last segment, and the CRC (0 where the client cannot)."""
    return bytes([0xC1 | unused << 2]) + crc.to_bytes(2, "little") + bytes(5)
