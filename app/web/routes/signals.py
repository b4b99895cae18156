"""Test signals, which run as long as they are held, their runs, and the touch probe."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends

from app.errors import NotConnectedError
from app.model.roles import Role
from app.service.motion.probe import ProbeLine, Probes
from app.web.deps import BenchOf, JournalOf, PersonOf, TargetOf, needs
from app.web.models.signals import SignalRequest, SignalRunDoc, SignalRunLine
from app.web.routes.motion import MOTION, DeskOf

router = APIRouter()
TECHNICIAN = needs(Role.TECHNICIAN)


def get_probes(bench: BenchOf) -> Probes:
    """The probes of the connection. Raises NotConnectedError."""
    if bench.probes is None:
        raise NotConnectedError
    return bench.probes


ProbesOf = Annotated[Probes, Depends(get_probes)]


@router.post(MOTION + "/signal", dependencies=[TECHNICIAN])
async def signal(
    bench: BenchOf, desk: DeskOf, target: TargetOf, journal: JournalOf, person: PersonOf, request: SignalRequest
) -> SignalRunDoc:
    """Run a test signal (mode 8) as long as it is held, and keep what came of it, whatever ended it."""
    desk.admit(request.fence, request.order)
    runs = bench.office.signal_runs
    return SignalRunDoc.of(await runs.run(desk, target.slug, request.fence, request.wanted(), person.person, journal))


@router.get(MOTION + "/signals")
async def signals(bench: BenchOf, target: TargetOf) -> list[SignalRunLine]:
    """The latest runs of a device, newest first."""
    return [SignalRunLine.of(run) for run in await bench.office.signal_runs.of(target.slug)]


@router.get("/signals/{run_id}")
async def signal_run(bench: BenchOf, run_id: str) -> SignalRunDoc:
    """One run with its courses; 404 ``signal_unknown``."""
    return SignalRunDoc.of(await bench.office.signal_runs.get(run_id))


@router.get(MOTION + "/probe")
async def probe(probes: ProbesOf, target: TargetOf) -> ProbeLine:
    """How the touch probe stands. It is read twenty times a second for 2 s from each such request on."""
    return await probes.look(target.slug)


@router.post(MOTION + "/probe/arm", dependencies=[TECHNICIAN])
async def arm_probe(probes: ProbesOf, target: TargetOf) -> ProbeLine:
    """Take captures from now on for new; nothing is written to the drive."""
    return await probes.arm(target.slug)
