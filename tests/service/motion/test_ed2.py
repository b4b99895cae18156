"""A hydraulic axis on PROFIBUS moves while somebody holds it, and rests without current in its valves else."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path

import pytest

from app.drivers.profibus import WATCHDOG_MS
from app.errors import (
    AxisStateError,
    InterlockError,
    LimitError,
    NotHeldError,
    NotPreparedError,
    OvertakenError,
    UsageError,
)
from app.model.address import Address
from app.service.connection import Connection
from app.service.motion.desk import MotionDesk
from app.service.motion.hydraulic_moves import Way, drive_by_hand, hold, move_to, reset_fault
from app.service.motion.interlocks import Confirmed, Interlock
from app.service.motion.moves import jog
from app.service.motion.operation import take_over
from app.service.motion.running import Ended
from app.service.stop import Command, command_all
from app.twins.ed2.states import State
from app.wire.profibus.telegrams import CONTROL_WORD as _CONTROL
from tests.drivers.profibus_rig import CONTROLWORD, NODE, ip
from tests.service.motion.ed2_rig import AXIS, Cylinders, cylinders, ed2_connection
from tests.service.motion.rig import Page, at_the_desk

pytestmark = pytest.mark.alone  # pages miss each other after fractions of a second

START_MM = 250.0
CREEP = Way(positive=True, rapid=False)
RAPID = Way(positive=True, rapid=True)


@pytest.fixture
def bench() -> Iterator[Cylinders]:
    with cylinders() as one:
        yield one


@pytest.fixture
async def connection(bench: Cylinders, tmp_path: Path) -> AsyncIterator[Connection]:
    async with ed2_connection(bench, tmp_path) as one:
        yield one


async def until(holds: Callable[[], bool], within_s: float = 10.0) -> None:
    """Wait for what the twin itself shows."""
    async with asyncio.timeout(within_s):
        while not holds():  # noqa: ASYNC110  the twin has no event for it
            await asyncio.sleep(0.002)


async def prepared(desk: MotionDesk, page: Page) -> None:
    page.hold()
    await desk.prepare(AXIS, page.fence)
    page.let_go()
    page.hold()


async def driving(bench: Cylinders, desk: MotionDesk, page: Page, way: Way = RAPID) -> asyncio.Task[None]:
    await prepared(desk, page)
    motion = asyncio.create_task(drive_by_hand(desk, AXIS, page.fence, way))
    await until(lambda: bench.places_mm[0] > START_MM + 2.0 or motion.done())
    if motion.done():
        await motion
    return motion


def why(desk: MotionDesk) -> Ended:
    assert desk.last is not None
    return desk.last.why


async def test_manual_control_moves_both_cylinders_while_it_is_held(bench: Cylinders, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        with pytest.raises(NotPreparedError):
            page.hold()
            await drive_by_hand(desk, AXIS, page.fence, CREEP)
        motion = await driving(bench, desk, page, CREEP)
        page.let_go()
        await motion
        assert why(desk) is Ended.RELEASED
        assert bench.state is State.INIT
        first, second = bench.places_mm
        assert first > START_MM
        assert second == pytest.approx(first, abs=1.0)
        with pytest.raises(NotHeldError):
            await drive_by_hand(desk, AXIS, page.fence, CREEP)
        assert bench.number(0, 40) == -2
        await desk.put_back(AXIS, page.fence)
        assert bench.number(0, 40) == 9
        assert not desk.left.devices


async def test_a_move_reaches_its_target_by_the_handshake(bench: Cylinders, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        await move_to(desk, AXIS, page.fence, 260.0, 50.0, connection.journal)
        assert why(desk) is Ended.DONE
        assert bench.places_mm == pytest.approx((260.0, 260.0), abs=1.0)
        assert bench.state is State.INIT
        assert bench.number(12, 61) == 1000, "the commissioned speed stands again"
        for position, speed in ((270.0, 200.0), (270.0, 0.0)):
            page.let_go()
            page.hold()
            with pytest.raises(LimitError):
                await move_to(desk, AXIS, page.fence, position, speed, connection.journal)
        assert bench.places_mm[0] == pytest.approx(260.0, abs=1.0)


async def test_stop_takes_the_current_from_the_valves(bench: Cylinders, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        motion = await driving(bench, desk, page)
        pressed_s = time.monotonic()
        stopping = command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
        stopped = asyncio.create_task(_standstill_s(bench, pressed_s))
        (outcome,) = await stopping
        stands_s = await stopped
        assert outcome.error is None
        assert outcome.confirmed_t_ns is not None
        with contextlib.suppress(OvertakenError):
            await motion
        print(f"STOP: confirmed after {(outcome.confirmed_t_ns - outcome.sent_t_ns) / 1e6:.0f} ms, "
              f"stands after {1000 * stands_s:.0f} ms")  # fmt: skip
        assert stands_s < 0.5
        assert bench.state is State.INIT
        rest = bench.places_mm
        await asyncio.sleep(0.3)  # it would have gone on
        assert bench.places_mm == rest
        assert bench.wired.received[_CONTROL] == 0


async def _standstill_s(bench: Cylinders, since_s: float) -> float:
    await until(lambda: bench.speed_mm_s == 0.0)
    return time.monotonic() - since_s


@pytest.mark.parametrize("how", ["silent", "socket", "lease", "let go"])
async def test_whoever_is_gone_has_stopped_it(bench: Cylinders, connection: Connection, how: str) -> None:
    async with at_the_desk(connection) as (desk, page):
        motion = await driving(bench, desk, page)
        page.beat()
        begun_s = time.monotonic()
        if how == "silent":
            await page.die()
        elif how == "socket":
            desk.page_gone(page.name)
        elif how == "lease":
            desk.give_back_lease(page.fence)
        else:
            page.let_go()
        stands_s = await _standstill_s(bench, begun_s)
        with contextlib.suppress(OvertakenError):
            await motion
        await until(lambda: bench.state is State.INIT)
        print(f"{how}: stands after {1000 * stands_s:.0f} ms")
        assert stands_s < (1.2 if how == "let go" else 0.9)
        wanted = {"silent": Ended.SILENT, "socket": Ended.SILENT, "lease": Ended.LEASE, "let go": Ended.RELEASED}
        assert why(desk) is wanted[how]
        assert bench.wired.received[_CONTROL] == 0


@pytest.mark.parametrize("sign", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "held"])
async def test_without_us_the_watchdog_of_the_slave_stops_it(
    bench: Cylinders, tmp_path: Path, sign: signal.Signals
) -> None:
    """By PROFIBUS-DP a slave that hears nothing of its master for its watchdog time leaves Data_Exchange."""
    wired = bench.wired
    command = (sys.executable, "-m", "tests.service.motion.ed2_driver", wired.line.path, str(wired.baud), str(tmp_path))
    process = await asyncio.create_subprocess_exec(*command)
    try:
        await until(lambda: bench.places_mm[0] > START_MM + 2.0, 30.0)
        process.send_signal(sign)
        stands_s = await _standstill_s(bench, time.monotonic())
        print(f"{sign.name}: stands after {1000 * stands_s:.0f} ms")
        assert stands_s < WATCHDOG_MS / 1000 + 0.6
        assert bench.state is State.INIT
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()


@pytest.mark.parametrize("steps", range(1, 8))
async def test_whenever_it_is_let_go_it_comes_to_rest_without_current(
    bench: Cylinders, connection: Connection, steps: int
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
            await move_to(desk, AXIS, page.fence, 450.0, 20.0, connection.journal)
        assert said >= min(steps, 3)
        if steps <= 5:
            assert why(desk) is Ended.RELEASED
        await until(lambda: bench.state is State.INIT and bench.speed_mm_s == 0.0)
        rest = bench.places_mm
        await asyncio.sleep(0.2)  # it would have gone on
        assert bench.places_mm == rest


async def test_an_axis_is_held_where_it_stands(bench: Cylinders, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        holding = asyncio.create_task(hold(desk, AXIS, page.fence))
        await until(lambda: bench.state is State.HOLD)
        assert bench.places_mm[0] == pytest.approx(START_MM, abs=0.5)
        page.let_go()
        await holding
        assert why(desk) is Ended.RELEASED
        assert bench.state is State.INIT


async def test_no_bit_of_the_controlword_before_the_order_is_proven(bench: Cylinders, tmp_path: Path) -> None:
    """Telegram 1 tells nothing but 250.000 mm and the statusword: the order of words stays open without the setting."""
    async with (
        ed2_connection(bench, tmp_path, ', pzd_order = "low-low"') as connection,
        at_the_desk(connection) as (
            desk,
            page,
        ),
    ):
        (order,) = [one for one in await desk.interlocks(AXIS) if one.interlock is Interlock.ORDER]
        assert order.holds_back
        assert order.details["why_key"] == "profibus.order.setting"
        page.hold()
        with pytest.raises(InterlockError) as refused:
            await desk.prepare(AXIS, page.fence)
        assert refused.value.details["interlock"] == "pzd_order"
        assert bench.state is State.INIT
        assert not bench.wired.received.get(_CONTROL)


async def test_a_real_device_needs_a_stop_by_hand_that_an_expert_answers_for(bench: Cylinders, tmp_path: Path) -> None:
    more = ', pzd_order = "high-high", external_stop = "red button at the bench"'
    bench.wired.do(lambda: setattr(bench.wired.device.slave, "ident", 0x1234))  # that of no twin of ours
    async with ed2_connection(bench, tmp_path, more) as connection, at_the_desk(connection) as (desk, page):
        page.hold()
        with pytest.raises(InterlockError) as refused:
            await desk.prepare(AXIS, page.fence)
        assert refused.value.details["interlock"] == "self_stop"
        desk.confirm(page.fence, Confirmed(people_out=True, external_stops=frozenset({AXIS})))
        page.let_go()
        page.hold()
        await desk.prepare(AXIS, page.fence)
        assert desk.prepared[AXIS].unwatched


async def test_a_travel_window_without_a_way_is_never_enabled(bench: Cylinders, connection: Connection) -> None:
    """Where nobody has told of it, it is found as the axis is enabled; from then on a rule holds the axis back."""
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        bench.wired.do(lambda: bench.wired.device.channels[0].put(1, 106, 1))
        for order, interlock in (
            (drive_by_hand(desk, AXIS, page.fence, CREEP), "travel_window"),
            (hold(desk, AXIS, page.fence), "rules"),
        ):
            page.let_go()
            page.hold()
            with pytest.raises(InterlockError) as refused:
                await order
            assert refused.value.details["interlock"] == interlock
            assert bench.state in (State.INIT, State.DISABLED)
        assert bench.places_mm[0] == pytest.approx(START_MM, abs=0.1)


async def test_manual_control_ends_before_the_limits_of_travel(bench: Cylinders, connection: Connection) -> None:
    driver = connection.driver(connection.target(AXIS))
    await driver.write(NODE, ip(1, 106), b"\x01")
    await driver.write(NODE, ip(1, 100), (2000).to_bytes(4, "little"))
    await driver.write(NODE, ip(1, 101), (2800).to_bytes(4, "little"))
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        await drive_by_hand(desk, AXIS, page.fence, RAPID)
        assert why(desk) is Ended.LIMIT
        assert 255.0 < bench.places_mm[0] <= 280.5
        page.let_go()
        page.hold()
        with pytest.raises(LimitError):
            await move_to(desk, AXIS, page.fence, 281.0, 50.0, connection.journal)


async def test_local_operation_and_commands_of_other_axes_are_refused(bench: Cylinders, connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await prepared(desk, page)
        with pytest.raises(UsageError):
            await jog(desk, AXIS, page.fence, 1.0, connection.journal)
        driver = connection.driver(connection.target(AXIS))
        await driver.write(NODE, ip(0, 41), b"\x01")
        page.let_go()
        page.hold()
        with pytest.raises(AxisStateError):
            await drive_by_hand(desk, AXIS, page.fence, CREEP)
        assert bench.state is State.INIT


async def test_a_fault_ends_the_motion_and_is_reset(bench: Cylinders, connection: Connection) -> None:
    axis = bench.wired.device.kernel.axes[0]
    async with at_the_desk(connection) as (desk, page):
        motion = await driving(bench, desk, page, CREEP)
        bench.wired.do(lambda: setattr(axis.transducer.wire, "broken", True))
        await motion
        assert why(desk) is Ended.STOPPED
        assert bench.state is State.FAULT
        bench.wired.do(lambda: setattr(axis.transducer.wire, "broken", False))
        page.let_go()
        await reset_fault(desk, AXIS, page.fence, connection.journal)
        await until(lambda: bench.state is State.INIT)
        assert bench.wired.received[_CONTROL] == 0


async def test_operation_is_changed_in_legal_order_and_without_power(bench: Cylinders, connection: Connection) -> None:
    driver = connection.driver(connection.target(AXIS))
    await driver.write(NODE, ip(0, 41), b"\x01")
    await until(lambda: bench.number(0, 39) == 2)
    async with at_the_desk(connection) as (desk, page):
        await take_over(desk, AXIS, page.fence, single=True, aligned=False, journal=connection.journal)
        assert [bench.number(0, pnu) for pnu in (41, 39, 53)] == [0, 1, 1]
        with pytest.raises(InterlockError) as refused:
            await take_over(desk, AXIS, page.fence, single=False, aligned=False, journal=connection.journal)
        assert refused.value.details["interlock"] == "aligned"
        assert bench.number(0, 53) == 1
        await take_over(desk, AXIS, page.fence, single=False, aligned=True, journal=connection.journal)
        assert bench.number(0, 53) == 0
        await prepared(desk, page)
        holding = asyncio.create_task(hold(desk, AXIS, page.fence))
        await until(lambda: bench.state is State.HOLD)
        with pytest.raises(InterlockError):
            await take_over(desk, AXIS, page.fence, single=True, aligned=False, journal=connection.journal)
        page.let_go()
        await holding
