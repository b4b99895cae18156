"""What the device answers to each request: registers, single objects, the whole dictionary (manual, 8.4). Pure.

Every refusal of an object carries a CANopen abort code, every other one an exception code 1 to 4.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import IntEnum
from typing import Final

from app.model.address import Address
from app.model.description import Kind
from app.twins.object_store import Cell, ObjectStore, RefusedAccessError
from app.twins.pd4e.process_data import ProcessData, RefusedRequestError
from app.wire.modbus.answers import (
    AbortAnswer,
    Answer,
    ArrayWritten,
    ExceptionAnswer,
    FramesRead,
    ObjectRead,
    ObjectWritten,
    RegistersRead,
    RegistersWritten,
)
from app.wire.modbus.fields import FormatError
from app.wire.modbus.frames import MAX_OBJECT_BYTES, ObjectFrame, batches
from app.wire.modbus.functions import ERROR_FLAG, OBJECT_FUNCTIONS, Function, ModbusException, Phase
from app.wire.modbus.requests import (
    MAX_OBJECT_DATA,
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
    decode_request,
)
from app.wire.records import Fault
from app.wire.sdo import Abort


class Refusal(IntEnum):
    """Abort codes of the maker (manual, 8.4.5)."""

    COMMAND = 0xFFFF0003
    ACCESS = 0xFFFF0008
    PARAMETER = 0xFFFF000E
    SEQUENCE = 0xFFFF1004


_REFUSAL_BY_FAULT: Final = {Fault.OPTION: Refusal.COMMAND, Fault.FIELD: Refusal.COMMAND}


class Answering:
    """Answers the requests of one connection; remembers where FC 101 and 102 are."""

    def __init__(self, store: ObjectStore, process_data: ProcessData) -> None:
        self._store = store
        self._process_data = process_data
        self._dictionary: Iterator[tuple[ObjectFrame, ...]] | None = None
        self._array: Iterator[tuple[ObjectFrame, ...]] | None = None
        self._array_index = -1

    def answer(self, pdu: bytes) -> bytes:
        """The PDU of the answer to a request's PDU, whatever that is."""
        try:
            request = decode_request(pdu)
        except FormatError as error:
            return _not_understood(pdu[0], error.fault).pdu()
        try:
            return self._do(request).pdu()
        except RefusedAccessError as error:
            return AbortAnswer(error.code).pdu()
        except _RefusedError as error:
            return AbortAnswer(error.refusal).pdu()
        except RefusedRequestError as error:
            return ExceptionAnswer(request.function, error.exception).pdu()

    def _do(self, request: Request) -> Answer:
        match request:
            case ReadRegisters(start, quantity, function):
                return RegistersRead(self._process_data.read(start, quantity), function)
            case WriteRegister(start, value):
                self._process_data.write(start, (value,))
                return request
            case WriteRegisters(start, registers):
                self._process_data.write(start, registers)
                return RegistersWritten(start, len(registers))
            case ReadWriteRegisters(start, quantity, write_start, registers):
                self._process_data.write(write_start, registers)
                return RegistersRead(self._process_data.read(start, quantity), request.function)
            case ReadObject():
                return ObjectRead(request.address, self._read_object(request), request.start, request.node)
            case WriteObject():
                if request.start:
                    raise _RefusedError(Refusal.PARAMETER)
                self._store.write(request.address, request.data)
                return ObjectWritten(request.address, 0, request.node)
            case ReadDictionary(phase):
                return FramesRead(phase, self._next_of_dictionary(phase), request.function)
            case ReadArray(phase, index):
                return FramesRead(phase, self._next_of_array(phase, index), request.function)
            case WriteArray(phase, frames):
                self._write_array(frames)
                return ArrayWritten(phase)

    def _read_object(self, request: ReadObject) -> bytes:
        """Bytes of an object: as many as it has must be asked for; of a text, up to as many as are asked for."""
        data = self._store.read(request.address)
        if self._store.at(request.address).size is None:
            return data[request.start : request.start + min(request.size, MAX_OBJECT_DATA)]
        if request.start:
            raise _RefusedError(Refusal.PARAMETER)
        if request.size != len(data):
            raise RefusedAccessError(Abort.LENGTH_TOO_HIGH if request.size > len(data) else Abort.LENGTH_TOO_LOW)
        return data

    def _next_of_dictionary(self, phase: Phase) -> tuple[ObjectFrame, ...]:
        if phase is Phase.START:
            self._dictionary = _cut(self._frames(self._store))
        return _next(self._dictionary)

    def _next_of_array(self, phase: Phase, index: int) -> tuple[ObjectFrame, ...]:
        if phase is Phase.START:
            cells = self._array_cells(index)
            self._array, self._array_index = _cut(self._frames(cells)), index
        elif index != self._array_index:
            raise _RefusedError(Refusal.SEQUENCE)
        return _next(self._array)

    def _array_cells(self, index: int) -> list[Cell]:
        """Sub-indices of an array or record. OPEN what a drive does with a plain variable; refused here."""
        cells = [cell for cell in self._store if cell.entry.address.major == index]
        if not cells:
            raise RefusedAccessError(Abort.NO_OBJECT)
        if cells[0].entry.kind is Kind.VAR:
            raise _RefusedError(Refusal.ACCESS)
        return cells

    def _frames(self, cells: Iterable[Cell]) -> Iterator[ObjectFrame]:
        """Frames in the order of the dictionary, each value as it is when its turn comes.

        What cannot be read at the moment (an empty place of 1003h) is left out.
        """
        for cell in cells:
            if not cell.entry.access.readable:
                continue
            try:
                data = cell.to_bytes()
            except RefusedAccessError:
                continue
            if len(data) <= MAX_OBJECT_BYTES:
                yield ObjectFrame(cell.entry.address, data)

    def _write_array(self, frames: tuple[ObjectFrame, ...]) -> None:
        """Write frames one after another; what was written before a refusal stays. Sub-index 0 may tell what it is."""
        indices = {frame.address.major for frame in frames}
        if len(indices) != 1:
            raise _RefusedError(Refusal.PARAMETER)
        self._array_cells(indices.pop())
        for address, data in frames:
            if not (address.minor == 0 and self._says(address, data)):
                self._store.write(address, data)

    def _says(self, address: Address, data: bytes) -> bool:
        cell = self._store.at(address)
        return not cell.entry.access.writable and cell.to_bytes() == data


class _RefusedError(Exception):
    """A request that is refused with a code of the maker."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.name)
        self.refusal = refusal


def _cut(frames: Iterable[ObjectFrame]) -> Iterator[tuple[ObjectFrame, ...]]:
    return (tuple(batch) for batch in batches(frames))


def _next(pieces: Iterator[tuple[ObjectFrame, ...]] | None) -> tuple[ObjectFrame, ...]:
    """The next piece; after the last one "no data available". Raises RefusedAccessError, or where none was begun."""
    if pieces is None:
        raise _RefusedError(Refusal.SEQUENCE)
    piece = next(pieces, None)
    if piece is None:
        raise RefusedAccessError(Abort.NO_DATA)
    return piece


def _not_understood(code: int, fault: Fault) -> Answer:
    function = code & ~ERROR_FLAG
    if fault is Fault.FUNCTION:
        return ExceptionAnswer(function, ModbusException.ILLEGAL_FUNCTION)
    if code in OBJECT_FUNCTIONS:
        return AbortAnswer(_REFUSAL_BY_FAULT.get(fault, Refusal.PARAMETER), Function.OBJECT)
    return ExceptionAnswer(function, ModbusException.ILLEGAL_VALUE)
