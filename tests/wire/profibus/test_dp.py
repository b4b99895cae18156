"""DP services: known bytes, every check, answers that belong and that do not, round trips, any bytes at all."""

from __future__ import annotations

from typing import Final

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.wire.profibus import dp
from app.wire.profibus.configuration import Length, Module, decode_configuration, encode_configuration
from app.wire.profibus.control import Answer, Ask, Reply, Request, Station
from app.wire.profibus.diagnosis import (
    NO_MASTER,
    ChannelBlock,
    DeviceBlock,
    Diagnosis,
    ModuleBlock,
    RevisionBlock,
    Status,
    decode_diagnosis,
)
from app.wire.profibus.dp import (
    ChkCfg,
    Command,
    ConfigurationAnswer,
    DataExchange,
    DiagnosisAnswer,
    Done,
    FdlStatus,
    GetCfg,
    GlobalControl,
    Inputs,
    Other,
    OtherAnswer,
    Refused,
    Service,
    ServiceAnswer,
    SetPrm,
    SlaveDiag,
    StatusAnswer,
)
from app.wire.profibus.fdl import ShortAck, Telegram, Token, decode
from app.wire.profibus.fields import FormatError
from app.wire.records import Fault
from tests.wire.profibus.test_fdl import TELEGRAMS

BYTE: Final = st.integers(0, 255)
WORD: Final = st.integers(0, 0xFFFF)
SIMPLE_LENGTH: Final = st.builds(Length, st.integers(1, 16), st.booleans(), st.booleans())
SPECIAL_LENGTH: Final = st.builds(Length, st.integers(1, 64), st.booleans(), st.booleans())
SIMPLE: Final = st.tuples(SIMPLE_LENGTH, st.sampled_from(((True, False), (False, True), (True, True)))).map(
    lambda pair: Module(pair[0] if pair[1][0] else None, pair[0] if pair[1][1] else None, False, b"")
)
SPECIAL: Final = st.builds(
    Module, st.none() | SPECIAL_LENGTH, st.none() | SPECIAL_LENGTH, st.just(True), st.binary(max_size=14)
)
MODULES: Final = st.lists(SIMPLE | SPECIAL, min_size=1, max_size=8).map(tuple)
SET_PRM: Final = st.builds(
    SetPrm, WORD, st.booleans(), st.booleans(), st.none() | st.tuples(st.integers(1, 255), st.integers(1, 255)),
    BYTE, BYTE, st.booleans(), st.booleans(), st.binary(max_size=30),
)  # fmt: skip
SERVICES: Final[st.SearchStrategy[Service]] = st.one_of(
    st.just(FdlStatus()),
    st.just(SlaveDiag()),
    st.just(GetCfg()),
    SET_PRM,
    st.builds(ChkCfg, MODULES),
    st.builds(DataExchange, st.binary(max_size=244)),
    st.builds(GlobalControl, st.integers(0, 31).map(lambda bits: Command(bits << 1)), BYTE),
)
DIAGNOSES: Final = st.builds(Diagnosis, st.integers(0, 0xFFFFFF).map(Status), BYTE, WORD, st.binary(max_size=60))

# 88h is slave 8 and 81h master 1, both with an access point; sums by hand.
REQUESTS: Final[list[tuple[str, Service, bool, bool]]] = [
    ("10 08 01 49 52 16", FdlStatus(), False, False),
    ("68 05 05 68 88 81 6D 3C 3E F0 16", SlaveDiag(), True, False),
    ("68 05 05 68 88 81 5D 3B 3E DF 16", GetCfg(), False, True),
    ("68 0C 0C 68 88 81 7D 3D 3E 88 0A 0A 0B 04 74 00 20 16", SetPrm(0x0474, watchdog=(10, 10)), True, True),
    ("68 07 07 68 88 81 5D 3E 3E F3 F2 C7 16", ChkCfg(decode_configuration(b"\xf3\xf2")), False, True),
    ("68 05 05 68 08 01 7D 00 07 8D 16", DataExchange(b"\0\7"), True, True),
    ("10 08 01 7D 86 16", DataExchange(), True, True),
    ("68 07 07 68 88 81 46 3A 3E 02 00 C9 16", GlobalControl(Command.CLEAR), False, False),
]


@pytest.mark.parametrize(("text", "service", "fcb", "fcv"), REQUESTS)
def test_requests_by_hand(text: str, service: Service, fcb: bool, fcv: bool) -> None:
    telegram = dp.encode_request(service, 1, 8, fcb, fcv)
    assert telegram.encode() == bytes.fromhex(text)
    assert dp.decode_request(telegram) == service


