"""Every request and answer that the codec can build."""

from __future__ import annotations

from typing import Final

from hypothesis import strategies as st

from app.model.address import Address
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
from app.wire.modbus.frames import ObjectFrame, batches
from app.wire.modbus.functions import Function, Phase
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
)

WORD: Final = st.integers(0, 0xFFFF)
BYTE: Final = st.integers(0, 0xFF)
PHASE: Final = st.sampled_from(Phase)
ADDRESS: Final = st.tuples(WORD, BYTE).map(lambda parts: Address(*parts))
DATA: Final = st.binary(max_size=MAX_OBJECT_DATA)
FRAME: Final = st.builds(ObjectFrame, ADDRESS, st.binary(max_size=20))
FRAMES: Final = st.lists(FRAME, max_size=20).map(lambda frames: tuple(next(batches(frames), ())))
READERS: Final = st.sampled_from((Function.READ_HOLDING_REGISTERS, Function.READ_INPUT_REGISTERS))


def registers(most: int) -> st.SearchStrategy[tuple[int, ...]]:
    """1 to ``most`` registers."""
    return st.lists(WORD, min_size=1, max_size=most).map(tuple)


REQUESTS: Final[st.SearchStrategy[Request]] = st.one_of(
    st.builds(ReadRegisters, WORD, st.integers(1, 125), READERS),
    st.builds(WriteRegister, WORD, WORD),
    st.builds(WriteRegisters, WORD, registers(123)),
    st.builds(ReadWriteRegisters, WORD, st.integers(1, 125), WORD, registers(121)),
    st.builds(ReadObject, ADDRESS, WORD, WORD, BYTE),
    st.builds(WriteObject, ADDRESS, DATA, WORD, BYTE),
    st.builds(ReadDictionary, PHASE),
    st.builds(ReadArray, PHASE, WORD),
    st.builds(WriteArray, PHASE, FRAMES),
)
ANSWERS: Final[st.SearchStrategy[Answer]] = st.one_of(
    st.builds(
        RegistersRead,
        registers(125),
        st.sampled_from(
            (Function.READ_HOLDING_REGISTERS, Function.READ_INPUT_REGISTERS, Function.READ_WRITE_REGISTERS)
        ),
    ),
    st.builds(WriteRegister, WORD, WORD),
    st.builds(RegistersWritten, WORD, st.integers(1, 123)),
    st.builds(ObjectRead, ADDRESS, DATA, WORD, BYTE),
    st.builds(ObjectWritten, ADDRESS, WORD, BYTE),
    st.builds(FramesRead, PHASE, FRAMES, st.sampled_from((Function.READ_DICTIONARY, Function.READ_ARRAY))),
    st.builds(ArrayWritten, PHASE),
    st.builds(ExceptionAnswer, st.integers(0, 0x7F), st.integers(1, 254)),
    st.builds(
        AbortAnswer,
        st.integers(0, 0xFFFFFFFF),
        st.sampled_from((Function.OBJECT, Function.READ_DICTIONARY, Function.READ_ARRAY, Function.WRITE_ARRAY)),
    ),
)
