"""Examples of the PD4-E manual, with the bytes that its extract dropped put back (the MBAP length proves them)."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.model.address import Address
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import AbortAnswer, Answer, ObjectRead, ObjectWritten
from app.wire.modbus.requests import ReadObject, Request, WriteObject, WriteRegister


class Vector(NamedTuple):
    """``text`` are the bytes of the ADU; it bears ``transaction`` and ``pdu``."""

    name: str
    text: str
    transaction: int
    pdu: Request | Answer
    is_request: bool

    @property
    def data(self) -> bytes:
        return bytes.fromhex(self.text)

    @property
    def message(self) -> Message:
        return Message(self.transaction, 0, self.pdu.pdu())


VECTORS: Final = (
    Vector("p97_write_register", "00 00 00 00 00 06 00 06 17 70 00 01", 0, WriteRegister(6000, 1), True),
    Vector(
        "p102_answer_6042",
        "00 00 00 00 00 0F 00 2B 0D 00 00 01 60 42 00 00 00 00 02 00 00",
        0,
        ObjectRead(Address(0x6042), b"\0\0"),
        False,
    ),
    Vector(
        "p103_answer_6040",
        "00 02 00 00 00 0D 00 2B 0D 01 00 01 60 40 00 00 00 00 00",
        2,
        ObjectWritten(Address(0x6040)),
        False,
    ),
    Vector(
        "p103_write_6040",
        "00 03 00 00 00 0F 00 2B 0D 01 00 01 60 40 00 00 00 00 02 80 00",
        3,
        WriteObject(Address(0x6040), (0x80).to_bytes(2, "little")),
        True,
    ),
    Vector(
        "p104_answer_6040",
        "00 06 00 00 00 0D 00 2B 0D 01 00 01 60 40 00 00 00 00 00",
        6,
        ObjectWritten(Address(0x6040)),
        False,
    ),
    Vector(
        "p104_read_6041",
        "00 00 00 00 00 0D 00 2B 0D 00 00 01 60 41 00 00 00 00 02",
        0,
        ReadObject(Address(0x6041), 2),
        True,
    ),
    Vector(
        "p110_read_6060",
        "00 00 00 00 00 0D 00 2B 0D 00 00 01 60 60 00 00 00 00 02",
        0,
        ReadObject(Address(0x6060), 2),
        True,
    ),
    Vector("p110_abort", "00 00 00 00 00 0B 00 AB FF 00 06 0D CE 12 00 07 06", 0, AbortAnswer(0x06070012), False),
)
DICTIONARY_HEAD: Final = bytes.fromhex("65 AA CD 21 00 0A 02 07 00 21 00 0B 02 07 00 21 00 0C 02")
"""Page 108: the answer of FC 101 as far as it is printed; CDh = 205 bytes of frames follow the length."""
