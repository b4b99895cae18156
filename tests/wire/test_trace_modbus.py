"""The trace of a bus of Modbus TCP: what each ADU means, whichever part of the traffic one begins to read."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address
from app.wire.decoders import decoder_of
from app.wire.frame import Adu, Can, Direction, Frame
from app.wire.modbus.answers import (
    AbortAnswer,
    ExceptionAnswer,
    FramesRead,
    ObjectRead,
    ObjectWritten,
    RegistersRead,
)
from app.wire.modbus.frames import ObjectFrame
from app.wire.modbus.functions import Function, Phase
from app.wire.modbus.requests import (
    ReadDictionary,
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    WriteObject,
    WriteRegister,
)
from app.wire.records import MalformedAduSeen, OrphanSeen, RestartSeen
from app.wire.trace import adu_packing, can_packing
from app.wire.trace.filter import TraceFilter
from app.wire.trace.modbus_tracer import ModbusTracer
from app.wire.trace.ring import FrameRing
from app.wire.trace.service import Service
from app.wire.trace.tracer import Gap, Item, Step, Tone, TraceRow
from tests.recording.make_pd4e import BUS as SAMPLE_BUS
from tests.recording.make_pd4e import SAMPLE, SERVER
from tests.recording.rig import frames_of
from tests.wire.modbus.traffic import BUS, NODE, OTHER, Client
from tests.wire.modbus.traffic import SERVER as DEVICE

STATUSWORD, WINDOW = Address(0x6041), Address(0x6065)
SERVERS = {NODE: DEVICE}
LATER_NS = 10_000_000_000


def rows_of(frames: list[Frame]) -> list[TraceRow]:
    return list(ModbusTracer(BUS, SERVERS).rows(frames))


def test_an_object_is_named_in_request_and_answer() -> None:
    client = Client()
    read = client.exchange(ReadObject(STATUSWORD, 2), ObjectRead(STATUSWORD, b"\x37\x16"))
    write = client.exchange(WriteObject(WINDOW, b"\1\0\0\0"), ObjectWritten(WINDOW))
    rows = rows_of([*read, *write])
    assert [(row.step, row.address, row.value) for row in rows] == [
        (Step.READ, STATUSWORD, None),
        (Step.READ_ANSWER, STATUSWORD, b"\x37\x16"),
        (Step.WRITE, WINDOW, b"\1\0\0\0"),
        (Step.WRITE_ANSWER, WINDOW, b"\1\0\0\0"),
    ]
    assert {(row.speaker.node, row.speaker.number) for row in rows} == {(NODE, Function.OBJECT)}
    services = [Service.MODBUS_REQUEST, Service.MODBUS_RESPONSE]
    assert [row.speaker.service for row in rows] == services * 2
    assert rows[1].took_ns == rows[1].t_ns - rows[0].t_ns
    assert {row.tone for row in rows} == {Tone.PLAIN}


def test_registers_and_the_dictionary_say_what_they_carry() -> None:
    client = Client()
    both = client.exchange(
        ReadWriteRegisters(5000, 2, 6000, (6,)), RegistersRead((1, 2), Function.READ_WRITE_REGISTERS)
    )
    one = client.exchange(WriteRegister(6000, 7), WriteRegister(6000, 7))
    frames = (ObjectFrame(STATUSWORD, b"\0\0"), ObjectFrame(WINDOW, b"\0\0\0\0"))
    rows = rows_of([*both, *one, *client.dictionary(frames)])
    steps = [Step.REGISTERS_BOTH, Step.REGISTERS_WRITE, Step.DICTIONARY]
    assert [row.step for row in rows] == [step for step in steps for _ in range(2)]
    assert (rows[0].read, rows[0].written) == ((5000, 2), (6000, 1))
    assert rows[2].written == (6000, 1)
    assert [record.address for record in rows[5].records[1:]] == [STATUSWORD, WINDOW]  # type: ignore[union-attr]


def test_refusals_are_red_and_say_why() -> None:
    client = Client()
    abort = client.exchange(ReadObject(Address(0x2FFF), 4), AbortAnswer(0x06020000))
    exception = client.exchange(ReadRegisters(9000, 1), ExceptionAnswer(Function.READ_HOLDING_REGISTERS, 2))
    rows = rows_of([*abort, *exception])
    assert [row.tone for row in rows] == [Tone.PLAIN, Tone.ERROR] * 2
    assert (rows[1].step, rows[1].abort_code, rows[1].address) == (Step.ABORT, 0x06020000, Address(0x2FFF))
    assert (rows[3].step, rows[3].exception) == (Step.EXCEPTION, 2)


def test_nonsense_late_answers_and_strangers_are_told() -> None:
    client = Client()
    late = client.answer(ObjectRead(STATUSWORD, b"\0\0"), transaction=99)
    broken = client.ask(b"\x2b\x0d\x00")
    stranger = Frame(LATER_NS, BUS, Direction.RX, Adu(b"\0\1\0\0\0\2\0\3", "10.9.9.9:1>10.9.9.8:502"))
    rows = rows_of([late, broken, stranger])
    assert isinstance(rows[0].records[0], OrphanSeen)
    assert (rows[1].step, type(rows[1].records[-1]), rows[1].tone) == (Step.UNKNOWN, MalformedAduSeen, Tone.ERROR)
    assert (rows[2].speaker.service, rows[2].speaker.node, rows[2].records) == (Service.UNKNOWN, 0, ())


def test_a_restart_is_told_where_it_shows() -> None:
    uptime = Address(0x230F)
    first = Client().exchange(ReadObject(uptime, 4), ObjectRead(uptime, b"\x64\0\0\0"))
    second = Client(OTHER, ours=False).at(LATER_NS).exchange(ReadObject(uptime, 4), ObjectRead(uptime, b"\1\0\0\0"))
    rows = rows_of([*first, *second])
    assert [isinstance(row.records[0], RestartSeen) for row in rows if row.records] == [False, True]


def test_wherever_one_begins_the_rows_are_the_same() -> None:
    """Of a recording: those of the ring's chunks, each from its own state, are those of reading from the beginning."""
    frames = frames_of(SAMPLE)
    decoder = decoder_of(SAMPLE_BUS, servers={1: SERVER})
    ring = FrameRing(SAMPLE_BUS, decoder.snapshot, limit=1 << 20, chunk=100)
    items: list[Item] = []
    for number, frame in enumerate(frames):
        item: Item = Gap(frame.t_ns - 1, SAMPLE_BUS, "gap.bus_lost") if number % 1000 == 999 else frame
        ring.extend((item,))
        items.append(item)
        if isinstance(item, Gap):
            decoder.gap(item.t_ns, item.reason)
        else:
            decoder.feed(item)
    tracer = ModbusTracer(SAMPLE_BUS, {1: SERVER})
    found: list[TraceRow] = []
    for chunk in ring.chunks():
        tracer.restart(chunk.snapshot)
        found += tracer.rows(chunk.items())
    assert found == list(ModbusTracer(SAMPLE_BUS, {1: SERVER}).rows(items))


