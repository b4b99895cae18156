"""Whatever comes over the line, the twin neither breaks nor says what is no telegram."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from app.twins.ed2.dp_line import to_bytes, to_symbols
from app.wire.profibus import dp
from app.wire.profibus.control import Ask, Request
from app.wire.profibus.fdl import Telegram, decode
from app.wire.profibus.splitter import Found, Splitter
from tests.twins.ed2.rig import MS, Master, Rig, VirtualWire, made

ADDRESS = st.sampled_from((2, 3, 6, 7, 126))
SAP = st.none() | st.integers(0, 63)
REQUEST = st.builds(Request, st.sampled_from(Ask), st.booleans(), st.booleans())
TELEGRAM = st.builds(
    Telegram,
    st.sampled_from((6, 6, 6, 7, 127)),
    ADDRESS,
    REQUEST,
    st.binary(max_size=30),
    SAP,
    st.sampled_from((None, 62, 62, 51)),
    st.just(False),
)


def spoken(rig: Rig) -> list[bytes]:
    """What the slave says, cut into telegrams; nothing may be left over."""
    rig.line.run_until(rig.line.busy_until_ns + 5 * MS)
    rig.line.run_until(rig.line.busy_until_ns + 5 * MS)
    splitter = Splitter()
    pieces = [*splitter.feed(to_bytes(rig.line.receive())), *splitter.silence()]
    assert all(isinstance(piece, Found) for piece in pieces)
    return [piece.data for piece in pieces]


def works(rig: Rig) -> None:
    """Power off and on, and it is a slave as any other."""
    rig.restart()
    master = Master(VirtualWire(rig.line), address=5)
    master.start()


@settings(max_examples=60, deadline=None)
@given(st.lists(st.binary(min_size=1, max_size=300), max_size=8))
def test_any_bytes(pieces: list[bytes]) -> None:
    rig = made()
    for piece in pieces:
        rig.line.send(to_symbols(piece))
        for data in spoken(rig):
            decode(data)
    works(rig)


@settings(max_examples=60, deadline=None)
@given(st.lists(TELEGRAM, max_size=12))
def test_any_telegrams_to_a_slave_that_exchanges(telegrams: list[Telegram]) -> None:
    rig = made()
    rig.master.start()
    for telegram in telegrams:
        rig.line.send(to_symbols(telegram.encode()))
        told = spoken(rig)
        control = telegram.control
        assert isinstance(control, Request)
        for_it = telegram.destination == 6 and control.ask.answered
        assert len(told) == for_it
    works(rig)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.binary(min_size=22, max_size=22), max_size=12))
def test_any_outputs(several: list[bytes]) -> None:
    rig = made()
    rig.master.start(103)
    for outputs in several:
        rig.master.ask(dp.DataExchange(outputs))
        rig.master.wire.wait(30)
    works(rig)
    assert 0.0 <= rig.device.axes[0].cylinder.position_mm <= 500.0


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from((1, 2, 3, 10)), st.integers(0, 225), st.sampled_from((0, 1, 3, 12)),
                       st.integers(0, 0xFFFFFFFF)), max_size=20),
    st.integers(0, 0xFFFF),
)  # fmt: skip
def test_any_jobs(jobs: list[tuple[int, int, int, int]], word: int) -> None:
    rig = made()
    rig.master.start(1)
    control = word.to_bytes(2, "big") + bytes.fromhex("0003D090")
    for kind, pnu, ind, value in jobs:
        data = bytes((kind << 4, pnu, ind, 0)) + value.to_bytes(4, "big")
        for outputs in (bytes(8), data):
            rig.master.ask(dp.DataExchange(outputs + control))
            rig.master.wire.wait(10)
    works(rig)
