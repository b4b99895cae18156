"""A batch of changes: what each row claims is what the device did, and an end in the middle leaves whole rows."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import pytest

from app.errors import ConflictError, HubsideError, LimitError, SdoAbortError, UsageError
from app.model.address import Address
from app.model.checks import Allow
from app.service.connection import Connection
from app.service.jobs import Job, Jobs, JobState, RowState
from app.service.journal import Kind
from app.service.write_many import Change, OnFailure, Order, prepare, write_many
from app.twins.line import Fault, delay, drop
from app.wire.frame import Can
from app.wire.memory import StoredState
from tests.service.conftest import MS, Served

LIMIT = Address(0x3110, 1)
HOME_OFFSET = Address(0x607C)
FACTORY = Address(0x30F1, 1)
PMMS = tuple(f"wtg-07/blade-{blade}/pmm" for blade in (1, 2, 3))
PMC = "wtg-07/blade-1/pmc"
DEADLINE_S = 40.0


def change(connection: Connection, slug: str, address: Address, raw: int, expected: int | None = None) -> Change:
    target = connection.target(slug)
    return Change(connection.driver(target), target, address, raw, expected)


async def run(connection: Connection, order: Order) -> Job:
    jobs = Jobs()
    job = start(jobs, connection, order)
    await ended(job)
    return job


def start(jobs: Jobs, connection: Connection, order: Order) -> Job:
    async def work(job: Job) -> None:
        await write_many(job, order, connection.journal.by("A. Technician"), connection.stamper)

    return jobs.start("write", "", work, prepare(order))


async def ended(job: Job) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while job.state is JobState.RUNNING:  # noqa: ASYNC110  a job has no event
            await asyncio.sleep(0.005)


def states(job: Job) -> list[RowState]:
    return [row.state for row in job.rows]


def errors(job: Job) -> list[type[HubsideError] | None]:
    return [None if row.error is None else type(row.error) for row in job.rows]


def order(changes: Sequence[Change], save: bool = False, on_failure: OnFailure = OnFailure.STOP) -> Order:
    return Order(changes, frozenset(PMMS if save else ()), on_failure)


async def test_rows_of_three_blades_are_written_verified_and_saved(connection: Connection) -> None:
    job = await run(connection, order([change(connection, slug, LIMIT, 490, 500) for slug in PMMS], save=True))
    assert (job.state, job.done, job.total) == (JobState.DONE, 3, 3)
    assert states(job) == [RowState.SAVED] * 3
    assert [(row.device, row.address, row.was, row.read) for row in job.rows] == [
        (slug, "3110:01", 500, 490) for slug in PMMS
    ]
    for slug in PMMS:
        target = connection.target(slug)
        view = connection.live.value("can0", target.node, LIMIT)
        assert view is not None and view.stored is not None
        assert (view.stored.data, view.stored.state) == ((490).to_bytes(2, "little"), StoredState.SAVED)
    noted = [(entry.kind, entry.person) for entry in connection.journal.latest()]
    assert noted.count((Kind.WRITTEN, "A. Technician")) == 3
    assert noted.count((Kind.SAVED, "A. Technician")) == 3


async def test_without_save_rows_end_verified_and_nothing_is_stored(connection: Connection) -> None:
    job = await run(connection, order([change(connection, PMMS[0], LIMIT, 480)]))
    assert states(job) == [RowState.VERIFIED]
    assert Kind.SAVED not in [entry.kind for entry in connection.journal.latest()]


async def test_a_value_that_changed_since_is_a_conflict_and_stays(connection: Connection) -> None:
    stale = order(
        [change(connection, PMMS[0], LIMIT, 490, expected=510), change(connection, PMMS[1], LIMIT, 490, expected=500)],
        save=True,
        on_failure=OnFailure.GO_ON,
    )
    job = await run(connection, stale)
    assert states(job) == [RowState.REFUSED, RowState.SAVED]
    assert errors(job) == [ConflictError, None]
    assert job.rows[0].error is not None and job.rows[0].error.details["found"] == "50.0"
    target = connection.target(PMMS[0])
    assert await connection.driver(target).read(target.node, LIMIT) == (500).to_bytes(2, "little")


async def test_one_wrong_row_keeps_all_from_being_sent(connection: Connection) -> None:
    """With "stop" a batch that cannot be written as a whole is not begun."""
    wrong = [change(connection, PMMS[0], LIMIT, 490), change(connection, PMMS[1], LIMIT, 40_000)]
    job = await run(connection, order(wrong, save=True))
    assert states(job) == [RowState.WAITING, RowState.REFUSED]
    assert errors(job) == [None, LimitError]
    assert Kind.WRITTEN not in [entry.kind for entry in connection.journal.latest()]
    job = await run(connection, order(wrong, save=True, on_failure=OnFailure.GO_ON))
    assert states(job) == [RowState.SAVED, RowState.REFUSED]


async def test_a_refusal_by_the_device_stops_the_rest_and_the_save(connection: Connection) -> None:
    """The home offset needs homing mode; the mode is unknown until it is read, so the batch begins."""
    rows = [
        change(connection, PMMS[0], LIMIT, 490),
        change(connection, PMC, HOME_OFFSET, 5),
        change(connection, PMMS[1], LIMIT, 490),
    ]
    job = await run(connection, order(rows, save=True))
    # Device by device in the order of their first rows: the second module comes after the axis.
    assert states(job) == [RowState.VERIFIED, RowState.REFUSED, RowState.WAITING]
    assert Kind.SAVED not in [entry.kind for entry in connection.journal.latest()]
    job = await run(connection, order(rows, save=True, on_failure=OnFailure.GO_ON))
    assert states(job) == [RowState.SAVED, RowState.REFUSED, RowState.SAVED]


async def test_a_row_may_rest_on_a_row_before_it(connection: Connection) -> None:
    """The nominal voltage must lie above the switch-on voltage, which an earlier row lowers."""
    switch_on, nominal = Address(0x30FB, 8), Address(0x30FA, 1)
    target = connection.target(PMMS[0])
    driver = connection.driver(target)
    for address in (switch_on, nominal, Address(0x30FB, 7), Address(0x30FA, 3)):
        await driver.read(target.node, address)
    low, now = target.lookup(switch_on), target.lookup(nominal)
    assert isinstance(low, int) and isinstance(now, int)
    wanted = low - 1
    alone = await run(connection, order([change(connection, PMMS[0], nominal, wanted)]))
    assert errors(alone) == [LimitError]
    both = order([change(connection, PMMS[0], switch_on, wanted - 1), change(connection, PMMS[0], nominal, wanted)])
    assert states(await run(connection, both)) == [RowState.VERIFIED] * 2


async def test_what_only_the_maker_sets_needs_the_permission(connection: Connection, served: Served) -> None:
    rows = [change(connection, PMMS[0], FACTORY, 1)]
    assert states(await run(connection, order(rows))) == [RowState.REFUSED]
    allowed = await run(connection, Order(rows, save=frozenset(), on_failure=OnFailure.STOP, allow=Allow.FACTORY))
    # The twin, as the device, refuses it all the same.
    assert errors(allowed) == [SdoAbortError]


async def test_a_save_that_is_not_acknowledged_is_not_claimed(connection: Connection, served: Served) -> None:
    served.spoil(Fault(lambda can: can.can_id == 0x601 and can.data[1:3] == b"\x10\x10", drop))
    job = await run(connection, order([change(connection, PMMS[0], LIMIT, 470)], save=True))
    assert states(job) == [RowState.NOT_SAVED]
    assert job.rows[0].read == 470 and job.rows[0].error is not None


async def test_cancelling_ends_between_two_writes(connection: Connection, served: Served) -> None:
    """The row that is on its way is finished and told; those after it were never sent."""
    jobs = Jobs()

    def is_write(can: Can) -> bool:
        return can.can_id == 0x601 and can.data[0] >> 5 == 1

    served.spoil(Fault(is_write, delay(300 * MS)))
    job = start(jobs, connection, order([change(connection, slug, LIMIT, 460) for slug in PMMS]))
    async with asyncio.timeout(DEADLINE_S):
        while job.rows[0].state is not RowState.SENT:  # noqa: ASYNC110  a row has no event
            await asyncio.sleep(0.002)
    jobs.cancel(job.id)
    await ended(job)
    assert job.state is JobState.CANCELLED
    assert states(job) == [RowState.VERIFIED, RowState.WAITING, RowState.WAITING]
    target = connection.target(PMMS[1])
    assert await connection.driver(target).read(target.node, LIMIT) == (500).to_bytes(2, "little")


async def test_an_object_is_written_once_in_a_batch(connection: Connection) -> None:
    twice = [change(connection, PMMS[0], LIMIT, 490), change(connection, PMMS[0], LIMIT, 480)]
    with pytest.raises(UsageError):
        prepare(order(twice))
    with pytest.raises(UsageError):
        prepare(order([]))
