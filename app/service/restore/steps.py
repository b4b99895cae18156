"""How the steps of a restore are carried out: what must hold before each, the step itself, and what proves it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.drivers.contract import LinkState
from app.errors import (
    BusLostError,
    ConflictError,
    DeviceError,
    HubsideError,
    NoAnswerError,
    OvertakenError,
    StoreError,
    UnverifiedError,
)
from app.model.address import Address
from app.model.checks import Allow
from app.model.datatypes import Raw
from app.model.description import Description, RestoreClass
from app.model.restore.plan import Step, StepKind
from app.model.saving import Category, command_of, has_categories
from app.model.station import Place, StationValues
from app.service.connection import Connection
from app.service.devices import Target
from app.service.gate import BARE_TURBINE
from app.service.journal import Journal
from app.service.restore.commands import Counts, commands_of
from app.service.restore.log import RestoreLog, raw_text
from app.service.restore.order import Broken, Cause, Objection, Timing
from app.service.restore.precheck import objections_to_surroundings
from app.service.restore.survey import (
    VELOCITY,
    Survey,
    boots_of,
    is_driven,
    read_integer,
    read_whole,
    standstill,
)
from app.service.save import Took, restart, save
from app.service.stop import CONTROLWORD, has_feather, machine_of
from app.service.whole import whole
from app.service.write import write_raw
from app.store.restore_rows import Direction, StepState

DEVICE_TYPE: Final = Address(0x1000)
UPTIME: Final = Address(0x230F)
"""Seconds since the start, of a drive of Nanotec."""
SHUTDOWN: Final = 0x0106
"""Controlword (manual table 52)."""
_ENABLE_OPERATION: Final = 1 << 3
_FEATHER: Final = 1 << 11
LOOK_S: Final = 0.05
"""How often is looked whether a device is ready, an axis stands, or a person has decided."""


@dataclass(slots=True)
class Switching:
    """A device that somebody is to switch off and on. ``without``: a person wants to go on without that proof."""

    slug: str
    until_s: float
    without: bool = False


class Hands:
    """Carries out single steps at one station. Every method raises Broken, and nothing else that is expected.

    ``targets`` by slug pass no gate. ``now`` is what RAM is known to hold; the boots and reconnects of ``take`` are
    those against which a hidden restart or a gap shows. STOP or FEATHER after a person's decision (``commands``, later
    ``decided``) ends the way: above all no write of the controlword follows one, and no restart, which opens the safety
    chain. ``turned_back``: a person wants the old values, so that no step leads forward any more.
    """

    def __init__(
        self,
        connection: Connection,
        targets: Mapping[str, Target],
        log: RestoreLog,
        journal: Journal,
        expert: bool,
        timing: Timing,
        monotonic: Callable[[], float] = time.monotonic,
        commands: Counts | None = None,
    ) -> None:
        self.connection = connection
        self.targets = targets
        self.now = StationValues(())
        self.timing = timing
        self.monotonic = monotonic
        self._log = log
        self._journal = journal
        self._expert = expert
        self._boots: dict[str, int] = {}
        self._reconnects = self._all_reconnects()
        self._commands = commands_of(connection) if commands is None else commands
        self.turned_back = False
        self.switching: Switching | None = None
        known = set(targets)
        others = (axis.target for axis in connection.axes() if axis.target.slug not in known)
        bare = connection.turbine.slug == BARE_TURBINE
        self._watched = (*targets.values(), *(others if bare else ()))
        """Nobody says which nodes of a bus without names belong together: there all axes must stand."""

    def take(self, found: Survey) -> None:
        """Go on from what was just read."""
        self.now = found.station
        self._boots = dict(found.boots)
        self._reconnects = self._all_reconnects()

    def decided(self, commands: Counts | None = None) -> None:
        """A person wants it to go on, knowing of ``commands``; by default of all until now."""
        self._commands = commands_of(self.connection) if commands is None else commands

    # -- what must hold --------------------------------------------------------------

    async def guard(self, direction: Direction) -> None:
        """Nothing was commanded, restarted or missed, nobody else writes, all is recorded, no axis is driven."""
        self._not_overtaken()
        self.look_for_restarts()
        self._look_around(direction)
        for target in self._watched:
            if await self._is_driven(target):
                raise Broken(Cause.DRIVE_ENABLED, target.slug)

    def look_for_restarts(self) -> None:
        """No device has started anew, and the bus was not gone, since ``take``."""
        for name, link in self.connection.buses.items():
            status = link.status
            if status.state is LinkState.LOST or status.reconnects != self._reconnects[name]:
                raise Broken(Cause.BUS_LOST, "", BusLostError(bus=name, reason=status.reason or "connected again"))
        for slug, target in self.targets.items():
            if boots_of(target) != self._boots.get(slug, 0):
                raise Broken(Cause.DEVICE_RESTARTED, slug)

    def _look_around(self, direction: Direction) -> None:
        """No other master has come, and the recording goes on; the way back is gone unrecorded too."""
        found = objections_to_surroundings(self.connection, self.connection.stamper())
        back = direction is Direction.BACK
        broken = Broken.by(one for one in found if not (back and one.objection is Objection.NOT_RECORDING))
        if broken is not None:
            raise broken

    async def ready(self) -> None:
        """Wait until every device answers."""
        for target in self.targets.values():
            await self._answers(target)

    async def quiet(self) -> None:
        """Wait until no axis is driven: one that stands is not written to while it follows something."""
        until = self.monotonic() + self.timing.quiet_s
        for target in self._watched:
            while await self._is_driven(target, fresh=True):
                if self.monotonic() > until:
                    raise Broken(Cause.DRIVE_ENABLED, target.slug)
                await asyncio.sleep(LOOK_S)

    async def _still(self) -> None:
        """Wait until all axes stand: a restart opens the safety chain, and that of another device may drive ours."""
        until = self.monotonic() + self.timing.quiet_s
        for target in self._watched:
            while abs(await self._integer(target, VELOCITY) or 0) > standstill(target.description):
                if self.monotonic() > until:
                    raise Broken(Cause.DRIVE_ENABLED, target.slug)
                await asyncio.sleep(LOOK_S)

    async def _not_feathered(self, slug: str) -> None:
        """A FEATHER that somebody has sent is not cut short by a restart: it stands in the controlword."""
        for target in self._watched:
            if CONTROLWORD not in target.description.entries or not has_feather(target):
                continue
            word = await self._integer(target, CONTROLWORD)
            if word is not None and word & _FEATHER:
                self._log.ended(StepState.FAILED)
                raise Broken(Cause.DRIVE_ENABLED, slug)

    def _not_overtaken(self) -> None:
        """Nobody has sent STOP or FEATHER since a person decided last."""
        for slug, count in commands_of(self.connection).items():
            if count != self._commands.get(slug):
                target = self.connection.target(slug)
                controlword = machine_of(target).controlword
                error = OvertakenError(bus=target.device.bus, node=target.node, address=controlword.short)
                raise Broken(Cause.OVERTAKEN, slug, error)

    def _sure(self, direction: Direction) -> None:
        """At the last moment before a restart: nothing speaks against it."""
        self._not_overtaken()
        self._look_around(direction)
        if self.turned_back and direction is not Direction.BACK:
            raise Broken(Cause.CANCELLED)

    async def _integer(self, target: Target, address: Address) -> int | None:
        try:
            return await read_integer(self.connection, target, address)
        except HubsideError as error:
            raise Broken(cause_of(error), target.slug, error) from error

    async def _is_driven(self, target: Target, fresh: bool = False) -> bool:
        machine = target.description.machine
        if machine is None:
            return False
        view = target.live.value(target.device.bus, target.node, machine.statusword)
        young_ns = int(self.timing.status_s * 1e9)
        if not fresh and view is not None and view.reading is not None and not view.stale:
            raw = target.lookup(machine.statusword)
            if view.reading.age_ns(self.connection.stamper()) < young_ns and isinstance(raw, int):
                return is_driven(machine, raw)
        status = await self._integer(target, machine.statusword)
        return status is not None and is_driven(machine, status)

    async def _answers(self, target: Target) -> None:
        """Wait until it does. One without a boot-up message tells by its uptime whether it has started anew."""
        asked = _sign_of_life(target.description)
        until = self.monotonic() + self.timing.ready_s
        while True:
            try:
                await self.connection.driver(target).read(target.node, asked)
            except BusLostError as error:
                raise Broken(Cause.BUS_LOST, target.slug, error) from error
            except (NoAnswerError, DeviceError) as error:
                if self.monotonic() > until:
                    raise Broken(Cause.NO_ANSWER, target.slug, error) from error
                await asyncio.sleep(LOOK_S)
            else:
                return

    def _all_reconnects(self) -> dict[str, int]:
        return {name: link.status.reconnects for name, link in self.connection.buses.items()}

    # -- the steps ---------------------------------------------------------------------

    async def write(self, step: Step, direction: Direction) -> None:
        """One value: intent, write, read back; never twice. ``until`` of the step is waited for."""
        assert step.place is not None and step.raw is not None  # a step that writes has both
        place, target = step.place, self.targets[step.device]
        await self.guard(direction)
        if step.until is not None:
            await self._let_go(target, direction)
        await self._log.intend(direction, step.kind, step.device, place, step.raw)
        try:
            done = await whole(
                write_raw(
                    self.connection.driver(target),
                    target,
                    place.address,
                    step.raw,
                    self._journal,
                    allow=self._allow(target, place.address),
                    expected=self.now.raw(place),
                )
            )
            if step.until is not None:
                await self._shows(target, step.until.address, step.raw)
        except HubsideError as error:
            self._log.ended(_state_after(error), error)
            self._not_overtaken()
            raise Broken(cause_of(error), step.device, error) from error
        self.now = self.now.with_value(place, step.raw)
        for effect in target.entry(place.address).effects:
            if step.raw in effect.writing:
                self.now = self.now.with_value(Place(place.slug, effect.address), effect.raw)
        read = None if done.read is None else raw_text(done.read)
        self._log.ended(StepState.DONE, read=read, how=done.how.value)
        self.look_for_restarts()

    async def _let_go(self, target: Target, direction: Direction) -> None:
        """Have the controlword ask for nothing: the mode of operation changes only then (manual 5.9.1).

        STOP leaves the bit set that enables operation, although the axis is off. Shutdown keeps it off. A FEATHER that
        stands in it is for a person to take back.
        """
        word = await self._integer(target, CONTROLWORD)
        if word is None or not word & _ENABLE_OPERATION:
            return
        if word & _FEATHER and has_feather(target):
            raise Broken(Cause.DRIVE_ENABLED, target.slug)
        place = Place(target.slug, CONTROLWORD)
        await self._log.intend(direction, StepKind.AUXILIARY, target.slug, place, SHUTDOWN)
        try:
            done = await whole(
                write_raw(
                    self.connection.driver(target),
                    target,
                    CONTROLWORD,
                    SHUTDOWN,
                    self._journal,
                    allow=Allow.MOTION,
                    expected=word,
                    known=self._commands.get(target.slug, 0),
                )
            )
        except HubsideError as error:
            self._log.ended(_state_after(error), error)
            self._not_overtaken()
            raise Broken(cause_of(error), target.slug, error) from error
        self._log.ended(StepState.DONE, how=done.how.value)

    def _allow(self, target: Target, address: Address) -> Allow:
        factory = self._expert and target.entry(address).restore is RestoreClass.FACTORY
        return Allow.FACTORY if factory else Allow.NOTHING

    async def _shows(self, target: Target, address: Address, raw: Raw) -> None:
        """Wait until an object shows a value. Raises UnverifiedError and what reading raises."""
        until = self.monotonic() + self.timing.mode_s
        while (found := await read_integer(self.connection, target, address)) != raw:
            if self.monotonic() > until:
                name = target.entry(address).title
                raise UnverifiedError(
                    address=address.short, name=name, sent=str(raw), found=str(found), reason_key="unverified.not_shown"
                )
            await asyncio.sleep(LOOK_S)
        self.now = self.now.with_value(Place(target.slug, address), raw)

    async def check(self, goals: Mapping[Place, Raw]) -> None:
        """Read all values once more: what is about to be saved is what was verified."""
        try:
            for slug, target in self.targets.items():
                wanted = {place.address: raw for place, raw in goals.items() if place.slug == slug}
                report = await read_whole(self.connection.driver(target), target, wanted)
                _compare(Cause.CHANGED, slug, wanted, report.values)
        except HubsideError as error:
            raise Broken(cause_of(error), "", error) from error
        self.look_for_restarts()

    async def save(self, slug: str, direction: Direction, category: Category = None) -> None:
        """1010h, and wait until the device is ready again. From its intent on the memory is in doubt."""
        target = self.targets[slug]
        await self.guard(direction)
        await self._log.intend(direction, StepKind.SAVE, slug, self._entry_of(target, category))
        driver, stamper = self.connection.driver(target), self.connection.stamper
        try:
            took = await whole(save(driver, target, self._journal, stamper, category))
        except HubsideError as error:
            self._log.ended(_state_after(error), error)
            self._not_overtaken()
            cause = cause_of(error)
            raise Broken(cause if not cause.allows_rollback else Cause.SAVE_FAILED, slug, error) from error
        self._log.ended(StepState.DONE, took_s=round(took.took_s, 3))
        await self._answers(target)
        self.look_for_restarts()

    def _entry_of(self, target: Target, category: Category) -> Place | None:
        """The entry that saves a category; None where the device saves all that it has."""
        if not has_categories(target.description):
            return None
        return Place(target.slug, command_of(target.description.save, category).address)

    async def restart(self, slug: str, direction: Direction) -> bool:
        """Restart the device, wait until it says that it is back, and for the first answer.

        False where a person was to switch it off and on and did not: then nothing is proven, and nothing is lost.
        """
        target = self.targets[slug]
        await self._still()
        self.look_for_restarts()
        await self._log.intend(direction, StepKind.RESTART, slug)
        await self._not_feathered(slug)
        before = boots_of(target)
        driver, stamper = self.connection.driver(target), self.connection.stamper
        by_hand = driver.restarts_by_hand
        seconds = self.timing.hand_s if by_hand else self.timing.boot_s
        restarting = restart(driver, target, self._journal, stamper, seconds, sure=lambda: self._sure(direction))
        try:
            took = await (self._by_hand(target, restarting, direction) if by_hand else whole(restarting))
        except Broken:
            self._log.ended(StepState.FAILED)
            raise
        except HubsideError as error:
            self._log.ended(_state_after(error), error)
            raise Broken(cause_of(error), slug, error) from error
        if took is None:
            self._log.ended(StepState.FAILED, by_hand=True)
            await self._answers(target)
            return False
        await self._answers(target)
        known: dict[str, Any] = {"took_s": round(took.took_s, 3)}
        if took.proven is not None:
            known["proven"] = took.proven
        self._log.ended(StepState.DONE, **known)
        self._boots[slug] = max(before + 1, boots_of(target))
        if driver.ends_with_restart:
            bus = target.device.bus  # by the restart that we asked for
            self._reconnects[bus] = self.connection.buses[bus].status.reconnects
        return True

    async def _by_hand(
        self, target: Target, restarting: Coroutine[Any, Any, Took], direction: Direction
    ) -> Took | None:
        """Wait until somebody has switched the device off and on; None where nobody does, or wants to go on without.

        Nothing is sent meanwhile, so that a person may change his mind, and the tool may end, at any moment.
        """
        self.switching = Switching(target.slug, self.monotonic() + self.timing.hand_s)
        task = asyncio.ensure_future(restarting)
        try:
            while not task.done():
                if self.switching.without:
                    return None
                self._sure(direction)
                await asyncio.wait([task], timeout=LOOK_S)
            return task.result()
        except NoAnswerError:
            return None
        finally:
            self.switching = None
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    async def prove(
        self, slug: str, goals: Mapping[Place, Raw], found: Survey, direction: Direction, restarted: bool
    ) -> list[Address]:
        """What was read of the device at the end is what it was to hold.

        Gives what cannot be proven now: a restart opens the safety chain, and the emergency feather command that
        follows puts its own values into some objects.
        """
        await self._log.intend(direction, StepKind.PROVE, slug)
        wanted = {place.address: raw for place, raw in goals.items() if place.slug == slug}
        values, description = found.sets[slug].values, self.targets[slug].description
        hidden = [
            address
            for address, raw in wanted.items()
            if restarted
            and values.get(address) != raw
            and (source := description.entry(address).overwritten_by) is not None
            and values.get(address) == values.get(source)
        ]
        try:
            _compare(Cause.PROOF_FAILED, slug, {a: raw for a, raw in wanted.items() if a not in hidden}, values)
        except Broken as broken:
            self._log.ended(StepState.FAILED, differing=broken.details["differing"])
            raise
        self._log.ended(StepState.DONE, values=len(wanted) - len(hidden))
        return hidden


def _sign_of_life(description: Description) -> Address:
    """What a device is asked for to see whether it answers."""
    for address in (UPTIME, DEVICE_TYPE):
        if address in description.entries:
            return address
    return next(entry.address for entry in description if entry.access.readable)


def _compare(cause: Cause, slug: str, wanted: Mapping[Address, Raw], found: Mapping[Address, Raw]) -> None:
    differing = [address.short for address, raw in wanted.items() if found.get(address) != raw]
    if differing:
        raise Broken(cause, slug, differing=", ".join(differing))


def cause_of(error: HubsideError) -> Cause:
    """Why a restore cannot go on after ``error``."""
    kinds: Iterable[tuple[type[HubsideError], Cause]] = (
        (BusLostError, Cause.BUS_LOST),
        (StoreError, Cause.STORE_FAILED),
        (ConflictError, Cause.CHANGED),
        (OvertakenError, Cause.OVERTAKEN),
        (NoAnswerError, Cause.NO_ANSWER),
        (UnverifiedError, Cause.UNVERIFIED),
    )
    return next((cause for kind, cause in kinds if isinstance(error, kind)), Cause.DEVICE_REFUSED)


def _state_after(error: HubsideError) -> StepState:
    """Whether it is known what became of a step that ended with ``error``."""
    open_ends = (NoAnswerError, UnverifiedError)
    return StepState.UNKNOWN if isinstance(error, open_ends) else StepState.FAILED
