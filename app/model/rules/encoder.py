"""The encoders: resolution, direction, and whether motor and blade encoder can agree (manual 5.5, 5.6)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.model.rules.look import Found, Look, make_rule, pmc
from app.model.rules.rule import Rule, Severity
from app.model.rules.units import BLADE_FEED, FEED, ratio

RESOLUTION: Final = (pmc("608F:01"), pmc("608F:02"))
BLADE_RESOLUTION: Final = (pmc("688F:01"), pmc("688F:02"))
GEAR: Final = (pmc("6091:01"), pmc("6091:02"))
BLADE_GEAR: Final = (pmc("6891:01"), pmc("6891:02"))
POLARITIES: Final = (pmc("607E"), pmc("687E"))
BLADE_CODE: Final = pmc("5894")
SIMULATED: Final = 0xFF
COMMON_LINES: Final = (512, 1024, 2048)
_POLARITY: Final = (0x00, 0xC0)


def _resolution(look: Look) -> Iterator[Found]:
    for pair in (RESOLUTION, BLADE_RESOLUTION):
        lines, turns = (look.maybe(one) for one in pair)
        if lines is None or turns is None or (turns > 0 and lines % turns == 0 and lines // turns in COMMON_LINES):
            continue
        yield Found(pair, {"object": pair[0].address[:4], "lines": lines, "turns": turns})


def _polarity(look: Look) -> Iterator[Found]:
    for one in POLARITIES:
        raw = look.maybe(one)
        if raw is not None and raw not in _POLARITY:
            yield Found((one,), {"object": one.address, "raw": f"{raw & 0xFF:02X}h"})


def _feeds(look: Look) -> Iterator[Found]:
    """Both positions are compared, and 606Ah changes over between them: a turn must have the same units by both."""
    if _simulated(look):
        return
    motor, blade = ratio(look, FEED), ratio(look, BLADE_FEED)
    if motor is not None and blade is not None and motor != blade:
        details = {"motor_units": round(float(motor), 2), "blade_units": round(float(blade), 2)}
        yield Found((*FEED, *BLADE_FEED), details)


def _gears(look: Look) -> Iterator[Found]:
    """The motor turns over its gearbox and the toothed rim, the blade encoder over the rim alone: never faster."""
    if _simulated(look):
        return
    motor, blade = ratio(look, GEAR), ratio(look, BLADE_GEAR)
    if motor is None or blade is None:
        return
    if blade > motor or (blade == 1 != motor):
        details = {"motor_ratio": round(float(motor), 3), "blade_ratio": round(float(blade), 3)}
        yield Found((*BLADE_GEAR, *GEAR), details)


def _simulated(look: Look) -> bool:
    return look(BLADE_CODE)[0] == SIMULATED


def _simulation(look: Look) -> Iterator[Found]:
    if _simulated(look):
        yield Found((BLADE_CODE,))


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.encoder_resolution", "5.5.1.2", Severity.NOTE, (*RESOLUTION, *BLADE_RESOLUTION), _resolution),
    make_rule("oat.polarity_bits", "5.5.1.5", Severity.WARNING, POLARITIES, _polarity),
    make_rule("oat.blade_encoder_feed", "5.6.1.5", Severity.ERROR, (BLADE_CODE, *FEED, *BLADE_FEED), _feeds),
    make_rule("oat.blade_encoder_gear", "5.6.1.4", Severity.WARNING, (BLADE_CODE, *GEAR, *BLADE_GEAR), _gears),
    make_rule("oat.blade_encoder_simulated", "5.6.1.7", Severity.WARNING, (BLADE_CODE,), _simulation),
)
