"""Orders that try an axis: held enabled, its EFC, its brake; and what needs no preparation. On a twin, over a wire."""

from __future__ import annotations

import asyncio
import contextlib

import pytest

from app.errors import AxisStateError, BusLostError, HubsideError, InterlockError, LeaseError
from app.model.address import Address
from app.model.axis_state import AxisState
from app.service.connection import Connection
from app.service.motion.brake_test import OUTPUTS, BrakeVerdict, try_brake
from app.service.motion.control import cia402
from app.service.motion.desk import MotionDesk
from app.service.motion.feathering import feather
from app.service.motion.moves import hold, home, jog, move_to, reset_fault
from app.service.motion.running import Ended
from app.service.stop import Command, command_all
from app.twins.plant import BrakeFault
from tests.service.conftest import Served
from tests.service.motion.rig import AXIS, Page, angle_deg, at_the_desk, number

pytestmark = pytest.mark.alone  # drives and pages miss each other after fractions of a second

STATUS = Address(0x6041)
OFF = (0x21, 0x40)


async def prepared(desk: MotionDesk, page: Page) -> None:
    page.hold()
    await desk.prepare(AXIS, page.fence)
    page.let_go()
    page.hold()


async def state(connection: Connection) -> int:
    return await number(connection, STATUS) & 0x6F


def why(desk: MotionDesk) -> Ended | None:
    return None if desk.last is None else desk.last.why


async def until_state(connection: Connection, *wanted: int) -> None:
    async with asyncio.timeout(10.0):
        while await state(connection) not in wanted:  # noqa: ASYNC110  the device has no event for it
            await asyncio.sleep(0.02)


async def until_angle(connection: Connection, above_deg: float) -> None:
    async with asyncio.timeout(20.0):
        while await angle_deg(connection) < above_deg:  # noqa: ASYNC110  the device has no event for it
            await asyncio.sleep(0.02)


async def out_of_feather(connection: Connection, desk: MotionDesk, page: Page) -> None:
    """Far enough from the end of the EFC that it can be let go on its way; pressed anew afterwards."""
    page.let_go()
    page.hold()
    await move_to(desk, AXIS, page.fence, 76.0, 5.0, connection.journal)
    page.let_go()
    page.hold()


