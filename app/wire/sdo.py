"""Byte codec of SDO (CiA 301, 7.2.4.3): builds and reads the 8 bytes of each protocol step. Pure.

Client to server on 600h + node, server to client on 580h + node, unless 1200h says otherwise.
"""

from __future__ import annotations

import binascii
import struct
from enum import IntEnum
from typing import Final, NamedTuple

from app.model.address import Address

_IDX: Final = struct.Struct("<BHB4s")
_IDX_U32: Final = struct.Struct("<BHBI")

REQUEST_BASE: Final = 0x600
RESPONSE_BASE: Final = 0x580


class Abort(IntEnum):
    """Abort codes of CiA 301, table 22."""

    TOGGLE_BIT = 0x05030000
    TIMED_OUT = 0x05040000
    COMMAND_UNKNOWN = 0x05040001
    BLOCK_SIZE = 0x05040002
    SEQUENCE_NUMBER = 0x05040003
    CRC = 0x05040004
    OUT_OF_MEMORY = 0x05040005
    UNSUPPORTED_ACCESS = 0x06010000
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_LENGTH = 0x06040042
    PARAMETER_INCOMPATIBLE = 0x06040043
    INTERNAL_INCOMPATIBLE = 0x06040047
    HARDWARE = 0x06060000
    LENGTH = 0x06070010
    LENGTH_TOO_HIGH = 0x06070012
    LENGTH_TOO_LOW = 0x06070013
    NO_SUB_INDEX = 0x06090011
    VALUE_RANGE = 0x06090030
    VALUE_TOO_HIGH = 0x06090031
    VALUE_TOO_LOW = 0x06090032
    MAX_BELOW_MIN = 0x06090036
    RESOURCE = 0x060A0023
    GENERAL = 0x08000000
    NOT_STORED = 0x08000020
    LOCAL_CONTROL = 0x08000021
    DEVICE_STATE = 0x08000022
    NO_DICTIONARY = 0x08000023
    NO_DATA = 0x08000024


class GatewayAbort(IntEnum):
    """Abort codes beyond CiA 301 of a gateway to an object dictionary (PD4-E manual, pages 105, 109 and 112)."""

    GATEWAY_NO_ERROR = 0xFFFF0000
    GATEWAY_COMMAND = 0xFFFF0003
    GATEWAY_ACCESS = 0xFFFF0008
    GATEWAY_PARAMETER = 0xFFFF000E
    GATEWAY_SERVICE = 0xFFFF1003
    GATEWAY_SEQUENCE = 0xFFFF1004


_ABORT_NAMES: Final = {code.value: code.name.lower() for code in (*Abort, *GatewayAbort)}


def abort_text_key(code: int) -> str:
    """Text key of an abort code; unknown codes share one."""
    return f"abort.{_ABORT_NAMES.get(code, 'unknown')}"


class Command(IntEnum):
    """Client (ccs) and server (scs) command specifiers, bits 7..5 of the first byte."""

    CCS_DOWNLOAD_SEGMENT = 0
    CCS_DOWNLOAD = 1
    CCS_UPLOAD = 2
    CCS_UPLOAD_SEGMENT = 3
    ABORT = 4
    CCS_BLOCK_UPLOAD = 5
    CCS_BLOCK_DOWNLOAD = 6
    SCS_UPLOAD_SEGMENT = 0
    SCS_DOWNLOAD_SEGMENT = 1
    SCS_UPLOAD = 2
    SCS_DOWNLOAD = 3
    SCS_BLOCK_DOWNLOAD = 5
    SCS_BLOCK_UPLOAD = 6


class Multiplexed(NamedTuple):
    """A frame that carries an address: initiate request or response, or abort."""

    command: int
    flags: int
    address: Address
    data: bytes


class Segment(NamedTuple):
    """A segment, or its acknowledge."""

    command: int
    toggle: bool
    last: bool
    data: bytes


def multiplexed(data: bytes) -> Multiplexed:
    """Read an initiate or abort frame of 8 bytes; ``flags`` are bits 4..0 of its first byte."""
    head, index, sub, rest = _IDX.unpack(data)
    return Multiplexed(head >> 5, head & 0x1F, Address(index, sub), rest)


