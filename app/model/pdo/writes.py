"""From one setup of PDOs to another: the writes, in the order that CiA 301 demands (7.5.2.36 and 7.5.2.38).

Disable what changes (bit 31 of the COB-ID), set the number of mapped objects to 0, write the objects, set their number,
write the other parameters, and enable with the COB-ID at last. Everything that is to change is disabled before anything
is enabled, so that two PDOs may swap their identifiers. What STOP goes by is disabled last and enabled first: meanwhile
STOP goes by SDO.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import Enum
from typing import NamedTuple

from app.model.address import Address
from app.model.pdo.objects import COB_INVALID, PdoParameters
from app.model.pdo.setup import (
    SUB_COB_ID,
    SUB_EVENT,
    SUB_INHIBIT,
    SUB_SYNC_START,
    SUB_TYPE,
    PdoId,
    PdoPlace,
    PdoSetup,
    PdoSetups,
)


class Step(Enum):
    """What a write is for; the value is the end of its text key ``page.pdo.step.…``."""

    DISABLE = "disable"
    CLEAR = "clear"
    MAP = "map"
    COUNT = "count"
    PARAMETER = "parameter"
    ENABLE = "enable"
    COB_ID = "cob_id"


class PdoWrite(NamedTuple):
    """One write to an object of a PDO. ``was`` is what stands there before it; None where that is not known."""

    pdo: PdoId
    step: Step
    address: Address
    raw: int
    was: int | None


def changed_pdos(before: PdoSetups, after: PdoSetups) -> list[PdoId]:
    """Those that are not set up alike."""
    return [pdo for pdo, setup in after.items() if before.get(pdo) != setup]


def writes_between(
    places: Iterable[PdoPlace],
    before: PdoSetups,
    after: PdoSetups,
    is_stop_path: Callable[[PdoSetup], bool] = lambda _setup: False,
) -> list[PdoWrite]:
    """The writes, in their order. Every changed PDO must be in both setups."""
    changed = set(changed_pdos(before, after))
    pairs = [(place, before[place.id], after[place.id]) for place in places if place.id in changed]
    last = sorted(pairs, key=lambda pair: is_stop_path(pair[1]))
    first = sorted(pairs, key=lambda pair: not is_stop_path(pair[2]))
    return [
        *(write for _place, old, _new in last for write in _disable(old)),
        *(write for place, old, new in pairs for write in _fill(place, old, new)),
        *(write for _place, old, new in first for write in _identify(old, new)),
    ]


def _off(parameters: PdoParameters) -> int:
    return parameters.cob_id | COB_INVALID


def _disable(old: PdoSetup) -> Iterable[PdoWrite]:
    if old.enabled:
        address = old.id.parameter(SUB_COB_ID)
        yield PdoWrite(old.id, Step.DISABLE, address, _off(old.parameters), old.parameters.cob_id)


def _fill(place: PdoPlace, old: PdoSetup, new: PdoSetup) -> Iterable[PdoWrite]:
    pdo = place.id
    if old.mapped != new.mapped:
        yield PdoWrite(pdo, Step.CLEAR, pdo.mapped(0), 0, len(old.mapped))
        for sub, entry in enumerate(new.mapped, start=1):
            known = old.mapped[sub - 1].raw if sub <= len(old.mapped) else None
            yield PdoWrite(pdo, Step.MAP, pdo.mapped(sub), entry.raw, known)
        if new.mapped:
            yield PdoWrite(pdo, Step.COUNT, pdo.mapped(0), len(new.mapped), 0)
    for sub, was, raw in (
        (SUB_TYPE, old.parameters.transmission_type, new.parameters.transmission_type),
        (SUB_INHIBIT, old.parameters.inhibit_100us, new.parameters.inhibit_100us),
        (SUB_EVENT, old.parameters.event_ms, new.parameters.event_ms),
        (SUB_SYNC_START, old.parameters.sync_start, new.parameters.sync_start),
    ):
        if sub in place.subs and raw != was:
            yield PdoWrite(pdo, Step.PARAMETER, pdo.parameter(sub), raw, was)


def _identify(old: PdoSetup, new: PdoSetup) -> Iterable[PdoWrite]:
    standing = _off(old.parameters) if old.enabled else old.parameters.cob_id
    if new.parameters.cob_id != standing:
        step = Step.ENABLE if new.enabled else Step.COB_ID
        yield PdoWrite(new.id, step, new.id.parameter(SUB_COB_ID), new.parameters.cob_id, standing)
