"""Recordings to and from other formats: exports to download, uploads to import, cuts, merges, anonymised copies."""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, NamedTuple

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from app.errors import RefusedError, UsageError
from app.model.address import parse_address
from app.model.roles import Role
from app.model.site import Turbine
from app.recording.exchange.anonymise import AnonymiseOrder
from app.recording.exchange.cut import CutOrder, cut
from app.recording.exchange.exporting import Choice, export, losses
from app.recording.exchange.formats import SUFFIXES, Format, Style
from app.recording.exchange.importing import ImportOrder, plain_name
from app.recording.exchange.merge import MergeInput
from app.recording.exchange.table import Shape, TableOrder, arrow, signals_named, write_table
from app.recording.reader import open_recording
from app.recording.writer import free_space
from app.service.exchange import (
    DOWNLOAD_PREFIX,
    KIND,
    SPARE_BYTES,
    UPLOAD_PREFIX,
    UPLOAD_SUFFIX,
    Action,
    Made,
    Room,
    Work,
    anonymise_into,
    check_free,
    cut_into,
    import_upload,
    in_background,
    in_thread,
    merge_into,
    sweep_once,
)
from app.service.indexing import Indexing
from app.service.jobs import Job, Jobs
from app.service.recording_list import Recordings
from app.web.attachment import as_attachment
from app.web.deps import BenchOf, JobsOf, PersonOf, needs
from app.web.guard import MAX_RECORDING
from app.web.models.exchange import (
    AnonymiseRequest,
    CutRequest,
    ExchangeJob,
    LossDoc,
    LossesDoc,
    MergeRequest,
    made_of,
)
from app.web.problem import NotFoundError
from app.web.routes.recordings import MCAP, RecordingsOf

router = APIRouter()
Moment = Annotated[int | None, Query(ge=0, lt=2**62, description="ns since 1970; without it from begin or to end")]
Buses = Annotated[list[str] | None, Query(max_length=100, description="All where none is given", examples=[["can0"]])]
Exact = Annotated[bool, Query(description="Nine decimals, directions, raw DLC: loses nothing, fewer tools read it")]


def get_choice(
    into: Annotated[Format, Query(alias="format")],
    exact: Exact = False,
    bus: Buses = None,
    start_ns: Moment = None,
    end_ns: Moment = None,
) -> Choice:
    """What of a recording is exported, and how."""
    return Choice(into, Style.EXACT if exact else Style.COMMON, bus, start_ns, end_ns)


ChoiceOf = Annotated[Choice, Depends(get_choice)]


@router.get("/recordings/{name}/losses")
async def export_losses(recordings: RecordingsOf, name: str, choice: ChoiceOf) -> LossesDoc:
    """What the format cannot hold of a recording: every frame is looked at, before anything is exported."""
    path = _known(recordings, name)

    def counted() -> LossesDoc:
        with open_recording(path) as recording:
            told = losses(recording, choice)
        details = {"format": choice.into.value}
        return LossesDoc(
            losses=[
                LossDoc(
                    what=what.value,
                    things=things,
                    text_key=f"exchange.loss.{what.value}",
                    details={**details, "things": things},
                )
                for what, things in told
            ]
        )

    return await in_thread(counted)


@router.get("/recordings/{name}/export", response_class=FileResponse)
async def export_recording(recordings: RecordingsOf, name: str, choice: ChoiceOf) -> Response:
    """A recording, or a part of it, in another format, to download."""
    path = _known(recordings, name)
    suffix = SUFFIXES[choice.into] if choice.into is not Format.MCAP else ".part.mcap"

    def write(target: Path, room: Room) -> None:
        if choice.into is Format.MCAP:
            cut(path, target, CutOrder(choice.start_ns, choice.end_ns, choice.buses), room)
            return
        with open_recording(path) as recording:
            export(recording, target, choice, room)

    return await _download(recordings, path, path.stem + suffix, write)


