"""The motor: what its data must hold for currents, speeds and temperatures to mean something (manual 5.2)."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Final

from app.model.rules.look import Found, Look, make_rule, pmc
from app.model.rules.rule import Rule, Severity

MOTOR_TYPE: Final = pmc("6402")
POLE_PAIRS: Final = pmc("6410:01")
NOMINAL_SPEED: Final = pmc("6410:04")
NOMINAL_FREQUENCY: Final = pmc("6410:06")
MOTOR_MAXIMUM: Final = pmc("6410:07")
MOTOR_WARNING: Final = pmc("6410:08")
RATED_CURRENT: Final = pmc("6076")
MAXIMUM_SPEED: Final = pmc("6080")
HEAT_SINK_MAXIMUM: Final = pmc("6510:02")
HEAT_SINK_WARNING: Final = pmc("6510:06")
NOT_CONFIGURED: Final = 0
ASYNCHRONOUS: Final = 7
LARGEST_SLIP: Final = Fraction(1, 5)
"""No motor of this size slips more at its nominal load."""
_SPEEDS: Final = (MOTOR_TYPE, NOMINAL_SPEED, NOMINAL_FREQUENCY, POLE_PAIRS)


def _type(look: Look) -> Iterator[Found]:
    (code,) = look(MOTOR_TYPE)
    if code == NOT_CONFIGURED:
        yield Found((MOTOR_TYPE,))


def _rated_current(look: Look) -> Iterator[Found]:
    (current_ma,) = look(RATED_CURRENT)
    if current_ma <= 0:
        yield Found((RATED_CURRENT,))


def _slip(look: Look) -> Iterator[Found]:
    """An asynchronous motor turns a little slower than its field: 60 x frequency / pole pairs."""
    (code,) = look(MOTOR_TYPE)
    if code != ASYNCHRONOUS:
        return
    speed_rpm, frequency_dhz, pairs = look(NOMINAL_SPEED, NOMINAL_FREQUENCY, POLE_PAIRS)
    if pairs <= 0:
        return  # the manual's default is one pair; 0 makes no field
    field_rpm = Fraction(frequency_dhz * 6, pairs)
    if not field_rpm * (1 - LARGEST_SLIP) <= speed_rpm < field_rpm:
        details = {"speed_rpm": speed_rpm, "field_rpm": round(float(field_rpm)), "pairs": pairs}
        yield Found((NOMINAL_SPEED, NOMINAL_FREQUENCY, POLE_PAIRS), {**details, "frequency_hz": frequency_dhz / 10})


def _maximum_speed(look: Look) -> Iterator[Found]:
    (maximum_rpm,) = look(MAXIMUM_SPEED)
    if maximum_rpm <= 0:
        yield Found((MAXIMUM_SPEED,))


def _motor_temperatures(look: Look) -> Iterator[Found]:
    warning, maximum = look(MOTOR_WARNING, MOTOR_MAXIMUM)
    if warning >= maximum:
        yield Found((MOTOR_WARNING, MOTOR_MAXIMUM), {"warning_c": warning / 10, "maximum_c": maximum / 10})


def _heat_sink(look: Look) -> Iterator[Found]:
    warning, maximum = look(HEAT_SINK_WARNING, HEAT_SINK_MAXIMUM)
    if warning >= maximum:
        yield Found((HEAT_SINK_WARNING, HEAT_SINK_MAXIMUM), {"warning_c": warning / 10, "maximum_c": maximum / 10})


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.motor_type", "5.2.1.1", Severity.WARNING, (MOTOR_TYPE,), _type),
    make_rule("oat.rated_current", "5.2.1.4", Severity.ERROR, (RATED_CURRENT,), _rated_current),
    make_rule("oat.motor_slip", "5.2.1.2", Severity.WARNING, _SPEEDS, _slip),
    make_rule("oat.motor_speed_zero", "5.3.1.3", Severity.ERROR, (MAXIMUM_SPEED,), _maximum_speed),
    # Stepwise, both: an order of two.
    make_rule(
        "oat.motor_temperatures",
        "5.2.1.2",
        Severity.ERROR,
        (MOTOR_WARNING, MOTOR_MAXIMUM),
        _motor_temperatures,
        stepwise=True,
    ),
    make_rule(
        "oat.heat_sink_temperatures",
        "5.1.1.1",
        Severity.ERROR,
        (HEAT_SINK_WARNING, HEAT_SINK_MAXIMUM),
        _heat_sink,
        stepwise=True,
    ),
)
