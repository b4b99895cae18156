"""The scope against twins on a real wire: every frame counts, triggers come from the bus, and what was caught stays."""

from __future__ import annotations

import asyncio
from itertools import pairwise
from pathlib import Path

import pytest

from app.errors import NotConnectedError, ScopeSettingsError, ScopeStateError, ScopeUnknownError
from app.model.address import Address
from app.service.connection import Connection
from app.service.polling import USUAL
from app.service.scope.engine import Cause, Ended
from app.service.scope.line import latest_of, scope_line, scope_view
from app.service.scope.tap import PORTION
from app.store.store import Store
from app.wire.frame import Can
from app.wire.nmt import NmtCommand, NmtState
from app.wire.records import Source, ValueSeen
from tests.service.conftest import Served
from tests.service.scope.rig import (
    AXIS,
    DEADLINE_S,
    POSITION,
    POWER,
    STATUSWORD,
    Wire,
    kept,
    order,
    scope_at,
    trigger,
    until,
)
from tests.web.rig import Feeder, make_connection

NODE = 11
TPDO1 = 0x18B
COB_ID, EVENT_TIMER = Address(0x1800, 1), Address(0x1800, 5)
DISABLED = 1 << 31
PERIOD_MS = 5
MS = 1_000_000


async def operational(connection: Connection, cyclic: bool = False) -> None:
    """The axis controller operational; its statusword every 5 ms where ``cyclic``."""
    target = connection.target(AXIS)
    driver = connection.driver(target)
    if cyclic:
        cob_id = int.from_bytes(await driver.read(NODE, COB_ID), "little")
        await driver.write(NODE, COB_ID, (cob_id | DISABLED).to_bytes(4, "little"))
        await driver.write(NODE, EVENT_TIMER, PERIOD_MS.to_bytes(2, "little"))
        await driver.write(NODE, COB_ID, cob_id.to_bytes(4, "little"))
    driver.nmt(NmtCommand.START, NODE)

    def runs() -> bool:
        view = connection.live.node("can0", NODE)
        return view is not None and view.state is NmtState.OPERATIONAL

    await until(runs)


async def test_every_pdo_counts_and_none_twice(connection: Connection) -> None:
    """The statusword 200 times a second: the capture holds what crossed the wire, frame by frame."""
    await operational(connection, cyclic=True)
    async with scope_at(connection) as (desk, wire):
        await desk.arm(connection, order(STATUSWORD, f"{STATUSWORD}.0", total_s=0.8, pre_s=0.4), "tester")
        await until(lambda: scope_line(desk, True).signals[0].rate_hz > 0.8 * 1000 / PERIOD_MS)
        assert scope_line(desk, True).signals[0].way == "pdo"
        desk.trigger_now()
        (found,) = await kept(desk)
        capture = await desk.captures.get(found)
        head = capture.head
        frames = wire.between(TPDO1, head.start_ns, head.end_ns)
        assert len(frames) > 60, "many came by PDO"
        got = list(zip(capture.values[0].t_ns.tolist(), capture.values[0].raw.tolist(), strict=True))
        by_pdo = [(t_ns, int.from_bytes(data, "little")) for t_ns, data in frames]
        assert set(by_pdo) <= set(got)
        assert head.signals[0].by_pdo == len(by_pdo)
        assert len({t_ns for t_ns, _ in got}) == len(got), "none twice"
        assert [raw & 1 for _, raw in got] == capture.values[1].raw.tolist()
        assert (head.cause, head.ended, head.recording) == (Cause.MANUAL.value, Ended.COMPLETE.value, _file(connection))


def _file(connection: Connection) -> str:
    assert connection.recording is not None
    file = connection.recording.status().file
    assert file is not None
    return file.name


