"""Columns out of files that are cut, damaged or read in part, and what becomes of bytes of any length."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from app.errors import RecordingError
from app.model.address import Address
from app.model.datatypes import DataType
from app.recording.columns import Signal, can_columns, samples
from app.recording.columns.pool import mapped_ahead
from app.recording.columns.values import Gathered, Samples
from app.recording.reader import Recording, open_recording
from app.wire.frame import Frame
from app.wire.records import Source
from bench._traffic import traffic
from tests.recording.rig import START_NS, record
from tests.recording.test_columns import SCENARIOS, described, streamed, values

POSITION = Signal("can0", 11, Address(0x6064))


def frames_by_columns(recording: Recording, start_ns: int | None = None, end_ns: int | None = None) -> list[Frame]:
    return [
        columns.frame(row)
        for columns in can_columns(recording, start_ns=start_ns, end_ns=end_ns)
        for row in range(columns.frames)
    ]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return record(tmp_path_factory.mktemp("whole"), traffic(12_000, start_ns=START_NS)).read_bytes()


@pytest.mark.parametrize("share", [0.02, 0.3, 0.61, 0.97])
def test_a_recording_cut_off_gives_the_same_frames(whole: bytes, tmp_path: Path, share: float) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(whole[: int(share * len(whole))])
    with open_recording(path) as recording:
        frames = list(recording.frames())
        assert frames_by_columns(recording) == frames
        assert recording.damages
    assert len(frames) >= (share - 0.2) * 12_000


def test_a_damaged_chunk_is_left_out_and_named(whole: bytes, tmp_path: Path) -> None:
    data = bytearray(whole)
    mark = whole.index(b"\x04\x00\x00\x00zstd", len(whole) // 2)
    while int.from_bytes(whole[mark - 36 : mark - 28], "little") < 5000:  # a chunk of frames is longer than others
        mark = whole.index(b"\x04\x00\x00\x00zstd", mark + 1)
    data[mark + 200] ^= 0x10
    path = tmp_path / "hit.mcap"
    path.write_bytes(data)
    with open_recording(path) as recording:
        frames = frames_by_columns(recording)
        assert [damage.offset for damage in recording.damages] == [mark - 37]
    with open_recording(path) as recording:
        assert frames == list(recording.frames())
    assert 0 < len(frames) < 12_000
    with pytest.raises(RecordingError) as caught, open_recording(path, strict=True) as recording:
        frames_by_columns(recording)
    assert caught.value.details["offset"] == mark - 37


def test_a_stretch_of_time_gives_what_is_in_it() -> None:
    """Values from a time on are decoded by what the keyframe before it knows: the same as from the beginning."""
    descriptions = described(["can0"])
    with open_recording(SCENARIOS / "7-service-visit.mcap") as recording:
        frames = list(recording.frames())
        start_ns, end_ns = frames[len(frames) // 3].t_ns, frames[len(frames) * 2 // 3].t_ns
        assert frames_by_columns(recording, start_ns, end_ns) == [f for f in frames if start_ns <= f.t_ns < end_ns]
        seen = streamed(frames, descriptions)
        found = samples(recording, list(seen), descriptions, start_ns, end_ns)
    for signal, all_values in seen.items():
        assert values(found[signal]) == [value for value in all_values if start_ns <= value[0] < end_ns], signal


def test_one_signal_by_path_and_one_that_is_not_there() -> None:
    path, other = SCENARIOS / "3-following-error.mcap", Signal("modbus0", 1, Address(0x6064))
    descriptions = described(["can0"])
    found = samples(path, [POSITION, other], descriptions)
    with open_recording(path) as recording:
        seen = streamed(recording.frames(), descriptions)
    assert values(found[POSITION]) == seen[POSITION]
    assert found[POSITION].raw.dtype == np.int64
    assert found[other].values == 0


def gathered(*pieces: bytes) -> Gathered:
    """Values that came as these bytes, one block each two."""
    found = Gathered()
    for n, data in enumerate(pieces):
        found.add_one(1 - n % 2, 100 - n % 2 + n // 2 * 10, data, Source.SDO_READ)
        if n % 2:
            found.next_block()
    found.next_block()
    return found


def shown(found: Samples) -> list[bytes]:
    return [found.data(n) for n in range(found.values)]


def test_bytes_of_any_length_come_back() -> None:
    pieces = (b"\xff", b"\xfe\xff", b"", b"123456789", b"\x80" * 8, b"\0\0\0\x80")
    swapped = [pieces[1], pieces[0], pieces[3], pieces[2], pieces[5], pieces[4]]
    for data_type in (None, DataType.INTEGER16, DataType.UNSIGNED32, DataType.REAL32, DataType.VISIBLE_STRING):
        assert shown(gathered(*pieces).samples(data_type)) == swapped, data_type
    signed = gathered(*pieces).samples(DataType.INTEGER32)
    assert signed.raw.tolist() == [-2, -1, 0, 0, -(1 << 31), int.from_bytes(b"\x80" * 8, "little", signed=True)]
    assert signed.size.tolist() == [2, 1, 255, 0, 4, 8]
    assert gathered(*pieces).samples(None).raw.tolist()[:2] == [0xFFFE, 0xFF]
    late = gathered(*pieces).samples(DataType.INTEGER32, start_ns=105)
    assert shown(late) == swapped[2:]


def test_floating_point_numbers_keep_their_bytes_where_they_are_none() -> None:
    pieces = (np.float32(1.5).tobytes(), b"\x01\0\xc0\x7f", b"\0\0", np.float32(-2.25).tobytes())
    found = gathered(*pieces).samples(DataType.REAL32)
    assert shown(found) == [pieces[1], pieces[0], pieces[3], pieces[2]]
    assert found.raw.tolist()[1:3] == [1.5, -2.25]
    assert np.isnan(found.raw[[0, 3]]).all()


def test_the_pool_keeps_order_and_does_not_run_ahead() -> None:
    done: defaultdict[str, int] = defaultdict(int)

    def work(task: int) -> int:
        done["work"] += 1
        return task * task

    def given() -> Iterator[int]:
        for task in range(50):
            done["given"] += 1
            yield task

    results = mapped_ahead(work, given(), 3)
    assert next(results) == 0
    assert done["given"] <= 6
    assert list(results) == [task * task for task in range(1, 50)]


def test_an_error_in_the_pool_reaches_the_reader_and_ends_its_threads() -> None:
    def work(task: int) -> int:
        if task == 7:
            raise ValueError("seven")
        return task

    found = []
    with pytest.raises(ValueError, match="seven"):
        for result in mapped_ahead(work, range(30), 2):
            found.append(result)
    assert found == list(range(7))
