"""What the axes do in their modes, seen by status words and actual values on the line."""

from __future__ import annotations

import pytest

from app.twins.ed2.delivered import ANALOG, INCREMENTAL, SSI_BINARY, SSI_GRAY
from app.twins.ed2.device import Settings
from app.twins.ed2.hydraulics import Bench
from app.twins.ed2.states import State
from app.wire.profibus import dp
from app.wire.profibus.pkw import PkwError
from app.wire.profibus.pzd import ORDERS, Order, orders_that_fit
from app.wire.profibus.telegrams import (
    ACTUAL,
    CONTROL_MODE,
    CONTROL_MODE_SET,
    DEVICE_MODE_SET,
    RAMP_ACCELERATION,
    RAMP_DECELERATION,
    RAMP_VELOCITY,
    SETPOINT,
    STATUS_WORD,
    TELEGRAM_TYPES,
)
from tests.twins.ed2.rig import Rig, made

RUN, R = 0x7, 0x8
POSITIVE, NEGATIVE, FORCE, START, RAPID, STOP = 0x200, 0x400, 0x400, 0x2000, 0x2000, 0x4000
REACHED, ACKNOWLEDGE, TOUCHED, BADLY = 0x1000, 0x2000, 0x400, 0x800


def active(mode: int, *telegrams: int, settings: Settings | None = None) -> Rig:
    rig = made(settings)
    rig.master.start(*(telegrams or (1,)))
    if mode != 9:
        rig.master.write("0/40", mode)
    return rig


def moving(rig: Rig, axis: int = 1) -> bool:
    return not rig.device.axes[axis - 1].cylinder.still


# -- mode 9 ------------------------------------------------------------------------------


@pytest.mark.parametrize("transducer", [SSI_BINARY, SSI_GRAY, ANALOG])
def test_an_axis_goes_to_its_setpoint_when_it_is_started(transducer: int) -> None:
    rig = active(9, settings=Settings(transducer=transducer))
    master = rig.master
    assert master.actual == pytest.approx(250_000, abs=10)
    master.set(RUN, 300_000)
    master.advance(100)
    assert not moving(rig)
    master.set(RUN | START)
    took_ms = master.until(lambda: bool(master.status & REACHED))
    assert took_ms >= 500, "100 mm/s"
    assert master.actual == pytest.approx(300_000, abs=100)
    assert rig.device.axes[1].position == pytest.approx(300.0, abs=0.2), "the other axis went with it"


def test_the_stop_bit_brings_it_to_rest_and_hold_keeps_it() -> None:
    rig = active(9)
    master = rig.master
    master.set(RUN | START, 400_000)
    master.advance(300)
    assert moving(rig)
    master.set(RUN | START | STOP)
    master.until(lambda: not moving(rig))
    stood = master.actual
    master.set(0x3)
    master.advance(500)
    assert master.actual == pytest.approx(stood, abs=300)
    assert stood < 350_000


def test_setpoints_that_stream_are_followed_smoothly() -> None:
    rig = active(9)
    master = rig.master
    master.set(RUN | START, 250_000)
    place, velocities = 250_000, []
    for _ in range(100):
        place += 500
        master.values[0][SETPOINT] = place
        master.exchange()
        master.wire.wait(10)
        velocities.append(rig.device.axes[0].motion.reference.velocity)
    assert min(velocities[50:]) > 40.0
    assert max(velocities[50:]) < 60.0


def test_a_setpoint_out_of_range_is_not_taken() -> None:
    rig = active(9)
    rig.master.set(RUN | START, 260_000)
    rig.master.set(RUN | START, -5_000)
    rig.master.until(lambda: bool(rig.master.status & REACHED))
    assert rig.master.actual == pytest.approx(260_000, abs=100)


