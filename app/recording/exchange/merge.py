"""Merges recordings by time: parts of one, cuts of one, or recordings of several buses."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

from app.errors import UsageError
from app.recording.cdr import MAX_T_NS, NS, ClockReading
from app.recording.content import METADATA_RECORDING, AttachedFile, Event, RecordingInfo, to_json
from app.recording.exchange.origin import OriginKind, origin_table, source_of
from app.recording.exchange.states import JoiningCourse, first_state, lost_by, lost_until, renamed, shifted
from app.recording.exchange.tape import Subject, Tape, Taped
from app.recording.index.course import Mark, marks_of
from app.recording.reader import Recording, open_recording
from app.recording.schemas import FIXED_TOPICS
from app.wire.frame import Frame

_SPARE_NS: Final = NS
"""A state stands before its frame, and equal stamps are moved on."""


@dataclass(frozen=True)
class MergeInput:
    """A file of a merge: ``offset_ns`` is added to its times, ``buses`` are renamed."""

    path: Path
    offset_ns: int = 0
    buses: Mapping[str, str] = field(default_factory=dict)


class Merged(NamedTuple):
    """What was written. ``duplicates`` were left out; ``moved`` stamps were not later than the one before."""

    taped: Taped
    duplicates: int
    moved: int


class _Source(NamedTuple):
    given: MergeInput
    recording: Recording

    @property
    def id(self) -> str:
        """The same in all files of a recording, if nothing of it was moved."""
        known = self.recording.metadata[METADATA_RECORDING].get("id", "")
        return "" if self.given.offset_ns or self.given.buses else known

    def bus(self, name: str) -> str:
        return self.given.buses.get(name, name)

    def frames(self) -> Iterator[Frame]:
        offset_ns, buses = self.given.offset_ns, self.given.buses
        if not offset_ns and not buses:
            return self.recording.frames()
        return (
            frame._replace(t_ns=frame.t_ns + offset_ns, bus=buses.get(frame.bus, frame.bus))
            for frame in self.recording.frames()
        )

    def events(self) -> Iterator[Event]:
        offset_ns = self.given.offset_ns
        for event in self.recording.events():
            details = shifted(event.details, offset_ns) if offset_ns else event.details
            yield Event(event.t_ns + offset_ns, event.kind, self.bus(event.bus), details)

    def clocks(self) -> Iterator[ClockReading]:
        offset_ns = self.given.offset_ns
        for reading in self.recording.clocks():
            seen_ns = None if reading.adapter_t_ns is None else reading.adapter_t_ns + offset_ns
            yield reading._replace(t_ns=reading.t_ns + offset_ns, bus=self.bus(reading.bus), adapter_t_ns=seen_ns)

    def state(self) -> Mark | None:
        """What the file says was known at its beginning."""
        found = first_state(self.recording)
        if found is None:
            return None
        t_ns, state = found
        state = shifted(renamed(state, self.given.buses), self.given.offset_ns)
        return Mark(t_ns + self.given.offset_ns, "", "", state)


def merge(inputs: Sequence[MergeInput], dst: Path, on_frames: Callable[[int], None] | None = None) -> Merged:
    """Writes all frames, events and attachments of the files to ``dst``, which must not exist.

    Frames that are equal in every bit are left out where both are of the same recording, whose stamps are unique.
    Raises UsageError where recordings of different buses with one name run at the same time, and RecordingError.
    """
    if len(inputs) < 2:
        raise UsageError(reason="a merge takes two files or more")
    with ExitStack() as stack:
        sources = [_Source(one, stack.enter_context(open_recording(one.path))) for one in inputs]
        for source in sources:
            if METADATA_RECORDING not in source.recording.metadata:
                raise UsageError(reason=f"{source.given.path.name} is no recording of this bench: import it first")
        _check_times(sources)
        _check_buses(sources)
        seam = _Seam(sources)
        subject = _subject(sources, dst, seam)
        tape = Tape(subject, lambda _: dst, rotate=False, course=JoiningCourse)
        taped = tape.write(seam.frames(), on_frames)
        return Merged(taped, seam.duplicates, seam.moved)


def _check_times(sources: Sequence[_Source]) -> None:
    """Raises UsageError where there is no frame, or where an offset leads to times that no recording can hold."""
    if all(source.recording.span_ns is None for source in sources):
        raise UsageError(reason=f"{sources[0].given.path.name} and the other files hold no frame")
    for source in sources:
        offset_ns, recording = source.given.offset_ns, source.recording
        if not offset_ns:
            continue
        frames = recording.span_ns or ()
        beside = [*(event.t_ns for event in recording.events()), *(one.t_ns for one in recording.clocks())]
        times = [recording.identity.started_ns, *frames, *beside]
        if min(times) + offset_ns < _SPARE_NS or max(times) + offset_ns >= MAX_T_NS - _SPARE_NS:
            name, offset = source.given.path.name, f"{offset_ns / NS:g} s"
            raise UsageError(reason=f"{name}: an offset of {offset} leads out of the years 1970 to 2038")


def _check_buses(sources: Sequence[_Source]) -> None:
    """Two buses must not become one: what runs at the same time under one name is of one recording."""
    spans: dict[str, list[tuple[int, int, str]]] = {}
    for source in sources:
        span = source.recording.span_ns
        if span is None:
            continue
        for name in (
            topic[1:] for topic, count in source.recording.topics.items() if count and topic not in FIXED_TOPICS
        ):
            first_ns, last_ns = span[0] + source.given.offset_ns, span[1] + source.given.offset_ns
            for other_first, other_last, other in spans.setdefault(source.bus(name), []):
                if first_ns <= other_last and other_first <= last_ns and other != (source.id or None):
                    raise UsageError(
                        reason=f"{source.given.path.name} and another file run at the same time on '{source.bus(name)}'"
                        " and are not of one recording: rename a bus"
                    )
            spans[source.bus(name)].append((first_ns, last_ns, source.id))


class _Seam:
    """The frames of all files in one order, strictly by time."""

    def __init__(self, sources: Sequence[_Source]) -> None:
        self._sources = sources
        self.duplicates = self.moved = 0

    def _tagged(self, number: int, source: _Source) -> Iterator[tuple[int, int, Frame]]:
        return ((frame.t_ns, number, frame) for frame in source.frames())

    def frames(self) -> Iterator[Frame]:
        ids = [source.id for source in self._sources]
        last_ns, at_ns = -1, -1
        at_once: list[tuple[str, Frame]] = []
        streams = [self._tagged(number, source) for number, source in enumerate(self._sources)]
        for t_ns, number, frame in heapq.merge(*streams, key=lambda item: item[:2]):
            if t_ns != at_ns:
                at_ns = t_ns
                at_once.clear()
            recording = ids[number]
            if recording and (recording, frame) in at_once:
                self.duplicates += 1
                continue
            at_once.append((recording, frame))
            if t_ns <= last_ns:
                self.moved += 1
                frame = frame._replace(t_ns=last_ns + 1)
            last_ns = frame.t_ns
            yield frame


def _subject(sources: Sequence[_Source], dst: Path, seam: _Seam) -> Subject:
    ids = {source.id for source in sources}
    events = _events(sources)
    files = [source_of(source.given.path, "mcap") for source in sources]
    before = [source.recording.metadata for source in sources]
    offsets = [source.given.offset_ns for source in sources]

    def origin() -> dict[str, str]:
        details = {"offsets_ns": offsets, "duplicates": seam.duplicates, "moved": seam.moved}
        return origin_table(OriginKind.MERGE, files, before, **details)

    return Subject(
        recording=next(iter(ids)) if len(ids) == 1 and all(ids) else dst.stem,
        started_ns=min(source.recording.identity.started_ns + source.given.offset_ns for source in sources),
        info=_info(sources),
        origin=origin,
        attachments=_attachments(sources),
        events=events,
        clocks=sorted({one for source in sources for one in source.clocks()}, key=lambda one: (one.t_ns, one.bus)),
        marks=_marks(sources, events),
        lost=_lost(sources),
    )


def _info(sources: Sequence[_Source]) -> RecordingInfo:
    infos = [source.recording.info for source in sources]
    rates: dict[str, int] = {}
    nodes: dict[str, str] = {}
    servers: dict[str, str] = {}
    orders: dict[str, str] = {}
    protocols: dict[str, str] = {}
    for source, info in zip(sources, infos, strict=True):
        rates |= {source.bus(bus): rate for bus, rate in info.bit_rates.items()}
        protocols |= {source.bus(bus): name for bus, name in info.protocols.items()}
        for table, told in ((nodes, info.nodes), (servers, info.servers), (orders, info.orders)):
            for key, what in told.items():
                bus, _, number = key.rpartition("/")
                key = f"{source.bus(bus)}/{number}"
                if table.setdefault(key, what) != what:
                    raise UsageError(reason=f"{key} is {table[key]} in one file and {what} in another: rename a bus")
    versions = {name: version for info in infos for name, version in info.versions.items()}
    return RecordingInfo(
        _joined(info.turbine for info in infos), _joined(info.who for info in infos), rates, nodes, versions, servers,
        protocols, orders,
    )  # fmt: skip


def _joined(names: Iterable[str]) -> str:
    return "+".join(dict.fromkeys(name for name in names if name))


def _events(sources: Sequence[_Source]) -> list[Event]:
    """All events by time; of equal ones of one recording the first."""
    found: dict[tuple[Any, ...], Event] = {}
    for number, source in enumerate(sources):
        for event in source.events():
            key = source.id or number, event.t_ns, event.kind, event.bus, to_json(event.details)
            found.setdefault(key, event)
    return sorted(found.values(), key=lambda event: event.t_ns)


def _attachments(sources: Sequence[_Source]) -> list[AttachedFile]:
    """Those of all files; one that differs under the same name is kept under the name of its file."""
    kept: dict[str, AttachedFile] = {}
    for source in sources:
        for attached in source.recording.attachments():
            if kept.setdefault(attached.name, attached) != attached:
                other = attached._replace(name=f"{source.given.path.stem}/{attached.name}")
                kept[other.name] = other
    return list(kept.values())


def _marks(sources: Sequence[_Source], events: Sequence[Event]) -> list[Mark]:
    """What acts on the state: what each file says of its beginning, and where frames are missing."""
    states = [mark for source in sources if (mark := source.state()) is not None]
    return sorted([*states, *marks_of(events, None, 0, MAX_T_NS)], key=lambda mark: mark.t_ns)


def _lost(sources: Sequence[_Source]) -> int:
    """Frames that were lost, of every recording once: its files count what was lost in the parts before them too."""
    groups: dict[str, list[_Source]] = {}
    for number, source in enumerate(sources):
        groups.setdefault(source.id or str(number), []).append(source)
    return sum(map(_lost_of_one, groups.values()))


def _lost_of_one(files: Sequence[_Source]) -> int:
    """At the end of the last file that was closed; where one was not, what all of them tell and was lost before."""
    closed = [source.recording for source in files if source.recording.totals is not None]
    before = min((lost_until(one) - lost_by(one.events()) for one in closed), default=0)
    told = before + lost_by(_events(files))
    return max(told, *(lost_until(one) for one in closed), 0)
