"""The audit log: its chain under every kind of tampering, its queue while the store fails, and its export."""

from __future__ import annotations

import asyncio
import csv
import io
import sqlite3
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest
from sqlalchemy import Connection, text

from app.errors import StoreBusyError, StoreError
from app.service.journal import Journal, Kind
from app.service.office import audit as audit_module
from app.service.office.audit import Action, AuditLog, text_key_of
from app.store import database
from app.store.audit_chain import BEGINNING, Breach, Broken, Head, canonical, plain, row_hash
from app.store.audit_rows import Filter, details_of
from app.store.store import Store

ROWS = 12
DEADLINE_S = 20.0


@pytest.fixture
async def folder(tmp_path: Path) -> AsyncIterator[Path]:
    """A closed store with some rows in its log."""
    store = Store.open(tmp_path)
    log = AuditLog(store)
    for number in range(ROWS):
        log.note(Action.LOGIN, f"person {number}", None, number=number)
    await log.close()
    store.close()
    yield tmp_path


async def verified(folder: Path, expected: Head | None = None) -> audit_module.Verified:
    store = Store.open(folder)
    try:
        return await AuditLog(store).verify(expected)
    finally:
        store.close()


def tamper(folder: Path, *statements: str) -> None:
    """As somebody with the file and no scruples: the triggers are no hindrance to them."""
    with closing(sqlite3.connect(folder / database.FILE)) as file:
        triggers = file.execute("SELECT name, sql FROM sqlite_schema WHERE type = 'trigger'").fetchall()
        for name, _sql in triggers:
            file.execute(f"DROP TRIGGER {name}")
        for statement in statements:
            file.execute(statement)
        for _name, sql in triggers:
            file.execute(sql)
        file.commit()


COPY = (
    "INSERT INTO audit SELECT {new}, id || 'x', t_ns, person, kind, device, address, details, previous, hash "
    "FROM audit WHERE seq = {old}"
)
TAMPERED: list[tuple[tuple[str, ...], Broken]] = [
    (("UPDATE audit SET person = 'bert' WHERE seq = 5",), Broken(5, Breach.CHANGED)),
    (("UPDATE audit SET t_ns = t_ns + 1 WHERE seq = 1",), Broken(1, Breach.CHANGED)),
    (("UPDATE audit SET details = '{}' WHERE seq = 12",), Broken(12, Breach.CHANGED)),
    (("UPDATE audit SET device = 'wtg-07' WHERE seq = 3",), Broken(3, Breach.CHANGED)),
    (("UPDATE audit SET id = '' WHERE seq = 2",), Broken(2, Breach.CHANGED)),
    (("UPDATE audit SET hash = previous WHERE seq = 4",), Broken(4, Breach.CHANGED)),
    (("UPDATE audit SET previous = hash WHERE seq = 4",), Broken(4, Breach.PREVIOUS)),
    (("DELETE FROM audit WHERE seq = 7",), Broken(8, Breach.MISSING)),
    (("DELETE FROM audit WHERE seq = 1",), Broken(2, Breach.MISSING)),
    (("DELETE FROM audit WHERE seq = 12",), Broken(12, Breach.END)),
    (("DELETE FROM audit WHERE seq > 6",), Broken(7, Breach.END)),
    (("DELETE FROM audit",), Broken(1, Breach.END)),
    ((COPY.format(new=13, old=12),), Broken(13, Breach.PREVIOUS)),
    (("DELETE FROM audit WHERE seq = 5", COPY.format(new=5, old=6)), Broken(5, Breach.PREVIOUS)),
]


async def test_a_whole_chain_is_found_good(folder: Path) -> None:
    done = await verified(folder)
    assert (done.rows, done.broken, done.head.seq) == (ROWS, None, ROWS)
    assert (await verified(folder, done.head)).broken is None


@pytest.mark.parametrize(("statements", "broken"), TAMPERED)
async def test_every_tampering_is_found_at_its_first_row(
    folder: Path, statements: tuple[str, ...], broken: Broken
) -> None:
    tamper(folder, *statements)
    assert (await verified(folder)).broken == broken


async def test_a_chain_that_was_made_anew_fits_no_head_that_was_noted(folder: Path, tmp_path: Path) -> None:
    """Somebody rewrites row 3 and everything after it, hashes and head too."""
    noted = (await verified(folder)).head
    with closing(sqlite3.connect(folder / database.FILE)) as file:
        rows = file.execute("SELECT seq, id, t_ns, person, kind, device, address, details FROM audit").fetchall()
    statements, last = [], BEGINNING
    for row in rows:
        keys = ("seq", "id", "t_ns", "person", "kind", "device", "address", "details")
        content = dict(zip(keys, row, strict=True))
        if row[0] == 3:
            content["person"] = "nobody"
            statements.append("UPDATE audit SET person = 'nobody' WHERE seq = 3")
        previous, last = last, row_hash(last, content)
        statements.append(f"UPDATE audit SET previous = '{previous}', hash = '{last}' WHERE seq = {row[0]}")
    tamper(folder, *statements, f"UPDATE audit_head SET hash = '{last}'")
    assert (await verified(folder)).broken is None, "by itself it is whole"
    assert (await verified(folder, noted)).broken == Broken(ROWS, Breach.CHANGED)
    assert (await verified(folder, Head(ROWS + 5, noted.hash))).broken == Broken(ROWS + 1, Breach.END)


