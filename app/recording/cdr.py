"""CDR (little-endian, plain XCDR1) for the messages of a recording.

CAN frames are encoded and decoded by the thousand as one NumPy structured array whose items are whole MCAP message
records; the rare messages (clock, state, event, telegram) go field by field. Layouts: ``docs/recording-format.md``.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from enum import Enum
from functools import cache
from itertools import repeat
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from app.wire.frame import Adu, Can, Direction, Fdl, Frame

NS: Final = 1_000_000_000
OP_MESSAGE: Final = 5
RECORD_PREFIX: Final = struct.Struct("<BQ")
MESSAGE_PREFIX: Final = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
MESSAGE_FIXED: Final = 22  # bytes of a message record that its length counts before the payload
ENCAPSULATION: Final = b"\x00\x01\x00\x00"
MAX_ID: Final = 0x1FFF_FFFF
MAX_DATA: Final = 8
MAX_DLC: Final = 15
MAX_T_NS: Final = NS << 31  # where the seconds of builtin_interfaces/Time end, in 2038


class Representation(Enum):
    """The forms of CDR whose layout of a CAN frame is the same but for the byte order: the first two bytes."""

    BIG_ENDIAN = 0x0000
    LITTLE_ENDIAN = 0x0001
    BIG_ENDIAN_2 = 0x0006
    LITTLE_ENDIAN_2 = 0x0007

    @property
    def order(self) -> str:
        """The byte order as ``struct`` and NumPy write it."""
        return "<" if self.value & 1 else ">"


Times = npt.NDArray[np.uint64]
CanArray = npt.NDArray[np.void]


def frame_id(bus: str, direction: Direction) -> str:
    """``can0/rx`` or ``can0/tx``: the same length for both directions."""
    return f"{bus}/{direction.value}"


@cache
def can_dtype(bus: str) -> np.dtype[np.void]:
    """The MCAP message record of one CAN frame on ``bus``, all bytes of it, packed."""
    text = len(bus.encode()) + 4  # "/rx" and NUL
    return np.dtype(
        [
            ("opcode", "u1"),
            ("length", "<u8"),
            ("channel", "<u2"),
            ("sequence", "<u4"),
            ("log_time", "<u8"),
            ("publish_time", "<u8"),
            ("encapsulation", "<u4"),
            ("sec", "<i4"),
            ("nanosec", "<u4"),
            ("frame_id_length", "<u4"),
            ("frame_id", f"S{(text + 3) // 4 * 4}"),
            ("id", "<u4"),
            ("is_rtr", "u1"),
            ("is_extended", "u1"),
            ("is_error", "u1"),
            ("dlc", "u1"),
            ("data", "S8"),
        ]
    )


def valid(frame: Frame) -> bool:
    """Whether a frame fits into its message type."""
    can = frame.payload
    if not 0 <= frame.t_ns < MAX_T_NS:
        return False
    return not isinstance(can, Can) or (
        0 <= can.can_id <= MAX_ID and len(can.data) <= MAX_DATA and -1 <= can.dlc <= MAX_DLC
    )


def encode_can(channel_id: int, bus: str, frames: Sequence[Frame]) -> CanArray:
    """Message records of CAN frames of one bus, sorted by time.

    Raises ``ValueError`` or ``OverflowError`` where a frame is not ``valid``.
    """
    t_ns, _, directions, payloads, _ = zip(*frames, strict=True)
    can_ids, datas, extended, remote, error, dlcs = zip(*payloads, strict=True)
    times = np.array(t_ns, dtype=np.uint64)
    lengths = np.fromiter(map(len, datas), np.int64, len(datas))
    dlc = np.array(dlcs, dtype=np.int64)
    dlc = np.where(dlc == -1, lengths, dlc)
    if lengths.max() > MAX_DATA or not 0 <= dlc.min() <= dlc.max() <= MAX_DLC:
        raise ValueError("a length that no classic CAN frame has")
    if max(can_ids) > MAX_ID or times.max() >= MAX_T_NS:
        raise ValueError("an identifier or a time stamp out of range")
    records: CanArray = np.zeros(len(times), dtype=can_dtype(bus))
    records["opcode"] = OP_MESSAGE
    records["length"] = records.dtype.itemsize - RECORD_PREFIX.size
    records["channel"] = channel_id
    records["log_time"] = times
    records["publish_time"] = times
    records["encapsulation"] = int.from_bytes(ENCAPSULATION, "little")
    records["sec"] = times // np.uint64(NS)
    records["nanosec"] = times % np.uint64(NS)
    records["frame_id_length"] = len(bus.encode()) + 4
    sent = np.array([direction is Direction.TX for direction in directions])
    records["frame_id"] = np.where(sent, frame_id(bus, Direction.TX).encode(), frame_id(bus, Direction.RX).encode())
    records["id"] = can_ids
    records["is_rtr"] = remote
    records["is_extended"] = extended
    records["is_error"] = error
    records["dlc"] = dlc
    records["data"] = np.array(datas, dtype="S8")
    if len(times) > 1 and not np.all(times[:-1] <= times[1:]):
        records = records[np.argsort(times, kind="stable")]
    return records


def decode_can(bus: str, records: CanArray) -> Iterator[Frame]:
    """The frames of whole message records (see ``can_dtype``)."""
    size = len(records)
    data = np.ascontiguousarray(records["data"]).tobytes()
    sent = records["frame_id"] == frame_id(bus, Direction.TX).encode()
    columns = zip(
        records["log_time"].tolist(),
        sent.tolist(),
        records["id"].tolist(),
        records["is_extended"].tolist(),
        records["is_rtr"].tolist(),
        records["is_error"].tolist(),
        records["dlc"].tolist(),
        range(0, 8 * size, 8),
        repeat(bus),
        strict=False,
    )
    for t_ns, is_sent, can_id, extended, remote, error, dlc, at, name in columns:
        can = make_can(can_id, data[at : at + 8], bool(extended), bool(remote), bool(error), dlc)
        yield Frame(t_ns, name, Direction.TX if is_sent else Direction.RX, can)


def make_can(can_id: int, data8: bytes, extended: bool, remote: bool, error: bool, dlc: int) -> Can:
    """A CAN payload in its plain form: ``dlc`` is given only where the number of data bytes does not tell it."""
    if remote:
        return Can(can_id, b"", extended, True, error, dlc)
    return Can(can_id, data8[:dlc], extended, False, error, dlc if dlc > MAX_DATA else -1)


class CdrWriter:
    """Builds one message payload, field by field. Alignment counts from behind the encapsulation header."""

    def __init__(self) -> None:
        self._out = bytearray()

    def _number(self, code: str, size: int, value: int) -> None:
        self._out += bytes(-len(self._out) % size)
        self._out += struct.pack("<" + code, value)

    def header(self, t_ns: int, text: str) -> None:
        """``std_msgs/Header``."""
        self._number("i", 4, t_ns // NS)
        self._number("I", 4, t_ns % NS)
        self.string(text)

    def uint8(self, value: int) -> None:
        """``uint8`` or ``bool``."""
        self._number("B", 1, value)

    def int64(self, value: int) -> None:
        """``int64``."""
        self._number("q", 8, value)

    def string(self, text: str) -> None:
        """``string``: length with the NUL, UTF-8, NUL."""
        raw = text.encode() + b"\x00"
        self._number("I", 4, len(raw))
        self._out += raw

    def octets(self, data: bytes) -> None:
        """``uint8[]``: length, bytes."""
        self._number("I", 4, len(data))
        self._out += data

    def payload(self) -> bytes:
        """The payload with its encapsulation header."""
        return ENCAPSULATION + bytes(self._out)


class CdrReader:
    """Reads one message payload, field by field. Raises ``ValueError`` where the bytes end too soon."""

    def __init__(self, payload: bytes) -> None:
        if payload[:4] != ENCAPSULATION:
            raise ValueError("not little-endian CDR")
        self._data = payload[4:]
        self._at = 0

    def _number(self, code: str, size: int) -> int:
        self._at += -self._at % size
        return int(struct.unpack("<" + code, self.take(size))[0])

    def take(self, size: int) -> bytes:
        """``size`` bytes without alignment."""
        piece = self._data[self._at : self._at + size]
        if len(piece) != size:
            raise ValueError("message ends too soon")
        self._at += size
        return piece

    def header(self) -> tuple[int, str]:
        """``std_msgs/Header``: t_ns and frame_id."""
        seconds, nanoseconds = self._number("i", 4), self._number("I", 4)
        return seconds * NS + nanoseconds, self.string()

    def uint8(self) -> int:
        """``uint8`` or ``bool``."""
        return self._number("B", 1)

    def uint32(self) -> int:
        """``uint32``."""
        return self._number("I", 4)

    def int64(self) -> int:
        """``int64``."""
        return self._number("q", 8)

    def string(self) -> str:
        """``string``."""
        return self.take(self._number("I", 4)).rstrip(b"\x00").decode()

    def octets(self) -> bytes:
        """``uint8[]``."""
        return self.take(self._number("I", 4))


class TelegramKind(Enum):
    """What a telegram message carries."""

    MODBUS_ADU = 1
    PROFIBUS_FDL = 2


class ClockReading(NamedTuple):
    """One pairing of the clocks, in nanoseconds.

    ``t_ns``, ``monotonic_ns`` and ``wall_ns`` were read together; the adapter's clock showed ``adapter_ns`` when the
    frame stamped ``adapter_t_ns`` was seen. ``bus`` is empty and the adapter's times are None where no bus gives them.
    """

    t_ns: int
    monotonic_ns: int
    wall_ns: int
    bus: str = ""
    adapter_ns: int | None = None
    adapter_t_ns: int | None = None


def encode_telegram(frame: Frame) -> bytes:
    """Payload of a Modbus ADU or a PROFIBUS telegram."""
    writer = CdrWriter()
    writer.header(frame.t_ns, frame_id(frame.bus, frame.direction))
    payload = frame.payload
    if isinstance(payload, Adu):
        writer.uint8(TelegramKind.MODBUS_ADU.value)
        writer.string(payload.link)
    elif isinstance(payload, Fdl):
        writer.uint8(TelegramKind.PROFIBUS_FDL.value)
        writer.string("")
    else:
        raise ValueError("a CAN frame is no telegram")
    writer.octets(payload.data)
    return writer.payload()


def decode_telegram(payload: bytes) -> Frame:
    """A frame from the payload of ``encode_telegram``. Raises ``ValueError`` on bytes that make no sense."""
    reader = CdrReader(payload)
    t_ns, text = reader.header()
    bus, direction = split_frame_id(text)
    kind = TelegramKind(reader.uint8())
    link, data = reader.string(), reader.octets()
    return Frame(t_ns, bus, direction, Adu(data, link) if kind is TelegramKind.MODBUS_ADU else Fdl(data))


def decode_can_payload(payload: bytes) -> Frame:
    """A frame from one ``can_msgs/msg/Frame``, however its frame_id is padded."""
    reader = CdrReader(payload)
    t_ns, text = reader.header()
    bus, direction = split_frame_id(text)
    can_id = reader.uint32()
    remote, extended, error, dlc = (reader.uint8() for _ in range(4))
    can = make_can(can_id, reader.take(8), bool(extended), bool(remote), bool(error), dlc)
    return Frame(t_ns, bus, direction, can)


def split_frame_id(text: str) -> tuple[str, Direction]:
    """Bus and direction from ``can0/tx``. Raises ``ValueError`` where it has another form."""
    bus, _, word = text.rpartition("/")
    return bus, Direction(word)


def encode_clock(reading: ClockReading) -> bytes:
    """Payload of a clock message."""
    writer = CdrWriter()
    writer.header(reading.t_ns, reading.bus)
    writer.int64(reading.monotonic_ns)
    writer.int64(reading.wall_ns)
    known = reading.adapter_ns is not None and reading.adapter_t_ns is not None
    writer.uint8(known)
    writer.int64(reading.adapter_ns or 0 if known else 0)
    writer.int64(reading.adapter_t_ns or 0 if known else 0)
    return writer.payload()


def decode_clock(payload: bytes) -> ClockReading:
    """The clocks from the payload of ``encode_clock``."""
    reader = CdrReader(payload)
    t_ns, bus = reader.header()
    monotonic_ns, wall_ns = reader.int64(), reader.int64()
    known = bool(reader.uint8())
    adapter_ns, adapter_t_ns = reader.int64(), reader.int64()
    if not known:
        return ClockReading(t_ns, monotonic_ns, wall_ns, bus)
    return ClockReading(t_ns, monotonic_ns, wall_ns, bus, adapter_ns, adapter_t_ns)


def encode_texts(t_ns: int, bus: str, *texts: str) -> bytes:
    """Payload of a state (one text) or an event (kind and details)."""
    writer = CdrWriter()
    writer.header(t_ns, bus)
    for text in texts:
        writer.string(text)
    return writer.payload()


def decode_texts(payload: bytes, count: int) -> tuple[Any, ...]:
    """``(t_ns, bus, text, ...)`` from the payload of ``encode_texts``."""
    reader = CdrReader(payload)
    return (*reader.header(), *(reader.string() for _ in range(count)))


def message_record(channel_id: int, t_ns: int, payload: bytes) -> bytes:
    """One MCAP message record; its sequence number is always 0."""
    return MESSAGE_PREFIX.pack(OP_MESSAGE, MESSAGE_FIXED + len(payload), channel_id, 0, t_ns, t_ns) + payload
