"""Indexes are made in a process of their own, one at a time; parts that a recorder has closed get theirs."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from time import monotonic_ns, time_ns

import pytest

from app.recording.content import RecorderClock
from app.recording.index import index_path, open_index
from app.recording.index.__main__ import QUIETLY
from app.service.indexing import Indexing, IndexJob, IndexState, PartWatch
from app.service.journal import Journal
from app.service.recording import Recording, Subject
from app.wire.frame import Can, Direction, Frame, Stamper
from tests.recording.index_rig import SCENARIOS

TIMEOUT_S = 60.0


@pytest.fixture
def indexing() -> Iterator[Indexing]:
    made = Indexing()
    yield made
    made.close()


def copy(number: int, folder: Path) -> Path:
    target = folder / f"{number}.mcap"
    shutil.copy(SCENARIOS[number - 1], target)
    return target


def test_one_that_is_waited_for_is_made_with_its_progress(indexing: Indexing, tmp_path: Path) -> None:
    path = copy(3, tmp_path)
    job = indexing.now(path)
    assert indexing.now(path) is job
    assert job.wait(TIMEOUT_S) is IndexState.DONE
    assert job.share == 1.0
    found = open_index(path)
    assert found is not None
    found.close()


def test_what_is_waited_for_comes_before_what_can_wait(indexing: Indexing, tmp_path: Path) -> None:
    first, second, third = (copy(number, tmp_path) for number in (1, 2, 3))
    running, waiting = indexing.later(first), indexing.later(second)
    urgent = indexing.now(third)
    assert urgent.wait(TIMEOUT_S) is IndexState.DONE
    assert not waiting.state.ended
    assert waiting.wait(TIMEOUT_S) is IndexState.DONE
    assert running.state.ended
    assert indexing.later(first).wait(TIMEOUT_S) is IndexState.DONE, "it made way, and was made later all the same"
    assert {path.name for path in tmp_path.iterdir()} == {f"{n}.mcap{end}" for n in (1, 2, 3) for end in ("", ".index")}


def test_one_that_is_given_up_leaves_nothing_behind(indexing: Indexing, tmp_path: Path) -> None:
    path = copy(1, tmp_path)
    job = indexing.now(path)
    waiting = indexing.now(copy(2, tmp_path))
    waiting.cancel()
    assert waiting.wait(0) is IndexState.CANCELLED
    job.cancel()
    assert job.wait(TIMEOUT_S) is IndexState.CANCELLED
    assert sorted(one.name for one in tmp_path.iterdir()) == ["1.mcap", "2.mcap"]
    assert indexing.now(path).wait(TIMEOUT_S) is IndexState.DONE, "asked again, it is made"


def test_closing_gives_up_what_is_left(tmp_path: Path) -> None:
    indexing = Indexing()
    jobs = [indexing.later(copy(number, tmp_path)) for number in (1, 2)]
    indexing.close()
    assert [job.wait(TIMEOUT_S) for job in jobs] == [IndexState.CANCELLED] * 2
    assert indexing.now(tmp_path / "1.mcap").state is IndexState.CANCELLED
    assert sorted(one.name for one in tmp_path.iterdir()) == ["1.mcap", "2.mcap"]


def test_what_cannot_be_read_fails_with_its_reason(indexing: Indexing, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.mcap"
    wrong.write_bytes(b"no recording")
    job = indexing.now(wrong)
    assert job.wait(TIMEOUT_S) is IndexState.FAILED
    assert job.error is not None
    assert job.error.details["file"] == "wrong.mcap"
    assert indexing.now(copy(3, tmp_path)).wait(TIMEOUT_S) is IndexState.DONE, "the next one is made"


def test_one_that_has_its_index_is_not_made_again(indexing: Indexing, tmp_path: Path) -> None:
    path = copy(3, tmp_path)
    assert indexing.now(path).wait(TIMEOUT_S) is IndexState.DONE
    made_ns = index_path(path).stat().st_mtime_ns
    assert indexing.later(path).wait(TIMEOUT_S) is IndexState.DONE
    assert index_path(path).stat().st_mtime_ns == made_ns


def test_what_can_wait_leaves_the_processor_to_all_others(indexing: Indexing, tmp_path: Path) -> None:
    job = indexing.later(copy(1, tmp_path))
    while job.share == 0 and not job.state.ended:
        job.wait(0.01)
    process = job._process
    assert process is not None
    assert os.sched_getscheduler(process.pid) == os.SCHED_IDLE
    assert os.getpriority(os.PRIO_PROCESS, process.pid) >= 10
    assert QUIETLY.startswith("--")
    job.cancel()


def test_a_part_is_told_when_it_is_complete() -> None:
    told: list[Path] = []
    parts = PartWatch(told.append)
    first, second = Path("a-001.mcap"), Path("a-002.mcap")
    for file in (None, first, first, second, second, None, None):
        parts.look(file)
    assert told == [first, second]
    PartWatch(None).look(first)


def test_a_recording_that_has_ended_gets_its_index(indexing: Indexing, tmp_path: Path) -> None:
    stamper = Stamper(time_ns(), monotonic_ns)
    jobs: list[IndexJob] = []
    subject = Subject("wtg-07", "ada", {"can0": 500_000}, {}, ())
    clock = RecorderClock(monotonic_ns, time_ns, stamper)
    recording = Recording(
        tmp_path, subject, Journal(stamper, "ada"), clock, lambda path: jobs.append(indexing.later(path))
    )
    recording.watch(lambda: (stamper(), {}))
    recording.recorder.write([Frame(stamper(), "can0", Direction.RX, Can(0x70B, b"\x05")) for _ in range(50)])
    assert jobs == []
    recording.stop()
    (job,) = jobs
    assert job.wait(TIMEOUT_S) is IndexState.DONE
    index = open_index(job.path)
    assert index is not None
    with index:
        assert index.frames == 50
