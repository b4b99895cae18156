"""Plans for an ED2: gates within gates, modes that condition each other, and units before what is counted in them."""

from __future__ import annotations

from hypothesis import example, given, settings
from hypothesis import strategies as st

from app.model.address import Address, parse_address
from app.model.checks import check_write
from app.model.datatypes import Raw
from app.model.description_file import load_builtin
from app.model.restore.plan import Plan, StepKind, Treatment, Why
from app.model.restore.planner import make_plan
from app.model.restore.rows import allowed
from app.model.restore.wanted import PlanOptions, Wanted
from app.model.rules.check import broken_stepwise
from app.model.station import DeviceValues, Place, StationValues
from app.twins.ed2.delivered import SSI_GRAY, delivered

ED2 = load_builtin("wandfluh-ed2")
SLUG = "bench/bench/cylinders"
LOCAL, MODE, DEVICE_MODE, AXES = "0/41", "0/40", "0/39", "0/53"
ENABLE, LOW, HIGH, VALVE = "1/106", "1/100", "1/101", "3/133"

Changes = dict[str, int]
Done = tuple[str, str, Raw]


def station(changes: Changes) -> StationValues:
    """An axis as commissioned, but for the changes."""
    values: dict[Address, Raw] = {e.address: e.default for e in ED2 if e.default is not None and e.access.readable}
    for address, data in delivered(ED2, SSI_GRAY, 1).items():
        values[address] = int.from_bytes(data, "little", signed=(ED2.entry(address).type.range or (0, 0))[0] < 0)
    values |= {parse_address("1/106"): 0, parse_address("1/105"): 0, parse_address("3/131"): 0}
    values |= {parse_address(text): raw for text, raw in changes.items()}
    return StationValues((DeviceValues(SLUG, ED2, values),))


def plan_of(now: Changes, wanted: Changes, options: PlanOptions | None = None) -> Plan:
    goal = station(wanted).devices[0].values
    return make_plan(station(now), {SLUG: Wanted(goal)}, options or PlanOptions(same_unit={SLUG: True}))


def writes(plan: Plan) -> list[Done]:
    return [
        (one.kind.value, one.place.address.short, one.raw) for one in plan.steps if one.place and one.raw is not None
    ]


def walk(now: Changes, plan: Plan) -> dict[Address, Raw]:
    """What a strict device holds after the plan: it refuses what its description forbids."""
    values = dict(station(now).devices[0].values)
    for step in plan.steps:
        if step.place is None or step.raw is None:
            continue
        entry = ED2.entry(step.place.address)
        check_write(ED2, entry, step.raw, values.get, allow=allowed(entry, PlanOptions()))
        values[entry.address] = step.raw
        values |= {one.address: one.raw for one in entry.effects if step.raw in one.writing}
        assert not broken_stepwise(StationValues((DeviceValues(SLUG, ED2, values),))), step
    return values


def test_limits_are_enabled_first_and_written_at_once_behind_it() -> None:
    plan = plan_of({}, {ENABLE: 1, LOW: -100, HIGH: 4000, "12/207": 9000, "1/84": 2})
    assert plan.runnable
    assert writes(plan)[0] == ("write", "1/84", 2)
    at = writes(plan).index(("write", ENABLE, 1))
    assert writes(plan)[at:] == [("write", ENABLE, 1), ("write", LOW, -100), ("write", HIGH, 4000)]


def test_limits_that_are_not_in_force_are_written_while_they_are_and_switched_off_again() -> None:
    plan = plan_of({ENABLE: 0}, {ENABLE: 0, LOW: -100, HIGH: 4000})
    assert writes(plan) == [
        ("auxiliary", ENABLE, 1),
        ("write", LOW, -100),
        ("write", HIGH, 4000),
        ("auxiliary", ENABLE, 0),
    ]
    off = plan_of({ENABLE: 1, LOW: -100, HIGH: 4000}, {ENABLE: 0})
    addresses = [address for _, address, _ in writes(off)]
    assert set(addresses[:2]) == {LOW, HIGH} and addresses[2:] == [ENABLE]


def test_a_window_moves_without_ever_being_crossed() -> None:
    up = plan_of({ENABLE: 1, LOW: 0, HIGH: 1000}, {ENABLE: 1, LOW: 2000, HIGH: 3000})
    assert [address for _, address, _ in writes(up)] == [HIGH, LOW]
    down = plan_of({ENABLE: 1, LOW: 2000, HIGH: 3000}, {ENABLE: 1, LOW: 0, HIGH: 1000})
    assert [address for _, address, _ in writes(down)] == [LOW, HIGH]


def test_a_window_of_nothing_is_refused() -> None:
    plan = plan_of({}, {ENABLE: 1})
    assert [one.rule_id for one in plan.blockers] == ["ed2.travel_window"]


