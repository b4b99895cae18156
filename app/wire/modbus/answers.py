"""Answers of a Modbus server: what each one is, its bytes, reading it back, and whether it answers a request."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from app.model.address import Address
from app.wire.modbus.adu import HEADER_SIZE
from app.wire.modbus.fields import Fields, FormatError, bytes_of, checked, words_of
from app.wire.modbus.frames import ObjectFrame, decode_frames, encode_frames
from app.wire.modbus.functions import (
    ABORT_LENGTH,
    ABORT_MARK,
    ERROR_FLAG,
    EXTENDED,
    MAX_READ,
    MAX_WRITE,
    MEI_CANOPEN,
    OBJECT_FUNCTIONS,
    Function,
    Phase,
)
from app.wire.modbus.requests import (
    CANOPEN_NODE,
    ReadArray,
    ReadDictionary,
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    Request,
    WriteArray,
    WriteObject,
    WriteRegister,
    WriteRegisters,
    object_head,
    object_pdu,
    read_data,
    read_object_head,
    read_phase,
)
from app.wire.records import Fault


class RegistersRead(NamedTuple):
    """FC 3, 4 and 23: the registers, in their order."""

    registers: tuple[int, ...]
    function: Function = Function.READ_HOLDING_REGISTERS

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where there are too many registers, or none."""
        count = checked(len(self.registers), 1, MAX_READ, "number of registers")
        return bytes((self.function, 2 * count)) + bytes_of(self.registers)


class RegistersWritten(NamedTuple):
    """FC 16: ``quantity`` registers were written from ``start`` on."""

    start: int
    quantity: int

    @property
    def function(self) -> Function:
        """FC 16."""
        return Function.WRITE_MULTIPLE_REGISTERS

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where a field is out of range."""
        count = checked(self.quantity, 1, MAX_WRITE, "number of registers")
        return bytes((self.function,)) + bytes_of((self.start, count))


class ObjectRead(NamedTuple):
    """FC 43: the bytes of an object, least significant first."""

    address: Address
    data: bytes
    start: int = 0
    node: int = CANOPEN_NODE

    @property
    def function(self) -> Function:
        """FC 43."""
        return Function.OBJECT

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where the data are too long."""
        return object_pdu(self.node, self.address, self.start, self.data, write=False)


class ObjectWritten(NamedTuple):
    """FC 43: the object was written."""

    address: Address
    start: int = 0
    node: int = CANOPEN_NODE

    @property
    def function(self) -> Function:
        """FC 43."""
        return Function.OBJECT

    def pdu(self) -> bytes:
        """Bytes of the PDU."""
        return object_head(self.node, self.address, self.start, 0, write=True)


class FramesRead(NamedTuple):
    """FC 101 and 102: as many object frames as fitted."""

    phase: Phase
    frames: tuple[ObjectFrame, ...]
    function: Function = Function.READ_DICTIONARY

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where the frames do not fit."""
        return bytes((self.function, self.phase.value)) + encode_frames(self.frames)


class ArrayWritten(NamedTuple):
    """FC 103: all frames of the request were written. Not in the extract: by analogy with FC 102."""

    phase: Phase

    @property
    def function(self) -> Function:
        """FC 103."""
        return Function.WRITE_ARRAY

    def pdu(self) -> bytes:
        """Bytes of the PDU."""
        return bytes((self.function, self.phase.value, 0))


class ExceptionAnswer(NamedTuple):
    """A refusal with an exception code, see ``functions.ModbusException``; ``function`` may be any."""

    function: int
    exception: int

    def pdu(self) -> bytes:
        """Bytes of the PDU. Raises ValueError where a field is out of range."""
        function = checked(self.function, 0, 0x7F, "function code")
        return bytes((function | ERROR_FLAG, checked(self.exception, 1, EXTENDED - 1, "exception code")))


class AbortAnswer(NamedTuple):
    """A refusal with a CANopen abort code (page 110). Under ABh it answers FC 43 and FC 101 to 103 alike."""

    abort_code: int
    function: Function = Function.OBJECT

    def pdu(self) -> bytes:
        """Bytes of the PDU: the code is low byte first."""
        head = bytes((self.function | ERROR_FLAG, EXTENDED)) + ABORT_LENGTH.to_bytes(2, "big")
        return head + bytes((MEI_CANOPEN, ABORT_MARK)) + self.abort_code.to_bytes(4, "little")


Answer = (
    RegistersRead
    | WriteRegister
    | RegistersWritten
    | ObjectRead
    | ObjectWritten
    | FramesRead
    | ArrayWritten
    | ExceptionAnswer
    | AbortAnswer
)


def decode_answer(pdu: bytes, base: int = HEADER_SIZE) -> Answer:
    """Read the PDU of an answer. Offsets of errors count from the ADU's begin. Raises FormatError."""
    fields = Fields(pdu, base)
    code = fields.byte()
    if code & ERROR_FLAG:
        answer = _refusal(fields, code & ~ERROR_FLAG)
    else:
        reader = _READERS.get(code)
        if reader is None:
            raise FormatError(Fault.FUNCTION, base, f"function code {code} is not known")
        answer = reader(fields)
    fields.end()
    return answer


