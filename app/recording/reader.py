"""Opens a recording: our own files, packed ones, unfinished ones and damaged ones.

A finished file is read by its summary. Any other is scanned; what is damaged is left out and listed. With ``strict``
damage is an error instead.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from heapq import heapify, heappop, heapreplace
from pathlib import Path
from types import MappingProxyType
from typing import Final, NamedTuple, TypeVar

import numpy as np
from mcap.records import Attachment, Channel, Chunk, ChunkIndex, Header, Metadata, Schema

from app.errors import RecordingError
from app.recording.cdr import (
    MESSAGE_FIXED,
    RECORD_PREFIX,
    ClockReading,
    can_dtype,
    decode_can,
    decode_can_payload,
    decode_clock,
    decode_telegram,
    decode_texts,
    frame_id,
)
from app.recording.chunks import Body, chunk_data, split_body
from app.recording.content import (
    METADATA_BIT_RATES,
    METADATA_CHUNK_CHANNELS,
    METADATA_NODES,
    METADATA_RECORDING,
    METADATA_TOTALS,
    METADATA_VERSIONS,
    SCHEMA_NUMBER,
    AttachedFile,
    Event,
    EventKind,
    Keyframe,
    RecordingInfo,
    from_stored,
)
from app.recording.part import Identity
from app.recording.scan import (
    Bytes,
    Damage,
    DamageReason,
    Scan,
    check_head,
    is_finished,
    map_file,
    parse,
    parse_attachment,
    read_summary,
    scan,
    unmap,
)
from app.recording.schemas import CAN_FRAME, CLOCK, EVENT, STATE, TELEGRAM, MessageType
from app.recording.summary import MAGIC, Summary
from app.wire.frame import Direction, Frame

_PREFIX: Final = RECORD_PREFIX.size + MESSAGE_FIXED
_T = TypeVar("_T")


class Totals(NamedTuple):
    """What the end of a file says: frames in this file, frames lost by the recording until then."""

    frames: int
    lost: int
    closed_ns: int


class _ChunkAt(NamedTuple):
    start_ns: int
    end_ns: int
    offset: int
    length: int
    channel_id: int


class Recording:
    """An open recording file. Use as a context manager, or call ``close``.

    ``finished``: the file was closed properly. ``damages`` lists what could not be used; where the file was not
    scanned it grows as damaged chunks are met.
    """

    def __init__(self, path: Path, strict: bool = False) -> None:
        self.path = path
        self._strict = strict
        self._data = _map(path)
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def _open(self) -> None:
        check_head(self._data, self.path.name)
        self.finished = is_finished(self._data)
        self.damages: list[Damage] = []
        self._partial: Body | None = None
        summary = read_summary(self._data)
        chunks = None if summary is None else self._by_summary(summary)
        if chunks is None or summary is None:
            result = scan(self._data, self.path.name)
            summary, chunks = self._by_scan(result)
        self._chunks = sorted(chunks)
        self.channels: Mapping[int, Channel] = summary.channels
        self.schemas: Mapping[int, Schema] = summary.schemas
        self._message_counts = summary.messages
        self._attachment_spans = [(index.offset, index.length) for index in summary.attachments]
        recording = self.metadata.get(METADATA_RECORDING, {})
        number = recording.get("schema", str(SCHEMA_NUMBER))
        if number != str(SCHEMA_NUMBER):
            raise self._error(0, f"recording schema {number} is not known")

    def _by_summary(self, summary: Summary) -> list[_ChunkAt] | None:
        """The chunks by the summary, or None where it leads nowhere and the file must be scanned."""
        try:
            self._metadata = [parse(Metadata, self._body(index.offset, index.length)) for index in summary.metadata]
            return [self._chunk_at(index, n) for n, index in enumerate(summary.chunks)]
        except ValueError:
            return None

    def _chunk_at(self, index: ChunkIndex, number: int) -> _ChunkAt:
        channel_id = next(iter(index.message_index_offsets), None)
        if channel_id is None:
            packed = self.metadata.get(METADATA_CHUNK_CHANNELS, {}).get("ids", "").split()
            channel_id = int(packed[number]) if number < len(packed) else self._body_of(_plain(index)).channel_id
        return _plain(index)._replace(channel_id=channel_id)

    def _by_scan(self, result: Scan) -> tuple[Summary, list[_ChunkAt]]:
        self.damages.extend(result.damages)
        self._metadata = result.metadata
        self._partial = result.partial
        if self._strict and result.damages:
            frames = sum(self._is_bus(result.summary, n) * count for n, count in result.summary.messages.items())
            first = result.damages[0]
            raise self._error(first.offset, first.detail, recovered_frames=frames, recovered_bytes=result.end)
        pairs = zip(result.summary.chunks, result.chunk_channels, strict=True)
        return result.summary, [_plain(index)._replace(channel_id=channel_id) for index, channel_id in pairs]

    @staticmethod
    def _is_bus(summary: Summary, channel_id: int) -> bool:
        schema = summary.schemas.get(summary.channels[channel_id].schema_id)
        return schema is not None and schema.name in (CAN_FRAME.name, TELEGRAM.name)

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file. May be called twice."""
        unmap(self._data)

    # What the file says about itself.

    @property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """All metadata tables by name; of equal names the last one."""
        return MappingProxyType({record.name: record.metadata for record in self._metadata})

    @property
    def info(self) -> RecordingInfo:
        """What the recording is of. Raises ``RecordingError`` where the file does not say."""
        tables = self.metadata
        recording = tables.get(METADATA_RECORDING)
        if recording is None:
            raise self._error(0, "no recording of this bench")
        return RecordingInfo(
            turbine=recording.get("turbine", ""),
            who=recording.get("who", ""),
            bit_rates={bus: self._int(rate) for bus, rate in tables.get(METADATA_BIT_RATES, {}).items()},
            nodes=dict(tables.get(METADATA_NODES, {})),
            versions=dict(tables.get(METADATA_VERSIONS, {})),
        )

    @property
    def identity(self) -> Identity:
        """Which file of which recording this is. Raises ``RecordingError`` where the file does not say."""
        recording = self.metadata.get(METADATA_RECORDING)
        if recording is None:
            raise self._error(0, "no recording of this bench")
        number, started_ns, created_ns = (
            self._int(recording.get(key, "0")) for key in ("part", "started_ns", "created_ns")
        )
        return Identity(recording.get("id", ""), number, started_ns, created_ns)

    @property
    def totals(self) -> Totals | None:
        """The totals at the end of a file that was closed properly, else None."""
        table = self.metadata.get(METADATA_TOTALS)
        if table is None:
            return None
        return Totals(*(self._int(table.get(key, "0")) for key in Totals._fields))

    @property
    def topics(self) -> Mapping[str, int]:
        """Number of messages by topic."""
        return {channel.topic: self._message_counts.get(number, 0) for number, channel in self.channels.items()}

    @property
    def span_ns(self) -> tuple[int, int] | None:
        """Times of the first and the last frame's chunk borders, or None without frames."""
        chunks = [chunk for chunk in self._chunks if self._schema_name(chunk) in (CAN_FRAME.name, TELEGRAM.name)]
        if not chunks:
            return None
        return min(chunk.start_ns for chunk in chunks), max(chunk.end_ns for chunk in chunks)

    def attachments(self) -> list[AttachedFile]:
        """The files inside the file; damaged ones are left out and listed in ``damages``."""
        found = []
        for record in self.attachment_records():
            stored = AttachedFile(record.name, record.media_type, record.data)
            try:
                found.append(from_stored(stored))
            except ValueError as error:
                raise self._error(0, str(error)) from error
        return found

    # Records as they stand in the file, for who writes another file of them.

    @property
    def library(self) -> str:
        """What wrote the file, as its header says."""
        end = len(MAGIC) + RECORD_PREFIX.size
        length = RECORD_PREFIX.unpack(self._data[len(MAGIC) : end])[1]
        try:
            return parse(Header, self._data[end : end + length]).library
        except ValueError:
            return ""

    @property
    def metadata_records(self) -> Sequence[Metadata]:
        """All metadata records in order."""
        return tuple(self._metadata)

    def attachment_records(self) -> Iterator[Attachment]:
        """The attachments with their times, in order."""
        for offset, length in self._attachment_spans:
            try:
                yield parse_attachment(self._body(offset, length))
            except ValueError as error:
                self._damaged(offset, length, str(error))

    def bodies(self) -> Iterator[tuple[Body, float]]:
        """The content of every chunk by time, with the share of the chunks that is done, 0 to 1."""
        for n, chunk in enumerate(self._chunks, 1):
            try:
                yield self._body_of(chunk), n / len(self._chunks)
            except ValueError as error:
                self._damaged(chunk.offset, chunk.length, str(error))
        if self._partial is not None:
            yield self._partial, 1.0

    # What was recorded.

    def frames(self, start_ns: int | None = None, end_ns: int | None = None) -> Iterator[Frame]:
        """The frames of all buses by time, from ``start_ns`` on and before ``end_ns``."""
        names = CAN_FRAME.name, TELEGRAM.name
        return self._merged(lambda chunk: self._schema_name(chunk) in names, self._frames_of, start_ns, end_ns)

    def keyframes(self, start_ns: int | None = None, end_ns: int | None = None) -> Iterator[Keyframe]:
        """The state keyframes by time."""

        def decode(payload: bytes) -> Keyframe:
            t_ns, _, text = decode_texts(payload, 1)
            return Keyframe(t_ns, json.loads(text))

        return self._messages(STATE, decode, start_ns, end_ns)

    def events(self, start_ns: int | None = None, end_ns: int | None = None) -> Iterator[Event]:
        """The events by time."""

        def decode(payload: bytes) -> Event:
            t_ns, bus, kind, text = decode_texts(payload, 2)
            return Event(t_ns, EventKind(kind), bus, json.loads(text))

        return self._messages(EVENT, decode, start_ns, end_ns)

    def clocks(self, start_ns: int | None = None, end_ns: int | None = None) -> Iterator[ClockReading]:
        """The pairings of the clocks by time."""
        return self._messages(CLOCK, decode_clock, start_ns, end_ns)

    def _messages(
        self, message_type: MessageType, decode: Callable[[bytes], _T], start_ns: int | None, end_ns: int | None
    ) -> Iterator[_T]:
        return self._merged(
            lambda chunk: self._schema_name(chunk) == message_type.name,
            lambda body: ((t_ns, decode(payload)) for t_ns, payload in _payloads(body)),
            start_ns,
            end_ns,
        )

    def _merged(
        self,
        wanted: Callable[[_ChunkAt], bool],
        decode: Callable[[Body], Iterator[tuple[int, _T]]],
        start_ns: int | None,
        end_ns: int | None,
    ) -> Iterator[_T]:
        """Opens each chunk not before its first message's turn has come, and merges the open ones by time."""
        first = -1 if start_ns is None else start_ns
        beyond = 1 << 64 if end_ns is None else end_ns
        waiting: list[tuple[int, int, Iterator[tuple[int, _T]], _T | None]] = [
            (chunk.start_ns, n, self._chunk_messages(chunk, decode), None)
            for n, chunk in enumerate(self._chunks)
            if wanted(chunk) and chunk.end_ns >= first and chunk.start_ns < beyond
        ]
        if self._partial is not None and wanted(_of_body(self._partial)):
            partial = self._partial
            waiting.append((int(partial.times[0]), len(self._chunks), decode(partial), None))
        heapify(waiting)
        while waiting:
            t_ns, n, messages, message = waiting[0]
            if message is not None and first <= t_ns < beyond:
                yield message
            following = next(messages, None)
            if following is None:
                heappop(waiting)
            else:
                heapreplace(waiting, (following[0], n, messages, following[1]))

    def _chunk_messages(
        self, chunk: _ChunkAt, decode: Callable[[Body], Iterator[tuple[int, _T]]]
    ) -> Iterator[tuple[int, _T]]:
        try:
            yield from decode(self._body_of(chunk))
        except (ValueError, KeyError) as error:
            self._damaged(chunk.offset, chunk.length, str(error))

    def _frames_of(self, body: Body) -> Iterator[tuple[int, Frame]]:
        channel = self.channels[body.channel_id]
        if self._type_name(channel) == TELEGRAM.name:
            return ((t_ns, decode_telegram(payload)) for t_ns, payload in _payloads(body))
        layout = can_dtype(channel.topic[1:])
        stride = len(body.data) // len(body.times)
        if stride != layout.itemsize or len(body.data) % stride:
            return ((t_ns, decode_can_payload(payload)) for t_ns, payload in _payloads(body))
        records = np.frombuffer(body.data, dtype=layout)
        known = [frame_id(channel.topic[1:], direction).encode() for direction in Direction]
        if not np.isin(records["frame_id"], known).all():
            return ((t_ns, decode_can_payload(payload)) for t_ns, payload in _payloads(body))
        return zip(body.times.tolist(), decode_can(channel.topic[1:], records), strict=True)

    # Bytes of the file.

    def _schema_name(self, chunk: _ChunkAt) -> str:
        channel = self.channels.get(chunk.channel_id)
        return "" if channel is None else self._type_name(channel)

    def _type_name(self, channel: Channel) -> str:
        schema = self.schemas.get(channel.schema_id)
        return "" if schema is None else schema.name

    def _body(self, offset: int, length: int) -> bytes:
        return self._data[offset + RECORD_PREFIX.size : offset + length]

    def _body_of(self, chunk: _ChunkAt) -> Body:
        return split_body(chunk_data(parse(Chunk, self._body(chunk.offset, chunk.length))))

    def _damaged(self, offset: int, length: int, detail: str) -> None:
        if self._strict:
            raise self._error(offset, detail)
        damage = Damage(offset, length, DamageReason.UNREADABLE, detail)
        if damage not in self.damages:
            self.damages.append(damage)

    def _int(self, text: str) -> int:
        try:
            return int(text)
        except ValueError as error:
            raise self._error(0, f"{text!r} is no number") from error

    def _error(self, offset: int, reason: str, **more: int) -> RecordingError:
        return RecordingError(file=self.path.name, offset=offset, reason=reason, **more)


def open_recording(path: Path, strict: bool = False) -> Recording:
    """Opens a recording.

    Raises ``RecordingError`` where the file cannot be read or is no recording, and with ``strict`` where it is
    damaged or unfinished; its details then also name ``recovered_frames`` and ``recovered_bytes``.
    """
    return Recording(path, strict)


def _map(path: Path) -> Bytes:
    try:
        return map_file(path)
    except OSError as error:
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error


def _plain(index: ChunkIndex) -> _ChunkAt:
    return _ChunkAt(index.message_start_time, index.message_end_time, index.chunk_start_offset, index.chunk_length, 0)


def _of_body(body: Body) -> _ChunkAt:
    return _ChunkAt(int(body.times[0]), int(body.times[-1]), 0, 0, body.channel_id)


def _payloads(body: Body) -> Iterator[tuple[int, bytes]]:
    """Log time and payload of each message."""
    starts: Sequence[int] = body.offsets.tolist()
    ends = [*starts[1:], len(body.data)]
    for t_ns, start, end in zip(body.times.tolist(), starts, ends, strict=True):
        yield t_ns, body.data[start + _PREFIX : end]
