"""Follows the PKW jobs of one slave, seen from outside: which answer is that of which job.

A job stands in many exchanges, and nothing numbers it. Its answer is the first one that fits and that did not stand
there before it: an answer that was there already may be that of an equal job earlier.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from app.wire.frame import Direction
from app.wire.profibus.fields import FormatError
from app.wire.profibus.pkw import (
    AskKind,
    PkwAnswer,
    PkwRequest,
    ReplyKind,
    answers,
    decode_answer,
    decode_request,
)


class Job(NamedTuple):
    """A job and where it began; ``settled`` once it was answered."""

    request: PkwRequest
    t_ns: int
    client: Direction
    settled: bool = False


class Ended(NamedTuple):
    """A job that was answered, or (None) that nobody will answer any more. ``again``: a read that tells more."""

    job: Job
    answer: PkwAnswer | None
    again: bool = False


class PkwFollower:
    """The PKW channel of one slave."""

    def __init__(self) -> None:
        self._job: Job | None = None
        self._shown = bytes(8)
        """The answer that stood there in the latest exchange."""

    def exchange(self, t_ns: int, asked: bytes, shown: bytes, client: Direction, base: int = 0) -> list[Ended]:
        """Eight bytes each way of one exchange; those of the slave stand at ``base``.

        Raises FormatError where they are no job (at ``base``), or no answer.
        """
        try:
            request = decode_request(asked)
        except FormatError as error:
            raise FormatError(error.fault, base, f"answers what is no job: {error}") from error
        answer = decode_answer(shown, base)
        fresh, self._shown = shown != self._shown, shown
        ended, job = [], self._job
        if job is None or job.request != request:
            if job is not None and not job.settled:
                # The answer of this exchange left before the new job came: it can still be that of the old one.
                late = answer if fresh and answers(job.request, answer) else None
                ended.append(Ended(job, late))
                fresh = fresh and late is None
            job = Job(request, t_ns, client, settled=request.kind is AskKind.NOTHING)
        if fresh and request.kind is not AskKind.NOTHING and answers(request, answer):
            again = job.settled
            job = job._replace(settled=True)
            if not again or (request.kind is AskKind.READ and answer.kind is not ReplyKind.REFUSED):
                ended.append(Ended(job, answer, again))
        self._job = job
        return ended

    def forget(self) -> list[Ended]:
        """The slave is gone, or frames are missing."""
        job, self._job = self._job, None
        self._shown = bytes(8)
        return [] if job is None or job.settled else [Ended(job, None)]

    def snapshot(self) -> dict[str, Any]:
        """JSON-able."""
        job = self._job
        kept = None if job is None else [job.request.encode().hex(), job.t_ns, job.client.value, job.settled]
        return {"job": kept, "shown": self._shown.hex()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()``. Raises KeyError or ValueError on another state."""
        self._shown, kept = bytes.fromhex(state["shown"]), state["job"]
        self._job = None
        if kept is not None:
            request, t_ns, client, settled = kept
            self._job = Job(decode_request(bytes.fromhex(request)), t_ns, Direction(client), settled)
