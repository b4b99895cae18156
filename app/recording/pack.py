"""The archive form of a recording: larger chunks, harder compression and no message indexes.

Every message stays as it is, and so do attachments and metadata. Such a file is read by any MCAP reader and by us.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Final, NamedTuple

from app.errors import RecordingError
from app.recording.chunks import Body, EncodedChunk, Level, compressor, encode_chunk, join_bodies
from app.recording.content import METADATA_CHUNK_CHANNELS
from app.recording.mcap_file import McapFile, sync_directory
from app.recording.reader import Recording, open_recording
from app.recording.summary import record_bytes

PACK_CHUNK_BYTES: Final = 4 << 20  # larger chunks save less than 2 % more and cost memory and seek time
_PART_SUFFIX: Final = ".part"


class PackResult(NamedTuple):
    """Sizes in bytes, and how much of the source was damaged and is therefore missing."""

    source_bytes: int
    packed_bytes: int
    messages: int
    damages: int


def pack(src: Path, dst: Path, on_progress: Callable[[float], None] | None = None) -> PackResult:
    """Writes the archive form of ``src`` to ``dst``, which must not exist; it appears only when it is complete.

    ``on_progress`` gets the share done, 0 to 1. Raises ``RecordingError`` where ``src`` cannot be read or ``dst``
    cannot be written.
    """
    part = dst.with_name(dst.name + _PART_SUFFIX)
    try:
        if dst.exists():
            raise RecordingError(file=dst.name, offset=0, reason="the file exists already")
        part.unlink(missing_ok=True)
        with open_recording(src) as recording:
            _write(recording, part, on_progress)
            damages = len(recording.damages)
            messages = sum(recording.topics.values())
        part.rename(dst)
        sync_directory(dst.parent)
        return PackResult(src.stat().st_size, dst.stat().st_size, messages, damages)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise RecordingError(file=dst.name, offset=0, reason=error.strerror or str(error)) from error


def _write(recording: Recording, path: Path, on_progress: Callable[[float], None] | None) -> None:
    file = McapFile(path, recording.library)
    try:
        for metadata in recording.metadata_records:
            if metadata.name != METADATA_CHUNK_CHANNELS:
                file.add_metadata(metadata.name, metadata.metadata)
        for attachment in recording.attachment_records():
            file.add_attachment(attachment)
        for schema in recording.schemas.values():
            file.add_copy(record_bytes(schema))
            file.summary.schemas[schema.id] = schema
        for channel in recording.channels.values():
            file.add_copy(record_bytes(channel))
            file.summary.channels[channel.id] = channel
        order = []
        for chunk in _compressed(recording, on_progress):
            file.add_chunk(chunk)
            order.append(chunk.channel_id)
        file.add_metadata(METADATA_CHUNK_CHANNELS, {"ids": " ".join(map(str, order))})
        file.finish()
    finally:
        file.close()


def _compressed(recording: Recording, on_progress: Callable[[float], None] | None) -> Iterator[EncodedChunk]:
    """The new chunks in the order in which they were filled; compressed on all processors, a few at a time."""
    workers = os.cpu_count() or 1
    with ThreadPoolExecutor(workers) as pool:
        running: list[Future[EncodedChunk]] = []
        for body, share in _large_bodies(recording):
            if len(running) > workers:
                yield running.pop(0).result()
            running.append(pool.submit(_encode, body))
            if on_progress is not None:
                on_progress(share)
        for future in running:
            yield future.result()


def _encode(body: Body) -> EncodedChunk:
    return encode_chunk(body, compressor(Level.PACK), with_index=False)


def _large_bodies(recording: Recording) -> Iterator[tuple[Body, float]]:
    """The messages of each channel, gathered into large chunks, with the share of the source that was read."""
    gathered: dict[int, list[Body]] = defaultdict(list)
    for body, share in recording.bodies():
        bodies = gathered[body.channel_id]
        if bodies and sum(len(other.data) for other in bodies) + len(body.data) > PACK_CHUNK_BYTES:
            yield join_bodies(bodies), share
            bodies.clear()
        bodies.append(body)
    for bodies in gathered.values():
        if bodies:
            yield join_bodies(bodies), 1.0
