"""What a page may do while it shows a replay: read, and what is named here. All else is refused, new routes too.

What is written must be what was looked at: a page that shows a recording writes to no device, drives no bus and changes
nothing in a twin. STOP and FEATHER always go.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from fastapi import Depends, Request
from starlette.routing import compile_path

from app.errors import ReplayOnlyError
from app.service.shown import LIVE

IN_CONTEXT: Final = "X-Hubside-Context"
"""Header by which a page says what it shows: ``live``, or ``replay/`` and a name."""

_READS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
ALSO_IN_REPLAY: Final[tuple[tuple[str, str], ...]] = (
    # what stops, and what only ends something
    ("POST", "/api/live/stop"),
    ("POST", "/api/live/feather"),
    ("POST", "/api/live/devices/{turbine}/{station}/{device}/stop"),
    ("POST", "/api/live/disconnect"),
    ("POST", "/api/live/motion/lease/withdraw"),
    ("POST", "/api/live/motion/lease/answer"),
    ("POST", "/api/live/motion/lease/give-back"),
    ("POST", "/api/live/scope/stop"),
    ("DELETE", "/api/live/jobs/{job_id}"),
    ("POST", "/api/live/restores/{restore_id}/give-up"),
    # who asks, people, notes of the visit
    ("POST", "/api/login"),
    ("POST", "/api/logout"),
    ("POST", "/api/password"),
    ("POST", "/api/users"),
    ("PATCH", "/api/users/{user_id}"),
    ("POST", "/api/audit/verify"),
    ("PATCH", "/api/live/visit"),
    ("POST", "/api/live/visit/end"),
    ("PUT", "/api/favourites/{description_id}"),
    ("PUT", "/api/desk/views"),
    # replays, recordings, and why it tripped
    ("POST", "/api/replay"),
    ("POST", "/api/replay/{path:path}"),
    ("PUT", "/api/replay/{path:path}"),
    ("PATCH", "/api/replay/{path:path}"),
    ("DELETE", "/api/replay/{path:path}"),
    ("POST", "/api/recordings/import"),
    ("POST", "/api/recordings/merge"),
    ("POST", "/api/recordings/{name}/cut"),
    ("POST", "/api/recordings/{name}/anonymise"),
    ("POST", "/api/recordings/{name}/recover-sets"),
    ("POST", "/api/recordings/{name}/annotations"),
    ("DELETE", "/api/recordings/made/{job_id}"),
    ("PUT", "/api/annotations/{annotation_id}"),
    ("DELETE", "/api/annotations/{annotation_id}"),
    ("POST", "/api/incidents"),
    ("POST", "/api/incidents/import"),
    ("PUT", "/api/incidents/{key}"),
    ("DELETE", "/api/incidents/{key}"),
    ("PATCH", "/api/scope/captures/{capture_id}"),
    ("DELETE", "/api/scope/captures/{capture_id}"),
    ("POST", "/api/search"),
    ("POST", "/api/search/signature"),
    ("DELETE", "/api/search/{job_id}"),
    ("POST", "/api/align"),
    # libraries and files of the bench, comparing
    ("POST", "/api/sets/import"),
    ("POST", "/api/sets/{key}/tags"),
    ("PUT", "/api/nameplates"),
    ("POST", "/api/compare"),
    ("POST", "/api/compare/export"),
    ("POST", "/api/fleet"),
    ("POST", "/api/rules/check"),
    ("POST", "/api/motors"),
    ("POST", "/api/motors/import"),
    ("PUT", "/api/motors/{motor_id}"),
    ("DELETE", "/api/motors/{motor_id}"),
    ("POST", "/api/motors/{motor_id}/assign"),
    ("POST", "/api/settings/site/turbines"),
    ("PUT", "/api/settings/site/turbines/{slug}"),
    ("DELETE", "/api/settings/site/turbines/{slug}"),
)
"""None of these reaches a bus or a twin, but STOP and FEATHER."""
_ALSO: Final = tuple((method, compile_path(path)[0]) for method, path in ALSO_IN_REPLAY)


def refuse_in_replay(request: Request) -> None:
    """Of all routes of the API. Raises ReplayOnlyError."""
    if _is_live(request.headers.getlist(IN_CONTEXT)) or request.method in _READS:
        return
    path = str(request.scope["path"])
    if not any(method == request.method and pattern.match(path) for method, pattern in _ALSO):
        raise ReplayOnlyError(path=path)


def _is_live(contexts: Iterable[str]) -> bool:
    return all(context == LIVE for context in contexts)


WRITES_ONLY_LIVE: Final = Depends(refuse_in_replay)
