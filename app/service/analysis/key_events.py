"""What one jumps to: trips, errors and warnings of a recording, and the next or the one before from any time."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.service.analysis.look import Look
from app.service.analysis.steps import Step, steps_of
from app.service.analysis.trips import Trip
from app.wire.events import Severity


class KeyKind(Enum):
    """What is jumped to."""

    TRIP = "trip"
    ERROR = "error"
    WARNING = "warning"


ALL_KINDS: Final = frozenset(KeyKind)
_OF_SEVERITY: Final = {Severity.ERROR: KeyKind.ERROR, Severity.WARNING: KeyKind.WARNING}


@dataclass(frozen=True, slots=True)
class KeyEvent:
    """One event. A trip is at its T0; ``number`` is its place among the trips of the recording."""

    t_ns: int
    kind: KeyKind
    what: Trip | Step
    number: int | None = None

    @property
    def step(self) -> Step:
        """What happened; of a trip what came first."""
        return self.what.steps[self.what.first].step if isinstance(self.what, Trip) else self.what


def key_events(look: Look, kinds: Collection[KeyKind] = ALL_KINDS) -> list[KeyEvent]:
    """All of these kinds by time; of one moment the trip first."""
    found = [KeyEvent(trip.t0_ns, KeyKind.TRIP, trip, number) for number, trip in enumerate(look.trips)]
    for step in steps_of(look.signs):
        kind = _OF_SEVERITY.get(step.severity)
        if kind is not None:
            found.append(KeyEvent(step.t_ns, kind, step))
    return sorted((one for one in found if one.kind in kinds), key=lambda one: one.t_ns)


def events_after(events: list[KeyEvent], t_ns: int, limit: int) -> list[KeyEvent]:
    """The next ones later than ``t_ns``, the nearest first."""
    at = bisect_right(events, t_ns, key=lambda one: one.t_ns)
    return events[at : at + limit]


def events_before(events: list[KeyEvent], t_ns: int, limit: int) -> list[KeyEvent]:
    """The ones earlier than ``t_ns``, the nearest first."""
    at = bisect_left(events, t_ns, key=lambda one: one.t_ns)
    return events[max(0, at - limit) : at][::-1]
