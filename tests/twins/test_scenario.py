"""Scenario files: what they say, and what they are told where they say it wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.errors import UsageError
from app.model.address import Address
from app.model.fault import FaultOrder
from app.twins.scenario import (
    Clear,
    Control,
    MasterDo,
    MasterOrder,
    Preset,
    Unit,
    load_scenario,
    read_scenario,
)
from app.wire.nmt import NmtCommand

HEAD = 'title = "t"\nduration_s = 60\n'
WHOLE = """
title = "Everything"
note = "Look at blade 2."
seed = 42
duration_s = 60.0

[start]
angle_deg = 3.5
wind_mps = 11
operational = true
controller = true

[[parameters]]
blade = 2
device = "pmc"
address = "60FB:01"
raw = 2
save = true

[[parameters]]
device = "pmm"
address = "30E0"
raw = 5000

[[event]]
at_s = 20
clear = "bloc_weak"
blade = 2

[[event]]
at_s = 5.5
fault = "bloc_weak"
blade = 2
bloc = 3
for_s = 10

[[event]]
at_s = 5.5
clear = true

[[event]]
at_s = 25
controller = { angle_deg = 45.0 }

[[event]]
at_s = 30
master = { do = "write", node = 12, address = "60FB:01", raw = 17 }

[[event]]
at_s = 31
master = { do = "save", node = 12 }

