"""The plain model of the rotor, what it does to the axes, and the frame by which the twins tell it."""

from __future__ import annotations

import pytest

from app.drivers.listening import BusWatch
from app.twins.line import CanLine
from app.twins.plant import AxisPlant
from app.twins.rotor import RATED_RPM, RPM, Rotor, RotorConstants, idle_rpm, torque_line
from app.twins.surroundings import PERIOD_NS, Surroundings
from app.twins.wind import WindConstants
from app.wire.frame import Can, Direction, Frame
from app.wire.twin_environment import CAN_ID, parse_environment

FEATHER = (90.0, 90.0, 90.0)
WORKING = (0.0, 0.0, 0.0)
SECOND = 1_000_000_000
CALM = WindConstants(turbulence=0.0, direction_spread_deg=0.0)


def run(rotor: Rotor, seconds: float, pitch: tuple[float, ...]) -> None:
    for _ in range(round(seconds * 10)):
        rotor.step(0.1, pitch)


def test_one_seed_gives_one_wind_and_another_seed_another() -> None:
    first, second, other = Rotor(1), Rotor(1), Rotor(2)
    for rotor in (first, second, other):
        run(rotor, 60, FEATHER)
    assert first.environment == second.environment
    assert first.environment != other.environment


def test_feathered_it_idles_slowly_and_at_work_it_is_bounded_by_its_rated_speed() -> None:
    rotor = Rotor(3)
    run(rotor, 120, FEATHER)
    assert 0.05 < rotor.speed_rpm < 1.0
    run(rotor, 120, WORKING)
    assert 0.6 * RATED_RPM < rotor.speed_rpm <= RATED_RPM
    run(rotor, 60, FEATHER)
    assert rotor.speed_rpm < 1.0


def test_the_more_pitch_the_slower() -> None:
    speeds = [idle_rpm(8.0, (angle,) * 3) for angle in range(0, 100, 5)]
    assert speeds == sorted(speeds, reverse=True)
    assert idle_rpm(8.0, (0.0, 90.0, 90.0)) > idle_rpm(8.0, FEATHER)
    assert idle_rpm(0.0, WORKING) == 0.0
    assert idle_rpm(8.0, (200.0,)) == idle_rpm(8.0, (90.0,))
    assert idle_rpm(8.0, (-200.0,)) == idle_rpm(8.0, (0.0,))


def test_a_generator_holds_the_speed_at_which_its_torque_is_that_of_the_wind() -> None:
    rotor = Rotor(1, RotorConstants(friction_nms=0.0), CALM)
    start_nm, slope_nms = torque_line(7.5, WORKING, 0.0)
    rotor.generator_nm = start_nm / 3
    run(rotor, 600, WORKING)
    assert rotor.speed_rpm == pytest.approx(start_nm * 2 / 3 / slope_nms * RPM, rel=1e-6)
    rotor.generator_nm = 0.0
    run(rotor, 200, WORKING)
    assert rotor.speed_rpm > RATED_RPM  # nothing bounds it but the wind
    rotor.generator_nm = 2 * start_nm
    run(rotor, 600, WORKING)
    assert rotor.speed_rpm == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("angle_deg", [0.0, 40.0, 90.0])
def test_settled_it_turns_as_after_a_long_time(angle_deg: float) -> None:
    settled, patient = Rotor(1, None, CALM), Rotor(1, None, CALM)
    settled.settle((angle_deg,) * 3)
    run(patient, 300, (angle_deg,) * 3)
    assert settled.speed_rpm == pytest.approx(patient.speed_rpm, rel=1e-3)


def test_feathered_at_rated_speed_it_is_braked_within_some_ten_seconds() -> None:
    rotor = Rotor(1, None, WindConstants(mean_mps=12.0, turbulence=0.0))
    rotor.speed_rpm, rotor.generator_nm = RATED_RPM, 0.0
    run(rotor, 4, FEATHER)
    assert 0.2 * RATED_RPM < rotor.speed_rpm < 0.5 * RATED_RPM
    run(rotor, 12, FEATHER)
    assert rotor.speed_rpm < 0.1 * RATED_RPM


