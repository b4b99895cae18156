"""From increments to position units, and what follows from it (manual, 5.5, 5.6, 5.10.2.3; the worked examples)."""

from __future__ import annotations

from fractions import Fraction
from math import exp

import pytest

from app.model.description_file import load_builtin
from app.twins.axis_kernel import BLADE_RAD_S, MOTOR_RAD_S, SPEED_FILTERED
from app.twins.axis_scaling import (
    blade_scaling,
    highest_profile_velocity,
    interpolation_ms,
    motor_scaling,
    units_per_increment,
)
from app.twins.object_store import ObjectStore
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import BladeRig

PITCH = {(0x608F, 1): 1024, (0x6091, 1): 183 * 111, (0x6091, 2): 12}


@pytest.fixture
def store() -> ObjectStore:
    """All objects with their printed defaults."""
    return ObjectStore(load_builtin("oat-pmc"), 11)


def give(store: ObjectStore, values: dict[tuple[int, int], int]) -> None:
    for (index, sub), raw in values.items():
        store.cell(index, sub).raw = raw


@pytest.mark.rule("N1")
def test_position_units_per_increment(store: ObjectStore) -> None:
    give(store, {(0x608F, 1): 2000, (0x608F, 2): 4, (0x6091, 1): 30, (0x6091, 2): 7, (0x6092, 1): 125, (0x6092, 2): 10})
    feed, resolution, gear = Fraction(125, 10), Fraction(2000, 4), Fraction(30, 7)
    assert motor_scaling(store).units_per_increment == feed / (resolution * gear)
    give(store, {(0x688F, 1): 2000, (0x688F, 2): 4, (0x6891, 1): 30, (0x6891, 2): 7, (0x6892, 1): 125, (0x6892, 2): 10})
    assert blade_scaling(store).units_per_increment == feed / (resolution * gear)


@pytest.mark.rule("N2")
def test_the_pitch_example(store: ObjectStore) -> None:
    give(store, PITCH)
    scaling = motor_scaling(store)
    assert scaling.units_per_increment == Fraction(375, 18056)
    assert float(scaling.units_per_increment) == pytest.approx(0.02076872, abs=5e-9)
    assert 1 / float(scaling.units_per_increment) == pytest.approx(48.14933, abs=5e-6)
    assert float(scaling.units_per_turn) == pytest.approx(21.26717, abs=5e-6)
    assert 36000 / scaling.units_per_increment == 1733376
    assert scaling.position(433344) == pytest.approx(9000)


@pytest.mark.rule("N2")
def test_the_axis_moves_by_the_pitch_example() -> None:
    rig = BladeRig()
    before = rig.blade.axis.encoder_increments
    rig.enable()
    rig.move(7000)
    assert before - rig.blade.axis.encoder_increments == pytest.approx(1733376 / 36, abs=500)


@pytest.mark.rule("N3")
@pytest.mark.parametrize(("bevel", "increments"), [(12, Fraction(9472)), (15, Fraction(75776, 10))])
def test_the_additional_encoder(store: ObjectStore, bevel: int, increments: Fraction) -> None:
    give(store, {(0x688F, 1): 1024, (0x6891, 1): 111, (0x6891, 2): bevel})
    assert 36000 / blade_scaling(store).units_per_increment == increments


@pytest.mark.rule("N4")
def test_scaling_by_default(store: ObjectStore) -> None:
    assert motor_scaling(store).units_per_increment == Fraction(703125, 10000)
    assert units_per_increment(Fraction(512), Fraction(1), Fraction(36000)) == Fraction(703125, 10000)


@pytest.mark.rule("N5")
@pytest.mark.rule("N6")
def test_highest_profile_velocity_by_default_and_of_the_pitch_example(store: ObjectStore) -> None:
    assert highest_profile_velocity(store) == 1_800_000
    assert store.number(0x607F) <= highest_profile_velocity(store)
    give(store, PITCH)
    assert float(highest_profile_velocity(store)) == pytest.approx(1063.36, abs=5e-3)
    assert store.number(0x607F) / highest_profile_velocity(store) == pytest.approx(18.8, abs=0.01)


@pytest.mark.rule("N5")
def test_highest_profile_velocity_takes_the_feed_of_the_selected_encoder_and_the_gear_of_the_motor(
    store: ObjectStore,
) -> None:
    give(store, {**PITCH, (0x6892, 1): 3600, (0x6891, 1): 111, (0x6891, 2): 15})
    before = highest_profile_velocity(store)
    give(store, {(0x606A, 0): -1})
    assert highest_profile_velocity(store) == before / 10
    give(store, {(0x6080, 0): 1500})
    assert highest_profile_velocity(store) == before / 20


@pytest.mark.rule("N5")
@pytest.mark.rule("M15")
def test_a_velocity_beyond_the_formula_is_held_by_the_motor_speed() -> None:
    rig = BladeRig()
    rig.put("607F", 20_000)
    rig.put("60C5", 20_000)
    rig.put("6083", 20_000)
    rig.put("6065", 0xFFFFFFFF)
    rig.enable(velocity=1500)
    rig.go(1000)
    rig.master.run(2 * SECOND)
    assert rig.pmc.drive.profile.velocity == -1500
    assert rig.get("606C") == pytest.approx(-1063.36, rel=0.02)
    assert rig.get("6044") == pytest.approx(-3000, rel=0.02)
    assert rig.get("60F4") < -100


@pytest.mark.rule("K13")
@pytest.mark.parametrize(("value", "index", "ms"), [(1, -3, 1), (20, -3, 20), (2, -2, 20), (100, -5, 1), (1, 0, 1000)])
def test_interpolation_period(value: int, index: int, ms: int) -> None:
    assert interpolation_ms(value, index) == ms


@pytest.mark.rule("N8")
@pytest.mark.parametrize(("value", "time_ms"), [(0, 1), (1, 2), (3, 8), (5, 32), (6, 64)])
def test_filter_time_of_the_speed(value: int, time_ms: int) -> None:
    """An axis without torque is given a speed at once; after the filter time the controller is told 63 % of it."""
    rig = BladeRig()
    rig.put("60F9:05", value)
    for sub in ("01", "02", "03"):
        rig.put(f"60F9:{sub}", 0)
    rig.enable(mode=9)
    rig.master.run(100 * MS)
    rig.blade.advance(rig.line.now_ns)
    s = rig.blade.axis.s
    s[MOTOR_RAD_S] = s[BLADE_RAD_S] = 200.0
    rig.master.run(time_ms * MS)
    rig.blade.advance(rig.line.now_ns)
    assert s[SPEED_FILTERED] / s[MOTOR_RAD_S] == pytest.approx(1 - exp(-1), abs=0.05)
