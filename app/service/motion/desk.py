"""The desk from which the axes of one connection are moved: lease, dead man, preparation and the motion under way.

One axis moves at a time, and only while its person holds it: let go, and it halts by its ramp; silent, and it stops by
its quick stop. Then it has no power, and its brake is engaged. Whatever raises, hangs or is cancelled here, the drive
misses our heartbeat and stops by itself. STOP and FEATHER never come through here; they end what is under way.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from time import monotonic
from typing import Final

from app.drivers.contract import LinkState
from app.errors import (
    BusLostError,
    HubsideError,
    InterlockError,
    LeaseHeldError,
    NoAnswerError,
    NotConnectedError,
    NotHeldError,
    NotPreparedError,
    OldOrderError,
    PdoBusyError,
    UsageError,
)
from app.model.address import Address
from app.service.connection import Connection
from app.service.devices import Target
from app.service.journal import Journal, Kind
from app.service.motion import interlocks, preparation
from app.service.motion.commanding import Commanding
from app.service.motion.controls import control_class
from app.service.motion.dead_man import SILENCE_S, DeadMan
from app.service.motion.halting import Halting
from app.service.motion.heartbeat import Heartbeat, NoHeartbeat
from app.service.motion.interlocks import Confirmed, Interlock, Standing
from app.service.motion.lease import Holder, Lease
from app.service.motion.left import Left
from app.service.motion.preparation import Prepared
from app.service.motion.running import STOPPING, Doing, Ended, Last, Running
from app.service.stop import is_axis, machine_of
from app.wire.sdo_follower import SAVE_INDEX

UNKNOWN: Final = "–"
log = logging.getLogger(__name__)

TICK_S: Final = 0.02
CLOSE_S: Final = 8.0
LOOK_AGAIN_S: Final = 0.5
"""So often it is looked while an axis moves whether an interlock holds it back now."""


_UNHEARD: Final = (BusLostError, NoAnswerError)


class MotionDesk:
    """The desk of ``connection``. It looks after the dead man from the first lease on; ``close`` ends all of it."""

    def __init__(
        self,
        connection: Connection,
        journal: Journal,
        left: Left | None = None,
        now_s: Callable[[], float] = monotonic,
    ) -> None:
        self.connection = connection
        self.left = left or Left()
        self.lease = Lease(now_s, lambda: connection.stamper() // 1000)
        self.dead_man = DeadMan(now_s)
        self.confirmed = Confirmed()
        self.batteries_tested: set[str] = set()
        """Stations whose battery is tested from here, from before its conditions are looked at."""
        self.running: Running | None = None
        self.last: Last | None = None
        self.prepared: dict[str, Prepared] = {}
        self._journal = journal
        self.now_s = now_s
        self.now_ns = connection.stamper
        self._kept_still: str | None = None
        self._order = 0
        self._closed = False
        self._heartbeats = {
            bus.name: Heartbeat(connection.buses[bus.name].driver, bus.heartbeat_node, now_s)
            if connection.buses[bus.name].has_pdos
            else NoHeartbeat(now_s)
            for bus in connection.turbine.buses
        }
        self._halting = Halting(connection, journal, self.dead_man, self._heartbeats, self.prepared)
        self._reconnects: dict[str, int] = {}
        connection.gate.claims.axes = self
        self._ticker: asyncio.Task[None] | None = None
        self._changing = asyncio.Lock()

    # -- what others are kept from --------------------------------------------------------

    def keeper(self, device: str, address: Address | None) -> str | None:
        """See ``service.claims.Axes``. What an earlier server left is not saved either; a restart ends it."""
        changed, saves = self.left.of(device), address is not None and address.major == SAVE_INDEX
        moves = self.running is not None and self.running.slug == device
        prepared = device in self.prepared and (address is None or saves or address in changed)
        if not (moves or prepared or (saves and changed)):
            return None
        return UNKNOWN if self.lease.holder is None else self.lease.holder.person

    def changed(self, device: str) -> Mapping[Address, tuple[bytes, bytes]]:
        """See ``service.claims.Axes``."""
        return self.left.of(device)

    # -- looking after it ---------------------------------------------------------------

    async def close(self) -> None:
        """Stop what moves, put back what was prepared as far as the devices answer, and end."""
        self._closed = True
        self._end_running(Ended.LEASE)
        running = self.running
        if running is not None and running.task is not None:
            await asyncio.wait({running.task}, timeout=3.0)
        with suppress(TimeoutError):
            await asyncio.wait_for(self._put_all_back(), CLOSE_S)
        if self._ticker is not None:
            self._ticker.cancel()
            await asyncio.gather(self._ticker, return_exceptions=True)
        await self._halting.close()

    def _look_after(self) -> None:
        if self._ticker is None or self._ticker.done():
            self._ticker = asyncio.create_task(self._tick_on())
            self._ticker.add_done_callback(_tell_failure)

    async def _tick_on(self) -> None:
        """As long as somebody could move something, or an axis watches our heartbeat."""
        while self.lease.holder is not None or self.running is not None or self.prepared:
            self.tick()
            await asyncio.sleep(TICK_S)

    def tick(self) -> None:
        """One turn: the dead man first, then our heartbeats, then the lease."""
        running = self.running
        if running is not None and running.held and not running.over.is_set():
            if not self.dead_man.present:
                self._halting.stop(running, Ended.SILENT)
            elif not self.dead_man.holds(running.order):
                self._halting.let_go(running)
        for name, heartbeat in self._heartbeats.items():
            if self._is_interrupted(name) and heartbeat.cut():
                self._link_lost(name)
            heartbeat.tick()
        if self.lease.tick(running is not None):
            self._lease_changed()

    def _is_interrupted(self, bus: str) -> bool:
        """The link is down, or was since the last turn."""
        status = self.connection.buses[bus].status
        before = self._reconnects.get(bus, status.reconnects)
        self._reconnects[bus] = status.reconnects
        return status.state is not LinkState.CONNECTED or status.reconnects != before

    def _link_lost(self, bus: str) -> None:
        """The drives on it stop by themselves, for our heartbeat does not come again; each must prove it anew.

        Where they cannot, nobody knows what they do: one that was told to run is stopped once the link is back.
        """
        running = self.running
        if running is not None and running.control.target.device.bus == bus:
            self._halting.lost(running)
        for axis in self.prepared.values():
            if axis.control.target.device.bus == bus:
                axis.void()

    def page_gone(self, page: str) -> None:
        """The socket of a page is closed: who held by it holds nothing any more."""
        holder = self.lease.holder
        running = self.running
        if holder is not None and holder.page == page and running is not None and running.held:
            self._halting.stop(running, Ended.SILENT)

    def beat(
        self, page: str, fence: int, number: int, holding: bool, order: int = 0, sent_s: float | None = None
    ) -> None:
        """A beat of the dead man came from a page; who lets go is heard at once. ``sent_s``: by the page's clock."""
        holder = self.lease.holder
        if holder is None or holder.page != page:
            return
        if not self.dead_man.beat(fence, number, holding, order, sent_s):
            return
        self.lease.heard(page)
        running = self.running
        if (
            running is not None
            and running.held
            and not running.over.is_set()
            and not self.dead_man.holds(running.order)
        ):
            self._halting.let_go(running)

    def _end_running(self, why: Ended) -> None:
        if self.running is not None:
            self._halting.stop(self.running, why)

    # -- lease -----------------------------------------------------------------------------

    def take_lease(self, person: str, page: str) -> Holder:
        """Have the lease, or keep it. Raises LeaseHeldError."""
        before = self.lease.holder
        holder = self.lease.take(person, page)
        if before is None or before.fence != holder.fence:
            self._lease_changed()
        return holder

    def ask_for_lease(self, person: str, page: str) -> None:
        """Ask its holder for it. Raises LeaseHeldError where somebody else asks already."""
        before = self.lease.holder
        self.lease.ask(person, page)
        after = self.lease.holder
        if after is not None and (before is None or before.fence != after.fence):
            self._lease_changed()

    def withdraw_wish(self, page: str) -> None:
        """Whoever asked does not want it any more."""
        self.lease.withdraw(page)

    def answer_wish(self, fence: int, hand_over: bool) -> None:
        """The holder's answer to who asks. Raises LeaseNeededError, LeaseError."""
        before = self.lease.holder
        self.lease.answer(fence, hand_over)
        if before is None or self.lease.holder is None or before.fence != self.lease.holder.fence:
            self._lease_changed()

    def give_back_lease(self, fence: int) -> None:
        """End the lease: what was prepared is put back. Raises LeaseNeededError, LeaseError."""
        self.lease.give_back(fence)
        self._lease_changed()

    def _lease_changed(self) -> None:
        """Another one has it, or nobody: what was held is not any more, and nothing stays prepared or confirmed."""
        self._look_after()
        self._end_running(Ended.LEASE)
        holder = self.lease.holder
        self.confirmed = Confirmed()
        self._order = 0
        self.dead_man.start(0 if holder is None else holder.fence)
        if holder is None:
            self._journal.note(Kind.LEASE_ENDED)
        else:
            self._journal.by(holder.person).note(Kind.LEASE_TAKEN)
        for axis in self.prepared.values():
            axis.void()  # at once: what is being put back must not move meanwhile
        if self.prepared:
            self._halting.chore(self._put_all_back())

    def admit(self, fence: int, order: int) -> None:
        """An order has come; those of a page have rising numbers.

        Raises LeaseNeededError, LeaseError, OldOrderError.
        """
        self.lease.check(fence)
        if order <= self._order:
            raise OldOrderError(order=order, latest=self._order)
        self._order = order

    def confirm(self, fence: int, confirmed: Confirmed) -> None:
        """What the holder has looked at; who takes it back stops what moves.

        Raises LeaseNeededError, LeaseError, UsageError (no such stop is named).
        """
        journal = self._journal.by(self.lease.check(fence).person)
        for slug in sorted(confirmed.external_stops - self.confirmed.external_stops):
            stop = self._axis(slug).device.external_stop
            if not stop:
                raise UsageError(reason=f"{slug}: the site file names no external_stop")
            journal.note(Kind.EXTERNAL_STOP, slug, stop=stop)
        taken_back = self.confirmed.takes_back(confirmed)
        self.confirmed = confirmed
        running = self.running
        if running is not None and running.held and taken_back:
            self._halting.stop(running, Ended.INTERLOCK)

    # -- interlocks and preparation ------------------------------------------------------------

    async def interlocks(self, slug: str) -> list[Standing]:
        """How every interlock of an axis stands. Raises UsageError."""
        target = self._axis(slug)
        heartbeat = self._heartbeats[target.device.bus]
        return await interlocks.look(self.connection, target, heartbeat, self.confirmed, self.batteries_tested)

    async def _watch_interlocks(self, running: Running) -> None:
        """Stop what is held as soon as an interlock bites that did not at its beginning.

        But for the rules: only a write could break one, and nobody writes to an axis that moves.
        """
        while True:
            await asyncio.sleep(LOOK_AGAIN_S)
            try:
                found = await self.interlocks(running.slug)
            except HubsideError as error:
                log.info("%s: interlocks cannot be looked at: %s", running.slug, error.code)
                continue
            if running.over.is_set() or not running.held:
                return
            if any(one.holds_back for one in found if one.interlock is not Interlock.RULES):
                self._halting.stop(running, Ended.INTERLOCK)
                return

    async def require_clear(self, slug: str) -> None:
        """Raises InterlockError for the first interlock that holds the axis back."""
        for standing in await self.interlocks(slug):
            if standing.holds_back:
                raise InterlockError(device=slug, **standing.reason)

    async def prepare(self, slug: str, fence: int) -> Prepared:
        """Set an axis up and have it prove that it stops by itself, where its bus has what it could prove it by.

        Held all the while.

        Raises LeaseError and its like, InterlockError, NotHeldError, and what a write raises. Where it fails, what was
        changed is put back.
        """
        known = self.prepared.get(slug)
        control = self._control(self._axis(slug)) if known is None else known.control

        async def work(running: Running) -> None:
            heartbeat = self._heartbeats[control.target.device.bus]
            axis = Prepared(control)
            try:
                async with self._changing:  # the settings of an earlier lease may just be put back
                    self.prepared[slug] = axis  # another one: who puts the earlier one back finds it gone
                    if heartbeat.watched:
                        await preparation.set_up(axis, heartbeat, self.left, journal)
                    else:
                        await preparation.take_unwatched(axis, heartbeat, self.left)
                if heartbeat.watched:
                    await preparation.prove(axis, heartbeat, lambda: not running.over.is_set())
                    running.held = False  # the axis has no power of ours any more
                    await preparation.after_proof(axis)
            except BaseException:
                await asyncio.shield(self._put_back(axis, journal))
                raise
            if axis.unwatched:
                journal.note(Kind.MOTION_UNWATCHED, slug)
            else:
                journal.note(Kind.MOTION_PREPARED, slug, proof_ms=axis.proof_ms)

        journal = self._journal.by(self.lease.check(fence).person)
        await self._run(slug, fence, Doing.PREPARING, control, work, held=True)
        return self.prepared[slug]

    async def put_back(self, slug: str, fence: int) -> None:
        """End the preparation of an axis, also one of a server that was killed: its old values stand again.

        Raises LeaseError and its like, InterlockError while it moves, and what a write raises.
        """
        journal = self._journal.by(self.lease.check(fence).person)
        self._require_idle()
        axis = self.prepared.get(slug)
        control = self._control(self._axis(slug)) if axis is None else axis.control
        running = self.running = Running(slug, Doing.PUTTING_BACK, control, held=False)
        try:
            if axis is not None:
                await self._put_back(axis, journal)
            elif interlocks.others_at_work(self.connection, control.target):
                await self.left.forget_mode(slug)  # who has the node since then needs both as they are
                await preparation.put_back(control, self.left, journal)
                await self.left.forget_nmt(slug)
            else:
                await preparation.put_back(control, self.left, journal)
                await preparation.give_nmt_back(control, self.left, journal)
        finally:
            if self.running is running:
                self.running = None

    async def _put_back(self, axis: Prepared, journal: Journal) -> None:
        heartbeat = self._heartbeats[axis.control.target.device.bus]
        axis.void()  # before anything is written: it must not move any more
        async with self._changing:
            if self.prepared.get(axis.slug) is not axis:
                return
            # By a control of its own: a STOP that an order which waits for this would see stays one for it.
            await preparation.put_back(self._control(axis.control.target), self.left, journal)
            heartbeat.forget(axis.slug)
            await preparation.give_nmt_back(axis.control, self.left, journal)
            self.prepared.pop(axis.slug, None)
        journal.note(Kind.MOTION_PUT_BACK, axis.slug)

    async def _put_all_back(self) -> None:
        running = self.running
        if running is not None and running.task is not None:
            await asyncio.wait({running.task}, timeout=3.0)
        for axis in list(self.prepared.values()):
            try:
                await self._put_back(axis, self._journal)
            except HubsideError as error:
                log.warning("%s: what was prepared is not put back: %s", axis.slug, error.code)
                # Nobody looks after it any more: where it has power, it shall stop.
                self._heartbeats[axis.control.target.device.bus].withhold(axis.slug)

    def require_left(self) -> None:
        """The connection may end. Raises PdoBusyError while a device is kept still: it must not be left half-made."""
        if self._kept_still is not None:
            raise PdoBusyError(device=self._kept_still, reason_key="page.pdo.busy.changing")

    @contextmanager
    def kept_still(self, slug: str, page: str) -> Iterator[None]:
        """Nothing is begun at any axis meanwhile: what commands go by is changed in the device ``slug``.

        STOP and FEATHER go as ever. Raises LeaseHeldError where another page than ``page`` has the lease, PdoBusyError
        where an axis is under way, or the device is prepared or already kept still.
        """
        holder = self.lease.holder
        if holder is not None and holder.page != page:
            raise LeaseHeldError(holder=holder.person)
        if self._kept_still is not None:
            raise PdoBusyError(device=slug, reason_key="page.pdo.busy.changing")
        if self.running is not None:
            raise PdoBusyError(device=slug, reason_key="page.pdo.busy.moving")
        if slug in self.prepared:
            raise PdoBusyError(device=slug, reason_key="page.pdo.busy.prepared")
        self._kept_still = slug
        try:
            yield
        finally:
            self._kept_still = None

    # -- motion ---------------------------------------------------------------------------------

    async def halt(self, slug: str, fence: int) -> None:
        """Halt one axis by its ramp, whoever has it run; what is under way there ends.

        Raises LeaseError and its like, AxisStateError where it is not enabled, and what reading raises.
        """
        self.lease.check(fence)
        running = self.running
        if running is not None and running.slug == slug:
            if running.held and not running.over.is_set():
                self._halting.let_go(running)
            return
        control = self._control(self._axis(slug))
        control.own()
        await self._require_no_feather(control)
        await control.halt()

    async def _require_no_feather(self, control: Commanding) -> None:
        """Raises InterlockError where an EFC is under way: whatever is commanded now would end it."""
        if await control.is_feathering():
            key = "interlock.reason.feathering"
            raise InterlockError(device=control.target.slug, interlock="feathering", reason_key=key)

    async def without_proof(
        self, slug: str, fence: int, doing: Doing, work: Callable[[Running], Awaitable[None]]
    ) -> None:
        """Let ``work`` command an axis that need not be prepared: nothing moves by it. Raises what ``_run`` raises."""
        axis = self.prepared.get(slug)
        control = self._control(self._axis(slug)) if axis is None else axis.control
        await self._run(slug, fence, doing, control, work, held=False)

    async def move(
        self, slug: str, fence: int, doing: Doing, work: Callable[[Running], Awaitable[None]], held: bool = True
    ) -> None:
        """Let ``work`` command a prepared axis. Raises what ``_run`` raises, NotPreparedError."""
        axis = self.prepared.get(slug)
        self.lease.check(fence)
        if axis is None or not axis.may_move:
            raise NotPreparedError(device=slug)

        async def checked(running: Running) -> None:
            await preparation.check(axis)
            if not axis.may_move or self.prepared.get(slug) is not axis:
                raise NotPreparedError(device=slug)
            await work(running)

        await self._run(slug, fence, doing, axis.control, checked, held)

    async def _run(
        self,
        slug: str,
        fence: int,
        doing: Doing,
        control: Commanding,
        work: Callable[[Running], Awaitable[None]],
        held: bool,
    ) -> None:
        """Run what commands an axis to its end.

        Raises LeaseError and its like, InterlockError, NotHeldError, OvertakenError, AxisStateError, and what reading
        and writing raise.
        """
        holder, order = self.lease.check(fence), self._order
        self._require_idle()
        control.own()  # from here on: whoever presses STOP while this waits has pressed it later
        if held and not await self._is_held(order):
            raise NotHeldError(device=slug)
        self._require_idle()
        running = self.running = Running(slug, doing, control, held, order)
        journal = self._journal.by(holder.person)
        error: HubsideError | None = None
        watch: asyncio.Task[None] | None = None
        try:
            await self.require_clear(slug)
            await self._require_no_feather(control)
            self.lease.check(fence)
            if running.over.is_set():
                raise NotHeldError(device=slug)
            journal.note(Kind.MOTION_BEGUN, slug, what=doing.value)
            running.task = asyncio.ensure_future(_as_none(work(running)))
            if held:
                watch = asyncio.create_task(self._watch_interlocks(running))
            await asyncio.shield(running.task)
            running.end(Ended.DONE)
        except BaseException as failed:  # whatever it is: nobody looks after the axis any more
            error = failed if isinstance(failed, HubsideError) else None
            if running.why not in STOPPING:
                if isinstance(failed, _UNHEARD) and not self._heartbeats[control.target.device.bus].watched:
                    self._halting.lost(running)  # a connection whose end nobody tells looks like this
                else:
                    self._halting.stop(running, Ended.FAILED)
            running.end(Ended.FAILED)
            raise
        finally:
            if watch is not None:
                watch.cancel()
            if running.task is not None and not running.task.done():
                running.task.cancel()  # whoever waited for it is gone
            self.running = None
            self.dead_man.release()
            why = running.why or Ended.FAILED
            self.last = Last(slug, doing, why, error)
            journal.note(Kind.MOTION_ENDED, slug, what=doing.value, reason=why.value)

    def _require_idle(self) -> None:
        if self._closed:
            raise NotConnectedError
        if self.running is not None:
            raise InterlockError(
                device=self.running.slug,
                interlock="running",
                reason_key="interlock.reason.running",
                doing_key=f"motion.doing.{self.running.doing.value}",
            )
        if self._kept_still is not None:
            key = "interlock.reason.pdo_change"
            raise InterlockError(device=self._kept_still, interlock="running", reason_key=key)

    async def _is_held(self, order: int) -> bool:
        """Whether it is held. An order may be ahead of the beat that was sent before it, on another connection."""
        end_s = self.now_s() + SILENCE_S
        while not self.dead_man.holds(order) and self.now_s() < end_s:  # noqa: ASYNC110  the socket has no event for it
            await asyncio.sleep(TICK_S)
        return self.dead_man.holds(order)

    def _axis(self, slug: str) -> Target:
        target = self.connection.target(slug)
        if not is_axis(target):
            raise UsageError(reason=f"{slug} is no axis")
        return target

    def _control(self, target: Target) -> Commanding:
        link = self.connection.buses[target.device.bus]
        machine = machine_of(target)
        return control_class(machine)(
            link.driver,
            target.past_claims(),
            (lambda data: link.send_pdo(target.node, machine.controlword, data)) if link.has_pdos else None,
            lambda mode: self.left.note_mode_set(target.slug, mode),
        )


def _tell_failure(ticker: asyncio.Task[None]) -> None:
    """Nobody looks after the dead man any more; our heartbeat has ended with it, so every drive stops by itself."""
    if not ticker.cancelled() and (error := ticker.exception()) is not None:
        log.error("the desk has failed", exc_info=error)


async def _as_none(work: Awaitable[None]) -> None:
    await work
