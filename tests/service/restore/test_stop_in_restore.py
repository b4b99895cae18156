"""STOP and FEATHER while a restore runs: it halts, and nothing that it does takes them back."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from app.model.address import parse_address
from app.model.description import Verify
from app.model.restore.plan import Why
from app.model.station import Place
from app.service.connection import Connection
from app.service.journal import Entry, Kind
from app.service.restore import prepare, steps
from app.service.restore.order import Cause
from app.service.restore.survey import boots_of
from app.service.restore.transaction import End
from app.service.save import save
from app.service.stop import CONTROLWORD, Command, command_all
from app.service.write import write_raw
from app.store.restore_rows import Direction, RestoreState, StepState
from tests.service.conftest import Served
from tests.service.restore.conftest import PMC, PMM, Bench, holding

HOME_OFFSET = {"607C": 1234}
"""Taken in homing mode only, and the mode changes only while the controlword asks for nothing."""


async def send(connection: Connection, command: Command) -> None:
    """A person presses the button."""
    sent = await command_all(connection.axes(), command, connection.journal, connection.stamper)
    assert all(one.error is None for one in sent)


def boots(connection: Connection) -> list[int]:
    """How often each device has started."""
    return [boots_of(target) for target in connection.targets]


def when(connection: Connection, is_it: Callable[[Entry], bool], command: Command) -> list[asyncio.Future[None]]:
    """Have ``command`` sent as soon as the journal tells of something; gives what was sent."""
    sending: list[asyncio.Future[None]] = []

    def listen(entry: Entry) -> None:
        if is_it(entry) and not sending:
            sending.append(asyncio.ensure_future(send(connection, command)))

    connection.journal.listen(listen)
    return sending


def of_the_last_save(entry: Entry) -> bool:
    """The PMC is saved after the PMM, and nothing is restarted before."""
    return entry.kind is Kind.SAVED and entry.device == PMC


async def test_a_feather_is_not_cut_short_by_a_restart(bench: Bench) -> None:
    """Whoever has sent a FEATHER keeps it: no device of the station is restarted while it stands in the controlword."""
    connection = bench.connection
    boots = [boots_of(target) for target in connection.targets]
    sending = when(connection, of_the_last_save, Command.FEATHER)
    restore_id = await bench.begin(restart=True)
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    assert sending
    kept = await bench.desk.get(restore_id)
    assert kept.outcome["cause"] == Cause.OVERTAKEN.value
    assert [boots_of(target) for target in connection.targets] == boots


async def test_a_stop_halts_the_restore_before_it_restarts_anything(bench: Bench) -> None:
    """A restart opens the safety chain and drives the other blades: not after a STOP, until a person decides."""
    connection = bench.connection
    boots = [boots_of(target) for target in connection.targets]
    sending = when(connection, of_the_last_save, Command.STOP)
    restore_id = await bench.begin(restart=True)
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    assert sending
    kept = await bench.desk.get(restore_id)
    assert kept.outcome["cause"] == Cause.OVERTAKEN.value
    assert [boots_of(target) for target in connection.targets] == boots
    await bench.desk.resume(connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.NEW, "a person has decided, knowing of the STOP"


async def test_a_stop_is_not_overwritten_to_change_the_mode(bench: Bench) -> None:
    """To change the mode of operation the controlword is written: not where a person has commanded meanwhile."""
    connection = bench.connection
    driver = connection.driver(connection.target(PMC))
    await command_all(
        connection.axes(), Command.STOP, connection.journal, connection.stamper
    )  # its bit 3 must go first
    order = await bench.order({PMC: HOME_OFFSET})
    prepared = await bench.desk.prepare(connection, order)
    before = await bench.ram(PMC, "607C")
    restore_id = await bench.desk.begin(connection, prepared, prepared.hash)
    await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    assert (await bench.desk.get(restore_id)).outcome["cause"] == Cause.OVERTAKEN.value
    assert int.from_bytes(await driver.read(11, CONTROLWORD), "little") == Command.STOP.value
    assert await bench.ram(PMC, "607C") == before
    await bench.desk.resume(connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.NEW, "a person has decided, knowing of the STOP"


async def test_a_rollback_that_nobody_asked_for_does_not_overwrite_a_stop_either(bench: Bench) -> None:
    connection = bench.connection
    driver = connection.driver(connection.target(PMC))
    await driver.write(
        11, parse_address("6060"), b"\x03", verify=Verify.ACK
    )  # it goes back there after the homing mode
    restore_id = await bench.begin({PMC: HOME_OFFSET}, confirm_s=1.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    await command_all(connection.axes(), Command.STOP, connection.journal, connection.stamper)
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    outcome = (await bench.desk.get(restore_id)).outcome
    assert (outcome["first_cause"], outcome["cause"]) == (Cause.NOT_CONFIRMED.value, Cause.OVERTAKEN.value)
    assert await bench.ram(PMC, "6040") == Command.STOP.value
    await bench.desk.roll_back(connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.OLD


async def test_it_halts_at_a_write_too_and_confirmed_in_advance_is_no_decision(bench: Bench) -> None:
    connection = bench.connection
    before = boots(connection)
    sent = when(connection, lambda entry: entry.kind is Kind.WRITTEN, Command.STOP)
    restore_id = await bench.begin(restart=True, confirm_s=None)
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    assert sent
    kept = await bench.desk.get(restore_id)
    assert (kept.outcome["cause"], kept.saves_begun) == (Cause.OVERTAKEN.value, frozenset())
    assert boots(connection) == before


async def test_a_stop_right_after_the_confirmation_is_not_forgotten(bench: Bench) -> None:
    connection = bench.connection
    before = boots(connection)
    restore_id = await bench.begin(restart=True, confirm_s=30.0)
    await bench.until_state(restore_id, RestoreState.AWAITING_CONFIRMATION)
    await asyncio.gather(bench.desk.confirm(restore_id, "Anna"), send(connection, Command.STOP))
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    assert (await bench.desk.get(restore_id)).outcome["cause"] == Cause.OVERTAKEN.value
    assert boots(connection) == before


async def test_a_stop_while_the_station_is_read_for_it_is_not_overwritten(bench: Bench) -> None:
    """Whoever ordered the restore did not know of it: the order is older than all that is read for it."""
    prepared = await bench.desk.prepare(bench.connection, await bench.order({PMC: HOME_OFFSET}))
    await send(bench.connection, Command.STOP)
    restore_id = await bench.desk.begin(bench.connection, prepared, prepared.hash)
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    assert await bench.ram(PMC, "6040") == Command.STOP.value


@pytest.mark.parametrize("command", Command)
async def test_a_save_that_is_interrupted_by_it_is_not_rolled_back_unasked(bench: Bench, command: Command) -> None:
    bench.served.turbine.blades[0].pmc.device.memory.slow_ns = 700_000_000
    restore_id = await bench.begin({PMC: {"6065": 150}})
    await bench.until_state(restore_id, RestoreState.SAVING)
    await asyncio.sleep(0.3)  # 1010h is on the wire
    await send(bench.connection, command)
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    kept = await bench.desk.get(restore_id)
    assert kept.outcome["cause"] == Cause.OVERTAKEN.value
    assert {step.direction for step in kept.steps} == {Direction.FORWARD}


async def test_who_rolls_back_after_a_stop_has_no_device_restarted_on_the_way_forward(
    bench: Bench, served: Served
) -> None:
    connection = bench.connection
    moving: list[Callable[[], None]] = []
    cell = served.turbine.blades[0].pmc.device.store.cell(0x606C)

    def hold_the_restart(entry: Entry) -> None:
        if entry.kind is Kind.SAVED and entry.device == PMC and not moving:
            moving.append(holding(cell, 500))

    connection.journal.listen(hold_the_restart)
    restore_id = await bench.begin(restart=True)
    await bench.until_state(restore_id, RestoreState.RESTARTING)
    await send(connection, Command.STOP)
    await bench.desk.roll_back(connection, restore_id, "Berta")
    moving[0]()
    end = await bench.desk.wait(restore_id)
    kept = await bench.desk.get(restore_id)
    restarted = [s for s in kept.steps if (s.direction, s.kind) == (Direction.FORWARD, "restart")]
    assert not any(step.state is StepState.DONE for step in restarted)
    assert end is End.OLD, kept.outcome


async def test_on_a_bus_without_names_every_axis_counts(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody knows which PMC belongs to the PMM that is restored: the STOP of each of them halts it."""
    for module in (prepare, steps):
        monkeypatch.setattr(module, "BARE_TURBINE", "wtg-07")
    connection = bench.connection
    before = boots(connection)
    sent = when(connection, lambda entry: entry.kind is Kind.SAVED, Command.STOP)
    restore_id = await bench.begin({PMM: {"3110:01": 490}}, restart=True)
    assert await bench.desk.wait(restore_id) is End.INCOMPLETE
    assert sent
    assert (await bench.desk.get(restore_id)).outcome["cause"] == Cause.OVERTAKEN.value
    assert boots(connection) == before


