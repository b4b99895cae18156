"""Process data of every telegram, word by word, in every order of bytes."""

from __future__ import annotations

from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.description_file import load_builtin
from app.wire.profibus.configuration import encode_configuration
from app.wire.profibus.fields import FormatError
from app.wire.profibus.pzd import AS_PKW, AS_PRINTED, ORDERS, First, Order, decode_pzd, encode_pzd, orders_that_fit
from app.wire.profibus.telegrams import (
    ACTUAL,
    CONTROL_MODE_SET,
    CONTROL_WORD,
    DEVICE_MODE_SET,
    ERROR_CODE,
    RAMP_ACCELERATION,
    RAMP_VELOCITY,
    SETPOINT,
    STATUS_WORD,
    TELEGRAM_TYPES,
    Part,
    Signal,
    Words,
    assumed_modules,
)
from app.wire.records import Fault

WAYS: Final = [words for one in TELEGRAM_TYPES.values() for words in (one.received, one.sent)]

# 4.5.1: number, words of PKW, names of the words that the slave gets, and of those that it sends.
PRINTED: Final = [
    (1, 4, "ControlWord SetpointVal SetpointVal", "StatusWord ActualVal ActualVal"),
    (2, 0, "ControlWord SetpointVal SetpointVal", "StatusWord ActualVal ActualVal"),
    (100, 0, "ControlWord DeviceMode+ControlMode SetpointVal SetpointVal",
     "StatusWord DeviceMode+ControlMode ActualVal ActualVal ErrorCode DigInp"),
    (101, 0, "ControlWord SetpointVal SetpointVal ramp_Vel ramp_Vel ramp_Acc ramp_Dec",
     "StatusWord ActualVal ActualVal"),
    (102, 4, "ControlWord DeviceMode+ControlMode SetpointVal SetpointVal",
     "StatusWord DeviceMode+ControlMode ActualVal ActualVal ErrorCode DigInp"),
    (103, 4, "ControlWord SetpointVal SetpointVal ramp_Vel ramp_Vel ramp_Acc ramp_Dec",
     "StatusWord ActualVal ActualVal"),
]  # fmt: skip


def names(words: Words) -> str:
    return " ".join(
        "+".join(signal.name.split("_", 1)[1] for signal in shared) for shared in words for _ in range(shared[0].words)
    )


@pytest.mark.parametrize(("number", "pkw_words", "received", "sent"), PRINTED)
def test_words_are_those_of_the_manual(number: int, pkw_words: int, received: str, sent: str) -> None:
    one = TELEGRAM_TYPES[number]
    assert (names(one.received), names(one.sent)) == (received, sent)
    assert one.output_size == 2 * (pkw_words + len(received.split()))
    assert one.input_size == 2 * (pkw_words + len(sent.split()))
    assert TELEGRAM_TYPES.keys() == {row[0] for row in PRINTED}


def test_signals_agree_with_the_description() -> None:
    ed2 = load_builtin("wandfluh-ed2")
    signals = {signal for words in WAYS for shared in words for signal in shared}
    for signal in signals:
        if signal.address is None:
            assert signal.name in ("dpc_ramp_Dec", "stat_DigInp")
            continue
        entry = ed2.entry(signal.address)
        assert (entry.name, signal.number in entry.signals) == (signal.name, True)
        assert entry.type.is_signed is signal.signed
        wide = signal.number != RAMP_ACCELERATION.number
        assert (entry.type.bits == signal.bits) is wide, signal.name
    numbers = {number for entry in ed2 for number in entry.signals}
    assert {signal.number for signal in signals} == numbers | {102, 106}


@pytest.mark.parametrize(
    ("order", "text"),
    [
        (AS_PRINTED, "07 00 01 FF 04 03 02 01"),
        (AS_PKW, "00 07 FF 01 01 02 03 04"),
        (Order(First.HIGH, First.LOW), "00 07 FF 01 03 04 01 02"),
        (Order(First.LOW, First.HIGH), "07 00 01 FF 02 01 04 03"),
    ],
)
def test_each_order_by_hand(order: Order, text: str) -> None:
    words = TELEGRAM_TYPES[100].received
    values = {CONTROL_WORD: 7, DEVICE_MODE_SET: 1, CONTROL_MODE_SET: -1, SETPOINT: 0x01020304}
    assert encode_pzd(words, values, order) == bytes.fromhex(text)
    assert decode_pzd(words, bytes.fromhex(text), order) == values


