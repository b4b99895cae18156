"""The store's file: made, upgraded, refused, damaged, shared, backed up, restored, and its process killed."""

from __future__ import annotations

import asyncio
import json
import signal
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path

import pytest
from sqlalchemy import Connection, text

from app.errors import StoreBusyError, StoreDamagedError, StoreError, StoreInUseError
from app.model.roles import Role
from app.service.office.audit import Action, AuditLog
from app.store import capture_rows, database, user_rows
from app.store.migrations import SCHEMA, STEPS
from app.store.schema import metadata
from app.store.store import Store
from app.store.user_rows import User

ANNA = User("1", "Anna", Role.EXPERT, "hash", False, 7)


@contextmanager
def opened(folder: Path) -> Iterator[Store]:
    store = Store.open(folder)
    try:
        yield store
    finally:
        store.close()


def names(store: Store) -> list[str]:
    return [user.name for user in store.call(user_rows.all_users)]


def shape(path: Path) -> list[tuple[str, str]]:
    with closing(sqlite3.connect(path)) as file:
        return [
            (row[0], " ".join(row[1].split()))
            for row in file.execute("SELECT name, sql FROM sqlite_schema WHERE sql IS NOT NULL ORDER BY name")
        ]


def at_version(folder: Path, version: int) -> Path:
    """A store as an earlier version left it, with a user and an audited row in it."""
    folder.mkdir()
    path = folder / database.FILE
    with closing(sqlite3.connect(path)) as file:
        for step in STEPS[:version]:
            for statement in step:
                file.execute(statement)
        file.execute(f"PRAGMA user_version = {version}")
        if version:
            file.execute("INSERT INTO users VALUES ('1', 'Anna', 'anna', 'expert', 'hash', 0, 7)")
        file.commit()
    return path


# -- schema ---------------------------------------------------------------------------


@pytest.mark.parametrize("version", range(SCHEMA + 1))
def test_every_earlier_version_is_brought_up_to_date_with_its_rows(tmp_path: Path, version: int) -> None:
    with opened(tmp_path / "fresh"):
        pass
    path = at_version(tmp_path / "old", version)
    with opened(tmp_path / "old") as store:
        assert names(store) == (["Anna"] if version else [])
    assert shape(path) == shape(tmp_path / "fresh" / database.FILE)
    kept = tmp_path / "old" / f"store.schema-{version}.sqlite3"
    assert kept.exists() == (0 < version < SCHEMA)
    if kept.exists():
        with closing(sqlite3.connect(kept)) as file:
            assert file.execute("PRAGMA user_version").fetchone() == (version,)
            assert file.execute("SELECT name FROM users").fetchall() == [("Anna",)]


def test_marks_of_captures_get_a_column_of_their_own(tmp_path: Path) -> None:
    """A list of captures reads their heads, and there may be thousands of marks in one."""
    adding = next(n for n, step in enumerate(STEPS) if any("ADD COLUMN marks" in one for one in step))
    path = at_version(tmp_path / "old", adding)
    mark = {"t_ns": 7, "what": "gap", "bus": "can0", "device": None, "detail": "Lücke"}
    head = {"id": "1", "marks": [mark], "signals": [{"name": "a/b/c/6064"}]}
    with closing(sqlite3.connect(path)) as file:
        file.execute("INSERT INTO scope_captures VALUES ('1', 7, ?, x'00', '[]')", (json.dumps(head),))
        file.commit()
    with opened(tmp_path / "old") as store:
        found = store.call(lambda kept: capture_rows.head_of(kept, "1"))
    assert found is not None
    assert [json.loads(text) for text in found] == [{"id": "1", "signals": [{"name": "a/b/c/6064"}]}, [mark]]


def test_the_tables_are_those_that_the_queries_know(tmp_path: Path) -> None:
    with opened(tmp_path):
        pass
    with closing(sqlite3.connect(tmp_path / database.FILE)) as file:
        for table in metadata.sorted_tables:
            columns = {
                row[1]: (row[2], bool(row[3]), row[5]) for row in file.execute(f"PRAGMA table_info({table.name})")
            }
            assert columns.keys() == {column.name for column in table.columns}
            for column in table.columns:
                kind, not_null, key = columns[column.name]
                assert kind == str(column.type), (table.name, column.name)
                assert not_null == (not column.nullable), (table.name, column.name)
                assert bool(key) == column.primary_key, (table.name, column.name)
        tables = {row[0] for row in file.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}
        assert tables == set(metadata.tables)


def test_a_newer_file_is_refused_and_left_as_it_is(tmp_path: Path) -> None:
    path = at_version(tmp_path / "new", SCHEMA)
    with closing(sqlite3.connect(path)) as file:
        file.execute(f"PRAGMA user_version = {SCHEMA + 1}")
    before = path.read_bytes()
    with pytest.raises(StoreError, match="newer version") as refused:
        Store.open(tmp_path / "new")
    assert refused.value.details["file"] == str(path)
    assert path.read_bytes() == before


def test_a_database_of_another_program_is_refused(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / database.FILE)) as file:
        file.execute("CREATE TABLE photos (name TEXT)")
    with pytest.raises(StoreError, match="another program"):
        Store.open(tmp_path)


def test_the_rules_of_the_file_are_in_force(tmp_path: Path) -> None:
    with opened(tmp_path) as store:

        def pragma(name: str) -> object:
            return store.call(lambda connection: connection.exec_driver_sql(f"PRAGMA {name}").scalar())

        assert (pragma("journal_mode"), pragma("synchronous"), pragma("foreign_keys")) == ("delete", 2, 1)
    assert (tmp_path / database.FILE).stat().st_mode & 0o077 == 0


