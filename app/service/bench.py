"""The bench: what one server serves. Turbines that it knows, and the connection to one of them while there is one."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import replace
from typing import Final

from app.errors import HubsideError, NotConnectedError, StoreError
from app.service.as_found import REASON, is_whole, look, unreachable, until_back
from app.service.backup import ReadReport, whole_sets
from app.service.battery.archive import Archive as BatteryArchive
from app.service.battery.desk import BatteryDesk
from app.service.bitrates import with_bitrates
from app.service.connection import Connection
from app.service.indexing import Indexing
from app.service.instructor import Instructor, InstructorDesk
from app.service.journal import Journal, Kind
from app.service.link import TwinWatch
from app.service.motion.desk import MotionDesk
from app.service.motion.left import Left
from app.service.motion.probe import Probes
from app.service.office.office import Office
from app.service.options import Options
from app.service.pdo.desk import PdoDesk
from app.service.poll import Poller
from app.service.polling import Polling
from app.service.recording_list import Recordings, samples_folder
from app.service.replay.moments import Moments
from app.service.restore.desk import Desk
from app.service.scope.desk import ScopeDesk
from app.service.site_edit import SiteEditor
from app.service.sites import Sites
from app.store.store import Store
from app.store.visit_rows import Visit
from app.wire.frame import Stamper

log = logging.getLogger(__name__)

CONNECT_TIMEOUT_S: Final = 10.0

Told = Callable[[HubsideError], None]


def _log(error: HubsideError) -> None:
    log.warning("%s: %s", error.code, error)


class Bench:
    """Connections follow one another; time, journal and the people at work go on. Lives in the event loop.

    ``told`` hears of devices that could not be read after a connection was made. ``epoch`` is raised with every
    connection that is made or ended, so that whoever shows the live state knows that it is another one. What people do
    is kept in ``store``, which the bench closes at its end; without one it is forgotten then. ``instructor`` reaches
    the twins that were started with this server, where they were.
    """

    def __init__(
        self,
        sites: Sites,
        options: Options,
        told: Told = _log,
        wall_ns: Callable[[], int] = time.time_ns,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
        store: Store | None = None,
        stamper: Stamper | None = None,
        journal: Journal | None = None,
        instructor: Instructor | None = None,
    ) -> None:
        self.sites = sites
        self.options = options
        self.stamper = stamper or Stamper(wall_ns(), monotonic_ns)
        self.journal = journal or Journal(self.stamper, options.person)
        self.office = Office(store or Store.in_memory(), self.journal, self.stamper, options.person)
        self.restores = Desk(self.office, self.journal, self.stamper, data=options.data)
        self.site_editor = SiteEditor(sites)
        self.polling = Polling(self.office.store)
        self.scope = ScopeDesk(
            self.office.captures, self.journal, self.stamper, lambda: self.polling.plan, self._all_twins
        )
        self.connection: Connection | None = None
        self.motion: MotionDesk | None = None
        self.battery_archive = BatteryArchive(self.office.store, self.stamper)
        self.batteries: BatteryDesk | None = None
        self.probes: Probes | None = None
        self._left = Left(self.office.store)
        self.pdos = PdoDesk(self.office.store, self.stamper)
        self.twins: TwinWatch | None = None
        self.epoch = 0
        self.indexing = Indexing(None if options.data is None else options.data / "indexes")
        self.recordings: Recordings | None = None
        self.moments: Moments | None = None
        if options.data is not None:
            folder = options.data / "recordings"
            self.recordings = Recordings(folder, samples_folder(), options.more_recordings)
            self.moments = Moments(self.recordings, lambda: sites.turbines, options.data / "indexes")
        self._told = told
        self._clocks = wall_ns, monotonic_ns
        self._changing = asyncio.Lock()
        self._look: asyncio.Task[None] | None = None
        self.desk: InstructorDesk | None = None
        if instructor is not None:
            self.desk = InstructorDesk(instructor, self.journal, self.stamper, self._slug_of)

    @property
    def instructor(self) -> InstructorDesk | None:
        """Faults for the twins; None where they are not ours, or where another turbine is connected."""
        if self.desk is None or self.connection is None:
            return self.desk
        buses = self.connection.turbine.buses
        return self.desk if self.desk.serves(bus.connection for bus in buses) else None

    def require(self) -> Connection:
        """The connection. Raises NotConnectedError."""
        if self.connection is None:
            raise NotConnectedError
        return self.connection

    async def connect(self, slug: str, person: str, timeout_s: float = CONNECT_TIMEOUT_S) -> Connection:
        """End the connection that there is, and connect to the turbine ``slug``.

        Raises UsageError, DescriptionError, BusOpenError; then nothing is connected. RestoreOpenError: a restore runs.
        """
        turbine = self.sites.turbine(slug)
        descriptions = self.sites.describe(turbine)
        async with self._changing:
            self._require_idle()
            await self._end(person)
            found = await with_bitrates(turbine, self.options.listen_s)
            journal = self.journal.by(person)
            options = replace(self.options, person=person, part_closed=self.indexing.later)
            connection = Connection(found, descriptions, options, *self._clocks, self.stamper, journal)
            await connection.open(timeout_s)
            await self._keep(self.office.visits.begin(slug, person))
            self.show(connection)
            self._look = asyncio.create_task(self._first_look(connection, person))
            return connection

    def show(self, connection: Connection) -> None:
        """Have ``connection``, which is open, as the one that is served."""
        connection.gate.blocks = self.restores.blocks
        self.connection = connection
        self.scope.attach(connection)
        self.motion = MotionDesk(connection, self.journal, self._left)
        self.batteries = BatteryDesk(connection, self.motion, self.battery_archive)
        self.probes = Probes(connection)
        self.twins = TwinWatch(connection.targets, connection.buses, self.instructor is not None)
        self.epoch += 1

    async def consent(self, person: str) -> None:
        """Go active although another master is on the bus, and read what could not be read until now.

        Raises NotConnectedError.
        """
        async with self._changing:
            connection = self.require()
            held_back = [name for name, link in connection.buses.items() if link.needs_consent]
            if not held_back:
                return
            for name in held_back:
                self.journal.by(person).note(Kind.CONSENT, None, bus=name)
                connection.buses[name].driver.grant_consent()
            await self._end_look()
            self._look = asyncio.create_task(self._first_look(connection, person))

    async def end_visit(self, reason: str, work_order: str, person: str) -> Visit:
        """End the visit with the values as left, and the connection with it. Raises NoVisitError, StoreError."""
        async with self._changing:
            self._require_idle()
            visits = self.office.visits
            visits.require()
            if self.connection is not None:
                await visits.keep_left(self.connection.targets, person, work_order)
            visit = await visits.end(reason, work_order, person)
            await self._end(person)
            return visit

    async def disconnect(self, person: str) -> None:
        """End the connection; the recording is finished. Nothing happens where there is none.

        Raises RestoreOpenError while a restore runs, PdoBusyError while PDOs are changed.
        """
        async with self._changing:
            self._require_idle()
            await self._end(person)

    async def close(self) -> None:
        """End the connection at the end of the server, then the office. A restore that runs stays open, incomplete."""
        await self.restores.close()
        await self.scope.close()
        async with self._changing:
            await self._end(self.options.person)
        if self.desk is not None:
            await self.desk.close()
        await asyncio.to_thread(self.indexing.close)
        await self.office.close()

    def _require_idle(self) -> None:
        """Raises RestoreOpenError, PdoBusyError: nothing that must come to its end is under way."""
        self.restores.require_idle()
        if self.motion is not None:
            self.motion.require_left()

    async def _end(self, person: str) -> None:
        connection = self.connection
        if connection is None:
            return
        await self.scope.detach()
        await self._end_look()
        await self._keep(self.office.visits.keep_left(connection.targets, person))
        if self.batteries is not None:
            await self.batteries.close()
        if self.motion is not None:
            await self.motion.close()
        if self.probes is not None:
            await self.probes.close()
        self.connection, self.twins, self.motion = None, None, None
        self.batteries, self.probes = None, None
        self.epoch += 1
        self.journal.by(person).note(Kind.DISCONNECTED, None, turbine=connection.turbine.name)
        await connection.close()

    def _all_twins(self) -> bool:
        return self.twins is not None and self.twins.all_twins()

    def _slug_of(self, node: int) -> str | None:
        targets = () if self.connection is None else self.connection.targets
        return next((target.slug for target in targets if target.node == node), None)

    async def _keep(self, keeping: Awaitable[object]) -> None:
        """Keep something about the visit; a store that fails is told, and holds up no work at the turbine."""
        try:
            await keeping
        except StoreError as error:
            self._told(error)

    async def _end_look(self) -> None:
        if self._look is not None:
            self._look.cancel()
            await asyncio.gather(self._look, return_exceptions=True)
            self._look = None

    async def keep_found(self, reports: Iterable[ReadReport], person: str, looked: bool | None = None) -> None:
        """Keep what was read whole as found, of devices of which nothing was kept before in this visit.

        ``looked``: what is known now of the first look; None where the reports are not of it.
        """
        connection, visits = self.connection, self.office.visits
        if connection is None or visits.current is None:
            return
        read = [report for report in reports if is_whole(report)]
        slug, order, now_ns = connection.turbine.slug, visits.current.work_order, self._clocks[0]()
        whole = whole_sets(read, slug, person, REASON, now_ns, order)
        found = [self.office.library.identified(one) for one in whole]
        await self._keep(visits.keep_found(found, visits.looked if looked is None else looked))

    async def _first_look(self, connection: Connection, person: str) -> None:
        """Read everything once, then keep polling what the screens need. What did not answer is read once it does."""
        reports, missing = await look(connection, person, connection.targets)
        for error in unreachable(reports):
            self._told(error)
        await self.keep_found(reports, person, not any(one.lost for one in missing))
        poller = Poller(connection, lambda: self.polling.plan)
        try:
            while missing:
                back = await until_back(connection, missing)
                reports, again = await look(connection, person, [one.target for one in back])
                missing = [*(one for one in missing if one not in back), *again]
                await self.keep_found(reports, person, not any(one.lost for one in missing))
            await asyncio.Event().wait()
        finally:
            await poller.close()
