"""What is done with incidents as a whole: leave as a bundle, come in from one, and all that both need at hand."""

from __future__ import annotations

import asyncio
import os
import shutil
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app.errors import BundleError, HubsideError
from app.model.incident import Incident, Origin
from app.model.set_record import Source, Tag
from app.model.sets import ParameterSet
from app.service.incidents.annotations import Annotations
from app.service.incidents.bundle import Bundle, reach_of, write_bundle
from app.service.incidents.form import SUFFIX, Kind, Manifest, SetRole, plain_name
from app.service.incidents.identity import RecordingState, Standing, fingerprint, sha256_of
from app.service.incidents.incidents import Incidents
from app.service.incidents.opening import Flaw, Opened, open_bundle
from app.service.library.library import Library
from app.service.office.audit import Action
from app.service.recording_list import Recordings
from app.service.replay.moments import Moment, Moments
from app.store.set_rows import Filter

NO_FINGERPRINT: Final = "0-"
"""Of a recording that did not come along: no file has it."""
_MCAP: Final = ".mcap"
_NAMES: Final = 1000
MAX_NAME: Final = 250
_FOUND: Final = (RecordingState.THERE, RecordingState.GROWN)


@dataclass(frozen=True, slots=True)
class Exported:
    """A bundle that was written."""

    path: Path
    name: str
    manifest: Manifest


@dataclass(frozen=True, slots=True)
class Taken:
    """What came in. ``new``: the incident was not here. ``recording`` None: none was whole, or none came along."""

    incident: Incident | None
    new: bool
    recording: str | None
    annotations: int
    sets: int
    flaws: tuple[Flaw, ...]
    lacking: tuple[str, ...]


