"""The latest set of every device as a vector: what a comparison with the whole fleet reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from sqlalchemy import Connection, func, select

from app.store.schema import set_layouts, set_records, set_vectors

CHUNK: Final = 128
"""Rows that are handed on at once: a few hundred kilobytes, which stay in the processor's cache."""


def layouts_of(connection: Connection, description_id: str) -> dict[int, tuple[str, tuple[str, ...]]]:
    """The layouts of sets of that kind of device: the version of its description, and the addresses."""
    query = select(set_layouts).where(set_layouts.c.description_id == description_id)
    return {row.id: (row.description_version, tuple(row.addresses.split())) for row in connection.execute(query)}


def scan_latest(connection: Connection, layouts: Sequence[int], take: Callable[[Sequence[Any]], None]) -> None:
    """Hand the latest set of every device to ``take``, some rows at a time, where it has one of ``layouts``."""
    # A bare column beside max() is that of the row with the maximum (SQLite, "SELECT", 2.5).
    latest = (
        select(set_records.c.id, set_records.c.device, set_records.c.hash, func.max(set_records.c.t_ns).label("t_ns"))
        .group_by(set_records.c.device)
        .subquery()
    )
    query = (
        select(latest.c.id, latest.c.device, latest.c.t_ns, set_vectors.c.layout, set_vectors.c.vector)
        .join(set_vectors, set_vectors.c.hash == latest.c.hash)
        .where(set_vectors.c.layout.in_(layouts))
    )
    rows = connection.execute(query)
    while chunk := rows.fetchmany(CHUNK):
        take(chunk)