def test_the_wrong_order_enables_nothing_and_sets_other_bits() -> None:
    """Why no control word may leave before the order is proven: 0007h becomes 0700h."""
    words = TELEGRAM_TYPES[2].received
    assert decode_pzd(words, encode_pzd(words, {CONTROL_WORD: 7}, AS_PRINTED), AS_PKW)[CONTROL_WORD] == 0x0700


def values_of(words: Words) -> st.SearchStrategy[dict[Signal, int]]:
    def numbers(signal: Signal) -> st.SearchStrategy[int]:
        low = -(1 << signal.bits - 1) if signal.signed else 0
        return st.integers(low, low + (1 << signal.bits) - 1)

    return st.fixed_dictionaries({signal: numbers(signal) for shared in words for signal in shared})


@given(
    st.sampled_from(WAYS).flatmap(lambda words: st.tuples(st.just(words), values_of(words))), st.sampled_from(ORDERS)
)
def test_round_trip(given_: tuple[Words, dict[Signal, int]], order: Order) -> None:
    words, values = given_
    data = encode_pzd(words, values, order)
    assert decode_pzd(words, data, order) == values
    assert order in orders_that_fit(words, data, values)


@given(st.sampled_from(WAYS), st.sampled_from(ORDERS), st.binary(max_size=20), st.integers(0, 50))
def test_any_bytes(words: Words, order: Order, data: bytes, base: int) -> None:
    try:
        assert encode_pzd(words, decode_pzd(words, data, order, base), order) == data
    except FormatError as error:
        assert error.fault is Fault.LENGTH
        assert base <= error.offset <= base + len(data)


def test_the_order_is_found_by_what_pkw_reads_of_the_same_parameters() -> None:
    words = TELEGRAM_TYPES[1].sent
    known = {STATUS_WORD: 0x0008, ACTUAL: 123_456}
    for order in ORDERS:
        assert orders_that_fit(words, encode_pzd(words, known, order), known) == (order,)
    assert orders_that_fit(words, bytes(6), {STATUS_WORD: 0, ACTUAL: 0}) == ORDERS, "0 proves nothing"
    assert orders_that_fit(words, bytes(6), known) == ()
    assert len(orders_that_fit(words, encode_pzd(words, known, AS_PKW), {STATUS_WORD: 8})) == 2, "the words are open"


@pytest.mark.parametrize(
    ("signal", "value"),
    [
        (CONTROL_WORD, 0x10000),
        (CONTROL_WORD, -1),
        (RAMP_ACCELERATION, 65_536),
        (CONTROL_MODE_SET, 128),
        (SETPOINT, 1 << 31),
    ],
)
def test_no_number_is_cut_to_fit(signal: Signal, value: int) -> None:
    for words in WAYS:
        if any(signal in shared for shared in words):
            with pytest.raises(ValueError):
                encode_pzd(words, {signal: value}, AS_PRINTED)


def test_what_is_not_told_is_zero_and_what_telegrams_carry() -> None:
    words = TELEGRAM_TYPES[103].received
    assert encode_pzd(words, {RAMP_VELOCITY: 100}, AS_PRINTED) == bytes(6) + b"\x64\0\0\0" + bytes(4)
    assert [number for number, one in TELEGRAM_TYPES.items() if one.carries(ERROR_CODE)] == [100, 102]
    assert [number for number, one in TELEGRAM_TYPES.items() if one.has_pkw] == [1, 102, 103]
    assert {signal.part for signal in (DEVICE_MODE_SET, CONTROL_MODE_SET)} == {Part.LOW, Part.HIGH}


@pytest.mark.parametrize(
    ("number", "text"),
    [(1, "F3 F2"), (2, "F2"), (100, "E3 D5"), (101, "E6 D2"), (102, "F3 E3 D5"), (103, "F3 E6 D2")],
)
def test_the_configuration_that_is_assumed(number: int, text: str) -> None:
    modules = assumed_modules(TELEGRAM_TYPES[number])
    assert encode_configuration(modules) == bytes.fromhex(text)
    assert sum(one.output_size for one in modules) == TELEGRAM_TYPES[number].output_size
    assert sum(one.input_size for one in modules) == TELEGRAM_TYPES[number].input_size
