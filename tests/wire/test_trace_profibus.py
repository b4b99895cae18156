"""The trace of a PROFIBUS line: what each telegram means, whichever part of the traffic one begins to read."""

from __future__ import annotations

import random

import pytest

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.wire.busload import BusLoad
from app.wire.frame import Direction, Fdl, Frame
from app.wire.profibus import dp, pkw
from app.wire.profibus.configuration import Length, Module
from app.wire.profibus.control import Reply
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.profibus.diagnosis import Diagnosis, Status
from app.wire.profibus.dp import DataExchange, Inputs, Refused
from app.wire.profibus.fdl import Token, wire_bits
from app.wire.profibus.owners import Owners
from app.wire.profibus.pkw import PkwAnswer, PkwRequest, ReplyKind
from app.wire.profibus.pzd import AS_PKW, encode_pzd
from app.wire.profibus.telegrams import ACTUAL, CONTROL_WORD, SETPOINT, STATUS_WORD, TELEGRAM_TYPES
from app.wire.records import SdoSeen, ValueSeen
from app.wire.trace import fdl_packing
from app.wire.trace.profibus_tracer import ProfibusTracer
from app.wire.trace.ring import FrameRing
from app.wire.trace.service import Service
from app.wire.trace.tracer import Gap, Item, Step, Tone, TraceRow
from tests.recording.make_ed2 import SAMPLE
from tests.recording.rig import frames_of
from tests.wire.profibus.test_decoder import BUS, ED2, IDLE_ANSWER, MASTER, NODE, Line

SPEED, STATUS, POSITION = parse_address("12/61"), parse_address("0/38"), parse_address("12/100")
STATION = Diagnosis(Status.NOT_READY | Status.PARAMETERS_REQUIRED | Status.ALWAYS, 255, 0x0ED2)


def traced(frames: list[Frame]) -> list[TraceRow]:
    return list(ProfibusTracer(BUS, {NODE: ED2}).rows(frames))


def exchanged(
    line: Line, job: PkwRequest = pkw.IDLE, shown: PkwAnswer = IDLE_ANSWER, status: int = 0x0837, actual: int = 70_000
) -> list[Frame]:
    received = encode_pzd(line.telegram.received, {CONTROL_WORD: 0x0007, SETPOINT: 300_000}, AS_PKW)
    given = encode_pzd(line.telegram.sent, {STATUS_WORD: status, ACTUAL: actual}, AS_PKW)
    return line.served(DataExchange(job.encode() + received), Inputs(shown.encode() + given))


def proven(line: Line) -> list[Frame]:
    """What a master reads that proves the order."""
    return [
        *exchanged(line),
        *exchanged(line, pkw.read(STATUS), PkwAnswer(ReplyKind.WORD, STATUS, 0x0837)),
        *exchanged(line),
        *exchanged(line, pkw.read(POSITION), PkwAnswer(ReplyKind.DOUBLE, POSITION, 70_000)),
        *exchanged(line),
    ]


def test_each_service_is_told_with_its_ends() -> None:
    line = Line()
    modules = (Module(Length(14), Length(14), special=True),)
    frames = [
        *line.served(dp.FdlStatus(), dp.StatusAnswer(dp.Station.SLAVE)),
        *line.served(dp.SlaveDiag(), dp.DiagnosisAnswer(STATION)),
        *line.served(dp.SetPrm(0x0ED2, watchdog=(10, 10)), dp.Done()),
        *line.served(dp.ChkCfg(modules), dp.Done()),
        line.ask(dp.GlobalControl(dp.Command.CLEAR)),
        line.frame(Token(MASTER, 3).encode()),
    ]
    rows = traced(frames)
    assert [row.step for row in rows] == [
        *(2 * [Step.FDL_STATUS]), *(2 * [Step.SLAVE_DIAG]), *(2 * [Step.SET_PRM]), *(2 * [Step.CHK_CFG]),
        Step.GLOBAL_CONTROL, Step.TOKEN,
    ]  # fmt: skip
    ends = [(row.fdl.source, row.fdl.destination) for row in rows if row.fdl is not None]
    assert ends[:8] == 4 * [(MASTER, NODE), (NODE, MASTER)], "SC has the ends of what it answers"
    assert ends[8:] == [(MASTER, NODE), (3, MASTER)]
    assert [row.speaker.service for row in rows[:2]] == [Service.FDL_REQUEST, Service.FDL_RESPONSE]
    assert rows[-1].speaker.service is Service.FDL_TOKEN
    assert rows[2].fdl is not None
    assert (rows[2].fdl.dsap, rows[2].fdl.ssap) == (60, 62)


def test_process_data_are_told_by_name_once_their_order_is_proven() -> None:
    line = Line()
    rows = traced([*exchanged(line), *proven(line), *exchanged(line, actual=70_001)])
    assert rows[1].fdl is not None
    assert rows[1].fdl.signals == ()
    assert rows[1].fdl.process_data == bytes.fromhex("083700011170")
    last = rows[-1]
    assert last.fdl is not None
    assert dict(last.fdl.signals) == {STATUS_WORD: 0x0837, ACTUAL: 70_001}


def test_a_job_is_told_where_it_is_new_and_where_it_ends() -> None:
    line, write, taken = Line(), pkw.write(SPEED, b"\x64\0\0\0"), PkwAnswer(ReplyKind.DOUBLE, SPEED, 100)
    rows = traced(
        [*exchanged(line), *exchanged(line, write), *exchanged(line, write, taken), *exchanged(line, write, taken)]
    )
    told = [(row.address, row.value) for row in rows]
    assert (
        told
        == [(None, None)] * 2
        + [(SPEED, b"\x64\0\0\0"), (None, None)]
        + [(None, None), (SPEED, b"\x64\0\0\0")]
        + [(None, None)] * 2
    )
    assert [row.speaker.service for row in rows[-2:]] == [Service.FDL_SAME, Service.FDL_SAME]


