"""Objects of which each may be written depending on what the others hold: modes that condition each other.

The planner looks for the shortest way from what these objects hold to what they are to hold, over values of their
enumerations. It knows what the device takes (conditions) and what it changes by itself (effects). What is written on
the way only, so that something else can be, is an auxiliary step.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence, Set
from typing import Final, NamedTuple

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.restore.plan import PlanRow
from app.model.restore.walk import Walk
from app.model.station import Place

_BUDGET: Final = 20_000
"""Constellations that a search looks at before it gives up."""


class _Move(NamedTuple):
    address: Address
    raw: int


class _Node(NamedTuple):
    """What the objects hold, and which of the wanted ones were written as they are wanted since they changed last."""

    held: tuple[Raw | None, ...]
    written: frozenset[Address]


def interlocked(description: Description) -> tuple[Address, ...]:
    """The objects that condition each other: those of conditions that concern some values only, and what they name."""
    found: dict[Address, None] = {}
    for entry in description:
        for condition in entry.requires:
            named = description.entries.get(condition.address)
            if condition.writing and named is not None and named.is_parameter and named.access.writable:
                found |= dict.fromkeys((entry.address, condition.address))
    return tuple(sorted(found))


def settle(walk: Walk, slug: str, rows: Sequence[PlanRow], later: Mapping[Place, Raw]) -> list[PlanRow]:
    """Write ``rows``, which are interlocked, in a legal order; gives them where there is none.

    ``later`` is what the device will put into some of them by itself: what they hold until then is all the same.
    """
    wanted = {row.place.address: row.wanted for row in rows if later.get(row.place) != row.wanted}
    path = _way(walk, slug, wanted, {place.address for place in later if place.slug == slug})
    if path is None:
        return list(rows)
    by_address = {row.place.address: row for row in rows}
    last = {move.address: number for number, move in enumerate(path)}
    for number, move in enumerate(path):
        row = by_address.get(move.address)
        if row is not None and last[move.address] == number and row.wanted == move.raw:
            walk.write(row)
        else:
            walk.set_gate(Place(slug, move.address), move.raw)
    return []


def _way(walk: Walk, slug: str, wanted: Mapping[Address, Raw | None], free: Set[Address]) -> list[_Move] | None:
    """The shortest way; None where there is none. What ``free`` objects hold at its end is all the same."""
    addresses = interlocked(walk.description(slug))
    values = walk.values(slug)
    held = tuple(values.get(address) for address in addresses)
    goal = {address: raw for address, raw in zip(addresses, held, strict=True) if address not in free} | dict(wanted)
    start = _Node(held, frozenset())
    came: dict[_Node, tuple[_Node, _Move] | None] = {start: None}
    queue = deque([start])
    while queue and len(came) < _BUDGET:
        node = queue.popleft()
        reached = dict(zip(addresses, node.held, strict=True))
        if node.written == wanted.keys() and all(reached[address] == raw for address, raw in goal.items()):
            return _back(came, node)
        for move in _moves(walk, slug, addresses, goal):
            following = _after(walk, slug, addresses, node, move, wanted)
            if following is not None and following not in came:
                came[following] = node, move
                queue.append(following)
    return None


def _moves(walk: Walk, slug: str, addresses: Sequence[Address], goal: Mapping[Address, Raw | None]) -> Iterator[_Move]:
    """What may be written at all, that of the goal first."""
    description = walk.description(slug)
    aims = [_Move(address, raw) for address, raw in goal.items() if isinstance(raw, int)]
    yield from aims
    for address in addresses:
        name = description.entry(address).enumeration
        for one in () if name is None else description.enumerations[name].values:
            move = _Move(address, one.value)
            if move not in aims:
                yield move


def _after(
    walk: Walk, slug: str, addresses: Sequence[Address], node: _Node, move: _Move, wanted: Mapping[Address, Raw | None]
) -> _Node | None:
    """What stands there after the write; None where the device would refuse it."""
    held = dict(zip(addresses, node.held, strict=True))
    if not walk.takes(Place(slug, move.address), move.raw, held):
        return None
    changed = {move.address: move.raw} | walk.effects(Place(slug, move.address), move.raw)
    written = node.written - {address for address, raw in changed.items() if held.get(address) != raw}
    if wanted.get(move.address) == move.raw:
        written |= {move.address}
    return _Node(tuple(changed.get(address, held[address]) for address in addresses), frozenset(written))


def _back(came: Mapping[_Node, tuple[_Node, _Move] | None], node: _Node) -> list[_Move]:
    path: list[_Move] = []
    while (step := came[node]) is not None:
        node, move = step
        path.append(move)
    return path[::-1]
