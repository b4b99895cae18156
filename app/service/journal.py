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
    DISCONNECTED = "disconnected"
    BUS_LOST = "bus_lost"
    BUS_BACK = "bus_back"
    OTHER_MASTER = "other_master"
    CONSENT = "consent"
    RECORDING_STARTED = "recording_started"
    RECORDING_STOPPED = "recording_stopped"
    RECORDING_LOST = "recording_lost"
    WRITTEN = "written"
    WRITE_FAILED = "write_failed"
    SAVED = "saved"
    SAVED_PART = "saved_part"
    SAVE_REFUSED = "save_refused"
    SAVE_PROVEN = "save_proven"
    SAVE_NOT_PROVEN = "save_not_proven"
    RESTART = "restart"
    STOP_SENT = "stop_sent"
    FEATHER_SENT = "feather_sent"
    FOREIGN_WRITTEN = "foreign_written"
    STORE_FAILED = "store_failed"
    STORE_BACK = "store_back"
    SETTINGS_CHANGED = "settings_changed"
    FAULT_SET = "fault_set"
    FAULT_SEEN = "fault_seen"
    FAULT_CLEARED = "fault_cleared"
    FAULT_ENDED = "fault_ended"
    SCENARIO_STARTED = "scenario_started"
    SCENARIO_STOPPED = "scenario_stopped"
    SCENARIO_ENDED = "scenario_ended"
    NMT_SENT = "nmt_sent"
    LEASE_TAKEN = "lease_taken"
    LEASE_ENDED = "lease_ended"
    MOTION_PREPARED = "motion_prepared"
    MOTION_UNWATCHED = "motion_unwatched"
    EXTERNAL_STOP = "external_stop"
    MOTION_LOST = "motion_lost"
    MOTION_PUT_BACK = "motion_put_back"
    MOTION_BEGUN = "motion_begun"
    MOTION_ENDED = "motion_ended"
    MOTION_STOPPED = "motion_stopped"
    FAULT_RESET = "fault_reset"
    HOMED = "homed"
    HOME_FOUND = "home_found"
    INCIDENT_MADE = "incident_made"
    SCOPE_ARMED = "scope_armed"
    SCOPE_CAPTURED = "scope_captured"
    RESTORE_BEGUN = "restore_begun"
    RESTORE_CONFIRMED = "restore_confirmed"
    RESTORE_TURNED_BACK = "restore_turned_back"
    RESTORE_RESUMED = "restore_resumed"
    RESTORE_UNPROVEN = "restore_unproven"
    RESTORE_DONE = "restore_done"
    RESTORE_ROLLED_BACK = "restore_rolled_back"
    RESTORE_INCOMPLETE = "restore_incomplete"
    RESTORE_GIVEN_UP = "restore_given_up"
    PDO_CHANGED = "pdo_changed"
    PDO_PUT_BACK = "pdo_put_back"
    PDO_ROLLED_BACK = "pdo_rolled_back"
    PDO_BROKEN = "pdo_broken"
    BATTERY_TEST_BEGUN = "battery_test_begun"
    BATTERY_TEST_ENDED = "battery_test_ended"
    BATTERY_CHANGED = "battery_changed"
    VERIFIED = "verified"

    @property
    def severity(self) -> Severity:
        """Errors are what was lost or failed; a warning changes what the tool may do."""
        if self in _ERRORS:
            return Severity.ERROR
        return Severity.WARNING if self in _WARNINGS else Severity.INFO

    @property
    def has_doer(self) -> bool:
        """True for what a person did; false for what became of bus, recording and store meanwhile."""
        return self in _DONE


