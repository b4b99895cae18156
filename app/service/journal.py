"""What was done and what happened, as events for the page and the recording: who did what, when, to which device."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from threading import Lock
from typing import Any, Final

from app.wire.events import Severity

KEPT: Final = 2000


class Kind(Enum):
    """What an event is about; the value is the end of its text key ``journal.…``."""

    CONNECTED = "connected"
    BUS_LOST = "bus_lost"
    BUS_BACK = "bus_back"
    OTHER_MASTER = "other_master"
    RECORDING_STARTED = "recording_started"
    RECORDING_STOPPED = "recording_stopped"
    RECORDING_LOST = "recording_lost"
    WRITTEN = "written"
    WRITE_FAILED = "write_failed"
    SAVED = "saved"
    RESTART = "restart"
    STOP_SENT = "stop_sent"
    FEATHER_SENT = "feather_sent"

    @property
    def severity(self) -> Severity:
        """Errors are what was lost or failed; a warning changes what the tool may do."""
        if self in (Kind.BUS_LOST, Kind.WRITE_FAILED, Kind.RECORDING_LOST):
            return Severity.ERROR
        if self in (Kind.OTHER_MASTER, Kind.RECORDING_STOPPED, Kind.STOP_SENT, Kind.FEATHER_SENT):
            return Severity.WARNING
        return Severity.INFO


@dataclass(frozen=True, slots=True)
class Entry:
    """One event. ``device`` is a slug, or None where it is about the whole connection."""

    t_ns: int
    kind: Kind
    device: str | None
    person: str
    details: Mapping[str, Any]

    @property
    def text_key(self) -> str:
        """Key of its text."""
        return f"journal.{self.kind.value}"


class Journal:
    """Keeps the latest events and tells listeners; safe from any thread. ``stamp`` gives t_ns."""

    def __init__(self, stamp: Callable[[], int], person: str) -> None:
        self._stamp = stamp
        self._person = person
        self._entries: deque[Entry] = deque(maxlen=KEPT)
        self._listeners: list[Callable[[Entry], None]] = []
        self._lock = Lock()

    def note(self, kind: Kind, device: str | None = None, /, **details: Any) -> None:
        """Add an event and tell everybody who listens."""
        entry = Entry(self._stamp(), kind, device, self._person, details)
        with self._lock:
            self._entries.append(entry)
            listeners = tuple(self._listeners)
        for listener in listeners:
            listener(entry)

    def listen(self, listener: Callable[[Entry], None]) -> Callable[[], None]:
        """Have ``listener`` called with every new event; the returned function ends that."""
        with self._lock:
            self._listeners.append(listener)

        def end() -> None:
            with self._lock:
                if listener in self._listeners:
                    self._listeners.remove(listener)

        return end

    def latest(self) -> list[Entry]:
        """The events kept, oldest first."""
        with self._lock:
            return list(self._entries)
