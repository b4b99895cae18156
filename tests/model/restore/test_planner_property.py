"""From any sound station to any other one: there is a plan, and it is sound after every single write."""

from __future__ import annotations

import random
import time
from dataclasses import replace

from hypothesis import given, settings
from hypothesis import strategies as st

from app.model.address import Address
from app.model.checks import check_write
from app.model.restore.plan import Plan, StepKind, Treatment
from app.model.restore.planner import make_plan
from app.model.restore.rows import allowed
from app.model.restore.wanted import PlanOptions, Wanted
from app.model.rules.check import broken_stepwise
from app.model.station import Place, StationValues
from tests.model.restore.valid_stations import outside, restorable, valid_station

_MODE, _MODE_SHOWN = Address(0x6060), Address(0x6061)
SEEDS = st.integers(0, 2**32)


def _options(station: StationValues) -> PlanOptions:
    """Everything may be written."""
    return PlanOptions(expert=True, same_unit={one.slug: True for one in station.devices})


def _plan(now: StationValues, target: StationValues, options: PlanOptions) -> Plan:
    return make_plan(now, {one.slug: Wanted(one.values) for one in target.devices}, options)


def _walked(now: StationValues, plan: Plan, options: PlanOptions) -> StationValues:
    """The station after the writes of the plan, as a strict device with all rules would see them one by one."""
    for step in plan.steps:
        if step.place is None or step.raw is None:
            continue
        device = now.device(step.place.slug)
        assert device is not None
        entry = device.description.entry(step.place.address)
        check_write(device.description, entry, step.raw, device.values.get, allow=allowed(entry, options))
        if step.kind is StepKind.AUXILIARY:
            assert step.place.address == _MODE and step.until is not None
            now = now.with_value(step.until, step.raw)
        else:
            now = now.with_value(step.place, step.raw)
        assert not broken_stepwise(now), step
        assert not outside(now), step
    return now


def _restorable(station: StationValues) -> dict[Place, object]:
    return {
        Place(one.slug, entry.address): one.values[entry.address]
        for one in station.devices
        for entry in restorable(one.description)
    }


def _modes(station: StationValues) -> dict[str, int]:
    """The mode of operation that each device with an axis shows."""
    return {one.slug: mode for one in station.devices if (mode := one.number(_MODE_SHOWN)) is not None}


@settings(max_examples=12, deadline=None)
@given(SEEDS, SEEDS)
def test_any_sound_station_can_become_any_other_one_and_every_step_is_sound(one: int, other: int) -> None:
    now, target = valid_station(random.Random(one)), valid_station(random.Random(other))
    options = _options(now)
    plan = _plan(now, target, options)
    assert plan.runnable, (plan.blockers, plan.unordered)
    end = _walked(now, plan, options)
    assert _restorable(end) == _restorable(target)
    # The mode of operation is what it was, whatever it took to write the home offsets.
    assert _modes(end) == _modes(now)


@settings(max_examples=12, deadline=None)
@given(SEEDS, SEEDS, st.floats(0.02, 0.9))
def test_a_selection_is_planned_or_what_cannot_be_ordered_is_named(one: int, other: int, share: float) -> None:
    now, target = valid_station(random.Random(one)), valid_station(random.Random(other))
    rng = random.Random(one ^ other)
    selected = frozenset(place for place in sorted(_restorable(now), key=str) if rng.random() < share)
    options = replace(_options(now), selected=selected)
    plan = _plan(now, target, options)
    _walked(now, plan, options)
    writes = {row.place: row.wanted for row in plan.rows if row.treatment is Treatment.WRITE}
    assert set(writes) <= selected
    end = now
    for place, raw in writes.items():
        assert raw is not None
        end = end.with_value(place, raw)
    # With all of it written the station is unsound exactly where something could not be ordered.
    assert bool(plan.unordered) == bool(broken_stepwise(end) or outside(end))
    written = {step.place for step in plan.steps if step.kind is StepKind.WRITE}
    assert written | set(plan.unordered) == set(writes) and not written & set(plan.unordered)


@settings(max_examples=8, deadline=None)
@given(SEEDS, SEEDS, st.floats(0, 1))
def test_from_wherever_it_was_cut_off_a_plan_can_be_finished_and_taken_back(one: int, other: int, part: float) -> None:
    now, target = valid_station(random.Random(one)), valid_station(random.Random(other))
    options = _options(now)
    plan = _plan(now, target, options)
    cut = replace(plan, steps=plan.steps[: int(part * len(plan.steps))])
    between = _walked(now, cut, options)
    modes = _modes(now)
    for ways_end in (now, target):
        back = replace(options, returning=True, leave_modes=modes)
        rest = _plan(between, ways_end, back)
        assert rest.runnable
        end = _walked(between, rest, back)
        assert _restorable(end) == _restorable(ways_end)
        assert _modes(end) == modes


def test_a_whole_station_is_planned_in_well_under_a_second() -> None:
    now, target = valid_station(random.Random(1)), valid_station(random.Random(2))
    started = time.perf_counter()
    plan = _plan(now, target, _options(now))
    assert time.perf_counter() - started < 0.5
    assert len(plan.rows) > 350 and len(plan.steps) > 100