def test_limits_of_travel_hold_the_setpoint_back_and_show_what_is_outside() -> None:
    rig = active(9)
    master = rig.master
    master.write("1/106", 1)
    assert master.status & TOUCHED, "as delivered the window is 0 to 0"
    master.write("1/101", 2_600)
    master.write("1/100", 2_400)
    master.advance(4)
    assert not master.status & TOUCHED
    master.set(RUN | START, 400_000)
    master.until(lambda: bool(master.status & REACHED))
    assert master.actual == pytest.approx(260_000, abs=150)


def test_a_local_setpoint_comes_from_an_analog_input() -> None:
    rig = active(9)
    master = rig.master
    master.write("12/223", 500_000_000)
    rig.device.kernel.conditions.analog[0] = 55.0
    master.write("0/39", 2)
    master.set(RUN | START, 0)
    master.until(lambda: bool(master.status & REACHED))
    assert master.actual == pytest.approx(275_000, abs=150)


# -- mode -1 -----------------------------------------------------------------------------


def test_the_handshake_of_a_profile() -> None:
    rig = active(-1)
    master = rig.master
    status = master.set(RUN, 270_000)
    assert not status & ACKNOWLEDGE
    status = master.set(RUN | START)
    assert status & ACKNOWLEDGE
    assert not status & REACHED
    assert not master.set(RUN) & ACKNOWLEDGE
    master.until(lambda: bool(master.status & REACHED))
    assert master.actual == pytest.approx(270_000, abs=100)
    master.set(RUN, 200_000)
    master.advance(500)
    assert not moving(rig), "a setpoint without an edge is none"


def test_a_second_target_waits_and_a_third_is_not_taken() -> None:
    rig = active(-1)
    master = rig.master
    for place in (300_000, 200_000):
        master.set(RUN, place)
        assert master.set(RUN | START) & ACKNOWLEDGE
        master.set(RUN)
    assert master.status & ACKNOWLEDGE, "no place is free"
    master.set(RUN, 350_000)
    master.set(RUN | START)
    farthest = 0
    for _ in range(2_000):
        master.wire.wait(5)
        master.exchange()
        farthest = max(farthest, master.actual)
        if master.status & REACHED:
            break
    assert farthest == pytest.approx(300_000, abs=1_500)
    assert master.actual == pytest.approx(200_000, abs=100)


def test_force_setpoint_overtakes_the_running_move() -> None:
    rig = active(-1)
    master = rig.master
    master.set(RUN, 400_000)
    master.set(RUN | START)
    master.set(RUN)
    master.advance(300)
    master.set(RUN, 260_000)
    assert master.set(RUN | START | FORCE) & ACKNOWLEDGE
    master.set(RUN)
    master.until(lambda: bool(master.status & REACHED))
    assert master.actual == pytest.approx(260_000, abs=100)


@pytest.mark.parametrize("telegram", [101, 103])
def test_ramps_of_the_telegram_rule_the_profile(telegram: int) -> None:
    rig = active(-1, 103)
    if telegram != 103:
        rig.master.start(telegram)
    master = rig.master
    master.values[0].update({RAMP_VELOCITY: 200, RAMP_ACCELERATION: 500, RAMP_DECELERATION: 500})
    master.set(RUN, 270_000)
    master.set(RUN | START)
    took_ms = master.until(lambda: bool(master.status & REACHED))
    assert 1_000 <= took_ms <= 2_000, "20 mm at 20 mm/s"


def test_a_velocity_of_0_in_the_telegram_moves_nothing() -> None:
    rig = active(-1, 103)
    master = rig.master
    master.set(RUN, 270_000)
    assert master.set(RUN | START) & ACKNOWLEDGE
    master.advance(300)
    assert not moving(rig)
    assert master.read("12/61") == 0, "process data win over the parameter"


# -- mode -2 -----------------------------------------------------------------------------


def test_manual_control_creeps_and_runs_while_it_is_told() -> None:
    rig = active(-2)
    master = rig.master
    master.set(RUN | POSITIVE)
    master.advance(1_000)
    assert rig.device.axes[0].cylinder.velocity_mm_s == pytest.approx(10.0, rel=0.1)
    master.set(RUN | NEGATIVE | RAPID)
    master.advance(1_500)
    assert rig.device.axes[0].cylinder.velocity_mm_s == pytest.approx(-50.0, rel=0.1)
    master.set(RUN | POSITIVE | NEGATIVE)
    master.until(lambda: not moving(rig))
    master.set(RUN)
    master.advance(100)
    assert not moving(rig)


