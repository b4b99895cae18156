"""Recordings made of other files, in the background: imports, cuts, merges, anonymised copies."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from pathlib import Path
from threading import Event as Flag
from threading import Semaphore
from time import monotonic
from typing import Final, TypeVar

from app.errors import HubsideError, RefusedError, UsageError
from app.recording.exchange.anonymise import AnonymiseOrder, anonymise
from app.recording.exchange.cut import CutOrder, cut
from app.recording.exchange.draft import free_name, sweep
from app.recording.exchange.importing import Imported, ImportOrder, Wall, import_file
from app.recording.exchange.lines import Skipped
from app.recording.exchange.merge import MergeInput, merge
from app.recording.writer import free_space
from app.service.jobs import Job

SPARE_BYTES: Final = 1 << 30
"""So much of the disk stays free: where it is less, the recorder stops."""
AT_ONCE: Final = 2
"""Copies, imports and exports that are made at a time: the bench itself needs the processor too."""
_LOOK_S: Final = 1.0
KIND: Final = "exchange"
UPLOAD_PREFIX: Final = ".import-"
UPLOAD_SUFFIX: Final = ".upload"
DOWNLOAD_PREFIX: Final = ".export-"


class Action(Enum):
    """What makes a recording."""

    IMPORT = "import"
    CUT = "cut"
    MERGE = "merge"
    ANONYMISE = "anonymise"


@dataclass
class Made:
    """What an action has made: file names, frames, and what is to be told of it, by text key with how often."""

    action: Action
    files: list[str] = field(default_factory=list)
    frames: int = 0
    remarks: Mapping[str, int] = field(default_factory=dict)
    skipped: Sequence[Skipped] = ()


OnFrames = Callable[[int], None]
Work = Callable[[OnFrames], Made]
T = TypeVar("T")


_pool = ThreadPoolExecutor(AT_ONCE, "exchange")
_slots = Semaphore(AT_ONCE)
_swept: set[Path] = set()


def check_free() -> None:
    """Raises RefusedError where as much as may be is being made already."""
    if not _slots.acquire(blocking=False):
        raise RefusedError(reason=f"{AT_ONCE} files are being made already; wait until one of them is complete")
    _slots.release()


async def in_thread(work: Callable[[], T]) -> T:
    """Run ``work`` in one of the few threads for this. Raises RefusedError where all are busy."""
    check_free()
    _slots.acquire()
    future = _pool.submit(work)
    future.add_done_callback(lambda _: _slots.release())
    return await asyncio.wrap_future(future)


def sweep_once(folder: Path) -> None:
    """At the first use of the folder: takes away uploads, downloads and drafts that a killed server left."""
    if folder in _swept:
        return
    _swept.add(folder)
    for path in (*folder.glob(f"{UPLOAD_PREFIX}*{UPLOAD_SUFFIX}"), *folder.glob(f"{DOWNLOAD_PREFIX}*")):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with suppress(OSError):
                path.unlink()
    sweep(folder)


class Room:
    """Looks after the disk while a file is made in ``folder``: at the beginning for an estimate, then every second."""

    def __init__(self, folder: Path, estimate_bytes: int) -> None:
        self._folder = folder
        self._check(estimate_bytes)

    def __call__(self, *_progress: object) -> None:
        """Raises UsageError where the disk gets full; may be called at every frame."""
        if monotonic() >= self._due_s:
            self._check(0)

    def _check(self, more_bytes: int) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        free = free_space(self._folder)
        if free - more_bytes < SPARE_BYTES:
            needed = (SPARE_BYTES + more_bytes) >> 20
            raise UsageError(reason=f"only {free >> 20} MiB of the disk are free, {needed} MiB are needed: make room")
        self._due_s = monotonic() + _LOOK_S


class _StoppedError(HubsideError):
    """The job was cancelled; nothing half made is left."""


async def in_background(job: Job, work: Work) -> None:
    """Run ``work`` in a thread; cancelling the job ends it at its next frame, and takes away what it has begun."""
    stop = Flag()

    def on_frames(count: int) -> None:
        if stop.is_set():
            raise _StoppedError
        job.done = count

    try:
        job.result = await in_thread(partial(work, on_frames))
    except asyncio.CancelledError:
        stop.set()
        raise


def import_upload(upload: Path, name: str, folder: Path, order: ImportOrder) -> Work:
    """Make a recording of a file that was sent, under the ``name`` that it had; the file is removed then."""

    def work(on_frames: OnFrames) -> Made:
        try:
            room = Room(folder, upload.stat().st_size)
            found = import_file(upload, folder, order, _both(room, on_frames), name)
        finally:
            with suppress(OSError):
                upload.unlink()
        files = [part.name for part in found.taped.parts]
        return Made(Action.IMPORT, files, found.taped.frames, remarks_of(found), tuple(found.notes.skipped))

    return work


def _both(room: Room, on_frames: OnFrames) -> OnFrames:
    def look(count: int) -> None:
        on_frames(count)
        room()

    return look


def remarks_of(found: Imported) -> dict[str, int]:
    """What is not as a file should be, by the end of its text key, with how often."""
    notes = found.notes
    remarks = {
        "skipped": notes.skipped_lines,
        "moved": found.moved,
        "clock_steps": found.clock_steps,
        "rejected": found.taped.rejected + found.beyond,
        "truncated": 0 if notes.truncated is None else notes.truncated or 1,
        "wall_assumed": int(found.wall is Wall.ASSUMED),
        **{f"other_{kind.value}": count for kind, count in notes.other.items()},
    }
    return {key: count for key, count in remarks.items() if count}


def cut_into(folder: Path, source: Path, order: CutOrder) -> Work:
    """Cut a time out of a recording."""

    def work(on_frames: OnFrames) -> Made:
        with free_name(folder, f"{source.stem}-cut.mcap") as target:
            both = _both(Room(folder, source.stat().st_size), on_frames)
            done = cut(source, target, order, lambda share: both(round(100 * share)))
        return Made(Action.CUT, [target.name], done.frames)

    return work


def merge_into(folder: Path, inputs: Sequence[MergeInput]) -> Work:
    """Merge recordings."""

    def work(on_frames: OnFrames) -> Made:
        with free_name(folder, f"{inputs[0].path.stem}-merged.mcap") as target:
            room = Room(folder, sum(one.path.stat().st_size for one in inputs))
            done = merge(inputs, target, _both(room, on_frames))
        remarks = {"duplicates": done.duplicates, "moved": done.moved}
        told = {key: count for key, count in remarks.items() if count}
        return Made(Action.MERGE, [target.name], done.taped.frames, told)

    return work


def anonymise_into(folder: Path, source: Path, order: AnonymiseOrder) -> Work:
    """Copy a recording without what identifies; the name of the copy tells nothing either."""

    def work(on_frames: OnFrames) -> Made:
        with free_name(folder, "anonymous.mcap") as target:
            done = anonymise(source, target, order, _both(Room(folder, source.stat().st_size), on_frames))
        remarks = {
            "serials": done.serials,
            "left_out_details": done.left_out_details,
            "left_out_attachments": done.left_out_attachments,
            "left_out_frames": done.left_out_frames,
            "left_out_times": done.left_out_times,
        }
        told = {key: count for key, count in remarks.items() if count}
        return Made(Action.ANONYMISE, [target.name], done.taped.frames, told)

    return work
