"""Work that takes a while: started once, watched by anyone, cancelled whole."""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final
from uuid import uuid4

from app.errors import HubsideError
from app.model.datatypes import Raw

log = logging.getLogger(__name__)

KEPT: Final = 100


class JobState(Enum):
    """How a job stands."""

    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


class RowState(Enum):
    """How one object of a job that writes stands.

    ``UNPROVEN``: sent and acknowledged, but only an effect would prove it. ``REFUSED``: by us or by the device, or not
    verified; the row's error says which. ``NOT_SAVED``: verified in RAM, but the save was not acknowledged.
    """

    WAITING = "waiting"
    SENT = "sent"
    VERIFIED = "verified"
    UNPROVEN = "unproven"
    SAVING = "saving"
    SAVED = "saved"
    REFUSED = "refused"
    NOT_SAVED = "not_saved"


@dataclass
class JobRow:
    """One object of a job that writes: ``was`` and ``read`` are what RAM held before and after; ``error`` says why."""

    device: str
    address: str
    state: RowState = RowState.WAITING
    was: Raw | None = None
    read: Raw | None = None
    error: HubsideError | None = None


@dataclass
class Job:
    """One piece of work; ``failed`` names what did not succeed although the job went on.

    ``result`` is what it has found so far, of a type that its kind knows.
    """

    id: str
    kind: str
    device: str
    state: JobState = JobState.RUNNING
    done: int = 0
    total: int = 0
    failed: list[tuple[str, HubsideError]] = field(default_factory=list)
    error: HubsideError | None = None
    rows: list[JobRow] = field(default_factory=list)
    result: object = None


class Jobs:
    """The jobs of one server, the latest hundred kept. Lives in the event loop."""

    def __init__(self) -> None:
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def start(self, kind: str, device: str, work: Callable[[Job], Awaitable[None]], rows: Sequence[JobRow] = ()) -> Job:
        """Run ``work`` in the background; it reports through the job that it is given, and through its rows."""
        job = Job(uuid4().hex, kind, device, total=len(rows), rows=list(rows))
        self._jobs[job.id] = job
        while len(self._jobs) > KEPT:
            oldest = next(iter(self._jobs))
            if oldest in self._tasks:
                break
            del self._jobs[oldest]
        task = asyncio.ensure_future(self._run(job, work))
        self._tasks[job.id] = task
        task.add_done_callback(lambda _task: self._tasks.pop(job.id, None))
        return job

    def get(self, job_id: str) -> Job | None:
        """A job by its id, or None."""
        return self._jobs.get(job_id)

    def cancel(self, job_id: str) -> Job | None:
        """End a job; what it did by then stays done."""
        task = self._tasks.get(job_id)
        if task is not None:
            task.cancel()
        return self._jobs.get(job_id)

    async def close(self, timeout_s: float = 5.0) -> None:
        """Cancel all and wait until they have ended."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks, timeout=timeout_s)

    async def _run(self, job: Job, work: Callable[[Job], Awaitable[None]]) -> None:
        try:
            await work(job)
        except asyncio.CancelledError:
            job.state = JobState.CANCELLED
        except HubsideError as error:
            job.state, job.error = JobState.FAILED, error
        except Exception as error:  # a defect of ours: shown to the person, logged for us, never silent
            log.exception("job %s failed", job.kind)
            job.state, job.error = JobState.FAILED, HubsideError(reason=repr(error))
        else:
            job.state = JobState.DONE
