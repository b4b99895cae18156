"""The replays that are open: one for each recording, for all who look at it. For the event loop."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from app.errors import ReplayEndedError, SettingsError
from app.model.site import Turbine
from app.service.indexing import Indexing, IndexJob, IndexState
from app.service.replay.session import Session
from app.service.replay.source import Source
from app.service.shown import Shown

log = logging.getLogger(__name__)

MAX_OPEN: Final = 8
"""Each has a thread, a state and perhaps a 3D view."""
UNWATCHED_S: Final = 600.0
"""So long a replay that nobody looks at stays open: who reloads a page finds it where it was."""
SWEEP_S: Final = 5.0
_PREFIX: Final = "replay/"


@dataclass(frozen=True, slots=True)
class IndexLine:
    """How the index of a recording stands: ``progress`` 0 to 1, and the ``reason`` why there is none."""

    state: Literal["ready", "building", "failed"]
    progress: float
    reason: str | None


class Replays:
    """``known`` gives the turbines of which names are known; ``indexing`` makes indexes, also in ``cache``."""

    def __init__(
        self,
        known: Callable[[], Mapping[str, Turbine]],
        indexing: Indexing,
        cache: Path | None = None,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._known = known
        self._cache = cache
        self._indexing = indexing
        self._jobs: dict[str, IndexJob] = {}
        self._clock = monotonic_ns
        self._sessions: dict[str, Session] = {}
        self._watchers: dict[str, int] = {}
        self._unwatched_ns: dict[str, int] = {}
        self._opening = asyncio.Lock()

    @property
    def sessions(self) -> Mapping[str, Session]:
        """All that are open, by name."""
        return self._sessions

    async def open(self, path: Path, at_ns: int | None = None) -> Session:
        """The replay of a file; the one that is open where there is one, else a new one that stands at ``at_ns``.

        Raises RecordingError, SettingsError.
        """
        name = path.name.removesuffix(".mcap")
        async with self._opening:
            found = self.find(name)
            if found is not None and await asyncio.to_thread(_unchanged, found, path):
                return found
            await self._close(name)
            await self._make_room()
            source = await asyncio.to_thread(Source, path, self._known(), self._cache)
            session = Session(source, self._clock, at_ns)
            await asyncio.wrap_future(session.opened)
            self._sessions[name] = session
            self._unwatched_ns[name] = self._clock()
            if source.index is None:
                self._jobs[name] = self._indexing.now(path)
            return session

    def index_line(self, session: Session) -> IndexLine:
        """How the index of a replay stands; takes it where it has been made meanwhile."""
        source, job = session.source, self._jobs.get(session.source.name)
        if source.index is None and (job is None or job.state is IndexState.DONE):
            source.look_for_index()
        if source.index is not None:
            return IndexLine("ready", 1.0, None)
        if job is None or job.state in (IndexState.CANCELLED, IndexState.DONE):
            job = self._jobs[source.name] = self._indexing.now(source.path)  # the file has changed since
        if job.error is not None:
            return IndexLine("failed", job.share, str(job.error.details["reason"]))
        return IndexLine("building", round(job.share, 3), None)

    def watchers(self, name: str) -> int:
        """How many pages look at it."""
        return self._watchers.get(name, 0)

    def find(self, name: str) -> Session | None:
        """The replay of that name; None where it is not open, or has ended."""
        session = self._sessions.get(name)
        return session if session is not None and session.failure is None else None

    def require(self, name: str) -> Session:
        """The replay of that name. Raises ReplayEndedError, or what it has ended by."""
        session = self._sessions.get(name)
        if session is None:
            raise ReplayEndedError(recording=name)
        if session.failure is not None:
            raise session.failure
        return session

    async def end(self, name: str) -> None:
        """Close it for all who look. Raises ReplayEndedError where it is not open."""
        self.require(name)
        await self._close(name)

    def shown(self, ctx: str) -> Shown | None:
        """The replay as the context of a page."""
        return self.find(ctx.removeprefix(_PREFIX)) if ctx.startswith(_PREFIX) else None

    def watch(self, ctx: str) -> Callable[[], None]:
        """Somebody looks; the answer ends it."""
        name = ctx.removeprefix(_PREFIX)
        self._watchers[name] = self._watchers.get(name, 0) + 1

        def unwatch() -> None:
            self._watchers[name] -= 1
            if not self._watchers[name]:
                del self._watchers[name]
                self._unwatched_ns[name] = self._clock()

        return unwatch

    async def _make_room(self) -> None:
        """Raises SettingsError where all that are open are looked at."""
        if len(self._sessions) < MAX_OPEN:
            return
        idle = [name for name in self._sessions if name not in self._watchers]
        if not idle:
            raise SettingsError(reason=f"{MAX_OPEN} recordings are being replayed: close one first")
        oldest = min(idle, key=lambda name: self._unwatched_ns.get(name, 0))
        await self._close(oldest)

    async def _close(self, name: str) -> None:
        session = self._sessions.pop(name, None)
        self._jobs.pop(name, None)  # others may wait for the index, too: it is made all the same
        self._unwatched_ns.pop(name, None)
        if session is not None:
            await asyncio.to_thread(session.close)

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """While the block runs, replays that nobody looks at end by and by; at its end all do."""
        sweeper = asyncio.create_task(self._sweep())
        try:
            yield
        finally:
            sweeper.cancel()
            await asyncio.gather(sweeper, return_exceptions=True)
            for name in list(self._sessions):
                await self._close(name)

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(SWEEP_S)
            now_ns = self._clock()
            for name, session in list(self._sessions.items()):
                since_ns = self._unwatched_ns.get(name, now_ns)
                idle = name not in self._watchers and now_ns - since_ns > UNWATCHED_S * 1e9
                if idle or session.failure is not None:
                    await self._close(name)


def _unchanged(session: Session, path: Path) -> bool:
    """Whether it is still the file that was opened."""
    try:
        stat = path.stat()
    except OSError:
        return True  # it is gone; what is open can be looked at all the same
    return (stat.st_size, stat.st_mtime_ns) == session.source.made_of
