"""One file of a recording: takes batches, makes a chunk a topic of each, and syncs every chunk."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NamedTuple

from mcap.records import Attachment

from app.recording.cdr import MAX_T_NS, ClockReading, encode_can, encode_clock, encode_telegram, encode_texts, valid
from app.recording.chunks import Body, Level, can_body, compressor, encode_chunk, message_body
from app.recording.content import (
    METADATA_BIT_RATES,
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
    RecordingInfo,
    to_json,
    to_stored,
)
from app.recording.mcap_file import LIBRARY, McapFile, sync_directory
from app.recording.schemas import (
    ALL_TYPES,
    CAN_FRAME,
    CLOCK,
    CLOCK_TOPIC,
    EVENT,
    EVENTS_TOPIC,
    STATE,
    STATE_TOPIC,
    TELEGRAM,
    MessageType,
    bus_topic,
)
from app.wire.frame import Can, Frame

CHUNK_FRAMES: Final = 8192  # a backlog is cut into chunks of at most this many frames

BUSY_MESSAGES: Final = 2400  # more than a full bus of 500 kbit/s sends between two chunks: processor time goes first


@dataclass
class Batch:
    """What came together since the last chunks were closed."""

    frames: list[Frame] = field(default_factory=list)
    clocks: list[ClockReading] = field(default_factory=list)
    events: list[tuple[Event, str]] = field(default_factory=list)
    keyframes: list[tuple[int, str]] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.frames or self.clocks or self.events or self.keyframes)


class Identity(NamedTuple):
    """Which file of which recording this is. ``created_ns`` is of the file, ``started_ns`` of the recording."""

    recording: str
    number: int
    started_ns: int
    created_ns: int


class Part:
    """A recording's file. Methods raise ``OSError`` where the disk refuses."""

    def __init__(
        self,
        path: Path,
        identity: Identity,
        info: RecordingInfo,
        attachments: Iterable[AttachedFile] = (),
        library: str = LIBRARY,
    ) -> None:
        self.path = path
        self.frames = 0
        self.rejected = 0
        self.unwritten: list[Frame] = []
        """The frames that are not in the file because the disk refused."""
        self._file = McapFile(path, library)
        self._packer, self._fast_packer = compressor(Level.LIVE), compressor(Level.BUSY)
        self._channels: dict[tuple[str, MessageType], int] = {}
        try:
            self._write_head(identity, info, attachments)
        except OSError:
            self._file.close()
            with suppress(OSError):  # nothing is in it yet; where it cannot be removed, it is recovered as empty
                path.unlink()
            raise

    def _write_head(self, identity: Identity, info: RecordingInfo, attachments: Iterable[AttachedFile]) -> None:
        file = self._file
        file.add_metadata(
            METADATA_RECORDING,
            {
                "schema": str(SCHEMA_NUMBER),
                "id": identity.recording,
                "part": str(identity.number),
                "started_ns": str(identity.started_ns),
                "created_ns": str(identity.created_ns),
                "turbine": info.turbine,
                "who": info.who,
            },
        )
        file.add_metadata(METADATA_BIT_RATES, {bus: str(rate) for bus, rate in info.bit_rates.items()})
        file.add_metadata(METADATA_NODES, info.nodes)
        for name, table in (
            (METADATA_SERVERS, info.servers),
            (METADATA_PROTOCOLS, info.protocols),
            (METADATA_ORDERS, info.orders),
        ):
            if table:
                file.add_metadata(name, table)
        file.add_metadata(METADATA_VERSIONS, info.versions)
        for attachment in attachments:
            self.attach(attachment, identity.created_ns)
        self._schemas = {message_type: file.add_schema(message_type) for message_type in ALL_TYPES}
        for topic, message_type in ((CLOCK_TOPIC, CLOCK), (STATE_TOPIC, STATE), (EVENTS_TOPIC, EVENT)):
            self._channel(topic, message_type)
        for bus in (bus for bus in info.bit_rates if bus not in info.protocols):
            self._channel(bus_topic(bus), CAN_FRAME)
        sync_directory(self.path.parent)

    @property
    def size_bytes(self) -> int:
        """Bytes in the file so far."""
        return self._file.size

    def attach(self, attachment: AttachedFile, t_ns: int) -> None:
        """Puts a file into the file; the next chunk makes it durable."""
        name, media_type, data = to_stored(attachment)
        self._file.add_attachment(Attachment(t_ns, t_ns, name, media_type, data))

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """A further table of texts; of equal names the last one counts."""
        self._file.add_metadata(name, values)

    def _channel(self, topic: str, message_type: MessageType) -> int:
        key = topic, message_type
        if key not in self._channels:
            metadata = {"bus": topic[1:]} if message_type in (CAN_FRAME, TELEGRAM) else {}
            self._channels[key] = self._file.add_channel(topic, self._schemas[message_type], metadata)
        return self._channels[key]

    def append(self, batch: Batch) -> None:
        """Writes a batch: one chunk, one write and one sync for each topic that has messages."""
        pieces = list(_pieces(batch.frames))
        for n, (bus, is_can, frames) in enumerate(pieces):
            try:
                self._append_frames(bus, is_can, frames)
            except OSError:
                self.unwritten += (frame for _, _, missing in pieces[n:] for frame in missing)
                raise
        clocks = [(reading.t_ns, encode_clock(reading)) for reading in batch.clocks]
        states = [(t_ns, encode_texts(t_ns, "", text)) for t_ns, text in batch.keyframes]
        events = [
            (event.t_ns, encode_texts(event.t_ns, event.bus, event.kind.value, text)) for event, text in batch.events
        ]
        self._append_messages(CLOCK_TOPIC, CLOCK, clocks)
        self._append_messages(STATE_TOPIC, STATE, states)
        self._append_messages(EVENTS_TOPIC, EVENT, events)

    def _append_frames(self, bus: str, is_can: bool, frames: Sequence[Frame]) -> None:
        try:
            body = self._frames_body(bus, is_can, frames)
        except (ValueError, OverflowError):
            good = list(filter(valid, frames))
            if good:
                self._append_body(self._frames_body(bus, is_can, good))
            self.rejected += len(frames) - len(good)
            self.frames += len(good)
        else:
            self._append_body(body)
            self.frames += len(frames)

    def _frames_body(self, bus: str, is_can: bool, frames: Sequence[Frame]) -> Body:
        channel_id = self._channel(bus_topic(bus), CAN_FRAME if is_can else TELEGRAM)
        if is_can:
            return can_body(channel_id, encode_can(channel_id, bus, frames))
        if any(frame.t_ns >= MAX_T_NS for frame in frames):
            raise ValueError("time stamp out of range")
        return message_body(channel_id, [(frame.t_ns, encode_telegram(frame)) for frame in frames])

    def _append_messages(self, topic: str, message_type: MessageType, messages: Sequence[tuple[int, bytes]]) -> None:
        if messages:
            self._append_body(message_body(self._channel(topic, message_type), messages))

    def _append_body(self, body: Body) -> None:
        packer = self._packer if len(body.times) < BUSY_MESSAGES else self._fast_packer
        self._file.add_chunk(encode_chunk(body, packer, with_index=True))
        self._file.sync()

    def finish(self, t_ns: int, lost: int) -> None:
        """Writes the totals and the summary, syncs and closes. ``lost`` is that of the recording so far."""
        totals = {"frames": str(self.frames), "lost": str(lost), "closed_ns": str(t_ns)}
        self._file.add_metadata(METADATA_TOTALS, totals)
        self._file.finish()

    def abandon(self) -> None:
        """Closes the file as it is, for a disk that refuses. What it holds is recovered at the next start."""
        self._file.close()


def event_entry(event: Event) -> tuple[Event, str]:
    """An event with its details as JSON. Raises ``TypeError`` or ``ValueError`` where they are not plain."""
    return event, to_json(event.details)


def _pieces(frames: Sequence[Frame]) -> Iterator[tuple[str, bool, Sequence[Frame]]]:
    """Bus by bus what becomes a chunk: its bus, whether it is a CAN bus, and the frames."""
    for (bus, is_can), group in _by_bus(frames).items():
        for start in range(0, len(group), CHUNK_FRAMES):
            yield bus, is_can, group[start : start + CHUNK_FRAMES]


def _by_bus(frames: Sequence[Frame]) -> dict[tuple[str, bool], list[Frame]]:
    groups: dict[tuple[str, bool], list[Frame]] = {}
    for frame in frames:
        key = frame.bus, type(frame.payload) is Can
        group = groups.get(key)
        if group is None:
            group = groups[key] = []
        group.append(frame)
    return groups
