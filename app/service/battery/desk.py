"""The desk of batteries of one connection: tests that run, and changes."""

from __future__ import annotations

import asyncio
import logging
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import dataclass
from typing import Final

from app.errors import BatteryConditionError, BatteryNotNotedError, HubsideError, StoreError
from app.model.sets import IDENTITY
from app.model.station import station_slug
from app.service.battery.archive import Archive
from app.service.battery.change import reset_counter
from app.service.battery.commands import Edges
from app.service.battery.conditions import Condition, Need, look
from app.service.battery.objects import (
    CHARGER_STATUS,
    LOWEST_V,
    Command,
    read_number,
    read_numbers,
    require_battery,
)
from app.service.battery.records import ChangeRecord, Figures, Noted, TestRecord, Verdict
from app.service.battery.sequence import Sequence, figures
from app.service.claims import Work
from app.service.connection import Connection
from app.service.devices import Target
from app.service.journal import Journal, Kind
from app.service.motion.desk import MotionDesk

log = logging.getLogger(__name__)

CLOSE_S: Final = 15.0
"""A test between its two edges is brought to its second one first."""
_CHARGER_ACTIVE: Final = 1 << 1


@dataclass
class Running:
    """A test under way: whose it is, since when, and the battery before it."""

    person: str
    t_ns: int
    before: Figures
    sequence: Sequence
    task: asyncio.Task[TestRecord]