def test_a_limit_switch_ends_in_fault_and_can_be_left_the_other_way() -> None:
    rig = active(-2, settings=Settings(places_mm=(480.0, 480.0)))
    master = rig.master
    master.set(RUN | POSITIVE | RAPID)
    master.until(lambda: master.status & 0xF == State.FAULT.value)
    assert master.read("0/36") == 0x5211
    assert not moving(rig)
    master.set(0)
    master.set(R)
    master.set(RUN | POSITIVE)
    master.advance(300)
    assert rig.device.axes[0].position == pytest.approx(497.0, abs=2.0)
    master.set(RUN | NEGATIVE)
    master.until(lambda: rig.device.axes[0].position < 490.0)


# -- mode 6 ------------------------------------------------------------------------------


def joystick_rig() -> Rig:
    rig = made()
    rig.master.start(1)
    rig.master.write("0/53", 1)
    rig.master.write("0/40", 6)
    rig.device.kernel.conditions.levels |= 1 << 2  # input 3
    return rig


def test_open_loop_moves_by_the_joystick_and_stops_at_a_switch_without_an_error() -> None:
    rig = joystick_rig()
    master, analog = rig.master, rig.device.kernel.conditions.analog
    master.set(RUN | START)
    master.advance(200)
    assert not moving(rig), "the middle"
    analog[4] = 95.0
    master.until(lambda: rig.device.axes[0].cylinder.position_mm > 497.0)
    master.until(lambda: not moving(rig))
    assert master.status & 0xF == State.DEVICE_MODE_ACTIVE.value
    assert master.status & TOUCHED
    assert master.read("0/36") == 0
    analog[4] = 5.0
    master.until(lambda: rig.device.axes[0].cylinder.position_mm < 400.0)
    assert rig.device.axes[1].cylinder.position_mm == 250.0


def test_a_broken_joystick_wire_is_an_error() -> None:
    rig = joystick_rig()
    rig.device.kernel.conditions.analog[4] = 1.0
    rig.master.until(lambda: rig.master.status & 0xF == State.FAULT.value)
    assert rig.master.read("0/36") == 0x5301


def test_synchronous_axes_have_no_open_loop() -> None:
    rig = active(6)
    assert rig.master.set(RUN | START) & 0xF == State.DISABLED.value


# -- single and synchronous ----------------------------------------------------------------


def test_single_axes_go_their_own_ways() -> None:
    rig = active(9, 1, 1)
    master = rig.master
    master.write("0/53", 1)
    master.set(RUN | START, 300_000, axis=1)
    master.set(RUN | START, 200_000, axis=2)
    master.until(lambda: bool(master.seen[0][STATUS_WORD] & master.seen[1][STATUS_WORD] & REACHED))
    assert master.seen[0][ACTUAL] == pytest.approx(300_000, abs=100)
    assert master.seen[1][ACTUAL] == pytest.approx(200_000, abs=100)


def test_an_axis_without_a_telegram_stays_where_it_is() -> None:
    rig = active(9)
    rig.master.write("0/53", 1)
    rig.master.set(RUN | START, 300_000)
    rig.master.until(lambda: bool(rig.master.status & REACHED))
    assert rig.device.axes[1].cylinder.position_mm == 250.0


def test_synchronous_axes_stay_together_under_unequal_loads() -> None:
    rig = active(9, settings=Settings(bench=Bench(link_n_mm=500.0)))
    rig.device.axes[0].surroundings.load_n = 15_000.0
    rig.device.axes[1].surroundings.load_n = -10_000.0
    rig.master.set(RUN | START, 400_000)
    apart = []
    for _ in range(300):
        rig.master.wire.wait(5)
        rig.master.exchange()
        first, second = rig.device.axes
        apart.append(abs(first.position - second.position))
    assert max(apart) < 6.0
    rig.master.until(lambda: bool(rig.master.status & REACHED))


