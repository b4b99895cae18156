"""Restores: plan, begin, confirm, roll back, resume, and how they stand."""

from __future__ import annotations

import asyncio
from typing import Annotated, Final, Literal

from fastapi import APIRouter, Query, Response

from app.errors import RoleError, UsageError
from app.model.address import parse_address
from app.model.roles import Role, SignedIn
from app.model.station import Place
from app.service.bench import Bench
from app.service.connection import Connection
from app.service.records.files import html_file, pdf_file
from app.service.restore.assign import assign
from app.service.restore.motor_given import given_motor, is_motor
from app.service.restore.order import Given, Order
from app.service.restore.survey import targets_of
from app.web.attachment import as_attachment
from app.web.deps import BenchOf, ConnectionOf, PersonOf, needs
from app.web.models import Nothing
from app.web.models.restore import (
    GiveUpRequest,
    RestoreDoc,
    RestoreHead,
    RestorePlanDoc,
    RestorePlanRequest,
    RestoreRequest,
)
from app.web.models.restore_docs import descriptions_of, head_doc, plan_doc, restore_doc
from app.web.problem import NotFoundError

router = APIRouter()

_MEDIA: Final = {"html": "text/html; charset=utf-8", "pdf": "application/pdf", "json": "application/json"}


@router.post("/live/restore/plan", dependencies=[needs(Role.TECHNICIAN)])
async def plan_restore(
    bench: BenchOf, connection: ConnectionOf, person: PersonOf, request: RestorePlanRequest
) -> RestorePlanDoc:
    """Read the station, and say what a restore would do and what speaks against it. Nothing is written."""
    order = await _order(bench, connection, person, request)
    return plan_doc(await bench.restores.prepare(connection, order))


@router.post("/live/restore", dependencies=[needs(Role.TECHNICIAN)])
async def begin_restore(
    bench: BenchOf, connection: ConnectionOf, person: PersonOf, request: RestoreRequest
) -> RestoreDoc:
    """Read the station once more, and begin, where the plan is still the one that was looked at."""
    order = await _order(bench, connection, person, request)
    prepared = await bench.restores.prepare(connection, order)
    return await _doc(bench, await bench.restores.begin(connection, prepared, request.plan_hash))


@router.get("/live/restores")
async def restores(
    bench: BenchOf,
    turbine: Annotated[str | None, Query(max_length=200)] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
    only_open: Annotated[bool, Query(alias="open", description="Those that have not ended, however old")] = False,
) -> list[RestoreHead]:
    """Restores, newest first; of one turbine where named."""
    if not only_open:
        return [head_doc(row) for row in await bench.restores.latest(turbine, limit)]
    rows = [(await bench.restores.get(row.id)).row for row in reversed(bench.restores.open)]
    return [head_doc(row) for row in rows if turbine in (None, row.turbine) and not row.state.ended]


@router.get("/live/restores/{restore_id}")
async def restore(bench: BenchOf, restore_id: str) -> RestoreDoc:
    """How a restore stands."""
    return await _doc(bench, restore_id)


@router.post("/live/restores/{restore_id}/confirm", dependencies=[needs(Role.TECHNICIAN)])
async def confirm_restore(bench: BenchOf, person: PersonOf, restore_id: str, _request: Nothing) -> RestoreDoc:
    """Agree to what stands in RAM: it is saved then."""
    await bench.restores.confirm(restore_id, person.person)
    return await _doc(bench, restore_id)


@router.post("/live/restores/{restore_id}/roll-back", dependencies=[needs(Role.TECHNICIAN)])
async def roll_back_restore(bench: BenchOf, person: PersonOf, restore_id: str, _request: Nothing) -> RestoreDoc:
    """Back to the old values."""
    await bench.restores.roll_back(bench.connection, restore_id, person.person)
    return await _doc(bench, restore_id)


@router.post("/live/restores/{restore_id}/resume", dependencies=[needs(Role.TECHNICIAN)])
async def resume_restore(bench: BenchOf, person: PersonOf, restore_id: str, _request: Nothing) -> RestoreDoc:
    """On to the new values, from whatever is there; one that an expert began needs an expert."""
    if (await bench.restores.get(restore_id)).details["expert"]:
        require(person, Role.EXPERT)
    await bench.restores.resume(bench.connection, restore_id, person.person)
    return await _doc(bench, restore_id)


