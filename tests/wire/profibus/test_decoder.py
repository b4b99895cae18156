"""The passive decoder: jobs of PKW, process data, slaves that come and go, foreign masters, and anything at all."""

from __future__ import annotations

import json
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address, parse_address
from app.model.description_file import load_builtin
from app.wire.decoders import decoder_of, decoder_of_frame, decoder_of_state
from app.wire.frame import Can, Direction, Fdl, Frame
from app.wire.live import LiveState
from app.wire.profibus import dp, pkw
from app.wire.profibus.control import Reply, Station
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.profibus.diagnosis import NO_MASTER, Diagnosis, Status
from app.wire.profibus.dp import DataExchange, FdlStatus, Inputs, Refused, Service, ServiceAnswer, SetPrm, SlaveDiag
from app.wire.profibus.fdl import Token
from app.wire.profibus.pkw import AskKind, PkwAnswer, PkwRequest, ReplyKind
from app.wire.profibus.pzd import AS_PKW, AS_PRINTED, encode_pzd
from app.wire.profibus.slave import LOST_AFTER
from app.wire.profibus.telegrams import ACTUAL, CONTROL_WORD, SETPOINT, STATUS_WORD, TELEGRAM_TYPES
from app.wire.records import (
    DiagnosisSeen,
    Fault,
    GapSeen,
    MalformedAduSeen,
    OrphanSeen,
    Outcome,
    Protocol,
    Record,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    Side,
    SlaveSeen,
    SlaveState,
    Source,
    ValueSeen,
)
from tests.wire.profibus.test_fdl import TELEGRAMS

BUS: Final = "dp0"
NODE: Final = 6
MASTER: Final = 1
ED2: Final = load_builtin("wandfluh-ed2")
LOCAL, UNIT, STORE = parse_address("0/41"), parse_address("1/84"), parse_address("0/51")
IDLE_ANSWER: Final = PkwAnswer(ReplyKind.NOTHING)


class Line:
    """A master and a slave; frames come 1 ns after each other."""

    def __init__(self, master: int = MASTER, ours: bool = True, node: int = NODE, telegram: int = 1) -> None:
        self.master = master
        self.way = Direction.TX if ours else Direction.RX
        self.node = node
        self.telegram = TELEGRAM_TYPES[telegram]
        self.t_ns = 0

    def frame(self, data: bytes, way: Direction = Direction.RX) -> Frame:
        self.t_ns += 1
        return Frame(self.t_ns, BUS, way, Fdl(data))

    def ask(self, service: Service) -> Frame:
        return self.frame(dp.encode_request(service, self.master, self.node).encode(), self.way)

    def answer(self, service: Service, answer: ServiceAnswer) -> Frame:
        request = dp.encode_request(service, self.master, self.node)
        return self.frame(dp.encode_answer(answer, request).encode())

    def served(self, service: Service, answer: ServiceAnswer) -> list[Frame]:
        return [self.ask(service), self.answer(service, answer)]

    def exchange(self, job: PkwRequest = pkw.IDLE, shown: PkwAnswer = IDLE_ANSWER) -> list[Frame]:
        """One Data_Exchange with PKW, and process data of nothing but 0."""
        received, sent = 2 * self.telegram.received_words, 2 * self.telegram.sent_words
        return self.served(DataExchange(job.encode() + bytes(received)), Inputs(shown.encode() + bytes(sent)))


@pytest.fixture
def decoder() -> ProfibusDecoder:
    return ProfibusDecoder(BUS, {NODE: ED2})


def accesses(records: list[Record]) -> list[tuple[Address, SdoAccess, Outcome, bytes | None, int | None]]:
    return [(r.address, r.access, r.outcome, r.data, r.abort_code) for r in records if isinstance(r, SdoSeen)]


def values(records: list[Record]) -> list[tuple[Address, bytes, Source]]:
    return [(r.address, r.data, r.source) for r in records if isinstance(r, ValueSeen)]


def states(records: list[Record]) -> list[SlaveState]:
    return [r.state for r in records if isinstance(r, SlaveSeen)]


# -- PKW -----------------------------------------------------------------------------


