"""What each ADU means, a row each, made of the decoder's own records."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from app.wire.frame import Adu, Frame
from app.wire.modbus.adu import decode_adu
from app.wire.modbus.answers import (
    AbortAnswer,
    Answer,
    ExceptionAnswer,
    ObjectRead,
    ObjectWritten,
    RegistersWritten,
    decode_answer,
)
from app.wire.modbus.decoder import ModbusDecoder
from app.wire.modbus.fields import FormatError
from app.wire.modbus.functions import ERROR_FLAG, Function
from app.wire.modbus.requests import (
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    Request,
    WriteObject,
    WriteRegister,
    WriteRegisters,
    decode_request,
)
from app.wire.records import TransactionSeen
from app.wire.sdo import Abort
from app.wire.trace.service import Service, Speaker
from app.wire.trace.tracer import GAP_SPEAKER, Gap, Item, Step, TraceRow, Tracing

_FUNCTION_AT: Final = 7
_STEPS: Final[Mapping[int, Step]] = {
    Function.READ_HOLDING_REGISTERS: Step.REGISTERS_READ,
    Function.READ_INPUT_REGISTERS: Step.REGISTERS_READ,
    Function.WRITE_SINGLE_REGISTER: Step.REGISTERS_WRITE,
    Function.WRITE_MULTIPLE_REGISTERS: Step.REGISTERS_WRITE,
    Function.READ_WRITE_REGISTERS: Step.REGISTERS_BOTH,
    Function.READ_DICTIONARY: Step.DICTIONARY,
    Function.READ_ARRAY: Step.ARRAY_READ,
    Function.WRITE_ARRAY: Step.ARRAY_WRITE,
}


_LISTS: Final = (Function.READ_DICTIONARY, Function.READ_ARRAY)


class ModbusTracer(Tracing):
    """Of a bus of Modbus TCP. ``servers``: ``host:port`` of its nodes."""

    def __init__(self, bus: str, servers: Mapping[int, str], snapshot: Mapping[str, Any] | None = None) -> None:
        self._decoder = ModbusDecoder(bus, {server: node for node, server in servers.items()})
        super().__init__(self._decoder, snapshot)

    def speaker(self, item: Item) -> Speaker:
        """Whose item it is; ``number`` is the function code."""
        if isinstance(item, Gap):
            return GAP_SPEAKER
        path = self._decoder.path(item)
        if path is None or not isinstance(item.payload, Adu):
            return Speaker(Service.UNKNOWN)
        data = item.payload.data
        function = data[_FUNCTION_AT] & ~ERROR_FLAG if len(data) > _FUNCTION_AT else 0
        return Speaker(Service.MODBUS_REQUEST if path.is_request else Service.MODBUS_RESPONSE, path.node, function)

    def _taken(self, frame: Frame) -> TraceRow:
        speaker = self.speaker(frame)
        row = TraceRow(frame, speaker, None, None, None, None, tuple(self._decoder.feed(frame)))
        if not isinstance(frame.payload, Adu):
            return row
        try:
            pdu = decode_adu(frame.payload.data).pdu
            if speaker.service is Service.MODBUS_REQUEST:
                return _asked(row, decode_request(pdu))
            if speaker.service is Service.MODBUS_RESPONSE:
                return _answered(row, decode_answer(pdu))
        except FormatError:
            return row._replace(step=Step.UNKNOWN)  # the decoder's record says what is wrong
        return row


def _ended(row: TraceRow) -> Step | None:
    """What came to its end, where a list of objects did: its last message is a refusal."""
    for record in row.records:
        if isinstance(record, TransactionSeen) and record.function in _LISTS:
            return _STEPS[record.function]
    return None


def _asked(row: TraceRow, request: Request) -> TraceRow:
    match request:
        case ReadObject():
            return row._replace(step=Step.READ, address=request.address)
        case WriteObject():
            return row._replace(step=Step.WRITE, address=request.address, value=request.data)
    row = row._replace(step=_STEPS[request.function])
    match request:
        case ReadRegisters():
            return row._replace(read=(request.start, request.quantity))
        case WriteRegister():
            return row._replace(written=(request.start, 1))
        case WriteRegisters():
            return row._replace(written=(request.start, len(request.registers)))
        case ReadWriteRegisters():
            written = request.write_start, len(request.registers)
            return row._replace(read=(request.start, request.quantity), written=written)
    return row


def _answered(row: TraceRow, answer: Answer) -> TraceRow:
    match answer:
        case ExceptionAnswer():
            return row._replace(step=Step.EXCEPTION, exception=answer.exception)
        case AbortAnswer(abort_code=Abort.NO_DATA) if (step := _ended(row)) is not None:
            return row._replace(step=step, abort_code=Abort.NO_DATA)
        case AbortAnswer():
            ended = row.done
            address = None if ended is None else ended.address
            return row._replace(step=Step.ABORT, abort_code=answer.abort_code, address=address)
        case ObjectRead():
            return row._replace(step=Step.READ_ANSWER, address=answer.address, value=answer.data)
        case ObjectWritten():
            ended = row.done
            value = None if ended is None else ended.data
            return row._replace(step=Step.WRITE_ANSWER, address=answer.address, value=value)
        case RegistersWritten():
            return row._replace(step=Step.REGISTERS_WRITE, written=(answer.start, answer.quantity))
    return row._replace(step=_STEPS[answer.function])