def answers(request: Request, answer: Answer) -> bool:
    """True where ``answer`` can only be one to ``request``: the same function, object, span and count."""
    if isinstance(answer, ExceptionAnswer):
        return answer.function == request.function
    if isinstance(answer, AbortAnswer):
        own = answer.function == request.function
        return own or (answer.function == Function.OBJECT and request.function in OBJECT_FUNCTIONS)
    if answer.function != request.function:
        return False
    match request, answer:
        case ((ReadRegisters() | ReadWriteRegisters()), RegistersRead()):
            return len(answer.registers) == request.quantity
        case WriteRegister(), WriteRegister():
            return request == answer
        case WriteRegisters(), RegistersWritten():
            return (request.start, len(request.registers)) == (answer.start, answer.quantity)
        case ReadObject(), ObjectRead():
            return _same_object(request, answer) and len(answer.data) <= request.size
        case WriteObject(), ObjectWritten():
            return _same_object(request, answer)
        case ReadDictionary(), FramesRead():
            return _same_phase(request.phase, answer.phase)
        case ReadArray(), FramesRead():
            indices = {frame.address.major for frame in answer.frames}
            return _same_phase(request.phase, answer.phase) and indices <= {request.object_index}
        case WriteArray(), ArrayWritten():
            return _same_phase(request.phase, answer.phase)
    return False


def _same_object(request: ReadObject | WriteObject, answer: ObjectRead | ObjectWritten) -> bool:
    return (request.node, request.address, request.start) == (answer.node, answer.address, answer.start)


def _same_phase(asked: Phase, answered: Phase) -> bool:
    """The one printed answer bears AAh, and what was asked for is not printed: so AAh may answer 55h as well."""
    return answered is asked or answered is Phase.CONTINUE


def _refusal(fields: Fields, function: int) -> Answer:
    at, code = fields.offset, fields.byte()
    if code != EXTENDED or function not in OBJECT_FUNCTIONS:
        if not 1 <= code < EXTENDED:
            raise FormatError(Fault.FIELD, at, f"exception code {code:02X}h is none")
        return ExceptionAnswer(function, code)
    at, length = fields.offset, fields.word()
    if length != ABORT_LENGTH:
        raise FormatError(Fault.COUNT, at, f"the error block has {length} bytes, not {ABORT_LENGTH}")
    fields.expect(MEI_CANOPEN, "the MEI type")
    fields.expect(ABORT_MARK, "the mark of an abort code")
    return AbortAnswer(int.from_bytes(fields.take(4), "little"), Function(function))


def _registers(function: Function) -> Callable[[Fields], Answer]:
    def reader(fields: Fields) -> Answer:
        at, size = fields.offset, fields.byte()
        if size % 2 or not 2 <= size <= 2 * MAX_READ:
            raise FormatError(Fault.COUNT, at, f"{size} bytes are no 1 to {MAX_READ} registers")
        return RegistersRead(words_of(fields.take(size)), function)

    return reader


def _object(fields: Fields) -> Answer:
    head = read_object_head(fields)
    data = read_data(fields, head)
    if not head.write:
        return ObjectRead(head.address, data, head.start, head.node)
    if data:
        raise FormatError(Fault.COUNT, head.size_at, "the answer to a write carries data")
    return ObjectWritten(head.address, head.start, head.node)


def _frames(function: Function) -> Callable[[Fields], Answer]:
    def reader(fields: Fields) -> Answer:
        return FramesRead(read_phase(fields), decode_frames(fields), function)

    return reader


def _array_written(fields: Fields) -> Answer:
    phase = read_phase(fields)
    fields.expect(0, "the number of data bytes", Fault.COUNT)
    return ArrayWritten(phase)


_READERS: Final[Mapping[int, Callable[[Fields], Answer]]] = {
    Function.READ_HOLDING_REGISTERS: _registers(Function.READ_HOLDING_REGISTERS),
    Function.READ_INPUT_REGISTERS: _registers(Function.READ_INPUT_REGISTERS),
    Function.WRITE_SINGLE_REGISTER: lambda fields: WriteRegister(fields.word(), fields.word()),
    Function.WRITE_MULTIPLE_REGISTERS: lambda fields: RegistersWritten(
        fields.word(), fields.count(1, MAX_WRITE, "the number of registers")
    ),
    Function.READ_WRITE_REGISTERS: _registers(Function.READ_WRITE_REGISTERS),
    Function.OBJECT: _object,
    Function.READ_DICTIONARY: _frames(Function.READ_DICTIONARY),
    Function.READ_ARRAY: _frames(Function.READ_ARRAY),
    Function.WRITE_ARRAY: _array_written,
}
