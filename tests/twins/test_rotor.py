"""The plain model of rotor and wind, and the frame by which the twins tell it."""

from __future__ import annotations

import pytest

from app.drivers.listening import BusWatch
from app.twins.line import CanLine
from app.twins.plant import AxisPlant
from app.twins.rotor import RATED_RPM, Rotor, RotorConstants, idle_rpm
from app.twins.surroundings import PERIOD_NS, Surroundings
from app.wire.frame import Can, Direction, Frame
from app.wire.twin_environment import CAN_ID, parse_environment

FEATHER = (90.0, 90.0, 90.0)
WORKING = (0.0, 0.0, 0.0)
SECOND = 1_000_000_000


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


def test_the_azimuth_follows_the_speed() -> None:
    calm = RotorConstants(wind_spread_mps=0.0, direction_spread_deg=0.0, rotor_time_s=1e-9)
    rotor = Rotor(1, calm)
    rotor.step(1.0, (45.0,))
    assert rotor.azimuth_deg == pytest.approx(rotor.speed_rpm * 6.0)
    for _ in range(100):
        rotor.step(1.0, (45.0,))
        assert 0.0 <= rotor.azimuth_deg < 360.0


def test_the_wind_stays_around_its_mean_whatever_the_step() -> None:
    for dt_s in (0.1, 5.0):
        rotor, winds = Rotor(4), []
        for _ in range(4000):
            rotor.step(dt_s, FEATHER)
            winds.append(rotor.wind_mps)
        mean = sum(winds) / len(winds)
        assert mean == pytest.approx(rotor.constants.mean_wind_mps, abs=0.6)
        assert min(winds) >= 0.0


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
