"""Annotations: kept in the store with all their versions, and written beside their recording for other programs.

Where the file beside a recording is not the one that was written last, somebody else has been at it: it is read, and
what it says is merged. What is younger counts, nothing that is only here or only there is lost, and what was taken off
here stays off.
"""

from __future__ import annotations

import asyncio
import hashlib
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app.errors import AnnotationUnknownError, RecordingError
from app.model.incident import Annotation, Note, Span, checked_annotation
from app.recording.annotations import SUFFIX, file_hash, read_annotations, sidecar_of, write_annotations
from app.service.office.audit import Action, AuditLog
from app.store import incident_rows
from app.store.store import Connection, Store
from app.store.uuid7 import Uuid7

FROM_FILE: Final = "–"
"""Who made what a file tells no author of."""


@dataclass(frozen=True, slots=True)
class Mark:
    """An annotation as a person makes it."""

    span: Span
    text: str
    severity: Note = Note.INFO
    colour: str = ""
    incident: str | None = None


@dataclass(frozen=True, slots=True)
class Listed:
    """The annotations of a recording. ``problem``: why the file beside it could not be read or written."""

    annotations: tuple[Annotation, ...]
    file: Path | None
    problem: str | None = None


class Annotations:
    """``stamp`` gives t_ns. ``data``: the folder whose ``recordings`` are ours; files of others lie in ``annotations``.

    Belongs to the event loop. Every method raises StoreError where the store fails.
    """

    def __init__(self, store: Store, audit: AuditLog, stamp: Callable[[], int]) -> None:
        self._store = store
        self._audit = audit
        self._stamp = stamp
        self._new_id = Uuid7(stamp)
        self._writing = asyncio.Lock()
        self.data: Path | None = None

    def place(self, recording: Path) -> Path:
        """Where the file of a recording lies: beside ours; of a sample, or where nothing can be written, with us."""
        beside = sidecar_of(recording)
        if self.data is None:
            return beside
        ours = recording.parent == self.data / "recordings" and os.access(recording.parent, os.W_OK)
        return beside if ours else self.data / "annotations" / beside.name

    async def of(self, name: str, recording: Path | None) -> Listed:
        """All of a recording by time, after a look at the file beside it. ``recording`` None: it is not there."""
        problem = None
        if recording is not None:
            async with self._writing:
                problem = await self._take_file(name, self.place(recording))
        found = await self._store.run(lambda kept: incident_rows.annotations_of(kept, name))
        return Listed(tuple(found), None if recording is None else self.place(recording), problem)

    async def of_incident(self, name: str, incident_id: str) -> list[Annotation]:
        """Those of an incident, on the recording of that name."""
        found = await self._store.run(lambda kept: incident_rows.annotations_of(kept, name))
        return [one for one in found if one.incident == incident_id]

    async def add(self, name: str, recording: Path | None, mark: Mark, person: str) -> tuple[Annotation, str | None]:
        """Keep a new one; and why the file could not be written, where it could not. Raises IncidentFieldError."""
        made = Annotation(
            id=self._new_id(),
            recording=name,
            span=mark.span,
            text=mark.text.strip(),
            severity=mark.severity,
            colour=mark.colour.lower(),
            person=person,
            t_ns=self._stamp(),
            incident=mark.incident,
        )
        return await self._keep(checked_annotation(made), recording, Action.ANNOTATED)

    async def change(
        self, annotation_id: str, recording: Path | None, mark: Mark, person: str
    ) -> tuple[Annotation, str | None]:
        """Keep another version. Raises AnnotationUnknownError, IncidentFieldError."""
        before = await self.get(annotation_id)
        changed = replace(
            before,
            span=mark.span,
            text=mark.text.strip(),
            severity=mark.severity,
            colour=mark.colour.lower(),
            person=person,
            t_ns=self._stamp(),
        )
        return await self._keep(checked_annotation(changed), recording, Action.ANNOTATION_CHANGED)

    async def remove(self, annotation_id: str, recording: Path | None, person: str) -> str | None:
        """Take one off; its versions stay in the store. Raises AnnotationUnknownError."""
        before = await self.get(annotation_id)
        gone = replace(before, deleted=True, person=person, t_ns=self._stamp())
        return (await self._keep(gone, recording, Action.ANNOTATION_REMOVED))[1]

    async def get(self, annotation_id: str) -> Annotation:
        """One that is not taken off. Raises AnnotationUnknownError."""
        found = await self._store.run(lambda kept: incident_rows.get_annotation(kept, annotation_id))
        if found is None or found.deleted:
            raise AnnotationUnknownError(annotation=annotation_id)
        return found

    async def take(self, name: str, recording: Path | None, brought: Iterable[Annotation], person: str) -> int:
        """Merge annotations that were read from elsewhere; how many were new or younger."""
        mine = [replace(one, recording=name) for one in brought]
        async with self._writing:
            count = await self._merge(name, mine, person)
            if count and recording is not None:
                await self._write(name, self.place(recording))
            return count

    # -- the file ----------------------------------------------------------------------

    async def _keep(self, one: Annotation, recording: Path | None, action: Action) -> tuple[Annotation, str | None]:
        problem = None
        async with self._writing:
            if recording is not None:  # what another hand has put there must not be overwritten
                problem = await self._take_file(one.recording, self.place(recording))
            await self._store.run(lambda kept: incident_rows.put_annotations(kept, [one]))
            if recording is not None and problem is None:
                problem = await self._write(one.recording, self.place(recording))
        self._audit.note(action, one.person, None, recording=one.recording, text=one.text, id=one.id)
        return one, problem

    async def _write(self, name: str, place: Path) -> str | None:
        """Why it failed, where it did; then nothing has changed on the disk."""
        found = await self._store.run(lambda kept: incident_rows.annotations_of(kept, name))
        try:
            digest = await asyncio.to_thread(_written, place, found)
        except RecordingError as error:
            return str(error.details["reason"])
        now_ns = self._stamp()
        await self._store.run(lambda kept: incident_rows.put_file_hash(kept, name, digest, now_ns))
        return None

    async def _take_file(self, name: str, place: Path) -> str | None:
        """Merge what another hand has written there; why it cannot be read, where it cannot."""
        digest = await asyncio.to_thread(file_hash, place)
        known = await self._store.run(lambda kept: incident_rows.file_hash(kept, name))
        if digest is None or digest == known:
            return None
        try:
            brought = await asyncio.to_thread(read_annotations, place, name)
        except RecordingError as error:
            return str(error.details["reason"])
        count = await self._merge(name, brought, FROM_FILE)
        if count:
            self._audit.note(Action.ANNOTATIONS_MERGED, FROM_FILE, None, recording=name, file=place.name, count=count)
        now_ns = self._stamp()
        await self._store.run(lambda kept: incident_rows.put_file_hash(kept, name, digest, now_ns))
        return None

    async def _merge(self, name: str, brought: Iterable[Annotation], person: str) -> int:
        def work(kept: Connection) -> int:
            known = {one.id: one for one in incident_rows.annotations_of(kept, name, deleted=True)}
            incidents = {one.id for one in incident_rows.newest(kept, hidden=True)}
            taken: dict[str, Annotation] = {}
            for one in brought:
                other = incident_rows.get_annotation(kept, one.id) if one.id not in known else None
                mine = replace(
                    one,
                    id=one.id if other is None else _copy_id(name, one.id),
                    person=one.person or person,
                    incident=one.incident if one.incident in incidents else None,
                )
                if mine.id not in known or mine.t_ns > known[mine.id].t_ns:
                    taken[mine.id] = mine
            incident_rows.put_annotations(kept, list(taken.values()))
            return len(taken)

        return await self._store.run(work)


def _copy_id(name: str, annotation_id: str) -> str:
    """Of an annotation that came with a copy of its recording: the same each time it is read."""
    return f"copy-{hashlib.sha256(f'{name} {annotation_id}'.encode()).hexdigest()[:32]}"


def _written(place: Path, annotations: list[Annotation]) -> str:
    place.parent.mkdir(parents=True, exist_ok=True)
    return write_annotations(place, annotations)


__all__ = ["SUFFIX", "Annotations", "Listed", "Mark"]
