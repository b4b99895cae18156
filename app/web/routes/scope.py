"""The scope: who may look sees it, technicians arm it; captures are read, named, deleted and taken out as files."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.responses import StreamingResponse
from pydantic import TypeAdapter

from app.errors import ScopeSettingsError
from app.model.roles import Role
from app.model.texts import load_texts
from app.service.scope.capture import Capture, CaptureLine, InForce
from app.service.scope.captures import Captures
from app.service.scope.desk import ScopeDesk
from app.service.scope.export import csv_pieces, json_pieces
from app.service.scope.in_force import Frozen, in_force
from app.service.scope.line import ScopeLine, ScopeView, latest_of, scope_line, scope_view
from app.service.scope.series import ScopeSeries, XyPoints, capture_series, xy_points
from app.service.scope.spectrum import Spectrum, spectrum_of
from app.web.attachment import as_attachment
from app.web.deps import BenchOf, ConnectionOf, PersonOf, needs
from app.web.made_apart import list_made_apart, made_apart
from app.web.models import Nothing
from app.web.models.scope import ArmRequest, CaptureChange, CaptureDoc, InForceDoc

router = APIRouter()
TECHNICIAN = needs(Role.TECHNICIAN)
CAPTURE = "/scope/captures/{capture_id}"
Points = Annotated[int, Query(ge=10, le=20_000)]
Name = Annotated[str, Query(max_length=250, examples=["wtg-07/blade-1/pmc/6064"])]
_VIEW = TypeAdapter(ScopeView)
_LINE = TypeAdapter(CaptureLine)
_DOC = TypeAdapter(CaptureDoc)
_SERIES = TypeAdapter(ScopeSeries)
_SPECTRUM = TypeAdapter(Spectrum)
_XY = TypeAdapter(XyPoints)
_ROW = TypeAdapter(InForceDoc)
Second = Annotated[float, Query(ge=-1e6, le=1e6, description="s since the trigger")]


def get_scope(bench: BenchOf) -> ScopeDesk:
    """The scope of this bench."""
    return bench.scope


def get_captures(bench: BenchOf) -> Captures:
    """The captures of this server's store."""
    return bench.office.captures


ScopeOf = Annotated[ScopeDesk, Depends(get_scope)]
CapturesOf = Annotated[Captures, Depends(get_captures)]


# -- the scope -----------------------------------------------------------------------


@router.get("/live/scope")
async def scope(bench: BenchOf, desk: ScopeOf) -> ScopeLine:
    """What the scope does, and how fast its signals come."""
    return scope_line(desk, bench.connection is not None)


@router.get("/live/scope/view", response_model=ScopeView)
async def scope_preview(desk: ScopeOf, points: Points = 500) -> Response:
    """The last seconds of what it sees, while it is armed."""
    latest = latest_of(desk)
    return await made_apart(_VIEW, lambda: scope_view(latest, points))


@router.post("/live/scope/arm", dependencies=[TECHNICIAN])
async def arm_scope(desk: ScopeOf, connection: ConnectionOf, person: PersonOf, request: ArmRequest) -> ScopeLine:
    """Arm it; what was armed before ends."""
    await desk.arm(connection, request.order(), person.person)
    return scope_line(desk, True)


@router.post("/live/scope/trigger", dependencies=[TECHNICIAN])
async def trigger_scope(desk: ScopeOf, _connection: ConnectionOf) -> ScopeLine:
    """Begin a capture now."""
    desk.trigger_now()
    return scope_line(desk, True)


@router.post("/live/scope/stop", dependencies=[TECHNICIAN])
async def stop_scope(bench: BenchOf, desk: ScopeOf) -> ScopeLine:
    """End it; a capture under way is kept as far as it came."""
    await desk.stop()
    return scope_line(desk, bench.connection is not None)


# -- captures ------------------------------------------------------------------------


@router.get("/scope/captures", response_model=list[CaptureLine])
async def captures(kept: CapturesOf) -> Response:
    """All captures, the latest first."""
    found = await kept.all()
    return await list_made_apart(_LINE, lambda: found)


@router.get(CAPTURE, response_model=CaptureDoc)
async def capture(kept: CapturesOf, capture_id: str) -> Response:
    """One capture without its values."""
    found = await kept.head(capture_id)
    return await made_apart(_DOC, lambda: CaptureDoc.of(found))


@router.patch(CAPTURE, dependencies=[TECHNICIAN])
async def change_capture(kept: CapturesOf, person: PersonOf, capture_id: str, given: CaptureChange) -> CaptureDoc:
    """Give it a name and a note."""
    await kept.change(capture_id, given.name.strip() or given.name, given.note, person.person)
    return CaptureDoc.of(await kept.head(capture_id))


