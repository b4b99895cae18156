"""Temperatures of the PMM: limits in order, heating and cooling that do not fight, fans that run (manual 4.6)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from app.model.rules.look import Found, Look, Object, make_rule, pmc, pmm
from app.model.rules.rule import Details, Rule, Severity

SUPERVISORS: Final = ("3110", "3111", "3112", "3113")
"""Battery, heat sink, sensor 1, sensor 2; subs: 1 warning, 2 error, 3 lower limit, in 0.1 °C."""


@dataclass(frozen=True, slots=True)
class Controller:
    """A temperature controller and the supervisor of the same place."""

    heater: Object
    cooler: Object
    hysteresis: Object
    masks: tuple[Object, ...]
    """Outputs of heater, cooler and fan: it works only where one of them is given."""
    warning: Object
    lower: Object


def _controller(index: str, supervisor: str) -> Controller:
    heater, cooler, hysteresis, *masks = (pmm(f"{index}:0{sub}") for sub in range(1, 7))
    return Controller(heater, cooler, hysteresis, tuple(masks), pmm(f"{supervisor}:01"), pmm(f"{supervisor}:03"))


CONTROLLERS: Final = (_controller("3201", "3110"), _controller("3202", "3112"), _controller("3203", "3113"))
MOTOR_FAN: Final = pmm("3204:01")
MOTOR_FAN_HYSTERESIS: Final = pmm("3204:02")
MOTOR_FAN_MASK: Final = pmm("3204:03")
MOTOR_WARNING: Final = pmc("6410:08")
COLDEST_FAN_DC: Final = 200
"""20 °C: a fan below it would never rest."""
_LIMITS: Final = tuple(pmm(f"{index}:0{sub}") for index in SUPERVISORS for sub in (3, 1, 2))
_BANDS: Final = tuple(o for c in CONTROLLERS for o in (c.heater, c.cooler, c.hysteresis, *c.masks))
_AGAINST_WARNING: Final = tuple(o for c in CONTROLLERS for o in (c.heater, c.cooler, *c.masks, c.warning, c.lower))
_HYSTERESES: Final = (*(o for c in CONTROLLERS for o in (c.hysteresis, *c.masks)), MOTOR_FAN_HYSTERESIS, MOTOR_FAN_MASK)


def _order(look: Look) -> Iterator[Found]:
    for index in SUPERVISORS:
        below, warning, error = (pmm(f"{index}:0{sub}") for sub in (3, 1, 2))
        for lower, upper in ((below, warning), (warning, error)):
            low, high = look.maybe(lower), look.maybe(upper)
            if low is not None and high is not None and low >= high:
                details: Details = {
                    "lower": lower.address,
                    "upper": upper.address,
                    "lower_c": low / 10,
                    "upper_c": high / 10,
                }
                yield Found((lower, upper), details)


def _works(look: Look, controller: Controller) -> bool:
    """True where it is known to have an output; unknown masks are noted."""
    known = [look.maybe(mask) for mask in controller.masks]
    return any(mask for mask in known)


def _bands(look: Look) -> Iterator[Found]:
    """Heating ends at its threshold plus the hysteresis, cooling at its own less the hysteresis: they must not meet."""
    for one in CONTROLLERS:
        values = [look.maybe(part) for part in (one.heater, one.cooler, one.hysteresis)]
        heater, cooler, hysteresis = values
        if not _works(look, one) or heater is None or cooler is None or hysteresis is None:
            continue
        if heater + hysteresis >= cooler:
            details = {"heater_c": heater / 10, "cooler_c": cooler / 10, "hysteresis_k": hysteresis / 10}
            yield Found((one.heater, one.cooler, one.hysteresis), details)


def _hysteresis(look: Look) -> Iterator[Found]:
    for one in CONTROLLERS:
        raw = look.maybe(one.hysteresis)
        if _works(look, one) and raw is not None and raw <= 0:
            yield Found((one.hysteresis,), {"object": one.hysteresis.address})
    mask, raw = look(MOTOR_FAN_MASK, MOTOR_FAN_HYSTERESIS)
    if mask and raw <= 0:
        yield Found((MOTOR_FAN_HYSTERESIS,), {"object": MOTOR_FAN_HYSTERESIS.address})


def _before_warning(look: Look) -> Iterator[Found]:
    for one in CONTROLLERS:
        cooler, warning, heater, lower = map(look.maybe, (one.cooler, one.warning, one.heater, one.lower))
        if not _works(look, one):
            continue
        if cooler is not None and warning is not None and cooler > warning:
            yield _late(one.cooler, cooler, one.warning, warning)
        if heater is not None and lower is not None and heater < lower:
            yield _late(one.heater, heater, one.lower, lower)


def _late(threshold: Object, threshold_dc: int, limit: Object, limit_dc: int) -> Found:
    details = {"threshold": threshold.address, "limit": limit.address}
    return Found((threshold, limit), {**details, "threshold_c": threshold_dc / 10, "limit_c": limit_dc / 10})


def _without_fan(look: Look) -> Iterator[Found]:
    for one in CONTROLLERS:
        heater, cooler, fan = (look.maybe(mask) for mask in one.masks)
        if (heater or cooler) and fan == 0:
            yield Found((one.masks[-1],), {"object": one.masks[-1].address})


def _motor_fan_off(look: Look) -> Iterator[Found]:
    (mask,) = look(MOTOR_FAN_MASK)
    if mask == 0:
        yield Found((MOTOR_FAN_MASK,))


def _motor_fan(look: Look) -> Iterator[Found]:
    (mask,) = look(MOTOR_FAN_MASK)
    if mask == 0:
        return
    fan_dc, warning_dc = look(MOTOR_FAN, MOTOR_WARNING)
    if not COLDEST_FAN_DC <= fan_dc < warning_dc:
        details = {"fan_c": fan_dc / 10, "warning_c": warning_dc / 10, "coldest_c": COLDEST_FAN_DC / 10}
        yield Found((MOTOR_FAN, MOTOR_WARNING), details)


RULES: Final[tuple[Rule, ...]] = (
    # Stepwise: lower limit below warning below error, in each supervisor for itself.
    make_rule("oat.temperature_limits", "4.6.1.1", Severity.ERROR, _LIMITS, _order, stepwise=True),
    # Not stepwise: whether a controller works at all depends on its masks, and no harm comes of a moment.
    make_rule("oat.temperature_bands", "4.6.1.4", Severity.WARNING, _BANDS, _bands),
    make_rule("oat.temperature_hysteresis", "4.6.1.4", Severity.WARNING, _HYSTERESES, _hysteresis),
    make_rule("oat.cooling_after_warning", "4.6.1", Severity.WARNING, _AGAINST_WARNING, _before_warning),
    make_rule(
        "oat.controller_without_fan",
        "4.6",
        Severity.WARNING,
        tuple(mask for one in CONTROLLERS for mask in one.masks),
        _without_fan,
    ),
    make_rule("oat.motor_fan_off", "4.6.1.7", Severity.NOTE, (MOTOR_FAN_MASK,), _motor_fan_off),
    make_rule(
        "oat.motor_fan_temperature", "4.6.1.7", Severity.WARNING, (MOTOR_FAN, MOTOR_FAN_MASK, MOTOR_WARNING), _motor_fan
    ),
)
