"""Incidents: who may look reads them, technicians make and change them, experts hide them.

None of it reaches a device.
"""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from pathlib import Path
from typing import Annotated, Final, Literal

from fastapi import APIRouter, BackgroundTasks, Depends, Query, Request, Response
from fastapi.responses import FileResponse, RedirectResponse
from starlette.background import BackgroundTask

from app.errors import HubsideError, IncidentFieldError, IncidentUnknownError
from app.model.incident import Incident
from app.model.roles import Role, SignedIn
from app.recording.reader import open_recording
from app.service.incidents.annotations import Annotations
from app.service.incidents.desk import IncidentDesk
from app.service.incidents.form import MAX_BUNDLE_BYTES
from app.service.incidents.identity import fingerprint
from app.service.incidents.incidents import Incidents, Wanted
from app.service.incidents.link import closed_link, page_link
from app.service.incidents.report.making import make_report
from app.service.recording_list import Recordings
from app.web.attachment import as_attachment
from app.web.deps import BenchOf, PersonOf, needs
from app.web.guard import SIGNED_IN
from app.web.models import Nothing
from app.web.models.incidents import (
    AnnotationDoc,
    AnnotationList,
    IncidentChange,
    IncidentDoc,
    IncidentTaken,
    MarkIn,
    NewIncident,
)
from app.web.problem import NotFoundError, TooLargeError
from app.web.routes.recordings import RecordingsOf, get_recordings

router = APIRouter()
links = APIRouter(include_in_schema=False)
"""Short links, outside ``/api``."""
INCIDENT: Final = "/incidents/{key}"
LanguageName = Literal["en", "de"]
OCTETS: Final = "application/octet-stream"


def get_incidents(bench: BenchOf) -> Incidents:
    """The incidents of this server's store."""
    return bench.office.incidents


def get_annotations(bench: BenchOf) -> Annotations:
    """The annotations of this server's store; files of samples lie in the data folder."""
    annotations = bench.office.annotations
    annotations.data = bench.options.data
    return annotations


IncidentsOf = Annotated[Incidents, Depends(get_incidents)]
AnnotationsOf = Annotated[Annotations, Depends(get_annotations)]


@router.get("/incidents")
async def incidents(
    kept: IncidentsOf,
    files: RecordingsOf,
    recording: Annotated[str | None, Query(max_length=250)] = None,
    tag: Annotated[str | None, Query(max_length=40)] = None,
    words: Annotated[str, Query(max_length=200)] = "",
    hidden: bool = False,
) -> list[IncidentDoc]:
    """The newest version of every incident, the latest made first."""
    return [await _doc(kept, files, one) for one in await kept.all(Wanted(recording, tag, words, hidden))]


@router.get(INCIDENT)
async def incident(kept: IncidentsOf, files: RecordingsOf, key: str, version: int | None = None) -> IncidentDoc:
    """One incident by its id or code; an earlier version where one is named."""
    return await _doc(kept, files, await kept.get(key, version))


@router.get(INCIDENT + "/versions")
async def incident_versions(kept: IncidentsOf, files: RecordingsOf, key: str) -> list[IncidentDoc]:
    """All versions, newest first: who changed what, when."""
    return [await _doc(kept, files, one) for one in await kept.versions(key)]


@router.post("/incidents", dependencies=[needs(Role.TECHNICIAN)])
async def add_incident(
    kept: IncidentsOf, files: RecordingsOf, person: PersonOf, later: BackgroundTasks, given: NewIncident
) -> IncidentDoc:
    """Keep a new incident. The hash of its whole recording is taken afterwards."""
    path = _known(files, given.recording)
    mark, turbine, (begin_ns, end_ns) = await asyncio.to_thread(_identity, path)
    if given.to_ns < begin_ns or given.from_ns > end_ns:
        raise IncidentFieldError(field="span", reason_key="incident.flaw.elsewhere")
    made = await kept.add(given.draft(path.name, mark, turbine), person.person)
    later.add_task(_take_hash, kept, path)
    return await _doc(kept, files, made)