def segment(data: bytes) -> Segment:
    """Read a segment frame of 8 bytes: ``data`` without its unused bytes."""
    head = data[0]
    return Segment(head >> 5, bool(head & 0x10), bool(head & 1), data[1 : 8 - (head >> 1 & 7)])


def expedited_data(frame: Multiplexed) -> bytes | None:
    """Data of an expedited initiate frame; None where the transfer is segmented."""
    if not frame.flags & 2:
        return None
    return frame.data[: 4 - (frame.flags >> 2 & 3)] if frame.flags & 1 else frame.data


def announced_size(frame: Multiplexed) -> int | None:
    """Size in bytes that a segmented initiate frame announces; None where it does not."""
    return int.from_bytes(frame.data, "little") if frame.flags & 1 else None


# -- requests of a client ------------------------------------------------------


def upload_request(address: Address) -> bytes:
    """Initiate upload (read)."""
    return _IDX.pack(0x40, address.major, address.minor, bytes(4))


def download_request(address: Address, data: bytes) -> bytes:
    """Initiate download (write): expedited up to 4 bytes, else it announces the size."""
    if 0 < len(data) <= 4:
        head = 0x23 | (4 - len(data)) << 2
        return _IDX.pack(head, address.major, address.minor, data.ljust(4, b"\0"))
    return _IDX_U32.pack(0x21, address.major, address.minor, len(data))


def upload_segment_request(toggle: bool) -> bytes:
    """Ask for the next segment."""
    return bytes([0x60 | toggle << 4]) + bytes(7)


def download_segment_request(data: bytes, toggle: bool, last: bool) -> bytes:
    """Send up to 7 bytes."""
    return bytes([toggle << 4 | (7 - len(data)) << 1 | last]) + data.ljust(7, b"\0")


def abort(address: Address, code: int) -> bytes:
    """Abort the transfer, from either side."""
    return _IDX_U32.pack(0x80, address.major, address.minor, code)


def abort_code(frame: Multiplexed) -> int:
    """The code of an abort frame."""
    return int.from_bytes(frame.data, "little")


# -- answers of a server -------------------------------------------------------


def upload_response(address: Address, data: bytes) -> bytes:
    """Answer a read: expedited up to 4 bytes, else it announces the size."""
    if 0 < len(data) <= 4:
        head = 0x43 | (4 - len(data)) << 2
        return _IDX.pack(head, address.major, address.minor, data.ljust(4, b"\0"))
    return _IDX_U32.pack(0x41, address.major, address.minor, len(data))


def download_response(address: Address) -> bytes:
    """Acknowledge a write."""
    return _IDX.pack(0x60, address.major, address.minor, bytes(4))


def upload_segment_response(data: bytes, toggle: bool, last: bool) -> bytes:
    """Give up to 7 bytes."""
    return bytes([toggle << 4 | (7 - len(data)) << 1 | last]) + data.ljust(7, b"\0")


def download_segment_response(toggle: bool) -> bytes:
    """Acknowledge a segment."""
    return bytes([0x20 | toggle << 4]) + bytes(7)


# -- block transfer (7.2.4.3.9 ff) ----------------------------------------------


def crc(data: bytes, value: int = 0) -> int:
    """CRC of block transfers: CCITT polynomial 1021h, start 0 (7.2.4.3.16)."""
    return binascii.crc_hqx(data, value)


MAX_BLOCK_SIZE: Final = 127
SEGMENT_SIZE: Final = 7


class BlockStep(IntEnum):
    """Sub-command of block frames, the lowest bits of the first byte. Sub-block segments have none."""

    INITIATE = 0
    END = 1
    ACKNOWLEDGE = 2
    START = 3


class BlockInitiate(NamedTuple):
    """Initiate frame of the side that sends the data; ``size`` in bytes is None where it is not announced."""

    address: Address
    crc: bool
    size: int | None


class BlockAccept(NamedTuple):
    """Initiate frame of the side that receives the data: segments a block; ``pst`` only from a client (upload).

    ``pst`` is the protocol switch threshold in bytes: up to it a server may answer with a plain upload; 0 forbids it.
    """

    address: Address
    crc: bool
    block_size: int
    pst: int = 0


