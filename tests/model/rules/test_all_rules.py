"""Every rule with its examples, its texts, and what it may never do: pass silently, or fail."""

from __future__ import annotations

import itertools
import string
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description_file import load_builtin
from app.model.rules.all_rules import ALL
from app.model.rules.check import broken_stepwise, check_station
from app.model.rules.look import PMC, PMM
from app.model.rules.rule import Finding, Rule, Verdict
from app.model.station import DeviceValues, StationValues
from app.model.texts import LANGUAGES, load_texts
from tests.model.rules.examples import EXAMPLES
from tests.model.rules.stations import Changes, device, healthy, station

OF_STATIONS = [rule for rule in ALL if rule.id.startswith("oat.")]
"""Those of a PMM and a PMC; what is a device of its own has examples of its own (``test_hydraulics``)."""
BY_ID = {rule.id: rule for rule in OF_STATIONS}
every_rule = pytest.mark.parametrize("rule", OF_STATIONS, ids=lambda rule: rule.id)


def found(rule: Rule, of: StationValues) -> list[Finding]:
    return check_station(of, (rule,))


def test_every_rule_has_examples_and_an_id_of_its_own() -> None:
    assert len({rule.id for rule in ALL}) == len(ALL)
    assert len(BY_ID) == len(OF_STATIONS) >= 25
    assert set(EXAMPLES) == set(BY_ID)


def test_a_station_as_it_should_be_gives_no_findings() -> None:
    assert check_station(healthy()) == []


def test_what_the_defaults_of_the_manual_break_is_known() -> None:
    broken = [one for one in check_station(station()) if one.verdict is Verdict.BROKEN]
    assert {one.rule_id for one in broken} == {
        "oat.acceleration_zero",
        "oat.motor_type",
        "oat.difference_off",
        "oat.connection_loss",
        "oat.self_test_off",
        "oat.motor_fan_off",
        "oat.mirror_overflow",
    }
    assert all(one.details["at_default"] for one in broken), "each of them says that it was delivered so"


def test_the_default_velocity_is_found_too_high_for_the_pitch_gear_and_named_as_the_default() -> None:
    (one,) = found(BY_ID["oat.max_profile_velocity"], healthy(pmc={"607F": 20000}))
    assert one.details == {
        "velocity_dps": 200.0,
        "highest_dps": 10.63,
        "highest_raw": 1063,
        "speed_rpm": 3000,
        "at_default": "607F",
    }


@every_rule
def test_what_breaks_it_is_found_at_objects_of_the_rule(rule: Rule) -> None:
    broken = found(rule, healthy(*EXAMPLES[rule.id].broken))
    assert broken and {one.verdict for one in broken} == {Verdict.BROKEN}
    for one in broken:
        assert (one.rule_id, one.severity) == (rule.id, rule.severity)
        assert one.places, "something must be marked"
        for place in one.places:
            kind = PMM if place.slug.endswith("pmm") else PMC
            assert str(place.address) in {str(parse_address(text)) for text in rule.objects[kind]}


@every_rule
def test_what_keeps_it_gives_nothing(rule: Rule) -> None:
    assert found(rule, healthy(*EXAMPLES[rule.id].kept)) == []


@every_rule
def test_without_a_value_it_is_not_checked_and_names_it(rule: Rule) -> None:
    example = EXAMPLES[rule.id]
    pmm, pmc = (dict(changes) for changes in example.kept)
    (pmc if example.of_pmc else pmm)[example.without] = None
    (one,) = found(rule, healthy(pmm, pmc))
    assert one.verdict is Verdict.NOT_CHECKED
    assert example.without in str(one.details["missing"]).split(", ")


@pytest.mark.parametrize("rule", [rule for rule in OF_STATIONS if len(rule.objects) > 1], ids=lambda rule: rule.id)
@pytest.mark.parametrize("kind", (PMM, PMC))
def test_without_its_partner_it_is_not_checked(rule: Rule, kind: str) -> None:
    whole = healthy(*EXAMPLES[rule.id].kept)
    alone = StationValues(tuple(one for one in whole.devices if one.description.id == kind))
    partner = "OAT PMC" if kind == PMM else "OAT PMM"
    unchecked = [one for one in found(rule, alone) if one.verdict is Verdict.NOT_CHECKED]
    assert [one.details["missing"] for one in unchecked] == [partner]


@every_rule
def test_its_objects_exist(rule: Rule) -> None:
    for kind, addresses in rule.objects.items():
        for text in addresses:
            load_builtin(kind).entry(parse_address(text))


@every_rule
def test_it_looks_at_nothing_but_its_objects(rule: Rule) -> None:
    """What it judges and what it misses stays the same where all other values are gone."""
    for changes in (EXAMPLES[rule.id].broken, EXAMPLES[rule.id].kept):
        whole = healthy(*changes)
        bare = StationValues(tuple(_only(one, rule) for one in whole.devices))
        assert found(rule, bare) == found(rule, whole)


def _only(one: DeviceValues, rule: Rule) -> DeviceValues:
    own = {parse_address(text) for text in rule.objects.get(one.description.id, ())}
    return replace(one, values={address: raw for address, raw in one.values.items() if address in own})


@every_rule
@pytest.mark.parametrize("language", LANGUAGES)
def test_its_texts_are_there_and_its_findings_fill_them(rule: Rule, language: str) -> None:
    texts = load_texts(language)
    own = texts._texts
    assert {f"rule.{rule.id}.{part}" for part in ("title", "why", "broken")} <= set(own)
    for one in found(rule, healthy(*EXAMPLES[rule.id].broken)):
        asked = {name for _, name, _, _ in string.Formatter().parse(own[f"rule.{rule.id}.broken"]) if name}
        assert asked == set(one.details) - {"at_default"}


