"""Reads an MCAP file from its beginning without trusting it: what is whole, what is damaged, and where.

A record whose frame is intact but whose content is not is left out; where the framing itself is lost, the next chunk
whose CRC agrees is looked for. Nothing here raises on damaged bytes but the lack of an MCAP head.
"""

from __future__ import annotations

import mmap
import struct
import zlib
from dataclasses import dataclass, field
from enum import Enum
from io import BytesIO
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from app.errors import RecordingError
from app.recording.cdr import RECORD_PREFIX
from app.recording.chunks import Body, chunk_data, message_index, partial_body, split_body
from app.recording.schemas import (
    ALL_TYPES,
    CAN_FRAME,
    FIXED_TOPICS,
    MESSAGE_ENCODING,
    SCHEMA_ENCODING,
    TELEGRAM,
    bus_topic,
)
from app.recording.summary import FOOTER_SIZE, MAGIC, Summary

Bytes = bytes | mmap.mmap
_CHUNK_MARK: Final = b"\x04\x00\x00\x00zstd"
_CHUNK_MARK_AT: Final = 37  # where the mark stands in a chunk record
_CHUNK_PACKED_AT: Final = 49  # where the compressed bytes begin in a chunk record
_DATA_END_SIZE: Final = 13
_INDEX_HEAD: Final = struct.Struct("<QQQQI")  # a chunk index: times, place and length of the chunk, bytes of the next
_INDEX_OFFSET: Final = struct.Struct("<HQ")  # topic, place of its message index
_INDEX_NAME: Final = struct.Struct("<QI")  # length of the message indexes, bytes of the compression's name
_INDEX_SIZES: Final = struct.Struct("<QQ")
_UNREADABLE = (McapError, struct.error, ValueError, OverflowError)
KNOWN_SCHEMAS: Final = {
    number: Schema(id=number, data=known.text.encode(), encoding=SCHEMA_ENCODING, name=known.name)
    for number, known in enumerate(ALL_TYPES, 1)
}
"""The schemas are the same in every recording, so that a damaged declaration costs nothing."""
_R = TypeVar("_R", bound=McapRecord)
_DATA_OPCODES: Final = frozenset(
    {
        Opcode.HEADER,
        Opcode.SCHEMA,
        Opcode.CHANNEL,
        Opcode.CHUNK,
        Opcode.MESSAGE_INDEX,
        Opcode.ATTACHMENT,
        Opcode.METADATA,
        Opcode.DATA_END,
    }
)


class DamageReason(Enum):
    """What is wrong with a stretch of a file."""

    TRUNCATED = "truncated"
    UNREADABLE = "unreadable"


class Damage(NamedTuple):
    """``length`` bytes at ``offset`` that could not be used."""

    offset: int
    length: int
    reason: DamageReason
    detail: str


class Item(NamedTuple):
    """A whole record at ``offset``; ``length`` counts the message index behind a chunk too."""

    opcode: Opcode
    offset: int
    length: int


@dataclass
class Scan:
    """What a file holds. ``end`` is the offset behind the last whole record of the data section.

    ``finished``: the data section is closed and the file ends with a summary and the magic. ``partial`` holds the
    messages of a last chunk without its end.
    """

    library: str = ""
    finished: bool = False
    data_ended: bool = False
    end: int = len(MAGIC)
    items: list[Item] = field(default_factory=list)
    damages: list[Damage] = field(default_factory=list)
    summary: Summary = field(default_factory=Summary)
    chunk_channels: list[int] = field(default_factory=list)
    metadata: list[Metadata] = field(default_factory=list)
    partial: Body | None = None


def map_file(path: Path) -> Bytes:
    """The bytes of a file without reading it into memory. Close them with ``unmap``. Raises ``OSError``."""
    with path.open("rb") as file:
        if path.stat().st_size == 0:
            return b""
        return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)


def unmap(data: Bytes) -> None:
    """Gives a mapped file free. May be called twice."""
    if isinstance(data, mmap.mmap):
        data.close()


def parse(record_type: type[_R], body: bytes) -> _R:
    """A record from the bytes behind its length. Raises ``ValueError`` where they make no sense."""
    try:
        record: _R = record_type.read(ReadDataStream(BytesIO(body)))  # type: ignore[attr-defined]
    except _UNREADABLE as error:
        raise ValueError(f"{record_type.__name__}: {error}") from error
    return record


def is_finished(data: Bytes) -> bool:
    """Whether the file ends as a closed MCAP file does."""
    footer_at = len(data) - len(MAGIC) - FOOTER_SIZE
    if footer_at < len(MAGIC) or data[-len(MAGIC) :] != MAGIC:
        return False
    return RECORD_PREFIX.unpack(data[footer_at : footer_at + RECORD_PREFIX.size]) == (Opcode.FOOTER, FOOTER_SIZE - 9)


def check_head(data: Bytes, name: str) -> None:
    """Raises ``RecordingError`` where the file does not begin as an MCAP file does."""
    if data[: len(MAGIC)] != MAGIC:
        raise RecordingError(file=name, offset=0, reason="no MCAP file")


