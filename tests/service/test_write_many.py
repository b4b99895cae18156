"""A batch of changes: what each row claims is what the device did, and an end in the middle leaves whole rows."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import pytest

from app.errors import (
    BusLostError,
    ConflictError,
    DeviceBusyError,
    HubsideError,
    LimitError,
    NoAnswerError,
    NotWrittenError,
    OrderError,
    SdoAbortError,
    UsageError,
)
from app.model.address import Address
from app.model.checks import Allow
from app.service.claims import Work
from app.service.connection import Connection
from app.service.jobs import Job, Jobs, JobState, RowState
from app.service.journal import Entry, Kind
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


async def test_a_row_whose_order_rested_on_a_refused_one_is_not_written(connection: Connection) -> None:
    """The PMC's minimum may pass the battery's voltage only once that has more blocs; the PMM is in use."""
    blocs, minimum = Address(0x3020, 4), Address(0x6510, 4)
    target = connection.target(PMC)
    before = await connection.driver(target).read(target.node, minimum)
    raised = int.from_bytes(before, "little") * 5 // 2
    rows = [change(connection, PMMS[0], blocs, 8), change(connection, PMC, minimum, raised)]
    with connection.gate.claims.held(Work.PDOS, "Anna", (PMMS[0],)):
        job = await run(connection, order(rows, on_failure=OnFailure.GO_ON))
    assert job.done == 2
    assert {row.address: type(row.error) for row in job.rows} == {"3020:04": DeviceBusyError, "6510:04": OrderError}
    assert await connection.driver(target).read(target.node, minimum) == before
    assert states(await run(connection, order(rows))) == [RowState.VERIFIED] * 2


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


SWITCH_ON, NOMINAL = Address(0x30FB, 8), Address(0x30FA, 1)


def unheard(node: int, address: Address) -> Callable[[Can], bool]:
    """From the acknowledge of a write on, all answers about the object are lost."""
    mux, begun = address.major.to_bytes(2, "little") + bytes((address.minor,)), False

    def matches(can: Can) -> bool:
        nonlocal begun
        own = can.can_id == 0x580 + node and can.data[1:4] == mux
        begun = begun or (own and can.data[0] == 0x60)
        return own and begun

    return matches


@contextmanager
def until_a_write_fails(connection: Connection, served: Served, fault: Fault) -> Iterator[None]:
    """The fault is on the wire until a write is told to have failed."""

    def mend(entry: Entry) -> None:
        if entry.kind is Kind.WRITE_FAILED:
            served.thread.call_soon(lambda: served.line.withdraw(fault))

    end = connection.journal.listen(mend)
    served.spoil(fault)
    try:
        yield
    finally:
        end()


async def lowered(connection: Connection) -> tuple[list[Change], int]:
    """Two changes of which the second is allowed only after the first: the switch-on voltage, then the nominal one."""
    target = connection.target(PMMS[0])
    for address in (SWITCH_ON, NOMINAL, Address(0x30FB, 7), Address(0x30FA, 3)):
        await connection.driver(target).read(target.node, address)
    low = target.lookup(SWITCH_ON)
    assert isinstance(low, int)
    wanted = low - 1
    return [change(connection, PMMS[0], SWITCH_ON, wanted - 1), change(connection, PMMS[0], NOMINAL, wanted)], wanted


@pytest.mark.parametrize("on_failure", list(OnFailure))
async def test_a_write_that_took_effect_unheard_counts_for_the_rest(
    connection: Connection, served: Served, on_failure: OnFailure
) -> None:
    """Acknowledge and read-back are lost; read again, the object holds what was sent, and the next may rest on it."""
    changes, wanted = await lowered(connection)
    with until_a_write_fails(connection, served, Fault(unheard(1, SWITCH_ON), drop, times=None)):
        job = await run(connection, order(changes, on_failure=on_failure))
    assert states(job) == [RowState.VERIFIED] * 2, errors(job)
    assert (job.rows[0].read, job.rows[1].read) == (wanted - 1, wanted)
    kinds = [entry.kind for entry in connection.journal.latest() if entry.device == PMMS[0]]
    assert (kinds.count(Kind.WRITE_FAILED), kinds.count(Kind.WRITTEN)) == (1, 2)


async def test_a_write_that_never_arrived_is_a_failure_once_its_object_is_read(
    connection: Connection, served: Served
) -> None:
    changes, wanted = await lowered(connection)
    begun = False

    def from_its_request_on(can: Can) -> bool:
        nonlocal begun
        own = can.can_id == 0x601 and can.data[1:4] == b"\xfb\x30\x08"
        begun = begun or (own and can.data[0] >> 5 == 1)
        return own and begun

    with until_a_write_fails(connection, served, Fault(from_its_request_on, drop, times=None)):
        job = await run(connection, order(changes, on_failure=OnFailure.GO_ON))
    assert [row.address for row in job.rows] == ["30FB:08", "30FA:01"]
    assert errors(job)[0] is NoAnswerError and errors(job)[1] in (OrderError, LimitError)
    target = connection.target(PMMS[0])
    assert await connection.driver(target).read(target.node, SWITCH_ON) == (wanted + 1).to_bytes(2, "little")


@pytest.mark.parametrize("on_failure", list(OnFailure))
async def test_where_nobody_knows_what_a_write_left_the_rest_is_not_written_and_says_why(
    connection: Connection, served: Served, on_failure: OnFailure
) -> None:
    """The device is deaf from its first write on; with go-on the blade beside it is written and saved all the same."""
    rows = [
        change(connection, PMMS[0], LIMIT, 490),
        change(connection, PMMS[0], NOMINAL, 570),
        change(connection, PMC, Address(0x6065), 150),
        change(connection, PMMS[1], LIMIT, 490),
    ]
    served.spoil(Fault(unheard(1, LIMIT), drop, times=None))
    job = await run(connection, order(rows, save=True, on_failure=on_failure))
    assert job.state is JobState.DONE and job.done == len(job.rows)
    found = {(row.device, row.address): (row.state, row.error) for row in job.rows}
    state, error = found[PMMS[0], "3110:01"]
    assert state is RowState.REFUSED and isinstance(error, NoAnswerError)
    left = [(PMMS[0], "30FA:01"), (PMC, "6065")]
    if on_failure is OnFailure.STOP:
        left.append((PMMS[1], "3110:01"))
    else:
        assert found[PMMS[1], "3110:01"] == (RowState.SAVED, None)
    for place in left:
        state, error = found[place]
        assert state is RowState.REFUSED and isinstance(error, NotWrittenError), place
        assert (error.details["after"], error.details["after_device"]) == ("3110:01", PMMS[0])
        assert error.details["address"] == place[1]
    written = {entry.device for entry in connection.journal.latest() if entry.kind in (Kind.WRITTEN, Kind.SAVED)}
    assert written == ({PMMS[1]} if on_failure is OnFailure.GO_ON else set())


async def test_a_lost_link_ends_the_batch_and_each_row_says_what_became_of_it(
    connection: Connection, served: Served
) -> None:
    rows = [change(connection, slug, LIMIT, 490) for slug in PMMS]

    def cut(_can: Can) -> Sequence[tuple[int, Can]]:
        served.cut()
        return ()

    served.spoil(Fault(lambda can: can.can_id == 0x601 and can.data[0] >> 5 == 1, cut))
    job = await run(connection, order(rows, save=True, on_failure=OnFailure.GO_ON))
    assert states(job) == [RowState.REFUSED] * 3
    assert errors(job) == [BusLostError, NotWrittenError, NotWrittenError]
    assert job.done == 3
