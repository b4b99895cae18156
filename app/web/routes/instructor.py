"""The instructor: faults and scenarios for the twins that this server has started.

Every route answers 409 ``no_instructor`` where there are none, or where another turbine than these is connected: what
is refused now may be allowed after another connection.
"""

from __future__ import annotations

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Depends

from app.errors import NoInstructorError
from app.model.roles import Role
from app.service.instructor import InjectedLine, InstructorDesk, InstructorLine
from app.web.deps import BenchOf, PersonOf, needs
from app.web.models import Nothing
from app.web.models.instructor import FaultKindDoc, FaultOrderDoc, PlayRequest, ScenarioDoc

router = APIRouter(prefix="/instructor")


def get_desk(bench: BenchOf) -> InstructorDesk:
    """The instructor's desk. Raises NoInstructorError."""
    desk = bench.instructor
    if desk is None:
        raise NoInstructorError
    return desk


DeskOf = Annotated[InstructorDesk, Depends(get_desk)]
TECHNICIAN = needs(Role.TECHNICIAN)


@router.get("")
async def instructor(desk: DeskOf) -> InstructorLine:
    """What acts in the twins now: faults, and the scenario that plays. The socket has it as topic ``instructor``."""
    return await desk.refresh()


@router.get("/catalogue")
async def fault_catalogue(desk: DeskOf) -> list[FaultKindDoc]:
    """All kinds of fault, with what an order of each may say."""
    return [FaultKindDoc.of(kind) for kind in await desk.catalogue()]


@router.post("/faults", status_code=HTTPStatus.CREATED, dependencies=[TECHNICIAN])
async def inject_fault(desk: DeskOf, person: PersonOf, order: FaultOrderDoc) -> InjectedLine:
    """Put a fault into the twins. A refusal names the field, and the limits where its value is beyond them."""
    return await desk.inject(order.order(), person.person)


@router.delete("/faults/{fault}", dependencies=[TECHNICIAN])
async def clear_fault(desk: DeskOf, person: PersonOf, fault: int) -> InstructorLine:
    """Take a fault out. One that has ended already is no error: two pages may clear it."""
    await desk.clear(fault, person.person)
    return desk.line


@router.delete("/faults", dependencies=[TECHNICIAN])
async def clear_faults(desk: DeskOf, person: PersonOf) -> InstructorLine:
    """Take all faults out."""
    await desk.clear_all(person.person)
    return desk.line


@router.get("/scenarios")
async def scenarios(desk: DeskOf) -> list[ScenarioDoc]:
    """All scenarios that can be played."""
    return [ScenarioDoc.of(one) for one in await desk.scenarios()]


@router.post("/play", dependencies=[TECHNICIAN])
async def play_scenario(desk: DeskOf, person: PersonOf, request: PlayRequest) -> InstructorLine:
    """Begin a scenario; the one that plays is stopped."""
    return await desk.play(request.scenario, person.person)


@router.post("/stop", dependencies=[TECHNICIAN])
async def stop_scenario(desk: DeskOf, person: PersonOf, _request: Nothing) -> InstructorLine:
    """Stop the scenario that plays; its faults are cleared."""
    return await desk.stop(person.person)
