"""MCAP files of other programs through the same calls: whole, cut off and damaged."""

from __future__ import annotations

import random
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import Any, Final

import pytest
from mcap.records import Channel, Schema
from mcap.writer import CompressionType, Writer

from app.errors import RecordingError
from app.recording.can_table import CanColumns
from app.recording.cdr import make_can
from app.recording.columns import can_columns, samples
from app.recording.content import RecordingInfo
from app.recording.loose import bus_of, can_frames
from app.recording.mcap_file import McapFile
from app.recording.reader import open_recording
from app.recording.recover import recover
from app.recording.scan import DamageReason
from app.recording.schemas import CAN_FRAME
from app.service.recording_list import FileState, details, look_at
from app.wire.frame import Can, Direction, Frame
from tests.recording import columns_traffic
from tests.recording.foreign_files import Form, payload, write
from tests.recording.rig import by_mcap
from tests.recording.test_columns import described, streamed, values

BUSES: Final = ("can0", "can1")
COUNT: Final = 1500
NONE, LZ4 = CompressionType.NONE, CompressionType.LZ4
FORMS: Final = {
    "any_frame_id": Form(),
    "frame_id_of_ours": Form(frame_id=None),
    "no_frame_id": Form(frame_id=""),
    "big_endian": Form(order=">", frame_id="odd"),
    "lz4": Form(compression=LZ4),
    "lz4_mixed_topics": Form(compression=LZ4, mixed=True),
    "not_compressed": Form(compression=NONE, mixed=True),
    "no_chunks": Form(chunked=False),
    "no_chunks_mixed_topics": Form(chunked=False, mixed=True, frame_id=None),
    "no_summary": Form(summary=False),
    "no_chunks_no_summary": Form(chunked=False, summary=False),
    "no_crcs": Form(crcs=False, chunk_bytes=3000),
    "one_chunk": Form(chunk_bytes=1 << 24, mixed=True),
    "times_apart": Form(published_late_ns=5_000_000, stamp_early_ns=3_000_000, sequences=True),
    "garbage_behind_data": Form(garbage=True),
    "ways_as_topics": Form(topic="/{bus}/{way}", frame_id=""),
}


def plain(frame: Frame, form: Form) -> Frame:
    """The frame as a reader can know it."""
    can = frame.payload
    assert isinstance(can, Can)
    known = make_can(can.can_id, can.data.ljust(8, b"\0"), can.extended, can.remote, can.error, can.length)
    told = form.frame_id is None or "{way}" in form.topic
    return Frame(frame.t_ns, frame.bus, frame.direction if told else Direction.RX, known)


@cache
def traffic() -> list[Frame]:
    return columns_traffic.frames(7, COUNT, BUSES)


def of_buses(frames: list[Frame]) -> dict[str, list[Frame]]:
    return {bus: [frame for frame in frames if frame.bus == bus] for bus in BUSES}


def by_columns(source: Any) -> dict[str, list[Frame]]:
    found: defaultdict[str, list[Frame]] = defaultdict(list)
    for columns in can_columns(source):
        assert isinstance(columns, CanColumns)
        found[columns.bus] += map(columns.frame, range(columns.frames))
    return dict(found)


