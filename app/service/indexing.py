"""Indexes of recordings, made in a process of their own, one at a time, so that nothing else is held up.

A part that the recorder has closed is indexed when nothing else wants the processor; what somebody waits for comes
first. A cancelled one leaves nothing behind.
"""

from __future__ import annotations

import json
import logging
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from enum import Enum
from pathlib import Path
from threading import Condition, Thread
from typing import Final

from app.errors import RecordingError
from app.recording.index import open_index
from app.recording.index.__main__ import QUIETLY

log = logging.getLogger(__name__)

_MODULE: Final = "app.recording.index"


class IndexState(Enum):
    """How the making of an index stands."""

    WAITING = "waiting"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def ended(self) -> bool:
        """Nothing more comes of it."""
        return self not in (IndexState.WAITING, IndexState.RUNNING)


class IndexJob:
    """The making of one index. Any thread. ``error`` says why it failed."""

    def __init__(self, path: Path, quietly: bool, wake: Condition) -> None:
        self.path = path
        self.quietly = quietly
        self.state = IndexState.WAITING
        self.share = 0.0
        self.error: RecordingError | None = None
        self._wake = wake
        self._process: subprocess.Popen[str] | None = None
        self._unwanted = False

    @property
    def wanted(self) -> bool:
        """It goes on, and nobody has given it up."""
        return not self._unwanted and not self.state.ended

    def cancel(self) -> None:
        """Give it up."""
        with self._wake:
            self._unwanted = True
            if self.state is IndexState.WAITING:
                self._end(IndexState.CANCELLED)
            self._hang_up()

    def wait(self, timeout_s: float) -> IndexState:
        """How it stands when it has ended, or after this time."""
        with self._wake:
            self._wake.wait_for(lambda: self.state.ended, timeout_s)
            return self.state

    def run(self, cache: Path | None) -> None:
        """Make it. For the thread of ``Indexing``."""
        command = [sys.executable, "-m", _MODULE, str(self.path)]
        command += [] if cache is None else ["--cache", str(cache)]
        command += [QUIETLY] if self.quietly else []
        pipe = subprocess.PIPE
        flags = getattr(subprocess, "IDLE_PRIORITY_CLASS" if self.quietly else "BELOW_NORMAL_PRIORITY_CLASS", 0)
        try:
            process = subprocess.Popen(
                command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True, creationflags=flags
            )
        except OSError as error:
            self._fail(str(error))
            return
        with process:
            with self._wake:
                self._process = process
                if self._unwanted:
                    self._hang_up()
            for line in process.stdout or ():
                self._hear(line)
        if not self.state.ended:
            self._fail(f"the process has ended with {process.returncode}")

    def _hear(self, line: str) -> None:
        told = json.loads(line)
        with self._wake:
            self.share = told.get("share", self.share)
            if "done" in told:
                self.share = 1.0
                self._end(IndexState.DONE)
            elif "cancelled" in told:
                self._end(IndexState.CANCELLED)
        if "reason" in told:
            self._fail(told["reason"])

    def _fail(self, reason: str) -> None:
        with self._wake:
            self.error = RecordingError(file=self.path.name, offset=0, reason=reason)
            self._end(IndexState.FAILED)
        log.warning("no index of %s: %s", self.path, reason)

    def _end(self, state: IndexState) -> None:
        self.state = state
        self._wake.notify_all()

    def _hang_up(self) -> None:
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.close()


class Indexing:
    """Makes indexes, one at a time. ``cache`` is where those of recordings lie whose folder takes no files."""

    def __init__(self, cache: Path | None = None) -> None:
        self._cache = cache
        self._wake = Condition()
        self._waiting: deque[IndexJob] = deque()
        self._running: IndexJob | None = None
        self._closing = False
        self._thread: Thread | None = None

    def later(self, path: Path) -> IndexJob:
        """Index a file when nothing else is to be done, unless it has its index: a part that was closed."""
        return self._ask(path, quietly=True)

    def now(self, path: Path) -> IndexJob:
        """Index a file that somebody waits for, before all others. Asked twice it is made once."""
        return self._ask(path, quietly=False)

    def close(self, timeout_s: float = 10.0) -> None:
        """Give up what is left. May be called twice."""
        with self._wake:
            self._closing = True
            left = [*self._waiting, *([self._running] if self._running else [])]
            self._waiting.clear()
            self._wake.notify_all()
        for job in left:
            job.cancel()
        if self._thread is not None:
            self._thread.join(timeout_s)

    def _ask(self, path: Path, quietly: bool) -> IndexJob:
        with self._wake:
            running = self._running
            if running is not None and running.path == path and running.wanted and (quietly or not running.quietly):
                return running
            job = next((one for one in self._waiting if one.path == path and not one.state.ended), None)
            job = job or IndexJob(path, quietly, self._wake)
            if self._closing:
                job.state = IndexState.CANCELLED
                return job
            if job in self._waiting:
                self._waiting.remove(job)
            job.quietly = job.quietly and quietly
            if job.quietly:
                self._waiting.append(job)
            else:
                self._waiting.insert(sum(not one.quietly for one in self._waiting), job)
                self._make_way(running)
            if self._thread is None:
                self._thread = Thread(target=self._run, name="indexing", daemon=True)
                self._thread.start()
            self._wake.notify_all()
            return job

    def _make_way(self, running: IndexJob | None) -> None:
        """What runs for nobody begins anew when the one that somebody waits for is done."""
        if running is not None and running.quietly:
            running.cancel()
            if not any(one.path == running.path for one in self._waiting):
                self._waiting.append(IndexJob(running.path, quietly=True, wake=self._wake))

    def _run(self) -> None:
        while (job := self._next()) is not None:
            if job.quietly and _has_index(job.path, self._cache):
                with self._wake:
                    job._end(IndexState.DONE)
            else:
                job.run(self._cache)
            with self._wake:
                self._running = None

    def _next(self) -> IndexJob | None:
        with self._wake:
            while True:
                self._wake.wait_for(lambda: self._closing or self._waiting)
                if self._closing:
                    return None
                job = self._waiting.popleft()
                if job.state is IndexState.WAITING:
                    job.state, self._running = IndexState.RUNNING, job
                    return job


def _has_index(path: Path, cache: Path | None) -> bool:
    try:
        found = open_index(path, cache)
    except (RecordingError, OSError):
        return False
    if found is not None:
        found.close()
    return found is not None


class PartWatch:
    """Has every part indexed that a recorder has closed. ``look`` with the file at work, a few times a second."""

    def __init__(self, closed: Callable[[Path], object] | None) -> None:
        self._closed = closed
        self._file: Path | None = None

    def look(self, file: Path | None) -> None:
        """The file at work; None where there is none any more."""
        before, self._file = self._file, file
        if before is not None and before != file and self._closed is not None:
            self._closed(before)
