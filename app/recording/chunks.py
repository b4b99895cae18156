"""A chunk of an MCAP file: messages of one topic, compressed, with the index record that follows it."""

from __future__ import annotations

import struct
import threading
from collections.abc import Collection, Sequence
from enum import Enum
from io import BytesIO
from typing import Final, NamedTuple

import lz4.frame
import numpy as np
import zstandard
from isal import isal_zlib
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Chunk

from app.recording.cdr import MESSAGE_FIXED, OP_MESSAGE, RECORD_PREFIX, CanArray, Times, message_record

COMPRESSION: Final = "zstd"
LZ4: Final = "lz4"
"""How others compress."""
OP_CHUNK: Final = 6
OP_MESSAGE_INDEX: Final = 7
MAX_CHUNK_BYTES: Final = 1 << 27  # a chunk that claims more is taken as damaged, not as a reason to allocate it
_PIECE: Final = 1 << 9  # a few bytes may stand for 128 KiB
_CHUNK_HEAD: Final = struct.Struct("<BQQQQII4sQ")
_INDEX_HEAD: Final = struct.Struct("<BQHI")
_INDEX_ENTRY: Final = np.dtype([("log_time", "<u8"), ("offset", "<u8")])


class Level(Enum):
    """How hard to compress: while recording, the same on very busy buses, or for the archive."""

    LIVE = 1
    BUSY = 2
    PACK = 3


def compressor(level: Level) -> zstandard.ZstdCompressor:
    """The compressor of a level. Its frame states the content size, which recovery relies on."""
    if level is Level.PACK:
        return zstandard.ZstdCompressor(level=19)
    # Message records repeat at a distance of one record: small tables keep the matches near, which are the cheap
    # ones to write down. The optimal parser saves half a byte a frame and takes 3 us; the lazy one takes a tenth.
    strategy = zstandard.STRATEGY_LAZY2 if level is Level.BUSY else zstandard.STRATEGY_BTOPT
    parameters = zstandard.ZstdCompressionParameters(
        strategy=strategy,
        window_log=17,
        hash_log=10,
        chain_log=10,
        search_log=1,
        min_match=7,
        target_length=64,
    )
    return zstandard.ZstdCompressor(compression_params=parameters)


class Body(NamedTuple):
    """Uncompressed message records of one channel, with the log time and the offset of each."""

    channel_id: int
    data: bytes
    times: Times
    offsets: Times


class ChunkPlace(NamedTuple):
    """A chunk in the file: times of its first and last message, its record's ``length`` bytes at ``offset``, its topic.

    ``length`` 0: the messages that could be read of a last chunk without its end. In files of others the topic is
    ``ANY_CHANNEL``, and the record may be a run of messages outside chunks.
    """

    start_ns: int
    end_ns: int
    offset: int
    length: int
    channel_id: int


ANY_CHANNEL: Final = -1


class EncodedChunk(NamedTuple):
    """A chunk record, the index record behind it (may be empty), and what the summary must know of both."""

    channel_id: int
    chunk: bytes
    message_index: bytes
    messages: int
    start_ns: int
    end_ns: int
    compressed_size: int
    uncompressed_size: int


def can_body(channel_id: int, records: CanArray) -> Body:
    """The body of CAN message records."""
    offsets = np.arange(len(records), dtype=np.uint64) * np.uint64(records.dtype.itemsize)
    return Body(channel_id, records.tobytes(), records["log_time"], offsets)


def message_body(channel_id: int, messages: Sequence[tuple[int, bytes]]) -> Body:
    """The body of messages given as (log time in ns, payload), sorted by time."""
    ordered = sorted(messages, key=lambda message: message[0])
    records = [message_record(channel_id, t_ns, payload) for t_ns, payload in ordered]
    sizes = np.fromiter(map(len, records), np.uint64, len(records))
    times = np.array([t_ns for t_ns, _ in ordered], dtype=np.uint64)
    return Body(channel_id, b"".join(records), times, np.cumsum(sizes) - sizes)


def join_bodies(bodies: Sequence[Body]) -> Body:
    """One body of several of the same channel, sorted by time."""
    base = np.cumsum([0] + [len(body.data) for body in bodies[:-1]]).astype(np.uint64)
    data = b"".join(body.data for body in bodies)
    times = np.concatenate([body.times for body in bodies])
    offsets = np.concatenate([body.offsets + start for body, start in zip(bodies, base, strict=True)])
    if not np.all(times[:-1] <= times[1:]):
        data, times, offsets = _sorted_by_time(data, times, offsets)
    return Body(bodies[0].channel_id, data, times, offsets)