@router.post("/live/restores/{restore_id}/unproven", dependencies=[needs(Role.TECHNICIAN)])
async def go_on_unproven(bench: BenchOf, person: PersonOf, restore_id: str, _request: Nothing) -> RestoreDoc:
    """Do without the proof of a restart: nobody switches the device off and on now."""
    await bench.restores.go_on_unproven(restore_id, person.person)
    return await _doc(bench, restore_id)


@router.post("/live/restores/{restore_id}/give-up", dependencies=[needs(Role.EXPERT)])
async def give_up_restore(bench: BenchOf, person: PersonOf, restore_id: str, request: GiveUpRequest) -> RestoreDoc:
    """Close one that can be neither resumed nor rolled back; its station takes writes again, as it is."""
    await bench.restores.give_up(restore_id, person.person, request.reason)
    return await _doc(bench, restore_id)


@router.get("/records/{record_file}", response_class=Response)
async def record_file(
    bench: BenchOf, record_file: str, locale: Annotated[Literal["en", "de"], Query()] = "en"
) -> Response:
    """The signed record of a restore: ``<id>.html``, ``<id>.pdf`` or ``<id>.json``."""
    restore_id, _, form = record_file.rpartition(".")
    sealed = await bench.restores.record(restore_id) if form in _MEDIA else None
    key = None if sealed is None else await asyncio.to_thread(bench.restores.key)
    if sealed is None or key is None:
        raise NotFoundError(what=record_file)
    if form == "json":
        content = sealed.json.encode()
    else:
        make = html_file if form == "html" else pdf_file
        content = await asyncio.to_thread(make, sealed, locale, key)
    return Response(content, media_type=_MEDIA[form], headers=as_attachment(f"restore-{restore_id}.{form}"))


async def _order(bench: Bench, connection: Connection, person: SignedIn, request: RestorePlanRequest) -> Order:
    """What the page asks for.

    Raises RoleError, UsageError, SetUnknownError, MotorUnknownError, MotorInventedError.
    """
    _check_expert(person, request)
    library, motors = bench.office.library, bench.office.motors
    records = [await library.record(key) for key in request.sets if not is_motor(key)]
    sets = [Given(await library.set_of(record), record.id) for record in records]
    sets += [await given_motor(motors, connection, key, person.person) for key in request.sets if is_motor(key)]
    given, homeless = assign(targets_of(connection, request.station), sets)
    chosen = request.selected
    full = request if isinstance(request, RestoreRequest) else None
    return Order(
        station=request.station,
        given=given,
        person=person.person,
        selected=None if chosen is None else frozenset(Place(one.device, parse_address(one.address)) for one in chosen),
        restart=request.restart,
        expert=request.expert,
        reason="" if full is None else full.reason,
        work_order="" if full is None else full.work_order,
        confirm_s=None if full is None else full.confirm_s,
        others_confirmed=request.other_blades_confirmed,
        accepted=frozenset(request.accepted),
        homeless=homeless,
        network=request.network,
    )


def require(person: SignedIn, role: Role) -> None:
    """Raises RoleError."""
    if not person.role.covers(role):
        raise RoleError(needs=role.value, has=person.role.value)


def _check_expert(person: SignedIn, request: RestorePlanRequest) -> None:
    """What only an expert may do he does knowingly. Raises RoleError, UsageError."""
    if request.expert:
        require(person, Role.EXPERT)
    if (request.other_blades_confirmed or request.accepted) and not request.expert:
        raise UsageError(reason="other_blades_confirmed and accepted are for experts: set expert")


async def _doc(bench: Bench, restore_id: str) -> RestoreDoc:
    kept = await bench.restores.get(restore_id)
    connection = bench.connection
    targets = () if connection is None else connection.targets
    connected = {target.slug: target.description for target in targets}
    return restore_doc(kept, bench.restores, descriptions_of(kept, connected))