def test_joined_at_different_places_they_fault_instead_of_jumping_together() -> None:
    rig = active(9, settings=Settings(places_mm=(100.0, 400.0)))
    rig.master.set(RUN, 250_000)
    rig.master.until(lambda: rig.master.status & 0xF == State.FAULT_HOLD.value)
    assert rig.master.read("0/36") == 0x8230


# -- monitors ------------------------------------------------------------------------------


def test_the_coarse_following_error_comes_at_once_and_the_fine_one_after_its_delay() -> None:
    rig = active(9)
    master = rig.master
    master.write("12/164", 50)
    master.write("12/162", 500)
    rig.device.kernel.conditions.supply_bar = 1.0
    master.set(RUN | START, 400_000)
    master.until(lambda: abs(master.read("12/103")) > 5_500, 2_000)
    assert master.status & 0xF == State.DEVICE_MODE_ACTIVE.value
    took_ms = master.until(lambda: master.status & 0xF == State.FAULT_HOLD.value)
    assert 300 <= took_ms <= 600
    assert master.status & BADLY
    assert master.read("0/36") == 0x8230
    rig.device.kernel.conditions.supply_bar = 160.0
    assert master.set(0x3 | R) & 0xF == State.HOLD.value
    assert not master.status & BADLY


def test_a_broken_magnet_shows_when_it_is_wanted() -> None:
    rig = active(9)
    rig.device.axes[0].surroundings.magnet_b_broken = True
    rig.master.set(RUN | START, 300_000)
    rig.master.until(lambda: bool(rig.master.status & REACHED) or not rig.master.status & R)
    rig.master.set(RUN | START, 200_000)
    rig.master.until(lambda: rig.master.status & 0xF == State.FAULT.value)
    assert rig.master.read("0/36") == 0x5412


def test_the_window_has_a_hysteresis() -> None:
    rig = active(9)
    master = rig.master
    master.write("12/178", 20)
    master.write("12/213", 300)
    master.set(RUN | START, 255_000)
    master.until(lambda: bool(master.status & REACHED))
    rig.device.axes[0].transducer.wire.slip_mm = 1.0
    rig.device.axes[1].transducer.wire.slip_mm = 1.0
    master.advance(4)
    assert master.status & REACHED
    rig.device.axes[0].transducer.wire.slip_mm = 6.0
    master.advance(4)
    assert not master.status & REACHED


# -- inputs and outputs ----------------------------------------------------------------------


def test_inputs_are_read_and_forced_by_number() -> None:
    rig = active(9)
    master = rig.master
    assert master.read("12/224", 0x0100) == 0x0101
    assert master.read("12/224", 0x0400) == 0x0400
    master.write("12/224", 0x0100)
    assert master.read("12/224", 0x0100) == 0x0100
    assert master.set(RUN, 250_000) & 0xF == State.DISABLED.value
    master.write("12/224", 0x0102)
    master.advance(10)
    assert master.status & 0xF == State.DEVICE_MODE_ACTIVE.value
    assert master.refused(lambda: master.write("12/224", 0x1302)) is PkwError.OUT_OF_RANGE
    assert master.refused(lambda: master.write("12/224", 0x0103)) is PkwError.OUT_OF_RANGE
    assert master.refused(lambda: master.read("12/224", 0x1300)) is PkwError.OUT_OF_RANGE


def test_outputs_tell_arrival_and_following_error() -> None:
    rig = active(9)
    master = rig.master
    master.set(RUN | START, 250_000)
    master.until(lambda: bool(master.status & REACHED))
    assert master.read("12/225", 0x0300) == 0x0301
    assert master.read("12/225", 0x0100) == 0x0100
    master.write("12/225", 0x0101)
    assert master.read("12/225", 0x0100) == 0x0101