adus = st.builds(Adu, st.binary(max_size=300), st.sampled_from(["a:1>b:2", "b:2>a:1", "[::1]:5>c:502", ""]))
cans = st.builds(Can, st.integers(0, 0x7FF), st.binary(max_size=8), *[st.booleans()] * 3, st.integers(-1, 15))
times = st.integers(0, 1 << 62)


@given(st.lists(st.builds(Frame, times, st.just(BUS), st.sampled_from(Direction), adus, st.none())))
def test_packed_adus_come_back(frames: list[Frame]) -> None:
    assert list(adu_packing.unpack(adu_packing.pack(frames), BUS)) == frames


@given(st.lists(st.builds(Frame, times, st.just(BUS), st.sampled_from(Direction), cans, st.none() | times)))
def test_packed_can_frames_come_back(frames: list[Frame]) -> None:
    assert list(can_packing.unpack(can_packing.pack(frames), BUS)) == frames


def test_a_filter_of_identifiers_is_one_of_can() -> None:
    (row,) = rows_of([Client().ask(ReadDictionary(Phase.START))])
    assert TraceFilter(nodes=frozenset({NODE})).passes_item(row.item, row.speaker)
    assert not TraceFilter(nodes=frozenset({NODE + 1})).passes_item(row.item, row.speaker)
    assert not TraceFilter(ids=((0, 0x7FF),)).passes_item(row.item, row.speaker)
    assert FramesRead(Phase.START, ()).function == row.speaker.number
