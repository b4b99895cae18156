"""Rows of motors, of their versions, and of which device drives which motor."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, func, insert, select, update

from app.model.motor import Motor, Source, dump_draft, load_draft
from app.store.schema import motor_devices, motor_versions, motors


@dataclass(frozen=True, slots=True)
class Assigned:
    """A device drives a motor, as somebody said or as it was put into the device. ``device`` is a slug."""

    id: str
    device: str
    motor_id: str
    version: int
    t_ns: int
    person: str


def put_version(connection: Connection, motor: Motor) -> None:
    """Add a version; a motor that was deleted is listed again."""
    if not connection.execute(update(motors).where(motors.c.id == motor.id).values(deleted_ns=None)).rowcount:
        connection.execute(insert(motors), {"id": motor.id, "deleted_ns": None})
    connection.execute(
        insert(motor_versions),
        {
            "motor_id": motor.id,
            "version": motor.version,
            "t_ns": motor.t_ns,
            "person": motor.person,
            "source": motor.source.value,
            "origin": motor.origin,
            "description_version": motor.description_version,
            "content": dump_draft(motor.draft),
        },
    )


def put_versions(connection: Connection, added: Iterable[Motor]) -> None:
    """Add versions of many motors: all or none of them."""
    for motor in added:
        put_version(connection, motor)


def newest(connection: Connection) -> list[Motor]:
    """The newest version of every motor that is not deleted, in the order in which they were made."""
    last = (
        select(motor_versions.c.motor_id, func.max(motor_versions.c.version).label("version"))
        .group_by(motor_versions.c.motor_id)
        .subquery()
    )
    query = (
        _all()
        .join(last, (motor_versions.c.motor_id == last.c.motor_id) & (motor_versions.c.version == last.c.version))
        .where(motors.c.deleted_ns.is_(None))
        .order_by(motor_versions.c.motor_id)
    )
    return [_motor(row._mapping) for row in connection.execute(query)]


def versions_of(connection: Connection, motor_id: str) -> list[Motor]:
    """All versions of a motor, newest first; of a deleted one too."""
    query = _all().where(motor_versions.c.motor_id == motor_id).order_by(motor_versions.c.version.desc())
    return [_motor(row._mapping) for row in connection.execute(query)]


def delete_motor(connection: Connection, motor_id: str, t_ns: int) -> None:
    """List a motor no more."""
    connection.execute(update(motors).where(motors.c.id == motor_id).values(deleted_ns=t_ns))


def assign(connection: Connection, row: Assigned) -> None:
    """Keep which motor a device drives."""
    connection.execute(
        insert(motor_devices),
        {
            "id": row.id,
            "device": row.device,
            "motor_id": row.motor_id,
            "version": row.version,
            "t_ns": row.t_ns,
            "person": row.person,
        },
    )


def assigned(connection: Connection) -> list[Assigned]:
    """The newest row of every device, by device."""
    last = select(func.max(motor_devices.c.id)).group_by(motor_devices.c.device)
    query = select(motor_devices).where(motor_devices.c.id.in_(last)).order_by(motor_devices.c.device)
    return [Assigned(**row._mapping) for row in connection.execute(query)]


def _all() -> Any:
    return select(motor_versions, motors.c.deleted_ns).join(motors, motors.c.id == motor_versions.c.motor_id)


def _motor(row: Any) -> Motor:
    return Motor(
        id=row["motor_id"],
        version=row["version"],
        draft=load_draft(row["content"]),
        source=Source(row["source"]),
        origin=row["origin"],
        t_ns=row["t_ns"],
        person=row["person"],
        description_version=row["description_version"],
        deleted=row["deleted_ns"] is not None,
    )
