"""A motor goes into its drive by a restore: through plan, writes, save and proof, and is noted once that is done."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.errors import MotorUnknownError, UsageError
from app.model.address import Address, parse_address
from app.model.motor import Draft, Motor
from app.model.restore.plan import Treatment, Why
from app.service.motors import examples, live_motor, read_motor
from app.service.restore.motor_given import given_motor, is_motor
from app.service.restore.order import Given, Order
from app.service.restore.transaction import End
from tests.service.restore.conftest import PMC, PMM, STATION, Bench

RHO, MAX_CURRENT = Address(0x6410, 2), Address(0x6073)
WANTED = {"6402": 7, "6410:03": 3900, "6410:04": 1455, "6073": 1800, "6076": 15_200, "60F9:04": 120}
EXPERT_TERMS = {"confirm_s": None, "reason": "new motor", "expert": True, "others_confirmed": True}


async def kept(bench: Bench) -> Motor:
    """A motor of the database, with an offset that belongs to another machine."""
    values = {parse_address(address): raw for address, raw in WANTED.items()}
    return await bench.office.motors.add(Draft("Lorentz", "PM", values={**values, RHO: 77}), "Anna")


def spec_of(motor: Motor) -> str:
    return f"motor:{motor.id}@{motor.version}:{PMC}"


async def order_of(bench: Bench, motor: Motor) -> Order:
    given = await given_motor(bench.office.motors, bench.connection, spec_of(motor), "Anna")
    return Order(STATION, {PMC: given}, "Anna", **EXPERT_TERMS)  # type: ignore[arg-type]


async def test_a_motor_is_put_into_its_drive_and_noted_there(bench: Bench) -> None:
    motor = await kept(bench)
    rho = await bench.ram(PMC, "6410:02")
    prepared = await bench.desk.prepare(bench.connection, await order_of(bench, motor))
    rows = {row.place.address: row for row in prepared.plan.rows if row.place.slug == PMC}
    assert {rows[parse_address(one)].treatment for one in WANTED} <= {Treatment.WRITE, Treatment.EQUAL}
    assert rows[RHO].treatment is Treatment.SKIP
    others = [row for address, row in rows.items() if address.short not in WANTED]
    assert others and all(row.treatment is Treatment.SKIP for row in others)
    assert prepared.refusals == ()
    restore_id = await bench.desk.begin(bench.connection, prepared, prepared.hash)
    end = await bench.desk.wait(restore_id)
    done = await bench.desk.get(restore_id)
    assert end is End.NEW, done.outcome
    assert {address: await bench.ram(PMC, address) for address in WANTED} == WANTED
    assert await bench.ram(PMC, "6410:02") == rho != 77
    stored = bench.stored(PMC, "6076")
    assert stored is not None and int.from_bytes(stored, "little") == 15_200
    (assigned,) = (await bench.office.motors.assigned()).values()
    assert (assigned.device, assigned.motor_id, assigned.version) == (PMC, motor.id, 1)
    assert [one["set"]["record"] for one in done.details["devices"] if one["set"]] == [spec_of(motor)]


async def test_what_was_rolled_back_is_noted_nowhere(bench: Bench) -> None:
    motor = await kept(bench)
    before = await bench.ram(PMC, "6076")
    order = replace(await order_of(bench, motor), confirm_s=0.2)
    prepared = await bench.desk.prepare(bench.connection, order)
    end = await bench.desk.wait(await bench.desk.begin(bench.connection, prepared, prepared.hash))
    assert end is End.OLD
    assert await bench.ram(PMC, "6076") == before
    assert await bench.office.motors.assigned() == {}


async def test_a_motor_that_the_drive_holds_already_leaves_nothing_to_do(bench: Bench) -> None:
    target = bench.connection.target(PMC)
    values = await read_motor(bench.connection.driver(target), target)
    motor = await bench.office.motors.add(Draft("Lorentz", "PM", values=values), "Anna")
    prepared = await bench.desk.prepare(bench.connection, await order_of(bench, motor))
    assert {row.treatment for row in prepared.plan.rows} == {Treatment.EQUAL, Treatment.SKIP}
    equal = {row.place.address for row in prepared.plan.rows if row.treatment is Treatment.EQUAL}
    assert equal == set(live_motor(target)) - {RHO}
    (rho,) = [row for row in prepared.plan.rows if row.place.slug == PMC and row.place.address == RHO]
    assert rho.why is Why.NOT_IN_SET
    assert prepared.refusals != ()


async def test_only_what_names_a_motor_of_the_database_and_its_drive_is_taken(bench: Bench) -> None:
    motors, connection = bench.office.motors, bench.connection
    motor = await kept(bench)
    assert is_motor(spec_of(motor)) and not is_motor(motor.id)
    given: Given = await given_motor(motors, connection, spec_of(motor), "Anna")
    assert MAX_CURRENT in given.parameters.values and given.record == spec_of(motor)
    with pytest.raises(UsageError, match="is not motor:"):
        await given_motor(motors, connection, f"motor:{motor.id}:{PMC}", "Anna")
    with pytest.raises(MotorUnknownError):
        await given_motor(motors, connection, f"motor:{motor.id}@2:{PMC}", "Anna")
    for slug in (PMM, "wtg-07/blade-9/pmc"):
        with pytest.raises(UsageError):
            await given_motor(motors, connection, f"motor:{motor.id}@1:{slug}", "Anna")
    example = await given_motor(motors, connection, f"motor:{examples()[0].id}@1:{PMC}", "Anna")
    assert example.parameters.identity.device_name == "HUBSIDE TWIN PMC", "into a twin even an invented one goes"
