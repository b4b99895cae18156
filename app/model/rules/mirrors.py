"""16-bit mirrors of 32-bit objects: values that they cannot show (manual 2.2)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.model.rules.look import Found, Look, Object, make_rule, pmc
from app.model.rules.rule import Rule, Severity

_SIGNED: Final = (-(1 << 15), (1 << 15) - 1)
_UNSIGNED: Final = (0, (1 << 16) - 1)

MIRRORED: Final[tuple[tuple[Object, str, tuple[int, int]], ...]] = (
    (pmc("607D:01"), "507A, 5064", _SIGNED),
    (pmc("607D:02"), "507A, 5064", _SIGNED),
    (pmc("607F"), "50FF, 506C", _SIGNED),
    (pmc("6083"), "5083", _UNSIGNED),
    (pmc("6084"), "5084", _UNSIGNED),
)
"""What bounds or sets the mirrored value, its mirrors, and what these can hold. Of 567Ah and its kin there are none."""


def _overflow(look: Look) -> Iterator[Found]:
    for one, mirrors, (least, most) in MIRRORED:
        raw = look.maybe(one)
        if raw is not None and not least <= raw <= most:
            yield Found((one,), {"object": one.address, "raw": raw, "mirrors": mirrors, "least": least, "most": most})


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.mirror_overflow", "2.2", Severity.NOTE, tuple(one for one, _, _ in MIRRORED), _overflow),
)
