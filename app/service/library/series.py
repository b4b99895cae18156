"""Several recording files as one, in the order of time: the parts of a recording, or recordings of one visit.

A new part begins after an hour or 512 MiB, so that what belongs together often lies in several files. Parts that follow
one another are read as if they were one file. Where a part is missing, or another recording begins, is a gap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from heapq import merge
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from typing import Final

from app.errors import RecordingError
from app.recording.content import Event, EventKind, RecordingInfo
from app.recording.reader import Recording, open_recording
from app.wire.frame import Frame

Progress = Callable[[float], None]
"""Called with the share of the time that is done, 0 to 1."""
STEP: Final = 20_000
"""Frames between two calls."""
_OTHER_TURBINE: Final = "is of another turbine than {first}: recover each turbine by itself"
_OVERLAP: Final = "was recorded at the same time as {first}: name one of them, or what is seen twice is misread"


class Series:
    """Open files, by time. Use as a context manager. Raises RecordingError where they are no series."""

    def __init__(self, paths: Sequence[Path]) -> None:
        with ExitStack() as stack:
            opened = [stack.enter_context(_open(path)) for path in paths]
            self.recordings: tuple[Recording, ...] = tuple(sorted(opened, key=_begin_ns))
            for first, second in pairwise(self.recordings):
                _check(first, second)
            self._stack = stack.pop_all()

    def __enter__(self) -> Series:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def name(self) -> str:
        """``a.mcap``, or ``a.mcap … c.mcap (3)``."""
        names = [one.path.name for one in self.recordings]
        return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]} ({len(names)})"

    @property
    def infos(self) -> tuple[RecordingInfo, ...]:
        """What each is of, in their order."""
        return tuple(one.info for one in self.recordings)

    @property
    def damages(self) -> int:
        """Places that could not be read, as far as they were met."""
        return sum(len(one.damages) for one in self.recordings)

    def events(self) -> Iterator[Event]:
        """The events by time, with a gap where one file does not go on with another."""
        missing = (
            Event(_begin_ns(second), EventKind.GAP, "", {})
            for first, second in pairwise(self.recordings)
            if not _goes_on(first, second)
        )
        return merge(*(one.events() for one in self.recordings), missing, key=attrgetter("t_ns"))

    def frames(self, on_progress: Progress | None = None) -> Iterator[Frame]:
        """The frames by time; threads overtake each other, so that a part may begin a little before the last ended."""
        begin_ns = _begin_ns(self.recordings[0])
        span_ns = max((one.span_ns or (0, 0))[1] for one in self.recordings) - begin_ns
        frames = merge(*(one.frames() for one in self.recordings), key=attrgetter("t_ns"))
        for number, frame in enumerate(frames):
            if on_progress is not None and number % STEP == 0 and span_ns > 0:
                on_progress(min(max((frame.t_ns - begin_ns) / span_ns, 0.0), 1.0))
            yield frame
        if on_progress is not None:
            on_progress(1.0)


def _open(path: Path) -> Recording:
    try:
        return open_recording(path)
    except OSError as error:
        raise RecordingError(file=str(path), offset=0, reason=error.strerror or str(error)) from error


def _begin_ns(recording: Recording) -> int:
    span = recording.span_ns
    return recording.identity.created_ns if span is None else span[0]


def _goes_on(first: Recording, second: Recording) -> bool:
    """True where ``second`` is the next part of the same recording."""
    one, other = first.identity, second.identity
    return bool(one.recording) and (one.recording, one.number + 1) == (other.recording, other.number)


def _check(first: Recording, second: Recording) -> None:
    """Raises RecordingError where the two cannot be read as one."""
    if first.info.turbine != second.info.turbine:
        raise _error(second, _OTHER_TURBINE, first)
    one, other = first.span_ns, second.span_ns
    if one is not None and other is not None and other[0] <= one[1] and not _goes_on(first, second):
        raise _error(second, _OVERLAP, first)


def _error(recording: Recording, reason: str, first: Recording) -> RecordingError:
    return RecordingError(file=str(recording.path), offset=0, reason=reason.format(first=first.path.name))
