"""Visits at a turbine of twins, in a real store: what was found, what was left, and what changed in between."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from app.errors import NoVisitError
from app.model.address import Address
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.site import Turbine, load_site
from app.service.bench import Bench
from app.service.connection import Connection
from app.service.journal import Journal, Kind
from app.service.office.foreign_writes import FIRST_WINDOW_NS, ForeignWrites
from app.service.office.last_change import Writer, history, last_changes
from app.service.office.visit_changes import Progress, Time, VisitChanges, changes_since_last_visit
from app.service.office.visits import GOES_ON_NS, Visits
from app.service.options import Options
from app.service.sites import Sites
from app.service.write import write_raw
from app.store.store import Store
from app.store.visit_rows import Phase
from app.wire.frame import Direction
from app.wire.records import Outcome, Protocol, SdoAccess, SdoSeen
from tests.e2e.conftest import site_for
from tests.service.conftest import Served

PMM = "wtg-07/blade-1/pmm"
LIMIT = Address(0x3110, 1)
OTHER = Address(0x3110, 2)
DEADLINE_S = 20.0


def describe(_turbine: Turbine) -> dict[str, Description]:
    return {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}


def options(person: str = "anna") -> Options:
    return Options(person, None, consent=True, listen_s=0.1)


@asynccontextmanager
async def at_work(served: Served, folder: Path) -> AsyncIterator[Bench]:
    """A bench with its store in ``folder``, connected, everything read."""
    bench = Bench(Sites(load_site(site_for(served.address, folder)), describe), options(), store=Store.open(folder))
    try:
        await bench.connect("wtg-07", "anna")
        await until(lambda: bench.office.visits.looked)
        yield bench
    finally:
        await bench.close()


@asynccontextmanager
async def other_master(served: Served, folder: Path) -> AsyncIterator[Connection]:
    (turbine,) = load_site(site_for(served.address, folder))
    async with Connection(turbine, describe(turbine), options("nobody")) as opened:
        yield opened


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.02)


async def write(connection: Connection, address: Address, raw: int, journal: Journal | None = None) -> None:
    target = connection.target(PMM)
    await write_raw(connection.driver(target), target, address, raw, journal or connection.journal)


async def compared(bench: Bench) -> VisitChanges:
    office = bench.office
    return await changes_since_last_visit(office.visits, office.audit, bench.require().targets)


async def test_what_was_changed_between_visits_is_told_and_nothing_else(served: Served, tmp_path: Path) -> None:
    async with at_work(served, tmp_path) as bench:
        first = bench.office.visits.require()
        assert (await compared(bench)).state is Progress.NO_EARLIER_VISIT
        await write(bench.require(), LIMIT, 490, bench.journal.by("anna"))
        ended = await bench.end_visit("yearly service", "WO-1", "anna")
        assert (ended.id, ended.reason, ended.work_order, ended.left_open) == (
            first.id,
            "yearly service",
            "WO-1",
            False,
        )
        assert bench.connection is None
        assert bench.office.visits.current is None
        left = await bench.office.visits.sets(ended, Phase.LEFT)
        assert left[PMM].values[LIMIT] == 490
        assert len(left) == 6
    async with at_work(served, tmp_path) as bench:
        same = await compared(bench)
        assert (same.state, same.visit) == (Progress.READY, ended)
        assert [(one.device, one.rows, one.missing) for one in same.devices if one.rows or one.missing] == []
        await bench.end_visit("", "", "anna")
    async with other_master(served, tmp_path) as stranger:
        await write(stranger, LIMIT, 480)
    async with at_work(served, tmp_path) as bench:
        changes = {one.device: one for one in (await compared(bench)).devices}
        (row,) = changes[PMM].rows
        assert (row.address, row.was, row.now, row.was_shown, row.now_shown) == (LIMIT, 490, 480, "49.0", "48.0")
        assert (row.person, row.t_ns) == (None, None), "nobody was there to see it"
        assert all(not one.rows for device, one in changes.items() if device != PMM)


async def test_writes_of_another_master_are_seen_audited_and_told(served: Served, tmp_path: Path) -> None:
    async with at_work(served, tmp_path) as bench:
        await write(bench.require(), OTHER, 410, bench.journal.by("anna"))
        async with other_master(served, tmp_path) as stranger:
            await write(stranger, LIMIT, 470)
        await until(lambda: any(entry.kind is Kind.FOREIGN_WRITTEN for entry in bench.journal.latest()))
        (entry,) = [entry for entry in bench.journal.latest() if entry.kind is Kind.FOREIGN_WRITTEN]
        assert (entry.device, entry.person) == (PMM, "")
        assert (entry.details["was"], entry.details["now"], entry.details["address"]) == ("50.0", "47.0", "3110:01")
        await bench.office.audit.flush()
        last = {change.address: change for change in await last_changes(bench.office.audit, PMM)}
        assert {address: change.source for address, change in last.items()} == {
            "3110:01": Writer.OTHER_MASTER,
            "3110:02": Writer.OURS,
        }
        assert (last["3110:02"].person, last["3110:02"].now) == ("anna", "41.0")
        await write(bench.require(), LIMIT, 465, bench.journal.by("bert"))
        await bench.office.audit.flush()
        writes = await history(bench.office.audit, PMM, "3110:01", 10)
        assert [(one.person, one.was, one.now) for one in writes] == [("bert", "47.0", "46.5"), ("", "50.0", "47.0")]


async def test_a_visit_that_nobody_ended_counts_with_its_writes(served: Served, tmp_path: Path) -> None:
    """The bench dies in the visit: what was kept is as found, and the writes since are in the audit log."""
    async with at_work(served, tmp_path) as bench:
        await write(bench.require(), LIMIT, 490, bench.journal.by("anna"))
        await bench.office.audit.flush()
        visits, visit = bench.office.visits, bench.office.visits.require()
        visits.current = None  # as if killed: nothing is kept as left
    store = Store.open(tmp_path)
    later_ns = visit.started_ns + GOES_ON_NS + 1
    async with other_master(served, tmp_path) as connection:
        office = Bench(Sites((), describe), options(), store=store, wall_ns=lambda: later_ns).office
        await office.visits.begin("wtg-07", "carl")
        closed = next(one for one in await office.visits.latest("wtg-07", 10) if one.id == visit.id)
        assert closed.left_open
        target = connection.target(PMM)
        found = await connection.driver(target).read(target.node, LIMIT)
        assert int.from_bytes(found, "little") == 490
        before = await office.visits.sets(closed, Phase.FOUND)
        assert before[PMM].values[LIMIT] == 500
        now = {slug: one for slug, one in before.items() if slug != "wtg-07/blade-2/pmm"}
        await office.visits.keep_found(now.values())
        changes = await changes_since_last_visit(office.visits, office.audit, connection.targets)
        devices = {one.device: one for one in changes.devices}
        (row,) = devices[PMM].rows
        assert (row.was, row.now, row.person) == (490, 500, "anna")
        assert devices["wtg-07/blade-2/pmm"].missing is Time.NOW
        await office.close()


async def test_a_visit_goes_on_after_a_restart_within_a_shift(tmp_path: Path) -> None:
    clock = [1_700_000_000_000_000_000]

    def stamp() -> int:
        clock[0] += 1_000_000
        return clock[0]

    store = Store.in_memory()
    audit = Bench(Sites((), describe), options(), store=store).office.audit
    visits = Visits(store, audit, stamp)
    first = await visits.begin("wtg-07", "anna")
    assert (await Visits(store, audit, stamp).begin("wtg-07", "bert")) == first
    away = await visits.begin("wtg-08", "anna")
    assert away.id != first.id
    assert (await visits.begin("wtg-07", "anna")) == first
    changed = await visits.change("noise in blade 2", None, "anna")
    assert (await visits.change(None, "WO-2", "anna")) == (await visits.latest("wtg-07", 1))[0]
    assert changed.reason == "noise in blade 2"
    clock[0] += GOES_ON_NS
    second = await visits.begin("wtg-07", "anna")
    assert second.id != first.id
    assert {one.turbine: one.left_open for one in await visits.latest(None, 10) if one.ended_ns} == {
        "wtg-07": True,
        "wtg-08": True,
    }
    await visits.end("done", "", "anna")
    with pytest.raises(NoVisitError):
        await visits.end("again", "", "anna")


async def test_a_flood_of_one_object_is_folded_and_nothing_of_it_lost(connection: Connection) -> None:
    now_ns = [0]
    journal = Journal(lambda: now_ns[0], "tester")
    foreign = ForeignWrites(connection.targets, journal)

    def seen(raw: int, client: Direction = Direction.RX, outcome: Outcome = Outcome.DONE) -> SdoSeen:
        data = raw.to_bytes(2, "little") if outcome is Outcome.DONE else None
        return SdoSeen(
            now_ns[0], "can0", 1, SdoAccess.WRITE, LIMIT, outcome, data, None, None, Protocol.EXPEDITED, 0, client
        )  # fmt: skip

    total = 0
    for second in range(60):
        now_ns[0] = second * 1_000_000_000
        foreign.heard([seen(400 + second)] * 100)
        foreign.heard([seen(1, Direction.TX), seen(2, outcome=Outcome.ABORTED)])
        foreign.tick(now_ns[0])
        total += 100
    foreign.flush()
    told = journal.latest()
    assert sum(entry.details["count"] for entry in told) == total
    assert len(told) <= 5
    assert (told[0].details["count"], told[0].details["now"]) == (1, "40.0")
    assert [entry.details["was"] for entry in told[1:]] == [entry.details["now"] for entry in told[:-1]]
    assert told[-1].details["now"] == "45.9"
    now_ns[0] += 2 * FIRST_WINDOW_NS
    foreign.tick(now_ns[0])
    assert len(journal.latest()) == len(told)