ASKED: Final = {name: dp.encode_request(service, 1, 8) for name, service in (
    ("status", FdlStatus()), ("diagnosis", SlaveDiag()), ("configuration", GetCfg()), ("parameters", SetPrm(0x0474)),
    ("check", ChkCfg((Module(None, Length(1)),))), ("exchange", DataExchange(b"\0\7")),
)}  # fmt: skip
ANSWERS: Final[list[tuple[str, str, ServiceAnswer]]] = [
    ("status", "10 01 08 00 09 16", StatusAnswer(Station.SLAVE)),
    ("diagnosis", "68 0B 0B 68 81 88 08 3E 3C 02 05 00 FF 04 74 09 16",
     DiagnosisAnswer(Diagnosis(Status.NOT_READY | Status.PARAMETERS_REQUIRED | Status.ALWAYS, NO_MASTER, 0x0474))),
    ("configuration", "68 07 07 68 81 88 08 3E 3B F3 F2 6F 16",
     ConfigurationAnswer(decode_configuration(b"\xf3\xf2"))),
    ("parameters", "E5", Done()),
    ("check", "E5", Done()),
    ("exchange", "68 05 05 68 01 08 08 02 03 16 16", Inputs(b"\2\3")),
    ("exchange", "68 05 05 68 01 08 0A 02 03 18 16", Inputs(b"\2\3", diagnosis=True)),
    ("exchange", "E5", Inputs()),
    ("exchange", "10 01 08 03 0C 16", Refused(Reply.NO_SERVICE)),
]  # fmt: skip


@pytest.mark.parametrize(("asked", "text", "answer"), ANSWERS)
def test_answers_by_hand(asked: str, text: str, answer: ServiceAnswer) -> None:
    request = ASKED[asked]
    assert dp.encode_answer(answer, request).encode() == bytes.fromhex(text)
    telegram = decode(bytes.fromhex(text))
    assert dp.belongs(request, telegram)
    assert isinstance(telegram, Telegram | ShortAck)
    assert dp.decode_answer(dp.decode_request(request), telegram) == answer


@pytest.mark.parametrize(
    "answer",
    [
        Token(1, 8),
        Telegram(1, 9, Answer(Reply.DATA_LOW), bytes(6), 62, 60),
        Telegram(2, 8, Answer(Reply.DATA_LOW), bytes(6), 62, 60),
        Telegram(1, 8, Answer(Reply.DATA_LOW), bytes(6), 62, 59),
        Telegram(1, 8, Request(Ask.SRD_HIGH), bytes(6), 62, 60),
    ],
)
def test_answers_of_others(answer: Telegram | Token) -> None:
    assert not dp.belongs(ASKED["diagnosis"], answer)


@pytest.mark.parametrize(
    ("telegram", "fault", "offset"),
    [
        (Telegram(8, 1, Request(Ask.SRD_HIGH), bytes(6), 61, 62), Fault.LENGTH, 15),
        (Telegram(8, 1, Request(Ask.SRD_HIGH), b"\x81" + bytes(6), 61, 62), Fault.FIELD, 9),
        (Telegram(8, 1, Request(Ask.SRD_HIGH), b"\x08\0" + bytes(5), 61, 62), Fault.FIELD, 10),
        (Telegram(8, 1, Request(Ask.SRD_HIGH), b"\0", 60, 62), Fault.LENGTH, 9),
        (Telegram(8, 1, Request(Ask.SRD_HIGH), b"", 62, 62), Fault.LENGTH, 9),
        (Telegram(8, 1, Request(Ask.SRD_HIGH), b"\x41", 62, 62), Fault.LENGTH, 10),
        (Telegram(8, 1, Request(Ask.SRD_HIGH), b"\x0f", 62, 62), Fault.FIELD, 9),
        (Telegram(127, 1, Request(Ask.SDN_HIGH), b"\0", 58, 62), Fault.LENGTH, 10),
        (Telegram(127, 1, Request(Ask.SDN_HIGH), b"\x80\0", 58, 62), Fault.FIELD, 9),
        (Telegram(8, 1, Answer(Reply.OK)), Fault.FIELD, 3),
    ],
)
def test_every_check_tells_fault_and_place(telegram: Telegram, fault: Fault, offset: int) -> None:
    with pytest.raises(FormatError) as caught:
        dp.decode_request(telegram)
    assert (caught.value.fault, caught.value.offset) == (fault, offset)


@pytest.mark.parametrize(
    ("service", "answer"),
    [
        (SlaveDiag(), ShortAck()),
        (FdlStatus(), ShortAck()),
        (SlaveDiag(), Telegram(1, 8, Answer(Reply.DATA_LOW), bytes(5), 62, 60)),
        (SlaveDiag(), Telegram(1, 8, Answer(Reply.NO_DATA))),
        (SetPrm(1), Telegram(1, 8, Answer(Reply.DATA_LOW), bytes(5))),
        (FdlStatus(), Telegram(1, 8, Answer(Reply.DATA_LOW))),
        (DataExchange(), Telegram(1, 8, Request(Ask.SRD_HIGH))),
        (DataExchange(), Telegram(1, 8, Answer(Reply.OK), b"\1")),
    ],
)
def test_answers_that_make_no_sense(service: Service, answer: Telegram | ShortAck) -> None:
    with pytest.raises(FormatError):
        dp.decode_answer(service, answer)


