"""Incidents of one store: made, changed by versions, hidden, found by id or by the code of a short link."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app.errors import IncidentChangedError, IncidentUnknownError
from app.model.incident import CODE_LENGTH, CODE_LETTERS, Draft, Incident, Origin, checked
from app.service.incidents.identity import Standing, fingerprint, sha256_of, standing
from app.service.journal import Journal, Kind
from app.service.office.audit import Action, AuditLog
from app.service.recording_list import Recordings
from app.store import incident_rows
from app.store.store import Connection, Store
from app.store.uuid7 import Uuid7

_TRIES: Final = 20


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which incidents are listed: of a recording, with a tag, with all these words in them; hidden ones too."""

    recording: str | None = None
    tag: str | None = None
    words: str = ""
    hidden: bool = False

    def fits(self, one: Incident) -> bool:
        """True for what is wanted."""
        draft = one.draft
        if self.recording is not None and draft.recording != self.recording:
            return False
        if self.tag is not None and self.tag not in draft.tags:
            return False
        text = f"{one.code} {draft.title} {draft.notes} {draft.turbine} {one.author} {' '.join(draft.tags)}".casefold()
        return all(word in text for word in self.words.casefold().split())


class Incidents:
    """``stamp`` gives t_ns. Belongs to the event loop. Every method raises StoreError where the store fails."""

    def __init__(self, store: Store, audit: AuditLog, stamp: Callable[[], int], journal: Journal) -> None:
        self.store = store
        self.audit = audit
        self.stamp = stamp
        self._journal = journal
        self.new_id = Uuid7(stamp)
        self._changing = asyncio.Lock()

    # -- reading -------------------------------------------------------------------

    async def all(self, wanted: Wanted | None = None) -> list[Incident]:
        """The newest version of each, the latest made first."""
        asked = wanted or Wanted()
        found = await self.store.run(lambda kept: incident_rows.newest(kept, asked.hidden))
        return [one for one in found if asked.fits(one)]

    async def versions(self, key: str) -> list[Incident]:
        """All versions, newest first, also of a hidden one; ``key``: id or code. Raises IncidentUnknownError."""
        wanted = key.strip().lower()
        found = await self.store.run(lambda kept: incident_rows.versions_of(kept, wanted))
        if not found:
            raise IncidentUnknownError(incident=key)
        return found

    async def get(self, key: str, version: int | None = None) -> Incident:
        """One version, the newest where none is named. Raises IncidentUnknownError."""
        for one in await self.versions(key):
            if version in (None, one.version):
                return one
        raise IncidentUnknownError(incident=f"{key}@{version}")

    async def standing(self, recordings: Recordings, incident: Incident) -> Standing:
        """Where its recording is."""
        draft = incident.draft
        return await asyncio.to_thread(standing, recordings, draft.recording, draft.fingerprint)

    async def known_hash(self, incident: Incident) -> str | None:
        """SHA-256 of its recording, where it was ever taken."""
        mark = incident.draft.fingerprint
        return await self.store.run(lambda kept: incident_rows.recording_hash(kept, mark))

    async def hash_of(self, path: Path) -> str:
        """SHA-256 of a whole recording; a file that did not change is read once. Raises RecordingError."""
        mark = await asyncio.to_thread(fingerprint, path)
        known = await self.store.run(lambda kept: incident_rows.recording_hash(kept, mark))
        if known is not None:
            return known
        digest = await asyncio.to_thread(sha256_of, path)
        if await asyncio.to_thread(fingerprint, path) == mark:  # else it grew meanwhile
            now_ns = self.stamp()
            await self.store.run(lambda kept: incident_rows.put_recording_hash(kept, mark, digest, now_ns))
        return digest

    # -- changing --------------------------------------------------------------------

    async def add(self, draft: Draft, person: str) -> Incident:
        """Keep a new incident. Raises IncidentFieldError."""
        kept = await self._put_new(self.new_id(), None, checked(draft), person, None)
        details = {"title": kept.draft.title, "code": kept.code, "recording": kept.draft.recording}
        self._journal.by(person).note(Kind.INCIDENT_MADE, None, **details)
        return kept

    async def edit(self, key: str, based_on: int, draft: Draft, person: str) -> Incident:
        """Keep another version; the one before stays. Nothing happens where it says nothing new.

        Raises IncidentUnknownError, IncidentFieldError, IncidentChangedError where ``based_on`` is not the newest.
        """
        draft = checked(draft)
        async with self._changing:
            newest = await self.get(key)
            if newest.version != based_on:
                raise IncidentChangedError(incident=newest.draft.title, version=based_on, newest=newest.version)
            if newest.draft == draft and not newest.hidden:
                return newest
            changed = replace(
                newest, version=newest.version + 1, draft=draft, t_ns=self.stamp(), person=person, hidden=False
            )
            await self.store.run(lambda kept: incident_rows.put_version(kept, changed))
        self.note(Action.INCIDENT_CHANGED, changed, person)
        return changed

    async def hide(self, key: str, person: str) -> None:
        """List it no more; its versions stay readable. Raises IncidentUnknownError."""
        async with self._changing:
            found = await self.get(key)
            if found.hidden:
                raise IncidentUnknownError(incident=key)
            now_ns = self.stamp()
            await self.store.run(lambda kept: incident_rows.hide(kept, found.id, now_ns))
        self.note(Action.INCIDENT_HIDDEN, found, person)

    async def take(self, incident: Incident, origin: Origin, person: str) -> tuple[Incident, bool]:
        """Keep an incident that was made elsewhere, with its own id and author; True where it is new here.

        Where it is here already, what is later counts: a version that says something new and is younger than ours
        becomes our newest. Raises IncidentFieldError.
        """
        draft = checked(incident.draft)
        try:
            newest = await self.get(incident.id)
        except IncidentUnknownError:
            first = incident.person if incident.author == "" else incident.author
            kept = await self._put_new(incident.id, incident.code, draft, first, origin, incident.created_ns)
            self.note(Action.INCIDENT_OPENED, kept, person, file=origin.file)
            return kept, True
        same = replace(draft, recording=newest.draft.recording, fingerprint=newest.draft.fingerprint) == newest.draft
        if same or incident.t_ns <= newest.t_ns:
            if newest.hidden:  # who opens it wants to see it
                newest = await self.edit(newest.id, newest.version, newest.draft, person)
            return newest, False
        merged = replace(draft, recording=newest.draft.recording, fingerprint=newest.draft.fingerprint)
        kept = await self.edit(newest.id, newest.version, merged, incident.person)
        self.note(Action.INCIDENT_OPENED, kept, person, file=origin.file)
        return kept, False

    def note(self, action: Action, incident: Incident, person: str, **more: str) -> None:
        """Have something audited that was done with an incident."""
        details = {"title": incident.draft.title, "code": incident.code, "version": incident.version, **more}
        self.audit.note(action, person, None, id=incident.id, **details)

    async def _put_new(
        self,
        incident_id: str,
        code: str | None,
        draft: Draft,
        author: str,
        origin: Origin | None,
        created_ns: int | None = None,
    ) -> Incident:
        made_ns = self.stamp() if created_ns is None else created_ns

        def work(kept: Connection) -> Incident:
            free = code if code is not None and not incident_rows.has_code(kept, code) else _free_code(kept)
            incident = Incident(incident_id, free, 1, draft, made_ns, author, made_ns, author, False, origin)
            incident_rows.put_version(kept, incident)
            return incident

        return await self.store.run(work)


def new_code() -> str:
    """A code for a short link, by chance."""
    return "".join(secrets.choice(CODE_LETTERS) for _ in range(CODE_LENGTH))


def _free_code(kept: Connection) -> str:
    for _ in range(_TRIES):
        code = new_code()
        if not incident_rows.has_code(kept, code):
            return code
    raise IncidentUnknownError(incident="")
