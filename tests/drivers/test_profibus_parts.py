"""The parts of the PROFIBUS driver that know no line: PKW jobs, process data, the order of bytes, the configuration."""

from __future__ import annotations

import os
import termios
import tty
from dataclasses import dataclass, field

import pytest

from app.drivers.profibus_config import (
    MAX_CYCLE_S,
    ProfibusConfig,
    ProfibusStation,
    exchange_s,
    parse_profibus,
    require_fits,
)
from app.drivers.profibus_image import Change, Image
from app.drivers.profibus_line import Received, Unmarking, mark_parity
from app.drivers.profibus_order import OrderCheck, evidence_of
from app.drivers.profibus_pkw import STILL_S, Failure, PkwChannel, PkwJob, Result
from app.errors import UsageError
from app.model.texts import load_texts
from app.wire.profibus import pkw
from app.wire.profibus.pkw import IDLE, PkwAnswer, PkwRequest, ReplyKind
from app.wire.profibus.pzd import AS_PKW, AS_PRINTED, First, Order, encode_pzd
from app.wire.profibus.telegrams import ACTUAL, CONTROL_WORD, ERROR_CODE, SETPOINT, STATUS_WORD, TELEGRAM_TYPES
from tests.drivers.profibus_rig import LOCAL, RAMP_VELOCITY, STATUSWORD

NOTHING = PkwAnswer(ReplyKind.NOTHING).encode()
READ, WRITE = pkw.read(STATUSWORD), pkw.write(LOCAL, b"\1")
WORD = PkwAnswer(ReplyKind.WORD, STATUSWORD, 0x0231)
ONE, SHORT = TELEGRAM_TYPES[102], TELEGRAM_TYPES[1]


# -- PKW ------------------------------------------------------------------------------------------


@dataclass
class Channel:
    """A channel, the clock it is asked by, and what became of jobs."""

    channel: PkwChannel = field(default_factory=PkwChannel)
    now_s: float = 0.0
    ended: list[tuple[Result, bool]] = field(default_factory=list)

    def job(self, request: PkwRequest, urgent: bool = False, refusal: Failure | None = None) -> PkwJob:
        job = PkwJob(request, 1.0, lambda result, sent: self.ended.append((result, sent)), urgent, lambda: refusal)
        self.channel.put(job)
        return job

    def exchange(self, shown: bytes = NOTHING, passing_s: float = 0.01) -> bytes:
        self.now_s += passing_s
        asked = self.channel.outputs(self.now_s)
        self.channel.take(asked, shown)
        return asked


def test_a_job_is_put_after_the_device_has_shown_nothing_to_nothing() -> None:
    one = Channel()
    one.job(READ)
    assert one.exchange(WORD.encode()) == IDLE.encode()
    assert one.exchange(WORD.encode()) == IDLE.encode()
    assert one.exchange() == IDLE.encode()
    assert one.exchange() == READ.encode()
    assert one.ended == []
    assert one.exchange(WORD.encode()) == READ.encode()
    assert one.ended == [(WORD, True)]


def test_equal_jobs_are_told_apart_by_the_nothing_between_them() -> None:
    """The answer to the first stands there until it is gone; the second one has its own."""
    one = Channel()
    one.job(READ)
    one.job(READ)
    one.exchange()
    one.exchange(WORD.encode())
    assert len(one.ended) == 1
    for _ in range(3):
        assert one.exchange(WORD.encode()) == IDLE.encode()
    assert len(one.ended) == 1
    one.exchange()
    assert one.exchange(WORD.encode()) == READ.encode()
    assert len(one.ended) == 2
    assert not one.channel.waiting


@pytest.mark.parametrize(
    "other",
    [
        WORD._replace(address=LOCAL),
        WORD._replace(address=WORD.address._replace(major=12)),
        WORD._replace(kind=ReplyKind.NOTHING),
    ],
)
def test_an_answer_has_to_name_its_parameter(other: PkwAnswer) -> None:
    one = Channel()
    one.job(READ)
    one.exchange()
    one.exchange(other.encode())
    assert one.ended == []


