"""Rows of visits, and the parameter sets that belong to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from sqlalchemy import Connection, delete, insert, select, update

from app.store.schema import visit_sets, visits


class Phase(Enum):
    """When the values of a visit were taken."""

    FOUND = "found"
    LEFT = "left"


@dataclass(frozen=True, slots=True)
class Visit:
    """From connecting to a turbine to "end visit". ``left_open``: nobody ended it, a later one did."""

    id: str
    turbine: str
    person: str
    started_ns: int
    ended_ns: int | None = None
    left_open: bool = False
    reason: str = ""
    work_order: str = ""


def put_visit(connection: Connection, visit: Visit) -> None:
    """Add a visit, or replace the one with this id."""
    values = {
        "id": visit.id,
        "turbine": visit.turbine,
        "person": visit.person,
        "started_ns": visit.started_ns,
        "ended_ns": visit.ended_ns,
        "left_open": int(visit.left_open),
        "reason": visit.reason,
        "work_order": visit.work_order,
    }
    if not connection.execute(update(visits).where(visits.c.id == visit.id).values(values)).rowcount:
        connection.execute(insert(visits), values)


def get_visit(connection: Connection, visit_id: str) -> Visit | None:
    """One visit."""
    found = connection.execute(select(visits).where(visits.c.id == visit_id)).first()
    return None if found is None else _visit(found._mapping)


def list_visits(connection: Connection, turbine: str | None, limit: int) -> list[Visit]:
    """The latest visits, newest first; of one turbine where named."""
    query = select(visits).order_by(visits.c.started_ns.desc(), visits.c.id.desc()).limit(limit)
    if turbine is not None:
        query = query.where(visits.c.turbine == turbine)
    return [_visit(row._mapping) for row in connection.execute(query)]


def open_visits(connection: Connection) -> list[Visit]:
    """Visits that have not ended, newest first."""
    query = select(visits).where(visits.c.ended_ns.is_(None)).order_by(visits.c.started_ns.desc())
    return [_visit(row._mapping) for row in connection.execute(query)]


def keep_sets(connection: Connection, visit_id: str, phase: Phase, contents: Mapping[str, str]) -> None:
    """Keep sets by device. As found, those that are there stay as they are; as left, they are replaced."""
    if phase is Phase.LEFT:
        kept = visit_sets.c.visit_id == visit_id, visit_sets.c.phase == phase.value
        connection.execute(delete(visit_sets).where(*kept, visit_sets.c.device.in_(list(contents))))
    known = set(
        connection.scalars(
            select(visit_sets.c.device).where(visit_sets.c.visit_id == visit_id, visit_sets.c.phase == phase.value)
        )
    )
    new = [
        {"visit_id": visit_id, "phase": phase.value, "device": device, "content": content}
        for device, content in contents.items()
        if device not in known
    ]
    if new:
        connection.execute(insert(visit_sets), new)


def sets_of(connection: Connection, visit_id: str, phase: Phase) -> dict[str, str]:
    """The sets of a visit by device."""
    query = select(visit_sets.c.device, visit_sets.c.content).where(
        visit_sets.c.visit_id == visit_id, visit_sets.c.phase == phase.value
    )
    return {row.device: row.content for row in connection.execute(query)}


def _visit(row: object) -> Visit:
    values = dict(row)  # type: ignore[call-overload]
    return Visit(**{**values, "left_open": bool(values["left_open"])})
