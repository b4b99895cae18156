"""The journal of one restore in the store: each intent on the disk before its step, the outcome with the next one."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from app.errors import HubsideError, StoreError
from app.model.address import parse_address
from app.model.datatypes import Raw
from app.model.restore.plan import StepKind
from app.model.station import Place
from app.service.journal import Kind
from app.service.restore.order import Broken, Cause
from app.store import restore_rows as rows
from app.store.restore_rows import Direction, RestoreRow, RestoreState, StepRow, StepState, ValueRow
from app.store.store import Store

BEGUN: Final = f"journal.{Kind.RESTORE_BEGUN.value}"


def raw_text(raw: Raw) -> str:
    """A raw value as the store keeps it."""
    return json.dumps({"hex": raw.hex()} if isinstance(raw, bytes) else raw, ensure_ascii=False)


def raw_of(text: str) -> Raw:
    """The raw value that ``raw_text`` wrote."""
    value = json.loads(text)
    return bytes.fromhex(value["hex"]) if isinstance(value, dict) else value


def error_document(error: HubsideError) -> dict[str, Any]:
    """An error as it is kept: code, text key and what fills the text."""
    details = {
        name: one if isinstance(one, bool | int | float | str) else str(one) for name, one in error.details.items()
    }
    return {"code": error.code, "text_key": error.text_key, "details": details}


@dataclass(frozen=True, slots=True)
class Kept:
    """A restore as the store has it."""

    row: RestoreRow
    values: tuple[ValueRow, ...]
    steps: tuple[StepRow, ...]

    @property
    def details(self) -> dict[str, Any]:
        """What was ordered."""
        found: dict[str, Any] = json.loads(self.row.details)
        return found

    @property
    def outcome(self) -> dict[str, Any]:
        """How it stands, and why."""
        found: dict[str, Any] = json.loads(self.row.outcome)
        return found

    @property
    def goals(self) -> dict[Place, tuple[Raw, Raw]]:
        """Each object that it answers for: the value before, and the one that is wanted."""
        return {
            Place(one.device, parse_address(one.address)): (raw_of(one.before), raw_of(one.wanted))
            for one in self.values
        }

    @property
    def saves_begun(self) -> frozenset[str]:
        """Devices whose non-volatile memory may hold other values than before."""
        return frozenset(one.device for one in self.steps if one.kind == StepKind.SAVE.value)

    @property
    def parts_begun(self) -> frozenset[Place]:
        """Those of which single categories were saved: the entries that save them."""
        saves = (one for one in self.steps if one.kind == StepKind.SAVE.value)
        return frozenset(Place(one.device, parse_address(one.address)) for one in saves if one.address is not None)


async def load(store: Store, restore_id: str) -> Kept | None:
    """One restore with all its rows. Raises StoreError."""

    def read(connection: Any) -> Kept | None:
        row = rows.get_restore(connection, restore_id)
        if row is None:
            return None
        return Kept(row, tuple(rows.values_of(connection, restore_id)), tuple(rows.steps_of(connection, restore_id)))

    return await store.run(read)


class RestoreLog:
    """Writes one restore. ``stamp`` gives t_ns. What the store refuses is Broken (STORE_FAILED)."""

    def __init__(self, store: Store, kept: Kept, stamp: Callable[[], int]) -> None:
        self._store = store
        self._stamp = stamp
        self._id = kept.row.id
        self._next = len(kept.steps)
        self._ended: StepRow | None = None
        self._running: StepRow | None = None
        self.state = kept.row.state
        self.outcome = kept.outcome
        self.saves_begun = set(kept.saves_begun)
        self.parts_begun = set(kept.parts_begun)

    def tell(self, text_key: str, person: str = "", **details: str) -> None:
        """Something that happened to the restore as a whole; kept with the next state."""
        events = [*self.outcome.get("events", ()), event(self._stamp(), text_key, person, **details)]
        self.outcome = {**self.outcome, "events": events}

    async def enter(self, state: RestoreState, **outcome: Any) -> None:
        """The restore is in ``state`` from now on. ``outcome`` adds to what is known of it; None takes away."""
        merged = {**self.outcome, **outcome}
        self.outcome = {name: one for name, one in merged.items() if one is not None}
        await self._advance(None)
        text = json.dumps(self.outcome, ensure_ascii=False)
        ended_ns = self._stamp() if state.ended else None
        await self._run(lambda connection: rows.put_state(connection, self._id, state, text, ended_ns))
        self.state = state

    async def intend(
        self, direction: Direction, kind: StepKind, device: str, place: Place | None = None, raw: Raw | None = None
    ) -> None:
        """On the disk when this returns: the step may be carried out."""
        address = None if place is None else str(place.address)
        text = None if raw is None else raw_text(raw)
        step = StepRow(self._next, direction, kind.value, device, address, text, self._stamp())
        await self._advance(step)
        self._next += 1
        self._running = step
        if kind is StepKind.SAVE:
            self.saves_begun.add(device)
            self.parts_begun |= {place} if place is not None else set()

    def ended(self, state: StepState, error: HubsideError | None = None, **details: Any) -> None:
        """What became of the step; kept with the next intent or state."""
        if self._running is None:
            return
        known = dict(details) if error is None else {**details, "error": error_document(error)}
        self._ended = replace(
            self._running, state=state, ended_ns=self._stamp(), details=json.dumps(known, ensure_ascii=False)
        )
        self._running = None

    async def _advance(self, begun: StepRow | None) -> None:
        ended = self._ended
        if ended is None and begun is None:
            return
        await self._run(lambda connection: rows.advance(connection, self._id, ended, begun))
        self._ended = None

    async def _run(self, work: Callable[[Any], None]) -> None:
        try:
            await self._store.run(work)
        except StoreError as error:
            raise Broken(Cause.STORE_FAILED, "", error) from error


def event(t_ns: int, text_key: str, person: str = "", **details: str) -> dict[str, Any]:
    """One event of a restore, as it is kept."""
    return {"t_ns": t_ns, "text_key": text_key, "person": person, "details": details}


def new_row(restore_id: str, turbine: str, order: Any, details: Mapping[str, Any], now_ns: int) -> RestoreRow:
    """The row of a restore that begins."""
    return RestoreRow(
        restore_id,
        turbine,
        order.station,
        RestoreState.WRITING,
        order.person,
        order.reason,
        order.work_order,
        now_ns,
        json.dumps(details, ensure_ascii=False),
        outcome=json.dumps({"events": [event(now_ns, BEGUN, order.person, station=order.station)]}, ensure_ascii=False),
    )


def value_rows(goals: Mapping[Place, tuple[Raw, Raw]]) -> list[ValueRow]:
    """The values that a restore answers for, as the store keeps them."""
    return [
        ValueRow(n, place.slug, str(place.address), raw_text(before), raw_text(wanted))
        for n, (place, (before, wanted)) in enumerate(goals.items())
    ]
