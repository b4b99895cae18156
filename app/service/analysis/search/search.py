"""A search over many recordings: a job that tells how far it is, what it has found and what it could not look into."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from threading import Event
from typing import Final

from app.errors import HubsideError, IndexMissingError, RecordingError
from app.service.analysis.look import Look
from app.service.analysis.search.match import Found, find
from app.service.analysis.search.query import Query
from app.service.analysis.search.told import tell
from app.service.analysis.words import Words
from app.service.indexing import Indexing
from app.service.jobs import Job

KIND: Final = "search"
MAX_HITS: Final = 2000
_LOOK_S: Final = 0.2
"""How often a search that waits for an index looks whether it is wanted still."""


class Unsearched(Enum):
    """Why a recording was not looked into."""

    NO_INDEX = "no_index"
    BROKEN = "broken"
    LIVE = "live"
    """It is being written now."""
    NOT_FITTING = "not_fitting"
    """The signature does not fit what the recording is of; the error says why."""

    @property
    def text_key(self) -> str:
        """Text key of the reason."""
        return f"analysis.unsearched.{self.value}"


@dataclass(frozen=True, slots=True)
class Hit:
    """One place of a recording that matches, with its words."""

    file: str
    turbine: str
    found: Found
    words: Words


@dataclass(frozen=True, slots=True)
class Skipped:
    """A recording that was not looked into."""

    file: str
    reason: Unsearched
    error: HubsideError | None = None


@dataclass
class Search:
    """A search as it stands; its job says how far it is. ``searched`` counts the recordings that were looked into.

    ``more`` is set where there were more hits than are kept.
    """

    query: Query
    hits: list[Hit] = field(default_factory=list)
    skipped: list[Skipped] = field(default_factory=list)
    searched: int = 0
    more: bool = False


class _EndedError(Exception):
    """The search was cancelled."""


async def run_search(
    job: Job,
    search: Search,
    paths: Sequence[Path],
    live: Path | None = None,
    cache: Path | None = None,
    indexing: Indexing | None = None,
) -> None:
    """Look into one recording after the other. With ``indexing`` those without an index get one first."""
    job.result, job.total = search, len(paths)
    ended = Event()
    try:
        for path in paths:
            if live is not None and path.name == live.name:
                search.skipped.append(Skipped(path.name, Unsearched.LIVE))
            else:
                _take(search, await asyncio.to_thread(search_one, path, search.query, cache, indexing, ended))
            job.done += 1
    except asyncio.CancelledError:
        ended.set()
        raise


def _take(search: Search, told: list[Hit] | Skipped) -> None:
    if isinstance(told, Skipped):
        search.skipped.append(told)
        return
    search.searched += 1
    room = MAX_HITS - len(search.hits)
    search.more = search.more or len(told) > room
    search.hits += told[:room]


def search_one(
    path: Path,
    query: Query,
    cache: Path | None = None,
    indexing: Indexing | None = None,
    ended: Event | None = None,
) -> list[Hit] | Skipped:
    """The hits of one recording, or why it was not looked into. Give up once ``ended`` is set."""
    over = ended or Event()
    try:
        with _look(path, cache, indexing, over) as look:
            return [Hit(path.name, look.info.turbine, one, tell(look, one)) for one in find(look, query)]
    except _EndedError:
        return []  # nobody waits for it any more
    except IndexMissingError as error:
        return Skipped(path.name, Unsearched.NO_INDEX, error)
    except RecordingError as error:
        return Skipped(path.name, Unsearched.BROKEN, error)
    except OSError as error:
        told = RecordingError(file=path.name, offset=0, reason=error.strerror or str(error))
        return Skipped(path.name, Unsearched.BROKEN, told)
    except HubsideError as error:
        return Skipped(path.name, Unsearched.NOT_FITTING, error)


def _look(path: Path, cache: Path | None, indexing: Indexing | None, ended: Event) -> Look:
    def check() -> None:
        if ended.is_set():
            raise _EndedError

    try:
        return Look(path, cache, check)
    except IndexMissingError:
        if indexing is None:
            raise
    job = indexing.now(path)
    while not job.wait(_LOOK_S).ended:
        if ended.is_set():
            job.cancel()
            raise _EndedError
    if job.error is not None:
        raise job.error
    return Look(path, cache, check)