class BatteryDesk:
    """Tests and changes of the batteries of ``connection``. Belongs to the event loop; ``close`` ends what runs."""

    def __init__(self, connection: Connection, motion: MotionDesk, archive: Archive) -> None:
        self._connection = connection
        self._motion = motion
        self.archive = archive
        self._running: dict[str, Running] = {}
        self._beginning: set[str] = set()
        self._closed = False

    async def close(self) -> None:
        """Stop watching; the drives end their tests by themselves."""
        self._closed = True
        tasks = [running.task for running in self._running.values()]
        for running in self._running.values():
            running.sequence.cancel()
        if tasks:
            await asyncio.wait(tasks, timeout=CLOSE_S)

    def running(self, target: Target) -> Running | None:
        """The test of a device that is under way."""
        return self._running.get(target.slug)

    # -- test --------------------------------------------------------------------------

    async def needs(self, target: Target) -> list[Need]:
        """How the conditions of a test stand. Raises UsageError where the device has no battery."""
        require_battery(target)
        return await look(self._connection, self._motion, target)

    async def test(self, target: Target, person: str, journal: Journal) -> Running:
        """Begin a test; it goes on by itself. Returned once the drive has begun it, or would not.

        Raises BatteryConditionError, BatteryCommandError, BatteryArmedError, DeviceBusyError, and what a write raises.
        """
        slug = target.slug
        require_battery(target)
        if self._closed or slug in self._running or slug in self._beginning:
            raise BatteryConditionError(device=slug, **Need(Condition.NO_TEST, True, {}).reason)
        self._beginning.add(slug)
        self._motion.batteries_tested.add(station_slug(slug))
        try:
            await self._require(target)
            driver = self._connection.driver(target)
            before = await figures(driver, target)
            sequence = Sequence(driver, target, journal)
            with ExitStack() as claim:
                claim.enter_context(self._claimed(target, person))
                journal.note(Kind.BATTERY_TEST_BEGUN, slug)
                task = asyncio.create_task(self._run(target, person, sequence, before, journal))
                kept = claim.pop_all()
            task.add_done_callback(lambda _task: kept.close())
            running = self._running[slug] = Running(person, self._connection.stamper(), before, sequence, task)
        finally:
            self._beginning.discard(slug)
            self._let_move(slug)
        begun = asyncio.create_task(sequence.begun.wait())
        await asyncio.wait({begun, task}, return_when=asyncio.FIRST_COMPLETED)
        begun.cancel()
        if task.done():
            await task  # raises what kept it from beginning
        return running

    def _let_move(self, slug: str) -> None:
        """Where nothing of a test is under way, the axes of the station may move, as far as its unit says so too."""
        if slug not in self._running:
            self._motion.batteries_tested.discard(station_slug(slug))

    def cancel(self, target: Target) -> None:
        """Stop watching the test of a device; nothing happens where none runs."""
        running = self._running.get(target.slug)
        if running is not None:
            running.sequence.cancel()

    def _claimed(self, target: Target, person: str) -> AbstractContextManager[None]:
        """Nobody takes the device for himself meanwhile: what was begun by a write is ended by one."""
        return self._connection.gate.claims.held(Work.BATTERY, person, (target.slug,))

    async def _require(self, target: Target, only: frozenset[Condition] | None = None) -> None:
        for need in await self.needs(target):
            if need.holds_back and (only is None or need.condition in only):
                raise BatteryConditionError(device=target.slug, **need.reason)

    async def _run(
        self, target: Target, person: str, sequence: Sequence, before: Figures, journal: Journal
    ) -> TestRecord:
        """Raises what keeps a test from beginning; whatever comes later is a verdict."""
        driver, t_ns = self._connection.driver(target), self._connection.stamper()
        verdict_name = "–"
        try:
            verdict = await sequence.run()
            verdict_name = verdict.value
            lowest = await read_numbers(driver, target, (LOWEST_V,))
            record = TestRecord(
                id=self.archive.new_id(),
                device=target.slug,
                serial=serial_of(target),
                person=person,
                t_ns=t_ns,
                took_ms=sequence.took_ms,
                verdict=verdict,
                lowest_v=None if verdict is Verdict.REFUSED else lowest[LOWEST_V],
                before=before,
                after=await figures(driver, target),
                course=tuple(sequence.course),
            )
            with suppress(StoreError):  # the journal has told it; the page tells that the store fails
                await self.archive.keep(record)
            return record
        except HubsideError as error:
            verdict_name = error.code
            raise
        finally:
            self._running.pop(target.slug, None)
            self._let_move(target.slug)
            journal.note(Kind.BATTERY_TEST_ENDED, target.slug, verdict=verdict_name)

    # -- charger -----------------------------------------------------------------------

    async def charge(self, target: Target, journal: Journal) -> None:
        """Start the charger by hand (bit 0 of 3040h), and let the bit fall again.

        Raises BatteryConditionError, BatteryCommandError, DeviceBusyError, and what a write raises.
        """
        await self._require(target, frozenset({Condition.ANSWERS, Condition.NO_TEST, Condition.NO_RESTORE}))
        driver = self._connection.driver(target)
        edges = Edges(driver, target, journal)

        async def charges() -> bool:
            return bool(await read_number(driver, target, CHARGER_STATUS) & _CHARGER_ACTIVE)

        with self._claimed(target, journal.person):
            try:
                await edges.rise(Command.CHARGE, charges)
            finally:
                await edges.fall(Command.CHARGE)

    # -- change ------------------------------------------------------------------------

    async def note_old(self, target: Target, serials: str, person: str) -> Noted:
        """Note what the battery is before it is taken out. Raises BatteryConditionError, StoreError."""
        await self._require(target, frozenset({Condition.ANSWERS, Condition.NO_TEST}))
        found = await figures(self._connection.driver(target), target)
        noted = Noted(target.slug, person, self._connection.stamper(), serials, found)
        await self.archive.note(noted)
        return noted

    async def give_up_change(self, target: Target) -> None:
        """The battery stays; what was noted is forgotten. Raises StoreError."""
        await self.archive.forget(target.slug)

    async def changed(self, target: Target, serials: str, remark: str, person: str, journal: Journal) -> ChangeRecord:
        """The new battery is in: set its counter to 0, save, keep a record.

        Raises BatteryNotNotedError, BatteryConditionError, DeviceBusyError, what ``reset_counter`` raises, StoreError.
        """
        old = await self.archive.noted(target.slug)
        if old is None:
            raise BatteryNotNotedError(device=target.slug)
        await self._require(
            target, frozenset({Condition.ANSWERS, Condition.NO_TEST, Condition.NOBODY_MOVES, Condition.NO_RESTORE})
        )
        driver, now_ns = self._connection.driver(target), self._connection.stamper
        with self._claimed(target, person):
            counter = await reset_counter(driver, target, journal, now_ns)
        record = ChangeRecord(
            id=self.archive.new_id(),
            device=target.slug,
            serial=serial_of(target),
            person=person,
            t_ns=now_ns(),
            old=old,
            serials=serials,
            remark=remark,
            counter_mah=counter,
        )
        journal.note(Kind.BATTERY_CHANGED, target.slug, was=old.figures.charged_mah, old=old.serials, new=serials)
        await self.archive.keep(record)
        await self.archive.forget(target.slug)
        return record


def serial_of(target: Target) -> int | None:
    """Serial number that the unit tells; None where it tells none."""
    address = IDENTITY["serial"]
    raw = target.lookup(address) if address in target.description.entries else None
    return raw if isinstance(raw, int) else None
