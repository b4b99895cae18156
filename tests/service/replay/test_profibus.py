"""A replay of a PROFIBUS line: from a recording of our own driver, and the same state however one comes there."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import PkwRefusedError
from app.model.description import Bus
from app.recording.content import RecorderClock, RecordingInfo
from app.recording.index import build_index
from app.recording.reader import open_recording
from app.recording.writer import Recorder, RecorderSettings
from app.service.bus_feed import BusFeed
from app.service.replay.source import Source
from app.service.replay.stage import ReplayStage, stage_near
from app.twins.ed2.device import Settings
from app.wire.frame import Frame, Stamper
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.profibus.pzd import AS_PRINTED
from app.wire.records import SlaveState
from tests.drivers.profibus_rig import ACTUAL, BAUD, ED2, LOCAL, NODE, RAMP_VELOCITY, STATUSWORD, wire
from tests.recording.make_ed2 import BUS, SAMPLE

S = 1_000_000_000


@pytest.fixture(scope="module")
def indexed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Source]:
    path = tmp_path_factory.mktemp("replay") / SAMPLE.name
    shutil.copy(SAMPLE, path)
    build_index(path, {(BUS, 6): ED2}).close()
    source = Source(path, {})
    yield source
    source.close()


def streamed(source: Source, t_ns: int) -> ReplayStage:
    """From the beginning, frame by frame."""
    stage = ReplayStage(source, None, lambda: t_ns)
    while stage.advance(t_ns, lambda: False) < t_ns:
        pass
    return stage


def sought(source: Source, t_ns: int) -> ReplayStage:
    """From the keyframe before."""
    stage = stage_near(source, t_ns, t_ns, lambda: t_ns)
    stage.advance(t_ns, lambda: False)
    return stage


@settings(max_examples=25, deadline=None)
@given(share=st.floats(0, 1))
def test_a_seek_gives_the_state_that_streaming_gives(indexed: Source, share: float) -> None:
    t_ns = indexed.from_ns + round(share * (indexed.to_ns - indexed.from_ns))
    stage, other = sought(indexed, t_ns), streamed(indexed, t_ns)
    assert stage.buses[BUS].decoder.snapshot() == other.buses[BUS].decoder.snapshot()
    readings = [{at: view.reading for at, view in one.live.values(BUS, 6).items()} for one in (stage, other)]
    assert readings[0] == readings[1]
    nodes = [[replace(node, version=0) for node in one.live.nodes()] for one in (stage, other)]
    assert nodes[0] == nodes[1]


def test_a_line_without_described_stations_is_followed_too(indexed: Source) -> None:
    stage = streamed(indexed, indexed.from_ns + S)
    feed = BusFeed("dp0", BAUD, {}, stage.live, stage._lock, None, Bus.PROFIBUS_DP)
    assert isinstance(feed.decoder, ProfibusDecoder)
    feed.take(list(indexed.frames(indexed.from_ns, indexed.from_ns + S)))
    assert feed.decoder.state(6) is SlaveState.EXCHANGING
    now_ns = indexed.from_ns + S
    assert feed.node_load(now_ns).keys() == {6}
    assert 0.02 < feed.bus_load(now_ns) < 0.9
    gone = feed.decoder.snapshot()["slaves"]["6"]
    feed.gap(now_ns)
    assert feed.decoder.snapshot()["slaves"]["6"]["pkw"]["job"] is None
    assert gone["state"] == "exchanging"


@pytest.mark.alone
async def test_what_our_driver_has_said_and_heard_is_recorded_and_replayed(tmp_path: Path) -> None:
    from app.drivers.profibus_driver import ProfibusDriver  # an optional extra brings its library

    stamp = Stamper(time.time_ns(), time.monotonic_ns)
    seen: list[Frame] = []
    info = RecordingInfo(
        "bench", "ada", {BUS: BAUD}, {f"{BUS}/{NODE}": f"bench/blade-1/axes {ED2.id}"}, {}, {},
        {BUS: Bus.PROFIBUS_DP.value},
    )  # fmt: skip
    clock = RecorderClock(time.monotonic_ns, time.time_ns, stamp)
    with (
        wire(BAUD, Settings(order=AS_PRINTED)) as line,
        Recorder(tmp_path, info, clock, (), RecorderSettings(min_free_bytes=0)) as recorder,
    ):
        driver = ProfibusDriver(line.config(NODE), stamp, BUS, (ED2,), listen_s=0.05)
        driver.subscribe(seen.extend)
        driver.subscribe(recorder.write)
        await driver.connect(30.0)
        try:
            proven = (await driver.check_order(NODE)).proven
            await driver.write(NODE, RAMP_VELOCITY, (1234).to_bytes(4, "little"))
            with pytest.raises(PkwRefusedError):
                await driver.write(NODE, LOCAL, b"\x07")
            actual = await driver.read(NODE, ACTUAL)
        finally:
            await driver.close()
        status = recorder.close()
    assert proven == AS_PRINTED
    assert status.file is not None
    assert not status.lost
    with open_recording(status.file, strict=True) as recording:
        assert list(recording.frames()) == seen
    with build_index(status.file, {(BUS, NODE): ED2}) as index:
        assert "event.pkw_refused" in {event.text_key for event in index.events()}
        assert index.series((BUS, NODE, STATUSWORD), *index.span_ns).t_ns.size > 10
    source = Source(status.file, {})
    try:
        stage = sought(source, source.to_ns)
        (bus,) = source.turbine.buses
        assert (bus.name, bus.bitrate) == (BUS, BAUD)
        values = {at: view.reading for at, view in stage.live.values(BUS, NODE).items()}
        reading = values[ACTUAL]
        assert reading is not None
        assert int.from_bytes(reading.data, "little") == pytest.approx(int.from_bytes(actual, "little"), abs=100)
        written = values[RAMP_VELOCITY]
        assert written is not None
        assert int.from_bytes(written.data, "little") == 1234
        decoder = stage.buses[BUS].decoder
        assert isinstance(decoder, ProfibusDecoder)
        slave = decoder.slave(NODE)
        assert slave is not None
        assert slave.order == AS_PRINTED, "proven by the recording alone"
    finally:
        source.close()
