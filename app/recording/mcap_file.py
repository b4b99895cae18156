"""An MCAP file that is being written: whole records, one system call each, and a sync where durability is asked for."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from mcap.records import Attachment, Channel, Header, Metadata, Schema

from app import __version__
from app.recording.chunks import EncodedChunk
from app.recording.file_lock import lock_file
from app.recording.schemas import MESSAGE_ENCODING, PROFILE, SCHEMA_ENCODING, MessageType
from app.recording.summary import MAGIC, Summary, record_bytes

LIBRARY: Final = f"hubside {__version__}"


class McapFile:
    """Writes one file. Methods raise ``OSError`` where the disk refuses; the file then stays unfinished.

    The file is locked while it is open, so that a recovery never touches a recording at work.
    """

    def __init__(self, path: Path, library: str = LIBRARY) -> None:
        self.path = path
        self.summary = Summary()
        self._file = path.open("xb", buffering=0)
        try:
            lock_file(self._file)
            self.size = 0
            self._append(MAGIC + record_bytes(Header(profile=PROFILE, library=library)))
        except OSError:
            self._file.close()
            raise

    @classmethod
    def resume(cls, path: Path, summary: Summary, size: int) -> McapFile:
        """An unfinished file whose data section ends at ``size``; what stands behind is cut off."""
        self = cls.__new__(cls)
        self.path, self.summary, self.size = path, summary, size
        self._file = path.open("r+b", buffering=0)
        try:
            lock_file(self._file)
            self._file.truncate(size)
            self._file.seek(size)
        except OSError:
            self._file.close()
            raise
        return self

    def _append(self, data: bytes) -> int:
        """Writes all of ``data``; its offset. A part that the disk took before it refused is cut off again."""
        offset, view = self.size, memoryview(data)
        try:
            while view:
                view = view[self._file.write(view) or 0 :]
        except OSError:
            self._file.truncate(offset)
            self._file.seek(offset)
            raise
        self.size += len(data)
        return offset

    def add_schema(self, message_type: MessageType) -> int:
        """Declares a message type; its id."""
        schema = Schema(
            id=len(self.summary.schemas) + 1,
            data=message_type.text.encode(),
            encoding=SCHEMA_ENCODING,
            name=message_type.name,
        )
        self._append(record_bytes(schema))
        self.summary.schemas[schema.id] = schema
        return schema.id

    def add_channel(self, topic: str, schema_id: int, metadata: Mapping[str, str]) -> int:
        """Declares a topic; its channel id."""
        channel = Channel(
            id=len(self.summary.channels) + 1,
            topic=topic,
            message_encoding=MESSAGE_ENCODING,
            metadata=dict(metadata),
            schema_id=schema_id,
        )
        self._append(record_bytes(channel))
        self.summary.channels[channel.id] = channel
        return channel.id

    def add_chunk(self, chunk: EncodedChunk) -> None:
        """A chunk and its index in one write."""
        self.summary.add_chunk(chunk, self._append(chunk.chunk + chunk.message_index))

    def add_attachment(self, attachment: Attachment) -> None:
        """A file inside the file."""
        data = record_bytes(attachment)
        self.summary.add_attachment(attachment, self._append(data), len(data))

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """A named table of texts."""
        metadata = Metadata(name=name, metadata=dict(values))
        data = record_bytes(metadata)
        self.summary.add_metadata(metadata, self._append(data), len(data))

    def add_copy(self, data: bytes) -> int:
        """A whole record of another file; its offset. The caller adds it to the summary."""
        return self._append(data)

    def sync(self) -> None:
        """Returns when all that was written is on the disk."""
        os.fsync(self._file.fileno())

    def finish(self) -> None:
        """Writes the summary, syncs and closes."""
        self._append(self.summary.end_of_file(self.size))
        self.sync()
        self.close()

    def close(self) -> None:
        """Closes without a summary: for a disk that refuses. May be called twice."""
        self._file.close()


def sync_directory(path: Path) -> None:
    """Makes new names in a directory durable, where the system can do that (Windows does it by itself)."""
    if os.name == "nt":
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
