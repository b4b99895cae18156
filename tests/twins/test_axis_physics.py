"""The cascade and the plant of an axis: following error, step response beside an independent solution, energy, gear."""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from app.twins import axis_kernel as k
from app.twins.axis_drive import Feedback, Mode
from app.twins.plant import GEAR_RATIO, AxisConstants, BrakeFault, EncoderFault
from tests.twins.axis_rig import DC_LINK_V, AxisRig

UNITS_PER_RAD = 36000 / (2 * pi * GEAR_RATIO)
"""0.01 degrees of the blade for one radian of the motor."""


@pytest.mark.rule("N7")
@pytest.mark.parametrize(
    ("gain", "precontrol", "velocity"),
    [(17, 0, 800), (17, 500, 800), (17, 900, 400), (5, 0, 400), (5, 750, 800), (40, 0, 800), (40, 300, 200)],
)
def test_the_following_error_is_velocity_by_gain_and_what_the_precontrol_leaves(
    gain: int, precontrol: int, velocity: int
) -> None:
    rig = AxisRig(x60FB_01=gain, x60FB_02=precontrol, x6081=velocity, x6065=-1 & 0xFFFFFFFF)
    rig.start(Mode.PROFILE_POSITION)
    rig.go(1000)
    rig.run(2.0 + 10 / gain)
    assert rig.drive.profile.velocity == -velocity
    expected = velocity / gain * (1 - precontrol / 1000)
    assert abs(rig.drive.following_error) == pytest.approx(expected, rel=0.02)


@pytest.mark.rule("N7")
def test_full_precontrol_leaves_no_following_error() -> None:
    rig = AxisRig(x60FB_01=17, x60FB_02=1000, x6081=800)
    rig.start(Mode.PROFILE_POSITION)
    rig.go(1000)
    rig.run(2.5)
    assert abs(rig.drive.following_error) < 0.02 * 800 / 17


def solved_step(constants: AxisConstants, wanted: float, cycles: int) -> np.ndarray:
    """Speeds of the motor after each cycle for a step of the wanted speed, by scipy.

    The controllers as their description has them, sampled each millisecond; motor, gear and blade as differential
    equations, solved to 1e-9 with the voltage held for the cycle.
    """
    inertia_b = constants.blade_inertia_kgm2 / GEAR_RATIO**2
    inertia = constants.motor_inertia_kgm2 + inertia_b
    kt = constants.rated_torque_nm / constants.rated_current_a
    ohm = constants.winding_loss_w / (1.5 * constants.rated_current_a**2)
    henry = constants.inductance_h
    stiffness = inertia_b * (2 * pi * constants.mesh_hz) ** 2
    damping = 2 * constants.mesh_damping * sqrt(stiffness * inertia_b)
    half_play = np.radians(constants.play_deg) * GEAR_RATIO / 2
    dry_m = constants.coulomb_torque_nm * constants.motor_friction_share
    dry_b = constants.coulomb_torque_nm - dry_m

    def derivative(_t: float, state: np.ndarray, voltage: float) -> list[float]:
        motor, speed, blade, blade_speed, current = state
        twist = motor - blade
        mesh = 0.0
        if abs(twist) > half_play:
            mesh = stiffness * (twist - np.sign(twist) * half_play) + damping * (speed - blade_speed)
            mesh = max(mesh, 0.0) if twist > 0 else min(mesh, 0.0)
        friction = dry_m * np.tanh(speed / 1e-4) + constants.viscous_nms * speed
        friction_b = dry_b * np.tanh(blade_speed / 1e-4)
        return [
            speed,
            (kt * current - mesh - friction) / constants.motor_inertia_kgm2,
            blade_speed,
            (mesh - friction_b) / inertia_b,
            (voltage - ohm * current - kt / 1.5 * speed) / henry,
        ]

    usual = inertia / 0.010 / kt
    decay = exp(-ohm / henry * 0.001)
    current_gain = (1 - exp(-0.5)) * ohm / (1 - decay)
    state = np.zeros(5)
    filtered = velocity_sum = current_sum = 0.0
    speeds = []
    for _ in range(cycles):
        error = wanted - filtered
        current = usual * error + velocity_sum
        velocity_sum += usual / 0.100 * error * 0.001
        miss = current - state[4]
        voltage = kt / 1.5 * state[1] + current_gain * miss + current_sum
        assert abs(voltage) < DC_LINK_V / sqrt(3), "the step must stay within what the DC link can give"
        current_sum += current_gain * (1 - decay) * miss
        state = solve_ivp(
            derivative, (0.0, 0.001), state, args=(voltage,), method="LSODA", rtol=1e-7, atol=1e-9, max_step=2e-4
        ).y[:, -1]
        filtered += (state[1] - filtered) * (1 - exp(-0.5))
        speeds.append(state[1])
    return np.array(speeds)


