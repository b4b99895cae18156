"""Nothing that is begun while PDOs are changed cuts the change in two, nor does a change of PDOs cut anything else."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable

import pytest

from app.errors import DeviceBusyError, RestoreOpenError
from app.model.address import Address, parse_address
from app.model.checks import Allow
from app.service.claims import Claims, Work
from app.service.connection import Connection
from app.service.jobs import Job, JobState, RowState
from app.service.restore.transaction import End
from app.service.save import restart, save
from app.service.write import write_raw
from app.service.write_many import Change, OnFailure, Order, prepare, write_many
from app.store.restore_rows import RestoreState
from app.twins.line import Fault, delay
from app.wire.frame import Can
from tests.model.pdo.rig import TPDO2, enabled
from tests.service.conftest import MS, Served
from tests.service.pdo.rig import AXIS, DEADLINE_S, Person, ended
from tests.service.restore.conftest import PMC, PMM, Bench, bench, connection, served

__all__ = ["bench", "connection", "served"]

WINDOW = Address(0x6065)


@pytest.fixture
async def person(bench: Bench) -> AsyncIterator[Person]:
    """At the bench of a restore: same store, same connection."""
    yield Person(bench.connection, bench.office.store)


def is_write_of(address: str, node: int = 11) -> Callable[[Can], bool]:
    at = parse_address(address)
    mux = at.major.to_bytes(2, "little") + bytes((at.minor,))
    return lambda can: can.can_id == 0x600 + node and can.data[0] >> 5 == 1 and can.data[1:4] == mux


async def under_way(person: Person, served: Served) -> Job:
    """A change of PDOs whose third write lies on the wire for half a second."""
    wanted = enabled((await person.setups())[TPDO2], "6064/32", event_ms=50)
    edits = await person.edits(wanted)
    served.spoil(Fault(is_write_of("1A01:01"), delay(300 * MS)))
    job = await person.desk.apply(person.worker, person.target, edits)
    await until(lambda: any(row.state is RowState.SENT and row.address == "1A01:01" for row in job.rows))
    return job


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  a job has no event
            await asyncio.sleep(0.002)


async def run_batch(connection: Connection, *changes: Change) -> Job:
    order = Order(changes, frozenset(), OnFailure.GO_ON)
    job = Job("1", "write", "", rows=prepare(order))
    await write_many(job, order, connection.journal.by("B. Colleague"), connection.stamper)
    return job


def change(connection: Connection, slug: str, address: Address, raw: int) -> Change:
    target = connection.target(slug)
    return Change(connection.driver(target), target, address, raw)


async def test_a_restore_is_refused_while_a_change_is_written_and_the_change_ends_whole(
    bench: Bench, person: Person, served: Served
) -> None:
    prepared = await bench.desk.prepare(bench.connection, await bench.order())
    job = await under_way(person, served)
    with pytest.raises(DeviceBusyError) as refused:
        await bench.desk.begin(bench.connection, prepared, prepared.hash)
    assert job.state is JobState.RUNNING
    assert refused.value.details == {"device": AXIS, "work_key": Work.PDOS.text_key, "person": "A. Technician"}
    assert bench.desk.open == () and await bench.desk.latest() == []
    assert (await ended(job)).state is JobState.DONE, job.error
    assert {row.state for row in job.rows} == {RowState.VERIFIED}
    assert (await person.setups())[TPDO2].enabled
    _, end = await bench.run()
    assert end is End.NEW


async def test_nothing_else_is_written_saved_or_restarted_meanwhile_but_at_other_devices(
    person: Person, served: Served
) -> None:
    connection, target = person.connection, person.target
    driver, journal, stamper = connection.driver(target), connection.journal, connection.stamper
    other = connection.target("wtg-07/blade-2/pmc")
    before = await driver.read(target.node, WINDOW)
    job = await under_way(person, served)
    attempts: tuple[Callable[[], Awaitable[object]], ...] = (
        lambda: write_raw(driver, target, WINDOW, 150, journal),
        lambda: write_raw(driver, target, Address(0x1A01), 0, journal, allow=Allow.COMMUNICATION),
        lambda: save(driver, target, journal, stamper),
        lambda: restart(driver, target, journal, stamper),
    )
    for attempt in attempts:
        with pytest.raises(DeviceBusyError):
            await attempt()
    batch = await run_batch(
        connection, change(connection, AXIS, WINDOW, 150), change(connection, other.slug, WINDOW, 150)
    )
    assert job.state is JobState.RUNNING
    states = {row.device: (row.state, type(row.error)) for row in batch.rows}
    assert states == {
        AXIS: (RowState.REFUSED, DeviceBusyError),
        other.slug: (RowState.VERIFIED, type(None)),
    }
    assert (await ended(job)).state is JobState.DONE, job.error
    assert await driver.read(target.node, WINDOW) == before
    assert (await write_raw(driver, target, WINDOW, 150, journal)).verified


async def test_no_change_begins_while_a_batch_is_written(person: Person, served: Served) -> None:
    connection = person.connection
    edits = await person.edits(enabled((await person.setups())[TPDO2]))
    served.spoil(Fault(is_write_of("6065"), delay(300 * MS)))
    batch = asyncio.create_task(
        run_batch(connection, change(connection, AXIS, WINDOW, 150), change(connection, AXIS, Address(0x5683), 1400))
    )
    driver = connection.driver(person.target)
    await until(lambda: bool(driver._client.may_still_write(11, WINDOW)))
    with pytest.raises(DeviceBusyError) as refused:
        await person.desk.apply(person.worker, person.target, edits)
    assert (refused.value.details["work_key"], refused.value.details["person"]) == (
        Work.WRITES.text_key,
        "B. Colleague",
    )
    assert [row.state for row in (await batch).rows] == [RowState.VERIFIED] * 2
    job = await ended(await person.desk.apply(person.worker, person.target, edits))
    assert job.state is JobState.DONE, job.error


async def test_no_change_begins_while_a_restore_is_worked_on_nor_is_an_open_one_put_back(
    bench: Bench, person: Person
) -> None:
    first = await person.apply(enabled((await person.setups())[TPDO2]))
    assert first.state is JobState.DONE, first.error
    kept = person.desk.kept.of(AXIS)
    assert kept is not None
    edits = await person.edits(enabled((await person.setups())[TPDO2], event_ms=40))
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    with pytest.raises(DeviceBusyError) as refused:
        await person.desk.apply(person.worker, person.target, edits)
    assert refused.value.details["work_key"] == Work.RESTORE.text_key
    await person.desk.kept.put(AXIS, kept.opened())
    with pytest.raises(DeviceBusyError):
        await person.desk.undo(person.worker, person.target)
    await bench.desk.close()  # it stays incomplete, and nobody is at work on it
    with pytest.raises(RestoreOpenError):
        await write_raw(bench.connection.driver(person.target), person.target, WINDOW, 150, bench.connection.journal)
    undone = await person.undo()
    assert (undone.state, undone.error) == (JobState.DONE, None)
    assert not (await person.setups())[TPDO2].enabled


async def test_of_a_restore_and_a_change_that_begin_at_once_one_is_refused(bench: Bench, person: Person) -> None:
    """The change reads for a while before it writes, the restore keeps its values before it shuts the gate."""
    edits = await person.edits(enabled((await person.setups())[TPDO2]))
    prepared = await bench.desk.prepare(bench.connection, await bench.order())
    job, refused = await asyncio.gather(
        person.desk.apply(person.worker, person.target, edits),
        bench.desk.begin(bench.connection, prepared, prepared.hash),
        return_exceptions=True,
    )
    assert isinstance(job, Job) and isinstance(refused, DeviceBusyError)
    assert (await ended(job)).state is JobState.DONE, job.error
    undone = await person.undo()
    assert undone.state is JobState.DONE
    restore_id, late = await asyncio.gather(
        bench.desk.begin(bench.connection, prepared, prepared.hash),
        person.desk.apply(person.worker, person.target, edits),
        return_exceptions=True,
    )
    assert isinstance(restore_id, str) and isinstance(late, DeviceBusyError)
    assert await bench.desk.wait(restore_id) is End.NEW


async def test_a_claim_ends_with_its_work_and_counts_only_where_one_wants_the_device_alone() -> None:
    claims = Claims()
    with claims.held(Work.WRITES, "A", [PMM]), claims.held(Work.BATTERY, "B", [PMM]):
        claims.require_free(PMM)
        with pytest.raises(DeviceBusyError), claims.held(Work.RESTORE, "C", [PMC, PMM]):
            raise AssertionError("claimed")
        with claims.held(Work.PDOS, "C", [PMC]):
            with pytest.raises(DeviceBusyError):
                claims.require_free(PMC)
            with pytest.raises(DeviceBusyError), claims.held(Work.WRITES, "D", [PMC]):
                raise AssertionError("claimed")
        claims.require_free(PMC)
    with claims.held(Work.RESTORE, "C", [PMC, PMM]):
        pass
    claims.require_free(PMM)
