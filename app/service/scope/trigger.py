"""What a scope waits for. Pure: told of every value and event in their order, it says which of them fulfils it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol

from app.model.axis_state import AxisState
from app.wire.nmt import NmtState


class Slope(Enum):
    """Which way a level is crossed."""

    RISING = "rising"
    FALLING = "falling"
    EITHER = "either"


class Side(Enum):
    """On which side of a level a value lies."""

    ABOVE = "above"
    BELOW = "below"


class What(Enum):
    """What a device told."""

    EMCY = "emcy"
    BOOT_UP = "boot_up"
    NMT = "nmt"
    """The state of network management that it is in; each heartbeat tells it again."""


@dataclass(frozen=True, slots=True)
class Happened:
    """One event on the bus. ``code`` is that of an emergency message, ``state`` that of a heartbeat."""

    t_ns: int
    what: What
    bus: str
    node: int
    code: int | None = None
    state: NmtState | None = None


Node = tuple[str, int]
"""Bus and node number."""


class Trigger(Protocol):
    """Every value and event must be told, also while nothing is waited for: what came before decides."""

    def value(self, source: int, raw: int | float) -> bool:
        """A value of source number ``source`` came; True where it fulfils the condition."""

    def happened(self, event: Happened) -> bool:
        """An event came; True where it fulfils the condition."""

    def forget(self, bus: str, sources: Collection[int]) -> None:
        """Something is missing of ``bus``, on which ``sources`` are: what came before says nothing of what comes."""


class _Quiet:
    """Nothing of it fulfils anything."""

    def value(self, source: int, raw: int | float) -> bool:
        """No value does."""
        return False

    def happened(self, event: Happened) -> bool:
        """No event does."""
        return False

    def forget(self, bus: str, sources: Collection[int]) -> None:
        """Nothing is known."""


class Manual(_Quiet):
    """Fires by hand alone."""


class Edge(_Quiet):
    """A value crosses ``level`` (raw): the one before lay beyond it, this one has reached it."""

    def __init__(self, source: int, bit: int | None, level: float, slope: Slope) -> None:
        self._source, self._bit, self._level, self._slope = source, bit, level, slope
        self._before: int | float | None = None

    def value(self, source: int, raw: int | float) -> bool:
        """True where it is the first at or beyond the level."""
        if source != self._source:
            return False
        now, level = bit_of(raw, self._bit), self._level
        before, self._before = self._before, now
        if before is None:
            return False
        rose, fell = before < level <= now, before > level >= now
        return {Slope.RISING: rose, Slope.FALLING: fell, Slope.EITHER: rose or fell}[self._slope]

    def forget(self, bus: str, sources: Collection[int]) -> None:
        """The next value has none before it."""
        if self._source in sources:
            self._before = None


class Level(_Quiet):
    """A value lies above or below ``level`` (raw); at it is neither."""

    def __init__(self, source: int, bit: int | None, level: float, side: Side) -> None:
        self._source, self._bit, self._level, self._side = source, bit, level, side

    def value(self, source: int, raw: int | float) -> bool:
        """True for each value on that side."""
        if source != self._source:
            return False
        now = bit_of(raw, self._bit)
        return now > self._level if self._side is Side.ABOVE else now < self._level


class Change(_Quiet):
    """A bit is another than it was."""

    def __init__(self, source: int, bit: int) -> None:
        self._source, self._bit = source, bit
        self._before: int | float | None = None

    def value(self, source: int, raw: int | float) -> bool:
        """True where the bit has changed."""
        if source != self._source:
            return False
        before, self._before = self._before, bit_of(raw, self._bit)
        return before is not None and before != self._before

    def forget(self, bus: str, sources: Collection[int]) -> None:
        """The next value has none before it."""
        if self._source in sources:
            self._before = None


class StateChange(_Quiet):
    """The state of an axis changes, by its statusword; ``sources`` are statuswords."""

    def __init__(self, sources: frozenset[int]) -> None:
        self._sources = sources
        self._before: dict[int, AxisState | None] = {}

    def value(self, source: int, raw: int | float) -> bool:
        """True where the statusword tells another state than the one before."""
        if source not in self._sources:
            return False
        now = AxisState.of(int(raw))
        known = source in self._before
        before, self._before[source] = self._before.get(source), now
        return known and before is not now

    def forget(self, bus: str, sources: Collection[int]) -> None:
        """The next statusword has none before it."""
        for source in sources:
            self._before.pop(source, None)


_FAULT: Final = (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE)


class Fault(_Quiet):
    """An axis enters a fault by its statusword, or an emergency message brings an error code.

    ``nodes`` None: of any device. ``code`` None: any but 0 (error reset); else only a message with this code counts.
    """

    def __init__(self, sources: frozenset[int], nodes: frozenset[Node] | None, code: int | None) -> None:
        self._sources, self._nodes, self._code = sources, nodes, code
        self._was: dict[int, bool] = {}

    def value(self, source: int, raw: int | float) -> bool:
        """True where this is the first statusword that tells a fault."""
        if self._code is not None or source not in self._sources:
            return False
        now = AxisState.of(int(raw)) in _FAULT
        before, self._was[source] = self._was.get(source), now
        return before is False and now

    def happened(self, event: Happened) -> bool:
        """True for an emergency message with a code that counts."""
        if event.what is not What.EMCY or not event.code or not _counts(event, self._nodes):
            return False
        return self._code is None or event.code == self._code

    def forget(self, bus: str, sources: Collection[int]) -> None:
        """The next statusword has none before it."""
        for source in sources:
            self._was.pop(source, None)


class Event(_Quiet):
    """A device tells something: an emergency message, its boot-up, another NMT state."""

    def __init__(self, what: What, nodes: frozenset[Node] | None) -> None:
        self._what, self._nodes = what, nodes
        self._states: dict[Node, NmtState | None] = {}

    def happened(self, event: Happened) -> bool:
        """True for what is waited for; a heartbeat only where it tells another state."""
        if not _counts(event, self._nodes):
            return False
        if self._what is not What.NMT:
            return event.what is self._what
        return state_changed(self._states, event)

    def forget(self, bus: str, sources: Collection[int]) -> None:
        """The next heartbeat has none before it."""
        forget_states(self._states, bus)


def state_changed(states: dict[Node, NmtState | None], event: Happened) -> bool:
    """Take what ``event`` tells of an NMT state into ``states``; True where it is another than was known."""
    if event.what is What.EMCY:
        return False
    now = NmtState.PRE_OPERATIONAL if event.what is What.BOOT_UP else event.state
    node = (event.bus, event.node)
    known = node in states
    before, states[node] = states.get(node), now
    return known and before is not now


def forget_states(states: dict[Node, NmtState | None], bus: str) -> None:
    """Take the devices of ``bus`` out of ``states``."""
    for node in [one for one in states if one[0] == bus]:
        del states[node]


def _counts(event: Happened, nodes: frozenset[Node] | None) -> bool:
    return nodes is None or (event.bus, event.node) in nodes


def bit_of(raw: int | float, bit: int | None) -> int | float:
    """The bit of a word, or the number itself."""
    return raw if bit is None else int(raw) >> bit & 1
