"""Trips and their first-out chain.

A trip begins, after a time in which nothing of this was so on any unit, when the first of these is seen:

- the safety relay of a power unit opens (30FEh/3 bit 16), or a power unit sees the end of the safety chain at 0 V
  (30FDh, X13.10, X13.8 or X13.7): the chain is open;
- an axis loses X2.3 (60FDh bit 18): it feathers on its own and obeys its controlword no longer;
- an axis goes to Fault or Fault reaction active (6041h), or feather is commanded by its controlword (bit 11).

It lasts until none of this is so any more on any unit. What a unit does that fell silent or started anew nobody
knows: it carries the trip on, but hides none of another unit. A normal stop has none of it: the controlword feathers
the blades and switches the axes off. A restart opens the chain, and is a trip whose cause is told as a restart.

What was so when the recording began is no trip, and hides none of another unit: nobody saw it begin. A unit that is
tripped from before cannot trip until it is well; a trip of others names it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple

from app.recording.node_table import NodeKey
from app.service.analysis.because import Because, explain
from app.service.analysis.places import Places
from app.service.analysis.steps import Step, steps_of
from app.wire.events import Severity
from app.wire.signs import Sign, SignKind

TRIP_KINDS: Final = frozenset(
    {
        SignKind.RELAY_OPEN,
        SignKind.CHAIN_OPEN,
        SignKind.EFC_INPUT,
        SignKind.AXIS_FAULT,
        SignKind.EFC_COMMAND,
    }
)
_CHAIN: Final = TRIP_KINDS | {
    SignKind.PMM_FAULT,
    SignKind.WATCHDOG_OPEN,
    SignKind.REMOTE_LOST,
    SignKind.NOT_OPERATIONAL,
}
"""What carries a trip on, and is no reason of its own."""
_FORGETTING: Final = frozenset({SignKind.SILENT, SignKind.BOOT_UP})
"""From then on nobody knows whether a condition of the node is so."""
_Condition = tuple[SignKind, str]
BEFORE_NS: Final = 3600 * 1_000_000_000
AFTER_NS: Final = 600 * 1_000_000_000
_QUIET: Final = frozenset({SignKind.AXIS_ENABLED, SignKind.INTERNAL_LIMIT, SignKind.EMCY_RESET})
"""Signs that say nothing about why."""
_LATENT: Final = frozenset({SignKind.PARAMETER_WRITTEN, SignKind.WRITE_ABORTED})
"""Moments that may matter long before a trip."""


class Role(Enum):
    """What a step is to its trip."""

    BEFORE = "before"
    """Known before, and no part of the chain that led to the trip."""
    FIRST = "first"
    """What came first: the beginning of the chain."""
    PATH = "path"
    """Led from the first to the trip."""
    TRIP = "trip"
    """The moment of the trip, T0."""
    CONSEQUENCE = "consequence"
    OWN = "own"
    """Came after T0 and is explained by nothing before it."""

    @property
    def text_key(self) -> str:
        """Text key of its name."""
        return f"analysis.role.{self.value}"


@dataclass(frozen=True, slots=True)
class TripStep:
    """A step of a trip. ``because``: what explains it, by its place among the steps."""

    step: Step
    role: Role
    because: Because | None


@dataclass(frozen=True, slots=True)
class Trip:
    """One trip. ``first``, ``trigger`` and ``at`` are places in ``steps``.

    ``first`` began the chain; ``trigger`` is the last fault, command or loss before the safety chain opened or the axis
    faulted (often the same); ``at`` is the step at T0. ``ended_ns`` None: it lasts to the end of the recording.
    ``already``: the nodes that were tripped before the recording began, and were so at T0.
    """

    t0_ns: int
    ended_ns: int | None
    steps: tuple[TripStep, ...]
    first: int
    trigger: int
    at: int
    already: tuple[NodeKey, ...] = ()

    @property
    def known(self) -> bool:
        """Whether anything on the bus tells why. False: a contact outside the units opened it, or nobody told."""
        return self.first != self.at or self.steps[self.at].step.kind in (SignKind.AXIS_FAULT, SignKind.EFC_COMMAND)

    @property
    def nodes(self) -> tuple[NodeKey, ...]:
        """The nodes of what came first."""
        return self.steps[self.first].step.nodes


def find_trips(signs: Sequence[Sign], places: Places) -> list[Trip]:
    """All trips of a recording; ``signs`` are ``folded``, of the whole recording."""
    episodes = _episodes(signs)
    trips = []
    for number, episode in enumerate(episodes):
        t0_ns, ended_ns, _ = episode
        earliest = max(t0_ns - BEFORE_NS, episodes[number - 1].ended_ns or 0) if number else t0_ns - BEFORE_NS
        latest = min(t0_ns + AFTER_NS, ended_ns or t0_ns + AFTER_NS)
        near = [one for one in signs if earliest <= one.t_ns <= latest]
        trips.append(_trip(episode, near, places))
    return trips


def tripped_before(signs: Sequence[Sign]) -> tuple[NodeKey, ...]:
    """The nodes of which something of a trip was so when the recording began; ``signs`` are ``folded``."""
    return tuple(sorted({(one.bus, one.node) for one in signs if one.standing and one.kind in TRIP_KINDS}))


class _Episode(NamedTuple):
    """A time in which any of ``TRIP_KINDS`` is so. ``already``: the nodes of which one was so before the recording."""

    t0_ns: int
    ended_ns: int | None
    already: tuple[NodeKey, ...]


class _Tripped:
    """Which of ``TRIP_KINDS`` are so, node by node: begun in the recording, or standing from before it.

    ``_lost``: begun at nodes that fell silent or started anew since, so that nobody knows.
    """

    def __init__(self) -> None:
        self._begun: dict[NodeKey, set[_Condition]] = {}
        self._lost: dict[NodeKey, set[_Condition]] = {}
        self._standing: dict[NodeKey, set[_Condition]] = {}
        self.known_ns = 0
        """The last time at which one was known to be so."""

    def __bool__(self) -> bool:
        """Whether a trip goes on, as far as anybody knows."""
        return bool(self._begun or self._lost)

    @property
    def already(self) -> tuple[NodeKey, ...]:
        """The nodes of which one stands from before."""
        return tuple(sorted(self._standing))

    def begins_trip(self, sign: Sign) -> bool:
        """Whether a trip begins by it: one of which nothing is known any more goes on at the nodes that had it."""
        begins = sign.kind in TRIP_KINDS and not sign.ends and not sign.standing
        node = sign.bus, sign.node
        return begins and not self._begun and node not in self._lost and node not in self._standing

    def forget(self) -> None:
        """Another trip begins."""
        self._lost.clear()

    def see(self, sign: Sign) -> None:
        """It begins, ends, or nobody knows any more what its node does."""
        node, condition = (sign.bus, sign.node), (sign.kind, sign.subject)
        if self._begun:
            self.known_ns = sign.t_ns
        if sign.kind in _FORGETTING and not sign.ends:
            self._lost.setdefault(node, set()).update(self._begun.pop(node, ()))
            self._standing.pop(node, None)
        elif sign.kind in TRIP_KINDS and not sign.ends:
            from_before = sign.standing or (node in self._standing and node not in self._begun)
            (self._standing if from_before else self._begun).setdefault(node, set()).add(condition)
        elif sign.kind in TRIP_KINDS:
            for known in (self._begun, self._lost, self._standing):
                known.get(node, set()).discard(condition)
        for known in (self._begun, self._lost, self._standing):
            if node in known and not known[node]:
                del known[node]


def _episodes(signs: Sequence[Sign]) -> list[_Episode]:
    """All of them, by time."""
    tripped = _Tripped()
    found: list[_Episode] = []
    for sign in signs:
        before = bool(tripped)
        if tripped.begins_trip(sign):
            if before:
                found[-1] = found[-1]._replace(ended_ns=tripped.known_ns)
                tripped.forget()
            found.append(_Episode(sign.t_ns, None, tripped.already))
        tripped.see(sign)
        if before and not tripped:
            found[-1] = found[-1]._replace(ended_ns=sign.t_ns)
    return found


def _trip(episode: _Episode, signs: Sequence[Sign], places: Places) -> Trip:
    t0_ns = episode.t0_ns
    steps = steps_of(_telling(signs, t0_ns))
    reasons = explain(steps, places)
    at = next(n for n, one in enumerate(steps) if any(_begins(s, t0_ns) for s in one.signs))
    path = _path(at, reasons)
    first = path[-1]
    trigger = next((n for n in path if steps[n].kind not in _CHAIN), first)
    told = tuple(TripStep(step, _role(n, at, path, steps, reasons), reasons[n]) for n, step in enumerate(steps))
    return Trip(t0_ns, episode.ended_ns, told, first, trigger, at, episode.already)


def _begins(sign: Sign, t0_ns: int) -> bool:
    return sign.t_ns == t0_ns and sign.kind in TRIP_KINDS and not sign.standing


def _telling(signs: Sequence[Sign], t0_ns: int) -> list[Sign]:
    """The begins that may say why: before the trip only what was still so at T0, and moments."""
    over = {(one.key, int(one.details["began_ns"])) for one in signs if one.ends and one.t_ns < t0_ns - _MOMENT_NS}
    found = []
    for sign in signs:
        if sign.ends or sign.kind in _QUIET or sign.details.get("first") or _is_setting_up(sign):
            continue
        if sign.t_ns < t0_ns - _MOMENT_NS:
            if (sign.key, sign.t_ns) in over or (sign.severity is Severity.INFO and sign.kind not in _LATENT):
                continue
            if sign.kind in _MOMENTS and sign.kind not in _LATENT:
                continue
        found.append(sign)
    return found


def _is_setting_up(sign: Sign) -> bool:
    """A value written to a unit of which nobody knew the one before: so does who sets it up after a start."""
    return sign.kind is SignKind.PARAMETER_WRITTEN and "was_raw" not in sign.details


_MOMENT_NS: Final = 10_000_000_000
_MOMENTS: Final = frozenset({SignKind.NMT_COMMAND, SignKind.BOOT_UP, SignKind.GAP})
"""What is over at once, and leads to nothing after ten seconds."""


def _path(at: int, reasons: Sequence[Because | None]) -> list[int]:
    """From the step at T0 back to what came first."""
    path = [at]
    while (because := reasons[path[-1]]) is not None and because.cause not in path:
        path.append(because.cause)
    return path


def _role(number: int, at: int, path: Sequence[int], steps: Sequence[Step], reasons: Sequence[Because | None]) -> Role:
    if number == path[-1] and number != at:
        return Role.FIRST
    if number == at:
        return Role.TRIP
    if number in path:
        return Role.PATH
    explained = set(_path(number, reasons)[1:])
    if explained & set(path):
        return Role.CONSEQUENCE
    if steps[number].t_ns <= steps[at].t_ns:
        return Role.BEFORE
    return Role.CONSEQUENCE if explained else Role.OWN