def test_a_read_is_told_once_with_its_time_however_long_it_stands(decoder: ProfibusDecoder) -> None:
    line, answer = Line(), PkwAnswer(ReplyKind.BYTE, UNIT, 3)
    decoder.feed_all(line.exchange())
    frames = [
        *line.exchange(pkw.read(UNIT)),
        *line.exchange(pkw.read(UNIT), answer),
        *line.exchange(pkw.read(UNIT), answer),
    ]
    assert decoder.feed_all(frames) == [
        SdoSeen(
            6, BUS, NODE, SdoAccess.READ, UNIT, Outcome.DONE, b"\3", None, None, Protocol.PKW, 2, Direction.TX
        ),
        ValueSeen(6, BUS, NODE, UNIT, b"\3", Source.SDO_READ),
    ]  # fmt: skip


def test_a_write_and_its_bytes(decoder: ProfibusDecoder) -> None:
    line, speed = Line(ours=False), parse_address("12/61")
    job, answer = pkw.write(speed, b"\x64\0\0\0"), PkwAnswer(ReplyKind.DOUBLE, speed, 100)
    records = decoder.feed_all([*line.exchange(job), *line.exchange(job, answer)])
    assert accesses(records) == [(speed, SdoAccess.WRITE, Outcome.DONE, b"\x64\0\0\0", None)]
    assert values(records) == [(speed, b"\x64\0\0\0", Source.SDO_WRITE)]
    assert [r.client for r in records if isinstance(r, SdoSeen)] == [Direction.RX]


@pytest.mark.parametrize("code", [0, 1, 2, 5, 18])
def test_a_refusal_also_by_code_0(decoder: ProfibusDecoder, code: int) -> None:
    line, job = Line(), pkw.write(LOCAL, b"\1")
    records = decoder.feed_all([*line.exchange(job), *line.exchange(job, PkwAnswer(ReplyKind.REFUSED, LOCAL, code))])
    assert accesses(records) == [(LOCAL, SdoAccess.WRITE, Outcome.ABORTED, None, code)]
    assert [r.aborted_by for r in records if isinstance(r, SdoSeen)] == [Side.SERVER]
    assert values(records) == []


def test_an_answer_that_stood_there_before_is_not_that_of_a_new_job(decoder: ProfibusDecoder) -> None:
    """0/41 is written 1, then read: what still shows is the answer of the write."""
    line, written = Line(), PkwAnswer(ReplyKind.BYTE, LOCAL, 1)
    job, again = pkw.write(LOCAL, b"\1"), pkw.read(LOCAL)
    decoder.feed_all([*line.exchange(job), *line.exchange(job, written)])
    assert accesses(decoder.feed_all([*line.exchange(again, written), *line.exchange(again, written)])) == []
    changed = decoder.feed_all(line.exchange(again, PkwAnswer(ReplyKind.BYTE, LOCAL, 0)))
    assert accesses(changed) == [(LOCAL, SdoAccess.READ, Outcome.DONE, b"\0", None)]


def test_with_nothing_between_two_jobs_each_has_its_answer(decoder: ProfibusDecoder) -> None:
    line, answer, job = Line(), PkwAnswer(ReplyKind.BYTE, LOCAL, 1), pkw.read(LOCAL)
    once = [*line.exchange(job), *line.exchange(job, answer), *line.exchange(pkw.IDLE, answer), *line.exchange()]
    twice = [*line.exchange(job), *line.exchange(job, answer)]
    assert len(accesses(decoder.feed_all([*once, *twice]))) == 2


def test_the_late_answer_of_a_job_is_not_given_to_the_next(decoder: ProfibusDecoder) -> None:
    line, job, again = Line(), pkw.write(LOCAL, b"\1"), pkw.read(LOCAL)
    late = PkwAnswer(ReplyKind.BYTE, LOCAL, 1)
    records = decoder.feed_all([*line.exchange(job), *line.exchange(again, late), *line.exchange(again, late)])
    assert accesses(records) == [(LOCAL, SdoAccess.WRITE, Outcome.DONE, b"\1", None)]


def test_a_job_that_is_given_up_is_lost(decoder: ProfibusDecoder) -> None:
    line = Line()
    records = decoder.feed_all([*line.exchange(pkw.write(LOCAL, b"\1")), *line.exchange()])
    assert accesses(records) == [(LOCAL, SdoAccess.WRITE, Outcome.LOST, None, None)]
    assert values(records) == []


