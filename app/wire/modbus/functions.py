"""Function codes, exception codes and limits (Modbus application protocol V1.1b3, and the PD4-E manual, 8.3 to 8.4)."""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Final


class Function(IntEnum):
    """The function codes that the PD4-E documents."""

    READ_HOLDING_REGISTERS = 3
    READ_INPUT_REGISTERS = 4
    WRITE_SINGLE_REGISTER = 6
    WRITE_MULTIPLE_REGISTERS = 16
    READ_WRITE_REGISTERS = 23
    OBJECT = 43
    """With MEI type 0Dh: CANopen general reference, one object."""
    READ_DICTIONARY = 101
    READ_ARRAY = 102
    WRITE_ARRAY = 103


OBJECT_FUNCTIONS: Final = frozenset(
    {Function.OBJECT, Function.READ_DICTIONARY, Function.READ_ARRAY, Function.WRITE_ARRAY}
)
"""What reaches the object dictionary; a refusal of any of them carries a 32-bit abort code, under FC 43 (ABh)."""
MEI_CANOPEN: Final = 0x0D
ERROR_FLAG: Final = 0x80
"""Added to the function code of a refused request."""
EXTENDED: Final = 0xFF
"""The exception byte before an abort code."""
ABORT_MARK: Final = 0xCE
ABORT_LENGTH: Final = 6
"""MEI type, mark and abort code."""

MAX_READ: Final = 125
"""Registers that FC 3, 4 and 23 read at most."""
MAX_WRITE: Final = 123
MAX_READ_WRITE: Final = 121
"""Registers that FC 23 writes at most."""
MAX_FRAME_BYTES: Final = 252
"""Bytes of object frames in one message; more than Modbus itself allows a PDU to hold."""


class ModbusException(IntEnum):
    """Exception codes 1 to 4 (V1.1b3, chapter 7); the PD4-E has no others."""

    ILLEGAL_FUNCTION = 1
    ILLEGAL_ADDRESS = 2
    ILLEGAL_VALUE = 3
    DEVICE_FAILURE = 4


def exception_text_key(code: int) -> str:
    """Text key of an exception code; unknown codes share one."""
    try:
        return f"modbus.exception.{ModbusException(code).name.lower()}"
    except ValueError:
        return "modbus.exception.unknown"


class Phase(Enum):
    """Sub-function codes of FC 101 to 103. The extract prints AAh only; 55h is that of sibling manuals."""

    START = 0x55
    CONTINUE = 0xAA
