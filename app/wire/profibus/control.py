"""The function code of an FDL telegram (FC): request or answer, what is asked for, and the frame count bit.

A master alternates FCB from request to request of one station while FCV is set; a request with the FCB of the one
before is that one once more, and the station repeats its answer. FCB 1 without FCV begins to count.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

from app.wire.profibus.fields import FormatError
from app.wire.records import Fault

_RESERVED: Final = 0x80
_REQUEST: Final = 0x40
_FCB: Final = 0x20
_FCV: Final = 0x10
_FUNCTION: Final = 0x0F


class Ask(IntEnum):
    """Functions of a request."""

    TIME_EVENT = 0
    SDA_LOW = 3
    SDN_LOW = 4
    SDA_HIGH = 5
    SDN_HIGH = 6
    MULTICAST = 7
    FDL_STATUS = 9
    SRD_LOW = 12
    SRD_HIGH = 13
    IDENT = 14
    LSAS_STATUS = 15

    @property
    def answered(self) -> bool:
        """True where the station answers."""
        return self not in (Ask.TIME_EVENT, Ask.SDN_LOW, Ask.SDN_HIGH)


class Reply(IntEnum):
    """Functions of an answer."""

    OK = 0
    USER_ERROR = 1
    NO_RESOURCE = 2
    NO_SERVICE = 3
    """RS: the access point is not active; a slave gives it to Data_Exchange before it is parametrised."""
    DATA_LOW = 8
    NO_DATA = 9
    DATA_HIGH = 10
    """From a DP slave: these are its inputs, and it has a diagnosis to tell."""
    DATA_LOW_NO_RESOURCE = 12
    DATA_HIGH_NO_RESOURCE = 13

    @property
    def text_key(self) -> str:
        """Text key of the explanation."""
        return f"profibus.reply.{self.name.lower()}"


class Station(IntEnum):
    """What kind of station answers."""

    SLAVE = 0
    MASTER_NOT_READY = 1
    MASTER_READY = 2
    MASTER_IN_RING = 3


class Request(NamedTuple):
    """FC of a request."""

    ask: Ask
    fcb: bool = False
    fcv: bool = False

    def encode(self) -> int:
        """The byte."""
        return _REQUEST | _FCB * self.fcb | _FCV * self.fcv | self.ask


class Answer(NamedTuple):
    """FC of an answer."""

    reply: Reply
    station: Station = Station.SLAVE

    def encode(self) -> int:
        """The byte."""
        return self.station << 4 | self.reply


Control = Request | Answer


def decode_control(byte: int, offset: int) -> Control:
    """Read the byte at ``offset``. Raises FormatError."""
    if byte & _RESERVED:
        raise FormatError(Fault.FIELD, offset, f"function code {byte:02X}h has its reserved bit set")
    function = byte & _FUNCTION
    try:
        if byte & _REQUEST:
            return Request(Ask(function), bool(byte & _FCB), bool(byte & _FCV))
        return Answer(Reply(function), Station(byte >> 4))
    except ValueError:
        raise FormatError(Fault.FIELD, offset, f"function code {byte:02X}h is unknown") from None