def test_a_step_of_the_velocity_is_that_of_an_independent_solution() -> None:
    constants = AxisConstants()
    wanted = 5.0
    velocity = round(wanted * UNITS_PER_RAD)
    wanted = velocity / UNITS_PER_RAD
    rig = AxisRig(constants, x607F=20000, x6081=20000, x6083=10**9, x60C5=10**9, x6084=10**9, x60FF=velocity)
    rig.start(Mode.PROFILE_VELOCITY)
    rig.run(0.001)  # the set-point steps at the end of this cycle
    speeds: list[float] = []
    rig.run(0.4, lambda: speeds.append(rig.plant.speed_rad_s))
    solved = solved_step(constants, wanted, len(speeds))
    assert np.max(np.abs(np.array(speeds) - solved)) < 0.01 * wanted
    assert max(solved) > 1.02 * wanted, "the step overshoots: it says something about the loop"
    assert abs(speeds[-1] - wanted) < 0.02 * wanted


@pytest.mark.parametrize(("where", "raw"), [("60F9:01", 40), ("60F9:02", 800), ("60F9:03", 200), ("60F6:01", 4)])
def test_gains_change_what_is_seen(where: str, raw: int) -> None:
    def course(**values: int) -> list[float]:
        rig = AxisRig(None, x607F=20000, x6083=10**9, x60C5=10**9, x60FF=100, **values)
        rig.start(Mode.PROFILE_VELOCITY)
        speeds: list[float] = []
        rig.run(0.2, lambda: speeds.append(rig.plant.speed_rad_s))
        return speeds

    usual, changed = course(), course(**{"x" + where.replace(":", "_"): raw})
    assert max(abs(one - other) for one, other in zip(usual, changed, strict=True)) > 0.02 * 100 / UNITS_PER_RAD


@pytest.mark.rule("N8")
@pytest.mark.parametrize("exponent", [0, 1, 2, 5])
def test_the_speed_filter_has_two_to_the_power_of_its_object_in_milliseconds(exponent: int) -> None:
    """Driven from outside with a constant speed, the filtered speed follows a lag of the first order."""
    rig = AxisRig(x60F9_05=exponent)
    s, p = rig.plant.s, rig.plant.p
    s[k.MOTOR_RAD_S] = 10.0
    p[k.ENCODER_COUNTS] = 1.0
    for _ in range(2**exponent):
        k.measure(s, p)
    assert s[k.SPEED_FILTERED] == pytest.approx(10.0 * (1 - exp(-1)), rel=1e-9)


@pytest.mark.parametrize("load_nm", [0.0, 8.0, -8.0])
def test_energy_of_the_axis_is_kept(load_nm: float) -> None:
    """What the stage took is in heat, friction, motion and the load; with a load that drives it comes back."""
    constants = AxisConstants()
    rig = AxisRig(constants, x6081=800)
    rig.plant.load_torque_nm = load_nm
    rig.start(Mode.PROFILE_POSITION)
    rig.go(1000)
    rig.run(2.0)
    s = rig.plant.s
    motion = constants.motor_inertia_kgm2 * s[k.MOTOR_RAD_S] ** 2 / 2 + constants.blade_kgm2 * s[k.BLADE_RAD_S] ** 2 / 2
    magnetic = 0.75 * constants.inductance_h * s[k.CURRENT_A] ** 2
    found = s[k.COPPER_J] + s[k.INVERTER_J] + s[k.FRICTION_J] + s[k.MESH_J] - s[k.LOAD_J] + motion + magnetic
    turned_over = s[k.COPPER_J] + s[k.INVERTER_J] + s[k.FRICTION_J] + abs(s[k.LOAD_J]) + motion
    assert abs(s[k.MOTOR_J] - found) < 1e-6 * turned_over
    if load_nm < 0:  # it drives towards smaller angles, where the axis goes
        assert s[k.LOAD_J] > 0
        assert s[k.MOTOR_J] < s[k.LOAD_J]


