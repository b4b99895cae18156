"""From an order to a plan and the reasons against it: everything is read from the devices, nothing is written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from app.errors import RestoreOpenError, UsageError
from app.model.datatypes import Raw
from app.model.restore.plan import Plan, Treatment
from app.model.restore.planner import make_plan, plan_hash
from app.model.station import Place
from app.service.connection import Connection
from app.service.devices import Target
from app.service.gate import BARE_TURBINE
from app.service.restore import precheck
from app.service.restore.commands import Counts, commands_of
from app.service.restore.order import Objection, Order, Refusal
from app.service.restore.survey import Progress, Survey, survey, targets_of


@dataclass(frozen=True, slots=True)
class Prepared:
    """A restore that has not begun. ``hash`` names all that a person agrees to: plan, sets, devices, restarts."""

    order: Order
    targets: tuple[Target, ...]
    found: Survey
    plan: Plan
    same_unit: Mapping[str, bool]
    refusals: tuple[Refusal, ...]
    hash: str
    commands: Counts
    """STOP and FEATHER that were sent before it was ordered."""
    by_hand: tuple[str, ...] = ()
    """Devices that a person has to switch off and on where they are to restart."""

    @property
    def goals(self) -> dict[Place, tuple[Raw, Raw]]:
        """Each object that the restore answers for: what stands there before, and what is wanted.

        What is only written so that others can be is among them: whoever takes up the restore knows what it must hold.
        """
        goals = {
            row.place: (row.now, row.wanted)
            for row in self.plan.rows
            if row.treatment is not Treatment.SKIP and row.now is not None and row.wanted is not None
        }
        for place in self.plan.gates:
            now = self.found.station.raw(place)
            if now is not None:
                goals.setdefault(place, (now, now))
        return goals


async def prepare(
    connection: Connection,
    order: Order,
    nameplates: Mapping[str, str | None],
    on_progress: Progress | None = None,
) -> Prepared:
    """Read the station, plan, and look for whatever speaks against it.

    Raises UsageError (no such station or device), NoAnswerError, BusLostError, ConsentError.
    """
    commands = commands_of(connection)
    targets = targets_in(connection, order)
    found = await survey(connection, targets, order.person, order.reason, on_progress)
    same_unit = {
        slug: precheck.is_same_unit(given.parameters.identity, found.sets[slug].identity, nameplates.get(slug))
        for slug, given in order.given.items()
    }
    wanted = {slug: given.parameters for slug, given in order.given.items()}
    plan = make_plan(found.station, wanted, order.options(same_unit), found.states)
    open_restore = open_at(connection, targets, found)
    refusals = [
        *([] if open_restore is None else [Refusal(Objection.RESTORE_OPEN, "", {"restore": open_restore})]),
        *precheck.objections_to_sets(order, found, nameplates),
        *precheck.objections_to_state(found),
        *precheck.objections_to_surroundings(connection, connection.stamper()),
        *precheck.objections_to_plan(plan),
        *precheck.objections_to_saving(plan, found),
        *await precheck.objections_to_nameless_axes(connection, targets),
    ]
    by_hand = tuple(target.slug for target in targets if connection.driver(target).restarts_by_hand)
    if not (order.others_confirmed and order.expert):
        refusals += await precheck.objections_to_other_blades(connection, order.station)
    return Prepared(
        order, targets, found, plan, same_unit, tuple(refusals), _hash(order, plan, found), commands, by_hand
    )


def open_at(connection: Connection, targets: Iterable[Target], found: Survey) -> str | None:
    """A restore of one of the devices that is not finished, whatever name they had in it; None where there is none."""
    for target in targets:
        try:
            connection.gate.require_open(target.device, found.sets[target.slug].identity)
        except RestoreOpenError as error:
            return str(error.details["restore"])
    return None


def targets_in(connection: Connection, order: Order) -> tuple[Target, ...]:
    """The devices that belong together. On a bare bus, where nobody says so, those that are given a set.

    Raises UsageError.
    """
    targets = targets_of(connection, order.station)
    slugs = {target.slug for target in targets}
    for slug in order.given:
        if slug not in slugs:
            raise UsageError(reason=f"{slug} is no device of {order.station}")
    if connection.turbine.slug == BARE_TURBINE:
        return tuple(target for target in targets if target.slug in order.given)
    return targets


def _hash(order: Order, plan: Plan, found: Survey) -> str:
    content = {
        "plan": plan_hash(plan),
        "sets": {slug: given.parameters.hash for slug, given in order.given.items()},
        "devices": {slug: one.identity.as_json() for slug, one in found.sets.items()},
        "restart": order.restart,
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
