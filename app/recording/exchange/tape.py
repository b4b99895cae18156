"""Writes a recording that is made of frames which are there already: imports, merges, anonymised copies.

The live recorder's parts and limits, but the time is that of the frames. State keyframes are made as live: every 5 s
and at the beginning of every part.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from app.errors import RecordingError
from app.recording.cdr import NS, ClockReading
from app.recording.content import METADATA_ORIGIN, AttachedFile, Event, RecordingInfo, to_json
from app.recording.exchange.draft import Draft
from app.recording.index.course import Course, Mark, Step, steps
from app.recording.mcap_file import sync_directory
from app.recording.node_table import described, read_orders, read_protocols, read_servers
from app.recording.part import Batch, Identity, Part, event_entry
from app.wire.frame import Frame

KEYFRAME_NS: Final = 5 * NS
BATCH_FRAMES: Final = 8192
MAX_PART_BYTES: Final = 512 << 20
MAX_PART_NS: Final = 3600 * NS
_MAX_EVENTS: Final = 2000


@dataclass(frozen=True)
class Subject:
    """What is written beside the frames. ``events`` and ``clocks`` by time; ``marks`` act on the state.

    ``origin`` is asked at the beginning of a part and at its end, when more is known.
    """

    recording: str
    started_ns: int
    info: RecordingInfo
    origin: Callable[[], Mapping[str, str]]
    attachments: Sequence[AttachedFile] = ()
    events: Sequence[Event] = ()
    clocks: Sequence[ClockReading] = ()
    marks: Sequence[Mark] = ()
    lost: int = 0
    first_part: int = 1


@dataclass
class Taped:
    """What was written: the files, their frames, and those that do not fit into a recording."""

    parts: list[Path] = field(default_factory=list)
    frames: int = 0
    rejected: int = 0
    first_ns: int | None = None
    last_ns: int | None = None


class Tape:
    """Writes frames in the order in which they come. ``path_of`` gives the file of a part by its number."""

    def __init__(
        self, subject: Subject, path_of: Callable[[int], Path], rotate: bool, course: type[Course] = Course
    ) -> None:
        self._subject, self._path_of, self._rotate = subject, path_of, rotate
        info = subject.info
        self._course = course(
            (),
            described(info.nodes),
            _MAX_EVENTS,
            read_servers(info.servers),
            read_protocols(info.protocols),
            read_orders(info.orders),
        )
        self._events, self._clocks = deque(subject.events), deque(subject.clocks)
        self._batch = Batch()
        self._part: Part | None = None
        self._part_ns = self._due_ns = self._last_ns = 0
        self._drafts: list[Draft] = []
        self._taped = Taped()
        self._origin: Mapping[str, str] = {}

    def note(self, event: Event) -> None:
        """An event that was found on the way, later than all before."""
        self._events.append(event)

    def write(
        self,
        frames: Iterable[Frame],
        on_frames: Callable[[int], None] | None = None,
        check: Callable[[Path], None] | None = None,
    ) -> Taped:
        """Writes all and finishes. Nothing is left of it where anything raises; OSError becomes RecordingError.

        ``check`` gets every complete file before it has its name, and raises where it must not get it.
        """
        try:
            marks = self._subject.marks
            before_ns = min([self._subject.started_ns, *(mark.t_ns for mark in marks)]) - 1
            for step in steps(self._first(frames), marks, 0, before_ns, 0):
                self._take(step)
                if on_frames is not None:
                    on_frames(self._taped.frames + len(self._batch.frames))
            self._finish()
            if check is not None:
                for draft in self._drafts:
                    check(draft.path)
            self._publish()
        except OSError as error:
            self._clear()
            name = self._path_of(1).name
            raise RecordingError(file=name, offset=0, reason=error.strerror or str(error)) from error
        except BaseException:
            self._clear()
            raise
        return self._taped

    def _first(self, frames: Iterable[Frame]) -> Iterable[Frame]:
        for frame in frames:
            if self._taped.first_ns is None:
                self._taped.first_ns = frame.t_ns
            yield frame

    def _take(self, step: Step) -> None:
        frames = step.frames
        if frames:
            if self._part is not None and self._rotation_due(self._part, frames[0].t_ns):
                self._close_part()
            if self._part is None:
                self._open_part(frames[0].t_ns)
            elif frames[0].t_ns >= self._due_ns:
                self._keyframe(frames[0].t_ns)
            self._batch.frames += frames
            self._last_ns = frames[-1].t_ns
        self._course.take(step)
        if len(self._batch.frames) >= BATCH_FRAMES:
            self._flush()

    def _keyframe(self, t_ns: int) -> None:
        """The state before the frame at ``t_ns``."""
        at_ns = max(t_ns - 1, 0)
        self._batch.keyframes.append((at_ns, to_json(self._course.snapshot())))
        self._due_ns = t_ns + KEYFRAME_NS

    def _rotation_due(self, part: Part, t_ns: int) -> bool:
        return self._rotate and (part.size_bytes >= MAX_PART_BYTES or t_ns - self._part_ns >= MAX_PART_NS)

    def _open_part(self, t_ns: int) -> None:
        subject = self._subject
        number = subject.first_part + len(self._drafts)
        draft = Draft(self._path_of(number))
        identity = Identity(subject.recording, number, subject.started_ns, t_ns)
        self._part = Part(draft.path, identity, subject.info, subject.attachments)
        self._drafts.append(draft)
        self._origin = subject.origin()
        self._part.add_metadata(METADATA_ORIGIN, self._origin)
        self._part_ns = t_ns
        self._keyframe(t_ns)

    def _flush(self) -> None:
        if self._part is None:
            return
        batch, self._batch = self._batch, Batch()
        while self._events and self._events[0].t_ns <= self._last_ns:
            batch.events.append(event_entry(self._events.popleft()))
        while self._clocks and self._clocks[0].t_ns <= self._last_ns:
            batch.clocks.append(self._clocks.popleft())
        self._part.append(batch)

    def _close_part(self) -> None:
        part = self._part
        if part is None:
            return
        self._flush()
        at_end = self._subject.origin()
        if at_end != self._origin:
            part.add_metadata(METADATA_ORIGIN, at_end)
        part.finish(self._last_ns, self._subject.lost)
        self._taped.frames += part.frames
        self._taped.rejected += part.rejected
        self._part = None

    def _finish(self) -> None:
        if self._part is None:
            self._open_part(self._subject.started_ns)
        ends = [event.t_ns for event in self._events] + [reading.t_ns for reading in self._clocks]
        self._last_ns = max(self._last_ns, self._subject.started_ns, *ends)
        self._taped.last_ns = self._last_ns
        self._close_part()

    def _publish(self) -> None:
        for draft in self._drafts:
            draft.publish()
            self._taped.parts.append(draft.target)
        sync_directory(self._taped.parts[0].parent)

    def _clear(self) -> None:
        if self._part is not None:
            self._part.abandon()
        for draft in self._drafts:
            draft.withdraw()
