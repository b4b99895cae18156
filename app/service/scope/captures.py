"""The captures that are kept, and the latest one that nobody asked to keep: of AUTO without a trigger."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import zstandard

from app.errors import ScopeCaptureError, ScopeUnknownError
from app.service.office.audit import Action, AuditLog
from app.service.scope.capture import (
    Capture,
    CaptureLine,
    Head,
    InForce,
    Values,
    dump_head,
    dump_in_force,
    dump_marks,
    line_of,
    load_head,
    load_in_force,
    load_line,
    pack_values,
    renamed,
    unpack_values,
)
from app.store import capture_rows
from app.store.store import Connection, Store

MAX_KEPT: Final = 2000


@dataclass(frozen=True, slots=True)
class Listed:
    """A capture without its values. Not ``kept``: it goes with the next one, or with the server."""

    head: Head
    kept: bool


@dataclass(frozen=True, slots=True)
class _Packed:
    """A capture as the store keeps it."""

    head: Head
    text: str
    marks: str
    values: bytes
    in_force: str


def _packed(capture: Capture, rows: Sequence[InForce]) -> _Packed:
    values, in_force = pack_values(capture.values), dump_in_force(rows)
    head = replace(capture.head, size_bytes=len(values) + len(in_force.encode()))
    return _Packed(head, dump_head(head), dump_marks(head), values, in_force)


class Captures:
    """Of one store. Belongs to the event loop. Every method raises StoreError where the store fails."""

    def __init__(self, store: Store, audit: AuditLog) -> None:
        self._store = store
        self._audit = audit
        self._loose: tuple[Capture, tuple[InForce, ...]] | None = None
        self._open: tuple[str, tuple[Values, ...]] | None = None
        """The values that were asked for last: a page asks for them again with every zoom."""
        self._lines: list[CaptureLine] | None = None
        """What is kept, as it is listed; None: not known. Every open page asks for it again and again."""
        self._version = 0

    # -- reading -------------------------------------------------------------------

    async def all(self) -> list[CaptureLine]:
        """All, the latest first."""
        kept = self._lines
        if kept is None:
            version = self._version
            texts = await self._store.run(capture_rows.heads)
            kept = await asyncio.to_thread(lambda: [load_line(text) for text in texts])
            if version == self._version:
                self._lines = kept
        loose = [] if self._loose is None else [line_of(self._loose[0].head, False)]
        return sorted((*loose, *kept), key=lambda one: one.trigger_ns, reverse=True)

    async def head(self, capture_id: str) -> Listed:
        """One without its values. Raises ScopeUnknownError."""
        if (loose := self._of_loose(capture_id)) is not None:
            return Listed(loose[0].head, False)
        texts = await self._store.run(lambda kept: capture_rows.head_of(kept, capture_id))
        if texts is None:
            raise ScopeUnknownError(capture=capture_id)
        return Listed(await asyncio.to_thread(load_head, *texts), True)

    async def get(self, capture_id: str) -> Capture:
        """One whole. Raises ScopeUnknownError, ScopeCaptureError."""
        if (loose := self._of_loose(capture_id)) is not None:
            return loose[0]
        head = (await self.head(capture_id)).head
        if self._open is not None and self._open[0] == capture_id:
            return Capture(head, self._open[1])
        packed = await self._store.run(lambda kept: capture_rows.values_of(kept, capture_id))
        if packed is None:
            raise ScopeUnknownError(capture=capture_id)
        try:
            values = await asyncio.to_thread(unpack_values, packed)
        except (ValueError, zstandard.ZstdError) as error:
            raise ScopeCaptureError(capture=capture_id, reason=str(error)) from error
        self._open = (capture_id, values)
        return Capture(head, values)

    async def in_force(self, capture_id: str) -> tuple[InForce, ...]:
        """The parameter values that were in force. Raises ScopeUnknownError."""
        if (loose := self._of_loose(capture_id)) is not None:
            return loose[1]
        text = await self._store.run(lambda kept: capture_rows.in_force_of(kept, capture_id))
        if text is None:
            raise ScopeUnknownError(capture=capture_id)
        return await asyncio.to_thread(load_in_force, text)

    # -- changing --------------------------------------------------------------------

    def show(self, capture: Capture, rows: Sequence[InForce]) -> None:
        """Have ``capture`` until the next one comes, without keeping it."""
        self._loose = capture, tuple(rows)

    async def keep(self, capture: Capture, rows: Sequence[InForce]) -> Head:
        """Keep one for good. Raises ScopeCaptureError where there are too many."""
        if await self._store.run(capture_rows.count) >= MAX_KEPT:
            raise ScopeCaptureError(capture=capture.head.name, reason=f"{MAX_KEPT} captures are kept already")
        packed = await asyncio.to_thread(_packed, capture, rows)
        head = packed.head

        def put(kept: Connection) -> None:
            capture_rows.put_capture(
                kept, head.id, head.trigger_ns, packed.text, packed.marks, packed.values, packed.in_force
            )

        await self._store.run(put)
        self._changed()
        return head

    async def change(self, capture_id: str, name: str, note: str, person: str) -> Head:
        """Name and note; one that was not kept is kept by it. Raises ScopeUnknownError, ScopeCaptureError."""
        if (loose := self._of_loose(capture_id)) is not None:
            capture = Capture(renamed(loose[0].head, name, note), loose[0].values)
            head = await self.keep(capture, loose[1])
            self._loose = None
        else:
            head = renamed((await self.head(capture_id)).head, name, note)
            text = dump_head(head)
            if not await self._store.run(lambda kept: capture_rows.put_head(kept, capture_id, text)):
                raise ScopeUnknownError(capture=capture_id)
            self._changed()
        self._audit.note(Action.CAPTURE_CHANGED, person, capture=name)
        return head

    async def delete(self, capture_id: str, person: str) -> None:
        """Forget one. Raises ScopeUnknownError."""
        if (loose := self._of_loose(capture_id)) is not None:
            self._loose = None
            self._audit.note(Action.CAPTURE_DELETED, person, capture=loose[0].head.name)
            return
        head = (await self.head(capture_id)).head
        await self._store.run(lambda kept: capture_rows.delete_capture(kept, capture_id))
        self._changed()
        self._audit.note(Action.CAPTURE_DELETED, person, capture=head.name)

    def _changed(self) -> None:
        """The list is another."""
        self._version += 1
        self._lines = None

    def _of_loose(self, capture_id: str) -> tuple[Capture, tuple[InForce, ...]] | None:
        return self._loose if self._loose is not None and self._loose[0].head.id == capture_id else None
