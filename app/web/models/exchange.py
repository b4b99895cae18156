"""Recordings to and from other formats, cut, merged, anonymised: what the page asks for and gets."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, Field

from app.service.exchange import KIND, Action, Made
from app.service.jobs import Job
from app.web.models import Failure
from app.web.problem import problem_of


class LossDoc(BaseModel):
    """What a format cannot hold: ``text_key`` with ``details`` is its text."""

    what: str
    things: int
    text_key: str
    details: dict[str, Any]


class LossesDoc(BaseModel):
    """What an export would lose, counted before it is made."""

    losses: list[LossDoc]


class CutRequest(BaseModel):
    """From ``start_ns`` on and before ``end_ns``; null: from the beginning, to the end. ``buses`` null: all."""

    start_ns: int | None = Field(default=None, ge=0, lt=2**62)
    end_ns: int | None = Field(default=None, ge=0, lt=2**62)
    buses: list[str] | None = Field(default=None, max_length=100)


class MergeFile(BaseModel):
    """A recording of a merge: ``offset_ns`` is added to its times, ``buses`` gives some of its buses other names."""

    name: str = Field(max_length=300)
    offset_ns: int = Field(default=0, gt=-(2**62), lt=2**62)
    buses: dict[str, str] = Field(default_factory=dict, max_length=100)


class MergeRequest(BaseModel):
    """Recordings to merge by time."""

    recordings: list[MergeFile] = Field(min_length=2, max_length=100)


class AnonymiseRequest(BaseModel):
    """``objects`` are hidden on every node beside the serial number; a copy that holds one of ``words`` is refused."""

    hide_times: bool = False
    objects: list[str] = Field(default_factory=list, max_length=100)
    words: list[str] = Field(default_factory=list, max_length=100)


class SkippedLine(BaseModel):
    """A line of an imported file that was left out."""

    line: int
    text: str


class Remark(BaseModel):
    """Something to tell of what was made: ``text_key`` with ``details`` is its text."""

    what: str
    count: int
    text_key: str
    details: dict[str, Any]


class ExchangeJob(BaseModel):
    """How it stands: ``done`` counts frames (of a cut percent), ``files`` are the names of what was made."""

    id: str
    action: Literal["import", "cut", "merge", "anonymise"]
    state: Literal["running", "done", "failed", "cancelled"]
    done: int
    frames: int
    files: list[str]
    remarks: list[Remark]
    skipped: list[SkippedLine]
    error: Failure | None

    @classmethod
    def of(cls, job: Job, made: Made) -> ExchangeJob:
        """A job of this kind and what it has made so far."""
        problem = None if job.error is None else problem_of(job.error)
        error = None
        if problem is not None:
            error = Failure(address="", code=problem.code, text_key=problem.text_key, details=problem.details)
        remarks = [
            Remark(
                what=what,
                count=count,
                text_key=f"exchange.{made.action.value}.{what}",
                details={"count": count, "file": job.device},
            )
            for what, count in made.remarks.items()
        ]
        return cls(
            id=job.id,
            action=made.action.value,
            state=job.state.value,
            done=job.done,
            frames=made.frames,
            files=made.files,
            remarks=remarks,
            skipped=[SkippedLine(line=line, text=text) for line, text in made.skipped],
            error=error,
        )


def made_of(job: Job | None) -> Made | None:
    """What a job of this kind has made; None for any other job."""
    return job.result if job is not None and job.kind == KIND and isinstance(job.result, Made) else None


__all__ = [
    "Action",
    "AnonymiseRequest",
    "CutRequest",
    "ExchangeJob",
    "LossDoc",
    "LossesDoc",
    "MergeFile",
    "MergeRequest",
    "Remark",
    "SkippedLine",
    "made_of",
]
