"""What a rule is, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from app.model.station import Place, StationValues

Detail = int | float | str
"""Fills a placeholder of a finding's text."""
Details = Mapping[str, Detail]


class Severity(Enum):
    """``ERROR``: must not be so; a restore is refused. ``WARNING``: a person must know. ``NOTE``: worth a look."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


class Verdict(Enum):
    """``NOT_CHECKED``: a value or a partner that the rule needs is not known. It never counts as kept."""

    BROKEN = "broken"
    NOT_CHECKED = "not-checked"


@dataclass(frozen=True, slots=True)
class Finding:
    """What one rule has to say of a station. ``places`` are the objects to mark; none where a partner is missing.

    The text is ``rule.<id>.broken`` or ``rule.not_checked``, filled with ``details``.
    """

    rule_id: str
    severity: Severity
    verdict: Verdict
    places: tuple[Place, ...] = ()
    details: Mapping[str, Detail] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule. ``check`` gives a finding for each thing that is wrong, and nothing where the rule is kept.

    ``objects``: the addresses that it looks at, by description id; it does not concern a station that has none of these
    devices. ``stepwise``: it holds after every single write of a restore as well, not only at its end. Texts:
    ``rule.<id>.title``, ``.why`` and ``.broken``.
    """

    id: str
    section: str
    severity: Severity
    stepwise: bool
    objects: Mapping[str, tuple[str, ...]]
    check: Callable[[StationValues], tuple[Finding, ...]]

    @property
    def description_ids(self) -> tuple[str, ...]:
        """The kinds of devices that it looks at."""
        return tuple(self.objects)
