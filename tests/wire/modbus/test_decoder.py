"""The passive decoder: objects, registers, foreign masters, what has no answer, restarts, and anything at all."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import Address
from app.wire.events import EventKind, Severity, tell_fault
from app.wire.frame import Adu, Direction, Frame
from app.wire.live import LiveState
from app.wire.memory import StoredState
from app.wire.modbus.answers import (
    AbortAnswer,
    Answer,
    ArrayWritten,
    ExceptionAnswer,
    FramesRead,
    ObjectRead,
    ObjectWritten,
    RegistersRead,
    RegistersWritten,
)
from app.wire.modbus.decoder import ModbusDecoder
from app.wire.modbus.frames import ObjectFrame
from app.wire.modbus.functions import Function, Phase
from app.wire.modbus.image import RX_MAPPING, TX_MAPPING, WordOrder
from app.wire.modbus.requests import (
    ReadDictionary,
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    Request,
    WriteArray,
    WriteObject,
    WriteRegister,
    WriteRegisters,
)
from app.wire.modbus.transactions import LATE_NS, MAX_OPEN
from app.wire.records import (
    Fault,
    FaultSeen,
    GapSeen,
    LoadSeen,
    MalformedAduSeen,
    OrphanSeen,
    Outcome,
    Protocol,
    Record,
    RestartSeen,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    Side,
    Source,
    TransactionSeen,
    ValueSeen,
)
from tests.wire.modbus.strategies import ANSWERS, REQUESTS
from tests.wire.modbus.traffic import BUS, MS, NODE, OTHER, RX_ENTRIES, SERVER, TX_ENTRIES, US, Client, mapping_frames

STATUSWORD, CONTROLWORD, POSITION = Address(0x6041), Address(0x6040), Address(0x6064)
TARGET, UPTIME = Address(0x607A), Address(0x230F)
READ, READ_ANSWER = ReadObject(STATUSWORD, 2), ObjectRead(STATUSWORD, b"\x40\x06")


@pytest.fixture
def decoder() -> ModbusDecoder:
    return ModbusDecoder(BUS, {SERVER: NODE})


@pytest.fixture
def mapped(decoder: ModbusDecoder) -> ModbusDecoder:
    """A decoder that has seen the mapping of the device."""
    frames = Client().dictionary(mapping_frames(RX_MAPPING, RX_ENTRIES), mapping_frames(TX_MAPPING, TX_ENTRIES))
    decoder.feed_all(frames)
    assert decoder.image(NODE, sent_by_device=True) is not None
    return decoder


def values(records: list[Record]) -> list[tuple[Address, int, Source]]:
    return [(r.address, int.from_bytes(r.data, "little"), r.source) for r in records if isinstance(r, ValueSeen)]


def transfers(records: list[Record]) -> list[SdoSeen]:
    return [record for record in records if isinstance(record, SdoSeen)]


# -- objects ---------------------------------------------------------------------


def test_a_read(decoder: ModbusDecoder) -> None:
    records = decoder.feed_all(Client().exchange(READ, READ_ANSWER))
    assert records == [
        SdoSeen(
            2 * MS, BUS, NODE, SdoAccess.READ, STATUSWORD, Outcome.DONE, b"\x40\x06", None, None, Protocol.OBJECT, MS,
            Direction.TX,
        ),
        ValueSeen(2 * MS, BUS, NODE, STATUSWORD, b"\x40\x06", Source.SDO_READ),
    ]  # fmt: skip


def test_part_of_an_object_is_no_value(decoder: ModbusDecoder) -> None:
    name = Address(0x1008)
    records = decoder.feed_all(Client().exchange(ReadObject(name, 4, start=4), ObjectRead(name, b"PD4-", start=4)))
    assert [type(record) for record in records] == [SdoSeen]
    records = decoder.feed_all(Client().exchange(WriteObject(name, b"x", start=4), ObjectWritten(name, start=4)))
    assert [(seen.outcome, seen.data) for seen in transfers(records)] == [(Outcome.BROKEN, None)]
    assert values(records) == []


def test_a_text_may_be_shorter_than_what_was_asked_for(decoder: ModbusDecoder) -> None:
    name = Address(0x1008)
    records = decoder.feed_all(Client().exchange(ReadObject(name, 241), ObjectRead(name, b"PD4-E591L42-E-65-4")))
    assert [record.data for record in records if isinstance(record, ValueSeen)] == [b"PD4-E591L42-E-65-4"]


def test_a_write_by_a_foreign_master(decoder: ModbusDecoder) -> None:
    frames = Client(OTHER, ours=False).exchange(WriteObject(CONTROLWORD, b"\x80\x00"), ObjectWritten(CONTROLWORD))
    records = decoder.feed_all(frames)
    assert values(records) == [(CONTROLWORD, 0x80, Source.SDO_WRITE)]
    assert [seen.client for seen in transfers(records)] == [Direction.RX]


def test_the_plain_name_of_a_server_is_our_connection(decoder: ModbusDecoder) -> None:
    frames = [frame._replace(payload=Adu(frame.payload.data, SERVER)) for frame in Client().exchange(READ, READ_ANSWER)]
    assert values(decoder.feed_all(frames)) == [(STATUSWORD, 0x0640, Source.SDO_READ)]


@pytest.mark.parametrize(
    ("address", "data", "seen"), [(Address(0x1010, 5), b"save", SaveSeen), (Address(0x1011, 5), b"load", LoadSeen)]
)
def test_save_and_load(decoder: ModbusDecoder, address: Address, data: bytes, seen: type[SaveSeen | LoadSeen]) -> None:
    client, request = Client(), WriteObject(address, data)
    for answer, done in (
        (ObjectWritten(address), True),
        (AbortAnswer(0x08000022), False),
        (ExceptionAnswer(43, 4), False),
    ):
        records = decoder.feed_all(client.exchange(request, answer))
        assert [record.done for record in records if isinstance(record, seen)] == [done]
    records = decoder.feed_all([client.ask(request), client.ask(READ, transaction=client.transaction)])
    assert [record.done for record in records if isinstance(record, seen)] == [False]


def test_an_abort_names_its_object(decoder: ModbusDecoder) -> None:
    records = decoder.feed_all(Client().exchange(ReadObject(Address(0x6060), 2), AbortAnswer(0x06070012)))
    (seen,) = transfers(records)
    assert (seen.outcome, seen.abort_code, seen.aborted_by) == (Outcome.ABORTED, 0x06070012, Side.SERVER)
    assert len(records) == 1


def test_an_exception_names_its_function(decoder: ModbusDecoder) -> None:
    for exception in (1, 4):
        records = decoder.feed_all(Client().exchange(READ, ExceptionAnswer(43, exception)))
        assert records == [TransactionSeen(2 * MS, BUS, NODE, 43, Outcome.ABORTED, exception, None, MS, Direction.TX)]


def test_arrays(decoder: ModbusDecoder) -> None:
    frames = tuple(ObjectFrame(Address(0x2400, sub), bytes((sub,))) for sub in (1, 2))
    client, request = Client(), WriteArray(Phase.START, frames)
    records = decoder.feed_all(client.exchange(request, ArrayWritten(Phase.START)))
    assert values(records) == [(Address(0x2400, sub), sub, Source.SDO_WRITE) for sub in (1, 2)]
    assert {seen.protocol for seen in transfers(records)} == {Protocol.FRAMES}
    refused = decoder.feed_all(client.exchange(request, AbortAnswer(0x06010002)))
    assert [seen.abort_code for seen in refused if isinstance(seen, TransactionSeen)] == [0x06010002]
    assert [(seen.address.minor, seen.outcome) for seen in transfers(refused)] == [
        (1, Outcome.BROKEN),  # it may have been written before the other one was refused
        (2, Outcome.BROKEN),
    ]
    one = WriteArray(Phase.START, frames[:1])
    (seen,) = decoder.feed_all(client.exchange(one, AbortAnswer(0x06010002)))
    assert isinstance(seen, SdoSeen)
    assert (seen.outcome, seen.abort_code) == (Outcome.ABORTED, 0x06010002)


def test_the_whole_dictionary(decoder: ModbusDecoder) -> None:
    frames = [ObjectFrame(Address(0x2000 + number), bytes((number,))) for number in range(4)]
    client = Client()
    records = decoder.feed_all(client.dictionary(tuple(frames[:2]), tuple(frames[2:])))
    assert values(records) == [(frame.address, frame.data[0], Source.SDO_READ) for frame in frames]
    end = decoder.feed_all(client.exchange(ReadDictionary(Phase.CONTINUE), AbortAnswer(0x08000024)))
    assert end == [TransactionSeen(client.t_ns, BUS, NODE, 101, Outcome.ABORTED, None, 0x08000024, MS, Direction.TX)]


# -- registers ---------------------------------------------------------------------

CYCLE = ReadWriteRegisters(5000, 5, 6000, (0x000F, 0x0002))


def test_registers_mean_nothing_before_the_mapping_is_seen(decoder: ModbusDecoder) -> None:
    answer = RegistersRead((0x0637, 2, 0, 0, 7), Function.READ_WRITE_REGISTERS)
    records = decoder.feed_all(Client().exchange(CYCLE, answer))
    assert [type(record) for record in records] == [TransactionSeen]


def test_a_cycle_of_a_foreign_master(mapped: ModbusDecoder) -> None:
    answer = RegistersRead((0x0637, 2, 0, 0, 7), Function.READ_WRITE_REGISTERS)
    records = mapped.feed_all(Client(OTHER, ours=False).exchange(CYCLE, answer))
    assert values(records) == [
        (CONTROLWORD, 0x000F, Source.PDO_RX),
        (Address(0x6060), 2, Source.PDO_RX),
        (STATUSWORD, 0x0637, Source.PDO_TX),
        (Address(0x6061), 2, Source.PDO_TX),
        (POSITION, 0, Source.PDO_TX),
        (Address(0x6044), 7, Source.PDO_TX),
    ]


def test_what_was_refused_was_not_written(mapped: ModbusDecoder) -> None:
    records = mapped.feed_all(Client().exchange(WriteRegister(6000, 6), ExceptionAnswer(6, 2)))
    assert records == [TransactionSeen(records[0].t_ns, BUS, NODE, 6, Outcome.ABORTED, 2, None, MS, Direction.TX)]


@pytest.mark.parametrize(("exception", "unsure"), [(1, 0), (2, 0), (3, 2), (4, 2)])
def test_what_was_refused_half_way_is_unknown(mapped: ModbusDecoder, exception: int, unsure: int) -> None:
    records = mapped.feed_all(Client().exchange(CYCLE, ExceptionAnswer(23, exception)))
    assert [seen.outcome for seen in transfers(records)] == [Outcome.BROKEN] * unsure


def test_a_long_value_of_unknown_order_is_written_but_not_known(mapped: ModbusDecoder) -> None:
    write = WriteRegisters(6002, (5, 0))
    records = mapped.feed_all(Client().exchange(write, RegistersWritten(6002, 2)))
    assert values(records) == []
    assert [(seen.address, seen.outcome) for seen in transfers(records)] == [(TARGET, Outcome.BROKEN)]


def test_half_of_an_object_is_no_value(mapped: ModbusDecoder) -> None:
    records = mapped.feed_all(Client().exchange(WriteRegister(6002, 1), WriteRegister(6002, 1)))
    assert values(records) == []
    assert [(s.address, s.outcome, s.protocol) for s in transfers(records)] == [
        (TARGET, Outcome.BROKEN, Protocol.REGISTERS)
    ]


def test_a_change_of_the_mapping_is_followed(mapped: ModbusDecoder) -> None:
    client, sub0 = Client(), Address(RX_MAPPING, 0)
    write = (WriteRegisters(6000, (6,)), RegistersWritten(6000, 1))
    mapped.feed_all(client.exchange(WriteObject(sub0, b"\0"), ObjectWritten(sub0)))
    assert values(mapped.feed_all(client.exchange(*write))) == []
    entry = Address(RX_MAPPING, 1)
    mapped.feed_all(client.exchange(WriteObject(entry, b"\x10\x00\x42\x60"), ObjectWritten(entry)))
    mapped.feed_all(client.exchange(WriteObject(sub0, b"\1"), ObjectWritten(sub0)))
    assert values(mapped.feed_all(client.exchange(*write))) == [(Address(0x6042), 6, Source.PDO_RX)]
    mapped.feed_all([client.ask(WriteObject(sub0, b"\2")), client.ask(READ, transaction=client.transaction)])
    assert mapped.image(NODE, sent_by_device=False) is None  # nobody saw how that write ended


def test_the_order_of_words_is_learned_from_the_device(mapped: ModbusDecoder) -> None:
    client = Client().at(10_000 * MS)
    read, registers = ReadRegisters(5000, 5), RegistersRead((0x0637, 2, 0x0203, 0x0001, 7))
    assert POSITION not in [a for a, _, _ in values(mapped.feed_all(client.exchange(read, registers)))]
    position = ObjectRead(POSITION, (0x00010203).to_bytes(4, "little"))
    mapped.feed_all(client.exchange(ReadObject(POSITION, 4), position))
    assert (POSITION, 0x00010203, Source.PDO_TX) in values(mapped.feed_all(client.exchange(read, registers)))
    write = WriteRegisters(6002, (5, 0))
    assert values(mapped.feed_all(client.exchange(write, RegistersWritten(6002, 2)))) == [(TARGET, 5, Source.PDO_RX)]


def test_the_order_of_words_is_learned_from_what_the_device_takes_too(mapped: ModbusDecoder) -> None:
    client = Client().at(10_000 * MS)
    read, registers = ReadRegisters(6002, 2), RegistersRead((0x0203, 0x0001))
    target = ObjectRead(TARGET, (0x00010203).to_bytes(4, "little"))
    mapped.feed_all([*client.exchange(read, registers), *client.exchange(ReadObject(TARGET, 4), target)])
    image = mapped.image(NODE, sent_by_device=True)
    assert image is not None
    assert image.order is WordOrder.LOW_FIRST


def test_an_old_reading_shows_no_order(mapped: ModbusDecoder) -> None:
    client = Client().at(10_000 * MS)
    read, registers = ReadRegisters(5000, 5), RegistersRead((0x0637, 2, 0x0203, 0x0001, 7))
    mapped.feed_all(client.exchange(read, registers))
    client.at(12_000 * MS)
    position = ObjectRead(POSITION, (0x00010203).to_bytes(4, "little"))
    mapped.feed_all(client.exchange(ReadObject(POSITION, 4), position))
    assert POSITION not in [a for a, _, _ in values(mapped.feed_all(client.exchange(read, registers)))]


# -- which answer belongs to which request --------------------------------------------


def test_two_clients_with_the_same_transaction(decoder: ModbusDecoder) -> None:
    us, other = Client(), Client(OTHER, ours=False)
    second = ReadObject(CONTROLWORD, 2)
    frames = [
        us.ask(READ, 7),
        other.ask(second, 7),
        other.answer(ObjectRead(CONTROLWORD, b"\6\0"), 7),
        us.answer(READ_ANSWER, 7),
    ]
    records = decoder.feed_all(frames)
    assert values(records) == [(CONTROLWORD, 6, Source.SDO_READ), (STATUSWORD, 0x0640, Source.SDO_READ)]
    assert [seen.client for seen in transfers(records)] == [Direction.RX, Direction.TX]


def test_pipelined_requests(decoder: ModbusDecoder) -> None:
    client = Client(OTHER, ours=False)
    asked = [client.ask(ReadObject(Address(0x2000 + number), 1), number) for number in range(8)]
    answered = [client.answer(ObjectRead(Address(0x2000 + number), bytes((number,))), number) for number in range(8)]
    records = decoder.feed_all([*asked, *answered])
    assert [value for _, value, _ in values(records)] == list(range(8))


@pytest.mark.parametrize(
    ("answer", "transaction", "unit"),
    [
        (READ_ANSWER, 2, 0),
        (READ_ANSWER, 1, 1),
        (ObjectRead(CONTROLWORD, b"\6\0"), 1, 0),
        (RegistersRead((1,)), 1, 0),
    ],
)
def test_what_answers_nothing_is_an_orphan(decoder: ModbusDecoder, answer: Answer, transaction: int, unit: int) -> None:
    client = Client()
    decoder.feed(client.ask(READ, 1))
    (orphan,) = decoder.feed(client.answer(answer, transaction, unit))
    assert isinstance(orphan, OrphanSeen)
    assert orphan.address == (answer.address if isinstance(answer, ObjectRead) else None)
    assert values(list(decoder.feed(client.answer(READ_ANSWER, 1)))) == [(STATUSWORD, 0x0640, Source.SDO_READ)]
    assert isinstance(decoder.feed(client.answer(READ_ANSWER, 1))[0], OrphanSeen)  # it was answered already


WRITE = WriteObject(CONTROLWORD, b"\6\0")


def test_a_transaction_used_again_ends_the_one_before(decoder: ModbusDecoder) -> None:
    client = Client()
    records = decoder.feed_all([client.ask(WRITE, 1), client.ask(READ, 1)])
    assert [(seen.address, seen.outcome) for seen in transfers(records)] == [(CONTROLWORD, Outcome.LOST)]


def test_too_many_and_too_old_requests_are_lost(decoder: ModbusDecoder) -> None:
    client = Client()
    records = decoder.feed_all(client.ask(WRITE) for _ in range(MAX_OPEN + 2))
    assert [seen.outcome for seen in transfers(records)] == [Outcome.LOST] * 2
    late = decoder.feed(client.at(LATE_NS + 60 * MS).ask(WRITE))
    assert len(transfers(list(late))) == MAX_OPEN


def test_a_new_connection_of_ours_ends_what_was_open(decoder: ModbusDecoder) -> None:
    foreign = Client(OTHER, ours=False)
    decoder.feed(foreign.ask(WRITE))
    decoder.feed(Client().ask(WRITE))
    records = list(decoder.feed(Client("10.0.0.1:40001").ask(READ)))
    assert [(seen.outcome, seen.client) for seen in transfers(records)] == [(Outcome.LOST, Direction.TX)]
    assert values(list(decoder.feed(foreign.answer(ObjectWritten(CONTROLWORD))))) == [
        (CONTROLWORD, 6, Source.SDO_WRITE)
    ]


def test_lost_registers_make_their_objects_unknown(mapped: ModbusDecoder) -> None:
    client = Client()
    records = mapped.feed_all([client.ask(CYCLE, 1), client.ask(READ, 1)])
    assert [(seen.address, seen.outcome) for seen in transfers(records)] == [
        (CONTROLWORD, Outcome.LOST),
        (Address(0x6060), Outcome.LOST),
    ]
    live = LiveState()
    live.apply(ValueSeen(0, BUS, NODE, CONTROLWORD, b"\6\0", Source.SDO_READ))
    live.apply_all(records)
    view = live.value(BUS, NODE, CONTROLWORD)
    assert view is not None
    assert view.reading is None


def test_a_gap_ends_all_and_forgets_the_mapping(mapped: ModbusDecoder) -> None:
    mapped.feed(Client().ask(WRITE))
    records = list(mapped.gap(9 * MS, "gap.frames_lost"))
    assert [seen.outcome for seen in transfers(records)] == [Outcome.LOST]
    assert records[-1] == GapSeen(9 * MS, BUS, 0, "gap.frames_lost")
    assert mapped.image(NODE, sent_by_device=True) is None


# -- restarts ------------------------------------------------------------------------

BOOT = WriteObject(Address(0x2800, 1), b"boot")


def test_a_device_that_was_told_to_restart_is_back_on_a_new_connection(mapped: ModbusDecoder) -> None:
    first, second = Client(), Client("10.0.0.1:40001")
    assert not [r for r in mapped.feed_all(first.exchange(BOOT, ObjectWritten(BOOT.address))) if type(r) is RestartSeen]
    assert not [r for r in mapped.feed_all(first.exchange(READ, READ_ANSWER)) if type(r) is RestartSeen]
    records = mapped.feed_all(second.at(5000 * MS).exchange(READ, READ_ANSWER))
    assert [type(record) for record in records] == [RestartSeen, SdoSeen, ValueSeen]
    assert mapped.image(NODE, sent_by_device=True) is None
    assert not [
        r for r in mapped.feed_all(Client(OTHER, ours=False).exchange(READ, READ_ANSWER)) if type(r) is RestartSeen
    ]


def test_an_answer_to_a_client_that_was_there_before_shows_no_restart(mapped: ModbusDecoder) -> None:
    """It is answered on its old connection until the device really goes."""
    earlier, client, later = Client(OTHER, ours=False), Client(), Client("10.0.0.9:41001", ours=False)
    mapped.feed_all(earlier.exchange(READ, READ_ANSWER))
    mapped.feed_all(client.exchange(BOOT, ObjectWritten(BOOT.address)))
    assert RestartSeen not in {type(record) for record in mapped.feed_all(earlier.exchange(READ, READ_ANSWER))}
    assert mapped.image(NODE, sent_by_device=True) is not None
    restored = ModbusDecoder(BUS, {SERVER: NODE})
    restored.restore(json.loads(json.dumps(mapped.snapshot())))
    for decoder in (mapped, restored):
        assert RestartSeen not in {type(record) for record in decoder.feed_all(earlier.exchange(READ, READ_ANSWER))}
        assert RestartSeen in {type(record) for record in decoder.feed_all(later.exchange(READ, READ_ANSWER))}


def test_of_very_many_clients_the_earliest_are_forgotten(mapped: ModbusDecoder) -> None:
    for number in range(2000):
        mapped.feed_all(Client(f"10.0.0.9:{number}", ours=False).exchange(READ, READ_ANSWER))
    assert len(mapped.snapshot()["devices"][str(NODE)]["clients"]) == 1024


def test_a_mapping_that_was_written_in_part_is_not_known(mapped: ModbusDecoder) -> None:
    entry = WriteObject(Address(0x3602, 1), b"\x64\x60", start=2)
    assert mapped.image(NODE, sent_by_device=True) is not None
    records = mapped.feed_all(Client().exchange(entry, ObjectWritten(entry.address, start=2)))
    assert [(seen.address, seen.outcome) for seen in transfers(records)] == [(entry.address, Outcome.BROKEN)]
    assert mapped.image(NODE, sent_by_device=True) is None


def test_a_refused_restart_is_none(mapped: ModbusDecoder) -> None:
    mapped.feed_all(Client().exchange(BOOT, AbortAnswer(0x08000022)))
    records = mapped.feed_all(Client(OTHER, ours=False).exchange(READ, READ_ANSWER))
    assert RestartSeen not in {type(record) for record in records}


@pytest.mark.parametrize(("uptime_s", "restarted"), [(160, False), (158, False), (157, True), (3, True), (500, False)])
def test_an_uptime_that_falls_behind_shows_a_restart(decoder: ModbusDecoder, uptime_s: int, restarted: bool) -> None:
    client = Client()
    decoder.feed_all(client.exchange(ReadObject(UPTIME, 4), ObjectRead(UPTIME, (100).to_bytes(4, "little"))))
    answer = ObjectRead(UPTIME, uptime_s.to_bytes(4, "little"))
    records = decoder.feed_all(client.at(60_000 * MS).exchange(ReadObject(UPTIME, 4), answer))
    assert (RestartSeen in {type(record) for record in records}) is restarted


# -- faults ----------------------------------------------------------------------------


def faults(decoder: ModbusDecoder, client: Client, address: int, number: int) -> list[tuple[bool | None, int, bool]]:
    """What the value of an object tells of a fault."""
    answer = ObjectRead(Address(address), number.to_bytes(2, "little"))
    records = decoder.feed_all(client.exchange(ReadObject(Address(address), 2), answer))
    return [(one.fault, one.code, one.over) for one in records if isinstance(one, FaultSeen)]


FINE, FAULT, REACTION = 0x0627, 0x0608, 0x060F


def test_a_fault_its_reason_and_its_end_are_told_once_each(decoder: ModbusDecoder) -> None:
    client = Client()
    steps = [
        (0x6041, FINE, []), (0x603F, 0, []),
        (0x6041, REACTION, [(True, 0, False)]), (0x6041, FAULT, []),
        (0x603F, 0x8611, [(True, 0x8611, False)]), (0x603F, 0x8611, []), (0x6041, FAULT, []),
        (0x603F, 0x7121, [(True, 0x7121, False)]),
        (0x6041, FINE, []), (0x603F, 0, [(False, 0, True)]), (0x603F, 0, []),
        (0x6041, FAULT, [(True, 0, False)]), (0x6041, FINE, [(False, 0, True)]),
    ]  # fmt: skip
    for number, (address, value, told) in enumerate(steps):
        assert faults(decoder, client, address, value) == told, number


def test_a_fault_that_stood_before_is_told_when_it_is_first_seen_and_a_warning_is_none(decoder: ModbusDecoder) -> None:
    client = Client()
    assert faults(decoder, client, 0x603F, 0x8611) == [(None, 0x8611, False)]
    assert faults(decoder, client, 0x6041, FAULT) == [], "it is the same one"
    restored = ModbusDecoder(BUS, {SERVER: NODE})
    restored.restore(json.loads(json.dumps(decoder.snapshot())))
    for one in (decoder, restored):
        assert faults(one, client, 0x6041, FAULT) == []
    decoder.gap(client.t_ns, "gap.bus_lost")
    assert faults(decoder, client, 0x6041, FAULT) == [(True, 0, False)], "nobody knows what was meanwhile"
    assert faults(restored, client, 0x6041, FINE) == []
    assert faults(restored, client, 0x603F, 0) == [(False, 0, True)]
    assert faults(restored, client, 0x603F, 0x8612) == [(False, 0x8612, False)]
    told = tell_fault(FaultSeen(1, BUS, NODE, False, 0x8612), None)
    assert (told.severity, told.details["code_hex"]) == (Severity.WARNING, "8612h")


def test_a_fault_in_registers_is_told(mapped: ModbusDecoder) -> None:
    """A master that exchanges nothing but registers never reads 603Fh."""
    client = Client(OTHER, ours=False)
    request = ReadRegisters(5000, 1)
    assert not [r for r in mapped.feed_all(client.exchange(request, RegistersRead((FINE,)))) if type(r) is FaultSeen]
    records = mapped.feed_all(client.exchange(request, RegistersRead((FAULT,))))
    assert [one.fault for one in records if isinstance(one, FaultSeen)] == [True]


# -- what makes no sense ---------------------------------------------------------------


def test_malformed_messages_say_where(decoder: ModbusDecoder) -> None:
    client = Client()
    (bad,) = decoder.feed(client.ask(bytes.fromhex("2B 0D 02 00 01 6041 00 0000 0002")))
    assert isinstance(bad, MalformedAduSeen)
    assert (bad.fault, bad.offset, bad.node, bad.link) == (Fault.OPTION, 9, NODE, f"{US}>{SERVER}")
    records = decoder.feed_all([client.ask(WRITE, 9), client.ask(b"\3\0", 9)])
    assert [type(record) for record in records] == [SdoSeen, MalformedAduSeen]  # what it replaces is lost all the same
    records = decoder.feed_all([client.ask(WRITE), client.answer(bytes.fromhex("2B 0D 01"))])
    assert isinstance(records[0], MalformedAduSeen)
    assert records[0].offset == 10
    assert [seen.outcome for seen in transfers(records)] == [Outcome.BROKEN]
    (cut,) = decoder.feed(Frame(1, BUS, Direction.TX, Adu(b"\0\1\0\0\0\6\0", SERVER)))
    assert isinstance(cut, MalformedAduSeen)
    assert cut.fault is Fault.LENGTH


def test_functions_of_others_pass_silently(decoder: ModbusDecoder) -> None:
    """FC 1 is none of the device's, but a foreign master may ask it for others behind the same gateway."""
    client = Client(OTHER, ours=False)
    assert decoder.feed_all([client.ask(b"\1\0\0\0\1"), client.answer(b"\1\1\1")]) == []


