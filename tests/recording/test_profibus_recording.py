"""Recordings of PROFIBUS: telegrams read back, copies keep them, and all that is told is what the decoder sees."""

from __future__ import annotations

import random
import shutil
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import UsageError
from app.model.address import Address, parse_address
from app.model.description import Bus
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
from app.recording.writer import RecorderCore, RecorderSettings
from app.service.library.recovered import Doubt, recover_sets
from app.wire.events import EventKind
from app.wire.frame import Direction, Fdl, Frame, Stamper
from app.wire.profibus import dp
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.profibus.fdl import wire_bits
from app.wire.profibus.pzd import AS_PKW, AS_PRINTED
from app.wire.records import SdoAccess, Source, ValueSeen
from app.wire.signs import SignKind
from tests.recording.make_ed2 import BAUD, BUS, NODE, RAMP, SAMPLE, SLUG, RecordedWire, begin, record, rest
from tests.recording.rig import S, by_mcap, frames_of
from tests.service.replay.test_session import DROPS_OUT
from tests.twins.ed2.rig import Master

ED2 = load_builtin("wandfluh-ed2")
STATUSWORD, ACTUAL, RAMP_VELOCITY, STORE = (parse_address(one) for one in ("0/38", "12/100", "12/61", "0/51"))
KEY = (BUS, NODE)


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    path = tmp_path / "bench.mcap"
    shutil.copy(SAMPLE, path)
    return path


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RecordingIndex]:
    path = tmp_path_factory.mktemp("index") / SAMPLE.name
    shutil.copy(SAMPLE, path)
    with build_index(path, {KEY: ED2}) as built:
        yield built


def decoded(frames: list[Frame]) -> list[ValueSeen]:
    records = ProfibusDecoder(BUS, {NODE: ED2}).feed_all(frames)
    return [record for record in records if isinstance(record, ValueSeen)]


def number(value: ValueSeen) -> int:
    entry = ED2.entries[value.address]
    return int.from_bytes(value.data, "little", signed=entry.type.is_signed)


def test_the_same_program_makes_the_same_recording(tmp_path: Path) -> None:
    made = [record(tmp_path / name) for name in ("one", "two")]
    assert made[0].read_bytes() == made[1].read_bytes()


def test_a_recording_tells_what_is_spoken_and_has_one_channel_of_it(sample: Path) -> None:
    with open_recording(sample) as recording:
        assert recording.kinds == {BUS: Bus.PROFIBUS_DP}
        assert recording.descriptions[KEY].id == ED2.id
        assert [one.topic for one in recording.channels.values()].count(f"/{BUS}") == 1
        assert recording.info.bit_rates == {BUS: BAUD}


def test_without_a_word_of_the_file_the_messages_tell_what_is_spoken(tmp_path: Path) -> None:
    stamp = Stamper(10 * S, lambda: 10 * S)
    clock = RecorderClock(lambda: 10 * S, lambda: 10 * S, stamp)
    core = RecorderCore(tmp_path, RecordingInfo("bench", "ada"), clock, (), RecorderSettings(min_free_bytes=0))
    frame = Frame(stamp(), BUS, Direction.TX, Fdl(dp.encode_request(dp.FdlStatus(), 2, NODE).encode()))
    core.write([frame])
    core.shut()
    file = core.status().file
    assert file is not None
    with open_recording(file) as recording:
        assert recording.kinds == {BUS: Bus.PROFIBUS_DP}
        assert list(recording.frames()) == [frame]
    with build_index(file, {}) as built:
        (load,) = built.load()
        assert int(load.frames.sum()) == 1
        assert [one.kind for one in built.events()] == []


def test_other_tools_read_the_telegrams(sample: Path) -> None:
    found = [(t_ns, message) for topic, t_ns, message in by_mcap(sample) if topic == f"/{BUS}"]
    frames = frames_of(sample)
    assert [(t_ns, bytes(message.data)) for t_ns, message in found] == [  # type: ignore[attr-defined]
        (frame.t_ns, frame.payload.data) for frame in frames
    ]
    assert {(message.kind, message.header.frame_id) for _, message in found} == {  # type: ignore[attr-defined]
        (2, f"{BUS}/rx"), (2, f"{BUS}/tx"),
    }  # fmt: skip


# -- the order of process data ----------------------------------------------------------------