[[event]]
at_s = 32
master = { do = "nmt", node = 0, command = "start" }
"""


def test_everything_that_a_scenario_can_say() -> None:
    scenario = read_scenario(WHOLE, "s.toml")
    assert (scenario.title, scenario.seed, scenario.duration_ns) == ("Everything", 42, 60_000_000_000)
    assert scenario.note == "Look at blade 2."
    start = scenario.start
    assert (start.angle_deg, start.wind_mps, start.operational, start.controller) == (3.5, 11.0, True, True)
    assert scenario.presets == (
        Preset(Unit.PMC, Address(0x60FB, 1), 2, blade=2, save=True),
        Preset(Unit.PMM, Address(0x30E0), 5000),
    )
    assert [event.at_ns / 1e9 for event in scenario.events] == [5.5, 5.5, 20, 25, 30, 31, 32]
    fault, clear, clear_one, control, write, save, nmt = (event.action for event in scenario.events)
    assert isinstance(fault, FaultOrder)
    assert (fault.blade, fault.seconds, fault.values["bloc"], fault.values["ohm_factor"]) == (2, 10, 3, 5.0)
    assert clear == Clear()
    assert clear_one == Clear("bloc_weak", blade=2)
    assert control == Control({"angle_deg": 45.0})
    assert write == MasterOrder(MasterDo.WRITE, 12, Address(0x60FB, 1), 17)
    assert save == MasterOrder(MasterDo.SAVE, 12)
    assert nmt == MasterOrder(MasterDo.NMT, 0, command=NmtCommand.START)


def test_a_clear_covers_what_it_names() -> None:
    order = FaultOrder("bloc_weak", blade=2)
    assert Clear().covers(order)
    assert Clear("bloc_weak", blade=2).covers(order)
    assert not Clear("bloc_weak", blade=1).covers(order)
    assert not Clear("gust").covers(order)
    assert not Clear(node=2).covers(order)


def test_little_is_enough() -> None:
    scenario = read_scenario(HEAD, "s.toml")
    assert (scenario.seed, scenario.events, scenario.start.angle_deg) == (0, (), None)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("title = 'x'\nduration_s = = 3\n", ("s.toml: line 2",)),
        ("duration_s = 60\n", ("field 'title'", "missing")),
        ("title = 't'\n", ("field 'duration_s'", "missing")),
        ("title = 't'\nduration_s = 0\n", ("field 'duration_s'", "0.1")),
        ("title = 't'\nduration_s = nan\n", ("field 'duration_s'",)),
        ("title = 't'\nduration_s = 5\nspeed = 3\n", ("field 'speed'", "not known")),
        (HEAD + "seed = -1\n", ("field 'seed'",)),
        (HEAD + "seed = true\n", ("field 'seed'",)),
        (HEAD + "start = 3\n", ("field 'start'",)),
        (HEAD + "[start]\nwind = 3\n", ("start: field 'wind'",)),
        (HEAD + "[start]\nwind_mps = 99\n", ("start: field 'wind_mps'",)),
        (HEAD + "[start]\noperational = 1\n", ("start: field 'operational'",)),
        (HEAD + "[parameters]\nblade = 1\n", ("field 'parameters'", "[[parameters]]")),
        (HEAD + "[[parameters]]\ndevice = 'pmd'\n", ("parameters 1: field 'device'", "pmm, pmc")),
        (HEAD + "[[parameters]]\ndevice = 'pmc'\naddress = '3/4'\n", ("parameters 1: field 'address'",)),
        (HEAD + "[[parameters]]\ndevice = 'pmc'\naddress = 'x'\n", ("parameters 1: field 'address'",)),
        (HEAD + "[[parameters]]\ndevice = 'pmc'\naddress = '6081'\n", ("parameters 1: field 'raw'", "missing")),
        (HEAD + "[[parameters]]\ndevice = 'pmc'\naddress = '6081'\nraw = 1\nblade = 4\n", ("field 'blade'",)),
        (HEAD + "[[event]]\nat_s = 1\n", ("event 1: field 'fault'", "missing")),
        (HEAD + "[[event]]\nat_s = 61\nclear = true\n", ("event 1: field 'at_s'", "60")),
        (HEAD + "[[event]]\nclear = true\n", ("event 1: field 'at_s'", "missing")),
        (HEAD + "[[event]]\nat_s = 1\nclear = true\n[[event]]\nat_s = 'x'\n", ("event 2: field 'at_s'",)),
        (HEAD + "[[event]]\nat_s = 1\nclear = true\nfault = 'gust'\n", ("event 1: field 'fault'", "clear")),
        (HEAD + "[[event]]\nat_s = 1\nclear = false\n", ("event 1: field 'clear'",)),
        (HEAD + "[[event]]\nat_s = 1\nclear = 'flood'\n", ("event 1: field 'clear'",)),
        (HEAD + "[[event]]\nat_s = 1\nclear = true\nkind = 'gust'\n", ("event 1: field 'kind'", "not known")),
        (HEAD + "[[event]]\nat_s = 1\nfault = 'flood'\n", ("event 1: field 'kind'", "'flood' is no fault")),
        (HEAD + "[[event]]\nat_s = 1\nfault = 'gust'\ndepth = 3\n", ("event 1: field 'depth'", "no such value")),
        (HEAD + "[start]\ncontroller = true\n[[event]]\nat_s = 1\ncontroller = 3\n", ("event 1: field 'controller'",)),
        (HEAD + "[[event]]\nat_s = 1\ncontroller = { run = true }\n", ("event 1: field 'controller'", "start")),
        (HEAD + "[[event]]\nat_s = 1\nmaster = { do = 'sing', node = 1 }\n", ("event 1: master: field 'do'",)),
        (HEAD + "[[event]]\nat_s = 1\nmaster = { do = 'read', node = 1 }\n", ("event 1: master: field 'address'",)),
        (HEAD + "[[event]]\nat_s = 1\nmaster = { do = 'save', node = 0 }\n", ("event 1: master: field 'node'",)),
        (HEAD + "[[event]]\nat_s = 1\nmaster = { do = 'save', node = 1, raw = 3 }\n", ("master: field 'raw'",)),
        (HEAD + "[[event]]\nat_s = 1\nmaster = { do = 'nmt', node = 1, command = 'go' }\n", ("field 'command'",)),
        (HEAD + "#" * 300_000, ("longer",)),
    ],
)
def test_what_is_wrong_is_told_with_its_place(text: str, told: tuple[str, ...]) -> None:
    with pytest.raises(UsageError) as caught:
        read_scenario(text, "s.toml")
    reason = caught.value.details["reason"]
    assert reason.startswith("s.toml: ")
    assert all(part in reason for part in told), reason


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    for name in ("missing.toml", "binary.toml"):
        with pytest.raises(UsageError) as caught:
            load_scenario(tmp_path / name)
        assert name in caught.value.details["reason"]


def test_a_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "whole.toml"
    path.write_text(WHOLE, encoding="utf-8")
    assert load_scenario(path) == read_scenario(WHOLE, "other")
