"""The scope of a bench: one for all who look. It is armed for a connection, and what it catches is kept.

Everything here runs in the event loop; only ``Tap.hear`` runs on receive threads.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from app.errors import HubsideError, NotConnectedError, ScopeStateError
from app.model.address import Address
from app.model.description import Bus
from app.model.sets import iso_time
from app.service.connection import Connection
from app.service.journal import Journal, Kind
from app.service.polling import PollPlan
from app.service.scope.capture import Capture, Head, InForce, KeptDevice, KeptMark, KeptSignal, Values
from app.service.scope.captures import Captures
from app.service.scope.engine import SETTLE_NS, Caught, Cause, Ended, Engine, Mark, Phase
from app.service.scope.in_force import Frozen, in_force, who
from app.service.scope.order import Plan, ScopeOrder, plan
from app.service.scope.sampling import Sampling
from app.service.scope.signals import number_of
from app.service.scope.tap import Heard, Tap
from app.service.scope.trigger import Happened, What
from app.store.uuid7 import Uuid7
from app.wire.records import BootUpSeen, EmcySeen, GapSeen, RestartSeen, Source, ValueSeen

log = logging.getLogger(__name__)

TICK_S: Final = 0.05
SHOWN_NS: Final = 10_000_000_000
"""The live view spans so much."""
MAX_CAPTURES: Final = 100
"""Of one arming: then it stops."""
ARRIVAL_S: Final = 0.005
"""How often is looked whether all has come that crossed the wire until now."""
_PDOS: Final = (Source.PDO_TX, Source.PDO_RX)


@dataclass(frozen=True, slots=True)
class AtTrigger:
    """What was known of the devices when a trigger was seen, and the recording that was written."""

    devices: tuple[Frozen, ...]
    recording: str | None


@dataclass
class Run:
    """From arming to the end. ``reason_key``: why it ended by itself, None where it did not."""

    connection: Connection
    order: ScopeOrder
    plan: Plan
    person: str
    engine: Engine
    tap: Tap
    armed_ns: int
    sampling: Sampling | None = None
    ticker: asyncio.Task[None] | None = None
    over: bool = False
    reason_key: str | None = None
    made: list[str] = field(default_factory=list)
    seen: dict[int, AtTrigger] = field(default_factory=dict)
    unreadable: int = 0


class ScopeDesk:
    """``polling`` gives the plan in force, ``twins`` whether all devices are simulated. ``close`` ends it."""

    def __init__(
        self,
        captures: Captures,
        journal: Journal,
        stamper: Callable[[], int],
        polling: Callable[[], PollPlan],
        twins: Callable[[], bool],
    ) -> None:
        self.captures = captures
        self._attached: Connection | None = None
        self.run: Run | None = None
        self.now_ns = stamper
        self._journal = journal
        self._polling = polling
        self._twins = twins
        self._new_id = Uuid7(stamper)
        self._keeping: set[asyncio.Task[None]] = set()
        self._changing = asyncio.Lock()

    # -- orders ------------------------------------------------------------------------

    async def arm(self, connection: Connection, order: ScopeOrder, person: str) -> Run:
        """Begin; what was armed before ends. Raises ScopeSettingsError; then nothing has changed.

        NotConnectedError: ``connection`` is not the one that is served any more.
        """
        planned = plan(order, connection.target, connection.targets)
        async with self._changing:
            if connection is not self._attached:
                raise NotConnectedError
            await self._end(Ended.STOPPED)
            run = self._made(connection, order, planned, person)
            self.run = run
            for link in connection.buses.values():
                link.listen(run.tap.hear)
            run.sampling = Sampling(connection, _addresses(planned, order, connection), self._polling)
            run.ticker = asyncio.create_task(self._tick_forever(run))
            self._journal.by(person).note(Kind.SCOPE_ARMED, None, signals=len(planned.signals))
            return run

    def _made(self, connection: Connection, order: ScopeOrder, planned: Plan, person: str) -> Run:
        armed_ns = self.now_ns()
        buses = [place.bus for place in planned.sources]
        engine = Engine(planned.channels, planned.trigger, planned.timing, armed_ns, buses, SHOWN_NS)
        run: Run

        def take(heard: Sequence[Heard]) -> None:
            self._take(run, heard)

        tap = Tap(planned.sources, asyncio.get_running_loop(), take)
        run = Run(connection, order, planned, person, engine, tap, armed_ns)
        return run

    def trigger_now(self) -> None:
        """Begin a capture by hand. Raises ScopeStateError."""
        run = self.run
        if run is None or run.over or not run.engine.trigger_now(self.now_ns()):
            raise ScopeStateError(state_key="scope.state.not_waiting")
        self._freeze(run)

    async def stop(self) -> None:
        """End it; what was under way is kept as far as it came. Nothing happens where nothing is armed."""
        async with self._changing:
            await self._end(Ended.STOPPED)

    def attach(self, connection: Connection) -> None:
        """From now on ``connection`` is served: for it alone the scope can be armed."""
        self._attached = connection

    async def detach(self) -> None:
        """The connection ends; who arms for it from now on is refused."""
        async with self._changing:
            self._attached = None
            run = self.run
            if run is not None and not run.over:
                run.reason_key = "scope.over.link"
                await self._end(Ended.LINK)

    async def close(self) -> None:
        """End it, and have everything kept."""
        await self.detach()
        await asyncio.gather(*self._keeping, return_exceptions=True)

    # -- what comes ------------------------------------------------------------------------

    def _take(self, run: Run, heard: Sequence[Heard]) -> None:
        if run.over:
            return
        engine, sources, types = run.engine, run.plan.sources, run.plan.types
        unasked = {bus for bus, link in run.connection.buses.items() if link.kind is Bus.CANOPEN}
        for one in heard:
            if type(one) is ValueSeen:
                source = sources[(one.bus, one.node, one.address)]  # type: ignore[index]  # equal to a Place
                raw = number_of(types[source], one.data)
                if raw is None:
                    run.unreadable += 1
                else:
                    engine.value(source, one.t_ns, raw, one.source in _PDOS and one.bus in unasked)
            elif isinstance(one, GapSeen):
                engine.gap(one.t_ns, one.bus, one.reason)
            else:
                engine.happened(_happened(one))
        self._freeze(run)

    def _freeze(self, run: Run) -> None:
        """What is known of the devices when a trigger was seen, once for each."""
        window = run.engine.window
        if window is not None and window.number not in run.seen:
            concerned = _concerned(run.plan, run.order)
            targets = [one for one in run.connection.targets if one.slug in concerned]
            recording = None if run.connection.recording is None else run.connection.recording.status().file
            run.seen[window.number] = AtTrigger(
                tuple(Frozen.of(target) for target in targets), None if recording is None else recording.name
            )

    async def _tick_forever(self, run: Run) -> None:
        while not run.over:
            self._keep_all(run, run.engine.advance(run.tap.settled_ns(self.now_ns(), SETTLE_NS)))
            self._freeze(run)  # a capture of AUTO may have begun
            if run.tap.failed:
                await run.tap.drain()
                self._break_off(run)
            elif len(run.made) >= MAX_CAPTURES:
                run.reason_key = "scope.over.full"
                self._release(run)
            elif run.engine.phase is Phase.DONE:
                self._release(run)
            await asyncio.sleep(TICK_S)

    async def _end(self, why: Ended) -> None:
        run = self.run
        if run is None:
            return
        if not run.over:
            stop_ns = self.now_ns()
            try:
                if run.engine.window is not None:
                    await self._let_in(run, stop_ns)
                if not run.over:  # it may have come to its end meanwhile
                    self._keep_all(run, run.engine.stop(stop_ns, why))
            finally:
                if not run.over:
                    self._release(run)
        if run.ticker is not None:
            run.ticker.cancel()
            await asyncio.gather(run.ticker, return_exceptions=True)
        if run.sampling is not None:
            await run.sampling.close()
            run.sampling = None

    async def _let_in(self, run: Run, until_ns: int) -> None:
        """Take what crossed the wire until then and is still on its way through our threads."""
        tap = run.tap
        while tap.settled_ns(now_ns := self.now_ns(), 0) < until_ns and now_ns < until_ns + SETTLE_NS:  # noqa: ASYNC110  the receive thread has no event for it
            await asyncio.sleep(ARRIVAL_S)
        self._unlisten(run)
        await tap.drain()

    def _break_off(self, run: Run) -> None:
        """A defect of ours ended the listening: what came is kept, and says from where on something is missing."""
        now_ns = self.now_ns()
        for bus in run.connection.buses:
            run.engine.gap(run.tap.heard_ns.get(bus, now_ns) + 1, bus, "scope.gap.defect")
        run.reason_key = "scope.over.defect"
        self._keep_all(run, run.engine.stop(now_ns))
        self._release(run)

    def _unlisten(self, run: Run) -> None:
        for link in run.connection.buses.values():
            link.unlisten(run.tap.hear)

    def _release(self, run: Run) -> None:
        """Listen and read no more."""
        run.over = True
        run.tap.closed = True
        self._unlisten(run)
        if run.sampling is not None:
            run.sampling.halt()

    # -- keeping -----------------------------------------------------------------------------

    def _keep_all(self, run: Run, caught: Sequence[Caught]) -> None:
        for one in caught:
            seen = run.seen.pop(one.window.number, AtTrigger((), None))
            head = self._head(run, one, seen)
            if one.window.cause is not Cause.AUTO:
                run.made.append(head.id)
            task = asyncio.create_task(self._keep(run, Capture(head, _values(one)), seen.devices))
            self._keeping.add(task)
            task.add_done_callback(self._keeping.discard)

    async def _keep(self, run: Run, capture: Capture, frozen: Sequence[Frozen]) -> None:
        rows, devices = await asyncio.to_thread(_looked_up, frozen)
        capture = replace(capture, head=replace(capture.head, devices=devices))
        if capture.head.cause == Cause.AUTO.value:
            self.captures.show(capture, rows)
            return
        try:
            head = await self.captures.keep(capture, rows)
        except HubsideError as error:
            log.warning("a capture could not be kept: %s", error)
            self.captures.show(capture, rows)
            run.reason_key = "scope.over.store"
            return
        self._journal.by(run.person).note(Kind.SCOPE_CAPTURED, None, capture=head.name, values=_count(head))

    def _head(self, run: Run, caught: Caught, seen: AtTrigger) -> Head:
        window, connection = caught.window, run.connection
        slugs = {(one.device.bus, one.node): one.slug for one in connection.targets}
        return Head(
            id=self._new_id(),
            name=iso_time(window.trigger_ns)[:19].replace("T", " "),
            note="",
            person=run.person,
            turbine=connection.turbine.slug,
            turbine_name=connection.turbine.name,
            cause=window.cause.value,
            ended=window.ended.value,
            trigger_ns=window.trigger_ns,
            start_ns=window.start_ns,
            end_ns=window.end_ns,
            known_ns=window.known_ns,
            made_ns=self.now_ns(),
            order=run.order,
            signals=tuple(
                KeptSignal(
                    name=one.name,
                    device=one.device,
                    bus=one.place.bus,
                    title=one.title,
                    bit=one.bit,
                    bit_key=one.bit_key,
                    unit=one.unit,
                    scale=str(one.scale),
                    count=len(stretch.t_ns),
                    by_pdo=stretch.by_pdo,
                )
                for one, stretch in zip(run.plan.signals, caught.stretches, strict=True)
            ),
            marks=tuple(_mark(one, slugs) for one in caught.marks),
            devices=(),
            recording=seen.recording,
            twin=self._twins(),
            size_bytes=0,
        )


def _looked_up(frozen: Sequence[Frozen]) -> tuple[list[InForce], tuple[KeptDevice, ...]]:
    return in_force(frozen), tuple(who(one) for one in frozen)


def _happened(one: Heard) -> Happened:
    if isinstance(one, EmcySeen):
        return Happened(one.t_ns, What.EMCY, one.bus, one.node, code=one.code)
    if isinstance(one, BootUpSeen | RestartSeen):
        return Happened(one.t_ns, What.BOOT_UP, one.bus, one.node)
    return Happened(one.t_ns, What.NMT, one.bus, one.node, state=getattr(one, "state", None))


def _mark(mark: Mark, slugs: dict[tuple[str, int], str]) -> KeptMark:
    return KeptMark(mark.t_ns, mark.what, mark.bus, slugs.get((mark.bus, mark.node)), mark.detail)


def _values(caught: Caught) -> tuple[Values, ...]:
    return tuple(Values(one.t_ns, one.raw) for one in caught.stretches)


def _count(head: Head) -> int:
    return sum(one.count for one in head.signals)


def _concerned(planned: Plan, order: ScopeOrder) -> set[str]:
    """The devices whose values are kept with a capture."""
    by_trigger = order.trigger.device
    return {one.device for one in planned.signals} | (set() if by_trigger is None else {by_trigger})


def _addresses(planned: Plan, order: ScopeOrder, connection: Connection) -> dict[str, list[Address]]:
    """What is shown of each device concerned, and what triggers where devices send nothing unasked."""
    found: dict[str, list[Address]] = {slug: [] for slug in sorted(_concerned(planned, order))}
    shown = [(one.device, one.place) for one in planned.signals]
    asked = [
        (target.slug, place)
        for target in connection.targets
        for place in planned.sources
        if connection.buses[place.bus].kind is not Bus.CANOPEN and place[:2] == (target.device.bus, target.node)
    ]
    for device, place in (*shown, *asked):
        own = found.setdefault(device, [])
        if place.address not in own:
            own.append(place.address)
    return found
