"""The library in a real store: what is kept once, tags and their history, nameplates, files, visits, damage."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from app.errors import NameplateError, SetIncompleteError, SetTagError, SetUnknownError, StoreDamagedError, StoreError
from app.model.address import Address
from app.model.set_record import SetRecord, Source, Tag
from app.model.sets import Identity, ParameterSet, dump_set
from app.service.library.folder import SetFolder
from app.service.library.library import Library
from app.service.office.audit import AuditLog
from app.store import database
from app.store.set_rows import Filter
from app.store.store import Connection, Store
from tests.model.set_rig import ORIGIN, whole_set
from tests.service.conftest import Served
from tests.service.test_visits import at_work


@asynccontextmanager
async def library_in(folder: Path) -> AsyncIterator[tuple[Library, Store]]:
    store = Store.open(folder)
    audit = AuditLog(store)
    try:
        yield Library(store, audit, time.time_ns), store
        await audit.close()
    finally:
        store.close()


def at(text: str, name: str = "oat-pmc") -> ParameterSet:
    return replace(whole_set(name, replace(ORIGIN, time=text)), unread={})


async def test_a_content_is_kept_once_and_each_occasion_is_a_record(tmp_path: Path) -> None:
    first, later = at("2024-03-04T14:03:21Z"), at("2025-03-04T14:03:21Z")
    async with library_in(tmp_path) as (library, store):
        (one,) = await library.put([first], Source.BACKUP)
        (again,) = await library.put([first], Source.FILE)
        (two,) = await library.put([later], Source.BACKUP)
        assert again == one
        assert (one.hash, one.id) != (two.hash, two.id) == (one.hash, two.id)
        assert [record.id for record in await library.records()] == [two.id, one.id]
        assert await library.get(one.id) == first
        assert await library.get(one.hash[:8]) == later, "of a content that was taken twice, the latest occasion"
        assert await library.get(f"sha256:{one.hash}") == later
        contents = await store.run(lambda kept: kept.exec_driver_sql("SELECT count(*) FROM set_contents").scalar())
        assert contents == 1
        for key in ("none", one.hash[:7], "%", ""):
            with pytest.raises(SetUnknownError):
                await library.get(key)
    async with library_in(tmp_path) as (library, _store):
        assert await library.get(one.id) == first


async def test_rows_are_never_changed_and_a_changed_content_is_noticed(tmp_path: Path) -> None:
    async with library_in(tmp_path) as (library, store):
        (record,) = await library.put([at("2026-03-04T14:03:21Z")], Source.BACKUP)
        for statement in (
            "UPDATE set_contents SET content = '{}'",
            "DELETE FROM set_contents",
            "UPDATE set_records SET person = 'x'",
            "DELETE FROM set_records",
        ):
            with pytest.raises(StoreError, match="kept as they are"):
                await store.run(partial(Connection.exec_driver_sql, statement=statement))
    with closing(sqlite3.connect(tmp_path / database.FILE)) as file:
        file.execute("DROP TRIGGER set_contents_never_update")
        file.execute("UPDATE set_contents SET content = replace(content, '\"6866:00\":0', '\"6866:00\":1')")
        file.commit()
    async with library_in(tmp_path) as (library, _store):
        with pytest.raises(StoreDamagedError, match="not what its hash says"):
            await library.get(record.id)


async def test_a_backup_of_the_store_brings_the_library_back(tmp_path: Path) -> None:
    parameters, backup = at("2026-03-04T14:03:21Z"), tmp_path / "copy.sqlite3"
    async with library_in(tmp_path / "data") as (library, store):
        (record,) = await library.put([parameters], Source.BACKUP)
        await library.tag(record.id, Tag.GOLDEN, "eva")
        await library.set_nameplate("wtg-07/blade-1/pmc", "P 1", "P 1", "anna")
        await store.back_up(backup)
    path = tmp_path / "data" / database.FILE
    path.write_bytes(path.read_bytes()[:9000])
    database.restore(path, backup, tmp_path / "aside")
    async with library_in(tmp_path / "data") as (library, _store):
        assert await library.get(record.id) == parameters
        golden = await library.tagged(Tag.GOLDEN, "oat-pmc")
        assert golden is not None and golden.id == record.id
        plate = library.nameplate("wtg-07/blade-1/pmc")
        assert plate is not None and (plate.serial, plate.person) == ("P 1", "anna")


async def test_a_tag_is_on_one_set_of_its_scope_and_its_history_stays(tmp_path: Path) -> None:
    async with library_in(tmp_path) as (library, _store):
        one, two = await library.put([at("2026-03-04T00:00:00Z"), at("2026-03-05T00:00:00Z")], Source.BACKUP)
        (other,) = await library.put([at("2026-03-04T00:00:00Z", "oat-pmm")], Source.BACKUP)
        for record in (one, other, two):
            await library.tag(record.id, Tag.GOLDEN, "eva")
        assert {entry.record_id for entries in (await library.tags()).values() for entry in entries} == {
            two.id,
            other.id,
        }
        assert await tagged_ids(library, Tag.GOLDEN) == {two.id, other.id}
        await library.tag(one.id, Tag.GOLDEN, "eva", on=False)
        assert await tagged_ids(library, Tag.GOLDEN) == {two.id, other.id}, "it bore none"
        await library.tag(two.id, Tag.GOLDEN, "eva", on=False)
        assert await library.tagged(Tag.GOLDEN, "oat-pmc") is None
        assert [entry.record_id for entry in await library.tag_history("oat-pmc")] == [one.id, two.id, None]
        with pytest.raises(SetTagError):
            await library.tag(one.id, Tag.AS_LEFT, "eva")


async def test_a_set_with_unread_objects_is_never_golden(tmp_path: Path) -> None:
    partial_set = replace(at("2026-03-04T00:00:00Z"), unread={Address(0x6065): "no_answer"})
    async with library_in(tmp_path) as (library, _store):
        (record,) = await library.put([partial_set], Source.BACKUP)
        with pytest.raises(SetIncompleteError) as caught:
            await library.tag(record.id, Tag.GOLDEN, "eva")
        assert caught.value.details == {"set": record.id, "tag": "golden", "unread": 1}
        assert await tagged_ids(library, Tag.GOLDEN) == set()
        await library.tag(record.id, Tag.AS_DELIVERED, "eva")
        assert await tagged_ids(library, Tag.AS_DELIVERED) == {record.id}


async def test_a_set_from_a_time_to_come_is_kept_and_is_not_the_latest_for_ever(tmp_path: Path) -> None:
    """A clock that was ahead by years, once: what is taken by a right one afterwards is the latest again."""
    clock = [parse_time("2026-03-04T12:00:00Z")]
    now, soon, wrong = "2026-03-04T11:00:00Z", "2026-03-05T11:00:00Z", "2031-03-04T11:00:00Z"
    store = Store.open(tmp_path)
    audit = AuditLog(store)
    library = Library(store, audit, lambda: clock[0])
    try:
        (ahead,) = await library.put([at(wrong)], Source.FILE)
        assert library.is_ahead(ahead) and await latest(store) == [ahead.id], "there is no other"
        (record,) = await library.put([at(now)], Source.BACKUP)
        (early,) = await library.put([at(soon)], Source.FILE)
        assert not library.is_ahead(record) and not library.is_ahead(early), "a day is no matter"
        assert await latest(store) == [early.id]
        (again,) = await library.put([at("2031-03-05T11:00:00Z")], Source.FILE)
        assert await latest(store) == [early.id]
        assert [one.id for one in await library.records()] == [early.id, record.id, again.id, ahead.id]
        assert (await library.get(ahead.id)).origin.time == wrong, "it is kept as it is"
        clock[0] = parse_time("2031-04-01T12:00:00Z")
        assert (await library.records())[0].id == again.id, "its time has come"
    finally:
        await audit.close()
        store.close()


def parse_time(text: str) -> int:
    return replace(ORIGIN, time=text).t_ns


async def latest(store: Store) -> list[str]:
    """The records that stand for their devices in a comparison of the fleet."""
    rows = await store.run(lambda kept: kept.exec_driver_sql("SELECT record_id FROM set_latest").all())
    return [row[0] for row in rows]


async def tagged_ids(library: Library, tag: Tag) -> set[str]:
    found: list[SetRecord] = await library.records(Filter(tag=tag))
    return {record.id for record in found}


@pytest.mark.parametrize(("typed", "again"), [("", ""), ("P-1", "P-2"), ("P\n;1", "P\n;1"), ("x" * 41, "x" * 41)])
async def test_a_nameplate_that_is_none_or_differs_is_refused(tmp_path: Path, typed: str, again: str) -> None:
    async with library_in(tmp_path) as (library, _store):
        with pytest.raises(NameplateError):
            await library.set_nameplate("wtg-07/blade-1/pmc", typed, again, "anna")
        assert library.nameplates == {}


async def test_the_nameplate_stands_in_for_a_serial_number_that_is_not_told(tmp_path: Path) -> None:
    silent = replace(at("2026-03-04T00:00:00Z"), identity=Identity(serial=0))
    telling = replace(silent, identity=Identity(serial=7))
    async with library_in(tmp_path) as (library, _store):
        assert library.identified(silent) == silent
        await library.set_nameplate(silent.origin.device, " P  1 ", "P 1", "anna")
        assert library.identified(silent).identity == Identity(serial=0, nameplate="P 1")
        assert library.identified(telling) == telling


async def test_files_are_taken_once_and_bad_ones_named_until_they_are_mended(tmp_path: Path) -> None:
    folder = tmp_path / "sets" / "wtg-07"
    folder.mkdir(parents=True)
    text = dump_set(at("2026-03-04T00:00:00Z"))
    (folder / "good.json").write_text(text)
    (folder / "copy.json").write_text(text)
    bad = folder / "bad.json"
    bad.write_bytes(text[:200].encode() + b"\xff")
    async with library_in(tmp_path) as (library, store):
        sets = SetFolder(tmp_path / "sets", store, library)
        first = await sets.look(budget_s=0)
        assert first.waiting == 2, "one a look where there is no time"
        looked = await sets.look(budget_s=60)
        assert (looked.waiting, len(await library.records())) == (0, 1)
        (row,) = looked.bad
        assert (row.name, row.line) == ("wtg-07/bad.json", text[:200].count("\n") + 1)
        bad.write_text(dump_set(at("2026-03-05T00:00:00Z")))
        assert (await sets.look(budget_s=60)).bad == ()
        assert len(await library.records()) == 2
        for path in folder.iterdir():
            path.unlink()
        await sets.look(budget_s=60)
        assert len(await library.records()) == 2, "what was taken stays"


async def test_a_visit_puts_what_was_found_and_left_into_the_library(served: Served, tmp_path: Path) -> None:
    async with at_work(served, tmp_path) as bench:
        library = bench.office.library
        visit = bench.office.visits.require()
        found = await library.records(Filter(tag=Tag.AS_FOUND))
        assert len(found) == 6
        assert {record.unread for record in found} == {0}
        await bench.end_visit("yearly service", "WO-1", "anna")
        left = await library.records(Filter(tag=Tag.AS_LEFT))
        assert {record.origin.device for record in left} == {record.origin.device for record in found}
        assert {record.origin.work_order for record in left} == {"WO-1"}
        tags = await library.tags()
        assert {entry.visit_id for record in left for entry in tags[record.id]} == {visit.id}
        latest = await library.tagged(Tag.AS_LEFT, "wtg-07/blade-1/pmm")
        assert latest is not None and latest.id in {record.id for record in left}
        visits = bench.office.visits
        await visits.begin("wtg-07", "bert")
        for _ in range(2):
            await visits.keep_found([await library.set_of(record) for record in left])
        assert len(await library.records(Filter(tag=Tag.AS_FOUND))) == 12, "another visit, another find, and one"
