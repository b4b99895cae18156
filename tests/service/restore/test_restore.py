"""A restore over the wire: new, old or incomplete, and what stands in RAM, memory and store then."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from itertools import count

import pytest

from app.errors import RestoreChangedError, RestoreOpenError, RestoreStateError, UsageError
from app.model.address import parse_address
from app.model.fault import FaultOrder
from app.service.journal import Kind
from app.service.records.restore_record import Outcome
from app.service.restore.order import Cause, Objection
from app.service.restore.transaction import End
from app.service.save import restart, save
from app.service.stop import Command, command_all
from app.service.write import write_raw
from app.store.restore_rows import Direction, RestoreState, StepState, peek_open
from app.twins.faults import Instructor
from app.twins.line import Fault, drop
from app.twins.object_store import RefusedAccessError
from app.wire.frame import Can
from app.wire.sdo import Abort
from tests.service.conftest import MS, Served
from tests.service.restore.conftest import CHANGES, PMC, PMM, QUICK, Bench, holding
from tests.web.rig import wait_until

ACKNOWLEDGE = 0x60


def new_values() -> dict[tuple[str, str], int]:
    return {(slug, address): raw for slug, own in CHANGES.items() for address, raw in own.items()}


async def ram(bench: Bench) -> dict[tuple[str, str], object]:
    return {(slug, address): await bench.ram(slug, address) for slug, address in new_values()}


def download_of(node: int, address: str) -> Callable[[Can], bool]:
    at = parse_address(address)
    mux = at.major.to_bytes(2, "little") + bytes((at.minor,))
    return lambda can: can.can_id == 0x600 + node and can.data[0] >> 5 == 1 and can.data[1:4] == mux


def answer_to(node: int, address: str) -> Callable[[Can], bool]:
    at = parse_address(address)
    mux = at.major.to_bytes(2, "little") + bytes((at.minor,))
    return lambda can: can.can_id == 0x580 + node and can.data[0] == ACKNOWLEDGE and can.data[1:4] == mux


async def test_a_restore_writes_saves_and_proves_the_station(bench: Bench) -> None:
    before = await ram(bench)
    restore_id, end = await bench.run(restart=True)
    kept = await bench.desk.get(restore_id)
    assert end is End.NEW, kept.outcome
    assert kept.row.state is RestoreState.DONE and kept.outcome["proven"] is True
    assert await ram(bench) == new_values() != before
    for (slug, address), raw in new_values().items():
        stored = bench.stored(slug, address)
        assert stored is not None and int.from_bytes(stored, "little") == raw
    assert bench.desk.open == ()
    assert {step.state for step in kept.steps} == {StepState.DONE}
    assert [step.kind for step in kept.steps] == ["write"] * 5 + ["save"] * 2 + ["restart"] * 2 + ["prove"] * 2


async def test_what_the_device_counts_meanwhile_does_not_disturb(bench: Bench) -> None:
    """The charge counter goes on while the battery is charged: its old value is neither put back nor expected."""
    cell = bench.served.turbine.blades[0].pmm.device.store.cell(0x3050)
    counted = count(100)
    cell.source = lambda: next(counted)
    restore_id, end = await bench.run()
    assert end is End.NEW
    assert (PMM, parse_address("3050")) not in {
        (place.slug, place.address) for place in (await bench.desk.get(restore_id)).goals
    }
    assert await ram(bench) == new_values()


async def test_without_a_restart_it_is_saved_and_not_yet_proven(bench: Bench) -> None:
    restore_id, end = await bench.run()
    assert end is End.NEW
    assert (await bench.desk.get(restore_id)).outcome["proven"] is False


async def test_old_and_new_values_and_the_undo_set_are_kept_for_good(bench: Bench) -> None:
    before = await ram(bench)
    restore_id, _ = await bench.run()
    kept = await bench.desk.get(restore_id)
    assert {place.slug for place in kept.goals} == {PMM, PMC}
    for device in kept.details["devices"]:
        undo = await bench.office.library.get(device["before"]["record"])
        for (slug, address), raw in before.items():
            if slug == device["slug"]:
                assert undo.values[parse_address(address)] == raw


@pytest.mark.alone  # the twin waits for the disk in the middle of a transfer
async def test_each_intent_is_on_the_disk_before_its_write_leaves(bench: Bench, served: Served) -> None:
    """At the instant of every write and save another reader of the store finds its intent there."""
    seen: list[bool] = []
    path = bench.data / "store.sqlite3"

    def look(can: Can) -> bool:
        if can.can_id in (0x601, 0x60B) and can.data[0] >> 5 == 1:
            seen.append(bool(peek_open(path)) and bench.intent_on_disk(can.data[1:4]))
        return False

    served.spoil(Fault(look, drop, None))
    _, end = await bench.run()
    assert end is End.NEW
    assert seen == [True] * 7


async def test_a_refused_value_rolls_everything_back_by_itself(bench: Bench, served: Served) -> None:
    before = await ram(bench)
    blade = served.turbine.blades[0].pmc.device.store
    blade.cell(0x5683).guard = _refuse
    restore_id, end = await bench.run()
    kept = await bench.desk.get(restore_id)
    assert (end, kept.outcome["cause"]) == (End.OLD, Cause.DEVICE_REFUSED.value)
    assert kept.outcome["error"]["code"] == "sdo_abort"
    assert await ram(bench) == before
    assert bench.desk.open == () and not kept.saves_begun
    assert any(step.direction is Direction.BACK for step in kept.steps)


def _refuse(raw: object) -> None:
    if raw == 1400:
        raise RefusedAccessError(Abort.VALUE_RANGE)


async def test_a_lost_acknowledge_is_settled_by_reading_and_nothing_is_written_twice(
    bench: Bench, served: Served
) -> None:
    writes: list[Can] = []

    def note(can: Can) -> bool:
        if download_of(11, "6065")(can):
            writes.append(can)
        return False

    served.spoil(Fault(note, drop, None))
    served.spoil(Fault(answer_to(11, "6065"), drop))
    _, end = await bench.run()
    assert end is End.NEW and len(writes) == 1


async def test_nobody_confirms_and_the_old_values_come_back(bench: Bench) -> None:
    before = await ram(bench)
    restore_id = await bench.begin(confirm_s=0.3)
    assert await bench.desk.wait(restore_id) is End.OLD
    assert (await bench.desk.get(restore_id)).outcome["cause"] == Cause.NOT_CONFIRMED.value
    assert await ram(bench) == before
    with pytest.raises(RestoreStateError):
        await bench.desk.confirm(restore_id, "Anna")


async def test_a_person_confirms_what_stands_in_ram(bench: Bench) -> None:
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    transaction = bench.desk.at_work(restore_id)
    assert transaction is not None and transaction.left_s is not None and 25 < transaction.left_s <= 30
    assert await ram(bench) == new_values()
    assert bench.stored(PMM, "3110:01") is None, "nothing is saved before"
    await bench.desk.confirm(restore_id, "Berta")
    assert await bench.desk.wait(restore_id) is End.NEW
    assert (await bench.desk.get(restore_id)).outcome["confirmed_by"] == "Berta"


async def test_a_person_wants_the_old_values(bench: Bench) -> None:
    before = await ram(bench)
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    await bench.desk.roll_back(bench.connection, restore_id, "Berta")
    assert await bench.desk.wait(restore_id) is End.OLD
    assert await ram(bench) == before


async def test_the_gate_is_shut_while_it_is_open_and_opens_at_its_end(bench: Bench) -> None:
    connection = bench.connection
    target, other = connection.target(PMM), connection.target("wtg-07/blade-2/pmm")
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    driver, journal, stamper = connection.driver(target), connection.journal, connection.stamper
    for attempt in (
        lambda: write_raw(driver, target, parse_address("3110:01"), 480, journal),
        lambda: save(driver, target, journal, stamper),
        lambda: restart(driver, target, journal, stamper),
    ):
        with pytest.raises(RestoreOpenError):
            await attempt()
    assert (await write_raw(driver, other, parse_address("3110:01"), 480, journal)).verified, "another station goes on"
    await bench.desk.roll_back(connection, restore_id, "Anna")
    await bench.desk.wait(restore_id)
    assert (await write_raw(driver, target, parse_address("3110:01"), 480, journal)).verified


async def test_a_pulled_cable_leaves_it_incomplete_and_both_ways_lead_out(bench: Bench, served: Served) -> None:
    before = await ram(bench)
    for goal, after in ((End.OLD, before), (End.NEW, new_values())):
        served.spoil(Fault(download_of(11, "6065"), _cut(served)))
        restore_id, end = await bench.run()
        assert end is End.INCOMPLETE
        assert (await bench.desk.get(restore_id)).outcome["cause"] == Cause.BUS_LOST.value
        assert [row.id for row in bench.desk.open] == [restore_id]
        await bench.until_connected()
        order = bench.desk.roll_back if goal is End.OLD else bench.desk.resume
        await order(bench.connection, restore_id, "Berta")
        assert await bench.desk.wait(restore_id) is goal
        assert await ram(bench) == after
        assert bench.desk.open == ()


def _cut(served: Served) -> Callable[[Can], list[tuple[int, Can]]]:
    def act(_can: Can) -> list[tuple[int, Can]]:
        served.cut()
        return []

    return act


@pytest.mark.parametrize("address", ["6065", "5683"])
async def test_a_device_that_lost_power_is_brought_back_to_the_old_values(
    bench: Bench, served: Served, address: str
) -> None:
    before = await ram(bench)
    instructor = Instructor(served.turbine, served.line)

    def cut(_can: Can) -> list[tuple[int, Can]]:
        instructor.inject(FaultOrder("power_cut", node=11, values={"off_s": 0.2}))
        return []

    served.spoil(Fault(download_of(11, address), cut))
    restore_id, end = await bench.run()
    kept = await bench.desk.get(restore_id)
    assert end is End.OLD, kept.outcome
    assert await ram(bench) == before


async def test_a_power_cut_while_saving_ends_old_with_the_memory_written_again(bench: Bench, served: Served) -> None:
    before = await ram(bench)
    instructor = Instructor(served.turbine, served.line)

    def cut(can: Can) -> list[tuple[int, Can]]:
        instructor.inject(FaultOrder("power_cut", node=1, values={"off_s": 0.2}))
        return [(0, can)]

    served.spoil(Fault(download_of(1, "1010:03"), cut))
    restore_id, end = await bench.run(restart=True)
    kept = await bench.desk.get(restore_id)
    assert end is End.OLD, kept.outcome
    assert kept.outcome["cause"] == Cause.SAVE_FAILED.value
    assert await ram(bench) == before
    back = [step for step in kept.steps if step.direction is Direction.BACK]
    assert "save" in {step.kind for step in back}


async def test_a_tool_that_ends_leaves_it_open_for_the_next_one(bench: Bench) -> None:
    before = await ram(bench)
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    await bench.desk.close()
    kept = await bench.desk.get(restore_id)
    assert (kept.row.state, kept.outcome["cause"]) == (RestoreState.INCOMPLETE, Cause.TOOL_ENDED.value)
    again = bench.another_desk()
    assert [row.id for row in again.open] == [restore_id]
    await again.roll_back(bench.connection, restore_id, "Berta")
    assert await again.wait(restore_id) is End.OLD
    assert await ram(bench) == before


async def test_an_axis_that_is_driven_meanwhile_ends_the_writing(bench: Bench) -> None:
    """FEATHER goes through, and the restore gives way; how long it waits for the axis is limited."""
    connection = bench.connection
    bench.desk = bench.another_desk(replace(QUICK, quiet_s=0.1))
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    sent = await command_all(connection.axes(), Command.FEATHER, connection.journal, connection.stamper)
    assert all(one.error is None for one in sent)
    await bench.desk.confirm(restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    kept = await bench.desk.get(restore_id)
    assert (kept.outcome["cause"], kept.saves_begun) == (Cause.DRIVE_ENABLED.value, frozenset())
    await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    bench.desk = bench.another_desk()
    await bench.desk.resume(connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.NEW


async def test_who_takes_it_up_again_finds_the_station_fit(bench: Bench, served: Served) -> None:
    """What held when it began must hold again; the way back needs neither battery nor recording."""
    served.spoil(Fault(download_of(11, "6065"), _cut(served)))
    restore_id, end = await bench.run()
    assert end is End.INCOMPLETE
    await bench.until_connected()
    connection = bench.connection
    status = served.turbine.blades[0].pmm.device.store.cell(0x3000)
    neighbour = served.turbine.blades[1].pmc.device.store.cell(0x6064)
    serial = served.turbine.blades[0].pmc.device.store.cell(0x1018, 4)
    recording = connection.recording

    async def resumed() -> tuple[object, object]:
        await bench.desk.resume(connection, restore_id, "Berta")
        assert await bench.desk.wait(restore_id) is End.INCOMPLETE
        outcome = (await bench.desk.get(restore_id)).outcome
        return outcome["cause"], (outcome.get("cause_details") or {}).get("objection_key")

    for cell, raw, objection in (
        (status, 0x08, Objection.BATTERY),
        (neighbour, 0, Objection.OTHER_BLADES),
        (serial, 4711, None),
    ):
        end_it = holding(cell, raw)
        expected = (Cause.OTHER_DEVICE.value, None)
        assert await resumed() == (expected if objection is None else (Cause.NOT_FIT.value, objection.text_key))
        end_it()
    connection.recording = None
    assert await resumed() == (Cause.NOT_FIT.value, Objection.NOT_RECORDING.text_key)
    end_it = holding(status, 0x08)
    await bench.desk.roll_back(connection, restore_id, "Berta")
    assert await bench.desk.wait(restore_id) is End.OLD
    end_it()
    connection.recording = recording


async def test_an_expert_gives_up_what_can_never_be_finished(bench: Bench, served: Served) -> None:
    """Its device is gone for good: the gate opens for a reason that is audited, and the record says what that means."""
    served.spoil(Fault(download_of(11, "6065"), _cut(served)))
    restore_id, end = await bench.run()
    assert end is End.INCOMPLETE
    await bench.until_connected()
    connection, target = bench.connection, bench.connection.target(PMM)
    driver = connection.driver(target)
    with pytest.raises(UsageError):
        await bench.desk.give_up(restore_id, "Berta", "  ")
    with pytest.raises(RestoreOpenError):
        await write_raw(driver, target, parse_address("3110:01"), 480, connection.journal)
    await bench.desk.give_up(restore_id, "Berta", "PMC exchanged")
    assert bench.desk.open == ()
    assert (await write_raw(driver, target, parse_address("3110:01"), 480, connection.journal)).verified
    told = next(entry for entry in connection.journal.latest() if entry.kind is Kind.RESTORE_GIVEN_UP)
    assert (told.person, told.details["reason"]) == ("Berta", "PMC exchanged")
    kept = await bench.desk.get(restore_id)
    assert (kept.row.state, kept.outcome["given_up_by"]) == (RestoreState.GIVEN_UP, "Berta")
    sealed = await bench.desk.record(restore_id)
    assert sealed is not None and sealed.record.outcome is Outcome.GIVEN_UP
    assert not any(row.verified or row.saved or row.proven for row in sealed.record.rows), "nothing of it is claimed"
    assert any(one.details.get("reason") == "PMC exchanged" for one in sealed.record.events)
    for again in (bench.desk.resume, bench.desk.roll_back):
        with pytest.raises(RestoreStateError):
            await again(connection, restore_id, "Berta")
    assert bench.another_desk().open == (), "nor for the next run of the tool"


async def test_a_recording_that_ends_halts_the_restore(bench: Bench) -> None:
    connection = bench.connection
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    recording, connection.recording = connection.recording, None
    await bench.desk.confirm(restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    kept = await bench.desk.get(restore_id)
    assert (kept.outcome["cause"], kept.saves_begun) == (Cause.NOT_FIT.value, frozenset()), "nothing was saved"
    connection.recording = recording


async def test_another_masters_write_is_not_saved(bench: Bench) -> None:
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    target = bench.connection.target(PMM)
    await bench.connection.driver(target).write(1, parse_address("30FC:02"), (652).to_bytes(2, "little"))
    await bench.desk.confirm(restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.OLD
    kept = await bench.desk.get(restore_id)
    assert (kept.outcome["cause"], kept.saves_begun) == (Cause.CHANGED.value, frozenset())
    assert kept.outcome["cause_details"] == {"differing": "30FC:02"}


async def test_a_plan_that_nobody_looked_at_is_not_begun(bench: Bench) -> None:
    prepared = await bench.desk.prepare(bench.connection, await bench.order())
    target = bench.connection.target(PMM)
    await write_raw(bench.connection.driver(target), target, parse_address("3110:01"), 480, bench.connection.journal)
    anew = await bench.desk.prepare(bench.connection, await bench.order())
    assert anew.hash != prepared.hash
    with pytest.raises(RestoreChangedError):
        await bench.desk.begin(bench.connection, anew, prepared.hash)
    assert bench.desk.open == ()


async def test_one_at_a_time_whoever_asks_at_once(bench: Bench) -> None:
    prepared = await bench.desk.prepare(bench.connection, await bench.order(confirm_s=30.0))
    begun = await asyncio.gather(
        *(bench.desk.begin(bench.connection, prepared, prepared.hash) for _ in range(2)), return_exceptions=True
    )
    assert [type(one) for one in begun] == [str, RestoreOpenError]
    (row,) = await bench.desk.latest()
    with pytest.raises(RestoreOpenError):
        await bench.desk.prepare(bench.connection, await bench.order())
    await bench.desk.close()
    bench.desk = bench.another_desk()
    ways = (bench.desk.resume, bench.desk.roll_back)
    taken = await asyncio.gather(*(way(bench.connection, row.id, "Anna") for way in ways), return_exceptions=True)
    assert taken[0] is None
    assert await bench.desk.wait(row.id) in (End.NEW, End.OLD)
    assert bench.desk.open == ()


async def test_a_store_that_fails_stops_the_writing_at_once(bench: Bench) -> None:
    """What cannot be journalled is not written: no way back is tried either, for it could not be journalled."""
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    blocker = await bench.hold_store()
    await bench.desk.confirm(restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    blocker()
    assert [row.id for row in bench.desk.open] == [restore_id]
    assert bench.stored(PMM, "3110:01") is None
    with pytest.raises(RestoreOpenError):
        target = bench.connection.target(PMM)
        await save(bench.connection.driver(target), target, bench.connection.journal, bench.connection.stamper)
    assert (await bench.desk.get(restore_id)).row.state is RestoreState.INCOMPLETE, "whatever the store still says"
    await bench.desk.resume(bench.connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.NEW


async def test_a_slow_memory_is_waited_for_and_a_failing_one_ends_old(bench: Bench, served: Served) -> None:
    before = await ram(bench)
    memory = served.turbine.blades[0].pmm.device.memory
    memory.failing = True
    restore_id, end = await bench.run()
    assert end is End.INCOMPLETE, "the old values could not be saved again either"
    kept = await bench.desk.get(restore_id)
    assert kept.outcome["first_cause"] == Cause.SAVE_FAILED.value
    memory.failing, memory.slow_ns = False, 700 * MS
    await bench.desk.roll_back(bench.connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.OLD
    assert await ram(bench) == before


async def test_late_acknowledges_do_not_lead_astray(bench: Bench, served: Served) -> None:
    """Every answer of the PMM comes 700 ms late, longer than is waited for."""
    instructor = Instructor(served.turbine, served.line)
    restore_id = await bench.begin({PMM: {"3110:01": 490, "30FC:02": 655}}, confirm_s=30.0)
    order = FaultOrder("late_sdo_ack", node=1, values={"delay_ms": 700.0}, seconds=1.5)
    served.thread.call_soon(lambda: _inject(instructor, order))
    transaction = bench.desk.at_work(restore_id)
    assert transaction is not None
    await wait_until(lambda: transaction.state in (RestoreState.AWAITING_CONFIRMATION, RestoreState.ROLLED_BACK))
    if transaction.state is RestoreState.AWAITING_CONFIRMATION:
        await bench.desk.confirm(restore_id, "Anna")
    end = await bench.desk.wait(restore_id)
    assert end in (End.NEW, End.OLD)
    assert await bench.ram(PMM, "3110:01") == (490 if end is End.NEW else 500)
    assert await bench.ram(PMM, "30FC:02") == (655 if end is End.NEW else 650)


def _inject(instructor: Instructor, order: FaultOrder) -> None:
    instructor.inject(order)
