"""Frames to file and back, by us and by the mcap library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk

from app.recording.cdr import decode_can_payload
from app.recording.chunks import chunk_data, split_body
from app.recording.content import AttachedFile
from app.recording.pack import pack
from app.recording.reader import open_recording
from app.recording.scan import Item, map_file, parse, scan, unmap
from app.wire.frame import Adu, Can, Direction, Fdl, Frame
from bench._traffic import traffic
from tests.recording.rig import START_NS, S, by_mcap, frames_of, record

ids = st.integers(0, 0x7FF)
long_ids = st.integers(0, 0x1FFF_FFFF)
octets = st.binary(max_size=8)
full = st.binary(min_size=8, max_size=8)
no, yes, plain = st.just(False), st.just(True), st.just(-1)
cans = st.one_of(
    st.builds(Can, ids, octets, no, no, no, plain),
    st.builds(Can, long_ids, octets, yes, no, no, plain),
    st.builds(Can, ids, st.just(b""), st.booleans(), yes, no, st.integers(0, 8)),
    st.builds(Can, long_ids, octets, yes, no, yes, plain),
    st.builds(Can, ids, full, no, no, no, st.integers(9, 15)),
)
payloads = st.one_of(
    st.tuples(st.sampled_from(("can0", "c", "can-hub-2")), cans),
    st.tuples(st.just("modbus0"), st.builds(Adu, st.binary(max_size=300), st.sampled_from(("", "10.0.0.5:502")))),
    st.tuples(st.just("dp0"), st.builds(Fdl, st.binary(max_size=255))),
)


@st.composite
def recordings(draw: st.DrawFn) -> list[Frame]:
    gaps = draw(st.lists(st.integers(1, 300_000_000), max_size=60))
    t_ns, frames = START_NS, []
    for gap in gaps:
        t_ns += gap
        bus, payload = draw(payloads)
        frames.append(Frame(t_ns, bus, draw(st.sampled_from(Direction)), payload))
    return frames


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(recordings())
def test_frames_come_back_as_they_went_in(tmp_path_factory: pytest.TempPathFactory, frames: list[Frame]) -> None:
    path = record(tmp_path_factory.mktemp("r"), frames)
    assert frames_of(path) == frames
    packed = path.with_name("packed.mcap")
    pack(path, packed)
    assert frames_of(packed) == frames


@pytest.fixture(scope="module")
def busy(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Frame]]:
    frames = traffic(12_000, start_ns=START_NS)
    attached = [AttachedFile("oat-pmc.toml", "application/toml", b"schema = 1\n")]
    return record(tmp_path_factory.mktemp("busy"), frames, attached), frames


@pytest.mark.parametrize("streaming", [False, True])
@pytest.mark.parametrize("packed", [False, True])
def test_mcap_with_ros2_support_reads_every_message(
    busy: tuple[Path, list[Frame]], tmp_path: Path, streaming: bool, packed: bool
) -> None:
    path, frames = busy
    if packed:
        pack(path, tmp_path / "p.mcap")
        path = tmp_path / "p.mcap"
    got: list[Frame] = []
    topics: dict[str, int] = {}
    for topic, log_time, message in by_mcap(path, streaming):
        topics[topic] = topics.get(topic, 0) + 1
        if topic == "/can0":
            got.append(_frame(log_time, message))
    assert got == frames
    assert topics["/clock"] >= 25
    assert topics["/state"] == 1


def _frame(log_time: int, message: Any) -> Frame:
    stamp = message.header.stamp
    assert stamp.sec * S + stamp.nanosec == log_time
    bus, _, direction = message.header.frame_id.partition("/")
    can = Can(message.id, bytes(message.data)[: message.dlc], message.is_extended, message.is_rtr, message.is_error)
    return Frame(log_time, bus, Direction(direction), can)


def test_header_schema_and_summary_are_what_tools_expect(busy: tuple[Path, list[Frame]]) -> None:
    path, frames = busy
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        channel = next(channel for channel in summary.channels.values() if channel.topic == "/can0")
        schema = summary.schemas[channel.schema_id]
        assert (schema.name, schema.encoding, channel.message_encoding) == ("can_msgs/msg/Frame", "ros2msg", "cdr")
        assert summary.statistics.channel_message_counts[channel.id] == len(frames)
        assert [attachment.name for attachment in reader.iter_attachments()] == ["oat-pmc.toml"]
        assert {record.name for record in reader.iter_metadata()} >= {
            "recording",
            "bit_rates",
            "nodes",
            "versions",
            "totals",
        }
        assert all(len(index.message_index_offsets) == 1 for index in summary.chunk_indexes)


def test_chunks_hold_one_topic_and_messages_of_one_size(busy: tuple[Path, list[Frame]]) -> None:
    path, frames = busy
    data = map_file(path)
    try:
        result = scan(data, path.name)
        records = [data[item.offset : item.offset + item.length] for item in _chunks(result.items)]
    finally:
        unmap(data)
    bodies = [split_body(_uncompressed(record)) for record in records]
    number = next(channel.id for channel in result.summary.channels.values() if channel.topic == "/can0")
    bus = [body for body in bodies if body.channel_id == number]
    assert sum(len(body.times) for body in bus) == len(frames)
    for body in bus:
        assert len(body.data) == 71 * len(body.times)
        first = decode_can_payload(body.data[31:71])
        assert first.t_ns == int(body.times[0])
        assert set(body.data[11:15]) == {0}, "the sequence number is constant"


def _chunks(items: list[Item]) -> list[Item]:
    return [item for item in items if item.opcode is Opcode.CHUNK]


def _uncompressed(record: bytes) -> bytes:
    length = int.from_bytes(record[1:9], "little")
    return chunk_data(parse(Chunk, record[9 : 9 + length]))


def test_a_stretch_of_time_is_read_alone(busy: tuple[Path, list[Frame]]) -> None:
    path, frames = busy
    start, end = frames[3000].t_ns, frames[9000].t_ns
    with open_recording(path) as recording:
        assert list(recording.frames(start, end)) == frames[3000:9000]


def test_frames_of_threads_that_overtake_each_other_are_read_in_order(tmp_path: Path) -> None:
    frames = traffic(4000, start_ns=START_NS)
    mixed = [frame for n in range(0, 4000, 7) for frame in reversed(frames[n : n + 7])]
    path = record(tmp_path, mixed)
    assert frames_of(path) == frames


def test_the_size_of_a_frame_stays_within_its_limits() -> None:
    from bench.record_size import LIMIT_LIVE, LIMIT_PACKED, measure

    sizes = measure(60_000)
    assert sizes.frames_per_s >= 4000
    assert sizes.live <= LIMIT_LIVE
    assert sizes.packed <= LIMIT_PACKED
