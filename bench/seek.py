"""Seeks in a long recording: the first picture of an indexed file, and the state at random times.

The recording is of one full bus of 1 Mbit/s, as the recorder writes it, with the recorder's own keyframes every 5 s.
The peer seeks as one does without an index of ours: the mcap library finds the last message of ``/state`` before the
time by the file's indexes, then gives the frames since. Both decode them into a live state; both must hold the same
values.
"""

from __future__ import annotations

import json
import random
import statistics
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

from mcap.reader import SeekingReader

from app.cli.runtime import spare_collector
from app.model.address import Address
from app.model.description_file import load_builtin
from app.recording.cdr import decode_can_payload, decode_texts
from app.recording.content import RecorderClock, RecordingInfo
from app.recording.index import Course, RecordingIndex, build_index, course_at, index_path, open_index
from app.recording.index.course import Descriptions
from app.recording.reader import open_recording
from app.recording.writer import RecorderCore, RecorderSettings
from app.wire.can_bits import frame_bits
from app.wire.frame import STAMP_STEP_NS, Direction, Frame
from app.wire.memory import Reading
from bench import _load
from bench._priority import preferred
from bench._result import Result

BUS: Final = "can0"
BIT_NS: Final = 1000  # 1 Mbit/s
START_NS: Final = 1_750_000_000_000_000_000
CYCLE_NS: Final = 100_000_000
SHORT_FRAMES: Final = 600_000
FULL_SECONDS: Final = 3600
KEYFRAME_NS: Final = 6_000_000_000  # one comes every 5 s
FIRST_PICTURE_S: Final = 0.5
SEEK_P99_S: Final = 0.1
TARGET: Final = 2.0
PICTURES: Final = 7
PEER_SEEKS: Final = 12
POINTS: Final = 2000
SIGNAL: Final = (BUS, 11, Address(0x6064))
CACHE: Final = Path(__file__).resolve().parent.parent / ".cache" / "bench" / "seek"
VERSION: Final = 1
"""Of the generated recording: raised with what is generated below."""


class Taken(NamedTuple):
    """Time taken in s: of the processor, and by the clock."""

    cpu_s: float
    clock_s: float


def described() -> Descriptions:
    """What stands on the bus."""
    kinds = ((_load.PMM_NODES, load_builtin("oat-pmm")), (_load.PMC_NODES, load_builtin("oat-pmc")))
    return {(BUS, node): description for nodes, description in kinds for node in nodes}


def run(full: bool) -> Result:
    """About a minute and a half of the bus, or an hour."""
    path = prepare(None if full else SHORT_FRAMES)
    descriptions = described()
    lines = [_size(path)]
    with open_recording(path) as recording:
        span = recording.span_ns
        if span is None:
            raise RuntimeError("nothing was recorded")
    chance = random.Random(7)
    times = [chance.randrange(*span) for _ in range(300 if full else 100)]
    spare_collector()  # as the server does, for both
    with preferred():
        pictures = [_timed(partial(_picture, path, descriptions, t_ns)) for t_ns in times[:PICTURES]]
        ours = _our_seeks(path, descriptions, times)
        peers = _peer_seeks(path, descriptions, times[:PEER_SEEKS])
    _same_values(path, descriptions, times[:3])
    lines.append(f"first picture of the indexed file: {_told(pictures)}")
    lines.append(f"seek: {_told(ours)}")
    lines.append(f"mcap: {_told(peers)}")
    first, p99 = _p99(pictures), _p99(ours)
    short = []
    if first > FIRST_PICTURE_S:
        short.append(f"first picture {_ms(first)}, at most {_ms(FIRST_PICTURE_S)}")
    if p99 > SEEK_P99_S:
        short.append(f"p99 of a seek {_ms(p99)}, at most {_ms(SEEK_P99_S)}")
    return Result(_p99(peers) / p99, TARGET, tuple(lines), tuple(short))


def _size(path: Path) -> str:
    with _index(path) as index:
        seconds = (index.span_ns[1] - index.span_ns[0]) / 1e9
        per_frame = index_path(path).stat().st_size / index.frames
        size = f"index {per_frame:.2f} bytes a frame"
        return f"{index.frames} frames in {seconds:.0f} s, {index.keyframes} keyframes, {size}"


def _ms(seconds: float) -> str:
    return f"{1000 * seconds:.0f} ms"


def _p99(taken: list[Taken]) -> float:
    """Of processor time: the clock's counts whatever else the machine does."""
    times = sorted(one.cpu_s for one in taken)
    return times[min(len(times) - 1, int(0.99 * len(times)))]


def _told(taken: list[Taken]) -> str:
    cpu, clock = ([one[n] for one in taken] for n in (0, 1))
    medians = f"median {_ms(statistics.median(cpu))} of processor time ({_ms(statistics.median(clock))} by the clock)"
    return f"{medians}, p99 {_ms(_p99(taken))} ({_ms(sorted(clock)[int(0.99 * len(clock))])}) of {len(taken)}"