def test_a_forced_input_that_was_saved_is_forced_after_power_off() -> None:
    rig = active(9)
    rig.master.write("12/224", 0x0100)
    rig.master.write("0/51", 0x73617665)
    rig.restart()
    rig.master.start(1)
    assert rig.master.read("12/224", 0x0100) == 0x0100


def test_local_operation_by_hand_and_by_joystick() -> None:
    rig = active(9)
    master, conditions = rig.master, rig.device.kernel.conditions
    master.write("0/53", 1)
    master.write("0/41", 1)
    conditions.levels |= 1 << 9 | 1 << 11  # inputs 10 and 12
    master.advance(500)
    assert rig.device.axes[0].cylinder.velocity_mm_s == pytest.approx(50.0, rel=0.15)
    assert rig.device.axes[1].cylinder.still
    conditions.levels = 1 | 1 << 2
    conditions.analog[5] = 20.0
    master.advance(500)
    assert rig.device.axes[0].cylinder.still
    assert rig.device.axes[1].cylinder.velocity_mm_s < -10.0
    assert master.status & 0xF == State.INIT.value


# -- sensors -------------------------------------------------------------------------------------


def test_an_incremental_sensor_counts_from_power_on() -> None:
    rig = active(9, settings=Settings(transducer=INCREMENTAL))
    master = rig.master
    assert master.actual == 0
    master.set(RUN | START, 30_000)
    master.until(lambda: bool(master.status & REACHED))
    assert rig.device.axes[0].cylinder.position_mm == pytest.approx(280.0, abs=0.2)
    rig.restart()
    master.start(1)
    assert master.actual == 0


def test_resolution_offset_and_signal_rule_what_is_understood() -> None:
    rig = active(9)
    master = rig.master
    master.write("1/98", -10_000)
    master.advance(20)
    assert master.actual == pytest.approx(200_000, abs=10)
    master.write("1/99", 2_500)
    master.advance(20)
    rig.restart()
    master.start(1)
    assert master.actual == pytest.approx(250_000, abs=10)


def test_a_sensor_that_tells_impossible_values_is_an_error() -> None:
    rig = active(9)
    rig.device.axes[0].transducer.wire.disturbed = True
    rig.master.until(lambda: rig.master.status & 0xF == State.FAULT.value)
    assert rig.master.read("0/36") == 0x5231


def test_an_analog_sensor_shows_a_broken_wire_and_what_is_beyond_its_range() -> None:
    rig = active(9, settings=Settings(transducer=ANALOG))
    rig.device.axes[0].transducer.wire.broken = True
    rig.master.until(lambda: rig.master.status & 0xF == State.FAULT.value)
    assert rig.master.read("0/36") == 0x5232
    rig.device.axes[0].transducer.wire.broken = False
    rig.master.set(R)
    assert rig.master.read("0/36") == 0
    rig.device.axes[0].transducer.wire.slip_mm = 300.0
    rig.master.until(lambda: rig.master.status & 0xF == State.FAULT.value)
    assert rig.master.read("0/36") == 0x5233


# -- valves ----------------------------------------------------------------------------------------


def test_a_cylinder_with_unequal_areas_is_faster_one_way() -> None:
    rig = joystick_rig()
    analog = rig.device.kernel.conditions.analog
    rig.master.set(RUN | START)
    speeds = []
    for percent in (70.0, 30.0):
        analog[4] = percent
        rig.master.advance(300)
        speeds.append(abs(rig.device.axes[0].cylinder.velocity_mm_s))
    assert speeds[0] > 1.1 * speeds[1]


def test_imin_below_the_dead_band_of_the_valve_leaves_the_axis_short_of_its_target() -> None:
    rig = active(9)
    master = rig.master
    master.write("3/73", 100)
    master.set(RUN | START, 300_000)
    master.advance(3_000)
    assert not master.status & REACHED
    assert 100 < 300_000 - master.actual < 5_000


def test_inverted_the_axis_runs_away_and_the_following_error_catches_it() -> None:
    rig = active(9)
    master = rig.master
    master.write("3/131", 1)
    master.set(RUN | START, 300_000)
    master.until(lambda: master.status & 0xF in (State.FAULT_HOLD.value, State.FAULT.value, 0x7))


