"""Why it tripped: trips of a recording in words, events to jump to, searching many recordings, laying them over."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query

from app.errors import HubsideError, UsageError
from app.model.description import Bus
from app.model.description_file import BUILTIN, load_builtin
from app.service.analysis.align import align, zero_of_trip
from app.service.analysis.key_events import ALL_KINDS, KeyKind, events_after, events_before, key_events
from app.service.analysis.look import Look
from app.service.analysis.search import query as q
from app.service.analysis.search.match import check
from app.service.analysis.search.search import KIND, Search, run_search
from app.service.analysis.words import tellers
from app.service.bench import Bench
from app.service.jobs import Job
from app.service.recording_list import Recordings
from app.web.deps import BenchOf, JobsOf
from app.web.models.analysis import AlignDoc, AlignedDoc, AlignRequest, AnchorAt, KeyEventDoc, TripsDoc
from app.web.models.signature import RecordingSearchRequest, SignatureDoc, SignatureRequest, SignatureSearchDoc
from app.web.models.trace import exact_ns
from app.web.problem import NotFoundError, jsonable
from app.web.routes.recordings import RecordingsOf, live_file

router = APIRouter()

Moment = Annotated[int | None, Query(ge=0, le=2**62, description="A time stamp in ns")]


@router.get("/recordings/{name}/trips")
async def recording_trips(bench: BenchOf, recordings: RecordingsOf, name: str) -> TripsDoc:
    """The trips of a recording, each with what came first. It must have an index."""
    path, cache = _known(recordings, name), _cache(bench)

    def told() -> TripsDoc:
        with Look(path, cache) as look:
            return TripsDoc.of(look)

    return await asyncio.to_thread(told)


@router.get("/recordings/{name}/key-events")
async def recording_key_events(
    bench: BenchOf,
    recordings: RecordingsOf,
    name: str,
    after: Moment = None,
    before: Moment = None,
    kind: Annotated[list[KeyKind] | None, Query(description="All where none is given")] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 1,
) -> list[KeyEventDoc]:
    """The next trips, errors and warnings after a time, or those before it, the nearest first."""
    if (after is None) == (before is None):
        raise UsageError(reason="give after or before")
    path, cache = _known(recordings, name), _cache(bench)

    def told() -> list[KeyEventDoc]:
        with Look(path, cache) as look:
            events = key_events(look, kind or ALL_KINDS)
            if after is not None:
                found = events_after(events, exact_ns(after), limit)
            else:
                found = events_before(events, exact_ns(before or 0), limit)
            words = tellers(look.places)
            return [KeyEventDoc.of(look, event, words) for event in found]

    return await asyncio.to_thread(told)


# -- searching ------------------------------------------------------------------


@router.post("/search/signature")
async def read_signature(request: SignatureRequest) -> SignatureDoc:
    """A signature as it is understood, without searching. The problem names the character where it is not."""
    return SignatureDoc.of(_checked(request))


@router.post("/search")
async def search_recordings(
    bench: BenchOf, recordings: RecordingsOf, jobs: JobsOf, request: RecordingSearchRequest
) -> SignatureSearchDoc:
    """Search recordings for a signature, in the background; results come as they are found."""
    search = Search(_checked(request))
    paths = await asyncio.to_thread(_paths, recordings, request.recordings)

    async def work(job: Job) -> None:
        indexing = bench.indexing if request.make_indexes else None
        await run_search(job, search, paths, live_file(bench), _cache(bench), indexing)

    job = jobs.start(KIND, "", work)
    job.result, job.total = search, len(paths)
    return SignatureSearchDoc.of(job, search, 0)


@router.get("/search/{job_id}")
async def recording_search(
    jobs: JobsOf, job_id: str, since: Annotated[int, Query(ge=0, le=100_000, description="Hits known already")] = 0
) -> SignatureSearchDoc:
    """How a search stands, with the hits that are not known yet."""
    return _search_doc(jobs.get(job_id), job_id, since)


@router.delete("/search/{job_id}")
async def cancel_recording_search(jobs: JobsOf, job_id: str) -> SignatureSearchDoc:
    """End a search; what it has found stays."""
    if _is_search(jobs.get(job_id)):
        jobs.cancel(job_id)
    return _search_doc(jobs.get(job_id), job_id, 0)


def _checked(request: SignatureRequest) -> q.Query:
    query = request.signature()
    known = [load_builtin(name) for name in BUILTIN]
    check(query, [one for one in known if one.bus is Bus.CANOPEN])
    return query


def _is_search(job: Job | None) -> bool:
    return job is not None and job.kind == KIND


def _search_doc(job: Job | None, job_id: str, since: int) -> SignatureSearchDoc:
    if job is None or not isinstance(job.result, Search):
        raise NotFoundError(what=job_id)
    return SignatureSearchDoc.of(job, job.result, since)


def _paths(recordings: Recordings, names: list[str] | None) -> list[Path]:
    """The files of these names, or all; a search looks into the latest first."""
    if names is None:
        return [path for one in recordings.files(None) if (path := recordings.path(one.name)) is not None]
    return [_known(recordings, name) for name in dict.fromkeys(names)]


# -- laying over ----------------------------------------------------------------


@router.post("/align")
async def align_recordings(bench: BenchOf, recordings: RecordingsOf, request: AlignRequest) -> AlignDoc:
    """Signals of several recordings on one axis, each by its own zero.

    A recording that cannot be shown tells why; the others are shown all the same.
    """
    cache = _cache(bench)
    found = [await asyncio.to_thread(_aligned, recordings, anchor, request, cache) for anchor in request.recordings]
    return AlignDoc(recordings=found)


def _aligned(recordings: Recordings, anchor: AnchorAt, request: AlignRequest, cache: Path | None) -> AlignedDoc:
    if (anchor.trip is None) == (anchor.t_ns is None):
        raise UsageError(reason=f"{anchor.name}: give trip or t_ns")
    turbine = ""
    try:
        with Look(_known(recordings, anchor.name), cache) as look:
            turbine = look.info.turbine
            t0_ns = zero_of_trip(look, anchor.trip) if anchor.trip is not None else exact_ns(anchor.t_ns or 0)
            return AlignedDoc.of(align(look, t0_ns, [one.signal() for one in request.signals], request.window()))
    except HubsideError as error:
        return AlignedDoc(
            name=anchor.name, turbine=turbine, t0_ns=None, from_ms=0, to_ms=0, tracks=[],
            problem=error.text_key, problem_details=jsonable(dict(error.details)),
        )  # fmt: skip


def _known(recordings: Recordings, name: str) -> Path:
    path = recordings.path(name)
    if path is None:
        raise NotFoundError(what=name)
    return path


def _cache(bench: Bench) -> Path | None:
    """Where indexes lie whose recordings are in a folder that takes no files."""
    return None if bench.options.data is None else bench.options.data / "indexes"
