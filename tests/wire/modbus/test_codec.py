"""Requests and answers against the manual's examples, against bytes worked out by hand, and against anything at all."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address
from app.wire.modbus.adu import HEADER_SIZE, Message, decode_adu
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
    answers,
    decode_answer,
)
from app.wire.modbus.fields import FormatError
from app.wire.modbus.frames import MAX_OBJECT_BYTES, ObjectFrame, batches
from app.wire.modbus.functions import MAX_FRAME_BYTES, Function, ModbusException, Phase, exception_text_key
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
from tests.wire.modbus.strategies import ANSWERS, REQUESTS
from tests.wire.modbus.vectors import DICTIONARY_HEAD, VECTORS, Vector

STATUSWORD = Address(0x6041)


@pytest.mark.parametrize("vector", VECTORS, ids=lambda vector: vector.name)
def test_the_examples_of_the_manual(vector: Vector) -> None:
    assert vector.message.encode() == vector.data
    message = decode_adu(vector.data)
    assert message == (vector.transaction, 0, vector.pdu.pdu())
    decode = decode_request if vector.is_request else decode_answer
    assert decode(message.pdu) == vector.pdu


def test_the_printed_answer_of_fc_101_is_low_byte_first() -> None:
    """Page 108 prints the begin only: the frames are filled up to the 205 bytes that it announces."""
    body = DICTIONARY_HEAD[3:] + b"\x07\x00" + bytes.fromhex("21 00 0D 02 07 00") * 31 + bytes(1)
    pdu = DICTIONARY_HEAD[:3] + body
    assert len(body) == 205
    with pytest.raises(FormatError):  # 205 is no multiple of 6: the last frame must have been another one
        decode_answer(pdu)
    body = DICTIONARY_HEAD[3:] + b"\x07\x00" + bytes.fromhex("21 00 0D 02 07 00") * 30 + bytes.fromhex("0021010306AABB")
    answer = decode_answer(DICTIONARY_HEAD[:3] + body)
    assert isinstance(answer, FramesRead)
    assert answer.phase is Phase.CONTINUE
    assert answer.frames[:3] == tuple(ObjectFrame(Address(0x0021, sub), b"\x07\x00") for sub in (0x0A, 0x0B, 0x0C))
    assert answer.frames[-1] == ObjectFrame(Address(0x2100, 1), bytes.fromhex("06AABB"))


@pytest.mark.parametrize(
    ("pdu", "text"),
    [
        (ReadRegisters(5000, 7), "03 1388 0007"),
        (ReadRegisters(5000, 125, Function.READ_INPUT_REGISTERS), "04 1388 007D"),
        (WriteRegisters(6000, (0x0006, 0x0002)), "10 1770 0002 04 0006 0002"),
        (ReadWriteRegisters(5000, 7, 6000, (0x000F,)), "17 1388 0007 1770 0001 02 000F"),
        (ReadDictionary(Phase.START), "65 55 00"),
        (ReadDictionary(Phase.CONTINUE), "65 AA 00"),
        (ReadArray(Phase.START, 0x2400), "66 55 00 00 24"),
        (WriteArray(Phase.START, (ObjectFrame(Address(0x2400, 1), b"\x01\x02"),)), "67 55 06 00 24 01 02 01 02"),
    ],
)
def test_bytes_of_requests(pdu: Request, text: str) -> None:
    assert pdu.pdu() == bytes.fromhex(text)
    assert decode_request(pdu.pdu()) == pdu


@pytest.mark.parametrize(
    ("pdu", "text"),
    [
        (RegistersRead((0x0640, 0)), "03 04 0640 0000"),
        (RegistersWritten(6000, 2), "10 1770 0002"),
        (RegistersRead((0x0640,), Function.READ_WRITE_REGISTERS), "17 02 0640"),
        (FramesRead(Phase.START, (), Function.READ_ARRAY), "66 55 00"),
        (ArrayWritten(Phase.START), "67 55 00"),
        (ExceptionAnswer(3, ModbusException.ILLEGAL_ADDRESS), "83 02"),
        (ExceptionAnswer(43, ModbusException.ILLEGAL_FUNCTION), "AB 01"),
        (AbortAnswer(0x08000024), "AB FF 0006 0D CE 24 00 00 08"),
        (AbortAnswer(0x08000024, Function.READ_DICTIONARY), "E5 FF 0006 0D CE 24 00 00 08"),
    ],
)
def test_bytes_of_answers(pdu: Answer, text: str) -> None:
    assert pdu.pdu() == bytes.fromhex(text)
    assert decode_answer(pdu.pdu()) == pdu


@given(REQUESTS)
def test_requests_come_back(request_: Request) -> None:
    assert decode_request(request_.pdu()) == request_


@given(ANSWERS)
def test_answers_come_back(answer: Answer) -> None:
    assert decode_answer(answer.pdu()) == answer


@given(st.binary(min_size=1, max_size=300))
def test_any_bytes_give_a_message_or_a_declared_error(pdu: bytes) -> None:
    _only_declared(pdu)


@given(st.one_of(REQUESTS, ANSWERS), st.data())
def test_changed_bytes_give_a_message_or_a_declared_error(message: Request | Answer, data: st.DataObject) -> None:
    pdu = bytearray(message.pdu())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(pdu) - 1))
        pdu[at] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(1, len(pdu)))
    _only_declared(bytes(pdu[:cut]) + data.draw(st.binary(max_size=3)))


def _only_declared(pdu: bytes) -> None:
    """What is read is exactly what the bytes say; an error lies within the ADU."""
    for decode in (decode_request, decode_answer):
        try:
            assert decode(pdu).pdu() == pdu
        except FormatError as error:
            assert HEADER_SIZE <= error.offset <= HEADER_SIZE + len(pdu)


@pytest.mark.parametrize(
    ("text", "fault", "offset"),
    [
        ("", Fault.LENGTH, 7),
        ("2A", Fault.FUNCTION, 7),
        ("03 1388", Fault.LENGTH, 10),
        ("03 1388 0000", Fault.COUNT, 10),
        ("03 1388 007E", Fault.COUNT, 10),
        ("03 1388 0001 00", Fault.LENGTH, 12),
        ("10 1770 0002 03 0006 0002", Fault.COUNT, 12),
        ("17 1388 0001 1770 007A 02 0001", Fault.COUNT, 14),
        ("2B 0E 01 00", Fault.FUNCTION, 8),
        ("2B 0D 02 00 01 6041 00 0000 0002", Fault.OPTION, 9),
        ("2B 0D 80 00 01 6041 00 0000 0002", Fault.OPTION, 9),
        ("2B 0D 00 01 01 6041 00 0000 0002", Fault.FIELD, 10),
        ("2B 0D 01 00 01 6040 00 0000 0002 06", Fault.COUNT, 17),
        ("65 54 00", Fault.FIELD, 8),
        ("65 55 01", Fault.COUNT, 9),
        ("67 55 05 00 24 01 02 01", Fault.LENGTH, 15),
        ("67 55 09 00 24 01 02 01 02", Fault.LENGTH, 16),
    ],
)
def test_what_is_wrong_with_a_request_and_where(text: str, fault: Fault, offset: int) -> None:
    with pytest.raises(FormatError) as caught:
        decode_request(bytes.fromhex(text))
    assert (caught.value.fault, caught.value.offset) == (fault, offset)
    assert str(caught.value).startswith(f"byte {offset}: ")


@pytest.mark.parametrize(
    ("text", "fault", "offset"),
    [
        ("03 03 0640 00", Fault.COUNT, 8),
        ("03 00", Fault.COUNT, 8),
        ("03 04 0640", Fault.LENGTH, 11),
        ("83", Fault.LENGTH, 8),
        ("83 00", Fault.FIELD, 8),
        ("83 FF", Fault.FIELD, 8),
        ("AB FF 0005 0D CE 12 00 07 06", Fault.COUNT, 9),
        ("AB FF 0006 0E CE 12 00 07 06", Fault.FIELD, 11),
        ("AB FF 0006 0D CF 12 00 07 06", Fault.FIELD, 12),
        ("AB FF 0006 0D CE 12 00 07", Fault.LENGTH, 16),
        ("AB FF 0006 0D CE 12 00 07 06 00", Fault.LENGTH, 17),
        ("2B 0D 01 00 01 6040 00 0000 0001 00", Fault.COUNT, 17),
    ],
)
def test_what_is_wrong_with_an_answer_and_where(text: str, fault: Fault, offset: int) -> None:
    with pytest.raises(FormatError) as caught:
        decode_answer(bytes.fromhex(text))
    assert (caught.value.fault, caught.value.offset) == (fault, offset)


@pytest.mark.parametrize(
    "message",
    [
        ReadRegisters(0, 126),
        ReadRegisters(-1, 1),
        WriteRegister(0, 0x10000),
        WriteRegisters(0, ()),
        WriteRegisters(0, (0,) * 124),
        ReadWriteRegisters(0, 1, 0, (0,) * 122),
        WriteObject(STATUSWORD, bytes(MAX_OBJECT_DATA + 1)),
        WriteArray(Phase.START, (ObjectFrame(STATUSWORD, bytes(MAX_OBJECT_BYTES + 1)),)),
        WriteArray(Phase.START, (ObjectFrame(STATUSWORD, bytes(MAX_OBJECT_BYTES)), ObjectFrame(STATUSWORD, b""))),
        RegistersRead(()),
        ExceptionAnswer(3, 0xFF),
    ],
)
def test_nothing_is_built_that_nobody_could_read(message: Request | Answer) -> None:
    with pytest.raises(ValueError):
        message.pdu()


# -- which answer belongs to which request -------------------------------------

READ = ReadObject(STATUSWORD, 2)
WRITE = WriteObject(Address(0x6040), b"\x06\x00")
DICTIONARY = ReadDictionary(Phase.START)
FRAMES = (ObjectFrame(Address(0x2400, 1), b"\x01"),)


@pytest.mark.parametrize(
    ("request_", "answer", "wanted"),
    [
        (READ, ObjectRead(STATUSWORD, b"\x40\x06"), True),
        (READ, ObjectRead(STATUSWORD, b"\x40\x06\x00"), False),
        (READ, ObjectRead(Address(0x6042), b"\0\0"), False),
        (READ, ObjectRead(STATUSWORD, b"\0\0", node=2), False),
        (READ, ObjectWritten(STATUSWORD), False),
        (READ, AbortAnswer(1), True),
        (READ, ExceptionAnswer(43, 1), True),
        (READ, ExceptionAnswer(3, 1), False),
        (READ, AbortAnswer(1, Function.READ_ARRAY), False),
        (WRITE, ObjectWritten(Address(0x6040)), True),
        (WRITE, ObjectWritten(STATUSWORD), False),
        (WRITE, ObjectRead(Address(0x6040), b""), False),
        (DICTIONARY, FramesRead(Phase.START, FRAMES), True),
        (DICTIONARY, FramesRead(Phase.CONTINUE, FRAMES), True),
        (ReadDictionary(Phase.CONTINUE), FramesRead(Phase.START, FRAMES), False),
        (DICTIONARY, FramesRead(Phase.START, FRAMES, Function.READ_ARRAY), False),
        (DICTIONARY, AbortAnswer(1), True),
        (DICTIONARY, AbortAnswer(1, Function.READ_DICTIONARY), True),
        (ReadArray(Phase.START, 0x2400), FramesRead(Phase.START, FRAMES, Function.READ_ARRAY), True),
        (ReadArray(Phase.START, 0x2401), FramesRead(Phase.START, FRAMES, Function.READ_ARRAY), False),
        (WriteArray(Phase.START, FRAMES), ArrayWritten(Phase.START), True),
        (ReadRegisters(5000, 2), RegistersRead((1, 2)), True),
        (ReadRegisters(5000, 2), RegistersRead((1,)), False),
        (ReadRegisters(5000, 2), RegistersRead((1, 2), Function.READ_INPUT_REGISTERS), False),
        (ReadRegisters(5000, 2), AbortAnswer(1), False),
        (ReadWriteRegisters(5000, 1, 6000, (1,)), RegistersRead((1,), Function.READ_WRITE_REGISTERS), True),
        (WriteRegister(6000, 1), WriteRegister(6000, 1), True),
        (WriteRegister(6000, 1), WriteRegister(6000, 2), False),
        (WriteRegisters(6000, (1, 2)), RegistersWritten(6000, 2), True),
        (WriteRegisters(6000, (1, 2)), RegistersWritten(6000, 1), False),
    ],
)
def test_an_answer_counts_only_for_its_request(request_: Request, answer: Answer, wanted: bool) -> None:
    assert answers(request_, answer) is wanted


def test_frames_are_cut_into_messages_that_can_be_sent() -> None:
    frames = [ObjectFrame(Address(0x2000 + number), bytes(number % 9)) for number in range(400)]
    cut = list(batches(frames))
    assert [frame for batch in cut for frame in batch] == frames
    sizes = [sum(len(frame.encode()) for frame in batch) for batch in cut]
    assert max(sizes) <= MAX_FRAME_BYTES
    assert min(sizes[:-1]) > MAX_FRAME_BYTES - 13  # none could have taken one more
    full = FramesRead(Phase.START, (ObjectFrame(STATUSWORD, bytes(MAX_OBJECT_BYTES)),))
    assert decode_adu(Message(1, 0, full.pdu()).encode()).pdu == full.pdu()


def test_exceptions_have_names() -> None:
    assert exception_text_key(2) == "modbus.exception.illegal_address"
    assert exception_text_key(77) == "modbus.exception.unknown"
