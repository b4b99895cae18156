"""Modes of the PMC: which there are, when they change, what each does with its set-points (manual, 5.9 to 5.14)."""

from __future__ import annotations

from itertools import pairwise

import pytest

from app.twins.cia402 import State
from app.twins.plant import BrakeFault
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import (
    DISABLE_VOLTAGE,
    ENABLE,
    NEW_TARGET,
    PMC,
    SHUTDOWN,
    START,
    SWITCH_ON,
    BladeRig,
)

REACHED, LIMIT, BIT_12, BIT_13 = 10, 11, 12, 13
MODES = (1, 3, 6, 8, 9, -113)
DEVICE_STATE, INCOMPATIBLE, VALUE_RANGE, TOO_LOW = 0x08000022, 0x06040043, 0x06090030, 0x06090032


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


def speeds(rig: BladeRig, duration_ns: int, step_ns: int = 10 * MS) -> list[float]:
    """Velocity set-points in units/s, one for each step."""
    found = []
    for _ in range(duration_ns // step_ns):
        rig.master.run(step_ns)
        rig.blade.advance(rig.line.now_ns)
        found.append(rig.pmc.drive.profile.velocity)
    return found


# -- choosing a mode (K1 to K3) ---------------------------------------------------------------


@pytest.mark.rule("K1")
def test_a_mode_changes_only_with_bit_3_of_the_controlword_and_bit_2_of_the_statusword_0(rig: BladeRig) -> None:
    rig.put("6060", 1)
    rig.command(ENABLE)
    assert rig.refused("6060", 3) == DEVICE_STATE
    rig.pmc.inputs.enable = False
    rig.wait_state(State.SWITCH_ON_DISABLED)
    assert rig.refused("6060", 3) == DEVICE_STATE  # bit 3 of the controlword still stands
    rig.command(DISABLE_VOLTAGE)
    assert rig.refused("6060", 3) == DEVICE_STATE  # 010Ch has it, too
    assert rig.get("6061") == 1
    rig.command(SHUTDOWN)
    rig.put("6060", 3)
    assert rig.get("6061") == 3


@pytest.mark.rule("K1")
def test_a_mode_that_a_pdo_brings_too_late_is_not_taken(rig: BladeRig) -> None:
    rig.put("1601:00", 0)
    rig.put("1601:01", 0x60600008)
    rig.put("1601:00", 1)
    rig.put("1401:01", 0x300 + PMC)
    rig.operational()
    rig.master.send(0x300 + PMC, b"\x03")
    rig.master.run(5 * MS)
    assert rig.get("6061") == 3
    rig.command(ENABLE)
    rig.master.send(0x300 + PMC, b"\x01")
    rig.master.run(5 * MS)
    assert (rig.get("6060"), rig.get("6061")) == (3, 3)


@pytest.mark.rule("K2")
@pytest.mark.rule("K3")
def test_the_modes_that_there_are(rig: BladeRig) -> None:
    assert rig.get("6502") == 0x1A5
    assert rig.get("6061") == 0
    for mode in MODES:
        rig.put("6060", mode)
        assert rig.get("6061") == mode
        rig.put("6060", 0)  # no change
        assert rig.get("6061") == mode


@pytest.mark.rule("K2")
@pytest.mark.parametrize("mode", [-128, -1, 2, 4, 5, 7, 10, 127])
def test_other_modes_are_not_accepted(rig: BladeRig, mode: int) -> None:
    rig.put("6060", 3)
    assert rig.refused("6060", mode) == VALUE_RANGE
    assert (rig.get("6060"), rig.get("6061")) == (3, 3)


@pytest.mark.rule("K2")
def test_without_a_mode_nothing_moves(rig: BladeRig) -> None:
    rig.enable(mode=0)
    rig.put("60FF", -500)
    rig.go(7000)
    rig.master.run(SECOND)
    assert rig.angle_deg == pytest.approx(80.0, abs=0.01)


# -- profile position (K4 to K9) --------------------------------------------------------------


@pytest.mark.rule("K4")
def test_a_target_is_taken_by_the_edge_only(rig: BladeRig) -> None:
    rig.enable()
    rig.put("607A", 7900)
    rig.command(START, NEW_TARGET)
    rig.wait_bit(REACHED)
    rig.put("607A", 7000)
    rig.command(NEW_TARGET)
    rig.master.run(SECOND)
    assert rig.get("6064") == pytest.approx(7900, abs=2)
    rig.command(START, NEW_TARGET)
    assert not rig.bit(REACHED)


@pytest.mark.rule("K4")
def test_bit_12_falls_when_bit_4_has_fallen(rig: BladeRig) -> None:
    rig.enable()
    rig.put("607A", 7900)
    rig.command(START, NEW_TARGET)
    rig.wait_bit(REACHED)
    assert rig.bit(BIT_12)
    rig.command(START)
    assert not rig.bit(BIT_12)


@pytest.mark.rule("K4")
def test_a_third_target_is_not_taken_while_one_waits(rig: BladeRig) -> None:
    rig.enable()
    for target in (7500, 7800, 7000):
        rig.put("607A", target)
        rig.command(START, NEW_TARGET)
    rig.command(START)
    assert rig.bit(BIT_12)
    rig.wait_bit(BIT_12, False)
    rig.wait_bit(REACHED)
    assert rig.get("6064") == pytest.approx(7800, abs=2)


@pytest.mark.rule("K5")
@pytest.mark.parametrize("bit", [5, 6, 9])
def test_a_target_with_a_bit_that_must_be_0_is_not_taken(rig: BladeRig, bit: int) -> None:
    """Relative (bit 6) would be 79.5 degrees, change on the fly (bits 5 and 9) would leave out the first target."""
    rig.enable()
    rig.go(7900)
    rig.put("607A", -50)
    rig.command(START | 1 << bit, NEW_TARGET | 1 << bit)
    assert not rig.bit(BIT_12)
    rig.command(START)
    rig.wait_bit(REACHED)
    assert rig.get("6064") == pytest.approx(7900, abs=2)
    rig.put("607A", 7950)
    rig.command(NEW_TARGET)
    assert rig.bit(BIT_12)
    rig.wait_bit(REACHED)
    assert rig.get("6064") == pytest.approx(7950, abs=2)


@pytest.mark.rule("K6")
def test_a_target_given_under_halt_waits_for_its_end(rig: BladeRig) -> None:
    rig.enable()
    rig.put("607A", 7800)
    rig.command(ENABLE | 0x10)
    assert rig.bit(BIT_12)
    rig.master.run(500 * MS)
    assert rig.angle_deg == pytest.approx(80.0, abs=0.01)
    rig.command(START)
    rig.wait_bit(REACHED)
    assert rig.get("6064") == pytest.approx(7800, abs=2)


@pytest.mark.rule("K6")
def test_without_a_target_the_end_of_halt_starts_nothing(rig: BladeRig) -> None:
    rig.put("607A", 7000)
    rig.enable()
    rig.command(START, ENABLE, START)
    rig.master.run(500 * MS)
    assert rig.angle_deg == pytest.approx(80.0, abs=0.01)


@pytest.mark.rule("K6")
def test_a_target_given_while_halted_on_the_way_comes_after_the_old_one(rig: BladeRig) -> None:
    rig.enable()
    rig.go(7000)
    rig.run_until(lambda: rig.angle_deg < 77)
    rig.command(ENABLE)
    rig.wait_bit(REACHED)
    assert rig.angle_deg > 71
    rig.put("607A", 7800)
    rig.command(ENABLE | 0x10, START)
    lowest = 80.0
    while rig.get("606C") < 100:  # as long as it is not on the way up
        rig.master.run(20 * MS)
        lowest = min(lowest, rig.angle_deg)
    assert lowest == pytest.approx(70.0, abs=0.1)
    rig.wait_bit(REACHED)
    assert rig.get("6064") == pytest.approx(7800, abs=2)


@pytest.mark.rule("K7")
@pytest.mark.rule("J11")
@pytest.mark.parametrize(("target", "reached"), [(-500, 7700), (36001, 8300)])
def test_a_target_beyond_a_limit_ends_there(rig: BladeRig, target: int, reached: int) -> None:
    rig.put("607D:01", 7700)
    rig.put("607D:02", 8300)
    rig.enable()
    rig.move(target)
    assert rig.bit(LIMIT)
    assert rig.get("6064") == pytest.approx(reached, abs=2)


@pytest.mark.rule("K7")
def test_targets_are_limited_when_they_are_handed_over_not_later(rig: BladeRig) -> None:
    rig.enable(velocity=400)
    rig.go(7500)
    rig.put("607D:01", 7800)
    rig.put("6081", 800)
    rig.put("607A", 7990)
    rig.master.run(600 * MS)
    assert rig.get("606C") == pytest.approx(-400, abs=5)
    rig.wait_bit(REACHED)
    assert rig.get("6064") == pytest.approx(7500, abs=2)
    assert not rig.bit(LIMIT)


@pytest.mark.rule("K8")
@pytest.mark.parametrize(
    ("values", "acceleration", "deceleration"),
    [
        ({"6083": 1200, "60C5": 2000, "6084": 900, "60C6": 0}, 1200, 900),
        ({"6083": 1200, "60C5": 700, "6084": 900, "60C6": 0}, 700, 900),
        ({"6083": 1200, "60C5": 2000, "6084": 900, "60C6": 600}, 1200, 600),
        ({"6083": 1200, "60C5": 2000, "6084": 900, "60C6": 5000}, 1200, 900),
        ({"6083": 1200, "60C5": 700, "6084": 0, "60C6": 0}, 700, 1200),
    ],
)
@pytest.mark.rule("K9")
def test_ramps_and_their_times(rig: BladeRig, values: dict[str, int], acceleration: int, deceleration: int) -> None:
    """t = velocity / ramp: the set-point is counted while it is neither 0 nor 700."""
    for where, number in values.items():
        rig.put(where, number)
    rig.enable(velocity=700)
    rig.go(6000)
    course = [abs(speed) for speed in speeds(rig, 5 * SECOND, 5 * MS)]
    top = course.index(700.0)
    end = len(course) - course[::-1].index(700.0)
    stop = course.index(0.0, end)
    assert top * 5 == pytest.approx(700 / acceleration * 1000, abs=25)
    assert (stop - end) * 5 == pytest.approx(700 / deceleration * 1000, abs=25)


@pytest.mark.rule("K8")
@pytest.mark.parametrize(("wanted", "highest", "reached"), [(400, 1000, 400), (900, 500, 500)])
def test_velocity_within_its_maximum(rig: BladeRig, wanted: int, highest: int, reached: int) -> None:
    rig.put("607F", highest)
    rig.enable(velocity=wanted)
    rig.go(6000)
    assert max(map(abs, speeds(rig, SECOND))) == reached
    assert rig.get("606C") == pytest.approx(-reached, abs=5)


# -- profile velocity (K10) -------------------------------------------------------------------


@pytest.mark.rule("K10")
def test_a_speed_starts_at_once_and_changes_by_ramps(rig: BladeRig) -> None:
    rig.enable(mode=3)
    rig.command(START)
    rig.put("60FF", -600)
    course = speeds(rig, 300 * MS)
    steps = [abs(after - before) for before, after in pairwise(course)]
    assert course[0] < 0
    assert max(steps) == pytest.approx(15, abs=2)  # 1500 units/s2 in 10 ms
    rig.master.run(300 * MS)
    rig.put("60FF", 400)
    course = speeds(rig, SECOND)
    steps = [after - before for before, after in pairwise(course)]
    assert max(steps) == pytest.approx(15, abs=2)
    assert course[-1] == 400


@pytest.mark.rule("K10")
def test_a_speed_is_limited_to_607f_in_both_directions(rig: BladeRig) -> None:
    rig.put("607F", 500)
    rig.enable(mode=3)
    rig.command(START)
    for wanted in (-5000, 5000):
        rig.put("60FF", wanted)
        rig.master.run(800 * MS)
        assert rig.pmc.drive.profile.velocity == (500 if wanted > 0 else -500)


@pytest.mark.rule("K10")
def test_bits_10_and_12_of_a_speed_look_at_the_set_point_not_at_the_motor(rig: BladeRig) -> None:
    rig.put("6080", 1000)  # the motor cannot follow
    rig.enable(mode=3)
    rig.put("60FF", -800)
    rig.command(START)
    rig.wait_bit(REACHED)
    assert rig.get("606C") > -500
    rig.put("6073", 50)  # hardly any current: the axis runs on while the set-point stops
    rig.put("60FF", 0)
    rig.wait_bit(BIT_12)
    assert rig.get("606C") < -50
    assert not rig.bit(BIT_13)
    rig.command(ENABLE)
    assert rig.bit(REACHED)
    assert rig.get("606C") < -20


# -- cyclic modes (K11 to K13) ------------------------------------------------------------------


@pytest.mark.rule("K11")
def test_the_sum_of_target_and_offset_is_the_position_within_the_limits(rig: BladeRig) -> None:
    rig.put("607D:02", 8100)
    rig.put("607A", 8000)
    rig.enable(mode=8)
    rig.command(START)
    rig.put("60B0", -50)
    rig.master.run(SECOND)
    assert rig.get("6064") == pytest.approx(7950, abs=2)
    assert not rig.bit(LIMIT)
    rig.put("60B0", 150)
    rig.master.run(SECOND)
    assert rig.get("6064") == pytest.approx(8100, abs=2)
    assert rig.bit(LIMIT)


@pytest.mark.rule("K11")
def test_60b1_is_the_pre_control_of_the_cyclic_position(rig: BladeRig) -> None:
    """A standing target with a pre-control of 34 units/s stands off by 34 / 17 units."""
    rig.put("607A", 8000)
    rig.enable(mode=8)
    rig.command(START)
    rig.put("60B1", 340)
    rig.master.run(3 * SECOND)
    assert rig.get("60F4") == pytest.approx(-340 / 17, abs=2)


@pytest.mark.rule("K11")
def test_halt_of_the_cyclic_position_stops_shorter_than_the_ramp_and_ends_without_one(rig: BladeRig) -> None:
    rig.put("6065", 0xFFFFFFFF)
    rig.put("607A", 8000)
    rig.enable(mode=8)
    rig.command(START)
    rig.put("607A", 4000)
    rig.run_until(lambda: rig.get("606C") < -750)
    began_ns = rig.line.now_ns
    rig.command(ENABLE)
    rig.master.until(lambda: rig.pmc.drive.profile.velocity == 0, step_ns=MS)
    assert rig.line.now_ns - began_ns < 200 * MS  # 800 units/s by 6084h would take 533 ms
    rig.master.run(500 * MS)
    stood = rig.get("6064")
    rig.put("607A", stood - 300)
    rig.command(START)
    rig.master.run(5 * MS)
    rig.blade.advance(rig.line.now_ns)
    assert rig.pmc.drive.profile.position == stood - 300


@pytest.mark.rule("K12")
def test_the_sum_of_target_and_offset_is_the_speed_within_its_limit(rig: BladeRig) -> None:
    rig.put("607F", 600)
    rig.enable(mode=9)
    rig.put("60FF", -300)
    rig.put("60B1", -100)
    rig.command(START)
    rig.master.run(SECOND)
    assert rig.get("606C") == pytest.approx(-400, abs=5)
    rig.put("60B1", -500)
    rig.master.run(SECOND)
    assert rig.pmc.drive.profile.velocity == -600


@pytest.mark.rule("K12")
def test_halt_of_the_cyclic_velocity_stops_short_and_keeps_the_velocity(rig: BladeRig) -> None:
    rig.enable(mode=9)
    rig.put("60FF", -700)
    rig.command(START)
    rig.run_until(lambda: rig.get("606C") < -680)
    began_ns = rig.line.now_ns
    rig.command(ENABLE)
    rig.master.until(lambda: rig.pmc.drive.profile.velocity == 0, step_ns=MS)
    assert rig.line.now_ns - began_ns < 200 * MS
    rig.master.run(500 * MS)
    assert abs(rig.get("606C")) < 5
    rig.command(START)
    rig.master.run(5 * MS)
    rig.blade.advance(rig.line.now_ns)
    assert rig.pmc.drive.profile.velocity == -700  # no ramp


@pytest.mark.rule("K13")
def test_a_cyclic_position_is_reached_in_the_time_of_60c2_by_steps_of_1_ms(rig: BladeRig) -> None:
    rig.put("60C2:01", 40)
    rig.put("607A", 8000)
    rig.put("6083", 100_000)
    rig.put("60C5", 100_000)
    rig.put("6084", 100_000)
    rig.enable(mode=8)
    rig.command(START)
    rig.master.run(100 * MS)
    rig.put("607A", 7980)
    begun_ns, course = rig.line.now_ns, []
    for _ in range(60):
        rig.master.run(MS)
        rig.blade.advance(rig.line.now_ns)
        course.append(rig.pmc.drive.profile.position)
    assert rig.line.now_ns - begun_ns == 60 * MS
    moving = [place for place, position in enumerate(course) if 7980 < position < 8000]
    assert 33 < len(moving) < 41  # it began while the write was answered
    steps = [course[place] - course[place + 1] for place in moving[:-1]]
    assert steps[5:] == pytest.approx([0.5] * len(steps[5:]), abs=0.06)  # 20 units in 40 ms
    assert course[-1] == 7980


@pytest.mark.rule("K13")
@pytest.mark.parametrize(("mode", "target"), [(8, "607A"), (9, "60FF")])
def test_cyclic_set_points_are_limited_in_speed_and_ramp(rig: BladeRig, mode: int, target: str) -> None:
    rig.put("607A", 8000)
    rig.put("6083", 800)
    rig.enable(mode, velocity=300)
    rig.command(START)
    rig.master.run(50 * MS)
    rig.put(target, 5000 if mode == 8 else -900)
    course = speeds(rig, SECOND)
    steps = [abs(after - before) for before, after in pairwise(course)]
    assert max(steps) == pytest.approx(8, abs=1.5)
    assert min(course) == -300


@pytest.mark.rule("K13")
def test_60c2_must_be_a_multiple_of_the_internal_cycle(rig: BladeRig) -> None:
    assert (rig.get("60C2:01"), rig.get("60C2:02")) == (1, -3)
    assert rig.refused("60C2:01", 0) == TOO_LOW
    assert rig.refused("60C2:02", 1) == VALUE_RANGE
    assert rig.refused("60C2:02", -6) == VALUE_RANGE
    rig.put("60C2:02", -4)  # 0.1 ms
    assert rig.refused("6060", 8) == INCOMPATIBLE
    assert rig.refused("6060", 9) == INCOMPATIBLE
    rig.put("6060", 1)
    rig.put("60C2:01", 15)  # 1.5 ms
    assert rig.refused("6060", 8) == INCOMPATIBLE
    rig.put("60C2:01", 20)  # 2 ms
    rig.put("6060", 8)
    assert rig.refused("60C2:01", 15) == INCOMPATIBLE
    assert rig.refused("60C2:02", -5) == INCOMPATIBLE
    rig.put("60C2:01", 30)


@pytest.mark.rule("K13")
def test_a_sync_that_is_lost_or_late_makes_no_other_cycle(rig: BladeRig) -> None:
    rig.put("60C2:01", 20)
    for gap_ms in (20, 20, 20, 20, 20, 40, 23):
        rig.master.send(0x80)
        rig.master.run(gap_ms * MS)
    rig.master.send(0x80)
    rig.master.run(2 * MS)
    rig.put("6060", 8)
    assert rig.refused("60C2:01", 30) == INCOMPATIBLE


@pytest.mark.rule("K13")
def test_60c2_must_be_a_multiple_of_the_sync_cycle(rig: BladeRig) -> None:
    for _ in range(5):
        rig.master.send(0x80)
        rig.master.run(10 * MS)
    rig.put("60C2:01", 15)
    assert rig.refused("6060", 8) == INCOMPATIBLE
    rig.put("60C2:01", 30)
    rig.put("6060", 8)
    assert rig.refused("60C2:01", 25) == INCOMPATIBLE
    rig.put("60C2:01", 20)
    rig.master.run(SECOND)  # no SYNC any more: any multiple of the internal cycle will do
    rig.put("60C2:01", 25)


# -- homing (K14 to K16), heating (K17) --------------------------------------------------------


@pytest.mark.rule("K14")
@pytest.mark.parametrize("where", ["607C", "687C"])
def test_offsets_are_written_in_homing_mode_only(rig: BladeRig, where: str) -> None:
    before = rig.get(where)
    for mode in (0, 1, 3, 8, 9, -113):
        rig.put("6060", mode)
        if mode:
            assert rig.refused(where, before + 7) == DEVICE_STATE
    rig.put("6060", 6)
    rig.put(where, before + 7)
    assert rig.get("6064" if where == "607C" else "6864") == 8007


@pytest.mark.rule("K14")
def test_method_35_is_the_only_one(rig: BladeRig) -> None:
    assert rig.get("6098") == 35
    for method in (0, 1, 34, 37):
        assert rig.refused("6098", method) == VALUE_RANGE
    rig.put("6098", 35)


@pytest.mark.rule("K15")
@pytest.mark.rule("K16")
def test_homing_makes_the_position_that_of_607a(rig: BladeRig) -> None:
    offsets = rig.get("607C"), rig.get("687C")
    rig.put("6060", 6)
    rig.put("607A", 9100)
    rig.command(SHUTDOWN, SHUTDOWN | 0x10)
    assert (rig.bit(REACHED), rig.bit(BIT_12), rig.bit(BIT_13)) == (True, True, False)
    assert (rig.get("6064"), rig.get("6864")) == (9100, 9100)
    assert rig.get("607C") == pytest.approx(offsets[0] + 1100, abs=1)
    assert rig.get("687C") == pytest.approx(offsets[1] + 1100, abs=1)
    rig.put("607A", 100)
    rig.command(SHUTDOWN | 0x10)  # no edge
    assert rig.get("6064") == 9100


@pytest.mark.rule("K15")
def test_homing_wants_an_axis_that_stands(rig: BladeRig) -> None:
    rig.put("6060", 6)
    rig.put("607A", 9100)
    rig.blade.axis.brake_stuck = BrakeFault.LIFTED
    rig.blade.axis.load_torque_nm = 10.0
    rig.run_until(lambda: rig.get("606C") > 50)
    rig.command(SHUTDOWN | 0x10)
    assert (rig.bit(BIT_12), rig.bit(BIT_13)) == (False, True)
    rig.blade.axis.load_torque_nm = 0.0
    rig.blade.axis.brake_stuck = BrakeFault.NONE
    rig.run_until(lambda: rig.get("6044") == 0)
    rig.command(SHUTDOWN, SHUTDOWN | 0x10)
    assert (rig.bit(BIT_12), rig.bit(BIT_13)) == (True, False)


@pytest.mark.rule("K16")
@pytest.mark.parametrize(("offset", "actual"), [("607C", "6064"), ("687C", "6864")])
def test_the_offset_is_added_to_the_encoders_position(rig: BladeRig, offset: str, actual: str) -> None:
    rig.put("6060", 6)
    rig.put(offset, 0)
    zero = rig.get(actual)
    for number in (-12_345, 2000):
        rig.put(offset, number)
        assert rig.get(actual) == pytest.approx(zero + number, abs=1)


@pytest.mark.rule("K17")
def test_heating_warms_the_motor_by_its_current_and_moves_nothing(rig: BladeRig) -> None:
    cold = rig.blade.power.motor_c
    rig.put("6410:0D", 900)
    rig.enable(mode=-113)
    rig.command(START)
    rig.master.run(10 * MS)
    assert rig.get("6078") == 900
    rig.master.run(20 * SECOND)
    assert rig.angle_deg == pytest.approx(80.0, abs=0.001)
    assert rig.blade.power.motor_c > cold + 0.5
    rig.command(SHUTDOWN)
    rig.master.run(200 * MS)
    assert rig.get("6078") == 0


@pytest.mark.rule("K17")
def test_heating_current_by_default(rig: BladeRig) -> None:
    rig.enable(mode=-113)
    rig.command(START)
    rig.master.run(10 * MS)
    assert rig.get("6078") == rig.get("6410:0D") == 100
    rig.command(SWITCH_ON)
    rig.master.run(10 * MS)
    assert rig.get("6078") < 100
