"""Scenario files of ED2 twins: what is read, and how what makes no sense is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.errors import UsageError
from app.twins.ed2.faults import Order
from app.twins.ed2.scenario import Scenario, load_scenario, read_scenario

TEXT = """
title = "A wire breaks"
seed = 3
duration_s = 60.0

[[event]]
at_s = 10
fault = "sensor_wire"
axis = 1
for_s = 5.0

[[event]]
fault = "pressure"
slave = 7
value = 12.5
"""


def test_a_scenario_is_read(tmp_path: Path) -> None:
    expected = Scenario(
        "A wire breaks",
        3,
        60.0,
        (Order("sensor_wire", None, 1, 0.0, 10.0, 5.0), Order("pressure", 7, None, 12.5)),
    )
    assert read_scenario(TEXT, "x.toml") == expected
    path = tmp_path / "x.toml"
    path.write_text(TEXT, encoding="utf-8")
    assert load_scenario(path) == expected


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ('title = "A wire breaks"', "", "title"),
        ("seed = 3", "seed = -1", "seed"),
        ("seed = 3", "sead = 3", "sead"),
        ("duration_s = 60.0", "duration_s = 5.0", "at_s"),
        ("duration_s = 60.0", "", "duration_s"),
        ("axis = 1", "axis = 3", "axis"),
        ("axis = 1", 'axis = "one"', "axis"),
        ('"pressure"', '"pressures"', "fault"),
        ('fault = "pressure"', "", "fault"),
        ("value = 12.5", "value = -1", "value"),
        ("value = 12.5", "volt = 12.5", "volt"),
    ],
)
def test_what_is_wrong_is_told_with_its_field(old: str, new: str, field: str) -> None:
    with pytest.raises(UsageError) as caught:
        read_scenario(TEXT.replace(old, new), "x.toml")
    assert caught.value.details["field"] == field
    assert "x.toml" in str(caught.value.details["reason"])


@pytest.mark.parametrize(
    "text", ["title = ", "event = 1\ntitle='x'\nduration_s=1", "event = [1]\ntitle='x'\nduration_s=1"]
)
def test_what_is_no_scenario_is_told(text: str) -> None:
    with pytest.raises(UsageError):
        read_scenario(text, "x.toml")


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError):
        load_scenario(tmp_path / "none.toml")
