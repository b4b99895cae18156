"""The motor database: motors of the store with all their versions, and the invented examples of the program.

A technician adds and changes motors: each change is a version of its own, and the earlier ones stay. Only an expert
deletes one, which takes it from the list and keeps its versions.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

from app import __version__
from app.drivers.contract import TWIN_NAME, Driver
from app.errors import MotorChangedError, MotorInventedError, MotorUnknownError, UsageError
from app.model.address import Address, is_decimal
from app.model.bundled import bundled_folder
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.motor import DESCRIPTION_ID, Draft, Motor, Source, checked, entries_of, wanted_values
from app.model.motor_csv import FileRow, read_motors, write_motors
from app.model.sets import IDENTITY, Identity, Origin, ParameterSet, identity_of, iso_time
from app.service.backup import read_device
from app.service.devices import Target
from app.service.office.audit import Action, AuditLog
from app.store import motor_rows
from app.store.motor_rows import Assigned
from app.store.store import Store
from app.store.uuid7 import Uuid7

EXAMPLES: Final = "examples.csv"


@dataclass(frozen=True, slots=True)
class Imported:
    """What a file brought: motors that were not known, versions that are new, and those that say nothing new."""

    added: tuple[Motor, ...]
    changed: tuple[Motor, ...]
    unchanged: tuple[Motor, ...]


@cache
def description() -> Description:
    """Of the drive that motors are for."""
    return load_builtin(DESCRIPTION_ID)


@cache
def examples() -> tuple[Motor, ...]:
    """The invented motors that come with the program."""
    file = bundled_folder("od", "od") / "motors" / EXAMPLES
    rows = read_motors(description(), file.read_bytes(), EXAMPLES)
    return tuple(
        Motor(row.id or "", 1, row.draft, Source.EXAMPLE, EXAMPLES, 0, "", description().version) for row in rows
    )


class Motors:
    """The motors of one store. ``stamp`` gives t_ns. Belongs to the event loop."""

    def __init__(self, store: Store, audit: AuditLog, stamp: Callable[[], int]) -> None:
        self._store = store
        self._audit = audit
        self._stamp = stamp
        self._new_id = Uuid7(stamp)
        self._changing = asyncio.Lock()

    # -- reading -------------------------------------------------------------------

    async def all(self) -> list[Motor]:
        """The newest version of every motor; the examples last. Raises StoreError."""
        return [*await self._store.run(motor_rows.newest), *examples()]

    async def versions(self, motor_id: str) -> list[Motor]:
        """All versions of a motor, newest first, also of one that was deleted. Raises MotorUnknownError."""
        example = _example(motor_id)
        found = [example] if example else await self._store.run(lambda kept: motor_rows.versions_of(kept, motor_id))
        if not found:
            raise MotorUnknownError(motor=motor_id)
        return found

    async def get(self, motor_id: str, version: int | None = None) -> Motor:
        """One version of a motor, the newest where none is named. Raises MotorUnknownError."""
        for motor in await self.versions(motor_id):
            if version in (None, motor.version):
                return motor
        raise MotorUnknownError(motor=f"{motor_id}@{version}")

    async def find(self, text: str) -> Motor:
        """The motor that ``text`` names: an id or its beginning, ``maker type`` or ``type``, each with ``@VERSION``.

        Raises MotorUnknownError, and UsageError where it names several.
        """
        name, _, version = text.rpartition("@") if "@" in text else (text, "", "")
        if version and not is_decimal(version):
            raise MotorUnknownError(motor=text)
        wanted = name.strip().casefold()
        found = [motor for motor in await self.all() if _is_named(motor, wanted)]
        if len(found) > 1:
            raise UsageError(reason=f"'{name}' names {len(found)} motors: {', '.join(motor.id for motor in found)}")
        motor_id = found[0].id if found else name
        return await self.get(motor_id, int(version) if version else None)

    async def export(self, ids: Iterable[str] | None = None) -> str:
        """Motors as CSV: those named, else all that are no examples. Raises MotorUnknownError."""
        if ids is not None:
            return write_motors(description(), [await self.get(one) for one in ids])
        return write_motors(description(), [motor for motor in await self.all() if not motor.invented])

    # -- changing --------------------------------------------------------------------

    async def add(self, draft: Draft, person: str, source: Source = Source.TYPED, origin: str = "") -> Motor:
        """Keep a motor that is not known yet. Raises MotorFieldError."""
        motor = self._version(self._new_id(), 1, checked(description(), draft), source, origin, person)
        await self._store.run(lambda kept: motor_rows.put_version(kept, motor))
        self._note(Action.MOTOR_ADDED, motor, person)
        return motor

    async def add_from_device(self, driver: Driver, target: Target, draft: Draft, person: str) -> Motor:
        """Keep a motor with the values that a device holds now: they are read over the wire.

        What ``draft`` says of values counts nothing. Raises what ``read_motor`` and ``add`` raise.
        """
        values = await read_motor(driver, target)
        motor = await self.add(replace(draft, values=values), person, Source.DEVICE, target.slug)
        await self.assign(target.slug, motor, person)
        return motor

    async def edit(self, motor_id: str, based_on: int, draft: Draft, person: str) -> Motor:
        """Keep another version; the one before stays. Nothing happens where it says nothing new.

        Raises MotorUnknownError, MotorInventedError, MotorChangedError where ``based_on`` is no longer the newest,
        MotorFieldError.
        """
        draft = checked(description(), draft)
        async with self._changing:
            newest = await self._own(motor_id)
            if newest.version != based_on:
                raise MotorChangedError(motor=newest.title, version=based_on, newest=newest.version)
            if newest.draft == draft and not newest.deleted:
                return newest
            motor = self._version(motor_id, newest.version + 1, draft, Source.TYPED, "", person)
            await self._store.run(lambda kept: motor_rows.put_version(kept, motor))
        self._note(Action.MOTOR_CHANGED, motor, person)
        return motor

    async def delete(self, motor_id: str, person: str) -> None:
        """List a motor no more; its versions stay readable. Raises MotorUnknownError, MotorInventedError."""
        async with self._changing:
            motor = await self._own(motor_id)
            if motor.deleted:
                raise MotorUnknownError(motor=motor_id)
            now_ns = self._stamp()
            await self._store.run(lambda kept: motor_rows.delete_motor(kept, motor_id, now_ns))
        self._note(Action.MOTOR_DELETED, motor, person)

    async def take_file(self, data: bytes, file: str, person: str) -> Imported:
        """Keep the motors of a CSV file, all or none: new ones, and new versions of those whose id is known.

        Raises MotorFileError, which names line, column and reason.
        """
        rows = await asyncio.to_thread(read_motors, description(), data, file)
        async with self._changing:
            made = [await self._of_row(row, file, person) for row in rows]
            new = [motor for motor, is_new in made if is_new]
            await self._store.run(lambda kept: motor_rows.put_versions(kept, new))
        for motor in new:
            self._note(Action.MOTOR_ADDED if motor.version == 1 else Action.MOTOR_CHANGED, motor, person)
        return Imported(
            tuple(motor for motor in new if motor.version == 1),
            tuple(motor for motor in new if motor.version > 1),
            tuple(motor for motor, is_new in made if not is_new),
        )

    async def _of_row(self, row: FileRow, file: str, person: str) -> tuple[Motor, bool]:
        """The version that a row of a file makes, and whether it is new. An example stays one."""
        source = Source.EXAMPLE if row.invented else Source.FILE
        if row.id is None:
            return self._version(self._new_id(), 1, row.draft, source, file, person), True
        try:
            newest = await self.get(row.id)
        except MotorUnknownError:
            return self._version(row.id, 1, row.draft, source, file, person), True
        if (newest.draft == row.draft and not newest.deleted) or _example(row.id):
            return newest, False
        return self._version(row.id, newest.version + 1, row.draft, source, file, person), True

    async def _own(self, motor_id: str) -> Motor:
        """The newest version of a motor that may be changed. Raises MotorUnknownError, MotorInventedError."""
        motor = await self.get(motor_id)
        if _example(motor_id):
            raise MotorInventedError(motor=motor.title)
        return motor

    def _version(self, motor_id: str, number: int, draft: Draft, source: Source, origin: str, person: str) -> Motor:
        return Motor(motor_id, number, draft, source, origin, self._stamp(), person, description().version)

    def _note(self, action: Action, motor: Motor, person: str) -> None:
        self._audit.note(action, person, None, motor=motor.title, id=motor.id, version=motor.version)

    # -- devices ---------------------------------------------------------------------

    async def assign(self, device: str, motor: Motor, person: str) -> None:
        """Keep that ``device`` (a slug) drives ``motor``: what it is compared with from now on."""
        row = Assigned(self._new_id(), device, motor.id, motor.version, self._stamp(), person)
        await self._store.run(lambda kept: motor_rows.assign(kept, row))
        details = {"motor": motor.title, "id": motor.id, "version": motor.version}
        self._audit.note(Action.MOTOR_ASSIGNED, person, device, **details)

    async def assigned(self) -> dict[str, Assigned]:
        """Which motor each device drives, by the device's slug, as far as somebody has said."""
        return {row.device: row for row in await self._store.run(motor_rows.assigned)}


