"""Voltages of the DC link: one order from the least to the greatest, over PMM and PMC (manual 4.2.2, table 19).

Stepwise rules of this package compare values that are to lie in an order, each of them on one side of every comparison
only. Such an order can be kept by single writes from any valid state to any other one: raise what rises, from the top
downwards, then lower what falls, from the bottom upwards. Each value then passes only where its neighbour has made room
already, or stands further away than it finally will. So a rule is stepwise only where it is of that form.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from app.model.rules.look import Found, Look, Object, make_rule, pmc, pmm
from app.model.rules.rule import Details, Rule, Severity

LADDER: Final = (
    pmc("6510:04"),
    *map(pmm, ("30FA:03", "30FB:08", "30FA:01", "30FB:07", "30FC:02", "30FC:01", "30FA:02")),
    pmc("6510:05"),
)
"""From the bottom: minimum PMC, minimum PMM, booster on, nominal, booster target, chopper off, chopper on, maximum PMM,
maximum PMC. All in V. Each lies below the next; the two maxima may be equal, as they are by default."""
PMC_MINIMUM: Final = LADDER[0]
NOMINAL: Final = pmm("30FA:01")
BOOSTER_TARGET: Final = pmm("30FB:07")
CHOPPER: Final = (pmm("30FC:02"), pmm("30FC:01"))
MAINS: Final = pmm("3062")
INDUCTANCE: Final = pmm("30FB:09")
BLOCS: Final = pmm("3020:04")
NOMINAL_BLOC: Final = pmm("3020:05")
MAINS_PRESENT_V: Final = 100
"""Below it nothing can be said of the mains: they are off."""
NOMINAL_TOLERANCE: Final = 0.1
"""The mains themselves may be off by a tenth (EN 50160); the manual rounds 565.7 V to 560 V."""


def _ladder(look: Look) -> Iterator[Found]:
    """Compares each rung with the next one that is known."""
    known = [(rung, raw) for rung in LADDER if (raw := look.maybe(rung)) is not None]
    for (lower, lower_v), (upper, upper_v) in pairwise(known):
        if lower_v > upper_v or (lower_v == upper_v and upper != LADDER[-1]):
            yield _out_of_order(lower, lower_v, upper, upper_v)


def _chopper(look: Look) -> Iterator[Found]:
    (target_v,) = look(BOOSTER_TARGET)
    for threshold in CHOPPER:
        threshold_v = look.maybe(threshold)
        if threshold_v is not None and threshold_v < target_v:
            yield _out_of_order(BOOSTER_TARGET, target_v, threshold, threshold_v)


def _out_of_order(lower: Object, lower_v: int, upper: Object, upper_v: int) -> Found:
    details: Details = {"lower": lower.address, "upper": upper.address, "lower_v": lower_v, "upper_v": upper_v}
    return Found((lower, upper), details)


def _below_battery(look: Look) -> Iterator[Found]:
    minimum_v, blocs, bloc_mv = look(PMC_MINIMUM, BLOCS, NOMINAL_BLOC)
    battery_v = blocs * bloc_mv / 1000
    if minimum_v >= battery_v:
        yield Found((PMC_MINIMUM, BLOCS, NOMINAL_BLOC), {"minimum_v": minimum_v, "battery_v": battery_v})


def _nominal(look: Look) -> Iterator[Found]:
    nominal_v, mains_v = look(NOMINAL, MAINS)
    if mains_v < MAINS_PRESENT_V:
        look.lacks(MAINS)
        return
    expected_v = round(mains_v * math.sqrt(2))
    if abs(nominal_v - expected_v) > NOMINAL_TOLERANCE * expected_v:
        details = {"nominal_v": nominal_v, "mains_v": mains_v, "expected_v": expected_v}
        yield Found((NOMINAL,), details)


def _inductance(look: Look) -> Iterator[Found]:
    (inductance_uh,) = look(INDUCTANCE)
    if inductance_uh <= 0:
        yield Found((INDUCTANCE,))


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.dc_link_ladder", "4.2.2", Severity.ERROR, LADDER, _ladder, stepwise=True),
    # Stepwise: the lower side has the PMC's minimum only, the upper one a product that grows with both its factors.
    make_rule(
        "oat.pmc_minimum_below_battery",
        "4.2.2",
        Severity.ERROR,
        (PMC_MINIMUM, BLOCS, NOMINAL_BLOC),
        _below_battery,
        stepwise=True,
    ),
    make_rule(
        "oat.chopper_above_booster", "4.5.1.1", Severity.ERROR, (BOOSTER_TARGET, *CHOPPER), _chopper, stepwise=True
    ),
    make_rule("oat.nominal_dc_link", "4.2.2.2", Severity.NOTE, (NOMINAL, MAINS), _nominal),
    make_rule("oat.booster_inductance", "4.4.1.1", Severity.WARNING, (INDUCTANCE,), _inductance),
)
