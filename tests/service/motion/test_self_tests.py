"""An axis does not move while its unit tests the battery or the inputs, and no battery is tested while one moves."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest

from app.errors import BatteryConditionError, InterlockError
from app.model.texts import error_text, load_texts
from app.service.battery.conditions import Condition
from app.service.battery.objects import TEST_STATUS, TestStatus, read_number
from app.service.connection import Connection
from app.service.devices import Target
from app.service.motion import interlocks
from app.service.motion.desk import MotionDesk
from app.service.motion.interlocks import Interlock, Standing
from app.service.motion.moves import jog
from app.service.motion.self_tests import Testing, Tests, battery, look_at_tests, pulsed
from app.store.store import Store
from app.twins.line import Fault, drop
from tests.e2e.test_interoperation import until
from tests.service.battery.rig import COMMAND_TEST, NODE, at_the_batteries, charged, in_plant, witness
from tests.service.conftest import Served
from tests.service.motion.rig import AXIS, Page, angle_deg, at_the_desk

pytestmark = [pytest.mark.alone, pytest.mark.timeout(120)]  # twins in real time

HEALTHY = 1 << 0 | 1 << 2 | 1 << 3
PULSE_NS, SHOWN_S = 30_000_000, 2.0
SHOWN = {1: 1 << 16, 2: 1 << 18, 3: 1 << 19}
OTHER_AXIS = "wtg-07/blade-2/pmc"


@pytest.fixture
def store() -> Iterator[Store]:
    opened = Store.in_memory()
    yield opened
    opened.close()


@pytest.mark.parametrize("at_rest", [0, sum(SHOWN.values())], ids=["a pulse sets the bit", "a pulse clears the bit"])
def test_a_test_pulse_is_seen_whatever_level_shows_it(at_rest: int) -> None:
    assert pulsed(HEALTHY | at_rest) == ()
    assert pulsed(HEALTHY | at_rest ^ SHOWN[1]) == ("X13.10",)
    assert pulsed(HEALTHY | at_rest ^ SHOWN[2]) == ("X13.8",)
    assert pulsed(HEALTHY | at_rest ^ SHOWN[3]) == ("X13.7",)
    assert pulsed(HEALTHY & ~(1 << 3) | at_rest ^ SHOWN[1]) == ("X13.10", "X13.8"), "which of two, nobody knows"
    assert pulsed(at_rest ^ SHOWN[1]) == (), "the chain is open: nothing is tested"
    assert pulsed(None) is None


def test_a_battery_test_is_seen_by_the_status_of_the_unit() -> None:
    said = {None: Testing.UNKNOWN, 0: Testing.NO, TestStatus.OK | TestStatus.FINISHED: Testing.NO}
    said |= {TestStatus.STARTED: Testing.ARMED, TestStatus.ACTIVE: Testing.YES, TestStatus.IMPOSSIBLE: Testing.NO}
    assert {status: battery(status) for status in said} == said


async def standing(desk: MotionDesk, interlock: Interlock, slug: str = AXIS) -> Standing:
    return next(one for one in await desk.interlocks(slug) if one.interlock is interlock)


async def cleared(desk: MotionDesk, interlock: Interlock, within_s: float) -> None:
    async with asyncio.timeout(within_s):
        while (await standing(desk, interlock)).holds_back:  # noqa: ASYNC110  a device tells no event
            await asyncio.sleep(0.05)


async def refused(connection: Connection, desk: MotionDesk, page: Page, interlock: Interlock) -> InterlockError:
    """A jog of a prepared axis is refused, and nothing moves by it."""
    page.hold()
    before_deg = await angle_deg(connection)
    with pytest.raises(InterlockError) as caught:
        await jog(desk, AXIS, page.fence, -3.0, connection.journal)
    page.let_go()
    assert caught.value.details["interlock"] == interlock.value
    assert await angle_deg(connection) == pytest.approx(before_deg, abs=0.05)
    return caught.value


async def prepared(desk: MotionDesk, page: Page) -> None:
    page.hold()
    await desk.prepare(AXIS, page.fence)
    page.let_go()


async def test_nothing_moves_while_the_battery_is_tested_from_here(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    async with at_the_desk(connection) as (motion, page), at_the_batteries(connection, store) as (desk, target):
        desk._motion = motion
        await prepared(motion, page)
        assert not (await standing(motion, Interlock.BATTERY_TEST)).holds_back
        async with asyncio.timeout(10.0):
            while any(need.holds_back for need in await desk.needs(target)):  # noqa: ASYNC110  the proof has just ended
                await asyncio.sleep(0.05)
        running = await desk.test(target, "tester", connection.journal)
        assert (await standing(motion, Interlock.BATTERY_TEST)).holds_back, "seen before it bites"
        assert not (await standing(motion, Interlock.BATTERY_TEST, OTHER_AXIS)).holds_back, "another blade's battery"
        error = await refused(connection, motion, page, Interlock.BATTERY_TEST)
        en, de = (error_text(load_texts(language), error) for language in ("en", "de"))
        assert en == f"{AXIS}: motion is held back: Battery test at this blade: under way"
        assert de == f"{AXIS}: Die Bewegung ist gesperrt: Batterietest an diesem Blatt: läuft"
        desk.cancel(target)
        await running.task
        assert (await standing(motion, Interlock.BATTERY_TEST)).holds_back, "the unit goes on by itself"
        await cleared(motion, Interlock.BATTERY_TEST, 40.0)
        status = await read_number(connection.driver(target), target, TEST_STATUS)
        assert status == TestStatus.OK | TestStatus.FINISHED, "nothing has broken it off"
        page.hold()
        moving = asyncio.create_task(jog(motion, AXIS, page.fence, -3.0, connection.journal))
        await until(lambda: motion.running is not None and motion.running.turning)
        page.let_go()
        await moving


async def test_nothing_moves_while_somebody_else_has_armed_a_test(served: Served, connection: Connection) -> None:
    in_plant(served, charged(0.98))
    async with at_the_desk(connection) as (motion, _):
        with witness(served) as unit:
            unit.sdo[0x3040].raw = COMMAND_TEST
            await until(lambda: unit.sdo[0x3005].raw == TestStatus.STARTED)
            found = await standing(motion, Interlock.BATTERY_TEST)
            assert (found.holds_back, found.details["state_key"]) == (True, "interlock.testing.armed")
            with pytest.raises(InterlockError):
                await motion.require_clear(AXIS)


async def test_a_test_is_refused_while_an_axis_moves_and_a_motion_while_a_test_is_about_to_begin(
    served: Served, connection: Connection, store: Store
) -> None:
    in_plant(served, charged(0.98))
    async with at_the_desk(connection) as (motion, page), at_the_batteries(connection, store) as (desk, target):
        desk._motion = motion
        await prepared(motion, page)
        page.hold()
        moving = asyncio.create_task(jog(motion, AXIS, page.fence, -3.0, connection.journal))
        await until(lambda: motion.running is not None and motion.running.turning)
        with pytest.raises(BatteryConditionError) as caught:
            await desk.test(target, "tester", connection.journal)
        assert caught.value.details["condition"] in (Condition.STANDS.value, Condition.NOBODY_MOVES.value)
        assert motion.running is not None, "the motion goes on"
        page.let_go()
        await moving
        assert motion.batteries_tested == set(), "a test that was refused holds nothing back"
        with witness(served) as unit:
            assert (unit.sdo[0x3040].raw, unit.sdo[0x3005].raw) == (0, 0)
        # From its first look on, before anything is sent.
        test = asyncio.create_task(desk.test(target, "tester", connection.journal))
        await asyncio.sleep(0)
        assert (await standing(motion, Interlock.BATTERY_TEST)).holds_back
        running = await test
        desk.cancel(target)
        await running.task


def pulse(served: Served, bit: int) -> None:
    """The controller pulls one input to 0 V for 30 ms."""
    inputs, line = served.turbine.blades[0].pmm.inputs, served.line

    def end(_t_ns: int) -> None:
        inputs.digital |= bit

    def begin() -> None:
        inputs.digital &= ~bit
        line.call_at(line.now_ns + PULSE_NS, end)

    served.thread.call_soon(begin)


async def test_nothing_moves_while_an_input_of_the_safety_chain_is_tested(
    served: Served, connection: Connection
) -> None:
    async with at_the_desk(connection) as (motion, page):
        await prepared(motion, page)
        await cleared(motion, Interlock.INPUT_TEST, 5.0)
        pulse(served, 1 << 2)
        async with asyncio.timeout(SHOWN_S):
            while not (found := await standing(motion, Interlock.INPUT_TEST)).holds_back:  # noqa: ASYNC110  as above
                await asyncio.sleep(0.02)
        assert found.details == {"clamps": "X13.8"}
        assert not (await standing(motion, Interlock.INPUT_TEST, OTHER_AXIS)).holds_back
        error = await refused(connection, motion, page, Interlock.INPUT_TEST)
        assert "X13.8" in error_text(load_texts("de"), error)
        await cleared(motion, Interlock.INPUT_TEST, 2 * SHOWN_S)
        await motion.require_clear(AXIS)


async def test_an_angle_does_not_grow_old_while_the_units_are_asked(
    connection: Connection, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def slowly(connection: Connection, target: Target) -> Tests:
        await asyncio.sleep(0.6)
        return await look_at_tests(connection, target)

    async with at_the_desk(connection) as (motion, _):
        monkeypatch.setattr(interlocks, "look_at_tests", slowly)
        for slug in ("wtg-07/blade-2/pmc", "wtg-07/blade-3/pmc"):
            await angle_deg(connection, slug)
        await asyncio.sleep(0.6)
        assert not (await standing(motion, Interlock.OTHERS_FEATHERED)).holds_back


async def test_a_unit_that_does_not_answer_holds_its_axis_back(served: Served, connection: Connection) -> None:
    async with at_the_desk(connection) as (motion, _):
        served.spoil(Fault(lambda can: can.can_id == 0x600 + NODE, drop, times=None))
        for interlock in (Interlock.BATTERY_TEST, Interlock.INPUT_TEST):
            assert (await standing(motion, interlock)).holds_back
        found = await standing(motion, Interlock.BATTERY_TEST)
        assert found.details["state_key"] == "interlock.testing.unknown"
        assert not (await standing(motion, Interlock.BATTERY_TEST, OTHER_AXIS)).holds_back
