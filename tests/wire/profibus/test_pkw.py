"""PKW: the manual's examples byte by byte, what was derived from them, and any bytes at all."""

from __future__ import annotations

from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address, Addressing, parse_address
from app.model.datatypes import decode_raw, encode_raw
from app.model.description_file import load_builtin
from app.wire.profibus import pkw
from app.wire.profibus.fields import FormatError
from app.wire.profibus.pkw import AskKind, PkwAnswer, PkwRequest, ReplyKind
from app.wire.records import Fault

ED2: Final = load_builtin("wandfluh-ed2")
ADDRESSES: Final = st.builds(Address, st.integers(0, 255), st.integers(0, 255), st.just(Addressing.PKW))
_SIZES: Final = {
    AskKind.WRITE_BYTE: 8,
    AskKind.WRITE_WORD: 16,
    ReplyKind.BYTE: 8,
    ReplyKind.WORD: 16,
    ReplyKind.REFUSED: 16,
}
REQUESTS: Final = st.sampled_from(AskKind).flatmap(
    lambda kind: st.builds(PkwRequest, st.just(kind), ADDRESSES, st.integers(0, (1 << _SIZES.get(kind, 32)) - 1))
)
ANSWERS: Final = st.sampled_from(ReplyKind).flatmap(
    lambda kind: st.builds(PkwAnswer, st.just(kind), ADDRESSES, st.integers(0, (1 << _SIZES.get(kind, 32)) - 1))
)


def at(text: str) -> Address:
    return parse_address(text)


def job(address: str, raw: int) -> PkwRequest:
    """The write of a value by the type of the description."""
    return pkw.write(at(address), encode_raw(ED2.entry(at(address)).type, raw))


# Printed in 4.7 (db_Local, db_DeviceMode) and 4.8.58 (digital inputs, of which only PWE is).
PRINTED: Final = [
    ("A0 29 00 00 00 00 00 01", job("0/41", 1)),
    ("10 27 00 00 00 00 00 00", pkw.read(at("0/39"))),
    ("20 E0 0C 00 00 00 0A 02", job("12/224", 0x0A02)),
    ("10 E0 0C 00 00 00 04 00", pkw.read(at("12/224"), 0x0400)),
]
DERIVED: Final = [
    ("30 33 00 00 73 61 76 65", job("0/51", 0x73617665)),
    ("10 24 00 00 00 00 00 00", pkw.read(at("0/36"))),
    ("30 3D 0C 00 00 00 00 64", job("12/61", 100)),
    ("A0 28 00 00 00 00 00 FF", job("0/40", -1)),
    ("20 49 03 00 00 00 00 96", job("3/73", 150)),
    ("30 66 01 00 FF FF FF FE", job("1/102", -2)),
]
ANSWERED: Final = [
    ("B0 29 00 00 00 00 00 01", PkwAnswer(ReplyKind.BYTE, at("0/41"), 1)),
    ("B0 27 00 00 00 00 00 01", PkwAnswer(ReplyKind.BYTE, at("0/39"), 1)),
    ("10 E0 0C 00 00 00 04 01", PkwAnswer(ReplyKind.WORD, at("12/224"), 0x0401)),
    ("20 33 00 00 73 61 76 65", PkwAnswer(ReplyKind.DOUBLE, at("0/51"), 0x73617665)),
    ("10 24 00 00 00 00 82 30", PkwAnswer(ReplyKind.WORD, at("0/36"), 0x8230)),
    ("20 3D 0C 00 00 00 00 64", PkwAnswer(ReplyKind.DOUBLE, at("12/61"), 100)),
    ("10 49 03 00 00 00 00 96", PkwAnswer(ReplyKind.WORD, at("3/73"), 150)),
    ("70 29 00 00 00 00 00 02", PkwAnswer(ReplyKind.REFUSED, at("0/41"), 2)),
    ("70 29 00 00 00 00 00 00", PkwAnswer(ReplyKind.REFUSED, at("0/41"), 0)),
]


@pytest.mark.parametrize(("text", "request_"), PRINTED + DERIVED)
def test_requests(text: str, request_: PkwRequest) -> None:
    assert request_.encode() == bytes.fromhex(text)
    assert pkw.decode_request(bytes.fromhex(text)) == request_


@pytest.mark.parametrize(("text", "answer"), ANSWERED)
def test_answers(text: str, answer: PkwAnswer) -> None:
    assert answer.encode() == bytes.fromhex(text)
    assert pkw.decode_answer(bytes.fromhex(text)) == answer


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        (job("0/41", 1), ANSWERED[0][1]),
        (pkw.read(at("0/39")), ANSWERED[1][1]),
        (pkw.read(at("12/224"), 0x0400), ANSWERED[2][1]),
        (job("12/61", 100), ANSWERED[5][1]),
        (job("3/73", 150), ANSWERED[6][1]),
        (job("0/41", 1), ANSWERED[7][1]),
        (pkw.IDLE, PkwAnswer(ReplyKind.NOTHING)),
    ],
)
def test_an_answer_has_another_number_than_its_request(request_: PkwRequest, answer: PkwAnswer) -> None:
    assert pkw.answers(request_, answer)