def test_other_traffic_says_nothing(decoder: ModbusDecoder) -> None:
    frame = Client().ask(READ)
    data = Client().ask(READ).payload.data
    assert decoder.feed(frame._replace(bus="modbus1")) == ()
    assert decoder.feed(frame._replace(payload=Adu(data, "10.0.0.1:1>10.0.0.6:502"))) == ()
    decoder.set_server("10.0.0.6:502", 6)
    assert decoder.feed(frame._replace(payload=Adu(data, "10.0.0.1:1>10.0.0.6:502"))) == []
    records = decoder.feed(
        frame._replace(payload=Adu(Client().answer(READ_ANSWER, 1).payload.data, "10.0.0.6:502>10.0.0.1:1"))
    )
    assert {record.node for record in records} == {6}


STEPS = st.lists(
    st.tuples(st.sampled_from((US, OTHER)), st.one_of(REQUESTS, ANSWERS), st.booleans(), st.integers(0, 3)),
    max_size=25,
)


def frames_of(steps: list[tuple[str, Request | Answer, bool, int]]) -> list[Frame]:
    clients = {US: Client(), OTHER: Client(OTHER, ours=False)}
    return [
        clients[name].ask(message.pdu(), transaction) if asks else clients[name].answer(message.pdu(), transaction)
        for name, message, asks, transaction in steps
    ]