async def read_motor(driver: Driver, target: Target) -> dict[Address, int]:
    """The motor's parameters of a device, read over the wire. Raises what the first that failed raised, UsageError."""
    _check_kind(target)
    report = await read_device(driver, target, [entry.address for entry in entries_of(target.description)])
    for error in report.failed.values():
        raise error
    return _numbers(report.values.items())


def live_motor(target: Target) -> dict[Address, int]:
    """The motor's parameters of a device as they were last seen on the wire; what is not known is left out.

    Raises UsageError.
    """
    _check_kind(target)
    seen = ((entry.address, target.lookup(entry.address)) for entry in entries_of(target.description))
    return _numbers((address, raw) for address, raw in seen if raw is not None)


async def read_identity(driver: Driver, target: Target) -> Identity:
    """What a device says of itself, read over the wire. Raises BusLostError."""
    report = await read_device(driver, target, [at for at in IDENTITY.values() if at in target.description.entries])
    return identity_of(report.values)


def motor_set(motor: Motor, target: Target, identity: Identity, turbine: str, person: str, t_ns: int) -> ParameterSet:
    """What a motor puts into a device, as a set of that device which holds nothing else: for a restore.

    ``identity`` is what the device says of itself. Raises UsageError for another kind of device, MotorInventedError for
    an example and a device that does not say that it is simulated.
    """
    _check_kind(target)
    if motor.invented and not (identity.device_name or "").startswith(TWIN_NAME):
        raise MotorInventedError(motor=motor.title)
    reason = f"{motor.title} (motor {motor.id}, version {motor.version})"
    return ParameterSet(
        description_id=target.description.id,
        description_version=target.description.version,
        identity=identity,
        origin=Origin(turbine, target.slug, target.node, iso_time(t_ns), person, reason, f"hubside {__version__}"),
        values=dict(wanted_values(target.description, motor.draft.values)),
    )


def _check_kind(target: Target) -> None:
    if target.description.id != DESCRIPTION_ID:
        raise UsageError(reason=f"{target.slug} is no {DESCRIPTION_ID}: it has no motor")


def _numbers(pairs: Iterable[tuple[Address, Raw]]) -> dict[Address, int]:
    return {address: raw for address, raw in pairs if isinstance(raw, int)}


def _example(motor_id: str) -> Motor | None:
    return next((motor for motor in examples() if motor.id == motor_id), None)


def _is_named(motor: Motor, wanted: str) -> bool:
    names = (motor.title.casefold(), motor.draft.type.casefold())
    return wanted in names or (len(wanted) >= 8 and motor.id.startswith(wanted))
