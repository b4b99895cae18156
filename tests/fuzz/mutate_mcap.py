"""Damage for MCAP files, record by record: lengths, counts, order, and content whose CRC agrees all the same."""

from __future__ import annotations

import random
import struct
import zlib
from collections.abc import Callable
from typing import Final, NamedTuple

import zstandard

from app.recording.cdr import RECORD_PREFIX
from app.recording.summary import MAGIC
from tests.fuzz.mutate import LARGEST, NUMBERS, bytes_changed

OP_FOOTER: Final = 2
OP_SCHEMA: Final = 3
OP_CHANNEL: Final = 4
OP_CHUNK: Final = 6
OP_ATTACHMENT: Final = 9
OPCODES: Final = (*range(1, 16), 0, 0x80, 0xFF)
BOMB_BYTES: Final = 1 << 30
MESSAGE_BOMB_BYTES: Final = 255 << 20
"""Less than what a reader takes for a chunk, and far more than it may hold."""
_CHUNK_HEAD: Final = struct.Struct("<QQQII")
_PACKER: Final = zstandard.ZstdCompressor(level=1)
_BOMBS: dict[int, bytes] = {}


class Record(NamedTuple):
    """A record of a file."""

    opcode: int
    body: bytes

    def encoded(self) -> bytes:
        """Its bytes."""
        return RECORD_PREFIX.pack(self.opcode, len(self.body)) + self.body


def records_of(data: bytes) -> list[Record]:
    """The records of a whole file, or of the content of a chunk."""
    found, at = [], len(MAGIC) if data.startswith(MAGIC) else 0
    while at + RECORD_PREFIX.size <= len(data):
        opcode, length = RECORD_PREFIX.unpack_from(data, at)
        at += RECORD_PREFIX.size
        if at + length > len(data):
            break
        found.append(Record(opcode, data[at : at + length]))
        at += length
    return found


def file_of(records: list[Record]) -> bytes:
    """The file; its footer points to the summary where there is one, and has no CRC."""
    data, summary_at = bytearray(MAGIC), 0
    ended = False
    for record in records:
        if ended and not summary_at:
            summary_at = len(data)
        if record.opcode == OP_FOOTER and len(record.body) == 20:
            record = Record(OP_FOOTER, struct.pack("<QQI", summary_at if summary_at != len(data) else 0, 0, 0))
        data += record.encoded()
        ended = ended or record.opcode == 15
    return bytes(data + MAGIC)


def changed(chance: random.Random, data: bytes) -> bytes:
    """A file with a few records changed; now and then some bytes of the whole as well."""
    if chance.random() < 0.3:
        return bytes_changed(chance, data)
    records = records_of(data)
    for _ in range(min(4, int(chance.paretovariate(1.2)))):
        if records:
            chance.choice(_WAYS)(chance, records)
    made = file_of(records)
    return bytes_changed(chance, made) if chance.random() < 0.15 else made


def _drop(chance: random.Random, records: list[Record]) -> None:
    del records[chance.randrange(len(records))]


def _repeat(chance: random.Random, records: list[Record]) -> None:
    at = chance.randrange(len(records))
    records[at:at] = [records[at]] * chance.randrange(1, 5)


def _swap(chance: random.Random, records: list[Record]) -> None:
    first, second = chance.randrange(len(records)), chance.randrange(len(records))
    records[first], records[second] = records[second], records[first]


def _other_opcode(chance: random.Random, records: list[Record]) -> None:
    at = chance.randrange(len(records))
    records[at] = Record(chance.choice(OPCODES), records[at].body)


def _other_body(chance: random.Random, records: list[Record]) -> None:
    at = chance.randrange(len(records))
    opcode, body = records[at]
    body = bytes_changed(chance, body)
    if opcode == OP_ATTACHMENT and len(body) > 4 and chance.random() < 0.7:
        body = body[:-4] + zlib.crc32(body[:-4]).to_bytes(4, "little")
    records[at] = Record(opcode, body)


def _shortened(chance: random.Random, records: list[Record]) -> None:
    at = chance.randrange(len(records))
    records[at] = Record(records[at].opcode, records[at].body[: chance.randrange(len(records[at].body) + 1)])


def _some(chance: random.Random, records: list[Record], opcode: int) -> int | None:
    places = [at for at, record in enumerate(records) if record.opcode == opcode]
    return chance.choice(places) if places else None


def chunk_of(content: bytes, size: int | None = None, packed: bytes | None = None, name: bytes = b"zstd") -> bytes:
    """The body of a chunk record with any content, whose CRC agrees."""
    packed = _PACKER.compress(content) if packed is None else packed
    times = [struct.unpack_from("<Q", body, 6)[0] for opcode, body in records_of(content) if len(body) >= 14]
    head = _CHUNK_HEAD.pack(
        min(times, default=0),
        max(times, default=0),
        len(content) if size is None else size,
        zlib.crc32(content),
        len(name),
    )
    return head + name + len(packed).to_bytes(8, "little") + packed