async def test_what_no_pdo_carries_is_polled_and_says_so(connection: Connection) -> None:
    async with scope_at(connection) as (desk, wire):
        await desk.arm(connection, order(POSITION, f"{POWER}/3063"), "tester")
        await until(lambda: all(one.rate_hz > 20 for one in scope_line(desk, True).signals))
        line = scope_line(desk, True)
        assert [one.way for one in line.signals] == ["polled", "polled"]
        assert [one.unit for one in line.signals] == ["°", "V"]
        assert connection.buses["can0"].bus_load(connection.stamper()) < USUAL.load_cap + 0.15
        view = scope_view(latest_of(desk), 400)
        assert [one.signal for one in view.series] == [POSITION, f"{POWER}/3063"]
        assert view.series[0].low[-1] == pytest.approx(80.0, abs=0.5), "in degrees"
        await desk.stop()
        seen = 0

        def quiet() -> bool:
            """Nothing more asked since the last look: what was under way in that moment is ended, with an abort."""
            nonlocal seen
            before, seen = seen, _asked(wire)
            return before == seen > 0

        await until(quiet, every_s=0.3)


def _asked(wire: Wire) -> int:
    return sum(isinstance(one.payload, Can) and one.payload.can_id & 0x780 == 0x600 for one in wire.frames)


async def test_the_state_of_the_axis_triggers(connection: Connection) -> None:
    await operational(connection)
    async with scope_at(connection) as (desk, wire):
        on = trigger(kind="event", event="axis_state", device=AXIS)
        await desk.arm(connection, order(STATUSWORD, on=on), "tester")
        await until(lambda: any(one.way != "silent" for one in scope_line(desk, True).signals))
        target = connection.target(AXIS)
        await connection.driver(target).write(NODE, Address(0x6040), bytes(2))
        (found,) = await kept(desk)
        capture = await desk.captures.get(found)
        at = capture.values[0].t_ns.tolist().index(capture.head.trigger_ns)
        raws = capture.values[0].raw.tolist()
        assert raws[at] & 0x4F == 0x40, "switch on disabled: by the very value that told it"
        assert raws[:at]
        assert all(raw & 0x6F == 0x21 for raw in raws[:at])
        assert wire.between(TPDO1, capture.head.trigger_ns, capture.head.trigger_ns), "which a PDO brought"


async def test_a_fault_of_the_twin_triggers(connection: Connection, served: Served) -> None:
    """An error in the twin's own controller: the message that told it is the trigger."""
    await operational(connection)
    async with scope_at(connection) as (desk, wire):
        await desk.arm(connection, order(STATUSWORD, POSITION, on=trigger(kind="fault", device=AXIS)), "tester")
        await until(lambda: all(one.way != "silent" for one in scope_line(desk, True).signals))
        served.thread.call_soon(lambda: served.turbine.blades[0].pmc.raise_error(0x8110))
        (found,) = await kept(desk)
        capture = await desk.captures.get(found)
        marks = [(one.what, one.device, one.detail) for one in capture.head.marks]
        assert ("emcy", AXIS, "8110") in marks
        messages = wire.between(0x8B, capture.head.trigger_ns, capture.head.trigger_ns)
        assert [data[:2] for _, data in messages] == [b"\x10\x81"]
        assert len(capture.values[1].t_ns[capture.values[1].t_ns < capture.head.trigger_ns]) > 0, "pre-trigger"


async def test_a_boot_up_triggers_and_breaks_the_lines_of_its_device(connection: Connection) -> None:
    await operational(connection)
    async with scope_at(connection) as (desk, _wire):
        on = trigger(kind="event", event="boot_up", device=AXIS)
        await desk.arm(connection, order(STATUSWORD, f"{POWER}/3063", on=on), "tester")
        connection.driver(connection.target(AXIS)).nmt(NmtCommand.RESET_NODE, NODE)
        (found,) = await kept(desk)
        capture = await desk.captures.get(found)
        assert capture.breaks_s(0) == [0.0]
        assert capture.breaks_s(1) == []


async def test_it_re_arms_until_it_is_stopped(connection: Connection) -> None:
    async with scope_at(connection) as (desk, _wire):
        on = trigger(kind="level", signal=POSITION, level=10.0, side="above")
        await desk.arm(connection, order(POSITION, on=on, mode="normal", total_s=0.2, pre_s=0.1), "tester")
        found = await kept(desk, 3)
        await desk.stop()
        heads = [(await desk.captures.get(one)).head for one in reversed(found[-3:])]
        for first, second in pairwise(heads):
            assert second.trigger_ns > first.end_ns
        assert scope_line(desk, True).phase == "done"