# -- damage ---------------------------------------------------------------------------


@pytest.mark.parametrize("damage", ["text", "header", "pages", "truncated"])
def test_a_damaged_file_is_named_and_kept(tmp_path: Path, damage: str) -> None:
    with opened(tmp_path) as store:
        for number in range(300):
            user = User(str(number), f"user {number}", Role.VIEWER, "x" * 200, False, number)
            store.call(partial(user_rows.put_user, user=user))
    path = tmp_path / database.FILE
    whole = path.read_bytes()
    broken = {
        "text": b"this is no database at all\n" * 200,
        "header": b"\xff" * 32 + whole[32:],
        "pages": whole[:4096] + b"\x5a" * 20_000 + whole[24_096:],
        "truncated": whole[: len(whole) // 2],
    }[damage]
    path.write_bytes(broken)
    with pytest.raises(StoreDamagedError) as told:
        Store.open(tmp_path)
    assert told.value.details["file"] == str(path)
    assert told.value.details["reason"]
    assert path.read_bytes() == broken
    path.write_bytes(whole)
    with opened(tmp_path) as store:
        assert len(names(store)) == 300


def test_a_backup_restores_what_was_and_what_is_replaced_is_kept(tmp_path: Path) -> None:
    backup = tmp_path / "backup.sqlite3"
    with opened(tmp_path / "data") as store:
        store.call(lambda connection: user_rows.put_user(connection, ANNA))
        asyncio.run(store.back_up(backup))
        with pytest.raises(StoreError, match="exists already"):
            asyncio.run(store.back_up(backup))
        store.call(lambda connection: user_rows.put_user(connection, User("2", "Ben", Role.VIEWER, "h", False, 8)))
    path, aside = tmp_path / "data" / database.FILE, tmp_path / "aside.sqlite3"
    path.write_bytes(path.read_bytes()[:5000])
    assert database.restore(path, backup, aside)
    assert aside.stat().st_size == 5000
    with opened(tmp_path / "data") as store:
        assert names(store) == ["Anna"]


def test_a_damaged_backup_replaces_nothing(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        store.call(lambda connection: user_rows.put_user(connection, ANNA))
    bad = tmp_path / "bad.sqlite3"
    bad.write_bytes((tmp_path / database.FILE).read_bytes()[:9000])
    with pytest.raises(StoreDamagedError):
        database.restore(tmp_path / database.FILE, bad, tmp_path / "aside")
    with pytest.raises(StoreError, match="no such file"):
        database.restore(tmp_path / database.FILE, tmp_path / "none", tmp_path / "aside")
    with opened(tmp_path) as store:
        assert names(store) == ["Anna"]


# -- one writer -----------------------------------------------------------------------


def test_a_second_opening_is_refused_until_the_first_is_closed(tmp_path: Path) -> None:
    with opened(tmp_path):
        with pytest.raises(StoreInUseError) as refused:
            Store.open(tmp_path)
        assert refused.value.details["file"] == str(tmp_path / database.FILE)
        script = "import pathlib, sys, app.store.store as it; it.Store.open(pathlib.Path(sys.argv[1]))"
        other = subprocess.run(
            [sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True, timeout=60, check=False
        )
        assert "StoreInUseError" in other.stderr
    with opened(tmp_path):
        pass


async def test_what_fails_is_undone_and_what_hangs_is_given_up(tmp_path: Path) -> None:
    store = Store.open(tmp_path)

    def failing(connection: Connection) -> None:
        user_rows.put_user(connection, ANNA)
        raise ValueError("on the way")

    with pytest.raises(ValueError, match="on the way"):
        await store.run(failing)
    assert await store.run(user_rows.all_users) == []
    going_on = threading.Event()
    with pytest.raises(StoreBusyError):
        await store.run(lambda _connection: going_on.wait(30), timeout_s=0.05)
    going_on.set()
    with pytest.raises(StoreError, match="no such table"):
        await store.run(lambda connection: connection.execute(text("SELECT * FROM photos")))
    store.close()
    store.close()
    with pytest.raises(StoreError, match="closed"):
        await store.run(user_rows.all_users)


# -- kills ----------------------------------------------------------------------------


def test_the_drivers_own_errors_are_told_as_those_of_the_store(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        with pytest.raises(StoreError, match="no such table: photos"):
            store.call(lambda connection: connection.connection.cursor().execute("SELECT * FROM photos"))
        with pytest.raises(StoreError, match="no such table: photos"):
            store.call(lambda connection: connection.execute(text("SELECT * FROM photos")).all())


@pytest.mark.parametrize("lines", [1, 4, 9])
def test_a_killed_process_leaves_a_whole_chain_with_all_that_it_said_was_kept(tmp_path: Path, lines: int) -> None:
    command = [sys.executable, "-m", "tests.store.writer_process", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        said = 0
        stream = process.stdout
        assert stream is not None
        for _ in range(lines):
            said = int(stream.readline())
        process.send_signal(signal.SIGKILL)
        said = max([said, *(int(line) for line in stream.read().split())])
    asyncio.run(goes_on(tmp_path, said))


async def goes_on(folder: Path, said: int) -> None:
    """The chain is whole, holds what was said to be kept, and is continued."""
    store = Store.open(folder)
    audit = AuditLog(store)
    done = await audit.verify()
    assert done.broken is None
    assert done.rows >= said > 0
    audit.note(Action.LOGIN, "ben")
    await audit.close()
    assert (await audit.verify()).rows == done.rows + 1
    store.close()