def test_only_ak_7_says_no_and_its_code_0_does_too() -> None:
    one = Channel()
    refused = PkwAnswer(ReplyKind.REFUSED, STATUSWORD, 0)
    zero = PkwAnswer(ReplyKind.WORD, STATUSWORD, 0)
    for answer in (refused, zero):
        one.job(READ)
        one.exchange()
        one.exchange(answer.encode())
    assert one.ended == [(refused, True), (zero, True)]


def test_bytes_that_are_no_answer_are_counted_and_waited_out() -> None:
    one = Channel()
    one.job(READ)
    one.exchange()
    one.exchange(b"\x55" * 8)
    one.exchange(WORD.encode())
    assert (one.channel.malformed, one.ended) == (1, [(WORD, True)])


def test_an_answer_after_its_time_is_not_that_of_the_next_job() -> None:
    one = Channel()
    one.job(READ)
    one.exchange()
    for _ in range(9):
        one.exchange(WORD._replace(address=LOCAL).encode(), passing_s=0.125)
    assert one.ended == [(Failure.TIMEOUT, True)]
    one.job(READ)
    assert one.exchange(WORD.encode()) == IDLE.encode()
    assert len(one.ended) == 1


def test_time_in_which_the_host_stood_still_is_nobodys_time() -> None:
    one = Channel()
    one.job(READ)
    one.exchange()
    one.exchange(passing_s=5.0)
    assert one.ended == []
    assert one.exchange(WORD.encode(), passing_s=STILL_S) == READ.encode()
    assert one.ended == [(WORD, True)]


def test_a_job_that_waits_for_nobody_ends_too() -> None:
    """The station is not there: nothing is exchanged, only time passes."""
    one = Channel()
    one.job(READ)
    for now_s in (0.0, 0.2, 0.4, 0.6, 0.8, 1.1):
        one.channel.expire(now_s)
    assert one.ended == [(Failure.TIMEOUT, False)]


def test_an_urgent_write_goes_first_and_a_read_begins_anew_behind_it() -> None:
    one = Channel()
    one.job(READ)
    one.job(pkw.read(RAMP_VELOCITY))
    one.exchange()
    assert one.exchange() == READ.encode()
    one.job(WRITE, urgent=True)
    assert one.exchange() == IDLE.encode()
    assert one.exchange() == WRITE.encode()
    done = PkwAnswer(ReplyKind.BYTE, LOCAL, 1)
    one.exchange(done.encode())
    assert one.ended == [(done, True)]
    one.exchange()
    assert one.exchange(WORD.encode()) == READ.encode()
    assert one.ended[1:] == [(WORD, True)]


def test_a_write_that_runs_is_not_interrupted_for_its_outcome_would_be_open() -> None:
    one = Channel()
    one.job(WRITE)
    one.exchange()
    one.exchange()
    one.job(pkw.write(LOCAL, b"\0"), urgent=True)
    assert one.exchange() == WRITE.encode()


def test_a_write_that_was_overtaken_is_not_sent() -> None:
    one = Channel()
    one.job(WRITE, refusal=Failure.OVERTAKEN)
    one.exchange()
    assert one.exchange() == IDLE.encode()
    assert one.ended == [(Failure.OVERTAKEN, False)]


@pytest.mark.parametrize(("request_", "ends"), [(READ, []), (WRITE, [(Failure.GONE, True)])])
def test_what_was_sent_to_a_station_that_went(request_: PkwRequest, ends: list[tuple[Result, bool]]) -> None:
    """A read is put again once it is back. A write is not: nobody knows whether it was taken."""
    one = Channel()
    one.job(request_)
    one.exchange()
    one.exchange()
    one.channel.gone()
    assert one.ended == ends
    one.exchange()
    assert one.exchange() == (request_.encode() if not ends else IDLE.encode())


def test_a_job_that_nobody_waits_for_is_taken_back() -> None:
    one = Channel()
    first, second = one.job(READ), one.job(WRITE)
    one.exchange()
    one.exchange()
    one.channel.drop(second)
    one.channel.drop(first)
    assert one.ended == [(Failure.CANCELLED, False), (Failure.CANCELLED, True)]
    assert one.exchange() == IDLE.encode()
    assert not one.channel.waiting


