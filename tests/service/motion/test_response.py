"""What is read from a response, of courses whose answer is known: sines, second-order systems, ramps. Pure."""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.service.motion import fits
from app.service.motion.fits import StepResponse
from app.service.motion.loop_model import STEP_S, follow, identify_lag, set_points
from app.service.motion.proposal import MOST_CHANGE, MOST_GAIN, Proposal, propose
from tests.service.motion.test_signals import LIMITS, SINE

TIMES = np.arange(0.0, 10.0, 0.011)


@given(
    st.floats(0.05, 2.0),
    st.floats(0.1, 5.0),
    st.floats(0.2, 1.5),
    st.floats(-170, 170),
    st.floats(-50, 50),
)
def test_a_sine_is_found_again(frequency: float, amplitude: float, ratio: float, phase: float, mean: float) -> None:
    demand = mean + amplitude * np.sin(2 * pi * frequency * TIMES)
    actual = mean + ratio * amplitude * np.sin(2 * pi * frequency * TIMES + np.radians(phase))
    found = fits.sine_response((TIMES, demand), (TIMES, actual), frequency, (0.0, 10.0))
    assert found is not None
    assert found.ratio == pytest.approx(ratio, rel=1e-6)
    assert found.phase_deg == pytest.approx(phase, abs=1e-4)
    assert found.delay_ms == pytest.approx(-phase / 360 / frequency * 1000, abs=0.01)
    assert found.rest_deg < 1e-6


def test_a_delay_is_a_delay_at_any_sampling() -> None:
    late = np.sort(np.random.default_rng(1).uniform(0, 10, 700))
    demand = np.sin(2 * pi * 0.5 * TIMES)
    actual = np.sin(2 * pi * 0.5 * (late - 0.030))
    found = fits.sine_response((TIMES, demand), (late, actual), 0.5, (0.0, 10.0))
    assert found is not None
    assert found.delay_ms == pytest.approx(30.0, abs=0.01)


def test_too_little_of_a_sine_is_none() -> None:
    few = TIMES[:5], TIMES[:5]
    assert fits.sine_response(few, few, 0.5, (0.0, 10.0)) is None
    still = TIMES, np.full(len(TIMES), 80.0)
    assert fits.sine_response(still, still, 0.5, (0.0, 10.0)) is None


@given(st.floats(0.3, 0.8), st.floats(5.0, 20.0))
def test_a_second_order_system_gives_its_textbook_numbers(damping: float, natural: float) -> None:
    times = np.arange(0.0, 6.0, 0.002)
    at = np.maximum(times - 1.0, 0.0)
    damped = natural * sqrt(1 - damping**2)
    way = 1 - np.exp(-damping * natural * at) * (
        np.cos(damped * at) + damping / sqrt(1 - damping**2) * np.sin(damped * at)
    )
    found = fits.step_response((times, 80.0 - 2.0 * way), 1.0, 6.0, 80.0, 78.0, 0.0)
    assert found is not None
    assert found.overshoot_percent == pytest.approx(100 * exp(-pi * damping / sqrt(1 - damping**2)), abs=0.3)
    assert found.settling_ms is not None
    assert found.settling_ms <= 1000 * -np.log(0.02 * sqrt(1 - damping**2)) / damping / natural + 3
    assert abs(found.error_deg) < 0.02
    assert found.band_deg == pytest.approx(0.04)


def test_a_first_order_lag_gives_its_rise_and_dead_time() -> None:
    times = np.arange(0.0, 3.0, 0.001)
    lag_s, dead_s = 0.1, 0.05
    way = 1 - np.exp(-np.maximum(times - 0.5 - dead_s, 0.0) / lag_s)
    found = fits.step_response((times, 10.0 + 4.0 * way), 0.5, 3.0, 10.0, 14.0, 0.0)
    assert found is not None
    assert found.rise_ms == pytest.approx(1000 * lag_s * np.log(9), abs=2)
    assert found.dead_ms == pytest.approx(1000 * (dead_s + lag_s * -np.log(0.98)), abs=2)
    assert found.settling_ms == pytest.approx(1000 * (dead_s + lag_s * -np.log(0.02)), abs=3)
    assert found.overshoot_percent == 0.0


def test_what_never_settles_has_no_settling_time() -> None:
    times = np.arange(0.0, 3.0, 0.01)
    found = fits.step_response((times, np.where(times > 0.5, 9.5, 10.0)), 0.5, 3.0, 10.0, 9.0, 0.1)
    assert found is not None
    assert found.settling_ms is None
    assert found.rise_ms is None
    assert found.error_deg == pytest.approx(-0.5)


