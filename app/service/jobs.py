"""Work that takes a while: started once, watched by anyone, cancelled whole."""

from __future__ import annotations

import asyncio
import logging
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Final
from uuid import uuid4

from app.errors import HubsideError

log = logging.getLogger(__name__)

KEPT: Final = 100


class JobState(Enum):
    """How a job stands."""

    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass
class Job:
    """One piece of work; ``failed`` names what did not succeed although the job went on."""

    id: str
    kind: str
    device: str
    state: JobState = JobState.RUNNING
    done: int = 0
    total: int = 0
    failed: list[tuple[str, HubsideError]] = field(default_factory=list)
    error: HubsideError | None = None


class Jobs:
    """The jobs of one server, the latest hundred kept. Lives in the event loop."""

    def __init__(self) -> None:
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def start(self, kind: str, device: str, work: Callable[[Job], Awaitable[None]]) -> Job:
        """Run ``work`` in the background; it reports through the job that it is given."""
        job = Job(uuid4().hex, kind, device)
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
