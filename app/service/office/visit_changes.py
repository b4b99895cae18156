"""What changed at a turbine between the last visit and this one: parameters, not process values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description import Description, Entry
from app.model.sets import ParameterSet
from app.model.values import show
from app.service.devices import Target, decode
from app.service.office.audit import AuditLog
from app.service.office.last_change import WRITES
from app.service.office.visits import Visits
from app.store.audit_chain import AuditRow
from app.store.audit_rows import Filter, details_of
from app.store.visit_rows import Phase, Visit

LOOKED_BACK: Final = 50
"""Visits that are searched for one of which values were kept."""


class Progress(Enum):
    """How far the comparison is."""

    NO_EARLIER_VISIT = "no-earlier-visit"
    READING = "reading"
    """The devices are still being read."""
    READY = "ready"


class Time(Enum):
    """One of the two sides of the comparison."""

    THEN = "then"
    NOW = "now"


@dataclass(frozen=True, slots=True)
class ChangedRow:
    """One parameter whose raw values differ; who wrote it and when where that was seen (``person`` "": another master).

    ``t_ns`` None: nobody saw it. ``was_key`` and ``now_key``: text keys where an enumeration names the value.
    """

    address: Address
    name: str
    was: Raw
    now: Raw
    was_shown: str
    now_shown: str
    was_key: str | None
    now_key: str | None
    person: str | None
    t_ns: int | None


@dataclass(frozen=True, slots=True)
class DeviceChanges:
    """One device. ``unknown`` are parameters that one side does not have, with that side; they may have changed.

    ``missing`` is the side on which nothing is known of the device. ``replaced``: another serial number, or another
    kind of device, answers at its place.
    """

    device: str
    rows: tuple[ChangedRow, ...] = ()
    unknown: tuple[tuple[Address, str, Time], ...] = ()
    missing: Time | None = None
    replaced: bool = False


@dataclass(frozen=True, slots=True)
class VisitChanges:
    """The comparison with ``visit``, the last one of which values were kept."""

    state: Progress
    visit: Visit | None
    devices: tuple[DeviceChanges, ...] = ()


async def changes_since_last_visit(visits: Visits, audit: AuditLog, targets: Iterable[Target]) -> VisitChanges:
    """Compare the open visit's values as found with the last visit's as left. Raises NoVisitError, StoreError.

    Where nothing was kept as left, its values as found with the writes that were audited since are taken.
    """
    present = visits.require()
    earlier = await _earlier(visits, present)
    if earlier is None:
        return VisitChanges(Progress.NO_EARLIER_VISIT, None)
    visit, then = earlier
    now = await visits.sets(present, Phase.FOUND)
    devices = list(targets)
    if not visits.looked and any(target.slug not in now for target in devices):
        return VisitChanges(Progress.READING, visit)
    left = bool(await visits.sets(visit, Phase.LEFT))
    ended = left and not visit.left_open and visit.ended_ns is not None
    since_ns = visit.ended_ns if ended and visit.ended_ns is not None else visit.started_ns
    seen = await audit.between(Filter(device=present.turbine, kinds=WRITES), since_ns, present.started_ns)
    if not left:
        by_slug = {target.slug: target for target in devices}
        then = {slug: _with_writes(one, by_slug[slug], seen) for slug, one in then.items() if slug in by_slug}
    writers = {(row.device, row.address): row for row in seen}
    compared = [compare(target, then.get(target.slug), now.get(target.slug), writers) for target in devices]
    return VisitChanges(Progress.READY, visit, tuple(compared))


def compare(
    target: Target,
    then: ParameterSet | None,
    now: ParameterSet | None,
    writers: Mapping[tuple[str | None, str | None], AuditRow],
) -> DeviceChanges:
    """One device's parameters then and now; ``writers`` are the last writes that were seen, by device and address."""
    if then is None or now is None:
        return DeviceChanges(target.slug, missing=Time.THEN if then is None else Time.NOW)
    if then.description_id != now.description_id:
        return DeviceChanges(target.slug, missing=Time.THEN, replaced=True)
    rows, unknown = [], []
    for entry in target.description:
        if not entry.is_parameter:
            continue
        was_raw, now_raw = then.values.get(entry.address), now.values.get(entry.address)
        if was_raw is None or now_raw is None:
            if (was_raw is None) != (now_raw is None):
                side = Time.THEN if was_raw is None else Time.NOW
                unknown.append((entry.address, entry.title, side))
        elif was_raw != now_raw:
            writer = writers.get((target.slug, entry.address.short))
            rows.append(_row(target.description, entry, then, now, writer))
    replaced = then.identity.has_other_serial(now.identity)
    return DeviceChanges(target.slug, tuple(rows), tuple(unknown), None, replaced)


def _row(
    description: Description, entry: Entry, then: ParameterSet, now: ParameterSet, writer: AuditRow | None
) -> ChangedRow:
    was_raw, now_raw = then.values[entry.address], now.values[entry.address]
    return ChangedRow(
        address=entry.address,
        name=entry.title,
        was=was_raw,
        now=now_raw,
        was_shown=show(entry, was_raw, then.values.get),
        now_shown=show(entry, now_raw, now.values.get),
        was_key=description.name_key(entry, was_raw),
        now_key=description.name_key(entry, now_raw),
        person=None if writer is None else writer.person,
        t_ns=None if writer is None else writer.t_ns,
    )


async def _earlier(visits: Visits, present: Visit) -> tuple[Visit, dict[str, ParameterSet]] | None:
    """The last visit before ``present`` of which values were kept: as left, else as found."""
    for visit in await visits.latest(present.turbine, LOOKED_BACK):
        if visit.id == present.id or visit.started_ns >= present.started_ns:
            continue
        for phase in (Phase.LEFT, Phase.FOUND):
            sets = await visits.sets(visit, phase)
            if sets:
                return visit, sets
    return None


def _with_writes(found: ParameterSet, target: Target, writes: Iterable[AuditRow]) -> ParameterSet:
    """The values as found, with those that were written since."""
    values = dict(found.values)
    for row in writes:
        data = details_of(row).get("data")
        if row.device != target.slug or row.address is None or not isinstance(data, str):
            continue
        entry = target.description.entries.get(parse_address(row.address))
        if entry is not None:
            values[entry.address] = decode(entry, bytes.fromhex(data))
    return replace(found, values=values)
