"""Opens a recording: our own files, packed ones, unfinished ones and damaged ones.

A finished file is read by its summary. Any other is scanned; what is damaged is left out and listed. With ``strict``
damage is an error instead.
"""

from __future__ import annotations

import json
import mmap
import struct
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from heapq import heapify, heappop, heapreplace
from pathlib import Path
from types import MappingProxyType
from typing import Final, NamedTuple, TypeVar

import numpy as np
from mcap.records import Attachment, Channel, Chunk, ChunkIndex, Header, Metadata, Schema

from app.errors import RecordingError
from app.model.description import Bus, Description
from app.recording.cdr import (
    MESSAGE_FIXED,
    OP_MESSAGE,
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
from app.recording.chunks import ANY_CHANNEL, Body, ChunkPlace, chunk_data, read_chunk, split_body
from app.recording.content import (
    METADATA_BIT_RATES,
    METADATA_CHUNK_CHANNELS,
    METADATA_NODES,
    METADATA_ORDERS,
    METADATA_PROTOCOLS,
    METADATA_RECORDING,
    METADATA_SERVERS,
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
from app.recording.file_bytes import FileBytes
from app.recording.foreign import is_foreign, read_foreign
from app.recording.loose import bodies_in, frames_in, messages_in, payloads_in
from app.recording.node_table import OrderTable, ServerTable, described, read_orders, read_protocols, read_servers
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
from app.wire.frame import Direction, Fdl, Frame

_PREFIX: Final = RECORD_PREFIX.size + MESSAGE_FIXED
_MESSAGE: Final = bytes((OP_MESSAGE,))
_AROUND: Final = 1 << 20
_FRAME_TYPES: Final = (CAN_FRAME.name, TELEGRAM.name)
_T = TypeVar("_T")


class Totals(NamedTuple):
    """What the end of a file says: frames in this file, frames lost by the recording until then."""

    frames: int
    lost: int
    closed_ns: int


class Recording:
    """An open recording file. Use as a context manager, or call ``close``.

    ``finished``: the file was closed properly. ``damages`` lists what could not be used; where the file was not
    scanned it grows as damaged chunks are met.
    """

    def __init__(self, path: Path, strict: bool = False) -> None:
        self.path = path
        self._strict = strict
        mapped = _map(path)
        self._data: Bytes | FileBytes = mapped
        try:
            self._open(mapped)
        except BaseException:
            self.close()
            raise

    def _open(self, data: Bytes) -> None:
        check_head(data, self.path.name)
        self.damages: list[Damage] = []
        self._rest = b""
        self.foreign = is_foreign(data)
        if self.foreign:
            self._open_foreign(data)
        else:
            self._open_ours(data)
        recording = self.metadata.get(METADATA_RECORDING, {})
        number = recording.get("schema", str(SCHEMA_NUMBER))
        if number != str(SCHEMA_NUMBER):
            raise self._error(0, f"recording schema {number} is not known")

    def _open_ours(self, data: Bytes) -> None:
        self.finished = is_finished(data)
        summary = read_summary(data)
        chunks = None if summary is None else self._by_summary(summary)
        if chunks is None or summary is None:
            result = scan(data, self.path.name)
            summary, chunks = self._by_scan(result)
        self._take(summary, chunks)

    def _open_foreign(self, data: Bytes) -> None:
        found = read_foreign(data)
        self.finished = found.finished
        self.damages.extend(found.damages)
        self._metadata = found.metadata
        self._rest = found.partial
        places = found.places
        if self._rest:
            times = messages_in(self._rest).t_ns
            if len(times):
                places.append(ChunkPlace(int(times.min()), int(times.max()), found.end, 0, ANY_CHANNEL))
        self._take(found.summary, places)
        if self._strict and found.damages:
            raise self._damage_error(found.summary, found.damages[0], found.end)

    def _take(self, summary: Summary, chunks: list[ChunkPlace]) -> None:
        self._chunks = sorted(chunks)
        self.channels: Mapping[int, Channel] = summary.channels
        self.schemas: Mapping[int, Schema] = summary.schemas
        self._message_counts = summary.messages
        self._attachment_spans = [(index.offset, index.length) for index in summary.attachments]

    def _by_summary(self, summary: Summary) -> list[ChunkPlace] | None:
        """The chunks by the summary, or None where it leads nowhere and the file must be scanned."""
        try:
            self._metadata = [parse(Metadata, self._body(index.offset, index.length)) for index in summary.metadata]
            return [self._chunk_at(index, n) for n, index in enumerate(summary.chunks)]
        except ValueError:
            return None

    def _chunk_at(self, index: ChunkIndex, number: int) -> ChunkPlace:
        channel_id = next(iter(index.message_index_offsets), None)
        if channel_id is None:
            packed = self.metadata.get(METADATA_CHUNK_CHANNELS, {}).get("ids", "").split()
            channel_id = int(packed[number]) if number < len(packed) else self._body_of(_plain(index)).channel_id
        return _plain(index)._replace(channel_id=channel_id)

    def _by_scan(self, result: Scan) -> tuple[Summary, list[ChunkPlace]]:
        self.damages.extend(result.damages)
        self._metadata = result.metadata
        if self._strict and result.damages:
            raise self._damage_error(result.summary, result.damages[0], result.end)
        pairs = zip(result.summary.chunks, result.chunk_channels, strict=True)
        places = [_plain(index)._replace(channel_id=channel_id) for index, channel_id in pairs]
        if result.partial is not None:
            self._rest = result.partial.data
            places.append(_of_body(result.partial, result.end))
        return result.summary, places

    def _damage_error(self, summary: Summary, first: Damage, end: int) -> RecordingError:
        frames = sum(self._is_bus(summary, n) * count for n, count in summary.messages.items())
        return self._error(first.offset, first.detail, recovered_frames=frames, recovered_bytes=end)

    @staticmethod
    def _is_bus(summary: Summary, channel_id: int) -> bool:
        channel = summary.channels.get(channel_id)
        schema = None if channel is None else summary.schemas.get(channel.schema_id)
        return schema is not None and schema.name in _FRAME_TYPES

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file. May be called twice."""
        if isinstance(self._data, FileBytes):
            self._data.close()
        else:
            unmap(self._data)

    def keep(self) -> None:
        """To be held for long: maps the file no more, for a mapped file that somebody cuts ends the process.

        Raises ``RecordingError`` where it cannot be opened any more.
        """
        try:
            held = FileBytes(self.path)
        except OSError as error:
            raise self._error(0, error.strerror or str(error)) from error
        self.close()
        self._data = held

    # What the file says about itself.

    @property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """All metadata tables by name; of equal names the last one."""
        return MappingProxyType({record.name: record.metadata for record in self._metadata})

    @property
    def descriptions(self) -> Mapping[tuple[str, int], Description]:
        """What describes the nodes that the file names, by bus and node."""
        return described(self.metadata.get(METADATA_NODES, {}))

    @property
    def servers(self) -> ServerTable:
        """Where the nodes of Modbus TCP buses listened, by bus and node."""
        return read_servers(self.metadata.get(METADATA_SERVERS, {}))

    @property
    def orders(self) -> OrderTable:
        """What a site says of the process data of nodes on PROFIBUS, by bus and node."""
        return read_orders(self.metadata.get(METADATA_ORDERS, {}))

    @cached_property
    def kinds(self) -> Mapping[str, Bus]:
        """What is spoken on each bus: as the file says, else as its messages show."""
        found = {bus: Bus.MODBUS_TCP for bus, _ in self.servers}
        found |= read_protocols(self.metadata.get(METADATA_PROTOCOLS, {}))
        for channel in self.channels.values():
            bus, name = channel.topic[1:], self._type_name(channel)
            if bus not in found and name in _FRAME_TYPES:
                found[bus] = Bus.CANOPEN if name == CAN_FRAME.name else self._kind_of_telegrams(bus)
        return found

    def _kind_of_telegrams(self, bus: str) -> Bus:
        for place in self.telegram_chunks((bus,)):
            try:
                frames = self.telegrams(place)
            except ValueError:
                continue  # who reads it for its content tells the damage
            if frames:
                return Bus.PROFIBUS_DP if isinstance(frames[0].payload, Fdl) else Bus.MODBUS_TCP
        return Bus.MODBUS_TCP

    @property
    def info(self) -> RecordingInfo:
        """What the recording is of; nothing is known of files of others.

        Raises ``RecordingError`` where a file of ours does not say.
        """
        tables = self.metadata
        recording = tables.get(METADATA_RECORDING, {} if self.foreign else None)
        if recording is None:
            raise self._error(0, "no recording of this bench")
        return RecordingInfo(
            turbine=recording.get("turbine", ""),
            who=recording.get("who", ""),
            bit_rates={bus: self._int(rate) for bus, rate in tables.get(METADATA_BIT_RATES, {}).items()},
            nodes=dict(tables.get(METADATA_NODES, {})),
            versions=dict(tables.get(METADATA_VERSIONS, {})),
            servers=dict(tables.get(METADATA_SERVERS, {})),
            protocols=dict(tables.get(METADATA_PROTOCOLS, {})),
            orders=dict(tables.get(METADATA_ORDERS, {})),
        )

    @property
    def identity(self) -> Identity:
        """Which file of which recording this is; a file of others is the only one of none.

        Raises ``RecordingError`` where a file of ours does not say.
        """
        recording = self.metadata.get(METADATA_RECORDING, {"part": "1"} if self.foreign else None)
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
    def frame_count(self) -> int:
        """Number of frames of all buses, by the summary or the scan."""
        carrying = (n for n, channel in self.channels.items() if self._type_name(channel) in _FRAME_TYPES)
        return sum(self._message_counts.get(number, 0) for number in carrying)

    @property
    def span_ns(self) -> tuple[int, int] | None:
        """Times of the first and the last frame's chunk borders, or None without frames."""
        chunks = [chunk for chunk in self._chunks if self._may_hold(chunk, *_FRAME_TYPES)]
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
        try:
            length = RECORD_PREFIX.unpack(self._data[len(MAGIC) : end])[1]
            return parse(Header, self._data[end : end + length]).library
        except (ValueError, struct.error):
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
                data = self.unpacked(chunk)
                for body in bodies_in(data) if self.foreign else (split_body(data),):
                    yield body, n / len(self._chunks)
            except ValueError as error:
                self._damaged(chunk.offset, chunk.length, str(error))

    # Chunks of CAN frames, for who reads by columns.

    def can_chunks(self, buses: Collection[str] | None = None) -> list[ChunkPlace]:
        """The chunks of CAN frames of ``buses`` (None: all) by time; of files of others all chunks."""
        if self.foreign:
            return list(self._chunks)
        return [
            place
            for place in self._chunks
            if self._may_hold(place, CAN_FRAME.name)
            and (buses is None or self.channels[place.channel_id].topic[1:] in buses)
        ]

    def telegram_chunks(self, buses: Collection[str] | None = None) -> list[ChunkPlace]:
        """The chunks of telegrams of ``buses`` (None: all) by time; none of files of others."""
        return [
            place
            for place in self._chunks
            if not self.foreign
            and place.channel_id != ANY_CHANNEL
            and self._may_hold(place, TELEGRAM.name)
            and (buses is None or self.channels[place.channel_id].topic[1:] in buses)
        ]

    def telegrams(self, place: ChunkPlace) -> list[Frame]:
        """Those of a chunk of telegrams. Raises ``ValueError`` where it is damaged."""
        return [frame for _, frame in self._frames_of(place)]

    def unpacked(self, place: ChunkPlace) -> bytes:
        """The uncompressed records of a chunk. Raises ``ValueError`` where it is damaged."""
        return chunk_data(self.chunk(place))

    def chunk(self, place: ChunkPlace) -> Chunk:
        """The chunk as it stands in the file. Raises ``ValueError`` where it is none."""
        record = self._data[place.offset : place.offset + place.length] if place.length else self._rest
        if not place.length or record[:1] == _MESSAGE:  # the rest of a cut chunk, or messages outside chunks
            return Chunk("", record, place.end_ns, place.start_ns, 0, len(record))
        return read_chunk(record)

    def leave_out(self, place: ChunkPlace, detail: str) -> None:
        """Lists a chunk that cannot be read in ``damages``; with ``strict`` it raises ``RecordingError``."""
        self._damaged(place.offset, place.length, detail)

    def release(self, places: Sequence[ChunkPlace]) -> None:
        """Gives the memory of chunks back that were read and are not needed soon; the file stays mapped."""
        if not isinstance(self._data, mmap.mmap) or not hasattr(mmap, "MADV_DONTNEED"):
            return
        # What stands around a chunk (its message index) was mapped with it, by whole stretches.
        start = max(0, min(place.offset for place in places) - _AROUND) // mmap.PAGESIZE * mmap.PAGESIZE
        end = min(len(self._data), max(place.offset + place.length for place in places) + _AROUND)
        if start >= end:  # a damaged index names a place behind the end of the file
            return
        self._data.madvise(mmap.MADV_DONTNEED, start, end - start)

    # What was recorded.

    def frames(self, start_ns: int | None = None, end_ns: int | None = None) -> Iterator[Frame]:
        """The frames of all buses by time, from ``start_ns`` on and before ``end_ns``."""
        return self._merged(_FRAME_TYPES, self._foreign_frames if self.foreign else self._frames_of, start_ns, end_ns)

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
        def messages(place: ChunkPlace) -> Iterator[tuple[int, _T]]:
            data = self.unpacked(place)
            if self.foreign:
                found: Iterable[tuple[int, bytes]] = payloads_in(data, self.channels, self.schemas, message_type.name)
            else:
                found = payloads(split_body(data))
            return ((t_ns, decode(payload)) for t_ns, payload in found)

        return self._merged((message_type.name,), messages, start_ns, end_ns)

    def _merged(
        self,
        names: Collection[str],
        messages_of: Callable[[ChunkPlace], Iterator[tuple[int, _T]]],
        start_ns: int | None,
        end_ns: int | None,
    ) -> Iterator[_T]:
        """Opens each chunk not before its first message's turn has come, and merges the open ones by time."""
        first = -1 if start_ns is None else start_ns
        beyond = 1 << 64 if end_ns is None else end_ns
        waiting: list[tuple[int, int, Iterator[tuple[int, _T]], _T | None]] = [
            (chunk.start_ns, n, self._chunk_messages(chunk, messages_of), None)
            for n, chunk in enumerate(self._chunks)
            if self._may_hold(chunk, *names) and chunk.end_ns >= first and chunk.start_ns < beyond
        ]
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
        self, chunk: ChunkPlace, messages_of: Callable[[ChunkPlace], Iterator[tuple[int, _T]]]
    ) -> Iterator[tuple[int, _T]]:
        try:
            yield from messages_of(chunk)
        except (ValueError, KeyError) as error:
            self._damaged(chunk.offset, chunk.length, str(error))

    def _foreign_frames(self, place: ChunkPlace) -> Iterator[tuple[int, Frame]]:
        found = frames_in(self.unpacked(place), self.channels, self.schemas)
        for reason, count in found.left_out.items():
            self.leave_out(place, f"{count} messages: {reason}")
        return ((frame.t_ns, frame) for frame in found.frames)

    def _frames_of(self, place: ChunkPlace) -> Iterator[tuple[int, Frame]]:
        body = split_body(self.unpacked(place))
        channel = self.channels[body.channel_id]
        if self._type_name(channel) == TELEGRAM.name:
            return ((t_ns, decode_telegram(payload)) for t_ns, payload in payloads(body))
        layout = can_dtype(channel.topic[1:])
        stride = len(body.data) // len(body.times)
        if stride != layout.itemsize or len(body.data) % stride:
            return ((t_ns, decode_can_payload(payload)) for t_ns, payload in payloads(body))
        records = np.frombuffer(body.data, dtype=layout)
        known = [frame_id(channel.topic[1:], direction).encode() for direction in Direction]
        if not np.isin(records["frame_id"], known).all():
            return ((t_ns, decode_can_payload(payload)) for t_ns, payload in payloads(body))
        return zip(body.times.tolist(), decode_can(channel.topic[1:], records), strict=True)

    # Bytes of the file.

    def _may_hold(self, chunk: ChunkPlace, *names: str) -> bool:
        """Whether messages of one of these types can be in a chunk."""
        channel = self.channels.get(chunk.channel_id)
        return chunk.channel_id == ANY_CHANNEL or (channel is not None and self._type_name(channel) in names)

    def _type_name(self, channel: Channel) -> str:
        schema = self.schemas.get(channel.schema_id)
        return "" if schema is None else schema.name

    def _body(self, offset: int, length: int) -> bytes:
        return self._data[offset + RECORD_PREFIX.size : offset + length]

    def _body_of(self, chunk: ChunkPlace) -> Body:
        return split_body(self.unpacked(chunk))

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


def _plain(index: ChunkIndex) -> ChunkPlace:
    return ChunkPlace(index.message_start_time, index.message_end_time, index.chunk_start_offset, index.chunk_length, 0)


def _of_body(body: Body, offset: int) -> ChunkPlace:
    return ChunkPlace(int(body.times[0]), int(body.times[-1]), offset, 0, body.channel_id)


def payloads(body: Body) -> Iterator[tuple[int, bytes]]:
    """Log time and payload of each message."""
    starts: Sequence[int] = body.offsets.tolist()
    ends = [*starts[1:], len(body.data)]
    for t_ns, start, end in zip(body.times.tolist(), starts, ends, strict=True):
        yield t_ns, body.data[start + _PREFIX : end]
