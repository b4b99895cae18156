"""The motor database: who may look at everything, add and change as a technician, delete as an expert."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from app.errors import UsageError
from app.model.address import Address
from app.model.motor import entries_of
from app.model.motor_diff import compare_plates, compare_values
from app.model.od_export import description_dict, entry_dict
from app.model.roles import Role
from app.service.bench import Bench
from app.service.motors import description, live_motor
from app.web.attachment import as_attachment
from app.web.deps import DEVICE, BenchOf, ConnectionOf, PersonOf, TargetOf, needs
from app.web.models import Nothing
from app.web.models.motors import (
    AssignedDoc,
    Assignment,
    DraftIn,
    MotorChange,
    MotorComparison,
    MotorDoc,
    MotorFile,
    MotorForm,
    MotorFromDevice,
    MotorList,
    MotorsTaken,
    PlateRowDoc,
    SideDoc,
    ValueRowDoc,
    plate_fields,
)

router = APIRouter()
MOTOR = "/motors/{motor_id}"
Spec = Annotated[str, Query(max_length=300, examples=["motor:0197a000-0000-7000-8000-00000000e001@1"])]


@router.get("/motors")
async def motors(bench: BenchOf) -> MotorList:
    """The newest version of every motor, the invented examples last."""
    database = bench.office.motors
    found, assigned = await database.all(), await database.assigned()
    return MotorList(
        motors=[MotorDoc.of(motor) for motor in found], assigned=[AssignedDoc.of(row) for row in assigned.values()]
    )


@router.get("/motors/form")
async def motor_form() -> MotorForm:
    """What a form of a motor is drawn from: fields, units, limits and names of values."""
    whole = description_dict(description())
    return MotorForm(
        plate=plate_fields(),
        description={**whole, "entries": [entry_dict(entry) for entry in entries_of(description())]},
    )


@router.get("/motors/export", response_class=Response)
async def export_motors(
    bench: BenchOf, ids: Annotated[list[str] | None, Query(max_length=1000, examples=[[]])] = None
) -> Response:
    """Motors as CSV: those named, else all but the examples."""
    text = await bench.office.motors.export(ids)
    headers = as_attachment("hubside-motors.csv")
    return Response(text.encode(), media_type="text/csv; charset=utf-8", headers=headers)


@router.get("/motors/compare")
async def compare_motors(bench: BenchOf, left: Spec, right: Spec) -> MotorComparison:
    """Two of ``motor:ID``, ``motor:ID@VERSION`` and ``live:TURBINE/STATION/DEVICE`` beside each other.

    Of a device that is what was last seen on the wire; nothing is sent.
    """
    sides = [await _side(bench, spec) for spec in (left, right)]
    (one, values), (other, others) = sides
    plates = [side.motor.plate.plate() for side, _values in sides if side.motor is not None]
    return MotorComparison(
        left=one,
        right=other,
        plate=[PlateRowDoc.of(row) for row in compare_plates(*plates)] if len(plates) == len(sides) else [],
        values=[ValueRowDoc.of(row) for row in compare_values(description(), values, others)],
    )


@router.post("/motors", dependencies=[needs(Role.TECHNICIAN)])
async def add_motor(bench: BenchOf, person: PersonOf, given: DraftIn) -> MotorDoc:
    """Add a motor that was typed."""
    return MotorDoc.of(await bench.office.motors.add(given.draft(), person.person))


@router.post("/motors/import", dependencies=[needs(Role.TECHNICIAN)])
async def import_motors(bench: BenchOf, person: PersonOf, given: MotorFile) -> MotorsTaken:
    """Take the motors of a CSV file: all of them or, where anything is wrong in it, none."""
    taken = await bench.office.motors.take_file(given.data, given.name, person.person)
    return MotorsTaken(
        added=[MotorDoc.of(motor) for motor in taken.added],
        changed=[MotorDoc.of(motor) for motor in taken.changed],
        unchanged=[MotorDoc.of(motor) for motor in taken.unchanged],
    )


@router.get(f"{MOTOR}/versions")
async def motor_versions(bench: BenchOf, motor_id: str) -> list[MotorDoc]:
    """All versions of a motor, newest first, also of one that was deleted."""
    return [MotorDoc.of(motor) for motor in await bench.office.motors.versions(motor_id)]


@router.put(MOTOR, dependencies=[needs(Role.TECHNICIAN)])
async def change_motor(bench: BenchOf, person: PersonOf, motor_id: str, given: MotorChange) -> MotorDoc:
    """Make another version of a motor; those before stay readable."""
    return MotorDoc.of(await bench.office.motors.edit(motor_id, given.based_on, given.draft(), person.person))


@router.delete(MOTOR, dependencies=[needs(Role.EXPERT)])
async def delete_motor(bench: BenchOf, person: PersonOf, motor_id: str) -> Nothing:
    """List a motor no more; its versions stay readable."""
    await bench.office.motors.delete(motor_id, person.person)
    return Nothing()


@router.post(f"{MOTOR}/assign", dependencies=[needs(Role.TECHNICIAN)])
async def assign_motor(bench: BenchOf, person: PersonOf, motor_id: str, given: Assignment) -> Nothing:
    """Note that a device drives this motor: what it is compared with from now on. Nothing is sent."""
    slug = given.device
    if all(device.slug != slug for turbine in bench.sites.turbines.values() for device in turbine.devices):
        raise UsageError(reason=f"no device '{slug}'")
    motor = await bench.office.motors.get(motor_id, given.version)
    await bench.office.motors.assign(slug, motor, person.person)
    return Nothing()


@router.post(f"{DEVICE}/motor", dependencies=[needs(Role.TECHNICIAN)])
async def add_motor_of_device(
    bench: BenchOf, connection: ConnectionOf, target: TargetOf, person: PersonOf, given: MotorFromDevice
) -> MotorDoc:
    """Read the motor's parameters of a device over the wire, and add the motor with them."""
    driver = connection.driver(target)
    return MotorDoc.of(await bench.office.motors.add_from_device(driver, target, given.draft(), person.person))


async def _side(bench: Bench, spec: str) -> tuple[SideDoc, dict[Address, int]]:
    """One side of a comparison with its values. Raises MotorUnknownError, NotConnectedError, UsageError."""
    kind, _, name = spec.partition(":")
    if kind == "live":
        return SideDoc(device=name, motor=None), live_motor(bench.require().target(name))
    if kind != "motor":
        raise UsageError(reason=f"'{spec}' is neither motor:ID nor live:TURBINE/STATION/DEVICE")
    motor = await bench.office.motors.find(name)
    return SideDoc(device=None, motor=MotorDoc.of(motor)), dict(motor.draft.values)
