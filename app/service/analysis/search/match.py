"""Finds a signature in one recording: events first, signals only where an event lets them matter."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from app.model.description import Description
from app.recording.node_table import NodeKey
from app.service.analysis.look import Look
from app.service.analysis.search.levels import Span, check_level, find_levels, fits
from app.service.analysis.search.query import All, Any, EventIs, Level, Not, Order, Pair, Query, Same, Special
from app.service.analysis.search.stretches import Held
from app.service.analysis.steps import onset_ns
from app.service.analysis.trips import Trip
from app.wire.events import Severity
from app.wire.signs import Sign

MAX_FOUND: Final = 200
"""So many places of one recording are told."""


@dataclass(frozen=True, slots=True)
class Found:
    """One place that matches: ``from_ns`` to ``to_ns`` is what matched, ``t_ns`` the moment to jump to.

    ``what`` are its parts in the order of the signature: signs, trips, and stretches in which a condition held.
    """

    from_ns: int
    to_ns: int
    t_ns: int
    key: NodeKey | None
    what: tuple[tuple[Query, Sign | Trip | Held], ...]


def find(look: Look, query: Query) -> list[Found]:
    """All places of a recording that match, by time. Raises UsageError where a unit does not fit its object."""
    return sorted(_find(look, query, None), key=lambda one: (one.t_ns, one.from_ns))[:MAX_FOUND]


def _find(look: Look, query: Query, spans: list[Span] | None) -> list[Found]:
    if isinstance(query, EventIs):
        return [one for one in _events(look, query) if spans is None or _inside(one.t_ns, spans)]
    if isinstance(query, Level):
        return [_held(query, one, spans) for one in find_levels(look, query, spans)]
    if isinstance(query, Pair):
        return _pairs(look, query, spans)
    if isinstance(query, Any):
        return [one for part in query.parts for one in _find(look, part, spans)]
    if isinstance(query, Not):
        return [] if _find(look, query.part, None) else [_nothing(look)]
    return _all(look, query)


def _all(look: Look, query: All) -> list[Found]:
    """Every part is somewhere; that something is missing is no place of its own."""
    parts = [(part, _find(look, part, None)) for part in sorted(query.parts, key=_cost)]
    if not all(found for _, found in parts):
        return []
    told = [one for part, found in parts for one in found if not isinstance(part, Not)]
    return told or parts[0][1]


def _nothing(look: Look) -> Found:
    begin, end = look.span_ns
    return Found(begin, end, begin, None, ())


def _inside(t_ns: int, spans: list[Span]) -> bool:
    return any(begin <= t_ns < end for begin, end in spans)


def _held(query: Level, held: Held, spans: list[Span] | None) -> Found:
    start_ns = held.from_ns
    if spans is not None:  # it may hold since long before
        start_ns = max(start_ns, min(begin for begin, end in spans if end > held.from_ns and begin < held.to_ns))
    return Found(start_ns, held.to_ns, start_ns, held.key, ((query, held),))


def check(query: Query, descriptions: Sequence[Description]) -> None:
    """Whether it can be found at all. Raises UsageError and UnknownObjectError as ``check_level`` does."""
    if isinstance(query, Level):
        check_level(query, descriptions)
    elif isinstance(query, Pair):
        check(query.left, descriptions)
        check(query.right, descriptions)
    elif isinstance(query, Not):
        check(query.part, descriptions)
    elif isinstance(query, All | Any):
        for part in query.parts:
            check(part, descriptions)


# -- events --------------------------------------------------------------------


def _events(look: Look, query: EventIs) -> list[Found]:
    if query.kind is Special.TRIP:
        return [_trip(query, one) for one in look.trips if any(fits(key, query.scope, look) for key in one.nodes)]
    return [
        Found(t_ns := onset_ns(sign), sign.t_ns, t_ns, (sign.bus, sign.node), ((query, sign),))
        for sign in look.signs
        if _is(sign, query) and fits((sign.bus, sign.node), query.scope, look)
    ]


def _trip(query: EventIs, trip: Trip) -> Found:
    first_ns = min(trip.steps[trip.first].step.t_ns, trip.t0_ns)
    return Found(first_ns, trip.t0_ns, trip.t0_ns, trip.nodes[0], ((query, trip),))


def _is(sign: Sign, query: EventIs) -> bool:
    if query.kind is Special.ERROR:
        return not sign.ends and sign.severity is Severity.ERROR
    if query.kind is Special.WARNING:
        return not sign.ends and sign.severity is Severity.WARNING
    if sign.kind is not query.kind or sign.ends is not query.ended:
        return False
    return query.code is None or sign.details.get("code") == query.code


# -- pairs -----------------------------------------------------------------------


def _cost(query: Query) -> int:
    """Events are at hand; signals are read."""
    if isinstance(query, EventIs):
        return 0
    if isinstance(query, Level):
        return 2
    if isinstance(query, Not):
        return _cost(query.part)
    if isinstance(query, Pair):
        return max(1, min(_cost(query.left), _cost(query.right)))
    return max(_cost(part) for part in query.parts)


def _pairs(look: Look, query: Pair, spans: list[Span] | None) -> list[Found]:
    within = query.within_ns
    if query.order is Order.WITHOUT:
        left = _find(look, query.left, spans)
        right = _find(look, query.right, [(one.t_ns, one.t_ns + within + 1) for one in left]) if left else []
        return [one for one in left if not _after(look, one, right, query)]
    if query.order is Order.BEFORE or _cost(query.right) <= _cost(query.left):
        right = _find(look, query.right, spans)
        left = _find(look, query.left, [(one.t_ns - within, one.t_ns + 1) for one in right]) if right else []
    else:
        left = _find(look, query.left, spans)
        right = _find(look, query.right, [(one.t_ns, one.t_ns + within + 1) for one in left]) if left else []
    return _joined(look, left, right, query)


def _joined(look: Look, left: Sequence[Found], right: Sequence[Found], query: Pair) -> list[Found]:
    """For each right one the nearest left one in time."""
    ordered = sorted(left, key=lambda one: one.from_ns)
    starts = [one.from_ns for one in ordered]
    found = []
    for late in right:
        at = bisect_left(starts, late.t_ns + 1)
        for early in reversed(ordered[:at]):
            if _in_time(early, late, query) and _same(look, early, late, query.same):
                found.append(Found(early.from_ns, late.to_ns, late.t_ns, late.key, early.what + late.what))
                break
    return found


def _in_time(early: Found, late: Found, query: Pair) -> bool:
    """A condition counts to its end, an event at its moment; nothing follows itself."""
    if early.what == late.what:
        return False
    last_ns = early.to_ns if early.what and isinstance(early.what[-1][1], Held) else early.t_ns
    if query.order is Order.BEFORE:
        return early.from_ns <= late.t_ns and last_ns >= late.t_ns - query.within_ns
    return early.t_ns <= late.t_ns <= last_ns + query.within_ns


def _after(look: Look, early: Found, right: Sequence[Found], query: Pair) -> bool:
    return any(
        early.what != late.what
        and early.t_ns <= late.t_ns <= early.t_ns + query.within_ns
        and _same(look, early, late, query.same)
        for late in right
    )


def _same(look: Look, early: Found, late: Found, same: Same | None) -> bool:
    if same is None:
        return True
    if early.key is None or late.key is None or early.key == late.key:
        return early.key == late.key
    if same is Same.NODE:
        return False
    places = look.places.get(early.key), look.places.get(late.key)
    return places[0] is not None and places[1] is not None and places[0].station == places[1].station