def test_at_the_end_nobody_is_left_waiting() -> None:
    one = Channel()
    for request in (READ, WRITE):
        one.job(request)
    one.exchange()
    one.exchange()
    one.channel.end_all(Failure.GONE)
    assert one.ended == [(Failure.GONE, True), (Failure.GONE, False)]


# -- process data ------------------------------------------------------------------------------------


@dataclass
class Data:
    """An image whose order is proven, and what became of changes."""

    image: Image = field(default_factory=lambda: Image(ONE))
    ended: list[tuple[Failure | None, bool]] = field(default_factory=list)

    def change(self, word: int, urgent: bool = False) -> None:
        self.image.put(Change({CONTROL_WORD: word}, lambda failure, sent: self.ended.append((failure, sent)), urgent))


def test_nothing_but_zeros_is_sent_before_the_order_is_proven() -> None:
    data = Data()
    data.change(0)
    assert data.image.outputs() == bytes(8)
    data.image.delivered()
    data.change(7)
    assert data.image.outputs() == bytes(8)
    assert data.ended == [(None, True), (Failure.NOT_READY, False)]
    assert data.image.controlword == 0


def test_each_change_stands_until_it_was_surely_taken() -> None:
    """An edge of new_setpoint, 0 to 1 to 0: no lost exchange can swallow it."""
    data = Data()
    data.image.order = AS_PKW
    for word in (0x0007, 0x2007, 0x0007):
        data.change(word)
    sent = [data.image.outputs()[:2].hex() for _ in range(3)]
    assert sent == ["0007"] * 3
    for expected in ("2007", "0007"):
        data.image.delivered()
        assert data.image.outputs()[:2].hex() == expected
    data.image.delivered()
    assert data.ended == [(None, True)] * 3
    assert not data.image.busy


def test_a_stop_takes_the_place_of_all_that_waits() -> None:
    data = Data()
    data.image.order = AS_PKW
    data.change(0x0007)
    data.image.outputs()
    data.change(0x2007)
    data.change(0, urgent=True)
    assert data.image.outputs()[:2] == b"\0\0"
    assert data.ended == [(Failure.GONE, True), (Failure.OVERTAKEN, False)]
    data.image.delivered()
    assert data.ended[2:] == [(None, True)]


def test_a_station_that_went_begins_with_zeros_again() -> None:
    data = Data()
    data.image.order = AS_PKW
    data.change(0x0007)
    data.image.outputs()
    data.change(0x000F)
    data.image.forget(Failure.GONE)
    assert data.ended == [(Failure.GONE, True), (Failure.GONE, False)]
    assert data.image.outputs() == bytes(8)


# -- the order of bytes --------------------------------------------------------------------------------


def _check(order: Order, status: int, actual: int, setting: Order | None = None) -> OrderCheck:
    values = {STATUS_WORD: status, ACTUAL: actual, ERROR_CODE: 0}
    data = encode_pzd(ONE.sent, values, order)
    read = {
        STATUS_WORD: status.to_bytes(2, "little"),
        ACTUAL: actual.to_bytes(4, "little", signed=True),
        ERROR_CODE: bytes(2),
    }
    return OrderCheck(tuple(evidence_of(ONE, signal, raw, data) for signal, raw in read.items()), setting)


@pytest.mark.parametrize("order", [Order(byte, word) for byte in First for word in First])
def test_one_order_is_left_where_the_values_tell_them_apart(order: Order) -> None:
    check = _check(order, 0x0231, -5)
    assert check.fits == (order,)
    assert check.proven == order
    assert _check(order, 0x0231, -5, setting=order).proven == order


def test_zero_proves_nothing() -> None:
    check = _check(AS_PKW, 0, 0)
    assert len(check.fits) == 4
    assert check.proven is None
    assert _check(AS_PKW, 0, 0, setting=AS_PKW).proven is None
    assert check.reason_key == "profibus.order.ambiguous"


def test_the_site_decides_what_a_proven_order_of_bytes_leaves_open() -> None:
    assert _check(AS_PKW, 0x0231, 0).proven is None
    assert _check(AS_PKW, 0x0231, 0, setting=AS_PKW).proven == AS_PKW


def test_a_setting_that_the_values_contradict_is_not_taken() -> None:
    check = _check(AS_PKW, 0x0231, 1000, setting=AS_PRINTED)
    assert check.proven is None
    assert check.reason_key == "profibus.order.setting"


