"""The audit log: who did what, when, to which device; every row is chained to the one before (``store.audit_chain``).

``take`` and ``note`` are called from any thread and never wait: rows queue for the store's thread, which writes all
that waits in one transaction. Nothing is dropped: where the store fails, rows wait in memory, their number can be
asked, the page is told, and writing is tried again.
"""

from __future__ import annotations

import asyncio
import csv
import logging
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from enum import Enum
from functools import partial
from threading import Lock, Timer
from typing import Any, Final, TextIO

from app.errors import HubsideError, StoreBusyError
from app.service.journal import Entry, Journal, Kind
from app.store import audit_rows, small_rows
from app.store.audit_chain import AuditRow, Breach, Broken, Head, canonical, plain
from app.store.audit_rows import Filter, NewRow
from app.store.store import Connection, Store
from app.store.uuid7 import Uuid7

log = logging.getLogger(__name__)

CHUNK: Final = 2000
"""Rows that are checked or exported at a time, so that other work of the store comes between."""
RETRY_S: Final = 2.0
VERIFIED: Final = "audit.verified"
Tell = Callable[[], None]
_ADDRESS: Final = "address"


class Action(Enum):
    """What people did that is no event of a connection; the value is the end of its text key ``audit.…``."""

    LOGIN = "login"
    LOGIN_FAILED = "login_failed"
    LAUNCHED = "launched"
    LOGOUT = "logout"
    USER_ADDED = "user_added"
    USER_ROLE = "user_role"
    USER_PASSWORD = "user_password"
    USER_DISABLED = "user_disabled"
    USER_ENABLED = "user_enabled"
    VISIT_STARTED = "visit_started"
    VISIT_CONTINUED = "visit_continued"
    VISIT_ENDED = "visit_ended"
    VISIT_CHANGED = "visit_changed"
    SET_TAGGED = "set_tagged"
    SET_UNTAGGED = "set_untagged"
    SET_IMPORTED = "set_imported"
    SETS_RECOVERED = "sets_recovered"
    NAMEPLATE_TYPED = "nameplate_typed"
    MOTOR_ADDED = "motor_added"
    MOTOR_CHANGED = "motor_changed"
    MOTOR_DELETED = "motor_deleted"
    MOTOR_ASSIGNED = "motor_assigned"
    INCIDENT_CHANGED = "incident_changed"
    INCIDENT_HIDDEN = "incident_hidden"
    INCIDENT_EXPORTED = "incident_exported"
    INCIDENT_OPENED = "incident_opened"
    INCIDENT_REPORTED = "incident_reported"
    ANNOTATED = "annotated"
    ANNOTATION_CHANGED = "annotation_changed"
    ANNOTATION_REMOVED = "annotation_removed"
    ANNOTATIONS_MERGED = "annotations_merged"
    CAPTURE_CHANGED = "capture_changed"
    CAPTURE_DELETED = "capture_deleted"

    @property
    def text_key(self) -> str:
        """Key of its text."""
        return f"audit.{self.value}"


_JOURNAL_KINDS: Final = frozenset(kind.value for kind in Kind)


def text_key_of(kind: str) -> str:
    """Text key of a row's kind."""
    return f"journal.{kind}" if kind in _JOURNAL_KINDS else f"audit.{kind}"


@dataclass(frozen=True, slots=True)
class Verified:
    """A walk over the whole chain: how many rows, and the first that is broken."""

    rows: int
    head: Head
    broken: Broken | None
    t_ns: int


