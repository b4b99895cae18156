"""The course of a recording: how frames, noted events and time act on decoders and live state, as they did live.

One order for all who read a recording: the builder of the index, a seek, a replay. Frames up to a time come first, then
what was noted at it, then the look at the clock (``LiveState.tick``), every 100 ms on a fixed grid. So a state restored
from a keyframe and fed from there is the one that reading from the beginning gives.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from typing import Any, Final, NamedTuple, TypeVar

from app.errors import HubsideError
from app.model.description import Bus, Description
from app.recording.content import Event, EventKind, Keyframe
from app.recording.index.content import Gap
from app.recording.node_table import OrderTable, ServerTable
from app.wire.decoders import decoder_of, decoder_of_frame, decoder_of_state
from app.wire.frame import Frame
from app.wire.live import LiveState
from app.wire.records import Record

_BUS: Final = attrgetter("bus")
_Told = TypeVar("_Told")
Descriptions = Mapping[tuple[str, int], Description]

TICK_NS: Final = 100_000_000
QUIET_NS: Final = 120_000_000_000
"""So long after the last frame every tick counts, beyond only the last: every heartbeat is overdue by then."""
GAP_REASONS: Final = {
    EventKind.BUS_LOST: "gap.bus_lost",
    EventKind.BUS_BACK: "gap.bus_lost",
    EventKind.GAP: "gap.bus_lost",
    EventKind.FRAMES_LOST: "gap.frames_lost",
}
DAMAGE_REASON: Final = "gap.damage"


class Mark(NamedTuple):
    """Something that acts at ``t_ns``, behind all frames up to then.

    Frames are missing (``reason`` is a text key; ``bus`` empty: on all buses), or the file says the whole ``state``: at
    the beginning of a part, which knows no frames of the parts before it.
    """

    t_ns: int
    bus: str
    reason: str
    state: Mapping[str, Any] | None = None


class Step(NamedTuple):
    """Frames since the step before, up to ``t_ns``; then a mark, or a look at the clock."""

    t_ns: int
    frames: list[Frame]
    mark: Mark | None
    tick: bool


class Course:
    """Decoders and live state of a recording, led from step to step. Not thread-safe, but ``live`` may be read."""

    def __init__(
        self,
        buses: Iterable[str],
        descriptions: Descriptions,
        max_events: int = 2000,
        servers: ServerTable | None = None,
        kinds: Mapping[str, Bus] | None = None,
        orders: OrderTable | None = None,
    ) -> None:
        """``kinds`` is what is spoken on buses of which no device is described."""
        at, spoken = servers or {}, kinds or {}
        self.live = LiveState(max_events)
        self.heard_ns = 0
        """Time of the last frame."""
        self.decoders = {
            bus: decoder_of(bus, _on(bus, descriptions), _on(bus, at) or None, spoken.get(bus), _on(bus, orders or {}))
            for bus in sorted({*buses, *(bus for bus, _ in descriptions), *(bus for bus, _ in at)})
        }
        for (bus, node), description in descriptions.items():
            self.live.set_description(bus, node, description)

    def decode(self, frames: Sequence[Frame]) -> list[Record]:
        """Decode frames of any bus in their order, and apply what they say."""
        if not frames:
            return []
        records: list[Record] = []
        for bus, batch in groupby(frames, key=_BUS):
            of_bus = list(batch)
            decoder = self.decoders.get(bus)
            if decoder is None:
                decoder = self.decoders[bus] = decoder_of_frame(of_bus[0])
            records += decoder.feed_all(of_bus)
        self.live.apply_all(records)
        self.heard_ns = frames[-1].t_ns
        return records

    def mark(self, mark: Mark) -> list[Record]:
        """Frames are missing, or the state is told."""
        if mark.state is not None:
            self.restore(mark.state)
            return []
        records: list[Record] = []
        for bus, decoder in self.decoders.items():
            if mark.bus in ("", bus):
                records += decoder.gap(mark.t_ns, mark.reason)
        self.live.apply_all(records)
        return records

    def take(self, step: Step) -> list[Record]:
        """One step; the records that came of it."""
        records = self.decode(step.frames)
        if step.mark is not None:
            records += self.mark(step.mark)
        if step.tick:
            self.live.tick(step.t_ns)
        return records

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state of a keyframe."""
        return {
            "live": self.live.snapshot(),
            "decoders": {bus: decoder.snapshot() for bus, decoder in self.decoders.items()},
            "heard_ns": self.heard_ns,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a keyframe, of an index or of the recorder. Raises KeyError or ValueError on another state."""
        self.live.restore(state["live"])
        for bus, kept in state["decoders"].items():
            if bus not in self.decoders:
                self.decoders[bus] = decoder_of_state(bus, kept)
            self.decoders[bus].restore(kept)
        self.heard_ns = state.get("heard_ns", self.live.t_ns)


def _on(bus: str, table: Mapping[tuple[str, int], _Told]) -> dict[int, _Told]:
    return {node: told for (name, node), told in table.items() if name == bus}


def steps(frames: Iterable[Frame], marks: Sequence[Mark], heard_ns: int, start_ns: int, end_ns: int) -> Iterator[Step]:
    """The steps behind ``start_ns`` up to ``end_ns``.

    ``frames`` and ``marks`` are those in between by time, ``heard_ns`` is the time of the last frame before.
    """
    walk = _Walk(marks, heard_ns, start_ns)
    for frame in frames:
        t_ns = frame.t_ns
        if t_ns > walk.due_ns:
            yield from walk.up_to(t_ns - 1)
        walk.batch.append(frame)
        walk.heard_ns = t_ns
    yield from walk.up_to(end_ns)
    if walk.batch:
        yield Step(end_ns, walk.batch, None, tick=False)


class _Walk:
    """Where the steps end: at marks and on the grid of ticks, whichever comes next."""

    def __init__(self, marks: Sequence[Mark], heard_ns: int, start_ns: int) -> None:
        self.batch: list[Frame] = []
        self.heard_ns = heard_ns
        self._marks = [mark for mark in reversed(marks) if mark.t_ns > start_ns]
        self._tick_ns = (start_ns // TICK_NS + 1) * TICK_NS
        self.due_ns = self._due()

    def _due(self) -> int:
        return min(self._tick_ns, self._marks[-1].t_ns) if self._marks else self._tick_ns

    def up_to(self, t_ns: int) -> Iterator[Step]:
        while self.due_ns <= t_ns:
            batch, self.batch = self.batch, []
            if self._marks and self._marks[-1].t_ns <= self._tick_ns:
                mark = self._marks.pop()
                yield Step(mark.t_ns, batch, mark, tick=False)
            else:
                tick_ns = self._tick_ns
                self._tick_ns += TICK_NS
                if tick_ns > self.heard_ns + QUIET_NS:
                    self._tick_ns = max(self._tick_ns, t_ns // TICK_NS * TICK_NS)
                yield Step(tick_ns, batch, None, tick=True)
            self.due_ns = self._due()


def marks_of(
    events: Iterable[Event], keyframe: Keyframe | None, start_ns: int, end_ns: int, damages: Iterable[Gap] = ()
) -> list[Mark]:
    """The marks of a file: what its recorder noted, its first ``keyframe`` if one can go on from it, and damages."""
    marks = [Mark(gap.to_ns, gap.bus, DAMAGE_REASON) for gap in damages]
    for event in events:
        reason = GAP_REASONS.get(event.kind)
        if reason is not None:
            marks.append(Mark(min(max(event.t_ns, start_ns), end_ns), event.bus, reason))
    if keyframe is not None and start_ns <= keyframe.t_ns <= end_ns and restorable(keyframe.state):
        marks.append(Mark(keyframe.t_ns, "", "", keyframe.state))
    return sorted(marks, key=lambda mark: mark.t_ns)


def restorable(state: Mapping[str, Any]) -> bool:
    """Whether one can go on from the state of a keyframe: that of another program may be of another kind."""
    try:
        Course((), {}).restore(state)
    except (KeyError, ValueError, TypeError, AttributeError, IndexError, HubsideError):
        return False
    return True