async def test_the_values_in_force_are_those_of_the_trigger(connection: Connection) -> None:
    address = Address(0x6065)
    target = connection.target(AXIS)
    driver = connection.driver(target)
    before = await driver.read(NODE, address)
    async with scope_at(connection) as (desk, _wire):
        await desk.arm(connection, order(POSITION), "tester")
        await until(lambda: scope_line(desk, True).signals[0].rate_hz > 0)
        desk.trigger_now()
        other = (int.from_bytes(before, "little") + 100).to_bytes(len(before), "little")
        await driver.write(NODE, address, other)
        (found,) = await kept(desk)
        rows = {one.address: one for one in await desk.captures.in_force(found)}
        assert rows["6065"].raw == str(int.from_bytes(before, "little")), "not what came after"
        assert rows["6065"].unit == "°"
        (device,) = (await desk.captures.get(found)).head.devices
        assert (device.device, device.description_id) == (AXIS, "oat-pmc")
        assert device.values == len(rows)


async def test_parameters_that_nobody_knows_are_read_beside_the_signals(connection: Connection) -> None:
    """Also those of the device that triggers; what PDOs bring leaves more room for it."""

    def unknown(slug: str) -> list[Address]:
        target = connection.target(slug)
        parameters = [one.address for one in target.description if one.is_parameter and one.access.readable]
        return [one for one in parameters if target.lookup(one) is None]

    assert len(unknown(AXIS)) > 50, "nothing was read yet"
    assert len(unknown(POWER)) > 50
    async with scope_at(connection) as (desk, _wire):
        await desk.arm(connection, order(POSITION, on=trigger(kind="fault", device=POWER)), "tester")
        await until(lambda: scope_line(desk, True).signals[0].rate_hz > 20)
        await until(lambda: not unknown(AXIS) and not unknown(POWER))
        desk.trigger_now()
        (found,) = await kept(desk)
        rows = await desk.captures.in_force(found)
        devices = {one.device: one for one in (await desk.captures.get(found)).head.devices}
        for slug in (AXIS, POWER):
            assert devices[slug].values == sum(row.device == slug for row in rows)
            described = {one.address.short for one in connection.target(slug).description if one.is_parameter}
            assert described == {row.address for row in rows if row.device == slug and row.parameter}


async def test_a_lost_link_is_a_gap_in_the_capture(connection: Connection, served: Served) -> None:
    async with scope_at(connection) as (desk, _wire):
        await desk.arm(connection, order(POSITION, total_s=6.0, pre_s=0.2), "tester")
        await until(lambda: scope_line(desk, True).signals[0].rate_hz > 0)
        desk.trigger_now()
        served.cut()
        run = desk.run
        assert run is not None
        await until(lambda: any(one.what == "gap" for one in run.engine.marks(run.armed_ns, connection.stamper())))
        gap = next(one.t_ns for one in run.engine.marks(run.armed_ns, connection.stamper()) if one.what == "gap")
        await until(lambda: len(run.engine.latest(gap, connection.stamper())[0].t_ns) > 3)
        await desk.stop()
        (found,) = await kept(desk)
        capture = await desk.captures.get(found)
        assert "gap" in [one.what for one in capture.head.marks]
        assert (gap - capture.head.trigger_ns) / 1e9 in capture.breaks_s(0)
        assert capture.head.ended == Ended.STOPPED.value


async def test_the_end_of_the_connection_keeps_what_came(connection: Connection) -> None:
    async with scope_at(connection) as (desk, _wire):
        await desk.arm(connection, order(POSITION, total_s=20.0), "tester")
        await until(lambda: scope_line(desk, True).signals[0].rate_hz > 0)
        desk.trigger_now()
        await desk.detach()
        (found,) = await kept(desk)
        assert (await desk.captures.get(found)).head.ended == Ended.LINK.value
        assert scope_line(desk, False).reason_key == "scope.over.link"
        assert all(link.listeners == () for link in connection.buses.values())


