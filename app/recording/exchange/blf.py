"""Vector's BLF, by python-can's layouts: whole ns counted from a start in milliseconds, channels in place of buses.

python-can computes with floats of seconds since 1970, which loses up to 119 ns of a stamp on either way, and its reader
says nothing of a file that ends in the middle, of objects that it does not know, nor of error frames of the old type.
A measurement comment keeps the names of the buses.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

from can import Message
from can.io import blf
from can.io.blf import BLFWriter

from app.errors import RecordingError
from app.recording.cdr import MAX_DATA, MAX_DLC, MAX_ID, NS, make_can
from app.recording.exchange.formats import HEAD_MARK, Head
from app.recording.exchange.lines import MAX_LISTED, Notes, Other, Skipped
from app.wire.frame import Can, Direction, Frame

MS: Final = 1_000_000
CAN_ERROR: Final = 2
APP_TEXT: Final = 65
MAX_CONTAINER: Final = 64 << 20  # bytes; a container that claims more is damage, not a reason to allocate it
_APP_TEXT: Final = struct.Struct("<LLLL")
_OLD_ERROR: Final = struct.Struct("<HH")
_ALIGNMENT: Final = 8
_FD_TYPES: Final = (blf.CAN_FD_MESSAGE, blf.CAN_FD_MESSAGE_64)
_FD_FLAG_AT: Final = 13  # of a CAN_FD_MESSAGE; clear where the frame is a classic one
_MEASUREMENT_COMMENT: Final = 0


class ExactBlfWriter(BLFWriter):
    """python-can's writer with stamps in whole ns: the ``timestamp`` of a message is its ``t_ns``."""

    def __init__(self, file: Path, head: Head) -> None:
        super().__init__(file)
        self.start_ns = head.started_ns // MS * MS
        self.start_timestamp = self.start_ns / NS
        self.stop_timestamp = self.start_timestamp
        self._comment(HEAD_MARK + head.to_json())

    def add(self, frame: Frame, can: Can, channel: int) -> None:
        """Writes a frame on the channel that counts from 0."""
        if can.error:  # python-can counts the DLC of an error frame as one of CAN FD
            self._add_object(blf.CAN_ERROR_EXT, _error_object(channel, can), frame.t_ns)
        else:
            self.on_message_received(_message(frame, can, channel))

    def _comment(self, text: str) -> None:
        data = text.encode()
        data += bytes(-len(data) % 4)
        self._add_object(APP_TEXT, _APP_TEXT.pack(_MEASUREMENT_COMMENT, 0, len(data), 0) + data, self.start_ns)

    def _add_object(self, obj_type: int, data: bytes, timestamp: float | None = None) -> None:
        t_ns = self.start_ns if timestamp is None else int(timestamp)
        self.stop_timestamp = t_ns / NS
        header_size = blf.OBJ_HEADER_BASE_STRUCT.size + blf.OBJ_HEADER_V1_STRUCT.size
        self._buffer += [
            blf.OBJ_HEADER_BASE_STRUCT.pack(b"LOBJ", header_size, 1, header_size + len(data), obj_type),
            blf.OBJ_HEADER_V1_STRUCT.pack(blf.TIME_ONE_NANS, 0, 0, max(t_ns - self.start_ns, 0)),
            data,
        ]
        self._buffer_size += header_size + len(data)
        self.object_count += 1
        while self._buffer_size >= self.max_container_size:
            self._flush()


def write_blf(path: Path, head: Head, frames: Iterable[Frame]) -> None:
    """Writes frames that are ``held``. Raises OSError."""
    channels = {bus: number for number, bus in enumerate(head.buses)}
    with ExactBlfWriter(path, head) as writer:
        for frame in frames:
            can = frame.payload
            if isinstance(can, Can):
                writer.add(frame, can, channels[frame.bus])


def _message(frame: Frame, can: Can, channel: int) -> Message:
    return Message(
        timestamp=frame.t_ns,
        arbitration_id=can.can_id,
        is_extended_id=can.extended,
        is_remote_frame=can.remote,
        is_rx=frame.direction is Direction.RX,
        dlc=can.length,
        data=can.data,
        channel=channel,
    )


