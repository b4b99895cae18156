"""Plans of restores: every object accounted for, writes in a safe order, needs and ends."""

from __future__ import annotations

from dataclasses import replace

from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.restore.plan import Need, Plan, PlanRow, Step, StepKind, Treatment, Why
from app.model.restore.planner import make_plan, plan_hash
from app.model.restore.wanted import DeviceState, PlanOptions, Wanted
from app.model.rules.check import broken_stepwise
from app.model.rules.look import PMC, PMM
from app.model.station import Place, StationValues
from tests.model.rules.stations import SLUGS, Changes, place, station


def wanted(kind: str, changes: Changes) -> Wanted:
    """A full set of one device: everything at its default but for the changes; None leaves a value out."""
    full = station(**{kind.rpartition("-")[2]: changes}).of_kind(kind)
    assert full is not None
    return Wanted(full.values)


def planned(
    pmm: Changes | None = None,
    pmc: Changes | None = None,
    now: StationValues | None = None,
    options: PlanOptions | None = None,
    states: dict[str, DeviceState] | None = None,
) -> Plan:
    """The plan from ``now`` (the defaults) to sets with these changes."""
    sets = {SLUGS[kind]: wanted(kind, changes) for kind, changes in ((PMM, pmm), (PMC, pmc)) if changes is not None}
    return make_plan(now or station(), sets, options or PlanOptions(), states)


def row(plan: Plan, where: Place) -> PlanRow:
    """The row of one object; there is exactly one."""
    (found,) = (one for one in plan.rows if one.place == where)
    return found


def written(plan: Plan) -> list[tuple[str, Raw | None]]:
    """Addresses and values of the writes, in their order."""
    return [
        (one.place.address.short, one.raw)
        for one in plan.steps
        if one.place is not None and one.kind in (StepKind.WRITE, StepKind.AUXILIARY)
    ]


def test_writes_what_differs_and_then_confirms_saves_and_proves() -> None:
    plan = planned({"3110:01": 490}, {})
    where = place(PMM, "3110:01")
    assert row(plan, where) == PlanRow(where, Treatment.WRITE, 500, 490)
    assert plan.steps == (
        Step(StepKind.WRITE, where.slug, where, 490),
        Step(StepKind.CONFIRM, ""),
        Step(StepKind.SAVE, where.slug),
        Step(StepKind.PROVE, where.slug),
    )
    assert plan.runnable and plan.station == "wtg-07/blade-2"


def test_restarts_what_it_saves_where_that_is_agreed() -> None:
    plan = planned({"3110:01": 490}, {"6065": 200}, options=PlanOptions(restart=True))
    ends = [(one.kind, one.device) for one in plan.steps[2:]]
    assert ends == [
        (StepKind.CONFIRM, ""),
        *((kind, SLUGS[of]) for kind in (StepKind.SAVE, StepKind.RESTART, StepKind.PROVE) for of in (PMM, PMC)),
    ]


def test_every_object_of_set_and_device_has_one_row_that_says_what_becomes_of_it() -> None:
    now = station(pmc={"6066": None})
    plan = planned(
        {"3110:01": None, "3050": 7, "30F0:01": 1, "3000": 5, "3040": 1},
        {"6066": 11, "6073": 2500},
        now=now,
    )
    reasons = {place(PMM, "3110:01"): Why.NOT_IN_SET, place(PMM, "3050"): Why.COUNTS}
    reasons |= {place(PMM, "30F0:01"): Why.NEEDS_EXPERT, place(PMM, "3000"): Why.READ_ONLY}
    reasons |= {place(PMM, "3040"): Why.NEVER, place(PMC, "6066"): Why.UNREADABLE, place(PMC, "6073"): Why.MISFIT}
    for where, why in reasons.items():
        assert row(plan, where).why is why, where
    assert row(plan, place(PMC, "6073")).details["error_key"] == "error.limit"
    assert not written(plan)
    for one in now.devices:
        addresses = [found.place.address for found in plan.rows if found.place.slug == one.slug]
        assert len(addresses) == len(set(addresses))
        assert {entry.address for entry in one.description if entry.saved and entry.access.writable} <= set(addresses)


def test_the_ladder_moves_up_and_down_over_both_devices_without_ever_crossing() -> None:
    low_pmm: Changes = {"30FA:03": 150, "30FB:08": 160, "30FA:01": 170, "30FB:07": 180, "30FC:02": 190}
    low_pmm |= {"30FC:01": 200, "30FA:02": 210}
    low_pmc: Changes = {"6510:04": 140, "6510:05": 220}
    high, low = station(), station(low_pmm, low_pmc)
    for now, target in ((high, low), (low, high)):
        sets = {one.slug: Wanted(one.values) for one in target.devices}
        plan = make_plan(now, sets)
        assert plan.runnable and len(written(plan)) == 9
        assert _end(now, plan) == {one.slug: dict(one.values) for one in target.devices}


def _end(now: StationValues, plan: Plan) -> dict[str, dict[Address, Raw]]:
    """The values after all writes; after each of them all stepwise rules hold."""
    for step in plan.steps:
        if step.kind is StepKind.WRITE and step.place is not None and step.raw is not None:
            now = now.with_value(step.place, step.raw)
            assert not broken_stepwise(now), step
    return {one.slug: dict(one.values) for one in now.devices}


