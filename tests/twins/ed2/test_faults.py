"""Faults: how they are written, and what each of them does to the device."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.errors import UsageError
from app.model.description_file import load_builtin
from app.twins.ed2.device import Ed2, Settings
from app.twins.ed2.faults import KINDS, ON_AXIS, FaultPlan, Order, parse_order
from app.wire.profibus import dp
from app.wire.profibus.pkw import PkwError
from app.wire.profibus.telegrams import ERROR_CODE
from tests.twins.ed2.rig import MS, Rig, made

RUN, START = 0x7, 0x2000


def with_plan() -> tuple[Rig, FaultPlan]:
    rig = made()
    rig.master.start(102)
    plan = FaultPlan([rig.device], lambda fault: setattr(rig.line, "fault", fault))
    plan.run_until(rig.line.now_ns)
    live = rig.line.on_time

    def pass_on(t_ns: int) -> None:
        plan.run_until(t_ns)
        live(t_ns)

    rig.line.on_time = pass_on
    return rig, plan


def test_an_order_is_read_from_text() -> None:
    assert parse_order("sensor_wire@5s,axis=2") == Order("sensor_wire", None, 2, 0.0, 5.0)
    assert parse_order("supply,value=12.5,slave=7,for_s=3") == Order("supply", 7, None, 12.5, 0.0, 3.0)
    assert parse_order("answers_lost@1.5s") == Order("answers_lost", None, None, 5.0, 1.5)


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("fire", "fault"),
        ("sensor_wire", "axis"),
        ("sensor_wire,axis=3", "axis"),
        ("supply,axis=1", "axis"),
        ("supply,value=61", "value"),
        ("sensor_wire,axis=1,value=2", "value"),
        ("supply,volt=2", "volt"),
        ("supply,value=x", "value"),
        ("supply@-1s", "at_s"),
        ("answers_lost,slave=6", "slave"),
        ("supply,for_s=nan", "for_s"),
    ],
)
def test_what_makes_no_sense_is_refused_by_its_field(text: str, field: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_order(text)
    assert caught.value.details["field"] == field


def test_a_slave_that_is_not_there_has_no_faults() -> None:
    device = Ed2(load_builtin("wandfluh-ed2"), Settings(address=6))
    with pytest.raises(UsageError):
        FaultPlan([device], lambda _: None).add(parse_order("supply,slave=7"))


@pytest.mark.parametrize(
    ("order", "code"),
    [
        ("sensor_wire,axis=1", 0x5232),
        ("sensor_values,axis=2", 0x5235),
        ("magnet_a_wire,axis=1", 0x5411),
        ("limit_negative_wire,axis=1", 0x5212),
        ("limit_positive_wire,axis=1", 0x5211),
        ("supply", 0x5100),
        ("pressure", 0x8230),
    ],
)
def test_it_begins_at_its_time_tells_its_code_and_ends(order: str, code: int) -> None:
    rig, plan = with_plan()
    master = rig.master
    kind, *more = order.split(",")
    master.write("0/40", 9)
    master.set(RUN | START, 250_000)
    plan.add(parse_order(",".join([f"{kind}@0.2s", *more, "for_s=3"])))
    master.set(RUN | START, 450_000)
    master.advance(100)
    assert master.seen[0][ERROR_CODE] == 0
    master.until(lambda: master.seen[0][ERROR_CODE] == code)
    master.advance(3_500, every=50)
    for word in (0, 0x8, 0):
        master.set(word)
    assert master.seen[0][ERROR_CODE] == 0
    assert master.set(RUN, 250_000) & 0xF == 0xF


def test_without_the_release_the_axis_is_let_go_without_an_error() -> None:
    rig, plan = with_plan()
    rig.master.write("0/40", 9)
    rig.master.set(RUN, 250_000)
    plan.add(parse_order("release"))
    rig.master.until(lambda: rig.master.status & 0xF == 0x9)
    assert rig.master.seen[0][ERROR_CODE] == 0


def test_a_memory_that_takes_nothing_refuses_the_save() -> None:
    rig, plan = with_plan()
    plan.add(parse_order("eeprom_failing,for_s=2"))
    rig.master.advance(10)
    assert rig.master.refused(lambda: rig.master.write("0/51", 0x73617665)) is PkwError.OTHER
    rig.master.advance(2_000, every=50)
    rig.master.write("0/51", 0x73617665)


def test_a_slow_memory_answers_late() -> None:
    rig, plan = with_plan()
    plan.add(parse_order("eeprom_slow,value=1.5"))
    rig.master.advance(10)
    began_ns = rig.line.now_ns
    rig.master.write("0/51", 0x73617665)
    assert rig.line.now_ns - began_ns >= 1_500 * MS


def test_power_goes_and_comes_back() -> None:
    rig, plan = with_plan()
    plan.add(parse_order("power,for_s=1"))
    rig.master.wire.wait(10)
    assert not rig.device.slave.powered
    rig.master.wire.wait(1_500)
    rig.master.start(1)


def test_answers_are_lost_and_then_they_are_not() -> None:
    rig, plan = with_plan()
    plan.add(parse_order("answers_lost,value=100,for_s=1"))
    rig.master.wire.wait(10)
    assert rig.master.send(dp.FdlStatus()) == []
    rig.master.wire.wait(1_000)
    assert rig.line.fault is None
    rig.master.exchange()


def test_every_kind_begins_and_ends() -> None:
    rig, plan = with_plan()
    for kind in KINDS:
        plan.add(parse_order(f"{kind}{',axis=1' if kind in ON_AXIS else ''},for_s=0.1"))
    seen = set()
    for _ in range(150):
        rig.master.wire.wait(10)
        seen.add((rig.device.slave.powered, rig.line.fault is None))
    assert {powered for powered, _ in seen} == {quiet for _, quiet in seen} == {True, False}
    assert rig.line.fault is None
    rig.master.start(1)
    for word in (0, 0x8, 0):
        rig.master.set(word, 0)
    assert rig.master.read("0/36") == 0


def test_the_page_of_the_twin_names_every_kind() -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "twin-ed2.md").read_text(encoding="utf-8")
    assert [kind for kind in KINDS if f"`{kind}`" not in page] == []
