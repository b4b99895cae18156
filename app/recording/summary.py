"""What the end of an MCAP file says about its data section, so that indexed readers need not scan it."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from app.recording.chunks import COMPRESSION, EncodedChunk

MAGIC: Final = b"\x89MCAP0\r\n"
FOOTER_SIZE: Final = 29  # the footer record; the magic follows it
_FOOTER_WITHOUT_CRC: Final = struct.Struct("<BQQQ")


def record_bytes(record: McapRecord) -> bytes:
    """A record as it stands in the file."""
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


@dataclass
class Summary:
    """Collects the indexes while a file is written or scanned, and builds the end of the file from them."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    messages: Counter[int] = field(default_factory=Counter)

    def add_chunk(self, chunk: EncodedChunk, offset: int) -> None:
        """A chunk record at ``offset``, its message index directly behind it."""
        index_at = {chunk.channel_id: offset + len(chunk.chunk)} if chunk.message_index else {}
        self.chunks.append(
            ChunkIndex(
                chunk_length=len(chunk.chunk),
                chunk_start_offset=offset,
                compression=COMPRESSION,
                compressed_size=chunk.compressed_size,
                message_end_time=chunk.end_ns,
                message_index_length=len(chunk.message_index),
                message_index_offsets=index_at,
                message_start_time=chunk.start_ns,
                uncompressed_size=chunk.uncompressed_size,
            )
        )
        self.messages[chunk.channel_id] += chunk.messages

    def add_attachment(self, attachment: Attachment, offset: int, length: int) -> None:
        """An attachment record of ``length`` bytes at ``offset``."""
        self.attachments.append(
            AttachmentIndex(
                offset=offset,
                length=length,
                log_time=attachment.log_time,
                create_time=attachment.create_time,
                data_size=len(attachment.data),
                name=attachment.name,
                media_type=attachment.media_type,
            )
        )

    def add_metadata(self, metadata: Metadata, offset: int, length: int) -> None:
        """A metadata record of ``length`` bytes at ``offset``."""
        self.metadata.append(MetadataIndex(offset=offset, length=length, name=metadata.name))

    def statistics(self) -> Statistics:
        """The counts of the file."""
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(sorted(self.messages.items())),
            chunk_count=len(self.chunks),
            message_count=self.messages.total(),
            message_end_time=max((chunk.message_end_time for chunk in self.chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self.chunks), default=0),
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )

    def end_of_file(self, offset: int) -> bytes:
        """Everything from the DataEnd record to the closing magic, for a data section that ends at ``offset``."""
        data_end = record_bytes(DataEnd(data_section_crc=0))
        start = offset + len(data_end)
        groups: tuple[tuple[Opcode, list[McapRecord]], ...] = (
            (Opcode.SCHEMA, list(self.schemas.values())),
            (Opcode.CHANNEL, list(self.channels.values())),
            (Opcode.STATISTICS, [self.statistics()]),
            (Opcode.CHUNK_INDEX, list(self.chunks)),
            (Opcode.ATTACHMENT_INDEX, list(self.attachments)),
            (Opcode.METADATA_INDEX, list(self.metadata)),
        )
        body, offsets = bytearray(), bytearray()
        for opcode, records in groups:
            group = b"".join(map(record_bytes, records))
            if group:
                offsets += record_bytes(SummaryOffset(opcode, start + len(body), len(group)))
            body += group
        offsets_at = start + len(body)
        body += offsets
        head = _FOOTER_WITHOUT_CRC.pack(Opcode.FOOTER, FOOTER_SIZE - 9, start, offsets_at)
        footer = record_bytes(Footer(start, offsets_at, zlib.crc32(head, zlib.crc32(bytes(body)))))
        return data_end + bytes(body) + footer + MAGIC
