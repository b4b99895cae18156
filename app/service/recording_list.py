"""The recordings in the data folder: a list that stays fast, and what one of them holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

from app.errors import RecordingError
from app.model.bundled import bundled_folder
from app.recording.annotations import SUFFIX as ANNOTATIONS
from app.recording.content import AttachedFile, EventKind
from app.recording.reader import Recording, open_recording
from app.recording.scan import is_finished, map_file, unmap
from app.recording.schemas import EVENTS_TOPIC
from app.recording.writer import free_space
from app.service.file_list import FileList

MAX_EVENTS: Final = 500
_LOSSES: Final = frozenset(
    {
        EventKind.FRAMES_LOST,
        EventKind.GAP,
        EventKind.BUS_LOST,
        EventKind.BUS_BACK,
        EventKind.DISK_ERROR,
        EventKind.SPACE_LOW,
        EventKind.RESUMED,
    }
)
"""What tells that a recording does not hold everything."""


class FileState(Enum):
    """How a file stands. ``UNFINISHED``: its end is missing, ``hubside recover`` closes it."""

    LIVE = "live"
    FINISHED = "finished"
    UNFINISHED = "unfinished"
    UNREADABLE = "unreadable"


@dataclass(frozen=True, slots=True)
class Summary:
    """What a file says of itself. ``frames`` and ``events`` are those of this file, ``part`` counts from 1.

    ``lost`` counts what its recording had lost by the end of the file. Times are Unix ns; None: not told.
    """

    turbine: str
    person: str
    part: int
    started_ns: int | None
    first_ns: int | None
    last_ns: int | None
    frames: int
    lost: int | None
    events: int


@dataclass(frozen=True, slots=True)
class Look:
    """What one look at a file gave. ``reason``: why it cannot be read."""

    state: FileState
    summary: Summary | None = None
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class RecordingFile:
    """One file of the list. ``look`` None: not read yet; ``sample``: it came with the program."""

    name: str
    size_bytes: int
    modified_ns: int
    look: Look | None
    sample: bool = False


@dataclass(frozen=True, slots=True)
class RecordingDetails:
    """What one file holds. ``topics``: messages by topic; ``losses``: events that tell of missing frames."""

    look: Look
    metadata: Mapping[str, Mapping[str, str]]
    topics: Mapping[str, int]
    attachments: tuple[tuple[str, str, int], ...]
    damages: tuple[tuple[int, int, str, str], ...]
    losses: tuple[tuple[int, EventKind, str, Mapping[str, Any]], ...]


def samples_folder() -> Path:
    """Where the recordings lie that come with the program."""
    return bundled_folder("recordings", "recordings") / "scenarios"


class Recordings:
    """The recordings of one folder, and behind them those of ``samples``, of which a name in the folder hides one.

    ``more`` are files that lie elsewhere; they go before all others of their name.
    """

    def __init__(self, folder: Path, samples: Path | None = None, more: Iterable[Path] = ()) -> None:
        self._list = FileList(folder, "*.mcap", look_at, ANNOTATIONS)
        self._more = {path.name: path for path in more}
        self._samples = None if samples is None else FileList(samples, "*.mcap", look_at, ANNOTATIONS)

    @property
    def folder(self) -> Path:
        """Where they lie."""
        return self._list.folder

    @property
    def free_bytes(self) -> int | None:
        """Room on the disk; None where there is no folder yet."""
        try:
            return free_space(self.folder)
        except OSError:
            return None

    def files(self, live: Path | None) -> list[RecordingFile]:
        """The files, latest first; ``live`` is the one that is being written. Reads files: not for the event loop."""
        own = [self._elsewhere(path) for path in self._more.values() if path.is_file()]
        own += [
            self._file(one.name, one.size_bytes, one.modified_ns, one.content, live)
            for one in self._list.look()
            if one.name not in self._more
        ]
        if self._samples is None:
            return own
        names = {one.name for one in own}
        samples = sorted(self._samples.look(), key=attrgetter("name"))
        return own + [
            RecordingFile(one.name, one.size_bytes, one.modified_ns, one.content, sample=True)
            for one in samples
            if one.name not in names
        ]

    def path(self, name: str) -> Path | None:
        """The file of that name, or None."""
        own = self._more.get(name) or self._list.path(name)
        return own if own is not None or self._samples is None else self._samples.path(name)

    def of_size(self, size_bytes: int) -> list[Path]:
        """The files of exactly that size, in the folder and among the samples."""
        lists = [self._list] if self._samples is None else [self._list, self._samples]
        more = [path for path in self._more.values() if path.is_file() and path.stat().st_size == size_bytes]
        return more + [path for one in lists for path in one.of_size(size_bytes)]

    @staticmethod
    def _elsewhere(path: Path) -> RecordingFile:
        stat = path.stat()
        return RecordingFile(path.name, stat.st_size, stat.st_mtime_ns, look_at(path))

    @staticmethod
    def _file(name: str, size: int, modified_ns: int, look: Look | None, live: Path | None) -> RecordingFile:
        if live is not None and name == live.name:
            look = Look(FileState.LIVE)
        return RecordingFile(name, size, modified_ns, look)


def look_at(path: Path) -> Look:
    """What a file says of itself at its end. An unfinished one is not scanned: that can take long."""
    try:
        data = map_file(path)
        try:
            finished = is_finished(data)
        finally:
            unmap(data)
        if not finished:
            return Look(FileState.UNFINISHED)
        with open_recording(path) as recording:
            return Look(FileState.FINISHED, _summary(recording))
    except RecordingError as error:
        return Look(FileState.UNREADABLE, reason=str(error.details["reason"]))
    except (OSError, ValueError) as error:
        return Look(FileState.UNREADABLE, reason=str(error))


def details(path: Path) -> RecordingDetails:
    """All that a file tells beside its frames; an unfinished file is scanned. Raises RecordingError."""
    with open_recording(path) as recording:
        state = FileState.FINISHED if recording.finished else FileState.UNFINISHED
        losses = [event for event in recording.events() if event.kind in _LOSSES][:MAX_EVENTS]
        attachments = tuple((one.name, one.media_type, len(one.data)) for one in recording.attachments())
        return RecordingDetails(
            look=Look(state, _summary(recording)),
            metadata={name: dict(table) for name, table in recording.metadata.items()},
            topics=dict(recording.topics),
            attachments=attachments,
            damages=tuple((one.offset, one.length, one.reason.value, one.detail) for one in recording.damages),
            losses=tuple((one.t_ns, one.kind, one.bus, one.details) for one in losses),
        )


def attachment(path: Path, name: str) -> AttachedFile | None:
    """A file inside a recording, or None. Raises RecordingError."""
    with open_recording(path) as recording:
        return next((one for one in recording.attachments() if one.name == name), None)


def _summary(recording: Recording) -> Summary:
    info, identity, span = recording.info, recording.identity, recording.span_ns
    # An archive tells its totals before its frames: cut off, it would claim what it no longer holds.
    totals = recording.totals if recording.finished else None
    return Summary(
        turbine=info.turbine,
        person=info.who,
        part=identity.number,
        started_ns=identity.created_ns or identity.started_ns or None,
        first_ns=None if span is None else span[0],
        last_ns=None if span is None else span[1],
        frames=recording.frame_count if totals is None else totals.frames,
        lost=None if totals is None else totals.lost,
        events=recording.topics.get(EVENTS_TOPIC, 0),
    )
