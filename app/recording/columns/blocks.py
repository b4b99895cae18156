"""The CAN frames of a recording as blocks: chunks of one topic put together, decompressed ahead by some threads."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterator
from typing import Any, Final, Generic, NamedTuple, TypeVar

import numpy as np
from mcap.records import Chunk

from app.recording.can_table import Block, CanColumns, Columns, Rows, Words, by_time, columns_of, concatenated
from app.recording.cdr import decode_can_payload
from app.recording.chunks import ANY_CHANNEL, MAX_CHUNK_BYTES, ChunkPlace, split_body, unpack_into
from app.recording.columns.buffers import Buffers
from app.recording.columns.order import InOrder
from app.recording.columns.pool import default_workers, mapped_ahead
from app.recording.columns.records import record_block
from app.recording.loose import can_frames
from app.recording.reader import Recording, payloads
from app.wire.frame import Frame

BLOCK_BYTES: Final = 1 << 20
"""Compressed chunks are put together up to here; about six times as much in memory."""
BATCH_BYTES: Final = 1 << 25
"""Unpacked chunks are put together up to here."""
_T = TypeVar("_T")


class Span(NamedTuple):
    """Times from ``start_ns`` on and before ``end_ns``; None is open."""

    start_ns: int | None = None
    end_ns: int | None = None

    def touches(self, place: ChunkPlace) -> bool:
        """Whether a chunk may have frames of this span."""
        return (self.start_ns is None or place.end_ns >= self.start_ns) and (
            self.end_ns is None or place.start_ns < self.end_ns
        )

    def cut(self, block: Block) -> Block:
        """The part of ``block`` within the span."""
        size = len(block.t_ns)
        first = 0 if self.start_ns is None else _before(block, self.start_ns)
        end = size if self.end_ns is None else _before(block, self.end_ns)
        return block if (first, end) == (0, size) else block.part(first, max(first, end))


def _before(block: Block, t_ns: int) -> int:
    """How many frames are before ``t_ns``."""
    return int(np.searchsorted(block.t_ns, np.uint64(min(max(t_ns, 0), (1 << 64) - 1)), "left"))


class Prepared(Generic[_T]):
    """A block with what was found out of it beforehand, by the thread that unpacked it. A part of it has no note."""

    def __init__(self, block: Block, note: _T) -> None:
        self.block, self.note = block, note
        self.bus, self.t_ns, self.ids = block.bus, block.t_ns, block.ids

    def gather(self, rows: Any) -> CanColumns:
        """The columns of the frames at ``rows``."""
        return self.block.gather(rows)

    def words(self, rows: Rows) -> Words:
        """The data of the frames at ``rows`` as numbers."""
        return self.block.words(rows)

    def part(self, start: int, stop: int) -> Block:
        """The frames from position ``start`` on and before ``stop``."""
        return self.block.part(start, stop)


class _Loaded(NamedTuple):
    places: list[ChunkPlace]
    blocks: list[Block]


def can_blocks(
    recording: Recording,
    buses: Collection[str] | None,
    span: Span,
    workers: int | None,
    prepare: Callable[[Block], Block] = lambda block: block,
) -> Iterator[Block]:
    """The CAN frames of ``buses`` (None: all) within ``span``, those of each bus in the order of time.

    ``prepare`` is called by the threads of the pool; blocks that overlap with others lose what it added.
    """
    orders: defaultdict[str, InOrder] = defaultdict(InOrder)
    buffers = Buffers()

    def load(places: list[ChunkPlace]) -> _Loaded:
        found = _unpacked(recording, places, buffers)
        blocks = (span.cut(block) for block in found if buses is None or block.bus in buses)
        return _Loaded(places, [prepare(block) for block in blocks if len(block.t_ns)])

    groups = _groups(recording, buses, span)
    for places, blocks in mapped_ahead(load, groups, workers or default_workers()):
        for block in blocks:
            yield from orders[block.bus].take(block)
        recording.release(places)
    for order in orders.values():
        yield from order.end()


def _groups(recording: Recording, buses: Collection[str] | None, span: Span) -> Iterator[list[ChunkPlace]]:
    """Chunks of a topic in groups, by the time of the first of each."""
    open_groups: dict[int, list[ChunkPlace]] = {}
    for place in recording.can_chunks(buses):
        if not span.touches(place):
            continue
        group = open_groups.setdefault(place.channel_id, [])
        group.append(place)
        if sum(each.length for each in group) < BLOCK_BYTES:
            continue
        for channel_id in [number for number, each in open_groups.items() if each[0] <= group[0]]:
            yield open_groups.pop(channel_id)
    yield from open_groups.values()


def _unpacked(recording: Recording, places: list[ChunkPlace], buffers: Buffers) -> Iterator[Block]:
    """The frames of chunks of one topic, as one block where all are of our own form; of files of others by bus."""
    channel_id = places[0].channel_id
    if channel_id == ANY_CHANNEL:
        yield from _foreign(recording, places)
        return
    bus = recording.channels[channel_id].topic[1:]
    for batch in _batches(recording, places):
        data, pieces = _joined(recording, batch, buffers)
        block = record_block(bus, channel_id, data)
        if block is not None:
            yield block
            continue
        for place, piece in pieces:
            block = record_block(bus, channel_id, piece)
            if block is not None:
                yield block
            else:
                yield from _one_by_one(recording, place, bytes(piece))


def _batches(recording: Recording, places: list[ChunkPlace]) -> Iterator[list[tuple[ChunkPlace, Chunk]]]:
    """The chunks that can be unpacked, in groups that do not take much memory."""
    batch: list[tuple[ChunkPlace, Chunk]] = []
    size = 0
    for place in places:
        try:
            chunk = recording.chunk(place)
            if not 0 < chunk.uncompressed_size <= MAX_CHUNK_BYTES:
                raise ValueError("chunk size out of range")
        except ValueError as error:
            recording.leave_out(place, str(error))
            continue
        if batch and size + chunk.uncompressed_size > BATCH_BYTES:
            yield batch
            batch, size = [], 0
        batch.append((place, chunk))
        size += chunk.uncompressed_size
    if batch:
        yield batch


def _joined(
    recording: Recording, batch: list[tuple[ChunkPlace, Chunk]], buffers: Buffers
) -> tuple[memoryview, list[tuple[ChunkPlace, memoryview]]]:
    """The records of all chunks that are whole behind each other, and those of each."""
    whole = buffers.take(sum(chunk.uncompressed_size for _, chunk in batch))
    pieces, at = [], 0
    for place, chunk in batch:
        piece = whole[at : at + chunk.uncompressed_size]
        try:
            unpack_into(chunk, piece)
        except ValueError as error:
            recording.leave_out(place, str(error))
            continue
        pieces.append((place, piece))
        at += len(piece)
    return whole[:at], pieces


def _foreign(recording: Recording, places: list[ChunkPlace]) -> Iterator[Block]:
    pieces: defaultdict[str, list[CanColumns]] = defaultdict(list)
    for place in places:
        data = _data(recording, place)
        if data is None:
            continue
        try:
            found = can_frames(data, recording.channels, recording.schemas)
        except ValueError as error:
            recording.leave_out(place, str(error))
            continue
        for reason, count in found.left_out.items():
            recording.leave_out(place, f"{count} messages: {reason}")
        for bus, columns in found.buses.items():
            pieces[bus].append(columns)
    for columns in map(concatenated, pieces.values()):
        yield Columns(by_time(columns))


def _data(recording: Recording, place: ChunkPlace) -> bytes | None:
    try:
        return recording.unpacked(place)
    except ValueError as error:
        recording.leave_out(place, str(error))
        return None


def _one_by_one(recording: Recording, place: ChunkPlace, data: bytes) -> Iterator[Block]:
    """The frames of a chunk whose records have another form than ours, by bus."""
    frames: defaultdict[str, list[Frame]] = defaultdict(list)
    try:
        for t_ns, payload in payloads(split_body(data)):
            frame = decode_can_payload(payload)
            frames[frame.bus].append(frame._replace(t_ns=t_ns))
    except ValueError as error:
        recording.leave_out(place, str(error))
    for bus, found in frames.items():
        yield Columns(by_time(columns_of(bus, found)))
