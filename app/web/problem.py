"""Errors as the page gets them: application/problem+json (RFC 9457) with code, text key, details and device state."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from decimal import Decimal
from enum import Enum
from http import HTTPStatus
from typing import Any, ClassVar, Final

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from app import errors
from app.errors import HubsideError
from app.model.texts import LANGUAGES, Texts, error_text, load_texts
from app.web.models import Failure, Problem

log = logging.getLogger(__name__)

MEDIA_TYPE: Final = "application/problem+json"

_STATUS: Final[tuple[tuple[type[HubsideError], HTTPStatus], ...]] = (
    (errors.UnknownObjectError, HTTPStatus.NOT_FOUND),
    (errors.PreconditionError, HTTPStatus.CONFLICT),
    (errors.OrderError, HTTPStatus.CONFLICT),
    (errors.NotWrittenError, HTTPStatus.CONFLICT),
    (errors.ConflictError, HTTPStatus.CONFLICT),
    (errors.ConsentError, HTTPStatus.CONFLICT),
    (errors.SettingsError, HTTPStatus.CONFLICT),
    (errors.LoginError, HTTPStatus.UNAUTHORIZED),
    (errors.LoginNeededError, HTTPStatus.UNAUTHORIZED),
    (errors.LoginPausedError, HTTPStatus.TOO_MANY_REQUESTS),
    (errors.UserUnknownError, HTTPStatus.NOT_FOUND),
    (errors.MotorUnknownError, HTTPStatus.NOT_FOUND),
    (errors.MotorChangedError, HTTPStatus.CONFLICT),
    (errors.MotorInventedError, HTTPStatus.CONFLICT),
    (errors.IncidentUnknownError, HTTPStatus.NOT_FOUND),
    (errors.IncidentChangedError, HTTPStatus.CONFLICT),
    (errors.IncidentRecordingError, HTTPStatus.CONFLICT),
    (errors.AnnotationUnknownError, HTTPStatus.NOT_FOUND),
    (errors.UserExistsError, HTTPStatus.CONFLICT),
    (errors.LastExpertError, HTTPStatus.CONFLICT),
    (errors.NoVisitError, HTTPStatus.CONFLICT),
    (errors.NoInstructorError, HTTPStatus.CONFLICT),
    (errors.ReplayOnlyError, HTTPStatus.CONFLICT),
    (errors.RecordingLiveError, HTTPStatus.CONFLICT),
    (errors.IndexMissingError, HTTPStatus.CONFLICT),
    (errors.MomentError, HTTPStatus.NOT_FOUND),
    (errors.ReplayEndedError, HTTPStatus.NOT_FOUND),
    (errors.RestoreUnknownError, HTTPStatus.NOT_FOUND),
    (errors.SetUnknownError, HTTPStatus.NOT_FOUND),
    (errors.SignalUnknownError, HTTPStatus.NOT_FOUND),
    (errors.DeviceBusyError, HTTPStatus.CONFLICT),
    (errors.RestoreOpenError, HTTPStatus.CONFLICT),
    (errors.RestoreRefusedError, HTTPStatus.CONFLICT),
    (errors.RestoreChangedError, HTTPStatus.CONFLICT),
    (errors.RestoreStateError, HTTPStatus.CONFLICT),
    (errors.LeaseNeededError, HTTPStatus.CONFLICT),
    (errors.LeaseHeldError, HTTPStatus.CONFLICT),
    (errors.LeaseError, HTTPStatus.CONFLICT),
    (errors.OldOrderError, HTTPStatus.CONFLICT),
    (errors.NotHeldError, HTTPStatus.CONFLICT),
    (errors.InterlockError, HTTPStatus.CONFLICT),
    (errors.AxisStateError, HTTPStatus.CONFLICT),
    (errors.NotPreparedError, HTTPStatus.CONFLICT),
    (errors.BatteryConditionError, HTTPStatus.CONFLICT),
    (errors.BatteryNotNotedError, HTTPStatus.CONFLICT),
    (errors.OvertakenError, HTTPStatus.CONFLICT),
    (errors.PdoUnknownError, HTTPStatus.CONFLICT),
    (errors.PdoChangedError, HTTPStatus.CONFLICT),
    (errors.PdoBusyError, HTTPStatus.CONFLICT),
    (errors.PdoNoUndoError, HTTPStatus.CONFLICT),
    (errors.ScopeStateError, HTTPStatus.CONFLICT),
    (errors.ScopeUnknownError, HTTPStatus.NOT_FOUND),
    (errors.RefusedError, HTTPStatus.UNPROCESSABLE_ENTITY),
    (errors.ColumnError, HTTPStatus.NOT_FOUND),
    (errors.StoreError, HTTPStatus.SERVICE_UNAVAILABLE),
    (errors.UsageError, HTTPStatus.BAD_REQUEST),
    (errors.RecordingError, HTTPStatus.UNPROCESSABLE_ENTITY),
    (errors.BusLostError, HTTPStatus.SERVICE_UNAVAILABLE),
    (errors.BusOpenError, HTTPStatus.SERVICE_UNAVAILABLE),
    (errors.TwinsGoneError, HTTPStatus.SERVICE_UNAVAILABLE),
    (errors.NoAnswerError, HTTPStatus.GATEWAY_TIMEOUT),
    (errors.DeviceError, HTTPStatus.BAD_GATEWAY),
    (errors.ProtocolError, HTTPStatus.BAD_GATEWAY),
    (errors.UnverifiedError, HTTPStatus.BAD_GATEWAY),
    (errors.RestoreBrokenError, HTTPStatus.BAD_GATEWAY),
    (errors.PdoRolledBackError, HTTPStatus.BAD_GATEWAY),
    (errors.PdoBrokenError, HTTPStatus.BAD_GATEWAY),
)
"""The first that fits counts. 4xx: nothing was sent; 502 to 504: it was, and something on the bus went wrong."""


class NotFoundError(errors.RefusedError):
    """The address names nothing. Details: what."""

    code: ClassVar[str] = "not_found"


class UnauthorisedError(errors.RefusedError):
    """No session: the printed address must be opened first."""

    code: ClassVar[str] = "unauthorised"


class ForbiddenHostError(errors.RefusedError):
    """Asked under a name, or from a page, that is not ours. Details: host, origin."""

    code: ClassVar[str] = "forbidden_host"


class InvalidRequestError(errors.RefusedError):
    """The request cannot be understood. Details: reason."""

    code: ClassVar[str] = "invalid"


class TooLargeError(InvalidRequestError):
    """The request's body is larger than any that is understood. Details: reason."""


