"""The rules of an ED2: what breaks each, what just keeps it, and what is missing where it cannot be judged."""

from __future__ import annotations

import pytest

from app.model.address import parse_address
from app.model.rules.all_rules import ALL
from app.model.rules.check import check_station
from app.model.rules.rule import Rule, Verdict
from app.model.station import DeviceValues, StationValues
from app.model.texts import LANGUAGES, load_texts
from tests.model.restore.test_ed2 import Changes, station

RULES = {rule.id: rule for rule in ALL if rule.id.startswith("ed2.")}
EXAMPLES: dict[str, tuple[Changes, Changes, str]] = {
    "ed2.travel_limits": (
        {"1/106": 1, "1/100": 10, "1/101": -10},
        {"1/106": 0, "1/100": 10, "1/101": -10},
        "1/106",
    ),
    "ed2.travel_window": ({"1/106": 1}, {"1/106": 1, "1/101": 1}, "1/106"),
    "ed2.open_loop_axes": ({"0/40": 6}, {"0/40": 6, "0/53": 1}, "0/40"),
    "ed2.single_axes_controller": ({"0/53": 1, "12/219": 0}, {"0/53": 1, "12/219": 2}, "12/219"),
    "ed2.single_axes_transducer": ({"0/53": 1, "1/22": 64}, {"0/53": 0, "1/22": 64}, "0/53"),
    "ed2.valve_currents": ({"3/73": 702}, {"3/73": 700}, "3/129"),
    "ed2.hand_speeds": ({"12/216": 1001}, {"12/216": 1000}, "12/61"),
}
"""What breaks it, what keeps it, and the value that is taken away from the first."""
every_rule = pytest.mark.parametrize("rule", RULES.values(), ids=list(RULES))


def without(of: StationValues, address: str) -> StationValues:
    (one,) = of.devices
    kept = {at: raw for at, raw in one.values.items() if at != parse_address(address)}
    return StationValues((DeviceValues(one.slug, one.description, kept),))


def test_every_rule_has_an_example() -> None:
    assert set(EXAMPLES) == set(RULES)


def test_an_axis_as_commissioned_gives_no_findings() -> None:
    assert check_station(station({})) == []


@every_rule
def test_what_breaks_it_is_found_and_what_keeps_it_is_not(rule: Rule) -> None:
    broken, kept, _ = EXAMPLES[rule.id]
    (found,) = check_station(station(broken), (rule,))
    assert (found.rule_id, found.verdict) == (rule.id, Verdict.BROKEN)
    assert {str(place.address) for place in found.places} <= set(rule.objects["wandfluh-ed2"])
    assert check_station(station(kept), (rule,)) == []


@every_rule
def test_without_a_value_it_is_not_checked_and_names_it(rule: Rule) -> None:
    broken, _, missing = EXAMPLES[rule.id]
    (found,) = check_station(without(station(broken), missing), (rule,))
    assert (found.verdict, found.details["missing"]) == (Verdict.NOT_CHECKED, missing)


@every_rule
@pytest.mark.parametrize("language", LANGUAGES)
def test_its_texts_are_filled(rule: Rule, language: str) -> None:
    texts = load_texts(language)
    (found,) = check_station(station(EXAMPLES[rule.id][0]), (rule,))
    told = texts(f"rule.{rule.id}.broken", **found.details)
    assert "{" not in told and told != f"rule.{rule.id}.broken"
    for part in ("title", "why"):
        assert texts(f"rule.{rule.id}.{part}") != f"rule.{rule.id}.{part}"