@pytest.mark.parametrize("code", [0, 2, 18])
def test_a_refused_job_is_an_error_once(code: int) -> None:
    line, write = Line(), pkw.write(SPEED, b"\x64\0\0\0")
    refusal = PkwAnswer(ReplyKind.REFUSED, SPEED, code)
    rows = traced([*exchanged(line), *exchanged(line, write, refusal), *exchanged(line, write, refusal)])
    assert [row.tone for row in rows] == 3 * [Tone.PLAIN] + [Tone.ERROR] + 2 * [Tone.PLAIN]
    assert rows[3].fdl is not None
    assert rows[3].fdl.pkw == refusal


def test_an_exchange_that_brings_nothing_new_has_a_service_of_its_own() -> None:
    line = Line()
    frames = [*exchanged(line), *exchanged(line), *exchanged(line, actual=70_001), *exchanged(line, actual=70_001)]
    services = [row.speaker.service for row in traced(frames)]
    assert services == [
        Service.FDL_REQUEST, Service.FDL_RESPONSE, Service.FDL_SAME, Service.FDL_SAME,
        Service.FDL_SAME, Service.FDL_RESPONSE, Service.FDL_SAME, Service.FDL_SAME,
    ]  # fmt: skip
    waiting = traced([*frames, *line.served(DataExchange(bytes(14)), Inputs(bytes(14), diagnosis=True))])
    assert waiting[-1].speaker.service is Service.FDL_RESPONSE, "a diagnosis waits: that is new"


def test_a_refusal_and_what_makes_no_sense_stand_out() -> None:
    line = Line()
    asked = DataExchange(bytes(14))
    rows = traced([*line.served(asked, Refused(Reply.NO_SERVICE)), line.frame(b"\x68\x05\x05\x68\x00")])
    assert rows[1].tone is Tone.WARNING
    assert (rows[2].speaker.service, rows[2].step, rows[2].tone) == (Service.UNKNOWN, Step.UNKNOWN, Tone.ERROR)


def test_of_an_unknown_device_the_bytes_are_told() -> None:
    line = Line()
    rows = list(ProfibusTracer(BUS, {}).rows(exchanged(line)))
    assert [row.step for row in rows] == [Step.DATA_EXCHANGE, Step.DATA_EXCHANGE]
    assert rows[1].fdl is not None
    assert len(rows[1].fdl.process_data) == 14


def test_a_trace_from_the_middle_says_what_one_from_the_beginning_says() -> None:
    frames = frames_of(SAMPLE)
    description = {6: load_builtin("wandfluh-ed2")}
    items: list[Item] = list(frames)
    items.insert(700, Gap(frames[700].t_ns - 1, "dp0", "gap.bus_lost"))
    decoder = ProfibusDecoder("dp0", description)
    ring = FrameRing("dp0", decoder.snapshot, chunk=64)
    for item in items:
        ring.extend((item,))
        if isinstance(item, Gap):
            decoder.gap(item.t_ns, item.reason)
        else:
            decoder.feed(item)
    whole = list(ProfibusTracer("dp0", description).rows(items))
    chance = random.Random(5)
    for chunk in chance.sample(ring.chunks(), 12):
        tracer = ProfibusTracer("dp0", description, snapshot=chunk.snapshot)
        rows = list(tracer.rows(chunk.items()))
        assert rows == whole[chunk.first : chunk.first + chunk.count]


def test_the_records_of_the_rows_are_those_of_the_decoder() -> None:
    frames = frames_of(SAMPLE)
    description = {6: load_builtin("wandfluh-ed2")}
    wanted = ProfibusDecoder("dp0", description).feed_all(frames)
    rows = list(ProfibusTracer("dp0", description).rows(frames))
    assert [record for row in rows for record in row.records] == wanted
    assert sum(isinstance(one, SdoSeen) for one in wanted) > 100
    for row in rows:
        told = {one.address: one.data for one in row.records if isinstance(one, ValueSeen)}
        signals = () if row.fdl is None else row.fdl.signals
        for signal, value in signals:
            if signal.address in told:
                size = len(told[signal.address])
                assert value.to_bytes(size, "little", signed=signal.signed) == told[signal.address], row


def test_packed_telegrams_come_back() -> None:
    frames = frames_of(SAMPLE)
    assert list(fdl_packing.unpack(fdl_packing.pack(frames), "dp0")) == frames
    skipped = [Frame(5, BUS, Direction.RX, Fdl(bytes(256))), Frame(6, BUS, Direction.RX, Fdl(b"\xe5"))]
    assert list(fdl_packing.unpack(fdl_packing.pack(skipped), BUS)) == skipped


def test_the_load_of_a_line_is_shared_by_its_stations() -> None:
    first, second = Line(), Line(node=9)
    frames = [
        *exchanged(first),
        *second.served(dp.SetPrm(1), dp.Done()),
        first.ask(dp.GlobalControl()),
        first.frame(Token(MASTER, 3).encode()),
    ]
    owners, load = Owners(), BusLoad(500_000)
    found = []
    for frame in frames:
        assert isinstance(frame.payload, Fdl)
        found.append(owners.of(frame.payload.data))
        load.feed(1_000, wire_bits(len(frame.payload.data)), found[-1])
    assert found == [NODE, NODE, 9, 9, NODE, 0]
    size = sum(len(frame.payload.data) for frame in frames)
    assert load.load(1_000_000_000) == pytest.approx(11 * size / 500_000)
    assert TELEGRAM_TYPES[1].input_size == 14