def test_a_recording_proves_the_order_of_its_own_process_data(sample: Path) -> None:
    decoder = ProfibusDecoder(BUS, {NODE: ED2})
    decoder.feed_all(frames_of(sample))
    slave = decoder.slave(NODE)
    assert slave is not None
    assert slave.order == AS_PKW
    actual = [
        number(one) for one in decoded(frames_of(sample)) if one.source is Source.PDO_TX and one.address == ACTUAL
    ]
    assert min(actual) == pytest.approx(250_000, abs=50)
    assert max(actual) == pytest.approx(300_000, abs=200)
    assert len(actual) > 500


def begun(folder: Path, setting: str | None) -> Path:
    """A recording in which nobody reads a position by PKW, but the statusword."""
    wire = RecordedWire(folder, None if setting is None else {f"{BUS}/{NODE}": setting})
    master = Master(wire, NODE)
    begin(master)
    master.read("0/38")
    rest(master, 200)
    wire.recorder.shut()
    file = wire.recorder.status().file
    assert file is not None
    return file


@pytest.mark.parametrize(
    ("setting", "seen"), [(None, False), ("high-high", True), ("high-low", True), ("low-low", False)]
)
def test_what_the_site_says_is_in_the_recording_and_decides_between_words(
    tmp_path: Path, setting: str | None, seen: bool
) -> None:
    path = begun(tmp_path, setting)
    with open_recording(path) as recording:
        assert (KEY in recording.orders) is (setting is not None)
        by_columns = samples(recording, [Signal(*KEY, ACTUAL)], recording.descriptions)
    with build_index(path, {KEY: ED2}) as built:
        addresses = {one.address for one in built.signals()}
        assert STATUSWORD in addresses, "one word, and its bytes are proven"
        assert (ACTUAL in addresses) is seen
        assert bool(by_columns[Signal(*KEY, ACTUAL)].values) is seen
    if setting == "high-low":
        (value, *_) = by_columns[Signal(*KEY, ACTUAL)].raw.tolist()
        assert value & 0xFFFF == 250_000 >> 16, "nothing refutes it before a position is read"


# -- copies -----------------------------------------------------------------------------------


def test_a_cut_begins_with_what_is_known(sample: Path, tmp_path: Path) -> None:
    frames = frames_of(sample)
    start_ns, end_ns = frames[700].t_ns, frames[1000].t_ns
    target = tmp_path / "cut.mcap"
    assert cut(sample, target, CutOrder(start_ns, end_ns)).frames == 300
    assert frames_of(target) == frames[700:1000]
    with open_recording(target) as copy:
        assert copy.kinds == {BUS: Bus.PROFIBUS_DP}
        state = next(copy.keyframes()).state
    decoder = ProfibusDecoder(BUS, {NODE: ED2})
    decoder.restore(state["decoders"][BUS])
    later = [one for one in decoder.feed_all(frames[700:1000]) if isinstance(one, ValueSeen)]
    assert later == [one for one in decoded(frames) if start_ns <= one.t_ns < end_ns]
    assert ACTUAL in {one.address for one in later}, "its order was proven before"


def test_a_merge_with_a_turbine_keeps_both_buses_and_what_the_site_says(tmp_path: Path) -> None:
    line = begun(tmp_path / "line", "high-high")
    target, moved = tmp_path / "merged.mcap", frames_of(DROPS_OUT)[0].t_ns - frames_of(line)[0].t_ns
    merge([MergeInput(line, moved, {BUS: "bench"}), MergeInput(DROPS_OUT)], target)
    found = frames_of(target)
    with open_recording(target) as merged:
        assert merged.kinds == {"bench": Bus.PROFIBUS_DP, "can0": Bus.CANOPEN}
        assert merged.orders == {("bench", NODE): AS_PKW}
        assert merged.descriptions["bench", NODE].id == ED2.id
        state = list(merged.keyframes())[1].state
    here = [frame.payload for frame in found if frame.bus == "bench"]
    assert here == [frame.payload for frame in frames_of(line)]
    assert len(found) - len(here) == len(frames_of(DROPS_OUT))
    assert (state["decoders"]["bench"]["protocol"], state["decoders"]["bench"]["bus"]) == ("profibus-dp", "bench")


def test_two_orders_of_one_name_are_not_merged(tmp_path: Path) -> None:
    one, two = begun(tmp_path / "one", "high-high"), begun(tmp_path / "two", "high-low")
    with pytest.raises(UsageError, match="dp0/6 is high-high in one file and high-low in another"):
        merge([MergeInput(one), MergeInput(two, 10 * S)], tmp_path / "none.mcap")


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
        with open_recording(path) as recording:
            assert recording.kinds == {BUS: Bus.PROFIBUS_DP}
        (tmp_path / f"{path.name}.tail").unlink(missing_ok=True)
    assert kept


