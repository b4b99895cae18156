"""In which order values are written, so that after every single write all stepwise rules and all limits hold.

A write is taken as soon as it harms nothing. With limits and rules that compare two objects (a below b, as in the
DC-link ladder) this always comes to an end: what rises waits only for what rises above it, what falls only for what
falls below it, so that some write is always free. Where rules entangle more objects than two, a first choice can lead
nowhere: then other orders of these objects are tried, within a budget. What cannot be placed is named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from app.model.datatypes import Raw
from app.model.restore.interlock import interlocked, settle
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
    waiting = _inside(walk, _meaning_first(walk, [row for row in rows if row not in homing]), frozenset(), {})
    for slug in dict.fromkeys(row.place.slug for row in homing):
        own = [row for row in homing if row.place.slug == slug]
        waiting += _in_their_mode(walk, own, options.leave_modes.get(slug, _mode(walk, slug, states)))
    waiting = _again(walk, waiting)
    for slug, mode in options.leave_modes.items():
        if walk.shown_mode(slug) not in (None, mode):
            walk.set_mode(slug, mode)
    undone = [row for row in rows if row not in waiting and walk.value(row.place) != row.wanted]
    return walk.steps, tuple(row.place for row in (*waiting, *undone))


def _again(walk: Walk, waiting: Sequence[PlanRow]) -> list[PlanRow]:
    """What others have kept back; not modes for which there is no way, for one alone would change the others."""
    stuck = [row for row in waiting if row.place.address in interlocked(walk.description(row.place.slug))]
    return [*stuck, *_advance(walk, [row for row in waiting if row not in stuck])]


def _meaning_first(walk: Walk, rows: Sequence[PlanRow]) -> list[PlanRow]:
    """What says how other numbers are meant stands before these, else all stays in the order given."""
    places, ordered = {row.place: row for row in rows}, dict[Place, PlanRow]()

    def put(row: PlanRow) -> None:
        if row.place in ordered:
            return
        rule = walk.entry(row.place).quantity_rule
        for address in () if rule is None else rule.after:
            first = places.get(Place(row.place.slug, address))
            if first is not None and first is not row:
                put(first)
        ordered.setdefault(row.place, row)

    for row in rows:
        put(row)
    return list(ordered.values())


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


def _inside(walk: Walk, rows: Sequence[PlanRow], opened: frozenset[Place], later: Mapping[Place, Raw]) -> list[PlanRow]:
    """Write what needs no other gate than those that are ``opened``, then what lies behind each further gate.

    Gives what still waits. A gate is a parameter that must hold a value while others are written. ``later``: what the
    device itself will change with the gates around.
    """
    behind: dict[Place, list[tuple[PlanRow, int]]] = {}
    for row in rows:
        gate = next((one for one in walk.gates_of(row.place) if one[0] not in opened), None)
        if gate is not None:
            behind.setdefault(gate[0], []).append((row, gate[1]))
    hidden = {row.place for some in behind.values() for row, _ in some}
    free = [row for row in rows if row.place not in hidden and row.place not in behind]
    waiting = _free(walk, free, later)
    for place, some in behind.items():
        if place in hidden:
            continue  # it is one of those behind another gate: its turn comes there
        own = next((row for row in rows if row.place == place), None)
        waiting += _behind_gate(walk, some, place, own, opened | {place}, later)
    return waiting


def _free(walk: Walk, rows: Sequence[PlanRow], later: Mapping[Place, Raw]) -> list[PlanRow]:
    """Write what nothing but rules, limits and each other keep back: first the modes, then the rest."""
    waiting: list[PlanRow] = []
    bound: set[Place] = set()
    for slug in dict.fromkeys(row.place.slug for row in rows):
        locked = {Place(slug, address) for address in interlocked(walk.description(slug))}
        own = [row for row in rows if row.place in locked]
        bound |= {row.place for row in own}
        if own:
            waiting += settle(walk, slug, own, later)
    return waiting + _advance(walk, [row for row in rows if row.place not in bound])


def _behind_gate(
    walk: Walk,
    rows: Sequence[tuple[PlanRow, int]],
    gate: Place,
    own: PlanRow | None,
    opened: frozenset[Place],
    later: Mapping[Place, Raw],
) -> list[PlanRow]:
    """Write each of ``rows`` while ``gate`` holds its value, then the gate itself; gives what still waits.

    ``own``: the gate's row, where it is to be written too; else it is put back to what it holds. ``opened``: it and the
    gates outside of it.
    """
    before = walk.value(gate)
    if before is None:
        return [*(row for row, _ in rows), *([] if own is None else [own])]
    final = before if own is None else own.wanted
    assert final is not None  # a row that is written has a value
    closing = {Place(gate.slug, address): raw for address, raw in walk.effects(gate, final).items()}
    waiting: list[PlanRow] = []
    for value in sorted(dict.fromkeys(value for _, value in rows), key=lambda one: (one != before, one == final)):
        group = [row for row, needed in rows if needed == value]
        held = walk.value(gate)
        then = later if value == final else {**later, **closing}
        if held == value:
            waiting += _inside(walk, group, opened, then)
        elif own is not None and value == final and walk.can_write(own):
            walk.write(own)
            waiting += _inside(walk, group, opened, then)
        else:
            assert held is not None  # it was known above
            walk.set_gate(gate, value)
            left = _inside(walk, group, opened, then)
            if len(left) == len(group):
                walk.take_back_gate(gate, held)
            waiting += left
    if own is not None and walk.value(gate) != final:
        return [*waiting, *_advance(walk, [own])]
    if own is None and walk.value(gate) != before:
        walk.set_gate(gate, before)
    return waiting


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
    own = {row.place for row in rows}

    def find(place: Place) -> Place:
        while leader.setdefault(place, place) != place:
            place = leader[place]
        return place

    for row in rows:
        for other in own.intersection(walk.ties(row.place)):
            leader[find(other)] = find(row.place)
    groups: dict[Place, list[PlanRow]] = {}
    for row in rows:
        groups.setdefault(find(row.place), []).append(row)
    return list(groups.values())