@router.put(INCIDENT, dependencies=[needs(Role.TECHNICIAN)])
async def change_incident(
    kept: IncidentsOf, files: RecordingsOf, person: PersonOf, key: str, given: IncidentChange
) -> IncidentDoc:
    """Keep another version; it stays on its recording."""
    now = (await kept.get(key)).draft
    draft = given.draft(now.recording, now.fingerprint, now.turbine)
    return await _doc(kept, files, await kept.edit(key, given.based_on, draft, person.person))


@router.delete(INCIDENT, dependencies=[needs(Role.EXPERT)])
async def hide_incident(kept: IncidentsOf, person: PersonOf, key: str) -> Nothing:
    """List it no more; its versions stay readable."""
    await kept.hide(key, person.person)
    return Nothing()


# -- out and in ----------------------------------------------------------------------


def get_desk(kept: IncidentsOf, marks: AnnotationsOf, files: RecordingsOf, bench: BenchOf) -> IncidentDesk:
    """Export and import. Raises NotFoundError where the server keeps nothing."""
    if bench.moments is None:
        raise NotFoundError(what="recordings")
    return IncidentDesk(kept, marks, bench.office.library, files, bench.moments, files.folder)


DeskOf = Annotated[IncidentDesk, Depends(get_desk)]


@router.get(INCIDENT + "/bundle", response_class=Response)
async def export_incident(desk: DeskOf, person: PersonOf, key: str) -> Response:
    """The incident as one file: recording cut, descriptions, sets, notes, annotations."""
    folder = await asyncio.to_thread(tempfile.mkdtemp, prefix="hubside-bundle-")
    try:
        exported = await desk.export(key, Path(folder) / "bundle", person.person)
    except BaseException:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
        raise
    gone = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
    headers = as_attachment(exported.name)
    return FileResponse(exported.path, media_type=OCTETS, headers=headers, background=gone)


@router.get(INCIDENT + "/report", response_class=Response)
async def incident_report(
    request: Request, desk: DeskOf, bench: BenchOf, person: PersonOf, key: str, language: LanguageName | None = None
) -> Response:
    """The incident as one HTML file to keep: it opens from a disk, with plots, values, words and the 3D scene."""
    data = bench.options.data
    cache = None if data is None else data / "indexes"
    wanted = language or request.app.state.language
    made = await make_report(desk, key, person.person, wanted, bench.sites.turbines, cache)
    return Response(made.html.encode(), media_type="text/html; charset=utf-8", headers=as_attachment(made.name))


@router.post(
    "/incidents/import",
    dependencies=[needs(Role.TECHNICIAN)],
    openapi_extra={
        "requestBody": {"required": True, "content": {OCTETS: {"schema": {"type": "string", "format": "binary"}}}}
    },
)
async def import_incident(
    request: Request,
    bench: BenchOf,
    desk: DeskOf,
    files: RecordingsOf,
    person: PersonOf,
    name: Annotated[str, Query(max_length=250)],
) -> IncidentTaken:
    """Open a bundle, the body of the request, and keep what of it is whole; ``name`` is that of its file."""
    folder = await asyncio.to_thread(tempfile.mkdtemp, prefix="hubside-bundle-")
    try:
        path = Path(folder) / "bundle"
        await _store_body(request, path)
        taken = await desk.take(path, person.person, name)
    finally:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)
    if taken.recording is not None:
        bench.indexing.later(files.folder / taken.recording)
    doc = None if taken.incident is None else await _doc(desk.incidents, files, taken.incident)
    return IncidentTaken.of(taken, doc)


def _too_large() -> TooLargeError:
    return TooLargeError(reason=f"the bundle is larger than {MAX_BUNDLE_BYTES >> 20} MB")