def test_formats_of_can_tell_that_they_take_no_telegrams(sample: Path) -> None:
    with open_recording(sample) as recording:
        lost = {one.what: one.things for one in losses(recording, Choice(Format.CANDUMP))}
    assert lost[Lost.FRAME] == len(frames_of(sample))


def test_an_anonymous_copy_has_neither_telegrams_nor_what_they_told(sample: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no CAN frame"):
        anonymise(sample, tmp_path / "none.mcap", AnonymiseOrder())
    both, copy = tmp_path / "both.mcap", tmp_path / "anonymous.mcap"
    merge([MergeInput(sample, frames_of(DROPS_OUT)[0].t_ns - frames_of(sample)[0].t_ns), MergeInput(DROPS_OUT)], both)
    done = anonymise(both, copy, AnonymiseOrder())
    assert done.left_out_frames == len(frames_of(sample))
    with open_recording(copy) as recording:
        assert {frame.bus for frame in recording.frames()} == {"can0"}
        assert BUS not in recording.info.bit_rates
        assert recording.kinds == {"can0": Bus.CANOPEN}
        for keyframe in recording.keyframes():
            assert set(keyframe.state["decoders"]) <= {"can0"}
            assert {node["bus"] for node in keyframe.state["live"]["nodes"]} == {"can0"}


# -- values -----------------------------------------------------------------------------------


@settings(max_examples=12, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1))
def test_samples_are_what_the_decoder_sees(start: float, length: float) -> None:
    with open_recording(SAMPLE) as recording:
        assert recording.span_ns is not None
        first_ns, last_ns = recording.span_ns
        start_ns = first_ns + round(start * (last_ns - first_ns))
        end_ns = start_ns + round(length * (last_ns - start_ns)) + 1
        wanted: defaultdict[Address, list[tuple[int, bytes, Source]]] = defaultdict(list)
        for value in decoded(list(recording.frames())):
            if start_ns <= value.t_ns < end_ns:
                wanted[value.address].append((value.t_ns, value.data, value.source))
        signals = [Signal(*KEY, entry.address) for entry in ED2]
        found = samples(recording, signals, recording.descriptions, start_ns, end_ns)
    for signal, seen in found.items():
        told = [(int(seen.t_ns[n]), seen.data(n), SOURCES[int(seen.source[n])]) for n in range(seen.values)]
        assert told == wanted[signal.address], signal


def test_a_table_holds_the_values_in_their_units(sample: Path, tmp_path: Path) -> None:
    signals = [Signal(*KEY, ACTUAL), Signal(*KEY, STATUSWORD)]
    with open_recording(sample) as recording:
        write_table(recording, tmp_path / "long.parquet", TableOrder(signals=signals))
        write_table(recording, tmp_path / "wide.parquet", TableOrder(Shape.WIDE, signals))
    rows = pq.read_table(tmp_path / "long.parquet").to_pylist()
    wanted = [one for one in decoded(frames_of(sample)) if one.address == ACTUAL]
    assert [row["raw"] for row in rows if row["address"] == "12/100"] == [number(one) for one in wanted]
    assert {row["device"] for row in rows} == {SLUG}
    assert pq.read_table(tmp_path / "wide.parquet").num_rows > len(wanted) // 2


def test_a_set_is_recovered_from_what_pkw_has_read_and_written(sample: Path) -> None:
    (one,) = recover_sets(sample, {ED2.id: ED2}).sets
    values = one.parameters.values
    assert one.bus == BUS
    assert values[RAMP_VELOCITY] == RAMP, "it was saved before the power cycle, and read after it"
    assert one.seen[RAMP_VELOCITY].access is SdoAccess.READ
    assert one.seen[RAMP_VELOCITY].doubt is None
    assert STORE not in values, "an order is no value"
    assert one.parameters.unread[parse_address("12/224")] == "PKW error 2"
    assert len(values) > 50