def test_values_that_fit_no_order_prove_none() -> None:
    check = _check(AS_PKW, 0x0231, 1000)
    wrong = evidence_of(ONE, STATUS_WORD, b"\x55\x66", check.evidence[0].data)
    assert OrderCheck((*check.evidence, wrong)).proven is None
    for key in ("ambiguous", "contradiction", "setting", "needs"):
        for language in ("en", "de"):
            assert load_texts(language)(f"profibus.order.{key}") != f"profibus.order.{key}"


# -- parity marks --------------------------------------------------------------------------------------


@pytest.mark.parametrize("cut", range(10))
def test_marks_of_wrong_parity_are_undone_however_they_are_cut(cut: int) -> None:
    marked = b"\x10\xff\xff\xff\x00\x41\x16\xff\xff\x20"
    marks = Unmarking()
    parts = [marks.feed(marked[:cut]), marks.feed(marked[cut:])]
    assert b"".join(part.data for part in parts) == b"\x10\xff\x16\xff\x20"
    assert sum(part.broken for part in parts) == 1
    assert marks.feed(b"\x01") == Received(b"\x01", 0)


def test_a_port_is_told_to_mark_parity_and_keeps_all_else() -> None:
    """A pseudo-terminal has no parity, but the flags of one."""
    ours, theirs = os.openpty()
    try:
        tty.setraw(theirs)
        before = termios.tcgetattr(theirs)
        mark_parity(theirs)
        after = termios.tcgetattr(theirs)
        assert after[0] == before[0] | termios.INPCK | termios.PARMRK
        assert after[1:] == before[1:]
        os.write(ours, b"\x10\xff\x16")
        assert Unmarking().feed(os.read(theirs, 10)) == Received(b"\x10\xff\x16", 0)
    finally:
        os.close(ours)
        os.close(theirs)


# -- the configuration -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "config"),
    [
        ("/dev/ttyUSB0@500000", ProfibusConfig("/dev/ttyUSB0", 500_000)),
        ("/dev/pts/3@19200,6", ProfibusConfig("/dev/pts/3", 19_200, (ProfibusStation(6),))),
        ("/dev/ttyS0@9600, 6/102,7/1", None),
        (
            "/dev/ttyS0@19200,6/102,7/1",
            ProfibusConfig("/dev/ttyS0", 19_200, (ProfibusStation(6, 102), ProfibusStation(7, 1))),
        ),
    ],
)
def test_configurations(text: str, config: ProfibusConfig | None) -> None:
    if config is None:
        with pytest.raises(UsageError, match="more than 90 ms"):
            parse_profibus(text)
        return
    assert parse_profibus(text) == config
    assert parse_profibus(str(config)) == config


@pytest.mark.parametrize(
    "text", ["", "/dev/ttyUSB0", "@500000", "a@500", "a@115200", "a@9600,6,6", "a@9600,6/3", "a@9600,127", "a@9600,2"]
)
def test_configurations_that_are_none(text: str) -> None:
    with pytest.raises(UsageError):
        parse_profibus(text)


@pytest.mark.parametrize(
    ("baud", "telegrams", "fits"),
    [(9_600, (102,), True), (9_600, (102, 103), False), (19_200, (102, 103), True), (9_600, (1, 1), False)],
)
def test_what_takes_the_wire_longer_than_the_master_waits_is_refused(
    baud: int, telegrams: tuple[int, ...], fits: bool
) -> None:
    types = [TELEGRAM_TYPES[number] for number in telegrams]
    assert (sum(exchange_s(each, baud) for each in types) <= MAX_CYCLE_S) is fits
    if fits:
        require_fits(types, baud)
    else:
        with pytest.raises(UsageError):
            require_fits(types, baud)


def test_one_exchange_takes_what_its_bytes_take() -> None:
    """Telegram 102: 25 bytes to the slave and 29 back, 11 bits each."""
    assert exchange_s(ONE, 9_600) == pytest.approx((25 + 29) * 11 / 9_600)
    assert exchange_s(SHORT, 500_000) == pytest.approx((23 + 23) * 11 / 500_000)
    assert SETPOINT in [signal for word in SHORT.received for signal in word]