def test_the_gear_has_play_between_motor_and_blade() -> None:
    rig = AxisRig(x6081=800)
    rig.start(Mode.PROFILE_POSITION)
    rig.go(4000)
    rig.run(3.0)
    from_above = rig.plant.angle_deg - rig.drive.motor_position / 100
    rig.go(3000)
    rig.run(3.0)
    rig.go(4000)
    rig.run(3.0)
    from_below = rig.plant.angle_deg - rig.drive.motor_position / 100
    assert from_above - from_below == pytest.approx(rig.plant.constants.play_deg, abs=0.01)


@pytest.mark.rule("M14")
def test_peak_current_is_given_for_its_time_and_nominal_current_afterwards() -> None:
    rig = AxisRig(x6073=1500, x60F6_03=400, x6065=-1 & 0xFFFFFFFF)
    rated = rig.plant.constants.rated_current_a
    rig.start(Mode.PROFILE_POSITION)
    rig.plant.load_torque_nm = 60.0  # twice what the motor can do for long
    rig.run(0.05)
    currents: list[float] = []
    rig.run(0.3, lambda: currents.append(abs(rig.plant.s[k.CURRENT_A])))
    assert max(currents) == pytest.approx(1.5 * rated, rel=0.01)
    rig.run(0.3)
    assert abs(rig.plant.s[k.CURRENT_A]) == pytest.approx(rated, rel=0.01)


def test_a_low_dc_link_limits_the_speed() -> None:
    """The motor's own voltage grows with its speed; without the booster a battery of 216 V cannot drive it fast."""
    rig = AxisRig(x6081=1000, x6065=-1 & 0xFFFFFFFF)

    def weak(s: list[float], p: list[float], cycles: int) -> int:
        for _ in range(cycles):
            s[k.DC_LINK_V] = 216.0
            k.axis_cycle(s, p)
        return cycles

    rig.plant.run = weak
    rig.start(Mode.PROFILE_POSITION)
    rig.go(0)
    rig.run(3.0)
    constants = rig.plant.constants
    highest = 216 / sqrt(3) / (constants.torque_nm_per_a / 1.5)
    assert abs(rig.plant.speed_rad_s) < highest < 1000 / UNITS_PER_RAD


def test_a_brake_that_stays_engaged_holds_the_motor_and_one_that_stays_lifted_holds_nothing() -> None:
    rig = AxisRig(x6081=500, x6065=-1 & 0xFFFFFFFF)
    rig.plant.brake_stuck = BrakeFault.ENGAGED
    rig.start(Mode.PROFILE_POSITION)
    rig.go(4000)
    rig.run(1.0)
    assert rig.plant.angle_deg == pytest.approx(50.0, abs=0.1)
    rig.drive.switch_off()
    rig.plant.brake_stuck = BrakeFault.LIFTED
    rig.plant.load_torque_nm = 10.0
    rig.run(1.0)
    assert rig.plant.angle_deg > 51.0


def test_an_encoder_without_sine_and_cosine_stands_still_while_the_blade_moves() -> None:
    rig = AxisRig(x6081=500, x6065=-1 & 0xFFFFFFFF)
    rig.start(Mode.PROFILE_POSITION)
    rig.go(4000)
    rig.run(1.0)
    count, blade_count = rig.plant.encoder_increments, rig.plant.blade_encoder_increments
    rig.plant.encoder_fault = EncoderFault.SINE_COSINE
    rig.run(0.2)
    assert rig.plant.encoder_increments == count
    assert rig.plant.blade_encoder_increments != blade_count


@pytest.mark.rule("L4")
def test_the_additional_encoder_can_take_the_place_of_the_motor_encoder() -> None:
    rig = AxisRig(x6081=500)
    rig.plant.encoder_fault = EncoderFault.SINE_COSINE
    rig.drive.feedback = Feedback.BLADE_ENCODER
    rig.start(Mode.PROFILE_POSITION)
    rig.go(6000)
    rig.run(5.0)
    assert rig.plant.angle_deg == pytest.approx(60.0, abs=0.15)


