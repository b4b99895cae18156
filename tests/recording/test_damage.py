"""Damaged and cut files: never a crash, never a wrong frame, and the damage is told."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.errors import RecordingError
from app.recording.chunks import COMPRESSION, MAX_CHUNK_BYTES, partial_data
from app.recording.content import AttachedFile
from app.recording.reader import open_recording
from app.recording.recover import RecoveryKind, recover, recover_all
from app.wire.frame import Frame
from bench._traffic import traffic
from tests.recording.rig import START_NS, by_mcap, frames_of, record

FRAMES = 6000


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, list[Frame]]:
    frames = traffic(FRAMES, start_ns=START_NS)
    attached = [AttachedFile("oat-pmc.toml", "application/toml", bytes(range(256)) * 8)]
    return record(tmp_path_factory.mktemp("original"), frames, attached).read_bytes(), frames


def is_part_of(some: list[Frame], frames: list[Frame]) -> bool:
    rest = iter(frames)
    return all(frame in rest for frame in some)


flips = st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(1, 255)), max_size=4)
zeroed = st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 3000))


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.one_of(st.just(1.0), st.floats(0, 1)), flips, zeroed)
def test_whatever_happens_to_the_bytes(
    original: tuple[bytes, list[Frame]],
    tmp_path_factory: pytest.TempPathFactory,
    cut: float,
    flipped: list[tuple[float, int]],
    hole: tuple[float, int],
) -> None:
    whole, frames = original
    data = bytearray(whole[: round(cut * len(whole))])
    for where, mask in flipped:
        if data:
            data[int(where * len(data))] ^= mask
    start = int(hole[0] * len(data))
    data[start : start + hole[1]] = bytes(len(data[start : start + hole[1]]))
    path = tmp_path_factory.mktemp("damaged") / "d-001.mcap"
    path.write_bytes(data)
    try:
        with open_recording(path) as recording:
            got = list(recording.frames())
            list(recording.clocks()), list(recording.keyframes()), list(recording.events()), recording.attachments()
            damages = recording.damages
            finished = recording.finished
    except RecordingError as error:
        assert error.details["file"] == path.name
        return
    assert is_part_of(got, frames)
    assert len(got) == len(frames) or damages or not finished
    assert all(damage.length > 0 and 0 <= damage.offset < len(data) for damage in damages)
    recovery = recover(path, 0)
    if recovery is not None and recovery.kind is not RecoveryKind.SET_ASIDE:
        again = frames_of(path)
        assert again == got
        assert recovery.frames == len(got)
        assert sum(topic == "/can0" for topic, _, _ in by_mcap(path)) == len(got)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.01, 0.1, 0.37, 0.5, 0.9, 0.999, 0.99999])
def test_a_cut_file_keeps_every_whole_chunk_and_every_byte(
    original: tuple[bytes, list[Frame]], tmp_path: Path, share: float
) -> None:
    whole, frames = original
    path = tmp_path / "cut-001.mcap"
    cut = whole[: int(share * len(whole))]
    path.write_bytes(cut)
    (recovery,) = recover_all(tmp_path, 7)
    if recovery.kept_aside is not None:
        tail = recovery.kept_aside.read_bytes()
        assert cut.endswith(tail)
        kept = b"" if recovery.kind is RecoveryKind.SET_ASIDE else path.read_bytes()[: len(cut) - len(tail)]
        assert kept + tail == cut, "no original byte is lost"
    if recovery.kind is RecoveryKind.SET_ASIDE:
        return
    with open_recording(path, strict=True) as recording:
        got = list(recording.frames())
        assert recording.metadata["recovery"]["recovered_ns"] == "7"
        assert recording.metadata["recovery"]["frames"] == str(len(got))
    assert got == frames[: len(got)]
    assert recover_all(tmp_path, 8) == []


def test_strict_reading_names_the_offset_and_what_is_left(original: tuple[bytes, list[Frame]], tmp_path: Path) -> None:
    whole, _ = original
    path = tmp_path / "cut-001.mcap"
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RecordingError) as caught:
        open_recording(path, strict=True)
    details = caught.value.details
    assert details["offset"] == details["recovered_bytes"] > 0
    with open_recording(path) as recording:
        assert not recording.finished
        assert details["recovered_frames"] == len(list(recording.frames())) > 0


def test_a_chunk_damaged_in_the_middle_costs_that_chunk_alone(
    original: tuple[bytes, list[Frame]], tmp_path: Path
) -> None:
    whole, frames = original
    path = tmp_path / "hit-001.mcap"
    data = bytearray(whole)
    mark = whole.index(b"\x04\x00\x00\x00zstd", len(whole) // 2)
    while int.from_bytes(whole[mark - 36 : mark - 28], "little") < 5000:  # a chunk of frames is longer than others
        mark = whole.index(b"\x04\x00\x00\x00zstd", mark + 1)
    data[mark + 100] ^= 0x40
    path.write_bytes(data)
    with open_recording(path) as recording:
        got = list(recording.frames())
        assert [damage.offset for damage in recording.damages] == [mark - 37]
    assert is_part_of(got, frames)
    assert len(frames) - 2500 <= len(got) < len(frames)
    with pytest.raises(RecordingError), open_recording(path, strict=True) as recording:
        list(recording.frames())


@pytest.mark.parametrize("content", [b"", b"\x89MCAP", b"no recording at all", bytes(100)])
def test_what_is_no_recording_is_refused_and_put_aside(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x-001.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError) as caught:
        open_recording(path)
    assert caught.value.details["offset"] == 0
    (recovery,) = recover_all(tmp_path, 0)
    assert recovery.kind is RecoveryKind.SET_ASIDE
    assert recovery.kept_aside is not None and recovery.kept_aside.read_bytes() == content


def test_a_missing_file_is_an_error_of_its_own_words(tmp_path: Path) -> None:
    with pytest.raises(RecordingError):
        open_recording(tmp_path / "none.mcap")


def test_a_crash_while_the_repaired_copy_takes_the_name_is_made_good(
    original: tuple[bytes, list[Frame]], tmp_path: Path
) -> None:
    whole, frames = original
    (tmp_path / "r-001.mcap.recovering").write_bytes(whole)
    (tmp_path / "r-001.mcap.damaged").write_bytes(b"the original")
    assert recover_all(tmp_path, 0) == []
    assert frames_of(tmp_path / "r-001.mcap") == frames


def test_the_beginning_of_a_chunk_that_swells_beyond_measure_is_left_alone() -> None:
    packed = zstandard.compress(bytes(4 * MAX_CHUNK_BYTES))
    tracemalloc.start()
    try:
        assert partial_data(packed[:-4], COMPRESSION) == b""
        assert tracemalloc.get_traced_memory()[1] < 2.5 * MAX_CHUNK_BYTES
    finally:
        tracemalloc.stop()
    assert partial_data(zstandard.compress(bytes(1 << 20))[:-4], COMPRESSION).strip(b"\0") == b""
    assert len(partial_data(zstandard.compress(bytes(1 << 20)), COMPRESSION)) == 1 << 20
