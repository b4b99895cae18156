"""A hydraulic axis on PROFIBUS moves while somebody holds it, and rests without current in its valves else."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path

import pytest

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
from app.service.motion.running import Ended
from app.service.stop import Command, command_all
from app.twins.ed2.states import State
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