class SceneGoneError(errors.NoAnswerError):
    """The 3D server does not answer. Details: reason."""

    code: ClassVar[str] = "scene_gone"


_OWN_STATUS: Final[Mapping[type[HubsideError], HTTPStatus]] = {
    NotFoundError: HTTPStatus.NOT_FOUND,
    errors.NotConnectedError: HTTPStatus.CONFLICT,
    errors.RoleError: HTTPStatus.FORBIDDEN,
    UnauthorisedError: HTTPStatus.UNAUTHORIZED,
    ForbiddenHostError: HTTPStatus.FORBIDDEN,
    InvalidRequestError: HTTPStatus.UNPROCESSABLE_ENTITY,
    TooLargeError: HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
    SceneGoneError: HTTPStatus.BAD_GATEWAY,
}


def status_of(error: HubsideError) -> HTTPStatus:
    """The HTTP status of an error of ours."""
    own = _OWN_STATUS.get(type(error))
    if own is not None:
        return own
    return next((status for kind, status in _STATUS if isinstance(error, kind)), HTTPStatus.INTERNAL_SERVER_ERROR)


def problem_of(
    error: HubsideError,
    status: HTTPStatus | None = None,
    device_state: str | None = None,
    texts: Texts | None = None,
) -> Problem:
    """The document of an error; ``device_state`` is a text key. ``texts`` in English where None."""
    status = status or status_of(error)
    return Problem(
        type=f"urn:hubside:error:{error.code}",
        title=status.phrase,
        status=status.value,
        code=error.code,
        text=error_text(texts or load_texts("en"), error),
        text_key=error.text_key,
        details={name: jsonable(detail) for name, detail in error.details.items()},
        device_state=device_state,
    )


def jsonable(detail: Any) -> Any:
    """A detail as JSON carries it: bytes as hexadecimal digits, enumerations as their value, all else as text."""
    if detail is None or isinstance(detail, bool | int | float | str):
        return detail
    if isinstance(detail, bytes):
        return detail.hex(" ")
    if isinstance(detail, Enum):
        return jsonable(detail.value)
    if isinstance(detail, Decimal):
        return int(detail) if detail == int(detail) else float(detail)
    if isinstance(detail, Mapping):
        return {str(key): jsonable(item) for key, item in detail.items()}
    if isinstance(detail, list | tuple | set | frozenset):
        return [jsonable(item) for item in detail]
    return str(detail)


def texts_for(accept_language: str | None, usual: str = "en") -> Texts:
    """The texts of the language that an Accept-Language field wants most (RFC 9110, 12.5.4) and we speak."""
    best, weight = usual, 0.0
    for wish in (accept_language or "").split(","):
        tag, _, parameter = wish.partition(";")
        language = tag.strip().lower().partition("-")[0]
        wanted = _weight(parameter)
        if language in LANGUAGES and wanted > weight:
            best, weight = language, wanted
    return load_texts(best)


def _weight(parameter: str) -> float:
    name, _, number = parameter.strip().partition("=")
    try:
        return float(number) if name.strip() == "q" else 1.0
    except ValueError:
        return 0.0


def response_of(problem: Problem) -> JSONResponse:
    """The answer that carries a problem."""
    return JSONResponse(problem.model_dump(), problem.status, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Have every error answered as a problem; defects of ours are logged with their traceback and named as such."""

    def answer(request: Request, error: HubsideError, status: HTTPStatus | None = None) -> JSONResponse:
        state = getattr(request.state, "device_state", None)
        texts = texts_for(request.headers.get("accept-language"), app.state.language)
        return response_of(problem_of(error, status, state() if callable(state) else None, texts))

    @app.exception_handler(HubsideError)
    async def refused(request: Request, error: HubsideError) -> JSONResponse:
        return answer(request, error)

    @app.exception_handler(RequestValidationError)
    async def invalid(request: Request, error: RequestValidationError) -> JSONResponse:
        reason = "; ".join(f"{'.'.join(str(part) for part in one['loc'])}: {one['msg']}" for one in error.errors())
        return answer(request, InvalidRequestError(reason=reason))

    @app.exception_handler(HTTPException)
    async def plain(request: Request, error: HTTPException) -> JSONResponse:
        status = HTTPStatus(error.status_code)
        own = NotFoundError(what=request.url.path) if status is HTTPStatus.NOT_FOUND else None
        return answer(request, own or InvalidRequestError(reason=status.phrase), status)

    @app.exception_handler(Exception)
    async def defect(request: Request, error: Exception) -> JSONResponse:
        log.error("%s %s failed", request.method, request.url.path, exc_info=error)
        return answer(request, HubsideError(reason=type(error).__name__))


def failure(address: str, error: HubsideError) -> Failure:
    """An error as part of a result."""
    problem = problem_of(error)
    return Failure(address=address, code=problem.code, text_key=problem.text_key, details=problem.details)
