"""One restore on its way: forward to the new values, back to the old ones, or on after an interruption.

All three are the same: read the station, plan from what is there to the goal, carry the plan out, prove it. What
differs is the goal, what is saved, and what happens where it fails. The package's docstring has the states.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from app.errors import HubsideError
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.restore.plan import Plan, Step, StepKind
from app.model.restore.planner import make_plan
from app.model.restore.wanted import PlanOptions, Wanted
from app.model.saving import Category
from app.model.sets import Identity
from app.model.station import Place
from app.service.journal import Kind
from app.service.restore import precheck
from app.service.restore.commands import Counts, commands_of
from app.service.restore.log import RestoreLog, error_document
from app.service.restore.order import Broken, Cause
from app.service.restore.steps import LOOK_S, Hands, cause_of
from app.service.restore.survey import Survey, survey
from app.store.restore_rows import Direction, RestoreState

log = logging.getLogger(__name__)


class End(Enum):
    """What stands in the devices at the end."""

    NEW = "new"
    OLD = "old"
    INCOMPLETE = "incomplete"


@dataclass(frozen=True, slots=True)
class Terms:
    """What was agreed at the beginning. ``modes``: of operation, by slug, as they were; ``saves``: devices to save.

    ``categories``: what is saved of them, by slug, all where it is not named. ``network``: their addresses go along.
    ``identities``: of the devices when it began; ``nameplates`` as they are known now, by slug. ``others_confirmed``:
    an expert has answered for the other blades.
    """

    goals: Mapping[Place, tuple[Raw, Raw]]
    modes: Mapping[str, int]
    saves: frozenset[str]
    restart: bool
    expert: bool
    station: str
    person: str
    reason: str
    identities: Mapping[str, Identity] = field(default_factory=dict)
    nameplates: Mapping[str, str | None] = field(default_factory=dict)
    others_confirmed: bool = False
    categories: Mapping[str, tuple[Category, ...]] = field(default_factory=dict)
    network: bool = False

    def wanted(self, direction: Direction) -> dict[Place, Raw]:
        """The values that a way leads to."""
        at = 0 if direction is Direction.BACK else 1
        return {place: pair[at] for place, pair in self.goals.items()}


class Transaction:
    """A restore that is worked on. One of ``forward``, ``resume`` and ``back`` is run, once.

    ``found`` is what was read last, complete at the end; ``left_s`` is how long the person has to confirm.
    """

    def __init__(self, hands: Hands, store_log: RestoreLog, terms: Terms, found: Survey | None = None) -> None:
        self.found = found
        self.done = self.total = 0
        self.broken: Broken | None = None
        self._hands = hands
        self._log = store_log
        self._terms = terms
        self._decided = asyncio.Event()
        self._confirmed_by: str | None = None
        self._back_by: str | None = None
        self._back_commands: Counts | None = None
        self._deadline: float | None = None
        self._returning = False
        self._restarted: set[str] = set()
        """Devices that have restarted on the way that is gone now."""
        self._ordered = False
        """A person has taken it up after an interruption: whether the station is fit is not known."""

    # -- for people ------------------------------------------------------------------

    @property
    def descriptions(self) -> Mapping[str, Description]:
        """Those of its devices, by slug."""
        return {slug: target.description for slug, target in self._hands.targets.items()}

    @property
    def state(self) -> RestoreState:
        """How it stands."""
        return self._log.state

    @property
    def goes_on(self) -> bool:
        """False once it has come to an end, which is only kept now."""
        return not self._log.state.ended and self._log.state is not RestoreState.INCOMPLETE

    @property
    def left_s(self) -> float | None:
        """Seconds until all is rolled back for want of a confirmation; None where none is awaited."""
        if self._deadline is None or self._log.state is not RestoreState.AWAITING_CONFIRMATION:
            return None
        return max(0.0, self._deadline - self._hands.monotonic())

    def confirm(self, person: str) -> bool:
        """A person agrees to what stands in RAM. False where nothing awaits it, or too late."""
        if not self.left_s or self._decided.is_set():
            return False
        self._confirmed_by = person
        self._hands.decided()
        self._decided.set()
        return True

    @property
    def switching(self) -> str | None:
        """The device that somebody is to switch off and on now; None where none is."""
        waiting = self._hands.switching
        return None if waiting is None else waiting.slug

    @property
    def switch_left_s(self) -> float | None:
        """Seconds until it goes on without that; None where it is not awaited."""
        waiting = self._hands.switching
        return None if waiting is None else max(0.0, waiting.until_s - self._hands.monotonic())

    def go_on_unproven(self) -> bool:
        """Nobody switches the device off and on: what was saved stays not proven. False where that is not awaited."""
        waiting = self._hands.switching
        if waiting is None:
            return False
        waiting.without = True
        return True

    def turn_back(self, person: str) -> None:
        """A person wants the old values: after the step that runs now, knowing what was commanded until now."""
        self._back_commands = commands_of(self._hands.connection)
        self._hands.turned_back = True
        self._back_by = person
        self._decided.set()

    # -- the three ways ----------------------------------------------------------------

    async def forward(self, plan: Plan, confirm_s: float | None) -> End:
        """From a plan that a person has agreed to; what fails is rolled back at once."""
        assert self.found is not None  # the plan was made of it
        self._hands.take(self.found)
        return await self._guarded(self._go(plan.steps, Direction.FORWARD, confirm_s), falls_back=True)

    async def resume(self) -> End:
        """On to the new values from whatever is there. What fails leaves it incomplete: a person decides again."""
        self._ordered = True
        self._tell(Kind.RESTORE_RESUMED)
        return await self._guarded(self._go_on(), falls_back=False)

    async def back(self) -> End:
        """To the old values from whatever is there, as a person orders it now."""
        self._ordered = True
        self._tell(Kind.RESTORE_TURNED_BACK)
        return await self._guarded(self._go_back(), falls_back=False)

    async def _guarded(self, way: Awaitable[End], falls_back: bool) -> End:
        """Whatever happens, the state that is kept in the end tells the truth."""
        try:
            return await way
        except Broken as broken:
            self.broken = self.broken or broken
            overtaken = broken.cause is Cause.OVERTAKEN and self._back_by is not None and not self._returning
            wanted_back = broken.cause is Cause.CANCELLED or overtaken
            if not (falls_back or wanted_back) or not (broken.cause.allows_rollback or overtaken):
                return await self._incomplete(broken)
        except asyncio.CancelledError:
            await asyncio.shield(self._incomplete(Broken(Cause.TOOL_ENDED)))
            raise
        except Exception as error:
            log.exception("a restore failed by a defect")
            return await self._incomplete(Broken(Cause.DEFECT, "", HubsideError(reason=repr(error))))
        return await self._guarded(self._go_back(), falls_back=False)

    async def _incomplete(self, broken: Broken) -> End:
        self.broken = self.broken or broken
        outcome = _outcome_of(broken)
        if self.broken is not broken:
            outcome["first_cause"] = self.broken.cause.value
        self._tell(Kind.RESTORE_INCOMPLETE, "", cause_key=broken.cause.text_key)
        try:
            await self._log.enter(RestoreState.INCOMPLETE, **outcome)
        except Broken:
            log.exception("the store cannot be written: the restore stays open")
            self._log.state = RestoreState.INCOMPLETE
        return End.INCOMPLETE

    async def _go_on(self) -> End:
        await self._log.enter(
            RestoreState.WRITING, cause=None, cause_details=None, error=None, device=None, first_cause=None
        )
        options = self._options(self._terms.saves, self._terms.categories)
        plan = await self._plan(Direction.RESUME, options)
        return await self._go(self._all_steps(plan, Direction.RESUME), Direction.RESUME, None)

    async def _go_back(self) -> End:
        known = {} if self.broken is None else _outcome_of(self.broken)
        self._returning = True
        if self._back_by is not None:
            self._hands.decided(self._back_commands)
            self._tell(Kind.RESTORE_TURNED_BACK, self._back_by)
        await self._log.enter(RestoreState.ROLLING_BACK, **known)
        options = self._options(frozenset(self._log.saves_begun), self._categories_begun())
        plan = await self._plan(Direction.BACK, options)
        return await self._go(self._all_steps(plan, Direction.BACK), Direction.BACK, None)

    async def _plan(self, direction: Direction, options: PlanOptions) -> Plan:
        """Read the station and plan, once every device answers and no axis is driven."""
        await self._hands.ready()
        await self._hands.quiet()
        found = await self._read()
        self._check_devices(found)
        if self._ordered:
            await self._check_fit(found, direction)
        self._hands.take(found)
        return make_plan(found.station, _by_device(self._terms.wanted(direction)), options, found.states)

    def _check_devices(self, found: Survey) -> None:
        """The devices are those that the restore began with."""
        for slug, then in self._terms.identities.items():
            now = found.sets[slug].identity
            if precheck.is_other_device(then, now, self._terms.nameplates.get(slug)):
                raise Broken(Cause.OTHER_DEVICE, slug)
            if precheck.is_other_firmware(then, now):
                raise Broken(Cause.OTHER_FIRMWARE, slug, was=str(then.software), now=str(now.software))

    async def _check_fit(self, found: Survey, direction: Direction) -> None:
        """What held when it began must hold again; the way back needs less of it."""
        connection = self._hands.connection
        if direction is Direction.BACK:
            refusals = list(precheck.objections_to_going_back(connection, found))
        else:
            refusals = list(precheck.objections_to_going_on(connection, found))
            if not self._terms.others_confirmed:
                refusals += await precheck.objections_to_other_blades(connection, self._terms.station)
        broken = Broken.by(refusals)
        if broken is not None:
            raise broken

    def _categories_begun(self) -> dict[str, tuple[Category, ...]]:
        """What of each device its memory may hold otherwise than before."""
        found: dict[str, tuple[Category, ...]] = {}
        for slug, description in self.descriptions.items():
            begun = {place.address for place in self._log.parts_begun if place.slug == slug}
            if begun:
                found[slug] = tuple(one.category for one in description.save if one.address in begun)
        return found

    def _options(self, saves: frozenset[str], categories: Mapping[str, tuple[Category, ...]]) -> PlanOptions:
        """For values that stood in these very devices, or were agreed to for them."""
        slugs = {place.slug for place in self._terms.goals}
        return PlanOptions(
            same_unit=dict.fromkeys(slugs, True),
            expert=self._terms.expert,
            restart=self._terms.restart,
            returning=True,
            leave_modes=self._terms.modes,
            save=saves,
            categories=categories,
            confirm=False,
            network=self._terms.network,
        )

    def _all_steps(self, plan: Plan, direction: Direction) -> Sequence[Step]:
        """The plan, and for better or worse what it found no order for: what stood there must stand there again."""
        wanted = self._terms.wanted(direction)
        rest = [Step(StepKind.WRITE, place.slug, place, wanted[place]) for place in plan.unordered]
        at = next((n for n, step in enumerate(plan.steps) if step.kind in _LAST), len(plan.steps))
        return (*plan.steps[:at], *rest, *plan.steps[at:])

    # -- one way -------------------------------------------------------------------------

    async def _go(self, steps: Sequence[Step], direction: Direction, confirm_s: float | None) -> End:
        goals = self._terms.wanted(direction)
        self.done, self.total = 0, len(steps)
        checked = restarting = False
        for number, step in enumerate(steps):
            self._look_for_people(direction)
            if step.kind is StepKind.SAVE and not checked:
                later = self._changed_by(steps[number:])
                await self._hands.check({place: raw for place, raw in goals.items() if place not in later})
                checked = True
            if step.kind is StepKind.RESTART and not restarting:
                await self._hands.guard(
                    direction
                )  # of its own chain: from the first restart on, that may drive the axis
                restarting = True
            await self._enter_for(step, direction)
            await self._do(step, direction, confirm_s)
            self.done += 1
        saved = {step.device for step in steps if step.kind is StepKind.SAVE}
        restarted = self._restarted
        unproven = await self._prove(bool(restarted), goals, direction)
        self._look_for_people(direction)
        proven = bool(saved) and saved <= restarted and not unproven
        back = direction is Direction.BACK
        cause = Cause.CANCELLED if self.broken is None else self.broken.cause
        if back:
            self._tell(Kind.RESTORE_ROLLED_BACK, "", cause_key=cause.text_key)
        else:
            self._tell(Kind.RESTORE_DONE)
        await self._log.enter(RestoreState.ROLLED_BACK if back else RestoreState.DONE, proven=proven, unproven=unproven)
        return End.OLD if back else End.NEW

    def _changed_by(self, steps: Iterable[Step]) -> frozenset[Place]:
        """What the steps write, and what the device changes by itself with that."""
        written = [step.place for step in steps if step.place is not None]
        effects = (
            Place(place.slug, effect.address)
            for place in written
            for effect in self.descriptions[place.slug].entry(place.address).effects
        )
        return frozenset((*written, *effects))

    async def _do(self, step: Step, direction: Direction, confirm_s: float | None) -> None:
        if step.kind in (StepKind.WRITE, StepKind.AUXILIARY):
            await self._hands.write(step, direction)
        elif step.kind is StepKind.CONFIRM:
            await self._confirm(direction, confirm_s)
        elif step.kind is StepKind.SAVE:
            await self._hands.save(step.device, direction, step.category)
        elif step.kind is StepKind.RESTART and await self._hands.restart(step.device, direction):
            self._restarted.add(step.device)

    async def _enter_for(self, step: Step, direction: Direction) -> None:
        """The state that the step belongs to."""
        state = _STATE_FOR.get(step.kind)
        if state is not None and direction is not Direction.BACK and self._log.state is not state:
            await self._log.enter(state)

    def _look_for_people(self, direction: Direction) -> None:
        if self._back_by is not None and direction is not Direction.BACK:
            raise Broken(Cause.CANCELLED, person=self._back_by)

    async def _confirm(self, direction: Direction, confirm_s: float | None) -> None:
        """Wait for the person, on the monotonic clock; look meanwhile whether a device restarts or the bus goes."""
        if confirm_s is None:
            self._confirmed_by = self._terms.person
        else:
            self._deadline = self._hands.monotonic() + confirm_s
            await self._log.enter(RestoreState.AWAITING_CONFIRMATION, confirm_s=confirm_s)
            while not self._decided.is_set():
                if not self.left_s:
                    raise Broken(Cause.NOT_CONFIRMED)
                self._hands.look_for_restarts()
                await asyncio.sleep(LOOK_S)
            self._look_for_people(direction)
        self._tell(Kind.RESTORE_CONFIRMED, self._confirmed_by)
        await self._log.enter(
            RestoreState.SAVING, confirmed_by=self._confirmed_by, confirmed_ns=self._hands.connection.stamper()
        )

    async def _prove(
        self, restarted: bool, goals: Mapping[Place, Raw], direction: Direction
    ) -> list[tuple[str, str]] | None:
        """Everything is read again, and every value of the plan must be there.

        Gives device and address of what a restart hides (``Hands.prove``).
        """
        if direction is not Direction.BACK and self._log.state is not RestoreState.PROVING:
            await self._log.enter(RestoreState.PROVING)
        found = await self._read()
        self._hands.look_for_restarts()
        unproven: list[tuple[str, str]] = []
        for slug in dict.fromkeys(place.slug for place in goals):
            hidden = await self._hands.prove(slug, goals, found, direction, restarted)
            unproven += [(slug, str(address)) for address in hidden]
        self.found = found
        return unproven or None

    def _tell(self, kind: Kind, person: str | None = None, **details: str) -> None:
        """For the record: what happened to the restore as a whole."""
        who = self._terms.person if person is None else person
        self._log.tell(f"journal.{kind.value}", who, station=self._terms.station, **details)

    async def _read(self) -> Survey:
        terms = self._terms
        try:
            return await survey(self._hands.connection, self._hands.targets.values(), terms.person, terms.reason)
        except HubsideError as error:
            raise Broken(cause_of(error), "", error) from error


_LAST: Final = (StepKind.CONFIRM, StepKind.SAVE, StepKind.RESTART, StepKind.PROVE)
_STATE_FOR: Final = {
    StepKind.SAVE: RestoreState.SAVING,
    StepKind.RESTART: RestoreState.RESTARTING,
    StepKind.PROVE: RestoreState.PROVING,
}


def _by_device(goals: Mapping[Place, Raw]) -> dict[str, Wanted]:
    """Values as the planner takes them."""
    slugs = dict.fromkeys(place.slug for place in goals)
    return {slug: Wanted({place.address: raw for place, raw in goals.items() if place.slug == slug}) for slug in slugs}


def _outcome_of(broken: Broken) -> dict[str, object]:
    error = None if broken.error is None else error_document(broken.error)
    details = {name: str(one) for name, one in broken.details.items()}
    return {
        "cause": broken.cause.value,
        "device": broken.device or None,
        "error": error,
        "cause_details": details or None,
    }
