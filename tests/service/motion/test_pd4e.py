"""A drive on a bus without PDOs and heartbeats moves while somebody holds it, where it is a twin or answered for."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from app.drivers.contract import LinkState
from app.errors import (
    AxisStateError,
    BusLostError,
    InterlockError,
    LimitError,
    NotHeldError,
    NotPreparedError,
    OvertakenError,
    UsageError,
)
from app.model.address import Address
from app.model.axis_state import AxisState
from app.service.connection import Connection
from app.service.journal import Kind
from app.service.motion.desk import MotionDesk
from app.service.motion.homing import search_home
from app.service.motion.interlocks import Confirmed, Interlock
from app.service.motion.line import motion_line
from app.service.motion.moves import hold, home, jog, move_to, reset_fault
from app.service.motion.running import Ended
from app.service.stop import CONTROLWORD, Command, command_all
from app.wire.frame import Adu, Direction, Frame
from app.wire.modbus.adu import decode_adu
from app.wire.modbus.requests import ReadDictionary, WriteObject, decode_request
from tests.service.motion.pd4e_rig import AXIS, Bench, bench_connection, served
from tests.service.motion.rig import Page, at_the_desk

pytestmark = pytest.mark.alone  # pages miss each other after fractions of a second

STATUS, MODE, METHOD, POSITION = 0x6041, 0x6060, 0x6098, 0x6064
EXTERNAL = 'external_stop = "red button at the bench"'
JOG_RPM = 60.0
ENABLED = AxisState.OPERATION_ENABLED


@pytest.fixture
def bench() -> Iterator[Bench]:
    with served() as one:
        yield one


@pytest.fixture
async def connection(bench: Bench, tmp_path: Path) -> AsyncIterator[Connection]:
    async with bench_connection(bench, tmp_path) as one:
        yield one


def state(bench: Bench) -> AxisState | None:
    return AxisState.of(bench.witness(STATUS, size=2, signed=False))


def degrees(bench: Bench) -> float:
    return bench.witness(POSITION) / 10


async def until_state(bench: Bench, wanted: AxisState) -> None:
    async with asyncio.timeout(10.0):
        while await asyncio.to_thread(state, bench) is not wanted:
            pass


async def beyond(bench: Bench, wanted_deg: float) -> None:
    async with asyncio.timeout(10.0):
        while await asyncio.to_thread(degrees, bench) < wanted_deg:
            pass


async def prepared(desk: MotionDesk, page: Page) -> None:
    page.hold()
    await desk.prepare(AXIS, page.fence)
    page.let_go()
    page.hold()


async def jogging(bench: Bench, connection: Connection, desk: MotionDesk, page: Page) -> asyncio.Task[None]:
    await prepared(desk, page)
    motion = asyncio.create_task(jog(desk, AXIS, page.fence, JOG_RPM, connection.journal))
    await beyond(bench, 20.0)
    return motion


def why(desk: MotionDesk) -> Ended:
    assert desk.last is not None
    return desk.last.why


async def test_a_jog_moves_while_it_is_held_and_the_mode_comes_back(bench: Bench, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        with pytest.raises(NotPreparedError):
            page.hold()
            await jog(desk, AXIS, page.fence, JOG_RPM, connection.journal)
        motion = await jogging(bench, connection, desk, page)
        (line,) = motion_line(desk).prepared
        assert (line.device, line.proof_ms) == (AXIS, None), "it has proven nothing"
        assert desk.left.devices == (AXIS,)
        page.let_go()
        await motion
        assert why(desk) is Ended.RELEASED
        rest = bench.witness(POSITION)
        assert state(bench) is AxisState.READY
        with pytest.raises(NotHeldError):
            await jog(desk, AXIS, page.fence, JOG_RPM, connection.journal)
        assert bench.witness(POSITION) == rest
        assert bench.witness(MODE, size=1) == 3
        await desk.put_back(AXIS, page.fence)
        assert bench.witness(MODE, size=1) == 0, "it had none"
        assert not desk.left.devices


async def test_a_move_reaches_its_target_in_the_units_of_the_drive(bench: Bench, connection: Connection) -> None:
    target = connection.target(AXIS)
    for sub, limit in ((1, -3600), (2, 3600)):
        await connection.driver(target).write(1, Address(0x607D, sub), limit.to_bytes(4, "little", signed=True))
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        await move_to(desk, AXIS, page.fence, 90.5, 120.0, connection.journal)
        assert why(desk) is Ended.DONE
        assert bench.witness(POSITION) == pytest.approx(905, abs=10)
        assert bench.witness(0x6081) == 120
        for position, speed in ((400.0, 60.0), (90.0, 40_000.0), (90.0, 0.0)):
            page.let_go()
            page.hold()
            with pytest.raises(LimitError):
                await move_to(desk, AXIS, page.fence, position, speed, connection.journal)
        page.let_go()
        page.hold()
        await jog(desk, AXIS, page.fence, 240.0, connection.journal)
        assert why(desk) is Ended.LIMIT
        assert 90 < degrees(bench) <= 360


async def test_silence_stops_it(bench: Bench, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        motion = await jogging(bench, connection, desk, page)
        page.beat()
        silent_s = time.monotonic()
        await page.die()
        while await asyncio.to_thread(state, bench) is ENABLED:
            pass
        assert time.monotonic() - silent_s < 0.5
        await motion
        assert why(desk) is Ended.SILENT


async def test_stop_wins_over_what_the_motion_would_still_send(bench: Bench, connection: Connection) -> None:
    """With 605Ah = 6 the drive stays in Quick stop active, from where a controlword could take it on."""
    target = connection.target(AXIS)
    await connection.driver(target).write(1, Address(0x605A), (6).to_bytes(2, "little"))
    async with at_the_desk(connection) as (desk, page):
        motion = await jogging(bench, connection, desk, page)
        (outcome,) = await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
        assert outcome.confirmed_t_ns is not None
        page.let_go()
        with contextlib.suppress(OvertakenError):
            await motion
        assert state(bench) is AxisState.QUICK_STOP_ACTIVE
        assert bench.witness(0x6040, size=2) == Command.STOP.value


@pytest.mark.parametrize("steps", range(1, 8))
async def test_whenever_it_is_let_go_it_comes_to_rest_without_power(
    bench: Bench, connection: Connection, steps: int
) -> None:
    """Let go after each controlword of the way, in turn: none that comes later runs it."""
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        driver = connection.driver(connection.target(AXIS))
        write, said = driver.write, 0

        async def counted(node: int, address: Address, *rest: object, **more: object) -> object:
            nonlocal said
            if address == CONTROLWORD and (said := said + 1) == steps:
                page.let_go()
            return await write(node, address, *rest, **more)

        driver.write = counted
        with contextlib.suppress(NotHeldError):
            await move_to(desk, AXIS, page.fence, 3600.0, 60.0, connection.journal)
        assert said >= min(steps, 4)
        assert why(desk) is Ended.RELEASED
        assert state(bench) in (AxisState.READY, AxisState.SWITCH_ON_DISABLED)
        rest = bench.witness(POSITION)
        await asyncio.sleep(0.1)  # it would have gone on
        assert bench.witness(POSITION) == rest


async def test_a_drive_that_is_no_twin_needs_a_stop_by_hand_that_an_expert_answers_for(tmp_path: Path) -> None:
    with served(real=True) as bench:
        async with bench_connection(bench, tmp_path / "a") as without, at_the_desk(without) as (desk, page):
            stands = {one.interlock: one for one in await desk.interlocks(AXIS)}
            assert stands[Interlock.SELF_STOP].holds_back
            assert Interlock.ROTOR_LOCKED not in stands
            assert Interlock.NO_MASTER not in stands, "over TCP no other master can be seen"
            with pytest.raises(InterlockError) as found:
                await prepared(desk, page)
            assert found.value.details["interlock"] == "self_stop"
            with pytest.raises(UsageError):
                desk.confirm(page.fence, Confirmed(people_out=True, external_stops=frozenset({AXIS})))
        async with bench_connection(bench, tmp_path / "b", EXTERNAL) as named, at_the_desk(named) as (desk, page):
            with pytest.raises(InterlockError):
                await prepared(desk, page)
            page.let_go()
            desk.confirm(page.fence, Confirmed(people_out=True, external_stops=frozenset({AXIS})))
            motion = await jogging(bench, named, desk, page)
            page.let_go()
            await motion
            assert why(desk) is Ended.RELEASED
            desk.give_back_lease(page.fence)
            again = Page(desk, name="another page")
            assert desk.confirmed.external_stops == frozenset(), "for one lease"
            assert again.fence != page.fence


async def test_nobody_near_it_is_to_be_confirmed_first(connection: Connection) -> None:
    async with at_the_desk(connection, confirmed=False) as (desk, page):
        with pytest.raises(InterlockError) as found:
            await prepared(desk, page)
        assert found.value.details["interlock"] == "zone_clear"


async def test_a_lost_connection_ends_the_motion_and_stops_the_drive_once_it_is_back(
    bench: Bench, connection: Connection
) -> None:
    async with at_the_desk(connection) as (desk, page):
        motion = await jogging(bench, connection, desk, page)
        bench.cut()
        with contextlib.suppress(BusLostError):
            await motion
        assert why(desk) is Ended.LINK
        assert motion_line(desk).prepared == ()
        assert any(one.kind is Kind.MOTION_LOST for one in connection.journal.latest())
        await until_state(bench, AxisState.SWITCH_ON_DISABLED)
        assert connection.buses["lan"].status.state is LinkState.CONNECTED
        page.let_go()
        page.hold()
        with pytest.raises(NotPreparedError):
            await jog(desk, AXIS, page.fence, JOG_RPM, connection.journal)


async def test_homing_by_methods_of_the_drive(bench: Bench, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        motion = await jogging(bench, connection, desk, page)
        page.let_go()
        await motion
        page.hold()
        assert await search_home(desk, AXIS, page.fence, 35, connection.journal) == pytest.approx(0.0, abs=0.2)
        assert why(desk) is Ended.DONE
        assert abs(bench.witness(POSITION)) <= 2
        page.let_go()
        page.hold()
        assert await search_home(desk, AXIS, page.fence, 33, connection.journal) == pytest.approx(0.0, abs=2.0)
        assert bench.witness(METHOD, size=1) == 35, "what stood there"
        page.let_go()
        page.hold()
        with pytest.raises(UsageError):
            await search_home(desk, AXIS, page.fence, 36, connection.journal)
        with pytest.raises(UsageError):
            await home(desk, AXIS, page.fence, 90.0, connection.journal)
        searching = asyncio.create_task(search_home(desk, AXIS, page.fence, 17, connection.journal))
        await until_state(bench, ENABLED)
        page.let_go()
        await searching
        assert why(desk) is Ended.RELEASED
        assert state(bench) is AxisState.READY


async def test_a_fault_is_reset(bench: Bench, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        holding = asyncio.create_task(hold(desk, AXIS, page.fence))
        await until_state(bench, ENABLED)
        bench.on_thread(lambda: setattr(bench.device.drive.conditions, "supply_mv", 60_000))
        await until_state(bench, AxisState.FAULT)
        with contextlib.suppress(AxisStateError):
            await holding
        page.let_go()
        found = await reset_fault(desk, AXIS, page.fence, connection.journal)
        assert found is AxisState.FAULT, "its cause still stands"
        bench.on_thread(lambda: setattr(bench.device.drive.conditions, "supply_mv", 48_000))
        assert await reset_fault(desk, AXIS, page.fence, connection.journal) is not AxisState.FAULT
        assert state(bench) in (AxisState.READY, AxisState.SWITCH_ON_DISABLED)


class OnTheWire:
    """When the controlword left for the drive, by the frames of its bus."""

    def __init__(self, connection: Connection) -> None:
        self.words: list[tuple[float, int]] = []
        self.dictionary = 0
        self._end = connection.driver(connection.target(AXIS)).subscribe(self._heard)

    def close(self) -> None:
        self._end()

    def _heard(self, frames: list[Frame]) -> None:
        for frame in frames:
            if frame.direction is not Direction.TX or not isinstance(frame.payload, Adu):
                continue
            request = decode_request(decode_adu(frame.payload.data).pdu)
            self.dictionary += isinstance(request, ReadDictionary)
            if isinstance(request, WriteObject) and request.address == CONTROLWORD:
                self.words.append((time.monotonic(), int.from_bytes(request.data, "little")))


@asynccontextmanager
async def backed_up(connection: Connection) -> AsyncIterator[OnTheWire]:
    """The whole dictionary is read by FC 101 all the while, over and over."""
    wire, target = OnTheWire(connection), connection.target(AXIS)

    async def forever() -> None:
        while True:
            await connection.driver(target).backup(target.node)

    reading = asyncio.create_task(forever())
    try:
        yield wire
    finally:
        reading.cancel()
        await asyncio.gather(reading, return_exceptions=True)
        wire.close()


async def test_stop_leaves_at_once_beside_a_backup(connection: Connection) -> None:
    """100 presses at times of no rhythm; the worst but one within 50 ms."""
    took_ms = []
    async with backed_up(connection) as wire:
        for press in range(100):
            await asyncio.sleep(0.01 + (press * 37 % 23) / 1000)
            pressed_s = time.monotonic()
            await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
            left_s = next(at_s for at_s, word in wire.words if word == Command.STOP.value and at_s >= pressed_s)
            took_ms.append(1000 * (left_s - pressed_s))
        assert wire.dictionary > 100, "the backup went on"
    took_ms.sort()
    print(f"STOP to the wire: median {took_ms[50]:.1f} ms, p99 {took_ms[98]:.1f} ms, worst {took_ms[99]:.1f} ms")
    assert took_ms[98] <= 50


@pytest.mark.parametrize("how", ["let go", "silent", "socket closed", "lease given back"])
async def test_how_soon_the_word_that_ends_it_leaves_beside_a_backup(
    bench: Bench, connection: Connection, how: str
) -> None:
    """From the last beat on: let go at once, silence within 500 ms."""
    async with at_the_desk(connection) as (desk, page):
        motion = await jogging(bench, connection, desk, page)
        async with backed_up(connection) as wire:
            await asyncio.sleep(0.2)
            page.beat()
            began_s = time.monotonic()
            if how == "let go":
                page.let_go()
            elif how == "silent":
                await page.die()
            elif how == "socket closed":
                desk.page_gone(page.name)
            else:
                desk.give_back_lease(page.fence)
            await motion
        wanted, within_s = (0x010F, 0.1) if how == "let go" else (0x010B, 0.5 if how == "silent" else 0.1)
        left_s = next(at_s for at_s, word in wire.words if at_s >= began_s and word == wanted) - began_s
        print(f"{how}: {1000 * left_s:.1f} ms")
        assert left_s < within_s