@pytest.mark.rule("L4")
def test_without_any_encoder_the_axis_runs_under_speed_control() -> None:
    rig = AxisRig(x6081=500, x6065=-1 & 0xFFFFFFFF)
    rig.plant.encoder_fault = EncoderFault.SINE_COSINE
    rig.plant.blade_encoder_failed = True
    rig.drive.feedback = Feedback.NONE
    rig.start(Mode.PROFILE_POSITION)
    rig.go(9000)
    before = rig.plant.angle_deg
    rig.run(3.0)
    assert rig.plant.angle_deg - before == pytest.approx(5.0 * (3.0 - 500 / 1500 / 2), rel=0.05)


@pytest.mark.rule("K11")
@pytest.mark.rule("K13")
def test_cyclic_set_points_on_a_line_make_an_even_velocity() -> None:
    """Every 20 ms another target, up to 6 degrees/s; some come late by a cycle, as behind other frames."""
    rig = AxisRig(x6081=1000, x6083=6000, x6084=6000, x60C2_01=20, x607A=5000)
    rig.start(Mode.CYCLIC_POSITION)
    velocities: list[float] = []
    target = 5000
    for step in range(1, 80):
        target += min(12, step)
        rig.put("607A", target)
        rig.run(0.020 + 0.001 * (step % 3 - 1), lambda: velocities.append(rig.drive.profile.velocity))
    steady = velocities[900:]  # it has caught up with what the limits held back
    assert np.mean(steady) == pytest.approx(600, rel=0.02)
    assert min(steady) > 570
    assert max(steady) < 650
    assert abs(rig.drive.profile.position - target) < 13
    rig.run(0.1)
    assert rig.drive.profile.velocity == 0.0
    assert rig.drive.profile.position == target


@pytest.mark.rule("K13")
def test_a_cyclic_set_point_beyond_the_limits_is_approached_within_them() -> None:
    rig = AxisRig(x6081=500, x60C2_01=20, x607A=5000)
    rig.start(Mode.CYCLIC_POSITION)
    rig.put("607A", 6000)
    velocities: list[float] = []
    rig.run(3.0, lambda: velocities.append(rig.drive.profile.velocity))
    assert max(velocities) == 500
    steps = np.diff(velocities)
    assert max(steps) <= 1.5 + 1e-9  # 6083h, 15 degrees/s2
    assert min(steps) >= -1.5 - 1e-6 - 3.0  # the last of them meets the target
    assert rig.drive.profile.position == 6000


@pytest.mark.rule("K11")
@pytest.mark.rule("K12")
@pytest.mark.parametrize(
    ("mode", "where", "raw"), [(Mode.CYCLIC_POSITION, "607A", 5300), (Mode.CYCLIC_VELOCITY, "60FF", 300)]
)
def test_the_end_of_halt_jumps_back_without_a_ramp(mode: Mode, where: str, raw: int) -> None:
    rig = AxisRig(x6081=1000, x607A=5000, x6065=-1 & 0xFFFFFFFF)
    rig.start(mode)
    rig.drive.halted = True
    rig.run(0.1)
    rig.put(where, raw)
    rig.run(0.1)
    assert rig.drive.profile.velocity == 0.0
    rig.drive.halted = False
    rig.run(0.002)
    reached = rig.drive.profile.position if mode is Mode.CYCLIC_POSITION else rig.drive.profile.velocity
    assert reached == raw


@pytest.mark.rule("K17")
def test_heating_makes_losses_and_no_motion() -> None:
    rig = AxisRig(x6410_0D=400)
    rig.start(Mode.HEATING)
    rig.run(1.0)
    s, rated_w = rig.plant.s, rig.plant.constants.winding_loss_w
    assert s[k.COPPER_J] == pytest.approx(0.4**2 * rated_w, rel=0.01)
    assert s[k.MOTOR_J] == pytest.approx(s[k.COPPER_J] + s[k.INVERTER_J], rel=0.01)
    assert rig.plant.angle_deg == pytest.approx(50.0, abs=0.01)
    assert rig.drive.current_permille == 400


def test_a_current_loop_tuned_beyond_reason_does_not_pass_the_current_limit() -> None:
    rig = AxisRig(x60F6_01=65534, x60F6_02=65534, x6073=1200, x6081=800, x6065=-1 & 0xFFFFFFFF)
    rig.start(Mode.PROFILE_POSITION)
    rig.go(1000)
    currents: list[float] = []
    rig.run(0.5, lambda: currents.append(abs(rig.plant.s[k.CURRENT_A])))
    assert max(currents) <= 1.2 * rig.plant.constants.rated_current_a + 1e-9
    assert max(currents) > 1.1 * rig.plant.constants.rated_current_a
