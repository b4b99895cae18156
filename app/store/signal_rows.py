"""Rows of runs of test signals: never changed, never deleted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, insert, select

from app.store.schema import signal_runs


@dataclass(frozen=True, slots=True)
class SignalRow:
    """A run: ``device`` is a slug, ``shape`` and ``why`` name its signal and its end; ``content`` is JSON."""

    id: str
    device: str
    t_ns: int
    person: str
    shape: str
    why: str
    content: str


def put_run(connection: Connection, row: SignalRow) -> None:
    """Keep a run."""
    connection.execute(
        insert(signal_runs),
        {
            "id": row.id,
            "device": row.device,
            "t_ns": row.t_ns,
            "person": row.person,
            "shape": row.shape,
            "why": row.why,
            "content": row.content,
        },
    )


def get_run(connection: Connection, run_id: str) -> SignalRow | None:
    """A run, or None."""
    found = connection.execute(select(signal_runs).where(signal_runs.c.id == run_id)).one_or_none()
    return None if found is None else SignalRow(**found._mapping)


def runs_of(connection: Connection, device: str, limit: int) -> Sequence[SignalRow]:
    """The latest runs of a device, newest first."""
    query = (
        select(signal_runs)
        .where(signal_runs.c.device == device)
        .order_by(signal_runs.c.t_ns.desc(), signal_runs.c.id.desc())
        .limit(limit)
    )
    return [SignalRow(**row._mapping) for row in connection.execute(query)]