async def test_what_an_emergency_feathering_overwrites_is_not_held_against_a_restart(bench: Bench) -> None:
    """A restart opens the chain, and the feathering takes 6083h from 5683h: its stored value cannot be read then."""
    connection = bench.connection
    target = connection.target(PMC)
    driver = connection.driver(target)
    await write_raw(driver, target, parse_address("6083"), 1600, connection.journal)
    await save(driver, target, connection.journal, connection.stamper)
    restore_id, end = await bench.run({PMC: {"6065": 150}}, restart=True)
    kept = await bench.desk.get(restore_id)
    assert end is End.NEW, kept.outcome
    assert await bench.ram(PMC, "6083") == await bench.ram(PMC, "5683") != 1600
    assert (kept.outcome["proven"], kept.outcome["unproven"]) == (False, [[PMC, "6083:00"]])
    sealed = await bench.desk.record(restore_id)
    assert sealed is not None
    proven = {row.address: row.proven for row in sealed.record.rows if row.device == PMC and row.verified}
    assert (proven["6083"], proven["6065"]) == (False, True)
    assert bench.stored(PMC, "6083") == (1600).to_bytes(4, "little")


async def test_a_selection_tells_what_a_feathering_may_have_left(bench: Bench) -> None:
    chosen = frozenset({Place(PMC, parse_address("6065"))})
    order = await bench.order({PMC: {"6065": 150, "6083": 1600}}, selected=chosen)
    plan = (await bench.desk.prepare(bench.connection, order)).plan
    why = {row.place.address.short: row.why for row in plan.rows if row.place.slug == PMC}
    assert why["6083"] is Why.LEFT_BY_FEATHER