def test_local_operation_is_left_first_and_kept_out_of_it_for_then_nothing_could_be_saved() -> None:
    change = {"12/207": 9000}
    bus, local = {LOCAL: 0}, {LOCAL: 1, DEVICE_MODE: 2}
    assert writes(plan_of(local, {**bus, **change}))[0] == ("write", LOCAL, 0)
    entered = plan_of(bus, {**local, **change})
    assert LOCAL not in [address for _, address, _ in writes(entered)]
    assert [row.why for row in entered.rows if row.place.address.short == LOCAL] == [Why.NOT_SAVABLE]
    inside = writes(plan_of(local, {**local, **change}))
    assert inside == [("auxiliary", LOCAL, 0), ("write", "12/207", 9000), ("auxiliary", LOCAL, 1)]


def test_on_the_way_back_local_operation_is_entered_once_all_is_saved() -> None:
    back = PlanOptions(same_unit={SLUG: True}, returning=True, save=frozenset({SLUG}))
    plan = plan_of({LOCAL: 0}, {LOCAL: 1, DEVICE_MODE: 2, "12/207": 9000}, back)
    kinds = [(step.kind.value, None if step.place is None else step.place.address.short) for step in plan.steps]
    assert kinds.index(("save", None)) < kinds.index(("write", LOCAL)) < kinds.index(("prove", None))


def test_single_axes_are_reached_from_open_loop_by_a_mode_that_allows_it() -> None:
    plan = plan_of({MODE: 6, DEVICE_MODE: 2}, {MODE: 6, DEVICE_MODE: 2, AXES: 1})
    assert plan.runnable
    done = writes(plan)
    assert ("write", AXES, 1) in done and done[-1][1:] in ((MODE, 6), (DEVICE_MODE, 2))
    assert walk({MODE: 6, DEVICE_MODE: 2}, plan)[parse_address(MODE)] == 6


def test_a_mode_alone_is_refused_where_the_device_would_change_what_was_left_out() -> None:
    only = PlanOptions(selected=frozenset(_places(MODE)))
    plan = plan_of({}, {MODE: 6, DEVICE_MODE: 2, AXES: 1}, only)
    assert [one.address.short for one in plan.unordered] == [MODE]


def test_the_valve_is_of_the_right_kind_while_its_values_are_written() -> None:
    plan = plan_of({VALVE: 0}, {VALVE: 1, "3/73": 200, "3/132": 80})
    assert writes(plan) == [("write", "3/73", 200), ("write", VALVE, 1), ("write", "3/132", 80)]


def test_what_another_kind_of_transducer_needs_is_left_out_and_told() -> None:
    plan = plan_of({}, {"1/102": 500})
    (row,) = [row for row in plan.rows if row.place.address.short == "1/102"]
    assert (row.treatment, row.why) == (Treatment.SKIP, Why.CONDITION)
    assert row.details == {"needs": "1/22 = 64", "found": "66"}


MODES = st.sampled_from([(6, 2), (9, 1), (9, 2), (-1, 1), (-2, 1)])
"""What a device can hold."""


@st.composite
def stations(draw: st.DrawFn) -> Changes:
    mode, device_mode = draw(MODES)
    local = draw(st.integers(0, 1))
    axes = 1 if mode == 6 else draw(st.integers(0, 1))
    low = draw(st.integers(-400_000, 399_999))
    return {
        LOCAL: local,
        MODE: mode,
        DEVICE_MODE: 2 if local else device_mode,
        AXES: axes,
        ENABLE: draw(st.integers(0, 1)),
        LOW: low,
        HIGH: draw(st.integers(low + 1, 400_000)),
        VALVE: draw(st.integers(0, 1)),
        "1/84": draw(st.integers(1, 3)),
        "1/99": draw(st.integers(1_000, 10_000_000)),
        "3/73": (least := draw(st.integers(0, 475)) * 2),
        "3/129": draw(st.integers(least // 2, 900)) * 2,
        "3/132": draw(st.integers(50, 100)),
        "12/61": (speed := draw(st.integers(0, 100_000))),
        "12/216": draw(st.integers(0, speed)),
        "12/217": draw(st.integers(0, speed)),
    }


@settings(deadline=None, max_examples=150)
@given(stations(), stations())
@example({MODE: 9, DEVICE_MODE: 2}, {MODE: -1, DEVICE_MODE: 1, AXES: 1})
def test_from_any_state_to_any_other_there_is_a_legal_way(now: Changes, wanted: Changes) -> None:
    plan = plan_of(now, wanted, PlanOptions(same_unit={SLUG: True}, returning=True, save=frozenset()))
    assert not plan.unordered, writes(plan)
    reached = walk(now, plan)
    goal = station(wanted).devices[0].values
    for row in plan.rows:
        if row.treatment is not Treatment.SKIP:
            assert reached[row.place.address] == goal[row.place.address], row
    written = [one.place for one in plan.steps if one.kind is StepKind.WRITE]
    rows = {row.place for row in plan.rows if row.treatment is Treatment.WRITE}
    by_itself = {place for place in rows if place.address == parse_address(DEVICE_MODE)} if wanted.get(LOCAL) else set()
    assert len(written) == len(set(written)) and rows - by_itself <= set(written) <= rows


def _places(*addresses: str) -> set[Place]:
    return {Place(SLUG, parse_address(one)) for one in addresses}
