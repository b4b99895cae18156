"""In which order values are written, so that after every single write all stepwise rules and all limits hold.

A write is taken as soon as it harms nothing. With limits and rules that compare two objects (a below b, as in the
DC-link ladder) this always comes to an end: what rises waits only for what rises above it, what falls only for what
falls below it, so that some write is always free. Where rules entangle more objects than two, a first choice can lead
nowhere: then other orders of these objects are tried, within a budget. What cannot be placed is named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from app.model.restore.plan import PlanRow, Step
from app.model.restore.walk import Walk
from app.model.restore.wanted import DeviceState, PlanOptions
from app.model.rules.rule import Rule
from app.model.station import Place, StationValues

_BUDGET: Final = 5000
"""Sets of written rows that a search looks at before it gives up: some tenths of a second."""


def order(
    station: StationValues,
    rows: Sequence[PlanRow],
    rules: Sequence[Rule],
    options: PlanOptions,
    states: Mapping[str, DeviceState],
) -> tuple[list[Step], tuple[Place, ...]]:
    """Writes in their order, with the changes of mode that they need; and the places for which there is no order."""
    walk = Walk(station, rows, rules, options)
    homing = [row for row in rows if walk.mode_needed(row.place) is not None]
    gates = {row.place: found for row in rows if (found := walk.gate_of(row.place)) is not None}
    closing = {gate for gate, _ in gates.values()}
    ordinary = [row for row in rows if row not in homing and row.place not in gates and row.place not in closing]
    waiting = _advance(walk, ordinary)
    for gate, opened in dict.fromkeys(gates.values()):
        behind = [row for row in rows if gates.get(row.place) == (gate, opened)]
        waiting += _behind_gate(walk, behind, gate, opened, next((row for row in rows if row.place == gate), None))
    for slug in dict.fromkeys(row.place.slug for row in homing):
        own = [row for row in homing if row.place.slug == slug]
        waiting += _in_their_mode(walk, own, options.leave_modes.get(slug, _mode(walk, slug, states)))
    waiting = _advance(walk, waiting)
    for slug, mode in options.leave_modes.items():
        if walk.shown_mode(slug) not in (None, mode):
            walk.set_mode(slug, mode)
    return walk.steps, tuple(row.place for row in waiting)


def _mode(walk: Walk, slug: str, states: Mapping[str, DeviceState]) -> int | None:
    """The mode of operation that the device is in before the plan; None where it is not known."""
    state = states.get(slug)
    mode = walk.shown_mode(slug) if state is None or state.mode is None else state.mode
    return mode if isinstance(mode, int) else None


def _in_their_mode(walk: Walk, rows: list[PlanRow], leave: int | None) -> list[PlanRow]:
    """Write what needs another mode of operation, in that mode; gives what is still waiting.

    0 demands no mode at all (table 55), so that a device cannot be put back to it but by a restart.
    """
    slug = rows[0].place.slug
    before, needed = walk.shown_mode(slug), walk.mode_needed(rows[0].place)
    assert needed is not None  # that is what these rows were chosen for
    walk.set_mode(slug, needed)
    waiting = _advance(walk, rows)
    if len(waiting) == len(rows):
        walk.forget_mode(slug, before)  # nothing can be written in that mode: then nobody has to change it
    elif leave:
        walk.set_mode(slug, leave)
    return waiting


def _behind_gate(walk: Walk, rows: list[PlanRow], gate: Place, opened: int, own: PlanRow | None) -> list[PlanRow]:
    """Write what can be written only while ``gate`` holds ``opened``, then the gate itself; gives what still waits.

    ``own``: the gate's row, where it is to be written too; else it is put back to what it holds.
    """
    before = walk.value(gate)
    if before is None:
        return rows if own is None else [*rows, own]
    if before != opened:
        walk.set_gate(gate, opened)
    waiting = _advance(walk, rows)
    if before != opened and len(waiting) == len(rows):
        walk.take_back_gate(gate, before)
    elif own is None and before != opened:
        walk.set_gate(gate, before)
    return waiting if own is None else [*waiting, *_advance(walk, [own])]


def _advance(walk: Walk, rows: Sequence[PlanRow]) -> list[PlanRow]:
    """Write all that can be written; gives the rows that cannot."""
    waiting: list[PlanRow] = []
    for group in _tied(walk, rows):
        left = _greedily(walk, group)
        if left:
            for row in reversed([row for row in group if row not in left]):
                walk.take_back(row)
            left = _search(walk, group)
        waiting += left
    return waiting


def _greedily(walk: Walk, rows: Sequence[PlanRow]) -> list[PlanRow]:
    """Write whatever harms nothing, again and again until nothing more can be written; gives what is left."""
    waiting, before = list(rows), -1
    while waiting and len(waiting) != before:
        before = len(waiting)
        waiting = [row for row in waiting if not _written(walk, row)]
    return waiting


def _written(walk: Walk, row: PlanRow) -> bool:
    if not walk.can_write(row):
        return False
    walk.write(row)
    return True


def _search(walk: Walk, rows: Sequence[PlanRow]) -> list[PlanRow]:
    """Try all orders, depth first, and keep the one that writes most; gives what it leaves.

    What may follow rests only on what was written, not on the order: each set of written rows is looked at once.
    """
    best: list[int] = []
    path: list[int] = []
    seen: set[frozenset[int]] = set()

    def descend() -> bool:
        nonlocal best
        if len(path) > len(best):
            best = list(path)
        if len(path) == len(rows) or len(seen) >= _BUDGET:
            return True
        for at, row in enumerate(rows):
            if at in path or frozenset((*path, at)) in seen or not walk.can_write(row):
                continue
            path.append(at)
            seen.add(frozenset(path))
            walk.write(row)
            done = descend()
            walk.take_back(row)
            path.pop()
            if done:
                return True
        return False

    descend()
    for at in best:
        walk.write(rows[at])
    return [row for at, row in enumerate(rows) if at not in best]


def _tied(walk: Walk, rows: Sequence[PlanRow]) -> list[list[PlanRow]]:
    """Rows in groups: those that rules, limits and preconditions tie together, each group in the order given."""
    leader: dict[Place, Place] = {}

    def find(place: Place) -> Place:
        while leader.setdefault(place, place) != place:
            place = leader[place]
        return place

    for row in rows:
        for other in walk.ties(row.place):
            leader[find(other)] = find(row.place)
    groups: dict[Place, list[PlanRow]] = {}
    for row in rows:
        groups.setdefault(find(row.place), []).append(row)
    return list(groups.values())