class AuditLog:
    """The log of one store. ``stamp`` gives t_ns; ``journal`` is told where the store fails."""

    def __init__(self, store: Store, stamp: Callable[[], int] = time.time_ns, journal: Journal | None = None) -> None:
        self._store = store
        self._stamp = stamp
        self._journal = journal
        self._new_id = Uuid7(stamp)
        self._waiting: deque[NewRow] = deque()
        self._lock = Lock()
        self._writing: Future[int] | None = None
        self._retry: Timer | None = None
        self._failing = False
        self._closed = False

    # -- writing -------------------------------------------------------------------

    def take(self, entry: Entry) -> None:
        """An event of the journal. For ``Journal.listen``."""
        self._add(entry.t_ns, entry.kind, entry.device, entry.person, entry.details)

    def note(self, action: Action, person: str, device: str | None = None, /, **details: Any) -> None:
        """Something that a person did; a detail ``address`` is the parameter's, in its short form."""
        self._add(self._stamp(), action, device, person, details)

    @property
    def waiting(self) -> int:
        """Rows that are not on the disk yet."""
        return len(self._waiting)

    @property
    def failing(self) -> bool:
        """True while the store cannot be written."""
        return self._failing

    def _add(self, t_ns: int, kind: Enum, device: str | None, person: str, details: Mapping[str, Any]) -> None:
        address = details.get(_ADDRESS)
        others = {key: plain(detail) for key, detail in details.items() if key != _ADDRESS}
        at = None if address is None else str(address)
        with self._lock:
            row = NewRow(self._new_id(), t_ns, person, str(kind.value), device, at, canonical(others))
            self._waiting.append(row)
        self._write_soon()

    def _write_soon(self) -> None:
        """Have the store's thread write what waits, unless it is about to, or a failure is being waited out."""
        with self._lock:
            if self._writing is not None or self._retry is not None or not self._waiting:
                return
            try:
                writing = self._writing = self._store.submit(self._write)
            except HubsideError as error:
                writing, tell = None, self._failed(error)
        if writing is not None:
            writing.add_done_callback(self._written)
        elif tell is not None:
            tell()

    def _write(self, connection: Connection) -> int:
        with self._lock:
            rows = list(self._waiting)
        audit_rows.append(connection, rows)
        return len(rows)

    def _written(self, done: Future[int]) -> None:
        """The transaction has ended. In the store's thread."""
        error = done.exception()
        tell: Tell | None = None
        with self._lock:
            self._writing = None
            if error is not None:
                tell = self._failed(error)
            else:
                for _ in range(done.result()):
                    self._waiting.popleft()
                if self._failing:
                    self._failing = False
                    tell = partial(self._tell, Kind.STORE_BACK, file=self._store.file)
        if tell is not None:
            tell()
        self._write_soon()

    def _failed(self, error: BaseException) -> Tell | None:
        """Try again later; gives what is to be told once the lock is free, the first time. Holds the lock."""
        log.error("the audit log cannot be written, %d rows wait: %s", len(self._waiting), error)
        first, self._failing = not self._failing, True
        if not self._closed:
            self._retry = Timer(RETRY_S, self._try_again)
            self._retry.daemon = True
            self._retry.start()
        reason = str(getattr(error, "details", {}).get("reason", error))
        return partial(self._tell, Kind.STORE_FAILED, file=self._store.file, reason=reason) if first else None

    def _tell(self, kind: Kind, **details: Any) -> None:
        if self._journal is not None:
            self._journal.note(kind, None, **details)

    def _try_again(self) -> None:
        with self._lock:
            self._retry = None
        self._write_soon()

    async def close(self, timeout_s: float = 10.0) -> None:
        """Have all rows on the disk; those that cannot be written are named in the program's log."""
        try:
            await self.flush(timeout_s)
        except StoreBusyError:
            log.critical("%d rows of the audit log were not written: %s", len(self._waiting), list(self._waiting))
        with self._lock:
            self._closed = True
            if self._retry is not None:
                self._retry.cancel()

    async def flush(self, timeout_s: float = 10.0) -> None:
        """Wait until all rows are on the disk. Raises StoreBusyError; rows that failed go on waiting."""
        try:
            async with asyncio.timeout(timeout_s):
                while self._waiting:
                    self._write_soon()
                    await asyncio.sleep(0.005)
        except TimeoutError as error:
            raise StoreBusyError(file=self._store.file, timeout_s=timeout_s) from error

    # -- reading -------------------------------------------------------------------

    async def head(self) -> tuple[Head, int | None]:
        """The end of the chain, and when the whole of it was last found good (t_ns)."""

        def work(connection: Connection) -> tuple[Head, int | None]:
            return audit_rows.head(connection), small_rows.get_setting(connection, VERIFIED)

        return await self._store.run(work)

    async def latest(self, wanted: Filter, before: int | None, limit: int) -> list[AuditRow]:
        """Rows that fit, newest first, older than the row ``before``."""
        return await self._store.run(lambda connection: audit_rows.latest(connection, wanted, before, limit))

    async def between(self, wanted: Filter, start_ns: int, end_ns: int) -> list[AuditRow]:
        """Rows that fit with ``start_ns`` <= t_ns < ``end_ns``, oldest first."""
        return await self._store.run(lambda connection: audit_rows.between(connection, wanted, start_ns, end_ns))

    async def last_of_each_address(self, device: str, kinds: tuple[str, ...]) -> list[AuditRow]:
        """The newest row of these kinds for every address of ``device``."""
        return await self._store.run(lambda connection: audit_rows.last_of_each_address(connection, device, kinds))

    async def verify(self, expected: Head | None = None) -> Verified:
        """Walk the whole chain; ``expected`` is a head that somebody noted, which must be in it."""
        last = Head()
        broken: Broken | None = None
        while broken is None:
            before = last
            limit = CHUNK if expected is None or before.seq >= expected.seq else min(CHUNK, expected.seq - before.seq)
            last, broken = await self._store.run(partial(audit_rows.walk, before=before, limit=limit))
            if broken is None and expected is not None and last.seq == expected.seq and last.hash != expected.hash:
                broken = Broken(last.seq, Breach.CHANGED)
            if last == before:
                break
        if broken is None and expected is not None and last.seq < expected.seq:
            broken = Broken(last.seq + 1, Breach.END)
        if broken is None:
            broken = await self._store.run(lambda connection: audit_rows.check_end(connection, last))
        done = Verified(last.seq, last, broken, self._stamp())
        if broken is None:
            await self._store.run(lambda connection: small_rows.put_setting(connection, VERIFIED, done.t_ns))
        return done

    async def export(self, wanted: Filter, file: TextIO) -> int:
        """Write rows that fit as CSV, oldest first; gives their number."""
        writer = csv.writer(file)
        writer.writerow(AuditRow.__dataclass_fields__)
        seq = count = 0
        while rows := await self._store.run(partial(audit_rows.after, wanted=wanted, seq=seq, limit=CHUNK)):
            for row in rows:
                writer.writerow(_cells(row))
            seq, count = rows[-1].seq, count + len(rows)
        return count


def _cells(row: AuditRow) -> Iterator[Any]:
    """The row's fields; what a spreadsheet would take for a formula is kept from it by an apostrophe."""
    for name in AuditRow.__dataclass_fields__:
        cell = getattr(row, name)
        yield f"'{cell}" if isinstance(cell, str) and cell.startswith(("=", "+", "-", "@", "\t", "\r")) else cell
