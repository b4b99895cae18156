"""The line in process: symbols and their parity, time, noise, and that slaves do not act on what is damaged."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.twins.ed2.dp_line import LineNoise, Symbols, parity_holds, to_bytes, to_symbols
from app.twins.ed2.dp_slave import DpState
from app.wire.profibus import dp, pkw
from app.wire.profibus.control import Station
from app.wire.profibus.fdl import Telegram
from app.wire.profibus.telegrams import CONTROL_WORD
from tests.twins.ed2.rig import MASTER, MS, VirtualWire, made, where


@given(st.binary(max_size=40))
def test_symbols_carry_bytes_and_even_parity(data: bytes) -> None:
    symbols = to_symbols(data)
    assert to_bytes(symbols) == data
    assert all(symbol.bit_count() % 2 == 0 and parity_holds(symbol) for symbol in symbols)


@given(st.integers(0, 255), st.integers(0, 8), st.integers(0, 8))
def test_one_flipped_bit_shows_and_two_do_not(byte: int, first: int, second: int) -> None:
    (symbol,) = to_symbols(bytes((byte,)))
    assert not parity_holds(symbol ^ 1 << first)
    assert first == second or parity_holds(symbol ^ 1 << first ^ 1 << second)


@pytest.mark.parametrize("baud", [9_600, 19_200, 500_000, 12_000_000])
def test_request_answer_and_what_is_between_take_their_bit_times(baud: int) -> None:
    rig = made(baud=baud)
    request = dp.encode_request(dp.FdlStatus(), MASTER, 6).encode()
    began_ns = rig.line.now_ns
    ended_ns = rig.line.send(to_symbols(request))
    assert ended_ns - began_ns == 6 * 11 * 1_000_000_000 // baud
    rig.line.run_until(ended_ns)
    bit_ns = 1_000_000_000 / baud
    rig.line.run_until(round(ended_ns + (11 + 11) * bit_ns) - 2)
    assert rig.line.receive() == ()
    rig.line.run_until(round(ended_ns + (11 + 11) * bit_ns) + 2)
    assert to_bytes(rig.line.receive()) == b"\x10"
    rig.line.run_until(round(ended_ns + (11 + 6 * 11) * bit_ns) + 10)
    assert (
        to_bytes(rig.line.receive())
        == dp.encode_answer(dp.StatusAnswer(Station.SLAVE), dp.encode_request(dp.FdlStatus(), MASTER, 6)).encode()[1:]
    )


def test_a_telegram_with_a_wrong_parity_is_not_obeyed_though_its_bytes_are_right() -> None:
    rig = made()
    rig.master.start()
    telegram = rig.master.frame(dp.DataExchange(rig.master.outputs())).encode()
    symbols = list(to_symbols(telegram))
    symbols[9] ^= 0x100
    rig.line.run_until(rig.line.send(symbols) + 5 * MS)
    assert rig.line.receive() == ()
    rig.line.run_until(rig.line.send(to_symbols(telegram)) + 5 * MS)
    assert to_bytes(rig.line.receive()) != b""


def test_half_a_telegram_and_a_silence_do_not_spoil_the_next_one() -> None:
    rig = made()
    rig.master.start()
    telegram = rig.master.frame(dp.DataExchange(rig.master.outputs())).encode()
    rig.line.run_until(rig.line.send(to_symbols(telegram[:10])) + 5 * MS)
    assert rig.line.receive() == ()
    rig.master.exchange()


def test_noise_is_the_same_with_every_run_and_does_what_it_counts() -> None:
    sent = [to_symbols(bytes(range(10, 40)))] * 400

    def run() -> tuple[list[list[Symbols]], dict[str, int]]:
        noise = LineNoise(7, bit_errors=0.0005, lost=0.1, doubled=0.1, truncated=0.1)
        return [list(noise(one)) for one in sent], noise.counts

    first, counts = run()
    assert run() == (first, counts)
    assert counts["lost"] == sum(len(parts) == 0 for parts in first)
    assert counts["doubled"] == sum(len(parts) == 2 for parts in first)
    assert all(counts[name] > 10 for name in counts)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 1 << 30))
def test_through_noise_no_wrong_value_gets_into_the_slave(seed: int) -> None:
    rig = made()
    master = rig.master
    master.start()
    wire = rig.master.wire
    assert isinstance(wire, VirtualWire)
    rig.line.fault = LineNoise(seed, bit_errors=0.002, lost=0.05, doubled=0.05, truncated=0.05)
    master.job = pkw.write(where("12/207"), (4_321).to_bytes(4, "little"))
    master.values[0] = {CONTROL_WORD: 0x0001}
    for _ in range(150):
        master.send(dp.DataExchange(master.outputs()))
        assert rig.device.outputs_of(1).get(CONTROL_WORD, 1) in (0, 1)
        assert rig.device.channels[0].number(12, 207) in (10_000, 4_321)
    rig.line.fault = None
    wire.wait(10)
    wire.take()
    if rig.device.slave.state is not DpState.DATA_EXCHANGE:
        master.first = True
        master.start()
    master.exchange()
    master.advance(20)
    assert rig.device.channels[0].number(12, 207) == 4_321


def test_a_slave_that_restarts_says_nothing_and_then_waits_for_parameters() -> None:
    rig = made()
    rig.master.start()
    rig.device.power_off()
    assert rig.master.send(dp.DataExchange(rig.master.outputs())) == []
    rig.device.power_on()
    assert rig.master.send(dp.DataExchange(rig.master.outputs())) == []
    rig.master.wire.wait(300)
    told = rig.master.send(dp.SlaveDiag())
    assert isinstance(told[0], Telegram)
    rig.master.start()


def test_the_line_says_when_something_will_happen() -> None:
    rig = made()
    assert rig.line.next_due_ns() is None
    sent_ns = rig.line.send(to_symbols(dp.encode_request(dp.FdlStatus(), MASTER, 6).encode()))
    assert rig.line.next_due_ns() == sent_ns
    rig.line.run_until(sent_ns)
    due_ns = rig.line.next_due_ns()
    assert due_ns is not None
    rig.line.run_until(due_ns)
    assert len(rig.line.receive()) == 1


@pytest.mark.parametrize("share", [0.0, 0.0001, 0.01, 0.5, 1.0])
def test_as_many_bits_flip_as_are_asked_for(share: float) -> None:
    noise, sent = LineNoise(3, bit_errors=share), to_symbols(bytes(range(40)))
    flipped = 0
    for _ in range(2_000):
        (told,) = noise(sent)
        flipped += sum((one ^ other).bit_count() for one, other in zip(sent, told, strict=True))
    assert flipped == noise.counts["bit_errors"]
    bits = 2_000 * 40 * 9
    assert flipped == pytest.approx(share * bits, rel=0.3 if share < 0.001 else 0.05)
