"""One device: read, write, save, restart."""

from __future__ import annotations

from fastapi import APIRouter

from app.model.address import parse_address
from app.model.checks import Allow
from app.model.roles import Role
from app.service.backup import read_device, readable
from app.service.devices import Target
from app.service.jobs import Job
from app.service.save import restart, save
from app.service.views import raw_from_json, raw_to_json
from app.service.write import write_raw
from app.web.deps import DEVICE, BenchOf, ConnectionOf, JobsOf, JournalOf, PersonOf, TargetOf, needs
from app.web.models import JobDoc, Nothing, ReadRequest, RestartDone, SaveDone, SaveRequest, WriteDone, WriteRequest
from app.web.routes.jobs import job_doc

router = APIRouter(dependencies=[needs(Role.TECHNICIAN)])


@router.post(f"{DEVICE}/read")
async def read(
    bench: BenchOf, connection: ConnectionOf, jobs: JobsOf, person: PersonOf, target: TargetOf, request: ReadRequest
) -> JobDoc:
    """Read objects in the background; their values come by the socket."""
    wanted = None if request.addresses is None else [parse_address(text) for text in request.addresses]
    for address in wanted or ():
        target.entry(address)

    async def work(job: Job) -> None:
        def progress(_target: Target, done: int, total: int) -> None:
            job.done, job.total = done, total

        job.total = len(readable(target.description) if wanted is None else wanted)
        report = await read_device(connection.driver(target), target, wanted, progress)
        if wanted is None:
            await bench.keep_found([report], person.person)
        job.failed = [(address.short, error) for address, error in report.failed.items()]
        job.done = job.total

    return job_doc(jobs.start("read", target.slug, work))


@router.post(f"{DEVICE}/write")
async def write(
    connection: ConnectionOf, journal: JournalOf, person: PersonOf, target: TargetOf, request: WriteRequest
) -> WriteDone:
    """Check, write once, read back. What only the maker sets needs an expert."""
    address = parse_address(request.address)
    raw = raw_from_json(target.entry(address), request.raw)
    allow = Allow.FACTORY if person.role is Role.EXPERT else Allow.NOTHING
    allow |= Allow.ADDRESS if request.address_confirmed else Allow.NOTHING
    done = await write_raw(connection.driver(target), target, address, raw, journal, allow=allow)
    return WriteDone(
        address=address.short,
        sent_raw=raw_to_json(done.sent),
        read_raw=None if done.read is None else raw_to_json(done.read),
        verified=done.verified,
        was_raw=None if done.was is None else raw_to_json(done.was),
        t_ns=connection.stamper(),
    )


@router.post(f"{DEVICE}/save")
async def save_device(connection: ConnectionOf, journal: JournalOf, target: TargetOf, request: SaveRequest) -> SaveDone:
    """Make the device's parameters non-volatile, all or those of one category, and wait until it acknowledges."""
    took = await save(connection.driver(target), target, journal, connection.stamper, request.category)
    return SaveDone(t_ns=took.t_ns, took_s=took.took_s, category=request.category)


@router.post(f"{DEVICE}/restart")
async def restart_device(
    connection: ConnectionOf, journal: JournalOf, target: TargetOf, _request: Nothing
) -> RestartDone:
    """Restart the device, and wait until it has booted."""
    took = await restart(connection.driver(target), target, journal, connection.stamper)
    return RestartDone(boot_up_t_ns=took.t_ns, took_s=took.took_s, proven=took.proven)
