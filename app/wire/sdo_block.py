"""Puts the sub-blocks of an SDO block transfer together as a third party sees them (CiA 301, 7.2.4.3.9 ff)."""

from __future__ import annotations

from typing import Any, Final

from app.wire import sdo
from app.wire.records import Fault

MAX_BYTES: Final = 4 * 2**20
"""Longer transfers are followed no further: no parameter is as long, and memory is bounded."""


class BlockBuffer:
    """Data of one block transfer. What the receiver acknowledged counts, not what was seen to be sent."""

    __slots__ = ("_data", "_last", "_window", "end", "finished", "size", "with_crc")

    def __init__(self) -> None:
        self._data = bytearray()
        self._window: dict[int, bytes] = {}
        self._last = 0
        self.finished = False
        """The last segment of all is acknowledged."""
        self.size: int | None = None
        """Bytes announced."""
        self.with_crc = True
        """Both sides can CRC."""
        self.end: sdo.BlockEnd | None = None

    @property
    def last_seen(self) -> int:
        """Sequence number of the latest segment since the last acknowledge, 0 before any."""
        return next(reversed(self._window), 0)

    def add(self, data: bytes) -> None:
        """Take a segment of the sub-block that runs."""
        part = sdo.parse_block_segment(data)
        self._window.pop(part.sequence, None)
        self._window[part.sequence] = part.data
        if part.last:
            self._last = part.sequence

    def acknowledge(self, sequence: int) -> Fault | None:
        """Keep the segments up to ``sequence``; the sender repeats all after it. A fault where one was never seen."""
        window, self._window = self._window, {}
        last, self._last = self._last, 0
        if len(self._data) + sequence * sdo.SEGMENT_SIZE > MAX_BYTES:
            return Fault.SIZE
        for number in range(1, sequence + 1):
            part = window.get(number)
            if part is None:
                return Fault.SEQUENCE
            self._data += part
        self.finished = bool(last) and sequence == last
        return None

    def whole(self) -> bytes | Fault:
        """All data, checked against the announced size and the CRC of the end frame."""
        end = self.end
        if end is None or end.unused > len(self._data):
            return Fault.SIZE
        data = bytes(self._data[: len(self._data) - end.unused])
        if self.size is not None and self.size != len(data):
            return Fault.SIZE
        if self.with_crc and sdo.crc(data) != end.crc:
            return Fault.CRC
        return data

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state."""
        return {
            "data": self._data.hex(),
            "window": [[number, part.hex()] for number, part in self._window.items()],
            "last": self._last,
            "finished": self.finished,
            "size": self.size,
            "crc": self.with_crc,
            "end": None if self.end is None else list(self.end),
        }

    @classmethod
    def restore(cls, state: dict[str, Any]) -> BlockBuffer:
        """The buffer that gave ``state``."""
        buffer = cls()
        buffer._data = bytearray.fromhex(state["data"])
        buffer._window = {number: bytes.fromhex(part) for number, part in state["window"]}
        buffer._last = state["last"]
        buffer.finished = state["finished"]
        buffer.size = state["size"]
        buffer.with_crc = state["crc"]
        buffer.end = None if state["end"] is None else sdo.BlockEnd(*state["end"])
        return buffer
