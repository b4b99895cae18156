"""The file of an index: used only where it is whole and of this very recording; made, given up and made at once."""

from __future__ import annotations

import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from app.errors import RecordingError
from app.recording.index import CancelledError, build_index, index_path, open_index
from app.recording.index.file import IndexWriter
from app.recording.reader import open_recording
from tests.recording.index_rig import SCENARIOS, built, descriptions_of
from tests.recording.rig import Bench

COMMAND = (sys.executable, "-m", "app.recording.index")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A short recording."""
    bench = Bench(tmp_path)
    bench.run(3, per_step=20)
    bench.core.shut()
    return next(tmp_path.glob("*.mcap"))


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_it_lies_beside_the_recording_and_is_found_again(recording: Path) -> None:
    assert open_index(recording) is None
    with built(recording) as index:
        assert index.path == index_path(recording) == recording.with_name(recording.name + ".index")
        assert index.frames == 600
    again = open_index(recording)
    assert again is not None
    with again:
        assert again.frames == 600
    assert names(recording.parent) == [recording.name, recording.name + ".index"]


def test_it_is_stale_when_the_recording_has_changed(recording: Path) -> None:
    built(recording).close()
    whole = recording.read_bytes()
    for changed in (whole + b"\0", whole[:-1], b"\1" + whole[1:], whole[:-9] + b"\1" + whole[-8:]):
        recording.write_bytes(changed)
        assert open_index(recording) is None
    recording.write_bytes(whole)
    found = open_index(recording)
    assert found is not None
    found.close()


def test_it_is_made_of_a_file_that_still_grows_and_stale_as_soon_as_it_has(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.run(2, per_step=10)
    path = next(tmp_path.glob("*.mcap"))
    with built(path) as index:
        assert 150 <= index.frames <= 200
    bench.run(1, per_step=10)
    assert open_index(path) is None
    bench.core.shut()
    with built(path) as index:
        assert index.frames == 300


def test_one_of_another_schema_is_not_used(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.recording.index.file.SCHEMA", 0)
    with pytest.raises(RecordingError):
        built(recording)
    assert index_path(recording).exists()
    monkeypatch.undo()
    assert open_index(recording) is None
    built(recording).close()


def test_a_damaged_one_is_never_trusted_and_made_anew(recording: Path) -> None:
    built(recording).close()
    place = index_path(recording)
    whole, chance = place.read_bytes(), random.Random(5)
    for _ in range(60):
        at = chance.randrange(len(whole))
        place.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << chance.randrange(8)]) + whole[at + 1 :])
        assert open_index(recording) is None
    for damaged in (b"", b"SQLite format 3\0", whole[: len(whole) // 2], os.urandom(5000), whole + b"\0"):
        place.write_bytes(damaged)
        assert open_index(recording) is None
    with built(recording) as index:
        assert index.frames == 600


def test_one_that_is_taken_away_while_open_gives_its_answers_or_a_recording_error(recording: Path) -> None:
    with built(recording) as index:
        size = index.path.stat().st_size
        os.truncate(index.path, size // 8)
        with pytest.raises(RecordingError):
            for at_ns in range(*index.span_ns, 10**8):
                index.keyframe(at_ns)
                index.events()
                index.load()
                index.signals()
                index.gaps()


def test_giving_up_leaves_nothing_behind(recording: Path) -> None:
    asked = iter([False, False, True])
    with pytest.raises(CancelledError):
        build_index(recording, descriptions_of(recording), cancelled=lambda: next(asked))
    assert names(recording.parent) == [recording.name]


def test_progress_goes_from_nothing_to_all(recording: Path) -> None:
    shares: list[float] = []
    built(recording, on_progress=shares.append).close()
    assert shares == sorted(shares)
    assert 0 <= shares[0] < 0.5
    assert shares[-1] == 1.0


def test_a_full_disk_is_told_and_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / SCENARIOS[0].name
    shutil.copy(SCENARIOS[0], path)

    limited = "import resource, runpy; resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))"
    run = f"{limited}; runpy.run_module('app.recording.index', run_name='__main__')"
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", run, str(path)], stdin=pipe, stdout=pipe, stderr=pipe, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        lines, errors = process.stdout.read(), process.stderr.read()
    assert process.returncode == 1
    assert '"reason"' in lines.splitlines()[-1]
    assert errors == ""
    assert names(tmp_path) == [path.name]


def test_what_a_killed_process_has_left_goes_with_the_next_one(tmp_path: Path) -> None:
    path = tmp_path / SCENARIOS[0].name
    shutil.copy(SCENARIOS[0], path)
    with subprocess.Popen([*COMMAND, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert '"share"' in process.stdout.readline()
        process.send_signal(signal.SIGKILL)
    left = [name for name in names(tmp_path) if name.endswith(".part")]
    assert len(left) == 1
    with IndexWriter(index_path(path)) as writer:
        assert names(tmp_path) == [path.name, writer.part.name]
        with IndexWriter(index_path(path)):  # what somebody is at work on stays
            assert writer.part.exists()
    assert names(tmp_path) == [path.name]


def test_two_at_once_do_not_disturb_each_other(recording: Path) -> None:
    with subprocess.Popen([*COMMAND, str(recording)], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline()  # it is at work now
        for _ in range(3):
            with built(recording) as index:
                assert index.frames == 600
        output = process.stdout.read()  # to its end with its input open: that it closes would be a cancel
        assert output.splitlines()[-1] == b'{"done": true}'
    found = open_index(recording)
    assert found is not None
    found.close()
    assert names(recording.parent) == [recording.name, recording.name + ".index"]


def test_where_the_folder_takes_no_index_it_lies_in_the_cache(recording: Path, tmp_path: Path) -> None:
    """A name that is as long as a name may be leaves no room for one beside it, whoever asks."""
    long = recording.with_name("x" * 250 + ".mcap")
    recording.rename(long)
    with pytest.raises(RecordingError):
        built(long)
    cache = tmp_path / "cache" / "indexes"
    with built(long, cache=cache) as index:
        assert index.path.parent == cache
    found = open_index(long, cache)
    assert found is not None
    found.close()
    other = long.parent / "elsewhere" / long.name
    other.parent.mkdir()
    shutil.copy(long, other)
    assert open_index(other, cache) is None, "the same name in another folder is another recording"


def test_a_file_that_is_no_recording_has_no_index(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.mcap"
    wrong.write_bytes(b"no recording")
    with pytest.raises(RecordingError):
        build_index(wrong, {})
    with pytest.raises(RecordingError):
        build_index(tmp_path / "none.mcap", {})
    assert open_index(tmp_path / "none.mcap") is None
    assert names(tmp_path) == ["wrong.mcap"]


def test_one_without_frames_has_an_empty_index(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    bench.run(0.5)
    bench.core.shut()
    path = next(tmp_path.glob("*.mcap"))
    with open_recording(path) as recording:
        assert recording.span_ns is None
    with built(path) as index:
        assert index.frames == 0
        assert index.signals() == []
        assert index.keyframe(1 << 62) is None


def test_the_file_is_plain_sqlite(recording: Path) -> None:
    with built(recording) as index:
        database = sqlite3.connect(index.path)
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        database.close()
