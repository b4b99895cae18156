"""Ramps without a drive around them: exact ends, limits of speed, acceleration and jerk, for any numbers."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from app.twins.pd4e.reference import Reference

CYCLE_S = 0.001
positive = st.floats(0.5, 50.0)


@settings(max_examples=60, deadline=None)
@given(st.floats(-20, 20).filter(lambda target: abs(target) > 1e-6), positive, positive, positive)
def test_a_trapezoid_ends_exactly_within_its_limits(
    target: float, velocity: float, acceleration: float, deceleration: float
) -> None:
    reference = Reference()
    speeds = [0.0]
    for _ in range(100_000):
        there = reference.towards(target, velocity, acceleration, deceleration)
        speeds.append(reference.velocity)
        if there:
            break
    assert reference.position == target
    assert reference.velocity == 0.0
    assert max(map(abs, speeds)) <= velocity * 1.000001
    assert all(speed * target >= 0 for speed in speeds), "it never turns back"
    changes = [abs(after) - abs(before) for before, after in pairwise(speeds)]
    assert max(changes) <= acceleration * CYCLE_S * 1.000001
    # The last step may be up to two of the ramp: it ends on the spot instead of creeping on.
    assert min(changes) >= -deceleration * CYCLE_S * 2.000001


@settings(max_examples=30, deadline=None)
@given(st.floats(0.1, 10), st.floats(2, 20), st.floats(20, 500))
def test_a_smoothed_ramp_ends_exactly_with_limited_jerk(target: float, acceleration: float, jerk: float) -> None:
    reference = Reference()
    reference.smooth(acceleration, jerk)
    speeds = [0.0, 0.0]
    for _ in range(100_000):
        there = reference.towards(target, 5.0, acceleration, acceleration)
        speeds.append(reference.velocity)
        if there:
            break
    assert reference.position == target
    rates = [(after - before) / CYCLE_S for before, after in pairwise(speeds)]
    jerks = [abs(after - before) / CYCLE_S for before, after in pairwise(rates)]
    # Twice where the ramp goes from speeding up to slowing down at once; its last step may add as much once more.
    assert max(jerks) <= 3 * jerk * 1.01


def test_smoothing_that_begins_in_motion_does_not_jump() -> None:
    reference = Reference()
    reference.put(3.0, 2.0)
    reference.smooth(10.0, 100.0)
    before = reference.position
    reference.run(2.0, 10.0, 10.0)
    assert abs(reference.position - before - 2.0 * CYCLE_S) < 1e-9
    assert abs(reference.velocity - 2.0) < 1e-9


def test_without_a_ramp_nothing_moves() -> None:
    reference = Reference()
    for velocity, acceleration, deceleration in ((0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 0.0)):
        assert not reference.towards(1.0, velocity, acceleration, deceleration)
        assert reference.position == 0.0
