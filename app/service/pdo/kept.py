"""The last change of PDOs of each device: kept before its first write, to be put back, also after a crash."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Final

from app.model.pdo.objects import PdoParameters
from app.model.pdo.setup import Direction, Mapped, PdoId, PdoSetup
from app.store.small_rows import get_setting, put_setting
from app.store.store import Store

KEY: Final = "pdo.changes"


class Stand(Enum):
    """How far a change got. ``OPEN``: it has begun; where nobody is at work on it, its end is not known."""

    OPEN = "open"
    APPLIED = "applied"


@dataclass(frozen=True, slots=True)
class PdoChange:
    """A change of some PDOs of a device: who made it, when (t_ns), and how they were set up before and after."""

    device: str
    person: str
    t_ns: int
    stand: Stand
    before: Mapping[PdoId, PdoSetup]
    after: Mapping[PdoId, PdoSetup]

    def applied(self) -> PdoChange:
        """The same, once all of it was verified."""
        return replace(self, stand=Stand.APPLIED)

    def opened(self) -> PdoChange:
        """The same, once it has begun."""
        return replace(self, stand=Stand.OPEN)


class Kept:
    """The last change by device. Kept in ``store``. For the event loop."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._found = _read(store.call(lambda connection: get_setting(connection, KEY)))

    def of(self, device: str) -> PdoChange | None:
        """The last change of a device."""
        return self._found.get(device)

    async def put(self, device: str, change: PdoChange | None) -> None:
        """Keep the change; None forgets the one that there is. Raises StoreError."""
        found = {name: one for name, one in self._found.items() if name != device}
        if change is not None:
            found[device] = change
        document = {name: _document(one) for name, one in found.items()}
        await self._store.run(lambda connection: put_setting(connection, KEY, document))
        self._found = found


def _document(change: PdoChange) -> dict[str, Any]:
    return {
        "person": change.person,
        "t_ns": change.t_ns,
        "stand": change.stand.value,
        "before": [_setup_document(setup) for setup in change.before.values()],
        "after": [_setup_document(setup) for setup in change.after.values()],
    }


def _setup_document(setup: PdoSetup) -> list[Any]:
    return [setup.id.direction.value, setup.id.number, list(setup.parameters), [one.raw for one in setup.mapped]]


def _read(document: Any) -> dict[str, PdoChange]:
    if not isinstance(document, dict):
        return {}
    return {
        device: PdoChange(
            device,
            one["person"],
            one["t_ns"],
            Stand(one["stand"]),
            _read_setups(one["before"]),
            _read_setups(one["after"]),
        )
        for device, one in document.items()
    }


def _read_setups(rows: list[list[Any]]) -> dict[PdoId, PdoSetup]:
    found = (
        PdoSetup(PdoId(Direction(direction), number), PdoParameters(*parameters), tuple(map(Mapped, mapped)))
        for direction, number, parameters, mapped in rows
    )
    return {setup.id: setup for setup in found}
