"""Before a visit ends: what would be kept of each device as left, and how old that is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from app.model.set_record import SetRecord, Source
from app.service.backup import SECOND_NS
from app.service.devices import Target
from app.service.library.library import Library
from app.service.office.audit import AuditLog
from app.service.office.last_change import WRITES
from app.service.office.visits import AS_LEFT, STALE, Visits, as_known
from app.store.audit_rows import Filter, details_of
from app.store.set_rows import Filter as SetFilter
from app.store.visit_rows import Visit

_READ: Final = (Source.VISIT, Source.BACKUP, Source.UNDO)
"""Sets of these sources were read from the device at the time that they tell."""


@dataclass(frozen=True, slots=True)
class Leaving:
    """One device. ``unread`` and ``stale`` count parameters that would not be kept.

    ``read_ns``: since when the device has been known completely: the oldest reading of any parameter where none is
    missing, else the newest complete set of it in this visit; None where it never was. ``writes`` counts the writes
    since, by us and by other masters; 0 where ``read_ns`` is None.
    """

    device: str
    parameters: int
    unread: int
    stale: int
    read_ns: int | None
    writes: int


async def before_leaving(
    visits: Visits, library: Library, audit: AuditLog, targets: Iterable[Target], person: str, now_ns: int
) -> list[Leaving]:
    """What would be kept of ``targets``, were the visit ended now. Nothing is read for it. Raises StoreError."""
    found = []
    for target in targets:
        known = as_known(target, "", person, now_ns, found=visits.found.get(target.slug))
        parameters = [entry.address for entry in target.description if entry.is_parameter]
        reasons = [known.unread[address] for address in parameters if address in known.unread]
        stale = reasons.count(STALE)
        read_ns = await _complete_set_ns(visits.current, library, target) if reasons else _oldest_ns(target)
        writes = 0 if read_ns is None else await _writes(audit, target, read_ns, now_ns)
        found.append(Leaving(target.slug, len(parameters), len(reasons) - stale, stale, read_ns, writes))
    return found


def _oldest_ns(target: Target) -> int | None:
    """When the parameter was told that has been known for the longest time."""
    views = target.live.values(target.device.bus, target.node)
    parameters = (views.get(entry.address) for entry in target.description if entry.is_parameter)
    told = [view.reading.t_ns for view in parameters if view is not None and view.reading is not None]
    return min(told, default=None)


async def _complete_set_ns(visit: Visit | None, library: Library, target: Target) -> int | None:
    """When the newest set of the visit was taken in which nothing of the device is missing."""
    if visit is None:
        return None
    start_ns = visit.started_ns // SECOND_NS * SECOND_NS  # sets tell their time in whole seconds
    records = await library.records(SetFilter(device=target.slug))
    return next((one.t_ns for one in records if one.t_ns >= start_ns and _was_read_then(one)), None)


def _was_read_then(record: SetRecord) -> bool:
    """True of a complete set that was read at its time; what was kept as left may be older than that says."""
    return record.complete and record.source in _READ and record.origin.reason != AS_LEFT


async def _writes(audit: AuditLog, target: Target, start_ns: int, end_ns: int) -> int:
    """Writes that were seen in between; like ones of another master were folded into one row."""
    rows = await audit.between(Filter(device=target.slug, kinds=WRITES), start_ns, end_ns)
    return sum(int(details_of(row).get("count", 1)) for row in rows)
