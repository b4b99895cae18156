"""The routes of the HTTP API. Each calls one use case; its answer is for the caller, screens rest on the socket."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request

from app import __version__
from app.errors import HubsideError
from app.model.address import parse_address
from app.model.od_export import description_dict
from app.model.texts import LANGUAGES, load_texts
from app.service.backup import read_device, readable
from app.service.connection import Connection
from app.service.devices import Target
from app.service.jobs import Job, Jobs
from app.service.link import TwinWatch
from app.service.save import restart, save
from app.service.stop import AxisOutcome, Command, command_all
from app.service.views import device_state, raw_from_json, raw_to_json
from app.service.write import write_raw
from app.web.models import (
    AxisDone,
    BusRef,
    DeviceRef,
    Failure,
    JobDoc,
    Language,
    Nothing,
    Problem,
    ReadRequest,
    RestartDone,
    SaveDone,
    Session,
    StationRef,
    StopDone,
    Turbine,
    WriteDone,
    WriteRequest,
)
from app.web.problem import MEDIA_TYPE, NotFoundError, problem_of
from app.web.socket import link_of

ANY_PROBLEM: dict[int | str, dict[str, Any]] = {
    "default": {"model": Problem, "description": "What went wrong", "content": {MEDIA_TYPE: {}}}
}
router = APIRouter(prefix="/api", responses=ANY_PROBLEM)


def get_bench(request: Request) -> Connection:
    """The bench that this server serves."""
    bench: Connection = request.app.state.bench
    return bench


def get_twins(request: Request) -> TwinWatch:
    """What is known of whether the devices are simulated."""
    twins: TwinWatch = request.app.state.twins
    return twins


def get_jobs(request: Request) -> Jobs:
    """The jobs of this server."""
    jobs: Jobs = request.app.state.jobs
    return jobs


def get_target(request: Request, turbine: str, station: str, device: str) -> Target:
    """The device of the path; errors from here on tell the state that it is in. Raises NotFoundError."""
    slug = f"{turbine}/{station}/{device}"
    target = next((one for one in get_bench(request).targets if one.slug == slug), None)
    if target is None:
        raise NotFoundError(what=slug)
    request.state.device_state = lambda: device_state(target)
    return target


BenchOf = Annotated[Connection, Depends(get_bench)]
TwinsOf = Annotated[TwinWatch, Depends(get_twins)]
JobsOf = Annotated[Jobs, Depends(get_jobs)]
TargetOf = Annotated[Target, Depends(get_target)]
DEVICE = "/live/devices/{turbine}/{station}/{device}"


# -- session and texts ------------------------------------------------------------


@router.get("/session")
async def session(request: Request) -> Session:
    """Who is served, and in which languages."""
    return Session(version=__version__, role="technician", languages=list(LANGUAGES), locale=request.app.state.language)


@router.get("/texts/{locale}")
async def texts(locale: Language) -> dict[str, str]:
    """All texts for people in one language, by key."""
    return dict(load_texts(locale).flat)


# -- turbine and descriptions -------------------------------------------------------


@router.get("/live/turbine")
async def turbine(bench: BenchOf, twins: TwinsOf) -> Turbine:
    """The connected turbine with its stations and devices."""
    site = bench.turbine
    link = link_of(bench, twins, bench.stamper())
    adapter = bench.buses[link.bus].adapter if link.bus else ""
    stations = [
        StationRef(
            slug=station.slug,
            name=station.name,
            blade=station.blade,
            devices=[
                DeviceRef(slug=one.slug, node=one.node, description_id=one.description_id, name=one.name)
                for one in station.devices
            ],
        )
        for station in site.stations
    ]
    bus = BusRef(name=link.bus, bitrate=link.bitrate, interface=adapter)
    return Turbine(slug=site.slug, name=site.name, mode=link.mode, bus=bus, stations=stations)


@router.get("/live/descriptions/{description_id}")
async def description(bench: BenchOf, description_id: str) -> dict[str, Any]:
    """Everything that is known of a device's objects."""
    found = next((one.description for one in bench.targets if one.description.id == description_id), None)
    if found is None:
        raise NotFoundError(what=description_id)
    return description_dict(found)


# -- devices ------------------------------------------------------------------------


