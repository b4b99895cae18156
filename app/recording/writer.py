"""The recorder: every frame of every bus into a series of MCAP files, from a thread of its own.

``write`` only appends to a list. The thread closes the chunks, rotates the files and guards the free space; it never
blocks a caller. What cannot be kept is counted, told in the status and written into the file as an event.
"""

from __future__ import annotations

import logging
import shutil
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import Enum
from pathlib import Path
from threading import Event as Flag
from threading import Lock, Thread
from typing import Any, Final, NamedTuple

from app.recording.cdr import NS, ClockReading
from app.recording.content import AttachedFile, Event, EventKind, Keyframe, RecorderClock, RecordingInfo, to_json
from app.recording.part import Batch, Identity, Part, event_entry
from app.wire.frame import Frame

_logger = logging.getLogger(__name__)

MS: Final = 1_000_000
WALL_STEP_NS: Final = 5 * MS  # more than the jitter of reading two clocks, less than any step that matters
READ_BRACKET_NS: Final = MS // 5  # clocks read further apart than this are read again
MAX_KEPT_EVENTS: Final = 1000
USUAL_FLUSH_NS: Final = 50 * MS  # what the disk may take for the chunks of one flush before the next comes sooner


class RecorderState(Enum):
    """``BLOCKED``: nothing can be kept for now, it is tried again. ``FAILED``: the recorder itself is defect."""

    RECORDING = "recording"
    BLOCKED = "blocked"
    FAILED = "failed"
    CLOSED = "closed"


class BlockReason(Enum):
    """Why nothing is kept."""

    SPACE_LOW = "space_low"
    DISK_ERROR = "disk_error"
    DEFECT = "defect"


class LossReason(Enum):
    """Where frames were lost."""

    QUEUE_FULL = "queue_full"
    BLOCKED = "blocked"
    INVALID = "invalid"
    ADAPTER = "adapter"


@dataclass(frozen=True)
class RecorderSettings:
    """Limits of a recorder. Times in s, sizes in bytes, the queue in frames."""

    flush_s: float = 0.4
    clock_s: float = 0.1
    keyframe_s: float = 5.0
    max_file_bytes: int = 512 << 20
    max_file_s: float = 3600.0
    min_free_bytes: int = 1 << 30
    max_queue: int = 200_000
    retry_s: float = 5.0


class RecorderStatus(NamedTuple):
    """What the recorder does. ``size_bytes``, ``frames``, ``lost`` and ``parts`` count the whole recording.

    ``file`` is the file at work, else the last one; ``detail`` is the system's own text of a disk error.
    """

    state: RecorderState
    reason: BlockReason | None
    detail: str
    file: Path | None
    since_ns: int
    size_bytes: int
    frames: int
    lost: int
    parts: int
    free_bytes: int


class _Loss(NamedTuple):
    frames: int
    from_ns: int
    to_ns: int


def free_space(path: Path) -> int:
    """Free bytes of the disk that holds ``path``."""
    return shutil.disk_usage(path).free