def test_the_interface_with_its_own_electronics() -> None:
    rig = active(9)
    master = rig.master
    master.write("3/133", 1)
    assert master.refused(lambda: master.write("3/73", 200)) is PkwError.NOT_CHANGEABLE
    master.set(RUN | START, 300_000)
    master.until(lambda: bool(master.status & REACHED))
    master.set(0)
    master.write("3/94", 50)
    master.set(RUN | START)
    master.advance(2_000)
    assert master.actual > 300_500, "an offset of 5 % is held against by a deviation"


def test_without_dither_the_axis_does_not_settle() -> None:
    rig = active(9)
    master = rig.master
    master.write("3/101", 0)
    master.set(RUN | START, 300_000)
    master.advance(3_000)
    assert not master.status & REACHED


def test_synchronous_by_hand_moves_the_chosen_axis_and_only_with_input_14() -> None:
    rig = active(9)
    conditions = rig.device.kernel.conditions
    rig.master.write("0/41", 1)
    conditions.levels |= 1 << 9  # input 10: forward
    rig.master.advance(200)
    assert not moving(rig, 1)
    conditions.levels |= 1 << 13  # input 14: single
    rig.master.advance(300)
    assert moving(rig, 1)
    assert not moving(rig, 2)
    conditions.levels |= 1 << 8  # input 9: axis 2
    rig.master.advance(600)
    assert not moving(rig, 1)
    assert moving(rig, 2)


@pytest.mark.parametrize("order", ORDERS)
def test_process_data_come_in_the_order_of_the_setting(order: Order) -> None:
    rig = active(9, 102, settings=Settings(order=order))
    master = rig.master
    master.values[0].update({DEVICE_MODE_SET: 1, CONTROL_MODE_SET: 9})
    master.set(RUN | START, 254_321)
    master.until(lambda: bool(master.status & REACHED))
    assert master.actual == pytest.approx(254_321, abs=100)
    assert master.read("0/38") == master.status
    assert master.read("12/21") == 254_321


def test_process_data_prove_their_order_by_what_pkw_reads() -> None:
    rig = active(9)
    master = rig.master
    inputs = master.ask(dp.DataExchange(master.outputs()))
    assert isinstance(inputs, dp.Inputs)
    known = {STATUS_WORD: master.read("0/38"), ACTUAL: master.read("12/100")}
    assert orders_that_fit(TELEGRAM_TYPES[1].sent, inputs.data[8:], known) == (Settings().order,)


def test_synchronous_axes_have_the_mode_of_the_first_telegram() -> None:
    rig = active(9, 102, 102)
    master = rig.master
    master.values[0].update({DEVICE_MODE_SET: 1, CONTROL_MODE_SET: -2})
    master.values[1].update({DEVICE_MODE_SET: 1, CONTROL_MODE_SET: -1})
    master.advance(10)
    assert [seen[CONTROL_MODE] for seen in master.seen] == [-2, -2]
    master.jobs_of = 1
    master.values[0][CONTROL_MODE_SET] = 9
    assert master.read("0/40") == 9


def test_axes_that_were_synchronous_have_handshakes_of_their_own_afterwards() -> None:
    rig = active(-1, 1, 1)
    master = rig.master
    master.set(RUN, 250_000, axis=2)
    master.set(RUN, 260_000)
    assert master.set(RUN | START) & ACKNOWLEDGE
    for axis in (1, 2):
        master.set(0, axis=axis)
    master.write("0/53", 1)
    master.set(RUN, 255_000, axis=2)
    assert not master.set(RUN, 270_000) & ACKNOWLEDGE
    assert master.set(RUN | START) & ACKNOWLEDGE
    assert not master.seen[1][STATUS_WORD] & ACKNOWLEDGE
    master.until(lambda: bool(master.status & REACHED))
    assert rig.device.axes[1].position == pytest.approx(250.0, abs=5.0)
