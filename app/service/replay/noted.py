"""What the recorder noted beside frames, in the words of the page."""

from __future__ import annotations

from typing import Final

from app.recording.content import Event, EventKind
from app.service.journal import Kind
from app.service.views import EventLine
from app.wire.events import Severity

_LOSSES: Final = frozenset(
    {EventKind.BUS_LOST, EventKind.GAP, EventKind.FRAMES_LOST, EventKind.DISK_ERROR, EventKind.SPACE_LOW}
)
_KINDS: Final = {f"journal.{kind.value}": kind for kind in Kind}


def event_line(event: Event) -> EventLine:
    """What the recorder noted, as the page is told. Notes of a journal have its text; all else has one by its kind."""
    details = dict(event.details)
    device, person = details.pop("device", None), details.pop("person", None)
    text_key = details.pop("text_key", None) or f"recording.event.{event.kind.value}"
    if event.bus:
        details["bus"] = event.bus
    kind = _KINDS.get(str(text_key))
    plain = Severity.ERROR if event.kind in _LOSSES else Severity.INFO
    severity = plain if kind is None else kind.severity
    doer = person if kind is not None and kind.has_doer else None
    return EventLine(event.t_ns, severity.value, device, str(text_key), details, doer)