@pytest.mark.parametrize("name", FORMS)
def test_a_whole_file_in_any_form(tmp_path: Path, name: str) -> None:
    form, frames = FORMS[name], traffic()
    path = write(tmp_path / "theirs.mcap", frames, form)
    expected = [plain(frame, form) for frame in frames]
    descriptions = described(BUSES)
    with open_recording(path, strict=True) as recording:
        assert recording.finished and recording.foreign
        assert recording.info == RecordingInfo("", "")
        got = list(recording.frames())
        assert of_buses(got) == of_buses(expected)
        assert [frame.t_ns for frame in got] == [frame.t_ns for frame in expected]
        assert by_columns(recording) == of_buses(expected)
        seen = streamed(expected, descriptions)
        found = samples(recording, list(seen), descriptions)
        assert {signal: values(found[signal]) for signal in seen} == seen
        middle = frames[COUNT // 2].t_ns
        assert list(recording.frames(middle)) == [frame for frame in got if frame.t_ns >= middle]
        assert not [*recording.keyframes(), *recording.events()]
        assert recording.frame_count == len(frames)


@pytest.mark.parametrize("name", ["any_frame_id", "big_endian", "lz4_mixed_topics", "no_chunks"])
def test_the_mcap_library_reads_the_same(tmp_path: Path, name: str) -> None:
    """Our files are no misunderstanding of our own: mcap-ros2-support decodes them to the same frames."""
    form, frames = FORMS[name], traffic()
    path = write(tmp_path / "theirs.mcap", frames, form)
    decoded: Any = by_mcap(path, streaming=True)
    theirs = [
        (log_time, message.id, bytes(message.data), message.dlc)
        for topic, log_time, message in decoded
        if topic != "/imu" and not message.is_rtr
    ]
    with open_recording(path) as recording:
        ours = [
            (frame.t_ns, frame.payload.can_id, frame.payload.data.ljust(8, b"\0"), frame.payload.length)
            for frame in recording.frames()
            if isinstance(frame.payload, Can) and not frame.payload.remote
        ]
    assert sorted(ours) == sorted(theirs)


def test_messages_out_of_order_are_sorted_by_log_time(tmp_path: Path) -> None:
    frames, form = traffic(), Form(chunk_bytes=5000)
    mixed = [frame for n in range(0, len(frames), 40) for frame in reversed(frames[n : n + 40])]
    times = [frame.t_ns for frame in frames]
    with open_recording(write(tmp_path / "mixed.mcap", mixed, form)) as recording:
        assert [frame.t_ns for frame in recording.frames()] == times
        found = by_columns(recording)
    for bus, sent in of_buses(frames).items():
        assert [frame.t_ns for frame in found[bus]] == [frame.t_ns for frame in sent]


@pytest.mark.parametrize("name", ["any_frame_id", "lz4_mixed_topics", "not_compressed", "no_chunks_mixed_topics"])
@pytest.mark.parametrize("share", [0.05, 0.4, 0.77, 0.999])
def test_a_file_cut_off_gives_what_is_before_the_cut(tmp_path: Path, name: str, share: float) -> None:
    form = FORMS[name]
    frames = [plain(frame, form) for frame in traffic()]
    whole = write(tmp_path / "whole.mcap", traffic(), form, finish=False).read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[: int(len(whole) * share)])
    with open_recording(path) as recording:
        got = list(recording.frames())
        (damage,) = recording.damages
        assert not recording.finished
        assert by_columns(recording) == {bus: mine for bus, mine in of_buses(got).items() if mine}
    assert got == frames[: len(got)]
    assert damage.reason is DamageReason.TRUNCATED
    assert damage.offset + damage.length == path.stat().st_size
    least = share - 20_000 / len(whole) if form.chunked else share - 0.01
    assert len(got) >= least * len(frames) * 0.9
    with pytest.raises(RecordingError) as caught:
        open_recording(path, strict=True)
    assert caught.value.details["offset"] == caught.value.details["recovered_bytes"] == damage.offset
    before = path.read_bytes()
    assert recover(path, 0) is None
    assert path.read_bytes() == before
    assert look_at(path).state is FileState.UNFINISHED
    assert details(path).damages[0][0] == damage.offset


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, LZ4, NONE])
def test_of_the_chunk_that_was_cut_the_messages_before_the_cut_are_kept(
    tmp_path: Path, compression: CompressionType
) -> None:
    form, frames = Form(compression=compression, chunk_bytes=1 << 24), columns_traffic.frames(7, 6 * COUNT, BUSES)
    whole = write(tmp_path / "whole.mcap", frames, form).read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[: int(len(whole) * 0.4)])
    with open_recording(path) as recording:
        got = list(recording.frames())
        assert by_columns(recording) == of_buses(got)
    assert 0 < len(got) < len(frames)
    assert got == [plain(frame, form) for frame in frames[: len(got)]]


