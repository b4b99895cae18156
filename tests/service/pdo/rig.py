"""A person at the desk where PDOs are changed, on twins over a wire."""

from __future__ import annotations

import asyncio
from dataclasses import replace

from app.model.pdo.setup import PdoId, PdoSetup
from app.service.connection import Connection
from app.service.devices import Target
from app.service.jobs import Job, Jobs, JobState
from app.service.motion.desk import MotionDesk
from app.service.pdo.change import read_setups
from app.service.pdo.desk import Edit, PdoDesk, Worker
from app.store.store import Store
from app.wire.nmt import NmtCommand, NmtState
from tests.model.pdo.rig import TPDO2, enabled
from tests.service.motion.rig import SteadyClock

AXIS = "wtg-07/blade-1/pmc"
PAGE = "page of the test"
DEADLINE_S = 60.0


class Person:
    """Works on the PDOs of one device; ``store`` is that of the bench."""

    def __init__(self, connection: Connection, store: Store, motion: MotionDesk | None = None) -> None:
        self.connection = connection
        self.motion = motion or MotionDesk(connection, connection.journal, now_s=SteadyClock())
        self.desk = PdoDesk(store, connection.stamper)
        self.jobs = Jobs()
        journal = connection.journal.by("A. Technician")
        self.worker = Worker("A. Technician", PAGE, connection, self.motion, journal, self.jobs)

    @property
    def target(self) -> Target:
        return self.connection.target(AXIS)

    async def setups(self) -> dict[PdoId, PdoSetup]:
        return await read_setups(self.connection.driver(self.target), self.target)

    async def edits(self, *wanted: PdoSetup) -> list[Edit]:
        """From how they are set up now."""
        now = await self.setups()
        return [Edit(now[setup.id], setup) for setup in wanted]

    async def begin(self, *wanted: PdoSetup) -> Job:
        return await self.desk.apply(self.worker, self.target, await self.edits(*wanted))

    async def apply(self, *wanted: PdoSetup) -> Job:
        return await ended(await self.begin(*wanted))

    async def undo(self) -> Job:
        return await ended(await self.desk.undo(self.worker, self.target))

    async def sending(self) -> PdoSetup:
        """TPDO2 with position and statusword, every 50 ms; and the node operational."""
        wanted = enabled((await self.setups())[TPDO2], "6064/32", "6041/16", event_ms=50)
        await self.start_node()
        return wanted

    async def start_node(self) -> None:
        target = self.target
        self.connection.driver(target).nmt(NmtCommand.START, target.node)
        async with asyncio.timeout(DEADLINE_S):
            while self.nmt() is not NmtState.OPERATIONAL:  # noqa: ASYNC110  the live state has no event for it
                await asyncio.sleep(0.01)

    def nmt(self) -> NmtState | None:
        view = self.connection.live.node(self.target.device.bus, self.target.node)
        return None if view is None else view.state


def with_cob_id(setup: PdoSetup, cob_id: int) -> PdoSetup:
    return replace(setup, parameters=setup.parameters._replace(cob_id=cob_id))


async def ended(job: Job) -> Job:
    async with asyncio.timeout(DEADLINE_S):
        while job.state is JobState.RUNNING:  # noqa: ASYNC110  a job has no event
            await asyncio.sleep(0.005)
    return job
