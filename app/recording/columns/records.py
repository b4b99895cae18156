"""Chunks of our own form as blocks: records of one size, viewed where they stand, checked before they are trusted."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np

from app.recording.can_table import CanColumns, Ids, Rows, Times, Words, is_sorted
from app.recording.cdr import ENCAPSULATION, OP_MESSAGE, RECORD_PREFIX, CanArray, can_dtype

_RX: Final = int.from_bytes(b"/rx\0", "little")
_TX: Final = int.from_bytes(b"/tx\0", "little")


class _Layout(NamedTuple):
    """The record of ``can_dtype`` in few wide fields; ``constant`` ones hold the same in every record of a chunk."""

    dtype: np.dtype[np.void]
    constant: tuple[tuple[str, int], ...]


@lru_cache(maxsize=256)
def _layout(bus: str, channel_id: int) -> _Layout:
    plain = can_dtype(bus)
    name = bus.encode()
    at = {field: offset for field, (_, offset, *_) in (plain.fields or {}).items()}
    length = plain.itemsize - RECORD_PREFIX.size
    fields = {
        "log_time": ("<u8", at["log_time"]),
        "way": ("<u4", at["frame_id"] + len(name)),
        "id": ("<u4", at["id"]),
        "marks": ("<u4", at["is_rtr"]),
        "data": ("<u8", at["data"]),
    }
    constant = []
    for offset, content in (
        (0, RECORD_PREFIX.pack(OP_MESSAGE, length) + channel_id.to_bytes(2, "little")),
        (at["encapsulation"], ENCAPSULATION),
        (at["frame_id_length"], (len(name) + 4).to_bytes(4, "little") + name),
    ):
        for place, size, raw in _covered(offset, content):
            fields[f"at{place}"] = (f"<u{size}", place)
            constant.append((f"at{place}", raw))
    dtype = np.dtype(
        {
            "names": list(fields),
            "formats": [form for form, _ in fields.values()],
            "offsets": [offset for _, offset in fields.values()],
            "itemsize": plain.itemsize,
        }
    )
    return _Layout(dtype, tuple(constant))


def _covered(offset: int, content: bytes) -> Iterator[tuple[int, int, int]]:
    """Numbers of 8, 4 or 1 bytes that cover ``content``; the last one may overlap the one before it."""
    size = next(width for width in (8, 4, 1) if len(content) >= width)
    places = [*range(0, len(content) - size + 1, size)]
    if places[-1] + size < len(content):
        places.append(len(content) - size)
    for place in places:
        yield offset + place, size, int.from_bytes(content[place : place + size], "little")


class RecordBlock:
    """Message records of CAN frames of one bus, all of our own form, sorted by time."""

    def __init__(self, bus: str, records: CanArray, t_ns: Times, ids: Ids) -> None:
        self.bus = bus
        self.t_ns = t_ns
        self.ids = ids
        self._records = records

    def gather(self, rows: Any) -> CanColumns:
        """The columns of the frames at ``rows``."""
        records = self._records  # field by field: to copy whole records takes five times as long
        marks = np.ascontiguousarray(records["marks"][rows]).view(np.uint8).reshape(-1, 4)
        data = np.ascontiguousarray(records["data"][rows]).view(np.uint8).reshape(-1, 8)
        flags = marks[:, :3] != 0
        return CanColumns(
            self.bus,
            self.t_ns[rows],
            self.ids[rows],
            records["way"][rows] == _TX,
            flags[:, 1],
            flags[:, 0],
            flags[:, 2],
            np.ascontiguousarray(marks[:, 3]),
            data,
        )

    def words(self, rows: Rows) -> Words:
        """The data of the frames at ``rows`` as numbers."""
        words: Words = self._records["data"][rows]
        return words

    def part(self, start: int, stop: int) -> RecordBlock:
        """The frames from position ``start`` on and before ``stop``."""
        cut = slice(start, stop)
        return RecordBlock(self.bus, self._records[cut], self.t_ns[cut], self.ids[cut])


def record_block(bus: str, channel_id: int, data: bytes | memoryview) -> RecordBlock | None:
    """The block of the uncompressed chunks of one topic, or None where a record has another form than ours."""
    layout = _layout(bus, channel_id)
    if not data or len(data) % layout.dtype.itemsize:
        return None
    records: CanArray = np.frombuffer(data, dtype=layout.dtype)
    if not all(bool((records[field] == raw).all()) for field, raw in layout.constant):
        return None
    way = np.ascontiguousarray(records["way"])
    if not bool(((way == _RX) | (way == _TX)).all()):
        return None
    t_ns, ids = np.ascontiguousarray(records["log_time"]), np.ascontiguousarray(records["id"])
    if not is_sorted(t_ns):
        order = np.argsort(t_ns, kind="stable")
        records, t_ns, ids = records[order], t_ns[order], ids[order]
    return RecordBlock(bus, records, t_ns, ids)
