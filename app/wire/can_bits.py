"""Exact length of a CAN frame on the bus, in bits, stuff bits included (ISO 11898-1, 10.4 and 10.5).

Counted from start of frame to the end of the intermission, so that ``bits / bitrate`` is the time for which the frame
keeps the bus from carrying the next one. Stuffing runs from start of frame to the last bit of the CRC sequence.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

from app.wire.frame import Can

CRC15_POLYNOMIAL: Final = 0x4599
TRAILER_BITS: Final = 1 + 1 + 1 + 7 + 3
"""CRC delimiter, ACK slot, ACK delimiter, end of frame, intermission: never stuffed."""
ERROR_FRAME_BITS: Final = 6 + 6 + 8 + 3
"""Error flag and its echo by the other nodes, error delimiter, intermission; the frame it broke is not known."""

_START_STATE: Final = 1 << 8
"""State of the stuffing machine before start of frame: a recessive bit, run of one."""
_STATE_MASK: Final = 0x700
_COUNT_SHIFT: Final = 16


def _stuff_table(width: int) -> list[int]:
    """Steps of the stuffing machine over ``width`` bits at a time.

    A state is (run length - 1) << 1 | last bit, kept shifted by 8, so that ``state | bits`` is the place in the table;
    an item is the next state plus the stuff bits inserted << 16, so that items can be summed up.
    """
    table = [0] * 0x800
    for state in range(8):
        for bits in range(1 << width):
            last, run, stuffed = state & 1, (state >> 1) + 1, 0
            for shift in range(width - 1, -1, -1):
                bit = bits >> shift & 1
                last, run = bit, run + 1 if bit == last else 1
                if run == 5:
                    last, run, stuffed = 1 - last, 1, stuffed + 1
            table[state << 8 | bits] = (run - 1 << 1 | last) << 8 | stuffed << _COUNT_SHIFT
    return table


def _crc_table() -> list[int]:
    table = []
    for byte in range(256):
        value = byte << 7
        for _ in range(8):
            value = (value << 1) ^ (CRC15_POLYNOMIAL if value & 0x4000 else 0)
        table.append(value & 0x7FFF)
    return table


_BIT1: Final = _stuff_table(1)
_BIT7: Final = _stuff_table(7)
_BIT8: Final = _stuff_table(8)
_CRC8: Final = _crc_table()


@lru_cache(maxsize=4096)
def _header(can_id: int, length: int, extended: bool, remote: bool) -> tuple[int, int, int]:
    """Start of frame to DLC: CRC so far, last item of the stuffing machine, and its sum."""
    if not 0 <= length <= 15:
        raise ValueError(f"DLC {length} is outside 0..15")
    if not 0 <= can_id < (1 << 29 if extended else 1 << 11):
        raise ValueError(f"identifier {can_id:X}h does not fit its format")
    if extended:
        # SOF, base id 11, SRR = 1, IDE = 1, extension 18, RTR, r1 = r0 = 0, DLC
        width = 39
        bits = (can_id >> 18) << 27 | 0b11 << 25 | (can_id & 0x3FFFF) << 7 | remote << 6 | length
    else:
        # SOF, id 11, RTR, IDE = r0 = 0, DLC
        width = 19
        bits = can_id << 7 | remote << 6 | length
    crc = total = 0
    item = _START_STATE
    for shift in range(width - 1, -1, -1):
        bit = bits >> shift & 1
        item = _BIT1[item & _STATE_MASK | bit]
        total += item & ~0xFFFF
        crc = (crc << 1 & 0x7FFF) ^ (CRC15_POLYNOMIAL if (crc >> 14) ^ bit else 0)
    return crc, item, total + width


@lru_cache(maxsize=16384)
def frame_bits(can: Can) -> int:
    """Bits that ``can`` takes on the bus, from start of frame to the end of the intermission.

    Raises ValueError where the frame cannot exist: more than 8 bytes, an identifier or DLC out of range.
    """
    can_id, data, extended, remote, error, dlc = can
    if error:
        return ERROR_FRAME_BITS
    size = len(data)
    if size > 8:
        raise ValueError(f"{size} data bytes in a classic frame")
    crc, item, total = _header(can_id, size if dlc < 0 else dlc, extended, remote)
    if not remote:
        total += 8 * size
        for byte in data:
            crc = (crc << 8 & 0x7FFF) ^ _CRC8[crc >> 7 ^ byte]
            item = _BIT8[item & 0x700 | byte]
            total += item & 0xF0000
    item = _BIT7[item & 0x700 | crc >> 8]
    stuffed = total + item + _BIT8[item & 0x700 | crc & 0xFF]
    return (stuffed >> _COUNT_SHIFT) + (total & 0xFFFF) + 15 + TRAILER_BITS


def header_bits(can_id: int, length: int, extended: bool, remote: bool) -> tuple[int, int, int]:
    """For who counts whole columns of frames: CRC, item of the stuffing machine and its sum behind the DLC.

    Raises ValueError where the frame cannot exist.
    """
    return _header(can_id, length, extended, remote)


def byte_tables() -> tuple[list[int], list[int], list[int]]:
    """The tables that ``frame_bits`` goes on with: CRC by byte, stuffing by 8 bits and by 7."""
    return _CRC8, _BIT8, _BIT7
