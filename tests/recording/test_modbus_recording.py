"""Recordings of Modbus TCP: every ADU reads back, copies keep it, and what is told of them is what the decoder sees."""

from __future__ import annotations

import asyncio
import random
import shutil
import time
from collections import Counter, defaultdict
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymodbus.client import AsyncModbusTcpClient

from app.drivers.modbus import ModbusDriver
from app.drivers.modbus_config import ModbusConfig, ModbusPeer
from app.errors import SdoAbortError, UsageError
from app.model.address import Address
from app.model.description_file import load_builtin
from app.recording.columns import SOURCES, Signal, samples
from app.recording.content import RecorderClock, RecordingInfo
from app.recording.exchange.anonymise import AnonymiseOrder, anonymise
from app.recording.exchange.cut import CutOrder, cut
from app.recording.exchange.exporting import Choice, losses
from app.recording.exchange.formats import Format, Lost
from app.recording.exchange.merge import MergeInput, merge
from app.recording.exchange.table import Shape, TableOrder, write_table
from app.recording.index import Course, RecordingIndex, build_index, steps
from app.recording.index.frames import course_at
from app.recording.reader import open_recording
from app.recording.recover import recover
from app.recording.scan import is_finished, map_file
from app.recording.writer import Recorder, RecorderSettings
from app.service.library.recovered import recover_sets
from app.wire.decoders import decoder_of
from app.wire.frame import Adu, Direction, Frame, Stamper
from app.wire.modbus.adu import AduSplitter, decode_adu, wire_bits
from app.wire.modbus.functions import Function
from app.wire.records import SdoAccess, SdoSeen, Source, TransactionSeen, ValueSeen
from app.wire.signs import SignKind
from tests.drivers.modbus_rig import POSITION, STATUSWORD, TARGET, VALUES, twin
from tests.drivers.test_modbus_interop import dissected
from tests.recording.make_pd4e import BUS, SAMPLE, SERVER, SLUG, record
from tests.recording.rig import S, by_mcap, frames_of
from tests.service.replay.test_session import DROPS_OUT

PD4E = load_builtin("nanotec-pd4e")
SERVERS = {1: SERVER}
PATIENCE_S = 10.0
MANY = 3


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    path = tmp_path / "bench.mcap"
    shutil.copy(SAMPLE, path)
    return path


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RecordingIndex]:
    path = tmp_path_factory.mktemp("index") / SAMPLE.name
    shutil.copy(SAMPLE, path)
    with build_index(path, {(BUS, 1): PD4E}) as built:
        yield built


def decoded(frames: list[Frame]) -> list[ValueSeen]:
    records = decoder_of(BUS, servers=SERVERS).feed_all(frames)
    return [record for record in records if isinstance(record, ValueSeen)]


def adus(frames: list[Frame]) -> list[Adu]:
    return [frame.payload for frame in frames if isinstance(frame.payload, Adu)]


# -- a session as it happens ----------------------------------------------------------------


