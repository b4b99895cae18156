"""Voltages of the DC link: one order from the least to the greatest, over PMM and PMC (manual 4.2.2, table 19)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from app.model.rules.look import Found, Look, make_rule, pmc, pmm
from app.model.rules.rule import Rule, Severity

LADDER: Final = (
    *pmc("6510:04"),
    *pmm("30FA:03", "30FB:08", "30FA:01", "30FB:07", "30FC:02", "30FC:01", "30FA:02"),
    *pmc("6510:05"),
)
"""From the bottom: minimum PMC, minimum PMM, booster on, nominal, booster target, chopper off, chopper on, maximum PMM,
maximum PMC. All in V. Each lies below the next; the two maxima may be equal, as they are by default."""


def _ladder(look: Look) -> Iterator[Found]:
    """Compares each rung with the next one that is known."""
    known = [(rung, raw) for rung in LADDER if (raw := look.maybe(rung)) is not None]
    for (lower, lower_v), (upper, upper_v) in pairwise(known):
        if lower_v > upper_v or (lower_v == upper_v and upper != LADDER[-1]):
            names = {"lower": lower.address, "upper": upper.address}
            yield Found((lower, upper), {**names, "lower_v": lower_v, "upper_v": upper_v})


RULES: Final[tuple[Rule, ...]] = (
    # Stepwise: an order of values can be kept from any valid state to any other one. Raise what rises, from the top
    # rung downwards, then lower what falls, from the bottom upwards: each value passes only where its neighbour has
    # made room already or stands further away than it finally will.
    make_rule("oat.dc_link_ladder", "4.2.2", Severity.ERROR, LADDER, _ladder, stepwise=True),
)
