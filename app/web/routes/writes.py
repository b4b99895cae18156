"""Many changes at once: one request after one review, its progress row by row in the job."""

from __future__ import annotations

from fastapi import APIRouter

from app.model.address import parse_address
from app.model.checks import Allow
from app.model.roles import Role, SignedIn
from app.service.address_change import address_changes
from app.service.connection import Connection
from app.service.jobs import Job
from app.service.views import raw_from_json
from app.service.write_many import Change, OnFailure, Order, prepare, write_many
from app.service.write_order import KnownDevices
from app.web.deps import ConnectionOf, JobsOf, JournalOf, PersonOf, needs
from app.web.models import JobDoc
from app.web.models.writes import WritesRequest, WritesRow
from app.web.models.writes_plan import WritesPlan, WritesPlanRequest
from app.web.problem import NotFoundError
from app.web.routes.jobs import job_doc

router = APIRouter(dependencies=[needs(Role.TECHNICIAN)])


@router.post("/live/writes")
async def writes(
    connection: ConnectionOf, jobs: JobsOf, journal: JournalOf, person: PersonOf, request: WritesRequest
) -> JobDoc:
    """Check, put in order, write, read back and save in the background. What only the maker sets needs an expert."""
    changes = [_change(connection, row) for row in request.rows]
    beside = [(connection.driver(target), target) for target in connection.targets]
    order = Order(
        changes,
        frozenset(request.save),
        OnFailure(request.on_failure),
        _allowed(person) | (Allow.ADDRESS if request.address_confirmed else Allow.NOTHING),
        beside,
        request.accepted,
    )

    async def work(job: Job) -> None:
        await write_many(job, order, journal, connection.stamper)

    return job_doc(jobs.start("write", "", work, prepare(order)))


@router.post("/live/writes/plan")
async def plan_writes(connection: ConnectionOf, person: PersonOf, request: WritesPlanRequest) -> WritesPlan:
    """In which order a batch would be written, so that after every write all rules hold that must. Sends nothing."""
    changes = [_change(connection, row) for row in request.rows]
    wanted = {change.place: change.raw for change in changes}
    known = KnownDevices(connection.targets, _allowed(person), request.accepted)
    moved = address_changes((change.target, change.address, change.raw) for change in changes)
    return WritesPlan.of(known.order(wanted), known.unknown(wanted), moved)


def _allowed(person: SignedIn) -> Allow:
    return Allow.FACTORY if person.role.covers(Role.EXPERT) else Allow.NOTHING


def _change(connection: Connection, row: WritesRow) -> Change:
    target = next((one for one in connection.targets if one.slug == row.device), None)
    if target is None:
        raise NotFoundError(what=row.device)
    address = parse_address(row.address)
    entry = target.entry(address)
    expected = None if row.expected_raw is None else raw_from_json(entry, row.expected_raw)
    return Change(connection.driver(target), target, address, raw_from_json(entry, row.raw), expected)
