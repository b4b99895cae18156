"""MCAP files that others wrote: chunks of several topics, messages outside chunks, any compression, no words of ours.

A finished file is walked from record to record without unpacking; one without a summary, or whose records do not hold
together, is unpacked chunk by chunk, and what is damaged is left out and listed with its place.
"""

from __future__ import annotations

import struct
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Metadata, Schema

from app.recording.cdr import RECORD_PREFIX
from app.recording.chunks import ANY_CHANNEL, ChunkPlace, chunk_data, partial_data, read_chunk, whole_records
from app.recording.content import METADATA_RECORDING
from app.recording.loose import Messages, messages_in
from app.recording.scan import Bytes, Damage, DamageReason, is_finished, parse, parse_attachment, read_summary
from app.recording.summary import MAGIC, Summary

_OURS: Final = "hubside"
_CHUNK_TIMES: Final = struct.Struct("<QQQ")  # at the beginning of a chunk's content: start, end, size
_COMPRESSION_AT: Final = 28
_MARKS: Final = (b"\x04\x00\x00\x00zstd", b"\x03\x00\x00\x00lz4")
_MARK_AT: Final = RECORD_PREFIX.size + _COMPRESSION_AT
_RUN_BYTES: Final = 1 << 20
"""Messages outside chunks are read together up to here."""
_PRIVATE: Final = 0x80
"""Record kinds from here on are free for anyone; a reader passes over them (MCAP, "Records")."""
_IN_CHUNKS: Final = frozenset({Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE})
_KNOWN: Final = frozenset(Opcode)


@dataclass
class ForeignFile:
    """What such a file holds. ``places``: its chunks and runs of messages; ``partial``: the rest of a cut chunk.

    ``end`` is the offset behind the last whole record.
    """

    finished: bool
    summary: Summary = field(default_factory=Summary)
    places: list[ChunkPlace] = field(default_factory=list)
    damages: list[Damage] = field(default_factory=list)
    metadata: list[Metadata] = field(default_factory=list)
    partial: bytes = b""
    end: int = len(MAGIC)


def is_foreign(data: Bytes) -> bool:
    """Whether the file was surely written by another program; one whose head is damaged counts as ours."""
    first = _record_at(data, len(MAGIC))
    if first is None or first[0] != Opcode.HEADER:
        return False
    try:
        library = parse(Header, data[len(MAGIC) + RECORD_PREFIX.size : first[1]]).library
    except ValueError:
        return False
    if library.startswith(_OURS):
        return False
    second = _record_at(data, first[1])
    if second is None:  # cut off here, or nothing that a record can be
        return len(data) - first[1] < RECORD_PREFIX.size
    return not _is_our_metadata(data[first[1] + RECORD_PREFIX.size : second[1]], second[0])


def _is_our_metadata(body: bytes, opcode: int) -> bool:
    name = len(METADATA_RECORDING).to_bytes(4, "little") + METADATA_RECORDING.encode()
    return opcode == Opcode.METADATA and body.startswith(name)


def _record_at(data: Bytes, at: int) -> tuple[int, int] | None:
    """Kind and end of a record, which may be beyond the end of the file; None where none can stand there."""
    if at + RECORD_PREFIX.size > len(data):
        return None
    opcode, length = RECORD_PREFIX.unpack(data[at : at + RECORD_PREFIX.size])
    return (opcode, at + RECORD_PREFIX.size + length) if opcode in _KNOWN or opcode >= _PRIVATE else None


def read_foreign(data: Bytes) -> ForeignFile:
    """Everything but the frames. Raises nothing on damaged bytes: they are listed."""
    summary = read_summary(data)
    if summary is not None and summary.channels and summary.messages:
        walk = _Walk(data, summary, unpack=False)
        if walk.run():
            return walk.file
    walk = _Walk(data, summary or Summary(), unpack=True)
    walk.run()
    return walk.file


