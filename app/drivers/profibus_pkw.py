"""The PKW channel of one station: jobs one at a time, with AK 0 between them.

Nothing numbers a job, so an answer that stands there may be that of the one before. Therefore a job is put only after
the station has shown AK 0 to AK 0, and its answer has to name its parameter. Only AK 7 says no, and its code 0 does too
(ED2 manual, 4.6). Pure: the bytes of exchanges in and out, no clock and no line.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from enum import Enum
from typing import Final

from app.wire.profibus import pkw
from app.wire.profibus.fields import FormatError
from app.wire.profibus.pkw import AskKind, PkwAnswer, PkwRequest, ReplyKind


class Failure(Enum):
    """Why a job has no answer."""

    TIMEOUT = "timeout"
    GONE = "gone"
    """The station, or the line, went away. A read is put again; a write is not, for its outcome is open."""
    OVERTAKEN = "overtaken"
    """An urgent command came first: it was not sent."""
    NOT_READY = "not_ready"
    """The order of process data is not proven: nothing but zeros is sent."""
    CANCELLED = "cancelled"


Result = PkwAnswer | Failure
End = Callable[[Result, bool], None]
"""Called once with what became of a job, and whether it was sent."""


class PkwJob:
    """One job. ``refusal`` is asked right before it is sent. Its time runs from when it is its turn."""

    def __init__(
        self, request: PkwRequest, timeout_s: float, end: End,
        urgent: bool = False, refusal: Callable[[], Failure | None] = lambda: None,
    ) -> None:  # fmt: skip
        self.request = request
        self.timeout_s = timeout_s
        self.urgent = urgent
        self.refusal = refusal
        self.deadline_s: float | None = None
        self.sent = False
        self._end = end
        self._ended = False

    @property
    def is_read(self) -> bool:
        """It changes nothing, and may be put again."""
        return self.request.kind is AskKind.READ

    def end(self, result: Result) -> None:
        """Tell what became of it, once."""
        if not self._ended:
            self._ended = True
            self._end(result, self.sent)


_IDLE: Final = pkw.IDLE.encode()
STILL_S: Final = 0.3
"""More than one turn of the line takes: what goes beyond it the host was not there."""


class PkwChannel:
    """The jobs of one station, and the eight bytes that are put for them."""

    def __init__(self) -> None:
        self._queue: deque[PkwJob] = deque()
        self._job: PkwJob | None = None
        self._put = b""
        """The bytes of the job, where it stands in the telegrams."""
        self._clear = False
        """The station has shown AK 0 since the last job."""
        self._looked_s: float | None = None
        self.malformed = 0
        """Answers that were none."""

    @property
    def busy(self) -> bool:
        """There is a reason to exchange at once."""
        return self._job is not None or bool(self._queue) or not self._clear

    @property
    def waiting(self) -> bool:
        """Somebody waits for a job."""
        return self._job is not None or bool(self._queue)

    def put(self, job: PkwJob) -> None:
        """Queue it. An urgent one goes first; a read that is under way is put again behind it."""
        if not job.urgent:
            self._queue.append(job)
            return
        running = self._job
        if running is not None and running.is_read and not running.urgent:
            self._give_up()
            self._queue.appendleft(running)
        self._queue.insert(sum(1 for one in self._queue if one.urgent), job)

    def drop(self, job: PkwJob) -> None:
        """Nobody waits for it any more. A write that was sent stays sent."""
        if job is self._job:
            self._give_up()
        elif job in self._queue:
            self._queue.remove(job)
        job.end(Failure.CANCELLED)

    def outputs(self, now_s: float) -> bytes:
        """Eight bytes for the next exchange."""
        self.expire(now_s)
        if self._job is None or not self._clear:
            return _IDLE
        if not self._put:
            refusal = self._job.refusal()
            if refusal is not None:
                self._finish(refusal)
                return _IDLE
            self._put = self._job.request.encode()
            self._job.sent = True
        return self._put

    def take(self, asked: bytes, shown: bytes) -> None:
        """Eight bytes each way of an exchange that was surely no repetition."""
        try:
            answer = pkw.decode_answer(shown)
        except FormatError:
            self.malformed += 1
            return
        if asked == _IDLE:
            self._clear = self._clear or answer.kind is ReplyKind.NOTHING
        elif self._job is not None and asked == self._put and pkw.answers(self._job.request, answer):
            self._finish(answer)

    def expire(self, now_s: float) -> None:
        """Begin the next job where none is under way, and end the one whose time is over.

        Where the host stood still, nobody's time has run: a device cannot have answered what was not asked.
        """
        still_s = 0.0 if self._looked_s is None else max(0.0, now_s - self._looked_s - STILL_S)
        self._looked_s = now_s
        if self._job is not None and self._job.deadline_s is not None:
            self._job.deadline_s += still_s
        if self._job is not None and self._job.deadline_s is not None and now_s >= self._job.deadline_s:
            self._finish(Failure.TIMEOUT)
        if self._job is None and self._queue:
            self._job = self._queue.popleft()
            self._job.deadline_s = now_s + self._job.timeout_s

    def gone(self) -> None:
        """The station has gone: what was sent there tells nothing. A write that was sent ends, the rest waits on."""
        job, put = self._job, self._put
        self._clear, self._put = False, b""
        if job is not None and put and not job.is_read:
            self._finish(Failure.GONE)

    def end_all(self, failure: Failure) -> None:
        """Nothing goes on."""
        job, waiting = self._job, list(self._queue)
        self._give_up()
        self._queue.clear()
        for one in [*([] if job is None else [job]), *waiting]:
            one.end(failure)

    def _finish(self, result: Result) -> None:
        job = self._job
        self._give_up()
        if job is not None:
            job.end(result)

    def _give_up(self) -> None:
        """From now on AK 0, until the station shows it too."""
        self._clear = self._clear and not self._put
        self._job, self._put = None, b""