def test_a_read_that_stands_tells_each_new_value(decoder: ProfibusDecoder) -> None:
    line, place, job = Line(), parse_address("12/100"), pkw.read(parse_address("12/100"))
    frames = line.exchange(job)
    for number in (5, 6, 6, 0xFFFFFFFF):
        frames += line.exchange(job, PkwAnswer(ReplyKind.DOUBLE, place, number))
    records = decoder.feed_all(frames)
    assert len(accesses(records)) == 1
    assert [int.from_bytes(data, "little", signed=True) for _, data, _ in values(records)] == [5, 6, -1]


@pytest.mark.parametrize(
    ("answer", "done"), [(PkwAnswer(ReplyKind.DOUBLE, STORE), True), (PkwAnswer(ReplyKind.REFUSED, STORE, 18), False)]
)
def test_saving(decoder: ProfibusDecoder, answer: PkwAnswer, done: bool) -> None:
    line, job = Line(), PkwRequest(AskKind.WRITE_DOUBLE, STORE, 0x73617665)
    records = decoder.feed_all([*line.exchange(job), *line.exchange(job, answer)])
    assert [(r.address, r.done) for r in records if isinstance(r, SaveSeen)] == [(STORE, done)]
    nothing = PkwRequest(AskKind.WRITE_DOUBLE, STORE, 0)
    assert not any(
        isinstance(r, SaveSeen) for r in decoder.feed_all([*line.exchange(nothing), *line.exchange(nothing, answer)])
    )


def test_what_is_no_pkw_is_told_and_no_value(decoder: ProfibusDecoder) -> None:
    line = Line()
    frames = line.served(DataExchange(bytes(14)), Inputs(b"\x51" + bytes(13)))
    (state, malformed) = decoder.feed_all(frames)
    assert isinstance(state, SlaveSeen)
    assert isinstance(malformed, MalformedAduSeen)
    assert (malformed.node, malformed.fault, malformed.offset) == (NODE, Fault.FIELD, 7)


# -- process data ----------------------------------------------------------------------


@pytest.mark.parametrize("order", [AS_PRINTED, AS_PKW])
def test_process_data_by_the_order_that_was_proven(decoder: ProfibusDecoder, order) -> None:  # type: ignore[no-untyped-def]
    line, kind = Line(telegram=2), TELEGRAM_TYPES[2]
    outputs = encode_pzd(kind.received, {CONTROL_WORD: 7, SETPOINT: 1000}, order)
    inputs = encode_pzd(kind.sent, {STATUS_WORD: 0x0F, ACTUAL: -2}, order)
    assert values(decoder.feed_all(line.served(DataExchange(outputs), Inputs(inputs)))) == [], "no order is known"
    decoder.set_order(NODE, order)
    assert values(decoder.feed_all(line.served(DataExchange(outputs), Inputs(inputs)))) == [
        (parse_address("0/37"), b"\7\0", Source.PDO_RX),
        (parse_address("12/21"), b"\xe8\3\0\0", Source.PDO_RX),
        (parse_address("0/38"), b"\x0f\0", Source.PDO_TX),
        (parse_address("12/100"), b"\xfe\xff\xff\xff", Source.PDO_TX),
    ]


def test_every_telegram_is_told_by_its_lengths(decoder: ProfibusDecoder) -> None:
    decoder.set_order(NODE, AS_PKW)
    seen = {}
    for number, kind in TELEGRAM_TYPES.items():
        line = Line(telegram=number)
        frames = line.served(DataExchange(bytes(kind.output_size)), Inputs(bytes(kind.input_size)))
        seen[number] = len(values(decoder.feed_all(frames)))
    assert seen == {1: 4, 2: 4, 100: 9, 101: 6, 102: 9, 103: 6}


def test_a_slave_without_a_description_tells_no_value() -> None:
    decoder, line = ProfibusDecoder(BUS), Line()
    records = decoder.feed_all([*line.exchange(), *line.exchange(pkw.read(UNIT), PkwAnswer(ReplyKind.BYTE, UNIT, 1))])
    assert [type(record) for record in records] == [SlaveSeen]


