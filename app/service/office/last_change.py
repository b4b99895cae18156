"""Who wrote a parameter last, when, from what to what: by the audit log, writes of other masters included."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

from app.service.journal import Kind
from app.service.office.audit import AuditLog
from app.store.audit_chain import AuditRow
from app.store.audit_rows import Filter, details_of

WRITES: Final = (Kind.WRITTEN.value, Kind.FOREIGN_WRITTEN.value)


class Writer(Enum):
    """Whose transfer it was."""

    OURS = "ours"
    OTHER_MASTER = "other-master"


@dataclass(frozen=True, slots=True)
class Change:
    """One acknowledged write: ``was`` and ``now`` as they were shown.

    ``count`` is more than 1 where like ones of another master were folded. ``person`` is empty for another master.
    """

    address: str
    t_ns: int
    person: str
    was: str
    now: str
    source: Writer
    count: int
    seq: int


async def last_changes(audit: AuditLog, device: str) -> list[Change]:
    """The last write of each parameter of ``device`` that was ever seen."""
    return [_change(row) for row in await audit.last_of_each_address(device, WRITES)]


async def history(audit: AuditLog, device: str, address: str, limit: int) -> list[Change]:
    """The writes of one parameter, newest first."""
    wanted = Filter(device=device, address=address, kinds=WRITES)
    return [_change(row) for row in await audit.latest(wanted, None, limit)]


def _change(row: AuditRow) -> Change:
    details = details_of(row)
    foreign = row.kind == Kind.FOREIGN_WRITTEN.value
    return Change(
        address=row.address or "",
        t_ns=row.t_ns,
        person=row.person,
        was=str(details.get("was", "–")),
        now=str(details.get("now", "–")),
        source=Writer.OTHER_MASTER if foreign else Writer.OURS,
        count=int(details.get("count", 1)),
        seq=row.seq,
    )