def test_no_text_is_left_of_a_rule_that_is_gone() -> None:
    told = {
        key.rpartition(".")[0].removeprefix("rule.") for key in load_texts("en").flat if key.startswith("rule.oat.")
    }
    assert told == set(BY_ID)


OBJECTS = sorted({(kind, text) for rule in OF_STATIONS for kind, texts in rule.objects.items() for text in texts})
raws: st.SearchStrategy[Raw | None] = st.one_of(
    st.none(),
    st.sampled_from((0, 1, -1, 0x7FFF, 0x8000, 0xFFFF, 0xFFFFFFFF, -(1 << 31))),
    st.integers(-(1 << 63), 1 << 64),
    st.floats(),
    st.text(max_size=3),
    st.binary(max_size=3),
)


@settings(max_examples=200, deadline=None)
@given(st.dictionaries(st.sampled_from(OBJECTS), raws, max_size=60), st.booleans(), st.booleans())
def test_no_rule_fails_whatever_the_values_are(
    values: dict[tuple[str, str], Raw | None], with_pmm: bool, with_pmc: bool
) -> None:
    changed: dict[str, Changes] = {PMM: {}, PMC: {}}
    for (kind, text), raw in values.items():
        changed[kind][str(parse_address(text))] = raw
    devices = [device(kind, changed[kind]) for kind, there in ((PMM, with_pmm), (PMC, with_pmc)) if there]
    for one in check_station(StationValues(tuple(devices))):
        for language in LANGUAGES:
            verdict = f"rule.{one.rule_id}.broken" if one.verdict is Verdict.BROKEN else "rule.not_checked"
            assert load_texts(language)(verdict, **one.details)


# -- rules that hold after every write ------------------------------------------------

STEPWISE = tuple(rule for rule in ALL if rule.stepwise)
STEPS = sorted(
    {(kind, parse_address(text)) for rule in STEPWISE for kind, texts in rule.objects.items() for text in texts}
)


@st.composite
def valid_values(draw: st.DrawFn) -> dict[tuple[str, Address], int]:
    """Values that keep all stepwise rules: drawn narrowly, then mended by sorting what must lie in an order."""
    number = {step: draw(st.integers(1, 40)) for step in STEPS}

    def order(*steps: tuple[str, str]) -> None:
        keys = [(kind, parse_address(text)) for kind, text in steps]
        low = draw(st.integers(1, 9))
        for key in keys:
            number[key] = low
            low += draw(st.integers(1, 9))

    ladder = [(PMC, "6510:04")]
    ladder += [(PMM, text) for text in ("30FA:03", "30FB:08", "30FA:01", "30FB:07", "30FC:02", "30FC:01", "30FA:02")]
    order(*ladder, (PMC, "6510:05"))
    order((PMM, "3020:05"), (PMM, "3020:06"))
    for text in ("3020:05", "3020:06"):  # in mV: blocs times this lies above the PMC's minimum in V
        number[PMM, parse_address(text)] += number[PMC, parse_address("6510:04")] * 1000
    order((PMM, "30F1:05"), (PMM, "30F1:04"))
    order((PMC, "607D:01"), (PMC, "567A"), (PMC, "607D:02"))
    order((PMC, "5681"), (PMC, "607F"))
    order((PMC, "5683"), (PMC, "6083"), (PMC, "60C5"))
    order((PMC, "5684"), (PMC, "6084"), (PMC, "60C6"))
    if draw(st.booleans()):
        number[PMC, parse_address("60C6")] = 0  # no limit
    order((PMC, "6410:08"), (PMC, "6410:07"))
    order((PMC, "6510:06"), (PMC, "6510:02"))
    for index in ("3110", "3111", "3112", "3113"):
        order(*((PMM, f"{index}:0{sub}") for sub in (3, 1, 2)))
    order((PMM, "3220:01"), (PMM, "3220:02"))
    return number


def _station(values: dict[tuple[str, Address], int]) -> StationValues:
    texts = {kind: {str(address): raw for (k, address), raw in values.items() if k == kind} for kind in (PMM, PMC)}
    return healthy(dict(texts[PMM]), dict(texts[PMC]))


@settings(max_examples=40, deadline=None)
@given(valid_values(), valid_values())
def test_from_any_valid_station_to_any_other_single_writes_keep_every_stepwise_rule(
    before: dict[tuple[str, Address], int], after: dict[tuple[str, Address], int]
) -> None:
    now = dict(before)
    assert not broken_stepwise(_station(before)) and not broken_stepwise(_station(after))
    waiting = {step for step in STEPS if before[step] != after[step]}
    for _ in range(len(waiting)):
        step = next((one for one in sorted(waiting) if not broken_stepwise(_station({**now, one: after[one]}))), None)
        assert step is not None, f"stuck, still to write: {waiting}"
        waiting.discard(step)
        now[step] = after[step]
    assert now == after


def test_the_order_matters_for_some_of_them() -> None:
    """The property above would be empty if any order would do."""
    low = {(PMM, parse_address("30FA:03")): 200, (PMM, parse_address("30FB:08")): 300}
    high = {(PMM, parse_address("30FA:03")): 410, (PMM, parse_address("30FB:08")): 430}
    orders = itertools.permutations(high)
    kept = [not broken_stepwise(_station({**low, first: high[first]})) for first, _second in orders]
    assert sorted(kept) == [False, True]
