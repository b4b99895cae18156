"""STOP and FEATHER reach every axis, by PDO where it is in force, else by SDO, whatever else is going on."""

from __future__ import annotations

import asyncio

import pytest

from app.errors import NoAnswerError, OvertakenError
from app.model.address import Address
from app.model.checks import Allow
from app.service.backup import read_devices
from app.service.connection import Connection
from app.service.pdo.look import seen_on
from app.service.stop import Command, Path, command_all
from app.service.write import write_raw
from app.twins.line import Fault, delay, drop
from app.wire.nmt import NmtCommand, NmtState
from tests.e2e.test_interoperation import until
from tests.service.conftest import MS, Served

CONTROLWORD = Address(0x6040)
ANGLE = Address(0x6064)
RPDO1_TYPE = Address(0x1400, 2)


async def enable(connection: Connection, node: int) -> None:
    """Bring an axis to operation enabled."""
    target = next(one for one in connection.targets if one.node == node)
    driver = connection.driver(target)
    for word in (0x0106, 0x0107, 0x010F):
        await driver.write(node, CONTROLWORD, word.to_bytes(2, "little"))


async def statusword(connection: Connection, node: int) -> int:
    target = next(one for one in connection.targets if one.node == node)
    return int.from_bytes(await connection.driver(target).read(node, Address(0x6041)), "little")


async def test_stop_takes_the_pdo_of_operational_nodes_and_sdo_for_others(connection: Connection) -> None:
    driver = connection.buses["can0"].driver
    driver.nmt(NmtCommand.START, 11)
    for node in (11, 12):
        await enable(connection, node)
    await until(lambda: (view := connection.live.node("can0", 11)) is not None and view.state is not None)
    assert await statusword(connection, 11) & 0x6F == 0x27
    outcomes = await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    by_device = {outcome.device.split("/")[1]: outcome for outcome in outcomes}
    assert by_device["blade-1"].how is Path.RPDO
    assert by_device["blade-2"].how is Path.SDO
    assert all(outcome.confirmed_t_ns is not None for outcome in outcomes)
    for node in (11, 12):
        assert await statusword(connection, node) & 0x6F != 0x27


async def test_stop_goes_before_a_running_backup(connection: Connection) -> None:
    await enable(connection, 11)
    pairs = [(connection.driver(target), target) for target in connection.targets]
    backup = asyncio.create_task(read_devices(pairs))
    await until(lambda: connection.buses["can0"].frames > 200)
    outcomes = await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    assert not backup.done(), "the backup was still running"
    assert all(outcome.error is None for outcome in outcomes)
    assert await statusword(connection, 11) & 0x6F != 0x27
    reports = await backup
    assert all(len(report.values) > 200 for report in reports), "and it went on afterwards"


async def test_feather_drives_the_blade_to_90_degrees(connection: Connection) -> None:
    outcomes = await command_all(connection.axes(), Command.FEATHER, connection.journal, connection.stamper)
    assert [outcome.error for outcome in outcomes] == [None, None, None]
    target = connection.target("wtg-07/blade-1/pmc")
    driver = connection.driver(target)

    async def angle() -> int:
        return int.from_bytes(await driver.read(11, ANGLE), "little", signed=True)

    for _ in range(400):
        if await angle() >= 8990:
            return
        await asyncio.sleep(0.05)
    raise AssertionError(f"the blade stands at {await angle()}")


async def test_one_dead_axis_does_not_keep_the_others_from_stopping(connection: Connection, served: Served) -> None:
    await enable(connection, 12)
    served.spoil(Fault(lambda can: can.can_id == 0x60B, drop, None))
    outcomes = await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    failed = [outcome.device for outcome in outcomes if outcome.how is Path.FAILED]
    assert failed == ["wtg-07/blade-1/pmc"]
    assert await statusword(connection, 12) & 0x6F != 0x27


async def test_a_write_that_waits_does_not_follow_a_stop(connection: Connection, served: Served) -> None:
    """Whoever asked for it did not know of the STOP: it would set the axis going again."""
    await enable(connection, 11)
    target = connection.target("wtg-07/blade-1/pmc")
    driver = connection.driver(target)
    served.spoil(Fault(lambda can: can.can_id == 0x58B, drop, times=1))
    waits_500_ms = asyncio.create_task(driver.read(11, ANGLE))
    enabling = asyncio.create_task(
        write_raw(driver, target, CONTROLWORD, 0x010F, connection.journal, allow=Allow.MOTION)
    )
    await asyncio.sleep(0)  # both wait in the queue of the node
    await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    with pytest.raises(OvertakenError):
        await enabling
    await waits_500_ms
    assert int.from_bytes(await driver.read(11, CONTROLWORD), "little") == Command.STOP.value
    assert await statusword(connection, 11) & 0x6F != 0x27


