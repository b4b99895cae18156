"""Requests of a Modbus client: what each one is, its bytes, and reading it back (PD4-E manual, 8.4)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from app.model.address import Address
from app.wire.modbus.adu import HEADER_SIZE
from app.wire.modbus.fields import MAX_WORD, Fields, FormatError, bytes_of, checked
from app.wire.modbus.frames import ObjectFrame, decode_frames, encode_frames
from app.wire.modbus.functions import MAX_READ, MAX_READ_WRITE, MAX_WRITE, MEI_CANOPEN, Function, Phase
from app.wire.records import Fault

CANOPEN_NODE: Final = 1
"""Node ID in FC 43, as in every example of the manual."""
OBJECT_HEAD: Final = 12
"""Bytes of an FC 43 PDU before its data."""
MAX_OBJECT_DATA: Final = 253 - OBJECT_HEAD
"""What is left of the 253 bytes of a standard PDU."""
_READ, _WRITE = 0, 1


class ReadRegisters(NamedTuple):
    """FC 3 or 4: ``quantity`` (1 to 125) registers from ``start``."""

    start: int
    quantity: int
    function: Function = Function.READ_HOLDING_REGISTERS

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where a field is out of range."""
        return bytes((self.function,)) + _span(self.start, self.quantity, MAX_READ)


class WriteRegister(NamedTuple):
    """FC 6: one register. The answer repeats it."""

    start: int
    value: int

    @property
    def function(self) -> Function:
        """FC 6."""
        return Function.WRITE_SINGLE_REGISTER

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where a field is out of range."""
        return bytes((self.function,)) + bytes_of((self.start, self.value))


class WriteRegisters(NamedTuple):
    """FC 16: 1 to 123 ``registers`` from ``start`` on."""

    start: int
    registers: tuple[int, ...]

    @property
    def function(self) -> Function:
        """FC 16."""
        return Function.WRITE_MULTIPLE_REGISTERS

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where a field is out of range."""
        return bytes((self.function,)) + _written(self.start, self.registers, MAX_WRITE)


class ReadWriteRegisters(NamedTuple):
    """FC 23: 1 to 121 ``registers`` are written from ``write_start`` on, then ``quantity`` (1 to 125) are read."""

    start: int
    quantity: int
    write_start: int
    registers: tuple[int, ...]

    @property
    def function(self) -> Function:
        """FC 23."""
        return Function.READ_WRITE_REGISTERS

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where a field is out of range."""
        head = bytes((self.function,)) + _span(self.start, self.quantity, MAX_READ)
        return head + _written(self.write_start, self.registers, MAX_READ_WRITE)


class ReadObject(NamedTuple):
    """FC 43, MEI 0Dh: read ``size`` BYTES of an object, from byte ``start`` on."""

    address: Address
    size: int
    start: int = 0
    node: int = CANOPEN_NODE

    @property
    def function(self) -> Function:
        """FC 43."""
        return Function.OBJECT

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where a field is out of range."""
        size = checked(self.size, 0, MAX_WORD, "size")
        return object_head(self.node, self.address, self.start, size, write=False)


class WriteObject(NamedTuple):
    """FC 43, MEI 0Dh: write an object; ``data`` least significant byte first."""

    address: Address
    data: bytes
    start: int = 0
    node: int = CANOPEN_NODE

    @property
    def function(self) -> Function:
        """FC 43."""
        return Function.OBJECT

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where a field is out of range or the data are too long."""
        return object_pdu(self.node, self.address, self.start, self.data, write=True)


class ReadDictionary(NamedTuple):
    """FC 101: all objects, so many at a time as fit."""

    phase: Phase

    @property
    def function(self) -> Function:
        """FC 101."""
        return Function.READ_DICTIONARY

    def pdu(self) -> bytes:
        """Bytes of the PDU."""
        return bytes((self.function, self.phase.value, 0))


class ReadArray(NamedTuple):
    """FC 102: all sub-indices of ``object_index``.

    The bytes of the request are lost in the extract: its index is taken to be low byte first as in the frames.
    """

    phase: Phase
    object_index: int

    @property
    def function(self) -> Function:
        """FC 102."""
        return Function.READ_ARRAY

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where the index is out of range."""
        index = checked(self.object_index, 0, MAX_WORD, "index").to_bytes(2, "little")
        return bytes((self.function, self.phase.value, 0)) + index