@given(st.floats(0.5, 5.0), st.floats(5.0, 40.0), st.sampled_from([-1.0, 1.0]))
def test_a_ramp_behind_a_gain_tells_that_gain(speed: float, gain: float, side: float) -> None:
    times = np.arange(0.0, 4.0, 0.01)
    demand = 40.0 + side * speed * times
    found = fits.ramp_response((times, demand), (times, demand - side * speed / gain), (1.0, 3.0), 0.01)
    assert found is not None
    assert found.lag_deg == pytest.approx(speed / gain)
    assert found.gain_per_s == pytest.approx(gain)
    none = fits.ramp_response((times, demand), (times, demand), (1.0, 3.0), 0.02)
    assert none is not None
    assert none.gain_per_s is None


# -- the model of the loop ---------------------------------------------------------------------


def test_targets_within_the_limits_are_joined_by_straight_lines() -> None:
    times = np.arange(0.0, SINE.duration_s, 0.05)
    targets = 80 + np.array([SINE.offset_deg(t) for t in times])
    points, speeds = set_points(times, targets, SINE.duration_s, 0.056, LIMITS)
    late = np.interp(np.arange(len(points)) * STEP_S, times + 0.056, targets)
    assert np.abs(points - late).max() < 0.02
    assert np.abs(speeds).max() < 4.0


def test_a_step_is_made_by_the_ramps() -> None:
    points, speeds = set_points(np.array([0.0, 0.5]), np.array([80.0, 79.2]), 2.0, 0.056, LIMITS)
    assert points[-1] == 79.2
    assert speeds.min() == pytest.approx(-sqrt(0.8 * 15), abs=0.03)
    reached = np.argmax(points <= 79.2 + 1e-9) * STEP_S - 0.5
    assert reached == pytest.approx(2 * sqrt(0.8 / 15), abs=0.02)


@given(st.floats(0.006, 0.1), st.sampled_from([10.0, 17.0, 25.0]), st.sampled_from([0.0, 0.9, 1.0]))
def test_the_lag_of_a_loop_is_found_again(lag_s: float, gain: float, precontrol: float) -> None:
    points, speeds = set_points(np.array([0.0, 0.5]), np.array([80.0, 79.2]), 2.0, 0.056, LIMITS)
    course = follow(points, speeds, gain, precontrol, lag_s)
    times = np.arange(0.0, 2.0, 0.01)
    measured = np.interp(times, np.arange(len(course)) * STEP_S, course)
    assert identify_lag(times, measured, points, speeds, gain, precontrol) == pytest.approx(lag_s, rel=0.03, abs=0.001)


# -- the proposal --------------------------------------------------------------------------------

WELL = StepResponse(30.0, 200.0, 0.0, 300.0, 0.0, 0.1)


def new_value(proposal: Proposal, address: str) -> int | None:
    return next((value.new for value in proposal.values if value.address == address), None)


@given(st.floats(0.001, 0.5), st.integers(1, 60), st.floats(0, 60), st.integers(0, 1000))
def test_a_proposal_is_cautious(lag_s: float, gain: int, overshoot: float, precontrol: int) -> None:
    step = StepResponse(30.0, 200.0, overshoot, 300.0, 0.0, 0.1)
    proposal = propose(step, lag_s, gain, precontrol, (0, 65535))
    assert proposal.reasons
    new = new_value(proposal, "60FB:01")
    if new is not None:
        assert 1 <= new <= MOST_GAIN
        assert gain / MOST_CHANGE - 0.5 <= new <= gain * MOST_CHANGE + 0.5 or gain > MOST_GAIN
        if overshoot > 5.0:
            assert new < gain
    less = new_value(proposal, "60FB:02")
    assert less is None or (overshoot > 5.0 and 900 <= less < precontrol)


def test_a_gain_that_fits_its_lag_stays() -> None:
    proposal = propose(WELL, 1 / (4 * 17), 17, 1000, (0, 65535))
    assert proposal.values == ()
    assert [reason.key for reason in proposal.reasons] == ["lag", "as_it_is"]


def test_a_slow_loop_is_made_faster_by_a_quarter() -> None:
    assert new_value(propose(WELL, 0.010, 8, 1000, (0, 65535)), "60FB:01") == 10
    assert new_value(propose(WELL, 0.010, 8, 1000, (0, 9)), "60FB:01") == 9, "the description's limit"


def test_a_loop_that_overshoots_is_only_made_slower() -> None:
    wild = StepResponse(30.0, 100.0, 25.0, 900.0, 0.0, 0.1)
    proposal = propose(wild, 0.005, 30, 1000, (0, 65535))
    assert new_value(proposal, "60FB:01") == 24
    assert new_value(proposal, "60FB:02") == 950