async def _store_body(request: Request, path: Path) -> None:
    """Write the body of a request into a file. Raises TooLargeError, at once where the length is told."""
    told = request.headers.get("content-length", "")
    size = 0
    if told.isdecimal() and int(told) > MAX_BUNDLE_BYTES:
        raise _too_large()
    with path.open("xb") as file:
        async for piece in request.stream():
            size += len(piece)
            if size > MAX_BUNDLE_BYTES:
                raise _too_large()
            await asyncio.to_thread(file.write, piece)


# -- annotations ---------------------------------------------------------------------


@router.get("/recordings/{name}/annotations")
async def list_annotations(marks: AnnotationsOf, files: RecordingsOf, name: str) -> AnnotationList:
    """The annotations of a recording, after a look at the file beside it; also of one that is gone."""
    return AnnotationList.of(await marks.of(name, files.path(name)))


@router.post("/recordings/{name}/annotations", dependencies=[needs(Role.TECHNICIAN)])
async def annotate(
    kept: IncidentsOf, marks: AnnotationsOf, files: RecordingsOf, person: PersonOf, name: str, given: MarkIn
) -> AnnotationDoc:
    """Mark a point or a stretch of a recording."""
    path = _known(files, name)
    mark = given.mark(await _incident_id(kept, given.incident))
    return AnnotationDoc.of(*await marks.add(name, path, mark, person.person))


@router.put("/annotations/{annotation_id}", dependencies=[needs(Role.TECHNICIAN)])
async def change_annotation(
    marks: AnnotationsOf, files: RecordingsOf, person: PersonOf, annotation_id: str, given: MarkIn
) -> AnnotationDoc:
    """Change one; it stays on its recording and with its incident."""
    before = await marks.get(annotation_id)
    path = files.path(before.recording)
    mark = given.mark(before.incident)
    return AnnotationDoc.of(*await marks.change(annotation_id, path, mark, person.person))


@router.delete("/annotations/{annotation_id}", dependencies=[needs(Role.TECHNICIAN)])
async def remove_annotation(marks: AnnotationsOf, files: RecordingsOf, person: PersonOf, annotation_id: str) -> Nothing:
    """Take one off."""
    before = await marks.get(annotation_id)
    await marks.remove(annotation_id, files.path(before.recording), person.person)
    return Nothing()


# -- short links ---------------------------------------------------------------------


@links.get("/i/{code}")
async def open_link(request: Request, bench: BenchOf, code: str) -> Response:
    """Lead to the page at the moment of the incident; who must log in first is led there without a word of it."""
    person: SignedIn | None = request.scope.get(SIGNED_IN)
    if person is None:
        return RedirectResponse(closed_link(code), 303)
    kept = bench.office.incidents
    try:
        found = await kept.get(code)
    except IncidentUnknownError:
        return RedirectResponse(closed_link(code), 303)  # the page says that there is none
    return RedirectResponse(page_link(found, await kept.standing(get_recordings(bench), found)), 303)


# ------------------------------------------------------------------------------------


async def _doc(kept: Incidents, files: Recordings, one: Incident) -> IncidentDoc:
    return IncidentDoc.of(one, await kept.standing(files, one), await kept.known_hash(one))


async def _incident_id(kept: Incidents, key: str | None) -> str | None:
    return None if key is None else (await kept.get(key)).id


def _known(files: Recordings, name: str) -> Path:
    path = files.path(name)
    if path is None:
        raise NotFoundError(what=name)
    return path


def _identity(path: Path) -> tuple[str, str, tuple[int, int]]:
    """Fingerprint, turbine and time of a recording. Raises RecordingError."""
    with open_recording(path) as recording:
        return fingerprint(path), recording.info.turbine, recording.span_ns or (0, 0)


async def _take_hash(kept: Incidents, path: Path) -> None:
    """For the incident it is enough that its recording has a fingerprint; the hash is taken again when needed."""
    try:
        await kept.hash_of(path)
    except HubsideError:
        return