@router.get("/recordings/{name}/table", response_class=FileResponse)
async def export_table(
    recordings: RecordingsOf,
    name: str,
    shape: Shape = Shape.LONG,
    signal: Annotated[
        list[str] | None,
        Query(max_length=500, description="DEVICE:ADDRESS; all where none is given", examples=[["can0/11:6064"]]),
    ] = None,
    start_ns: Moment = None,
    end_ns: Moment = None,
) -> Response:
    """The decoded signals of a recording as Apache Parquet, to download."""
    arrow()
    path = _known(recordings, name)

    def write(target: Path, room: Room) -> None:
        with open_recording(path) as recording:
            nodes = recording.metadata.get("nodes", {})
            signals = None if signal is None else signals_named(signal, nodes)
            write_table(recording, target, TableOrder(shape, signals, start_ns, end_ns), room)

    return await _download(recordings, path, f"{path.stem}.parquet", write)


async def _download(recordings: Recordings, source: Path, name: str, write: Callable[[Path, Room], None]) -> Response:
    """A file that ``write`` makes of ``source``, and that is gone when it was sent."""
    check_free()
    await asyncio.to_thread(recordings.folder.mkdir, parents=True, exist_ok=True)
    folder = Path(await asyncio.to_thread(tempfile.mkdtemp, prefix=DOWNLOAD_PREFIX, dir=recordings.folder))

    def clear() -> None:
        shutil.rmtree(folder, ignore_errors=True)

    target = folder / "export"
    try:
        await in_thread(lambda: write(target, Room(folder, source.stat().st_size)))
    except BaseException:
        await asyncio.to_thread(clear)
        raise
    return FileResponse(target, media_type=MCAP, headers=as_attachment(name), background=BackgroundTask(clear))


# -- recordings that are made --------------------------------------------------------


class Makers(NamedTuple):
    """Starts what makes recordings; each gets its index when nothing else is to be done."""

    jobs: Jobs
    indexing: Indexing
    folder: Path

    def start(self, action: Action, name: str, work: Work) -> ExchangeJob:
        """Make recordings in ``folder``, of what is called ``name``. Raises RefusedError where too much is at work."""
        check_free()

        async def run(job: Job) -> None:
            await in_background(job, work)
            made = made_of(job)
            for file in () if made is None else made.files:
                self.indexing.later(self.folder / file)

        job = self.jobs.start(KIND, name, run)
        job.result = made = Made(action)
        return ExchangeJob.of(job, made)


def get_makers(bench: BenchOf, jobs: JobsOf, recordings: RecordingsOf) -> Makers:
    """Those of this server's data folder."""
    return Makers(jobs, bench.indexing, recordings.folder)


MakersOf = Annotated[Makers, Depends(get_makers)]


@router.post(
    "/recordings/import",
    dependencies=[needs(Role.TECHNICIAN)],
    openapi_extra={
        "requestBody": {
            "required": True,
            "description": "The file itself; at most 4 GiB",
            "content": {MCAP: {"schema": {"type": "string", "format": "binary"}}},
        }
    },
)
async def import_recording(
    request: Request,
    bench: BenchOf,
    makers: MakersOf,
    recordings: RecordingsOf,
    person: PersonOf,
    file: Annotated[str, Query(max_length=300, description="What the file is called", examples=["trip.blf"])],
    form: Annotated[Format | None, Query(alias="format", description="Where the file does not tell")] = None,
    turbine: Annotated[str | None, Query(max_length=100, description="A turbine of the site file")] = None,
    start: Annotated[datetime | None, Query(description="When the first frame came")] = None,
    lenient: Annotated[bool, Query(description="Leave bad lines out and count them")] = False,
) -> ExchangeJob:
    """Make a recording of a file of another tool: candump, ASC, BLF, TRC, CSV or MCAP. The body is the file."""
    order = _order(bench.sites.turbines.get(turbine or ""), turbine, person.person, form, start, lenient)
    name = plain_name(Path(file).name)
    sweep_once(recordings.folder)
    check_free()
    upload = await _received(request, recordings.folder)
    try:
        return makers.start(Action.IMPORT, name, import_upload(upload, name, recordings.folder, order))
    except RefusedError:
        await asyncio.to_thread(upload.unlink, missing_ok=True)
        raise


@router.post("/recordings/{name}/cut", dependencies=[needs(Role.TECHNICIAN)])
async def cut_recording(recordings: RecordingsOf, makers: MakersOf, name: str, given: CutRequest) -> ExchangeJob:
    """Make a recording of a part of one, beside it, that replays from its beginning."""
    order = CutOrder(given.start_ns, given.end_ns, given.buses)
    return makers.start(Action.CUT, name, cut_into(recordings.folder, _known(recordings, name), order))


