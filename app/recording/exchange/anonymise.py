"""A copy of a recording that does not tell whose it is: no turbine, no person, no serial number, no free text.

What is kept is kept by name, all else is left out: of events the kinds and times and what is known to be harmless, of
attachments our own descriptions. At the end all that the copy tells is searched for every text that was taken away.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

from app.errors import RecordingError, UsageError
from app.model.address import Address
from app.model.description import Bus
from app.model.description_file import BUILTIN, load_builtin
from app.model.od_export import to_json
from app.recording.cdr import NS, ClockReading
from app.recording.content import METADATA_RECORDING, AttachedFile, Event, RecordingInfo
from app.recording.exchange.harmless import PERSON, Harmless
from app.recording.exchange.hiding import STATIONS, Hider, Pseudonyms, shifted_time
from app.recording.exchange.leftovers import Wanted, find_left
from app.recording.exchange.origin import OriginKind, origin_table
from app.recording.exchange.states import first_state, lost_until, shifted, without
from app.recording.exchange.tape import Subject, Tape, Taped
from app.recording.index.course import Mark, marks_of
from app.recording.node_table import described, read_nodes
from app.recording.reader import Recording, open_recording
from app.wire.frame import Can, Frame
from app.wire.sync import TIME_COB_ID

TURBINE: Final = "turbine"
FIXED_START_NS: Final = 946_684_800 * NS
"""1 January 2000: where recordings begin whose times are hidden."""
_STEP_NS: Final = 512


@dataclass(frozen=True)
class AnonymiseOrder:
    """What is hidden beyond the usual.

    ``hide_times``: the recording begins on 1 January 2000. ``objects``: more objects that identify a unit, on every
    node. ``texts``: more words that must not be in the copy; it is refused where one is.
    """

    hide_times: bool = False
    objects: Collection[Address] = ()
    texts: Collection[str] = ()


@dataclass
class Anonymised:
    """What was written, and what was left out: telegrams of other buses than CAN, events' details, attachments.

    ``left_out_times`` are TIME stamps on the bus that could not be moved.
    """

    taped: Taped = field(default_factory=Taped)
    serials: int = 0
    left_out_frames: int = 0
    left_out_times: int = 0
    left_out_details: int = 0
    left_out_attachments: int = 0


class _Names(NamedTuple):
    """Other names for the parts of slugs."""

    known: dict[str, str]

    def slug(self, text: str) -> str:
        parts = text.split("/")
        return "/".join([TURBINE, *(self._part(part) for part in parts[1:])]) if len(parts) > 1 else TURBINE

    def _part(self, part: str) -> str:
        if STATIONS.fullmatch(part):
            return part
        return self.known.setdefault(part, f"place-{len(self.known) + 1}")


def anonymise(
    src: Path, dst: Path, order: AnonymiseOrder, on_frames: Callable[[int], None] | None = None
) -> Anonymised:
    """Writes the copy to ``dst``, which must not exist.

    Of buses that are no CAN buses neither telegrams nor state nor addresses are in it. Raises UsageError where ``src``
    is no recording of this bench or has no CAN frame, and RecordingError, also where something that
    identifies is found in the copy; there is no copy then.
    """
    with open_recording(src) as recording:
        if METADATA_RECORDING not in recording.metadata:
            raise UsageError(reason=f"{src.name} is no recording of this bench: import it first")
        if recording.span_ns is None:
            raise UsageError(reason=f"{src.name} holds no frame")
        if not recording.can_chunks():
            raise UsageError(reason=f"{src.name} holds no CAN frame, and of telegrams nobody knows what identifies")
        return _Copy(recording, dst, order).write(on_frames)


class _Copy:
    def __init__(self, recording: Recording, dst: Path, order: AnonymiseOrder) -> None:
        self._recording, self._dst, self._order = recording, dst, order
        self._info = recording.info
        self._names = _Names({})
        self._result = Anonymised()
        self._pseudonyms = Pseudonyms()
        span = recording.span_ns or (0, 0)
        by_ns = FIXED_START_NS - span[0] if order.hide_times else 0
        self._by_ns = by_ns - by_ns % _STEP_NS
        self._started_ns = span[0] + self._by_ns
        descriptions = described(self._info.nodes)
        self._hider = Hider(descriptions, self._pseudonyms, order.objects)
        named = read_nodes(self._info.nodes)
        slugs = {named[key].slug: key for key in descriptions}
        self._harmless = Harmless(slugs, descriptions, self._hider, self._names.slug)

    def write(self, on_frames: Callable[[int], None] | None) -> Anonymised:
        state = self._first_state()
        events = [self._event(event) for event in self._recording.events()]
        marks = marks_of(events, None, self._started_ns, 1 << 62)
        subject = Subject(
            recording=f"{TURBINE}-{self._started_ns // NS}",
            started_ns=self._started_ns,
            info=self._new_info(),
            origin=lambda: origin_table(OriginKind.ANONYMISED, []),
            attachments=self._attachments(),
            events=events,
            clocks=list(self._clocks()),
            marks=sorted([*state, *marks], key=lambda mark: mark.t_ns),
            lost=lost_until(self._recording),
        )
        tape = Tape(subject, lambda _: self._dst, rotate=False)
        result = self._result
        result.taped = tape.write(self._frames(), on_frames, lambda draft: self._search(draft, on_frames))
        result.left_out_details = self._harmless.left_out
        result.serials = len(self._pseudonyms.numbers)
        return result

    def _frames(self) -> Iterator[Frame]:
        for frame in self._hider(self._can_frames()):
            moved = self._moved(frame) if self._by_ns else frame
            if moved is None:
                self._result.left_out_times += 1
            else:
                yield moved

    def _moved(self, frame: Frame) -> Frame | None:
        """Later or earlier, also in the time that it tells; None where that cannot be."""
        can, t_ns = frame.payload, frame.t_ns + self._by_ns
        if not isinstance(can, Can) or can.can_id != TIME_COB_ID or can.extended or can.remote or can.error:
            return frame._replace(t_ns=t_ns)
        data = shifted_time(can.data, self._by_ns)
        return None if data is None else frame._replace(t_ns=t_ns, payload=can._replace(data=data))

    def _can_frames(self) -> Iterator[Frame]:
        for frame in self._recording.frames():
            if isinstance(frame.payload, Can):
                yield frame
            else:  # what identifies in a telegram of another bus is not known
                self._result.left_out_frames += 1

    def _new_info(self) -> RecordingInfo:
        nodes = {}
        others = self._others
        for key, text in self._info.nodes.items():
            if key.rpartition("/")[0] in others:
                continue
            slug, _, description = text.rpartition(" ")
            nodes[key] = f"{self._names.slug(slug)} {description if description in BUILTIN else 'unknown'}"
        versions = {name: version for name, version in self._info.versions.items() if name in ("hubside", *BUILTIN)}
        rates = {bus: rate for bus, rate in self._info.bit_rates.items() if bus not in others}
        return RecordingInfo(TURBINE, PERSON, rates, nodes, versions)

    @property
    def _others(self) -> set[str]:
        """Buses whose telegrams are left out."""
        return {bus for bus, kind in self._recording.kinds.items() if kind is not Bus.CANOPEN}

    def _attachments(self) -> list[AttachedFile]:
        ours = {f"descriptions/{name}.json": name for name in BUILTIN}
        kept = []
        for attached in self._recording.attachments():
            name = ours.get(attached.name)
            if name is not None and attached.data == to_json(load_builtin(name)).encode():
                kept.append(attached)
            else:
                self._result.left_out_attachments += 1
        return kept

    def _event(self, event: Event) -> Event:
        details = shifted(self._harmless.details(event), self._by_ns)
        return Event(event.t_ns + self._by_ns, event.kind, event.bus, details)

    def _clocks(self) -> Iterator[ClockReading]:
        """Without the time since the computer was started, which the offset between the clocks would tell."""
        first: dict[str, tuple[int, int]] = {}
        for reading in self._recording.clocks():
            t_ns, monotonic_ns, wall_ns, bus, adapter_ns, adapter_t_ns = reading
            mono_0, adapter_0 = first.setdefault(bus, (monotonic_ns, adapter_ns or 0))
            yield ClockReading(
                t_ns + self._by_ns,
                monotonic_ns - mono_0,
                wall_ns + self._by_ns,
                bus,
                None if adapter_ns is None else adapter_ns - adapter_0,
                None if adapter_t_ns is None else adapter_t_ns + self._by_ns,
            )

    def _first_state(self) -> list[Mark]:
        found = first_state(self._recording)
        if found is None:
            return []
        t_ns, state = found
        state = without(state, self._others)
        for bus, kept in state["decoders"].items():
            self._hider.decoder(bus).restore(kept)
        hidden = self._hidden_state(state)
        return [Mark(t_ns + self._by_ns, "", "", shifted(hidden, self._by_ns))]

    def _hidden_state(self, state: Mapping[str, Any]) -> dict[str, Any]:
        nodes = []
        for node in state["live"]["nodes"]:
            memory = node["memory"]
            cells = {where: self._cell(node, where, cell) for where, cell in memory["cells"].items()}
            nodes.append({**node, "memory": {**memory, "cells": cells}})
        decoders = {}
        for bus, decoder in state["decoders"].items():
            without = {number: {**kept, "sdo": None} for number, kept in decoder["nodes"].items()}
            decoders[bus] = {**decoder, "nodes": without}
        return {**state, "live": {**state["live"], "nodes": nodes}, "decoders": decoders}

    def _cell(self, node: Mapping[str, Any], where: str, cell: Sequence[Any]) -> list[Any]:
        index, _, sub = where.partition(":")
        address = Address(int(index, 16), int(sub, 16)) if sub else None
        if not self._hider.is_identity(node["bus"], node["node"], address):
            return list(cell)
        reading, stored, *rest = cell
        return [self._value(reading), self._value(stored), *rest]

    def _value(self, kept: Sequence[Any] | None) -> list[Any] | None:
        if kept is None:
            return None
        raw = bytes.fromhex(kept[0])
        other = self._pseudonyms.number(raw) if len(raw) <= 4 else b"X" * len(raw)
        return [other.hex(), *kept[1:]]

    def _search(self, draft: Path, on_frames: Callable[[int], None] | None) -> None:
        """Looks for all that was taken away, before the copy has its name. Raises RecordingError where some is left."""
        info, identity = self._info, self._recording.identity
        names = {info.turbine, info.who, identity.recording, self._recording.path.stem, *self._names.known}
        names |= {name.slug for name in read_nodes(info.nodes).values()}
        with open_recording(draft) as copy:
            frames = copy.frame_count

            def on_piece() -> None:
                if on_frames is not None:
                    on_frames(frames)

            found = find_left(copy, Wanted(names, self._order.texts, self._pseudonyms.texts), on_piece)
        if found is not None:
            raise RecordingError(
                file=self._dst.name, offset=0, reason=f"{found.text!r} is still in {found.where.value}"
            )


def plain_bytes(recording: Recording) -> Iterator[bytes]:
    """What a file holds, uncompressed: messages, metadata, names of topics and attachments, all but what is in them."""
    yield recording.library.encode()
    for record in recording.metadata_records:
        yield repr((record.name, record.metadata)).encode()
    for channel in recording.channels.values():
        yield repr((channel.topic, channel.metadata)).encode()
    for attached in recording.attachments():
        yield attached.name.encode()
    for body, _ in recording.bodies():
        yield body.data
