"""A recording process that is killed, and what its system calls show."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from app.recording.file_lock import lock_file
from app.recording.reader import open_recording
from app.recording.recover import recover, recover_all
from app.recording.scan import map_file, scan, unmap
from tests.recording.recording_process import BATCH
from tests.recording.rig import S, by_mcap, files, frames_of

ROOT = Path(__file__).resolve().parents[2]
KILLS = 20
AT_ONCE = 2
START_TIMEOUT_S = 30.0
MAX_LOSS_NS = S // 2


def command(directory: Path, progress: Path, *more: str) -> list[str]:
    progress.write_bytes(bytes(8))
    return [sys.executable, "-m", "tests.recording.recording_process", str(directory), str(progress), *more]


def handed_over(progress: Path) -> int:
    return int.from_bytes(progress.read_bytes(), "little")


def kill_after(directory: Path, delay_s: float) -> int:
    """Starts a recording and kills it that long after its first frame; the time stamp of the last frame handed over."""
    directory.mkdir()
    progress = directory / "progress"
    with subprocess.Popen(command(directory, progress), cwd=ROOT) as process:
        try:
            deadline = time.monotonic() + START_TIMEOUT_S
            while not handed_over(progress):
                assert process.poll() is None and time.monotonic() < deadline, "the recording did not start"
            with pytest.raises(subprocess.TimeoutExpired):
                process.wait(delay_s)
        finally:
            process.send_signal(signal.SIGKILL)
    return handed_over(progress)


def test_a_kill_at_any_moment_costs_half_a_second_at_most(tmp_path: Path) -> None:
    chance = random.Random(20)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        runs = [pool.submit(kill_after, tmp_path / str(n), chance.uniform(0.0, 1.6)) for n in range(KILLS)]
        last_handed_over = [run.result() for run in runs]
    for n, last_ns in enumerate(last_handed_over):
        directory = tmp_path / str(n)
        (recovery,) = recover_all(directory, last_ns)
        (path,) = files(directory)
        frames = frames_of(path)
        assert len(frames) == recovery.frames
        numbers = [int.from_bytes(frame.payload.data, "little") for frame in frames]
        assert numbers == [k // BATCH * BATCH for k in range(len(frames))], "nothing is missing before the end"
        first_ns = frames[0].t_ns if frames else last_ns
        end_ns = frames[-1].t_ns if frames else first_ns
        assert last_ns - end_ns <= MAX_LOSS_NS
        assert sum(topic == "/can0" for topic, _, _ in by_mcap(path)) == len(frames)
        assert recover_all(directory, last_ns) == []


@pytest.fixture(scope="module")
def traced(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, list[str]]]:
    """A recording of about 2 s that ended by itself, and its system calls."""
    assert shutil.which("strace"), "strace is missing: make system installs it"
    directory = tmp_path_factory.mktemp("traced")
    trace = directory / "trace"
    options = ["strace", "-f", "-y", "-e", "trace=write,fsync,fdatasync", "-s", "16", "-xx", "-o", str(trace)]
    subprocess.run([*options, *command(directory, directory / "progress", "300")], cwd=ROOT, check=True, timeout=60)
    (path,) = files(directory)
    yield path, [line for line in trace.read_text().splitlines() if f"{path.name.encode().hex()}" in _plain(line)]


def _plain(line: str) -> str:
    """The line with paths as hexadecimal digits, as ``-xx`` writes them or not."""
    return re.sub(r"\\x([0-9a-f]{2})", r"\1", line) + line.encode().hex()


def test_each_chunk_is_written_by_one_call_and_synced_by_one_call(traced: tuple[Path, list[str]]) -> None:
    path, calls = traced
    data = map_file(path)
    try:
        chunks = len(scan(data, path.name).summary.chunks)
    finally:
        unmap(data)
    names = ["sync" if "sync(" in call else "chunk" if r', "\x06\x' in call else "other" for call in calls]
    assert names.count("chunk") == chunks >= 6
    for n, name in enumerate(names):
        if name == "chunk":
            assert names[n + 1] == "sync"
    assert names.count("sync") == chunks + 1, "one a chunk, and one when the file is closed"


def test_a_recording_at_work_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "at-work-001.mcap"
    path.write_bytes(b"\x89MCAP0\r\n")
    with path.open("r+b") as file:
        lock_file(file)
        assert recover(path, 0) is None
    assert recover(path, 0) is not None


def test_a_disk_that_refuses_the_recovery_leaves_the_file_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from app.errors import RecordingError
    from tests.recording.rig import Bench

    bench = Bench(tmp_path)
    bench.run(2.0, 10)
    original = files(tmp_path)[0].read_bytes() + b"\x06half a chunk"
    copy = tmp_path / "copy" / "cut-001.mcap"
    copy.parent.mkdir()
    copy.write_bytes(original)
    bench.core.shut()

    def refuse(_: int) -> None:
        raise OSError(5, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", refuse)
        with pytest.raises(RecordingError):
            recover(copy, 0)
    assert copy.read_bytes().startswith(original[:-13])
    assert recover(copy, 0) is not None
    with open_recording(copy, strict=True) as recording:
        assert list(recording.frames()) == bench.written[: len(list(recording.frames()))]
