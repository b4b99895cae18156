"""Closes recordings that a crash, a kill or a power cut left open.

Every whole record is kept, and of a last chunk without its end the messages that can be read. No original byte is
lost: what stands behind the last whole record is put aside in a file of its own before it is cut off, and a file that
is damaged in its middle is kept whole beside its repaired copy.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Final, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex

from app.errors import RecordingError
from app.recording.cdr import RECORD_PREFIX
from app.recording.chunks import Body, Level, chunk_data, compressor, encode_chunk, message_index, split_body
from app.recording.content import METADATA_RECOVERY
from app.recording.file_lock import lock_file
from app.recording.foreign import is_foreign
from app.recording.mcap_file import McapFile, sync_directory
from app.recording.scan import Bytes, Scan, is_finished, map_file, parse, scan, unmap
from app.recording.schemas import CAN_FRAME, TELEGRAM
from app.recording.summary import MAGIC, Summary, record_bytes

TAIL_SUFFIX: Final = ".tail"
DAMAGED_SUFFIX: Final = ".damaged"
_COPY_SUFFIX: Final = ".recovering"


class RecoveryKind(Enum):
    """How a file was recovered.

    ``CLOSED``: only the summary was missing or the end was cut. ``REPAIRED``: a copy without the damaged parts took
    the file's name. ``SET_ASIDE``: nothing could be read.
    """

    CLOSED = "closed"
    REPAIRED = "repaired"
    SET_ASIDE = "set_aside"


class Recovery(NamedTuple):
    """What was recovered of a file. ``kept_aside`` holds the bytes that could not be used, or the whole original.

    ``lost_bytes`` could not be read; ``unproven_frames`` come from a chunk without its end, which no CRC covers.
    """

    file: Path
    kind: RecoveryKind
    recovered_bytes: int
    lost_bytes: int
    frames: int
    unproven_frames: int
    last_ns: int | None
    kept_aside: Path | None


def recover_all(directory: Path, now_ns: int) -> list[Recovery]:
    """Recovers every unfinished recording of a directory; those that a living process writes are left alone.

    Raises ``RecordingError`` where the disk refuses; a file is then as it was, or recovered.
    """
    _finish_replacements(directory)
    found = []
    for path in sorted(directory.glob("*.mcap")):
        recovery = recover(path, now_ns)
        if recovery is not None:
            found.append(recovery)
    return found


def recover(path: Path, now_ns: int) -> Recovery | None:
    """Recovers one file; None where it is finished, being written or not ours. ``now_ns`` goes into the note of it.

    Raises ``RecordingError`` where the disk refuses.
    """
    try:
        if not _to_recover(path):
            return None
        return _recover(path, now_ns)
    except OSError as error:
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error


def _to_recover(path: Path) -> bool:
    """Whether a file is unfinished and nobody is at work on it."""
    with path.open("r+b") as file:
        try:
            lock_file(file)
        except OSError:
            return False
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - 64))
        end = file.read()
    # The head of a long file does not matter here: it is enough that the length is not that of an empty one.
    return not is_finished(MAGIC + end if size > len(end) else end)


def _recover(path: Path, now_ns: int) -> Recovery | None:
    data = map_file(path)
    try:
        if data[: len(MAGIC)] != MAGIC:
            return _set_aside(path, data)
        if is_foreign(data):
            return None  # another program's file: it is read as it is, and left as it is
        result = scan(data, path.name)
        rewritten = _cut_last_without_index(data, result)
        without_index = any(not index.message_index_length for index in result.summary.chunks)
        middle = without_index or any(damage.offset < result.end for damage in result.damages)
        recovery = _copy(path, data, result, rewritten, now_ns) if middle else None
        tail = b"" if middle or result.data_ended else data[result.end :]
    finally:
        unmap(data)
    if recovery is not None and recovery.kept_aside is not None:
        path.rename(recovery.kept_aside)
        _copy_name(path).rename(path)
        sync_directory(path.parent)
        return recovery
    return _close(path, tail, result, rewritten, now_ns)


def _set_aside(path: Path, data: Bytes) -> Recovery:
    size = len(data)
    unmap(data)
    aside = _free_name(path, DAMAGED_SUFFIX)
    path.rename(aside)
    sync_directory(path.parent)
    return Recovery(path, RecoveryKind.SET_ASIDE, 0, size, 0, 0, None, aside)


def _cut_last_without_index(data: Bytes, result: Scan) -> Body | None:
    """Takes a last chunk whose message index is cut out of the result: it is written anew, with an index."""
    last = result.items[-1] if result.items else None
    if last is None or last.opcode is not Opcode.CHUNK or result.summary.chunks[-1].message_index_length:
        return None
    body = _chunk_body(data, result.summary.chunks.pop())
    result.summary.messages[body.channel_id] -= len(body.times)
    result.items.pop()
    result.end = last.offset
    return body


def _chunk_body(data: Bytes, index: ChunkIndex) -> Body:
    start = index.chunk_start_offset + RECORD_PREFIX.size
    return split_body(chunk_data(parse(Chunk, data[start : index.chunk_start_offset + index.chunk_length])))


def _close(path: Path, tail: bytes, result: Scan, rewritten: Body | None, now_ns: int) -> Recovery:
    """Puts aside what stands behind the last whole record, cuts it off and closes the file in place."""
    lost = sum(damage.length for damage in result.damages)
    aside = None
    if tail:
        aside = _free_name(path, TAIL_SUFFIX)
        _write_durably(aside, tail)
    file = McapFile.resume(path, result.summary, result.end)
    note = Recovery(path, RecoveryKind.CLOSED, result.end + len(tail) - lost, lost, 0, 0, None, aside)
    return _complete(file, result, rewritten, note, now_ns)


def _copy_name(path: Path) -> Path:
    return path.with_name(path.name + _COPY_SUFFIX)


def _copy(path: Path, data: Bytes, result: Scan, rewritten: Body | None, now_ns: int) -> Recovery:
    """Copies the whole records to a new file, which then takes the name of the old one; the old one is kept."""
    copy, aside = _copy_name(path), _free_name(path, DAMAGED_SUFFIX)
    copy.unlink(missing_ok=True)
    file = McapFile(copy, result.library)
    try:
        _copy_items(file, data, result)
    except OSError:
        file.close()
        raise
    lost = sum(damage.length for damage in result.damages)
    note = Recovery(path, RecoveryKind.REPAIRED, len(data) - lost, lost, 0, 0, None, aside)
    return _complete(file, result, rewritten, note, now_ns)


def _copy_items(file: McapFile, data: Bytes, result: Scan) -> None:
    old, new = result.summary, file.summary
    new.schemas, new.channels, new.messages = old.schemas, old.channels, old.messages
    moved: dict[int, int] = {}
    for declaration in (*new.schemas.values(), *new.channels.values()):  # all of them, for one may be damaged
        file.add_copy(record_bytes(declaration))
    for item in result.items:
        if item.opcode not in (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL):
            moved[item.offset] = file.add_copy(data[item.offset : item.offset + item.length])
        if item.opcode is Opcode.CHUNK:
            chunk = old.chunks[len(new.chunks)]
            if not chunk.message_index_length:
                body = _chunk_body(data, chunk)
                index = message_index(body)
                chunk.message_index_length = len(index)
                chunk.message_index_offsets = {body.channel_id: chunk.chunk_start_offset + chunk.chunk_length}
                file.add_copy(index)
            new.chunks.append(_moved(chunk, moved[item.offset]))
    for attachment in old.attachments:
        attachment.offset = moved[attachment.offset]
    for metadata in old.metadata:
        metadata.offset = moved[metadata.offset]
    new.attachments, new.metadata = old.attachments, old.metadata


def _moved(index: ChunkIndex, offset: int) -> ChunkIndex:
    shift = offset - index.chunk_start_offset
    offsets = {number: at + shift for number, at in index.message_index_offsets.items()}
    return replace(index, chunk_start_offset=offset, message_index_offsets=offsets)


def _complete(file: McapFile, result: Scan, rewritten: Body | None, note: Recovery, now_ns: int) -> Recovery:
    """Adds the messages of a broken last chunk and the note of the recovery, and closes the file."""
    summary = result.summary
    unproven = 0
    try:
        for body in (rewritten, result.partial):
            if body is not None:
                file.add_chunk(encode_chunk(body, compressor(Level.LIVE), with_index=True))
        if result.partial is not None and _carries_frames(summary, result.partial.channel_id):
            unproven = len(result.partial.times)
        frames = sum(count for number, count in file.summary.messages.items() if _carries_frames(summary, number))
        last_ns = max((chunk.message_end_time for chunk in file.summary.chunks), default=None)
        note = note._replace(frames=frames, unproven_frames=unproven, last_ns=last_ns)
        file.add_metadata(METADATA_RECOVERY, _table(note, now_ns))
        file.finish()
    except OSError:
        file.close()
        raise
    return note


def _table(note: Recovery, now_ns: int) -> dict[str, str]:
    return {
        "recovered_ns": str(now_ns),
        "kind": note.kind.value,
        "recovered_bytes": str(note.recovered_bytes),
        "lost_bytes": str(note.lost_bytes),
        "frames": str(note.frames),
        "unproven_frames": str(note.unproven_frames),
        "last_ns": "" if note.last_ns is None else str(note.last_ns),
        "kept_aside": "" if note.kept_aside is None else note.kept_aside.name,
    }


def _carries_frames(summary: Summary, channel_id: int) -> bool:
    schema = summary.schemas.get(summary.channels[channel_id].schema_id)
    return schema is not None and schema.name in (CAN_FRAME.name, TELEGRAM.name)


def _finish_replacements(directory: Path) -> None:
    """Ends what a crash in the middle of a repair left: the copy is whole once the original has its other name."""
    for copy in directory.glob(f"*.mcap{_COPY_SUFFIX}"):
        path = copy.with_name(copy.name.removesuffix(_COPY_SUFFIX))
        if path.exists():
            copy.unlink()
        else:
            copy.rename(path)


def _free_name(path: Path, suffix: str) -> Path:
    def names() -> Iterator[Path]:
        yield path.with_name(path.name + suffix)
        for n in range(2, 1000):
            yield path.with_name(f"{path.name}{suffix}-{n}")

    for name in names():
        if not name.exists():
            return name
    raise RecordingError(file=path.name, offset=0, reason="no free name to keep the damaged bytes")


def _write_durably(path: Path, data: bytes) -> None:
    with path.open("xb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    sync_directory(path.parent)