async def test_an_axis_is_held_enabled_and_stands(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        start_deg = await angle_deg(connection)
        holding = asyncio.create_task(hold(desk, AXIS, page.fence))
        await until_state(connection, 0x27)
        assert await number(connection, OUTPUTS) & 1, "the brake is lifted"
        page.let_go()
        await holding
        assert desk.last is not None
        assert desk.last.why is Ended.RELEASED
        assert await state(connection) in OFF
        assert not await number(connection, OUTPUTS) & 1
        assert await angle_deg(connection) == pytest.approx(start_deg, abs=0.1)


async def test_the_efc_of_one_axis_drives_to_its_target_and_others_stay(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        neighbour = "wtg-07/blade-2/pmc"
        stood = await feather(desk, AXIS, page.fence)
        assert stood.to_deg == stood.from_deg, "the proof has feathered the blades"
        await out_of_feather(connection, desk, page)
        start_deg = await angle_deg(connection)
        others = await number(connection, Address(0x6064), neighbour)
        found = await feather(desk, AXIS, page.fence)
        assert desk.last is not None
        assert desk.last.why in (Ended.DONE, Ended.LIMIT)
        assert found.from_deg == pytest.approx(start_deg, abs=0.1)
        assert found.target_deg == 90.0
        assert found.to_deg == pytest.approx(90.0, abs=0.5)
        assert await state(connection) in OFF, "without power afterwards"
        assert await number(connection, Address(0x6064), neighbour) == pytest.approx(others, abs=5)


async def test_an_efc_that_is_let_go_stops_on_its_way(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        await out_of_feather(connection, desk, page)
        driving = asyncio.create_task(feather(desk, AXIS, page.fence))
        await until_angle(connection, 78.0)
        page.let_go()
        found = await driving
        assert desk.last is not None
        assert desk.last.why is Ended.RELEASED
        assert 78.0 < found.to_deg < 89.0
        rest_deg = await angle_deg(connection)
        await asyncio.sleep(0.3)
        assert await angle_deg(connection) == pytest.approx(rest_deg, abs=0.05)
        assert await state(connection) in OFF


async def test_a_brake_that_lifts_and_holds(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        found = await try_brake(desk, AXIS, page.fence, connection.journal)
        assert found.verdict is BrakeVerdict.HOLDS
        assert found.turned_deg == pytest.approx(0.5, abs=0.3)
        assert found.drift_deg is not None
        assert found.drift_deg < 0.1
        assert found.lifted_s is not None
        assert found.engaged_s is not None


async def test_a_brake_that_sticks_is_found(connection: Connection, served: Served) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        plant = served.turbine.blades[0].pmc.drive.plant
        served.thread.call_soon(lambda: setattr(plant, "brake_stuck", BrakeFault.ENGAGED))
        found = await try_brake(desk, AXIS, page.fence, connection.journal)
        assert found.verdict is BrakeVerdict.STUCK
        assert found.turned_deg is not None
        assert found.turned_deg < 0.2


async def test_a_brake_test_that_is_let_go_has_no_verdict(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        trying = asyncio.create_task(try_brake(desk, AXIS, page.fence, connection.journal))
        await until_state(connection, 0x27)
        page.let_go()
        found = await trying
        assert found.verdict is None
        assert await state(connection) in OFF


async def test_a_brake_test_that_is_let_go_while_the_blade_rests_enables_nothing(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        trying = asyncio.create_task(try_brake(desk, AXIS, page.fence, connection.journal))
        await until_state(connection, 0x27)
        await until_state(connection, *OFF)
        page.let_go()
        found = await trying
        assert found.verdict is None
        assert why(desk) is Ended.RELEASED
        for _ in range(10):
            assert await state(connection) in OFF


async def test_nothing_but_stop_ends_a_feather(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        await out_of_feather(connection, desk, page)
        await command_all(connection.axes(), Command.FEATHER, connection.journal, connection.stamper)
        await until_state(connection, 0x27)
        with pytest.raises(InterlockError):
            await desk.halt(AXIS, page.fence)
        with pytest.raises(InterlockError):
            await hold(desk, AXIS, page.fence)
        with pytest.raises(InterlockError):
            await reset_fault(desk, AXIS, page.fence, connection.journal)
        await until_angle(connection, 89.5)


async def test_a_frame_that_the_adapter_does_not_take_keeps_nothing_from_stopping(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        await out_of_feather(connection, desk, page)
        control = cia402(desk.prepared[AXIS].control)
        send = control._send
        assert send is not None
        moving = asyncio.create_task(jog(desk, AXIS, page.fence, -4.0, connection.journal))
        start_deg = await angle_deg(connection)
        async with asyncio.timeout(10.0):
            while await angle_deg(connection) > start_deg - 0.5:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.01)

        def full(data: bytes) -> bool:
            send(data)  # counted, as the driver does it, and not taken
            raise BusLostError(bus="can0", reason="the adapter's buffer is full")

        driver = connection.driver(connection.target(AXIS))
        sends = driver._port.send
        driver._port.send = lambda _can: None  # what is sent now does not reach the bus
        control._send = full
        page.let_go()
        driver._port.send = sends
        with contextlib.suppress(HubsideError):
            await moving
        await until_state(connection, *OFF)


async def test_a_fault_is_reset_before_anything_is_prepared(connection: Connection, served: Served) -> None:
    async with at_the_desk(connection) as (desk, page):
        pmc = served.turbine.blades[0].pmc
        served.thread.call_soon(lambda: pmc.raise_error(0x8400))
        async with asyncio.timeout(30.0):
            while await number(connection, STATUS) & 0x4F != 0x08:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.02)
        assert desk.prepared == {}
        assert await reset_fault(desk, AXIS, page.fence, connection.journal) is not AxisState.FAULT
        page.hold()
        await desk.prepare(AXIS, page.fence)
        assert desk.prepared[AXIS].proof_s is not None


async def test_an_axis_with_power_is_not_homed(connection: Connection, served: Served) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        machine = served.turbine.blades[0].pmc.machine
        control = cia402(desk.prepared[AXIS].control)
        control.own()
        await control.enable()
        assert machine.state.name == "OPERATION_ENABLED"
        before_deg = await angle_deg(connection)
        with pytest.raises(AxisStateError):
            await home(desk, AXIS, page.fence, 45.0, connection.journal)
        assert await angle_deg(connection) == pytest.approx(before_deg, abs=0.1)


async def test_one_axis_is_halted_and_stopped(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        with pytest.raises(LeaseError):
            await desk.halt(AXIS, page.fence - 1)
        with pytest.raises(AxisStateError):
            await desk.halt(AXIS, page.fence)  # that word would enable it
        assert await state(connection) in OFF
        await prepared(desk, page)
        holding = asyncio.create_task(hold(desk, AXIS, page.fence))
        await until_state(connection, 0x27)
        await desk.halt(AXIS, page.fence)
        await holding
        assert why(desk) is Ended.RELEASED
        page.let_go()
        page.hold()
        again = asyncio.create_task(hold(desk, AXIS, page.fence))
        await until_state(connection, 0x27)
        axes = [axis for axis in connection.axes() if axis.target.slug == AXIS]
        outcomes = await command_all(axes, Command.STOP, connection.journal, connection.stamper)
        await again
        assert [one.device for one in outcomes] == [AXIS]
        assert why(desk) is Ended.STOPPED
        with pytest.raises(AxisStateError):
            await desk.halt(AXIS, page.fence)