async def test_a_stop_by_pdo_is_not_undone_by_a_write_that_is_on_its_way(
    connection: Connection, served: Served
) -> None:
    """A device works what comes by SDO in its own time: the STOP follows the write on the same way then."""
    driver = connection.buses["can0"].driver
    driver.nmt(NmtCommand.START, 11)
    await enable(connection, 11)
    await until(lambda: (view := connection.live.node("can0", 11)) is not None and view.state is not None)
    served.spoil(Fault(lambda can: can.can_id == 0x60B, delay(100 * MS), times=None))
    enabling = asyncio.create_task(driver.write(11, CONTROLWORD, (0x010F).to_bytes(2, "little")))
    await until(lambda: driver._client.may_still_write(11, CONTROLWORD))
    outcomes = await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    by_device = {outcome.device: outcome for outcome in outcomes}
    assert by_device["wtg-07/blade-1/pmc"].how is Path.SDO
    assert by_device["wtg-07/blade-1/pmc"].confirmed_t_ns is not None
    await asyncio.gather(enabling, return_exceptions=True)
    assert int.from_bytes(await driver.read(11, CONTROLWORD), "little") == Command.STOP.value
    assert await statusword(connection, 11) & 0x6F != 0x27


async def start(connection: Connection, node: int) -> None:
    """Have the node operational, and known to be."""
    connection.buses["can0"].driver.nmt(NmtCommand.START, node)

    def runs() -> bool:
        view = connection.live.node("can0", node)
        return view is not None and view.state is NmtState.OPERATIONAL

    await until(runs)


async def stop_at(connection: Connection, node: int) -> Path:
    """STOP an enabled axis; by which way it went, which must have been one alone."""
    await enable(connection, node)
    sent = (0x200 + node, False)
    before = seen_on(connection, "can0").latest_ns.get(sent)
    outcomes = await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    (outcome,) = [one for one in outcomes if one.device == "wtg-07/blade-1/pmc"]
    assert outcome.confirmed_t_ns is not None
    assert await statusword(connection, node) & 0x6F != 0x27
    by_pdo = seen_on(connection, "can0").latest_ns.get(sent) != before
    assert by_pdo is (outcome.how is Path.RPDO)
    return outcome.how


@pytest.mark.parametrize("kind", [0, 1, 240, 252])
async def test_a_pdo_that_waits_for_a_sync_is_no_way_for_a_stop(connection: Connection, kind: int) -> None:
    """What comes by it takes effect only at a SYNC, and none is ever sent here: it goes by SDO, and at once."""
    await start(connection, 11)
    driver = connection.buses["can0"].driver
    assert await stop_at(connection, 11) is Path.RPDO
    await driver.write(11, RPDO1_TYPE, bytes((kind,)))
    assert await stop_at(connection, 11) is Path.SDO
    await driver.write(11, RPDO1_TYPE, bytes((254,)))
    assert await stop_at(connection, 11) is Path.RPDO


async def test_a_pdo_of_which_it_is_not_sure_when_it_works_is_no_way_for_a_stop(
    connection: Connection, served: Served
) -> None:
    """The answer to the write of its transmission type is lost: it may wait for a SYNC now, until somebody reads it."""
    await start(connection, 11)
    driver = connection.buses["can0"].driver
    lost = Fault(lambda can: can.can_id == 0x58B and can.data[1:4] == b"\x00\x14\x02", drop, times=None)
    served.spoil(lost)
    with pytest.raises(NoAnswerError):
        await driver.write(11, RPDO1_TYPE, b"\x01")
    served.thread.call_soon(lambda: served.line.withdraw(lost))
    assert await stop_at(connection, 11) is Path.SDO
    await driver.write(11, RPDO1_TYPE, b"\xff")
    assert await stop_at(connection, 11) is Path.RPDO


async def test_a_pdo_that_is_switched_off_is_no_way_for_a_stop(connection: Connection) -> None:
    await start(connection, 11)
    driver = connection.buses["can0"].driver
    await driver.write(11, Address(0x1400, 1), (0x8000020B).to_bytes(4, "little"))
    assert await stop_at(connection, 11) is Path.SDO