def test_a_selection_that_no_order_can_reach_is_named_and_stops_the_plan() -> None:
    target = place(PMM, "30FB:07")
    options = PlanOptions(selected=frozenset({target, place(PMM, "3110:01")}))
    plan = planned({"30FB:07": 660, "30FC:02": 665, "3110:01": 490}, options=options)
    assert plan.unordered == (target,)
    assert not plan.runnable
    assert row(plan, place(PMM, "30FC:02")).why is Why.NOT_SELECTED
    assert "oat.dc_link_ladder" in [one.rule_id for one in plan.blockers]


def test_home_offsets_go_in_homing_mode_only_and_only_to_the_same_machine() -> None:
    now = station(pmc={"6061": 1})
    offset = place(PMC, "607C")
    assert row(planned(pmc={"607C": 50}, now=now), offset).why is Why.OTHER_UNIT
    options = PlanOptions(same_unit={SLUGS[PMC]: True})
    plan = planned(pmc={"607C": 50, "687C": 60, "6065": 200}, now=now, options=options)
    assert written(plan) == [("6065", 200), ("6060", 6), ("607C", 50), ("687C", 60), ("6060", 1)]
    assert plan.needs == {SLUGS[PMC]: (Need.AXIS_DISABLED, Need.HOMING_MODE)}
    change = plan.steps[1]
    assert change.kind is StepKind.AUXILIARY and change.until == place(PMC, "6061")


def test_a_device_that_is_in_homing_mode_stays_in_it_unless_it_was_left_there() -> None:
    now = station(pmc={"6061": 6})
    options = PlanOptions(same_unit={SLUGS[PMC]: True})
    assert written(planned(pmc={"607C": 50}, now=now, options=options)) == [("607C", 50)]
    cut_off = replace(options, leave_modes={SLUGS[PMC]: 3})
    assert written(planned(pmc={"607C": 50}, now=now, options=cut_off)) == [("607C", 50), ("6060", 3)]


def test_factory_objects_are_for_experts() -> None:
    options = PlanOptions(expert=True)
    assert written(planned({"30F0:01": 1999}, options=options)) == [("30F0:01", 1999)]


def test_what_takes_effect_only_after_a_restart_is_named() -> None:
    plan = planned(pmc={"60FB:03": 0})
    assert plan.restarts == (SLUGS[PMC],)
    assert plan.after_restart == (place(PMC, "60FB:03"),)
    assert planned(pmc={"60FB:03": 0x0101}).restarts == ()


def test_an_error_at_the_end_blocks_unless_it_stands_there_and_an_expert_accepts_it() -> None:
    crossed: Changes = {"6510:05": 740}
    new = planned(pmc=crossed)
    assert [one.rule_id for one in new.blockers] == ["oat.dc_link_ladder"]
    options = PlanOptions(expert=True, accepted=frozenset({"oat.dc_link_ladder"}))
    assert planned(pmc=crossed, options=options).blockers
    there = station(pmc=crossed)
    also = crossed | {"6065": 200}
    assert planned(pmc=also, now=there).blockers
    plan = planned(pmc=also, now=there, options=options)
    assert plan.runnable and written(plan) == [("6065", 200)]


def test_the_way_back_leads_to_what_was_there_whatever_the_rules_say_of_it() -> None:
    now = station(pmc={"6510:05": 760})
    before: Changes = {"6510:05": 740, "6065": 200}
    assert not planned(pmc=before, now=now).runnable
    options = PlanOptions(returning=True, save=frozenset(), confirm=False)
    plan = planned(pmc=before, now=now, options=options)
    assert plan.runnable and written(plan) == [("6065", 200), ("6510:05", 740)]
    assert [one.kind for one in plan.steps[2:]] == [StepKind.PROVE]


def test_a_present_value_that_the_device_would_not_take_back_is_not_overwritten() -> None:
    plan = planned(pmc={"6073": 1500}, now=station(pmc={"6073": 2600}))
    assert row(plan, place(PMC, "6073")).why is Why.IRREVOCABLE
    assert not written(plan)


def test_a_plan_that_goes_on_saves_what_is_asked_for_although_nothing_is_written() -> None:
    plan = planned(pmc={}, options=PlanOptions(returning=True, save=frozenset({SLUGS[PMC]})))
    assert [one.kind for one in plan.steps] == [StepKind.CONFIRM, StepKind.SAVE, StepKind.PROVE]
    assert planned(pmc={}).steps == ()


def test_the_hash_stands_for_what_is_done_and_not_for_values_that_never_stand_still() -> None:
    one = planned({"3110:01": 490})
    assert plan_hash(one) == plan_hash(planned({"3110:01": 490}, now=station(pmm={"3000": 5})))
    others = [
        planned({"3110:01": 491}),
        planned({"3110:01": 490}, now=station(pmm={"3110:01": 501})),
        planned({"3110:01": 490}, options=PlanOptions(restart=True)),
        planned({"3110:01": 490, "3110:02": None}),
    ]
    assert len({plan_hash(plan) for plan in (one, *others)}) == 5


def test_addresses_of_other_versions_are_told_apart() -> None:
    full = wanted(PMM, {})
    foreign = parse_address("3FFF:01")
    plan = make_plan(station(), {SLUGS[PMM]: Wanted({**full.values, foreign: 1}, {parse_address("3050"): "timeout"})})
    assert row(plan, Place(SLUGS[PMM], foreign)).why is Why.NOT_ON_DEVICE
    assert row(plan, place(PMM, "3050")).details == {"unread": "timeout"}
