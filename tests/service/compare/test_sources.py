"""Columns of real twins, of descriptions, and of the library; and those that cannot be shown."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from dataclasses import replace

import pytest

from app.errors import ColumnError
from app.model.address import Address
from app.model.diff.column import CellState
from app.model.diff.compare import RowState
from app.model.set_record import Source, Tag
from app.model.sets import ParameterSet, iso_time
from app.service.backup import read_device, to_set
from app.service.compare.comparison import Compared, compare_columns
from app.service.compare.ground import Ground
from app.service.compare.parity import compare_blades
from app.service.compare.sources import DAY_NS, Columns
from app.service.compare.spec import ColumnKind
from app.service.connection import Connection
from app.service.library.library import Library
from app.service.office.audit import AuditLog
from app.service.save import restart
from app.service.write import write_raw
from app.store.store import Store

PMM, PMC = "wtg-07/blade-1/pmm", "wtg-07/blade-1/pmc"
LIMIT, OFFSET, NODE_PDO = Address(0x3110, 1), Address(0x607C), Address(0x1400, 1)
NOW_NS = 1_800_000_000_000_000_000


@pytest.fixture
def store() -> Iterator[Store]:
    opened = Store.in_memory()
    yield opened
    opened.close()


@pytest.fixture
async def library(store: Store) -> AsyncIterator[Library]:
    audit = AuditLog(store)
    yield Library(store, audit, lambda: NOW_NS)
    await audit.close()


def ground(connection: Connection, library: Library | None = None) -> Columns:
    return Columns(Ground(lambda: NOW_NS, tuple(connection.targets), library=library))


async def read(connection: Connection, *slugs: str) -> None:
    for slug in slugs:
        target = connection.target(slug)
        assert not (await read_device(connection.driver(target), target)).errors


def states(compared: Compared, address: Address) -> tuple[RowState, list[CellState]]:
    row = next(one for one in compared.comparison.rows if one.address == address)
    return row.state, [cell.state for cell in row.cells]


async def test_what_was_not_read_is_unread_and_never_equal(connection: Connection) -> None:
    compared = await compare_columns(ground(connection), [f"live:{PMM}", f"live:{PMM}"])
    assert compared.comparison.summary.unread == compared.comparison.summary.missing == len(compared.comparison.rows)
    assert not compared.columns[0].complete


async def test_ram_beside_what_is_stored(connection: Connection) -> None:
    """After a restart, what is read first is proven to be stored; a write changes RAM alone."""
    target = connection.target(PMM)
    await restart(connection.driver(target), target, connection.journal, connection.stamper)
    await read(connection, PMM)
    await write_raw(connection.driver(target), target, LIMIT, 490, connection.journal)
    compared = await compare_columns(ground(connection), [f"live:{PMM}", f"stored:{PMM}"])
    assert [row.address for row in compared.comparison.rows if row.state is not RowState.SAME] == [LIMIT]
    row = next(one for one in compared.comparison.rows if one.address == LIMIT)
    assert [cell.raw for cell in row.cells] == [490, 500]
    assert [one.twin for one in compared.columns] == [True, True]


async def test_defaults_know_the_number_of_the_node(connection: Connection) -> None:
    await read(connection, PMC)
    columns = [f"live:{PMC}", f"default:{PMC}"]
    compared = await compare_columns(ground(connection), columns, everything=True)
    assert states(compared, NODE_PDO)[0] is RowState.SAME, "COB-IDs hold the node's number"
    assert compared.columns[1].t_ns is None


async def test_blades_side_by_side_set_apart_what_is_bound_to_one(connection: Connection) -> None:
    await read(connection, *[f"wtg-07/blade-{blade}/{kind}" for blade in (1, 2, 3) for kind in ("pmm", "pmc")])
    target = connection.target("wtg-07/blade-2/pmm")
    await write_raw(connection.driver(target), target, LIMIT, 480, connection.journal)
    charge = Address(0x3050)
    await write_raw(connection.driver(target), target, charge, 77, connection.journal)
    pmm, pmc = await compare_blades(ground(connection), connection.turbine, ColumnKind.LIVE)
    assert (pmm.blades, pmm.without, pmc.description_id) == ((1, 2, 3), (), "oat-pmc")
    assert states(pmm.compared, LIMIT)[0] is RowState.DIFFERENT
    assert states(pmm.compared, charge)[0] is RowState.UNIT
    assert pmm.compared.comparison.summary.different == 1
    assert pmc.compared.comparison.summary.different == 0


async def test_a_blade_without_such_a_column_is_left_out(connection: Connection, library: Library) -> None:
    for blade in (1, 3):
        await read(connection, f"wtg-07/blade-{blade}/pmm")
        (record,) = await library.put([await taken(connection, f"wtg-07/blade-{blade}/pmm")], Source.BACKUP)
        await library.tag(record.id, Tag.AS_DELIVERED, "Eva")
    (pmm,) = await compare_blades(ground(connection, library), connection.turbine, ColumnKind.DELIVERED)
    assert (pmm.blades, pmm.without) == ((1, 3), (2,))


async def taken(connection: Connection, slug: str) -> ParameterSet:
    target = connection.target(slug)
    return to_set(await read_device(connection.driver(target), target), "wtg-07", "Anna", "service", NOW_NS)


def aged(one: ParameterSet, days: float, limit: int) -> ParameterSet:
    origin = replace(one.origin, time=iso_time(int(NOW_NS - days * DAY_NS)))
    return replace(one, values={**one.values, LIMIT: limit}, origin=origin)


async def test_the_library_gives_golden_and_delivered_sets_and_the_year_before(
    connection: Connection, library: Library
) -> None:
    ages = {30: 400, 200: 410, 350: 420, 500: 430}
    one, other = await taken(connection, PMM), await taken(connection, "wtg-07/blade-2/pmm")
    sets = [aged(one, age, limit) for age, limit in ages.items()]
    records = await library.put([*sets, aged(other, 0, 440)], Source.BACKUP)
    await library.tag(records[4].id, Tag.GOLDEN, "Eva")
    await library.tag(records[3].id, Tag.AS_DELIVERED, "Eva")
    specs = [f"year:{PMM}", f"golden:{PMM}", "golden:oat-pmm", f"delivered:{PMM}", f"set:{records[0].hash[:12]}"]
    compared = await compare_columns(ground(connection, library), specs)
    row = next(one for one in compared.comparison.rows if one.address == LIMIT)
    assert [cell.raw for cell in row.cells] == [420, 440, 440, 430, 400]
    assert [one.record for one in compared.columns] == [records[n].id for n in (2, 4, 4, 3, 0)]
    assert compared.columns[0].hash == records[2].hash


async def test_a_fragment_is_the_set_of_the_year_before_only_where_no_other_is(
    connection: Connection, library: Library
) -> None:
    one = await taken(connection, PMM)
    fragment = replace(aged(one, 365, 420), unread={OFFSET: "no_answer"})
    (record,) = await library.put([fragment], Source.BACKUP)
    columns = ground(connection, library)
    assert (await columns.resolve(f"year:{PMM}")).record == record.id
    whole, _young = await library.put([aged(one, 500, 430), aged(one, 30, 440)], Source.BACKUP)
    assert (await columns.resolve(f"year:{PMM}")).record == whole.id


async def test_a_set_that_is_too_young_is_no_set_of_the_year_before(connection: Connection, library: Library) -> None:
    await library.put([aged(await taken(connection, PMM), 170, 500)], Source.BACKUP)
    with pytest.raises(ColumnError) as caught:
        await ground(connection, library).resolve(f"year:{PMM}")
    assert caught.value.details == {"column": f"year:{PMM}", "reason_key": "compare.unresolved.no-year"}


async def test_a_set_of_a_device_that_nobody_describes_is_named(connection: Connection, library: Library) -> None:
    (record,) = await library.put([replace(await taken(connection, PMM), description_id="foreign")], Source.FILE)
    with pytest.raises(ColumnError) as caught:
        await ground(connection, library).resolve(f"set:{record.id}")
    assert caught.value.details["reason_key"] == "compare.unresolved.no-description"


async def test_a_set_of_another_kind_of_device_is_not_comparable(connection: Connection, library: Library) -> None:
    (record,) = await library.put([await taken(connection, PMC)], Source.BACKUP)
    await read(connection, PMM)
    compared = await compare_columns(ground(connection, library), [f"live:{PMM}", f"set:{record.id}"], everything=True)
    shared = [row for row in compared.comparison.rows if all(cell.raw is not None for cell in row.cells)]
    assert len(shared) > 50
    assert {row.state for row in shared} == {RowState.NOT_COMPARABLE}
    assert compared.comparison.summary.same == compared.comparison.summary.different == 0


async def test_twelve_columns(connection: Connection, library: Library) -> None:
    one = await taken(connection, PMM)
    sets = [replace(one, values={**one.values, LIMIT: 400 + number}) for number in range(12)]
    records = await library.put(sets, Source.BACKUP)
    compared = await compare_columns(ground(connection, library), [f"set:{one.id}" for one in records])
    row = next(one for one in compared.comparison.rows if one.address == LIMIT)
    assert [cell.raw for cell in row.cells] == list(range(400, 412))
    assert compared.comparison.summary.different == 1


async def test_files_are_columns_only_where_a_person_names_them_here(connection: Connection) -> None:
    with pytest.raises(ColumnError) as caught:
        await ground(connection).resolve("file:/etc/passwd")
    assert caught.value.details["reason_key"] == "compare.unresolved.not-here"
