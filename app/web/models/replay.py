"""Replays as the page gets them. Times are in t_ns; the page's numbers are rounded to what fits (``exact_ns``)."""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from app.errors import UsageError
from app.service.replay import orders
from app.service.replay.replays import IndexLine, Replays
from app.service.replay.session import Session
from app.service.replay.transport import FASTEST, SLOWEST, Loop
from app.service.shown import CursorLine
from app.web.models.trace import exact_ns

_T = TypeVar("_T")
Time = Annotated[int, Field(ge=0, le=2**62)]


class OpenReplayRequest(BaseModel):
    """``recording`` is the name of a file of the list.

    ``at_ns`` is where the cursor stands if the recording is opened by this; one that is open already is not moved.
    """

    model_config = ConfigDict(extra="forbid")

    recording: Annotated[str, Field(max_length=250)]
    at_ns: Time | None = None


class ReplayDoc(BaseModel):
    """An open replay. ``id`` names its context ``replay/<id>``; ``damages`` are places that could not be read.

    Steps from event to event, plots and the timeline know the whole recording once its ``index`` is ready.
    ``watchers`` are the pages that look at it.
    """

    id: str
    recording: str
    turbine: str
    name: str
    from_ns: int
    to_ns: int
    damages: int
    index: IndexLine
    watchers: int
    cursor: CursorLine

    @classmethod
    def of(cls, session: Session, replays: Replays) -> ReplayDoc:
        """As it is now."""
        source = session.source
        return cls(
            id=source.name,
            recording=source.path.name,
            turbine=source.turbine.slug,
            name=source.turbine.name,
            from_ns=source.from_ns,
            to_ns=source.to_ns,
            damages=source.damages,
            index=replays.index_line(session),
            watchers=replays.watchers(source.name),
            cursor=session.cursor(),
        )


class MomentSetsRequest(BaseModel):
    """Keep what was known of ``devices`` at ``t_ns`` as sets; null: at the cursor."""

    model_config = ConfigDict(extra="forbid")

    devices: Annotated[list[Annotated[str, Field(max_length=200)]], Field(min_length=1, max_length=32)]
    t_ns: Time | None = None
    reason: Annotated[str, Field(max_length=500)] = ""


class MomentSet(BaseModel):
    """A set that was kept: how many objects were known at that time, and how many were never seen until then."""

    id: str
    device: str
    known: int
    unseen: int


class LoopRef(BaseModel):
    """A stretch of the recording."""

    from_ns: Time
    to_ns: Time


class CursorRequest(BaseModel):
    """What the cursor is to do.

    ``play`` (with ``speed``, where given), ``pause``, ``seek`` (to ``t_ns``), ``step`` (by ``dt_ms``, or with ``by`` to
    the next frame or event, backwards with ``forward`` false), ``speed``, ``loop`` (null: no more).
    """

    model_config = ConfigDict(extra="forbid")

    action: Literal["play", "pause", "seek", "step", "speed", "loop"]
    t_ns: Time | None = None
    speed: Annotated[float, Field(ge=SLOWEST, le=FASTEST, allow_inf_nan=False)] | None = None
    by: Literal["time", "frame", "event"] = "time"
    dt_ms: Annotated[float, Field(ge=-86_400_000, le=86_400_000, allow_inf_nan=False)] | None = None
    forward: bool = True
    loop: LoopRef | None = None

    def order(self) -> orders.Order:
        """As the replay takes it. Raises UsageError where something is missing."""
        match self.action:
            case "play":
                return orders.Play(self.speed)
            case "pause":
                return orders.Pause()
            case "seek":
                return orders.Seek(exact_ns(_given(self.t_ns, "t_ns")))
            case "speed":
                return orders.SetSpeed(_given(self.speed, "speed"))
            case "loop":
                loop = self.loop
                return orders.SetLoop(None if loop is None else Loop(exact_ns(loop.from_ns), exact_ns(loop.to_ns)))
            case "step":
                return self._step()

    def _step(self) -> orders.Order:
        if self.by == "frame":
            return orders.StepFrame(self.forward)
        if self.by == "event":
            return orders.StepEvent(self.forward)
        return orders.StepTime(round(_given(self.dt_ms, "dt_ms") * 1e6))


def _given(field: _T | None, name: str) -> _T:
    if field is None:
        raise UsageError(reason=f"'{name}' is needed for this action")
    return field
