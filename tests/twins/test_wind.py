"""The wind of the twins: mean, slow changes from a seed, gusts by their shapes."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin

import pytest

from app.twins.wind import MAX_WIND_MPS, Wind, WindConstants

CALM = WindConstants(mean_mps=12.0, turbulence=0.0, direction_spread_deg=0.0)


def course(wind: Wind, seconds: float, dt_s: float = 0.1) -> list[float]:
    speeds = []
    for _ in range(round(seconds / dt_s)):
        wind.step(dt_s)
        speeds.append(wind.speed_mps)
    return speeds


@pytest.mark.parametrize("dt_s", [0.1, 5.0])
def test_it_stays_around_its_mean_whatever_the_step(dt_s: float) -> None:
    wind = Wind(4)
    speeds = course(wind, 4000 * dt_s, dt_s)
    assert sum(speeds) / len(speeds) == pytest.approx(wind.constants.mean_mps, abs=0.6)
    assert min(speeds) >= 0.0
    spread = (sum((speed - 7.5) ** 2 for speed in speeds) / len(speeds)) ** 0.5
    assert spread == pytest.approx(wind.constants.turbulence * 7.5, rel=0.35)


def test_a_gust_rises_by_half_a_cosine_stays_and_falls() -> None:
    wind = Wind(1, CALM)
    course(wind, 3)
    wind.gust(8.0, rise_s=2.0, hold_s=3.0, fall_s=4.0)
    speeds = course(wind, 12)
    assert speeds[9] == pytest.approx(12 + 4)  # half way up after a second
    assert speeds[4] == pytest.approx(12 + 4 * (1 - cos(pi / 4)))
    assert speeds[20:49] == pytest.approx([20.0] * 29)
    assert speeds[69] == pytest.approx(12 + 4)
    assert speeds[90:] == pytest.approx([12.0] * 30)
    assert max(speeds) == pytest.approx(20.0)


def test_a_gust_without_flanks_begins_and_ends_at_once() -> None:
    wind = Wind(1, CALM)
    wind.gust(-5.0, 0.0, 1.05, 0.0)
    assert course(wind, 2) == pytest.approx([7.0] * 10 + [12.0] * 10)


def test_the_extreme_operating_gust_has_the_shape_of_its_standard() -> None:
    wind = Wind(1, CALM)
    wind.extreme_gust(9.0)
    speeds = course(wind, 12)
    for place in (0, 20, 52, 80, 103):
        t_s = (place + 1) / 10
        shape = -0.37 * sin(3 * pi * t_s / 10.5) * (1 - cos(2 * pi * t_s / 10.5))
        assert speeds[place] == pytest.approx(12 + 9 / 0.74 * shape)
    assert max(speeds) == pytest.approx(12 + 9, abs=0.02)
    assert min(speeds) < 12 - 2.5  # it dips before and after
    assert speeds[105:] == pytest.approx([12.0] * 15)


def test_gusts_add_up_and_no_wind_blows_backwards_or_without_end() -> None:
    wind = Wind(1, CALM)
    wind.gust(5.0, 0.0, 9.0, 0.0)
    wind.gust(4.0, 0.0, 9.0, 0.0)
    assert course(wind, 1)[-1] == pytest.approx(21.0)
    wind.gust(-60.0, 0.0, 9.0, 0.0)
    assert course(wind, 1)[-1] == 0.0
    wind.gust(500.0, 0.0, 9.0, 0.0)
    assert course(wind, 1)[-1] == MAX_WIND_MPS


def test_the_mean_goes_where_it_is_sent_at_once_or_slowly() -> None:
    wind = Wind(1, CALM)
    wind.set_mean(10.0)
    assert wind.mean_mps == 10.0
    wind.set_mean(16.0, over_s=3.0)
    assert course(wind, 5) == pytest.approx([10 + 0.2 * n for n in range(1, 30)] + [16.0] * 21)
    wind.set_mean(13.0, over_s=3.0)
    assert course(wind, 4)[-1] == pytest.approx(13.0)


REFUSED: dict[str, Callable[[Wind], object]] = {
    "below 0": lambda wind: wind.set_mean(-1.0),
    "too strong": lambda wind: wind.set_mean(MAX_WIND_MPS + 1),
    "no number": lambda wind: wind.set_mean(float("nan")),
    "back in time": lambda wind: wind.set_mean(5.0, -1.0),
    "gust without time": lambda wind: wind.gust(5.0, 0.0, 0.0, 0.0),
    "gust back in time": lambda wind: wind.gust(5.0, -1.0, 5.0, 0.0),
    "gust of no size": lambda wind: wind.gust(float("nan"), 1.0, 1.0, 1.0),
    "extreme gust without time": lambda wind: wind.extreme_gust(5.0, 0.0),
}


@pytest.mark.parametrize("call", REFUSED.values(), ids=REFUSED)
def test_what_is_no_wind_is_refused(call: Callable[[Wind], object]) -> None:
    wind = Wind(1, CALM)
    with pytest.raises(ValueError, match="m/s"):
        call(wind)
    assert course(wind, 1) == pytest.approx([12.0] * 10)
