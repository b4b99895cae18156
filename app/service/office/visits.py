"""Visits: from connecting to a turbine to "end visit", with the values as found and as left."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Final

from app import __version__
from app.errors import NoVisitError
from app.model.address import Address
from app.model.datatypes import Raw
from app.model.set_record import Tag
from app.model.sets import Origin, ParameterSet, dump_set, identity_of, iso_time, load_set
from app.service.backup import SECOND_NS, readable
from app.service.devices import Target, decode
from app.service.library.library import Library
from app.service.office.audit import Action, AuditLog
from app.store import visit_rows
from app.store.store import Connection, Store
from app.store.uuid7 import Uuid7
from app.store.visit_rows import Phase, Visit

GOES_ON_NS: Final = 12 * 3600 * 1_000_000_000
"""Connecting again within so long after its beginning goes on with a visit: a shift."""
NOT_READ: Final = "not read"
TAGS: Final = {Phase.FOUND: Tag.AS_FOUND, Phase.LEFT: Tag.AS_LEFT}
STALE: Final = "stale"
"""Frames were lost, or the same quantity was written elsewhere: what was read last proves nothing."""


class Visits:
    """The visits of one store. ``stamp`` gives t_ns. Lives in the event loop."""

    def __init__(self, store: Store, audit: AuditLog, stamp: Callable[[], int], library: Library | None = None) -> None:
        self._library = library or Library(store, audit, stamp)
        self._store = store
        self._audit = audit
        self._stamp = stamp
        self._new_id = Uuid7(stamp)
        self.current: Visit | None = None
        self.looked = False
        """True once the devices of the present connection were read, as far as they answered."""

    def require(self) -> Visit:
        """The visit that is open. Raises NoVisitError."""
        if self.current is None:
            raise NoVisitError
        return self.current

    async def begin(self, turbine: str, person: str) -> Visit:
        """Connected: go on with the open visit of ``turbine``, or begin one. Old ones are closed as left open.

        Raises StoreError; then no visit is open.
        """
        self.current, self.looked = None, False
        now_ns = self._stamp()
        opened = await self._store.run(visit_rows.open_visits)
        young = [visit for visit in opened if now_ns - visit.started_ns < GOES_ON_NS]
        for visit in opened:
            if visit not in young:
                await self._put(replace(visit, ended_ns=now_ns, left_open=True))
        going_on = next((visit for visit in young if visit.turbine == turbine), None)
        visit = going_on or Visit(self._new_id(), turbine, person, now_ns)
        if going_on is None:
            await self._put(visit)
        self._audit.note(Action.VISIT_CONTINUED if going_on else Action.VISIT_STARTED, person, None, turbine=turbine)
        self.current = visit
        return visit

    async def keep_found(self, sets: Iterable[ParameterSet]) -> None:
        """Keep the values as found; those of an earlier connection in the same visit stay. Raises StoreError."""
        visit = self.current
        if visit is not None:
            await self._keep(visit, Phase.FOUND, sets, visit.person)
        self.looked = True

    async def keep_left(self, targets: Iterable[Target], person: str, work_order: str | None = None) -> None:
        """Keep what is known of the devices now, in the place of what was kept before. Raises StoreError."""
        visit = self.current
        if visit is not None:
            now_ns = self._stamp()
            order = visit.work_order if work_order is None else work_order
            known = [as_known(one, visit.turbine, person, now_ns, order) for one in targets]
            await self._keep(visit, Phase.LEFT, [self._library.identified(one) for one in known], person)

    async def end(self, reason: str, work_order: str, person: str) -> Visit:
        """End the open visit. Raises NoVisitError, StoreError."""
        ended = replace(self.require(), ended_ns=self._stamp(), reason=reason, work_order=work_order)
        await self._put(ended)
        self.current = None
        self._audit.note(Action.VISIT_ENDED, person, None, turbine=ended.turbine, reason=reason, work_order=work_order)
        return ended

    async def change(self, reason: str | None, work_order: str | None, person: str) -> Visit:
        """Change reason or work order of the open visit; None stays. Raises NoVisitError, StoreError."""
        visit = self.require()
        changed = replace(
            visit,
            reason=visit.reason if reason is None else reason,
            work_order=visit.work_order if work_order is None else work_order,
        )
        await self._put(changed)
        self.current = changed
        self._audit.note(
            Action.VISIT_CHANGED, person, None,
            turbine=visit.turbine, reason=changed.reason, work_order=changed.work_order,
        )  # fmt: skip
        return changed

    async def latest(self, turbine: str | None, limit: int) -> list[Visit]:
        """Visits, newest first."""
        return await self._store.run(lambda connection: visit_rows.list_visits(connection, turbine, limit))

    async def sets(self, visit: Visit, phase: Phase) -> dict[str, ParameterSet]:
        """The values of a visit by device; empty where none were kept. Raises SetFileError where one is damaged."""
        texts = await self._store.run(lambda connection: visit_rows.sets_of(connection, visit.id, phase))
        return {device: load_set(text, f"visit {visit.id}, {device}") for device, text in texts.items()}

    async def _put(self, visit: Visit) -> None:
        await self._store.run(lambda connection: visit_rows.put_visit(connection, visit))

    async def _keep(self, visit: Visit, phase: Phase, sets: Iterable[ParameterSet], person: str) -> None:
        """Keep the sets with the visit and, in the same transaction, in the library."""
        kept = [one for one in sets if one.values]
        texts = {one.origin.device: dump_set(one) for one in kept}

        def work(connection: Connection) -> None:
            visit_rows.keep_sets(connection, visit.id, phase, texts)
            self._library.keep_visit(connection, kept, TAGS[phase], visit.id, person)

        await self._store.run(work)


def as_known(target: Target, turbine: str, person: str, now_ns: int, work_order: str = "") -> ParameterSet:
    """The parameter set of what the live state knows now; nothing is read for it."""
    views = target.live.values(target.device.bus, target.node)
    values: dict[Address, Raw] = {}
    unread: dict[Address, str] = {}
    for address in readable(target.description):
        view = views.get(address)
        if view is None or view.reading is None:
            unread[address] = NOT_READ
        elif view.stale:
            unread[address] = STALE
        else:
            values[address] = decode(target.entry(address), view.reading.data)
    time = iso_time(now_ns // SECOND_NS * SECOND_NS)
    return ParameterSet(
        description_id=target.description.id,
        description_version=target.description.version,
        identity=identity_of(values),
        origin=Origin(turbine, target.slug, target.node, time, person, "as left", f"hubside {__version__}", work_order),
        values=values,
        unread=unread,
    )
