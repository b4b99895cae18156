"""PKW: one parameter a time in the first eight bytes of telegrams 1, 102 and 103 (ED2 manual, 4.6 and 4.7).

PKE 2 (AK 4 bits, 4 reserved, PNU 8), IND 1, reserved 1, PWE 4; the most significant byte first, as the manual's two
examples have it. Chapter 1.4 speaks of the least significant first for all words, which these examples refute.

A number of the answer is not that of its request. There is nothing that tells a new job from the one before: a master
sends AK 0 between two jobs and waits for AK 0. Only AK 7 tells a failure, and its code 0 is one.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

from app.model.address import Address, Addressing
from app.wire.profibus.fields import FormatError, checked
from app.wire.records import Fault

SIZE: Final = 8
_MAX_VALUE: Final = 0xFFFFFFFF


class AskKind(IntEnum):
    """AK of a request."""

    NOTHING = 0
    READ = 1
    WRITE_WORD = 2
    WRITE_DOUBLE = 3
    WRITE_BYTE = 10


class ReplyKind(IntEnum):
    """AK of an answer."""

    NOTHING = 0
    WORD = 1
    DOUBLE = 2
    REFUSED = 7
    BYTE = 11


class PkwError(IntEnum):
    """Why a job was refused (4.6). The manual has none for a wrong IND, and none for a wrong state."""

    UNKNOWN_PNU = 0
    NOT_CHANGEABLE = 1
    OUT_OF_RANGE = 2
    WRONG_LENGTH = 5
    OTHER = 18


_WRITES: Final = {1: AskKind.WRITE_BYTE, 2: AskKind.WRITE_WORD, 4: AskKind.WRITE_DOUBLE}
_WRITTEN: Final = {kind: size for size, kind in _WRITES.items()}
_REPLY_SIZES: Final = {ReplyKind.BYTE: 1, ReplyKind.WORD: 2, ReplyKind.DOUBLE: 4}
_REPLY_OF: Final = {
    AskKind.WRITE_BYTE: ReplyKind.BYTE,
    AskKind.WRITE_WORD: ReplyKind.WORD,
    AskKind.WRITE_DOUBLE: ReplyKind.DOUBLE,
}
NOWHERE: Final = Address(0, 0, Addressing.PKW)


def error_text_key(code: int) -> str:
    """Text key of an error code; unknown ones share one."""
    try:
        return f"profibus.pkw.{PkwError(code).name.lower()}"
    except ValueError:
        return "profibus.pkw.unknown"


class PkwRequest(NamedTuple):
    """A job. ``value`` is PWE as an unsigned number: of a read it is 0, but for 12/224 and 12/225."""

    kind: AskKind
    address: Address = NOWHERE
    value: int = 0

    @property
    def data(self) -> bytes | None:
        """What is to be written, least significant byte first; None where nothing is."""
        size = _WRITTEN.get(self.kind)
        return None if size is None else self.value.to_bytes(4, "little")[:size]

    def encode(self) -> bytes:
        """Eight bytes. Raises ValueError where a field is out of range."""
        return _encode(self.kind, self.address, self.value)


class PkwAnswer(NamedTuple):
    """What became of a job. ``value`` is PWE; of REFUSED the error code."""

    kind: ReplyKind
    address: Address = NOWHERE
    value: int = 0

    @property
    def data(self) -> bytes | None:
        """The parameter's bytes, least significant first; None where there is none."""
        size = _REPLY_SIZES.get(self.kind)
        return None if size is None else self.value.to_bytes(4, "little")[:size]

    def encode(self) -> bytes:
        """Eight bytes. Raises ValueError where a field is out of range."""
        return _encode(self.kind, self.address, self.value)


IDLE: Final = PkwRequest(AskKind.NOTHING)
"""Between two jobs."""


def read(address: Address, value: int = 0) -> PkwRequest:
    """Asks for a parameter; ``value`` says more where the parameter needs it."""
    return PkwRequest(AskKind.READ, address, value)


def write(address: Address, data: bytes) -> PkwRequest:
    """Writes the bytes of a parameter, least significant first. Raises ValueError where they are not 1, 2 or 4.

    OPEN: a negative byte or word is not extended to the bytes before it.
    """
    if len(data) not in _WRITES:
        raise ValueError(f"no job writes {len(data)} bytes")
    return PkwRequest(_WRITES[len(data)], address, int.from_bytes(data, "little"))


def decode_request(data: bytes, base: int = 0) -> PkwRequest:
    """Read a job; offsets of errors begin at ``base``. Raises FormatError."""
    number, address, value = _decode(data, base)
    try:
        kind = AskKind(number)
    except ValueError:
        raise FormatError(Fault.FIELD, base, f"AK {number} is no request") from None
    size = _WRITTEN.get(kind, 4)
    return PkwRequest(kind, address, value & (1 << 8 * size) - 1)


def decode_answer(data: bytes, base: int = 0) -> PkwAnswer:
    """Read what became of a job; offsets of errors begin at ``base``. Raises FormatError."""
    number, address, value = _decode(data, base)
    try:
        kind = ReplyKind(number)
    except ValueError:
        raise FormatError(Fault.FIELD, base, f"AK {number} is no answer") from None
    size = 2 if kind is ReplyKind.REFUSED else _REPLY_SIZES.get(kind, 4)
    return PkwAnswer(kind, address, value & (1 << 8 * size) - 1)


def answers(request: PkwRequest, answer: PkwAnswer) -> bool:
    """True where ``answer`` can be that of ``request``: by parameter, and by what is asked for."""
    if request.kind is AskKind.NOTHING or answer.kind is ReplyKind.NOTHING:
        return request.kind is AskKind.NOTHING and answer.kind is ReplyKind.NOTHING
    if request.address != answer.address:
        return False
    if answer.kind is ReplyKind.REFUSED:
        return True
    return request.kind is AskKind.READ or answer.kind is _REPLY_OF[request.kind]


def _encode(kind: int, address: Address, value: int) -> bytes:
    ind, pnu = checked(address.major, 0, 255, "IND"), checked(address.minor, 0, 255, "PNU")
    return bytes((kind << 4, pnu, ind, 0)) + checked(value, 0, _MAX_VALUE, "PWE").to_bytes(4, "big")


def _decode(data: bytes, base: int) -> tuple[int, Address, int]:
    if len(data) != SIZE:
        raise FormatError(Fault.LENGTH, base + min(len(data), SIZE), f"PKW has {SIZE} bytes, not {len(data)}")
    if data[0] & 0x0F:
        raise FormatError(Fault.FIELD, base, f"PKE {data[:2].hex().upper()}h has reserved bits set")
    if data[3]:
        raise FormatError(Fault.FIELD, base + 3, f"the reserved byte is {data[3]:02X}h")
    return data[0] >> 4, Address(data[2], data[1], Addressing.PKW), int.from_bytes(data[4:], "big")