def _error_object(channel: int, can: Can) -> bytes:
    identifier = can.can_id | (blf.CAN_MSG_EXT if can.extended else 0)
    packed: bytes = blf.CAN_ERROR_EXT_STRUCT.pack(channel + 1, 0, 0, 0, 0, can.length, 0, identifier, 0, can.data)
    return packed


class _Object(NamedTuple):
    """One object: its type, its time in ns since the start, its content."""

    kind: int
    at_ns: int
    data: bytes


class BlfReader:
    """Reads a file. Raises RecordingError with the offset at damage in the middle, unless ``lenient``."""

    def __init__(self, path: Path, notes: Notes, lenient: bool) -> None:
        self._path, self._notes, self._lenient = path, notes, lenient
        self._start_ns = 0

    def frames(self) -> Iterator[Frame]:
        """The frames in the order of the file. Raises RecordingError and OSError."""
        with self._path.open("rb") as file:
            self._read_head(file)
            for found in self._objects(file):
                frame = self._frame(found)
                if frame is not None:
                    yield frame

    def _error(self, offset: int, reason: str) -> RecordingError:
        return RecordingError(file=self._path.name, offset=offset, reason=reason)

    def _read_head(self, file: BinaryIO) -> None:
        data = file.read(blf.FILE_HEADER_STRUCT.size)
        if len(data) < blf.FILE_HEADER_STRUCT.size or data[:4] != b"LOGG":
            raise self._error(0, "no BLF file, or its head is cut off")
        fields = blf.FILE_HEADER_STRUCT.unpack(data)
        self._start_ns = round(blf.systemtime_to_timestamp(fields[14:22]) * 1000) * MS
        self._notes.wall_known = self._start_ns > 0
        file.seek(max(fields[1], blf.FILE_HEADER_STRUCT.size))

    def _objects(self, file: BinaryIO) -> Iterator[_Object]:
        """The objects of all containers; one may go on in the next container."""
        tail = b""
        for offset, data in self._containers(file):
            if data is None:  # what was begun before the damage has no end
                tail = b""
                continue
            tail += data
            at = 0
            while (found := self._object_at(tail, at, offset)) is not None:
                item, at = found
                if item is not None:
                    yield item
            tail = tail[at:]
            if len(tail) > MAX_CONTAINER:
                raise self._error(offset, "an object that has no end")
        if tail.strip(b"\0") and self._notes.truncated is None:
            self._notes.truncated = self._path.stat().st_size

    def _containers(self, file: BinaryIO) -> Iterator[tuple[int, bytes | None]]:
        """Offset and uncompressed bytes of each container; None where they are damaged and left out."""
        base = blf.OBJ_HEADER_BASE_STRUCT
        while head := file.read(base.size):
            offset = file.tell() - len(head)
            if len(head) < base.size:
                self._notes.truncated = offset
                return
            signature, _, _, size, kind = base.unpack(head)
            if signature != b"LOBJ" or not base.size <= size <= MAX_CONTAINER:
                raise self._error(offset, "no object of a BLF file")
            body = file.read(size - base.size)
            if len(body) < size - base.size:
                self._notes.truncated = offset
            file.read(size % 4)
            if kind != blf.LOG_CONTAINER:
                self._notes.other[Other.STATUS] += 1
            elif len(body) >= blf.LOG_CONTAINER_STRUCT.size:
                yield offset, self._unpacked(body, offset)

    def _unpacked(self, body: bytes, offset: int) -> bytes | None:
        method, _ = blf.LOG_CONTAINER_STRUCT.unpack_from(body)
        packed = body[blf.LOG_CONTAINER_STRUCT.size :]
        if method == blf.NO_COMPRESSION:
            return packed
        if method != blf.ZLIB_DEFLATE:
            raise self._error(offset, f"compression {method} is not known")
        try:
            unpacker = zlib.decompressobj()
            data = unpacker.decompress(packed, MAX_CONTAINER)
        except zlib.error as error:
            if self._lenient:
                self._notes.skip(offset, f"zlib: {error}")
                return None
            raise self._error(offset, f"zlib: {error}") from error
        if not unpacker.eof and self._notes.truncated is None:
            self._notes.truncated = offset
        return data

    def _object_at(self, data: bytes, at: int, offset: int) -> tuple[_Object | None, int] | None:
        """The object at or just behind ``at`` (they are padded) and where it ends; None where more bytes are needed."""
        base = blf.OBJ_HEADER_BASE_STRUCT
        start = data.find(b"LOBJ", at, at + _ALIGNMENT)
        if start < 0:
            if at + _ALIGNMENT > len(data):
                return None
            start = self._next_object(data, at, offset)
        if start < 0 or start + base.size > len(data):
            return None
        _, _, version, size, kind = base.unpack_from(data, start)
        if size < base.size:
            raise self._error(offset, "an object smaller than its head")
        if start + size > len(data):
            return None
        return self._object(data[start + base.size : start + size], version, kind), start + size

    def _next_object(self, data: bytes, at: int, offset: int) -> int:
        if not self._lenient:
            raise self._error(offset, "bytes that are no object")
        self._notes.skipped_lines += 1
        if len(self._notes.skipped) < MAX_LISTED:
            self._notes.skipped.append(Skipped(offset, "bytes that are no object"))
        return data.find(b"LOBJ", at)

    def _object(self, body: bytes, version: int, kind: int) -> _Object | None:
        head = {1: blf.OBJ_HEADER_V1_STRUCT, 2: blf.OBJ_HEADER_V2_STRUCT}.get(version)
        if head is None or len(body) < head.size:
            self._notes.other[Other.STATUS] += 1
            return None
        flags, _, _, count = head.unpack_from(body)
        return _Object(kind, count * 10_000 if flags == blf.TIME_TEN_MICS else count, body[head.size :])

    def _frame(self, found: _Object) -> Frame | None:
        kind, at_ns, data = found
        try:
            if kind in (blf.CAN_MESSAGE, blf.CAN_MESSAGE2):
                channel, direction, can = _classic(data)
            elif kind == blf.CAN_ERROR_EXT:
                channel, direction, can = _error(data)
            elif kind == CAN_ERROR:
                channel, direction, can = _OLD_ERROR.unpack_from(data)[0], Direction.RX, Can(0, b"", error=True)
            elif kind == blf.CAN_FD_MESSAGE and len(data) >= blf.CAN_FD_MSG_STRUCT.size and not data[_FD_FLAG_AT] & 1:
                channel, direction, can = _classic(data[:8] + data[20:28])  # on a channel of CAN FD
            else:
                self._pass_over(kind, data)
                return None
        except struct.error:
            self._notes.other[Other.STATUS] += 1
            return None
        return Frame(self._start_ns + at_ns, self._bus(channel), direction, can)

    def _pass_over(self, kind: int, data: bytes) -> None:
        if kind == APP_TEXT and len(data) >= _APP_TEXT.size:
            text = data[_APP_TEXT.size :].rstrip(b"\0").decode("utf-8", "replace")
            if text.startswith(HEAD_MARK):
                self._notes.head = Head.from_json(text[len(HEAD_MARK) :])
                return
        self._notes.other[Other.CAN_FD if kind in _FD_TYPES else Other.STATUS] += 1

    def _bus(self, channel: int) -> str:
        head = self._notes.head
        if head is not None and 1 <= channel <= len(head.buses):
            return head.buses[channel - 1]
        return f"can{channel - 1 if channel else 0}"


def _classic(data: bytes) -> tuple[int, Direction, Can]:
    channel, flags, dlc, identifier, data8 = blf.CAN_MSG_STRUCT.unpack_from(data)
    dlc = min(dlc, MAX_DLC)
    extended = bool(identifier & blf.CAN_MSG_EXT)
    can = make_can(identifier & MAX_ID, data8, extended, bool(flags & blf.REMOTE_FLAG), False, dlc)
    return channel, Direction.TX if flags & blf.DIR else Direction.RX, can


def _error(data: bytes) -> tuple[int, Direction, Can]:
    channel, _, _, _, _, dlc, _, identifier, _, data8 = blf.CAN_ERROR_EXT_STRUCT.unpack_from(data)
    can = make_can(
        identifier & MAX_ID, data8[:MAX_DATA], bool(identifier & blf.CAN_MSG_EXT), False, True, min(dlc, MAX_DLC)
    )
    return channel, Direction.RX, can
