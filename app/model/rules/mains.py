"""Times after a failure of the mains: how long it may last, and whether the blade reaches feather (manual 4.2.1)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from typing import Final

from app.model.rules.look import Found, Look, make_rule, pmc, pmm
from app.model.rules.rule import Rule, Severity

HOLD_UP: Final = pmm("30E0")
SHUT_DOWN: Final = pmm("30E1")
LOWER_LIMIT: Final = pmc("607D:01")
MAXIMUM_VELOCITY: Final = pmc("607F")
EFC_TARGET: Final = pmc("567A")
EFC_VELOCITY: Final = pmc("5681")
EFC_ACCELERATION: Final = pmc("5683")
EFC_DECELERATION: Final = pmc("5684")
MAXIMUM_ACCELERATION: Final = pmc("60C5")
MAXIMUM_DECELERATION: Final = pmc("60C6")
SHORTEST_HOLD_UP_MS: Final = 3000
_TRAVEL: Final = (EFC_TARGET, EFC_VELOCITY, EFC_ACCELERATION, EFC_DECELERATION, LOWER_LIMIT, MAXIMUM_VELOCITY)
_RAMPS: Final = (MAXIMUM_ACCELERATION, MAXIMUM_DECELERATION)


def _hold_up(look: Look) -> Iterator[Found]:
    (hold_up_ms,) = look(HOLD_UP)
    if hold_up_ms < SHORTEST_HOLD_UP_MS:
        yield Found((HOLD_UP,), {"hold_up_s": hold_up_ms / 1000, "shortest_s": SHORTEST_HOLD_UP_MS / 1000})


def _shut_down(look: Look) -> Iterator[Found]:
    hold_up_ms, shut_down_s = look(HOLD_UP, SHUT_DOWN)
    target, velocity, acceleration, deceleration, lowest, maximum = look(*_TRAVEL)
    steepest, steepest_down = look(*_RAMPS)
    braking = deceleration if deceleration > 0 else acceleration
    travel_s = travel_time_s(
        target, velocity, min(acceleration, steepest), _limited(braking, steepest_down), lowest, maximum
    )
    if travel_s is None:
        return  # without velocity or ramp there is no travel: oat.efc_values tells
    needed_s = hold_up_ms / 1000 + travel_s
    if shut_down_s < needed_s:
        details = {"shut_down_s": shut_down_s, "hold_up_s": hold_up_ms / 1000, "travel_s": round(travel_s, 1)}
        yield Found((SHUT_DOWN, HOLD_UP, EFC_TARGET, EFC_VELOCITY), {**details, "needed_s": math.ceil(needed_s)})


def _limited(deceleration: int, most: int) -> int:
    """60C6h = 0, its default, limits nothing: taken so, for no axis could stop else."""
    return min(deceleration, most) if most > 0 else deceleration


def travel_time_s(
    target: int, velocity: int, acceleration: int, deceleration: int, lowest: int, maximum: int
) -> float | None:
    """Time in s from the lowest position to feather, with ramps at both ends; position units, per s and s².

    A deceleration of 0 is that of the acceleration (6084h). None where nothing moves.
    """
    speed = min(velocity, maximum)
    if speed <= 0 or acceleration <= 0:
        return None
    way = abs(target - lowest)
    ramps = Fraction(1, acceleration) + Fraction(1, deceleration if deceleration > 0 else acceleration)
    if way >= speed * speed * ramps / 2:
        return float(Fraction(way, speed) + speed * ramps / 2)
    return math.sqrt(2 * way * ramps)  # the speed is not reached: a triangle


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.hold_up_time", "4.2.1.4", Severity.WARNING, (HOLD_UP,), _hold_up),
    make_rule("oat.shut_down_time", "4.2.1.5", Severity.ERROR, (SHUT_DOWN, HOLD_UP, *_TRAVEL, *_RAMPS), _shut_down),
)
