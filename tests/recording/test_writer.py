"""What the recorder does beside writing frames: clocks, keyframes, events, losses, rotation, a full or broken disk."""

from __future__ import annotations

import errno
import gzip
import os
from itertools import pairwise
from pathlib import Path

import pytest

from app.recording.content import Event, EventKind
from app.recording.part import Part
from app.recording.reader import open_recording
from app.recording.recover import recover_all
from app.recording.writer import BlockReason, Recorder, RecorderSettings, RecorderState
from app.wire.frame import Can, Direction, Frame
from tests.recording.rig import INFO, MS, Bench, HandClock, S, files, frames_of


def test_metadata_attachments_and_totals_come_back(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.core.attach("set.json", "application/json", b"{}")
    bench.run(1.0, 10)
    bench.core.shut()
    with open_recording(files(tmp_path)[0], strict=True) as recording:
        assert recording.info == INFO
        assert recording.identity.number == 1
        assert [(each.name, each.data) for each in recording.attachments()] == [("set.json", b"{}")]
        totals = recording.totals
        assert totals is not None and (totals.frames, totals.lost) == (100, 0)
        assert list(recording.frames()) == bench.written


def test_large_attachments_are_packed_and_come_back_plain(tmp_path: Path) -> None:
    large = b'{"name": "value"}' * 5000
    bench = Bench(tmp_path)
    bench.core.attach("descriptions/oat-pmc.json", "application/json", large)
    bench.run(1.0)
    bench.core.shut()
    assert files(tmp_path)[0].stat().st_size < len(large) / 5
    with open_recording(files(tmp_path)[0], strict=True) as recording:
        assert recording.attachments() == [("descriptions/oat-pmc.json", "application/json", large)]
        (stored,) = recording.attachment_records()
    assert stored.name == "descriptions/oat-pmc.json.gz"
    assert gzip.decompress(stored.data) == large


def test_clocks_are_paired_every_100_ms_with_the_adapters_time(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    for n in range(10):
        bench.clock.advance(100 * MS)
        stamp = bench.clock.recorder.stamp()
        bench.core.write([Frame(stamp, "can0", Direction.RX, Can(1), t_adapter_ns=n * 100 * MS)])
        bench.core.cycle()
    bench.core.shut()
    with open_recording(files(tmp_path)[0]) as recording:
        clocks = list(recording.clocks())
        frames = list(recording.frames())
    assert [reading.adapter_ns for reading in clocks] == [n * 100 * MS for n in range(10)]
    assert [reading.adapter_t_ns for reading in clocks] == [frame.t_ns for frame in frames]
    steps = {later.monotonic_ns - earlier.monotonic_ns for earlier, later in pairwise(clocks)}
    assert steps == {100 * MS}
    assert clocks[0].bus == "can0"


def test_a_step_of_the_wall_clock_is_an_event_and_slow_drift_is_not(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.run(1.0)
    bench.clock.wall += 1 * MS
    bench.run(1.0)
    bench.clock.wall -= 3 * S
    bench.run(1.0)
    bench.core.shut()
    with open_recording(files(tmp_path)[0]) as recording:
        steps = [event for event in recording.events() if event.kind is EventKind.WALL_CLOCK_STEP]
    assert [event.details["step_ns"] for event in steps] == [-3 * S]


def test_keyframes_are_wanted_at_the_start_and_every_5_s(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    times = []
    for _ in range(120):
        bench.run(0.1, 1)
        if bench.core.keyframe_due():
            times.append(bench.clock.monotonic)
            bench.core.keyframe({"values": {"can0/11/6041:00": "1637"}, "transfers": []})
    bench.core.shut()
    assert [later - earlier for earlier, later in pairwise(times)] == [5 * S, 5 * S]
    with open_recording(files(tmp_path)[0]) as recording:
        keyframes = list(recording.keyframes())
    assert len(keyframes) == 3
    assert keyframes[0].state["values"] == {"can0/11/6041:00": "1637"}


def test_events_come_back_with_bus_and_details_and_refuse_what_is_no_json(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.core.event(EventKind.GAP, "can0", from_ns=1, to_ns=2)
    with pytest.raises(TypeError):
        bench.core.event(EventKind.NOTE, text=b"bytes")
    bench.core.shut()
    with open_recording(files(tmp_path)[0]) as recording:
        events = list(recording.events())
    assert [(event.kind, event.bus, event.details) for event in events] == [
        (EventKind.GAP, "can0", {"from_ns": 1, "to_ns": 2})
    ]


def test_frames_beyond_the_queue_are_lost_counted_and_noted(tmp_path: Path) -> None:
    bench = Bench(tmp_path, RecorderSettings(max_queue=100))
    bench.write(100)
    surplus = bench.frames(7)
    bench.core.write(surplus)
    assert bench.core.status().lost == 7
    bench.run(0.5)
    bench.core.count_lost("can0", 3, 10, 20)
    bench.core.shut()
    assert bench.core.status().lost == 10
    assert bench.recorded() == bench.written
    with open_recording(files(tmp_path)[0]) as recording:
        losses = [event.details for event in recording.events() if event.kind is EventKind.FRAMES_LOST]
        totals = recording.totals
    assert losses == [
        {"count": 7, "from_ns": surplus[0].t_ns, "to_ns": surplus[-1].t_ns, "reason": "queue_full"},
        {"count": 3, "from_ns": 10, "to_ns": 20, "reason": "adapter"},
    ]
    assert totals is not None and totals.lost == 10


def test_a_frame_that_fits_no_message_is_counted_and_harms_no_other(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.write(5)
    bench.core.write([Frame(bench.clock.recorder.stamp(), "can0", Direction.RX, Can(1, bytes(64)))])
    bench.core.write([Frame(-1, "can0", Direction.RX, Can(1))])
    bench.write(5)
    bench.run(0.5)
    bench.core.shut()
    assert bench.recorded() == bench.written
    assert bench.core.status().lost == 2


def test_files_rotate_by_size_and_by_time_and_no_frame_falls_between(tmp_path: Path) -> None:
    by_size = Bench(tmp_path / "size", RecorderSettings(max_file_bytes=20_000))
    by_size.run(10.0, 50)
    by_size.core.shut()
    assert len(files(tmp_path / "size")) > 3
    assert all(path.stat().st_size < 40_000 for path in files(tmp_path / "size"))
    assert by_size.recorded() == by_size.written
    by_time = Bench(tmp_path / "time", RecorderSettings(max_file_s=2.0))
    by_time.run(9.0, 5)
    by_time.core.shut()
    assert len(files(tmp_path / "time")) in (4, 5)
    assert by_time.recorded() == by_time.written
    with open_recording(files(tmp_path / "time")[1]) as second:
        assert second.identity.number == 2
        assert second.info == INFO


def test_recording_stops_cleanly_when_space_is_low_and_goes_on_when_it_is_back(tmp_path: Path) -> None:
    bench = Bench(tmp_path, RecorderSettings(min_free_bytes=1000, retry_s=1.0))
    bench.run(1.0, 10)
    bench.free = 999
    bench.run(1.0, 10)
    status = bench.core.status()
    assert (status.state, status.reason, status.free_bytes) == (RecorderState.BLOCKED, BlockReason.SPACE_LOW, 999)
    assert status.frames + status.lost >= len(bench.written) - 40, "all but what the queue still holds"
    with open_recording(files(tmp_path)[0], strict=True) as recording:
        assert recording.finished
        assert [event.kind for event in recording.events()] == [EventKind.SPACE_LOW]
    bench.free = 1 << 30
    bench.run(2.0, 10)
    bench.core.shut()
    status = bench.core.status()
    assert (status.reason, status.parts) == (None, 2)
    assert status.frames + status.lost == len(bench.written)
    assert status.frames == len(bench.recorded())
    with open_recording(files(tmp_path)[1], strict=True) as recording:
        kinds = [event.kind for event in recording.events()]
    assert sorted(kind.value for kind in kinds) == ["frames_lost", "resumed"]


class BrokenDisk:
    """Stands for a disk that refuses: the system call of the sync fails while ``broken``."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.broken = False
        self._fsync = os.fsync
        monkeypatch.setattr(os, "fsync", self)

    def __call__(self, descriptor: int) -> None:
        if self.broken:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        self._fsync(descriptor)


def test_a_disk_error_is_told_and_survived(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk = BrokenDisk(monkeypatch)
    bench = Bench(tmp_path, RecorderSettings(retry_s=1.0))
    bench.run(1.0, 10)
    disk.broken = True
    bench.run(3.0, 10)
    status = bench.core.status()
    assert (status.state, status.reason) == (RecorderState.BLOCKED, BlockReason.DISK_ERROR)
    assert os.strerror(errno.EIO) in status.detail
    disk.broken = False
    bench.run(2.0, 10)
    bench.core.shut()
    status = bench.core.status()
    assert status.frames + status.lost == len(bench.written)
    assert status.lost > 0
    recover_all(tmp_path, 0)
    assert len(bench.recorded()) >= status.frames
    kinds = [event.kind for path in files(tmp_path) for event in _events(path)]
    assert EventKind.DISK_ERROR in kinds


def _events(path: Path) -> list[Event]:
    with open_recording(path) as recording:
        return list(recording.events())


def test_a_directory_that_cannot_be_made_blocks_and_does_not_raise(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    bench = Bench(tmp_path / "file" / "sub")
    bench.run(1.0, 10)
    status = bench.core.status()
    assert (status.state, status.reason, status.frames) == (RecorderState.BLOCKED, BlockReason.DISK_ERROR, 0)
    assert 0 < status.lost <= 100


def test_the_thread_records_and_ends(tmp_path: Path) -> None:
    clock = HandClock()
    with Recorder(tmp_path, INFO, clock.recorder, settings=RecorderSettings(clock_s=0.01)) as recorder:
        frames = [Frame(clock.recorder.stamp(), "can0", Direction.TX, Can(n)) for n in range(1000)]
        for frame in frames:
            recorder.write([frame])
    status = recorder.close()
    assert (status.state, status.frames, status.lost) == (RecorderState.CLOSED, 1000, 0)
    assert status.file is not None and frames_of(status.file) == frames
    recorder.write(frames)
    assert recorder.status() == status


def test_two_recordings_of_one_second_get_names_of_their_own(tmp_path: Path) -> None:
    for _ in range(3):
        Bench(tmp_path).core.shut()
    assert len(files(tmp_path)) == 3


def test_a_defect_of_the_recorder_itself_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def defect(*_: object) -> None:
        raise ZeroDivisionError("defect")

    monkeypatch.setattr(Part, "append", defect)
    recorder = Recorder(tmp_path, INFO, HandClock().recorder, settings=RecorderSettings(clock_s=0.01))
    recorder.write([Frame(1, "can0", Direction.TX, Can(1))])
    status = recorder.close()
    assert (status.state, status.reason) == (RecorderState.FAILED, BlockReason.DEFECT)
    recorder.write([Frame(2, "can0", Direction.TX, Can(1))])
    assert recorder.status().lost >= 1
