"""Length on the bus of whole columns of CAN frames: ``wire.can_bits`` by the thousand."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from app.recording.columns import CanColumns
from app.recording.index.content import Counts
from app.wire.can_bits import ERROR_FRAME_BITS, TRAILER_BITS, byte_tables, header_bits

_CRC, _STUFF8, _STUFF7 = (np.array(table, np.int64) for table in byte_tables())
_STATE: Final = 0x700
_CRC_MASK: Final = 0x7FFF
_STUFFED_SHIFT: Final = 16
_CRC_BITS: Final = 15


def frame_bits(columns: CanColumns) -> Counts:
    """Bits that each frame takes on the bus; 0 for one that no bus can carry."""
    crc, item, total, possible = _headers(columns)
    lengths, stuffed = columns.lengths.astype(np.int64), total & ~0xFFFF
    for place in range(8):
        more = lengths > place
        byte = columns.data[:, place].astype(np.int64)
        crc = np.where(more, (crc << 8 & _CRC_MASK) ^ _CRC[crc >> 7 ^ byte], crc)
        item = np.where(more, _STUFF8[item & _STATE | byte], item)
        stuffed += np.where(more, item & ~0xFFFF, 0)
    item = _STUFF7[item & _STATE | crc >> 8]
    stuffed += item & ~0xFFFF
    stuffed += _STUFF8[item & _STATE | crc & 0xFF] & ~0xFFFF
    bits = (stuffed >> _STUFFED_SHIFT) + (total & 0xFFFF) + 8 * lengths + _CRC_BITS + TRAILER_BITS
    found: Counts = np.where(columns.error, ERROR_FRAME_BITS, np.where(possible, bits, 0))
    return found


def _headers(columns: CanColumns) -> tuple[Counts, Counts, Counts, npt.NDArray[np.bool_]]:
    """What stands in front of the data: looked up for each kind of frame once."""
    kind = columns.can_id.astype(np.int64) << 6 | columns.dlc.astype(np.int64) << 2
    kind |= columns.extended.astype(np.int64) << 1 | columns.remote
    kinds, places = np.unique(kind, return_inverse=True)
    found = [_header(one) for one in kinds.tolist()]
    known = np.array([(0, 0, 0) if one is None else one for one in found], np.int64).reshape(-1, 3)[places]
    return known[:, 0], known[:, 1], known[:, 2], np.array([one is not None for one in found])[places]


def _header(kind: int) -> tuple[int, int, int] | None:
    try:
        return header_bits(kind >> 6, kind >> 2 & 0xF, bool(kind & 2), bool(kind & 1))
    except ValueError:
        return None
