"""A restore of a device that saves by categories: what is written, saved, left out, and where it ends."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from app.model.address import parse_address
from app.model.datatypes import Raw
from app.model.restore.plan import StepKind, Treatment, Why
from app.model.saving import saves_for
from app.model.sets import ParameterSet, dump_set, load_set
from app.model.variant import variant_of
from app.service.backup import read_device, to_set
from app.service.connection import Connection
from app.service.journal import Kind
from app.service.office.office import Office
from app.service.restore.desk import Desk
from app.service.restore.order import Cause, Given, Objection, Order, Timing
from app.service.restore.prepare import Prepared
from app.service.restore.transaction import End
from app.store.restore_rows import RestoreState
from app.store.store import Store
from app.twins.object_store import RefusedAccessError
from app.wire.sdo import Abort
from tests.service.pd4e.conftest import PD4E, SERVO, STATION, Served, connection_to, served_twin

CHANGES: dict[str, Raw] = {"2031": 1500, "6065": 300, "6073": 1200, "2701:05": 77}
"""Tuning, application, drive, customer."""
PARTS = ["application", "customer", "drive", "tuning"]
MAPPING: dict[str, Raw] = {"3602:00": 4, "3602:02": 0x60640020}
QUICK = Timing(ready_s=5.0, quiet_s=1.0, boot_s=5.0, mode_s=1.0)


@dataclass
class Bench:
    """A desk in front of one twin."""

    desk: Desk
    connection: Connection
    served: Served
    office: Office
    data: Path

    async def set_of(self) -> ParameterSet:
        target = self.connection.target(SERVO)
        return to_set(await read_device(self.connection.driver(target), target), "bench-pd4e", "Anna", "backup", 0)

    async def prepare(self, changes: Mapping[str, Raw], base: ParameterSet | None = None, **options: Any) -> Prepared:
        found = await self.set_of() if base is None else base
        wanted = replace(found, values={**found.values, **{parse_address(one): raw for one, raw in changes.items()}})
        usual: dict[str, Any] = {"confirm_s": None, "reason": "test"}
        order = Order(STATION, {SERVO: Given(wanted)}, "Anna", **{**usual, **options})
        return await self.desk.prepare(self.connection, order)

    async def run(self, changes: Mapping[str, Raw], **options: Any) -> tuple[str, End]:
        prepared = await self.prepare(changes, **options)
        restore_id = await self.desk.begin(self.connection, prepared, prepared.hash)
        return restore_id, await self.desk.wait(restore_id)

    def memory(self, changes: Mapping[str, Raw]) -> list[bytes | None]:
        return [self.served.stored(address) for address in changes]

    def ram(self, changes: Mapping[str, Raw]) -> dict[str, Raw]:
        return {address: self.served.holds(address) for address in changes}


@pytest.fixture
async def bench(connection: Connection, served: Served, tmp_path: Path) -> AsyncIterator[Bench]:
    office = Office(Store.open(tmp_path / "data"), connection.journal, connection.stamper, "tester")
    desk = Desk(office, connection.journal, connection.stamper, QUICK, data=tmp_path / "data")
    connection.gate.blocks = desk.blocks
    try:
        yield Bench(desk, connection, served, office, tmp_path / "data")
    finally:
        await desk.close()
        await office.close()


def saved(prepared: Prepared) -> list[str | None]:
    return [step.category for step in prepared.plan.steps if step.kind is StepKind.SAVE]


def whys(prepared: Prepared) -> dict[str, Why | None]:
    return {row.place.address.short: row.why for row in prepared.plan.rows if row.treatment is Treatment.SKIP}


# -- backup --------------------------------------------------------------------------------


async def test_a_set_knows_its_machine_and_survives_its_file(bench: Bench) -> None:
    parameters = await bench.set_of()
    assert parameters.complete
    identity = parameters.identity
    assert (identity.drive_serial, identity.mark) == ("TWIN-0001", "TWIN-0001")
    assert variant_of(PD4E, identity.device_name, identity.product_code) == "pd4-e591"
    assert (parameters.description_id, parameters.description_version) == (PD4E.id, PD4E.version)
    again = load_set(dump_set(parameters), "servo.json")
    assert (again, again.hash) == (parameters, parameters.hash)


async def test_reading_twice_gives_the_same_values_but_for_what_the_device_counts(bench: Bench) -> None:
    one, two = await bench.set_of(), await bench.set_of()
    differing = {address for address in one.values if one.values[address] != two.values.get(address)}
    assert not {address for address in differing if PD4E.entry(address).is_parameter}


# -- the plan ------------------------------------------------------------------------------


async def test_each_category_that_is_touched_is_saved_once(bench: Bench) -> None:
    prepared = await bench.prepare(CHANGES)
    assert not prepared.refusals
    assert saved(prepared) == PARTS
    assert saved(await bench.prepare({"6065": 300, "6066": 200})) == ["application"]


def test_saves_for_what_is_written() -> None:
    def wanted(*addresses: str) -> tuple[str | None, ...]:
        return saves_for(PD4E, map(parse_address, addresses))

    assert wanted("2031", "6065", "2031") == ("application", "tuning")
    assert wanted("6041", "6064") == ()
    assert wanted("1020:01") == (None,)
    assert wanted("1020:01", "2031") == ("tuning",)


async def test_a_mapping_is_opened_written_and_closed_by_its_count(bench: Bench) -> None:
    prepared = await bench.prepare(MAPPING)
    writes = [(step.kind, str(step.place.address), step.raw) for step in prepared.plan.steps if step.place is not None]
    assert writes == [
        (StepKind.AUXILIARY, "3602:00", 0),
        (StepKind.WRITE, "3602:02", 0x60640020),
        (StepKind.WRITE, "3602:00", 4),
    ]
    only_an_entry = await bench.prepare({"3602:02": 0x60640020})
    steps = [step for step in only_an_entry.plan.steps if step.place is not None]
    assert [(step.kind, step.raw) for step in steps[::2]] == [(StepKind.AUXILIARY, 0), (StepKind.AUXILIARY, 6)]
    gate = next(place for place in only_an_entry.goals if str(place.address) == "3602:00")
    assert only_an_entry.goals[gate] == (6, 6)


async def test_the_network_address_goes_along_only_where_that_is_chosen_and_never_with_a_restart(bench: Bench) -> None:
    address = {"2011": 0xC0A80A0A, "2031": 1500}
    assert whys(await bench.prepare(address))["2011"] is Why.NETWORK
    chosen = await bench.prepare(address, network=True)
    assert not chosen.refusals
    assert [str(place.address) for place in chosen.plan.new_address] == ["2011:00"]
    assert saved(chosen) == ["tuning", "ethernet"]
    refused = await bench.prepare(address, network=True, restart=True)
    assert [one.objection for one in refused.refusals] == [Objection.NEW_ADDRESS]


async def test_what_is_bound_to_a_machine_goes_to_the_same_machine_only(bench: Bench) -> None:
    found = await bench.set_of()
    assert "607C" not in whys(await bench.prepare({"607C": 5}, found))
    other = replace(found, identity=replace(found.identity, drive_serial="TWIN-0002"))
    assert whys(await bench.prepare({"607C": 5}, other))["607C"] is Why.OTHER_UNIT


async def test_a_set_of_another_variant_needs_an_expert(bench: Bench, tmp_path: Path) -> None:
    with served_twin("pd4-e601") as other:
        async with connection_to(other.address) as second:
            target = second.target(SERVO)
            found = to_set(await read_device(second.driver(target), target), "bench-pd4e", "Anna", "backup", 0)
    refused = await bench.prepare({"6065": 300}, found)
    assert [one.objection for one in refused.refusals] == [Objection.OTHER_VARIANT]
    assert not (await bench.prepare({"6065": 300}, found, expert=True)).refusals


# -- the way -------------------------------------------------------------------------------


async def test_new_values_stand_saved_and_proven(bench: Bench) -> None:
    restore_id, end = await bench.run({**CHANGES, **MAPPING}, restart=True)
    assert end is End.NEW
    assert bench.ram({**CHANGES, **MAPPING}) == {**CHANGES, **MAPPING}
    assert None not in bench.memory({**CHANGES, **MAPPING})
    kept = await bench.desk.get(restore_id)
    assert kept.outcome["proven"] is True
    record = await bench.desk.record(restore_id)
    assert record is not None
    rows = {row.address: row for row in record.record.rows if row.address in CHANGES}
    assert all(row.saved and row.proven for row in rows.values())
    steps = [step.address for step in record.record.steps if step.kind is StepKind.SAVE]
    assert steps == ["1010:02", "1010:03", "1010:04", "1010:05", "1010:06"]
    kinds = [one.kind for one in bench.connection.journal.latest()]
    assert kinds.count(Kind.SAVED_PART) == 5 and Kind.SAVE_PROVEN in kinds


async def test_without_a_restart_it_is_saved_and_not_proven(bench: Bench) -> None:
    restore_id, end = await bench.run(CHANGES)
    assert end is End.NEW
    assert (await bench.desk.get(restore_id)).outcome["proven"] is False
    assert None not in bench.memory(CHANGES)


async def test_what_was_not_touched_is_not_claimed_to_be_saved(bench: Bench) -> None:
    restore_id, _ = await bench.run({"2031": 1500})
    record = await bench.desk.record(restore_id)
    assert record is not None
    rows = {row.address: row.saved for row in record.record.rows}
    assert (rows["2031"], rows["6065"]) == (True, False)


async def test_a_value_that_the_device_refuses_brings_the_old_ones_back(bench: Bench) -> None:
    before = bench.ram(CHANGES)
    refuse(bench, "6073")
    restore_id, end = await bench.run(CHANGES)
    assert end is End.OLD
    assert bench.ram(CHANGES) == before
    assert bench.memory(CHANGES) == [None] * len(CHANGES)
    kept = await bench.desk.get(restore_id)
    assert (kept.outcome["cause"], kept.saves_begun) == (Cause.DEVICE_REFUSED.value, frozenset())


async def test_a_save_that_is_refused_in_the_midst_is_undone_by_saving_the_same_categories(bench: Bench) -> None:
    before = bench.ram(CHANGES)
    accept = refuse(bench, "1010:05")
    restore_id, end = await bench.run(CHANGES, restart=True)
    assert end is End.INCOMPLETE, "the save of the rollback is refused as well"
    assert bench.ram(CHANGES) == before
    accept()
    await bench.desk.roll_back(bench.connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.OLD
    kept = await bench.desk.get(restore_id)
    back = [step.address for step in kept.steps if step.kind == "save" and step.direction.value == "back"]
    assert back[-3:] == ["1010:03", "1010:04", "1010:05"], "tuning was never begun"
    await restart(bench)
    assert bench.ram(CHANGES) == before


async def test_a_connection_that_is_cut_leaves_it_incomplete_and_both_ways_lead_out(bench: Bench) -> None:
    before = bench.ram({**CHANGES, **MAPPING})
    cut(bench, "3602:02")
    restore_id, end = await bench.run({**CHANGES, **MAPPING}, restart=True)
    assert end is End.INCOMPLETE
    assert (await bench.desk.get(restore_id)).row.state is RestoreState.INCOMPLETE
    assert bench.served.holds("3602:00") == 0, "the mapping is open"
    await bench.desk.roll_back(bench.connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.OLD
    assert bench.ram({**CHANGES, **MAPPING}) == before
    cut(bench, "3602:02")
    restore_id, end = await bench.run({**CHANGES, **MAPPING}, restart=True)
    assert end is End.INCOMPLETE
    await bench.desk.resume(bench.connection, restore_id, "Anna")
    assert await bench.desk.wait(restore_id) is End.NEW
    assert bench.ram({**CHANGES, **MAPPING}) == {**CHANGES, **MAPPING}
    assert None not in bench.memory({**CHANGES, **MAPPING})


def refuse(bench: Bench, address: str) -> Callable[[], None]:
    """The device refuses writes to the object; gives what ends that."""
    cell = bench.served.device.store.at(parse_address(address))
    own = cell.guard

    def guard(_raw: Raw) -> None:
        raise RefusedAccessError(Abort.DEVICE_STATE)

    def accept() -> None:
        cell.guard = own

    cell.guard = guard
    return accept


def cut(bench: Bench, address: str) -> None:
    """All connections end when the object is written next, before it holds the new value."""
    cell = bench.served.device.store.at(parse_address(address))
    own = cell.guard

    def guard(raw: Raw) -> None:
        cell.guard = own
        bench.served.device.on_restart()
        raise RefusedAccessError(Abort.DEVICE_STATE)

    cell.guard = guard


async def restart(bench: Bench) -> None:
    target = bench.connection.target(SERVO)
    await bench.connection.driver(target).restart(target.node)
