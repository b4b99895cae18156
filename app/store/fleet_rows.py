"""The latest set of every device as a vector: what a comparison with the whole fleet reads."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, Final

from sqlalchemy import Connection, delete, insert, select

from app.model.set_vector import layout_of, pack
from app.model.sets import ParameterSet
from app.store.schema import set_latest, set_layouts, set_records

AHEAD_NS: Final = 24 * 3600 * 1_000_000_000
"""So far may the clock go ahead by which a set was taken; what is beyond says nothing of when it was."""
CHUNK: Final = 128
"""Rows that are handed on at once: a few hundred kilobytes, which stay in the processor's cache."""


def keep_latest(connection: Connection, record_id: str, parameters: ParameterSet, now_ns: int) -> None:
    """A record was added: it is the latest of its device, unless a later one is there.

    A fragment never takes the place of a complete set, however late it is: what it lacks would pass for equal. Nor does
    a set whose time is ahead (``AHEAD_NS``) take that of one whose time is not, and it gives its own to any such.
    """
    device, t_ns = parameters.origin.device, parameters.origin.t_ns
    known = _rank_of_latest(connection, device, now_ns)
    if known is not None and known > (parameters.complete, t_ns <= now_ns + AHEAD_NS, t_ns):
        return
    layout = layout_of(parameters.values)
    row = {
        "device": device,
        "record_id": record_id,
        "t_ns": t_ns,
        "layout": _layout_id(connection, parameters, layout),
        "vector": pack(parameters.values, layout),
    }
    connection.execute(delete(set_latest).where(set_latest.c.device == device))
    connection.execute(insert(set_latest), row)


def _rank_of_latest(connection: Connection, device: str, now_ns: int) -> tuple[bool, bool, int] | None:
    """Whether the latest set of a device is complete, and its time can be; and its time. None where there is none."""
    joined = set_latest.join(set_records, set_records.c.id == set_latest.c.record_id)
    query = select(set_latest.c.t_ns, set_records.c.unread).select_from(joined).where(set_latest.c.device == device)
    row = connection.execute(query).first()
    return None if row is None else (not json.loads(row.unread), row.t_ns <= now_ns + AHEAD_NS, row.t_ns)


def layouts_of(connection: Connection, description_id: str) -> dict[int, tuple[str, tuple[str, ...]]]:
    """The layouts of sets of that kind of device: the version of its description, and the addresses."""
    query = select(set_layouts).where(set_layouts.c.description_id == description_id)
    return {row.id: (row.description_version, tuple(row.addresses.split())) for row in connection.execute(query)}


def scan_latest(connection: Connection, layouts: Sequence[int], take: Callable[[Sequence[Any]], None]) -> None:
    """Hand the latest sets that have one of ``layouts`` to ``take``, some rows at a time.

    A row is device, record, t_ns, layout, vector.
    """
    columns = ", ".join(column.name for column in set_latest.c)
    places = ", ".join("?" * len(layouts))
    # The driver's own cursor: SQLAlchemy's rows would cost a fifth of the whole comparison.
    cursor = connection.connection.cursor()
    try:
        cursor.execute(f"SELECT {columns} FROM set_latest WHERE layout IN ({places})", list(layouts))
        while chunk := cursor.fetchmany(CHUNK):
            take(chunk)
    finally:
        cursor.close()


def _layout_id(connection: Connection, parameters: ParameterSet, layout: Sequence[str]) -> int:
    values = {
        "description_id": parameters.description_id,
        "description_version": parameters.description_version,
        "addresses": " ".join(layout),
    }
    same = [set_layouts.c[name] == value for name, value in values.items()]
    found: int | None = connection.scalar(select(set_layouts.c.id).where(*same))
    if found is not None:
        return found
    made = connection.execute(insert(set_layouts), values).inserted_primary_key
    assert made is not None  # a row of one table has its key
    return int(made[0])