def scan(data: Bytes, name: str) -> Scan:
    """Goes through the whole file. Raises ``RecordingError`` only where ``check_head`` does."""
    check_head(data, name)
    return _Scanner(data).run()


class _Scanner:
    def __init__(self, data: Bytes) -> None:
        self._data = data
        self._size = len(data)
        self._result = Scan()
        # A damaged data section may have lost the declaration of a topic; the summary repeats them.
        known = read_summary(data)
        if known is not None:
            self._result.summary.channels.update(known.channels)
        self._result.summary.schemas.update(KNOWN_SCHEMAS)

    def run(self) -> Scan:
        at = len(MAGIC)
        while at < self._size and not self._result.data_ended:
            at = self._step(at)
        self._result.finished = self._result.data_ended and is_finished(self._data)
        return self._result

    def _frame(self, at: int) -> tuple[int, int] | None:
        """Opcode and end of the record at ``at``, or None where none can stand there."""
        if at + RECORD_PREFIX.size > self._size:
            return None
        opcode, length = RECORD_PREFIX.unpack(self._data[at : at + RECORD_PREFIX.size])
        end = at + RECORD_PREFIX.size + length
        return (opcode, end) if opcode in _DATA_OPCODES and end <= self._size else None

    def _step(self, at: int) -> int:
        """Takes the record at ``at`` or notes the damage; where to go on."""
        frame = self._frame(at)
        if frame is None:
            return self._resync(at, "no record")
        opcode, end = Opcode(frame[0]), frame[1]
        if opcode is Opcode.DATA_END:
            if end - at != _DATA_END_SIZE:
                return self._resync(at, "end of data of a wrong size")
            self._result.data_ended = True
            return end
        try:
            end = self._take(opcode, at, end)
        except ValueError as error:
            return self._leave_out(at, end, str(error))
        self._result.items.append(Item(opcode, at, end - at))
        self._result.end = end
        return end

    def _take(self, opcode: Opcode, at: int, end: int) -> int:
        """Puts a record into the result; where it ends, a message index counted in. Raises ``ValueError``."""
        body = self._data[at + RECORD_PREFIX.size : end]
        result = self._result
        if opcode is Opcode.CHUNK:
            return self._take_chunk(parse(Chunk, body), at, end)
        if opcode is Opcode.HEADER:
            result.library = parse(Header, body).library
        elif opcode is Opcode.SCHEMA:
            schema = parse(Schema, body)
            if schema != KNOWN_SCHEMAS.get(schema.id):
                raise ValueError("schema that no recording has")
        elif opcode is Opcode.CHANNEL:
            channel = parse(Channel, body)
            if not _plausible(channel):
                raise ValueError("topic that no recording has")
            result.summary.channels.setdefault(channel.id, channel)
        elif opcode is Opcode.ATTACHMENT:
            result.summary.add_attachment(parse_attachment(body), at, end - at)
        elif opcode is Opcode.METADATA:
            metadata = parse(Metadata, body)
            result.metadata.append(metadata)
            result.summary.add_metadata(metadata, at, end - at)
        else:
            raise ValueError("message index that belongs to no whole chunk")
        return end

    def _take_chunk(self, chunk: Chunk, at: int, end: int) -> int:
        body = split_body(chunk_data(chunk))
        if body.channel_id not in self._result.summary.channels:
            raise ValueError("chunk of a topic that is not declared")
        index_at, index_end = {}, self._message_index_end(body, end)
        if index_end > end:
            index_at[body.channel_id] = end
        self._result.summary.chunks.append(
            ChunkIndex(
                chunk_length=end - at,
                chunk_start_offset=at,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=int(body.times.max()),
                message_index_length=index_end - end,
                message_index_offsets=index_at,
                message_start_time=int(body.times.min()),
                uncompressed_size=len(body.data),
            )
        )
        self._result.summary.messages[body.channel_id] += len(body.times)
        self._result.chunk_channels.append(body.channel_id)
        return index_end

    def _message_index_end(self, body: Body, at: int) -> int:
        """Where the message index of a chunk ends, or ``at`` where the one that belongs to it does not stand there."""
        expected = message_index(body)
        return at + len(expected) if self._data[at : at + len(expected)] == expected else at

    def _leave_out(self, at: int, end: int, detail: str) -> int:
        """A record with a sound frame and damaged content; goes on behind it if that looks like a record again."""
        if end != self._size and self._frame(end) is None:
            return self._resync(at, detail)
        self._damage(at, end, DamageReason.UNREADABLE, detail)
        return end

    def _damage(self, at: int, end: int, reason: DamageReason, detail: str) -> None:
        self._result.damages.append(Damage(at, end - at, reason, detail))

    def _resync(self, at: int, detail: str) -> int:
        """Looks for the next chunk that is whole; the end of the file where there is none."""
        mark = self._data.find(_CHUNK_MARK, at + 1 + _CHUNK_MARK_AT)
        while mark >= 0:
            start = mark - _CHUNK_MARK_AT
            if self._whole_chunk_at(start):
                self._damage(at, start, DamageReason.UNREADABLE, detail)
                return start
            mark = self._data.find(_CHUNK_MARK, mark + 1)
        truncated = self._truncated_record_at(at)
        self._damage(at, self._size, DamageReason.TRUNCATED if truncated else DamageReason.UNREADABLE, detail)
        return self._size

    def _whole_chunk_at(self, start: int) -> bool:
        frame = self._frame(start)
        if frame is None or frame[0] != Opcode.CHUNK:
            return False
        try:
            chunk_data(parse(Chunk, self._data[start + RECORD_PREFIX.size : frame[1]]))
        except ValueError:
            return False
        return True

    def _truncated_record_at(self, at: int) -> bool:
        """Whether the file just ends inside the record at ``at``; keeps what can be read of a chunk."""
        head = self._data[at : at + _CHUNK_PACKED_AT]
        if len(head) < RECORD_PREFIX.size:
            return True
        opcode, length = RECORD_PREFIX.unpack(head[: RECORD_PREFIX.size])
        if opcode not in _DATA_OPCODES or at + RECORD_PREFIX.size + length <= self._size:
            return False
        if opcode == Opcode.CHUNK and head[_CHUNK_MARK_AT : _CHUNK_MARK_AT + 8] == _CHUNK_MARK:
            body = partial_body(self._data[at + _CHUNK_PACKED_AT : self._size])
            if body is not None and body.channel_id in self._result.summary.channels:
                self._result.partial = body
        return True