def _timed(act: Callable[[], object]) -> Taken:
    begin, cpu = time.perf_counter(), time.process_time()
    act()
    return Taken(time.process_time() - cpu, time.perf_counter() - begin)


def _index(path: Path) -> RecordingIndex:
    index = open_index(path)
    if index is None:
        raise RuntimeError("no index")
    return index


# -- ours ---------------------------------------------------------------------


def _picture(path: Path, descriptions: Descriptions, t_ns: int) -> None:
    """Everything that a page shows first."""
    with open_recording(path) as recording, _index(path) as index:
        course_at(index, recording, descriptions, t_ns).live.snapshot()
        index.events()
        index.signs()
        index.gaps()
        index.load(buckets=1000)
        if not len(index.series(SIGNAL, *index.span_ns, POINTS).t_ns):
            raise RuntimeError("nothing to plot")


def _our_seeks(path: Path, descriptions: Descriptions, times: list[int]) -> list[Taken]:
    with open_recording(path) as recording, _index(path) as index:
        return [_timed(partial(course_at, index, recording, descriptions, t_ns)) for t_ns in times]


# -- the peer -----------------------------------------------------------------


def _peer_seeks(path: Path, descriptions: Descriptions, times: list[int]) -> list[Taken]:
    with path.open("rb") as stream:
        reader = SeekingReader(stream)
        reader.get_summary()
        return [_timed(partial(_peer_course, reader, descriptions, t_ns)) for t_ns in times]


def _peer_course(reader: SeekingReader, descriptions: Descriptions, t_ns: int) -> Course:
    found = reader.iter_messages(topics=["/state"], start_time=t_ns - KEYFRAME_NS, end_time=t_ns + 1, reverse=True)
    course, at_ns = Course((), descriptions), 0
    for _, _, message in found:
        course.restore(json.loads(decode_texts(message.data, 1)[2]))
        at_ns = message.log_time + 1
        break
    messages = reader.iter_messages(topics=[f"/{BUS}"], start_time=at_ns, end_time=t_ns + 1)
    course.decode([decode_can_payload(message.data) for _, _, message in messages])
    return course


def _same_values(path: Path, descriptions: Descriptions, times: list[int]) -> None:
    with path.open("rb") as stream, open_recording(path) as recording, _index(path) as index:
        reader = SeekingReader(stream)
        for t_ns in times:
            ours = course_at(index, recording, descriptions, t_ns)
            if _readings(ours) != _readings(_peer_course(reader, descriptions, t_ns)):
                raise RuntimeError(f"other values at {t_ns}")


def _readings(course: Course) -> dict[tuple[int, Address], Reading | None]:
    return {
        (node.node, address): view.reading
        for node in course.live.nodes()
        for address, view in course.live.values(BUS, node.node).items()
    }


# -- the recording ------------------------------------------------------------


def prepare(frames: int | None) -> Path:
    """The recording with its index, made once; ``frames`` None: an hour of them."""
    folder = CACHE / f"{VERSION}-{frames or 'hour'}"
    found = next(folder.glob("*.mcap"), None) if (folder / "done").exists() else None
    if found is None:
        for left in folder.glob("*"):
            left.unlink()
        found = _record(folder, frames)
        (folder / "done").touch()
    if open_index(found) is None:
        build_index(found, described()).close()
    return found


def _stamped(frames: int | None) -> Iterator[Frame]:
    """The traffic of ``_load`` on a bus that is never idle."""
    t_ns, end_ns = START_NS, START_NS + FULL_SECONDS * 1_000_000_000
    for n, can in enumerate(_load.endless()):
        if n == frames or (frames is None and t_ns >= end_ns):
            return
        t_ns += frame_bits(can) * BIT_NS
        yield Frame(t_ns - t_ns % STAMP_STEP_NS, BUS, Direction.RX, can)


def _record(folder: Path, count: int | None) -> Path:
    now_ns = START_NS
    clock = RecorderClock(lambda: now_ns - START_NS, lambda: now_ns, lambda: now_ns)
    nodes = {f"{bus}/{node}": f"wtg-07/blade/{node} {one.id}" for (bus, node), one in described().items()}
    settings = RecorderSettings(min_free_bytes=0, max_file_bytes=1 << 40, max_file_s=1e9)
    core = RecorderCore(folder, RecordingInfo("wtg-07", "bench", {BUS: 1_000_000}, nodes), clock, (), settings)
    course, batch, due_ns = Course((), described()), [], START_NS
    for frame in _stamped(count):
        batch.append(frame)
        if frame.t_ns < due_ns:
            continue
        due_ns, now_ns = frame.t_ns + CYCLE_NS, frame.t_ns
        core.write(batch)
        course.decode(batch)
        course.live.tick(now_ns)
        if core.keyframe_due():
            core.keyframe(course.snapshot(), now_ns)
        core.cycle()
        batch = []
    core.write(batch)
    core.shut()
    return next(folder.glob("*.mcap"))