@router.post(f"{DEVICE}/read")
async def read(bench: BenchOf, jobs: JobsOf, target: TargetOf, request: ReadRequest) -> JobDoc:
    """Read objects in the background; their values come by the socket."""
    wanted = None if request.addresses is None else [parse_address(text) for text in request.addresses]
    for address in wanted or ():
        target.entry(address)

    async def work(job: Job) -> None:
        def progress(_target: Target, done: int, total: int) -> None:
            job.done, job.total = done, total

        job.total = len(readable(target.description) if wanted is None else wanted)
        report = await read_device(bench.driver(target), target, wanted, progress)
        job.failed = [(address.short, error) for address, error in report.failed.items()]
        job.done = job.total

    return job_doc(jobs.start("read", target.slug, work))


@router.post(f"{DEVICE}/write")
async def write(bench: BenchOf, target: TargetOf, request: WriteRequest) -> WriteDone:
    """Check, write once, read back."""
    address = parse_address(request.address)
    raw = raw_from_json(target.entry(address), request.raw)
    done = await write_raw(bench.driver(target), target, address, raw, bench.journal)
    return WriteDone(
        address=address.short,
        sent_raw=raw_to_json(done.sent),
        read_raw=None if done.read is None else raw_to_json(done.read),
        verified=done.verified,
        was_raw=None if done.was is None else raw_to_json(done.was),
        t_ns=bench.stamper(),
    )


@router.post(f"{DEVICE}/save")
async def save_device(bench: BenchOf, target: TargetOf, _request: Nothing) -> SaveDone:
    """Make the device's parameters non-volatile, and wait until it acknowledges."""
    took = await save(bench.driver(target), target, bench.journal, bench.stamper)
    return SaveDone(t_ns=took.t_ns, took_s=took.took_s)


@router.post(f"{DEVICE}/restart")
async def restart_device(bench: BenchOf, target: TargetOf, _request: Nothing) -> RestartDone:
    """Restart the device, and wait until it has booted."""
    took = await restart(bench.driver(target), target, bench.journal, bench.stamper)
    return RestartDone(boot_up_t_ns=took.t_ns, took_s=took.took_s)


# -- jobs ---------------------------------------------------------------------------


@router.get("/live/jobs/{job_id}")
async def job(jobs: JobsOf, job_id: str) -> JobDoc:
    """How a job stands."""
    return job_doc(_known(jobs.get(job_id), job_id))


@router.delete("/live/jobs/{job_id}")
async def cancel_job(jobs: JobsOf, job_id: str) -> JobDoc:
    """End a job; what it did by then stays done."""
    return job_doc(_known(jobs.cancel(job_id), job_id))


def _known(job: Job | None, job_id: str) -> Job:
    if job is None:
        raise NotFoundError(what=job_id)
    return job


def job_doc(job: Job) -> JobDoc:
    """A job as the page gets it."""
    return JobDoc(
        id=job.id,
        kind=job.kind,
        device=job.device,
        state=job.state.value,
        done=job.done,
        total=job.total,
        failed=[failure(address, error) for address, error in job.failed],
        error=None if job.error is None else failure("", job.error),
    )


def failure(address: str, error: HubsideError) -> Failure:
    """An error as part of a result."""
    problem = problem_of(error)
    return Failure(address=address, code=problem.code, text_key=problem.text_key, details=problem.details)


# -- stop ---------------------------------------------------------------------------


@router.post("/live/stop")
async def stop(bench: BenchOf, _request: Nothing) -> StopDone:
    """STOP to every axis. This is no safety function."""
    return _stop_done(await command_all(bench.axes(), Command.STOP, bench.journal, bench.stamper))


@router.post("/live/feather")
async def feather(bench: BenchOf, _request: Nothing) -> StopDone:
    """FEATHER to every axis. This is no safety function."""
    return _stop_done(await command_all(bench.axes(), Command.FEATHER, bench.journal, bench.stamper))


def _stop_done(outcomes: list[AxisOutcome]) -> StopDone:
    return StopDone(
        axes=[
            AxisDone(
                device=one.device,
                sent_t_ns=one.sent_t_ns,
                confirmed_t_ns=one.confirmed_t_ns,
                how=one.how.value,
                error=None if one.error is None else failure("", one.error),
            )
            for one in outcomes
        ]
    )
