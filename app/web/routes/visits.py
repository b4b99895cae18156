"""Visits, what changed since the last one, who changed a parameter last, and favourites."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from app.model.address import parse_address
from app.model.roles import Role
from app.service.office.last_change import history, last_changes
from app.service.office.leaving import before_leaving
from app.service.office.visit_changes import changes_since_last_visit
from app.store import small_rows
from app.web.deps import DEVICE, BenchOf, ConnectionOf, PersonOf, TargetOf, needs
from app.web.models.visits import (
    ChangesSinceLastVisit,
    Favourites,
    LeftNow,
    ParameterChange,
    ParameterChanges,
    PresentVisit,
    VisitChange,
    VisitDoc,
    VisitEnd,
)

router = APIRouter()

HISTORY: int = 200


@router.get("/live/visit")
async def present_visit(bench: BenchOf) -> PresentVisit:
    """The visit that is open."""
    visit = bench.office.visits.current
    return PresentVisit(visit=None if visit is None else VisitDoc.of(visit))


@router.patch("/live/visit", dependencies=[needs(Role.TECHNICIAN)])
async def change_visit(bench: BenchOf, person: PersonOf, given: VisitChange) -> VisitDoc:
    """Change reason or work order of the open visit."""
    return VisitDoc.of(await bench.office.visits.change(given.reason, given.work_order, person.person))


@router.post("/live/visit/end", dependencies=[needs(Role.TECHNICIAN)])
async def end_visit(bench: BenchOf, person: PersonOf, given: VisitEnd) -> VisitDoc:
    """Keep the values as left, end the visit, and disconnect."""
    return VisitDoc.of(await bench.end_visit(given.reason, given.work_order, person.person))


@router.get("/live/visit/left")
async def left_now(bench: BenchOf, connection: ConnectionOf) -> list[LeftNow]:
    """What would be kept of each device as left, were the visit ended now. Nothing is read for it."""
    office, person = bench.office, bench.options.person
    found = await before_leaving(
        office.visits, office.library, office.audit, connection.targets, person, bench.stamper()
    )
    return [LeftNow.of(one) for one in found]


@router.get("/visits")
async def visits(
    bench: BenchOf,
    turbine: Annotated[str | None, Query(max_length=200)] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
) -> list[VisitDoc]:
    """Visits, newest first; of one turbine where named."""
    return [VisitDoc.of(visit) for visit in await bench.office.visits.latest(turbine, limit)]


@router.get("/live/changes-since-last-visit")
async def since_last_visit(bench: BenchOf, connection: ConnectionOf) -> ChangesSinceLastVisit:
    """Parameters that are not as the last visit left them; what is unknown on one side is named."""
    office = bench.office
    return ChangesSinceLastVisit.of(await changes_since_last_visit(office.visits, office.audit, connection.targets))


@router.get(f"{DEVICE}/changes")
async def parameter_changes(
    bench: BenchOf, target: TargetOf, address: Annotated[str | None, Query(max_length=20)] = None
) -> ParameterChanges:
    """The last write of each parameter; with ``address`` that parameter's writes too, newest first."""
    audit = bench.office.audit
    one = None if address is None else target.entry(parse_address(address)).address.short
    writes = [] if one is None else await history(audit, target.slug, one, HISTORY)
    last = await last_changes(audit, target.slug) if one is None else []
    return ParameterChanges(
        last={change.address: ParameterChange.of(change) for change in last or writes[:1]},
        history=[ParameterChange.of(change) for change in writes],
    )


@router.get("/favourites/{description_id}")
async def favourites(bench: BenchOf, person: PersonOf, description_id: str) -> Favourites:
    """The addresses that this person has marked."""
    who = person.person
    found = await bench.office.store.run(lambda kept: small_rows.get_favourites(kept, who, description_id))
    return Favourites(addresses=found)


@router.put("/favourites/{description_id}")
async def put_favourites(bench: BenchOf, person: PersonOf, description_id: str, given: Favourites) -> Favourites:
    """Replace the list; an address that is none is refused."""
    who, addresses = person.person, [parse_address(text).short for text in given.addresses]
    await bench.office.store.run(lambda kept: small_rows.put_favourites(kept, who, description_id, addresses))
    return Favourites(addresses=list(dict.fromkeys(addresses)))
