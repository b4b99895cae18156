"""The store's file: how it is opened, checked, brought to this version, backed up and restored.

A rollback journal with full synchronisation: a committed row is on the disk, and a killed process leaves whole rows.
(Write-ahead logs can lose commits in SQLite 3.7.0 to 3.51.2, so there is none.)
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from app.errors import StoreDamagedError, StoreError
from app.store.migrations import SCHEMA, STEPS

FILE: Final = "store.sqlite3"
LOCK: Final = "store.lock"
BUSY_S: Final = 5.0
"""How long is waited for a foreign reader of the file, such as a backup program."""


def open_database(path: Path) -> sqlite3.Connection:
    """Open the store, or make it, and bring it to this version. For the thread that calls.

    Raises StoreDamagedError, StoreError; then the file is as it was.
    """
    _make_private(path)
    with _explained(path):
        connection = connect(path)
        try:
            _check(connection, path)
            _migrate(connection, path)
        except BaseException:
            connection.close()
            raise
    return connection


def open_memory() -> sqlite3.Connection:
    """A store that ends with the process."""
    connection = sqlite3.connect(":memory:", isolation_level=None)
    connection.execute("PRAGMA foreign_keys = ON")
    _upgrade(connection, SCHEMA)
    return connection


def connect(path: Path) -> sqlite3.Connection:
    """A plain connection with the rules of the store. Raises sqlite3.Error."""
    connection = sqlite3.connect(path, timeout=BUSY_S, isolation_level=None)
    try:
        connection.execute("PRAGMA journal_mode = DELETE")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
    except sqlite3.Error:
        connection.close()
        raise
    return connection


def check_file(path: Path) -> int:
    """Check a store or a backup of one; gives its schema version. Raises StoreDamagedError, StoreError."""
    if not path.is_file():
        raise StoreError(file=str(path), reason="there is no such file")
    with _explained(path), contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as one:
        return _check(one, path)


def back_up(source: sqlite3.Connection, target: Path) -> None:
    """Write a whole copy of the store to ``target``, which must not exist. Raises StoreError."""
    if target.exists():
        raise StoreError(file=str(target), reason="the file exists already; a backup never replaces another file")
    partial = target.with_name(f"{target.name}.part")
    partial.unlink(missing_ok=True)
    _make_private(partial)
    with _explained(partial):
        with contextlib.closing(sqlite3.connect(partial)) as copy:
            source.backup(copy)
        check_file(partial)
    partial.replace(target)


def restore(path: Path, backup: Path, aside: Path) -> bool:
    """Put ``backup`` in the place of the store at ``path``; what was there is kept at ``aside``: True where it was.

    The caller holds the folder's lock. Raises StoreDamagedError or StoreError; then nothing has changed.
    """
    check_file(backup)
    fresh = path.with_name(f"{path.name}.part")
    fresh.unlink(missing_ok=True)
    with contextlib.closing(sqlite3.connect(f"{backup.absolute().as_uri()}?mode=ro", uri=True)) as source:
        back_up(source, fresh)
    journal = Path(f"{path}-journal")
    existed = path.exists()
    if existed:
        path.replace(aside)
    if journal.exists():  # it belongs to the file that was put aside: to the new one it would be poison
        journal.replace(Path(f"{aside}-journal"))
    fresh.replace(path)
    return existed


def _make_private(path: Path) -> None:
    """Make the file where there is none, for its owner alone: hashes of passwords are in it."""
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))


def _check(connection: sqlite3.Connection, path: Path) -> int:
    """The schema version of a file that is whole."""
    version: int = connection.execute("PRAGMA user_version").fetchone()[0]
    found = [str(row[0]) for row in connection.execute("PRAGMA integrity_check(5)")]
    if found != ["ok"]:
        raise StoreDamagedError(file=str(path), reason="; ".join(found))
    loose = connection.execute("PRAGMA foreign_key_check").fetchall()
    if loose:
        raise StoreDamagedError(file=str(path), reason=f"{len(loose)} rows point to rows that are not there")
    if version > SCHEMA:
        reason = f"it was written by a newer version (schema {version}, this one reads up to {SCHEMA})"
        raise StoreError(file=str(path), reason=reason)
    return version


def _migrate(connection: sqlite3.Connection, path: Path) -> None:
    version = int(connection.execute("PRAGMA user_version").fetchone()[0])
    if version == SCHEMA:
        return
    if version == 0 and connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]:
        raise StoreError(file=str(path), reason="it is a database of another program")
    if version:
        kept = path.with_name(f"{path.stem}.schema-{version}{path.suffix}")
        if not kept.exists():
            back_up(connection, kept)
    _upgrade(connection, SCHEMA)


def _upgrade(connection: sqlite3.Connection, until: int) -> None:
    """Go through the steps up to the schema ``until``."""
    version = int(connection.execute("PRAGMA user_version").fetchone()[0])
    for number, step in enumerate(STEPS[version:until], version + 1):
        connection.execute("BEGIN IMMEDIATE")
        try:
            for statement in step:
                connection.execute(statement)
            connection.execute(f"PRAGMA user_version = {number}")
            connection.execute("COMMIT")
        except BaseException:
            connection.execute("ROLLBACK")
            raise


@contextlib.contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Errors of SQLite and of the system as errors of the store."""
    try:
        yield
    except sqlite3.DatabaseError as error:
        if isinstance(error, sqlite3.OperationalError | sqlite3.IntegrityError):
            raise StoreError(file=str(path), reason=str(error)) from error
        raise StoreDamagedError(file=str(path), reason=str(error)) from error
    except OSError as error:
        raise StoreError(file=str(path), reason=error.strerror or str(error)) from error
