"""Orders where the first choice leads nowhere, and where there is none at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from app.model.datatypes import Raw
from app.model.restore.plan import Plan, StepKind
from app.model.restore.planner import make_plan
from app.model.restore.wanted import Wanted
from app.model.rules.look import PMM, Found, Look, make_rule, pmm
from app.model.rules.rule import Rule, Severity
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
