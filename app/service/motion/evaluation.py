"""What a run of a test signal comes to: its response, what was expected, and a proposal; from courses alone."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from app.model.address import parse_address
from app.service.motion import fits
from app.service.motion.courses import CURRENT, DEMAND, FOLLOWING, POSITION, VELOCITY, as_document
from app.service.motion.cyclic import INTERPOLATION_MS, SEND_S, Played
from app.service.motion.fits import RampResponse, SineResponse, StepResponse
from app.service.motion.loop_model import STEP_S, follow, identify_lag, set_points
from app.service.motion.proposal import LEAST_LAG_S, Proposal, propose
from app.service.motion.running import Ended
from app.service.motion.signals import CORNER_S, REST_S, Curve, Shape

MOST_POINTS: Final = 1500
"""Of a course that is kept; a longer one is thinned out."""
_LEAST_POINTS: Final = 20
_SETTLES_S: Final = 0.1
_SEEN_DEG: Final = 0.02
"""Less lag than two units cannot be told from how old a value is."""


@dataclass(frozen=True, slots=True)
class Results:
    """``lag_ms``: of the velocity loop, as it fits a step best. None: the course does not show it."""

    sine: SineResponse | None = None
    step: StepResponse | None = None
    ramp: RampResponse | None = None
    lag_ms: float | None = None
    most_following_deg: float | None = None


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Results, a proposal where a step was run to its end, and the courses to be kept."""

    results: Results
    proposal: Proposal | None
    courses: dict[str, Any]


def evaluate(played: Played, gain_limits: tuple[int, int]) -> Evaluation:
    """Of a run that had begun. Takes some tenths of a second: not for the event loop."""
    courses, begun_ns = played.courses, played.begun_ns
    if courses is None or begun_ns is None:
        return Evaluation(Results(), None, {})
    seen = {
        "demand": courses.of(DEMAND, begun_ns),
        "position": courses.of(POSITION, begun_ns),
        "following": courses.of(FOLLOWING, begun_ns),
        "velocity": courses.of(VELOCITY, begun_ns),
        "current": courses.of(CURRENT, begun_ns),
    }
    demand, position = seen["demand"], seen["position"]
    if min(len(demand[0]), len(position[0])) < _LEAST_POINTS:
        return Evaluation(Results(), None, as_document(_thinned(seen).items()))
    limits = played.limits
    end_s = float(demand[0][-1]) + SEND_S
    points, speeds = set_points(*demand, end_s, INTERPOLATION_MS / 1000, limits)
    grid_s: Curve = np.arange(len(points), dtype=np.float64) * STEP_S
    filter_s = 2 ** min(played.raws[parse_address("60F9:05")], 8) / 1000
    expected = follow(points, speeds, limits.gain_per_s, limits.precontrol, max(filter_s, LEAST_LAG_S))
    seen["set_point"], seen["expected"] = (grid_s, points), (grid_s, expected)
    results = _results(played, demand, position, (grid_s, points), speeds, seen["following"][1])
    return Evaluation(results, _proposal(played, results, gain_limits), as_document(_thinned(seen).items()))


def _results(
    played: Played,
    demand: tuple[Curve, Curve],
    position: tuple[Curve, Curve],
    wanted: tuple[Curve, Curve],
    speeds: Curve,
    following: Curve,
) -> Results:
    signal, limits = played.signal, played.limits
    most = float(np.abs(following).max()) if len(following) else None
    if signal.shape is Shape.SINE:
        sine = fits.sine_response(wanted, position, signal.frequency_hz, _steady(played))
        return Results(sine=sine, most_following_deg=most)
    if signal.shape is Shape.RAMP:
        window = (REST_S + CORNER_S + INTERPOLATION_MS / 1000 + _SETTLES_S / 2, REST_S + signal.leg_s - CORNER_S)
        return Results(ramp=fits.ramp_response(wanted, position, window, _SEEN_DEG), most_following_deg=most)
    lag_s = identify_lag(*position, wanted[1], speeds, limits.gain_per_s, limits.precontrol)
    return Results(
        step=_step(demand, position, limits.window_deg), lag_ms=round(1000 * lag_s, 2), most_following_deg=most
    )


def _steady(played: Played) -> tuple[float, float]:
    begin_s, end_s = played.signal.steady_s
    return begin_s + _SETTLES_S, end_s


def _step(demand: tuple[Curve, Curve], position: tuple[Curve, Curve], window_deg: float) -> StepResponse | None:
    """The first step of the targets that were sent."""
    times, targets = demand
    changed = np.nonzero(np.diff(targets))[0]
    if not len(changed):
        return None
    first = int(changed[0]) + 1
    end_s = float(times[changed[1] + 1]) if len(changed) > 1 else float(times[-1]) + SEND_S
    start, target = float(targets[0]), float(targets[first])
    return fits.step_response(position, float(times[first]), end_s, start, target, window_deg)


def _proposal(played: Played, results: Results, gain_limits: tuple[int, int]) -> Proposal | None:
    if played.why is not Ended.DONE or results.step is None or results.lag_ms is None:
        return None
    gain, precontrol = (played.raws[parse_address(text)] for text in ("60FB:01", "60FB:02"))
    return propose(results.step, results.lag_ms / 1000, gain, precontrol, gain_limits)


def _thinned(courses: dict[str, tuple[Curve, Curve]]) -> dict[str, tuple[Curve, Curve]]:
    """Each n-th point of what is long."""
    return {
        name: (times[:: max(1, -(-len(times) // MOST_POINTS))], values[:: max(1, -(-len(times) // MOST_POINTS))])
        for name, (times, values) in courses.items()
    }


def results_document(results: Results) -> dict[str, Any]:
    """The results as they are kept."""
    return asdict(results)
