"""What the page needs of a drive on Modbus TCP: where it is, what differs from its description, that it answers."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from app.errors import AddressChangeError, UsageError
from app.model.address import Address
from app.model.checks import Allow, check_write
from app.model.datatypes import DataType
from app.model.description_file import load_builtin
from app.model.site import read_site
from app.service.address_change import address_changes
from app.service.connection import Connection
from app.service.devices import Target
from app.service.jobs import Job, RowState
from app.service.journal import Kind
from app.service.options import Options
from app.service.polling import Rate, usual_list
from app.service.verify import verifiable, verify
from app.service.views import node_lines
from app.service.write import write_raw
from app.service.write_many import Change, OnFailure, Order, prepare, write_many
from tests.drivers.modbus_rig import twin

CONFIGURATION, STATIC, MASK, MODULES = Address(0x2010), Address(0x2011), Address(0x2012), Address(0x2102)
WINDOW, POLES = Address(0x6065), Address(0x2030)
IP = 0xC0A80015  # 192.168.0.21
MASK_24 = 0xFFFFFF00


@pytest.fixture
async def servo(tmp_path: Path) -> AsyncIterator[tuple[Connection, Target]]:
    """A connection to a twin, named by a site file."""
    with twin() as peer:
        site = f"""
schema = 1
[turbine.b.bus.lan]
connection = "modbus-tcp"
ranges = ["127.0.0.1:{peer.port}"]
[turbine.b.station.s.device.servo]
description = "nanotec-pd4e"
node = 1
address = "127.0.0.1:{peer.port}"
"""
        (turbine,) = read_site(site, "site.toml")
        known = {"nanotec-pd4e": load_builtin("nanotec-pd4e")}
        async with Connection(turbine, known, Options("Tester", None)) as connection:
            yield connection, next(iter(connection.targets))


def changes(connection: Connection, target: Target, wanted: dict[Address, int]) -> list[Change]:
    return [Change(connection.driver(target), target, address, raw) for address, raw in wanted.items()]


async def test_what_decides_the_address_is_written_only_once_it_is_confirmed(servo: tuple[Connection, Target]) -> None:
    connection, target = servo
    driver = connection.driver(target)
    before = await driver.read(1, STATIC)
    with pytest.raises(AddressChangeError) as refused:
        await write_raw(driver, target, STATIC, IP, connection.journal)
    assert refused.value.details["connected"] == target.device.server.text
    assert await driver.read(1, STATIC) == before
    done = await write_raw(driver, target, STATIC, IP, connection.journal, allow=Allow.ADDRESS)
    assert done.verified and done.read == IP


async def test_a_batch_with_such_a_row_writes_nothing_until_it_is_confirmed(servo: tuple[Connection, Target]) -> None:
    connection, target = servo
    wanted = {WINDOW: 300, STATIC: IP}
    for allow, states in ((Allow.NOTHING, ["waiting", "refused"]), (Allow.ADDRESS, ["verified", "verified"])):
        order = Order(changes(connection, target, wanted), frozenset(), OnFailure.STOP, allow)
        job = Job("1", "write", "", rows=prepare(order))
        await write_many(job, order, connection.journal, connection.stamper)
        found = {row.address: row for row in job.rows}
        assert [found[address.short].state for address in wanted] == [RowState(one) for one in states]
        error = found[STATIC.short].error
        assert isinstance(error, AddressChangeError) is (allow is Allow.NOTHING)


async def test_it_is_told_where_the_device_is_then(servo: tuple[Connection, Target]) -> None:
    connection, target = servo
    port = target.device.server.port

    def told(wanted: dict[Address, int]) -> list[str | None]:
        return [one.site_address for one in address_changes((target, a, raw) for a, raw in wanted.items())]

    assert told({WINDOW: 1}) == []
    assert told({CONFIGURATION: 1, STATIC: IP, MASK: MASK_24}) == [f"192.168.0.21:{port}"]
    assert told({CONFIGURATION: 0, STATIC: IP, MASK: MASK_24}) == [None], "DHCP gives the address"
    assert told({CONFIGURATION: 1, STATIC: IP, MASK: MASK_24, MODULES: 0}) == [None], "the bus itself is switched"
    await connection.driver(target).write(1, MASK, MASK_24.to_bytes(4, "little"))
    await connection.driver(target).write(1, CONFIGURATION, b"\1\0\0\0")
    async with asyncio.timeout(10.0):
        while told({STATIC: IP}) != [f"192.168.0.21:{port}"]:  # noqa: ASYNC110  frames reach the live state later
            await asyncio.sleep(0.01)


def test_a_write_that_nobody_confirmed_is_refused_wherever_it_comes_from() -> None:
    description = load_builtin("nanotec-pd4e")
    for address in (CONFIGURATION, STATIC, MASK, Address(0x2013), MODULES):
        with pytest.raises(AddressChangeError):
            check_write(description, description.entry(address), 0, lambda _address: None)


async def test_the_twin_is_as_it_is_described_and_a_drive_that_is_not_is_told(
    servo: tuple[Connection, Target],
) -> None:
    connection, target = servo
    assert verifiable(connection) == {target.slug}
    done = await verify(connection.driver(target), target, connection.journal, connection.stamper)
    assert done.objects == len(target.description.entries)
    # Nothing but the categories in which it has nothing to save, which it says itself.
    assert {(one.address.major, one.deviation.value) for one in done.findings} == {
        (0x1010, "not_ready"),
        (0x1011, "not_ready"),
    }
    noted = [entry for entry in connection.journal.latest() if entry.kind is Kind.VERIFIED]
    assert [(entry.device, entry.details["count"]) for entry in noted] == [(target.slug, len(done.findings))]
    as_made = set(done.findings)
    # Now it is described otherwise than it is made: one object is smaller there, and another one does not exist.
    entries = {address: entry for address, entry in target.description.entries.items() if address != POLES}
    entries[WINDOW] = replace(entries[WINDOW], type=DataType.UNSIGNED16)
    connection.driver(target)._devices[1].description = replace(target.description, entries=entries)
    done = await verify(connection.driver(target), target, connection.journal, connection.stamper)
    found = {(one.address, one.deviation.value, one.expected, one.found) for one in set(done.findings) - as_made}
    assert found == {(WINDOW, "size", 2, 4), (POLES, "extra", None, 4)}


async def test_a_bus_that_gives_no_whole_dictionary_says_so(servo: tuple[Connection, Target]) -> None:
    connection, target = servo
    with pytest.raises(UsageError):
        await verify(object(), target, connection.journal, connection.stamper)  # type: ignore[arg-type]


async def test_a_device_without_heartbeats_is_there_by_its_answers(servo: tuple[Connection, Target]) -> None:
    connection, target = servo
    (line,) = node_lines([target], connection.live)
    assert (line.managed, line.answered_t_ns) == (False, None)
    asked_ns = connection.stamper()
    await connection.driver(target).read(1, WINDOW)
    async with asyncio.timeout(10.0):
        while node_lines([target], connection.live)[0].answered_t_ns is None:  # noqa: ASYNC110  frames come later
            await asyncio.sleep(0.01)
    (line,) = node_lines([target], connection.live)
    assert line.answered_t_ns is not None and line.answered_t_ns > asked_ns
    assert (line.heartbeat_t_ns, line.nmt, line.silent) == (None, "unknown", False)


def test_units_that_the_device_chooses_are_read_again_and_others_poll_as_before() -> None:
    servo, pmc = (usual_list(load_builtin(name)) for name in ("nanotec-pd4e", "oat-pmc"))
    assert servo[Address(0x60A8)] is Rate.RARE
    assert servo[Address(0x6091, 1)] is Rate.RARE
    assert servo[Address(0x6077)] is Rate.SLOW
    assert servo[Address(0x4014, 1)] is Rate.SLOW
    assert Address(0x6077) not in pmc, "it has a current of its own"
    assert not [address for address in pmc if address.major in (0x60A8, 0x6091, 0x6092, 0x4014)]
