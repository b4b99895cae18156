"""Test signals as they are generated, and the limits that refuse them: pure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from app.errors import LimitError
from app.service.motion.signals import (
    CORNER_S,
    MOST_DPS,
    RESERVE,
    DriveLimits,
    Shape,
    Signal,
    check,
    following_deg,
    step_peak_dps,
)

LIMITS = DriveLimits(
    low_deg=0.0,
    high_deg=95.0,
    velocity_dps=10.0,
    acceleration_dps2=15.0,
    deceleration_dps2=15.0,
    following_deg=1.0,
    gain_per_s=17.0,
    precontrol=1.0,
    window_deg=0.1,
)
SINE = Signal(Shape.SINE, 1.0, 0.5, 3, 2.0, 1.0)
STEP = Signal(Shape.STEP, -0.8, 0.5, 1, 5.0, 1.0)
RAMP = Signal(Shape.RAMP, -3.0, 0.5, 1, 2.0, 1.0)

shapes = st.sampled_from(Shape)
wanted = st.builds(
    Signal,
    shape=shapes,
    amplitude_deg=st.floats(-10, 10).filter(lambda deg: abs(deg) > 0.01),
    frequency_hz=st.floats(0.05, 2.0),
    cycles=st.integers(1, 5),
    speed_dps=st.floats(0.1, 5.0),
    hold_s=st.floats(0.2, 2.0),
)


@given(wanted)
def test_each_begins_and_ends_where_the_blade_stands_and_never_goes_further(signal: Signal) -> None:
    assume(signal.shape is not Shape.RAMP or abs(signal.amplitude_deg) >= 2 * CORNER_S * signal.speed_dps)
    assert signal.offset_deg(0.0) == 0.0
    assert signal.offset_deg(signal.duration_s) == pytest.approx(0.0, abs=1e-9)
    _, offsets = signal.course(0.02)
    assert np.abs(offsets).max() <= abs(signal.amplitude_deg) + 1e-9


@given(wanted, st.floats(5, 90))
def test_what_is_allowed_stays_within_every_limit(signal: Signal, start_deg: float) -> None:
    try:
        check(signal, start_deg, LIMITS)
    except LimitError:
        return
    times, offsets = signal.course()
    assert start_deg + offsets.min() >= LIMITS.low_deg
    assert start_deg + offsets.max() <= LIMITS.high_deg
    assert signal.duration_s <= 60.0
    if signal.shape is not Shape.STEP:
        speeds = np.diff(offsets) / np.diff(times)
        assert np.abs(speeds).max() <= RESERVE * MOST_DPS + 1e-3
        assert np.abs(np.diff(speeds)).max() / 0.001 <= RESERVE * LIMITS.acceleration_dps2 + 1e-3


@given(st.floats(0.2, 4.0), st.floats(0.3, 4.0))
def test_a_ramp_has_its_speed_between_rounded_corners(amplitude_deg: float, speed_dps: float) -> None:
    ramp = Signal(Shape.RAMP, amplitude_deg, 0.5, 1, speed_dps, 1.0)
    if amplitude_deg < 2 * CORNER_S * speed_dps:
        with pytest.raises(LimitError):
            check(ramp, 45.0, LIMITS)
        return
    times, offsets = ramp.course()
    speeds = np.diff(offsets) / np.diff(times)
    assert speeds.max() == pytest.approx(speed_dps, rel=0.02)
    middle = speeds[int(1000 * (0.5 + ramp.leg_s / 2))]
    assert middle == pytest.approx(speed_dps, rel=0.01)
    assert np.abs(np.diff(speeds)).max() / 0.001 == pytest.approx(speed_dps / CORNER_S, rel=0.05)


def test_a_sine_fades_in_without_a_jump_of_its_speed() -> None:
    _, offsets = SINE.course()
    speeds = np.diff(offsets) / 0.001
    assert abs(speeds[:520]).max() < 0.01
    assert np.abs(np.diff(speeds)).max() < 0.02
    assert np.abs(offsets).max() == pytest.approx(1.0, abs=0.001)


@pytest.mark.parametrize(
    ("signal", "limits", "names"),
    [
        (replace(SINE, amplitude_deg=50.0), LIMITS, ""),
        (replace(SINE, amplitude_deg=4.0), LIMITS, ""),
        (SINE, replace(LIMITS, high_deg=80.5), "607D"),
        (SINE, replace(LIMITS, velocity_dps=3.0), "607F"),
        (replace(SINE, frequency_hz=1.0, amplitude_deg=0.5), replace(LIMITS, acceleration_dps2=15.0), "6083"),
        (SINE, replace(LIMITS, deceleration_dps2=5.0), "6084"),
        (SINE, replace(LIMITS, acceleration_dps2=0.0), "6083"),
        (RAMP, replace(LIMITS, precontrol=0.0, following_deg=0.14), "6065"),
        (replace(STEP, amplitude_deg=0.9), LIMITS, "6065"),
        (STEP, replace(LIMITS, velocity_dps=2.0), "607F"),
        (SINE, replace(LIMITS, gain_per_s=0.0), "6065"),
    ],
)
def test_a_refusal_names_the_limit(signal: Signal, limits: DriveLimits, names: str) -> None:
    with pytest.raises(LimitError) as refused:
        check(signal, 80.0, limits)
    assert refused.value.details["address"] == names
    assert refused.value.details["maximum"]


def test_what_the_drive_can_do_is_allowed() -> None:
    for signal in (SINE, STEP, RAMP):
        check(signal, 80.0, LIMITS)


def test_the_following_error_at_a_speed_is_that_of_the_manual() -> None:
    assert following_deg(3.4, replace(LIMITS, precontrol=0.0)) == pytest.approx(0.2)
    assert following_deg(3.4, replace(LIMITS, precontrol=0.5)) == pytest.approx(0.1)
    assert following_deg(3.4, LIMITS) == 0.0


def test_a_step_comes_to_the_speed_that_its_way_allows() -> None:
    assert step_peak_dps(STEP, LIMITS) == pytest.approx((0.8 * 15) ** 0.5)
    assert step_peak_dps(replace(STEP, speed_dps=1.0), LIMITS) == 1.0
