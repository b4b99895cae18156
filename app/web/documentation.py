"""What the OpenAPI document says beyond types: which problems a route may answer with, and examples of both.

The problems follow from what a route depends on, so that no route can forget one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any, Final

from fastapi import FastAPI
from fastapi.dependencies.models import Dependant
from fastapi.openapi.utils import get_openapi
from fastapi.routing import iter_route_contexts

from app import errors
from app.errors import HubsideError
from app.web import deps
from app.web.problem import (
    MEDIA_TYPE,
    ForbiddenHostError,
    InvalidRequestError,
    NotFoundError,
    UnauthorisedError,
    problem_of,
)
from app.web.routes import instructor

API_VERSION: Final = "1"
"""Of the API itself: a release that does not change it does not change this."""

_PROBLEM: Final = {"$ref": "#/components/schemas/Problem"}
_SLUG: Final = "wtg-07/blade-2/pmc"
_READY: Final = "nmt.state.pre_operational"

ALWAYS: Final[tuple[HubsideError, ...]] = (
    UnauthorisedError(),
    ForbiddenHostError(host="evil.example", origin=None),
)
"""What any route answers a stranger, or a foreign page."""
OF_A_ROLE: Final = errors.RoleError(needs="technician", has="viewer")
OF_INPUT: Final = InvalidRequestError(reason="body.raw: Field required")
OF_A_PATH: Final = NotFoundError(what=_SLUG)
OF_A_CONNECTION: Final = errors.NotConnectedError()
OF_THE_INSTRUCTOR: Final = (
    errors.NoInstructorError(),
    errors.TwinsGoneError(reason="the connection was closed"),
)
OF_A_FAULT: Final = (
    errors.FaultOrderError(field="blade", reason="fault: field 'blade': is 4, not 1, 2 or 3"),
    errors.FaultValueError(
        field="remaining_percent", value=300.0, limits="0 … 130 %", minimum=0.0, maximum=130.0, unit="%"
    ),
)
OF_A_DEVICE: Final[tuple[HubsideError, ...]] = (
    errors.SdoAbortError(node=12, address="3110:01", abort_code=0x08000022, text_key_reason="abort.device_state"),
    errors.BusLostError(bus="can0", reason="the adapter was pulled"),
    errors.NoAnswerError(node=12, address="3110:01", timeout_s=1.0),
)

BODIES: Final[dict[str, Any]] = {
    "Nothing": {},
    "Press": {"page": "5f0c9a11d2e84b37", "number": 1},
    "ConnectRequest": {"turbine": "wtg-07"},
    "OpenReplayRequest": {"recording": "3-following-error.mcap"},
    "MomentSetsRequest": {"devices": ["wtg-07/blade-2/pmc"], "reason": "before the trip"},
    "SignatureRequest": {"text": "60F4 > 2 deg within 5 s before emcy 8611"},
    "RecordingSearchRequest": {
        "query": {
            "type": "pair",
            "left": {"type": "level", "object": "60F4", "comparison": ">", "number": 2, "unit": "°"},
            "order": "before",
            "right": {"type": "event", "kind": "emcy", "code": 0x8611},
            "within_ms": 5000,
        },
        "recordings": ["3-following-error.mcap"],
    },
    "AlignRequest": {
        "recordings": [
            {"name": "3-following-error.mcap", "trip": 0},
            {"name": "5-bloc-ageing.mcap", "t_ns": 1772449260945239552},
        ],
        "signals": [{"address": "6064", "device": "pmc"}, {"address": "60F4", "blade": 2}],
        "before_ms": 5000,
        "after_ms": 15000,
    },
    "CutRequest": {"start_ns": 1772449240000000000, "end_ns": 1772449250000000000, "buses": ["can0"]},
    "MergeRequest": {
        "recordings": [
            {"name": "3-following-error.mcap"},
            {"name": "5-bloc-ageing.mcap", "offset_ns": 3600000000000, "buses": {"can0": "can1"}},
        ]
    },
    "AnonymiseRequest": {"hide_times": True, "objects": ["2105:01"], "words": ["wtg-07"]},
    "CursorRequest": {"action": "step", "by": "event", "forward": True},
    "SaveRequest": {"category": "tuning"},
    "ReadRequest": {"addresses": ["6064", "3110:01"]},
    "WriteRequest": {"address": "3110:01", "raw": 490},
    "WritesRequest": {
        "rows": [{"device": "wtg-07/blade-1/pmm", "address": "3110:01", "raw": 490, "expected_raw": 500}],
        "save": ["wtg-07/blade-1/pmm"],
        "on_failure": "stop",
    },
    "RestorePlanRequest": {
        "station": "wtg-07/blade-1",
        "sets": ["0197a000-0000-7000-8000-000000000001", "0197a000-0000-7000-8000-000000000002"],
        "restart": True,
    },
    "RestoreRequest": {
        "station": "wtg-07/blade-1",
        "sets": ["0197a000-0000-7000-8000-000000000001", "0197a000-0000-7000-8000-000000000002"],
        "restart": True,
        "plan_hash": "5f" * 32,
        "reason": "motor exchanged",
        "work_order": "WO-20417",
        "confirm_s": 300,
    },
    "GiveUpRequest": {"reason": "the PMC was exchanged, a set is restored into the new one"},
    "BackupRequest": {"reason": "before the exchange of the motor"},
    "LoginRequest": {"name": "Anna", "password": "correct horse battery"},
    "OwnPassword": {"old": "correct horse battery", "new": "blade and hub 12"},
    "NewUser": {"name": "Ben", "password": "blade and hub 12", "role": "technician"},
    "UserChange": {"role": "expert", "disabled": False, "password": None},
    "VisitChange": {"reason": "yearly service", "work_order": "WO-20417"},
    "VisitEnd": {"reason": "yearly service", "work_order": "WO-20417"},
    "Favourites": {"addresses": ["6064", "3110:01"]},
    "TestRequest": {"connection": "socketcan:can0", "bitrate": 500_000, "sure": False},
    "SearchRequest": {"connection": "slcan:/dev/ttyACM0"},
    "ScanRequest": {"connection": "socketcan:can0", "bitrate": 500_000, "consent": False},
    "TurbineChange": {
        "revision": "6f1c09",
        "turbine": {
            "slug": "wtg-08",
            "name": "WTG-08",
            "buses": [{"name": "can0", "connection": "socketcan:can0", "bitrate": 500_000}],
            "stations": [],
        },
    },
}
"""An example of every body whose type has none of its own, by the name of the type."""


def document(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document of ``app``."""
    made = get_openapi(title=app.title, version=API_VERSION, routes=app.routes)
    for route in iter_route_contexts(app.routes):
        dependant: Dependant | None = getattr(route, "dependant", None)
        for method in getattr(route, "methods", None) or ():
            operation = made["paths"].get(route.path, {}).get(method.lower())
            if operation is not None and dependant is not None:
                operation["responses"] = {
                    **{code: answer for code, answer in operation["responses"].items() if code != "default"},
                    **_problems(str(route.path), dependant),
                    "default": _described("Anything else that went wrong", []),
                }
                _with_example(operation, made["components"]["schemas"])
    return made


