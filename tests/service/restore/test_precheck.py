"""What the pre-check refuses, and that it refuses nothing else: each reason is brought about in twins or sets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from app.errors import RestoreRefusedError, UsageError
from app.model.address import parse_address
from app.model.fault import FaultOrder
from app.model.sets import Identity, ParameterSet
from app.model.texts import load_texts
from app.service.restore.assign import assign
from app.service.restore.order import Given, Objection, Order
from app.service.restore.precheck import is_same_unit
from app.service.restore.survey import targets_of
from app.service.stop import Command, command_all
from app.service.write import write_raw
from app.twins.faults import Instructor
from app.twins.object_store import Cell
from tests.service.restore.conftest import PMC, PMM, STATION, Bench, holding
from tests.web.rig import wait_until

Found = set[tuple[Objection, str]]


async def refused(bench: Bench, order: Order) -> Found:
    """What speaks against an order; every reason has words in both languages, with all its details filled in."""
    prepared = await bench.desk.prepare(bench.connection, order)
    for refusal in prepared.refusals:
        for language in ("en", "de"):
            text = load_texts(language)(refusal.objection.text_key, **refusal.details)
            assert "–" not in text and "{" not in text and text != refusal.objection.text_key, text
    return {(one.objection, one.device) for one in prepared.refusals}


def with_set(order: Order, slug: str, change: Callable[[ParameterSet], ParameterSet]) -> Order:
    given = order.given[slug]
    return replace(order, given={**order.given, slug: Given(change(given.parameters))})


def other_identity(**parts: Any) -> Callable[[ParameterSet], ParameterSet]:
    return lambda one: replace(one, identity=replace(one.identity, **parts))


async def test_sets_that_do_not_fit_are_refused(bench: Bench) -> None:
    good = await bench.order()
    assert await refused(bench, good) == set()
    pmm_set = good.given[PMM].parameters
    cases: list[tuple[Order, Found]] = [
        (with_set(good, PMC, lambda _: pmm_set), {(Objection.OTHER_DEVICE_TYPE, PMC)}),
        (with_set(good, PMM, other_identity(device_type=0x192)), {(Objection.OTHER_DEVICE_TYPE, PMM)}),
        (with_set(good, PMM, lambda one: replace(one, description_version="2.0.0")), {(Objection.DESCRIPTION, PMM)}),
        (with_set(good, PMM, lambda one: replace(one, description_version="1.9.0")), set()),
        (with_set(good, PMC, other_identity(software="2.00")), {(Objection.FIRMWARE, PMC)}),
        (with_set(good, PMC, other_identity(software="1.05")), set()),
        (replace(good, homeless=(good.given[PMC],)), {(Objection.NO_DEVICE, "")}),
        (await bench.order({PMM: {}, PMC: {}}), {(Objection.NOTHING_TO_DO, "")}),
        (await bench.order({PMM: {"30FC:02": 700}}), {(Objection.RULES, PMM), (Objection.NO_ORDER, "")}),
    ]
    for order, expected in cases:
        assert await refused(bench, order) == expected
    nothing = await refused(bench, replace(good, given={}))
    assert (Objection.NOTHING_GIVEN, "") in nothing


async def test_a_serial_number_that_contradicts_the_nameplate_is_refused(bench: Bench) -> None:
    await bench.office.library.set_nameplate(PMC, "P-4711", "P-4711", "Anna")
    good = await bench.order()
    assert await refused(bench, good) == set()
    assert await refused(bench, with_set(good, PMC, other_identity(nameplate="P-4711"))) == set()
    exchanged = with_set(good, PMC, other_identity(nameplate="P-0815"))
    assert await refused(bench, exchanged) == {(Objection.IDENTITY, PMC)}


def test_the_same_unit_is_known_by_its_serial_number_else_by_its_nameplate() -> None:
    serial, plate = Identity(serial=7), Identity(nameplate="A")
    assert is_same_unit(serial, Identity(serial=7), None)
    assert not is_same_unit(serial, Identity(serial=8), None)
    assert not is_same_unit(serial, Identity(), None), "a device that tells no number proves nothing"
    assert is_same_unit(plate, Identity(), "A")
    assert not is_same_unit(plate, Identity(), "B")
    assert not is_same_unit(Identity(), Identity(), None)
    assert not is_same_unit(Identity(serial=7, nameplate="A"), Identity(serial=7), "B"), "they contradict each other"
    assert not is_same_unit(Identity(serial=7, vendor_id=1), Identity(serial=7, vendor_id=2), None)
    assert not is_same_unit(Identity(serial=7, product_code=1), Identity(serial=7, product_code=2), None)
    assert not is_same_unit(Identity(serial=0), Identity(serial=0), None), "0 is no number"
    assert is_same_unit(Identity(serial=0, nameplate="A"), Identity(serial=0), "A")


async def test_values_of_another_unit_stay_where_they_are(bench: Bench) -> None:
    """The rho offset is bound to its machine: it goes back to the very same one, and to no other."""
    order = await bench.order({PMC: {"6410:02": 11, "6065": 150}})
    own = await bench.desk.prepare(bench.connection, order)
    foreign = await bench.desk.prepare(bench.connection, with_set(order, PMC, other_identity(serial=1)))
    place = next(place for place in own.goals if place.address == parse_address("6410:02"))
    assert own.same_unit == {PMC: True} and own.goals[place][1] == 11
    assert foreign.same_unit == {PMC: False} and place not in foreign.goals
    assert own.hash != foreign.hash


async def test_a_station_that_is_not_fit_is_refused(bench: Bench) -> None:
    good = await bench.order()
    own, other = bench.served.turbine.blades[0], bench.served.turbine.blades[1]
    pmm, pmc, neighbour = own.pmm.device.store, own.pmc.device.store, other.pmc.device.store
    other_pmc = "wtg-07/blade-2/pmc"
    cases: list[tuple[Cell, int, Found]] = [
        (pmm.cell(0x3000), 0x08, {(Objection.BATTERY, PMM)}),
        (pmm.cell(0x3000), 0x20, {(Objection.SUPPLY, PMM)}),
        (pmm.cell(0x3004), 0x20, {(Objection.SUPPLY, PMM)}),
        (pmc.cell(0x6041), 0x0637, {(Objection.DRIVE_ENABLED, PMC)}),
        (pmc.cell(0x6041), 0x0633, {(Objection.DRIVE_ENABLED, PMC)}),
        (pmc.cell(0x6041), 0x0608, set()),
        (pmc.cell(0x606C), 11, {(Objection.DRIVE_MOVING, PMC)}),
        (pmc.cell(0x606C), -11, {(Objection.DRIVE_MOVING, PMC)}),
        (pmc.cell(0x606C), 9, set()),
        (neighbour.cell(0x6064), 7499, {(Objection.OTHER_BLADES, other_pmc)}),
        (neighbour.cell(0x6064), 7500, set()),
        (pmc.cell(0x6064), 0, set()),
    ]
    for cell, raw, expected in cases:
        end = holding(cell, raw)
        assert await refused(bench, good) == expected, (cell.entry.address, raw)
        end()
    end = holding(neighbour.cell(0x6064), 0)
    assert await refused(bench, replace(good, others_confirmed=True)) == {(Objection.OTHER_BLADES, other_pmc)}
    assert await refused(bench, replace(good, others_confirmed=True, expert=True)) == set()
    end()


async def test_a_drive_in_motion_is_refused(bench: Bench) -> None:
    good = await bench.order()
    connection = bench.connection
    target = connection.target(PMC)
    slow = parse_address("5681")  # so that it still moves when all is read, however long that takes
    await write_raw(connection.driver(target), target, slow, 100, connection.journal)
    await command_all(connection.axes(), Command.FEATHER, connection.journal, connection.stamper)
    found = await refused(bench, good)
    assert {(Objection.DRIVE_ENABLED, PMC), (Objection.DRIVE_MOVING, PMC)} <= found
    with pytest.raises(RestoreRefusedError) as caught:
        prepared = await bench.desk.prepare(connection, good)
        await bench.desk.begin(connection, prepared)
    assert caught.value.details["refusals"][0]["text_key"] == "restore.refusal.drive-enabled"
    assert bench.desk.open == ()


async def test_another_master_and_no_recording_are_refused(bench: Bench) -> None:
    good = await bench.order()
    connection = bench.connection
    recording, connection.recording = connection.recording, None
    assert await refused(bench, good) == {(Objection.NOT_RECORDING, "")}
    connection.recording = recording
    instructor = Instructor(bench.served.turbine, bench.served.line)
    order = FaultOrder("second_master", node=3, values={"index": 0x3110, "sub": 1, "raw": 500, "interval_ms": 50.0})
    bench.served.thread.call_soon(lambda: _inject(instructor, order))
    await wait_until(lambda: bool(connection.buses["can0"].status.masters))
    assert (Objection.OTHER_MASTER, "") in await refused(bench, good)


def _inject(instructor: Instructor, order: FaultOrder) -> None:
    instructor.inject(order)


async def test_an_incomplete_restore_is_named(bench: Bench) -> None:
    restore_id = await bench.begin(confirm_s=30.0)
    await bench.desk.close()
    bench.desk = bench.another_desk()
    assert (Objection.RESTORE_OPEN, "") in await refused(bench, await bench.order())
    await bench.desk.roll_back(bench.connection, restore_id, "Anna")
    await bench.desk.wait(restore_id)


async def test_a_set_goes_to_its_own_device_else_to_the_one_of_its_kind(bench: Bench) -> None:
    targets = targets_of(bench.connection, STATION)
    own = Given(await bench.set_of(PMC))
    elsewhere = Given(
        replace(own.parameters, origin=replace(own.parameters.origin, device="wtg-01/blade-3/pmc", node=13))
    )
    foreign = Given(replace(elsewhere.parameters, description_id="nanotec-pd4e"))
    assert assign(targets, [own]) == ({PMC: own}, ())
    assert assign(targets, [elsewhere]) == ({PMC: elsewhere}, ())
    assert assign(targets, [foreign]) == ({}, (foreign,))
    with pytest.raises(UsageError):
        assign(targets, [own, elsewhere])
    with pytest.raises(UsageError):
        targets_of(bench.connection, "wtg-07/blade-9")
