"""What a measured response says: of a sine by least squares, of a step by its marks, of a ramp by its lag. Pure.

Times in s, positions in degrees. None: the course does not show it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Final

import numpy as np

from app.service.motion.signals import Curve

_LEAST: Final = 8
"""Fewer points make no fit."""
_MOVED_DEG: Final = 0.02
"""Two units of the drive: less is no motion."""


@dataclass(frozen=True, slots=True)
class SineResponse:
    """Actual position over set-point at one frequency. ``delay_ms`` is the phase as a time, positive: it is behind.

    ``rest_deg`` is the standard deviation of what is no sine of that frequency.
    """

    frequency_hz: float
    ratio: float
    phase_deg: float
    delay_ms: float
    rest_deg: float


@dataclass(frozen=True, slots=True)
class StepResponse:
    """Times from the moment at which the target was sent. ``band_deg``: in which it counts as settled."""

    dead_ms: float | None
    rise_ms: float | None
    overshoot_percent: float
    settling_ms: float | None
    error_deg: float
    band_deg: float


@dataclass(frozen=True, slots=True)
class RampResponse:
    """``lag_deg`` at constant speed; ``gain_per_s`` is what it implies: speed / lag. None: no lag to be seen."""

    speed_dps: float
    lag_deg: float
    gain_per_s: float | None


def fit_sine(times_s: Curve, values: Curve, frequency_hz: float) -> tuple[complex, float, float]:
    """Least squares of ``c + Re(a exp(i w t))``: ``a``, ``c`` and the standard deviation of the rest.

    Raises ValueError where there are too few points.
    """
    if len(times_s) < _LEAST:
        raise ValueError(f"{len(times_s)} points are too few")
    angle = 2 * pi * frequency_hz * times_s
    basis = np.column_stack((np.cos(angle), np.sin(angle), np.ones_like(angle)))
    (real, imaginary, mean), *_ = np.linalg.lstsq(basis, values, rcond=None)
    rest = values - basis @ np.array((real, imaginary, mean))
    return complex(real, -imaginary), float(mean), float(np.std(rest))


def sine_response(
    demand: tuple[Curve, Curve], actual: tuple[Curve, Curve], frequency_hz: float, window_s: tuple[float, float]
) -> SineResponse | None:
    """Compare the sines in two courses (times, positions) within a stretch of full amplitude."""
    try:
        wanted, _, _ = fit_sine(*within(demand, window_s), frequency_hz)
        found, _, rest = fit_sine(*within(actual, window_s), frequency_hz)
    except ValueError:
        return None
    if abs(wanted) < _MOVED_DEG / 2:
        return None
    transfer = found / wanted
    phase = float(np.degrees(np.angle(transfer)))
    return SineResponse(frequency_hz, abs(transfer), phase, -phase / 360 / frequency_hz * 1000, rest)


def step_response(
    actual: tuple[Curve, Curve], step_s: float, end_s: float, from_deg: float, to_deg: float, window_deg: float
) -> StepResponse | None:
    """Marks of a step that was sent at ``step_s`` and stood until ``end_s``."""
    times, values = within(actual, (step_s, end_s))
    amplitude = to_deg - from_deg
    if len(times) < _LEAST or abs(amplitude) < _MOVED_DEG:
        return None
    way = (values - from_deg) / amplitude
    band_deg = max(window_deg, 0.02 * abs(amplitude))
    dead = _first(times, way >= max(0.02, _MOVED_DEG / abs(amplitude)))
    low, high = _first(times, way >= 0.1), _first(times, way >= 0.9)
    outside = np.nonzero(np.abs(values - to_deg) > band_deg)[0]
    settled = None if len(outside) and outside[-1] == len(times) - 1 else times[outside[-1] + 1 if len(outside) else 0]
    late = values[times >= end_s - 0.25 * (end_s - step_s)]
    return StepResponse(
        dead_ms=None if dead is None else 1000 * (dead - step_s),
        rise_ms=None if low is None or high is None else 1000 * (high - low),
        overshoot_percent=max(0.0, 100 * (float(way.max()) - 1.0)),
        settling_ms=None if settled is None else 1000 * (float(settled) - step_s),
        error_deg=float(to_deg - late.mean()) if len(late) else float(to_deg - values[-1]),
        band_deg=band_deg,
    )


def ramp_response(
    demand: tuple[Curve, Curve], actual: tuple[Curve, Curve], window_s: tuple[float, float], least_deg: float
) -> RampResponse | None:
    """Lag behind the set-point in a stretch of constant speed; less than ``least_deg`` is none."""
    times, values = within(actual, window_s)
    if len(times) < _LEAST:
        return None
    wanted = np.interp(times, *demand)
    speed = float(np.polyfit(times, wanted, 1)[0])
    lag = float(np.mean(wanted - values)) * (1.0 if speed >= 0 else -1.0)
    return RampResponse(abs(speed), lag, abs(speed) / lag if lag > least_deg else None)


def within(course: tuple[Curve, Curve], window_s: tuple[float, float]) -> tuple[Curve, Curve]:
    """The points of a course in a stretch of time."""
    times, values = course
    chosen = (times >= window_s[0]) & (times <= window_s[1])
    return times[chosen], values[chosen]


def _first(times: Curve, found: np.ndarray) -> float | None:
    places = np.nonzero(found)[0]
    return float(times[places[0]]) if len(places) else None
