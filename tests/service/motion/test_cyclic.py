"""Test signals on a twin, over a wire: what is measured, every way to end, and what is put back."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.errors import LimitError, NotHeldError, PreconditionError
from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.site import load_site
from app.service.connection import Connection
from app.service.motion.courses import POSITION
from app.service.motion.cyclic import Played, Transport, play
from app.service.motion.desk import MotionDesk
from app.service.motion.evaluation import Evaluation, evaluate
from app.service.motion.interlocks import Confirmed
from app.service.motion.left import Left
from app.service.motion.line import motion_line
from app.service.motion.moves import move_to
from app.service.motion.running import Doing, Ended, Running
from app.service.motion.runs import SignalRuns
from app.service.motion.signals import Shape, Signal
from app.service.options import Options
from app.service.stop import Command, command_all
from app.store.store import Store
from app.wire.records import Record, SdoAccess, SdoSeen
from tests.e2e.conftest import site_for
from tests.service.conftest import Served
from tests.service.motion.rig import AXIS, Page, SteadyClock, angle_deg, at_the_desk, number

pytestmark = [pytest.mark.alone, pytest.mark.timeout(120)]  # targets come at a steady rate

SINE = Signal(Shape.SINE, -1.0, 0.5, 2, 2.0, 1.0)
LONG = replace(SINE, cycles=15)
STEP = Signal(Shape.STEP, -0.8, 0.5, 1, 5.0, 1.0)
RAMP = Signal(Shape.RAMP, -2.0, 0.5, 1, 2.0, 0.5)
STATUS, MODE = Address(0x6041), Address(0x6061)
BORROWED = (
    *(Address(0x60C2, 1), Address(0x60C2, 2), Address(0x6081)),
    *(Address(0x1403, 1), *(Address(0x1400 + pdo, 1) for pdo in range(3))),
    *(Address(0x1803, sub) for sub in (1, 3, 5)),
)
GAINS = (0, 65535)


async def stand(connection: Connection, desk: MotionDesk, page: Page) -> dict[Address, int]:
    """Prepared, away from the 90 degree switch, and held anew; what may be borrowed as it is then."""
    page.hold()
    await desk.prepare(AXIS, page.fence)
    page.let_go()
    page.hold()
    await move_to(desk, AXIS, page.fence, 80.0, 5.0, connection.journal)
    page.let_go()
    page.hold()
    return {address: await number(connection, address) for address in BORROWED}


async def run(connection: Connection, signal: Signal) -> tuple[Played, Evaluation]:
    """A signal to its end; afterwards the axis is as it was, without power, in a mode that goes nowhere."""
    async with at_the_desk(connection) as (desk, page):
        before = await stand(connection, desk, page)
        played = await play(desk, AXIS, page.fence, signal, connection.journal)
        assert (played.why, played.error) == (Ended.DONE, None)
        assert {address: await number(connection, address) for address in BORROWED} == before
        assert (await number(connection, STATUS)) & 0x6F in (0x21, 0x40)
        assert await number(connection, MODE) == 1
        assert await angle_deg(connection) == pytest.approx(80.0, abs=0.1)
        assert set(desk.left.of(AXIS)) == {Address(0x6007), Address(0x1016, 1)}, "what the proof has set, no more"
        return played, evaluate(played, GAINS)


async def test_a_sine_is_followed_as_its_gain_and_precontrol_promise(connection: Connection) -> None:
    played, found = await run(connection, SINE)
    sine = found.results.sine
    assert sine is not None
    assert played.transport is Transport.PDO
    assert played.sent == round(SINE.duration_s / 0.05) + 1
    assert sine.ratio == pytest.approx(1.0, abs=0.05)
    assert 0.0 < sine.delay_ms < 40.0, "velocity loop and filter are some 12 ms"
    assert sine.rest_deg < 0.05
    assert played.courses is not None and played.begun_ns is not None
    times, values = played.courses.of(POSITION, played.begun_ns)
    assert len(times) / SINE.duration_s > 80, "a hundred a second by a PDO"
    assert values.min() == pytest.approx(79.0, abs=0.1)
    assert values.max() == pytest.approx(81.0, abs=0.1)


async def test_a_step_shows_the_lag_of_the_velocity_loop(connection: Connection) -> None:
    _, found = await run(connection, STEP)
    step, lag_ms = found.results.step, found.results.lag_ms
    assert step is not None and lag_ms is not None
    assert step.dead_ms is not None and 20 < step.dead_ms < 130, "15 degrees/s2 take 52 ms for 0.02 degrees"
    assert step.rise_ms == pytest.approx(235, abs=50)  # of a triangle of 15 degrees/s2
    assert step.overshoot_percent < 5
    assert abs(step.error_deg) < 0.03
    assert 0 < lag_ms < 40, "some 12 ms; below 5 it cannot be told"
    assert found.proposal is not None
    assert found.proposal.reasons[0].key == "lag"
    expected = np.interp(1.0, np.array(found.courses["expected"]["t_ms"]) / 1000, found.courses["expected"]["y"])
    assert expected == pytest.approx(79.2, abs=0.05)


async def test_a_ramp_without_precontrol_lags_by_its_gain(connection: Connection) -> None:
    target = connection.target(AXIS)
    await connection.driver(target).write(target.node, Address(0x60FB, 2), b"\0\0")
    _, found = await run(connection, RAMP)
    ramp = found.results.ramp
    assert ramp is not None
    assert ramp.speed_dps == pytest.approx(2.0, rel=0.02)
    assert ramp.lag_deg == pytest.approx(2.0 / 17, abs=0.03)
    assert ramp.gain_per_s == pytest.approx(17, rel=0.25)


async def test_without_a_pdo_that_could_bring_them_targets_go_by_sdo(connection: Connection) -> None:
    target = connection.target(AXIS)
    await connection.driver(target).write(target.node, Address(0x1403, 2), b"\x01")  # waits for a SYNC
    played, found = await run(connection, SINE)
    assert played.transport is Transport.SDO
    assert found.results.sine is not None
    assert found.results.sine.ratio == pytest.approx(1.0, abs=0.05)


# -- what ends it -------------------------------------------------------------------------------


async def moving(connection: Connection, desk: MotionDesk, page: Page) -> asyncio.Task[Played]:
    """A long sine that is under way."""
    order = asyncio.create_task(play(desk, AXIS, page.fence, LONG, connection.journal))
    async with asyncio.timeout(15.0):
        while await angle_deg(connection) > 79.5:
            assert not order.done(), order.result()
            await asyncio.sleep(0.01)
    return order


async def stands(connection: Connection) -> float:
    """Where it stands without power."""
    async with asyncio.timeout(10.0):
        while (await number(connection, STATUS)) & 0x6F not in (0x21, 0x40):  # noqa: ASYNC110  no event for it
            await asyncio.sleep(0.02)
    rest_deg = await angle_deg(connection)
    await asyncio.sleep(0.2)
    assert await angle_deg(connection) == pytest.approx(rest_deg, abs=0.03)
    return rest_deg


async def test_let_go_it_halts(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        before = await stand(connection, desk, page)
        order = await moving(connection, desk, page)
        page.let_go()
        played = await order
        assert played.why is Ended.RELEASED
        assert 78.8 < await stands(connection) < 81.2
        assert await number(connection, MODE) == 1
        assert {address: await number(connection, address) for address in BORROWED} == before


async def test_silence_is_a_quick_stop(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        before = await stand(connection, desk, page)
        order = await moving(connection, desk, page)
        await page.die()
        silent_s = desk.now_s()
        while (await number(connection, STATUS)) & 0x6F == 0x27:  # noqa: ASYNC110  the device has no event for it
            await asyncio.sleep(0.005)
        assert desk.now_s() - silent_s < 0.5
        played = await order
        assert played.why is Ended.SILENT
        await stands(connection)
        assert {address: await number(connection, address) for address in BORROWED} == before


async def put_back(desk: MotionDesk) -> None:
    """Wait until all is as it was before the preparation."""
    async with asyncio.timeout(10.0):
        while desk.left.of(AXIS) or desk.prepared:  # noqa: ASYNC110  the store has no event for it
            await asyncio.sleep(0.02)


async def test_the_lease_given_back_is_a_quick_stop(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await stand(connection, desk, page)
        order = await moving(connection, desk, page)
        desk.give_back_lease(page.fence)
        assert (await order).why is Ended.LEASE
        await stands(connection)
        await put_back(desk)
        assert await number(connection, MODE) == 1
        assert desk.left.mode_of(AXIS) is None


@pytest.mark.parametrize("command", [Command.STOP, Command.FEATHER])
async def test_stop_and_feather_end_it_and_stay_in_force(connection: Connection, command: Command) -> None:
    async with at_the_desk(connection) as (desk, page):
        await stand(connection, desk, page)
        order = await moving(connection, desk, page)
        await command_all(connection.axes(), command, connection.journal, connection.stamper)
        assert (await order).why is Ended.STOPPED
        if command is Command.FEATHER:
            async with asyncio.timeout(20.0):
                while await angle_deg(connection) < 89.5:  # noqa: ASYNC110  the device has no event for it
                    await asyncio.sleep(0.05)
        else:
            assert 78.8 < await stands(connection) < 81.2
            desk.give_back_lease(page.fence)
            await put_back(desk)
            assert await number(connection, MODE) == 1


async def test_a_fault_ends_it_and_the_run_says_so(connection: Connection, served: Served) -> None:
    async with at_the_desk(connection) as (desk, page):
        await stand(connection, desk, page)
        order = await moving(connection, desk, page)
        pmc = served.turbine.blades[0].pmc
        served.thread.call_soon(lambda: pmc.raise_error(0x8400))
        played = await order
        assert played.why in (Ended.FAILED, Ended.STOPPED)
        assert played.sent > 0
        async with asyncio.timeout(20.0):  # its watchdog contact opens the safety chain: all blades go to feather
            while await angle_deg(connection) < 89.5:  # noqa: ASYNC110  the device has no event for it
                await asyncio.sleep(0.05)


@pytest.mark.parametrize(
    ("reasons", "told"),
    [
        ((Ended.DONE, Ended.FAILED), Ended.FAILED),
        ((Ended.RELEASED, Ended.FAILED), Ended.RELEASED),
        ((Ended.DONE, Ended.SILENT), Ended.DONE),
    ],
)
async def test_what_was_done_and_then_did_not_come_to_rest_has_failed(
    connection: Connection, reasons: Sequence[Ended], told: Ended
) -> None:
    async with at_the_desk(connection) as (desk, _):
        running = Running(AXIS, Doing.SIGNAL, desk._control(connection.target(AXIS)), held=True)
        for why in reasons:
            running.end(why)
        assert running.why is told


async def test_a_cable_that_is_pulled_ends_it(connection: Connection, served: Served) -> None:
    async with at_the_desk(connection) as (desk, page):
        await stand(connection, desk, page)
        order = await moving(connection, desk, page)
        served.cut()
        played = await order
        assert played.why in (Ended.LINK, Ended.FAILED)
        drive = served.turbine.blades[0].pmc.drive
        async with asyncio.timeout(10.0):
            while abs(drive.plant.speed_rad_s) > 0.1:  # noqa: ASYNC110  the twin has no event for it
                await asyncio.sleep(0.02)


async def test_what_a_killed_server_had_borrowed_is_put_back_by_the_next(served: Served, tmp_path: Path) -> None:
    (turbine,) = load_site(site_for(served.address, tmp_path))
    known = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}
    with_store = Store.in_memory()
    first = Connection(turbine, known, Options("tester", tmp_path / "rec", listen_s=0.2))
    await first.open()
    desk = MotionDesk(first, first.journal, Left(with_store), SteadyClock())
    page = Page(desk)
    page.open()
    desk.confirm(page.fence, Confirmed(rotor_locked=True, people_out=True))
    before = await stand(first, desk, page)
    order = await moving(first, desk, page)
    await first.close()  # nothing of it is heard on the bus any more
    await page.die()
    await order
    await desk.close()

    async with Connection(turbine, known, Options("tester", tmp_path / "rec2", listen_s=0.2)) as second:
        kept = Left(with_store)
        assert Address(0x1403, 1) in kept.of(AXIS)
        assert await number(second, Address(0x1403, 1)) != before[Address(0x1403, 1)]
        async with at_the_desk(second) as (_, page):
            await page.die()
        after = MotionDesk(second, second.journal, kept)
        assert motion_line(after).left == (AXIS,)
        await after.put_back(AXIS, after.take_lease("tester", "next").fence)
        # The lost heartbeat has sent the blades to feather, which has its own velocity: that is left as it is.
        rest = [address for address in BORROWED if address != Address(0x6081)]
        assert [await number(second, address) for address in rest] == [before[address] for address in rest]
        assert motion_line(after).left == ()
        await after.close()
    with_store.close()


# -- what is refused ------------------------------------------------------------------------------


async def test_a_limit_refuses_before_anything_is_sent(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await stand(connection, desk, page)
        written: list[Record] = []

        def heard(records: Sequence[Record]) -> None:
            written.extend(one for one in records if isinstance(one, SdoSeen) and one.access is SdoAccess.WRITE)

        link = connection.buses["can0"]
        link.listen(heard)
        with pytest.raises(LimitError) as refused:
            await play(desk, AXIS, page.fence, replace(SINE, amplitude_deg=-3.0), connection.journal)
        assert refused.value.details["unit"] in ("°/s", "°/s²")
        with pytest.raises(LimitError) as refused:
            await play(desk, AXIS, page.fence, replace(STEP, amplitude_deg=-0.9), connection.journal)
        assert refused.value.details["address"] == "6065"
        assert written == []
        assert await number(connection, MODE) == 1
        assert await angle_deg(connection) == pytest.approx(80.0, abs=0.1)


async def test_an_offset_of_the_target_is_no_place_to_begin(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        target = connection.target(AXIS)
        await stand(connection, desk, page)
        await connection.driver(target).write(target.node, Address(0x60B0), (50).to_bytes(4, "little"))
        with pytest.raises(PreconditionError):
            await play(desk, AXIS, page.fence, SINE, connection.journal)


async def test_nobody_who_holds_it_nothing_that_moves(connection: Connection) -> None:
    async with at_the_desk(connection) as (desk, page):
        await stand(connection, desk, page)
        page.let_go()
        with pytest.raises(NotHeldError):
            await play(desk, AXIS, page.fence, SINE, connection.journal)
        assert await angle_deg(connection) == pytest.approx(80.0, abs=0.1)


# -- what is kept ---------------------------------------------------------------------------------


async def test_a_run_is_kept_with_what_was_in_force(connection: Connection) -> None:
    store = Store.in_memory()
    runs = SignalRuns(store, connection.stamper)
    async with at_the_desk(connection) as (desk, page):
        await stand(connection, desk, page)
        ran = await runs.run(desk, AXIS, page.fence, STEP, "anna", connection.journal)
    (kept,) = await SignalRuns(store, connection.stamper).of(AXIS)
    assert kept == await runs.get(ran.id)
    assert (kept.person, kept.why, kept.shape) == ("anna", "done", "step")
    gain = next(one for one in kept.content["in_force"] if one["address"] == "60FB:01")
    assert (gain["raw"], gain["unit"]) == (17, "1/s")
    assert {"demand", "set_point", "position", "expected", "following", "velocity", "current"} == set(
        kept.content["courses"]
    )
    assert kept.content["results"]["step"]["overshoot_percent"] < 5
    store.close()
