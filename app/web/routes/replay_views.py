"""What a whole recording tells, by its index: timeline, events, signals over time. Reads only, for any session."""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query

from app.service.replay.views import ChangeLine, SeriesLine, SignalLine, Timeline, Views
from app.service.views import EventLine
from app.web.deps import ReplaysOf, SessionOf
from app.web.models.trace import exact_ns

router = APIRouter(prefix="/replay/{replay_id}")

Moment = Annotated[int | None, Query(ge=0, le=2**62, description="A time stamp in ns")]
Name = Annotated[str, Query(max_length=200)]


def get_views(replays: ReplaysOf, session: SessionOf) -> Views:
    """What the index tells. Raises IndexMissingError."""
    replays.index_line(session)  # takes the index that has been made meanwhile
    return Views(session.source, () if session.stage is None else session.stage.targets)


ViewsOf = Annotated[Views, Depends(get_views)]


@router.get("/timeline")
async def replay_timeline(
    views: ViewsOf, from_ns: Moment = None, to_ns: Moment = None, buckets: Annotated[int, Query(ge=1, le=4000)] = 1000
) -> Timeline:
    """Load, gaps and the events that matter most, of the whole recording or a part of it."""
    return await asyncio.to_thread(views.timeline, _exact(from_ns), _exact(to_ns), buckets)


@router.get("/events")
async def replay_events(
    views: ViewsOf,
    from_ns: Moment = None,
    to_ns: Moment = None,
    severity: Annotated[Literal["info", "warning", "error"], Query(description="The least")] = "info",
) -> list[EventLine]:
    """All that the devices told and that was noted, by time."""
    return await asyncio.to_thread(views.events, _exact(from_ns), _exact(to_ns), severity)


@router.get("/signals")
async def replay_signals(views: ViewsOf) -> list[SignalLine]:
    """Every described number that crossed the wire."""
    return await asyncio.to_thread(views.signals)


@router.get("/series")
async def replay_series(
    views: ViewsOf,
    signal: Annotated[list[str], Query(max_length=64, description="<device>/<address>, each")],
    from_ns: Moment = None,
    to_ns: Moment = None,
    points: Annotated[int, Query(ge=2, le=20_000)] = 2000,
) -> list[SeriesLine]:
    """Signals over time, each in at most about so many points: exact where they are few, else least and greatest."""
    return await asyncio.to_thread(views.series, signal, _exact(from_ns), _exact(to_ns), points)


@router.get("/history")
async def replay_history(views: ViewsOf, device: Name, address: Name) -> list[ChangeLine]:
    """When RAM of an object changed."""
    return await asyncio.to_thread(views.history, device, address)


def _exact(t_ns: int | None) -> int | None:
    return None if t_ns is None else exact_ns(t_ns)