def test_what_was_seen_before_a_slave_was_away_is_in_doubt(sample: Path, tmp_path: Path) -> None:
    frames = frames_of(sample)
    decoder = ProfibusDecoder(BUS, {NODE: ED2})
    away_ns = next(
        frame.t_ns
        for frame in frames
        if any(getattr(one, "state", None) for one in decoder.feed(frame)) and frame.t_ns > frames[900].t_ns
    )
    early = tmp_path / "early.mcap"
    cut(sample, early, CutOrder(None, away_ns + 1))
    (one,) = recover_sets(early, {ED2.id: ED2}).sets
    assert one.seen[RAMP_VELOCITY].doubt is Doubt.BOOT_UP


# -- the index ------------------------------------------------------------------------------


def test_the_index_finds_the_fault_its_code_and_its_end(index: RecordingIndex) -> None:
    kinds = (SignKind.AXIS_FAULT, SignKind.ERROR_CODE)
    signs = [(one.kind, one.ends) for one in index.signs() if one.kind in kinds]
    assert signs == [(SignKind.AXIS_FAULT, False), (SignKind.ERROR_CODE, False), (SignKind.AXIS_FAULT, True)]
    code = next(one for one in index.signs() if one.kind is SignKind.ERROR_CODE)
    assert code.details["code"] == 0x5232


def test_the_index_tells_of_slaves_diagnoses_and_refusals(index: RecordingIndex) -> None:
    told = [(event.kind, event.details.get("state_key", event.details.get("address"))) for event in index.events()]
    states = [str(what).rpartition(".")[2] for kind, what in told if kind is EventKind.SLAVE_STATE]
    start = ["present", "waiting", "exchanging"]
    assert states == [*start, "absent", *start, "waiting"]
    assert (EventKind.SDO_ABORTED, "0/38") in told
    assert (EventKind.SAVED, "0/51") in told
    diagnoses = [event.details["status_hex"] for event in index.events() if event.kind is EventKind.DIAGNOSIS]
    assert diagnoses == ["000502h", "000C00h", "000502h", "000C00h", "000502h"], "what is told again is no news"
    refused = next(event for event in index.events() if event.details.get("address") == "0/38")
    assert refused.details["reason_key"] == "profibus.pkw.not_changeable"


def test_the_load_counts_every_telegram(index: RecordingIndex) -> None:
    (load,) = index.load()
    frames = frames_of(SAMPLE)
    assert index.frames == int(load.frames.sum()) == len(frames)
    bits = sum(wire_bits(len(frame.payload.data)) for frame in frames)
    assert float(np.sum(load.share)) * load.bucket_ns / 1e9 * BAUD == pytest.approx(bits)


@pytest.mark.parametrize("address", [ACTUAL, STATUSWORD])
def test_a_plot_has_every_value_also_where_the_pages_hold_buckets(index: RecordingIndex, address: Address) -> None:
    begin_ns, end_ns = index.span_ns
    wanted = [one for one in decoded(frames_of(SAMPLE)) if one.address == address]
    series = index.series((*KEY, address), begin_ns, end_ns + 1, 100_000)
    assert series.t_ns.tolist() == [one.t_ns for one in wanted]
    assert series.low.tolist() == [number(one) for one in wanted]
    coarse = index.series((*KEY, address), begin_ns, end_ns + 1, 10)
    assert (min(coarse.low), max(coarse.high)) == (min(map(number, wanted)), max(map(number, wanted)))


def test_a_seek_gives_the_state_that_reading_from_the_beginning_gives(index: RecordingIndex) -> None:
    chance = random.Random(3)
    with open_recording(index.recording) as recording:
        for t_ns in sorted(chance.randrange(*index.span_ns) for _ in range(8)):
            plain = Course((BUS,), {KEY: ED2})
            first = index.span_ns[0] - 1
            for step in steps(recording.frames(None, t_ns + 1), index.marks(first, t_ns + 1), first + 1, first, t_ns):
                plain.take(step)
            sought = course_at(index, recording, {KEY: ED2}, t_ns)
            assert sought.snapshot()["decoders"] == plain.snapshot()["decoders"]
            assert sought.live.values(*KEY).keys() == plain.live.values(*KEY).keys()
            for address, view in sought.live.values(*KEY).items():
                assert view.reading == plain.live.values(*KEY)[address].reading


def test_an_order_that_was_proven_is_in_the_state(index: RecordingIndex) -> None:
    keyframe = index.keyframe(index.span_ns[1])
    assert keyframe is not None
    decoder = ProfibusDecoder(BUS, {NODE: ED2})
    decoder.restore(keyframe.state["decoders"][BUS])
    slave = decoder.slave(NODE)
    assert slave is not None
    assert slave.order == AS_PKW != AS_PRINTED
