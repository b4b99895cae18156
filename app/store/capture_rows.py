"""Rows of captures of the scope."""

from __future__ import annotations

from sqlalchemy import Connection, delete, func, insert, select, update

from app.store.schema import scope_captures


def put_capture(
    connection: Connection, capture_id: str, trigger_ns: int, head: str, marks: str, values: bytes, in_force: str
) -> None:
    """Add one. ``head``, ``marks`` and ``in_force`` are JSON, ``values`` packed (``service.scope.capture``)."""
    row = {"id": capture_id, "trigger_ns": trigger_ns, "head": head, "marks": marks}
    connection.execute(insert(scope_captures), {**row, "samples": values, "in_force": in_force})


def heads(connection: Connection) -> list[str]:
    """The heads of all without their marks, the latest first."""
    query = select(scope_captures.c.head).order_by(scope_captures.c.trigger_ns.desc(), scope_captures.c.id.desc())
    return list(connection.scalars(query))


def head_of(connection: Connection, capture_id: str) -> tuple[str, str] | None:
    """Head and marks of one, or None."""
    query = select(scope_captures.c.head, scope_captures.c.marks).where(scope_captures.c.id == capture_id)
    row = connection.execute(query).one_or_none()
    return None if row is None else (row.head, row.marks)


def values_of(connection: Connection, capture_id: str) -> bytes | None:
    """The packed values of one, or None."""
    found: bytes | None = connection.scalar(select(scope_captures.c.samples).where(scope_captures.c.id == capture_id))
    return found


def in_force_of(connection: Connection, capture_id: str) -> str | None:
    """The parameter values of one, or None."""
    found: str | None = connection.scalar(select(scope_captures.c.in_force).where(scope_captures.c.id == capture_id))
    return found


def put_head(connection: Connection, capture_id: str, head: str) -> bool:
    """Replace the head of one; False where there is none."""
    done = connection.execute(update(scope_captures).where(scope_captures.c.id == capture_id).values(head=head))
    return bool(done.rowcount)


def delete_capture(connection: Connection, capture_id: str) -> bool:
    """Forget one; False where there is none."""
    return bool(connection.execute(delete(scope_captures).where(scope_captures.c.id == capture_id)).rowcount)


def count(connection: Connection) -> int:
    """How many there are."""
    return connection.scalar(select(func.count()).select_from(scope_captures)) or 0
