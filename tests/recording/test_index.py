"""An index tells what reading the recording from its beginning tells: states, events, signs, values over time."""

from __future__ import annotations

from bisect import bisect_right
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from app.model.address import parse_address
from app.recording.index import GapKind, SeriesKind, course_at
from app.recording.index.build import KEYFRAME_FRAMES
from app.recording.index.near import NearFrames
from app.recording.reader import open_recording
from app.wire.events import EventKind
from tests.recording.index_rig import SCENARIOS, built, descriptions_of, indexed, plain, told
from tests.recording.rig import Bench

each_scenario = pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)


@each_scenario
def test_a_state_from_the_keyframe_before_is_that_of_reading_from_the_beginning(path: Path) -> None:
    index = indexed(path)
    with open_recording(path) as recording:
        for t_ns, state in told(path).states.items():
            course = course_at(index, recording, descriptions_of(path), t_ns)
            assert plain(course.snapshot()) == state


@each_scenario
def test_a_keyframe_is_never_far(path: Path) -> None:
    index = indexed(path)
    with open_recording(path) as recording:
        times = [frame.t_ns for frame in recording.frames()]
    assert len(times) == index.frames
    assert index.keyframe(times[0] - 2) is None
    at = -1
    for n, t_ns in enumerate(times):
        keyframe = index.keyframe(t_ns) if n % 500 == 499 or n == len(times) - 1 else None
        if keyframe is not None:
            at = bisect_right(times, keyframe.t_ns)
            assert n - at < KEYFRAME_FRAMES + 1500


@each_scenario
def test_events_and_signs_are_all_that_were_told(path: Path) -> None:
    index, whole = indexed(path), told(path)
    assert [event._replace(version=0) for event in index.events()] == whole.events
    assert list(index.signs()) == whole.signs
    middle_ns = sum(index.span_ns) // 2
    assert [*index.events(None, middle_ns), *index.events(middle_ns)] == list(index.events())
    assert all(event.t_ns >= middle_ns for event in index.events(middle_ns))
    assert [*index.signs(None, middle_ns), *index.signs(middle_ns)] == list(index.signs())


@each_scenario
def test_the_history_of_every_object_is_what_ram_held(path: Path) -> None:
    index = indexed(path)
    for t_ns, state in told(path).states.items():
        for node in state["live"]["nodes"]:
            for address, (reading, *_) in node["memory"]["cells"].items():
                info = next((one for one in index.signals() if str(one.address) == address), None)
                if info is not None and info.changes > 1000:
                    continue  # read from the frames: see below
                history = index.history(node["bus"], node["node"], parse_address(address))
                known = [change for change in history if change.t_ns <= t_ns]
                data = known[-1].data if known else None
                assert (None if data is None else data.hex()) == (None if reading is None else reading[0]), address


def test_the_history_of_a_restless_object_is_read_from_the_frames() -> None:
    path = SCENARIOS[0]
    key = "can0", 11, parse_address("6064")
    seen = told(path).values[key]
    changed = [seen[0], *(b for a, b in pairwise(seen) if a.data != b.data)]
    assert len(changed) > 3000
    history = indexed(path).history(*key)
    assert [(change.t_ns, change.data, change.source) for change in history] == [
        (one.t_ns, one.data, one.source) for one in changed
    ]


@each_scenario
def test_signals_tell_how_many_values_came_and_how_far_they_went(path: Path) -> None:
    whole = told(path)
    found = {(one.bus, one.node, one.address): one for one in indexed(path).signals()}
    assert found.keys() == whole.values.keys()
    for key, seen in whole.values.items():
        info = found[key]
        assert (info.count, info.first_ns, info.last_ns) == (len(seen), seen[0].t_ns, seen[-1].t_ns)
        assert info.changes == 1 + sum(a.data != b.data for a, b in pairwise(seen))
    angle = found["can0", 11, parse_address("6064")]
    raw = [int.from_bytes(one.data, "little", signed=True) for one in whole.values["can0", 11, parse_address("6064")]]
    assert (angle.low, angle.high) == (min(raw), max(raw))