async def test_what_waits_for_the_loop_at_the_end_is_in_the_capture() -> None:
    """Values that crossed the wire before the stop, and that the event loop had not taken yet."""
    connection = make_connection()
    async with scope_at(connection) as (desk, _wire):
        await desk.arm(connection, order(STATUSWORD, total_s=60.0, pre_s=0.0), "tester")
        desk.trigger_now()
        count = 2 * PORTION + 7
        for word in range(count):
            Feeder(connection).read(NODE, Address(0x6041), word.to_bytes(2, "little"))
        await desk.stop()
        (found,) = await kept(desk)
        capture = await desk.captures.get(found)
        assert capture.values[0].raw.tolist() == list(range(count))
        assert capture.head.marks == ()


async def test_a_capture_is_taken_out_only_once_all_of_it_was_handed_over() -> None:
    """Its end is long over, and most of its values still wait in the queue: none is lost, and none comes too late."""
    connection = make_connection()
    async with scope_at(connection) as (desk, _wire):
        on = trigger(kind="level", signal=STATUSWORD, level=-1.0, side="above")
        run = await desk.arm(connection, order(STATUSWORD, on=on, total_s=0.1, pre_s=0.0), "tester")
        await until(lambda: connection.stamper() > run.armed_ns + 500 * MS)
        begin_ns = run.armed_ns + MS
        words = [(begin_ns + n * 20_000, n % 0x10000) for n in range(6 * PORTION)]
        run.tap.hear(
            [
                ValueSeen(t_ns, "can0", NODE, Address(0x6041), word.to_bytes(2, "little"), Source.PDO_TX)
                for t_ns, word in words
            ]
        )
        (found,) = await kept(desk)
        capture = await desk.captures.get(found)
        expected = [(t_ns, word) for t_ns, word in words if t_ns <= begin_ns + 100 * MS]
        assert len(expected) > 4 * PORTION
        assert list(zip(capture.values[0].t_ns.tolist(), capture.values[0].raw.tolist(), strict=True)) == expected
        assert scope_line(desk, True).late == 0


async def test_a_defect_of_ours_keeps_what_came_and_says_so() -> None:
    connection = make_connection()
    async with scope_at(connection) as (desk, _wire):
        run = await desk.arm(connection, order(STATUSWORD, total_s=60.0, pre_s=0.0), "tester")
        desk.trigger_now()
        feeder = Feeder(connection)
        feeder.read(NODE, Address(0x6041), b"\x21\x00")
        run.tap._wanted = None  # type: ignore[assignment]
        feeder.read(NODE, Address(0x6041), b"\x27\x00")
        (found,) = await kept(desk)
        capture = await desk.captures.get(found)
        assert capture.values[0].raw.tolist() == [0x21]
        assert [(one.what, one.bus, one.detail) for one in capture.head.marks] == [("gap", "can0", "scope.gap.defect")]
        assert capture.breaks_s(0)[0] > capture.values[0].t_s(capture.head.trigger_ns)[-1]
        line = scope_line(desk, True)
        assert (line.phase, line.reason_key) == ("done", "scope.over.defect")


async def test_it_is_armed_for_what_is_served_alone(connection: Connection) -> None:
    async with scope_at(connection) as (desk, _wire):
        await desk.detach()
        with pytest.raises(NotConnectedError):
            await desk.arm(connection, order(POSITION), "tester")
        assert desk.run is None
        assert all(link.listeners == () for link in connection.buses.values())


