"""The last frames of a bus, kept so that any part of them can be decoded again with its context.

Frames lie in chunks, each with the decoder's state before its first one. A full chunk is packed: 30 bytes a CAN frame,
and nothing that the garbage collector must look at, where the frame itself takes some 300. Who looks back unpacks and
decodes what is looked at; while nobody looks, keeping a frame costs next to nothing.

The receive thread writes under its lock; readers take ``chunks()`` under the same lock and read them without.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, Final

from app.wire.frame import Adu, Fdl, Frame
from app.wire.trace import adu_packing, can_packing, fdl_packing
from app.wire.trace.packing import Packing
from app.wire.trace.tracer import Gap, Item

LIMIT: Final = 200_000
"""Items kept of a bus: 6 MB; 25 s of a full bus of 1 Mbit/s, some minutes of a usual one. ADUs are longer: 50 MB of a
dictionary that is read again and again, 10 MB of what else is asked. Telegrams of PROFIBUS take 8 MB."""
CHUNK: Final = 1000

Snapshot = Mapping[str, Any]


class Chunk:
    """Items from number ``first`` on, and the state of the decoder before them."""

    __slots__ = ("_bus", "_gaps", "_items", "_packed", "_packing", "count", "end_ns", "first", "snapshot", "start_ns")

    def __init__(self, bus: str, first: int, snapshot: Snapshot, items: Sequence[Item] = ()) -> None:
        self._bus = bus
        self._items: list[Item] | None = list(items)
        self._packed = b""
        self._packing: Packing = can_packing
        self._gaps: dict[int, Gap] = {}
        self.first = first
        self.snapshot = snapshot
        self.count = len(items)
        self.start_ns = items[0][0] if items else 0
        self.end_ns = items[-1][0] if items else 0

    def extend(self, items: Sequence[Item]) -> None:
        """Append; not after ``pack``."""
        if self._items is None:
            raise ValueError("the chunk is packed")
        if not self.count:
            self.start_ns = items[0][0]
        self._items += items
        self.count += len(items)
        self.end_ns = items[-1][0]

    def pack(self) -> list[Item]:
        """Keep as bytes from now on; gives the items as they were."""
        items = self._items or []
        self._gaps = {at: item for at, item in enumerate(items) if isinstance(item, Gap)}
        frames = [item for item in items if not isinstance(item, Gap)]
        self._packing = _packing_of(frames)
        self._packed = self._packing.pack(frames)
        self._items = None
        return items

    def copy(self) -> Chunk:
        """The same items; what is appended to this one later is not in it."""
        return self if self._items is None else Chunk(self._bus, self.first, self.snapshot, self._items)

    def items(self) -> Iterator[Item]:
        """All items in order."""
        if self._items is not None:
            return iter(self._items)
        return self._unpacked()

    def _unpacked(self) -> Iterator[Item]:
        frames = self._packing.unpack(self._packed, self._bus)
        for at in range(self.count):
            yield self._gaps[at] if at in self._gaps else next(frames)


def _packing_of(frames: Sequence[Frame]) -> Packing:
    if frames and isinstance(frames[0].payload, Adu):
        return adu_packing
    return fdl_packing if frames and isinstance(frames[0].payload, Fdl) else can_packing


class FrameRing:
    """The last ``limit`` items of ``bus``. ``snapshot`` gives the state of the decoder that is fed with the same items.

    ``packed`` is called with the items of each chunk that is full.
    """

    def __init__(
        self,
        bus: str,
        snapshot: Callable[[], Snapshot],
        limit: int = LIMIT,
        chunk: int = CHUNK,
        packed: Callable[[Sequence[Item]], None] | None = None,
    ) -> None:
        self._bus = bus
        self._snapshot = snapshot
        self._packed = packed
        self._limit = limit
        self._chunk = chunk
        self._chunks: deque[Chunk] = deque()
        self.total = 0
        """Items ever taken: the number of the next one."""

    def extend(self, items: Sequence[Item]) -> None:
        """Take items, before the decoder does."""
        if not items:
            return
        last = self._chunks[-1] if self._chunks else None
        if last is None or last.count >= self._chunk:
            if last is not None:
                full = last.pack()
                if self._packed is not None:
                    self._packed(full)
            last = Chunk(self._bus, self.total, self._snapshot())
            self._chunks.append(last)
        last.extend(items)
        self.total += len(items)
        while self.total - self._chunks[0].first - self._chunks[0].count >= self._limit:
            self._chunks.popleft()

    def renew(self) -> None:
        """Forget all: what is known of the nodes has changed, so that the states no longer fit."""
        self._chunks.clear()

    def chunks(self) -> list[Chunk]:
        """All chunks, oldest first."""
        chunks = list(self._chunks)
        return [*chunks[:-1], chunks[-1].copy()] if chunks else []

    def open_items(self) -> list[Item]:
        """Items of the chunk that is not yet full."""
        return list(self._chunks[-1].items()) if self._chunks else []

    def since(self, number: int) -> tuple[int, list[Item]]:
        """Items from ``number`` on, and the number of the first of them: a later one where that is gone."""
        first, found = self.total, []
        for chunk in reversed(self._chunks):
            if chunk.first + chunk.count <= number:
                break
            skipped = max(0, number - chunk.first)
            found.append(list(islice(chunk.items(), skipped, None)))
            first = chunk.first + skipped
        return first, [item for part in reversed(found) for item in part]