@given(STEPS, st.integers(0, 25))
def test_a_keyframe_anywhere_goes_on_as_if_nothing_was(
    steps: list[tuple[str, Request | Answer, bool, int]], at: int
) -> None:
    frames = frames_of(steps)
    decoder, restored = ModbusDecoder(BUS, {SERVER: NODE}), ModbusDecoder(BUS, {SERVER: NODE})
    live = LiveState()
    live.apply_all(decoder.feed_all(frames[:at]))
    restored.restore(json.loads(json.dumps(decoder.snapshot())))
    expected = decoder.feed_all(frames[at:])
    live.apply_all(expected)
    assert restored.feed_all(frames[at:]) == expected
    assert restored.snapshot() == json.loads(json.dumps(decoder.snapshot()))


@given(st.lists(st.tuples(st.binary(max_size=40), st.sampled_from(Direction)), max_size=10))
def test_any_bytes_give_records(chunks: list[tuple[bytes, Direction]]) -> None:
    decoder = ModbusDecoder(BUS, {SERVER: NODE})
    for data, direction in chunks:
        decoder.feed(Frame(1, BUS, direction, Adu(data, SERVER)))
    decoder.gap(2, "gap.frames_lost")


# -- the live state takes it all -----------------------------------------------------------


def test_the_live_state_of_a_device(mapped: ModbusDecoder) -> None:
    live, client = LiveState(), Client(OTHER, ours=False)
    window, save = Address(0x6065), Address(0x1010, 1)
    for request, answer in (
        (WriteObject(window, b"\1\0\0\0"), ObjectWritten(window)),
        (WriteObject(save, b"save"), ObjectWritten(save)),
        (ReadObject(Address(0x6060), 2), AbortAnswer(0x06070012)),
        (ReadRegisters(9000, 1), ExceptionAnswer(3, 2)),
        (ReadDictionary(Phase.START), FramesRead(Phase.START, ())),
        (ReadDictionary(Phase.CONTINUE), AbortAnswer(0x08000024)),
        (BOOT, ObjectWritten(BOOT.address)),
    ):
        live.apply_all(mapped.feed_all(client.exchange(request, answer)))
    view = live.value(BUS, NODE, window)
    assert view is not None
    assert view.stored is not None
    assert (view.stored.data, view.stored.state) == (b"\1\0\0\0", StoredState.SAVED)
    node = live.node(BUS, NODE)
    assert node is not None
    assert (node.other_client_ns, node.boots) == (client.t_ns, 0)
    read = Client("10.0.0.1:40001").at(client.t_ns).exchange(ReadObject(window, 4), ObjectRead(window, b"\1\0\0\0"))
    live.apply_all(mapped.feed_all(read))
    view, node = live.value(BUS, NODE, window), live.node(BUS, NODE)
    assert view is not None
    assert view.stored is not None
    assert view.stored.state is StoredState.PROVEN
    assert node is not None
    assert (node.boots, node.state) == (1, None)
    told = [(event.kind, event.details.get("reason_key")) for event in live.events()]
    assert told == [
        (EventKind.SAVED, None),
        (EventKind.SDO_ABORTED, "abort.length_too_high"),
        (EventKind.REQUEST_REFUSED, "modbus.exception.illegal_address"),
        (EventKind.BOOT_UP, None),
    ]
    live.apply_all(mapped.feed_all([client.ask(b"\3\0")]))
    assert live.events()[-1].text_key == "event.malformed_adu"
    restored = LiveState()
    restored.restore(json.loads(json.dumps(live.snapshot())))
    assert restored.snapshot()["nodes"] == live.snapshot()["nodes"]
    assert [event.text_key for event in restored.events()] == [event.text_key for event in live.events()]