@asynccontextmanager
async def tapped(peer: ModbusPeer, stamp: Stamper, hear: list[Frame]) -> AsyncIterator[int]:
    """A tap between a client of somebody else and the device: its port; what passes is heard as ``hear`` has it."""

    async def passing(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, link: str) -> None:
        splitter = AduSplitter()
        while data := await reader.read(4096):
            for adu in splitter.feed(data):
                hear.append(Frame(stamp(), BUS, Direction.RX, Adu(adu, link)))
            writer.write(data)
        writer.close()

    async def client(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        name = "{}:{}".format(*writer.get_extra_info("peername")[:2])
        far_reader, far_writer = await asyncio.open_connection(peer.host, peer.port)
        there = passing(reader, far_writer, f"{name}>{peer.server}")
        await asyncio.gather(there, passing(far_reader, writer, f"{peer.server}>{name}"))

    server = await asyncio.start_server(client, "127.0.0.1", 0)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()


@asynccontextmanager
async def driving(peer: ModbusPeer, stamp: Stamper) -> AsyncIterator[ModbusDriver]:
    driver = ModbusDriver(ModbusConfig((peer,)), stamp, BUS, (PD4E,))
    await driver.connect()
    try:
        yield driver
    finally:
        await driver.close()


async def test_a_session_with_a_drive_and_a_foreign_client_reads_back_frame_by_frame(tmp_path: Path) -> None:
    stamp = Stamper(time.time_ns(), time.monotonic_ns)
    seen: list[Frame] = []
    foreign: list[Frame] = []
    with twin() as peer:
        info = RecordingInfo("bench", "ada", {}, {f"{BUS}/1": f"{SLUG} {PD4E.id}"}, {}, {f"{BUS}/1": peer.server})
        clock = RecorderClock(time.monotonic_ns, time.time_ns, stamp)
        with Recorder(tmp_path, info, clock, (), RecorderSettings(min_free_bytes=0)) as recorder:
            async with driving(peer, stamp) as driver, tapped(peer, stamp, foreign) as port:
                driver.subscribe(seen.extend)
                driver.subscribe(recorder.write)
                await driver.process_data(1).exchange()
                await driver.backup(1)
                with pytest.raises(SdoAbortError):
                    await driver.read(1, Address(0x2FFF))
                client = AsyncModbusTcpClient("127.0.0.1", port=port, retries=0, timeout=PATIENCE_S)
                assert await client.connect()
                assert not (await client.read_holding_registers(5000, count=7, device_id=0)).isError()
                assert (await client.read_holding_registers(9000, count=1, device_id=0)).exception_code == 2
                client.close()
                await driver.write(1, TARGET, VALUES[TARGET])
            recorder.write(foreign)
            status = recorder.close()
        assert status.file is not None
        assert not status.lost
        with open_recording(status.file, strict=True) as recording:
            frames = list(recording.frames())
            assert recording.servers == {(BUS, 1): peer.server}
            records = decoder_of(BUS, servers={1: peer.server}).feed_all(frames)
        assert frames == sorted([*seen, *foreign], key=lambda frame: frame.t_ns)
        links = {(adu.link.split(">")[1] == peer.server) for adu in adus(frames)}
        assert links == {True, False}
        told = Counter(
            (one.client, one.function, one.outcome.value) for one in records if isinstance(one, TransactionSeen)
        )
        assert told[Direction.RX, Function.READ_HOLDING_REGISTERS, "done"] == 1
        assert told[Direction.RX, Function.READ_HOLDING_REGISTERS, "aborted"] == 1
        assert told[Direction.TX, Function.READ_DICTIONARY, "done"] > MANY
        written = [one for one in records if isinstance(one, SdoSeen) and one.access is SdoAccess.WRITE]
        assert [(one.address, one.data) for one in written] == [(TARGET, VALUES[TARGET])]


def test_the_same_program_makes_the_same_recording(tmp_path: Path) -> None:
    made = [record(tmp_path / name) for name in ("one", "two")]
    assert made[0].read_bytes() == made[1].read_bytes()


def test_other_tools_read_the_telegrams(sample: Path) -> None:
    found = [(t_ns, message) for topic, t_ns, message in by_mcap(sample) if topic == f"/{BUS}"]
    frames = frames_of(sample)
    assert [(t_ns, bytes(message.data), message.link) for t_ns, message in found] == [  # type: ignore[attr-defined]
        (frame.t_ns, *frame.payload) for frame in frames
    ]
    assert {(message.kind, message.header.frame_id) for _, message in found} == {  # type: ignore[attr-defined]
        (1, f"{BUS}/rx"), (1, f"{BUS}/tx"),
    }  # fmt: skip


async def test_tshark_reads_in_a_recording_what_our_decoder_reads(sample: Path, tmp_path: Path) -> None:
    frames = frames_of(sample)[:600]
    rows = await asyncio.to_thread(dissected, frames, tmp_path)
    assert len(rows) == len(frames)
    functions: Counter[int] = Counter()
    for frame, row in zip(adus(frames), rows, strict=True):
        message = decode_adu(frame.data)
        assert [int(each, 0) for each in row["mbtcp.trans_id"]] == [message.transaction]
        assert [int(each, 0) for each in row["mbtcp.len"]] == [len(message.pdu) + 1]
        assert [int(each, 0) for each in row["modbus.func_code"]] == [message.function & 0x7F]
        if message.function == Function.OBJECT:
            assert row["modbus.mei"] == ["13"]
        functions[message.function] += 1
    assert functions.keys() == {16 + 7, Function.READ_HOLDING_REGISTERS, 43, 101, 0xAB}
    status = [
        int(row["modbus.data"][0][:4], 16)
        for row in rows
        if row["modbus.func_code"] == ["23"] and row["modbus.data"] and row["tcp.dstport"] != ["15020"]
    ]
    ours = [one.data for one in decoded(frames) if one.address == STATUSWORD and one.source is Source.PDO_TX]
    assert status == [int.from_bytes(data, "little") for data in ours]
    assert len(status) > 100


# -- copies -----------------------------------------------------------------------------------


def test_a_cut_begins_with_what_is_known_and_keeps_the_servers(sample: Path, tmp_path: Path) -> None:
    frames = frames_of(sample)
    start_ns, end_ns = frames[1500].t_ns, frames[2000].t_ns
    target = tmp_path / "cut.mcap"
    assert cut(sample, target, CutOrder(start_ns, end_ns)).frames == 500
    assert frames_of(target) == frames[1500:2000]
    with open_recording(target) as copy:
        assert copy.servers == {(BUS, 1): SERVER}
        state = next(copy.keyframes()).state
    decoder = decoder_of(BUS, servers=SERVERS)
    decoder.restore(state["decoders"][BUS])
    later = [one for one in decoder.feed_all(frames[1500:2000]) if isinstance(one, ValueSeen)]
    assert later == [one for one in decoded(frames) if start_ns <= one.t_ns < end_ns]
    assert POSITION in {one.address for one in later}


def test_a_merge_with_a_turbine_keeps_both_buses(sample: Path, tmp_path: Path) -> None:
    target, moved = tmp_path / "merged.mcap", frames_of(DROPS_OUT)[0].t_ns - frames_of(sample)[0].t_ns
    merge([MergeInput(sample, moved, {BUS: "bench"}), MergeInput(DROPS_OUT)], target)
    found = frames_of(target)
    with open_recording(target) as merged:
        assert merged.servers == {("bench", 1): SERVER}
        assert merged.descriptions["bench", 1].id == PD4E.id
        state = list(merged.keyframes())[1].state
    here = [frame for frame in found if frame.bus == "bench"]
    assert [frame.payload for frame in here] == adus(frames_of(sample))
    assert len(found) - len(here) == len(frames_of(DROPS_OUT))
    assert {node["bus"] for node in state["live"]["nodes"]} == {"bench", "can0"}
    assert state["decoders"]["bench"]["protocol"] == "modbus-tcp"
    assert state["decoders"]["bench"]["bus"] == "bench"


def test_two_servers_of_one_name_are_not_merged(sample: Path, tmp_path: Path) -> None:
    half, other = tmp_path / "half.mcap", tmp_path / "other.mcap"
    frames = frames_of(sample)
    cut(sample, half, CutOrder(None, frames[1000].t_ns))
    cut(sample, other, CutOrder(frames[1000].t_ns, None))
    merge([MergeInput(half), MergeInput(other)], tmp_path / "again.mcap")
    assert frames_of(tmp_path / "again.mcap") == frames
    data = other.read_bytes()
    other.write_bytes(data.replace(SERVER.encode(), b"192.168.2.21:502"))
    with pytest.raises(UsageError, match=r"lan/1 is 192\.168\.2\.20:502 in one file and 192\.168\.2\.21:502"):
        merge([MergeInput(half), MergeInput(other)], tmp_path / "none.mcap")


def test_a_recording_that_was_cut_off_keeps_every_whole_telegram(tmp_path: Path) -> None:
    path = record(tmp_path)
    frames, data = frames_of(path), path.read_bytes()
    chance = random.Random(7)
    for size in sorted(chance.sample(range(len(data) // 3, len(data) - 2000), 5)):
        path.write_bytes(data[:size])
        found = recover(path, 1)
        assert found is not None
        kept = frames_of(path)
        assert kept == frames[: len(kept)]
        assert found.frames == len(kept)
        assert is_finished(map_file(path))
        (tmp_path / f"{path.name}.tail").unlink(missing_ok=True)
    assert len(kept) > len(frames) // 2


def test_formats_of_can_tell_that_they_take_no_telegrams(sample: Path) -> None:
    with open_recording(sample) as recording:
        lost = {one.what: one.things for one in losses(recording, Choice(Format.CANDUMP))}
    assert lost[Lost.FRAME] == len(frames_of(sample))


def test_an_anonymous_copy_has_neither_telegrams_nor_what_they_told(sample: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no CAN frame"):
        anonymise(sample, tmp_path / "none.mcap", AnonymiseOrder())
    both, copy = tmp_path / "both.mcap", tmp_path / "anonymous.mcap"
    begin_ns = frames_of(DROPS_OUT)[0].t_ns
    merge([MergeInput(sample, begin_ns - frames_of(sample)[0].t_ns), MergeInput(DROPS_OUT)], both)
    cut(both, tmp_path / "later.mcap", CutOrder(begin_ns + 5 * S, None))
    done = anonymise(tmp_path / "later.mcap", copy, AnonymiseOrder())
    kept = frames_of(tmp_path / "later.mcap")
    assert done.left_out_frames == sum(frame.bus == BUS for frame in kept) > MANY
    with open_recording(copy) as recording:
        assert {frame.bus for frame in recording.frames()} == {"can0"}
        assert recording.servers == {}
        for keyframe in recording.keyframes():
            assert set(keyframe.state["decoders"]) <= {"can0"}
            assert {node["bus"] for node in keyframe.state["live"]["nodes"]} == {"can0"}


# -- values -----------------------------------------------------------------------------------


@settings(max_examples=12, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1))
def test_samples_are_what_the_decoder_sees(begin: float, length: float) -> None:
    with open_recording(SAMPLE) as recording:
        assert recording.span_ns is not None
        first_ns, last_ns = recording.span_ns
        start_ns = first_ns + round(begin * (last_ns - first_ns))
        end_ns = start_ns + round(length * (last_ns - start_ns)) + 1
        frames = list(recording.frames())
        wanted: defaultdict[Address, list[tuple[int, bytes, Source]]] = defaultdict(list)
        for value in decoded(frames):
            if start_ns <= value.t_ns < end_ns:
                wanted[value.address].append((value.t_ns, value.data, value.source))
        signals = [Signal(BUS, 1, entry.address) for entry in PD4E]
        found = samples(recording, signals, recording.descriptions, start_ns, end_ns)
    for signal, seen in found.items():
        places = range(seen.values)
        told = [(int(seen.t_ns[n]), seen.data(n), SOURCES[int(seen.source[n])]) for n in places]
        assert told == wanted[signal.address], signal


def test_a_table_holds_the_values_in_their_units(sample: Path, tmp_path: Path) -> None:
    signals = [Signal(BUS, 1, POSITION), Signal(BUS, 1, STATUSWORD)]
    with open_recording(sample) as recording:
        write_table(recording, tmp_path / "long.parquet", TableOrder(signals=signals))
        write_table(recording, tmp_path / "wide.parquet", TableOrder(Shape.WIDE, signals))
    rows = pq.read_table(tmp_path / "long.parquet").to_pylist()
    wanted = decoded(frames_of(sample))
    assert [row["raw"] for row in rows if row["address"] == "6064"] == [
        int.from_bytes(one.data, "little", signed=True) for one in wanted if one.address == POSITION
    ]
    assert {row["device"] for row in rows} == {SLUG}
    assert pq.read_table(tmp_path / "wide.parquet").num_rows == len(
        {one.t_ns for one in wanted if one.address in (POSITION, STATUSWORD)}
    )


def test_a_set_is_recovered_from_the_dictionary_that_was_read(sample: Path) -> None:
    """FC 101 gives the whole dictionary; of objects that were written later the last value counts."""
    (one,) = recover_sets(sample, {PD4E.id: PD4E}).sets
    latest = {value.address: value.data for value in decoded(frames_of(sample)) if value.source is not Source.PDO_RX}
    assert one.bus == BUS
    assert one.parameters.values[Address(0x3700)] == 2
    assert one.parameters.values[Address(0x6066)] == 50
    assert one.seen[Address(0x6066)].access is SdoAccess.WRITE
    assert one.seen[Address(0x6065)].access is SdoAccess.READ
    assert all(seen.ours for seen in one.seen.values())
    assert len(one.parameters.values) > 850
    assert one.parameters.values[Address(0x6065)] == int.from_bytes(latest[Address(0x6065)], "little")


# -- the index ------------------------------------------------------------------------------


def test_the_index_finds_the_fault_its_code_and_its_end(index: RecordingIndex) -> None:
    signs = [(one.kind, one.ends) for one in index.signs() if one.kind in (SignKind.AXIS_FAULT, SignKind.ERROR_CODE)]
    assert signs == [(SignKind.AXIS_FAULT, False), (SignKind.ERROR_CODE, False), (SignKind.AXIS_FAULT, True)]
    code = next(one for one in index.signs() if one.kind is SignKind.ERROR_CODE)
    assert code.details["code"] == 0x8611
    assert index.gaps() == []


def test_the_load_counts_every_telegram(index: RecordingIndex) -> None:
    (load,) = index.load()
    frames = frames_of(SAMPLE)
    assert index.frames == int(load.frames.sum()) == len(frames)
    bits = sum(wire_bits(len(adu.data)) for adu in adus(frames))
    assert float(np.sum(load.share)) * load.bucket_ns / 1e9 * 100e6 == pytest.approx(bits)


def test_a_plot_has_every_value_also_where_the_pages_hold_buckets(index: RecordingIndex) -> None:
    span = index.span_ns
    wanted = [one for one in decoded(frames_of(SAMPLE)) if one.address == POSITION]
    series = index.series((BUS, 1, POSITION), span[0], span[1] + 1)
    assert series.t_ns.tolist() == [one.t_ns for one in wanted]
    assert series.low.tolist() == [int.from_bytes(one.data, "little", signed=True) for one in wanted]


def test_a_seek_gives_the_state_that_reading_from_the_beginning_gives(index: RecordingIndex) -> None:
    chance = random.Random(3)
    with open_recording(index.recording) as recording:
        for t_ns in sorted(chance.randrange(*index.span_ns) for _ in range(5)):
            plain = Course((BUS,), {(BUS, 1): PD4E}, servers={(BUS, 1): SERVER})
            first = index.span_ns[0] - 1
            for step in steps(recording.frames(None, t_ns + 1), index.marks(first, t_ns + 1), first + 1, first, t_ns):
                plain.take(step)
            sought = course_at(index, recording, {(BUS, 1): PD4E}, t_ns)
            assert sought.snapshot()["decoders"] == plain.snapshot()["decoders"]
            assert sought.live.values(BUS, 1).keys() == plain.live.values(BUS, 1).keys()
            for address, view in sought.live.values(BUS, 1).items():
                assert view.reading == plain.live.values(BUS, 1)[address].reading
