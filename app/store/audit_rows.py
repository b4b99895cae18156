"""Rows of the audit log: append, read, walk."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from sqlalchemy import Connection, Select, func, insert, or_, select, update

from app.store.audit_chain import AuditRow, Breach, Broken, Head, check_row, row_hash
from app.store.schema import audit, audit_head


@dataclass(frozen=True, slots=True)
class NewRow:
    """What is to be appended; ``details`` is canonical JSON of an object."""

    id: str
    t_ns: int
    person: str
    kind: str
    device: str | None
    address: str | None
    details: str


@dataclass(frozen=True, slots=True)
class Filter:
    """Which rows are wanted; None is any. ``device`` also takes all below it; ``text`` is looked for everywhere."""

    device: str | None = None
    address: str | None = None
    kinds: tuple[str, ...] | None = None
    person: str | None = None
    text: str | None = None


def append(connection: Connection, rows: Iterable[NewRow]) -> Head:
    """Append ``rows`` in their order; gives the new head."""
    before = head(connection)
    last = before
    made: list[dict[str, Any]] = []
    for row in rows:
        content = {"seq": last.seq + 1, **asdict(row)}
        last_hash = row_hash(last.hash, content)
        made.append({**content, "previous": last.hash, "hash": last_hash})
        last = Head(last.seq + 1, last_hash)
    if made:
        connection.execute(insert(audit), made)
        values = {"seq": last.seq, "hash": last.hash}
        if before.seq:
            connection.execute(update(audit_head).values(values))
        else:
            connection.execute(insert(audit_head), {"one": 1, **values})
    return last


def head(connection: Connection) -> Head:
    """The end of the chain as it was noted with the last row."""
    found = connection.execute(select(audit_head.c.seq, audit_head.c.hash)).first()
    return Head() if found is None else Head(found.seq, found.hash)


def latest(connection: Connection, wanted: Filter, before: int | None, limit: int) -> list[AuditRow]:
    """Rows that fit, newest first, older than the row ``before``."""
    query = _where(select(audit), wanted)
    if before is not None:
        query = query.where(audit.c.seq < before)
    return _rows(connection, query.order_by(audit.c.seq.desc()).limit(limit))


def after(connection: Connection, wanted: Filter, seq: int, limit: int) -> list[AuditRow]:
    """Rows that fit, oldest first, newer than the row ``seq``."""
    return _rows(connection, _where(select(audit), wanted).where(audit.c.seq > seq).order_by(audit.c.seq).limit(limit))


def between(connection: Connection, wanted: Filter, start_ns: int, end_ns: int) -> list[AuditRow]:
    """Rows that fit with ``start_ns`` <= t_ns < ``end_ns``, oldest first."""
    query = _where(select(audit), wanted).where(audit.c.t_ns >= start_ns, audit.c.t_ns < end_ns)
    return _rows(connection, query.order_by(audit.c.seq))


def last_of_each_address(connection: Connection, device: str, kinds: Sequence[str]) -> list[AuditRow]:
    """The newest row of these kinds for every address of ``device``."""
    newest = (
        select(func.max(audit.c.seq))
        .where(audit.c.device == device, audit.c.kind.in_(kinds), audit.c.address.is_not(None))
        .group_by(audit.c.address)
    )
    return _rows(connection, select(audit).where(audit.c.seq.in_(newest)).order_by(audit.c.seq))


def walk(connection: Connection, before: Head, limit: int) -> tuple[Head, Broken | None]:
    """Check up to ``limit`` rows behind ``before``: the last good one, and the first broken one if there is one."""
    query = select(audit).where(audit.c.seq > before.seq).order_by(audit.c.seq).limit(limit)
    for row in _rows(connection, query):
        breach = check_row(before, row)
        if breach is not None:
            return before, Broken(row.seq, breach)
        before = Head(row.seq, row.hash)
    return before, None


def check_end(connection: Connection, last: Head) -> Broken | None:
    """Whether the last good row is the one that was noted as the last, or one that came since."""
    noted = head(connection)
    if last.seq < noted.seq or (last.seq == noted.seq and last.hash != noted.hash):
        return Broken(last.seq + 1, Breach.END)
    return Broken(noted.seq + 1, Breach.END) if last.seq > noted.seq else None


def details_of(row: AuditRow) -> dict[str, Any]:
    """The row's details."""
    found: dict[str, Any] = json.loads(row.details)
    return found


def _where(query: Select[Any], wanted: Filter) -> Select[Any]:
    if wanted.device is not None:
        below = audit.c.device.startswith(f"{wanted.device}/", autoescape=True)
        query = query.where(or_(audit.c.device == wanted.device, below))
    if wanted.address is not None:
        query = query.where(audit.c.address == wanted.address)
    if wanted.kinds is not None:
        query = query.where(audit.c.kind.in_(wanted.kinds))
    if wanted.person is not None:
        query = query.where(audit.c.person == wanted.person)
    if wanted.text:
        columns = (audit.c.person, audit.c.kind, audit.c.device, audit.c.address, audit.c.details)
        query = query.where(or_(*(column.icontains(wanted.text, autoescape=True) for column in columns)))
    return query


def _rows(connection: Connection, query: Select[Any]) -> list[AuditRow]:
    return [AuditRow(**row._mapping) for row in connection.execute(query)]