def _sorted_by_time(data: bytes, times: Times, offsets: Times) -> tuple[bytes, Times, Times]:
    ends = np.append(offsets[1:], np.uint64(len(data)))
    order = np.argsort(times, kind="stable")
    pieces = [data[int(offsets[n]) : int(ends[n])] for n in order]
    sizes = np.fromiter(map(len, pieces), np.uint64, len(pieces))
    return b"".join(pieces), times[order], np.cumsum(sizes) - sizes


def encode_chunk(body: Body, packer: zstandard.ZstdCompressor, with_index: bool) -> EncodedChunk:
    """The chunk record of a body that is not empty, and its message index."""
    packed = packer.compress(body.data)
    start_ns, end_ns = int(body.times[0]), int(body.times[-1])
    head = _CHUNK_HEAD.pack(
        OP_CHUNK,
        _CHUNK_HEAD.size - RECORD_PREFIX.size + len(packed),
        start_ns,
        end_ns,
        len(body.data),
        isal_zlib.crc32(body.data),
        len(COMPRESSION),
        COMPRESSION.encode(),
        len(packed),
    )
    index = message_index(body) if with_index else b""
    return EncodedChunk(
        body.channel_id, head + packed, index, len(body.times), start_ns, end_ns, len(packed), len(body.data)
    )


def message_index(body: Body) -> bytes:
    """The message index record of a body."""
    entries = np.empty(len(body.times), dtype=_INDEX_ENTRY)
    entries["log_time"] = body.times
    entries["offset"] = body.offsets
    size = entries.nbytes
    return _INDEX_HEAD.pack(OP_MESSAGE_INDEX, 2 + 4 + size, body.channel_id, size) + entries.tobytes()


def read_chunk(record: bytes) -> Chunk:
    """The chunk of a whole chunk record. Raises ``ValueError`` where it is none."""
    if len(record) >= _CHUNK_HEAD.size:
        opcode, length, start_ns, end_ns, size, crc, word, compression, packed = _CHUNK_HEAD.unpack_from(record)
        whole = opcode == OP_CHUNK and length == len(record) - RECORD_PREFIX.size
        if whole and word == len(COMPRESSION) and packed == len(record) - _CHUNK_HEAD.size:
            name = compression.decode("ascii", "replace")
            return Chunk(name, record[_CHUNK_HEAD.size :], end_ns, start_ns, crc, size)
    return _read_any_chunk(record)


def _read_any_chunk(record: bytes) -> Chunk:
    """The same for a compression whose name has another length."""
    try:
        chunk: Chunk = Chunk.read(ReadDataStream(BytesIO(record[RECORD_PREFIX.size :])))
    except (McapError, struct.error, ValueError, OverflowError) as error:
        raise ValueError(f"Chunk: {error}") from error
    return chunk


def chunk_data(chunk: Chunk) -> bytes:
    """The uncompressed records of a chunk. Raises ``ValueError`` where they cannot be had or the CRC differs."""
    if not 0 < chunk.uncompressed_size <= MAX_CHUNK_BYTES:
        raise ValueError("chunk size out of range")
    if chunk.compression == COMPRESSION:
        data = _decompress(chunk.data, chunk.uncompressed_size)
    elif chunk.compression == LZ4:
        data = _decompress_lz4(chunk.data, chunk.uncompressed_size)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise ValueError(f"compression {chunk.compression!r} is not known")
    if len(data) != chunk.uncompressed_size:
        raise ValueError("chunk has another size than it states")
    if chunk.uncompressed_crc and isal_zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("CRC of the chunk differs")
    return data


_OF_THREAD: Final = threading.local()


def _unpacker() -> zstandard.ZstdDecompressor:
    """One for each thread: it must not be shared, and making one takes as long as a tenth of a chunk."""
    found: zstandard.ZstdDecompressor | None = getattr(_OF_THREAD, "unpacker", None)
    if found is None:
        found = _OF_THREAD.unpacker = zstandard.ZstdDecompressor()
    return found


def unpack_into(chunk: Chunk, target: memoryview) -> None:
    """``chunk_data`` into a place of ``uncompressed_size`` bytes: with no memory of its own it takes half the time.

    Raises ``ValueError`` as ``chunk_data`` does.
    """
    if chunk.compression != COMPRESSION:
        target[:] = chunk_data(chunk)
        return
    try:
        reader = _unpacker().stream_reader(chunk.data)
        at = 0
        while at < len(target) and (count := reader.readinto(target[at:])):
            at += count
        more = reader.read(1)
    except zstandard.ZstdError as error:
        raise ValueError(f"zstd: {error}") from error
    if at != len(target) or more:
        raise ValueError("chunk has another size than it states")
    if chunk.uncompressed_crc and isal_zlib.crc32(target) != chunk.uncompressed_crc:
        raise ValueError("CRC of the chunk differs")


