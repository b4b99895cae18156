"""The order of process data, proven by the line alone: what PKW reads stands in the same telegram once more."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import parse_address
from app.wire.profibus.order_proof import CONTRADICTIONS, OrderProof, order_text, read_order
from app.wire.profibus.pzd import AS_PKW, AS_PRINTED, ORDERS, First, Order, encode_pzd
from app.wire.profibus.telegrams import ACTUAL, STATUS_WORD, TELEGRAM_TYPES

STATUS, POSITION, OTHER = parse_address("0/38"), parse_address("12/100"), parse_address("12/61")
ONE = TELEGRAM_TYPES[1]


def sent(order: Order, status: int, actual: int) -> bytes:
    return encode_pzd(ONE.sent, {STATUS_WORD: status, ACTUAL: actual}, order)


def word(value: int) -> bytes:
    return value.to_bytes(2, "little")


def double(value: int) -> bytes:
    return value.to_bytes(4, "little", signed=True)


@pytest.mark.parametrize("order", ORDERS, ids=order_text)
def test_a_double_word_with_four_different_bytes_proves_all(order: Order) -> None:
    proof = OrderProof()
    proof.take(ONE, POSITION, double(0x01020304), sent(order, 0, 0x01020304))
    assert proof.order == order


def test_a_word_proves_the_bytes_of_words_and_no_more() -> None:
    proof = OrderProof()
    proof.take(ONE, STATUS, word(0x0837), sent(AS_PKW, 0x0837, 5))
    assert (proof.byte, proof.order) == (First.HIGH, None)
    assert proof.tells(STATUS_WORD) is not None
    assert proof.tells(ACTUAL) is None, "it has two words"
    proof.take(ONE, POSITION, double(5), sent(AS_PKW, 0x0837, 5))
    assert proof.order == AS_PKW


def test_zero_and_parameters_that_are_not_sent_prove_nothing() -> None:
    proof = OrderProof()
    proof.take(ONE, POSITION, double(0), sent(AS_PKW, 0x0837, 0))
    proof.take(ONE, OTHER, double(0x01020304), sent(AS_PKW, 0x0837, 0x01020304))
    assert (proof.byte, proof.order) == (None, None)


def test_the_setting_of_the_site_decides_between_words_only_where_bytes_are_proven() -> None:
    proof = OrderProof()
    proof.setting = AS_PKW
    assert proof.order is None
    proof.take(ONE, STATUS, word(0x0837), sent(AS_PKW, 0x0837, 0))
    assert proof.order == AS_PKW
    proof.setting = AS_PRINTED
    assert proof.order is None, "the line has refuted it"


def test_a_value_that_changed_meanwhile_refutes_nothing_and_another_device_begins_the_proof_anew() -> None:
    proof = OrderProof()
    proof.take(ONE, POSITION, double(0x01020304), sent(AS_PKW, 0, 0x01020304))
    for value in range(0x01020399, 0x01020399 + 2 * CONTRADICTIONS):
        proof.take(ONE, POSITION, double(0x01020304), sent(AS_PKW, 0, value))
    assert proof.order == AS_PKW
    for _ in range(CONTRADICTIONS):
        assert proof.order == AS_PKW
        proof.take(ONE, POSITION, double(0x01020304), sent(AS_PRINTED, 0, 0x01020304))
    assert proof.order == AS_PRINTED


@given(st.sampled_from(ORDERS), st.lists(st.integers(-(2**31), 2**31 - 1), max_size=5))
def test_the_true_order_is_never_refuted_and_a_state_goes_on(order: Order, values: list[int]) -> None:
    proof, again = OrderProof(), OrderProof()
    for value in values:
        proof.take(ONE, POSITION, double(value), sent(order, 0, value))
        again.restore(proof.snapshot())
        assert again.order == proof.order
        assert proof.order in (None, order)


def test_an_order_as_text() -> None:
    assert [order_text(order) for order in ORDERS] == ["low-low", "low-high", "high-low", "high-high"]
    assert all(read_order(order_text(order)) == order for order in ORDERS)
    with pytest.raises(ValueError, match="middle"):
        read_order("middle-low")