async def test_a_log_longer_than_a_chunk_is_walked_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit_module, "CHUNK", 7)
    store = Store.open(tmp_path)
    log = AuditLog(store)
    for number in range(50):
        log.note(Action.LOGIN, "anna", None, number=number)
    await log.flush()
    noted = (await log.head())[0]
    assert ((await log.verify()).rows, (await log.verify(noted)).broken) == (50, None)
    assert (await log.head())[1] is not None
    written = io.StringIO()
    assert await log.export(Filter(), written) == 50
    store.close()
    tamper(tmp_path, "UPDATE audit SET person = 'x' WHERE seq = 41")
    assert (await verified(tmp_path)).broken == Broken(41, Breach.CHANGED)


def test_the_store_itself_refuses_to_change_or_delete_rows(folder: Path) -> None:
    store = Store.open(folder)
    for statement in ("UPDATE audit SET person = 'x'", "DELETE FROM audit"):
        with pytest.raises(StoreError, match="never"):
            store.call(partial(Connection.execute, statement=text(statement)))
    store.close()


# -- writing --------------------------------------------------------------------------


async def test_events_of_the_journal_come_from_any_thread_in_one_chain(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    clock = iter(range(10**9))
    journal = Journal(lambda: next(clock), "tester")
    log = AuditLog(store, lambda: next(clock), journal)
    journal.listen(log.take)

    def work(person: str) -> None:
        for number in range(50):
            journal.by(person).note(
                Kind.WRITTEN, "wtg-07/blade-1/pmm", address="3110:01", was="1", now="2", n=number, odd=float("nan")
            )

    threads = [threading.Thread(target=work, args=(name,)) for name in ("anna", "bert", "carl", "dora")]
    for thread in threads:
        thread.start()
    for thread in threads:
        await asyncio.to_thread(thread.join)
    await log.flush()
    assert log.waiting == 0
    done = await log.verify()
    assert (done.rows, done.broken) == (200, None)
    rows = await log.latest(Filter(person="bert", kinds=("written",), device="wtg-07"), None, 500)
    assert [details_of(row)["n"] for row in rows] == list(range(49, -1, -1))
    assert (rows[0].address, rows[0].device, details_of(rows[0])["odd"]) == ("3110:01", "wtg-07/blade-1/pmm", "nan")
    assert [row.seq for row in await log.latest(Filter(text="DORA"), None, 2)] < [201]
    assert await log.latest(Filter(device="wtg-0"), None, 10) == []
    assert await log.latest(Filter(text="%"), None, 10) == []
    page = await log.latest(Filter(), rows[0].seq, 3)
    assert [row.seq for row in page] == [rows[0].seq - 1, rows[0].seq - 2, rows[0].seq - 3]
    store.close()


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.01)


async def test_nothing_is_lost_while_the_disk_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file may grow no more (as on a full disk): rows wait, it is told once, and written when there is room."""
    monkeypatch.setattr(audit_module, "RETRY_S", 0.05)
    store = Store.open(tmp_path)
    clock = iter(range(10**9))
    journal = Journal(lambda: next(clock), "tester")
    log = AuditLog(store, lambda: next(clock), journal)
    journal.listen(log.take)

    def pragma(text: str) -> int:
        return int(store.call(lambda connection: connection.exec_driver_sql(f"PRAGMA {text}").scalar()) or 0)

    pragma(f"max_page_count = {pragma('page_count')}")
    for number in range(200):
        log.note(Action.LOGIN, "anna", None, number=number, filler="x" * 100)
    await until(lambda: log.failing)
    assert log.waiting > 100, "the first few may have fitted"
    with pytest.raises(StoreBusyError):
        await log.flush(0.2)
    await until(lambda: any(entry.kind is Kind.STORE_FAILED for entry in journal.latest()))
    pragma("max_page_count = 100000")
    await log.flush()
    assert not log.failing
    await until(lambda: any(entry.kind is Kind.STORE_BACK for entry in journal.latest()))
    await log.flush()
    told = [entry.kind for entry in journal.latest()]
    assert told == [Kind.STORE_FAILED, Kind.STORE_BACK]
    done = await log.verify()
    assert (done.broken, done.rows) == (None, 202)
    await log.close()
    store.close()


# -- reading --------------------------------------------------------------------------


async def test_the_export_is_the_whole_log_and_no_formula_for_a_spreadsheet(tmp_path: Path) -> None:
    store = Store.open(tmp_path)
    log = AuditLog(store)
    log.note(Action.LOGIN_FAILED, "=HYPERLINK(1)", None, at="127.0.0.1")
    log.note(Action.LOGIN, 'anna, "the" first', None, at="127.0.0.1")
    await log.flush()
    written = io.StringIO()
    assert await log.export(Filter(), written) == 2
    rows = list(csv.DictReader(io.StringIO(written.getvalue())))
    assert [row["person"] for row in rows] == ["'=HYPERLINK(1)", 'anna, "the" first']
    assert rows[1]["previous"] == rows[0]["hash"]
    store.close()


def test_canonical_json_is_one_text_for_one_content() -> None:
    assert canonical({"b": 1, "a": [True, None, "ä"]}) == '{"a":[true,null,"ä"],"b":1}'
    assert plain({"k": Kind.SAVED, 1: b"\x01\xff", "f": float("inf"), "s": (1, 2)}) == {
        "k": "saved",
        "1": "01ff",
        "f": "inf",
        "s": [1, 2],
    }


def test_every_kind_has_a_text_key_and_none_is_of_both() -> None:
    assert not {action.value for action in Action} & {kind.value for kind in Kind}
    assert text_key_of("written") == "journal.written"
    assert text_key_of("login") == "audit.login"
