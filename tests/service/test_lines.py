"""The diagnosis of a PROFIBUS line, with the twin on a real pseudo-terminal."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest

from app.drivers.contract import LinkState
from app.drivers.profibus_view import StationView
from app.errors import SettingsError, UsageError
from app.model.description import Verify
from app.model.site import load_site
from app.service import lines
from app.service.connection import Connection
from app.service.link import TwinWatch
from app.service.site_edit import SiteEditor
from app.service.sites import Sites
from app.wire.profibus.pzd import AS_PKW
from app.wire.profibus.telegrams import ACTUAL, CONTROL_WORD, STATUS_WORD
from tests.drivers.profibus_rig import ACTUAL as ACTUAL_POSITION
from tests.drivers.profibus_rig import CONTROLWORD, DEADLINE_S, NODE, wire
from tests.service.lines_rig import DEVICE, connected, descriptions, site_text, turbine_of
from tests.web.rig import make_connection

ANOTHER = 0x4711
"""The ident number of no twin of ours."""


async def one_line(connection: Connection) -> lines.Line:
    (line,) = await lines.lines(connection)
    return line


async def station_that(connection: Connection, holds: Callable[[StationView], bool]) -> StationView:
    """The station once it ``holds``."""
    async with asyncio.timeout(DEADLINE_S):
        while True:
            ((_, view),) = (await one_line(connection)).stations
            if view is not None and holds(view):
                return view
            await asyncio.sleep(0.05)


async def test_a_line_and_its_station_are_told_as_the_driver_has_them() -> None:
    with wire() as line:
        async with connected(line) as connection:
            shown = await one_line(connection)
            assert (shown.status.state, shown.master, shown.problem) == (LinkState.CONNECTED, 2, None)
            ((target, view),) = shown.stations
            assert (target.slug, target.node) == (DEVICE, NODE)
            assert view is not None
            assert (view.order, view.sent, len(view.inputs)) == (None, None, 6)
            checked = await lines.check_order(connection, target)
            assert checked.order.proven == AS_PKW
            position = next(one for one in checked.readings if one.signal is ACTUAL)
            assert position.by_order[AS_PKW] == position.value == pytest.approx(250_000, abs=1000)
            assert [order for order, value in position.by_order.items() if value == position.value] == [AS_PKW]
            ((_, after),) = (await one_line(connection)).stations
            assert after is not None
            assert (after.order, after.received) == (AS_PKW, dict.fromkeys(after.received or {}, 0))
            assert after.sent is not None
            assert after.sent[STATUS_WORD] == 8
            await connection.driver(target).write(NODE, CONTROLWORD, b"\7\0", verify=Verify.EFFECT)
            ((_, enabled),) = (await one_line(connection)).stations
            assert enabled is not None
            assert enabled.received is not None
            assert enabled.received[CONTROL_WORD] == 7
            assert enabled.outputs[:2] == b"\0\7"


async def test_a_station_that_was_switched_off_is_told_and_what_was_proven_is_void() -> None:
    with wire() as line:
        async with connected(line) as connection:
            target = connection.target(DEVICE)
            await lines.check_order(connection, target)
            line.power_off()
            await station_that(connection, lambda view: view.state.value == "absent")
            line.power_on()
            view = await station_that(connection, lambda view: bool(view.inputs))
            assert (view.order, view.sent, view.starts) == (None, None, 2)


async def test_of_a_line_that_is_gone_nothing_is_told_but_why() -> None:
    with wire() as line:
        async with connected(line) as connection:
            await connection.driver(connection.target(DEVICE)).close()
            shown = await one_line(connection)
            assert shown.status.state is LinkState.CLOSED
            assert [view for _, view in shown.stations] == [None]


async def test_a_proven_order_is_noted_in_the_site_file(tmp_path: Path) -> None:
    with wire() as line:
        file = tmp_path / "site.toml"
        file.write_text(site_text(line, "telegram = 1"), encoding="utf-8")
        editor = SiteEditor(Sites((turbine_of(line),), descriptions, file=file))
        async with connected(line, "telegram = 1") as connection:
            target = connection.target(DEVICE)
            with pytest.raises(SettingsError):
                await lines.keep_order(connection, target, "low-low", editor, connection.journal)
            assert load_site(file)[0].devices[0].slave.pzd_order == ""
            await lines.keep_order(connection, target, "high-high", editor, connection.journal)
        slave = load_site(file)[0].devices[0].slave
        assert (slave.pzd_order, slave.telegram) == ("high-high", 1)


async def test_where_a_bus_has_no_order_of_bytes_there_is_nothing_to_check() -> None:
    connection = make_connection()
    with pytest.raises(UsageError):
        await lines.check_order(connection, next(iter(connection.targets)))
    (shown,) = await lines.lines(connection)
    assert (shown.stations, shown.problem, shown.master) == ((), None, None)


async def test_a_slave_says_by_its_ident_number_that_it_is_a_twin() -> None:
    with wire() as line:
        async with connected(line) as connection:
            watch = TwinWatch(connection.targets, connection.buses)
            await connection.driver(connection.target(DEVICE)).read(NODE, ACTUAL_POSITION)
            assert watch.all_twins()
    with wire() as line:
        line.do(lambda: setattr(line.device.slave, "ident", ANOTHER))
        async with connected(line) as connection:
            watch = TwinWatch(connection.targets, connection.buses)
            await connection.driver(connection.target(DEVICE)).read(NODE, ACTUAL_POSITION)
            assert not watch.all_twins()