class RecorderCore:
    """The recorder without its thread: whoever holds it calls ``cycle`` (see ``Recorder``)."""

    def __init__(
        self,
        directory: Path,
        info: RecordingInfo,
        clock: RecorderClock,
        attachments: Iterable[AttachedFile] = (),
        settings: RecorderSettings | None = None,
        free_bytes: Callable[[Path], int] = free_space,
    ) -> None:
        self._directory, self._info, self._clock = directory, info, clock
        self._attachments = list(attachments)
        self._settings = settings or RecorderSettings()
        self._free_bytes = free_bytes
        self._lock = Lock()
        self._pending = Batch()
        self._new_attachments: list[AttachedFile] = []
        self._losses: dict[tuple[str, LossReason], _Loss] = {}
        self._adapter: dict[str, tuple[int, int]] = {}
        self._kept_events: deque[tuple[Event, str]] = deque(maxlen=MAX_KEPT_EVENTS)
        self._lost = self._closed_frames = self._closed_bytes = self._number = self._free = 0
        self._state = RecorderState.RECORDING
        self._reason: BlockReason | None = None
        self._detail = ""
        self._part: Part | None = None
        self._file: Path | None = None
        self._since_ns = clock.stamp()
        self._recording = new_name(directory, self._since_ns, info.turbine)
        now_ns = clock.monotonic_ns()
        self._clock_due_ns = self._flush_due_ns = self._keyframe_due_ns = now_ns
        self._part_started_ns = self._retry_due_ns = now_ns
        self._wall_offset_ns: int | None = None
        self._open_part()

    # What callers use, from any thread.

    def write(self, frames: Sequence[Frame]) -> None:
        """Takes frames over. Never blocks; frames beyond the queue's limit are counted as lost."""
        if not frames:
            return
        last = frames[-1]
        with self._lock:
            if self._state is RecorderState.CLOSED:
                return
            pending = self._pending.frames
            if self._state is RecorderState.FAILED:
                self._lose(frames, LossReason.BLOCKED)
            elif len(pending) + len(frames) > self._settings.max_queue:
                self._lose(frames, LossReason.QUEUE_FULL)
            else:
                pending.extend(frames)
            if last.t_adapter_ns is not None:
                self._adapter[last.bus] = last.t_adapter_ns, last.t_ns

    def event(self, kind: EventKind, bus: str = "", t_ns: int | None = None, **details: Any) -> None:
        """Notes an event, now or at ``t_ns``. Raises ``TypeError`` or ``ValueError`` if details are no plain JSON."""
        entry = event_entry(Event(self._clock.stamp() if t_ns is None else t_ns, kind, bus, details))
        with self._lock:
            self._pending.events.append(entry)

    def keyframe(self, state: Mapping[str, Any], t_ns: int | None = None) -> None:
        """Notes the whole state as of now or of ``t_ns``. Raises as ``event`` does. Asked for by ``keyframe_due``."""
        entry = Keyframe(self._clock.stamp() if t_ns is None else t_ns, state)
        text = to_json(entry.state)
        with self._lock:
            self._pending.keyframes.append((entry.t_ns, text))
            self._keyframe_due_ns = self._clock.monotonic_ns() + int(self._settings.keyframe_s * NS)

    def keyframe_due(self) -> bool:
        """Whether a keyframe is wanted: at the start of every file and every 5 s."""
        return self._state is RecorderState.RECORDING and self._clock.monotonic_ns() >= self._keyframe_due_ns

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Puts a file into this and all later files of the recording."""
        attached = AttachedFile(name, media_type, data)
        with self._lock:
            self._attachments.append(attached)
            self._new_attachments.append(attached)

    def count_lost(self, bus: str, count: int, from_ns: int, to_ns: int) -> None:
        """Counts frames that were lost before they came here, in the adapter or the kernel."""
        with self._lock:
            self._add_loss(bus, LossReason.ADAPTER, _Loss(count, from_ns, to_ns))

    def status(self) -> RecorderStatus:
        """What the recorder does, as of now."""
        with self._lock:
            part = self._part
            return RecorderStatus(
                state=self._state,
                reason=self._reason,
                detail=self._detail,
                file=self._file,
                since_ns=self._since_ns,
                size_bytes=self._closed_bytes + (part.size_bytes if part else 0),
                frames=self._closed_frames + (part.frames if part else 0),
                lost=self._lost,
                parts=self._number,
                free_bytes=self._free,
            )

    def _lose(self, frames: Sequence[Frame], reason: LossReason) -> None:
        for frame in frames:
            self._add_loss(frame.bus, reason, _Loss(1, frame.t_ns, frame.t_ns))

    def _add_loss(self, bus: str, reason: LossReason, loss: _Loss) -> None:
        known = self._losses.get((bus, reason))
        if known is not None:
            loss_from, loss_to = min(known.from_ns, loss.from_ns), max(known.to_ns, loss.to_ns)
            self._losses[bus, reason] = _Loss(known.frames + loss.frames, loss_from, loss_to)
        else:
            self._losses[bus, reason] = loss
        self._lost += loss.frames

    # What the recorder's own thread does.

    def cycle(self) -> None:
        """Reads the clocks and closes the chunks where they are due. One thread only."""
        now_ns = self._clock.monotonic_ns()
        if now_ns >= self._clock_due_ns:
            self._clock_due_ns = max(self._clock_due_ns + int(self._settings.clock_s * NS), now_ns)
            self._read_clocks()
        if now_ns >= self._flush_due_ns:
            self.flush()
            took_ns = self._clock.monotonic_ns() - now_ns
            flush_ns = int(self._settings.flush_s * NS)
            # What comes while a slow disk is at work waits for it twice: then chunks are closed more often.
            self._flush_due_ns = now_ns + min(flush_ns, max(flush_ns + USUAL_FLUSH_NS - took_ns, 0))

    def wait_s(self) -> float:
        """How long until ``cycle`` has something to do."""
        due_ns = min(self._clock_due_ns, self._flush_due_ns)
        return max(0, due_ns - self._clock.monotonic_ns()) / NS

    def flush(self) -> None:
        """Writes all that is pending, and rotates the file where it is due."""
        self._free = self._read_free_space()
        if self._part is None and self._clock.monotonic_ns() >= self._retry_due_ns:
            self._open_part()
        batch, attachments = self._take_pending()
        if self._part is None:
            self._keep_back(batch)
            return
        if self._free < self._settings.min_free_bytes:
            details = {"free_bytes": self._free, "limit_bytes": self._settings.min_free_bytes}
            batch.events.append(event_entry(Event(self._clock.stamp(), EventKind.SPACE_LOW, "", details)))
            self._append(self._part, batch, attachments)
            self._block(BlockReason.SPACE_LOW, "")
            return
        self._append(self._part, batch, attachments)
        if self._part is not None and self._rotation_due(self._part):
            self._close_part()
            self._open_part()

    def shut(self) -> None:
        """Writes what is pending and finishes the file. One thread only, once, after the last ``cycle``."""
        with self._lock:
            self._state = RecorderState.CLOSED
        for _ in range(2):  # the second time for what was found wrong with the last frames
            batch, attachments = self._take_pending()
            if self._part is None:
                self._keep_back(batch)
            elif batch or attachments:
                self._append(self._part, batch, attachments)
        self._close_part()

    def give_up(self, detail: str) -> None:
        """After a defect: closes the file as it is; from now on every frame is lost."""
        with self._lock:
            part, self._part = self._part, None
            self._state, self._reason, self._detail = RecorderState.FAILED, BlockReason.DEFECT, detail
            self._lose(self._pending.frames, LossReason.BLOCKED)
            self._pending = Batch()
            if part is not None:
                self._closed_frames += part.frames
                self._closed_bytes += part.size_bytes
                part.abandon()

    def _take_pending(self) -> tuple[Batch, list[AttachedFile]]:
        with self._lock:
            batch, self._pending = self._pending, Batch()
            attachments, self._new_attachments = self._new_attachments, []
            losses: dict[tuple[str, LossReason], _Loss] = {}
            if self._part is not None:  # else they add up until there is a file to say so
                losses, self._losses = self._losses, losses
        for (bus, reason), loss in losses.items():
            details = {"count": loss.frames, "from_ns": loss.from_ns, "to_ns": loss.to_ns, "reason": reason.value}
            batch.events.append(event_entry(Event(self._clock.stamp(), EventKind.FRAMES_LOST, bus, details)))
        return batch, attachments

    def _keep_back(self, batch: Batch) -> None:
        """Without a file: frames are lost, events wait for the next file."""
        self._kept_events.extend(batch.events)
        with self._lock:
            self._lose(batch.frames, LossReason.BLOCKED)

    def _append(self, part: Part, batch: Batch, attachments: Sequence[AttachedFile]) -> None:
        rejected_before, missing = part.rejected, batch.frames
        try:
            for attached in attachments:
                part.attach(attached, self._clock.stamp())
            missing = part.unwritten
            part.append(batch)
        except OSError as error:
            details = {"error": str(error), "file": part.path.name}
            self._kept_events.extend(batch.events)  # their chunk is the last, so it is not in the file
            self._kept_events.append(event_entry(Event(self._clock.stamp(), EventKind.DISK_ERROR, "", details)))
            with self._lock:
                self._lose(missing, LossReason.BLOCKED)
            self._block(BlockReason.DISK_ERROR, str(error))
        rejected = part.rejected - rejected_before
        if rejected:
            times = [frame.t_ns for frame in batch.frames]
            with self._lock:
                self._add_loss("", LossReason.INVALID, _Loss(rejected, min(times), max(times)))

    def _rotation_due(self, part: Part) -> bool:
        age_ns = self._clock.monotonic_ns() - self._part_started_ns
        return part.size_bytes >= self._settings.max_file_bytes or age_ns >= self._settings.max_file_s * NS

    def _open_part(self) -> None:
        """The next file, or the state ``BLOCKED`` where the disk gives none. Takes back ``BLOCKED`` where it does."""
        self._retry_due_ns = self._clock.monotonic_ns() + int(self._settings.retry_s * NS)
        try:
            number, path = self._next_file()
            identity = Identity(self._recording, number, self._since_ns, self._clock.stamp())
            self._directory.mkdir(parents=True, exist_ok=True)
            self._free = self._free_bytes(self._directory)
            if self._free < self._needed_bytes():
                self._block(BlockReason.SPACE_LOW, "")
                return
            part = Part(path, identity, self._info, self._attachments)
        except OSError as error:
            self._block(BlockReason.DISK_ERROR, str(error))
            return
        self._resumed(part, path)

    def _next_file(self) -> tuple[int, Path]:
        """Number and path of the next file; one that a refusing disk left half made is passed over."""
        number = self._number + 1
        while (path := self._directory / f"{self._recording}-{number:03d}.mcap").exists():
            number += 1
        return number, path

    def _needed_bytes(self) -> int:
        """Free bytes to open a file: more after a stop, or a new file would come every few seconds."""
        limit = self._settings.min_free_bytes
        return limit if self._reason is None else limit + limit // 8

    def _resumed(self, part: Part, path: Path) -> None:
        with self._lock:
            was = self._reason
            self._part, self._file = part, path
            self._number += 1
            self._new_attachments.clear()
            self._state, self._reason, self._detail = RecorderState.RECORDING, None, ""
            self._part_started_ns = self._keyframe_due_ns = self._clock.monotonic_ns()
            self._pending.events.extend(self._kept_events)
            self._kept_events.clear()
        if was is not None:
            self.event(EventKind.RESUMED, reason=was.value)

    def _block(self, reason: BlockReason, detail: str) -> None:
        self._close_part()
        with self._lock:
            if self._state is not RecorderState.CLOSED:
                self._state = RecorderState.BLOCKED
            self._reason, self._detail = reason, detail
        self._retry_due_ns = self._clock.monotonic_ns() + int(self._settings.retry_s * NS)

    def _close_part(self) -> None:
        """Finishes the file; where the disk refuses even that, it stays unfinished and is recovered later."""
        part = self._part
        if part is None:
            return
        try:
            part.finish(self._clock.stamp(), self._lost)
        except OSError as error:
            _logger.warning("recording %s stays unfinished: %s", part.path, error)
            part.abandon()
        with self._lock:
            self._closed_frames += part.frames
            self._closed_bytes += part.size_bytes
            self._part = None

    def _read_free_space(self) -> int:
        try:
            return self._free_bytes(self._directory)
        except OSError:
            return self._free  # the write that follows tells what is wrong with the disk

    def _read_clocks(self) -> None:
        monotonic_ns, wall_ns = _read_together(self._clock)
        t_ns = self._clock.stamp()
        with self._lock:
            adapters = dict(self._adapter)
            clocks = self._pending.clocks
            if not adapters:
                clocks.append(ClockReading(t_ns, monotonic_ns, wall_ns))
            for bus, (adapter_ns, adapter_t_ns) in adapters.items():
                clocks.append(ClockReading(t_ns, monotonic_ns, wall_ns, bus, adapter_ns, adapter_t_ns))
        offset_ns = wall_ns - monotonic_ns
        if self._wall_offset_ns is not None and abs(offset_ns - self._wall_offset_ns) >= WALL_STEP_NS:
            self.event(EventKind.WALL_CLOCK_STEP, step_ns=offset_ns - self._wall_offset_ns, wall_ns=wall_ns)
        self._wall_offset_ns = offset_ns


class Recorder(RecorderCore):
    """The recorder with its thread. Use as a context manager, or call ``close``."""

    def __init__(
        self,
        directory: Path,
        info: RecordingInfo,
        clock: RecorderClock,
        attachments: Iterable[AttachedFile] = (),
        settings: RecorderSettings | None = None,
        free_bytes: Callable[[Path], int] = free_space,
    ) -> None:
        super().__init__(directory, info, clock, attachments, settings, free_bytes)
        self._stop = Flag()
        self._thread = Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self, timeout_s: float = 30.0) -> RecorderStatus:
        """Writes what is pending, finishes the file and ends the thread; the last status. May be called twice."""
        self._stop.set()
        self._thread.join(timeout_s)
        return self.status()

    def _run(self) -> None:
        try:
            while not self._stop.wait(self.wait_s()):
                self.cycle()
            self.shut()
        except Exception as error:
            _logger.exception("the recorder has ended by a defect of its own")
            self.give_up(repr(error))


def _read_together(clock: RecorderClock) -> tuple[int, int]:
    """Monotonic and wall time of one moment: read again where something came between."""
    best: tuple[int, int, int] | None = None
    for _ in range(3):
        before_ns = clock.monotonic_ns()
        wall_ns = clock.wall_ns()
        bracket_ns = clock.monotonic_ns() - before_ns
        if best is None or bracket_ns < best[0]:
            best = bracket_ns, before_ns + bracket_ns // 2, wall_ns
        if bracket_ns <= READ_BRACKET_NS:
            break
    if best is None:
        raise ValueError("no clock was read")
    return best[1], best[2]


def new_name(directory: Path, t_ns: int, turbine: str) -> str:
    """A name that no recording in the directory bears: ``20250615T120000Z-wtg-07``."""
    moment = datetime.fromtimestamp(t_ns / NS, UTC).strftime("%Y%m%dT%H%M%SZ")
    slug = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "-" for c in turbine) or "turbine"
    base = f"{moment}-{slug}"
    name, n = base, 1
    while any(directory.glob(f"{name}-[0-9][0-9][0-9].mcap*")):
        n += 1
        name = f"{base}-{n}"
    return name
