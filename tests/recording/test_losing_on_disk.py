"""A disk that refuses at any byte: all that is missing is counted by bus, and nothing that was noted is forgotten."""

from __future__ import annotations

import random
import resource
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.recording.content import EventKind
from app.recording.reader import open_recording
from app.recording.recover import recover_all
from app.recording.writer import BlockReason, RecorderSettings, RecorderState
from app.wire.frame import Can, Direction, Frame
from tests.e2e.conftest import Twins, twins
from tests.recording.rig import Bench, by_mcap, files, frames_of
from tests.soak.filling import MOST_LEFT_BYTES, SPACE_LOW_BYTES, fill_often

__all__ = ["twins"]
BUSES = ("can0", "can1", "can2")


@contextmanager
def refusing_beyond(size_bytes: int) -> Iterator[None]:
    """The system takes no byte of any file beyond ``size_bytes``."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def run(bench: Bench, rounds: int, notes: list[int]) -> None:
    """Frames of three buses, one that fits no message among them, and a note, every 100 ms."""
    for _ in range(rounds):
        for bus in BUSES:
            bench.write(7, bus)
        bench.core.write([Frame(bench.clock.recorder.stamp(), "can1", Direction.RX, Can(1, bytes(64)))])
        notes.append(len(notes))
        bench.core.event(EventKind.NOTE, number=notes[-1])
        bench.run(0.1)


@pytest.mark.parametrize("seed", range(12))
def test_every_frame_is_in_a_file_or_counted_for_its_bus(tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    bench = Bench(tmp_path, RecorderSettings(min_free_bytes=0, retry_s=0.5))
    notes: list[int] = []
    run(bench, 5, notes)
    for _ in range(3):
        (at_work,) = files(tmp_path)[-1:]
        with refusing_beyond(at_work.stat().st_size + chance.randrange(2500)):
            while bench.core.status().state is RecorderState.RECORDING:
                run(bench, 1, notes)
            status = bench.core.status()
            assert status.reason is BlockReason.DISK_ERROR and status.detail
            run(bench, chance.randrange(12), notes)
        while bench.core.status().state is RecorderState.BLOCKED:
            run(bench, 1, notes)
        run(bench, 6, notes)
    bench.core.shut()
    recover_all(tmp_path, 0)

    recorded, lost, noted = [], Counter[str](), []
    for path in files(tmp_path):
        recorded += frames_of(path)
        assert sum(topic in ("/can0", "/can1", "/can2") for topic, _, _ in by_mcap(path)) == len(frames_of(path))
        with open_recording(path, strict=True) as recording:
            for event in recording.events():
                if event.kind is EventKind.FRAMES_LOST:
                    lost[event.bus] += event.details["count"]
                elif event.kind is EventKind.NOTE:
                    noted.append(event.details["number"])
    status = bench.core.status()
    assert status.frames == len(recorded)
    invalid = len(notes)
    assert status.frames + status.lost == len(bench.written) + invalid
    assert lost.total() == status.lost
    rest = iter(bench.written)
    assert all(frame in rest for frame in recorded), "nothing is recorded twice, or in another order"
    for bus in BUSES:
        sent = sum(frame.bus == bus for frame in bench.written)
        kept = sum(frame.bus == bus for frame in recorded)
        blocked_invalid = invalid - lost[""] if bus == "can1" else 0
        assert kept + lost[bus] == sent + blocked_invalid
    assert sorted(noted) == notes


@pytest.mark.timeout(600)
async def test_a_full_disk_stops_the_recording_of_a_served_turbine_and_nothing_else(
    twins: Twins, tmp_path: Path
) -> None:
    fresh = random.SystemRandom().randrange(MOST_LEFT_BYTES)
    print(f"fresh number {fresh}:", await fill_often(twins, tmp_path, [SPACE_LOW_BYTES, fresh]))
