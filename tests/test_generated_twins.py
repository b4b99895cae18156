"""docs/twins.md is up to date, and complete: each rule of the drive has its words, its place and its tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.twins import make_page, make_plots

IDS = {"A": 10, "B": 7, "C": 5, "D": 9, "E": 2, "F": 14, "G": 5, "H": 8, "I": 13, "J": 15, "K": 17, "L": 5, "M": 15,
       "N": 8, "O": 1}  # fmt: skip
"""How many rules each chapter has."""
SILENT = {"A9", "D1", "D4", "F11", "F13", "F14", "H2", "I2", "I10", "K8", "K16", "M3", "M5"}
"""Rules that the manual leaves open."""
RULES = make_page.rules()


def test_every_rule_is_there_once_in_order() -> None:
    assert list(RULES) == [f"{chapter}{number}" for chapter, last in IDS.items() for number in range(1, last + 1)]
    assert len(RULES) == 134


def test_every_mark_of_a_test_names_a_rule() -> None:
    assert set(make_page.marks()) <= set(RULES)


@pytest.mark.parametrize("rule", RULES.values(), ids=RULES)
def test_a_rule_has_words_a_place_that_exists_and_a_test(rule: make_page.Rule) -> None:
    assert rule.words.endswith(".") and rule.section
    assert rule.lives
    for place in rule.lives:
        assert make_page.exists(place), f"{place} is gone: docs/twins_rules.toml"
    assert make_page.marks().get(rule.id), "no test bears this mark"


@pytest.mark.parametrize("rule", RULES.values(), ids=RULES)
def test_what_was_open_is_explained_in_the_code(rule: make_page.Rule) -> None:
    explained = {point.place for point in make_page.open_points()}
    assert rule.open or rule.id not in SILENT
    for place in rule.open:
        assert place in explained, f"nothing begins with OPEN at {place}: docs/twins_rules.toml"


def test_readings_are_known_and_used() -> None:
    used = {name for rule in RULES.values() for name in rule.readings}
    assert used == set(make_page.readings())


def test_the_page_is_up_to_date(tmp_path: Path) -> None:
    assert make_page.main([]) == 2
    assert make_page.main([str(tmp_path / "page.md")]) == 0
    made = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert make_page.PAGE.read_text(encoding="utf-8") == made, "docs/twins.md is out of date: run 'make generate'"


def test_the_page_shows_every_choice_and_every_picture() -> None:
    page = make_page.text()
    for point in make_page.open_points():
        assert point.text in page
    for name in (make_plots.MAINS_FAILURE, make_plots.TIME_TO_FEATHER):
        assert f"(img/{name})" in page
        assert (make_page.PAGE.parent / "img" / name).is_file()


def test_choices_are_read_whole() -> None:
    text = "Some.\n\n    OPEN what a 0 does; it counts\n    as 1. OPEN: another.\n\nMore. No reaction. OPEN; it stops."
    assert list(make_page.choices(text)) == [
        "what a 0 does; it counts as 1.",
        "another.",
        "No reaction; it stops.",
    ]
