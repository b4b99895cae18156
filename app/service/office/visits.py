"""Visits: from connecting to a turbine to "end visit", with the values as found and as left."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Final

from app import __version__
from app.errors import NoVisitError, SetFileError
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

log = logging.getLogger(__name__)

GOES_ON_NS: Final = 12 * 3600 * 1_000_000_000
"""Connecting again within so long after its beginning goes on with a visit: a shift."""
NOT_READ: Final = "not read"
AS_LEFT: Final = "as left"
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
        self.found: dict[str, ParameterSet] = {}
        """As found in the present visit, by device."""
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
        self.current, self.looked, self.found = None, False, {}
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
        self.found = await self._readable_sets(visit, Phase.FOUND)
        self.current = visit
        return visit

    async def keep_found(self, sets: Iterable[ParameterSet], looked: bool = True) -> None:
        """Keep the values as found; what was kept earlier in the same visit stays. Raises StoreError.

        ``looked`` False: other devices are still to be read.
        """
        visit = self.current
        if visit is not None:
            new = [one for one in sets if one.values and one.origin.device not in self.found]
            await self._keep(visit, Phase.FOUND, new, visit.person)
            for one in new:
                self.found.setdefault(one.origin.device, one)
        self.looked = looked

    async def keep_left(self, targets: Iterable[Target], person: str, work_order: str | None = None) -> None:
        """Keep what is known of the devices now. Raises StoreError.

        It takes the place of what an earlier connection of this visit kept where no more parameters are unknown than
        then; where more are, only what is known to have changed since does. Of a device of which no parameter is
        known, nothing is kept.
        """
        visit = self.current
        if visit is None:
            return
        now_ns = self._stamp()
        order = visit.work_order if work_order is None else work_order
        before = await self._readable_sets(visit, Phase.LEFT)
        left = []
        for target in targets:
            known = as_known(target, visit.turbine, person, now_ns, order, self.found.get(target.slug))
            one = _as_left(target, before.get(target.slug), known)
            if one is not None:
                left.append(self._library.identified(one))
        await self._keep(visit, Phase.LEFT, left, person)

    async def end(self, reason: str, work_order: str, person: str) -> Visit:
        """End the open visit. Raises NoVisitError, StoreError."""
        ended = replace(self.require(), ended_ns=self._stamp(), reason=reason, work_order=work_order)
        await self._put(ended)
        self.current, self.found = None, {}
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

    async def _readable_sets(self, visit: Visit, phase: Phase) -> dict[str, ParameterSet]:
        """As ``sets``; one that is damaged counts as not kept."""
        texts = await self._store.run(lambda connection: visit_rows.sets_of(connection, visit.id, phase))
        found = {}
        for device, text in texts.items():
            try:
                found[device] = load_set(text, f"visit {visit.id}, {device}")
            except SetFileError as error:
                log.warning("%s: %s", error.code, error)
        return found

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


def known_empty(
    found: ParameterSet | None, values: Mapping[Address, Raw], unread: Mapping[Address, str]
) -> frozenset[Address]:
    """The objects of ``unread`` that held no data as ``found`` and, as far as ``values`` tell, hold none now.

    Where the number of an array's entries (sub-index 0) is another now, nothing is known of those entries.
    """
    if found is None:
        return frozenset()

    def counts_as_then(address: Address) -> bool:
        count = Address(address.major, 0)
        return count == address or (count in values and values[count] == found.values.get(count))

    return frozenset(one for one in found.empty if unread.get(one) == NOT_READ and counts_as_then(one))


def _as_left(target: Target, kept: ParameterSet | None, known: ParameterSet) -> ParameterSet | None:
    """What is to be kept as left now that ``known`` is known and ``kept`` was kept before; None: nothing new."""
    parameters = [entry.address for entry in target.description if entry.is_parameter]
    if not any(address in known.values for address in parameters):
        return None
    if kept is None or _is_another(kept, known):
        return known
    if sum(one in known.unread for one in parameters) <= sum(one in kept.unread for one in parameters):
        return known
    if all(known.values.get(one, kept.values.get(one)) == kept.values.get(one) for one in parameters):
        return None
    values = {**kept.values, **known.values}
    return replace(
        known,
        values=values,
        identity=identity_of(values),
        unread={address: why for address, why in kept.unread.items() if address not in values},
        empty=tuple(address for address in kept.empty if address not in values),
    )


def _is_another(kept: ParameterSet, known: ParameterSet) -> bool:
    """True where another device, or another kind of device, stands there now."""
    return kept.description_id != known.description_id or kept.identity.has_other_serial(known.identity)


def as_known(
    target: Target, turbine: str, person: str, now_ns: int, work_order: str = "", found: ParameterSet | None = None
) -> ParameterSet:
    """The parameter set of what the live state knows now; nothing is read for it.

    ``found``: as found in this visit; it tells which objects hold no data.
    """
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
    empty = known_empty(found, values, unread)
    time = iso_time(now_ns // SECOND_NS * SECOND_NS)
    return ParameterSet(
        description_id=target.description.id,
        description_version=target.description.version,
        identity=identity_of(values),
        origin=Origin(turbine, target.slug, target.node, time, person, AS_LEFT, f"hubside {__version__}", work_order),
        values=values,
        unread={address: why for address, why in unread.items() if address not in empty},
        empty=tuple(address for address in unread if address in empty),
    )
