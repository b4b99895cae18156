"""Parameter sets of the data folder, and the backup that makes new ones."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Depends, Request
from fastapi.responses import FileResponse

from app.errors import HubsideError
from app.model.roles import Role
from app.service.backup import ReadReport, keep_sets, read_devices, readable
from app.service.devices import Target
from app.service.jobs import Job
from app.service.set_list import SetFile, SetFiles, SetLook, look_of, open_set
from app.service.views import raw_to_json
from app.web.deps import BenchOf, ConnectionOf, JobsOf, PersonOf, needs
from app.web.models import JobDoc
from app.web.models.sets import BackupRequest, SetDoc, SetHead, SetList, SetRef
from app.web.problem import NotFoundError
from app.web.routes.jobs import job_doc

router = APIRouter()


def get_sets(request: Request, bench: BenchOf) -> SetFiles:
    """The sets of this server's data folder. Raises NotFoundError where it has none."""
    folder = bench.options.data
    if folder is None:
        raise NotFoundError(what="sets")
    state = request.app.state
    if not hasattr(state, "sets"):
        state.sets = SetFiles(folder / "sets")
    sets: SetFiles = state.sets
    return sets


SetsOf = Annotated[SetFiles, Depends(get_sets)]


@router.get("/sets")
async def sets(all_of_them: SetsOf) -> SetList:
    """The set files, latest first. Those without head and reason are filled in by the next requests."""
    files = await asyncio.to_thread(all_of_them.files)
    return SetList(folder=str(all_of_them.folder), files=[_ref(one) for one in files])


@router.get("/sets/{turbine}/{file}")
async def parameter_set(all_of_them: SetsOf, turbine: str, file: str) -> SetDoc:
    """One set with all its values."""
    path = _known(all_of_them, turbine, file)
    found = await asyncio.to_thread(open_set, path)
    return SetDoc(
        name=f"{turbine}/{file}",
        path=str(path),
        head=SetHead.model_validate(look_of(found)),
        values={address.short: raw_to_json(raw) for address, raw in found.values.items()},
        unread={address.short: why for address, why in found.unread.items()},
        empty=[address.short for address in found.empty],
    )


@router.get("/sets/{turbine}/{file}/download", response_class=FileResponse)
async def download_set(all_of_them: SetsOf, turbine: str, file: str) -> FileResponse:
    """The set file as it is."""
    path = _known(all_of_them, turbine, file)
    return FileResponse(path, media_type="application/json", filename=path.name)


@router.post("/live/backup", dependencies=[needs(Role.TECHNICIAN)])
async def backup(
    connection: ConnectionOf, jobs: JobsOf, person: PersonOf, all_of_them: SetsOf, request: BackupRequest
) -> JobDoc:
    """Read every device of the turbine completely in the background, and keep a set of each."""
    pairs = [(connection.driver(target), target) for target in connection.targets]
    slug, folder = connection.turbine.slug, all_of_them.folder

    async def work(job: Job) -> None:
        done = dict.fromkeys((target.slug for _, target in pairs), 0)

        def progress(target: Target, count: int, _total: int) -> None:
            done[target.slug] = count
            job.done = sum(done.values())

        job.total = sum(len(readable(target.description)) for _, target in pairs)
        reports = await read_devices(pairs, progress)
        wall_ns = time.time_ns()
        await asyncio.to_thread(keep_sets, reports, folder, slug, person.person, request.reason, wall_ns)
        job.failed = [failure for report in reports for failure in _failures(report)]
        job.done = job.total

    return job_doc(jobs.start("backup", slug, work))


def _failures(report: ReadReport) -> list[tuple[str, HubsideError]]:
    """What was not read of a device; one line where it is the device as a whole."""
    slug = report.target.slug
    if report.lost is not None:
        return [(slug, report.lost)]
    if not report.values:
        return [(slug, error) for error in list(report.failed.values())[:1]]
    return [(f"{slug} {address.short}", error) for address, error in report.errors.items()]


def _known(all_of_them: SetFiles, turbine: str, file: str) -> Path:
    path = all_of_them.path(f"{turbine}/{file}")
    if path is None:
        raise NotFoundError(what=f"{turbine}/{file}")
    return path


def _ref(one: SetFile) -> SetRef:
    look = one.look
    return SetRef(
        name=one.name,
        size_bytes=one.size_bytes,
        modified_ns=one.modified_ns,
        head=None if look is None or look.origin is None else _head(look),
        reason=None if look is None else look.reason,
    )


def _head(look: SetLook) -> SetHead:
    return SetHead.model_validate(look)
