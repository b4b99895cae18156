"""The motor database: versions, files that are taken whole or not at all, and motors of real twins."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path

import pytest

from app.errors import (
    MotorChangedError,
    MotorFieldError,
    MotorFileError,
    MotorInventedError,
    MotorUnknownError,
    NoAnswerError,
    UsageError,
)
from app.model.address import Address
from app.model.motor import Draft, Plate, Source, entries_of
from app.service.connection import Connection
from app.service.motors import Motors, description, examples, live_motor, motor_set, read_identity, read_motor
from app.service.office.audit import AuditLog
from app.service.write import write_raw
from app.store import audit_rows
from app.store.audit_rows import Filter
from app.store.store import Store
from app.twins.line import Fault, drop
from tests.service.conftest import Served, connection, served

__all__ = ["connection", "served"]

PMC = "wtg-07/blade-1/pmc"
RHO = Address(0x6410, 2)
VOLTAGE = Address(0x6410, 3)
DRAFT = Draft("Lorentz", "PM 5.5-2", Plate(power_kw=Decimal("5.5")), {VOLTAGE: 4000}, "from the shelf")


@dataclass
class Database:
    """Motors of a store on the disk, and what was audited."""

    motors: Motors
    store: Store
    audit: AuditLog
    folder: Path

    async def audited(self) -> list[tuple[str, str, str | None]]:
        """Kind, person and device of all rows, oldest first."""
        await self.audit.flush()
        rows = await self.store.run(lambda kept: audit_rows.latest(kept, Filter(), None, 100))
        return [(row.kind, row.person, row.device) for row in reversed(rows)]


def ticking() -> Callable[[], int]:
    now = iter(range(1_700_000_000_000_000_000, 1_800_000_000_000_000_000, 1_000_000))
    return lambda: next(now)


@pytest.fixture
async def database(tmp_path: Path) -> AsyncIterator[Database]:
    store = Store.open(tmp_path / "motors")
    stamp = ticking()
    audit = AuditLog(store, stamp)
    try:
        yield Database(Motors(store, audit, stamp), store, audit, tmp_path / "motors")
        await audit.close()
    finally:
        store.close()


# -- versions ----------------------------------------------------------------------


async def test_every_change_is_a_version_and_the_earlier_ones_stay(database: Database) -> None:
    motors = database.motors
    first = await motors.add(DRAFT, "Anna")
    assert (first.version, first.source, first.person, first.invented) == (1, Source.TYPED, "Anna", False)
    second = await motors.edit(first.id, 1, replace(DRAFT, values={VOLTAGE: 3800}), "Ben")
    assert (second.version, second.person) == (2, "Ben")
    assert await motors.edit(first.id, 2, replace(DRAFT, values={VOLTAGE: 3800}), "Ben") == second, "nothing new"
    assert await motors.versions(first.id) == [second, first]
    assert await motors.get(first.id, 1) == first
    assert [motor.version for motor in await motors.all() if not motor.invented] == [2]
    assert await database.audited() == [("motor_added", "Anna", None), ("motor_changed", "Ben", None)]


async def test_who_changes_an_old_version_is_told_of_the_newer_one(database: Database) -> None:
    motors = database.motors
    first = await motors.add(DRAFT, "Anna")
    changes = [replace(DRAFT, remarks=text) for text in ("one", "other")]
    done = await asyncio.gather(*(motors.edit(first.id, 1, one, "Ben") for one in changes), return_exceptions=True)
    kinds = sorted(type(one).__name__ for one in done)
    assert kinds == ["Motor", "MotorChangedError"], "one of two at a time"
    with pytest.raises(MotorChangedError):
        await motors.edit(first.id, 3, DRAFT, "Ben")
    with pytest.raises(MotorUnknownError):
        await motors.edit("0197a000-0000-7000-8000-0000000000ff", 1, DRAFT, "Ben")
    with pytest.raises(MotorUnknownError):
        await motors.get(first.id, 9)
    with pytest.raises(MotorFieldError):
        await motors.edit(first.id, 2, replace(DRAFT, values={VOLTAGE: 70_000}), "Ben")
    assert len(await motors.versions(first.id)) == 2


async def test_a_deleted_motor_is_listed_no_more_and_stays_readable(database: Database) -> None:
    motors = database.motors
    motor = await motors.add(DRAFT, "Anna")
    await motors.delete(motor.id, "Eva")
    assert [one for one in await motors.all() if not one.invented] == []
    assert (await motors.get(motor.id)).deleted
    assert (await motors.versions(motor.id))[0].draft == motor.draft
    with pytest.raises(MotorUnknownError):
        await motors.delete(motor.id, "Eva")
    assert (await database.audited())[-1] == ("motor_deleted", "Eva", None)


async def test_motors_are_still_there_after_a_restart(database: Database, tmp_path: Path) -> None:
    motor = await database.motors.add(DRAFT, "Anna")
    await database.motors.assign(PMC, motor, "Anna")
    copy = tmp_path / "copy"
    copy.mkdir()
    await database.store.back_up(copy / "store.sqlite3")
    store = Store.open(copy)
    try:
        audit = AuditLog(store)
        again = Motors(store, audit, ticking())
        assert await again.get(motor.id) == motor
        assert (await again.assigned())[PMC].motor_id == motor.id
        await audit.close()
    finally:
        store.close()


async def test_a_motor_is_found_by_what_a_person_calls_it(database: Database) -> None:
    motors = database.motors
    first = await motors.add(DRAFT, "Anna")
    second = await motors.edit(first.id, 1, replace(DRAFT, remarks="x"), "Anna")
    for name in ("PM 5.5-2", "lorentz pm 5.5-2", first.id, first.id[:30]):
        assert await motors.find(name) == second
    assert await motors.find("PM 5.5-2@1") == first
    await motors.add(DRAFT, "Anna")
    with pytest.raises(UsageError, match="2 motors"):
        await motors.find("PM 5.5-2")
    for name in ("PM", "PM 5.5-2@x", "nothing"):
        with pytest.raises(MotorUnknownError):
            await motors.find(name)


# -- examples ----------------------------------------------------------------------


async def test_examples_are_plainly_invented_and_cannot_be_changed(database: Database) -> None:
    motors = database.motors
    found = [motor for motor in await motors.all() if motor.invented]
    assert len(found) >= 2 and tuple(found) == examples()
    for motor in found:
        assert "invented" in motor.draft.maker and motor.source is Source.EXAMPLE and "Invented" in motor.draft.remarks
        with pytest.raises(MotorInventedError):
            await motors.edit(motor.id, 1, DRAFT, "Anna")
        with pytest.raises(MotorInventedError):
            await motors.delete(motor.id, "Eva")
    assert await motors.export() == (await motors.export([])), "the export holds no examples"


# -- files -------------------------------------------------------------------------


async def test_a_file_brings_new_motors_and_new_versions(database: Database) -> None:
    motors = database.motors
    motor = await motors.add(DRAFT, "Anna")
    text = await motors.export([motor.id])
    same = await motors.take_file(text.encode(), "a.csv", "Ben")
    assert (same.added, same.changed, same.unchanged) == ((), (), (motor,))
    more = text.replace("400.0", "390.0") + text.splitlines()[1].replace(motor.id, "").replace("PM 5.5-2", "other")
    taken = await motors.take_file(more.encode(), "b.csv", "Ben")
    (added,), (changed,) = taken.added, taken.changed
    assert (changed.id, changed.version, changed.draft.values[VOLTAGE]) == (motor.id, 2, 3900)
    assert (added.draft.type, added.version, added.source, added.origin) == ("other", 1, Source.FILE, "b.csv")
    assert len([one for one in await motors.all() if not one.invented]) == 2


async def test_of_a_damaged_file_nothing_is_taken(database: Database) -> None:
    motors = database.motors
    text = "maker,type,6073\nA,one,100\nA,two,100\nA,three,500\n"
    with pytest.raises(MotorFileError) as wrong:
        await motors.take_file(text.encode(), "bad.csv", "Ben")
    assert (wrong.value.details["line"], wrong.value.details["column"]) == (4, "6073")
    assert tuple(await motors.all()) == examples()
    assert await database.audited() == []


async def test_an_example_that_went_through_a_file_stays_one(database: Database) -> None:
    motors = database.motors
    example = examples()[0]
    text = await motors.export([example.id])
    taken = await motors.take_file(text.encode(), "a.csv", "Ben")
    assert taken.unchanged == (example,) and taken.added == ()
    (row,) = (await motors.take_file(text.replace(example.id, "").encode(), "a.csv", "Ben")).added
    assert row.invented


# -- devices -----------------------------------------------------------------------


async def test_a_motor_is_read_from_a_device_over_the_wire(database: Database, connection: Connection) -> None:
    target = connection.target(PMC)
    driver = connection.driver(target)
    await write_raw(driver, target, Address(0x6073), 1500, connection.journal)
    motor = await database.motors.add_from_device(driver, target, DRAFT, "Anna")
    assert (motor.source, motor.origin, motor.draft.plate) == (Source.DEVICE, PMC, DRAFT.plate)
    assert set(motor.draft.values) == {entry.address for entry in entries_of(description())}
    assert motor.draft.values[Address(0x6073)] == 1500
    assert motor.draft.values[VOLTAGE] == 4000
    assert live_motor(target) == motor.draft.values, "the same was seen on the wire"
    assert (await database.motors.assigned())[PMC].motor_id == motor.id
    assert await database.audited() == [("motor_added", "Anna", None), ("motor_assigned", "Anna", PMC)]


async def test_what_a_device_does_not_tell_makes_no_motor(
    database: Database, connection: Connection, served: Served
) -> None:
    target = connection.target(PMC)
    assert live_motor(target) == {}, "nothing was read yet"
    with pytest.raises(UsageError, match="no oat-pmc"):
        await read_motor(connection.driver(target), connection.target("wtg-07/blade-1/pmm"))
    silent = bytes((0x10, 0x64, 3))
    served.spoil(Fault(lambda can: can.can_id == 0x580 + target.node and can.data[1:4] == silent, drop, None))
    with pytest.raises(NoAnswerError):
        await database.motors.add_from_device(connection.driver(target), target, DRAFT, "Anna")
    assert tuple(await database.motors.all()) == examples()


async def test_a_motor_becomes_a_set_of_its_drive_without_what_belongs_to_the_machine(
    database: Database, connection: Connection
) -> None:
    target = connection.target(PMC)
    identity = await read_identity(connection.driver(target), target)
    motor = await database.motors.add(replace(DRAFT, values={VOLTAGE: 3900, RHO: 7}), "Anna")
    found = motor_set(motor, target, identity, "wtg-07", "Ben", 1_700_000_000_000_000_000)
    assert found.identity.device_type == 0x00020192
    assert found.values == {VOLTAGE: 3900}
    assert (found.origin.device, found.origin.person, found.description_id) == (PMC, "Ben", "oat-pmc")
    assert motor.id in found.origin.reason and motor.title in found.origin.reason
    with pytest.raises(UsageError):
        motor_set(motor, connection.target("wtg-07/blade-1/pmm"), identity, "wtg-07", "Ben", 0)


async def test_an_example_goes_only_into_what_says_that_it_is_simulated(connection: Connection) -> None:
    target = connection.target(PMC)
    identity = await read_identity(connection.driver(target), target)
    assert motor_set(examples()[0], target, identity, "wtg-07", "Ben", 0).values[VOLTAGE] == 4000
    for name in ("PMC", None):
        with pytest.raises(MotorInventedError):
            motor_set(examples()[0], target, replace(identity, device_name=name), "wtg-07", "Ben", 0)
