"""The state that a keyframe holds, changed: shifted in time, renamed buses, joined with that of other buses.

And what a recording had lost by then.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any, Final

from app.recording.cdr import NS
from app.recording.content import Event, EventKind, Keyframe
from app.recording.index.course import Course, restorable
from app.recording.reader import Recording

_TIMES_FROM: Final = 10**17
"""What a state holds as a number from here on is a time in ns since 1970; raw values are hexadecimal texts."""

_LOOK_BACK_NS: Final = 15 * NS


def shifted(state: Any, by_ns: int) -> Any:
    """The same with all times moved."""
    if isinstance(state, Mapping):
        return {key: shifted(value, by_ns) for key, value in state.items()}
    if isinstance(state, list):
        return [shifted(value, by_ns) for value in state]
    return state + by_ns if type(state) is int and state >= _TIMES_FROM else state


def renamed(state: Mapping[str, Any], buses: Mapping[str, str]) -> dict[str, Any]:
    """The same with other names of buses."""

    def name(entry: Mapping[str, Any]) -> dict[str, Any]:
        return {**entry, "bus": buses.get(entry["bus"], entry["bus"])}

    live = state["live"]
    live = {**live, "nodes": [name(node) for node in live["nodes"]], "events": [name(one) for one in live["events"]]}
    decoders = {buses.get(bus, bus): name(decoder) for bus, decoder in state["decoders"].items()}
    return {**state, "live": live, "decoders": decoders}


def without(state: Mapping[str, Any], buses: Collection[str]) -> dict[str, Any]:
    """The same without what was known of some buses."""
    live = state["live"]
    kept = {key: [one for one in live[key] if one["bus"] not in buses] for key in ("nodes", "events")}
    decoders = {bus: decoder for bus, decoder in state["decoders"].items() if bus not in buses}
    return {**state, "live": {**live, **kept}, "decoders": decoders}


class JoiningCourse(Course):
    """A course on which a state that is told replaces that of its own buses only."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a keyframe for its buses. Raises KeyError or ValueError on another state."""
        before, told = self.live.snapshot(), state["live"]
        others = [node for node in before["nodes"] if node["bus"] not in state["decoders"]]
        events = [event for event in before["events"] if event["bus"] not in state["decoders"]]
        joined = {
            **told,
            "t_ns": max(before["t_ns"], told["t_ns"]),
            "nodes": [*others, *told["nodes"]],
            "events": sorted([*events, *told["events"]], key=lambda event: event["t_ns"]),
        }
        super().restore({**state, "live": joined})


def first_state(recording: Recording) -> tuple[int, Mapping[str, Any]] | None:
    """Time and state of the first keyframe, where there is one that can be gone on from."""
    keyframe = next(recording.keyframes(), None)
    return None if keyframe is None or not restorable(keyframe.state) else (keyframe.t_ns, keyframe.state)


def state_before(recording: Recording, t_ns: int) -> Keyframe | None:
    """The last keyframe up to ``t_ns`` that can be gone on from; they come every few seconds."""
    for back_ns in (_LOOK_BACK_NS, t_ns):
        found: list[Keyframe] = list(recording.keyframes(max(t_ns - back_ns, 0), t_ns + 1))
        usable: Keyframe | None = next((one for one in reversed(found) if restorable(one.state)), None)
        if usable is not None:
            return usable
    return None


def lost_until(recording: Recording, end_ns: int | None = None) -> int:
    """Frames that the recording had lost before ``end_ns`` (None: at the end of the file).

    By its totals, which count the parts before as well; a file without them, which was not closed, has but its events.
    """
    totals = recording.totals
    if totals is None:
        return lost_by(recording.events(None, end_ns))
    later = 0 if end_ns is None else lost_by(recording.events(end_ns, None))
    return max(totals.lost - later, 0)


def lost_by(events: Iterable[Event]) -> int:
    """Frames that were lost by what the events tell; a count that is no number tells nothing."""
    counts = (event.details.get("count") for event in events if event.kind is EventKind.FRAMES_LOST)
    return sum(count for count in counts if type(count) is int and count > 0)
