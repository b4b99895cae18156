"""The store: one thread owns the one connection; everything that is read or written goes through it, in order.

``work`` is a function of a SQLAlchemy connection. Each runs in a transaction of its own: what it raises undoes it.
"""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeoutError
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

from sqlalchemy import Connection as Connection
from sqlalchemy import Engine, create_engine, event
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import StaticPool

from app.errors import StoreBusyError, StoreDamagedError, StoreError
from app.store import database
from app.store.lock import FolderLock

T = TypeVar("T")
Work = Callable[[Connection], T]

TIMEOUT_S: Final = 10.0
IN_MEMORY: Final = ":memory:"


class Store:
    """From ``open`` or ``in_memory`` to ``close``. Safe from any thread."""

    def __init__(self, path: Path | None, lock: FolderLock | None) -> None:
        self._path = path
        self._lock = lock
        self._executor = ThreadPoolExecutor(1, "store")
        self._engine: Engine | None = None
        try:
            self._executor.submit(self._begin).result()
        except BaseException:
            self._executor.shutdown()
            raise

    @classmethod
    def open(cls, folder: Path) -> Store:
        """The store of a data folder, made where there is none. Waits for the disk.

        Raises StoreInUseError, StoreDamagedError, StoreError.
        """
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock = FolderLock(folder / database.LOCK, folder / database.FILE)
        except OSError as error:
            raise StoreError(file=str(folder), reason=error.strerror or str(error)) from error
        try:
            return cls(folder / database.FILE, lock)
        except BaseException:
            lock.release()
            raise

    @classmethod
    def in_memory(cls) -> Store:
        """A store that is forgotten at its end: for a server that is to keep nothing."""
        return cls(None, None)

    @property
    def file(self) -> str:
        """Its file, for people."""
        return IN_MEMORY if self._path is None else str(self._path)

    async def run(self, work: Work[T], timeout_s: float = TIMEOUT_S) -> T:
        """Do ``work`` in a transaction. Raises StoreBusyError, StoreError and what ``work`` raises."""
        waiting = asyncio.wrap_future(self.submit(work))
        try:
            async with asyncio.timeout(timeout_s):
                return await waiting
        except TimeoutError as error:
            raise StoreBusyError(file=self.file, timeout_s=timeout_s) from error

    def call(self, work: Work[T], timeout_s: float = TIMEOUT_S) -> T:
        """As ``run``, and the calling thread waits."""
        try:
            return self.submit(work).result(timeout_s)
        except FutureTimeoutError as error:
            raise StoreBusyError(file=self.file, timeout_s=timeout_s) from error

    def submit(self, work: Work[T]) -> Future[T]:
        """As ``run``, without waiting. Raises StoreError where the store is closed."""
        return self._submit(partial(self._transact, work))

    async def back_up(self, target: Path, timeout_s: float = 300.0) -> None:
        """Write a copy of the whole store. Raises StoreError."""
        waiting = asyncio.wrap_future(self._submit(lambda: database.back_up(self._raw(), target)))
        try:
            async with asyncio.timeout(timeout_s):
                await waiting
        except TimeoutError as error:
            raise StoreBusyError(file=self.file, timeout_s=timeout_s) from error

    def close(self) -> None:
        """End it, after all that was submitted is done. Again: nothing."""
        if self._engine is not None:
            self._submit(self._end).result()
        self._executor.shutdown()
        if self._lock is not None:
            self._lock.release()

    # -- in the store's thread ----------------------------------------------------

    def _submit(self, call: Callable[[], T]) -> Future[T]:
        try:
            return self._executor.submit(call)
        except RuntimeError as error:
            raise StoreError(file=self.file, reason="it is closed") from error

    def _begin(self) -> None:
        raw = database.open_memory() if self._path is None else database.open_database(self._path)
        self._engine = create_engine("sqlite://", creator=lambda: raw, poolclass=StaticPool)
        # Python's own transactions begin too late and as readers; ours begin as the writer that each may become.
        event.listen(self._engine, "begin", lambda connection: connection.exec_driver_sql("BEGIN IMMEDIATE"))

    def _end(self) -> None:
        raw = self._raw()
        self._opened().dispose()
        raw.close()
        self._engine = None

    def _opened(self) -> Engine:
        if self._engine is None:
            raise StoreError(file=self.file, reason="it is closed")
        return self._engine

    def _raw(self) -> sqlite3.Connection:
        with self._opened().connect() as connection:
            raw: Any = connection.connection.driver_connection
        if not isinstance(raw, sqlite3.Connection):
            raise StoreError(file=self.file, reason="it is closed")
        return raw

    def _transact(self, work: Work[T]) -> T:
        try:
            with self._opened().begin() as connection:
                return work(connection)
        except DBAPIError as error:
            raise self._failure(error.orig) from error
        except sqlite3.Error as error:  # of a cursor that was asked without SQLAlchemy
            raise self._failure(error) from error

    def _failure(self, error: BaseException | None) -> StoreError:
        usual = isinstance(error, sqlite3.OperationalError | sqlite3.IntegrityError)
        return (StoreError if usual else StoreDamagedError)(file=self.file, reason=str(error))