@each_scenario
def test_a_plot_shows_the_values_that_the_decoder_saw(path: Path) -> None:
    index = indexed(path)
    key = "can0", 12, parse_address("6064")
    seen = told(path).values[key]
    times = np.array([one.t_ns for one in seen], np.uint64)
    raw = np.array([int.from_bytes(one.data, "little", signed=True) for one in seen])
    start_ns, end_ns = index.span_ns
    whole = index.series(key, start_ns, end_ns + 1, len(seen))
    assert whole.kind is SeriesKind.POINTS
    assert np.array_equal(whole.t_ns, times)
    assert np.array_equal(whole.low, raw)
    for points, share in ((50, 1.0), (700, 0.6), (2000, 0.9)):
        last_ns = int(start_ns + (end_ns - start_ns) * share)
        drawn = index.series(key, start_ns, last_ns, points)
        assert len(drawn.t_ns) <= points + 1
        assert drawn.count.sum() >= (times < last_ns).sum()
        for t_ns, low, high, count in zip(drawn.t_ns, drawn.low, drawn.high, drawn.count, strict=True):
            inside = raw[(times >= t_ns) & (times < t_ns + np.uint64(max(1, drawn.bucket_ns)))]
            assert (low, high, count) == (inside.min(), inside.max(), len(inside))


def test_restarts_break_a_plot_and_are_gaps() -> None:
    """In the service visit two nodes start anew."""
    path = next(one for one in SCENARIOS if one.name.startswith("7"))
    index = indexed(path)
    boots = {(event.node, event.t_ns) for event in told(path).events if event.kind is EventKind.BOOT_UP}
    assert {(gap.details["node"], gap.from_ns) for gap in index.gaps() if gap.kind is GapKind.RESTART} == boots
    later = {t_ns for node, t_ns in boots if node == 12 and t_ns > index.span_ns[0] + 10_000_000_000}
    drawn = index.series(("can0", 12, parse_address("6064")), *index.span_ns, 100)
    assert set(drawn.breaks.tolist()) == later
    assert later


def test_the_load_is_that_of_the_frames() -> None:
    path = SCENARIOS[1]
    index = indexed(path)
    with open_recording(path) as recording:
        times = np.array([frame.t_ns for frame in recording.frames()], np.uint64)
    (load,) = index.load(buckets=100)
    assert 90 <= len(load.t_ns) <= 100
    assert load.frames.sum() == len(times)
    for t_ns, frames in zip(load.t_ns[:5], load.frames[:5], strict=True):
        assert frames == ((times >= t_ns) & (times < t_ns + np.uint64(load.bucket_ns))).sum()
    assert 0.05 < load.share.mean() < 0.5


def test_frames_of_several_buses_come_in_their_order(tmp_path: Path) -> None:
    """However they are found: all, or those between two times."""
    bench = Bench(tmp_path)
    for _ in range(20):
        bench.write(7)
        bench.write(5, "can1")
        bench.run(0.1, per_step=3)
    bench.core.shut()
    path = next(tmp_path.glob("*.mcap"))
    with open_recording(path) as recording, built(path) as index:
        frames = list(recording.frames())
        assert list(NearFrames(recording).all()) == frames
        for first, last in ((0, 10), (50, 51), (100, 290), (0, len(frames) - 1)):
            start_ns, end_ns = frames[first].t_ns, frames[last].t_ns
            assert list(index.near(recording).between(start_ns, end_ns)) == frames[first:last]
        assert [(load.bus, int(load.frames.sum())) for load in index.load()] == [("can0", 200), ("can1", 100)]


def test_frames_of_one_bus_come_in_their_order() -> None:
    with open_recording(SCENARIOS[3]) as recording:
        assert list(NearFrames(recording).all()) == list(recording.frames())
