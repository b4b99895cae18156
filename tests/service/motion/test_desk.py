"""The axis moves while somebody holds it, and stops otherwise: on a twin, over a wire."""

from __future__ import annotations

import asyncio
import contextlib
import time

import pytest

from app.errors import (
    InterlockError,
    LeaseError,
    LimitError,
    NotHeldError,
    NotPreparedError,
    OvertakenError,
    UsageError,
)
from app.model.address import Address
from app.model.axis_state import AxisState
from app.service.connection import Connection
from app.service.motion.desk import MotionDesk
from app.service.motion.interlocks import Confirmed, Interlock
from app.service.motion.left import Left
from app.service.motion.line import motion_line
from app.service.motion.moves import home, jog, move_to, reset_fault
from app.service.motion.positions import positions
from app.service.motion.running import Ended
from app.service.stop import CONTROLWORD, Command, command_all
from app.wire.nmt import NmtState
from tests.e2e.test_interoperation import until
from tests.service.conftest import Served
from tests.service.motion.rig import AXIS, Page, SteadyClock, angle_deg, at_the_desk, number

pytestmark = pytest.mark.alone  # drives and pages miss each other after fractions of a second

ABORT, WATCH = Address(0x6007), Address(0x1016, 1)
STATUS = Address(0x6041)


async def below(connection: Connection, limit_deg: float) -> None:
    async with asyncio.timeout(10.0):
        while await angle_deg(connection) > limit_deg:  # noqa: ASYNC110  the device has no event for it
            await asyncio.sleep(0.02)


async def jogging(connection: Connection, desk: MotionDesk, page: Page) -> tuple[float, asyncio.Task[None]]:
    """Prepared, held, and on its way: where it began, and the order."""
    page.hold()
    await desk.prepare(AXIS, page.fence)
    page.let_go()
    page.hold()
    start_deg = await angle_deg(connection)
    motion = asyncio.create_task(jog(desk, AXIS, page.fence, -4.0, connection.journal))
    await below(connection, start_deg - 1.0)
    return start_deg, motion


def nmt_state(connection: Connection) -> NmtState | None:
    view = connection.live.node("can0", 11)
    return None if view is None else view.state


async def test_an_axis_proves_that_it_stops_by_itself_and_gets_its_settings_back(connection: Connection) -> None:
    before = await number(connection, ABORT), await number(connection, WATCH)
    async with at_the_desk(connection) as (desk, page):
        page.hold()
        axis = await desk.prepare(AXIS, page.fence)
        assert axis.proof_s is not None
        assert 0.3 < axis.proof_s < 0.7, "the consumer time is 400 ms"
        assert await number(connection, ABORT) == 3
        assert await number(connection, WATCH) == 126 << 16 | 400
        assert (await number(connection, STATUS)) & 0x6F in (0x21, 0x40)
        page.let_go()
        await desk.put_back(AXIS, page.fence)
        assert (await number(connection, ABORT), await number(connection, WATCH)) == before
        await until(lambda: nmt_state(connection) is NmtState.PRE_OPERATIONAL)


async def test_both_encoders_say_where_the_blade_is(connection: Connection) -> None:
    target = connection.target(AXIS)
    found = await positions(connection.driver(target), target)
    assert found.position_deg == pytest.approx(await angle_deg(connection), abs=0.02)
    assert found.blade_deg == pytest.approx(found.position_deg, abs=0.5)
    pmm = connection.target("wtg-07/blade-1/pmm")
    with pytest.raises(UsageError):
        await positions(connection.driver(pmm), pmm)


