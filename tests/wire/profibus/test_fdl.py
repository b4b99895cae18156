"""FDL telegrams: known bytes, every check, round trips, and any bytes at all."""

from __future__ import annotations

from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.wire.profibus.control import Answer, Ask, Control, Reply, Request, Station, decode_control
from app.wire.profibus.fdl import AnyTelegram, ShortAck, Telegram, Token, decode, size_of
from app.wire.profibus.fields import FormatError
from app.wire.records import Fault

CONTROLS: Final[st.SearchStrategy[Control]] = st.one_of(
    st.builds(Request, st.sampled_from(Ask), st.booleans(), st.booleans()),
    st.builds(Answer, st.sampled_from(Reply), st.sampled_from(Station)),
)
SAPS: Final = st.none() | st.integers(0, 63)
ADDRESSES: Final = st.integers(0, 126)
VARIABLE: Final = st.builds(
    Telegram, st.integers(0, 127), ADDRESSES, CONTROLS, st.binary(max_size=244), SAPS, SAPS, st.just(False)
)
FIXED: Final = VARIABLE.flatmap(
    lambda one: st.binary(
        min_size=8 - (one.dsap is not None) - (one.ssap is not None),
        max_size=8 - (one.dsap is not None) - (one.ssap is not None),
    ).map(lambda data: one._replace(data=data, fixed=True))
)
TELEGRAMS: Final[st.SearchStrategy[AnyTelegram]] = st.one_of(
    VARIABLE, FIXED, st.builds(Token, ADDRESSES, ADDRESSES), st.just(ShortAck())
)

# Written out and summed up by hand.
VECTORS: Final[list[tuple[str, AnyTelegram]]] = [
    ("E5", ShortAck()),
    ("DC 02 01", Token(2, 1)),
    ("10 02 01 49 4C 16", Telegram(2, 1, Request(Ask.FDL_STATUS))),
    ("10 01 02 00 03 16", Telegram(1, 2, Answer(Reply.OK))),
    ("10 01 02 30 33 16", Telegram(1, 2, Answer(Reply.OK, Station.MASTER_IN_RING))),
    ("10 01 08 03 0C 16", Telegram(1, 8, Answer(Reply.NO_SERVICE))),
    ("68 05 05 68 88 81 6D 3C 3E F0 16", Telegram(8, 1, Request(Ask.SRD_HIGH, True), b"", 60, 62)),
    ("68 07 07 68 FF 81 46 3A 3E 00 00 3E 16", Telegram(127, 1, Request(Ask.SDN_HIGH), bytes(2), 58, 62)),
    (
        "A2 06 01 5D A0 29 00 00 00 00 00 01 2E 16",
        Telegram(6, 1, Request(Ask.SRD_HIGH, False, True), bytes.fromhex("A029000000000001"), fixed=True),
    ),
]


@pytest.mark.parametrize(("text", "telegram"), VECTORS)
def test_known_bytes(text: str, telegram: AnyTelegram) -> None:
    data = bytes.fromhex(text)
    assert telegram.encode() == data
    assert decode(data) == telegram
    assert size_of(data) == len(data)


@pytest.mark.parametrize(
    ("text", "fault", "offset"),
    [
        ("", Fault.LENGTH, 0),
        ("00", Fault.DELIMITER, 0),
        ("E5 E5", Fault.LENGTH, 1),
        ("DC 02", Fault.LENGTH, 2),
        ("DC 82 01", Fault.FIELD, 1),
        ("DC 02 7F", Fault.FIELD, 2),
        ("10 02 01 49 4C", Fault.LENGTH, 5),
        ("10 02 01 49 4C 17", Fault.DELIMITER, 5),
        ("10 02 01 49 4D 16", Fault.CHECKSUM, 4),
        ("10 03 01 49 4C 16", Fault.CHECKSUM, 4),
        ("10 02 7F 49 CA 16", Fault.FIELD, 2),
        ("10 02 01 C9 CC 16", Fault.FIELD, 3),
        ("10 02 01 41 44 16", Fault.FIELD, 3),
        ("10 02 01 04 07 16", Fault.FIELD, 3),
        ("10 82 01 49 CC 16", Fault.LENGTH, 4),
        ("68 03 03 68 02 01 49 4C 16", Fault.LENGTH, 1),
        ("68 FA", Fault.LENGTH, 1),
        ("68 05 06 68", Fault.LENGTH, 2),
        ("68 05 05 67", Fault.DELIMITER, 3),
        ("68 05 05 68 88 81 6D BC 3E 70 16", Fault.FIELD, 7),
        ("68 05 05 68 88 81 6D 3C 7E 30 16", Fault.FIELD, 8),
        ("68 05 05 68 88 81 6D 3C 3E F0 16 00", Fault.LENGTH, 11),
        ("A2 06 01 5D A0 29 00 00 00 00 00 01 2F 16", Fault.CHECKSUM, 12),
    ],
)
def test_every_check_tells_fault_and_place(text: str, fault: Fault, offset: int) -> None:
    with pytest.raises(FormatError) as caught:
        decode(bytes.fromhex(text))
    assert (caught.value.fault, caught.value.offset) == (fault, offset)


@given(TELEGRAMS)
def test_round_trip(telegram: AnyTelegram) -> None:
    assert decode(telegram.encode()) == telegram


@given(TELEGRAMS, st.data())
def test_one_wrong_bit_is_never_taken_for_the_same_telegram(telegram: AnyTelegram, data: st.DataObject) -> None:
    """Token and SC have no check sum: what a wrong bit makes of them is another telegram, or none."""
    raw = bytearray(telegram.encode())
    bit = data.draw(st.integers(0, 8 * len(raw) - 1))
    raw[bit // 8] ^= 1 << bit % 8
    if isinstance(telegram, Telegram):
        with pytest.raises(FormatError):
            decode(bytes(raw))
        return
    try:
        assert decode(bytes(raw)) != telegram
    except FormatError as error:
        assert error.offset <= len(raw)


@given(st.binary(max_size=300))
def test_any_bytes_are_a_telegram_or_a_declared_error(data: bytes) -> None:
    try:
        assert decode(data).encode() == data
    except FormatError as error:
        assert 0 <= error.offset <= len(data)


@given(st.integers(0, 255))
def test_any_function_code(byte: int) -> None:
    try:
        assert decode_control(byte, 3).encode() == byte
    except FormatError as error:
        assert (error.fault, error.offset) == (Fault.FIELD, 3)


@pytest.mark.parametrize(
    "telegram",
    [
        Token(127, 1),
        Token(1, -1),
        Telegram(128, 1, Request(Ask.FDL_STATUS)),
        Telegram(1, 127, Request(Ask.FDL_STATUS)),
        Telegram(1, 2, Request(Ask.SRD_HIGH), b"", 64, 62),
        Telegram(1, 2, Request(Ask.SRD_HIGH), bytes(247)),
        Telegram(1, 2, Request(Ask.SRD_HIGH), bytes(7), fixed=True),
    ],
)
def test_nothing_is_built_that_does_not_fit(telegram: AnyTelegram) -> None:
    with pytest.raises(ValueError):
        telegram.encode()


@given(VARIABLE | FIXED)
def test_data_begin_where_told(telegram: Telegram) -> None:
    if telegram.data:
        assert telegram.encode()[telegram.data_offset : -2] == telegram.data