_ERRORS: Final = (
    Kind.BUS_LOST,
    Kind.MOTION_LOST,
    Kind.WRITE_FAILED,
    Kind.SAVE_REFUSED,
    Kind.SAVE_NOT_PROVEN,
    Kind.RECORDING_LOST,
    Kind.STORE_FAILED,
    Kind.RESTORE_INCOMPLETE,
    Kind.PDO_BROKEN,
)
_WARNINGS: Final = (
    Kind.MOTION_STOPPED,
    Kind.MOTION_BEGUN,
    Kind.MOTION_UNWATCHED,
    Kind.EXTERNAL_STOP,
    Kind.NMT_SENT,
    Kind.RESTORE_BEGUN,
    Kind.RESTORE_TURNED_BACK,
    Kind.RESTORE_RESUMED,
    Kind.RESTORE_UNPROVEN,
    Kind.RESTORE_ROLLED_BACK,
    Kind.RESTORE_GIVEN_UP,
    Kind.PDO_CHANGED,
    Kind.PDO_PUT_BACK,
    Kind.PDO_ROLLED_BACK,
    Kind.OTHER_MASTER,
    Kind.CONSENT,
    Kind.RECORDING_STOPPED,
    Kind.STOP_SENT,
    Kind.FEATHER_SENT,
    Kind.FOREIGN_WRITTEN,
    Kind.FAULT_SET,
    Kind.FAULT_SEEN,
    Kind.SCENARIO_STARTED,
    Kind.BATTERY_TEST_BEGUN,
)
_DONE: Final = (
    Kind.NMT_SENT,
    Kind.LEASE_TAKEN,
    Kind.MOTION_PREPARED,
    Kind.MOTION_UNWATCHED,
    Kind.EXTERNAL_STOP,
    Kind.MOTION_PUT_BACK,
    Kind.MOTION_BEGUN,
    Kind.FAULT_RESET,
    Kind.HOMED,
    Kind.HOME_FOUND,
    Kind.INCIDENT_MADE,
    Kind.SCOPE_ARMED,
    Kind.RESTORE_BEGUN,
    Kind.RESTORE_CONFIRMED,
    Kind.RESTORE_TURNED_BACK,
    Kind.RESTORE_RESUMED,
    Kind.RESTORE_GIVEN_UP,
    Kind.PDO_CHANGED,
    Kind.PDO_PUT_BACK,
    Kind.PDO_ROLLED_BACK,
    Kind.PDO_BROKEN,
    Kind.CONNECTED,
    Kind.DISCONNECTED,
    Kind.CONSENT,
    Kind.WRITTEN,
    Kind.WRITE_FAILED,
    Kind.SAVED,
    Kind.SAVED_PART,
    Kind.SAVE_REFUSED,
    Kind.RESTART,
    Kind.STOP_SENT,
    Kind.FEATHER_SENT,
    Kind.SETTINGS_CHANGED,
    Kind.FAULT_SET,
    Kind.FAULT_CLEARED,
    Kind.SCENARIO_STARTED,
    Kind.SCENARIO_STOPPED,
    Kind.BATTERY_TEST_BEGUN,
    Kind.BATTERY_CHANGED,
    Kind.VERIFIED,
)


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


class _Pages:
    """What all hands of one journal share."""

    def __init__(self) -> None:
        self.entries: deque[Entry] = deque(maxlen=KEPT)
        self.listeners: list[Callable[[Entry], None]] = []
        self.lock = Lock()


class Journal:
    """Keeps the latest events and tells listeners; safe from any thread. ``stamp`` gives t_ns.

    What is noted bears the name of ``person``; ``by`` gives the same journal in the hands of another person.
    """

    def __init__(self, stamp: Callable[[], int], person: str, pages: _Pages | None = None) -> None:
        self._stamp = stamp
        self._person = person
        self._pages = pages or _Pages()

    @property
    def person(self) -> str:
        """Whose name it bears."""
        return self._person

    def by(self, person: str) -> Journal:
        """The same journal, written by ``person``."""
        return Journal(self._stamp, person, self._pages)

    def note(self, kind: Kind, device: str | None = None, /, **details: Any) -> None:
        """Add an event and tell everybody who listens."""
        entry = Entry(self._stamp(), kind, device, self._person, details)
        pages = self._pages
        with pages.lock:
            pages.entries.append(entry)
            listeners = tuple(pages.listeners)
        for listener in listeners:
            listener(entry)

    def listen(self, listener: Callable[[Entry], None]) -> Callable[[], None]:
        """Have ``listener`` called with every new event; the returned function ends that."""
        pages = self._pages
        with pages.lock:
            pages.listeners.append(listener)

        def end() -> None:
            with pages.lock:
                if listener in pages.listeners:
                    pages.listeners.remove(listener)

        return end

    def latest(self) -> list[Entry]:
        """The events kept, oldest first."""
        with self._pages.lock:
            return list(self._pages.entries)
