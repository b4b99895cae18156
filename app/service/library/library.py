"""The library of one store: sets by content, the occasions on which they were taken, tags and nameplates."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, Final

from app.errors import NameplateError, SetIncompleteError, SetTagError, SetUnknownError, StoreDamagedError
from app.model.address import Address, parse_address
from app.model.set_head import Imported
from app.model.set_record import SetRecord, Source, Tag, TagEntry
from app.model.sets import ParameterSet
from app.service.library.recovered import Recovered, Seen
from app.service.office.audit import Action, AuditLog
from app.store import set_rows
from app.store.fleet_rows import AHEAD_NS
from app.store.set_rows import Filter, Nameplate
from app.store.store import Connection, Store
from app.store.uuid7 import Uuid7

_SERIAL: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._/+-]{0,39}")
"""What stands on nameplates: letters, digits and what separates them."""


class Library:
    """``stamp`` gives t_ns. Lives in the event loop; nothing of it is ever deleted.

    Every method raises StoreError where the store fails.
    """

    def __init__(self, store: Store, audit: AuditLog, stamp: Callable[[], int]) -> None:
        self._store = store
        self._audit = audit
        self._stamp = stamp
        self._new_id = Uuid7(stamp)
        self._plates = store.call(set_rows.nameplates_now)

    # -- sets -------------------------------------------------------------------------

    async def put(self, sets: Iterable[ParameterSet], source: Source) -> list[SetRecord]:
        """Keep sets; one of the same content, device, time, person and reason is there once. Gives their records."""
        wanted = list(sets)
        return await self._store.run(lambda kept: [self.put_in(kept, one, source) for one in wanted])

    def put_in(self, connection: Connection, parameters: ParameterSet, source: Source) -> SetRecord:
        """As ``put``, one set within a transaction of the store's thread."""
        return set_rows.put_set(connection, self._new_id(), parameters, source, self._stamp())

    async def record(self, key: str) -> SetRecord:
        """The record with an id, or the latest of the content whose hash begins so. Raises SetUnknownError."""
        found = await self._store.run(lambda kept: set_rows.get_record(kept, key))
        if found is None:
            raise SetUnknownError(set=key)
        return found

    async def get(self, key: str) -> ParameterSet:
        """The set of a record (id, or at least 8 digits of the hash). Raises SetUnknownError, StoreDamagedError."""
        return await self.set_of(await self.record(key))

    async def set_of(self, record: SetRecord) -> ParameterSet:
        """The set of a record that is known. Raises StoreDamagedError where its content does not fit its hash."""
        found = await self._store.run(lambda kept: set_rows.get_set(kept, record))
        if found is None:
            raise StoreDamagedError(
                file=self._store.file, reason=f"the set {record.hash[:12]} is not what its hash says"
            )
        return found

    async def records(self, wanted: Filter | None = None) -> list[SetRecord]:
        """Records, latest first; those whose time is ahead stand last."""
        asked, now_ns = wanted or Filter(), self._stamp()
        return await self._store.run(lambda kept: set_rows.list_records(kept, asked, now_ns))

    def is_ahead(self, record: SetRecord) -> bool:
        """True where its time is more than a day ahead of ours: it says nothing of when the set was taken.

        Such a set is kept as it is, and is the latest of its device only as long as there is no other.
        """
        return record.t_ns > self._stamp() + AHEAD_NS

    async def put_recovered(self, recovered: Recovered, recording: str, person: str) -> list[SetRecord]:
        """Keep the sets of a recording, each with how its values were seen."""

        def work(kept: Connection) -> list[SetRecord]:
            records = []
            for one in recovered.sets:
                record = self.put_in(kept, one.parameters, Source.RECORDING)
                seen = {str(address): look.as_json() for address, look in one.seen.items()}
                set_rows.put_evidence(kept, record.id, recording, seen)
                records.append(record)
            return records

        records = await self._store.run(work)
        self._audit.note(Action.SETS_RECOVERED, person, None, recording=recording, sets=len(records))
        return records

    async def evidence(self, record: SetRecord) -> tuple[str, dict[str, Any]] | None:
        """The recording that a set comes from, and by address how its values were seen; None for other sets."""
        return await self._store.run(lambda kept: set_rows.get_evidence(kept, record.id))

    async def seen(self, record: SetRecord) -> tuple[str, dict[Address, Seen]]:
        """As ``evidence``, read; "" and nothing for sets that come from no recording."""
        recording, kept = await self.evidence(record) or ("", {})
        return recording, {parse_address(address): Seen.of_json(look) for address, look in kept.items()}

    async def take(self, imported: Imported, file: str, person: str) -> SetRecord:
        """Keep a set that was read from a file."""
        (record,) = await self.put([imported.parameters], Source.FILE)
        self._audit.note(Action.SET_IMPORTED, person, record.origin.device, file=file, set=record.id, hash=record.hash)
        return record

    # -- tags -------------------------------------------------------------------------

    async def tag(self, key: str, tag: Tag, person: str, on: bool = True) -> SetRecord:
        """Give a record a tag, or take it off. Who had it before loses it.

        Raises SetUnknownError, SetTagError; SetIncompleteError where a set with unread objects is to be golden.
        """
        record = await self.record(key)
        if not tag.by_hand:
            raise SetTagError(tag=tag.value)
        if on and tag is Tag.GOLDEN and not record.complete:
            raise SetIncompleteError(set=record.id, tag=tag.value, unread=record.unread)
        bearer = await self.tagged(tag, record.scope_of(tag))
        if on == (bearer is not None and bearer.id == record.id):
            return record
        if not on and (bearer is None or bearer.id != record.id):
            return record
        given = record.id if on else None
        entry = TagEntry(tag, record.scope_of(tag), given, person, self._stamp())
        await self._store.run(lambda kept: set_rows.put_tag(kept, entry))
        action = Action.SET_TAGGED if on else Action.SET_UNTAGGED
        self._audit.note(action, person, record.origin.device, tag=tag.value, set=record.id, hash=record.hash)
        return record

    async def tagged(self, tag: Tag, scope: str) -> SetRecord | None:
        """The record that bears a tag now: of a device (slug), a golden one of a description; the latest visit's."""

        def newest(kept: Connection) -> SetRecord | None:
            rows = set_rows.tags_now(kept, tag, scope)
            found = rows[-1].record_id if rows else None
            return None if found is None else set_rows.get_record(kept, found)

        return await self._store.run(newest)

    async def tags(self) -> dict[str, list[TagEntry]]:
        """The tags that are given now, by the id of the record that bears them."""
        found: dict[str, list[TagEntry]] = {}
        for entry in await self._store.run(set_rows.tags_now):
            found.setdefault(entry.record_id or "", []).append(entry)
        return found

    async def tag_history(self, scope: str) -> list[TagEntry]:
        """All that was done to the tags of a device or description, oldest first."""
        return await self._store.run(lambda kept: set_rows.tag_history(kept, scope))

    def keep_visit(
        self, connection: Connection, sets: Iterable[ParameterSet], tag: Tag, visit_id: str, person: str
    ) -> list[SetRecord]:
        """Keep the sets of a visit with their tag, within a transaction. What was found first stays what was found."""
        there = {one.scope for one in set_rows.tags_now(connection, tag) if one.visit_id == visit_id}
        records = []
        for one in sets:
            if tag is Tag.AS_FOUND and one.origin.device in there:
                continue
            record = self.put_in(connection, one, Source.VISIT)
            entry = TagEntry(tag, one.origin.device, record.id, person, self._stamp(), visit_id)
            set_rows.put_tag(connection, entry)
            records.append(record)
        return records

    # -- nameplates -------------------------------------------------------------------

    @property
    def nameplates(self) -> dict[str, Nameplate]:
        """What was typed of the devices' plates, by slug."""
        return dict(self._plates)

    def nameplate(self, slug: str) -> Nameplate | None:
        """The plate of one device, where somebody typed it."""
        return self._plates.get(slug)

    async def set_nameplate(self, slug: str, typed: str, typed_again: str, person: str) -> Nameplate:
        """Keep the serial number of a device's plate. Raises NameplateError where the two differ or are none."""
        serial, again = (" ".join(text.split()) for text in (typed, typed_again))
        if not _SERIAL.fullmatch(serial):
            raise NameplateError(device=slug, reason_key="nameplate.no_serial")
        if serial != again:
            raise NameplateError(device=slug, reason_key="nameplate.differs")
        before = self._plates.get(slug)
        if before is not None and before.serial == serial:
            return before
        plate = Nameplate(slug, serial, person, self._stamp())
        await self._store.run(lambda kept: set_rows.put_nameplate(kept, plate))
        self._plates[slug] = plate
        was = None if before is None else before.serial
        self._audit.note(Action.NAMEPLATE_TYPED, person, slug, serial=serial, was=was)
        return plate

    def identified(self, parameters: ParameterSet) -> ParameterSet:
        """The set with the nameplate of its device, where the device itself tells no serial number."""
        return with_plate(parameters, self._plates.get(parameters.origin.device))


def with_plate(parameters: ParameterSet, plate: Nameplate | None) -> ParameterSet:
    """The set with what was typed of the device's plate, where the device itself tells no serial number."""
    if plate is None or parameters.identity.mark is not None:
        return parameters
    return replace(parameters, identity=replace(parameters.identity, nameplate=plate.serial))