def test_a_step_is_exact_whatever_its_length() -> None:
    fine, coarse = Rotor(1, None, CALM), Rotor(1, None, CALM)
    run(fine, 10, (20.0,) * 3)
    coarse.step(10.0, (20.0,) * 3)
    assert fine.speed_rpm == pytest.approx(coarse.speed_rpm, rel=1e-9)


def test_the_azimuth_follows_the_speed() -> None:
    rotor = Rotor(1, RotorConstants(inertia_kgm2=1e-9), CALM)
    rotor.step(1.0, (45.0,))
    assert rotor.azimuth_deg == pytest.approx(rotor.speed_rpm * 6.0)
    for _ in range(100):
        rotor.step(1.0, (45.0,))
        assert 0.0 <= rotor.azimuth_deg < 360.0


def told(line: CanLine) -> list[tuple[int, Can]]:
    """Every frame of the line from now on."""
    frames: list[tuple[int, Can]] = []
    line.tap(lambda _start_ns, end_ns, can: frames.append((end_ns, can)))
    return frames


def test_ten_frames_a_second_follow_the_pitch_and_load_the_bus_little() -> None:
    line = CanLine(500_000)
    axes = [AxisPlant(90.0) for _ in range(3)]
    surroundings, frames = Surroundings(line, Rotor(1), axes), told(line)
    surroundings.start(line.now_ns)
    line.run_until(10 * SECOND)
    assert len(frames) == pytest.approx(100, abs=1)
    assert {(can.can_id, can.extended) for _, can in frames} == {(CAN_ID, True)}
    assert line.busy_ns / line.now_ns < 0.004
    slow = parse_environment(frames[-1][1].data).rotor_rpm
    for axis in axes:
        axis.place(0.0)
    line.run_until(40 * SECOND)
    assert parse_environment(frames[-1][1].data).rotor_rpm > slow + 5


def test_the_axes_feel_the_wind_and_their_azimuth() -> None:
    line = CanLine(500_000)
    axes = [AxisPlant(20.0) for _ in range(3)]
    rotor = Rotor(1, None, CALM)
    surroundings = Surroundings(line, rotor, axes)
    surroundings.mean_wind_mps = 14.0
    surroundings.start(line.now_ns)
    assert [axis.wind_mps for axis in axes] == [14.0] * 3
    assert [axis.azimuth_deg for axis in axes] == pytest.approx([0.0, 120.0, 240.0])
    surroundings.gust(6.0, rise_s=1.0, hold_s=20.0, fall_s=1.0)
    line.run_until(10 * SECOND)
    assert surroundings.mean_wind_mps == 14.0
    assert [axis.wind_mps for axis in axes] == pytest.approx([20.0] * 3)
    assert rotor.azimuth_deg > 0.0
    assert [axis.azimuth_deg for axis in axes] == pytest.approx([(rotor.azimuth_deg + n) % 360 for n in (0, 120, 240)])


def test_once_stopped_it_is_silent() -> None:
    line = CanLine(500_000)
    surroundings, frames = Surroundings(line, Rotor(1), [AxisPlant(90.0)]), told(line)
    surroundings.start(0)
    line.run_until(SECOND + PERIOD_NS // 2)
    surroundings.stop()
    count = len(frames)
    line.run_until(3 * SECOND)
    assert len(frames) == count
    assert frames[1][0] - frames[0][0] == pytest.approx(PERIOD_NS, rel=0.001)  # stuff bits differ


def test_it_is_taken_for_no_node_and_no_other_master() -> None:
    line = CanLine(500_000)
    surroundings, frames = Surroundings(line, Rotor(1), [AxisPlant(90.0)]), told(line)
    surroundings.start(0)
    line.run_until(SECOND)
    watch = BusWatch()
    watch.on_frames([Frame(t_ns, "can0", Direction.RX, can) for t_ns, can in frames])
    assert frames
    assert (watch.nodes, watch.masters) == ((), ())