class IncidentDesk:
    """``folder`` takes recordings that come in. Lives in the event loop."""

    def __init__(
        self,
        incidents: Incidents,
        annotations: Annotations,
        library: Library,
        recordings: Recordings,
        moments: Moments,
        folder: Path,
    ) -> None:
        self.incidents = incidents
        self.annotations = annotations
        self.library = library
        self.recordings = recordings
        self.moments = moments
        self._folder = folder

    # -- out -----------------------------------------------------------------------

    async def export(self, key: str, target: Path, person: str) -> Exported:
        """Write the bundle of an incident to ``target``. Raises IncidentUnknownError, RecordingError, BundleError."""
        incident = await self.incidents.get(key)
        bundle = await self._bundle(incident, person)
        manifest = await asyncio.to_thread(write_bundle, target, bundle)
        self.incidents.note(Action.INCIDENT_EXPORTED, incident, person)
        return Exported(target, f"{plain_name(incident.draft.turbine)}-{incident.code}{SUFFIX}", manifest)

    async def _bundle(self, incident: Incident, person: str) -> Bundle:
        standing = await self.incidents.standing(self.recordings, incident)
        path = standing.path
        lacking = [] if path is not None else [standing.state.text_key]
        moment = None if path is None else await self.moment(incident, standing)
        sets = [] if moment is None else await self.sets_of(moment, person, incident)
        reach = reach_of(incident)
        found = await self.annotations.of(incident.draft.recording, path)
        if found.problem is not None:
            lacking.append("incident.lacking.annotations")
        near = [
            one
            for one in found.annotations
            if one.incident == incident.id or (one.span.to_ns >= reach.from_ns and one.span.from_ns <= reach.to_ns)
        ]
        return Bundle(
            incident=incident,
            recording=path,
            sha256="" if path is None else await self.incidents.hash_of(path),
            annotations=near,
            sets=sets,
            descriptions=[] if moment is None else [one.description.id for one in moment.targets],
            lacking=tuple(lacking),
            person=person,
            made_ns=self.incidents.stamp(),
        )

    async def moment(self, incident: Incident, standing: Standing) -> Moment | None:
        """The devices at the moment of an incident; None where its recording is not there. Raises RecordingError."""
        if standing.path is None:
            return None
        return await self.moments.at(standing.path.name.removesuffix(_MCAP), incident.draft.at_ns)

    async def sets_of(self, moment: Moment, person: str, incident: Incident) -> list[tuple[SetRole, ParameterSet]]:
        """Of each device: its set as of the moment where anything was known, and its golden and latest ones."""
        found: list[tuple[SetRole, ParameterSet]] = []
        for target in moment.targets:
            parameters = moment.parameters(target.slug, person, incident.draft.title)
            if parameters.values:
                found.append((SetRole.MOMENT, parameters))
            reference = await self.reference(target.slug, target.description.id)
            found += reference
        return found

    async def reference(self, slug: str, description_id: str) -> list[tuple[SetRole, ParameterSet]]:
        """The golden set for a device (its own, else that of its kind), and its latest one."""
        found = []
        golden = await self.library.tagged(Tag.GOLDEN, slug) or await self.library.tagged(Tag.GOLDEN, description_id)
        if golden is not None:
            found.append((SetRole.GOLDEN, await self.library.set_of(golden)))
        latest = await self.library.records(Filter(device=slug, limit=1))
        if latest:
            found.append((SetRole.LATEST, await self.library.set_of(latest[0])))
        return found

    # -- in --------------------------------------------------------------------------

    async def take(self, file: Path, person: str, name: str | None = None) -> Taken:
        """Open a bundle and keep what of it is whole. Raises BundleError where nothing can be taken.

        The recording gets a free name in the folder; one that is there with the same content is not put in twice.
        """
        called = name or file.name
        with tempfile.TemporaryDirectory(prefix=".opening-", dir=await asyncio.to_thread(self._ready)) as folder:
            opened = await asyncio.to_thread(open_bundle, file, Path(folder))
            return await self._keep(opened, called, person)

    def _ready(self) -> Path:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            detail = error.strerror or str(error)
            raise BundleError(file=self._folder.name, reason_key="incident.bundle.disk", detail=detail) from error
        return self._folder

    async def _keep(self, opened: Opened, file: str, person: str) -> Taken:
        placed = await asyncio.to_thread(self._place, opened, file)
        flaws = list(opened.flaws)
        incident, new = None, False
        if opened.incident is not None:
            incident, new = await self._take_incident(opened, placed, file, person)
        recording = placed.name if placed is not None else None
        count = 0
        if recording is None and incident is not None:
            recording = incident.draft.recording
        if recording is not None:
            count = await self.annotations.take(recording, placed, opened.annotations, person)
        for role, source in ((SetRole.MOMENT, Source.RECORDING), (None, Source.FILE)):
            chosen = [one for given, one in opened.sets if (given is SetRole.MOMENT) == (role is SetRole.MOMENT)]
            await self.library.put(chosen, source)
        if incident is None and placed is None and not opened.sets and not opened.annotations:
            raise BundleError(file=file, reason_key="incident.bundle.nothing")
        name = None if placed is None else placed.name
        return Taken(incident, new, name, count, len(opened.sets), tuple(flaws), opened.manifest.lacking)

    async def _take_incident(
        self, opened: Opened, placed: Path | None, file: str, person: str
    ) -> tuple[Incident, bool]:
        manifest, brought = opened.manifest, opened.incident
        if brought is None:
            raise BundleError(file=file, reason_key="incident.bundle.nothing")
        cut = manifest.recording
        origin = Origin(
            file=file,
            tool=manifest.tool[:MAX_NAME],
            person=manifest.person[:MAX_NAME],
            exported_ns=manifest.made_ns,
            opened_ns=self.incidents.stamp(),
            opened_by=person,
            recording=brought.draft.recording if cut is None else cut.source,
            sha256="" if cut is None else cut.source_sha256,
        )
        name = brought.draft.recording if placed is None else placed.name
        mark = NO_FINGERPRINT if placed is None else await asyncio.to_thread(fingerprint, placed)
        if placed is None and (await self._standing(brought)).state is not RecordingState.GONE:
            name, mark = brought.draft.recording, brought.draft.fingerprint  # the whole recording is here
        draft = replace(brought.draft, recording=name[:MAX_NAME], fingerprint=mark)
        incident, new = await self.incidents.take(replace(brought, draft=draft), origin, person)
        if placed is not None and (await self._standing(incident)).state not in _FOUND:  # known here, recording lost
            found = replace(incident.draft, recording=placed.name, fingerprint=mark)
            incident = await self.incidents.edit(incident.id, incident.version, found, person)
        return incident, new

    async def _standing(self, incident: Incident) -> Standing:
        try:
            return await self.incidents.standing(self.recordings, incident)
        except HubsideError:
            return Standing(RecordingState.GONE)

    def _place(self, opened: Opened, file: str) -> Path | None:
        """Put the recording into the folder under a free name, never over another file."""
        if opened.recording is None:
            return None
        cut = opened.manifest.recording
        wanted = plain_name("recording" if cut is None else cut.name.removesuffix(_MCAP))
        digest = next(one.sha256 for one in opened.manifest.members if one.kind is Kind.RECORDING)
        for target in _free_names(self._folder, wanted):
            try:
                _link(opened.recording, target)
                return target
            except FileExistsError:
                if _is(target, digest):
                    return target
            except OSError as error:
                detail = error.strerror or str(error)
                raise BundleError(file=file, reason_key="incident.bundle.disk", detail=detail) from error
        raise BundleError(file=file, reason_key="incident.bundle.disk", detail=wanted)


def _free_names(folder: Path, wanted: str) -> Iterable[Path]:
    yield folder / f"{wanted}{_MCAP}"
    for number in range(2, _NAMES):
        yield folder / f"{wanted}-{number}{_MCAP}"


def _link(source: Path, target: Path) -> None:
    """Give a file another name. Raises FileExistsError where it is taken, OSError."""
    try:
        os.link(source, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without links
        with source.open("rb") as given, target.open("xb") as taken:
            try:
                shutil.copyfileobj(given, taken)
            except BaseException:
                with suppress(OSError):
                    target.unlink()
                raise


def _is(path: Path, digest: str) -> bool:
    try:
        return sha256_of(path) == digest
    except HubsideError:
        return False
