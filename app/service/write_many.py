"""Write a reviewed batch of changes: checked as a whole, written one by one, read back, then saved device by device.

They are written in an order in which, after every single write, the stepwise rules hold (``app.model.restore.batch``).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum

from app.drivers.contract import Driver
from app.errors import (
    BusLostError,
    ConflictError,
    DeviceBusyError,
    HubsideError,
    NoAnswerError,
    NotWrittenError,
    OrderError,
    RefusedError,
    UnverifiedError,
    UsageError,
)
from app.model.address import Address
from app.model.checks import Allow, check_write
from app.model.datatypes import Raw
from app.model.description import Verify
from app.model.saving import saves_for
from app.model.station import Place, station_slug
from app.service.address_change import require_confirmed
from app.service.claims import Work
from app.service.devices import Target
from app.service.jobs import Job, JobRow, RowState
from app.service.journal import Journal
from app.service.save import save_each
from app.service.whole import whole
from app.service.write import note_written, write_raw
from app.service.write_order import Device, KnownDevices


class OnFailure(Enum):
    """What happens to the rows after one that failed.

    ``STOP``: nothing more is written, and nothing is saved, so that half a batch never becomes permanent by itself.
    """

    STOP = "stop"
    GO_ON = "go-on"


@dataclass(frozen=True, slots=True)
class Change:
    """One object to write. ``expected`` is what RAM held when the change was made; None where that was not known."""

    driver: Driver
    target: Target
    address: Address
    raw: Raw
    expected: Raw | None = None

    @property
    def place(self) -> Place:
        """The object."""
        return Place(self.target.slug, self.address)


@dataclass(frozen=True, slots=True)
class Order:
    """A batch as a person confirmed it. ``save``: slugs of the devices whose verified values are made permanent.

    ``beside``: the other devices of the turbine, for rules look over all of a station. ``accepted``: the person accepts
    that rules are broken that hold after every write elsewhere, where they are broken in the end.
    """

    changes: Sequence[Change]
    save: frozenset[str]
    on_failure: OnFailure
    allow: Allow = Allow.NOTHING
    beside: Sequence[Device] = ()
    accepted: bool = False


Row = tuple[Change, JobRow]


def prepare(order: Order) -> list[JobRow]:
    """The rows of a job, all waiting. Raises UsageError where an object is to be written twice, or nothing at all."""
    if not order.changes:
        raise UsageError(reason="no change to write")
    places = [(change.target.slug, change.address) for change in order.changes]
    for (slug, address), times in Counter(places).items():
        if times > 1:
            raise UsageError(reason=f"{slug} {address.short} is there {times} times")
    return [JobRow(slug, address.short) for slug, address in places]


async def write_many(job: Job, order: Order, journal: Journal, now_ns: Callable[[], int]) -> None:
    """Write the rows of ``prepare``; the job's rows tell how far it is, in the order in which they are written.

    Every row is checked before the first is sent; a refused row is never sent, and with STOP none is then. Nobody takes
    one of the devices for himself meanwhile (``service.claims``); rows of a device that somebody has are refused. A
    cancelled job ends between two writes, never within one. A lost bus ends it as well. After a write without a clear
    end the value is read before the next one; where that fails, nothing more of its station is written: the order of
    the rest would rest on what nobody knows. What failed stands in the rows.
    """
    rows = list(zip(order.changes, job.rows, strict=True))
    with ExitStack() as claims:
        _claim(rows, journal.person, claims)
        known = await _known(rows, order)
        rows = _in_order(rows, known)
        job.rows[:] = [row for _, row in rows]
        await _check_all(rows, order.allow)
        job.done = sum(row.state is RowState.REFUSED for row in job.rows)
        if job.done and order.on_failure is OnFailure.STOP:
            return
        unclear = await _write_all(job, rows, order, known, journal)
        if unclear is None:
            return
        for slug in dict.fromkeys(change.target.slug for change in order.changes):
            if slug in order.save and station_slug(slug) not in unclear:
                own = [(change, row) for change, row in rows if change.target.slug == slug]
                await whole(_save(own, journal, now_ns))


def _claim(rows: Sequence[Row], person: str, claims: ExitStack) -> None:
    """Keep everybody from taking the devices for himself; those that somebody has are not written."""
    for slug in dict.fromkeys(change.target.slug for change, _ in rows):
        own = [(change, row) for change, row in rows if change.target.slug == slug]
        try:
            claims.enter_context(own[0][0].target.gate.claims.held(Work.WRITES, person, (slug,)))
        except DeviceBusyError as error:
            for _, row in own:
                row.state, row.error = RowState.REFUSED, error


async def _known(rows: Sequence[Row], order: Order) -> KnownDevices:
    """What the order of the writes rests on; what nobody knows is read."""
    devices = {target.slug: (driver, target) for driver, target in order.beside}
    devices |= {change.target.slug: (change.driver, change.target) for change, _ in rows}
    known = KnownDevices([target for _, target in devices.values()], order.allow, order.accepted)
    unknown = known.unknown(_wanted(rows))
    await known.read(unknown, {slug: driver for slug, (driver, _) in devices.items()})
    return known


def _wanted(rows: Iterable[Row]) -> dict[Place, Raw]:
    return {change.place: change.raw for change, _ in rows}


def _in_order(rows: Sequence[Row], known: KnownDevices) -> list[Row]:
    """The rows in the order in which they are written; those that have none come last, and are refused."""
    by_place = {change.place: (change, row) for change, row in rows}
    batch = known.order(_wanted(rows))
    for place in batch.unordered:
        change, row = by_place[place]
        entry = change.target.entry(change.address)
        row.state, row.error = RowState.REFUSED, OrderError(address=change.address.short, name=entry.title)
    return [by_place[place] for place in (*batch.places, *batch.unordered)]


async def _write_all(
    job: Job, rows: Sequence[Row], order: Order, known: KnownDevices, journal: Journal
) -> frozenset[str] | None:
    """Write what waits. After a failure the rest is put in order anew.

    Gives the stations of which something is not known any more; None where nothing more is to be done.
    """
    unclear: set[str] = set()
    waiting = [(change, row) for change, row in rows if row.state is RowState.WAITING]
    if len(waiting) < len(rows):  # those that are refused already do not come before the rest
        waiting = _anew(job, waiting, known)
    while waiting:
        change, row = waiting.pop(0)
        is_clear = await whole(_write_clearly(change, row, order.allow, known, journal))
        job.done += 1
        ends = _ends(row, order.on_failure)
        if not is_clear:
            station = station_slug(change.target.slug)
            unclear.add(station)
            _give_up(job, change, [one for one in waiting if ends or _is_of(one, station)])
        if ends:
            return None
        if row.error is not None:
            waiting = _anew(job, [one for one in waiting if one[1].state is RowState.WAITING], known)
    return frozenset(unclear)


def _anew(job: Job, waiting: Sequence[Row], known: KnownDevices) -> list[Row]:
    """What waits, in an order for it alone; those for which there is none are refused."""
    ordered = _in_order(waiting, known)
    job.done += sum(row.state is RowState.REFUSED for _, row in ordered)
    return [(change, row) for change, row in ordered if row.state is RowState.WAITING]


def _is_of(row: Row, station: str) -> bool:
    return station_slug(row[0].target.slug) == station


def _give_up(job: Job, after: Change, rows: Iterable[Row]) -> None:
    """Say of each row why it is not written."""
    for change, row in rows:
        row.state = RowState.REFUSED
        row.error = NotWrittenError(
            address=change.address.short,
            name=change.target.entry(change.address).title,
            after=after.address.short,
            after_device=after.target.slug,
        )
        job.done += 1


async def _check_all(rows: Sequence[Row], allow: Allow) -> None:
    """Refuse what cannot be written, with the values that the rows before it will have set."""
    planned: dict[tuple[str, Address], Raw] = {}
    for change, row in rows:
        target = change.target

        def lookup(address: Address, target: Target = target) -> Raw | None:
            found = planned.get((target.slug, address))
            return target.lookup(address) if found is None else found

        try:
            await target.pass_gate(change.driver, change.address)
            require_confirmed(target, target.entry(change.address), allow)
            entry, variant = target.entry(change.address), target.variant
            check_write(target.description, entry, change.raw, lookup, allow=allow, variant=variant)
        except HubsideError as error:
            row.state, row.error = RowState.REFUSED, error
        else:
            if row.state is RowState.WAITING:
                planned[target.slug, change.address] = change.raw


def _ends(row: JobRow, on_failure: OnFailure) -> bool:
    """True where nothing more is to be written at all: a person wants it so, or the bus is gone."""
    if row.error is None:
        return False
    return on_failure is OnFailure.STOP or isinstance(row.error, BusLostError)


async def _write_clearly(change: Change, row: JobRow, allow: Allow, known: KnownDevices, journal: Journal) -> bool:
    """Write, and have ``known`` know what the object holds then; where the write failed, by reading it.

    False where its outcome is not known, and cannot be read.
    """
    await _write(change, row, allow, journal)
    if row.error is None:
        known.put(change.place, change.raw)
        return True
    if isinstance(row.error, BusLostError):
        return False  # whatever comes back behind it may have started anew: nobody goes on from there by himself
    unclear = isinstance(row.error, (NoAnswerError, UnverifiedError))
    if not unclear and isinstance(row.error, RefusedError) and not isinstance(row.error, ConflictError):
        return True  # nothing was sent
    was = known.raw(change.place)
    found = await known.look(change.driver, change.place)
    entry = change.target.entry(change.address)
    if unclear and found == change.raw and entry.verify is Verify.EQUAL:
        row.state, row.error, row.was, row.read = RowState.VERIFIED, None, was, found
        note_written(journal, change.target, entry, was, change.raw)
    return found is not None or not unclear


async def _write(change: Change, row: JobRow, allow: Allow, journal: Journal) -> None:
    row.state = RowState.SENT
    try:
        done = await write_raw(
            change.driver,
            change.target,
            change.address,
            change.raw,
            journal,
            allow=allow,
            expected=change.expected,
        )
    except HubsideError as error:
        row.state, row.error = RowState.REFUSED, error
        return
    row.was, row.read = done.was, done.read
    row.state = RowState.VERIFIED if done.verified else RowState.UNPROVEN


async def _save(rows: Sequence[Row], journal: Journal, now_ns: Callable[[], int]) -> None:
    """Save one device where a value that it keeps was verified."""
    kept = [row for change, row in rows if row.state is RowState.VERIFIED and change.target.entry(change.address).saved]
    if not kept:
        return
    driver, target = rows[0][0].driver, rows[0][0].target
    for row in kept:
        row.state = RowState.SAVING
    categories = saves_for(target.description, (change.address for change, row in rows if row in kept))
    try:
        await save_each(driver, target, journal, now_ns, categories)
    except HubsideError as error:
        for row in kept:
            row.state, row.error = RowState.NOT_SAVED, error
        return
    for row in kept:
        row.state = RowState.SAVED
