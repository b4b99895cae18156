"""Replays: open a recording, move its cursor, end it. What is seen at the cursor has the read routes of the live bench.

Nothing under ``/replay`` can write to a device: there is no driver behind it, and what would write is refused.
"""

from __future__ import annotations

import asyncio
from typing import Final

from fastapi import APIRouter, Request

from app.errors import RecordingError, RecordingLiveError, ReplayOnlyError
from app.model.roles import Role
from app.model.set_record import Source
from app.service.shown import CursorLine
from app.web.deps import BenchOf, PersonOf, ReplaysOf, SessionOf, needs
from app.web.models import Nothing
from app.web.models.replay import CursorRequest, MomentSet, MomentSetsRequest, OpenReplayRequest, ReplayDoc
from app.web.models.trace import exact_ns
from app.web.problem import NotFoundError
from app.web.routes.recordings import RecordingsOf, is_live

router = APIRouter()
ANSWER_TIMEOUT_S: Final = 60.0
refusals = APIRouter(include_in_schema=False)
"""To be registered behind all other routes under ``/replay``."""


@router.get("/replay")
async def replays(opened: ReplaysOf) -> list[ReplayDoc]:
    """All replays that are open."""
    return [ReplayDoc.of(session, opened) for session in opened.sessions.values() if session.failure is None]


@router.post("/replay")
async def open_replay(bench: BenchOf, opened: ReplaysOf, files: RecordingsOf, request: OpenReplayRequest) -> ReplayDoc:
    """Replay a recording. Where somebody replays it already it is the same replay, with the same cursor."""
    path = files.path(request.recording)
    if path is None:
        raise NotFoundError(what=request.recording)
    if is_live(bench, path):
        raise RecordingLiveError(recording=path.name)
    return ReplayDoc.of(await opened.open(path, request.at_ns), opened)


@router.get("/replay/{replay_id}")
async def replay(opened: ReplaysOf, session: SessionOf) -> ReplayDoc:
    """One replay as it is now."""
    return ReplayDoc.of(session, opened)


@router.delete("/replay/{replay_id}", dependencies=[needs(Role.TECHNICIAN)])
async def end_replay(opened: ReplaysOf, session: SessionOf) -> Nothing:
    """Close it, for all who look at it."""
    await opened.end(session.source.name)
    return Nothing()


@router.post("/replay/{replay_id}/cursor")
async def move_cursor(session: SessionOf, request: CursorRequest) -> CursorLine:
    """Move the cursor, for all who look; the answer tells where it stands when the state there is known."""
    answer = asyncio.wrap_future(session.order(request.order()))
    try:
        return await asyncio.wait_for(answer, ANSWER_TIMEOUT_S)
    except TimeoutError as error:
        reason = f"no state at that time within {ANSWER_TIMEOUT_S:g} s"
        raise RecordingError(file=session.source.path.name, offset=0, reason=reason) from error


@router.post("/replay/{replay_id}/sets", dependencies=[needs(Role.TECHNICIAN)])
async def keep_moment(
    bench: BenchOf, session: SessionOf, person: PersonOf, request: MomentSetsRequest
) -> list[MomentSet]:
    """Keep what was known at a moment as sets of the library: candidates for a restore, which happens live."""
    if bench.moments is None:
        raise NotFoundError(what="recordings")
    t_ns = session.cursor().t_ns if request.t_ns is None else exact_ns(request.t_ns)
    moment = await bench.moments.at(session.source.name, t_ns)
    sets = [moment.parameters(device, person.person, request.reason) for device in request.devices]
    records = await bench.office.library.put(sets, Source.RECORDING)
    return [
        MomentSet(id=record.id, device=one.origin.device, known=len(one.values), unseen=len(one.unread))
        for one, record in zip(sets, records, strict=True)
    ]


@refusals.api_route("/replay/{replay_id}/{path:path}", methods=["POST", "PUT", "PATCH", "DELETE"])
async def write_to_replay(_request: Request, replay_id: str, path: str) -> None:
    """Nothing that was recorded can be changed, and no device is behind it."""
    raise ReplayOnlyError(recording=replay_id, path=path)