def _problems(path: str, dependant: Dependant) -> dict[str, Any]:
    by_status: dict[int, list[HubsideError]] = {}
    for error in _errors(path, dependant):
        by_status.setdefault(problem_of(error).status, []).append(error)
    return {str(code): _described(HTTPStatus(code).phrase, found) for code, found in sorted(by_status.items())}


def _errors(path: str, dependant: Dependant) -> Iterator[HubsideError]:
    calls = list(_calls(dependant))
    yield from ALWAYS
    if any(isinstance(call, deps.Needs) for call in calls):
        yield OF_A_ROLE
    if dependant.body_params or dependant.query_params:
        yield OF_INPUT
    if "{" in path:
        yield OF_A_PATH
    if deps.get_connection in calls:
        yield OF_A_CONNECTION
    if instructor.get_desk in calls:
        yield from OF_THE_INSTRUCTOR
        if dependant.body_params:
            yield from OF_A_FAULT
    if deps.get_target in calls:
        yield from OF_A_DEVICE


def _calls(dependant: Dependant) -> Iterator[Callable[..., Any]]:
    for inner in dependant.dependencies:
        if inner.call is not None:
            yield inner.call
        yield from _calls(inner)


def _described(text: str, found: list[HubsideError]) -> dict[str, Any]:
    media: dict[str, Any] = {"schema": _PROBLEM}
    if found:
        media["examples"] = {
            error.code: {"value": problem_of(error, device_state=_state_with(error)).model_dump()} for error in found
        }
    return {"description": text, "content": {MEDIA_TYPE: media}}


def _state_with(error: HubsideError) -> str | None:
    return _READY if error in OF_A_DEVICE else None


def _with_example(operation: dict[str, Any], schemas: dict[str, Any]) -> None:
    media = operation.get("requestBody", {}).get("content", {}).get("application/json")
    if media is not None:
        name = media["schema"]["$ref"].rpartition("/")[2]
        own = schemas[name].get("examples")
        media["example"] = own[0] if own else BODIES[name]
