"""The routes of the HTTP API, one module a feature. Each calls one use case; screens rest on the socket."""

from __future__ import annotations

from fastapi import APIRouter

from app.web.deps import ANY_PROBLEM
from app.web.routes import (
    audit,
    compare,
    devices,
    instructor,
    jobs,
    motors,
    recordings,
    restore,
    rules,
    session,
    sets,
    settings,
    stop,
    trace,
    turbine,
    users,
    visits,
    writes,
)

FEATURES = (
    session,
    turbine,
    devices,
    jobs,
    stop,
    writes,
    recordings,
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
    instructor,
)


def api_router() -> APIRouter:
    """All routes under ``/api``."""
    router = APIRouter(prefix="/api", responses=ANY_PROBLEM)
    for feature in FEATURES:
        router.include_router(feature.router)
    return router
