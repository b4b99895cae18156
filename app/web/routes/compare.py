"""Comparisons: any columns side by side. Reads only, for any session."""

from __future__ import annotations

from fastapi import APIRouter

from app.service.compare.comparison import compare_columns
from app.service.compare.ground import ground_of
from app.service.compare.sources import Columns
from app.web.deps import BenchOf
from app.web.models.compare import CompareRequest, ComparisonDoc

router = APIRouter()


@router.post("/compare")
async def compare(bench: BenchOf, request: CompareRequest) -> ComparisonDoc:
    """Compare two or more columns. A column that cannot be shown is named by the problem."""
    columns = Columns(ground_of(bench))
    pending = columns.read_pending(request.pending)
    return ComparisonDoc.of(await compare_columns(columns, request.columns, pending, request.all))