def _plausible(channel: Channel) -> bool:
    """Whether a recording can have this topic. No CRC covers a declaration, so what it says twice must agree."""
    schema = KNOWN_SCHEMAS.get(channel.schema_id)
    if schema is None or channel.message_encoding != MESSAGE_ENCODING:
        return False
    if schema.name in (CAN_FRAME.name, TELEGRAM.name):
        return channel.topic == bus_topic(channel.metadata.get("bus", ""))
    return FIXED_TOPICS.get(channel.topic) == schema.name


def parse_attachment(body: bytes) -> Attachment:
    """An attachment whose CRC agrees. Raises ``ValueError``."""
    if len(body) < 4 or zlib.crc32(body[:-4]) != int.from_bytes(body[-4:], "little"):
        raise ValueError("CRC of the attachment differs")
    return parse(Attachment, body)


def read_summary(data: Bytes) -> Summary | None:
    """The summary of a finished file, or None where there is none that agrees with its CRC."""
    if not is_finished(data):
        return None
    footer_at = len(data) - len(MAGIC) - FOOTER_SIZE
    try:
        footer = parse(Footer, data[footer_at + RECORD_PREFIX.size : footer_at + FOOTER_SIZE])
    except ValueError:
        return None
    if not len(MAGIC) <= footer.summary_start <= footer_at:
        return None
    covered = data[footer.summary_start : footer_at + FOOTER_SIZE - 4]
    if footer.summary_crc and zlib.crc32(covered) != footer.summary_crc:
        return None
    try:
        return _parse_summary(data, footer.summary_start, footer_at)
    except (ValueError, struct.error):
        return None


def _chunk_index(body: bytes) -> ChunkIndex:
    """As ``parse`` does, in a tenth of the time: an hour of a full bus has ten thousand. Raises ``struct.error``."""
    start_ns, end_ns, offset, length, offsets_size = _INDEX_HEAD.unpack_from(body)
    at = _INDEX_HEAD.size + offsets_size
    offsets = dict(_INDEX_OFFSET.iter_unpack(body[_INDEX_HEAD.size : at]))
    index_length, name_size = _INDEX_NAME.unpack_from(body, at)
    at += _INDEX_NAME.size
    compressed, uncompressed = _INDEX_SIZES.unpack_from(body, at + name_size)
    return ChunkIndex(
        chunk_length=length,
        chunk_start_offset=offset,
        compression=body[at : at + name_size].decode(),
        compressed_size=compressed,
        message_end_time=end_ns,
        message_index_length=index_length,
        message_index_offsets=offsets,
        message_start_time=start_ns,
        uncompressed_size=uncompressed,
    )


def _parse_summary(data: Bytes, at: int, end: int) -> Summary:
    summary = Summary()
    while at < end:
        opcode, length = RECORD_PREFIX.unpack(data[at : at + RECORD_PREFIX.size])
        body = data[at + RECORD_PREFIX.size : at + RECORD_PREFIX.size + length]
        if opcode == Opcode.SCHEMA:
            schema = parse(Schema, body)
            summary.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = parse(Channel, body)
            summary.channels[channel.id] = channel
        elif opcode == Opcode.CHUNK_INDEX:
            summary.chunks.append(_chunk_index(body))
        elif opcode == Opcode.ATTACHMENT_INDEX:
            summary.attachments.append(parse(AttachmentIndex, body))
        elif opcode == Opcode.METADATA_INDEX:
            summary.metadata.append(parse(MetadataIndex, body))
        elif opcode == Opcode.STATISTICS:
            summary.messages.update(parse(Statistics, body).channel_message_counts)
        at += RECORD_PREFIX.size + length
    return summary