@given(SERVICES, st.booleans(), st.booleans())
def test_services_round_trip(service: Service, fcb: bool, fcv: bool) -> None:
    telegram = decode(dp.encode_request(service, 1, 8, fcb, fcv).encode())
    assert isinstance(telegram, Telegram)
    assert dp.decode_request(telegram) == service


@given(DIAGNOSES)
def test_diagnoses_round_trip(diagnosis: Diagnosis) -> None:
    assert decode_diagnosis(diagnosis.encode()) == diagnosis
    answer = dp.encode_answer(DiagnosisAnswer(diagnosis), ASKED["diagnosis"])
    assert dp.decode_answer(SlaveDiag(), answer) == DiagnosisAnswer(diagnosis)


@given(MODULES)
def test_configurations_round_trip(modules: tuple[Module, ...]) -> None:
    assert decode_configuration(encode_configuration(modules)) == modules


@given(SERVICES, TELEGRAMS)
def test_any_telegram_is_a_service_an_answer_or_a_declared_error(service: Service, telegram: object) -> None:
    assume(isinstance(telegram, Telegram | ShortAck))
    assert isinstance(telegram, Telegram | ShortAck)
    size = len(telegram.encode())
    if isinstance(telegram, Telegram):
        try:
            dp.decode_request(telegram)
        except FormatError as error:
            assert 0 <= error.offset <= size
    try:
        dp.decode_answer(service, telegram)
    except FormatError as error:
        assert 0 <= error.offset <= size


@given(st.binary(max_size=250))
def test_any_bytes(data: bytes) -> None:
    try:
        assert encode_configuration(decode_configuration(data)) == data
    except FormatError as error:
        assert error.offset <= len(data)
    try:
        list(decode_diagnosis(data).blocks())
    except FormatError as error:
        assert error.offset <= len(data)


def test_extended_diagnosis() -> None:
    extended = bytes.fromhex("03 AA BB 42 05 82 C4 29 C7")
    blocks = list(Diagnosis(Status.EXTENDED, 1, 0x0474, extended).blocks())
    assert blocks == [DeviceBlock(b"\xaa\xbb"), ModuleBlock((0, 2)), ChannelBlock(2, 4, 3, 1, 9), RevisionBlock(7)]
    for wrong in ("00", "03 AA", "82 01", "40"):
        with pytest.raises(FormatError):
            list(Diagnosis(Status.EXTENDED, 1, 0x0474, bytes.fromhex(wrong)).blocks())


def test_when_a_slave_is_ready_for_its_outputs() -> None:
    assert Diagnosis(Status.ALWAYS | Status.WATCHDOG, 1, 0x0474).ready
    for wrong in (Status.NOT_READY, Status.CONFIGURATION_FAULT, Status.PARAMETER_FAULT, Status.PARAMETERS_REQUIRED):
        assert not Diagnosis(Status.ALWAYS | wrong, 1, 0x0474).ready


def test_watchdog_and_lengths() -> None:
    assert SetPrm(1, watchdog=(10, 20)).watchdog_ms == 2000
    assert SetPrm(1).watchdog_ms is None
    both = Length(4, words=True, consistent=True)
    assert (Module(both, both).output_size, Module(None, both).output_size) == (8, 0)
    assert encode_configuration((Module(both, Length(2, words=True), special=True),)) == b"\xc0\xc3\x41"


@pytest.mark.parametrize(
    "service",
    [
        SetPrm(0x10000), SetPrm(1, watchdog=(0, 1)), SetPrm(1, user_data=bytes(238)), ChkCfg(()),
        ChkCfg((Module(None, None),)), ChkCfg((Module(Length(1), Length(2)),)), ChkCfg((Module(Length(17), None),)),
        ChkCfg((Module(Length(1), None, maker=b"x"),)), DataExchange(bytes(245)), GlobalControl(groups=256),
    ],
)  # fmt: skip
def test_nothing_is_built_that_does_not_fit(service: Service) -> None:
    with pytest.raises(ValueError):
        dp.encode_request(service, 1, 8).encode()


def test_services_of_others_pass_as_they_are() -> None:
    asked = Other(Ask.SRD_LOW, 56, 62, b"\1")
    telegram = dp.encode_request(asked, 1, 8)
    assert dp.decode_request(telegram) == asked
    answer = OtherAnswer(Reply.DATA_LOW, b"\2")
    assert dp.decode_answer(asked, dp.encode_answer(answer, telegram)) == answer
