"""Rules over a station: what is broken, what is not checked, and what no step of a restore may break."""

from __future__ import annotations

from app.model.rules.check import broken_in, broken_stepwise, check_station, mended
from app.model.rules.dc_link import RULES as DC_LINK
from app.model.rules.look import PMC, PMM
from app.model.rules.rule import Severity, Verdict
from app.model.station import StationValues
from tests.model.rules.stations import device, healthy, place, station

RULES = DC_LINK[:1]
"""The ladder of table 19."""


def test_the_ladder_holds_as_delivered() -> None:
    assert check_station(station(), RULES) == []
    assert broken_stepwise(station()) == frozenset()


def test_a_broken_rung_names_both_places_over_both_devices() -> None:
    (found,) = check_station(station(pmc={"6510:04": 400}), RULES)
    assert (found.verdict, found.severity) == (Verdict.BROKEN, Severity.ERROR)
    assert found.places == (place(PMC, "6510:04"), place(PMM, "30FA:03"))
    names = {"lower": "6510:04", "upper": "30FA:03"}
    assert found.details == {**names, "lower_v": 400, "upper_v": 400}
    assert broken_stepwise(station(pmc={"6510:04": 400}), RULES) == {("oat.dc_link_ladder", found.places)}


def test_the_maxima_may_be_equal_but_not_the_wrong_way_round() -> None:
    assert check_station(station(pmc={"6510:05": 750}), RULES) == []
    assert [one.places for one in check_station(station(pmc={"6510:05": 749}), RULES)] == [
        (place(PMM, "30FA:02"), place(PMC, "6510:05"))
    ]


def test_without_its_partner_a_rule_is_not_checked_and_what_can_be_judged_is() -> None:
    alone = StationValues((device(PMM, {"30FB:08": 390}),))
    broken, unchecked = check_station(alone, RULES)
    assert broken.places == (place(PMM, "30FA:03"), place(PMM, "30FB:08"))
    assert (unchecked.verdict, unchecked.places) == (Verdict.NOT_CHECKED, ())
    assert unchecked.details == {"missing": "OAT PMC"}


def test_an_unknown_value_is_named_and_its_neighbours_are_compared() -> None:
    broken, unchecked = check_station(station(pmm={"30FA:01": None, "30FB:08": 600}), RULES)
    assert broken.places == (place(PMM, "30FB:08"), place(PMM, "30FB:07"))
    assert (unchecked.places, unchecked.details) == ((place(PMM, "30FA:01"),), {"missing": "30FA:01"})


def test_of_two_partners_none_is_taken() -> None:
    two = StationValues((device(PMM), device(PMC), device(PMC, {"6510:04": 500}, "wtg-07/blade-2/pmc-b")))
    (found,) = check_station(two, RULES)
    assert (found.verdict, found.details) == (Verdict.NOT_CHECKED, {"missing": "OAT PMC"})


def test_a_station_of_other_devices_is_no_matter_of_a_rule() -> None:
    assert check_station(StationValues((device("nanotec-pd4e", slug="a/b/c"),))) == []


def test_the_gravest_comes_first_and_what_is_not_checked_last() -> None:
    found = check_station(healthy(pmm={"30E3": 0, "3062": None}, pmc={"60FB:03": 0xC001}))
    assert [(one.rule_id, one.verdict) for one in found] == [
        ("oat.simulation_mode", Verdict.BROKEN),
        ("oat.limit_switches_crossable", Verdict.BROKEN),
        ("oat.self_test_off", Verdict.BROKEN),
        ("oat.nominal_dc_link", Verdict.NOT_CHECKED),
    ]


def test_two_devices_of_a_kind_are_both_judged_where_no_partner_is_asked() -> None:
    two = StationValues((device(PMC, {"60FB:01": 0}), device(PMC, {"60FB:01": 0}, "wtg-07/blade-2/pmc-b")))
    slugs = [one.places[0].slug for one in check_station(two) if one.rule_id == "oat.position_gain"]
    assert slugs == ["wtg-07/blade-2/pmc", "wtg-07/blade-2/pmc-b"]


def test_what_a_change_breaks_mends_and_leaves_broken_is_told_apart() -> None:
    torn = check_station(station(pmc={"6510:04": 400}), RULES)
    other = check_station(station(pmc={"6510:05": 749}), RULES)
    assert broken_in(torn) - broken_in(other) == broken_in(torn)
    assert broken_in(torn) - broken_in(torn) == frozenset()
    assert mended(torn, other) == torn
    assert mended(torn, torn) == []
    alone = check_station(StationValues((device(PMM, {}),)), RULES)
    assert alone and mended(torn, alone) == [], "what cannot be judged any more is not mended"