def content_of(body: bytes) -> bytes:
    """What is in the body of a chunk record; empty where that cannot be had."""
    try:
        name_size = struct.unpack_from("<I", body, 28)[0]
        packed = body[32 + name_size + 8 :]
        if name_size and zstandard.frame_content_size(packed) > LARGEST:
            return b""  # a bomb that was put in before
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=LARGEST) if name_size else packed
    except (struct.error, zstandard.ZstdError):
        return b""


def _inside_a_chunk(chance: random.Random, records: list[Record]) -> None:
    """Other messages, under a CRC that agrees."""
    at = _some(chance, records, OP_CHUNK)
    if at is None:
        return
    content = content_of(records[at].body)
    if chance.random() < 0.5:
        messages = records_of(content)
        if messages:
            chance.choice((_drop, _repeat, _swap, _other_opcode, _other_body, _shortened))(chance, messages)
        content = b"".join(message.encoded() for message in messages)
    else:
        content = bytes_changed(chance, content)
    if chance.random() < 0.1:
        records[at] = Record(OP_CHUNK, chunk_of(content, packed=content, name=chance.choice((b"", b"lz4", b"\xff"))))
    else:
        records[at] = Record(OP_CHUNK, chunk_of(content))


def _chunk_that_lies(chance: random.Random, records: list[Record]) -> None:
    """Another size, CRC or compression than the chunk has."""
    at = _some(chance, records, OP_CHUNK)
    if at is None:
        return
    content = content_of(records[at].body)
    way = chance.randrange(4)
    if way == 0:
        body = chunk_of(content, size=chance.choice(NUMBERS))
    elif way == 1:
        stream = zstandard.ZstdCompressor(write_content_size=False).compressobj()
        body = chunk_of(content, packed=stream.compress(content) + stream.flush())
    elif way == 2:
        body = chunk_of(content, packed=_PACKER.compress(content) * 2, size=2 * len(content))
    else:
        body = chunk_of(content, packed=bytes_changed(chance, _PACKER.compress(content)))
    records[at] = Record(OP_CHUNK, body)


def _bomb(size: int) -> bytes:
    """So many zero bytes, packed; made once."""
    if size not in _BOMBS:
        packer = zstandard.ZstdCompressor(level=1).compressobj(size=size)
        block = bytes(1 << 20)
        _BOMBS[size] = b"".join(packer.compress(block) for _ in range(size >> 20)) + packer.flush()
    return _BOMBS[size]


def _chunk_bomb(chance: random.Random, records: list[Record]) -> None:
    """A chunk that is a thousand times what it looks like."""
    if chance.random() < 0.9:  # each costs a moment
        return
    size = chance.choice((BOMB_BYTES, MESSAGE_BOMB_BYTES))
    body = chunk_of(b"", size=size, packed=_bomb(size))
    at = _some(chance, records, OP_CHUNK) or len(records) // 2
    records.insert(at, Record(OP_CHUNK, body))


def _attachment_bomb(chance: random.Random, records: list[Record]) -> None:
    """A packed attachment of 600 MiB, and one of nothing."""
    if chance.random() < 0.9:
        return
    key = -1
    if key not in _BOMBS:
        packer = zlib.compressobj(1, zlib.DEFLATED, 31)
        _BOMBS[key] = b"".join(packer.compress(bytes(1 << 20)) for _ in range(600)) + packer.flush()
    data = chance.choice((_BOMBS[key], b"", b"\x1f\x8b", _BOMBS[key][:1000]))
    name, media = b"a.json.gz", b"application/gzip; content=application/json"
    body = struct.pack("<QQ", 1, 1) + b"".join(len(text).to_bytes(4, "little") + text for text in (name, media))
    body += len(data).to_bytes(8, "little") + data
    body += zlib.crc32(body).to_bytes(4, "little")
    ends = [at for at, record in enumerate(records) if record.opcode == 15]
    records.insert(ends[0] if ends else len(records), Record(OP_ATTACHMENT, body))


def _cut_in_a_record(chance: random.Random, records: list[Record]) -> None:
    """The file ends: no summary, maybe half a record."""
    del records[chance.randrange(len(records)) + 1 :]


_WAYS: Final[tuple[Callable[[random.Random, list[Record]], None], ...]] = (
    _drop, _repeat, _swap, _other_opcode, _other_body, _other_body, _other_body, _shortened, _inside_a_chunk,
    _inside_a_chunk, _inside_a_chunk, _chunk_that_lies, _chunk_bomb, _attachment_bomb, _cut_in_a_record,
)  # fmt: skip
