"""The instructor: faults and scenarios for twins that this server has started, and who ordered them.

The twins run in a process of their own. ``Instructor`` is how they are told; ``InstructorDesk`` is what people work at:
it checks, notes in the journal who did what, and keeps looking, so that every page shows the same faults, whoever
ordered them.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

from app.errors import FaultOrderError, FaultValueError, HubsideError, TwinsGoneError, UsageError
from app.model.fault import CATALOGUE, ActiveFault, FaultKind, FaultOrder, FaultParameter, FaultTarget, check_order
from app.service.journal import Journal, Kind

log = logging.getLogger(__name__)

LOOK_S: Final = 1.0
"""How soon a fault is seen that ended of itself, or that somebody else has ordered."""
_OWN_TIME: Final = ("duration_s", "off_s")


@dataclass(frozen=True, slots=True)
class ScenarioRef:
    """A scenario that can be played. ``note`` says what it shows and what to watch; it may be empty."""

    name: str
    title: str
    duration_s: float
    seed: int
    note: str = ""


@dataclass(frozen=True, slots=True)
class Playing:
    """The scenario that plays, and how far it is."""

    scenario: str
    title: str
    elapsed_s: float
    duration_s: float


@dataclass(frozen=True, slots=True)
class Situation:
    """What acts in the twins at ``now_ns`` (line time)."""

    now_ns: int
    faults: tuple[ActiveFault, ...] = ()
    playing: Playing | None = None


class Instructor(Protocol):
    """How running twins are told. Every call raises TwinsGoneError where they do not answer."""

    @property
    def address(self) -> str:
        """The connection by which their bus is reached: ``socketcand:HOST:PORT``."""

    async def catalogue(self) -> Sequence[FaultKind]:
        """All kinds of fault that they know."""

    async def situation(self) -> Situation:
        """What acts now."""

    async def inject(self, order: FaultOrder) -> ActiveFault:
        """Put a fault in. Raises UsageError that names the field."""

    async def clear(self, fault: int) -> None:
        """Take a fault out. Raises UsageError where there is no such fault."""

    async def clear_all(self) -> None:
        """Take all faults out."""

    async def scenarios(self) -> Sequence[ScenarioRef]:
        """All scenarios that they can play."""

    async def play(self, scenario: str) -> None:
        """Begin a scenario; one that plays ends. Raises UsageError where there is no such scenario."""

    async def stop(self) -> None:
        """End the scenario that plays."""

    async def close(self) -> None:
        """End the connection to the twins; they go on."""


@dataclass(frozen=True, slots=True)
class InjectedLine:
    """A fault that acts. ``since_ns`` is in t_ns of the bench; ``until_ns`` None: until it is cleared."""

    id: int
    kind: str
    blade: int | None
    node: int | None
    values: Mapping[str, float]
    seconds: float | None
    since_ns: int
    until_ns: int | None


@dataclass(frozen=True, slots=True)
class PlayingLine:
    """The scenario that plays. Times are in t_ns of the bench."""

    scenario: str
    title: str
    since_ns: int
    until_ns: int


@dataclass(frozen=True, slots=True)
class InstructorLine:
    """What a page shows. ``available``: the twins are ours; ``answering``: they answered at the last look."""

    available: bool
    answering: bool
    faults: tuple[InjectedLine, ...]
    playing: PlayingLine | None


NOT_HERE: Final = InstructorLine(available=False, answering=False, faults=(), playing=None)


class InstructorDesk:
    """Use cases on running twins. For one event loop.

    ``stamp`` gives t_ns; ``slug_of`` the device at a node of theirs, as far as that is known.
    """

    def __init__(
        self,
        instructor: Instructor,
        journal: Journal,
        stamp: Callable[[], int],
        slug_of: Callable[[int], str | None] = lambda _node: None,
    ) -> None:
        self.line = replace(NOT_HERE, available=True)
        self._instructor = instructor
        self._journal = journal
        self._stamp = stamp
        self._slug_of = slug_of
        self._working = asyncio.Lock()

    def serves(self, connections: Iterable[str]) -> bool:
        """Whether all these connections lead to our twins: nothing real is among them."""
        return all(connection.partition("@")[0] == self._instructor.address for connection in connections)

    # -- what people do ------------------------------------------------------------

    async def catalogue(self) -> Sequence[FaultKind]:
        """All kinds of fault. Raises TwinsGoneError."""
        return await self._instructor.catalogue()

    async def scenarios(self) -> Sequence[ScenarioRef]:
        """All scenarios. Raises TwinsGoneError."""
        return await self._instructor.scenarios()

    async def inject(self, order: FaultOrder, person: str) -> InjectedLine:
        """Put a fault in. Raises FaultOrderError, FaultValueError, TwinsGoneError."""
        checked = await self._checked(order)
        async with self._working:
            await self._look()
            try:
                fault = await self._instructor.inject(checked)
            except UsageError as error:
                raise _refusal(error) from error
            self._note(Kind.FAULT_SET, fault.order, person)
            now_ns = self._stamp()
            line = _fault_line(fault, fault.since_ns, now_ns)
            self._show(faults=(*self.line.faults, line))
            await self._look()
            return line

    async def clear(self, fault: int, person: str) -> None:
        """Take a fault out; nothing happens where it has ended already. Raises TwinsGoneError."""
        async with self._working:
            await self._look()
            line = next((one for one in self.line.faults if one.id == fault), None)
            if line is None:
                return
            await self._instructor.clear(fault)
            self._cleared([line], person)
            await self._look()

    async def clear_all(self, person: str) -> None:
        """Take all faults out. Raises TwinsGoneError."""
        async with self._working:
            await self._look()
            await self._instructor.clear_all()
            self._cleared(self.line.faults, person)
            await self._look()

    async def play(self, scenario: str, person: str) -> InstructorLine:
        """Begin a scenario; the one that plays is stopped. Raises FaultOrderError, TwinsGoneError."""
        async with self._working:
            await self._look()
            if scenario not in {one.name for one in await self._instructor.scenarios()}:
                raise FaultOrderError(field="scenario", reason=f"there is no scenario '{scenario}'")
            await self._end_playing(person)
            await self._instructor.play(scenario)
            await self._look(by=person)
            return self.line

    async def stop(self, person: str) -> InstructorLine:
        """Stop the scenario that plays, if one does. Raises TwinsGoneError."""
        async with self._working:
            await self._look()
            await self._end_playing(person)
            await self._look()
            return self.line

    async def refresh(self) -> InstructorLine:
        """What acts now. Raises TwinsGoneError."""
        async with self._working:
            await self._look()
            return self.line

    async def watch(self) -> None:
        """Keep looking, for ever. Ends by being cancelled."""
        while True:
            try:
                await self.refresh()
            except TwinsGoneError as error:
                log.debug("the twins do not answer: %s", error)
            await asyncio.sleep(LOOK_S)

    async def close(self) -> None:
        """End the connection to the twins at the end of the server."""
        await self._instructor.close()

    # -- inside ----------------------------------------------------------------------

    async def _checked(self, order: FaultOrder) -> FaultOrder:
        try:
            return check_order(order)
        except UsageError as error:
            kinds = await self._instructor.catalogue()
            parameters = next((kind.parameters for kind in kinds if kind.id == order.kind), ())
            raise _refusal(error, order, parameters) from error

    async def _end_playing(self, person: str) -> None:
        playing = self.line.playing
        if playing is None:
            return
        await self._instructor.stop()
        self._show(playing=None)
        self._journal.by(person).note(Kind.SCENARIO_STOPPED, title=playing.title, scenario=playing.scenario)

    def _cleared(self, faults: Sequence[InjectedLine], person: str) -> None:
        for line in faults:
            self._note(Kind.FAULT_CLEARED, line, person)
        gone = {line.id for line in faults}
        self._show(faults=tuple(one for one in self.line.faults if one.id not in gone))

    async def _look(self, by: str | None = None) -> None:
        """See what acts; what came or went without us is noted. A scenario that is new was begun by ``by``."""
        try:
            now = await self._instructor.situation()
        except TwinsGoneError:
            self._show(answering=False)
            raise
        now_ns = self._stamp()
        before = {line.id: line for line in self.line.faults}
        lines = tuple(before.get(one.id) or _fault_line(one, now.now_ns, now_ns) for one in now.faults)
        for line in lines:
            if line.id not in before:
                self._note(Kind.FAULT_SEEN, line)
        there = {line.id for line in lines}
        for line in before.values():
            if line.id not in there:
                self._note(Kind.FAULT_ENDED, line)
        self._show(answering=True, faults=lines, playing=self._playing(now.playing, now_ns, by))

    def _playing(self, found: Playing | None, now_ns: int, by: str | None) -> PlayingLine | None:
        before = self.line.playing
        same = found is not None and before is not None and before.scenario == found.scenario
        if before is not None and not same:
            self._journal.note(Kind.SCENARIO_ENDED, title=before.title, scenario=before.scenario)
        if found is None or same:
            return before if same else None
        journal = self._journal if by is None else self._journal.by(by)
        journal.note(Kind.SCENARIO_STARTED, title=found.title, scenario=found.scenario)
        since_ns = now_ns - round(found.elapsed_s * 1e9)
        return PlayingLine(found.scenario, found.title, since_ns, since_ns + round(found.duration_s * 1e9))

    def _show(self, **change: Any) -> None:
        line = replace(self.line, **change)
        if line != self.line:
            self.line = line

    def _note(self, kind: Kind, fault: FaultOrder | InjectedLine, person: str | None = None) -> None:
        journal = self._journal if person is None else self._journal.by(person)
        device = None if fault.node is None else self._slug_of(fault.node)
        values = ", ".join(f"{name}={number:g}" for name, number in fault.values.items())
        timed = {} if fault.seconds is None else {"seconds": fault.seconds}
        journal.note(
            kind, device, fault_key=f"fault.{fault.kind}.name", **_where(fault, device), values=values, **timed
        )


@asynccontextmanager
async def watched(desk: InstructorDesk | None) -> AsyncIterator[None]:
    """While the block runs, ``desk`` keeps looking; nothing where there is none."""
    if desk is None:
        yield
        return
    task = asyncio.create_task(desk.watch())
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def _fault_line(fault: ActiveFault, line_now_ns: int, now_ns: int) -> InjectedLine:
    order = fault.order
    since_ns = now_ns - (line_now_ns - fault.since_ns)
    # What ends of itself has its time among its values.
    seconds = next((order.values[name] for name in _OWN_TIME if name in order.values), order.seconds)
    until_ns = None if seconds is None else since_ns + round(seconds * 1e9)
    return InjectedLine(
        fault.id, order.kind, order.blade, order.node, dict(order.values), order.seconds, since_ns, until_ns
    )


def _where(fault: FaultOrder | InjectedLine, device: str | None) -> dict[str, str]:
    """Where a fault acts, as a detail of the journal: a name, or the key of one."""
    if fault.node is not None:
        return {"target": str(fault.node) if device is None else device}
    if fault.blade is not None:
        return {"target_key": f"fault_target.blade_{fault.blade}"}
    kind = CATALOGUE.get(fault.kind)
    return {"target_key": f"fault_target.{'bus' if kind and kind.target is FaultTarget.BUS else 'turbine'}"}


def _refusal(error: UsageError, order: FaultOrder | None = None, known: Sequence[FaultParameter] = ()) -> HubsideError:
    """What is wrong with an order, with the limits where it is one of its values."""
    field = str(error.details.get("field", ""))
    parameter = next((one for one in known if one.name == field), None)
    given = None if order is None else order.values.get(field)
    if parameter is None or given is None or parameter.low <= given <= parameter.high:
        return FaultOrderError(field=field, reason=error.details.get("reason", ""))
    return FaultValueError(
        field=field,
        value=given,
        limits=f"{parameter.low:g} … {parameter.high:g} {parameter.unit}".strip(),
        minimum=parameter.low,
        maximum=parameter.high,
        unit=parameter.unit,
    )
