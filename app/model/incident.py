"""What an incident is: a stretch of a recording with what a person has to say of it, and annotations. Pure."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final

from app.errors import IncidentFieldError
from app.model.address import Address, parse_address

CODE_LETTERS: Final = "23456789abcdefghjkmnpqrstvwxyz"
"""Of short codes: without what is read or heard for another letter (0 and o, 1 and i and l, u and v)."""
CODE_LENGTH: Final = 7
MAX_TITLE: Final = 200
MAX_NOTES: Final = 20_000
MAX_TEXT: Final = 2_000
MAX_TAGS: Final = 20
MAX_TAG: Final = 40
MAX_PLOTS: Final = 12
MAX_SIGNALS: Final = 12
MAX_CAMERA: Final = 60
_COLOUR: Final = re.compile(r"#[0-9a-f]{6}")


class Note(Enum):
    """How much an annotation matters."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class SignalRef:
    """An object of a device: ``device`` is its slug."""

    device: str
    address: Address

    @property
    def text(self) -> str:
        """``wtg-07/blade-2/pmc/6064``."""
        return f"{self.device}/{self.address.short}"

    @classmethod
    def parse(cls, text: str) -> SignalRef:
        """As ``text`` gave it. Raises UsageError for what is no address, IncidentFieldError where no device is named.

        An address may hold a slash itself (12/221), a device's slug has two.
        """
        parts = text.split("/")
        if len(parts) not in (4, 5) or not all(parts):
            raise IncidentFieldError(field="plots", reason_key="incident.flaw.signal", found=text)
        return cls("/".join(parts[:3]), parse_address("/".join(parts[3:])))


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of a recording, in t_ns; both ends belong to it."""

    from_ns: int
    to_ns: int


@dataclass(frozen=True, slots=True)
class Draft:
    """What a person says of an incident.

    ``recording`` is the name of its file, ``fingerprint`` its size and a hash of both its ends. ``at_ns`` is the moment
    that it is about. ``plots``: the signals of each plot, from top to bottom. ``camera`` names a place from which the
    3D view is looked at.
    """

    recording: str
    fingerprint: str
    turbine: str
    span: Span
    at_ns: int
    title: str
    notes: str = ""
    tags: tuple[str, ...] = ()
    plots: tuple[tuple[SignalRef, ...], ...] = ()
    camera: str = ""
    loop: Span | None = None


@dataclass(frozen=True, slots=True)
class Origin:
    """Where an incident came from that was made elsewhere."""

    file: str
    tool: str
    person: str
    exported_ns: int
    opened_ns: int
    opened_by: str
    recording: str
    """Name of the recording that its own is a cut of."""
    sha256: str
    """Of that recording, where it was known."""


@dataclass(frozen=True, slots=True)
class Incident:
    """One version of an incident. ``author`` made the first one at ``created_ns``, ``person`` this one at ``t_ns``."""

    id: str
    code: str
    version: int
    draft: Draft
    t_ns: int
    person: str
    created_ns: int
    author: str
    hidden: bool = False
    origin: Origin | None = None


@dataclass(frozen=True, slots=True)
class Annotation:
    """A mark on a recording: a point where both ends are the same, else a stretch.

    ``extra`` are the texts that another program keeps with it. ``foreign``: it was made by another program.
    """

    id: str
    recording: str
    span: Span
    text: str
    severity: Note
    colour: str
    person: str
    t_ns: int
    incident: str | None = None
    deleted: bool = False
    foreign: bool = False
    extra: Mapping[str, str] = field(default_factory=dict)


def checked(draft: Draft) -> Draft:
    """The draft with its texts trimmed. Raises IncidentFieldError."""
    title = " ".join(draft.title.split())
    _limit("title", title, MAX_TITLE)
    if not title:
        raise IncidentFieldError(field="title", reason_key="incident.flaw.missing")
    _limit("notes", draft.notes, MAX_NOTES)
    _limit("camera", draft.camera, MAX_CAMERA)
    tags = tuple(dict.fromkeys(" ".join(tag.split()) for tag in draft.tags if tag.strip()))
    if len(tags) > MAX_TAGS:
        raise IncidentFieldError(field="tags", reason_key="incident.flaw.many", most=MAX_TAGS)
    for tag in tags:
        _limit("tags", tag, MAX_TAG)
    _check_spans(draft)
    if len(draft.plots) > MAX_PLOTS or any(len(plot) > MAX_SIGNALS for plot in draft.plots):
        raise IncidentFieldError(field="plots", reason_key="incident.flaw.many", most=MAX_PLOTS)
    return Draft(
        draft.recording, draft.fingerprint, draft.turbine, draft.span, draft.at_ns, title, draft.notes.strip(),
        tags, tuple(plot for plot in draft.plots if plot), draft.camera.strip(), draft.loop,
    )  # fmt: skip


def _check_spans(draft: Draft) -> None:
    span, loop = draft.span, draft.loop
    if not 0 <= span.from_ns < span.to_ns:
        raise IncidentFieldError(field="span", reason_key="incident.flaw.span")
    if not span.from_ns <= draft.at_ns <= span.to_ns:
        raise IncidentFieldError(field="at_ns", reason_key="incident.flaw.outside")
    if loop is not None and not 0 <= loop.from_ns < loop.to_ns:
        raise IncidentFieldError(field="loop", reason_key="incident.flaw.span")


def checked_annotation(one: Annotation) -> Annotation:
    """The same, where it can be kept. Raises IncidentFieldError."""
    _limit("text", one.text, MAX_TEXT)
    if not one.text.strip():
        raise IncidentFieldError(field="text", reason_key="incident.flaw.missing")
    if not 0 <= one.span.from_ns <= one.span.to_ns:
        raise IncidentFieldError(field="span", reason_key="incident.flaw.span")
    if one.colour and not _COLOUR.fullmatch(one.colour):
        raise IncidentFieldError(field="colour", reason_key="incident.flaw.colour")
    return one


def _limit(name: str, text: str, most: int) -> None:
    if len(text) > most:
        raise IncidentFieldError(field=name, reason_key="incident.flaw.long", most=most)
    if any(not (one.isprintable() or one in "\n\t\r") for one in text):
        raise IncidentFieldError(field=name, reason_key="incident.flaw.control")


# -- as JSON -----------------------------------------------------------------------


def dump_draft(draft: Draft) -> dict[str, Any]:
    """Plain JSON."""
    return {
        "recording": draft.recording,
        "fingerprint": draft.fingerprint,
        "turbine": draft.turbine,
        "from_ns": draft.span.from_ns,
        "to_ns": draft.span.to_ns,
        "at_ns": draft.at_ns,
        "title": draft.title,
        "notes": draft.notes,
        "tags": list(draft.tags),
        "plots": [[signal.text for signal in plot] for plot in draft.plots],
        "camera": draft.camera,
        "loop": None if draft.loop is None else [draft.loop.from_ns, draft.loop.to_ns],
    }


def load_draft(content: Mapping[str, Any]) -> Draft:
    """As ``dump_draft`` gave it. Raises KeyError, TypeError, ValueError, HubsideError for anything else."""
    loop = content["loop"]
    return Draft(
        recording=_text(content["recording"]),
        fingerprint=_text(content["fingerprint"]),
        turbine=_text(content["turbine"]),
        span=Span(_time(content["from_ns"]), _time(content["to_ns"])),
        at_ns=_time(content["at_ns"]),
        title=_text(content["title"]),
        notes=_text(content["notes"]),
        tags=tuple(_text(tag) for tag in content["tags"]),
        plots=tuple(tuple(SignalRef.parse(_text(one)) for one in plot) for plot in content["plots"]),
        camera=_text(content["camera"]),
        loop=None if loop is None else Span(_time(loop[0]), _time(loop[1])),
    )


def _text(found: Any) -> str:
    if not isinstance(found, str):
        raise TypeError(f"{found!r} is no text")
    return found


def _time(found: Any) -> int:
    if isinstance(found, bool) or not isinstance(found, int) or not 0 <= found < 1 << 63:
        raise TypeError(f"{found!r} is no time")
    return found
