"""The routes of the HTTP API, one module a feature. Each calls one use case; screens rest on the socket."""

from __future__ import annotations

from fastapi import APIRouter

from app.web.deps import ANY_PROBLEM
from app.web.in_replay import WRITES_ONLY_LIVE
from app.web.routes import (
    analysis,
    audit,
    battery,
    compare,
    desk,
    devices,
    exchange,
    incidents,
    instructor,
    jobs,
    lines,
    motion,
    motors,
    pdo,
    recordings,
    replay,
    replay_views,
    restore,
    rules,
    scope,
    session,
    sets,
    settings,
    signals,
    stop,
    trace,
    turbine,
    users,
    verify,
    visits,
    writes,
)

FEATURES = (
    session,
    turbine,
    devices,
    verify,
    jobs,
    stop,
    motion,
    pdo,
    battery,
    signals,
    writes,
    recordings,
    exchange,
    sets,
    compare,
    motors,
    restore,
    rules,
    users,
    audit,
    visits,
    settings,
    trace,
    lines,
    instructor,
    replay,
    replay_views,
    desk,
    analysis,
    incidents,
    scope,
)


def api_router() -> APIRouter:
    """All routes under ``/api``; from a page that shows a replay only those that say so."""
    router = APIRouter(prefix="/api", responses=ANY_PROBLEM, dependencies=[WRITES_ONLY_LIVE])
    for feature in FEATURES:
        router.include_router(feature.router)
    router.include_router(replay.refusals)
    return router
