"""Many changes at once: one request after one review, its progress row by row in the job."""

from __future__ import annotations

from fastapi import APIRouter

from app.model.address import parse_address
from app.model.checks import Allow
from app.model.roles import Role
from app.service.connection import Connection
from app.service.jobs import Job
from app.service.views import raw_from_json
from app.service.write_many import Change, OnFailure, Order, prepare, write_many
from app.web.deps import ConnectionOf, JobsOf, JournalOf, PersonOf, needs
from app.web.models import JobDoc
from app.web.models.writes import WritesRequest, WritesRow
from app.web.problem import NotFoundError
from app.web.routes.jobs import job_doc

router = APIRouter(dependencies=[needs(Role.TECHNICIAN)])


@router.post("/live/writes")
async def writes(
    connection: ConnectionOf, jobs: JobsOf, journal: JournalOf, person: PersonOf, request: WritesRequest
) -> JobDoc:
    """Check, write, read back and save in the background. What only the maker sets needs an expert."""
    allow = Allow.FACTORY if person.role.covers(Role.EXPERT) else Allow.NOTHING
    changes = [_change(connection, row) for row in request.rows]
    order = Order(changes, frozenset(request.save), OnFailure(request.on_failure), allow)

    async def work(job: Job) -> None:
        await write_many(job, order, journal, connection.stamper)

    return job_doc(jobs.start("write", "", work, prepare(order)))


def _change(connection: Connection, row: WritesRow) -> Change:
    target = next((one for one in connection.targets if one.slug == row.device), None)
    if target is None:
        raise NotFoundError(what=row.device)
    address = parse_address(row.address)
    entry = target.entry(address)
    expected = None if row.expected_raw is None else raw_from_json(entry, row.expected_raw)
    return Change(connection.driver(target), target, address, raw_from_json(entry, row.raw), expected)
