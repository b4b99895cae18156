"""Orders where the first choice leads nowhere, and where there is none at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from app.model.address import parse_address
from app.model.datatypes import Raw
from app.model.description_file import load_builtin
from app.model.restore.plan import Plan, StepKind
from app.model.restore.planner import make_plan
from app.model.restore.wanted import PlanOptions, Wanted
from app.model.rules.look import PMM, Found, Look, make_rule, pmm
from app.model.rules.rule import Rule, Severity
from app.model.station import DeviceValues, Place, StationValues
from tests.model.rules.stations import SLUGS, place, station

OBJECTS = ("3110:01", "3111:01", "3112:01")
FIRST, SECOND, THIRD = OBJECTS
TARGET: dict[str, Raw | None] = {FIRST: 490, SECOND: 740, THIRD: 440}


def _entangled(is_bad: Callable[[frozenset[str]], bool]) -> Rule:
    """A stepwise rule over three objects, broken where exactly the wrong ones of them have their new value."""
    objects = tuple(map(pmm, OBJECTS))

    def judge(look: Look) -> Iterator[Found]:
        if is_bad(frozenset(one.address for one in objects if look.maybe(one) == TARGET[one.address])):
            yield Found(objects)

    return make_rule("test.entangled", "0", Severity.ERROR, objects, judge, stepwise=True)


def _plan(rule: Rule) -> Plan:
    target = station(pmm=TARGET).of_kind(PMM)
    assert target is not None
    return make_plan(station(), {SLUGS[PMM]: Wanted(target.values)}, rules=(rule,))


def _order(plan: Plan) -> list[str]:
    return [one.place.address.short for one in plan.steps if one.place and one.kind is StepKind.WRITE]


def test_another_order_is_found_where_the_first_choice_leads_nowhere() -> None:
    plan = _plan(_entangled(lambda new: FIRST in new and len(new) == 2))
    assert plan.runnable
    assert _order(plan) == [SECOND, THIRD, FIRST]


def test_where_there_is_no_order_as_much_as_possible_is_ordered_and_the_rest_named() -> None:
    plan = _plan(_entangled(lambda new: (len(new) == 2 and new != {SECOND, THIRD}) or len(new) == 3))
    assert _order(plan) == [SECOND, THIRD]
    assert plan.unordered == (place(PMM, FIRST),)
    assert not plan.runnable


def test_objects_that_nothing_ties_do_not_wait_for_those_that_have_no_order() -> None:
    plan = _plan(_entangled(bool))
    assert _order(plan) == []
    assert plan.unordered == tuple(place(PMM, one) for one in OBJECTS)
    assert not any(one.kind is StepKind.SAVE for one in plan.steps)


SPEED, HAND_SPEED, DRIVE_TYPE, A_SIDE = "12/61", "12/216", "3/133", "3/73"
ED2: dict[str, Raw] = {SPEED: 1000, HAND_SPEED: 800, DRIVE_TYPE: 0, A_SIDE: 100}


def _ed2(changes: dict[str, Raw], *selected: str) -> Plan:
    """A plan for an ED2, of whose limits one rests on another object, and of whose objects one on a precondition."""
    slug, description = "wtg-07/blade-2/axis", load_builtin("wandfluh-ed2")
    values = {parse_address(text): raw for text, raw in ED2.items()}
    wanted = values | {parse_address(text): raw for text, raw in changes.items()}
    places = frozenset(Place(slug, parse_address(one)) for one in selected) or None
    device = StationValues((DeviceValues(slug, description, values),))
    return make_plan(device, {slug: Wanted(wanted)}, PlanOptions(selected=places))


def test_a_limit_never_falls_below_what_it_limits() -> None:
    assert _order(_ed2({SPEED: 500, HAND_SPEED: 400})) == [HAND_SPEED, SPEED]
    assert _order(_ed2({SPEED: 2000, HAND_SPEED: 1500})) == [SPEED, HAND_SPEED]
    alone = _ed2({SPEED: 500, HAND_SPEED: 400}, SPEED)
    assert _order(alone) == [] and [one.address.short for one in alone.unordered] == [SPEED]


def test_what_has_a_precondition_is_written_while_that_holds() -> None:
    assert _order(_ed2({DRIVE_TYPE: 1, A_SIDE: 200})) == [A_SIDE, DRIVE_TYPE]
