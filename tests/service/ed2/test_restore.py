"""A restore of an ED2: its order, what process data carry, the restart by hand, and where it ends."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.drivers.contract import LinkState
from app.errors import PkwRefusedError, PreconditionError
from app.model.address import parse_address
from app.model.datatypes import Raw
from app.model.restore.plan import StepKind, Why
from app.model.sets import dump_set, load_set
from app.service.journal import Kind
from app.service.restore.order import Cause, Objection
from app.service.restore.transaction import End
from app.store.restore_rows import RestoreState
from app.twins.ed2.states import State
from app.twins.object_store import RefusedAccessError
from app.wire.sdo import Abort
from tests.drivers.profibus_rig import CONTROLWORD, ED2, LOCAL
from tests.service.ed2.conftest import Bench, desk_of, kinds, steps
from tests.service.motion.ed2_rig import AXIS, ORDER, Cylinders
from tests.web.rig import wait_until

pytestmark = pytest.mark.alone  # a line that stands still for a second has lost its slave

CHANGES: dict[str, Raw] = {"12/207": 9_000, "1/106": 1, "1/100": -100, "1/101": 4_900, "12/61": 800, "12/64": 1_500}
MODES: dict[str, Raw] = {"0/40": -1, "0/53": 1}


async def test_a_set_survives_its_file(bench: Bench) -> None:
    parameters = await bench.set_of()
    again = load_set(dump_set(parameters), "cylinders.json")
    assert (again, again.hash) == (parameters, parameters.hash)


async def test_new_values_stand_saved_and_proven_once_somebody_has_switched_it_off_and_on(bench: Bench) -> None:
    wanted = {**CHANGES, **MODES}
    prepared = await bench.prepare(wanted, restart=True)
    assert not prepared.refusals
    assert prepared.by_hand == (AXIS,)
    assert kinds(prepared) == [StepKind.CONFIRM, StepKind.SAVE, StepKind.RESTART, StepKind.PROVE]
    restore_id, end = await bench.run_and_switch(wanted)
    assert end is End.NEW
    assert bench.ram(*wanted) == wanted
    assert bench.memory(wanted)
    assert (await bench.desk.get(restore_id)).outcome["proven"] is True


async def test_whoever_goes_on_without_the_switch_has_no_proof(bench: Bench) -> None:
    restore_id = await bench.begin(CHANGES, restart=True)
    await bench.asked_to_switch(restore_id)
    await bench.desk.go_on_unproven(restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.NEW
    assert (await bench.desk.get(restore_id)).outcome["proven"] is False
    assert bench.memory(CHANGES)
    assert Kind.RESTORE_UNPROVEN in [one.kind for one in bench.connection.journal.latest()]


async def test_who_turns_back_while_the_switch_is_awaited_gets_the_old_values_saved(bench: Bench) -> None:
    before = bench.ram(*CHANGES)
    restore_id = await bench.begin(CHANGES, restart=True)
    await bench.asked_to_switch(restore_id)
    await bench.desk.roll_back(bench.connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.OLD
    assert bench.ram(*CHANGES) == before
    assert bench.memory(dict(before))


async def test_limits_are_in_force_before_they_are_written_and_never_leave_an_enabled_axis_without_room(
    bench: Bench,
) -> None:
    writes = steps(await bench.prepare(CHANGES))
    at = writes.index(("write", "1/106", 1))
    assert writes[at : at + 3] == [("write", "1/106", 1), ("write", "1/100", -100), ("write", "1/101", 4_900)]
    refused = await bench.prepare({"1/106": 1})
    assert [(one.objection, one.details["rule"]) for one in refused.refusals] == [
        (Objection.RULES, "ed2.travel_window")
    ]


async def test_an_axis_whose_valve_is_driven_is_not_written_to(bench: Bench, twin: Cylinders) -> None:
    target = bench.connection.target(AXIS)
    driver = bench.connection.driver(target)
    for word in (0x0001, 0x0003):
        await driver.write(target.node, CONTROLWORD, word.to_bytes(2, "little"))
    await wait_until(lambda: twin.state is State.HOLD)
    refused = await bench.prepare(CHANGES)
    assert [one.objection for one in refused.refusals] == [Objection.DRIVE_ENABLED]
    await driver.write(target.node, CONTROLWORD, bytes(2))
    await wait_until(lambda: twin.state is State.INIT)
    assert not (await bench.prepare(CHANGES)).refusals


async def test_local_operation_is_left_for_it_and_never_entered_by_it(bench: Bench) -> None:
    """While it is operated locally the device takes nothing over the bus but the end of that, and so no save."""
    target = bench.connection.target(AXIS)
    await bench.connection.driver(target).write(target.node, LOCAL, b"\x01")
    refused = await bench.prepare({"12/207": 8_000})
    assert [(one.objection, one.details["needs"]) for one in refused.refusals] == [(Objection.CANNOT_SAVE, "0/41 = 0")]
    wanted: dict[str, Raw] = {"0/41": 0, "0/39": 1, **CHANGES}
    prepared = await bench.prepare(wanted)
    assert steps(prepared)[0] == ("write", "0/41", 0) and not prepared.refusals
    _, end = await bench.run(wanted)
    assert end is End.NEW
    assert bench.ram(*wanted) == wanted
    (row,) = [row for row in (await bench.prepare({"0/41": 1})).plan.rows if row.place.address == LOCAL]
    assert row.why is Why.NOT_SAVABLE


async def test_who_turns_back_after_the_save_finds_local_operation_again(bench: Bench) -> None:
    target = bench.connection.target(AXIS)
    await bench.connection.driver(target).write(target.node, LOCAL, b"\x01")
    before = bench.ram("0/41", "0/39", "12/207")
    cell = bench.twin.wired.device.channels[0].store.cell(0, 51)
    own = cell.guard

    def fails_once(_raw: Raw) -> None:
        cell.guard = own
        raise RefusedAccessError(Abort.HARDWARE)

    bench.twin.wired.do(lambda: setattr(cell, "guard", fails_once))
    restore_id, end = await bench.run({"0/41": 0, "0/39": 1, "12/207": 8_000})
    assert end is End.OLD, (await bench.desk.get(restore_id)).outcome
    assert bench.ram("0/41", "0/39", "12/207") == before


@pytest.mark.parametrize(("mode", "device_mode"), [(6, 2), (9, 2), (-2, 1)])
async def test_modes_that_the_device_changes_by_itself_are_expected(bench: Bench, mode: int, device_mode: int) -> None:
    wanted: dict[str, Raw] = {"0/53": 1, "0/40": mode, "0/39": device_mode}
    _, end = await bench.run(wanted)
    assert end is End.NEW
    assert bench.ram(*wanted) == wanted


async def test_a_refusal_is_told_in_the_words_of_the_device_and_brings_the_old_values_back(bench: Bench) -> None:
    before = bench.ram(*CHANGES)
    bench.refuse("12/207")
    restore_id, end = await bench.run(CHANGES)
    assert end is End.OLD
    assert bench.ram(*CHANGES) == before
    outcome = (await bench.desk.get(restore_id)).outcome
    assert outcome["cause"] == Cause.DEVICE_REFUSED.value
    assert outcome["error"]["code"] == PkwRefusedError.code
    assert outcome["error"]["details"]["text_key_reason"] == "profibus.pkw.not_changeable"


async def test_power_that_goes_in_the_midst_is_noticed_and_the_old_values_come_back(bench: Bench) -> None:
    before = bench.ram(*CHANGES)
    cell = bench.twin.wired.device.channels[0].store.cell(12, 207)

    def dies(_raw: Raw) -> None:
        cell.guard = None
        bench.twin.wired.device.power_off()

    bench.twin.wired.do(lambda: setattr(cell, "guard", dies))
    restore_id = await bench.begin(CHANGES)
    station = bench.connection.driver(bench.connection.target(AXIS))._line.stations[6]
    await wait_until(lambda: station.state.value == "absent")
    bench.twin.wired.power_on()
    end = await bench.desk.wait(restore_id)
    if end is End.INCOMPLETE:
        link = bench.connection.buses["dp0"]
        await wait_until(lambda: link.status.state is LinkState.CONNECTED)
        await bench.desk.roll_back(bench.connection, restore_id, "Anna")
        end = await bench.desk.wait(restore_id)
    assert end is End.OLD
    assert (await bench.desk.get(restore_id)).row.state is RestoreState.ROLLED_BACK
    assert bench.ram(*CHANGES) == before


async def test_modes_are_restored_through_the_telegram_that_carries_them(twin: Cylinders, tmp_path: Path) -> None:
    wanted: dict[str, Raw] = {**CHANGES, "0/53": 1, "0/40": 6, "0/39": 2}
    async with desk_of(twin, tmp_path, f"{ORDER}, telegram = 102") as bench:
        before = await bench.set_of()
        _, end = await bench.run(wanted)
        assert end is End.NEW
        assert bench.ram(*wanted) == wanted
        _, end = await bench.run({}, base=before)
        assert end is End.NEW
        after = await bench.set_of()
        assert {at: after.values[at] for at in after.values if ED2.entry(at).is_parameter} == {
            at: before.values[at] for at in before.values if ED2.entry(at).is_parameter
        }


async def test_a_zero_of_our_own_process_data_is_never_taken_for_the_value_of_a_parameter(
    twin: Cylinders, tmp_path: Path
) -> None:
    """Telegram 103 carries ramps: its first exchange has set them to 0 before anybody could read them."""
    ramps: dict[str, Raw] = {"12/61": 800, "12/64": 1_500}
    async with desk_of(twin, tmp_path, f"{ORDER}, telegram = 103") as bench:
        found = await bench.set_of()
        assert {"12/61", "12/64"} <= {at.short for at in found.unread}
        target = bench.connection.target(AXIS)
        driver = bench.connection.driver(target)
        with pytest.raises(PreconditionError):
            await driver.save(target.node)
        for address, raw in ramps.items():
            assert isinstance(raw, int)
            await driver.write(target.node, parse_address(address), raw.to_bytes(4, "little"))
        again = await bench.set_of()
        assert {address: again.values[parse_address(address)] for address in ramps} == ramps
        _, end = await bench.run({"12/61": 900, "12/207": 8_000})
        assert end is End.NEW
        assert bench.memory({"12/61": 900, "12/64": 1_500})
