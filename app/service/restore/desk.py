"""The desk of restores: begins them, has them decided, takes up what an earlier run left, shuts the gate meanwhile."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import Callable, Coroutine, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from app.errors import (
    MotorUnknownError,
    RestoreChangedError,
    RestoreOpenError,
    RestoreRefusedError,
    RestoreStateError,
    RestoreUnknownError,
    SigningKeyError,
    StoreError,
    UsageError,
)
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.set_record import SetRecord, Source
from app.model.sets import Identity
from app.service.claims import Work
from app.service.connection import Connection
from app.service.devices import Target
from app.service.gate import Blocks
from app.service.journal import Journal, Kind
from app.service.office.office import Office
from app.service.records.files import SealedRecord, seal_record
from app.service.records.signing import SigningKey
from app.service.restore import details as detail
from app.service.restore.blocking import block_of
from app.service.restore.commands import Counts, commands_of
from app.service.restore.left import give_up, require_same_places, take_up
from app.service.restore.log import Kept, RestoreLog, load, new_row, value_rows
from app.service.restore.motor_given import note_motors
from app.service.restore.order import Broken, Cause, Order, Timing
from app.service.restore.prepare import Prepared, open_at, prepare
from app.service.restore.record import RecordOf, outcome_of
from app.service.restore.steps import Hands
from app.service.restore.survey import Progress, Survey, targets_of
from app.service.restore.transaction import End, Terms, Transaction
from app.store import restore_rows as rows
from app.store.restore_rows import RestoreRow, RestoreState
from app.store.uuid7 import Uuid7

log = logging.getLogger(__name__)

REASON_BEFORE: Final = "before a restore"
REASON_AFTER: Final = "after a restore"


@dataclass(slots=True)
class Running:
    """A restore that is worked on now."""

    id: str
    station: str
    transaction: Transaction
    task: asyncio.Task[End]


class Desk:
    """The restores of one store. Belongs to the event loop; one restore is worked on at a time.

    ``stamp`` gives t_ns; ``blocks`` is what the gates of connections look at. ``data``: folder of the key that seals
    records; None makes none. Raises StoreError.
    """

    def __init__(
        self,
        office: Office,
        journal: Journal,
        stamp: Callable[[], int],
        timing: Timing | None = None,
        monotonic: Callable[[], float] = time.monotonic,
        data: Path | None = None,
    ) -> None:
        self.blocks = Blocks()
        self.running: Running | None = None
        self._starting = asyncio.Lock()
        self._endings: set[asyncio.Future[None]] = set()
        self._office = office
        self._store = office.store
        self._journal = journal
        self._stamp = stamp
        self._data = data
        self._timing = timing or Timing()
        self._monotonic = monotonic
        self._new_id = Uuid7(stamp)
        self._open: dict[str, RestoreRow] = {}
        self._broken: dict[str, Broken] = {}
        for row in self._store.call(lambda connection: take_up(connection, stamp())):
            self._open[row.id] = row
        self._shut()

    # -- what there is -----------------------------------------------------------------

    @property
    def open(self) -> tuple[RestoreRow, ...]:
        """Restores that have not ended, oldest first: also the one that runs."""
        return tuple(self._open.values())

    async def latest(self, turbine: str | None = None, limit: int = 100) -> list[RestoreRow]:
        """Restores, newest first."""
        found = await self._store.run(lambda connection: rows.list_restores(connection, turbine, limit))
        return [self._as_it_is(row) for row in found]

    async def get(self, restore_id: str) -> Kept:
        """One restore. Raises RestoreUnknownError."""
        found = await load(self._store, restore_id)
        if found is None:
            raise RestoreUnknownError(restore=restore_id)
        return replace(found, row=self._as_it_is(found.row))

    def _as_it_is(self, row: RestoreRow) -> RestoreRow:
        """A restore that nobody works on is incomplete, whatever a store that could not be written says of it."""
        if row.state.ended or self.at_work(row.id) is not None:
            return row
        return replace(row, state=RestoreState.INCOMPLETE)

    def at_work(self, restore_id: str) -> Transaction | None:
        """The restore while it is worked on."""
        running = self.running
        return running.transaction if running is not None and running.id == restore_id else None

    def require_idle(self) -> None:
        """Raises RestoreOpenError while a restore runs: the connection is its own."""
        if self.running is not None:
            raise RestoreOpenError(station=self.running.station, restore=self.running.id)

    # -- begin --------------------------------------------------------------------------

    async def prepare(self, connection: Connection, order: Order, on_progress: Progress | None = None) -> Prepared:
        """Plan, and what speaks against it. Reads the devices and writes nothing."""
        self.require_idle()
        return await prepare(connection, order, self._nameplates(), on_progress)

    async def begin(self, connection: Connection, prepared: Prepared, agreed: str | None = None) -> str:
        """Begin what was prepared just now; gives the id of the restore, which runs in the background.

        ``agreed``: hash of the plan that the person has looked at. Raises RestoreChangedError where it is another one,
        RestoreRefusedError where something speaks against it, RestoreOpenError, DeviceBusyError.
        """
        order = prepared.order
        if agreed is not None and agreed != prepared.hash:
            raise RestoreChangedError(station=order.station)
        if prepared.refusals:
            refusals = [one.as_detail() for one in prepared.refusals]
            raise RestoreRefusedError(station=order.station, count=len(refusals), refusals=refusals)
        async with self._starting:
            self.require_idle()
            found = open_at(connection, prepared.targets, prepared.found)
            if found is not None:
                raise RestoreOpenError(station=order.station, restore=found)
            with _claimed(connection, prepared.targets, order.person) as claim:
                return await self._begin(connection, prepared, claim)

    async def _begin(self, connection: Connection, prepared: Prepared, claim: ExitStack) -> str:
        order = prepared.order
        restore_id = self._new_id()
        before = await self._keep(prepared.found, REASON_BEFORE, order.person, Source.UNDO)
        ids = {one.origin.device: one.id for one in before}
        details = detail.details_of(connection, prepared, ids, self._nameplates())
        row = new_row(restore_id, connection.turbine.slug, order, details, self._stamp())
        values = value_rows(prepared.goals)
        await self._store.run(lambda kept: rows.add_restore(kept, row, values))
        self._open[row.id] = row
        self._shut()
        self._journal.by(order.person).note(Kind.RESTORE_BEGUN, None, station=order.station, restore=restore_id)
        kept = Kept(row, tuple(values), ())
        transaction = self._transaction(connection, kept, order.person, prepared.targets, prepared.commands)
        transaction.found = prepared.found
        way = transaction.forward(prepared.plan, order.confirm_s)
        await self._run(kept, transaction, way, order.person, claim.pop_all())
        return restore_id

    # -- decide -------------------------------------------------------------------------

    async def confirm(self, restore_id: str, person: str) -> None:
        """The person agrees to what stands in RAM.

        Raises RestoreStateError where that is not awaited any more, RestoreUnknownError.
        """
        transaction = self.at_work(restore_id)
        if transaction is None or not transaction.confirm(person):
            raise self._wrong_state((await self.get(restore_id)).row)
        station = self._open[restore_id].station
        self._journal.by(person).note(Kind.RESTORE_CONFIRMED, None, station=station, restore=restore_id)

    async def roll_back(self, connection: Connection | None, restore_id: str, person: str) -> None:
        """Back to the old values: at once where it is incomplete, else after the step that runs.

        Raises RestoreUnknownError, RestoreStateError, UsageError where its station is not connected, DeviceBusyError.
        """
        commands = None if connection is None else commands_of(connection)
        transaction = self.at_work(restore_id)
        if transaction is not None and transaction.goes_on:
            transaction.turn_back(person)
            return
        await self._settle()
        async with self._starting:
            kind = Kind.RESTORE_TURNED_BACK
            kept, transaction, claim = await self._take_on(connection, restore_id, person, kind, commands)
            await self._run(kept, transaction, transaction.back(), person, claim)

    async def go_on_unproven(self, restore_id: str, person: str) -> None:
        """Nobody switches the device off and on now: the restore ends with what is saved, and not proven.

        Raises RestoreStateError where that is not awaited, RestoreUnknownError.
        """
        transaction = self.at_work(restore_id)
        slug = None if transaction is None else transaction.switching
        if transaction is None or slug is None or not transaction.go_on_unproven():
            raise self._wrong_state((await self.get(restore_id)).row)
        self._journal.by(person).note(Kind.RESTORE_UNPROVEN, slug, station=self._open[restore_id].station)

    async def resume(self, connection: Connection | None, restore_id: str, person: str) -> None:
        """On to the new values. Raises RestoreUnknownError, RestoreStateError, UsageError, DeviceBusyError."""
        commands = None if connection is None else commands_of(connection)
        async with self._starting:
            kind = Kind.RESTORE_RESUMED
            kept, transaction, claim = await self._take_on(connection, restore_id, person, kind, commands)
            await self._run(kept, transaction, transaction.resume(), person, claim)

    async def give_up(self, restore_id: str, person: str, reason: str) -> None:
        """An expert closes one that can neither be resumed nor rolled back, as its device is gone: the gate opens.

        The rights are for the caller to check. Raises UsageError without a reason, RestoreUnknownError,
        RestoreStateError, StoreError; then it stays open.
        """
        async with self._starting:
            kept = await self.get(restore_id)
            if self.running is not None or kept.row.state is not RestoreState.INCOMPLETE:
                raise self._wrong_state(kept.row)
            await give_up(self._store, kept, self._stamp, person, reason)
            self._open.pop(restore_id, None)
            self._shut()
        details = {"station": kept.row.station, "restore": restore_id, "reason": reason.strip()}
        self._journal.by(person).note(Kind.RESTORE_GIVEN_UP, None, **details)
        await self.record(restore_id)

    async def _take_on(
        self, connection: Connection | None, restore_id: str, person: str, kind: Kind, commands: Counts | None
    ) -> tuple[Kept, Transaction, ExitStack]:
        kept = await self.get(restore_id)
        if self.running is not None or kept.row.state is not RestoreState.INCOMPLETE:
            raise self._wrong_state(kept.row)
        if connection is None or connection.turbine.slug != kept.row.turbine:
            raise UsageError(reason=f"connect to {kept.row.turbine} first: the restore is of {kept.row.station}")
        slugs = {one["slug"] for one in kept.details["devices"]}
        targets = tuple(target for target in targets_of(connection, kept.row.station) if target.slug in slugs)
        if len(targets) != len(slugs):
            raise UsageError(reason=f"not all devices of the restore are there: {', '.join(sorted(slugs))}")
        require_same_places(connection, kept, targets)
        with _claimed(connection, targets, person) as claim:
            self._journal.by(person).note(kind, None, station=kept.row.station, restore=restore_id)
            transaction = self._transaction(connection, kept, person, targets, commands)
            return kept, transaction, claim.pop_all()

    def _wrong_state(self, row: RestoreRow) -> RestoreStateError:
        return RestoreStateError(restore=row.id, station=row.station, state_key=row.state.text_key)

    # -- run ----------------------------------------------------------------------------

    def _transaction(
        self,
        connection: Connection,
        kept: Kept,
        person: str,
        targets: tuple[Target, ...],
        commands: Counts | None,
    ) -> Transaction:
        details = kept.details
        log = RestoreLog(self._store, kept, self._stamp)
        ungated = {target.slug: target.past_gate() for target in targets}
        journal = self._journal.by(person)
        hands = Hands(connection, ungated, log, journal, details["expert"], self._timing, self._monotonic, commands)
        terms = Terms(
            goals=kept.goals,
            modes=details["modes"],
            saves=frozenset(details["saves"]),
            restart=details["restart"],
            expert=details["expert"],
            station=kept.row.station,
            person=person,
            reason=REASON_AFTER,
            identities={one["slug"]: Identity(**one["identity"]) for one in details["devices"]},
            nameplates=self._nameplates(),
            others_confirmed=details["expert"] and details["others_confirmed"],
            categories={slug: tuple(some) for slug, some in details.get("categories", {}).items()},
            network=details.get("network", False),
        )
        return Transaction(hands, log, terms)

    async def _run(
        self, kept: Kept, transaction: Transaction, way: Coroutine[Any, Any, End], person: str, claim: ExitStack
    ) -> None:
        """``claim`` on its devices is given back at its end."""
        task = asyncio.create_task(self._watched(kept.row, transaction, way, person, claim))
        self.running = Running(kept.row.id, kept.row.station, transaction, task)
        await asyncio.sleep(0)  # it has begun: whatever ends it from now on is seen by itself

    async def _watched(
        self,
        row: RestoreRow,
        transaction: Transaction,
        way: Coroutine[Any, Any, End],
        person: str,
        claim: ExitStack,
    ) -> End:
        end = End.INCOMPLETE
        try:
            end = await way
            return end
        finally:
            ending = asyncio.ensure_future(self._ended(row, transaction, end, person, claim))
            self._endings.add(ending)
            ending.add_done_callback(self._endings.discard)
            await asyncio.shield(ending)

    async def _ended(self, row: RestoreRow, transaction: Transaction, end: End, person: str, claim: ExitStack) -> None:
        """The gate opens only where the station holds the old values or the new ones."""
        if end is End.INCOMPLETE:
            self._open[row.id] = replace(row, state=RestoreState.INCOMPLETE)
        else:
            self._open.pop(row.id, None)
        if transaction.broken is not None:
            self._broken[row.id] = transaction.broken
        self._shut()
        claim.close()
        try:
            await self._keep_end(row, transaction, end, person)
        finally:
            self.running = None

    async def _keep_end(self, row: RestoreRow, transaction: Transaction, end: End, person: str) -> None:
        """What is kept of the end: journal, values as they are now, record, motors."""
        details = {"station": row.station, "restore": row.id}
        cause = Cause.CANCELLED if transaction.broken is None else transaction.broken.cause
        if end is not End.NEW:
            details["cause_key"] = cause.text_key
        self._journal.by(person).note(_KIND_OF[end], None, **details)
        found = transaction.found if end is not End.INCOMPLETE else None
        after = [] if found is None else await self._keep(found, REASON_AFTER, person, Source.BACKUP)
        await self._seal(row.id, transaction.descriptions, found, after)
        if end is End.NEW:
            with contextlib.suppress(StoreError, MotorUnknownError):
                await note_motors(self._office.motors, json.loads(row.details)["devices"], person)

    def why(self, restore_id: str) -> Broken | None:
        """Why a restore that ran in this process did not go on."""
        return self._broken.get(restore_id)

    async def wait(self, restore_id: str) -> End:
        """Until it is not worked on any more."""
        running = self.running
        if running is not None and running.id == restore_id:
            return await asyncio.shield(running.task)
        await self._settle()
        state = (await self.get(restore_id)).row.state
        return {RestoreState.DONE: End.NEW, RestoreState.ROLLED_BACK: End.OLD}.get(state, End.INCOMPLETE)

    async def close(self) -> None:
        """End what runs: it stays open, incomplete, for whoever comes next."""
        running = self.running
        if running is not None:
            running.task.cancel()
            await asyncio.wait([running.task])
        await self._settle()

    async def _settle(self) -> None:
        """Until all that is kept of restores that have ended is on the disk."""
        await asyncio.gather(*self._endings, return_exceptions=True)

    async def record(self, restore_id: str) -> SealedRecord | None:
        """The sealed record of a restore that has come to an end, be it incomplete. Raises StoreError.

        A tool that was killed may have left none, or that of an earlier end: it is made of what the store kept then.
        """
        sealed, kept = await self._sealed(restore_id), await load(self._store, restore_id)
        if kept is None or self.at_work(restore_id) is not None:
            return sealed
        if sealed is not None and sealed.record.outcome is outcome_of(kept.row.state):
            return sealed
        try:
            descriptions = {one["slug"]: load_builtin(one["description"][0]) for one in kept.details["devices"]}
        except UsageError:  # of a file that is gone
            return sealed
        await self._seal(restore_id, descriptions, None, [])
        return await self._sealed(restore_id)

    async def _sealed(self, restore_id: str) -> SealedRecord | None:
        found = await self._store.run(lambda connection: rows.get_record(connection, restore_id))
        return None if found is None else SealedRecord(*found)

    def key(self) -> SigningKey | None:
        """The key that seals; None where there is no data folder. Waits for the disk. Raises SigningKeyError."""
        return None if self._data is None else SigningKey.of(self._data)

    async def _seal(
        self, restore_id: str, descriptions: Mapping[str, Description], found: Survey | None, after: list[SetRecord]
    ) -> None:
        """Make, seal and keep the record. What fails is told in the log: the restore itself has ended well or not."""
        if self._data is None:
            return
        ids = {one.origin.device: one.id for one in after}
        try:
            kept = await self.get(restore_id)
            record = RecordOf(kept, descriptions, {} if found is None else found.sets, ids).make()
            key = await asyncio.to_thread(SigningKey.of, self._data)
            one, t_ns = seal_record(record, key), self._stamp()
            await self._store.run(lambda to: rows.add_record(to, restore_id, t_ns, one.text, one.seal))
        except (StoreError, SigningKeyError):
            log.exception("the record of restore %s could not be kept", restore_id)

    def _nameplates(self) -> dict[str, str | None]:
        """Serial numbers on plates as people have typed them, by slug."""
        return {slug: plate.serial for slug, plate in self._office.library.nameplates.items()}

    # -- the gate -----------------------------------------------------------------------

    def _shut(self) -> None:
        self.blocks.put(block_of(row) for row in self._open.values())

    async def _keep(self, found: Survey, reason: str, person: str, source: Source) -> list[SetRecord]:
        """Sets go to the library; a store that fails holds up no restore."""
        library = self._office.library
        own = [
            library.identified(replace(one, origin=replace(one.origin, reason=reason, person=person)))
            for one in found.sets.values()
        ]
        try:
            return await self._office.library.put(own, source)
        except StoreError:
            return []


def _claimed(connection: Connection, targets: Iterable[Target], person: str) -> ExitStack:
    """A restore's claim on its devices, before the gate is shut and until it is worked on no more.

    Raises DeviceBusyError.
    """
    stack = ExitStack()
    slugs = [target.slug for target in targets]
    stack.enter_context(connection.gate.claims.held(Work.RESTORE, person, slugs))
    return stack


_KIND_OF: Final[Mapping[End, Kind]] = {
    End.NEW: Kind.RESTORE_DONE,
    End.OLD: Kind.RESTORE_ROLLED_BACK,
    End.INCOMPLETE: Kind.RESTORE_INCOMPLETE,
}
