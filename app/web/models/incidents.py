"""Incidents and annotations as the page gets and sends them. Times are t_ns, rounded as browsers round them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictInt

from app.model.incident import (
    MAX_CAMERA,
    MAX_NOTES,
    MAX_PLOTS,
    MAX_SIGNALS,
    MAX_TAG,
    MAX_TAGS,
    MAX_TEXT,
    MAX_TITLE,
    Annotation,
    Draft,
    Incident,
    Note,
    SignalRef,
    Span,
)
from app.service.incidents.annotations import Listed, Mark
from app.service.incidents.desk import Taken
from app.service.incidents.identity import Standing
from app.service.incidents.link import page_link
from app.web.models.replay import LoopRef, Time
from app.web.models.trace import exact_ns

NoteName = Literal["info", "warning", "error"]
RecordingStateName = Literal["there", "grown", "moved", "other", "gone"]
SignalText = Annotated[str, Field(max_length=250)]
_PLOTS: Final = [["wtg-07/blade-2/pmc/6064", "wtg-07/blade-2/pmc/60F4"]]
_INCIDENT: Final[dict[str, Any]] = {
    "from_ns": 1750000000000000000,
    "to_ns": 1750000030000000000,
    "at_ns": 1750000020000000000,
    "title": "Blade 2 trips on following error",
    "notes": "Grease on the gear; cleaned.",
    "tags": ["8611h"],
    "plots": _PLOTS,
    "camera": "blade-2",
    "loop": {"from_ns": 1750000015000000000, "to_ns": 1750000025000000000},
}
_MARK: Final[dict[str, Any]] = {
    "from_ns": 1750000020000000000,
    "to_ns": 1750000020500000000,
    "text": "brake closes late",
    "severity": "warning",
    "colour": "#ffcc00",
    "incident": None,
}


class IncidentIn(BaseModel):
    """What a person says of a stretch of a recording. ``plots``: the signals of each, ``DEVICE/ADDRESS``."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [_INCIDENT]})

    from_ns: Time
    to_ns: Time
    at_ns: Time
    title: Annotated[str, Field(max_length=MAX_TITLE)]
    notes: Annotated[str, Field(max_length=MAX_NOTES)] = ""
    tags: Annotated[list[Annotated[str, Field(max_length=MAX_TAG)]], Field(max_length=MAX_TAGS)] = []
    plots: Annotated[list[Annotated[list[SignalText], Field(max_length=MAX_SIGNALS)]], Field(max_length=MAX_PLOTS)] = []
    camera: Annotated[str, Field(max_length=MAX_CAMERA)] = ""
    loop: LoopRef | None = None

    def draft(self, recording: str, fingerprint: str, turbine: str) -> Draft:
        """As the model has it. Raises UsageError, IncidentFieldError for what names no signal."""
        loop = self.loop
        return Draft(
            recording=recording,
            fingerprint=fingerprint,
            turbine=turbine,
            span=Span(exact_ns(self.from_ns), exact_ns(self.to_ns)),
            at_ns=exact_ns(self.at_ns),
            title=self.title,
            notes=self.notes,
            tags=tuple(self.tags),
            plots=tuple(tuple(SignalRef.parse(one) for one in plot) for plot in self.plots),
            camera=self.camera,
            loop=None if loop is None else Span(exact_ns(loop.from_ns), exact_ns(loop.to_ns)),
        )


class NewIncident(IncidentIn):
    """A new incident on the recording of that name."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"recording": "3-following-error.mcap", **_INCIDENT}]}
    )

    recording: Annotated[str, Field(max_length=250)]


class IncidentChange(IncidentIn):
    """Another version, made from version ``based_on``."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"based_on": 1, **_INCIDENT}]})

    based_on: StrictInt


class OriginDoc(BaseModel):
    """Where an incident came from that was made elsewhere."""

    model_config = ConfigDict(from_attributes=True)

    file: str
    tool: str
    person: str
    exported_ns: int
    opened_ns: int
    opened_by: str
    recording: str
    sha256: str


