"""Work that runs in the background: how it stands, and its end."""

from __future__ import annotations

from fastapi import APIRouter

from app.model.roles import Role
from app.service.jobs import Job, JobRow
from app.service.views import raw_to_json
from app.web.deps import JobsOf, needs
from app.web.models import JobDoc, JobRowDoc
from app.web.problem import NotFoundError, failure

router = APIRouter()


@router.get("/live/jobs/{job_id}")
async def job(jobs: JobsOf, job_id: str) -> JobDoc:
    """How a job stands."""
    return job_doc(_known(jobs.get(job_id), job_id))


@router.delete("/live/jobs/{job_id}", dependencies=[needs(Role.TECHNICIAN)])
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
        rows=[_row_doc(row) for row in job.rows],
    )


def _row_doc(row: JobRow) -> JobRowDoc:
    return JobRowDoc(
        device=row.device,
        address=row.address,
        state=row.state.value,
        was_raw=None if row.was is None else raw_to_json(row.was),
        read_raw=None if row.read is None else raw_to_json(row.read),
        error=None if row.error is None else failure(row.address, row.error),
    )
