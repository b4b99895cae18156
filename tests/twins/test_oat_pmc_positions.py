"""Positions of the PMC over the wire: scaling, polarity, encoders, 16-bit mirrors, touch probe."""

from __future__ import annotations

from fractions import Fraction

import pytest

from app.twins.axis_scaling import motor_scaling, units_per_increment
from tests.twins.harness import MS
from tests.twins.oat_rig import SHUTDOWN, BladeRig


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


@pytest.mark.rule("N1")
@pytest.mark.rule("N2")
def test_scaling_of_the_worked_example(rig: BladeRig) -> None:
    scaling = motor_scaling(rig.pmc.device.store)
    assert scaling.units_per_increment == Fraction(375, 18056)
    assert 1 / float(scaling.units_per_increment) == pytest.approx(48.14933, abs=5e-6)
    assert float(scaling.units_per_turn) == pytest.approx(21.26717, abs=5e-6)
    assert 36000 / scaling.units_per_increment == 1733376
    before = rig.blade.axis.encoder_increments
    rig.enable()
    rig.move(7000)
    assert before - rig.blade.axis.encoder_increments == pytest.approx(1733376 / 36, abs=60)


@pytest.mark.rule("N3")
@pytest.mark.parametrize(("bevel", "increments"), [(12, Fraction(9472)), (15, Fraction(75776, 10))])
def test_scaling_of_the_additional_encoder(bevel: int, increments: Fraction) -> None:
    assert 36000 / units_per_increment(Fraction(1024), Fraction(111, bevel), Fraction(36000)) == increments


@pytest.mark.rule("N4")
def test_scaling_by_default() -> None:
    assert units_per_increment(Fraction(512), Fraction(1), Fraction(36000)) == Fraction(703125, 10000)


@pytest.mark.rule("N1")
def test_other_units_by_the_feed_constant(rig: BladeRig) -> None:
    rig.put("6092:01", 3600)
    rig.put("6060", 6)
    rig.put("607C", rig.get("607C") // 10)
    assert rig.get("6064") == pytest.approx(800, abs=1)


@pytest.mark.rule("M11")
def test_polarity_looks_at_bit_7_only(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.put("607C", 0)
    plain = rig.get("6064")
    rig.pmc.device.store.cell(0x607E).raw = 0x40
    rig.pmc.drive.refresh()
    assert rig.get("6064") == plain
    rig.put("607E", 0xC0)
    assert rig.get("6064") == -plain


@pytest.mark.rule("M11")
def test_polarity_of_the_additional_encoder(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.put("687C", 0)
    plain = rig.get("6864")
    rig.pmc.device.store.cell(0x687E).raw = 0x40
    rig.pmc.drive.refresh_blade()
    assert rig.get("6864") == plain
    rig.put("687E", 0xC0)
    assert rig.get("6864") == -plain


@pytest.mark.rule("M11")
def test_a_negative_polarity_turns_the_reference_too(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.put("607E", 0xC0)
    rig.put("607A", 5000)
    rig.command(SHUTDOWN, SHUTDOWN | 0x10)
    rig.enable()
    rig.move(5300)
    assert rig.get("6064") == pytest.approx(5300, abs=2)
    assert rig.angle_deg == pytest.approx(77.0, abs=0.05)


@pytest.mark.rule("M10")
def test_the_additional_encoder_can_control_the_position(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.put("687C", rig.get("687C") + 300)
    rig.put("606A", -1)
    assert rig.get("6064") == rig.get("6864") == 8300
    rig.enable()
    rig.move(8000)
    assert rig.get("6864") == pytest.approx(8000, abs=6)
    assert rig.angle_deg == pytest.approx(77.0, abs=0.1)


@pytest.mark.rule("M10")
def test_sensor_selection(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.put("687C", rig.get("687C") + 30)
    assert (rig.get("6064"), rig.get("6864"), rig.get("68F4")) == (8000, 8030, -30)
    rig.put("606A", -1)
    assert (rig.get("6064"), rig.get("6864"), rig.get("68F4")) == (8030, 8030, -30)
    rig.put("606A", 0)
    rig.put("6060", 1)
    rig.enable()
    rig.go(7000)
    rig.master.run(500 * MS)
    assert rig.refused("606A", -1) == 0x08000022


@pytest.mark.rule("M12")
def test_blade_encoder_simulation(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.put("687C", 0)
    assert rig.get("6864") != rig.get("6064")
    rig.put("5894", 0xFF)
    assert rig.get("6864") == rig.get("6064")


@pytest.mark.rule("A6")
@pytest.mark.parametrize(("mirror", "of"), [("507A", "607A"), ("5081", "6081"), ("5083", "6083"), ("5084", "6084"),
                                            ("50B0", "60B0"), ("50B1", "60B1"), ("50FF", "60FF")])  # fmt: skip
def test_mirrors_show_and_write_their_object(rig: BladeRig, mirror: str, of: str) -> None:
    rig.put(mirror, 1234)
    assert rig.get(of) == 1234
    rig.put(of, 4321)
    assert rig.get(mirror) == 4321


@pytest.mark.rule("A6")
@pytest.mark.parametrize(("mirror", "of"), [("5064", "6064"), ("5864", "6864"), ("506C", "606C"), ("58F4", "68F4")])
def test_mirrors_of_actual_values(rig: BladeRig, mirror: str, of: str) -> None:
    assert rig.get(mirror) == rig.get(of)
    assert rig.refused(mirror, 1) == 0x06010002


@pytest.mark.rule("A7")
def test_the_dc_link_mirror_is_in_volt(rig: BladeRig) -> None:
    assert rig.get("5079") == rig.get("6079") // 1000
    assert 540 < rig.get("5079") < 590


@pytest.mark.rule("A9")
def test_a_mirror_is_held_at_its_limit(rig: BladeRig) -> None:
    rig.put("607A", 36000)
    assert rig.get("507A") == 32767
    rig.put("607A", -36000)
    assert rig.get("507A") == -32768


@pytest.mark.rule("A10")
def test_a_mirror_is_saved_through_its_object(rig: BladeRig) -> None:
    rig.put("5083", 777)
    rig.put("5081", 888)
    rig.save()
    rig.restart()
    assert (rig.get("6083"), rig.get("5083"), rig.get("6081")) == (777, 777, 0)


@pytest.mark.rule("M13")
def test_touch_probe_keeps_the_position_of_each_edge(rig: BladeRig) -> None:
    rig.pmc.inputs.probe = True
    rig.master.run(50 * MS)
    assert (rig.get("60BA"), rig.get("60BB")) == (8000, 0)
    rig.enable()
    rig.move(7900)
    rig.pmc.inputs.probe = False
    rig.master.run(50 * MS)
    assert rig.get("60BA") == 8000
    assert rig.get("60BB") == pytest.approx(7900, abs=2)


@pytest.mark.rule("M13")
@pytest.mark.parametrize("late_ms", [1, 2, 3, 4])
def test_touch_probe_is_as_exact_as_1_ms_of_motion(rig: BladeRig, late_ms: int) -> None:
    rig.enable()
    rig.go(2000)
    rig.master.run(1500 * MS)
    rig.blade.advance(rig.line.now_ns)
    before = rig.pmc.drive.position
    rig.line.run_until(rig.line.now_ns + late_ms * MS)
    rig.pmc.inputs.probe = True
    assert rig.get("60BA") == pytest.approx(before - 0.8 * late_ms, abs=0.9)  # 800 units/s