@router.post("/recordings/merge", dependencies=[needs(Role.TECHNICIAN)])
async def merge_recordings(recordings: RecordingsOf, makers: MakersOf, given: MergeRequest) -> ExchangeJob:
    """Make one recording of several: parts of one, or of several buses."""
    inputs = [MergeInput(_known(recordings, one.name), one.offset_ns, one.buses) for one in given.recordings]
    return makers.start(Action.MERGE, given.recordings[0].name, merge_into(recordings.folder, inputs))


@router.post("/recordings/{name}/anonymise", dependencies=[needs(Role.TECHNICIAN)])
async def anonymise_recording(
    recordings: RecordingsOf, makers: MakersOf, name: str, given: AnonymiseRequest
) -> ExchangeJob:
    """Make a copy that does not tell whose recording it is."""
    order = AnonymiseOrder(given.hide_times, [parse_address(text) for text in given.objects], given.words)
    return makers.start(
        Action.ANONYMISE,
        name,
        anonymise_into(recordings.folder, _known(recordings, name), order),
    )


@router.get("/recordings/made/{job_id}")
async def exchange_job(jobs: JobsOf, job_id: str) -> ExchangeJob:
    """How an import, cut, merge or anonymised copy stands, and what came of it."""
    return _doc(jobs.get(job_id), job_id)


@router.delete("/recordings/made/{job_id}", dependencies=[needs(Role.TECHNICIAN)])
async def cancel_exchange(jobs: JobsOf, job_id: str) -> ExchangeJob:
    """End it; nothing half made is left."""
    _doc(jobs.get(job_id), job_id)
    jobs.cancel(job_id)
    return _doc(jobs.get(job_id), job_id)


def _doc(job: Job | None, job_id: str) -> ExchangeJob:
    made = made_of(job)
    if job is None or made is None:
        raise NotFoundError(what=job_id)
    return ExchangeJob.of(job, made)


def _known(recordings: Recordings, name: str) -> Path:
    sweep_once(recordings.folder)
    path = recordings.path(name)
    if path is None:
        raise NotFoundError(what=name)
    return path


def _order(
    turbine: Turbine | None, slug: str | None, person: str, form: Format | None, start: datetime | None, lenient: bool
) -> ImportOrder:
    nodes, rates = {}, {}
    if turbine is not None:
        nodes = {f"{one.bus}/{one.node}": f"{one.slug} {one.description_id}" for one in turbine.devices}
        rates = {bus.name: bus.bitrate for bus in turbine.buses if bus.bitrate}
    start_ns = None
    if start is not None:
        moment = start if start.tzinfo is not None else start.replace(tzinfo=UTC)
        start_ns = round(moment.timestamp() * 1_000_000) * 1_000
        if start_ns < 0:
            raise UsageError(reason="a start before 1970")
    return ImportOrder(
        turbine=slug or "import",
        who=person,
        bit_rates=rates,
        nodes=nodes,
        form=form,
        start_ns=start_ns,
        lenient=lenient,
    )


async def _received(request: Request, folder: Path) -> Path:
    """The body as a file in ``folder``. Raises UsageError where it is too large or the disk too small for it."""
    await asyncio.to_thread(folder.mkdir, parents=True, exist_ok=True)
    most = min(MAX_RECORDING, max(free_space(folder) - SPARE_BYTES, 0))
    announced = request.headers.get("content-length", "")
    if announced.isdecimal() and int(announced) > most:
        raise UsageError(reason=f"the file is too large: at most {most >> 20} MiB fit")
    with tempfile.NamedTemporaryFile(prefix=UPLOAD_PREFIX, suffix=UPLOAD_SUFFIX, dir=folder, delete=False) as file:
        path, size = Path(file.name), 0
        try:
            async for piece in request.stream():
                size += len(piece)
                if size > most:
                    raise UsageError(reason=f"the file is too large: at most {most >> 20} MiB fit")
                await asyncio.to_thread(file.write, piece)
        except BaseException:
            await asyncio.to_thread(path.unlink, missing_ok=True)
            raise
    return path
