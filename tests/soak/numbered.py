"""Numbered traffic: frame ``n`` of a bus is always the same one, so that what was recorded proves itself.

PDOs and heartbeats of three axes and SDO reads of their positions; the number stands in the last four bytes of each.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

NODES: Final = (11, 12, 13)
_ROUND: Final = tuple(
    line
    for node in NODES
    for line in (
        (0x180 + node, b"\x37\x16\x00\x00"),
        (0x280 + node, b"\x37\x16\x00\x00"),
        (0x380 + node, b"\x37\x16\x00\x00"),
        (0x600 + node, b"\x40\x64\x60\x00"),
        (0x580 + node, b"\x43\x64\x60\x00"),
    )
)
"""Identifier and first four data bytes of the frames of a round."""
IDENTIFIERS: Final = np.array([can_id for can_id, _ in _ROUND], dtype=np.uint32)
HEADS: Final = np.array([int.from_bytes(head, "little") for _, head in _ROUND], dtype=np.uint32)
ELEMENTS: Final = tuple((f"< frame {can_id:03X} ", head.hex().upper()) for can_id, head in _ROUND)
TICKS: Final = np.dtype([("bus", "<u4"), ("sent", "<u4"), ("t_ns", "<u8"), ("late_ns", "<u8"), ("held_ns", "<u8")])
"""What the feeder notes of each tick: frames sent of this bus until then; when; how much later than asked for the
system woke it; how long the client's connection held it up."""

Numbers = npt.NDArray[np.uint32]


class Columns(NamedTuple):
    """Frames of one bus in the order of a file: identifiers, the first four data bytes and the last four."""

    identifiers: Numbers
    heads: Numbers
    numbers: Numbers


def elements(first: int, count: int, at_s: float, period_s: float) -> bytes:
    """The socketcand text of ``count`` frames from number ``first`` on, stamped ``period_s`` apart."""
    size = len(ELEMENTS)
    parts = []
    for n in range(first, first + count):
        start, head = ELEMENTS[n % size]
        parts.append(f"{start}{at_s + (n - first) * period_s:.6f} {head}{n.to_bytes(4, 'little').hex().upper()} >")
    return "".join(parts).encode()


def wrong(columns: Columns) -> int:
    """How many frames are not those that their numbers say."""
    turn = columns.numbers % np.uint32(len(ELEMENTS))
    agrees = (IDENTIFIERS[turn] == columns.identifiers) & (HEADS[turn] == columns.heads)
    return int(np.count_nonzero(~agrees))
