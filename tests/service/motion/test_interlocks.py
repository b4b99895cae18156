"""Every interlock bites before a motion and while it goes on; nobody else changes what a motion rests on."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

import pytest

from app.drivers.can_config import parse_can
from app.drivers.can_port import CanPort
from app.errors import DeviceBusyError, InterlockError, LeaseHeldError, NotHeldError
from app.model.address import Address
from app.service.backup import read_device, to_set, whole_sets
from app.service.claims import Work
from app.service.connection import Connection
from app.service.gate import Block
from app.service.motion.brake_test import try_brake
from app.service.motion.desk import MotionDesk
from app.service.motion.interlocks import POSITION, Confirmed, Interlock
from app.service.motion.left import Changed
from app.service.motion.moves import jog
from app.service.motion.running import Ended
from app.service.save import restart, save
from app.service.write import write_raw
from app.wire.frame import Can, Stamper
from tests.e2e.test_interoperation import until
from tests.service.conftest import Served
from tests.service.motion.rig import AXIS, Page, angle_deg, at_the_desk, number

pytestmark = [pytest.mark.alone, pytest.mark.timeout(120)]  # drives and pages miss each other soon

OTHER = "wtg-07/blade-2/pmc"
ABORT, WATCH, GAIN, RAMP = Address(0x6007), Address(0x1016, 1), Address(0x60FB, 1), Address(0x6083)
HEARTBEAT_NODE = 126


@asynccontextmanager
async def moving(connection: Connection) -> AsyncIterator[tuple[MotionDesk, Page, asyncio.Task[None]]]:
    """A jog that is under way, far from its end."""
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        page.hold()
        start_deg = await angle_deg(connection)
        motion = asyncio.create_task(jog(desk, AXIS, page.fence, -2.0, connection.journal))
        async with asyncio.timeout(10.0):
            while await angle_deg(connection) > start_deg - 0.5:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.02)
        yield desk, page, motion
        page.let_go()
        await asyncio.wait({motion})


async def prepared(desk: MotionDesk, page: Page) -> None:
    page.hold()
    await desk.prepare(AXIS, page.fence)
    page.let_go()


@asynccontextmanager
async def stranger(served: Served, frame: Can, every_s: float = 0.1) -> AsyncIterator[None]:
    """Somebody else on the bus, who sends the same frame again and again."""
    port = CanPort(parse_can(served.address), "other", Stamper(0, time.monotonic_ns))

    def send() -> None:
        port.send(frame)
        port.call_later(every_s, send)

    await asyncio.to_thread(port.open, 3.0)
    try:
        send()
        yield
    finally:
        await asyncio.to_thread(port.close)


# -- before a motion -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """How an interlock is brought to bite, within ``alone`` where it needs somebody else."""

    interlock: Interlock
    bring: Callable[[Served, Connection], Awaitable[None]] | None = None
    frame: Can | None = None


async def _turn_the_other(served: Served, connection: Connection, angle_deg: float) -> None:
    plant = served.turbine.blades[1].pmc.drive.plant
    served.thread.call_soon(lambda: plant.place(angle_deg))
    target = connection.target(OTHER)
    async with asyncio.timeout(5.0):
        while await number(connection, POSITION, target.slug) != pytest.approx(100 * angle_deg, abs=100):  # noqa: ASYNC110  no event
            await asyncio.sleep(0.02)


async def _out_of_feather(served: Served, connection: Connection) -> None:
    await _turn_the_other(served, connection, 60.0)


async def _beyond_feather(served: Served, connection: Connection) -> None:
    await _turn_the_other(served, connection, 200.0)


async def _without_gain(served: Served, connection: Connection) -> None:
    target = connection.target(AXIS)
    await connection.driver(target).write(target.node, GAIN, b"\0\0")
    await connection.driver(target).read(target.node, GAIN)


async def _restore_open(served: Served, connection: Connection) -> None:
    connection.gate.blocks.put([Block("r1", "wtg-07/blade-1", ())])


async def _recording_ended(served: Served, connection: Connection) -> None:
    assert connection.recording is not None
    await asyncio.to_thread(connection.recording.stop)


async def _cable_out(served: Served, connection: Connection) -> None:
    await asyncio.to_thread(served.server.stop)
    await until(lambda: connection.buses["can0"].status.state.value == "lost")


WAYS = (
    Way(Interlock.OTHERS_FEATHERED, _out_of_feather),
    Way(Interlock.OTHERS_FEATHERED, _beyond_feather),
    Way(Interlock.RULES, _without_gain),
    Way(Interlock.NO_RESTORE, _restore_open),
    Way(Interlock.RECORDING, _recording_ended),
    Way(Interlock.CONNECTED, _cable_out),
    Way(Interlock.NO_MASTER, frame=Can(0x080)),
    Way(Interlock.HEARTBEAT_NODE, frame=Can(0x700 + HEARTBEAT_NODE, b"\x05")),
)
NAMES = [f"{way.interlock.value}{number}" for number, way in enumerate(WAYS)]


@pytest.mark.parametrize("way", WAYS, ids=NAMES)
async def test_each_bites_and_is_seen_before(way: Way, served: Served, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        assert not any(one.holds_back for one in await desk.interlocks(AXIS)), "nothing bites to begin with"
        if way.bring is not None:
            await way.bring(served, connection)
            await _bites(desk, page, way.interlock)
        else:
            assert way.frame is not None
            async with stranger(served, way.frame):
                await _bites(desk, page, way.interlock)


async def test_a_restore_that_has_the_axis_holds_it_back(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        with connection.gate.claims.held(Work.RESTORE, "ben", (AXIS,)):
            await _bites(desk, page, Interlock.NO_RESTORE)


async def _bites(desk: MotionDesk, page: Page, interlock: Interlock) -> None:
    async with asyncio.timeout(10.0):
        while interlock not in await _held_back_by(desk):  # noqa: ASYNC110  the live state has no event for it
            await asyncio.sleep(0.05)
    page.hold()
    with pytest.raises(InterlockError) as caught:
        await desk.prepare(AXIS, page.fence)
    assert caught.value.details["interlock"] in {one.value for one in await _held_back_by(desk)}
    assert desk.prepared == {}


async def _held_back_by(desk: MotionDesk) -> set[Interlock]:
    return {one.interlock for one in await desk.interlocks(AXIS) if one.holds_back}


# -- while it goes on ----------------------------------------------------------------------------


@pytest.mark.parametrize("bring", [_out_of_feather, _recording_ended], ids=["a blade leaves feather", "no recording"])
async def test_what_bites_while_it_moves_stops_it(
    bring: Callable[[Served, Connection], Awaitable[None]], served: Served, connection: Connection
) -> None:
    async with moving(connection) as (desk, _, motion):
        await bring(served, connection)
        await asyncio.wait_for(motion, 5.0)
        assert desk.last is not None and desk.last.why is Ended.INTERLOCK
        await _stands(connection)


async def test_a_stranger_with_our_heartbeat_number_stops_it(served: Served, connection: Connection) -> None:
    async with moving(connection) as (desk, _, motion):
        async with stranger(served, Can(0x700 + HEARTBEAT_NODE, b"\x05")):
            await asyncio.wait_for(motion, 5.0)
        assert desk.last is not None and desk.last.why is Ended.INTERLOCK
        await _stands(connection)


async def test_who_takes_back_that_nobody_is_there_stops_it(connection: Connection) -> None:
    async with moving(connection) as (desk, page, motion):
        desk.confirm(page.fence, Confirmed(rotor_locked=True, people_out=False))
        await asyncio.wait_for(motion, 5.0)
        assert desk.last is not None and desk.last.why is Ended.INTERLOCK
        await _stands(connection)


async def _stands(connection: Connection) -> None:
    async with asyncio.timeout(10.0):
        while await number(connection, Address(0x6041)) & 0x6F == 0x27:  # noqa: ASYNC110  no event for it
            await asyncio.sleep(0.02)


# -- what others are kept from ---------------------------------------------------------------------


async def test_nobody_writes_saves_or_restarts_an_axis_that_moves(connection: Connection) -> None:
    target, journal = connection.target(AXIS), connection.journal
    driver = connection.driver(target)
    async with moving(connection) as (desk, page, motion):
        for work in (
            write_raw(driver, target, WATCH, 0, journal),
            write_raw(driver, target, ABORT, 0, journal),
            write_raw(driver, target, RAMP, 100, journal),
            save(driver, target, journal, connection.stamper),
            restart(driver, target, journal, connection.stamper),
        ):
            with pytest.raises(DeviceBusyError) as caught:
                await work
            assert caught.value.details["person"] == "tester"
        with pytest.raises(DeviceBusyError), connection.gate.claims.held(Work.RESTORE, "ben", (AXIS,)):
            pass
        assert not motion.done()
        page.let_go()
        await motion
        assert desk.last is not None and desk.last.why is Ended.RELEASED


async def test_what_the_proof_rests_on_stays_while_it_is_prepared_and_all_else_may_be_tuned(
    connection: Connection,
) -> None:
    target, journal = connection.target(AXIS), connection.journal
    driver = connection.driver(target)
    before = await number(connection, ABORT)
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        for work in (
            write_raw(driver, target, WATCH, 0, journal),
            write_raw(driver, target, ABORT, 0, journal),
            save(driver, target, journal, connection.stamper),
            restart(driver, target, journal, connection.stamper),
        ):
            with pytest.raises(DeviceBusyError):
                await work
        written = await write_raw(driver, target, RAMP, 1400, journal)
        assert written.read == 1400
        assert await number(connection, ABORT) == 3
        read = await read_device(driver, target, [ABORT, WATCH, RAMP])
        assert to_set(read, "wtg-07", "tester", "", 0).values[ABORT] == 3, "what a restore goes by is what stands there"
        (found,) = whole_sets([read], "wtg-07", "tester", "", 0)
        assert found.values[ABORT] == before != 3, "a set that is kept holds what stands there otherwise"
        assert found.values[RAMP] == 1400
        await desk.put_back(AXIS, page.fence)
        await save(driver, target, journal, connection.stamper)


async def test_what_an_earlier_server_left_is_not_saved_and_a_restart_ends_it(connection: Connection) -> None:
    target, journal = connection.target(AXIS), connection.journal
    driver = connection.driver(target)
    async with at_the_desk(connection) as (desk, _):
        await desk.left.note(AXIS, ABORT, Changed(b"\x01\x00", b"\x03\x00"))
        with pytest.raises(DeviceBusyError):
            await save(driver, target, journal, connection.stamper)
        with connection.gate.claims.held(Work.RESTORE, "ben", (AXIS,)):
            pass
        (found,) = whole_sets([await read_device(driver, target, [ABORT])], "wtg-07", "tester", "", 0)
        assert found.values[ABORT] == await number(connection, ABORT) == 1, "nobody has written it"
        await restart(driver, target, journal, connection.stamper)


async def test_another_person_does_not_get_the_lease_by_the_name_of_its_page(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        with pytest.raises(LeaseHeldError):
            desk.take_lease("ben", page.name)
        assert desk.take_lease("tester", page.name).fence == page.fence


async def test_a_beat_for_another_order_holds_nothing(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        page.hold()
        desk.admit(page.fence, 7)
        before_deg = await angle_deg(connection)
        with pytest.raises(NotHeldError):
            await jog(desk, AXIS, page.fence, -2.0, connection.journal)
        assert await angle_deg(connection) == pytest.approx(before_deg, abs=0.05)


async def test_a_fault_in_the_middle_says_nothing_of_the_brake(served: Served, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        page.hold()
        trying = asyncio.create_task(try_brake(desk, AXIS, page.fence, connection.journal))
        await until(lambda: desk.running is not None and desk.running.turning)
        served.thread.call_soon(lambda: served.turbine.blades[0].pmc.raise_error(0x4310))
        found = await trying
        assert found.verdict is None
        assert desk.last is not None and desk.last.why is Ended.STOPPED
