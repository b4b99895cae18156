"""Rows of battery tests and of battery changes."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import Enum

from sqlalchemy import Connection, insert, select

from app.store.schema import battery_records


class RowKind(Enum):
    """What a row keeps."""

    TEST = "test"
    CHANGE = "change"


@dataclass(frozen=True, slots=True)
class BatteryRow:
    """One record; ``content`` is JSON, ``device`` a slug."""

    id: str
    device: str
    kind: RowKind
    t_ns: int
    person: str
    content: str


def add(connection: Connection, row: BatteryRow) -> None:
    """Keep a record."""
    connection.execute(insert(battery_records), {**asdict(row), "kind": row.kind.value})


def latest(connection: Connection, device: str, kind: RowKind, most: int) -> list[str]:
    """The contents of the newest records of a device, newest first."""
    query = (
        select(battery_records.c.content)
        .where(battery_records.c.device == device, battery_records.c.kind == kind.value)
        .order_by(battery_records.c.id.desc())
        .limit(most)
    )
    return list(connection.scalars(query))
