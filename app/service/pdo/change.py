"""One change of PDOs, carried out: verified writes in the order of CiA 301, or everything as it was before.

Whatever fails or is cancelled on the way, what stood before is written back, in the same order, and proven by reading.
Where that fails too the change stays open in the store, to be put back later. Who begins one has claimed the device:
its writes pass no gate, so that nothing which is begun meanwhile can keep them from their end.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from app.errors import (
    DeviceError,
    HubsideError,
    NoAnswerError,
    PdoBrokenError,
    PdoChangedError,
    PdoRolledBackError,
    PdoUnknownError,
    RefusedError,
    UnverifiedError,
)
from app.model.checks import Allow
from app.model.pdo.findings import is_stop_path
from app.model.pdo.setup import PdoId, PdoSetup, PdoSetups, objects_of, parse_setup, places_of
from app.model.pdo.writes import PdoWrite, writes_between
from app.service.devices import Target, decode
from app.service.jobs import Job, JobRow, RowState
from app.service.journal import Journal, Kind
from app.service.pdo.kept import Kept, PdoChange, Stand
from app.service.whole import ended
from app.service.write import write_raw


async def read_setups(driver: Any, target: Target) -> dict[PdoId, PdoSetup]:
    """All PDOs of a device, read over the wire now.

    Raises what reading raises, PdoUnknownError where a PDO is set up in a way that is not understood.
    """
    places = places_of(target.description)
    answers = await driver.read_many(target.node, [address for place in places for address in objects_of(place)])
    values = {}
    for address, answer in answers.items():
        if isinstance(answer, HubsideError):
            raise answer
        values[address] = decode(target.entry(address), answer)
    found = {}
    for place in places:
        setup = parse_setup(place, values.get)
        if setup is None:
            raise PdoUnknownError(device=target.slug, pdo=str(place.id))
        found[place.id] = setup
    return found


def planned(target: Target, before: PdoSetups, after: PdoSetups) -> list[PdoWrite]:
    """The writes from one setup to the other."""
    return writes_between(places_of(target.description), before, after, is_stop_path)


class _CancelledError(Exception):
    """A person ended the job."""


_WHY: Final = (
    (DeviceError, "refused"),
    (UnverifiedError, "unverified"),
    (NoAnswerError, "no_answer"),
    (RefusedError, "held"),
)


def _why(error: Exception) -> str:
    """Text key of why a write failed; the row of the write has the details."""
    for kind, name in _WHY:
        if isinstance(error, kind):
            return f"page.pdo.why.{name}"
    return "page.pdo.why.cancelled" if isinstance(error, _CancelledError) else "page.pdo.why.other"


@dataclass
class Carrying:
    """A change under way, of the PDOs that ``change`` names; ``target`` passes no gate.

    ``open_as`` is kept while it runs, and what stays kept where everything fails; ``replaces`` was kept before it.
    ``undo``: it puts an earlier change back.
    """

    driver: Any
    target: Target
    writes: Sequence[PdoWrite]
    change: PdoChange
    open_as: PdoChange
    replaces: PdoChange | None
    kept: Kept
    journal: Journal
    undo: bool = False
    cancelled: bool = False

    async def run(self, job: Job) -> None:
        """To its end, also where the job is cancelled: then everything is put back before it ends.

        Raises PdoRolledBackError, PdoBrokenError, StoreError (nothing was written).
        """
        task = asyncio.ensure_future(self._run(job))
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError:
            self.cancelled = True
            await ended(task)
            if isinstance(error := task.exception(), PdoBrokenError):
                raise error from None  # what is left half-made must be told
            raise

    async def _run(self, job: Job) -> None:
        slug = self.target.slug
        await self.kept.put(slug, self.open_as)  # before anything is written
        try:
            for write, row in zip(self.writes, job.rows, strict=True):
                if self.cancelled:
                    raise _CancelledError
                await self._write(write, row)
                job.done += 1
            await self._prove(self.change.after)
        except (HubsideError, _CancelledError) as error:
            if self.replaces is not None and self.undo and self.replaces.stand is Stand.OPEN:
                # What stood before is the half-made state: whatever is whole by now stays.
                self.journal.note(Kind.PDO_BROKEN, slug, **self._told())
                raise PdoBrokenError(device=slug, reason_key=_why(error), again_key=_why(error)) from error
            await self._roll_back(job, error)
        await self.kept.put(slug, None if self.undo else self.change.applied())
        self.journal.note(Kind.PDO_PUT_BACK if self.undo else Kind.PDO_CHANGED, slug, **self._told())

    async def _write(self, write: PdoWrite, row: JobRow) -> None:
        row.state, row.was = RowState.SENT, write.was
        try:
            done = await write_raw(
                self.driver, self.target, write.address, write.raw, self.journal, allow=Allow.COMMUNICATION
            )
        except HubsideError as error:
            row.state, row.error = RowState.REFUSED, error
            raise
        row.was, row.read = done.was, done.read
        row.state = RowState.VERIFIED if done.verified else RowState.UNPROVEN

    async def _prove(self, wanted: PdoSetups) -> None:
        """Read everything once more. Raises PdoChangedError where a PDO is not what it should be."""
        found = await read_setups(self.driver, self.target)
        for pdo, setup in wanted.items():
            if found[pdo] != setup:
                raise PdoChangedError(device=self.target.slug, pdo=str(pdo))

    async def _roll_back(self, job: Job, error: Exception) -> None:
        """Always raises: PdoRolledBackError, or PdoBrokenError where the change stays open."""
        slug, wanted = self.target.slug, self.change.before
        try:
            found = await read_setups(self.driver, self.target)
            writes = planned(self.target, found, {**found, **wanted})
            rows = [JobRow(slug, write.address.short, was=write.was) for write in writes]
            job.rows.extend(rows)
            job.total += len(rows)
            for write, row in zip(writes, rows, strict=True):
                await self._write(write, row)
                job.done += 1
            await self._prove(wanted)
        except HubsideError as again:
            self.journal.note(Kind.PDO_BROKEN, slug, **self._told())
            raise PdoBrokenError(device=slug, reason_key=_why(error), again_key=_why(again)) from error
        await self.kept.put(slug, self.replaces)
        self.journal.note(Kind.PDO_ROLLED_BACK, slug, **self._told())
        raise PdoRolledBackError(device=slug, reason_key=_why(error)) from error

    def _told(self) -> dict[str, str]:
        return {"pdos": ", ".join(str(pdo) for pdo in self.change.after)}