def _decompress(packed: bytes, size: int) -> bytes:
    """``size`` serves where the frame does not state its own, as that of other writers."""
    try:
        stated = zstandard.frame_content_size(packed)
        if not (stated == -1 or 0 < stated <= MAX_CHUNK_BYTES):
            raise ValueError("chunk size out of range")
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    except zstandard.ZstdError as error:
        raise ValueError(f"zstd: {error}") from error


def _decompress_lz4(packed: bytes, size: int) -> bytes:
    try:
        data: bytes = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
    except (RuntimeError, EOFError, ValueError) as error:
        raise ValueError(f"lz4: {error}") from error
    return data


def partial_body(packed: bytes) -> Body | None:
    """The whole messages of a chunk whose end is missing, as far as zstd gives them back. No CRC covers them."""
    data = partial_data(packed, COMPRESSION)
    end = whole_records(data, {OP_MESSAGE})
    try:
        return split_body(data[:end])
    except ValueError:
        return None


def partial_data(packed: bytes, compression: str) -> bytes:
    """What can be had of a compressed chunk whose end is missing; nothing where it makes no sense, or too much."""
    try:
        if compression == COMPRESSION:
            return _beginning(packed)
        if compression == LZ4:
            data: bytes = lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=MAX_CHUNK_BYTES)
            return data
    except (zstandard.ZstdError, RuntimeError, EOFError, ValueError):
        return b""
    return packed if compression == "" else b""


def _beginning(packed: bytes) -> bytes:
    """What zstd gives back before its data end, piece by piece: damaged data may swell to any size."""
    unpacker = zstandard.ZstdDecompressor().decompressobj()
    found = bytearray()
    for at in range(0, len(packed), _PIECE):
        found += unpacker.decompress(packed[at : at + _PIECE])
        if len(found) > MAX_CHUNK_BYTES:
            return b""
        if unpacker.eof:
            break
    return bytes(found)


def whole_records(data: bytes, opcodes: Collection[int]) -> int:
    """Where the last whole record in ``data`` ends, up to the first one of another kind than ``opcodes``."""
    at = 0
    while at + RECORD_PREFIX.size <= len(data):
        opcode, length = RECORD_PREFIX.unpack_from(data, at)
        if opcode not in opcodes or at + RECORD_PREFIX.size + length > len(data):
            break
        at += RECORD_PREFIX.size + length
    return at


def split_body(data: bytes) -> Body:
    """Finds the messages in the uncompressed records of a chunk. Raises ``ValueError`` if it is not of one channel."""
    if len(data) < RECORD_PREFIX.size + MESSAGE_FIXED:
        raise ValueError("chunk without a message")
    uniform = _uniform(data)
    return uniform if uniform is not None else _walk(data)


def _uniform(data: bytes) -> Body | None:
    """The fast way: all message records have the length of the first one."""
    opcode, length = RECORD_PREFIX.unpack_from(data)
    stride = RECORD_PREFIX.size + length
    if opcode != OP_MESSAGE or length < MESSAGE_FIXED or len(data) % stride:
        return None
    layout = np.dtype(
        {
            "names": ["opcode", "length", "channel", "log_time"],
            "formats": ["u1", "<u8", "<u2", "<u8"],
            "offsets": [0, 1, 9, 15],
            "itemsize": stride,
        }
    )
    view = np.frombuffer(data, dtype=layout)
    channel = view["channel"][0]
    if not (np.all(view["opcode"] == OP_MESSAGE) and np.all(view["length"] == length)):
        return None
    if not np.all(view["channel"] == channel):
        raise ValueError("chunk holds messages of several topics")
    return Body(int(channel), data, view["log_time"].copy(), np.arange(len(view), dtype=np.uint64) * np.uint64(stride))


def _walk(data: bytes) -> Body:
    """The plain way, record by record."""
    times, offsets, channels, at = [], [], set(), 0
    while at < len(data):
        if at + RECORD_PREFIX.size + MESSAGE_FIXED > len(data):
            raise ValueError("chunk ends inside a record")
        opcode, length = RECORD_PREFIX.unpack_from(data, at)
        if opcode != OP_MESSAGE or length < MESSAGE_FIXED or at + RECORD_PREFIX.size + length > len(data):
            raise ValueError("chunk holds something that is no message")
        channels.add(int.from_bytes(data[at + 9 : at + 11], "little"))
        times.append(int.from_bytes(data[at + 15 : at + 23], "little"))
        offsets.append(at)
        at += RECORD_PREFIX.size + length
    if len(channels) != 1:
        raise ValueError("chunk holds messages of several topics")
    return Body(channels.pop(), data, np.array(times, dtype=np.uint64), np.array(offsets, dtype=np.uint64))