async def test_a_jog_moves_while_it_is_held_and_halts_when_let_go(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        page.hold()
        await desk.prepare(AXIS, page.fence)
        start_deg = await angle_deg(connection)
        page.let_go()
        with pytest.raises(NotHeldError):
            await jog(desk, AXIS, page.fence, -4.0, connection.journal)
        assert await angle_deg(connection) == pytest.approx(start_deg, abs=0.05)
        page.hold()
        motion = asyncio.create_task(jog(desk, AXIS, page.fence, -4.0, connection.journal))
        await below(connection, start_deg - 2.0)
        page.let_go()
        await motion
        assert desk.last is not None
        assert desk.last.why is Ended.RELEASED
        rest_deg = await angle_deg(connection)
        assert start_deg - 6.0 < rest_deg < start_deg - 2.0
        assert (await number(connection, STATUS)) & 0x6F in (0x21, 0x40), "without power"
        await asyncio.sleep(0.3)
        assert await angle_deg(connection) == pytest.approx(rest_deg, abs=0.05)


async def test_a_move_reaches_its_angle(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        page.hold()
        await desk.prepare(AXIS, page.fence)
        page.let_go()
        page.hold()
        await move_to(desk, AXIS, page.fence, 77.5, 5.0, connection.journal)
        assert desk.last is not None
        assert desk.last.why is Ended.DONE
        assert await angle_deg(connection) == pytest.approx(77.5, abs=0.2)
        with pytest.raises(LimitError):
            page.let_go()
            page.hold()
            await move_to(desk, AXIS, page.fence, 400.0, 5.0, connection.journal)


async def test_silence_stops_the_axis(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        _, motion = await jogging(connection, desk, page)
        await page.die()
        silent_s = desk.now_s()
        while (await number(connection, STATUS)) & 0x6F == 0x27:  # noqa: ASYNC110  the device has no event for it
            await asyncio.sleep(0.005)
        took_s = desk.now_s() - silent_s
        assert took_s < 0.5
        await motion
        assert desk.last is not None
        assert desk.last.why is Ended.SILENT


async def test_stop_ends_what_is_under_way(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        _, motion = await jogging(connection, desk, page)
        await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
        with contextlib.suppress(OvertakenError):
            await motion
        assert (await number(connection, STATUS)) & 0x6F != 0x27


async def test_feather_while_the_axis_is_tried_is_not_ended_by_it(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        page.hold()
        trying = asyncio.create_task(desk.prepare(AXIS, page.fence))
        async with asyncio.timeout(10.0):
            while (await number(connection, STATUS)) & 0x6F != 0x27:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.01)
        await command_all(connection.axes(), Command.FEATHER, connection.journal, connection.stamper)
        with pytest.raises((OvertakenError, InterlockError)):
            await trying
        async with asyncio.timeout(20.0):
            while await angle_deg(connection) < 89.5:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.05)
        assert motion_line(desk).prepared == ()


async def test_stop_before_the_button_is_heard_of_wins(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        page.hold()
        await desk.prepare(AXIS, page.fence)
        page.let_go()
        start_deg = await angle_deg(connection)
        motion = asyncio.create_task(jog(desk, AXIS, page.fence, -4.0, connection.journal))
        await asyncio.sleep(0.05)  # the order is there, its beat is late
        stop = command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
        stopping = asyncio.create_task(stop)
        await asyncio.sleep(0.02)  # it is on the wire; that the axes obey is told later
        page.hold()
        with pytest.raises(OvertakenError):
            await motion
        await stopping
        assert await angle_deg(connection) == pytest.approx(start_deg, abs=0.05)


async def test_feather_is_not_ended_by_silence(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        _, motion = await jogging(connection, desk, page)
        await command_all(connection.axes(), Command.FEATHER, connection.journal, connection.stamper)
        await page.die()
        with contextlib.suppress(OvertakenError):
            await motion
        assert desk.last is not None
        assert desk.last.why is Ended.STOPPED
        async with asyncio.timeout(20.0):
            while await angle_deg(connection) < 89.5:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.05)


async def test_the_present_position_becomes_an_angle(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        page.hold()
        await desk.prepare(AXIS, page.fence)
        page.let_go()
        before_deg = await angle_deg(connection)
        await home(desk, AXIS, page.fence, 45.0, connection.journal)
        assert before_deg != pytest.approx(45.0, abs=1.0)
        assert await angle_deg(connection) == pytest.approx(45.0, abs=0.05)
        assert (await number(connection, STATUS)) & 0x6F in (0x21, 0x40), "nothing was switched on for it"
        assert desk.last is not None
        assert desk.last.why is Ended.DONE


async def test_a_fault_is_reset_and_nothing_moves_by_it(connection: Connection, served: Served) -> None:
    async with at_the_desk(connection) as (desk, page):
        page.hold()
        await desk.prepare(AXIS, page.fence)
        page.let_go()
        pmc = served.turbine.blades[0].pmc
        served.thread.call_soon(lambda: pmc.raise_error(0x8400))
        async with asyncio.timeout(10.0):
            while (await number(connection, STATUS)) & 0x4F != 0x08:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.02)
            # Its watchdog contact opens the safety chain: the blades go to feather, and only then is there a fault.
            while abs(pmc.drive.plant.speed_rad_s) > 0.1 or await angle_deg(connection) < 89.5:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
            while (await number(connection, STATUS)) & 0x4F != 0x08:  # noqa: ASYNC110
                await asyncio.sleep(0.02)
        rest_deg = await angle_deg(connection)
        assert await reset_fault(desk, AXIS, page.fence, connection.journal) is not AxisState.FAULT
        assert await angle_deg(connection) == pytest.approx(rest_deg, abs=0.1)


async def test_a_clock_that_is_set_changes_nothing(connection: Connection, monkeypatch: pytest.MonkeyPatch) -> None:
    async with at_the_desk(connection) as (desk, page):
        start_deg, motion = await jogging(connection, desk, page)
        hour_ns, wall_ns, wall_s = 3_600_000_000_000, time.time_ns, time.time
        monkeypatch.setattr(time, "time_ns", lambda: wall_ns() + hour_ns)
        monkeypatch.setattr(time, "time", lambda: wall_s() + hour_ns / 1e9)
        await below(connection, start_deg - 4.0)
        assert not motion.done(), "who holds goes on"
        await page.die()
        await motion
        assert desk.last is not None
        assert desk.last.why is Ended.SILENT


@pytest.mark.parametrize(("had", "set_since", "gets"), [(6, None, 6), (0, None, 1), (1, 6, 6)])
async def test_what_a_killed_server_left_is_put_back_by_the_next(
    connection: Connection, had: int, set_since: int | None, gets: int
) -> None:
    """The mode too, but not where somebody has set another one since; who had none gets one that goes nowhere."""
    left = Left()
    target = connection.target(AXIS)
    await connection.driver(target).write(target.node, Address(0x6060), bytes([had]))
    before = await number(connection, ABORT), await number(connection, WATCH)
    killed = MotionDesk(connection, connection.journal, left, SteadyClock())
    page = Page(killed)
    page.open()
    killed.confirm(page.fence, Confirmed(rotor_locked=True, people_out=True))
    page.hold()
    await killed.prepare(AXIS, page.fence)
    await page.die()
    assert killed._ticker is not None
    killed._ticker.cancel()  # it is gone without a word
    assert (await number(connection, ABORT), await number(connection, WATCH)) != before
    after = MotionDesk(connection, connection.journal, left)
    assert motion_line(after).left == (AXIS,)
    if set_since is not None:
        await connection.driver(target).write(target.node, CONTROLWORD, b"\x06\x01")  # no power, bit 3 clear
        await connection.driver(target).write(target.node, Address(0x6060), bytes([set_since]))
    fence = after.take_lease("tester", "next").fence
    await after.put_back(AXIS, fence)
    assert (await number(connection, ABORT), await number(connection, WATCH)) == before
    assert await number(connection, Address(0x6061)) == gets
    await until(lambda: nmt_state(connection) is NmtState.PRE_OPERATIONAL)
    assert motion_line(after).left == ()
    await after.close()


async def test_what_is_put_back_hides_no_stop_from_an_order_that_waits_for_it(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        page.hold()
        prepared = await desk.prepare(AXIS, page.fence)
        prepared.control.own()  # as an order does that waits for its turn
        await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
        await desk.put_back(AXIS, page.fence)
        with pytest.raises(OvertakenError):
            prepared.control.require_own()


async def test_nothing_moves_without_lease_interlocks_and_proof(connection: Connection) -> None:
    async with at_the_desk(connection, confirmed=False) as (desk, page):
        page.hold()
        held_back = {one.interlock for one in await desk.interlocks(AXIS) if one.holds_back}
        assert held_back == {Interlock.ROTOR_LOCKED, Interlock.PEOPLE_OUT}
        with pytest.raises(InterlockError):
            await desk.prepare(AXIS, page.fence)
        with pytest.raises(NotPreparedError):
            await jog(desk, AXIS, page.fence, 1.0, connection.journal)
        with pytest.raises(LeaseError):
            await jog(desk, AXIS, page.fence - 1, 1.0, connection.journal)
        with pytest.raises(LimitError):
            await jog(desk, AXIS, page.fence, 6.0, connection.journal)