class _Walk:
    """Goes through the data section. ``unpack``: looks into the chunks, for topics, times and what is damaged."""

    def __init__(self, data: Bytes, summary: Summary, unpack: bool) -> None:
        self._data = data
        self._unpack = unpack
        known = Summary(schemas=dict(summary.schemas), channels=dict(summary.channels))
        if not unpack:
            known.messages = Counter(summary.messages)
        self.file = ForeignFile(is_finished(data), known)
        self._run: list[int] = []  # where a run of messages outside chunks begins and ends

    def run(self) -> bool:
        """Whether everything was whole."""
        at = len(MAGIC)
        while at < len(self._data):
            record = _record_at(self._data, at)
            if record is None or record[1] > len(self._data):
                at = self._broken(at, record)
                continue
            opcode, end = record
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                self._end_run()
                self.file.end = end
                break
            try:
                self._take(opcode, at, end)
            except ValueError as error:
                self._damage(at, end, DamageReason.UNREADABLE, str(error))
            self.file.end = at = end
        else:
            self._end_run()
            self.file.finished = False
        return not self.file.damages and self.file.finished

    def _take(self, opcode: int, at: int, end: int) -> None:
        """Raises ``ValueError`` where the record makes no sense."""
        if opcode == Opcode.MESSAGE:
            self._lengthen_run(at, end)
            return
        self._end_run()
        body = self._data[at + RECORD_PREFIX.size : end] if opcode != Opcode.CHUNK else b""
        if opcode == Opcode.CHUNK:
            self._take_chunk(at, end)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._declare(opcode, body)
        elif opcode == Opcode.ATTACHMENT:
            attachment: Attachment = parse_attachment(body)
            self.file.summary.add_attachment(attachment, at, end - at)
        elif opcode == Opcode.METADATA:
            metadata = parse(Metadata, body)
            self.file.metadata.append(metadata)
            self.file.summary.add_metadata(metadata, at, end - at)

    def _declare(self, opcode: int, body: bytes) -> None:
        if opcode == Opcode.SCHEMA:
            schema = parse(Schema, body)
            self.file.summary.schemas.setdefault(schema.id, schema)
        else:
            channel = parse(Channel, body)
            self.file.summary.channels.setdefault(channel.id, channel)

    def _take_chunk(self, at: int, end: int) -> None:
        head = self._data[at + RECORD_PREFIX.size : at + RECORD_PREFIX.size + _CHUNK_TIMES.size]
        if len(head) < _CHUNK_TIMES.size or end - at < RECORD_PREFIX.size + _COMPRESSION_AT:
            raise ValueError("chunk too short")
        start_ns, end_ns, size = _CHUNK_TIMES.unpack(head)
        if not size:
            return
        if self._unpack:
            found = self._look_into(chunk_data(read_chunk(self._data[at:end])))
            if not len(found.t_ns):
                return
            start_ns, end_ns = int(found.t_ns.min()), int(found.t_ns.max())
        self.file.places.append(ChunkPlace(start_ns, end_ns, at, end - at, ANY_CHANNEL))

    def _look_into(self, data: bytes) -> Messages:
        """Topics declared within a chunk, and how many messages each has. Raises ``ValueError``."""
        found = messages_in(data)
        for at in found.others:
            opcode, length = RECORD_PREFIX.unpack_from(data, at)
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._declare(opcode, data[at + RECORD_PREFIX.size : at + RECORD_PREFIX.size + length])
        self._count(found)
        return found

    def _count(self, found: Messages) -> None:
        numbers, counts = np.unique(found.channels, return_counts=True)
        self.file.summary.messages.update(dict(zip(numbers.tolist(), counts.tolist(), strict=True)))

    # -- messages outside chunks -----------------------------------------------

    def _lengthen_run(self, at: int, end: int) -> None:
        if self._run and self._run[1] == at and end - self._run[0] <= _RUN_BYTES:
            self._run[1] = end
        else:
            self._end_run()
            self._run = [at, end]

    def _end_run(self) -> None:
        if not self._run:
            return
        (at, end), self._run = self._run, []
        try:
            found = messages_in(self._data[at:end])
        except ValueError as error:
            self._damage(at, end, DamageReason.UNREADABLE, str(error))
            return
        if self._unpack:
            self._count(found)
        start_ns, end_ns = int(found.t_ns.min()), int(found.t_ns.max())
        self.file.places.append(ChunkPlace(start_ns, end_ns, at, end - at, ANY_CHANNEL))

    # -- damage ----------------------------------------------------------------

    def _damage(self, at: int, end: int, reason: DamageReason, detail: str) -> None:
        self.file.damages.append(Damage(at, end - at, reason, detail))

    def _broken(self, at: int, record: tuple[int, int] | None) -> int:
        """No whole record stands at ``at``: the file ends within one, or has lost its frame; where to go on."""
        self._end_run()
        size = len(self._data)
        following = self._next_chunk(at + 1)
        if following is not None:
            self._damage(at, following, DamageReason.UNREADABLE, "no record")
            return following
        cut = record is not None or size - at < RECORD_PREFIX.size
        if record is not None and record[0] == Opcode.CHUNK and self._unpack:
            self._keep_rest(at)
        reason = DamageReason.TRUNCATED if cut else DamageReason.UNREADABLE
        self._damage(at, size, reason, "ends inside a record" if cut else "no record")
        return size

    def _next_chunk(self, at: int) -> int | None:
        """The next chunk that is whole."""
        for mark in _MARKS:
            place = self._data.find(mark, at + _MARK_AT)
            while place >= 0:
                start = place - _MARK_AT
                record = _record_at(self._data, start)
                if record is not None and record[0] == Opcode.CHUNK and record[1] <= len(self._data):
                    try:
                        messages_in(chunk_data(read_chunk(self._data[start : record[1]])))
                    except ValueError:
                        pass
                    else:
                        return start
                place = self._data.find(mark, place + 1)
        return None

    def _keep_rest(self, at: int) -> None:
        """What can be unpacked of a last chunk without its end."""
        head = self._data[at + RECORD_PREFIX.size : at + 64]
        if len(head) < _COMPRESSION_AT + 4 + 8:
            return
        length = int.from_bytes(head[_COMPRESSION_AT : _COMPRESSION_AT + 4], "little")
        name = head[_COMPRESSION_AT + 4 : _COMPRESSION_AT + 4 + length].decode("ascii", "replace")
        packed = self._data[at + RECORD_PREFIX.size + _COMPRESSION_AT + 4 + length + 8 :]
        data = partial_data(packed, name)
        data = data[: whole_records(data, _IN_CHUNKS)]
        if data:
            with suppress(ValueError):  # as where a whole chunk makes no sense; the damage is listed anyway
                self._look_into(data)
                self.file.partial = data