@pytest.mark.parametrize("finished", [True, False])
@pytest.mark.parametrize("compression", [CompressionType.ZSTD, LZ4])
def test_a_damaged_chunk_costs_that_chunk_alone_and_its_place_is_named(
    tmp_path: Path, finished: bool, compression: CompressionType
) -> None:
    form, frames = Form(compression=compression), traffic()
    path = write(tmp_path / "hit.mcap", frames, form, finished)
    data = bytearray(path.read_bytes())
    name = compression.name.lower().encode()
    marks = [at for at in range(len(data)) if data[at : at + len(name)] == name]
    start = marks[len(marks) // 4] - 4 - 9 - 28  # chunk indexes repeat the name at the end of a finished file
    data[start + 200] ^= 0x40
    path.write_bytes(data)
    with open_recording(path) as recording:
        got = list(recording.frames())
        assert [damage.offset for damage in recording.damages] == [start]
    lost = len(frames) - len(got)
    assert 0 < lost < len(frames) // 2
    rest = iter(plain(frame, form) for frame in frames)
    assert all(frame in rest for frame in got)
    with open_recording(path) as recording:
        assert by_columns(recording) == of_buses(got)
        assert [damage.offset for damage in recording.damages] == [start]
    with pytest.raises(RecordingError) as caught, open_recording(path, strict=True) as recording:
        list(can_columns(recording))
    assert caught.value.details["offset"] == start


def test_random_damage_never_raises_anything_else(tmp_path: Path) -> None:
    chance, path = random.Random(5), tmp_path / "hit.mcap"
    for n in range(150):
        form = chance.choice(list(FORMS.values()))
        data = bytearray(write(path, traffic()[:300], form, chance.random() < 0.7).read_bytes())
        for _ in range(chance.randrange(1, 4)):
            data[chance.randrange(min(8 if n % 3 else 60, len(data) - 1), len(data))] = chance.randrange(256)
        del data[chance.choice((len(data), chance.randrange(8, len(data)))) :]
        path.write_bytes(data)
        try:
            with open_recording(path) as recording:
                frames = list(recording.frames())
                by_columns(recording)
                recording.attachments(), recording.span_ns, recording.topics
        except RecordingError as error:
            assert error.details["file"] == path.name
        else:
            assert len(frames) <= 300


def test_what_is_no_frame_is_left_out_and_counted(tmp_path: Path) -> None:
    frame = Frame(5, "can0", Direction.RX, Can(0x181, b"\1\2"))
    good = payload(frame, Form())
    bad = [
        b"\0\2" + good[2:],  # parameter list
        good[:20],
        good[:12] + b"\xff\0\0\0" + good[16:],
        good[:28] + b"\xff\xff\xff\xff" + good[32:],
    ]
    path = tmp_path / "bad.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "another program")
        schema = writer.register_schema(CAN_FRAME.name, "ros2msg", CAN_FRAME.text.encode())
        channel = writer.register_channel("/can0", "cdr", schema)
        for n, one in enumerate([good, *bad, good]):
            writer.add_message(channel, n, one, n)
        writer.finish()  # type: ignore[no-untyped-call]
    with open_recording(path) as recording:
        assert [frame.t_ns for frame in recording.frames()] == [0, 5]
        assert sum(int(damage.detail.split()[0]) for damage in recording.damages) == len(bad)
        assert by_columns(recording) == {"can0": list(recording.frames())}


def test_a_file_of_ours_that_does_not_say_what_it_is_stays_an_error(tmp_path: Path) -> None:
    file = McapFile(tmp_path / "ours.mcap")
    file.add_channel("/can0", file.add_schema(CAN_FRAME), {"bus": "can0"})
    file.finish()
    with open_recording(tmp_path / "ours.mcap") as recording:
        assert not recording.foreign
        with pytest.raises(RecordingError):
            _ = recording.info


@pytest.mark.parametrize(
    ("topic", "frame_id", "bus", "direction"),
    [
        ("/can0", "", "can0", Direction.RX),
        ("/can0", "base_link", "can0", Direction.RX),
        ("/vehicle/can1", "", "vehicle/can1", Direction.RX),
        ("/can0/from_can_bus", "can", "can0", Direction.RX),
        ("/can0/to_can_bus", "can", "can0", Direction.TX),
        ("/from_can_bus", "can3", "can3", Direction.RX),
        ("/sent_messages", "", "can", Direction.TX),
        ("/anything", "can2/tx", "can2", Direction.TX),
        ("/anything", "odd/way", "anything", Direction.RX),
        ("/", "", "can", Direction.RX),
    ],
)
def test_bus_and_direction_by_topic_and_frame_id(topic: str, frame_id: str, bus: str, direction: Direction) -> None:
    assert bus_of(topic, frame_id) == (bus, direction)


def test_messages_of_another_type_are_no_frames() -> None:
    schema = Schema(id=1, data=b"", encoding="ros2msg", name="std_msgs/msg/String")
    channel = Channel(id=1, topic="/can0", message_encoding="cdr", metadata={}, schema_id=1)
    record = b"\5" + (22 + 32).to_bytes(8, "little") + b"\1\0" + bytes(20) + bytes(32)
    assert can_frames(record, {1: channel}, {1: schema}).buses == {}
