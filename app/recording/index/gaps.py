"""Gaps of a recording beside the silences of its buses: from what was noted, told and damaged."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from typing import Any

from app.recording.content import METADATA_RECOVERY, Event, EventKind
from app.recording.index.content import Gap, GapKind
from app.recording.reader import Recording
from app.wire.events import Event as WireEvent
from app.wire.events import EventKind as WireKind


def noted_gaps(noted: Iterable[Event], end_ns: int) -> list[Gap]:
    """Losses, steps of the clock, stretches without a bus, and where the recorder went on after it could not."""
    gaps: list[Gap] = []
    lost: dict[str, int] = {}
    for event in noted:
        details, bus, t_ns = event.details, event.bus, event.t_ns
        if event.kind is EventKind.FRAMES_LOST:
            gaps.append(_loss(event))
        elif event.kind is EventKind.WALL_CLOCK_STEP:
            gaps.append(Gap(GapKind.CLOCK_STEP, bus, t_ns, t_ns, {"step_ns": details.get("step_ns")}))
        elif event.kind is EventKind.RESUMED:
            gaps.append(Gap(GapKind.RESTART, bus, t_ns, t_ns, {"reason": details.get("reason")}))
        elif event.kind is EventKind.BUS_LOST:
            lost.setdefault(bus, t_ns)
        elif event.kind in (EventKind.BUS_BACK, EventKind.GAP):
            gaps.append(Gap(GapKind.BUS_LOST, bus, lost.pop(bus, t_ns), t_ns, {"ended": True}))
    gaps += [Gap(GapKind.BUS_LOST, bus, from_ns, end_ns, {"ended": False}) for bus, from_ns in lost.items()]
    return gaps


def _loss(event: Event) -> Gap:
    details = event.details
    from_ns, to_ns = (_time(details.get(key), event.t_ns) for key in ("from_ns", "to_ns"))
    more = {"count": details.get("count"), "reason": details.get("reason")}
    return Gap(GapKind.LOSS, event.bus, min(from_ns, to_ns), to_ns, more)


def _time(number: Any, otherwise: int) -> int:
    return number if isinstance(number, int) else otherwise


def restarts(events: Iterable[WireEvent]) -> list[Gap]:
    """Where nodes began anew."""
    return [
        Gap(GapKind.RESTART, event.bus, event.t_ns, event.t_ns, {"node": event.node})
        for event in events
        if event.kind is WireKind.BOOT_UP
    ]


def recorded_span(recording: Recording, span_ns: tuple[int, int]) -> tuple[int, int]:
    """From when to when was recorded, frames or not: the clocks are read ten times a second."""
    first = next(recording.clocks(None, span_ns[0]), None)
    last = deque(recording.clocks(span_ns[1] + 1), maxlen=1)
    return (
        span_ns[0] if first is None else first.t_ns,
        max([span_ns[1], *(reading.t_ns for reading in last)]),
    )


def damages(recording: Recording) -> list[Gap]:
    """What was found to be damaged until now: from the last frame before it to the first one behind."""
    chunks = [*recording.can_chunks(), *recording.telegram_chunks()]
    places = sorted(chunks, key=lambda place: place.offset)
    gaps = []
    for damage in recording.damages:
        details = {"offset": damage.offset, "length": damage.length, "detail": damage.detail}
        itself = next((place for place in places if place.offset == damage.offset), None)
        if itself is not None:
            channel = recording.channels.get(itself.channel_id)  # none: a chunk of several topics
            bus = "" if channel is None else channel.topic[1:]
            from_ns, to_ns = sorted((itself.start_ns, itself.end_ns))  # damage may have turned them round
            gaps.append(Gap(GapKind.DAMAGE, bus, from_ns, to_ns, details))
            continue
        before = [place.end_ns for place in places if place.offset < damage.offset]
        behind = [place.start_ns for place in places if place.offset > damage.offset]
        if before or behind:
            from_ns = max(before, default=min(behind, default=0))
            gaps.append(Gap(GapKind.DAMAGE, "", from_ns, max(from_ns, min(behind, default=from_ns)), details))
    return gaps


def file_gaps(recording: Recording, span_ns: tuple[int, int], damages: Sequence[Gap]) -> list[Gap]:
    """Where this part began, if it is not the first one; what is damaged, and what a recovery could not save."""
    gaps = list(damages)
    tables = recording.metadata
    number = tables.get("recording", {}).get("part", "1")
    if number.isdecimal() and int(number) > 1:
        gaps.append(Gap(GapKind.RESTART, "", span_ns[0], span_ns[0], {"part": int(number)}))
    lost = tables.get(METADATA_RECOVERY, {}).get("lost_bytes", "0")
    if lost.isdecimal() and int(lost):
        gaps.append(Gap(GapKind.DAMAGE, "", span_ns[1], span_ns[1], {"length": int(lost), "detail": "recovery"}))
    return gaps