def test_bytes_of_others_are_no_pkw(decoder: ProfibusDecoder) -> None:
    line = Line()
    assert values(decoder.feed_all(line.served(DataExchange(bytes(9)), Inputs(bytes(9))))) == []


# -- slaves ------------------------------------------------------------------------------


def test_a_slave_from_the_first_probe_to_its_loss_and_back(decoder: ProfibusDecoder) -> None:
    line, waiting = Line(), Diagnosis(Status.PARAMETERS_REQUIRED | Status.ALWAYS, NO_MASTER, 0x0474)
    frames = [
        *line.served(FdlStatus(), dp.StatusAnswer(Station.SLAVE)),
        *line.served(SlaveDiag(), dp.DiagnosisAnswer(waiting)),
        *line.served(SetPrm(0x0474), dp.Done()),
        *line.exchange(),
        *line.exchange(),
        *(line.ask(DataExchange(bytes(14))) for _ in range(LOST_AFTER + 3)),
        *line.served(DataExchange(bytes(14)), Refused(Reply.NO_SERVICE)),
    ]
    records = decoder.feed_all(frames)
    assert states(records) == [
        SlaveState.PRESENT, SlaveState.WAITING, SlaveState.EXCHANGING, SlaveState.ABSENT, SlaveState.WAITING,
    ]  # fmt: skip
    assert decoder.state(NODE) is SlaveState.WAITING
    (diagnosis,) = [record for record in records if isinstance(record, DiagnosisSeen)]
    assert (diagnosis.node, diagnosis.master, diagnosis.ident) == (NODE, NO_MASTER, 0x0474)


def test_stations_that_never_answered_are_not_lost(decoder: ProfibusDecoder) -> None:
    """A master asks every free address again and again."""
    line = Line(node=40)
    assert decoder.feed_all([line.ask(FdlStatus()) for _ in range(20)]) == []


def test_an_answer_in_between_is_no_loss(decoder: ProfibusDecoder) -> None:
    line, records = Line(), []
    for _ in range(6):
        records += decoder.feed_all([line.ask(DataExchange(bytes(14))) for _ in range(LOST_AFTER - 1)])
        records += decoder.feed_all(line.exchange())
    assert states(records) == [SlaveState.EXCHANGING]


def test_a_job_of_a_slave_that_goes_is_lost(decoder: ProfibusDecoder) -> None:
    line, job = Line(), pkw.write(LOCAL, b"\1")
    decoder.feed_all(line.exchange(job))
    records = decoder.feed_all([line.ask(DataExchange(job.encode() + bytes(6))) for _ in range(LOST_AFTER + 1)])
    assert [outcome for _, _, outcome, _, _ in accesses(records)] == [Outcome.LOST]


def test_the_master_that_leaves_unlocks(decoder: ProfibusDecoder) -> None:
    line = Line()
    frames = [*line.exchange(), *line.served(SetPrm(0x0474, lock=False, unlock=True), dp.Done())]
    assert states(decoder.feed_all(frames)) == [SlaveState.EXCHANGING, SlaveState.WAITING]


def test_two_masters_and_a_token(decoder: ProfibusDecoder) -> None:
    ours, other = Line(), Line(master=2, ours=False, node=9)
    decoder.set_description(9, ED2)
    job, answer = pkw.read(UNIT), PkwAnswer(ReplyKind.BYTE, UNIT, 2)
    records: list[Record] = []
    for shown in (IDLE_ANSWER, answer):
        records += decoder.feed_all([*ours.exchange(job, shown), ours.frame(Token(2, 1).encode())])
        records += decoder.feed_all([*other.exchange(job, shown), other.frame(Token(1, 2).encode())])
    assert [(r.node, r.client) for r in records if isinstance(r, SdoSeen)] == [(NODE, Direction.TX), (9, Direction.RX)]


def test_an_answer_nobody_asked_for(decoder: ProfibusDecoder) -> None:
    line = Line()
    frames = [line.answer(DataExchange(), Inputs(bytes(14))), line.frame(b"\xe5")]
    assert [(type(r), r.node) for r in decoder.feed_all(frames)] == [(OrphanSeen, NODE), (OrphanSeen, 0)]