async def test_captures_survive_a_restart(connection: Connection, tmp_path: Path) -> None:
    store = Store.open(tmp_path / "data")
    async with scope_at(connection, store) as (desk, _wire):
        await desk.arm(connection, order(POSITION, f"{STATUSWORD}.9"), "tester")
        await until(lambda: scope_line(desk, True).signals[0].rate_hz > 0)
        desk.trigger_now()
        (found,) = await kept(desk)
        before = await desk.captures.get(found)
        rows = await desk.captures.in_force(found)
        await desk.captures.change(found, "brake test", "after greasing", "tester")
    store.close()
    again = Store.open(tmp_path / "data")
    async with scope_at(connection, again) as (desk, _wire):
        after = await desk.captures.get(found)
        assert (after.head.name, after.head.note) == ("brake test", "after greasing")
        assert after.head.order == before.head.order
        for one, other in zip(before.values, after.values, strict=True):
            assert one.t_ns.tolist() == other.t_ns.tolist()
            assert one.raw.tolist() == other.raw.tolist()
        assert await desk.captures.in_force(found) == rows
        await desk.captures.delete(found, "tester")
        with pytest.raises(ScopeUnknownError):
            await desk.captures.get(found)
    again.close()


async def test_auto_without_a_trigger_shows_one_and_keeps_none_but_by_name(connection: Connection) -> None:
    async with scope_at(connection) as (desk, _wire):
        on = trigger(kind="edge", signal=POSITION, level=1.0, slope="falling")
        await desk.arm(connection, order(POSITION, on=on, mode="auto", auto_s=0.2, total_s=0.2, pre_s=0.1), "tester")
        (first,) = await kept(desk)
        async with asyncio.timeout(DEADLINE_S):
            while first in [one.id for one in await desk.captures.all()]:  # noqa: ASYNC110  no event tells it
                await asyncio.sleep(0.02)
        await desk.stop()
        (listed,) = await desk.captures.all()
        assert not listed.kept
        assert listed.cause == Cause.AUTO.value
        await desk.captures.change(listed.id, "at rest", "", "tester")
        (listed,) = await desk.captures.all()
        assert listed.kept


@pytest.mark.parametrize(
    ("signals", "changed", "field", "reason"),
    [
        ((), {}, "signals", "none"),
        ((*(f"{STATUSWORD}.{bit}" for bit in range(16)), POSITION), {}, "signals", "many"),
        (("nonsense",), {}, "nonsense", "name"),
        (("a/b/c/6064",), {}, "a/b/c/6064", "device"),
        ((f"{AXIS}/5FFF",), {}, f"{AXIS}/5FFF", "object"),
        ((f"{AXIS}/1008",), {}, f"{AXIS}/1008", "object"),
        ((f"{STATUSWORD}.16",), {}, f"{STATUSWORD}.16", "bit"),
        ((POSITION,), {"total_s": 0.05}, "total_s", "range"),
        ((POSITION,), {"total_s": float("nan")}, "total_s", "range"),
        ((POSITION,), {"pre_s": 0.7}, "pre_s", "range"),
        ((POSITION,), {"on": trigger(kind="edge", level=1.0)}, "signal", "signal"),
        ((POSITION,), {"on": trigger(kind="edge", signal=POSITION)}, "level", "level"),
        ((POSITION,), {"on": trigger(kind="event")}, "event", "event"),
        ((POSITION,), {"on": trigger(kind="event", event="axis_state", device=POWER)}, "device", "axis"),
        ((POSITION,), {"on": trigger(kind="event", event="bit", signal=POSITION)}, "signal", "bit"),
        ((POSITION,), {"on": trigger(kind="fault", device="a/b/c")}, "device", "device"),
    ],
    ids=lambda one: one if isinstance(one, str) else None,
)
async def test_what_does_not_fit_is_refused_and_nothing_is_armed(
    connection: Connection, signals: tuple[str, ...], changed: dict[str, object], field: str, reason: str
) -> None:
    async with scope_at(connection) as (desk, _wire):
        with pytest.raises(ScopeSettingsError) as refused:
            await desk.arm(connection, order(*signals, **changed), "tester")  # type: ignore[arg-type]
        assert (refused.value.details["field"], refused.value.details["reason_key"]) == (field, f"scope.flaw.{reason}")
        assert desk.run is None
        with pytest.raises(ScopeStateError):
            desk.trigger_now()