class WriteArray(NamedTuple):
    """FC 103: several sub-indices at once. Not in the extract at all: by analogy with FC 102."""

    phase: Phase
    frames: tuple[ObjectFrame, ...]

    @property
    def function(self) -> Function:
        """FC 103."""
        return Function.WRITE_ARRAY

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where the frames do not fit."""
        return bytes((self.function, self.phase.value)) + encode_frames(self.frames)


Request = (
    ReadRegisters
    | WriteRegister
    | WriteRegisters
    | ReadWriteRegisters
    | ReadObject
    | WriteObject
    | ReadDictionary
    | ReadArray
    | WriteArray
)


def decode_request(pdu: bytes, base: int = HEADER_SIZE) -> Request:
    """Read the PDU of a request. Offsets of errors count from the ADU's begin.

    Raises FormatError; with Fault.FUNCTION where the function (or its MEI type) is none of a PD4-E, with Fault.OPTION
    where the protocol control of FC 43 asks for something that it has not.
    """
    fields = Fields(pdu, base)
    code = fields.byte()
    reader = _READERS.get(code)
    if reader is None:
        raise FormatError(Fault.FUNCTION, base, f"function code {code} is not known")
    request = reader(fields)
    fields.end()
    return request


def object_pdu(node: int, address: Address, start: int, data: bytes, *, write: bool) -> bytes:
    """A request or answer of FC 43 with data. Raises ValueError where a field is out of range or they are too long."""
    count = checked(len(data), 0, MAX_OBJECT_DATA, "number of bytes")
    return object_head(node, address, start, count, write=write) + data


def object_head(node: int, address: Address, start: int, count: int, *, write: bool) -> bytes:
    """Requests and answers of FC 43 up to their data."""
    control = _WRITE if write else _READ
    head = bytes((Function.OBJECT, MEI_CANOPEN, control, 0, checked(node, 0, 0xFF, "node")))
    tail = bytes_of((checked(start, 0, MAX_WORD, "start"), count))
    return head + address.major.to_bytes(2, "big") + bytes((address.minor,)) + tail


class ObjectHead(NamedTuple):
    """What ``object_head`` wrote."""

    write: bool
    node: int
    address: Address
    start: int
    size: int
    size_at: int


def read_object_head(fields: Fields) -> ObjectHead:
    """Read what follows the function code of FC 43 up to its data. Raises FormatError."""
    fields.expect(MEI_CANOPEN, "the MEI type", Fault.FUNCTION)
    at, control = fields.offset, fields.byte()
    if control not in (_READ, _WRITE):
        raise FormatError(Fault.OPTION, at, f"protocol control {control:02X}h asks for an option that there is not")
    fields.expect(0, "the reserved byte")
    node, index, sub, start = fields.byte(), fields.word(), fields.byte(), fields.word()
    size_at, size = fields.offset, fields.word()
    return ObjectHead(control == _WRITE, node, Address(index, sub), start, size, size_at)


def read_data(fields: Fields, head: ObjectHead) -> bytes:
    """The data of FC 43, as many as are announced. Raises FormatError."""
    if head.size != fields.left:
        reason = f"{head.size} bytes are announced, {fields.left} follow"
        raise FormatError(Fault.COUNT, head.size_at, reason)
    return fields.take(head.size)


def read_phase(fields: Fields) -> Phase:
    """The sub-function code of FC 101 to 103. Raises FormatError."""
    at, code = fields.offset, fields.byte()
    try:
        return Phase(code)
    except ValueError:
        raise FormatError(Fault.FIELD, at, f"sub-function code {code:02X}h is neither 55h nor AAh") from None


def _span(start: int, count: int, most: int) -> bytes:
    return bytes_of((start, checked(count, 1, most, "number of registers")))


def _written(start: int, registers: tuple[int, ...], most: int) -> bytes:
    return _span(start, len(registers), most) + bytes((2 * len(registers),)) + bytes_of(registers)


def _read_registers(function: Function) -> Callable[[Fields], Request]:
    def reader(fields: Fields) -> Request:
        return ReadRegisters(fields.word(), fields.count(1, MAX_READ, "the number of registers"), function)

    return reader


def _write_registers(fields: Fields) -> Request:
    start, count = fields.word(), fields.count(1, MAX_WRITE, "the number of registers")
    return WriteRegisters(start, fields.registers(count))


def _read_write_registers(fields: Fields) -> Request:
    start, count = fields.word(), fields.count(1, MAX_READ, "the number of registers to read")
    write_start, written = fields.word(), fields.count(1, MAX_READ_WRITE, "the number of registers to write")
    return ReadWriteRegisters(start, count, write_start, fields.registers(written))


def _object(fields: Fields) -> Request:
    head = read_object_head(fields)
    if head.write:
        return WriteObject(head.address, read_data(fields, head), head.start, head.node)
    return ReadObject(head.address, head.size, head.start, head.node)


def _read_dictionary(fields: Fields) -> Request:
    phase = read_phase(fields)
    fields.expect(0, "the number of data bytes", Fault.COUNT)
    return ReadDictionary(phase)


def _read_array(fields: Fields) -> Request:
    phase = read_phase(fields)
    fields.expect(0, "the number of data bytes", Fault.COUNT)
    return ReadArray(phase, fields.word_low_first())


_READERS: Final[Mapping[int, Callable[[Fields], Request]]] = {
    Function.READ_HOLDING_REGISTERS: _read_registers(Function.READ_HOLDING_REGISTERS),
    Function.READ_INPUT_REGISTERS: _read_registers(Function.READ_INPUT_REGISTERS),
    Function.WRITE_SINGLE_REGISTER: lambda fields: WriteRegister(fields.word(), fields.word()),
    Function.WRITE_MULTIPLE_REGISTERS: _write_registers,
    Function.READ_WRITE_REGISTERS: _read_write_registers,
    Function.OBJECT: _object,
    Function.READ_DICTIONARY: _read_dictionary,
    Function.READ_ARRAY: _read_array,
    Function.WRITE_ARRAY: lambda fields: WriteArray(read_phase(fields), decode_frames(fields)),
}