class IncidentDoc(BaseModel):
    """One version of an incident.

    ``link`` is its short link, ``page`` where that leads. ``recording_state``: whether its recording is there;
    ``replay`` names the replay of it, null where it cannot be replayed. ``sha256`` of the recording, once it is known.
    """

    id: str
    code: str
    link: str
    page: str
    version: int
    recording: str
    recording_state: RecordingStateName
    recording_text_key: str
    replay: str | None
    sha256: str | None
    turbine: str
    from_ns: int
    to_ns: int
    at_ns: int
    title: str
    notes: str
    tags: list[str]
    plots: list[list[str]]
    camera: str
    loop: LoopRef | None
    t_ns: int
    person: str
    created_ns: int
    author: str
    hidden: bool
    origin: OriginDoc | None

    @classmethod
    def of(cls, one: Incident, standing: Standing, sha256: str | None) -> IncidentDoc:
        """As the page gets it."""
        draft, loop = one.draft, one.draft.loop
        return cls(
            id=one.id,
            code=one.code,
            link=f"/i/{one.code}",
            page=page_link(one, standing),
            version=one.version,
            recording=draft.recording,
            recording_state=standing.state.value,
            recording_text_key=standing.state.text_key,
            replay=None if standing.path is None else standing.path.name.removesuffix(".mcap"),
            sha256=sha256,
            turbine=draft.turbine,
            from_ns=draft.span.from_ns,
            to_ns=draft.span.to_ns,
            at_ns=draft.at_ns,
            title=draft.title,
            notes=draft.notes,
            tags=list(draft.tags),
            plots=[[signal.text for signal in plot] for plot in draft.plots],
            camera=draft.camera,
            loop=None if loop is None else LoopRef(from_ns=loop.from_ns, to_ns=loop.to_ns),
            t_ns=one.t_ns,
            person=one.person,
            created_ns=one.created_ns,
            author=one.author,
            hidden=one.hidden,
            origin=None if one.origin is None else OriginDoc.model_validate(one.origin),
        )


class MarkIn(BaseModel):
    """An annotation: a point where both times are the same. ``colour`` like ``#ffcc00``, or empty."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [_MARK]})

    from_ns: Time
    to_ns: Time
    text: Annotated[str, Field(max_length=MAX_TEXT)]
    severity: NoteName = "info"
    colour: Annotated[str, Field(max_length=7)] = ""
    incident: Annotated[str, Field(max_length=40)] | None = None

    def mark(self, incident: str | None) -> Mark:
        """As the service has it; ``incident`` is its id."""
        span = Span(exact_ns(self.from_ns), exact_ns(self.to_ns))
        return Mark(span, self.text, Note(self.severity), self.colour, incident)


class AnnotationDoc(BaseModel):
    """One annotation. ``incident`` is an id; ``foreign``: another program made it; ``extra`` is what it says besides.

    ``problem``: it is kept, but the file beside the recording could not be written, and why.
    """

    id: str
    recording: str
    from_ns: int
    to_ns: int
    text: str
    severity: NoteName
    colour: str
    person: str
    t_ns: int
    incident: str | None
    foreign: bool
    extra: dict[str, str]
    problem: str | None = None

    @classmethod
    def of(cls, one: Annotation, problem: str | None = None) -> AnnotationDoc:
        """As the page gets it."""
        return cls(
            id=one.id,
            recording=one.recording,
            from_ns=one.span.from_ns,
            to_ns=one.span.to_ns,
            text=one.text,
            severity=one.severity.value,
            colour=one.colour,
            person=one.person,
            t_ns=one.t_ns,
            incident=one.incident,
            foreign=one.foreign,
            extra=dict(one.extra),
            problem=problem,
        )


class AnnotationList(BaseModel):
    """The annotations of a recording by time, and the file beside it. ``problem``: why that file is no good."""

    annotations: list[AnnotationDoc]
    file: str | None
    problem: str | None

    @classmethod
    def of(cls, listed: Listed) -> AnnotationList:
        """As the page gets it."""
        file = None if listed.file is None else str(listed.file)
        return cls(annotations=docs_of(listed.annotations), file=file, problem=listed.problem)


def docs_of(annotations: Sequence[Annotation]) -> list[AnnotationDoc]:
    """As the page gets them."""
    return [AnnotationDoc.of(one) for one in annotations]


class FlawDoc(BaseModel):
    """A member of a bundle that was not taken, and why."""

    model_config = ConfigDict(from_attributes=True)

    member: str
    reason_key: str
    detail: str


class IncidentTaken(BaseModel):
    """What a bundle brought. ``incident`` null: it was not whole; ``new``: it was not here before.

    ``recording`` is the name of its file here, null where none was whole or came along. ``lacking``: text keys of what
    could not be put in when it was made.
    """

    incident: IncidentDoc | None
    new: bool
    recording: str | None
    annotations: int
    sets: int
    flaws: list[FlawDoc]
    lacking: list[str]

    @classmethod
    def of(cls, taken: Taken, incident: IncidentDoc | None) -> IncidentTaken:
        """As the page gets it."""
        return cls(
            incident=incident,
            new=taken.new,
            recording=taken.recording,
            annotations=taken.annotations,
            sets=taken.sets,
            flaws=[FlawDoc.model_validate(one) for one in taken.flaws],
            lacking=list(taken.lacking),
        )
