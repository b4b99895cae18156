"""Builds the index of a recording: one pass over its frames, decoded as they were live."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from app.errors import RecordingError
from app.model.address import Address
from app.recording.columns import can_columns
from app.recording.index.arrays import pack_arrays
from app.recording.index.bits import frame_bits
from app.recording.index.bodies import dump_event, dump_gap, dump_mark, dump_noted, dump_object, dump_sign
from app.recording.index.content import CancelledError, Gap
from app.recording.index.course import Course, Descriptions, Mark, Step, marks_of, restorable, steps
from app.recording.index.file import IndexWriter, refuses_files
from app.recording.index.gaps import damages, file_gaps, noted_gaps, recorded_span, restarts
from app.recording.index.index import RecordingIndex, open_index
from app.recording.index.keyframes import KeyframePacker
from app.recording.index.near import NearFrames
from app.recording.index.pages import Page
from app.recording.index.place import fingerprint, in_cache, index_path
from app.recording.index.telegrams import telegram_traffic
from app.recording.index.tracks import Tracks, pack_history
from app.recording.index.traffic import BusTraffic, LoadPage
from app.recording.node_table import order_table, server_table
from app.recording.reader import Recording, open_recording
from app.recording.schemas import FIXED_TOPICS
from app.wire.events import Event
from app.wire.modbus.adu import ETHERNET_BPS
from app.wire.records import Record, Source, ValueSeen
from app.wire.signs import Sign, SignFinder, folded

KEYFRAME_FRAMES: Final = 3000
"""A keyframe comes after so many frames, at the next tick: a seek decodes this many, and those of 100 ms, at most."""
_TICK_COSTS: Final = 4
"""So many frames take as long as a look at the clock."""
_COUNTING: Final = 0.1
"""About this share of the time goes into counting the traffic."""
_MAX_EVENTS: Final = 100_000

Progress = Callable[[float], None]


def build_index(
    recording: Path,
    descriptions: Descriptions,
    on_progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    cache: Path | None = None,
) -> RecordingIndex:
    """Builds the index of a recording and opens it; what was there is replaced.

    ``descriptions`` by bus and node tell types and error codes; ``on_progress`` gets the share done, 0 to 1.
    ``cancelled`` is asked a few times a second. Raises ``RecordingError`` where the recording cannot be read or the
    index not be written, and ``CancelledError``; neither leaves anything behind.
    """
    place = index_path(recording, cache)
    try:
        _build(recording, place, descriptions, on_progress, cancelled)
    except RecordingError as error:
        if cache is None or not refuses_files(error) or place == in_cache(recording, cache):
            raise
        _build(recording, in_cache(recording, cache), descriptions, on_progress, cancelled)
    opened = open_index(recording, cache)
    if opened is None:  # it grows while it is read: who opens it next asks for another index
        raise RecordingError(file=recording.name, offset=0, reason="the file has changed while it was read")
    return opened


def _build(
    path: Path,
    place: Path,
    descriptions: Descriptions,
    on_progress: Progress | None,
    cancelled: Callable[[], bool] | None,
) -> None:
    try:
        made_of = fingerprint(path)
    except OSError as error:
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error
    with open_recording(path) as recording, IndexWriter(place) as writer:
        builder = _Builder(recording, descriptions, writer)
        builder.run(on_progress or _nobody, cancelled or _never)
        writer.publish({"made_of": made_of, **builder.meta()})


def _nobody(_share: float) -> None:
    """Nobody wants to know how far it is."""


def _never() -> bool:
    return False


class _Builder:
    """One pass over an open recording."""

    def __init__(self, recording: Recording, descriptions: Descriptions, writer: IndexWriter) -> None:
        self._recording = recording
        self._writer = writer
        self._descriptions = descriptions
        self._span_ns = recording.span_ns or (0, 0)
        self._buses = [topic[1:] for topic in recording.topics if topic not in FIXED_TOPICS]
        self._noted = list(recording.events())
        self._course = Course(
            self._buses, descriptions, _MAX_EVENTS, recording.servers, recording.kinds, recording.orders
        )
        self._finder = SignFinder(descriptions)
        self._watched = {key: self._finder.watched(*key) for key in descriptions}
        self._unwatched: dict[tuple[str, int], ValueSeen] = {}
        self._signs: list[Sign] = []
        self._tracks = Tracks(descriptions, self._write_page)
        self._recorded_ns = recorded_span(recording, self._span_ns)
        self._traffic = {bus: BusTraffic(bus, self._recorded_ns[0], self._write_load) for bus in self._buses}
        self._keyframes = KeyframePacker()
        self._weight = 0
        self._events: list[Event] = []
        self._damages: list[Gap] = []
        self._told = 0
        self._last_may_grow = False

    def run(self, on_progress: Progress, cancelled: Callable[[], bool]) -> None:
        """Read everything. Raises CancelledError."""
        start_ns, end_ns = self._span_ns

        def reached(t_ns: int, first: float, last: float) -> None:
            on_progress(first + (last - first) * (t_ns - start_ns) / max(1, end_ns - start_ns))
            if cancelled():
                raise CancelledError

        if self._recording.span_ns is not None:
            for t_ns in self._count():  # all chunks are read here: what is damaged is known from now on
                reached(t_ns, 0.0, _COUNTING)
            self._damages = damages(self._recording)
            self._begin(start_ns - 1)
            for step in self._steps():
                self._take(step)
                reached(step.t_ns, _COUNTING, 1.0)
        self._finish()
        on_progress(1.0)

    def meta(self) -> dict[str, str]:
        """What the index says of itself."""
        start_ns, end_ns = self._span_ns
        rates = self._recording.metadata.get("bit_rates", {})
        frames = sum(bus.frames for bus in self._traffic.values())
        table = {"start_ns": str(start_ns), "end_ns": str(end_ns), "frames": str(frames)}
        described = {f"{bus}/{node}": one.id for (bus, node), one in self._descriptions.items()}
        table["described"] = json.dumps(described)
        table["servers"] = json.dumps(server_table(self._recording.servers))
        table["orders"] = json.dumps(order_table(self._recording.orders))
        table["kinds"] = json.dumps({bus: kind.value for bus, kind in self._recording.kinds.items()})
        adus = dict.fromkeys({bus for bus, _ in self._recording.servers}, str(ETHERNET_BPS))
        return table | {f"bit_rate/{bus}": rates.get(bus, adus.get(bus, "0")) for bus in self._traffic}

    def _steps(self) -> Iterator[Step]:
        start_ns, end_ns = self._span_ns
        first = next(self._recording.keyframes(), None)
        marks = marks_of(self._noted, first, start_ns, end_ns, self._damages)
        self._writer.insert("marks", ((None, mark.t_ns, dump_mark(mark)) for mark in marks))
        return steps(NearFrames(self._recording).all(), marks, start_ns, start_ns - 1, end_ns)

    def _take(self, step: Step) -> None:
        self._weight += len(step.frames) + _TICK_COSTS
        if step.mark is not None and step.mark.state is not None:
            self._hear(self._course.decode(step.frames))
            self._go_on_from(step.mark)
            return
        self._hear(self._course.take(step))
        if step.tick:
            self._feed_unwatched()
            self._signs += self._finder.tick(step.t_ns)
        if step.tick and self._weight >= KEYFRAME_FRAMES:
            self._keyframe(step.t_ns)

    def _hear(self, records: list[Record]) -> None:
        self._tracks.take(records)
        self._look_for_signs(records)

    def _look_for_signs(self, records: list[Record]) -> None:
        """Most values are of objects that make no sign: of those only the last tells when a node was heard."""
        watched, unwatched = self._watched, self._unwatched
        for record in records:
            node = record.bus, record.node
            if isinstance(record, ValueSeen) and record.address not in watched.get(node, (record.address,)):
                if record.source is not Source.PDO_RX:
                    unwatched[node] = record
                continue
            if record.node == 0:
                self._feed_unwatched()
            elif node in unwatched:
                self._signs += self._finder.feed(unwatched.pop(node))
            self._signs += self._finder.feed(record)

    def _feed_unwatched(self) -> None:
        for record in self._unwatched.values():
            self._signs += self._finder.feed(record)
        self._unwatched.clear()

    def _begin(self, t_ns: int) -> None:
        """With nothing known, or with what a keyframe before the first frame says, as a cut has one."""
        first = next(self._recording.keyframes(), None)
        if first is not None and first.t_ns <= t_ns and restorable(first.state):
            self._go_on_from(Mark(t_ns, "", "", first.state))
        else:
            self._keyframe(t_ns)

    def _go_on_from(self, mark: Mark) -> None:
        """The file says the whole state: what it knows of earlier parts is known from here."""
        self._drain()
        self._course.mark(mark)
        live = self._course.live
        self._told, self._last_may_grow = live.version, False
        for node in live.nodes():
            for address, view in live.values(node.bus, node.node).items():
                if view.reading is not None:
                    self._tracks.told((node.bus, node.node, address), mark.t_ns, view.reading)
                    self._signs += self._known_before(node.bus, node.node, address, mark.t_ns, view.reading.data)
        self._keyframe(mark.t_ns)

    def _known_before(self, bus: str, node: int, address: Address, t_ns: int, data: bytes) -> Sequence[Sign]:
        """What is so and began before; it does not count as heard of the node."""
        if address not in self._watched.get((bus, node), ()):
            return ()
        return self._finder.feed(ValueSeen(t_ns, bus, node, address, data, Source.PDO_RX))

    def _count(self) -> Iterator[int]:
        """The traffic, from all frames as columns; how far it is."""
        far_ns = self._span_ns[0]
        for columns in can_columns(self._recording, workers=1):
            if columns.bus not in self._traffic:
                self._traffic[columns.bus] = BusTraffic(columns.bus, self._recorded_ns[0], self._write_load)
            self._traffic[columns.bus].add(columns.t_ns, frame_bits(columns))
            far_ns = max(far_ns, int(columns.t_ns[-1]))
            yield far_ns
        for bus, times, bits in telegram_traffic(self._recording):
            self._traffic[bus].add(times, bits)
            far_ns = max(far_ns, int(times[-1]))
            yield far_ns

    def _keyframe(self, t_ns: int) -> None:
        self._weight = 0
        packed = self._keyframes.pack(t_ns, self._course.snapshot())
        self._writer.insert("keyframes", [packed])
        self._tracks.flush()
        self._drain()

    def _drain(self) -> None:
        """Take over what the live state has told. The last event stays with it: more may be folded into it."""
        events = self._course.live.events(self._told)
        if not events:
            return
        if self._last_may_grow:
            self._events.pop()
        self._events += events
        self._last_may_grow = True
        self._told = events[-2].version if len(events) > 1 else self._told

    def _write_page(self, page: Page) -> None:
        self._writer.insert("pages", [page])

    def _write_load(self, page: LoadPage) -> None:
        self._writer.insert("load", [page])

    def _finish(self) -> None:
        self._drain()
        self._tracks.finish()
        insert, end_ns = self._writer.insert, self._span_ns[1]
        events = [event._replace(version=n) for n, event in enumerate(self._events, 1)]
        insert("events", ((event.version, event.t_ns, dump_event(event)) for event in events))
        insert("noted", ((None, event.t_ns, dump_noted(event)) for event in self._noted))
        self._feed_unwatched()
        signs = folded([*self._signs, *self._finder.finish(end_ns)])
        insert("signs", ((None, sign.t_ns, dump_sign(sign)) for sign in signs))
        gaps = noted_gaps(self._noted, end_ns) + restarts(events)
        gaps += file_gaps(self._recording, self._span_ns, self._damages)
        for bus in self._traffic.values():
            gaps += bus.silences(self._recorded_ns[1])
        gaps.sort(key=lambda gap: (gap.from_ns, gap.to_ns, gap.kind.value))
        insert("gaps", ((None, gap.from_ns, dump_gap(gap)) for gap in gaps))
        insert("objects", self._objects())

    def _objects(self) -> Iterator[tuple[Any, ...]]:
        for key, track in self._tracks.by_key.items():
            one = track.indexed(key)
            breaks = pack_arrays(np.array(track.breaks, np.uint64))
            yield one.number, dump_object(one), breaks, pack_history(track.history) if one.kept else None
