"""The axis: limits before targets, feather, velocities, and what the position controller needs (manual 5.3 to 5.15)."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Final

from app.model.rules.look import Found, Judge, Look, Object, make_rule, pmc
from app.model.rules.rule import Details, Rule, Severity
from app.model.rules.units import SCALING, degrees, feed_in_use, ratio, units_per_turn

LOWER: Final = pmc("607D:01")
UPPER: Final = pmc("607D:02")
MAXIMUM_VELOCITY: Final = pmc("607F")
MOTOR_SPEED: Final = pmc("6080")
GEAR: Final = (pmc("6091:01"), pmc("6091:02"))
EFC_TARGET: Final = pmc("567A")
EFC_VELOCITY: Final = pmc("5681")
EFC_ACCELERATION: Final = pmc("5683")
EFC_DECELERATION: Final = pmc("5684")
ACCELERATION: Final = pmc("6083")
DECELERATION: Final = pmc("6084")
MAXIMUM_ACCELERATION: Final = pmc("60C5")
MAXIMUM_DECELERATION: Final = pmc("60C6")
WINDOW: Final = pmc("6065")
P_GAIN: Final = pmc("60FB:01")
PRECONTROL: Final = pmc("60FB:02")
PERIOD: Final = (pmc("60C2:01"), pmc("60C2:02"))
CONTROLLER_MODE: Final = pmc("6510:09")
BRAKE_TIME: Final = pmc("60F9:04")

FEATHER_DEG: Final = (80.0, 95.0)
"""Where feather may lie: at 95 degrees stands the limit switch behind it, and 90 is the usual place."""
WINDOW_OFF: Final = 0xFFFFFFFF
POSITION_AND_VELOCITY: Final = 2
BRAKE_MS: Final = 50
"""What a holding brake needs to fall in (manual 5.3.1.4); 0 stands for an axis without brake."""

_LIMITS: Final = (
    (EFC_VELOCITY, MAXIMUM_VELOCITY),
    (EFC_ACCELERATION, MAXIMUM_ACCELERATION),
    (EFC_DECELERATION, MAXIMUM_DECELERATION),
    (ACCELERATION, MAXIMUM_ACCELERATION),
    (DECELERATION, MAXIMUM_DECELERATION),
)
"""Targets with the limits that cut them down."""


def _software_limits(look: Look) -> Iterator[Found]:
    lower, upper = look(LOWER, UPPER)
    if lower >= upper:
        yield Found((LOWER, UPPER), {"lower": lower, "upper": upper})


def _feather_reachable(look: Look) -> Iterator[Found]:
    (target,) = look(EFC_TARGET)
    lower, upper = look.maybe(LOWER), look.maybe(UPPER)
    if lower is not None and target < lower:
        yield Found((EFC_TARGET, LOWER), {"target": target, "limit": lower})
    if upper is not None and target > upper:
        yield Found((EFC_TARGET, UPPER), {"target": target, "limit": upper})


def _feather_angle(look: Look) -> Iterator[Found]:
    (target,) = look(EFC_TARGET)
    turn = units_per_turn(look)
    low, high = FEATHER_DEG
    if turn is not None and not low <= (angle_deg := degrees(target, turn)) <= high:
        yield Found((EFC_TARGET, *feed_in_use(look)), {"angle_deg": angle_deg, "low_deg": low, "high_deg": high})


def _efc_values(look: Look) -> Iterator[Found]:
    for one in (EFC_VELOCITY, EFC_ACCELERATION):
        raw = look.maybe(one)
        if raw is not None and raw <= 0:
            yield Found((one,), {"object": one.address})


def _efc_deceleration(look: Look) -> Iterator[Found]:
    (raw,) = look(EFC_DECELERATION)
    if raw == 0:
        yield Found((EFC_DECELERATION,))


def _within_limits(look: Look) -> Iterator[Found]:
    """A maximum deceleration of 0 is taken for "no limit": the manual leaves it open, and it is the default."""
    for target, limit in _LIMITS:
        target_raw, limit_raw = look.maybe(target), look.maybe(limit)
        if target_raw is None or limit_raw is None or (limit == MAXIMUM_DECELERATION and limit_raw == 0):
            continue
        if target_raw > limit_raw:
            yield _beyond(target, target_raw, limit, limit_raw)


def _beyond(target: Object, target_raw: int, limit: Object, limit_raw: int) -> Found:
    details: Details = {
        "target": target.address,
        "target_raw": target_raw,
        "limit": limit.address,
        "limit_raw": limit_raw,
    }
    return Found((target, limit), details)


def _zero(one: Object) -> Judge:
    def judge(look: Look) -> Iterator[Found]:
        (raw,) = look(one)
        if raw == 0:
            yield Found((one,))

    return judge


def _by_motor_speed(look: Look) -> Iterator[Found]:
    """Formula of 607Fh: motor speed / 60 x feed constant / gear ratio, the feed that of the encoder in use."""
    velocity, speed_rpm = look(MAXIMUM_VELOCITY, MOTOR_SPEED)
    turn, gear = units_per_turn(look), ratio(look, GEAR)
    if turn is None or gear is None:
        return
    highest = Fraction(speed_rpm, 60) * turn / gear
    if velocity > highest:
        details = {
            "velocity_dps": degrees(velocity, turn),
            "highest_dps": degrees(highest, turn),
            "highest_raw": int(highest),
            "speed_rpm": speed_rpm,
        }
        yield Found((MAXIMUM_VELOCITY, MOTOR_SPEED, *GEAR), details)


def _following_window(look: Look) -> Iterator[Found]:
    """The error of a steady run: velocity / gain, less what the pre-control takes over (5.4.1.8)."""
    window, velocity, gain, precontrol = look(WINDOW, MAXIMUM_VELOCITY, P_GAIN, PRECONTROL)
    if gain <= 0 or window == WINDOW_OFF:
        return
    expected = abs(Fraction(velocity, gain) * (1 - Fraction(precontrol, 1000)))
    if window < expected:
        details = {"window": window, "expected": round(float(expected), 1), "velocity": velocity, "gain": gain}
        yield Found((WINDOW, MAXIMUM_VELOCITY, P_GAIN, PRECONTROL), details)


def _period(look: Look) -> Iterator[Found]:
    value, exponent = look(*PERIOD)
    period_ms = Fraction(value) * Fraction(10) ** max(-12, min(exponent + 3, 12))
    if period_ms <= 0 or period_ms.denominator != 1:
        yield Found(PERIOD, {"period_ms": round(float(period_ms), 3)})


def _controller_mode(look: Look) -> Iterator[Found]:
    (mode,) = look(CONTROLLER_MODE)
    if mode != POSITION_AND_VELOCITY:
        yield Found((CONTROLLER_MODE,), {"mode": mode})


def _brake_time(look: Look) -> Iterator[Found]:
    (time_ms,) = look(BRAKE_TIME)
    if 0 < time_ms < BRAKE_MS:
        yield Found((BRAKE_TIME,), {"time_ms": time_ms, "shortest_ms": BRAKE_MS})


RULES: Final[tuple[Rule, ...]] = (
    # Stepwise, all three: lower limit below target below upper limit, velocities and ramps below their maxima. They
    # are orders in one direction each (see dc_link); "no limit" counts as the highest one.
    make_rule("oat.software_limits", "5.10.2.2", Severity.ERROR, (LOWER, UPPER), _software_limits, stepwise=True),
    make_rule(
        "oat.feather_reachable",
        "5.15.1.1",
        Severity.ERROR,
        (EFC_TARGET, LOWER, UPPER),
        _feather_reachable,
        stepwise=True,
    ),
    make_rule(
        "oat.within_limits",
        "5.10.2",
        Severity.WARNING,
        tuple(dict.fromkeys(one for pair in _LIMITS for one in pair)),
        _within_limits,
        stepwise=True,
    ),
    make_rule("oat.feather_angle", "5.15.1.1", Severity.ERROR, (EFC_TARGET, *SCALING), _feather_angle),
    make_rule("oat.efc_values", "5.15.1", Severity.ERROR, (EFC_VELOCITY, EFC_ACCELERATION), _efc_values),
    make_rule("oat.efc_deceleration", "5.15.1.4", Severity.NOTE, (EFC_DECELERATION,), _efc_deceleration),
    make_rule("oat.acceleration_zero", "5.10.2.7", Severity.WARNING, (ACCELERATION,), _zero(ACCELERATION)),
    make_rule(
        "oat.acceleration_limit_zero",
        "5.10.2.5",
        Severity.WARNING,
        (MAXIMUM_ACCELERATION,),
        _zero(MAXIMUM_ACCELERATION),
    ),
    # Not stepwise: which feed constant counts depends on 606Ah, and while a scaling is being written half of it is the
    # old one anyway. The axis stands then.
    make_rule(
        "oat.max_profile_velocity",
        "5.10.2.3",
        Severity.WARNING,
        (MAXIMUM_VELOCITY, MOTOR_SPEED, *GEAR, *SCALING),
        _by_motor_speed,
    ),
    make_rule(
        "oat.following_error_window",
        "5.4.1.2",
        Severity.WARNING,
        (WINDOW, MAXIMUM_VELOCITY, P_GAIN, PRECONTROL),
        _following_window,
    ),
    make_rule("oat.position_gain", "5.4.1.8", Severity.ERROR, (P_GAIN,), _zero(P_GAIN)),
    make_rule("oat.interpolation_period", "5.12.2.3", Severity.WARNING, PERIOD, _period),
    make_rule("oat.controller_mode", "5.1.1.1", Severity.WARNING, (CONTROLLER_MODE,), _controller_mode),
    make_rule("oat.brake_time", "5.3.1.4", Severity.WARNING, (BRAKE_TIME,), _brake_time),
)