@router.delete(CAPTURE, dependencies=[TECHNICIAN])
async def delete_capture(kept: CapturesOf, person: PersonOf, capture_id: str) -> Nothing:
    """Forget it."""
    await kept.delete(capture_id, person.person)
    return Nothing()


@router.get(CAPTURE + "/series", response_model=list[ScopeSeries])
async def capture_values(
    kept: CapturesOf, capture_id: str, from_s: Second | None = None, to_s: Second | None = None, points: Points = 2000
) -> Response:
    """Its signals over time: every value where they are few, else least and greatest."""
    found = await kept.get(capture_id)
    span = _span(found, from_s, to_s)
    return await list_made_apart(_SERIES, lambda: capture_series(found, *span, points))


@router.get(CAPTURE + "/spectrum", response_model=Spectrum)
async def capture_spectrum(
    kept: CapturesOf, capture_id: str, signal: Name, from_s: Second | None = None, to_s: Second | None = None
) -> Response:
    """The spectrum of one signal of it, of a stretch or of all."""
    found = await kept.get(capture_id)
    at = _signal(found, signal)
    span = _span(found, from_s, to_s)
    return await made_apart(_SPECTRUM, lambda: spectrum_of(found, at, *span))


@router.get(CAPTURE + "/xy", response_model=XyPoints)
async def capture_xy(
    kept: CapturesOf,
    capture_id: str,
    x: Name,
    y: Name,
    from_s: Second | None = None,
    to_s: Second | None = None,
    points: Points = 5000,
) -> Response:
    """One signal of it against another, matched by time."""
    found = await kept.get(capture_id)
    span = _span(found, from_s, to_s)
    sides = _signal(found, x), _signal(found, y)
    return await made_apart(_XY, lambda: xy_points(found, *sides, *span, points))


@router.get(CAPTURE + "/parameters", response_model=list[InForceDoc])
async def capture_parameters(bench: BenchOf, kept: CapturesOf, capture_id: str) -> Response:
    """The parameter values that were in force, each beside what is known now."""
    rows = await kept.in_force(capture_id)
    slugs = {one.device for one in rows}
    targets = () if bench.connection is None else bench.connection.targets
    frozen = [Frozen.of(target) for target in targets if target.slug in slugs]

    def beside() -> list[InForceDoc]:
        now = {(one.device, one.address): one for one in in_force(frozen)}
        return [_beside(one, now.get((one.device, one.address))) for one in rows]

    return await list_made_apart(_ROW, beside)


@router.get(CAPTURE + "/csv", response_class=Response)
async def capture_csv(
    request: Request, kept: CapturesOf, capture_id: str, language: Literal["en", "de"] | None = None
) -> Response:
    """Its values as CSV: a row an instant, a column a signal."""
    found = await kept.get(capture_id)
    pieces = csv_pieces(found, load_texts(language or request.app.state.language))
    headers = as_attachment(f"{_file_name(found)}.csv")
    # The pieces of an iterator are made in a worker thread, one by one.
    return StreamingResponse(pieces, media_type="text/csv; charset=utf-8", headers=headers)


@router.get(CAPTURE + "/json", response_class=Response)
async def capture_json(kept: CapturesOf, capture_id: str) -> Response:
    """All of it as JSON."""
    found = await kept.get(capture_id)
    rows = await kept.in_force(capture_id)
    headers = as_attachment(f"{_file_name(found)}.json")
    return StreamingResponse(json_pieces(found, rows), media_type="application/json", headers=headers)


# ------------------------------------------------------------------------------------


def _span(found: Capture, from_s: float | None, to_s: float | None) -> tuple[float, float]:
    head = found.head
    begin_s = (head.start_ns - head.trigger_ns) / 1e9 if from_s is None else from_s
    end_s = (head.end_ns - head.trigger_ns) / 1e9 if to_s is None else to_s
    if end_s <= begin_s:
        raise ScopeSettingsError(field="from_s", reason_key="scope.flaw.span")
    return begin_s, end_s


def _signal(found: Capture, name: str) -> int:
    at = found.head.signal(name)
    if at is None:
        raise ScopeSettingsError(field=name, reason_key="scope.flaw.not_caught")
    return at


def _file_name(found: Capture) -> str:
    kept = "".join(one if one.isalnum() or one in "-_" else "-" for one in found.head.name)
    return f"scope-{found.head.turbine}-{kept}"[:120]


def _beside(was: InForce, now: InForce | None) -> InForceDoc:
    known = now is not None and not now.stale
    return InForceDoc(
        was=was,
        now_raw=None if now is None else now.raw,
        now_shown=None if now is None else now.shown,
        differs=(now.raw != was.raw) if now is not None and known else None,
    )
