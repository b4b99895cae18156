"""The recording of a connection: every frame, the journal's events, keyframes, descriptions and parameter sets."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from app import __version__
from app.model.description import Description
from app.model.od_export import to_json
from app.model.sets import ParameterSet, dump_set
from app.recording.content import AttachedFile, EventKind, RecorderClock, RecordingInfo
from app.recording.writer import BlockReason, Recorder, RecorderStatus
from app.service.indexing import PartWatch
from app.service.journal import Entry, Journal, Kind

JSON: Final = "application/json"
_KINDS: Final = {
    Kind.BUS_LOST: EventKind.BUS_LOST,
    Kind.BUS_BACK: EventKind.BUS_BACK,
    Kind.WRITTEN: EventKind.WRITE,
    Kind.WRITE_FAILED: EventKind.WRITE,
}


@dataclass(frozen=True, slots=True)
class Subject:
    """What is recorded. ``nodes`` maps ``can0/11`` to slug and description; ``servers`` a node to ``host:port``.

    ``protocols`` and ``orders`` as in ``RecordingInfo``.
    """

    turbine: str
    person: str
    bit_rates: Mapping[str, int]
    nodes: Mapping[str, str]
    descriptions: Iterable[Description]
    servers: Mapping[str, str] = field(default_factory=dict)
    protocols: Mapping[str, str] = field(default_factory=dict)
    orders: Mapping[str, str] = field(default_factory=dict)


class Recording:
    """A recorder with the journal's events in it. ``closed`` hears of files that are complete."""

    def __init__(
        self,
        folder: Path,
        subject: Subject,
        journal: Journal,
        clock: RecorderClock,
        closed: Callable[[Path], object] | None = None,
    ) -> None:
        info = RecordingInfo(
            turbine=subject.turbine,
            who=subject.person,
            bit_rates=dict(subject.bit_rates),
            nodes=dict(subject.nodes),
            servers=dict(subject.servers),
            protocols=dict(subject.protocols),
            orders=dict(subject.orders),
            versions={"hubside": __version__, "python": platform.python_version()},
        )
        attached = [
            AttachedFile(f"descriptions/{one.id}.json", JSON, to_json(one).encode()) for one in subject.descriptions
        ]
        self.recorder = Recorder(folder, info, clock, attached)
        self._journal = journal
        self._parts = PartWatch(closed)
        self._lost = 0
        self._reason: BlockReason | None = None
        self._stop_listening = journal.listen(self._note)
        journal.note(Kind.RECORDING_STARTED, None, file=str(self.recorder.status().file))

    def status(self) -> RecorderStatus:
        """What the recorder does, as of now."""
        return self.recorder.status()

    def watch(self, state: Callable[[], tuple[int, Mapping[str, Any]]]) -> None:
        """Call a few times a second: tells losses once, a stop and its end, and notes a keyframe where one is due.

        ``state`` gives the time of the last frame that it holds, and the state.
        """
        status = self.recorder.status()
        self._parts.look(status.file)
        self._tell(status)
        if self.recorder.keyframe_due():
            t_ns, now = state()
            self.recorder.keyframe(now, t_ns)

    def _tell(self, status: RecorderStatus) -> None:
        if status.reason is not self._reason:
            self._reason = status.reason
            if status.reason is None:
                self._journal.note(Kind.RECORDING_STARTED, None, file=str(status.file))
            else:
                self._journal.note(Kind.RECORDING_STOPPED, None, reason_key=f"recording_stopped.{status.reason.value}")
        if status.lost > self._lost:
            self._journal.note(Kind.RECORDING_LOST, None, count=status.lost - self._lost)
            self._lost = status.lost

    def attach_set(self, parameters: ParameterSet) -> None:
        """Put a parameter set into the recording."""
        name = f"sets/{parameters.origin.device}.json"
        self.recorder.attach(name, JSON, dump_set(parameters).encode())

    def stop(self, timeout_s: float = 10.0) -> None:
        """Write what is pending and finish the file."""
        self._stop_listening()
        self._parts.look(self.recorder.close(timeout_s).file)
        self._parts.look(None)

    def _note(self, entry: Entry) -> None:
        details = {key: str(value) for key, value in entry.details.items() if key != "bus"}
        who = {"device": entry.device, "person": entry.person, "text_key": entry.text_key}
        kind = _KINDS.get(entry.kind, EventKind.NOTE)
        self.recorder.event(kind, str(entry.details.get("bus", "")), entry.t_ns, **who, **details)
