"""Cuts a time out of a recording: the very messages, with the state of the beginning as a keyframe before them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from app.errors import RecordingError, UsageError
from app.recording.cdr import encode_texts
from app.recording.chunks import Body, Level, compressor, encode_chunk, message_body
from app.recording.content import (
    METADATA_CHUNK_CHANNELS,
    METADATA_ORIGIN,
    METADATA_RECORDING,
    METADATA_RECOVERY,
    METADATA_TOTALS,
    to_json,
)
from app.recording.exchange.draft import drafted
from app.recording.exchange.origin import OriginKind, origin_table, source_of
from app.recording.exchange.states import lost_until, state_before
from app.recording.index.course import Course, marks_of, steps
from app.recording.mcap_file import McapFile, sync_directory
from app.recording.reader import Recording, open_recording
from app.recording.schemas import CAN_FRAME, FIXED_TOPICS, STATE, STATE_TOPIC, TELEGRAM
from app.recording.summary import record_bytes

_LEFT_OUT: Final = frozenset({METADATA_CHUNK_CHANNELS, METADATA_TOTALS, METADATA_ORIGIN, METADATA_RECOVERY})
_MAX_EVENTS: Final = 2000
_BEYOND: Final = (1 << 64) - 1


class CutOrder(NamedTuple):
    """What is cut out: from ``start_ns`` on and before ``end_ns`` (None: open), of ``buses`` (None: all)."""

    start_ns: int | None = None
    end_ns: int | None = None
    buses: Collection[str] | None = None


class CutResult(NamedTuple):
    """What was written."""

    frames: int
    events: int
    size_bytes: int


def cut(src: Path, dst: Path, order: CutOrder, on_progress: Callable[[float], None] | None = None) -> CutResult:
    """Writes a recording of a part of ``src`` to ``dst``, which must not exist; it appears only when it is complete.

    Messages, attachments, nodes and identity stay; the metadata ``origin`` tells of what it is a cut. ``on_progress``
    gets the share done, 0 to 1. Raises RecordingError, and UsageError where nothing would be in it.
    """
    try:
        with drafted(dst) as draft, open_recording(src) as recording:
            frames, events = _Cut(recording, src, order).write(draft, on_progress)
        sync_directory(dst.parent)
        return CutResult(frames, events, dst.stat().st_size)
    except OSError as error:
        raise RecordingError(file=dst.name, offset=0, reason=error.strerror or str(error)) from error


class _Cut:
    def __init__(self, recording: Recording, src: Path, order: CutOrder) -> None:
        if METADATA_RECORDING not in recording.metadata:
            raise UsageError(reason=f"{src.name} is no recording of this bench: import it first")
        span = recording.span_ns
        if span is None:
            raise UsageError(reason=f"{src.name} holds no frame")
        self._recording, self._src = recording, src
        self._whole = order.start_ns is None or order.start_ns <= span[0]
        self._start_ns = span[0] if self._whole or order.start_ns is None else order.start_ns
        self._end_ns = span[1] + 1 if order.end_ns is None else order.end_ns
        if not self._start_ns < self._end_ns or self._start_ns > span[1] or self._end_ns <= span[0]:
            raise UsageError(reason=f"nothing of {src.name} lies in that time")
        self._buses = order.buses
        self._channels = {
            number
            for number, channel in recording.channels.items()
            if channel.topic in FIXED_TOPICS or order.buses is None or channel.topic[1:] in order.buses
        }
        self._frames = self._events = 0

    def write(self, path: Path, on_progress: Callable[[float], None] | None) -> tuple[int, int]:
        recording = self._recording
        file = McapFile(path, recording.library)
        try:
            self._write_head(file)
            packer = compressor(Level.LIVE)
            for body in self._bodies(on_progress):
                file.add_chunk(encode_chunk(body, packer, with_index=True))
            lost = str(lost_until(recording, self._end_ns))
            totals = {"frames": str(self._frames), "lost": lost, "closed_ns": str(self._end_ns - 1)}
            file.add_metadata(METADATA_TOTALS, totals)
            file.finish()
        finally:
            file.close()
        if not self._frames:
            raise UsageError(reason=f"nothing of {self._src.name} lies in that time")
        return self._frames, self._events

    def _write_head(self, file: McapFile) -> None:
        recording = self._recording
        for metadata in recording.metadata_records:
            if metadata.name not in _LEFT_OUT:
                file.add_metadata(metadata.name, metadata.metadata)
        source = source_of(self._src, "mcap")
        details: dict[str, Any] = {"start_ns": self._start_ns, "end_ns": self._end_ns}
        if self._buses is not None:
            details["buses"] = sorted(self._buses)
        file.add_metadata(METADATA_ORIGIN, origin_table(OriginKind.CUT, [source], [recording.metadata], **details))
        for attachment in recording.attachment_records():
            file.add_attachment(attachment)
        for schema in recording.schemas.values():
            file.add_copy(record_bytes(schema))
            file.summary.schemas[schema.id] = schema
        for number, channel in recording.channels.items():
            if number in self._channels:
                file.add_copy(record_bytes(channel))
                file.summary.channels[channel.id] = channel

    def _bodies(self, on_progress: Callable[[float], None] | None) -> Iterator[Body]:
        if not self._whole:
            yield from self._first_state()
        for body, share in self._recording.bodies():
            if on_progress is not None:
                on_progress(share)
            if body.channel_id in self._channels:
                piece = _between(body, self._start_ns if not self._whole else 0, self._end_ns)
                if piece is not None:
                    self._count(piece)
                    yield piece

    def _count(self, body: Body) -> None:
        channel = self._recording.channels[body.channel_id]
        schema = self._recording.schemas[channel.schema_id].name
        if schema in (CAN_FRAME.name, TELEGRAM.name):
            self._frames += len(body.times)
        elif channel.topic == "/events":
            self._events += len(body.times)

    def _first_state(self) -> Iterator[Body]:
        """What all frames before the beginning have told, as a keyframe."""
        recording, before_ns = self._recording, self._start_ns - 1
        course = Course((), recording.descriptions, _MAX_EVENTS, recording.servers, recording.kinds, recording.orders)
        keyframe = state_before(recording, before_ns)
        from_ns = -1 if keyframe is None else keyframe.t_ns
        if keyframe is not None:
            course.restore(keyframe.state)
        marks = marks_of(recording.events(from_ns + 1, self._start_ns), None, from_ns + 1, before_ns)
        for step in steps(recording.frames(from_ns + 1, self._start_ns), marks, max(from_ns, 0), from_ns, before_ns):
            course.take(step)
        number = next((n for n, c in recording.channels.items() if c.topic == STATE_TOPIC), None)
        if number is not None and recording.schemas[recording.channels[number].schema_id].name == STATE.name:
            yield message_body(number, [(before_ns, encode_texts(before_ns, "", to_json(course.snapshot())))])


def _between(body: Body, start_ns: int, end_ns: int) -> Body | None:
    """The messages of a body from ``start_ns`` on and before ``end_ns``; None where there are none."""
    first = int(np.searchsorted(body.times, np.uint64(start_ns), "left"))
    beyond = int(np.searchsorted(body.times, np.uint64(end_ns), "left"))
    if first >= beyond:
        return None
    if first == 0 and beyond == len(body.times):
        return body
    begin = int(body.offsets[first])
    end = int(body.offsets[beyond]) if beyond < len(body.offsets) else len(body.data)
    offsets = body.offsets[first:beyond] - np.uint64(begin)
    return Body(body.channel_id, body.data[begin:end], body.times[first:beyond], offsets)
