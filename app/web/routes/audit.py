"""The audit log: its rows, the end of its chain, and a walk over all of it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from app.store.audit_rows import Filter
from app.web.deps import BenchOf
from app.web.models import Nothing
from app.web.models.audit import AuditHead, AuditLine, AuditPage, AuditVerified

router = APIRouter(prefix="/audit")

Text = Annotated[str | None, Query(max_length=200)]
Seq = Annotated[int | None, Query(ge=1, le=2**53 - 1)]


@router.get("")
async def audit_rows(
    bench: BenchOf,
    before: Seq = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
    device: Text = None,
    kind: Annotated[list[str] | None, Query(max_length=50)] = None,
    person: Text = None,
    q: Text = None,
) -> AuditPage:
    """Rows, newest first. ``device`` may be a turbine or station too; ``kind`` may be named several times."""
    wanted = Filter(device=device, kinds=None if not kind else tuple(kind), person=person, text=q)
    rows = await bench.office.audit.latest(wanted, before, limit + 1)
    lines = [AuditLine.of(row) for row in rows[:limit]]
    return AuditPage(rows=lines, before=lines[-1].seq if len(rows) > limit else None)


@router.get("/head")
async def audit_head(bench: BenchOf) -> AuditHead:
    """The end of the chain: who notes it can prove later that nothing before it was rewritten."""
    log = bench.office.audit
    head, verified_t_ns = await log.head()
    return AuditHead(
        seq=head.seq, hash=head.hash, verified_t_ns=verified_t_ns, waiting=log.waiting, failing=log.failing
    )


@router.post("/verify")
async def verify_audit(bench: BenchOf, _request: Nothing) -> AuditVerified:
    """Walk the whole chain and name the first row that is wrong."""
    return AuditVerified.of(await bench.office.audit.verify())
