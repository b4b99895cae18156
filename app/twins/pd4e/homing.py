"""Homing: what each method does, and the course of one (manual, 6.5; CiA 402). Pure.

A method ends at an edge of the reference or of a limit switch, passed in one direction, and, for the ones with index,
at the index that follows. The known parts of the manual name 3 to 6, 11 to 14, 17 to 22, 27 to 30 and 33 to 35; the
others are those of CiA 402. The numbers of homing on block are those of sibling drives: the negative of a method
that ends at a limit switch, with the block in its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

NEGATIVE: Final = -1
POSITIVE: Final = 1


@dataclass(frozen=True, slots=True)
class Plan:
    """One method. ``search``: the direction to begin with, which for a limit is that of the limit.

    ``leaves``: +1 or -1 to leave the reference switch in this direction, ``enters`` to enter it; both 0 without one.
    """

    search: int
    leaves: int = 0
    enters: int = 0
    index: bool = False
    limit: bool = False
    turns: bool = False
    block: bool = False
    here: bool = False


_TO_SWITCH: Final = {
    3: Plan(POSITIVE, leaves=NEGATIVE),
    4: Plan(POSITIVE, enters=POSITIVE),
    5: Plan(NEGATIVE, leaves=POSITIVE),
    6: Plan(NEGATIVE, enters=NEGATIVE),
    7: Plan(POSITIVE, leaves=NEGATIVE, turns=True),
    8: Plan(POSITIVE, enters=POSITIVE, turns=True),
    9: Plan(POSITIVE, enters=NEGATIVE, turns=True),
    10: Plan(POSITIVE, leaves=POSITIVE, turns=True),
    11: Plan(NEGATIVE, leaves=POSITIVE, turns=True),
    12: Plan(NEGATIVE, enters=NEGATIVE, turns=True),
    13: Plan(NEGATIVE, enters=POSITIVE, turns=True),
    14: Plan(NEGATIVE, leaves=NEGATIVE, turns=True),
}
_TO_LIMIT: Final = {1: Plan(NEGATIVE, limit=True), 2: Plan(POSITIVE, limit=True)}
_WITHOUT_INDEX: Final = 16
"""A method without index has the number of the one with it, and this more."""


def plan_of(method: int) -> Plan | None:
    """What a number of 6098h stands for; None where it stands for nothing."""
    number = abs(method)
    with_index = number <= _WITHOUT_INDEX
    base = (_TO_SWITCH | _TO_LIMIT).get(number if with_index else number - _WITHOUT_INDEX)
    if base is not None:
        if method < 0 and not base.limit:
            return None
        return Plan(
            base.search, base.leaves, base.enters, with_index, base.limit, base.turns, block=method < 0, here=False
        )
    if method in (33, 34):
        return Plan(NEGATIVE if method == 33 else POSITIVE, index=True)
    return Plan(0, here=True) if method in (35, 37) else None


@dataclass(frozen=True, slots=True)
class Seen:
    """What the run looks at in one cycle. ``blocked``: the motor has pushed against a block for long enough."""

    negative_limit: bool
    positive_limit: bool
    home: bool
    index: bool
    blocked: bool


class Outcome(Enum):
    """Where a run is."""

    RUNNING = auto()
    FOUND = auto()
    FAILED = auto()


@dataclass(frozen=True, slots=True)
class Order:
    """What to do in this cycle: direction (0 stands), fast for the search, or slow for the zero."""

    direction: int
    fast: bool
    outcome: Outcome = Outcome.RUNNING


_FOUND: Final = Order(0, False, Outcome.FOUND)
_FAILED: Final = Order(0, False, Outcome.FAILED)


class Run:
    """One homing run; ``step`` once a cycle."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._direction = plan.search
        self._turned = False
        if plan.here:
            self._phase: Callable[[Seen], Order] = lambda _seen: _FOUND
        elif plan.limit:
            self._phase = self._to_limit
        elif plan.leaves or plan.enters:
            self._phase = self._to_switch
        else:
            self._phase = self._to_index

    def step(self, seen: Seen) -> Order:
        """What to do after what was seen."""
        return self._phase(seen)

    def _end(self, seen: Seen, direction: int) -> bool:
        if self._plan.block:
            return seen.blocked
        return seen.negative_limit if direction < 0 else seen.positive_limit

    def _then(self, phase: Callable[[Seen], Order], direction: int, fast: bool) -> Order:
        self._phase, self._direction = phase, direction
        return Order(direction, fast)

    # -- limits --------------------------------------------------------------------------

    def _to_limit(self, seen: Seen) -> Order:
        if not self._end(seen, self._direction):
            return Order(self._direction, True)
        if self._plan.block:
            # The block itself is the place, the index the first one on the way back.
            return self._then(self._to_index, -self._direction, False) if self._plan.index else _FOUND
        return self._then(self._off_limit, -self._direction, False)

    def _off_limit(self, seen: Seen) -> Order:
        if self._end(seen, -self._direction):
            return Order(self._direction, False)
        return self._at_edge(self._direction)

    # -- reference switch ------------------------------------------------------------------

    def _to_switch(self, seen: Seen) -> Order:
        if seen.home:
            return self._at_switch(seen)
        if self._end(seen, self._direction):
            if not self._plan.turns or self._turned:
                return _FAILED
            self._turned = True
            return self._then(self._to_switch, -self._direction, True)
        return Order(self._direction, True)

    def _at_switch(self, seen: Seen) -> Order:
        if self._plan.enters:
            return self._then(self._back_off, -self._plan.enters, True)
        return self._then(self._leave, self._plan.leaves, False)

    def _back_off(self, seen: Seen) -> Order:
        if seen.home:
            return _FAILED if self._end(seen, self._direction) else Order(self._direction, True)
        return self._then(self._enter, self._plan.enters, False)

    def _enter(self, seen: Seen) -> Order:
        if seen.home:
            return self._at_edge(self._plan.enters)
        return _FAILED if self._end(seen, self._direction) else Order(self._direction, False)

    def _leave(self, seen: Seen) -> Order:
        if not seen.home:
            return self._at_edge(self._plan.leaves)
        return _FAILED if self._end(seen, self._direction) else Order(self._direction, False)

    # -- index -----------------------------------------------------------------------------

    def _at_edge(self, direction: int) -> Order:
        return self._then(self._to_index, direction, False) if self._plan.index else _FOUND

    def _to_index(self, seen: Seen) -> Order:
        return _FOUND if seen.index else Order(self._direction, False)