@pytest.mark.parametrize(
    "answer",
    [
        PkwAnswer(ReplyKind.NOTHING),
        PkwAnswer(ReplyKind.BYTE, at("0/40"), 1),
        PkwAnswer(ReplyKind.BYTE, at("1/41"), 1),
        PkwAnswer(ReplyKind.WORD, at("0/41"), 1),
        PkwAnswer(ReplyKind.REFUSED, at("0/40"), 1),
    ],
)
def test_an_answer_of_another_job(answer: PkwAnswer) -> None:
    assert not pkw.answers(job("0/41", 1), answer)
    assert not pkw.answers(pkw.IDLE, ANSWERED[0][1])


def test_error_code_0_is_an_error_and_value_0_is_none() -> None:
    refused, zero = pkw.decode_answer(bytes.fromhex("7029000000000000")), pkw.decode_answer(bytes(8))
    assert (refused.kind, refused.data) == (ReplyKind.REFUSED, None)
    assert zero.kind is ReplyKind.NOTHING
    assert {code: pkw.error_text_key(code) for code in (0, 1, 2, 5, 18, 3)} == {
        0: "profibus.pkw.unknown_pnu", 1: "profibus.pkw.not_changeable", 2: "profibus.pkw.out_of_range",
        5: "profibus.pkw.wrong_length", 18: "profibus.pkw.other", 3: "profibus.pkw.unknown",
    }  # fmt: skip


def test_only_the_last_byte_of_a_byte_counts() -> None:
    """Whether a device extends the sign of -1 is not told."""
    for text in ("B0 28 00 00 00 00 00 FF", "B0 28 00 00 FF FF FF FF"):
        answer = pkw.decode_answer(bytes.fromhex(text))
        assert answer.data is not None
        assert decode_raw(ED2.entry(at("0/40")).type, answer.data) == -1


@pytest.mark.parametrize("entry", list(ED2), ids=lambda entry: str(entry.address))
def test_every_parameter_has_a_job_and_an_answer(entry) -> None:  # type: ignore[no-untyped-def]
    for raw in {entry.type.range[0], entry.type.range[1], 0, 1}:
        data = encode_raw(entry.type, raw)
        request = pkw.decode_request(pkw.write(entry.address, data).encode())
        assert (request.address, request.data) == (entry.address, data)
        kind = {1: ReplyKind.BYTE, 2: ReplyKind.WORD, 4: ReplyKind.DOUBLE}[len(data)]
        assert pkw.answers(request, PkwAnswer(kind, entry.address))


@given(REQUESTS)
def test_requests_round_trip(request: PkwRequest) -> None:
    assert pkw.decode_request(request.encode()) == request


@given(ANSWERS)
def test_answers_round_trip(answer: PkwAnswer) -> None:
    assert pkw.decode_answer(answer.encode()) == answer


@given(st.binary(max_size=10), st.integers(0, 100))
def test_any_bytes_are_a_job_or_a_declared_error(data: bytes, base: int) -> None:
    for decode in (pkw.decode_request, pkw.decode_answer):
        try:
            assert decode(data, base).encode()[:4] == data[:4]
        except FormatError as error:
            assert base <= error.offset <= base + len(data)


@pytest.mark.parametrize(
    ("text", "fault", "offset"),
    [
        ("10 27 00 00 00 00 00", Fault.LENGTH, 7),
        ("10 27 00 00 00 00 00 00 00", Fault.LENGTH, 8),
        ("11 27 00 00 00 00 00 00", Fault.FIELD, 0),
        ("10 27 00 01 00 00 00 00", Fault.FIELD, 3),
        ("40 27 00 00 00 00 00 00", Fault.FIELD, 0),
        ("F0 27 00 00 00 00 00 00", Fault.FIELD, 0),
    ],
)
def test_every_check_tells_fault_and_place(text: str, fault: Fault, offset: int) -> None:
    for decode in (pkw.decode_request, pkw.decode_answer):
        with pytest.raises(FormatError) as caught:
            decode(bytes.fromhex(text))
        assert (caught.value.fault, caught.value.offset) == (fault, offset)


def test_nothing_is_built_that_does_not_fit() -> None:
    for size in (0, 3, 5, 8):
        with pytest.raises(ValueError):
            pkw.write(at("0/41"), bytes(size))
    with pytest.raises(ValueError):
        pkw.read(Address(256, 1, Addressing.PKW)).encode()
    with pytest.raises(ValueError):
        pkw.read(at("0/41"), 1 << 32).encode()