def test_a_damaged_answer_is_told_and_changes_nothing(decoder: ProfibusDecoder) -> None:
    line, job, answer = Line(), pkw.read(UNIT), PkwAnswer(ReplyKind.BYTE, UNIT, 2)
    decoder.feed_all(line.exchange(job))
    asked, good = line.exchange(job, answer)
    assert isinstance(good.payload, Fdl)
    raw = bytearray(good.payload.data)
    raw[14] ^= 1
    (record,) = decoder.feed_all([asked, good._replace(payload=Fdl(bytes(raw)))])
    assert isinstance(record, MalformedAduSeen)
    assert (record.node, record.fault, record.offset) == (NODE, Fault.CHECKSUM, len(raw) - 2)
    assert len(accesses(decoder.feed_all(line.exchange(job, answer)))) == 1


def test_a_gap_gives_up_what_is_open(decoder: ProfibusDecoder) -> None:
    line = Line()
    decoder.feed_all(line.exchange(pkw.read(UNIT)))
    records = list(decoder.gap(99, "gap.lost"))
    assert [outcome for _, _, outcome, _, _ in accesses(records)] == [Outcome.LOST]
    assert records[-1] == GapSeen(99, BUS, 0, "gap.lost")


def test_frames_of_others_say_nothing(decoder: ProfibusDecoder) -> None:
    assert decoder.feed(Frame(1, "dp1", Direction.RX, Fdl(b"\0"))) == ()
    assert decoder.feed(Frame(1, BUS, Direction.RX, Can(1))) == ()


def test_a_bus_finds_its_decoder(decoder: ProfibusDecoder) -> None:
    kept = decoder.snapshot()
    found = (decoder_of(BUS, {NODE: ED2}), decoder_of_state(BUS, kept), decoder_of_frame(Line().frame(b"")))
    assert [type(one) for one in found] == [ProfibusDecoder] * 3
    assert values(list(found[0].feed_all(Line().exchange()))) == []


# -- keyframes, and anything at all ------------------------------------------------------


@given(st.data())
def test_going_on_from_a_kept_state_is_going_on(data: st.DataObject) -> None:
    line, jobs = Line(), [pkw.read(UNIT), pkw.write(LOCAL, b"\1"), pkw.IDLE]
    shown = [IDLE_ANSWER, PkwAnswer(ReplyKind.BYTE, UNIT, 2), PkwAnswer(ReplyKind.BYTE, LOCAL, 1)]
    frames: list[Frame] = []
    for job, answer in data.draw(st.lists(st.tuples(st.sampled_from(jobs), st.sampled_from(shown)), max_size=8)):
        frames += line.exchange(job, answer)
    cut = data.draw(st.integers(0, len(frames)))
    whole, first, second = (ProfibusDecoder(BUS, {NODE: ED2}) for _ in range(3))
    expected = whole.feed_all(frames)
    records = first.feed_all(frames[:cut])
    second.restore(json.loads(json.dumps(first.snapshot())))
    assert records + second.feed_all(frames[cut:]) == expected
    assert second.snapshot() == whole.snapshot()


@given(st.lists(st.binary(max_size=40) | TELEGRAMS.map(lambda one: one.encode()), max_size=12))
def test_any_bytes_give_records_that_the_live_state_takes(chunks: list[bytes]) -> None:
    decoder, live = ProfibusDecoder(BUS, dict.fromkeys((1, 6, 8), ED2)), LiveState()
    for t_ns, data in enumerate(chunks, 1):
        live.apply_all(decoder.feed(Frame(t_ns, BUS, Direction.RX, Fdl(data))))
    json.dumps(decoder.snapshot())


@given(st.lists(st.tuples(st.binary(min_size=14, max_size=14), st.binary(min_size=14, max_size=14)), max_size=12))
def test_any_exchange(pairs: list[tuple[bytes, bytes]]) -> None:
    decoder, line, live = ProfibusDecoder(BUS, {NODE: ED2}), Line(), LiveState()
    decoder.set_order(NODE, AS_PRINTED)
    for outputs, inputs in pairs:
        live.apply_all(decoder.feed_all(line.served(DataExchange(outputs), Inputs(inputs))))
