"""What is too much to keep in an index: values one by one and the history of restless objects, from the frames."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from app.recording.columns import Samples, Signal, samples
from app.recording.index.arrays import finite, numbers_of_samples, to_numbers
from app.recording.index.content import Change, SignalKey
from app.recording.index.course import Course, Descriptions, Step, steps
from app.recording.index.pages import Column, points
from app.recording.index.tracks import Tracks
from app.recording.reader import Recording, open_recording
from app.wire.frame import Frame
from app.wire.records import Record, ValueSeen

if TYPE_CHECKING:
    from app.recording.index.index import RecordingIndex


def values_of(index: RecordingIndex, signal: SignalKey, start_ns: int, end_ns: int) -> Column:
    """The numbers of a signal from ``start_ns`` on and before ``end_ns``."""
    bus, node, address = signal
    description = index.descriptions.get((bus, node))
    entry = None if description is None else description.entries.get(address)
    found = _samples(index, signal, start_ns, end_ns)
    if found is not None:
        return points(*numbers_of_samples(None if entry is None else entry.type, found))
    seen = [
        record
        for record in records_of(index, start_ns, end_ns)
        if type(record) is ValueSeen and record[1:4] == (bus, node, address)
    ]
    numbers, good = to_numbers(None if entry is None else entry.type, [record.data for record in seen])
    return points(*finite(np.array([record.t_ns for record in seen], np.uint64)[good], numbers))


def _samples(index: RecordingIndex, signal: SignalKey, start_ns: int, end_ns: int) -> Samples | None:
    """By columns, which know nothing of marks: None where one may matter."""
    if any(not mark.state for mark in index.marks(None, end_ns)):
        return None
    one = Signal(*signal)
    return samples(index.recording, [one], index.descriptions, start_ns, end_ns)[one]


def records_of(index: RecordingIndex, start_ns: int, end_ns: int) -> Iterator[Record]:
    """What the frames from ``start_ns`` on and before ``end_ns`` say."""
    with open_recording(index.recording) as recording:
        course, before_ns = _restored(index, index.descriptions, start_ns - 1)
        for step in _steps(index, recording.frames(before_ns + 1, end_ns), course, before_ns, end_ns - 1):
            yield from (record for record in course.take(step) if record.t_ns >= start_ns)


def course_at(index: RecordingIndex, recording: Recording, descriptions: Descriptions, t_ns: int) -> Course:
    """Decoders and live state with all that the frames up to and with ``t_ns`` have told.

    From the keyframe before and the frames since: as quick at the end of a long recording as at its beginning.
    """
    course, before_ns = _restored(index, descriptions, t_ns)
    frames = index.near(recording).between(before_ns + 1, t_ns + 1)
    for step in _steps(index, frames, course, before_ns, t_ns):
        course.take(step)
    return course


def _course(index: RecordingIndex, descriptions: Descriptions) -> Course:
    return Course((), descriptions, servers=index.servers, kinds=index.kinds, orders=index.orders)


def _restored(index: RecordingIndex, descriptions: Descriptions, t_ns: int) -> tuple[Course, int]:
    course, keyframe = _course(index, descriptions), index.keyframe(t_ns)
    if keyframe is None:
        return course, index.span_ns[0] - 1
    course.restore(keyframe.state)
    return course, keyframe.t_ns


def _steps(index: RecordingIndex, frames: Iterator[Frame], course: Course, before_ns: int, t_ns: int) -> Iterator[Step]:
    return steps(frames, index.marks(before_ns + 1, t_ns + 1), course.heard_ns, before_ns, t_ns)


def history_of(index: RecordingIndex, key: SignalKey) -> list[Change]:
    """When RAM of an object changed, from all frames of the recording."""
    tracks = Tracks(index.descriptions, lambda page: None, limit=1 << 62)
    tracks.take(records_of(index, *index.span_ns))
    return tracks.by_key[key].history if key in tracks.by_key else []
