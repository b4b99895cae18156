"""FDL telegrams: SD1 without data, SD2 with 1 to 246 bytes, SD3 with 8, SD4 the token, and the single byte SC.

The data begin with the service access points where bit 7 of the addresses says so: DSAP, then SSAP.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

from app.wire.profibus.control import Control, decode_control
from app.wire.profibus.fields import FormatError, checked
from app.wire.records import Fault

SD1: Final = 0x10
SD2: Final = 0x68
SD3: Final = 0xA2
SD4: Final = 0xDC
SC: Final = 0xE5
ED: Final = 0x16
BROADCAST: Final = 127
MAX_ADDRESS: Final = 126
MAX_SAP: Final = 63
FIXED_DATA: Final = 8
"""Bytes that SD3 carries, access points included."""
HEAD: Final = 3
"""DA, SA and FC, which LE counts as well."""
MIN_LE: Final = HEAD + 1
MAX_LE: Final = 249
MAX_DATA: Final = MAX_LE - HEAD
MAX_TELEGRAM: Final = MAX_LE + 6
BITS_PER_BYTE: Final = 11
"""Start, eight of data, parity, stop."""
_SIZES: Final = {SD1: 6, SD3: 14, SD4: 3, SC: 1}
_EXTENDED: Final = 0x80
_NO_SAP: Final = 0xC0
"""More extensions follow, or the extension is the number of a segment: DP has neither."""


@dataclass(frozen=True, slots=True)
class ShortAck:
    """SC: done, nothing to say. It tells neither who sends it nor to whom."""

    def encode(self) -> bytes:
        """Bytes on the line."""
        return bytes((SC,))


class Token(NamedTuple):
    """SD4: the right to send goes from one master to the next. It has no check sum."""

    destination: int
    source: int

    def encode(self) -> bytes:
        """Bytes on the line. Raises ValueError where an address is out of range."""
        destination = checked(self.destination, 0, MAX_ADDRESS, "destination")
        return bytes((SD4, destination, checked(self.source, 0, MAX_ADDRESS, "source")))


class Telegram(NamedTuple):
    """SD1, SD2 or SD3. ``data`` are what follows the access points; ``fixed`` asks for SD3."""

    destination: int
    source: int
    control: Control
    data: bytes = b""
    dsap: int | None = None
    ssap: int | None = None
    fixed: bool = False

    @property
    def control_offset(self) -> int:
        """Where FC stands in the bytes on the line."""
        short = self.fixed or not (self.data or self.dsap is not None or self.ssap is not None)
        return 3 if short else 6

    @property
    def data_offset(self) -> int:
        """Where ``data`` begin in the bytes on the line."""
        return self.control_offset + 1 + (self.dsap is not None) + (self.ssap is not None)

    def encode(self) -> bytes:
        """Bytes on the line. Raises ValueError where a field is out of range, or the data fit no telegram."""
        unit = b"".join(_extension(sap) for sap in (self.dsap, self.ssap)) + self.data
        body = bytes(
            (
                checked(self.destination, 0, BROADCAST, "destination") | _EXTENDED * (self.dsap is not None),
                checked(self.source, 0, MAX_ADDRESS, "source") | _EXTENDED * (self.ssap is not None),
                self.control.encode(),
            )
        )
        tail = bytes((check_sum(body + unit), ED))
        if self.fixed:
            checked(len(unit), FIXED_DATA, FIXED_DATA, "data length")
            return bytes((SD3,)) + body + unit + tail
        if not unit:
            return bytes((SD1,)) + body + tail
        length = HEAD + checked(len(unit), 1, MAX_DATA, "data length")
        return bytes((SD2, length, length, SD2)) + body + unit + tail


AnyTelegram = Telegram | Token | ShortAck


def wire_bits(size: int) -> int:
    """Bits that ``size`` bytes of telegrams take on the line; the pauses between telegrams are not in it."""
    return size * BITS_PER_BYTE


def check_sum(data: bytes) -> int:
    """FCS: the sum from DA to the last byte of data, modulo 256."""
    return sum(data) & 0xFF


def size_of(data: bytes | bytearray) -> int | None:
    """Bytes of the telegram that begins here; None where its length is not there yet.

    Raises FormatError as soon as what is there begins no telegram.
    """
    if not data:
        return None
    start = data[0]
    if start in _SIZES:
        return _SIZES[start]
    if start != SD2:
        raise FormatError(Fault.DELIMITER, 0, f"{start:02X}h begins no telegram")
    if len(data) > 1 and not MIN_LE <= data[1] <= MAX_LE:
        raise FormatError(Fault.LENGTH, 1, f"LE is {data[1]}, not {MIN_LE} to {MAX_LE}")
    if len(data) > 2 and data[2] != data[1]:
        raise FormatError(Fault.LENGTH, 2, f"LEr is {data[2]}, LE {data[1]}")
    if len(data) > 3 and data[3] != SD2:
        raise FormatError(Fault.DELIMITER, 3, f"the second start delimiter is {data[3]:02X}h")
    return data[1] + 6 if len(data) > 3 else None


def decode(data: bytes) -> AnyTelegram:
    """Read one whole telegram. Raises FormatError, also where bytes are missing or left over."""
    size = size_of(data)
    if size is None or len(data) < size:
        raise FormatError(Fault.LENGTH, len(data), "the telegram ends too early")
    if len(data) > size:
        raise FormatError(Fault.LENGTH, size, f"{len(data) - size} bytes too many")
    start = data[0]
    if start == SC:
        return ShortAck()
    if start == SD4:
        return Token(_plain_address(data, 1), _plain_address(data, 2))
    if data[-1] != ED:
        raise FormatError(Fault.DELIMITER, size - 1, f"the end delimiter is {data[-1]:02X}h")
    head = 4 if start == SD2 else 1
    found, wanted = data[-2], check_sum(data[head:-2])
    if found != wanted:
        raise FormatError(Fault.CHECKSUM, size - 2, f"FCS is {found:02X}h, {wanted:02X}h is right")
    return _telegram(data, head, fixed=start == SD3)


def _telegram(data: bytes, head: int, fixed: bool) -> Telegram:
    destination, source = data[head], data[head + 1]
    if source & ~_EXTENDED > MAX_ADDRESS:
        raise FormatError(Fault.FIELD, head + 1, "no station sends as address 127")
    control = decode_control(data[head + 2], head + 2)
    at, end, saps = head + HEAD, len(data) - 2, []
    for address in (destination, source):
        saps.append(_sap(data, at, end) if address & _EXTENDED else None)
        at += saps[-1] is not None
    return Telegram(
        destination & ~_EXTENDED, source & ~_EXTENDED, control, bytes(data[at:end]), saps[0], saps[1], fixed
    )


def _sap(data: bytes, at: int, end: int) -> int:
    if at >= end:
        raise FormatError(Fault.LENGTH, at, "an address is extended, and no extension follows")
    if data[at] & _NO_SAP:
        raise FormatError(Fault.FIELD, at, f"address extension {data[at]:02X}h is no access point")
    return data[at]


def _plain_address(data: bytes, at: int) -> int:
    if data[at] > MAX_ADDRESS:
        raise FormatError(Fault.FIELD, at, f"{data[at]} is no address of a master")
    return data[at]


def _extension(sap: int | None) -> bytes:
    return b"" if sap is None else bytes((checked(sap, 0, MAX_SAP, "access point"),))
