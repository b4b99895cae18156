"""A reviewed batch is written in an order in which every prefix keeps the rules that hold at every step (table 19)."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from app.errors import LimitError, OrderError
from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.rules.check import broken_stepwise
from app.model.rules.dc_link import LADDER
from app.model.station import DeviceValues, StationValues
from app.service.connection import Connection
from app.service.devices import decode
from app.service.jobs import RowState
from app.service.write_many import Change, OnFailure, Order
from app.service.write_order import KnownDevices
from app.twins.line import Fault, drop
from app.wire.frame import Can
from tests.service.conftest import Served
from tests.service.test_write_many import change, errors, run, states

PMM, PMC = "wtg-07/blade-1/pmm", "wtg-07/blade-1/pmc"
SLUG_OF = {"oat-pmm": PMM, "oat-pmc": PMC}
NODE_OF = {0x601: PMM, 0x60B: PMC}
Rung = tuple[str, Address]
RUNGS: list[Rung] = [(SLUG_OF[one.description_id], parse_address(one.address)) for one in LADDER]
DEFAULTS = (100, 400, 420, 560, 600, 650, 670, 750, 750)
UP = (120, 540, 565, 640, 690, 700, 730, 790, 800)
DOWN = (90, 310, 330, 395, 410, 415, 550, 620, 620)
MAXIMUM_PMM, MAXIMUM_PMC = RUNGS[-2], RUNGS[-1]


def ladder(connection: Connection, values: Sequence[int]) -> list[Change]:
    """All rungs in the order that breaks most: what rises from the bottom upwards, what falls from the top down."""
    rungs = [change(connection, slug, address, raw) for (slug, address), raw in zip(RUNGS, values, strict=True)]
    return rungs[::-1] if values[4] < DEFAULTS[4] else rungs


def batch(connection: Connection, changes: Sequence[Change], **options: object) -> Order:
    beside = [(connection.driver(target), target) for target in connection.targets]
    chosen = {"on_failure": OnFailure.STOP, "accepted": False} | options
    return Order(changes, frozenset(), beside=beside, **chosen)  # type: ignore[arg-type]


async def held(connection: Connection) -> tuple[Raw, ...]:
    """What the twins hold, asked on the wire."""
    found = []
    for slug, address in RUNGS:
        target = connection.target(slug)
        found.append(decode(target.entry(address), await connection.driver(target).read(target.node, address)))
    return tuple(found)


def broken(connection: Connection, values: dict[Rung, int]) -> bool:
    """True where a station that holds these rungs breaks a rule that holds at every step."""
    devices = []
    for slug in (PMM, PMC):
        own = {address: raw for (device, address), raw in values.items() if device == slug}
        devices.append(DeviceValues(slug, connection.target(slug).description, own))
    return bool(broken_stepwise(StationValues(tuple(devices))))


def prefixes(before: Sequence[int], writes: Sequence[tuple[Rung, int]]) -> list[dict[Rung, int]]:
    """The ladder after each write."""
    now, found = dict(zip(RUNGS, before, strict=True)), []
    for rung, raw in writes:
        now[rung] = raw
        found.append(dict(now))
    return found


def listen(served: Served) -> list[tuple[Rung, int]]:
    """The writes to rungs, as they are put on the line: a witness that knows nothing of jobs and rows."""
    seen: list[tuple[Rung, int]] = []

    def look(can: Can) -> bool:
        if can.can_id in NODE_OF and can.data[0] >> 5 == 1:
            address = Address(int.from_bytes(can.data[1:3], "little"), can.data[3])
            if (rung := (NODE_OF[can.can_id], address)) in RUNGS:
                seen.append((rung, int.from_bytes(can.data[4:6], "little")))
        return False

    served.spoil(Fault(look, drop, times=None))
    return seen


@pytest.mark.parametrize("values", [UP, DOWN])
async def test_the_ladder_moves_and_no_write_breaks_its_order(
    connection: Connection, served: Served, values: tuple[int, ...]
) -> None:
    changes = ladder(connection, values)
    naive = prefixes(DEFAULTS, [((one.target.slug, one.address), int(one.raw)) for one in changes])
    assert [broken(connection, one) for one in naive].count(True) > 4, "it needs another order"
    assert await held(connection) == DEFAULTS
    seen = listen(served)
    job = await run(connection, batch(connection, changes))
    assert states(job) == [RowState.VERIFIED] * len(RUNGS)
    assert await held(connection) == values
    assert sorted(rung[0] + str(rung[1]) for rung, _ in seen) == sorted(slug + str(one) for slug, one in RUNGS)
    assert [one for one in prefixes(DEFAULTS, seen) if broken(connection, one)] == []
    assert [(row.device, parse_address(row.address)) for row in job.rows] == [rung for rung, _ in seen]


async def test_the_other_unit_counts_where_nobody_has_read_it(connection: Connection, served: Served) -> None:
    """Only the PMM's maximum is written; that it would pass the PMC's is known only by asking the PMC."""
    assert connection.target(PMC).lookup(MAXIMUM_PMC[1]) is None
    only = [change(connection, *MAXIMUM_PMM, 780)]
    known = KnownDevices(connection.targets)
    assert MAXIMUM_PMC in [(one.slug, one.address) for one in known.unknown({only[0].place: 780})]
    seen = listen(served)
    job = await run(connection, batch(connection, only))
    assert (states(job), errors(job), seen) == ([RowState.REFUSED], [OrderError], [])
    assert await held(connection) == DEFAULTS
    assert states(await run(connection, batch(connection, only, accepted=True))) == [RowState.VERIFIED]


async def test_one_of_a_batch_that_has_no_turn_keeps_the_rest_from_being_sent(
    connection: Connection, served: Served
) -> None:
    changes = [
        change(connection, PMM, Address(0x3110, 1), 490),
        change(connection, *MAXIMUM_PMM, 780),
        change(connection, *MAXIMUM_PMC, 770),
    ]
    seen = listen(served)
    job = await run(connection, batch(connection, changes))
    assert seen == []
    by_address = {row.address: row.state for row in job.rows}
    assert by_address["30FA:02"] is RowState.REFUSED and by_address["3110:01"] is RowState.WAITING


async def test_after_a_failure_the_rest_is_ordered_anew(connection: Connection, served: Served) -> None:
    """The PMC's maximum must rise before the PMM's; where that fails, the PMM's has no turn any more."""
    served.spoil(Fault(lambda can: can.can_id == 0x60B and can.data[:4] == b"\x2b\x10\x65\x05", drop, times=None))
    changes = [
        change(connection, *MAXIMUM_PMM, 780),
        change(connection, *MAXIMUM_PMC, 790),
        change(connection, PMM, Address(0x3110, 1), 490),
    ]
    job = await run(connection, batch(connection, changes, on_failure=OnFailure.GO_ON))
    found = {row.address: (row.state, type(row.error)) for row in job.rows}
    assert found["6510:05"][0] is RowState.REFUSED
    assert found["30FA:02"] == (RowState.REFUSED, OrderError)
    assert found["3110:01"] == (RowState.VERIFIED, type(None))
    assert job.done == job.total
    assert await held(connection) == DEFAULTS


async def test_a_limit_says_more_than_the_order(connection: Connection) -> None:
    """A chopper threshold above the maximum of its own unit is refused for that."""
    await held(connection)
    job = await run(connection, batch(connection, [change(connection, PMM, Address(0x30FC, 1), 760)]))
    assert errors(job) == [LimitError]
