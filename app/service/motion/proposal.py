"""A proposal for the position controller from one measured step: old and new values, with the reasons in words. Pure.

The rule is the usual one of a proportional position loop around a velocity loop that lags by T: with a gain of 1/(4 T)
it comes to its place as fast as it can without overshoot. It is applied with caution: by a quarter at a time, and a
loop that overshoots is only ever made slower.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from app.service.motion.fits import StepResponse

MOST_CHANGE: Final = 1.25
LEAST_CHANGE: Final = 0.1
"""A smaller change of the gain is not worth the write."""
MOST_GAIN: Final = 50
"""1/s. Nothing of a blade calls for more, whatever the object could hold."""
LEAST_LAG_S: Final = 0.005
"""A lag below that cannot be told from the positions, which are 0.01 degrees apart."""
OVERSHOOT_PERCENT: Final = 5.0
_SLOWER: Final = 0.8
_LESS_PRECONTROL: Final = 50
_LEAST_PRECONTROL: Final = 900


@dataclass(frozen=True, slots=True)
class Reason:
    """``key`` is the end of the text key ``page.setup.controller.reason.…``, filled with ``details``."""

    key: str
    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class ProposedValue:
    """An object of the drive: its raw value now, and what is proposed."""

    address: str
    old: int
    new: int


@dataclass(frozen=True, slots=True)
class Proposal:
    """``values`` that should change; none: it is well as it is."""

    values: tuple[ProposedValue, ...]
    reasons: tuple[Reason, ...]


def propose(step: StepResponse, lag_s: float, gain: int, precontrol: int, gain_limits: tuple[int, int]) -> Proposal:
    """From a step that was run to its end. ``gain`` is 60FBh/1 in 1/s, ``precontrol`` 60FBh/2 in 0.1 %."""
    lag_s = max(lag_s, LEAST_LAG_S)
    ideal = 1 / (4 * lag_s)
    reasons = [Reason("lag", {"lag_ms": round(1000 * lag_s, 1), "ideal": round(ideal, 1)})]
    overshoots = step.overshoot_percent > OVERSHOOT_PERCENT
    if overshoots:
        reasons.append(Reason("overshoot", {"overshoot": round(step.overshoot_percent, 1)}))
        ideal = min(ideal, _SLOWER * gain)
    new_gain, capped = _cautious(ideal, gain, gain_limits)
    if capped:
        reasons.append(Reason("cautious", {"percent": round(100 * (MOST_CHANGE - 1))}))
    values = []
    if gain <= 0 or abs(new_gain - gain) >= LEAST_CHANGE * gain:
        values.append(ProposedValue("60FB:01", gain, new_gain))
    if overshoots and _LEAST_PRECONTROL < precontrol <= 1000:
        values.append(ProposedValue("60FB:02", precontrol, max(precontrol - _LESS_PRECONTROL, _LEAST_PRECONTROL)))
        reasons.append(Reason("precontrol", {}))
    if not values:
        reasons.append(Reason("as_it_is", {"percent": round(100 * LEAST_CHANGE)}))
    return Proposal(tuple(values), tuple(reasons))


def _cautious(ideal: float, gain: int, limits: tuple[int, int]) -> tuple[int, bool]:
    """The gain to propose, and whether caution made it another than the ideal one."""
    low, high = (gain / MOST_CHANGE, gain * MOST_CHANGE) if gain > 0 else (1.0, 5.0)
    wanted = min(max(ideal, low), high)
    new = round(min(max(wanted, limits[0], 1), limits[1], MOST_GAIN))
    return new, wanted != ideal