class BlockSegment(NamedTuple):
    """A segment of a sub-block: ``sequence`` 1..127, always 7 bytes; the unused ones are told by the end frame."""

    sequence: int
    last: bool
    data: bytes


class BlockAcknowledge(NamedTuple):
    """Last segment received in order (0: none), and segments a block from now on."""

    sequence: int
    block_size: int


class BlockEnd(NamedTuple):
    """Bytes of the last segment that are no data, and the CRC over all data (0 where not agreed)."""

    unused: int
    crc: int


def block_step(data: bytes) -> BlockStep:
    """Sub-command of a block frame that is no segment: one bit from the sender of the data, two from its receiver."""
    return BlockStep(data[0] & (1 if data[0] >> 5 == Command.CCS_BLOCK_DOWNLOAD else 3))


def block_download_request(address: Address, size: int | None, crc: bool = True) -> bytes:
    """Client: initiate a block download (write)."""
    return _IDX_U32.pack(0xC0 | crc << 2 | (size is not None) << 1, address.major, address.minor, size or 0)


def block_download_response(address: Address, block_size: int, crc: bool = True) -> bytes:
    """Server: accept a block download."""
    return _IDX.pack(0xA0 | crc << 2, address.major, address.minor, bytes((block_size, 0, 0, 0)))


def block_upload_request(address: Address, block_size: int, pst: int = 0, crc: bool = True) -> bytes:
    """Client: initiate a block upload (read)."""
    return _IDX.pack(0xA0 | crc << 2, address.major, address.minor, bytes((block_size, pst, 0, 0)))


def block_upload_response(address: Address, size: int | None, crc: bool = True) -> bytes:
    """Server: accept a block upload."""
    return _IDX_U32.pack(0xC0 | crc << 2 | (size is not None) << 1, address.major, address.minor, size or 0)


def block_upload_start() -> bytes:
    """Client: let the server send the first sub-block."""
    return b"\xa3" + bytes(7)


def block_segment(sequence: int, data: bytes, last: bool) -> bytes:
    """One segment of up to 7 bytes, from client (download) or server (upload).

    Raises ValueError where the sequence number is not 1..127.
    """
    if not 1 <= sequence <= MAX_BLOCK_SIZE:
        raise ValueError(f"sequence number {sequence} is outside 1..127")
    return bytes((last << 7 | sequence,)) + data.ljust(SEGMENT_SIZE, b"\0")


def block_acknowledge(sequence: int, block_size: int) -> bytes:
    """Acknowledge a sub-block, from server (download) or client (upload): the same bytes."""
    return bytes((0xA2, sequence, block_size)) + bytes(5)


def block_end(unused: int, crc: int) -> bytes:
    """End of the data, from client (download) or server (upload): the same bytes."""
    return bytes((0xC1 | unused << 2, crc & 0xFF, crc >> 8)) + bytes(5)


def block_end_response() -> bytes:
    """Confirm the end, from server (download) or client (upload): the same bytes."""
    return b"\xa1" + bytes(7)


def parse_block_initiate(data: bytes) -> BlockInitiate:
    """Read ``block_download_request`` or ``block_upload_response``."""
    head, index, sub, size = _IDX_U32.unpack(data)
    return BlockInitiate(Address(index, sub), bool(head & 4), size if head & 2 else None)


def parse_block_accept(data: bytes) -> BlockAccept:
    """Read ``block_download_response`` or ``block_upload_request``."""
    head, index, sub, rest = _IDX.unpack(data)
    return BlockAccept(Address(index, sub), bool(head & 4), rest[0], rest[1])


def parse_block_segment(data: bytes) -> BlockSegment:
    """Read a segment of a sub-block."""
    return BlockSegment(data[0] & 0x7F, bool(data[0] & 0x80), data[1:])


def parse_block_acknowledge(data: bytes) -> BlockAcknowledge:
    """Read the acknowledge of a sub-block."""
    return BlockAcknowledge(data[1], data[2])


def parse_block_end(data: bytes) -> BlockEnd:
    """Read the end of the data."""
    return BlockEnd(data[0] >> 2 & 7, data[1] | data[2] << 8)
