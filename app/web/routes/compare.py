"""Comparisons: any columns side by side, the blades of a turbine, a fleet. Reads only, for any session."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response

from app.errors import NotConnectedError
from app.service.compare.comparison import compare_columns
from app.service.compare.export import to_csv, to_html
from app.service.compare.fleet import compare_fleet
from app.service.compare.ground import ground_of
from app.service.compare.parity import compare_blades
from app.service.compare.sources import Columns
from app.service.compare.spec import ColumnKind, ColumnSpec
from app.web.attachment import as_attachment
from app.web.deps import BenchOf
from app.web.models.compare import CompareRequest, ComparisonDoc
from app.web.models.fleet import FleetDoc, FleetRequest, ParityDoc, ParityPart
from app.web.problem import texts_for

router = APIRouter()


@router.post("/compare")
async def compare(bench: BenchOf, request: CompareRequest) -> ComparisonDoc:
    """Compare two or more columns. A column that cannot be shown is named by the problem."""
    columns = Columns(ground_of(bench))
    pending = columns.read_pending(request.pending)
    return ComparisonDoc.of(await compare_columns(columns, request.columns, pending, request.all))


@router.post("/compare/export", response_class=Response)
async def export_comparison(
    bench: BenchOf,
    asked: Request,
    request: CompareRequest,
    file_format: Annotated[Literal["html", "csv"], Query(alias="format")] = "html",
    same: Annotated[bool, Query(description="With the rows that match")] = False,
) -> Response:
    """The comparison as a file of its own, in the language that was asked for."""
    columns = Columns(ground_of(bench))
    pending = columns.read_pending(request.pending)
    compared = await compare_columns(columns, request.columns, pending, request.all)
    texts = texts_for(asked.headers.get("accept-language"), asked.app.state.language)
    if file_format == "csv":
        # With a byte order mark: without one, spreadsheets take UTF-8 for an old code page.
        content, kind = to_csv(compared, texts, same).encode("utf-8-sig"), "text/csv; charset=utf-8"
    else:
        content, kind = to_html(compared, texts, same).encode(), "text/html; charset=utf-8"
    return Response(content, media_type=kind, headers=as_attachment(f"comparison.{file_format}"))


@router.get("/parity")
async def parity(
    bench: BenchOf,
    turbine: Annotated[str | None, Query(max_length=200, description="Slug; the connected one where not given")] = None,
    kind: Literal["live", "stored", "found", "left", "delivered", "latest"] = "live",
    everything: Annotated[bool, Query(alias="all")] = False,
) -> ParityDoc:
    """The blades of a turbine side by side, each kind of device by itself."""
    connection = bench.connection
    if turbine is None and connection is None:
        raise NotConnectedError
    named = None if connection is None else connection.turbine
    which = named if named is not None and turbine in (None, named.slug) else bench.sites.turbine(turbine or "")
    parts = await compare_blades(Columns(ground_of(bench)), which, ColumnKind(kind), everything)
    return ParityDoc(turbine=which.slug, parts=[ParityPart.of(part) for part in parts])


@router.post("/fleet")
async def fleet(bench: BenchOf, request: FleetRequest) -> FleetDoc:
    """One golden set against the latest set of every device of its kind."""
    columns = Columns(ground_of(bench))
    golden = ColumnSpec(ColumnKind.GOLDEN, request.description_id)
    if request.golden is not None:
        golden = ColumnSpec(ColumnKind.SET, request.golden)
    found = await compare_fleet(columns, bench.office.store, str(golden))
    return FleetDoc.of(found, request.group, request.limit)
