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


def abort_text_key(code: int) -> str:
    """Text key of an abort code; unknown codes share one."""
    try:
        return f"abort.{Abort(code).name.lower()}"
    except ValueError:
        return "abort.unknown"


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
