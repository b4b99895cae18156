"""The desk at which PDOs are changed: preview, apply, put back. One change at a time, and while nothing moves.

Any technician may: the objects are ``rw``, not the maker's ``r(w)`` that need an expert; what the rules call an error
is refused, every write is in the audit log under the person's name, and one action puts all of it back.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from enum import Enum

from app.errors import PdoBusyError, PdoChangedError, PdoNoUndoError, PdoRefusedError, PdoUnknownError, UsageError
from app.model.pdo.findings import PATHS, Finding, Severity, find
from app.model.pdo.setup import PdoId, PdoSetup, PdoSetups, places_of
from app.model.pdo.writes import PdoWrite, changed_pdos
from app.service.claims import Work
from app.service.connection import Connection
from app.service.devices import Target
from app.service.jobs import Job, JobRow, Jobs
from app.service.journal import Journal
from app.service.motion.desk import MotionDesk
from app.service.pdo.change import Carrying, planned, read_setups
from app.service.pdo.kept import Kept, PdoChange, Stand
from app.service.pdo.look import Cost, cost, setups_of, taken_by_others, with_changes
from app.service.stage import Stage
from app.store.store import Store


@dataclass(frozen=True, slots=True)
class Edit:
    """A PDO as a person wants it: ``base`` is how it was set up when the edit began."""

    base: PdoSetup
    wanted: PdoSetup


@dataclass(frozen=True, slots=True)
class Preview:
    """What an edit would do: findings, the writes in their order, and what it costs."""

    findings: Sequence[Finding]
    writes: Sequence[PdoWrite]
    cost: Cost


@dataclass(frozen=True, slots=True)
class Worker:
    """Who asks, from which page; what is connected and what moves there."""

    person: str
    page: str
    connection: Connection
    motion: MotionDesk
    journal: Journal
    jobs: Jobs

    def at(self, page: str) -> Worker:
        """The same person at a page."""
        return replace(self, page=page)


class UndoStand(Enum):
    """Whether the last change can be put back.

    ``READY``: it stands as it was applied. ``OPEN``: it did not come to its end. ``GONE``: its PDOs hold something else
    since, after a restart of the device for one. ``UNKNOWN``: they were not read since the device started.
    """

    READY = "ready"
    OPEN = "open"
    GONE = "gone"
    UNKNOWN = "unknown"


def preview(stage: Stage, target: Target, edits: Sequence[Edit], before: PdoSetups | None = None) -> Preview:
    """What the edits would do, by what is known, or from ``before``; nothing is sent.

    Raises PdoUnknownError, PdoChangedError.
    """
    before = setups_of(target) if before is None else before
    after = _edited(target, before, edits)
    findings = find(target.description, places_of(target.description), before, after, taken_by_others(stage, target))
    return Preview(findings, planned(target, before, after), cost(stage, target, before, after))


class PdoDesk:
    """The changes of one bench; ``stamp`` gives t_ns. Belongs to the event loop."""

    def __init__(self, store: Store, stamp: Callable[[], int]) -> None:
        self.kept = Kept(store)
        self._stamp = stamp

    def undo_stand(self, target: Target) -> UndoStand | None:
        """How the last change of the device stands, by what was seen on the wire; None where there is none."""
        change = self.kept.of(target.slug)
        if change is None:
            return None
        if change.stand is Stand.OPEN:
            return UndoStand.OPEN
        now = setups_of(target)
        if any(pdo not in now for pdo in change.after):
            return UndoStand.UNKNOWN
        return UndoStand.READY if _stands(change, now) else UndoStand.GONE

    async def apply(self, worker: Worker, target: Target, edits: Sequence[Edit]) -> Job:
        """Write the edits in a job of its own: all of them, or none.

        Raises LeaseHeldError, PdoBusyError, DeviceBusyError, RestoreOpenError, PdoChangedError, PdoRefusedError,
        UsageError, and what reading raises; nothing was written then.
        """

        async def prepare() -> Carrying:
            kept = self.kept.of(target.slug)
            if kept is not None and kept.stand is Stand.OPEN:
                # Its beginning is the only note of how the PDOs were set up: it is put back first.
                raise PdoBusyError(device=target.slug, reason_key="page.pdo.busy.open")
            await target.require_no_restore(worker.connection.driver(target))
            before = await self._read(worker, target)
            after = _edited(target, before, edits)
            self._require(worker, target, before, after, lambda _finding: True)
            return self._carrying(worker, target, before, after)

        return await self._start(worker, target, prepare)

    async def undo(self, worker: Worker, target: Target) -> Job:
        """Put the last change of the device back, in a job of its own.

        One that did not come to its end can be put back while a restore is incomplete too: it is no part of that.
        Raises PdoNoUndoError, PdoChangedError where its PDOs hold something else since, and what ``apply`` raises.
        """
        change = self.kept.of(target.slug)
        if change is None:
            raise PdoNoUndoError(device=target.slug)

        async def prepare() -> Carrying:
            if change.stand is not Stand.OPEN:
                await target.require_no_restore(worker.connection.driver(target))
            before = await self._read(worker, target)
            after = with_changes(before, change.before.values())
            if change.stand is Stand.APPLIED:
                for pdo in change.after:
                    if before[pdo] != change.after[pdo]:
                        raise PdoChangedError(device=target.slug, pdo=str(pdo))
            self._require(worker, target, before, after, lambda finding: finding.code in PATHS)
            return self._carrying(worker, target, before, after, change)

        return await self._start(worker, target, prepare)

    async def _start(self, worker: Worker, target: Target, prepare: Callable[[], Awaitable[Carrying]]) -> Job:
        with ExitStack() as stack:
            stack.enter_context(worker.motion.kept_still(target.slug, worker.page))
            claims = worker.connection.gate.claims
            stack.enter_context(claims.held(Work.PDOS, worker.person, (target.slug,)))
            carrying = await prepare()
            held = stack.pop_all()

        async def work(job: Job) -> None:
            with held:
                await carrying.run(job)

        rows = [JobRow(target.slug, write.address.short, was=write.was) for write in carrying.writes]
        return worker.jobs.start("pdo", target.slug, work, rows)

    async def _read(self, worker: Worker, target: Target) -> dict[PdoId, PdoSetup]:
        return await read_setups(worker.connection.driver(target), target)

    def _require(
        self,
        worker: Worker,
        target: Target,
        before: PdoSetups,
        after: PdoSetups,
        counts: Callable[[Finding], bool],
    ) -> None:
        """Raises PdoRefusedError for the first error that counts, UsageError where nothing is to be written."""
        others = taken_by_others(worker.connection, target)
        for finding in find(target.description, places_of(target.description), before, after, others):
            if finding.severity is Severity.ERROR and counts(finding):
                key = f"page.pdo.finding.{finding.code.value}"
                raise PdoRefusedError(
                    **{**finding.details, "device": target.slug, "pdo": str(finding.pdo), "reason_key": key}
                )

    def _carrying(
        self, worker: Worker, target: Target, before: PdoSetups, after: PdoSetups, undone: PdoChange | None = None
    ) -> Carrying:
        changed = changed_pdos(before, after)
        if not changed and undone is None:
            raise UsageError(reason="no PDO is to be changed")
        old, new = ({pdo: setups[pdo] for pdo in changed} for setups in (before, after))
        change = PdoChange(target.slug, worker.person, self._stamp(), Stand.OPEN, old, new)
        return Carrying(
            worker.connection.driver(target),
            target.past_gate(),
            planned(target, before, after),
            change,
            change if undone is None else undone.opened(),
            self.kept.of(target.slug),
            self.kept,
            worker.journal,
            undo=undone is not None,
        )


def _stands(change: PdoChange, now: PdoSetups) -> bool:
    return all(now.get(pdo) == setup for pdo, setup in change.after.items())


def _edited(target: Target, before: PdoSetups, edits: Sequence[Edit]) -> dict[PdoId, PdoSetup]:
    """The setup with the edits. Raises PdoUnknownError, PdoChangedError."""
    for edit in edits:
        pdo = edit.wanted.id
        if pdo not in before:
            raise PdoUnknownError(device=target.slug, pdo=str(pdo))
        if before[pdo] != edit.base:
            raise PdoChangedError(device=target.slug, pdo=str(pdo))
    return with_changes(before, [edit.wanted for edit in edits])
